//! The controller's side as state machines without I/O: they are told what arrived and what time it is, and say what
//! to do next. Time is a count of nanoseconds from any origin.
//!
//! * [`Transaction`] takes one request to its reply, [`BusTransaction`] to the replies of several encoders: time-outs and all
//!   checks.
//! * [`Reset`], [`EepromRead`], [`Write`] and [`Detection`] are made of several transactions and drive them by [`Step`].
//! * [`Cycle`] repeats a readout at a fixed period.
//! * [`Counters`] and [`ErrorRate`] keep account of what was refused.

mod cycle;
mod detection;
mod eeprom;
mod reset;
mod transaction;

pub use cycle::{Cycle, PeriodTooShort};
pub use detection::{Detected, Detection};
pub use eeprom::{EepromRead, Polling, Write};
pub use nrz_line::ErrorRate;
pub use reset::Reset;
pub use transaction::{BusTransaction, Line, Progress, Transaction};

use crate::{Error, ErrorClass, Request};

/// What a procedure of several transactions wants next.
pub type Step<T> = nrz_line::Step<Request, T, Error>;

/// How many transactions went well, and how many failed with which [`ErrorClass`].
pub type Counters = nrz_line::Counters<{ ErrorClass::ALL.len() }>;
