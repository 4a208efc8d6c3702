#![doc = include_str!("../README.md")]
//!
//! [`Behaviour`]: device::Behaviour
//! [`Detection`]: master::Detection
//! [`EepromAccess`]: master::EepromAccess
//! [`Fault`]: device::Fault
//! [`Line::hand_over_ns`]: master::Line::hand_over_ns
//! [`Line::latency_budget_ns`]: master::Line::latency_budget_ns
//! [`MultiTurnZero`]: master::MultiTurnZero
//! [`Reset`]: master::Reset
//! [`SingleTurnZero`]: master::SingleTurnZero
//! [`Transaction`]: master::Transaction
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod address;
pub mod clb;
mod count;
mod crc;
mod data_id;
pub mod device;
mod doubt;
mod error;
mod evidence;
mod frame;
pub mod inspect;
mod marks;
pub mod master;
mod message;
mod request;
mod resolution;
mod response;
pub mod spi;
mod status;
pub mod stream;
mod timing;
mod tolerated;
mod vendor;

pub use address::{Address, Adf, Page};
pub use count::{Abm, Abs};
pub use crc::crc;
pub use data_id::{ControlField, DataId, Layout};
pub use doubt::Doubt;
pub use error::{Error, ErrorClass};
pub use evidence::{Evidence, EvidenceCell, EvidenceShaftCell, Sample};
pub use frame::Frame;
pub use message::{AllData, Identification, Memory, MultiTurn, SingleTurn};
pub use nrz_line::{BitOrder, Window};
pub use request::Request;
pub use resolution::{Hint, Resolution};
pub use response::Response;
pub use servowire_core::OutOfRange;
pub use status::{Almc, StatusField};
pub use timing::{BitRate, RESPONSE_DELAY_NS};
pub use tolerated::{Policy, Tolerated};
pub use vendor::VendorCommand;
