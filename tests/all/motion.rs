//! From a move to the edges of STEP: an axis of step-profile, the PTO words of sorte-proto, and its SYNC0 handler on an
//! ideal timer. No step is lost, and none is more than a few nanoseconds from where it belongs.

use proptest::prelude::*;
use sorte_proto::Pto;
use sorte_proto::iep::Channel;
use sorte_proto::sync0::{CMP7_NS, MAX_LATENCY_NS, Variant};
use step_profile::{Arithmetic, Axis, Command, Direction, Parameters, Profile, Speed, Tone};

/// What the word and the 5 ns of the timer may do to a step, in ns.
const ERROR: core::ops::RangeInclusive<i64> = -14..=9;

/// The level of DIR, which both crates give the same code.
fn level(direction: Direction) -> sorte_proto::Direction {
    sorte_proto::Direction::from_code(direction.code()).unwrap()
}

fn word(command: Command) -> Pto {
    match command {
        Command::Disable => Pto::DriverOff,
        Command::Hold { direction } => Pto::NoPulse { direction: level(direction) },
        Command::Pulse { direction, sync_time } => Pto::from_step(sync_time, level(direction)).unwrap(),
    }
}

/// Runs a move and compares its rising edges with the times of its steps. The word of a cycle is for the next one.
fn run(profile: Profile<'_>, steps: u32, latency_ns: u16) -> Result<(), TestCaseError> {
    let want: Vec<i64> =
        profile.steps(steps).map(|s| i64::try_from((s.cycle + 1) * 4000).unwrap() + i64::from(s.sync_time)).collect();
    let cycles = profile.steps(steps).last().map_or(0, |s| s.cycle) + 3;
    let mut axis = Axis::new();
    axis.start(profile, steps, Direction::Reverse).unwrap();
    let mut output = Channel::new(Variant::Lossless, CMP7_NS, latency_ns);
    let mut edges = Vec::new();
    for cycle in 0..cycles {
        let word = word(axis.tick());
        prop_assert!(word.direction().is_some_and(sorte_proto::Direction::is_high), "DIR is held in cycle {}", cycle);
        output.set_start(word.start());
        while let Some(edge) = output.next_edge((cycle + 1) * 4000) {
            edges.extend(edge.high.then(|| i64::try_from(edge.ns).unwrap()));
        }
    }
    prop_assert_eq!(edges.len(), want.len(), "a step is lost or doubled");
    for (step, (edge, want)) in edges.iter().zip(&want).enumerate() {
        prop_assert!(ERROR.contains(&(edge - want)), "step {}: {} ns off", step, edge - want);
    }
    Ok(())
}

/// The tones of Table 3 as they are played.
#[test]
fn every_tone() {
    for tone in Tone::ALL {
        let profile = Profile::new(Parameters::at(tone.speed())).unwrap();
        run(profile, tone.p125(), 300).unwrap();
    }
}

/// All pulses at sync_time 0, which the wire cannot carry, and all at the end of the cycle.
#[test]
fn the_trap_of_phase_0_loses_no_step() {
    for init_sync in [0, 1, 3990, 3991, 3999] {
        let profile = Profile::new(Parameters::at(Speed::KHZ_250).with_init_sync(init_sync)).unwrap();
        run(profile, 5000, 0).unwrap();
        run(profile, 5000, MAX_LATENCY_NS).unwrap();
    }
}

proptest! {
    #[test]
    fn every_step_of_any_move(
        speed in 262_144..800_000_u32, k in 1..4_u32, init_sync in 0..4000_u32, steps in 1..400_u32,
        carried: bool, latency in 0..=MAX_LATENCY_NS,
    ) {
        let arithmetic = if carried { Arithmetic::Carried } else { Arithmetic::Corrected };
        let at = Parameters::at(Speed::from_raw(speed));
        let profile = Profile::new(at.with_steps_per_entry(k).with_init_sync(init_sync).with_arithmetic(arithmetic)).unwrap();
        run(profile, steps, latency)?;
    }
}
