//! Polls a simulated encoder through the driver sketch: `cargo run -p servowire-examples --bin tformat-uart`.

use servowire_examples::simulated_uart::{Bench, Pin, Uart};
use servowire_examples::tformat_uart::Encoder;
use tformat::master::Line;
use tformat::{Abm, Abs, BitRate, Request, Resolution, Response};

fn main() {
    let bench = Bench::new(0x17);
    let line = Line::new(BitRate::Mbit2_5).with_echo();
    let mut encoder = Encoder::new(Uart::new(&bench), Pin, &bench, line);
    for k in 0..5_u32 {
        bench.turn_to(Abs::truncate(k.wrapping_mul(0x11_1111)), Abm::truncate(k));
        match encoder.transact(Request::ReadAll) {
            Ok(Response::ReadAll(data)) => {
                match Resolution::from_enid(data.enid).map(|hint| hint.resolution.position(data.abs, data.abm)) {
                    Some(Ok(position)) => println!("{position}"),
                    other => println!("{data}: {other:?}"),
                }
            }
            other => println!("{other:?}"),
        }
    }
}
