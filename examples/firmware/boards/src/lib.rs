//! Code that the firmware images share and that also runs on a host: pin tables that are checked at compile time, clock
//! trees made
//! from the crystal, the first line of the console, the report of a master's readings, the control interrupt, and a machine
//! of several axes under commands.
#![no_std]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects))]

#[cfg(test)]
extern crate std;

mod clock;
mod control;
mod first_line;
mod line_fault;
mod motion;
mod oscillator;
mod pins;
mod pll;
mod readings;
mod report;
mod resolution;

pub use clock::Counter;
pub use control::{Control, Limits, Outputs, put};
pub use first_line::FirstLine;
pub use line_fault::LineFault;
pub use motion::Machine;
pub use oscillator::{Source, start, waited};
pub use pins::{Board, Pin};
pub use pll::{Pll, PllLimits};
pub use readings::Readings;
pub use resolution::RESOLUTION;
