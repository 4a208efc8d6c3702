//! Holds the protocol crates to one grammar: the programs of `programs.rs`, pasted for each of them, and the table of
//! CONTRIBUTING, which follows from the same lines; and all libraries to what a public signature must not have.
#![allow(clippy::arithmetic_side_effects, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

#[macro_use]
mod programs;

mod error_numbers;
mod hdsl;
mod nikon;
mod rtex;
mod sorte;
mod surface;
mod table;
mod tformat;
