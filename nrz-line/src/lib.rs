#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod cause;
mod format;
mod order;
mod receiver;
mod samples;
mod wave;
mod window;

pub use cause::{Cause, Found, Search};
pub use format::{Format, FormatError};
pub use order::BitOrder;
pub use receiver::{Field, Receiver};
pub use samples::Samples;
pub use wave::Wave;
pub use window::{OutOfBounds, Window};
