//! Polls a simulated encoder through the driver sketch: `cargo run -p servowire-examples --bin tformat-uart`.

use servowire_examples::simulated_uart::{Bench, Pin, Uart};
use servowire_examples::tformat_uart::Encoder;
use tformat::master::Line;
use tformat::{BitRate, Profile, Request, Response, U24};

fn main() {
    let bench = Bench::new(0x17);
    let line = Line::new(BitRate::Mbit2_5).with_echo();
    let mut encoder = Encoder::new(Uart::new(&bench), Pin, &bench, line);
    for k in 0..5_u32 {
        bench.turn_to(U24::truncate(k.wrapping_mul(0x11_1111)), U24::truncate(k));
        match encoder.transact(Request::Id3) {
            Ok(Response::Id3(full)) => {
                let position = Profile::from_enid(full.enid).map(|hint| hint.profile.position(full.abs, full.abm));
                println!("{position:?}");
            }
            other => println!("{other:?}"),
        }
    }
}
