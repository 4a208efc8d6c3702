#![doc = include_str!("../README.md")]
//!
//! [`Device::hear`]: device::Device::hear
//! [`hear_words`]: master::Master::hear_words
//! [`HFrame::finished`]: master::HFrame::finished
//! [`HFrame`]: master::HFrame
//! [`Master::fast`]: master::Master::fast
//! [`Master::hear_bits`]: master::Master::hear_bits
//! [`Master::hear`]: master::Master::hear
//! [`Master::safe`]: master::Master::safe
//! [`Master::start_short`]: master::Master::start_short
//! [`Master::transmission`]: master::Master::transmission
//! [`Report`]: inspect::Report
//! [`start_long`]: master::Master::start_long
//! [`Transmission`]: device::Transmission
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod acceleration;
mod answer;
mod channel2;
mod crc;
pub mod device;
mod dialect;
mod doubt;
mod encoder_id;
mod error;
mod evidence;
mod fast;
pub mod frame;
pub mod inspect;
mod line_code;
pub mod master;
pub mod message;
mod parameter;
mod position;
mod quality;
mod ranged;
pub mod registers;
mod resource;
pub mod rssi;
pub mod sampling;
pub mod symbol;
pub mod sync;
mod vframe;

/// The step width of a test sweep: under Miri every `n`-th case, because a whole sweep takes minutes there.
#[cfg(test)]
pub(crate) const fn thin(n: usize) -> usize {
    if cfg!(miri) { n } else { 1 }
}

pub use acceleration::DeltaDelta;
pub use answer::{Answer, Content, EncodedAnswer};
pub use channel2::{Channel2Findings, Channel2Monitor};
pub use crc::{CRC_16, RunningCrc16, crc16};
pub use dialect::Dialect;
pub use doubt::Doubt;
pub use encoder_id::{EncoderId, PositionBits};
pub use error::{Error, ErrorClass};
pub use evidence::{Evidence, EvidenceCell, EvidenceShaftCell, Policy, SafeEvidence, SafeSample, Sample, Tolerated};
pub use fast::FastPosition;
pub use line_code::{EncodedParameter, Equalisation, LineDisparity};
pub use nrz_line::Window;
pub use parameter::{EncoderByte, EncoderSymbol, MasterSymbol, Nibble, ParameterByte};
pub use position::{AlignmentStage, PositionRegisters, PositionRule, PositionTracker};
pub use quality::{QualityEvent, QualityMonitor, QualityRule};
pub use servowire_core::OutOfRange;
pub use symbol::Rule;
pub use vframe::{SafeBlock, VFrame};
