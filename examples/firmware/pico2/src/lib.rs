#![doc = include_str!("../README.md")]
#![no_std]

// The images of the RP2040, but for what is of the chip.
#[path = "../../rp2040/src/aformat.rs"]
pub mod aformat;
#[path = "../../rp2040/src/answering.rs"]
pub mod answering;
#[path = "../../rp2040/src/board.rs"]
pub mod board;
pub mod chip;
#[path = "../../rp2040/src/clock.rs"]
pub mod clock;
#[path = "../../rp2040/src/commands.rs"]
pub mod commands;
#[path = "../../rp2040/src/console.rs"]
pub mod console;
#[path = "../../rp2040/src/frames.rs"]
pub mod frames;
#[path = "../../rp2040/src/last_words.rs"]
pub mod last_words;
#[path = "../../rp2040/src/port.rs"]
pub mod port;
#[path = "../../rp2040/src/programs.rs"]
pub mod programs;
#[path = "../../rp2040/src/tformat.rs"]
pub mod tformat;
#[path = "../../rp2040/src/uart.rs"]
pub mod uart;

pub use chip::hal;
