//! The controller's side: what has to happen around the blocks, without any input or output of its own.
//!
//! The pieces work alone or together. [`Ring`] joins them: it takes the responses of all drives once per update
//! period and gives the commands of the next. Time is counted in update periods.

mod axis;
mod check;
mod counter;
mod echo;
mod handshake;
mod led;
mod phase;
mod profile_move;
mod progress;
mod ring;
mod servo_off;
mod slaves;

pub use axis::{Axis, AxisConfig, AxisState, Limits, SetpointError, StopReason};
pub use check::{Expected, Reception};
pub use counter::{CommandCounter, Turn};
pub use echo::{EchoWatch, ReceiveWatchdog};
pub use handshake::Handshake;
pub use led::{Led, Pattern, led, pattern};
pub use phase::{Asic, Fault, Inputs, Phase, PhaseControl};
pub use profile_move::{CommandEnded, MoveStage, ProfileMove};
pub use progress::{Failure, Progress};
pub use ring::Ring;
pub use servo_off::{ActiveCode, ServoOff};
pub use slaves::{Order, Slave, SlaveInfo, compare};
