//! The controller's side as state machines without I/O: they are told what arrived and what time it is, and say what
//! to do next. Time is a count of nanoseconds from any origin.
//!
//! * [`Transaction`] takes one request to its response, [`BusTransaction`] to the responses of several encoders: time-outs and all
//!   checks.
//! * [`GuardedReset`] and [`VerifiedWrite`] do what cannot be undone, once, and end as done, not done, or with an unknown effect;
//!   they are made of [`Reset`], [`Write`] and [`EepromRead`].
//! * [`Detection`] finds an encoder and its widths. All of these are made of several transactions and drive them by [`Step`].
//! * [`Cycle`] repeats a readout at a fixed period.
//! * [`Counters`] and [`ErrorRate`] keep account of what was refused.

mod cycle;
mod detection;
mod eeprom;
mod guarded;
mod hunt;
mod line;
mod reset;
mod transaction;
mod verified;
mod write;

pub use cycle::{Cycle, PeriodTooShort};
pub use detection::{Detected, Detection};
pub use eeprom::{EepromRead, READ_POLLING, WRITE_POLLING};
pub use guarded::GuardedReset;
pub use line::Line;
pub use reset::Reset;
pub use servowire_core::{ErrorRate, Polling};
pub use transaction::{BusTransaction, Exchange, Sampled, Transaction};
pub use verified::VerifiedWrite;
pub use write::Write;

use crate::error::{Error, ErrorClass};
use crate::request::Request;

/// What a procedure of several transactions wants next.
pub type Step<T> = servowire_core::Step<Request, T, Error>;

/// How far a transaction is.
pub type Progress<T> = servowire_core::Progress<T, Error>;

/// How many transactions went well, and how many failed with which [`ErrorClass`].
pub type Counters = servowire_core::Counters<{ ErrorClass::ALL.len() }>;
