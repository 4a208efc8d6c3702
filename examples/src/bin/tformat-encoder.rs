//! A T-Format encoder at standard input and output, for an emulator or a test bench: bytes of requests in, bytes of answers out.
//!
//! `cargo run -p servowire-examples --bin tformat-encoder`. Its shaft advances by a thousand counts with every answer. Here
//! bytes have no bit time: those that come within 100 ms belong to the same request.

use core::time::Duration;
use std::io::{self, Read, Write};
use std::time::Instant;

use tformat::device::Device;
use tformat::{Abm, Abs, BitRate};

const PAUSE: Duration = Duration::from_millis(100);
const FIELD_NS: u64 = 4_000;

fn main() -> io::Result<()> {
    let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
    let (mut last, mut now_ns, mut shaft) = (Instant::now(), 0_u64, 0_u32);
    let (mut input, mut output) = (io::stdin().lock(), io::stdout().lock());
    let mut byte = [0];
    while input.read(&mut byte)? > 0 {
        let [request] = byte;
        encoder.set_position(Abs::truncate(shaft), Abm::truncate(7));
        let pause_ns = if last.elapsed() > PAUSE { 1_000_000 } else { 0 };
        now_ns = now_ns.saturating_add(FIELD_NS).saturating_add(pause_ns);
        last = Instant::now();
        if let Some(answer) = encoder.hear(&[request], now_ns) {
            shaft = shaft.wrapping_add(1_000);
            now_ns = now_ns.saturating_add(1_000_000);
            output.write_all(answer.frame.as_bytes())?;
            output.flush()?;
        }
    }
    Ok(())
}
