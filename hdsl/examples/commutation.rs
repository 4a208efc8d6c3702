//! From the link to the field of a motor: `cargo run -p hdsl --example commutation`.
//!
//! A rotary encoder of 32 bits with 2^18 steps a turn on a motor of four pole pairs. The receiver puts its evidence into a cell, one
//! H-frame after the other; the current control takes the electrical angle out of it, at instants of its own. At 3 ms a word of the
//! acceleration channel is lost on the line: the angle goes on, with a bound that grows until a safe position has told.

#![allow(clippy::arithmetic_side_effects)]

use hdsl::device::Device;
use hdsl::master::{Master, State};
use hdsl::{Dialect, EncoderId, EvidenceShaftCell, Policy, Tolerated};
use servowire_core::{Acceleration, Angle, Commutation, Sense, Tracker};

/// A free-running H-frame, and the end of the window of its answer.
const FRAME_NS: u64 = 11_520;
const WINDOW_NS: u64 = 10_560;
/// RESOLUTN, resource 081h of the encoder.
const STEPS_PER_TURN: u32 = 1 << 18;
/// 300 turns per second squared are 0.01 steps a frame²; positions in whole steps make up to 2 of any such motion.
const STEPS_PER_FRAME2: u16 = 2;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let mut master = Master::new(Dialect::SICK);
    let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
    master.set_steps_per_turn(STEPS_PER_TURN);
    // 20 m of cable at 5 ns each, and what an encoder takes at most.
    master.set_latency_ns(200);

    // Found once on the motor: with the rotor held by a current in the d axis the encoder's angle was 75.3 degrees of the field.
    let commutation =
        Commutation::new(4, Angle::from_millidegrees(75_300), Sense::Up).ok_or("a motor has pole pairs")?;
    let acceleration = Acceleration::from_turns_per_s2(300).ok_or("slower")?;
    // Not older than two H-frames, and over up to 8 missing words.
    let policy = Policy::new(2 * FRAME_NS).tolerating(Tolerated::missing_words(8, STEPS_PER_FRAME2));
    let mut cell = EvidenceShaftCell::new();
    let (mut writer, mut reader) = cell.split(Tracker::new(STEPS_PER_TURN, 100).ok_or("fewer turns")?);

    for frame in 0..290_u64 {
        // 100 turns per second: 302 steps in a frame.
        let answer = encoder.set_position(frame.wrapping_mul(302)).hear(master.transmission().head.bits());
        let mut bits = answer.map_or(u64::MAX, |answer| answer.bits);
        if frame == 260 {
            bits ^= 1 << 43;
        }
        let end_ns = FRAME_NS.wrapping_mul(frame).wrapping_add(WINDOW_NS);
        let _ = master.hear_bits(bits, None, end_ns);
        writer.put(master.fast(), end_ns, policy);

        // The current control, 3 µs later.
        let now_ns = end_ns.wrapping_add(3_000);
        if master.state() != State::Running || frame < 255 {
            continue;
        }
        let sample = reader.at(now_ns, policy)?;
        let field = reader.angle(now_ns, policy, commutation, acceleration)?;
        // What the missing word leaves open in the position is part of the bound.
        let missing = commutation.bound(sample.angle_bound());
        println!(
            "frame {:3}: field at {:7.3} degrees, within {:.3}, of which {:.3} for missing words",
            sample.frame(),
            f64::from(field.angle.millidegrees()) / 1e3,
            f64::from(field.bound.millidegrees()) / 1e3,
            f64::from(missing.millidegrees()) / 1e3
        );
    }
    Ok(())
}
