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
use rtex_block::MacId;
use rtex_block::master::{
    ActiveCode, Asic, AxisState, Fault, Inputs, Limits, Order, Phase, PhaseControl, Slave, StopReason, compare, led,
};
use rtex_block::timing::{FrameTime, Periods, TimerSystem};

/// Unchanged echoes that count as a time-out: 4 ms.
const ECHO_LIMIT: NonZeroU16 = NonZeroU16::MIN.saturating_add(7);

const LIMITS: Limits = Limits::new(ECHO_LIMIT, 100).with_ready(400);

/// Update periods of motion before the drive goes silent, and of recording after it.
const BEFORE: u64 = 2_000;
const AFTER: u64 = 400;

/// The drive that goes silent.
const SILENT: usize = 11;

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "rtex-ring.svg".to_owned());
    if out.starts_with('-') {
        println!("usage: rtex-ring [OUT.svg]\n\nRuns the ring and draws it; without a name into rtex-ring.svg.");
        return Ok(());
    }
    check_periods()?;

    let mut bench = Bench::new(ActiveCode::CyclicPosition, LIMITS)?;
    let mut phases = PhaseControl::new();
    start_communication(&bench, &mut phases);

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
    while bench.now < silent_at + AFTER {
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

/// When the ASIC of this example gets to each of its states, ms.
const ASIC: [(f64, Asic); 4] =
    [(20.0, Asic::Initial), (140.0, Asic::RingConfig), (1_300.0, Asic::Ready), (2_100.0, Asic::Running)];

/// The slave table of the machine: 32 drives of one kind, in the order of the ring.
fn slave_table() -> [Slave; AXES] {
    core::array::from_fn(|place| Slave { mac_id: MacId::truncate(place as u8), kind: 1 })
}

/// The phases of the control function, with an ASIC that takes a while for each of its states. The main loop turns every
/// 10 ms; each change of phase or LED is shown.
fn start_communication(bench: &Bench, phases: &mut PhaseControl) {
    let found: Vec<Slave> = bench.slaves().collect();
    let table = slave_table();
    let mut shown = None;
    let mut prepared = false;
    for t_ms in (0..=2_200_u64).step_by(10) {
        let Some((_, asic)) = ASIC.iter().rev().find(|(from, _)| *from <= t_ms as f64) else { continue };
        let slave_info = (*asic == Asic::Ready).then(|| compare(&table, &found, Order::Ring));
        phases.step(Inputs { asic: *asic, slave_info, tx_ready: prepared, timeout: false });
        prepared |= phases.phase() == Phase::Prepare;
        let now = (phases.phase(), led(phases.phase(), phases.fault(), t_ms));
        if shown != Some(now) {
            println!(
                "{:9.1} ms  before the motion: ASIC {asic:?}, phase {:?}, COM LED {:?}",
                t_ms as f64, now.0, now.1
            );
            shown = Some(now);
        }
    }
}

fn report_stop(bench: &Bench, fault: Option<Fault>, silent_at: u64) {
    println!("{:9.1} ms  all servos off, {:.1} ms after", time_ms(bench.now), time_ms(bench.now - silent_at));
    if let Some((place, reason)) = bench.ring.failure() {
        println!("{:14}cause: axis {place}, {reason}; fault of the master: {fault:?}", "");
    }
}
