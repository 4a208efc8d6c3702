//! Random captures of servo lines, and what is due of them.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unnecessary_wraps,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]
#![allow(dead_code, unreachable_pub, reason = "a module of several programs, each using a part of it")]

pub mod dsl;
pub mod judge;
pub mod rng;
pub mod speech;
pub mod table;
pub mod wire;
