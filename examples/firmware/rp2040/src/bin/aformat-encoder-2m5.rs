//! An A-format encoder at 2.5 Mbit/s.
#![no_std]
#![no_main]

use nikon_aformat::BitRate;

#[rp2040_hal::entry]
fn main() -> ! {
    servowire_rp2040::aformat::encoder("aformat-encoder-2m5", BitRate::Mbit2_5)
}
