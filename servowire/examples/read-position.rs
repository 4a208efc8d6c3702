//! Reads the position of a T-Format encoder at a USB-RS485 adapter, ten times, with `servowire talk` as a library.
//!
//! ```sh
//! cargo run --release -p servowire --example read-position -- /dev/ttyUSB0
//! ```
//!
//! An adapter hands an answer over when it likes: an FTDI chip up to 16 ms late with its latency timer as Linux sets it, 1 ms at
//! best (`/sys/bus/usb-serial/devices/ttyUSB0/latency_timer`). So nobody knows when in a call the shaft was where the answer says. Here
//! the instant of sampling is that before the request, the earliest that is possible, and the age that the policy allows is a whole call. That is
//! good for looking at an axis that stands or turns slowly, and not for control: at 3,000 1/min a shaft makes 0.8 turns in 16 ms.

use core::error::Error;
use core::time::Duration;
use std::io::Write;
use std::time::Instant;

use servowire::talk::encoder::Encoder;
use servowire::talk::port;
use tformat::{BitRate, Evidence, Policy, Resolution, Response};

/// That of your encoder; one that calls itself another one gives no position.
const WIDTHS: (u8, u8) = (23, 16);
/// Of a call: twice the latency timer, USB and the scheduler.
const PATIENCE: Duration = Duration::from_millis(50);

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).ok_or("say which port: /dev/ttyUSB0")?;
    read(&name, PATIENCE, &mut std::io::stdout())
}

/// Ten positions, or why there is none. A call may take as long as `patience`.
///
/// # Errors
/// Of the port, of the encoder or of `out`.
pub fn read(name: &str, patience: Duration, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
    let resolution = Resolution::new(WIDTHS.0, WIDTHS.1)?;
    let mut encoder = Encoder::open(port::open(name, BitRate::Mbit2_5)?, patience)?;
    let policy = Policy::new(u64::try_from(patience.as_nanos())?);
    let began = Instant::now();
    let now_ns = || u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX);
    for _ in 0..10 {
        let (asked, asked_ns) = (Instant::now(), now_ns());
        let evidence = Evidence::of(Response::ReadAll(encoder.read()?), resolution, asked_ns);
        match evidence.at(now_ns(), policy) {
            Ok(sample) => writeln!(out, "{sample}, the call took {} us", asked.elapsed().as_micros())?,
            Err(doubt) => writeln!(out, "no position: {doubt}")?,
        }
    }
    Ok(())
}
