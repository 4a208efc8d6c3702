#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod abs40;
pub mod bus;
mod command;
mod crc;
pub mod device;
mod error;
mod expected;
mod frame;
pub mod inspect;
mod layout;
pub mod master;
mod number;
mod profile;
pub mod reception;
mod reply;
mod request;
mod response;
mod status;
pub mod stream;
mod temperature;
mod timing;

pub use abs40::Abs40;
pub use command::{Command, Version};
pub use crc::{Crc3, Crc8, crc3, crc8};
pub use error::{EchoField, Error, ErrorClass};
pub use expected::{Echo, Expected};
pub use frame::{FRAME_BITS, FrameCode, RequestFrame};
pub use layout::Layout;
pub use nrz_line::{BitOrder, Window};
pub use nrz_line::{TooWide, Unsigned};
pub use number::{EncoderAddress, U10, U17, U19, U24, U40, UserAddress};
pub use profile::{Battery, Multiturn, Position, Profile, TypeWord, WidthError};
pub use reply::Reply;
pub use request::{Frames, Operation, Request};
pub use response::{Body, Data, Response};
pub use status::{Alarm, Alm, EncoderStatus, PmAlarm, PmAlm};
pub use temperature::Temperature;
pub use timing::{BitRate, FRAME_GAP_NS, POWER_UP_NS, READ_BUSY_NS, REQUEST_GAP_NS, WRITE_BUSY_NS};
