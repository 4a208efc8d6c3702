#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod acceleration;
mod answer;
mod crc;
pub mod device;
mod doubt;
mod encoder_id;
mod error;
pub mod frame;
pub mod line;
mod line_code;
pub mod master;
pub mod message;
mod parameter;
mod position;
mod profile;
mod quality;
pub mod registers;
pub mod rssi;
pub mod sampling;
pub mod symbol;
pub mod sync;
mod vframe;

pub use acceleration::{DeltaDelta, OutOfRange};
pub use answer::{Answer, Content};
pub use crc::{CRC_16, RunningCrc16, crc16};
pub use doubt::Doubt;
pub use encoder_id::{EncoderId, PositionBits};
pub use error::{Error, ErrorClass};
pub use line_code::LineDisparity;
pub use nrz_line::Window;
pub use parameter::{EncoderByte, EncoderSymbol, MasterSymbol, Nibble, ParameterByte};
pub use position::{Phase, PositionRule, PositionTracker};
pub use profile::Profile;
pub use quality::{QualityEvent, QualityMonitor, QualityRule};
pub use symbol::Rule;
pub use vframe::{SafeBlock, VFrame};
