//! All tests of the crate through its public interface, in one binary.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    missing_docs
)]

mod again;
mod alarms;
mod answers;
mod caller;
mod common;
mod drive;
mod drive_bytes;
mod endings;
mod fresh;
mod gaps;
mod hostile;
mod impolite;
mod laws;
mod log;
mod master;
mod one_block;
mod places_in_time;
mod procedures;
mod refusals;
mod ring;
mod run_cut;
mod runner;
#[cfg(feature = "serde")]
mod serde;
mod setpoints;
mod shape;
mod steps;
mod stops;
