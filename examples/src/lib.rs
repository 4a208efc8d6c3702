//! Driver sketches over the embedded traits: what a firmware writes around the protocol crates.
//!
//! They are generic over the traits of `embedded-hal` and `embedded-io`, run on a host against the simulated devices of
//! the protocol crates, and are meant to be copied and cut to the board.
#![no_std]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(test)]
extern crate std;

pub mod simulated_uart;
pub mod tformat_uart;
