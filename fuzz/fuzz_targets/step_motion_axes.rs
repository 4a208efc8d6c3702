#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| servowire_fuzz::step_motion::axes(data));
