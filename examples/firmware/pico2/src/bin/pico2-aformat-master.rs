//! Reads positions of an A-format encoder at 8 Mbit/s and prints them.
#![no_std]
#![no_main]

use nikon_aformat::BitRate;

#[rp235x_hal::entry]
fn main() -> ! {
    servowire_pico2::aformat::master("pico2-aformat-master", BitRate::Mbit8)
}
