#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod builder;
mod class;
mod counters;
mod error_rate;
mod errors;
mod findings;
mod number;
mod procedure;
mod range;
mod show;
pub mod stream;
mod time;

pub use class::{Class, Classified};
pub use counters::Counters;
pub use error_rate::ErrorRate;
pub use findings::Findings;
pub use number::U24;
pub use procedure::{Polling, Progress, Step};
pub use range::OutOfRange;
pub use show::write_names;
pub use time::{ClockCheck, ClockError, MAX_TICK_NS, MIN_TICK_HZ, TickRate, TimeBase};

/// What the macros of this crate name; not for use by hand.
#[doc(hidden)]
pub mod private {
    pub use crate::errors::{Snake, snake_case};
    pub use arbitrary_int::{UInt, traits::Integer};
    pub use nom;
}
