//! The controller's side: everything that has to happen around the blocks, with no input or output of its own.
//!
//! The pieces can be used alone or together. [`Ring`] joins the axes: it takes the responses of all drives once per update
//! period and returns the commands of the next. [`Master`] adds the phases, the watchdog and the memory of the ASIC; [`Run`]
//! adds the common jobs. Limits are counted in update periods, ages in ns of the clock.

mod axis;
mod check;
mod config;
mod counter;
mod counters;
mod echo;
mod handshake;
mod heard;
mod led;
mod phase;
pub mod procedure;
mod profile_move;
mod progress;
mod ring;
mod run;
mod service;
mod servo_off;
mod slaves;
mod state;
mod sub_handshake;

pub use axis::{Axis, Sent};
pub use check::{Acknowledgement, Checked, Expected};
pub use config::{AxisConfig, Limits, StopCategory};
pub use counter::{CommandCounter, Turn};
pub use counters::Counters;
pub use echo::{Arrival, EchoWatch};
pub use handshake::Handshake;
pub use heard::Heard;
pub use led::{Led, Pattern, led, pattern};
pub use phase::{Asic, ControlError, ControlPhase, Inputs, PhaseControl};
pub use profile_move::{CommandEnded, MoveStage, ProfileMove};
pub use progress::{Failure, Progress};
pub use ring::{Fellows, Ring, RingFailure, SameMacId};
pub use run::{Ended, Run};
pub use service::{Master, MasterConfig, SetupError};
pub use servo_off::{ActiveCode, ServoOff};
pub use slaves::{Slave, SlaveInfo, compare};
pub use state::{AskError, AxisState, RingSwitchOnError, SetpointError, StopReason, SwitchOnError};
pub use sub_handshake::SubHandshake;
