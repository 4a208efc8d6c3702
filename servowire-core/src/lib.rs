#![doc = include_str!("../README.md")]
//!
//! [`run`]: fn@run
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod angle;
mod builder;
// Under the model there are only the slots: its atomics are not const.
#[cfg(not(all(test, loom)))]
mod cell;
mod class;
mod codes;
mod contract;
mod counters;
mod error_rate;
mod errors;
mod feedback;
mod findings;
mod four_slots;
mod motion;
mod number;
mod procedure;
mod range;
mod run;
#[cfg(not(all(test, loom)))]
mod shaft;
mod show;
mod step_dir;
pub mod stream;
mod time;

pub use angle::{Angle, Commutation, Sense};
#[cfg(not(all(test, loom)))]
pub use cell::{Cell, Reader, Words, Writer};
pub use class::{Class, Classified};
pub use contract::{Machine, Procedure};
pub use counters::Counters;
pub use error_rate::ErrorRate;
pub use feedback::{Feedback, Policy, Tolerance};
pub use findings::Findings;
pub use motion::{Acceleration, Estimate, Motion, Tracker};
pub use number::U24;
pub use procedure::{Polling, Progress, Step};
pub use range::OutOfRange;
pub use run::{Ended, run, run_async};
#[cfg(not(all(test, loom)))]
pub use shaft::{Shaft, ShaftCell, ShaftReader, ShaftWriter};
pub use show::write_names;
pub use step_dir::{Command, Direction};
pub use time::{ClockCheck, ClockError, MAX_TICK_NS, MIN_TICK_HZ, TickRate, TimeBase};

/// Items that the macros of this crate refer to; not for direct use.
#[doc(hidden)]
pub mod private {
    pub use crate::errors::{Snake, snake_case};
    pub use arbitrary_int::{UInt, traits::Integer};
    pub use nom;
}
