#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| servowire_fuzz::c::codecs::codecs(data));
