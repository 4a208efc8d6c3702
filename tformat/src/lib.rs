#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

pub mod clb;
mod control;
mod crc;
pub mod device;
mod error;
mod frame;
pub mod inspect;
pub mod master;
mod profile;
mod request;
mod response;
pub mod spi;
mod status;
pub mod stream;
mod timing;
mod vendor;

pub use control::{ControlField, DataId};
pub use crc::crc;
pub use error::{Error, ErrorClass};
pub use frame::Frame;
pub use nrz_line::{BitOrder, TooWide, Window};
pub use profile::{Hint, Position, Profile, WidthError};
pub use request::{Address, Adf, NotAnAddress, Request};
pub use response::{EncoderId, Full, Memory, MultiTurn, Response, SingleTurn};
pub use status::{Alarm, Almc, StatusField};
pub use timing::{BitRate, RESPONSE_DELAY_NS};
pub use vendor::VendorCommand;

/// A 24-bit data field: ABS (single-turn) or ABM (multi-turn) as it comes, low byte first on the line.
pub type U24 = nrz_line::Unsigned<24>;
