//! The crate from outside.
#![allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation, reason = "a test may")]

mod time;
