//! Time in nanoseconds from a counter that wraps.

mod base;
mod check;
mod rate;

pub use base::TimeBase;
pub use check::ClockCheck;
pub use rate::{MAX_TICK_NS, MIN_TICK_HZ, TickRate};

/// What is wrong with a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ClockError {
    /// The tick of the clock is longer than [`MAX_TICK_NS`].
    #[error("a clock of {hz} Hz is too coarse, the limit is {limit_hz} Hz")]
    TooCoarse {
        /// The rate that was requested.
        hz: u32,
        /// The lowest permitted rate, [`MIN_TICK_HZ`].
        limit_hz: u32,
    },
    /// A reading lies before the last one: the clock was set back or reset, or its counter was not read for too long.
    #[error("the clock went back by {by_ns} ns")]
    Backwards {
        /// How far it lies before the last one, in ns.
        by_ns: u64,
    },
    /// More time has passed since the last reading than can have passed.
    #[error("the clock jumped ahead by {by_ns} ns")]
    Ahead {
        /// Time from the last reading to this one, in ns.
        by_ns: u64,
    },
    /// The clock returns the same reading again and again.
    #[error("the clock stands still")]
    Stopped,
}
