//! Golden traces for teams that build this receiver in an FPGA or a PRU: every H-frame of a link as the samples of both
//! directions and the registers after it, one JSON object a line.
//!
//! `cargo run --release -p hdsl --example golden -- [sick|ti] [metres] [frames] > trace.jsonl`
//!
//! ```text
//!  state     state of the receiver in this frame
//!  head      SYNC to PARA: 8 samples a bit (75 MHz), a byte each, the first sample in bit 7
//!  answer    the 72 bit times after the direction switch, likewise; null for a frame without an answer
//!  tail      TRAILER and stuffing as line bits
//!  registers bytes 00h to 55h of the register map after the frame
//! ```
//!
//! The link comes up, the position runs to and fro past the end of its range, a short and a long message pass, one answer
//! is damaged. The same arguments give the same trace.

use core::fmt::Write;

use hdsl::device::{Device, Transmission};
use hdsl::master::Master;
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::Registers;
use hdsl::{Dialect, EncoderId};

#[path = "../tests/all/cable.rs"]
mod cable;

use cable::{Cable, Disturbance};

fn hex(bytes: impl IntoIterator<Item = u8>) -> String {
    bytes.into_iter().fold(String::new(), |mut text, byte| {
        // Never fails: it is a string.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The trace, a line for every H-frame.
pub(crate) fn trace(dialect: Dialect, metres: u32, frames: u64) -> Result<String, Box<dyn core::error::Error>> {
    let mut text = String::new();
    let mut cable = Cable::new(Disturbance::metres(metres).with_jitter(1), 1);
    let mut master = Master::new(dialect);
    let mut map = Registers::new(&dialect);
    // 24 bits of position, and a start near its end.
    let mut encoder = Device::new(EncoderId::try_from(0x000d3)?);
    let mut position = (1_u64 << 24) - 4000;
    for frame in 0..frames {
        let speed: i64 = if frame % 240 < 120 { 40 } else { -40 };
        position = position.wrapping_add_signed(speed) & 0xff_ffff;
        match frame {
            90 => master.start_short(ShortRequest::Read(RemoteRegister::PING))?,
            100 => master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN))?,
            _ => {}
        }
        let present = master.transmission();
        let answer = encoder.set_position(position).hear(cable.down(present.head.bits()));
        // One damaged bit in the acceleration.
        let answer =
            if frame == 170 { answer.map(|answer| Transmission { bits: answer.bits ^ 1 << 35 }) } else { answer };
        let samples = cable.up(answer);
        let state = master.state();
        let h_frame = master.hear(&samples, 0)?;
        map.apply(h_frame);
        let answer = if present.answered { format!("\"{}\"", hex(samples)) } else { "null".to_owned() };
        let tail: String = h_frame.tail.bits().map(|bit| if bit { '1' } else { '0' }).collect();
        writeln!(
            text,
            "{{\"frame\":{frame},\"state\":\"{state}\",\"head\":\"{}\",\"answer\":{answer},\"tail\":\"{tail}\",\"registers\":\"{}\"}}",
            hex(present.head.samples()),
            hex(*map.as_bytes())
        )?;
    }
    Ok(text)
}

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let dialect = match arguments.first().map(String::as_str) {
        None | Some("sick") => Dialect::SICK,
        Some("ti") => Dialect::TI,
        Some(other) => return Err(format!("{other}: sick or ti").into()),
    };
    let metres = arguments.get(1).map_or(Ok(20), |text| text.parse())?;
    let frames = arguments.get(2).map_or(Ok(200), |text| text.parse())?;
    print!("{}", trace(dialect, metres, frames)?);
    Ok(())
}
