//! Moves two stepper motors along lines that are typed.
#![no_std]
#![no_main]

use rp2040_hal::pac::interrupt;
use servowire_rp2040::steps::{self, Feed};

#[interrupt]
fn PIO0_IRQ_0() {
    static mut OWN: Option<Feed> = None;
    steps::fire(OWN);
}

#[rp2040_hal::entry]
fn main() -> ! {
    servowire_rp2040::motion::run("motion")
}
