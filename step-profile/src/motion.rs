//! Motion that a machine can use: trapezoids and S-curves within limits of speed, acceleration and jerk, in integers.

mod curve;
mod limits;
mod mover;
mod phases;
mod plan;
mod planner;
mod real;
mod slope;
mod stepper;

pub use limits::{Clock, Limits};
pub use mover::{Mover, Pulse};
pub use plan::{Plan, Pulses, State};
