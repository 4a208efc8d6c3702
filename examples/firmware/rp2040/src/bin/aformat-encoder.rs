//! An A-format encoder at 8 Mbit/s.
#![no_std]
#![no_main]

use nikon_aformat::BitRate;
use panic_halt as _;

#[rp2040_hal::entry]
fn main() -> ! {
    servowire_rp2040::aformat::encoder(BitRate::Mbit8, 277)
}
