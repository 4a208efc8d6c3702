//! The controller's side as state machines without I/O: they are told what arrived and what time it is, and say what
//! to do next. Time is a count of nanoseconds from any origin.
//!
//! * [`Transaction`] takes one request to its reply, [`BusTransaction`] to the replies of several encoders: time-outs and all
//!   checks.
//! * [`Reset`], [`EepromRead`], [`Write`] and [`Detection`] are made of several transactions and drive them by [`Step`].
//! * [`Cycle`] repeats a readout at a fixed period.
//! * [`Counters`] and [`ErrorRate`] keep account of what was refused.

mod counters;
mod cycle;
mod detection;
mod eeprom;
mod reset;
mod transaction;

pub use counters::{Counters, ErrorRate};
pub use cycle::{Cycle, PeriodTooShort};
pub use detection::{Detected, Detection};
pub use eeprom::{EepromRead, Polling, Write};
pub use reset::Reset;
pub use transaction::{BusTransaction, Line, Progress, Transaction};

use crate::{Error, Request};

/// What a procedure of several transactions wants next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Step<T> {
    /// Do this transaction and report its outcome.
    Send {
        /// What to send.
        request: Request,
        /// Not before this time.
        not_before_ns: u64,
    },
    /// The procedure has succeeded.
    Done {
        /// What it was made for.
        value: T,
        /// The encoder is ready for other requests from this time on.
        not_before_ns: u64,
    },
    /// The procedure has failed.
    Failed {
        /// Why.
        error: Error,
        /// The encoder is ready for other requests from this time on.
        not_before_ns: u64,
    },
}
