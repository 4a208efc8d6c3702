#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod arithmetic;
mod axis;
mod dance;
mod error;
mod frequency;
mod group;
mod interval;
mod microstep;
mod position;
mod profile;
pub mod pru_exact;
mod ramp;
mod ramp_steps;
mod runs;
mod tone;

pub use arithmetic::{Arithmetic, corrected};
pub use axis::{Axes, Axis};
pub use dance::{Dance, Note};
pub use error::{Error, ErrorClass};
pub use frequency::{Frequency, NamedSpeed, Speed};
pub use group::{Group, Motors};
pub use interval::{CYCLE_NS, Interval, StepTime, step_time_ns};
pub use microstep::{Microstep, Turn};
pub use position::{OperatingMode, PositionMode, PositionState};
pub use profile::{Parameters, Profile, Shape};
pub use ramp::RampTable;
pub use ramp_steps::{MoveState, RampStep, RampSteps};
pub use servowire_core::{Command, Direction, OutOfRange};
pub use tone::Tone;
