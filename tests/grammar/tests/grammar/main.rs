//! Holds the protocol crates to one grammar: the programs of `programs.rs`, pasted for each of them, and the table of
//! CONTRIBUTING, which follows from the same lines.
#![allow(missing_docs, unused_macros, clippy::missing_panics_doc, clippy::panic, clippy::unwrap_used)]

#[macro_use]
mod programs;

mod hdsl;
mod nikon;
mod rtex;
mod sorte;
mod table;
mod tformat;
