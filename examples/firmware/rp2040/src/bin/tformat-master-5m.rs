//! Reads positions of a T-Format encoder at 5 Mbit/s and prints them.
#![no_std]
#![no_main]

use tformat::BitRate;

#[rp2040_hal::entry]
fn main() -> ! {
    servowire_rp2040::tformat::master("tformat-master-5m", BitRate::Mbit5)
}
