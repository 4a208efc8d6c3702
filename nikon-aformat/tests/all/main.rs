//! All tests of both ends, in one binary.
#![allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation, clippy::indexing_slicing, reason = "tests")]
#![allow(clippy::panic, clippy::unnecessary_wraps, clippy::unwrap_used, clippy::std_instead_of_core, reason = "tests")]
#![allow(missing_docs, unreachable_pub, dead_code, reason = "tests")]

mod attacks;
mod both_ends;
mod chances;
mod common;
mod device;
mod hostile;
mod hostile_line;
mod hostile_procedures;
mod noisy_bus;
mod procedures;
mod remains;
#[cfg(feature = "serde")]
mod serde;
mod transactions;
mod values;
