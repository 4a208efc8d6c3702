#![doc = include_str!("../README.md")]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::std_instead_of_core
)]

pub mod cli;
mod clip;
pub mod cnc;
mod decode;
mod drawing;
mod explain;
mod files;
mod gcode;
mod interrupt;
mod live;
mod overwrite;
mod picture;
mod pipe;
pub mod profile;
mod reading;
pub mod registers;
mod report;
mod scope;
mod serial;
pub mod talk;
mod terminal;
pub mod timing;
mod units;
