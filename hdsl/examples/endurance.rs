//! A receiver and an encoder on a line with jitter, for as many H-frames as you like:
//! `cargo run --release -p hdsl --example endurance -- 10000000`.
//!
//! Ten million H-frames are two minutes of a free-running link.

use hdsl::device::Device;
use hdsl::master::Master;
use hdsl::{Dialect, EncoderId, Policy};

#[path = "../tests/all/cable.rs"]
mod cable;

use cable::{Cable, Disturbance};

/// A free-running H-frame; the window of its answer ends 10,560 ns after its start.
const FRAME_NS: u64 = 11_520;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let frames: u64 = std::env::args().nth(1).map_or(Ok(100_000), |n| n.parse())?;
    // 100 m of cable, every edge up to one sample early or late.
    let mut cable = Cable::new(Disturbance::metres(100).with_jitter(1), 42);
    let mut master = Master::new(Dialect::SICK);
    let mut encoder = Device::new(EncoderId::try_from(0x00153)?);

    let mut position = 0_u64;
    for frame in 0..frames {
        // To and fro, within the 32 bits of the encoder.
        position = if frame & 0x8000 == 0 { position.wrapping_add(3) } else { position.wrapping_sub(3) };
        let head = cable.down(master.transmission().head.bits());
        let samples = cable.up(encoder.set_position(position).hear(head));
        let h_frame = master.hear(&samples, FRAME_NS.saturating_mul(frame).saturating_add(10_560))?;
        if let Some(reason) = h_frame.restarted {
            println!("frame {frame}: link started anew: {reason}");
        }
    }
    let fast = master.fast().at(FRAME_NS.saturating_mul(frames), Policy::new(FRAME_NS))?;
    println!("{}", master.counters());
    println!("position {} (encoder {position}), quality {}", fast.position(), master.h_frame().quality);
    Ok(())
}
