//! Speed of the reference machine: `cargo bench -p servowire --bench cnc`.
//!
//! The program as a user runs it: four devices with crystals, drift, jitter, register writes as events and bit errors, their
//! axes at 250 kHz, positions in the command words. Its start-up is counted in.
#![allow(clippy::expect_used, clippy::std_instead_of_core)]

use std::process::{Command, Stdio};
use std::time::Instant;

/// Cycles of a run: 12 s of machine time.
const CYCLES: u32 = 3_000_000;
/// Runs; the best counts.
const RUNS: usize = 3;

fn main() {
    let cycles = CYCLES.to_string();
    let arguments = ["cnc", "--cycles", &cycles, "--bit-error-rate", "1e-9"];
    let mut best = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        let run = Command::new(env!("CARGO_BIN_EXE_servowire")).args(arguments).stdout(Stdio::null()).status();
        best = best.min(start.elapsed().as_secs_f64());
        assert!(run.expect("the program starts").success(), "a step was lost");
    }
    println!("{CYCLES} cycles of four devices: {:.2} million cycles/s", f64::from(CYCLES) / best / 1e6);
}
