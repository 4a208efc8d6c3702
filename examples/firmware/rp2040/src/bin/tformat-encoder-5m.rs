//! A T-Format encoder at 5 Mbit/s.
#![no_std]
#![no_main]

use tformat::BitRate;

#[rp2040_hal::entry]
fn main() -> ! {
    servowire_rp2040::tformat::encoder("tformat-encoder-5m", BitRate::Mbit5)
}
