#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

/// Step of a test sweep: every value natively, only every `thin`th one in an interpreter.
#[cfg(test)]
const fn stride(thin: usize) -> usize {
    if cfg!(miri) { thin } else { 1 }
}

pub mod cut_through;

mod address;
mod clock;
mod crc;
mod delay_req;
pub mod device;
mod discovery;
pub mod drv8711;
mod error;
mod evidence;
mod exchange;
pub mod follow;
mod frame;
mod frame_type;
mod hex;
pub mod iep;
pub mod inspect;
mod line_delay;
mod link;
pub mod master;
mod param;
mod payload;
pub mod pins;
mod place;
mod preamble;
mod pto;
mod status;
pub mod stream;
mod sync;
pub mod sync0;
#[cfg(feature = "serde")]
mod table;
mod tally;
pub mod timing;

pub use servowire_core::OutOfRange;

pub use address::DeviceAddress;
pub use clock::{Clock, Correction};
pub use crc::{crc8, crc8_update, fcs};
pub use delay_req::DelayReq;
pub use discovery::{Assignment, Discovery, DiscoveryView, Entry, Member, Network};
pub use error::{Error, ErrorClass};
pub use evidence::{Doubt, Evidence, EvidenceCell, Policy, Positions, Sample, Tolerated};
pub use exchange::{
    DeviceFrame, DeviceFrameView, MasterFrame, MasterFrameView, PublishedDeviceFrame, emit_master_frame_into,
};
pub use frame::LongFrame;
pub use frame_type::FrameType;
pub use line_delay::{DelayModel, LineDelay, RoundTrips};
pub use link::Link;
pub use param::{CrcKind, CrcMode, Param, ParamView, Parameters, Topology};
pub use payload::{MotorMask, Payload, Slice};
pub use place::Place;
pub use preamble::{Preamble, strip_preamble};
pub use pto::{Direction, Pto, Reserved, StartTime};
pub use status::Status;
pub use sync::{Sync, SyncView, TRANSIT_NS};
pub use tally::Tally;
