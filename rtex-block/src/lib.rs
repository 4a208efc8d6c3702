#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod block;
mod code;
mod command;
mod control;
pub mod device;
mod doubt;
mod error;
mod error_code;
mod evidence;
mod execution;
mod flags;
mod header;
pub mod inspect;
pub mod master;
mod noncyclic_command;
mod noncyclic_response;
pub mod pack;
pub mod position;
mod response;
mod status;
pub mod stream;
mod sub;
pub mod timing;
pub mod type_code;

pub use block::{BlockSize, LEN, LEN32};
pub use code::{Code, Codes, CyclicCode, NonCyclicCode};
pub use command::{Command, CommandBlock};
pub use control::ControlBits;
pub use doubt::Doubt;
pub use error::{Error, ErrorClass};
pub use error_code::{Alarm, ErrorCode};
pub use evidence::{Evidence, EvidenceCell, Policy, Sample, Tolerated};
pub use execution::{Execution, LatchFlags, ProfileFlags};
pub use header::{Header, MacId, UpdateCounter};
pub use noncyclic_command::{Arguments, NonCyclicCommand};
pub use noncyclic_response::{AlarmAndWarning, NonCyclicResponse, Results};
pub use response::{Response, ResponseBlock};
pub use servowire_core::OutOfRange;
pub use status::StatusFlags;
pub use sub::{Command32, Response32, SubCode, SubCommand, SubResponse};
pub use type_code::{Nibble, Pr, TypeCode};

/// The step of tests that run through all 16-bit values; larger under Miri.
#[cfg(test)]
pub(crate) const STRIDE: usize = if cfg!(miri) { 251 } else { 1 };
