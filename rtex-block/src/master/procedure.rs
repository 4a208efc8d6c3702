//! Procedures of several requests: texts, parameters, alarms, homing, latch.
//!
//! Call `start` of a procedure, and then `receive` once in every update period after the exchange, until it is done or has
//! failed; it stays in that state until it is restarted. It sends its requests through its axis, so nothing else may send
//! requests meanwhile. The caller supplies type codes that no available document confirms.

mod alarms;
mod ask;
mod homing;
mod latch;
mod parameters;
mod rebase;
mod text;

pub use alarms::{AlarmAttributes, AlarmHistory, Attributes, ClearAlarm, ClearableIf, Clearing};
pub use ask::{Procedure, Request};
pub use homing::{Home, SetPosition};
pub use latch::{Caught, Latch};
pub use parameters::{Backup, ParameterValue, Restore};
pub use rebase::RebaseWithServoOn;
pub use text::{ReadText, Text};
