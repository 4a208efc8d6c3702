//! The drive's side: what a simulator or a test bench runs.
//!
//! [`Drive`] answers commands block by block and moves a simple axis; up to 32 of them make a ring. [`check`] is the part of it
//! that checks header, codes and sub block, for use on its own.

mod behaviour;
mod check;
mod config;
mod drive;
mod fault;
mod literals;
mod motion;
mod parameters;
mod profile;
mod wire;

pub use behaviour::{Behaviour, Quirks};
pub use check::{Verdict, check};
pub use config::{DriveConfig, OpenCodes};
pub use drive::Drive;
pub use fault::Fault;
