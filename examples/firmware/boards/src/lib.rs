//! What the firmware images share, and what of them runs on a host too: pin tables that are checked at compile time, clock trees made
//! from the crystal, the first line of the console, and the control interrupt.
#![no_std]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects))]

#[cfg(test)]
extern crate std;

mod clock;
mod control;
mod first_line;
mod oscillator;
mod pins;
mod pll;
mod report;

pub use clock::Counter;
pub use control::{Control, Limits, Outputs};
pub use first_line::FirstLine;
pub use oscillator::{Oscillator, Source, start};
pub use pins::{Board, Pin};
pub use pll::{Pll, PllLimits};
pub use report::Report;
