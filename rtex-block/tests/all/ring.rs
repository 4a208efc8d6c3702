//! A master and 32 drives on a simulated ring, with faults.
//!
//! `tests/hostile.rs` runs longer, with impolite drives.

use core::num::NonZeroU16;

use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, OpenCodes};
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, Fellows, Heard, Limits, Master, Ring, RingFailure, StopCategory,
    StopReason,
};
use rtex_block::position::step;
use rtex_block::{Alarm, Command, CommandBlock, MacId, Response};
use servowire_world::Draw;

use crate::common::{CODES, Pair, limits};

const AXES: usize = 32;
const LIMIT: u16 = 8;
/// Update periods from a fault until every servo is off: the limit that notices it, one for the command to get there,
/// one for the drive to obey.
const OFF_WITHIN: u32 = LIMIT as u32 + 2;

fn axis(number: u8) -> Axis {
    let limit = NonZeroU16::new(LIMIT).unwrap();
    let limits = Limits::new(limit, 50).with_ready(Some(200)).with_inactive(10);
    Axis::new(AxisConfig::new(MacId::new(number).unwrap(), ActiveCode::CyclicPosition, 500_000, limits))
}

/// What the line does to one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Line {
    Good,
    /// Responses are lost; commands arrive.
    Deaf,
    /// Nothing passes in either direction.
    Cut,
    /// C/R of the commands is 1.
    Turned,
    /// Commands have an undefined cyclic code.
    BadCode,
    /// Responses carry another MAC-ID.
    WrongMac,
    /// Bit 30 of Command_Data1 is flipped: nothing notices that but the drive's limit of the step.
    Jump,
}

struct Bench {
    ring: Ring<AXES>,
    drives: [Drive; AXES],
    lines: [Line; AXES],
    responses: [Heard; AXES],
    commands: [Command; AXES],
    /// Responses come one update period later, as when an exchange misses the start of its frame.
    late: bool,
    held: [Heard; AXES],
    started: bool,
    now: u64,
}

impl Bench {
    fn new(invalid: u32) -> Self {
        let number = |k: usize| k as u8;
        Self {
            ring: Ring::new(core::array::from_fn(|k| axis(number(k))), invalid).unwrap(),
            drives: core::array::from_fn(|k| {
                Drive::new(DriveConfig::new(MacId::new(number(k)).unwrap(), OpenCodes::INVENTED))
            }),
            lines: [Line::Good; AXES],
            responses: [Heard::Nothing; AXES],
            commands: core::array::from_fn(|k| Command::nop(MacId::new(number(k)).unwrap())),
            late: false,
            held: [Heard::Nothing; AXES],
            started: false,
            now: 0,
        }
    }

    /// One update period: the master reads and writes, then the frame goes round.
    fn update(&mut self) {
        let responses = if self.late { core::mem::replace(&mut self.held, self.responses) } else { self.responses };
        self.commands = self.ring.update(&responses, self.now * 500_000).map(|command| command.main);
        self.frame();
    }

    /// The frame goes round, with what the master wrote last.
    fn frame(&mut self) {
        self.now += 1;
        for k in 0..AXES {
            let mut command = self.commands[k].emit();
            self.check_command(k, &command);
            match self.lines[k] {
                Line::Turned => command[0] |= 0x80,
                Line::BadCode => command[1] |= 0x50,
                Line::Jump => command[7] ^= 0x40,
                _ => {}
            }
            if self.lines[k] == Line::Cut {
                self.drives[k].framing_error();
                self.responses[k] = Heard::Nothing;
                continue;
            }
            let before = self.drives[k].position();
            let mut response = self.drives[k].hear(&command).unwrap();
            assert!(step(before, self.drives[k].position()).abs() <= 60_000, "axis {k} jumps at {}", self.now);
            if self.lines[k] == Line::WrongMac {
                response[0] ^= 1;
            }
            self.responses[k] =
                if self.lines[k] == Line::Deaf { Heard::Nothing } else { Response::parse(&response).into() };
        }
    }

    /// Once started no NOP goes out, and a failed ring sends nothing but servo-off.
    fn check_command(&mut self, k: usize, command: &[u8; 16]) {
        let block = CommandBlock::of(command).unwrap();
        self.started |= block.obeys_control();
        assert_eq!(block.obeys_control(), self.started);
        if self.ring.failure().is_some() {
            assert!(block.is_servo_off(), "axis {k} at {}", self.now);
        }
    }

    fn until(&mut self, limit: u32, mut done: impl FnMut(&Self) -> bool) -> u32 {
        for passed in 0..=limit {
            if done(self) {
                return passed;
            }
            self.update();
        }
        panic!("not done after {limit} update periods: {:?}", self.ring.failure());
    }

    fn switch_on(&mut self) {
        // Of an axis that was on, activity from before may still be reported for a turn of the counter.
        self.until(200, |bench| bench.ring.axes().iter().all(|axis| axis.can_switch_on().is_ok()));
        self.ring.switch_on().unwrap();
        self.until(50, |bench| bench.ring.all_are(AxisState::On));
    }

    fn all_off(&self) -> bool {
        self.drives.iter().all(|drive| !drive.is_active())
    }

    /// Moves every axis on, each at its own pace, to and fro.
    fn command_motion(&mut self) {
        for (k, axis) in self.ring.axes_mut().iter_mut().enumerate() {
            if axis.state() == AxisState::On {
                let forth = (self.now / 400 + k as u64) % 2 == 0;
                let by = (k as i32 + 1) * if forth { 50 } else { -50 };
                axis.set_position(axis.setpoint().wrapping_add(by)).unwrap();
            }
        }
    }

    fn repair(&mut self) {
        self.lines = [Line::Good; AXES];
        for drive in &mut self.drives {
            drive.clear_alarm();
            drive.set_fault(Fault::None);
        }
        self.ring.clear();
        self.switch_on();
    }
}

#[test]
fn starts_moves_and_stops() {
    let mut bench = Bench::new(20);
    start_move_and_stop(&mut bench);
}

#[test]
fn one_more_period_of_delay_is_no_fault() {
    let mut bench = Bench::new(3);
    bench.late = true;
    start_move_and_stop(&mut bench);
}

fn start_move_and_stop(bench: &mut Bench) {
    bench.switch_on();
    for _ in 0..2_000 {
        bench.command_motion();
        bench.update();
    }
    assert_eq!(bench.ring.failure(), None);
    assert!(bench.drives.iter().all(|drive| drive.position() != 0));
    bench.ring.switch_off();
    bench.until(5, |bench| bench.ring.all_are(AxisState::Off));
    assert!(bench.all_off());
}

#[test]
fn after_every_fault_every_servo_is_off_in_time() {
    let periods = 40_000;
    let mut bench = Bench::new(5);
    let mut draw = Draw::default();
    let mut below = |limit: usize| draw.below(limit as u64) as usize;
    let mut faults = [0_u32; 12];
    bench.switch_on();
    while bench.now < periods {
        for _ in 0..20 + below(400) {
            bench.command_motion();
            bench.update();
            assert_eq!(bench.ring.failure(), None, "at {}", bench.now);
        }
        let (k, kind) = (below(AXES), below(faults.len()));
        faults[kind] += 1;
        if kind < 3 {
            // Too short to matter: one update period without a response, or with a command that is thrown away.
            bench.lines[k] = [Line::Deaf, Line::BadCode, Line::Cut][kind];
            bench.update();
            bench.lines[k] = Line::Good;
            continue;
        }
        match kind {
            3 => bench.drives[k].set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
            4 => bench.drives[k].set_fault(Fault::NoMainPower),
            5 => bench.lines[k] = Line::Deaf,
            6 => bench.lines[k] = Line::Cut,
            7 => bench.lines = [Line::Cut; AXES],
            8 => bench.lines[k] = Line::Turned,
            9 => bench.lines[k] = Line::WrongMac,
            10 => bench.lines[k] = Line::Jump,
            // The master hangs: the same blocks go round again and again.
            _ => (0..LIMIT).for_each(|_| bench.frame()),
        }
        bench.until(OFF_WITHIN, Bench::all_off);
        bench.until(OFF_WITHIN, |bench| bench.ring.failure().is_some());
        bench.repair();
    }
    assert!(faults.iter().all(|&n| n > 0), "{faults:?}");
}

/// An axis that slows down in CP for a stop on request.
fn stopping() -> Pair {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits()).with_deceleration(100);
    let mut pair = Pair::with(config, DriveConfig::new(mac_id, CODES));
    pair.switch_on();
    for speed in (0..5_000).step_by(100) {
        let to = pair.axis.setpoint().wrapping_add(speed);
        pair.axis.set_position(to).unwrap();
        pair.update();
    }
    pair.axis.stop(StopCategory::One);
    pair.update();
    pair
}

/// Two axes that fail in the same update period do not make up for each other: an axis that slows down on request is switched off
/// as it is configured to be beside a fault.
#[test]
fn two_faults_in_one_period_are_faults() {
    let mut fellow = stopping();
    assert_eq!(fellow.axis.state(), AxisState::Stopping(StopReason::Requested));
    let mut faulty = Pair::on(ActiveCode::CyclicPosition, Behaviour::default());
    faulty.drive.set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
    faulty.until("stopped", |pair| pair.axis.state() == AxisState::Stopped(StopReason::Alarm));
    let mut fellows = Fellows::new();
    fellows.begin();
    (0..2).for_each(|place| fellows.look(place, &faulty.axis));
    fellows.tell(&mut fellow.axis);
    // At once, and the first reason stays.
    assert_eq!(fellow.axis.state(), AxisState::Stopped(StopReason::Requested));
}

/// A fault stays one, whoever is looked at after it: here an axis that was stopped on request.
#[test]
fn a_fault_beside_a_stop_on_request_is_a_fault() {
    let mut faulty = Pair::on(ActiveCode::CyclicPosition, Behaviour::default());
    faulty.drive.set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
    faulty.until("stopped", |pair| pair.axis.state() == AxisState::Stopped(StopReason::Alarm));
    let mut stopped = stopping();
    stopped.until("stopped", |pair| pair.axis.state() == AxisState::Stopped(StopReason::Requested));
    for all in [[&faulty.axis, &stopped.axis], [&stopped.axis, &faulty.axis]] {
        let (mut fellow, mut fellows) = (stopping(), Fellows::new());
        fellows.begin();
        (0..).zip(all).for_each(|(place, axis)| fellows.look(place, axis));
        fellows.tell(&mut fellow.axis);
        assert_eq!(fellow.axis.state(), AxisState::Stopped(StopReason::Requested));
    }
}

/// Without a fault each axis stops in its own time, whatever it would do if another one failed.
#[test]
fn a_stop_on_request_takes_its_own_time() {
    let mut stopped = stopping();
    stopped.until("stopped", |pair| pair.axis.state() == AxisState::Stopped(StopReason::Requested));
    let (mut fellow, mut fellows) = (stopping(), Fellows::new());
    assert_eq!(fellow.axis.config().stop, Some(StopCategory::Zero));
    fellows.begin();
    fellows.look(0, &stopped.axis);
    fellows.tell(&mut fellow.axis);
    assert_eq!(fellow.axis.state(), AxisState::Stopping(StopReason::Requested));
}

/// The ring says at once, not with the next exchange, that it was stopped.
#[test]
fn a_stop_of_the_ring_is_a_failure_at_once() {
    let mut bench = Bench::new(3);
    bench.switch_on();
    bench.ring.stop(StopCategory::Zero);
    let failure = RingFailure { place: 0, reason: StopReason::Requested };
    assert_eq!(bench.ring.failure(), Some(failure));
}

/// What the README says of the memory that an axis and a master take.
#[test]
fn a_master_of_32_axes_takes_so_much() {
    assert!(size_of::<Axis>() <= 320 && size_of::<Master<32>>() <= 10_450, "{}", size_of::<Master<32>>());
}
