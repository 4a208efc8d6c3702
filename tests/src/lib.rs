//! Runs reference vectors (JSON Lines) against the crates of the family.
//!
//! A *protocol* is a folder of vector files, a *topic* is one file: `tformat/requests.jsonl` holds the topic
//! `requests` of T-Format. What a row means is said in `tests/vectors/README.md`; how it is checked, in one
//! file per protocol under `protocols/`. Rows are read into structs that refuse unknown keys, so a key that
//! nobody looks at is a failure and not a silent pass.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::needless_pass_by_value,
    clippy::std_instead_of_core
)]

mod hex;
mod protocols;
mod pru;
mod row;
mod runner;

pub use runner::{Failure, Report, RunError, Topic, run_all, run_protocol};
