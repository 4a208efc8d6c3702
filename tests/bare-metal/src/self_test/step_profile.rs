//! Single steps register by register, and whole moves by their hash.

use step_profile::pru_exact::{self, Registers};
use step_profile::{Arithmetic, Parameters, Profile, RampStep, Speed, corrected};

use super::{Tally, Topic, each};

/// A row of `step_trace.jsonl` or `step_trace_edge.jsonl`.
pub(crate) struct Traced {
    why: &'static str,
    /// Ramp entry, speed constant, previous sync_time.
    given: [u32; 3],
    want: Registers,
    /// The PRU's result is the true one.
    exact: bool,
}

/// A row of `profile.jsonl`.
pub(crate) struct Move {
    name: &'static str,
    steps: u32,
    per_entry: u32,
    speed: u32,
    init_sync: u32,
    ns: u64,
    fnv1a64: u64,
}

include!(concat!(env!("OUT_DIR"), "/step-profile.rs"));

pub(crate) const TOPICS: &[Topic] = &[("step-profile/step_trace", steps), ("step-profile/profile", moves)];

fn steps() -> Tally {
    each(
        TRACES,
        |row| row.why,
        |row| {
            let [entry, speed, prev] = row.given;
            let step = pru_exact::step(entry, speed, prev);
            pru_exact::run(entry, speed, prev) == row.want
                && (step.cnt, step.sync) == (row.want.cnt, row.want.sync)
                && (!row.exact || corrected(row.want.t_step, prev) == step)
        },
    )
}

fn moves() -> Tally {
    each(
        MOVES,
        |row| row.name,
        |row| {
            let speed = Speed::from_raw(row.speed);
            let parameters = Parameters::at(speed)
                .with_steps_per_entry(row.per_entry)
                .with_init_sync(row.init_sync)
                .with_arithmetic(Arithmetic::PruExact);
            Profile::new(parameters).is_ok_and(|profile| {
                profile.duration_ns(row.steps) == row.ns
                    && profile.steps(row.steps).fold(0xcbf2_9ce4_8422_2325, hash) == row.fnv1a64
            })
        },
    )
}

/// FNV-1a over cycle (four bytes) and sync_time (two).
fn hash(hash: u64, step: RampStep) -> u64 {
    let ([c0, c1, c2, c3, ..], [s0, s1, ..]) = (step.cycle.to_le_bytes(), step.sync_time.to_le_bytes());
    [c0, c1, c2, c3, s0, s1]
        .into_iter()
        .fold(hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
