#![doc = include_str!("../README.md")]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::std_instead_of_core
)]

pub mod bundled;
pub mod capture;
pub mod cli;
pub mod cnc;
mod decode;
pub mod event;
pub mod fault;
mod gcode;
pub mod line;
pub mod output;
pub mod profile;
pub mod protocols;
pub mod registers;
pub mod talk;
pub mod timing;
