//! Reads positions of an A-format encoder at 2.5 Mbit/s and prints them.
#![no_std]
#![no_main]

use nikon_aformat::BitRate;

#[rp2040_hal::entry]
fn main() -> ! {
    servowire_rp2040::aformat::master("aformat-master-2m5", BitRate::Mbit2_5)
}
