//! Small programs that teach. Firmware for real boards is in `firmware/`, each image a workspace of its own.
#![no_std]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(test)]
extern crate std;

pub mod simulated_uart;
