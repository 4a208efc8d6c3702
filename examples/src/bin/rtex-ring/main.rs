//! An RTEX ring of 32 axes from power-up to a coordinated motion; half way one drive goes silent, the master notices by
//! the counter echo and stops all axes.
//!
//! `cargo run -p servowire-examples --bin rtex-ring [OUT.svg]` prints what happens when, a table of the axes, and writes
//! their positions as an SVG (default `rtex-ring.svg`).
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::std_instead_of_core,
    reason = "a program for a host"
)]

mod bench;
mod plot;

use core::num::NonZeroU16;
use std::error::Error;

use bench::{AXES, Bench, UPDATE_NS, time_ms};
use rtex_block::master::{
    ActiveCode, Asic, AxisState, Fault, Inputs, Limits, Order, PhaseControl, Slave, StopReason, compare, led,
};
use rtex_block::timing::{FrameTime, Periods, TimerSystem};

/// Unchanged echoes that count as a time-out: 4 ms.
const ECHO_LIMIT: NonZeroU16 = NonZeroU16::MIN.saturating_add(7);

const LIMITS: Limits = Limits::new(ECHO_LIMIT, 100).with_ready(400);

/// Update periods of motion before the drive goes silent, and of recording behind it.
const BEFORE: u64 = 2_000;
const BEHIND: u64 = 400;

/// The drive that goes silent.
const SILENT: usize = 11;

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "rtex-ring.svg".to_owned());
    check_periods()?;

    let mut bench = Bench::new(ActiveCode::CyclicPosition, LIMITS)?;
    let mut phases = PhaseControl::new();
    start_communication(&mut bench, &mut phases);

    bench.until("all drives ready, servo off", 1_000, |bench| bench.ring.all_are(AxisState::Off))?;
    bench.ring.switch_on();
    bench.until("all servos on", 1_000, |bench| bench.ring.all_are(AxisState::On))?;

    let begin = bench.now;
    while bench.now < begin + BEFORE {
        bench.command_wave(begin)?;
        bench.update();
    }
    bench.silence(SILENT);
    let silent_at = bench.now;
    println!("{:9.1} ms  drive {SILENT} goes silent in the middle of the motion", time_ms(silent_at));

    let mut stopped_at = None;
    while bench.now < silent_at + BEHIND {
        if bench.ring.failure().is_none() {
            bench.command_wave(begin)?;
        }
        bench.update();
        let timeout = matches!(bench.ring.failure(), Some((_, StopReason::EchoTimeout)));
        phases.step(Inputs { asic: Asic::Running, slave_info: None, tx_ready: true, timeout });
        if stopped_at.is_none() && bench.all_off() {
            stopped_at = Some(bench.now);
            report_stop(&bench, phases.fault(), silent_at);
        }
    }
    bench.print_table();
    plot::positions(
        &out,
        &bench.history,
        &[(silent_at, "drive silent"), (stopped_at.unwrap_or(bench.now), "all servos off")],
    )?;
    println!("positions: {out}");
    match (phases.fault(), stopped_at) {
        (Some(Fault::Timeout), Some(_)) => Ok(()),
        other => Err(format!("the ring did not stop as it must: {other:?}").into()),
    }
}

/// 0.5 ms is in the table of the A6N family, and a frame with all axes fits it.
fn check_periods() -> Result<(), String> {
    let periods = Periods::from_a6n(3, 1, None).ok_or("Pr7.20 = 3, Pr7.21 = 1 is not in the table")?;
    let frame_ns = FrameTime::GUIDE.estimate_ns(AXES as u32);
    println!(
        "update period {} us, communication period {} us, internal timer {}; a frame with {AXES} axes takes about {} us",
        periods.update_ns / 1_000,
        periods.com_ns / 1_000,
        if TimerSystem::Internal.allows(&periods) { "possible" } else { "not possible" },
        frame_ns / 1_000,
    );
    if periods.update_ns == UPDATE_NS && frame_ns <= u64::from(periods.com_ns) {
        Ok(())
    } else {
        Err("the ring does not fit its periods".to_owned())
    }
}

/// The phases of the control function, with an ASIC that takes a while for each of its states.
fn start_communication(bench: &mut Bench, phases: &mut PhaseControl) {
    let found: Vec<Slave> = bench.slaves().collect();
    let table = found.clone();
    let states = [Asic::Initial, Asic::RingConfig, Asic::Ready, Asic::Ready, Asic::Running];
    for asic in states {
        let slave_info = (asic == Asic::Ready).then(|| compare(&table, &found, Order::Ring));
        phases.step(Inputs { asic, slave_info, tx_ready: asic == Asic::Ready, timeout: false });
        let now_ms = bench.now * u64::from(UPDATE_NS) / 1_000_000;
        println!(
            "{:9.1} ms  ASIC {asic:?}, phase {:?}, COM LED {:?}",
            time_ms(bench.now),
            phases.phase(),
            led(phases.phase(), phases.fault(), now_ms),
        );
    }
}

fn report_stop(bench: &Bench, fault: Option<Fault>, silent_at: u64) {
    println!("{:9.1} ms  all servos off, {:.1} ms after", time_ms(bench.now), time_ms(bench.now - silent_at));
    if let Some((place, reason)) = bench.ring.failure() {
        println!("{:14}cause: axis {place}, {reason:?}; fault of the master: {fault:?}", "");
    }
}
