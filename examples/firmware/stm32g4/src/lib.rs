#![doc = include_str!("../README.md")]
#![no_std]

pub mod board;
pub mod clocks;
pub mod control;
pub mod report;

use defmt_rtt as _;
use panic_probe as _;
