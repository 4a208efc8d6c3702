#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(
    test,
    allow(
        clippy::arithmetic_side_effects,
        clippy::cast_possible_truncation,
        clippy::indexing_slicing,
        clippy::unwrap_used
    )
)]

#[cfg(any(test, feature = "arbitrary"))]
extern crate std;

mod clock;
mod direction;
#[cfg(feature = "drv8711")]
pub mod drv8711;
mod error;
#[cfg(any(feature = "nikon", feature = "tformat"))]
mod exchange;
#[cfg(feature = "nikon")]
pub mod nikon;
#[cfg(any(feature = "nikon", feature = "tformat"))]
mod quiet;
#[cfg(feature = "async")]
mod race;
#[cfg(feature = "rtex")]
pub mod rtex;
pub mod samples;
pub mod spi;
#[cfg(feature = "tformat")]
pub mod tformat;

#[cfg(feature = "embassy-time")]
pub use clock::EmbassyClock;
pub use clock::{Clock, CounterClock};
#[cfg(feature = "fugit")]
pub use clock::{FugitClock, FugitClock32};
#[cfg(feature = "async")]
pub use clock::{Timer, WithDelay};
pub use direction::{Automatic, Direction, DriverEnable};
pub use error::Error;
pub use servowire_core::{ClockError, TickRate};
