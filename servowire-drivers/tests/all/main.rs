//! The drivers against simulated lines, encoders, processors and ASICs.

#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::missing_panics_doc,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]
#![allow(dead_code, unreachable_pub, reason = "with fewer features a part of each helper is used")]

// Helpers.
#[cfg(feature = "rtex")]
mod asic;
#[cfg(any(all(feature = "tformat", feature = "nikon"), feature = "rtex"))]
mod bad_clock;
#[cfg(feature = "tformat")]
mod bench;
#[cfg(feature = "nikon")]
mod frames;
mod hostile;
mod late;
#[cfg(feature = "tformat")]
mod parts;
#[cfg(feature = "async")]
mod polls;
mod refusals;
#[cfg(all(feature = "tformat", feature = "nikon"))]
mod sampler;
mod second;

#[cfg(all(feature = "tformat", feature = "nikon"))]
mod anew;
#[cfg(all(feature = "tformat", feature = "nikon"))]
mod clock;
mod contract;
#[cfg(feature = "tformat")]
mod direction;
#[cfg(feature = "tformat")]
mod hard;
#[cfg(feature = "nikon")]
mod hard_nikon;
#[cfg(all(feature = "nikon", feature = "async"))]
mod nikon_asynch;
#[cfg(feature = "nikon")]
mod nikon_blocking;
#[cfg(feature = "rtex")]
mod rtex;
#[cfg(all(feature = "tformat", feature = "nikon"))]
mod spi;
#[cfg(all(feature = "tformat", feature = "async"))]
mod spi_dropped;
#[cfg(feature = "tformat")]
mod spi_parts;
#[cfg(all(feature = "tformat", feature = "async"))]
mod tformat_asynch;
#[cfg(feature = "tformat")]
mod tformat_blocking;
#[cfg(feature = "tformat")]
mod whole;
