//! What the fuzz targets do: each takes any bytes and panics when a law is broken.
//!
//! The bodies are ordinary functions that build on stable, so that the tests of the workspace replay the corpora;
//! `fuzz_targets/` hands them to the fuzzer. A new target is a function in the file of its protocol, a line in
//! [`TARGETS`], a file in `fuzz_targets/` and its `[[bin]]`, and seeds from `examples/seed_corpus.rs`.

pub mod c;
pub mod capture;
pub mod hdsl;
pub mod nikon;
pub mod nrz_line;
pub mod rtex;
pub mod sorte;
pub mod step_motion;
pub mod step_profile;
pub mod tformat;

/// A target.
pub type Target = fn(&[u8]);

/// All targets by name.
pub const TARGETS: &[(&str, Target)] = &[
    ("c_codecs", c::codecs::codecs),
    ("c_tformat", c::tformat),
    ("capture_vcd", capture::vcd),
    ("capture_table", capture::table),
    ("capture_analyzer", capture::analyzer),
    ("capture_isf", capture::isf),
    ("capture_any", capture::any),
    ("capture_saleae", capture::saleae),
    ("capture_session", capture::session),
    ("capture_fst", capture::fst),
    ("capture_sigrok_text", capture::sigrok_text),
    ("capture_ols", capture::ols),
    ("capture_raw", capture::raw),
    ("capture_packed", capture::packed),
    ("capture_hex", capture::hex),
    ("capture_records", capture::records),
    ("capture_packets", capture::packets),
    ("capture_survey", capture::survey),
    ("hdsl_symbol", hdsl::symbol),
    ("hdsl_answer", hdsl::answer),
    ("hdsl_head", hdsl::head),
    ("hdsl_message", hdsl::message),
    ("hdsl_learn", hdsl::learn),
    ("hdsl_position", hdsl::position),
    ("hdsl_master", hdsl::master),
    ("hdsl_link", hdsl::link),
    ("nikon_request", nikon::request),
    ("nikon_reply", nikon::reply),
    ("nikon_reception", nikon::reception),
    ("nikon_master", nikon::master),
    ("nikon_device", nikon::device),
    ("nikon_inspect", nikon::inspect),
    ("nikon_world", nikon::world::hostile),
    ("nrz_receiver", nrz_line::receiver),
    ("rtex_block", rtex::block),
    ("rtex_drive", rtex::drive),
    ("rtex_log", rtex::log),
    ("rtex_ring", rtex::ring),
    ("sorte_frame", sorte::frame),
    ("sorte_cut_through", sorte::cut_through),
    ("sorte_device", sorte::device),
    ("sorte_sync0", sorte::sync0),
    ("step_motion_plan", step_motion::plan),
    ("step_motion_path", step_motion::path),
    ("step_motion_axis", step_motion::axis),
    ("step_motion_axes", step_motion::axes),
    ("step_profile_step", step_profile::step),
    ("step_profile_axis", step_profile::axis),
    ("tformat_request", tformat::request),
    ("tformat_response", tformat::response),
    ("tformat_differential", tformat::differential),
    ("tformat_stream", tformat::stream),
    ("tformat_master", tformat::ends::master),
    ("tformat_device", tformat::ends::device),
    ("tformat_inspect", tformat::ends::inspect),
    ("tformat_world", tformat::world::hostile),
];

/// Takes a byte off the front; 0 when none is left.
fn byte(data: &mut &[u8]) -> u8 {
    let Some((first, rest)) = data.split_first() else { return 0 };
    *data = rest;
    *first
}

/// Takes four bytes off the front, low byte first.
fn word(data: &mut &[u8]) -> u32 {
    u32::from_le_bytes([byte(data), byte(data), byte(data), byte(data)])
}
