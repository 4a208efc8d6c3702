#![doc = include_str!("../README.md")]
#![no_std]

pub mod aformat;
pub mod answering;
pub mod board;
pub mod chip;
pub mod clock;
pub mod commands;
pub mod console;
pub mod frames;
pub mod last_words;
pub mod motion;
pub mod port;
pub mod programs;
pub mod steps;
pub mod tformat;
pub mod uart;

pub use chip::hal;
