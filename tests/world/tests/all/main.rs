//! The world itself: what it carries, what it hurts, what it remembers.

#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::expect_used,
    clippy::identity_op,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used
)]

mod facts;
