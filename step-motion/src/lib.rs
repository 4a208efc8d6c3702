#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod arc;
mod axes;
mod axes_timer;
mod axis;
mod curve;
mod cutter;
mod error;
mod halts;
mod homing;
mod limits;
mod line;
mod mover;
mod path;
mod path_mover;
mod peak;
mod phases;
mod places;
mod plan;
mod planner;
mod queue;
mod real;
mod reloads;
mod requests;
mod slope;
mod step_timer;
mod stepper;
#[cfg(test)]
mod tests;
mod word;
mod writer;

pub use arc::{Arc, Turning};
pub use axes::Axes;
pub use axes_timer::{AxesQueue, AxesTimer, FiredAxes};
pub use axis::{Axis, Work};
pub use error::{Error, ErrorClass};
pub use homing::{Homing, HomingConfig, HomingState, Switch};
pub use limits::{Clock, Limits};
pub use line::{AxisPulse, LinePulses};
pub use mover::{Mover, Pulse};
pub use path::{AxisSetup, Path};
pub use path_mover::PathMover;
pub use plan::{Plan, Pulses, Setpoint};
pub use queue::Queue;
pub use reloads::{Reload, Reloads};
pub use servowire_core::{Direction, OutOfRange};
pub use step_timer::{Fired, StepTimer};
