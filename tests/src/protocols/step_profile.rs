//! step-profile: step times, tables, whole moves.

mod core;
mod moves;
mod tables;
mod words;

use crate::row::Check;

pub(super) const TOPICS: &[(&str, Check)] = &[
    ("cycle_stream", moves::cycle_stream),
    ("microstep", tables::microstep),
    ("params", tables::params),
    ("payload", words::payload),
    ("profile", moves::profile),
    ("profile_alt_table", moves::profile_alt_table),
    ("profile_inexact", moves::profile_inexact),
    ("pru_step_core_words", core::words),
    ("pto_word", words::pto_word),
    ("ramp_table", tables::ramp_table),
    ("speed_const", tables::speed_const),
    ("step_trace", core::step_trace),
    ("step_trace_edge", core::step_trace),
    ("tones", tables::tones),
];
