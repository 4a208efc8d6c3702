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

#[cfg(any(feature = "nikon", feature = "tformat"))]
#[macro_use]
mod twins;

mod clock;
mod direction;
#[cfg(feature = "drv8711")]
pub mod drv8711;
mod error;
#[cfg(any(feature = "nikon", feature = "tformat"))]
mod exchange;
#[cfg(feature = "tformat")]
mod leaving;
#[cfg(feature = "nikon")]
pub mod nikon;
#[cfg(any(feature = "nikon", feature = "tformat"))]
mod quiet;
#[cfg(all(feature = "async", any(feature = "nikon", feature = "rtex", feature = "tformat")))]
mod race;
#[cfg(feature = "rtex")]
pub mod rtex;
pub mod samples;
#[cfg(feature = "tformat")]
mod sending;
pub mod spi;
#[cfg(feature = "tformat")]
pub mod tformat;

#[cfg(feature = "embassy-time")]
pub use clock::embassy::EmbassyClock;
#[cfg(feature = "fugit")]
pub use clock::fugit::{FugitClock, FugitClock32};
pub use clock::{Clock, CounterClock};
#[cfg(feature = "async")]
pub use clock::{Timer, WithDelay};
pub use direction::{Automatic, Direction, DirectionPin, PinTooSlow, Worst};
pub use error::Error;
pub use servowire_core::{ClockError, TickRate};
