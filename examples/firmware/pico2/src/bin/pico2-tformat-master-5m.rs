//! Reads positions of a T-Format encoder at 5 Mbit/s and prints them.
#![no_std]
#![no_main]

use tformat::BitRate;

#[rp235x_hal::entry]
fn main() -> ! {
    servowire_pico2::tformat::master("pico2-tformat-master-5m", BitRate::Mbit5)
}
