//! Motion that a machine can use: trapezoids and S-curves within limits of speed, acceleration and jerk, in integers.

mod arc;
mod batch;
mod cubic;
mod curve;
mod cycle;
mod guess;
mod homing;
mod limits;
mod line;
mod mover;
mod path;
mod path_mover;
mod peak;
mod phases;
mod plan;
mod planner;
mod real;
mod run;
mod slope;
mod stepper;

pub use arc::{Arc, Turning};
pub use cycle::{PtoMover, Reload, Reloads};
pub use homing::{Homing, HomingConfig, HomingState, Switch};
pub use limits::{Clock, Limits};
pub use line::{AxisPulse, LinePulses};
pub use mover::{Mover, Pulse};
pub use path::{AxisSetup, Path};
pub use path_mover::PathMover;
pub use plan::{Plan, Pulses, Setpoint};
