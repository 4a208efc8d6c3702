#![doc = include_str!("../README.md")]
//!
//! [`Detection`]: master::Detection
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

/// Test sweeps are thinned out under an interpreter.
#[cfg(test)]
const STRIDE: usize = if cfg!(miri) { 97 } else { 1 };

mod abs40;
pub mod bus;
mod command;
mod contents;
mod crc;
mod data;
pub mod device;
mod doubt;
mod error;
mod evidence;
mod expected;
mod frame;
pub mod inspect;
mod layout;
mod marks;
pub mod master;
mod number;
mod operation;
mod raw_response;
pub mod reception;
mod request;
mod resolution;
mod response;
mod status;
pub mod stream;
mod temperature;
mod timing;
mod tolerated;
mod type_word;
mod units;

pub use abs40::Abs40;
pub use command::{Command, Version};
pub use crc::{Crc3, Crc8, crc3, crc8};
pub use data::Data;
pub use doubt::Doubt;
pub use error::{EchoField, Error, ErrorClass};
pub use evidence::{Evidence, EvidenceCell, EvidenceShaftCell, Sample};
pub use expected::{Echo, Expected};
pub use frame::{FrameCode, RequestFrame};
pub use layout::{FRAME_BITS, Layout};
pub use nrz_line::{BitOrder, Window};
pub use number::{EncoderAddress, EncoderId, U10, U17, U19, U40, UserAddress};
pub use operation::Operation;
pub use raw_response::{Crc, RawResponse};
pub use request::{Frames, Request};
pub use resolution::Resolution;
pub use response::{Body, Response};
pub use servowire_core::{OutOfRange, U24};
pub use status::{Alm, EncoderStatus, PmAlm};
pub use temperature::Temperature;
pub use timing::{BitRate, FRAME_GAP_NS, POWER_UP_NS, READ_BUSY_NS, REQUEST_GAP_NS, WRITE_BUSY_NS};
pub use tolerated::{Policy, Tolerated};
pub use type_word::{Battery, Multiturn, TypeWord};
pub use units::Units;
