#![doc = include_str!("../README.md")]
//!
//! [`Hints::guard`]: capture::Hints::guard
//! [`Settings`]: settings::Settings
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::std_instead_of_core
)]

mod bundled;
pub mod capture;
pub mod codec;
mod decode;
pub mod event;
pub mod fault;
pub mod line;
mod log;
pub mod output;
pub mod protocols;
pub mod recognition;
pub mod settings;
pub mod sink;
pub mod time;

pub use decode::decode;
