//! All tests of both ends, in one binary.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "tests"
)]
#![allow(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used, reason = "tests")]
#![allow(clippy::missing_docs_in_private_items, missing_docs, unreachable_pub, dead_code, reason = "tests")]

mod attacks;
mod bench;
mod blocks;
mod both_ends;
mod laws;
#[cfg(feature = "serde")]
mod serde;
mod values;
