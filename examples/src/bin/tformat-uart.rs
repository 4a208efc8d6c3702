//! Polls a simulated encoder through the driver: `cargo run -p servowire-examples --bin tformat-uart`.

use servowire_drivers::DirectionPin;
use servowire_drivers::tformat::blocking::Driver;
use servowire_examples::simulated_uart::{Bench, Pin, Uart, WORST};
use tformat::master::Line;
use tformat::{Abm, Abs, BitRate, Policy, Resolution};

fn main() {
    let bench = Bench::new(0x17);
    let Ok(resolution) = Resolution::new(23, 16) else { return };
    let pin = DirectionPin::new(Pin, WORST);
    let mut encoder = match Driver::new(Uart::new(&bench), pin, &bench, Line::new(BitRate::Mbit2_5)) {
        Ok(encoder) => encoder,
        Err(too_slow) => return println!("{too_slow}"),
    };
    for k in 0..5_u32 {
        bench.turn_to(Abs::truncate(k.wrapping_mul(0x11_1111)), Abm::truncate(k));
        match encoder.read_position(resolution, Policy::new(500_000)) {
            Ok(sample) => println!("{sample}"),
            Err(error) => println!("{error:?}"),
        }
    }
}
