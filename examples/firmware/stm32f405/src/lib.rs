#![doc = include_str!("../README.md")]
#![no_std]

use core::fmt::Write;
use core::panic::PanicInfo;

pub mod clock;
pub mod stack;
pub mod steps;
pub mod uart;
pub mod watchdog;

/// Pins that switch a phase or a brake resistor of the servo drives that have this chip: VESC 4 to 6 and ODrive 3.
pub const POWER_STAGES: &[&str] =
    &["PA7", "PA8", "PA9", "PA10", "PB0", "PB1", "PB10", "PB11", "PB13", "PB14", "PB15", "PC6", "PC7", "PC8"];

/// Prints the location; the watchdog then restarts the image.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let _ = writeln!(uart::Console::last_words(), "\n{info}");
    loop {
        cortex_m::asm::nop();
    }
}
