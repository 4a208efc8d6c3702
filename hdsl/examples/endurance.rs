//! A receiver and an encoder on a line with jitter, for as many H-frames as you like:
//! `cargo run --release -p hdsl --example endurance -- 10000000`.
//!
//! Ten million H-frames are two minutes of a free-running link.

use hdsl::cable::{Cable, Disturbance};
use hdsl::device::Device;
use hdsl::master::Master;
use hdsl::{Dialect, EncoderId, Policy};

/// A free-running H-frame, and when in it the window of its answer ends.
const FRAME_NS: u64 = 11_520;
const WINDOW_NS: u64 = 10_560;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let frames: u64 = std::env::args().nth(1).map_or(Ok(100_000), |n| n.parse())?;
    // 100 m of cable, every edge up to one sample early or late.
    let mut cable = Cable::new(Disturbance::metres(100).with_jitter(1), 42);
    let mut master = Master::new(Dialect::SICK);
    let mut encoder = Device::new(EncoderId::try_from(0x00153)?);

    let (mut position, mut start_ns) = (0_u64, 0_u64);
    for frame in 0..frames {
        // To and fro, within the 32 bits of the encoder.
        position = if frame & 0x8000 == 0 { position.wrapping_add(3) } else { position.wrapping_sub(3) };
        let head = cable.down(master.transmission().head.bits());
        let samples = cable.up(encoder.hear_at(head, position));
        let h_frame = master.hear(&samples, start_ns.saturating_add(WINDOW_NS))?;
        start_ns = start_ns.saturating_add(FRAME_NS);
        if let Some(reason) = h_frame.restarted {
            println!("frame {frame}: link started anew: {reason}");
        }
    }
    let fast = master.fast().at(start_ns, Policy::new(FRAME_NS))?;
    println!("{frames} H-frames: {:?}", master.counters());
    println!("position {} (encoder {position}), quality {}", fast.position(), master.h_frame().quality);
    Ok(())
}
