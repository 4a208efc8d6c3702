//! A master and four impolite drives over lines that lose, delay and repeat blocks, with faults that last.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p rtex-block --test all hostile::` runs ten million update periods.

use core::num::NonZeroU16;

use crate::common::CODES;
use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, Quirks};
use rtex_block::master::{
    ActiveCode, Asic, Axis, AxisConfig, AxisState, ControlError, ControlPhase, Limits, Master, MasterConfig,
    RingFailure, Slave, StopCategory,
};
use rtex_block::position::Gear;
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{Alarm, Arguments, BlockSize, CommandBlock, MacId, NonCyclicCommand, SubCode, TypeCode, pack};
use servowire_world::{Cable, Draw, Kind, Rates, Scenario, Tally, wanted_events};

const AXES: usize = 4;
const PERIOD_NS: u64 = 500_000;
const LIMIT: u16 = 8;
/// Update periods from a fault until every motor is released: the limit that notices it, one for the command to get there,
/// one for the drive to obey, three that its status may be late, and four that frames may be lost meanwhile.
const OFF_WITHIN: u64 = LIMIT as u64 + 2 + 3 + 4;

fn behaviour(draw: &mut Draw) -> Behaviour {
    let mut some = |limit| draw.below(limit) as u16;
    // Up to three exchanges for each flag, but Servo_Active, which has a lateness of its own at servo-off.
    let late = core::array::from_fn(|bit| if bit == 7 { 0 } else { some(4) as u8 });
    Behaviour::new()
        .with_status_late(late)
        .with_latch_late(some(4) as u8)
        .with_echo_lag(some(4) as u8)
        .with_in_progress_late(some(20))
        .with_servo_off_late(some(4))
        .with_stale_answers(some(4))
        .with_quirks(
            [Quirks::ALWAYS_BUSY, Quirks::ERR_WHILE_BUSY, Quirks::ALWAYS_IN_POSITION, Quirks::WARNS]
                .into_iter()
                .filter(|_| some(2) == 0)
                .collect(),
        )
}

/// One direction to or from a drive: what arrives in a period stays in the memory until something newer comes.
struct Line {
    cable: Cable,
    /// On their way, with the time of arrival.
    late: Vec<(u64, Vec<u8>)>,
}

impl Line {
    fn new(seed: u64) -> Self {
        let rates = Rates { longest_ns: 1_200_000, ..Rates::QUIET }
            .with(Kind::Drop, 2_000)
            .with(Kind::Delay, 2_000)
            .with(Kind::Repeat, 1_000)
            .with(Kind::Cut, 500)
            .with(Kind::Foreign, 500);
        Self { cable: Cable::new(20_000, Scenario::random(seed, rates)), late: Vec::new() }
    }

    /// What the memory at the other end holds of this period: the block that came last.
    fn carry(&mut self, block: &[u8], now: u64) -> Option<[u8; 32]> {
        let arrivals = self.cable.carry(block, now * PERIOD_NS);
        self.late.extend(arrivals.into_iter().map(|arrival| (arrival.at_ns, arrival.bytes)));
        let end = (now + 1) * PERIOD_NS;
        self.late.sort_by_key(|(at, _)| *at);
        let here = self.late.iter().take_while(|(at, _)| *at < end).count();
        // The ASIC takes whole frames only.
        self.late.drain(..here).rev().find_map(|(_, bytes)| bytes.try_into().ok())
    }

    fn faults(&self) -> u64 {
        self.cable.tally.faults.iter().sum()
    }
}

struct Bench {
    master: Master<AXES>,
    drives: [Drive; AXES],
    down: [Line; AXES],
    up: [Line; AXES],
    cut: [bool; AXES],
    turned: [bool; AXES],
    tx: [u32; AXES * 8],
    rx: [u32; AXES * 8],
    now: u64,
    /// The last update period in which a line did anything wrong.
    hurt: u64,
    started: bool,
}

fn mac_id(place: usize) -> MacId {
    MacId::new(place as u8 * 7 + 1).unwrap()
}

/// Electronic gears, of which one alone is 1/1.
fn gear(place: usize) -> Gear {
    let (numerator, denominator) = [(1, 1), (3, 1), (7, 4), (125, 1)][place];
    Gear::new(numerator, denominator).unwrap()
}

impl Bench {
    fn new(draw: &mut Draw) -> Self {
        let limit = NonZeroU16::new(LIMIT).unwrap();
        let limits = Limits::new(limit, 80).with_ready(Some(200)).with_stop(6);
        let policies = [StopCategory::Zero, StopCategory::One];
        let axis = |place: usize| {
            let config = AxisConfig::new(mac_id(place), ActiveCode::CyclicPosition, 500_000, limits);
            Axis::new(config.with_stop(Some(policies[place % 2])).with_deceleration(40).with_gear(gear(place)))
        };
        let table: [Slave; AXES] = core::array::from_fn(|place| Slave { mac_id: mac_id(place), kind: 3 });
        let periods = Periods::from_a6n(3, 1, None).unwrap();
        let config = MasterConfig::new(BlockSize::Bytes32, periods, TimerSystem::Internal).with_watchdog(Some(limit));
        let mut master = Master::new(config, table, core::array::from_fn(axis)).unwrap();
        master.control(Asic::RingConfig, None);
        assert_eq!(master.control(Asic::Ready, Some(&table)), ControlPhase::Prepare);
        let mut bench = Self {
            master,
            drives: core::array::from_fn(|place| {
                let config = DriveConfig::new(mac_id(place), CODES).with_gear(gear(place));
                let mut drive = Drive::new(config);
                drive.set_behaviour(behaviour(draw));
                drive
            }),
            down: core::array::from_fn(|place| Line::new(place as u64 + 1)),
            up: core::array::from_fn(|place| Line::new(place as u64 + 100)),
            cut: [false; AXES],
            turned: [false; AXES],
            tx: [0; AXES * 8],
            rx: [0; AXES * 8],
            now: 0,
            hurt: 0,
            started: false,
        };
        bench.update();
        bench.master.control(Asic::Ready, None);
        assert_eq!(bench.master.control(Asic::Running, None), ControlPhase::Running);
        bench
    }

    fn update(&mut self) {
        self.master.exchange_words(&self.rx, &mut self.tx, self.now * PERIOD_NS).unwrap();
        self.judge();
        self.frame();
    }

    /// The laws of every update period, on the blocks as they are in the memory.
    fn judge(&mut self) {
        let fault = self.master.error();
        for place in 0..AXES {
            let mut block = [0; 32];
            pack::from_words(&self.tx[place * 8..place * 8 + 8], &mut block).unwrap();
            let main = *block.first_chunk().unwrap();
            let view = CommandBlock::of(&main).unwrap();
            self.started |= view.obeys_control();
            assert_eq!(view.obeys_control(), self.started, "a NOP at {}", self.now);
            let state = self.master.ring().axes()[place].state();
            assert!(view.is_servo_off() || state.is_servo_on() || !self.started, "{state} at {}", self.now);
            // A failure of the communication is servo-off for all, at once.
            assert!(fault.is_none() || view.is_servo_off() || !self.started, "{state} at {}", self.now);
        }
    }

    /// A frame goes round with what the master wrote last.
    fn frame(&mut self) {
        self.now += 1;
        let before: u64 = self.down.iter().chain(&self.up).map(Line::faults).sum();
        let mut any = false;
        for place in 0..AXES {
            let words = place * 8..place * 8 + 8;
            let mut block = [0; 32];
            pack::from_words(&self.tx[words.clone()], &mut block).unwrap();
            let from = self.drives[place].position();
            let command = if self.cut[place] { None } else { self.down[place].carry(&block, self.now) };
            if let Some(command) = command {
                let mut response = self.drives[place].hear(&command).unwrap();
                response[0] ^= u8::from(self.turned[place]);
                if let Some(block) = self.up[place].carry(&response, self.now) {
                    any = true;
                    pack::to_words(&block, &mut self.rx[words]).unwrap();
                }
            } else {
                self.drives[place].framing_error();
            }
            let by = self.drives[place].position().wrapping_sub(from);
            assert!(by.abs() <= 3_000, "axis {place} jumps by {by} at {}", self.now);
        }
        if any {
            assert!(!self.master.frame_received());
        }
        if self.down.iter().chain(&self.up).map(Line::faults).sum::<u64>() != before {
            self.hurt = self.now;
        }
    }

    fn until(&mut self, what: &str, limit: u64, mut done: impl FnMut(&mut Self) -> bool) {
        for _ in 0..=limit {
            if done(self) {
                return;
            }
            self.update();
        }
        let states = self.master.ring().axes().each_ref().map(Axis::state);
        panic!("{what}: not within {limit} update periods at {}: {states:?}", self.now);
    }

    fn all_off(&self) -> bool {
        self.drives.iter().all(|drive| !drive.is_active())
    }

    /// Clears until every axis is on; a frame that is lost may spoil an attempt, the next one succeeds.
    fn recover(&mut self, draw: &mut Draw) {
        (self.cut, self.turned) = ([false; AXES], [false; AXES]);
        for drive in &mut self.drives {
            drive.set_behaviour(behaviour(draw));
            drive.set_fault(Fault::None);
        }
        for _ in 0..20 {
            for drive in &mut self.drives {
                drive.clear_alarm();
            }
            self.master.clear();
            for _ in 0..400 {
                self.update();
                self.master.ring_mut().switch_on().ok();
                if self.master.ring().all_are(AxisState::On) {
                    assert_eq!(self.master.error(), None);
                    return;
                }
                if self.master.ring().failure().is_some() {
                    break;
                }
            }
        }
        panic!("no recovery at {}: {:?}", self.now, self.master.ring().failure());
    }

    /// Set-points and requests; outcomes are taken by chance.
    fn work(&mut self, draw: &mut Draw) {
        let now = self.now;
        for (place, axis) in self.master.ring_mut().axes_mut().iter_mut().enumerate() {
            if axis.state() == AxisState::On {
                let forth = (now / 300 + place as u64) % 2 == 0;
                let by = (place as i32 + 1) * if forth { 60 } else { -60 };
                axis.set_position(axis.setpoint().wrapping_add(by)).unwrap();
                // 200 000 pulses in half a millisecond are 1 600 command units at 125/1: a step too far is not taken.
                let too_far = axis.setpoint().wrapping_add(axis.max_step() as i32 + 1 + by.abs());
                assert!(axis.set_position(too_far).is_err());
            }
            match draw.below(40) {
                0 => {
                    let about = Arguments { type_code: TypeCode::short(draw.below(16) as u8), index: 0, data: 0 };
                    let _ = axis.ask(NonCyclicCommand::Monitor(about));
                }
                1 => _ = axis.ask_sub(SubCode::Monitor, draw.below(16) as u8, 0),
                2 => _ = (axis.take_outcome(), axis.take_sub_outcome()),
                _ => {}
            }
        }
    }
}

#[test]
fn hostile_every_servo_is_off_in_time() {
    let (wanted, mut draw) = (wanted_events(100_000), Draw::default());
    let mut bench = Bench::new(&mut draw);
    let mut faults = [0_u32; 8];
    let mut spurious = 0_u32;
    bench.recover(&mut draw);
    while bench.now < wanted {
        for _ in 0..30 + draw.below(300) {
            bench.work(&mut draw);
            bench.update();
            if bench.master.ring().failure().is_some() {
                break;
            }
        }
        if let Some(RingFailure { place, reason }) = bench.master.ring().failure() {
            // Only what the lines did can have been the cause.
            assert!(bench.now - bench.hurt <= 20, "axis {place} at {}: {reason}", bench.now);
            spurious += 1;
        } else {
            let (place, kind) = (draw.below(AXES as u64) as usize, draw.below(faults.len() as u64) as usize);
            faults[kind] += 1;
            match kind {
                0 => bench.drives[place].set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
                1 => bench.drives[place].set_fault(Fault::NoMainPower),
                2 => bench.cut[place] = true,
                3 => bench.cut = [true; AXES],
                4 => bench.turned[place] = true,
                5 => bench.drives[place].set_fault(Fault::ServoDrop),
                6 => bench.master.ring_mut().switch_off(),
                // The master hangs: the same blocks go round again and again.
                _ => (0..LIMIT).for_each(|_| bench.frame()),
            }
            let orderly = kind == 6;
            bench.until("every motor released", OFF_WITHIN + 8, |bench| bench.all_off());
            bench.until("the master knows", OFF_WITHIN, |bench| orderly || bench.master.ring().failure().is_some());
            let by_line = matches!(kind, 2..=4);
            assert!(!by_line || bench.master.error() == Some(ControlError::Timeout), "kind {kind} at {}", bench.now);
        }
        bench.until("every motor released", OFF_WITHIN + 8, |bench| bench.all_off());
        bench.recover(&mut draw);
    }
    let mut tally = Tally::default();
    bench.down.iter().chain(&bench.up).for_each(|line| tally.add(&line.cable.tally));
    println!("{} update periods, faults by kind {faults:?}, stops by the lines {spurious}\n{tally}", bench.now);
    assert!(wanted < 50_000 || faults.iter().all(|&n| n > 0), "{faults:?}");
}
