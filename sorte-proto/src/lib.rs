#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod error;
mod payload;
mod pto;

pub use error::{Error, ErrorClass};
pub use payload::{MotorMask, Payload, Slice};
pub use pto::{Direction, Pto, Reserved, StartTime};
