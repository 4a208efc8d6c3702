#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod crc;
mod error;
mod frame;
pub mod stream;

pub use crc::crc8;
pub use error::{Error, ErrorClass};
pub use frame::{Frame, HEADER, LEN};
