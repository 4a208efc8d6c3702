#![doc = include_str!("../README.md")]
//!
//! [`Arrival`]: master::Arrival
//! [`AskError::ServoOn`]: master::AskError::ServoOn
//! [`Axis::arrival`]: master::Axis::arrival
//! [`Axis::ask_sub`]: master::Axis::ask_sub
//! [`Axis::counters`]: master::Axis::counters
//! [`Axis::disobeys`]: master::Axis::disobeys
//! [`Axis::evidence`]: master::Axis::evidence
//! [`Axis::not_sent`]: master::Axis::not_sent
//! [`Axis::stop`]: master::Axis::stop
//! [`Axis`]: master::Axis
//! [`AxisConfig::deceleration`]: master::AxisConfig::deceleration
//! [`AxisConfig::stop`]: master::AxisConfig::stop
//! [`Behaviour`]: device::Behaviour
//! [`ClearableIf`]: master::procedure::ClearableIf
//! [`ClearAlarm`]: master::procedure::ClearAlarm
//! [`CommandEnded`]: master::CommandEnded
//! [`Failure::Stopped`]: master::Failure::Stopped
//! [`Fault`]: device::Fault
//! [`Held`]: master::AxisState::Held
//! [`Home`]: master::procedure::Home
//! [`inspect`]: mod@inspect
//! [`Limits::echo`]: master::Limits::echo
//! [`Master`]: master::Master
//! [`Ring::is_torn`]: master::Ring::is_torn
//! [`Ring::stop`]: master::Ring::stop
//! [`Ring`]: master::Ring
//! [`Run`]: master::Run
//! [`SameMacId`]: master::SameMacId
//! [`SetpointError::Step`]: master::SetpointError::Step
//! [`StopReason::WrongMacId`]: master::StopReason::WrongMacId
//! [`SwitchOnError`]: master::SwitchOnError
//! [`TimedOut`]: master::Failure::TimedOut
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
