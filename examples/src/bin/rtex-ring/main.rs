//! An RTEX ring of 32 axes from power-up to a coordinated motion; half-way one drive goes silent; the master notices it by
//! the counter echo and stops all axes.
//!
//! `cargo run -p servowire-examples --bin rtex-ring -- [--swapped] [OUT.svg]` prints what happens when, a table of the axes,
//! and writes their positions as an SVG.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::std_instead_of_core,
    reason = "a program for a host"
)]

mod bench;
mod plot;

use core::num::NonZeroU16;
use std::error::Error;
use std::process::ExitCode;

use bench::{ASIC, AXES, Bench};
use rtex_block::master::{Asic, AxisState, ControlError, ControlPhase, Led, Limits, RingFailure, StopReason};
use rtex_block::timing::{FrameTime, Periods, TimerSystem};

const HELP: &str = "\
An RTEX ring of 32 axes from power-up to a motion in which one drive goes silent.

Usage: rtex-ring [--swapped] [OUT.svg]

  OUT.svg    where the positions are drawn (default: rtex-ring.svg)
  --swapped  two drives stand in each other's place: the master refuses the ring
  --help     this text";

/// Unchanged echoes that count as a time-out: 4 ms.
const ECHO_LIMIT: NonZeroU16 = NonZeroU16::MIN.saturating_add(7);

const LIMITS: Limits = Limits::new(ECHO_LIMIT, 100).with_ready(Some(400));

/// Update periods of motion before the drive goes silent, of recording after it, and until the program ends.
const BEFORE: u64 = 2_000;
const RECORDED: u64 = 400;
const AFTER: u64 = 2_400;

/// Update periods from one turn of the main loop to the next: 10 ms.
const LOOP: u64 = 20;

/// The drive that goes silent.
const SILENT: usize = 11;

fn main() -> ExitCode {
    let (mut out, mut swapped) = ("rtex-ring.svg".to_owned(), false);
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--help" | "-h" => {
                println!("{HELP}");
                return ExitCode::SUCCESS;
            }
            "--swapped" => swapped = true,
            option if option.starts_with('-') => {
                eprintln!("error: no option {option}\n\n{HELP}");
                return ExitCode::from(2);
            }
            _ => out = argument,
        }
    }
    match run(&out, swapped) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(out: &str, swapped: bool) -> Result<(), Box<dyn Error>> {
    let periods = periods()?;
    let mut bench = Bench::new(periods, LIMITS, swapped)?;
    let mut lamp = Lamp::default();
    start_communication(&mut bench, &mut lamp)?;
    if let Some(fault) = bench.master.error() {
        return Err(format!("the ring does not start: {fault:?}").into());
    }

    until(&mut bench, &mut lamp, "all drives ready, servo off", AxisState::Off)?;
    bench.master.ring_mut().switch_on()?;
    until(&mut bench, &mut lamp, "all servos on", AxisState::On)?;

    let begin = bench.now;
    while bench.now < begin + BEFORE {
        bench.command_wave(begin)?;
        update(&mut bench, &mut lamp)?;
    }
    bench.silence(SILENT);
    let silent_at = bench.now;
    say(bench.time_ms(silent_at), &format!("drive {SILENT} goes silent in the middle of the motion"));

    let mut stopped_at = None;
    while bench.now < silent_at + AFTER {
        if bench.master.ring().failure().is_none() {
            bench.command_wave(begin)?;
        }
        update(&mut bench, &mut lamp)?;
        if stopped_at.is_none() && bench.all_off() {
            stopped_at = Some(bench.now);
            report_stop(&bench, silent_at);
        }
    }
    bench.print_table();
    let marks = [
        (bench.time_ms(silent_at), "drive silent"),
        (bench.time_ms(stopped_at.unwrap_or(bench.now)), "all servos off"),
    ];
    let end = bench.time_ms(silent_at + RECORDED);
    let shown = bench.history.partition_point(|(at, _)| *at <= end);
    plot::positions(out, bench.history.get(..shown).unwrap_or_default(), &marks)?;
    println!("positions: {out}");
    match (bench.master.error(), stopped_at) {
        (Some(ControlError::Timeout), Some(_)) => Ok(()),
        other => Err(format!("the ring did not stop as it must: {other:?}").into()),
    }
}

fn say(time_ms: f64, what: &str) {
    println!("{time_ms:9.1} ms  {what}");
}

/// 0.5 ms is in the table of the A6N family and works with the internal timer, and a frame with all axes fits it.
fn periods() -> Result<Periods, String> {
    let periods = Periods::from_a6n(3, 1, None).ok_or("Pr7.20 = 3, Pr7.21 = 1 is not in the table")?;
    let frame_ns = FrameTime::GUIDE.estimate_ns(AXES as u32);
    println!(
        "update period {} us, communication period {} us, internal timer {}; a frame with {AXES} axes takes about {} us",
        periods.update_ns / 1_000,
        periods.com_ns / 1_000,
        if TimerSystem::Internal.allows(&periods) { "possible" } else { "not possible" },
        frame_ns / 1_000,
    );
    if frame_ns <= u64::from(periods.com_ns) {
        Ok(periods)
    } else {
        Err("the ring does not fit its periods".to_owned())
    }
}

/// ControlPhase, fault and COM LED as they were shown last. A flashing LED begins lit when its pattern does.
#[derive(Default)]
struct Lamp {
    since_ms: u64,
    state: Option<(ControlPhase, Option<ControlError>)>,
    shown: Option<(ControlPhase, Led)>,
}

impl Lamp {
    /// The end of a turn of the main loop.
    fn show(&mut self, bench: &Bench, time_ms: u64, asic: Asic) {
        let master = &bench.master;
        let state = (master.phase(), master.error());
        let pattern = |(phase, fault)| rtex_block::master::pattern(phase, fault);
        if self.state.map(pattern) != Some(pattern(state)) {
            self.since_ms = time_ms;
        }
        self.state = Some(state);
        let now = (master.phase(), master.led(time_ms - self.since_ms));
        if self.shown != Some(now) {
            let fault = master.error().map_or(String::new(), |fault| format!(", fault {fault:?}"));
            say(time_ms as f64, &format!("ASIC {asic:?}, phase {:?}{fault}, COM LED {:?}", now.0, now.1));
            self.shown = Some(now);
        }
    }
}

/// The main loop up to PH_RUNNING, with an ASIC that takes a while for each of its states. Interrupts are off, so the loop
/// writes the first transmit data itself.
fn start_communication(bench: &mut Bench, lamp: &mut Lamp) -> Result<(), Box<dyn Error>> {
    let found = bench.found();
    let [.., (running, _)] = ASIC;
    for time_ms in (0..).step_by(10) {
        let Some((_, asic)) = ASIC.iter().rev().find(|(from, _)| *from <= time_ms) else { continue };
        // The slaves are known once the ring is closed.
        bench.master.control(*asic, (*asic == Asic::Ready).then_some(&found));
        if bench.master.phase() == ControlPhase::Prepare {
            bench.exchange()?;
        }
        lamp.show(bench, time_ms, *asic);
        if bench.master.is_running() || bench.master.error().is_some() && time_ms > running {
            return Ok(());
        }
    }
    Ok(())
}

/// An update period, and in every twentieth of them a turn of the main loop.
fn update(bench: &mut Bench, lamp: &mut Lamp) -> Result<(), Box<dyn Error>> {
    bench.update()?;
    if bench.now % LOOP == 0 {
        bench.master.control(Asic::Running, None);
        lamp.show(bench, bench.time_ms(bench.now) as u64, Asic::Running);
    }
    Ok(())
}

/// Updates until all axes are in this state, and says so.
fn until(bench: &mut Bench, lamp: &mut Lamp, what: &str, state: AxisState) -> Result<(), Box<dyn Error>> {
    let end = bench.now + 1_000;
    while !bench.master.ring().all_are(state) {
        if bench.now == end {
            return Err(format!("{what}: not reached, {:?}", bench.master.ring().failure()).into());
        }
        update(bench, lamp)?;
    }
    say(bench.time_ms(bench.now), what);
    Ok(())
}

fn report_stop(bench: &Bench, silent_at: u64) {
    let after = bench.time_ms(bench.now) - bench.time_ms(silent_at);
    say(bench.time_ms(bench.now), &format!("all servos off, {after:.1} ms after"));
    if let Some(RingFailure { place, reason: reason @ StopReason::EchoTimeout }) = bench.master.ring().failure() {
        println!("{:14}cause: axis {place}, {reason}; fault of the master: {:?}", "", bench.master.error());
    }
}
