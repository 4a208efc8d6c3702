//! A master and four impolite drives over lines that lose, delay and repeat blocks, with faults that last.
//!
//! `HOSTILE_EVENTS=100000 cargo test --release -p rtex-block --test all hostile:: -- --nocapture` puts a hundred thousand faults;
//! with `SEED=1` they are others.

use core::num::NonZeroU16;

use crate::common::CODES;
use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, Quirks};
use rtex_block::master::{
    ActiveCode, Arrival, Asic, Axis, AxisConfig, AxisState, ControlError, ControlPhase, Limits, Master, MasterConfig,
    RingFailure, Slave, StopCategory,
};
use rtex_block::position::Gear;
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{
    Alarm, Arguments, BlockSize, CommandBlock, Doubt, MacId, NonCyclicCommand, Policy, SubCode, Tolerated, TypeCode,
    pack,
};
use servowire_world::{Cable, Draw, Kind, Rates, Scenario, Seed, Tally, first_seed, wanted_events};

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
    fn new(draw: &mut Draw) -> Self {
        let rates = Rates { longest_ns: 1_200_000, ..Rates::QUIET }
            .with(Kind::Drop, 2_000)
            .with(Kind::Delay, 2_000)
            .with(Kind::Repeat, 1_000)
            .with(Kind::Cut, 500)
            .with(Kind::Foreign, 500);
        Self { cable: Cable::new(20_000, Scenario::random(draw.below(1 << 31), rates)), late: Vec::new() }
    }

    /// What the memory at the other end holds of this period: the block that came last.
    fn carry(&mut self, block: &[u8], now: u64) -> Option<Vec<u8>> {
        let arrivals = self.cable.carry(block, now * PERIOD_NS);
        self.late.extend(arrivals.into_iter().map(|arrival| (arrival.at_ns, arrival.bytes)));
        let end = (now + 1) * PERIOD_NS;
        self.late.sort_by_key(|(at, _)| *at);
        let here = self.late.iter().take_while(|(at, _)| *at < end).count();
        // The ASIC takes whole frames only.
        self.late.drain(..here).rev().find_map(|(_, bytes)| (bytes.len() == block.len()).then_some(bytes))
    }

    fn faults(&self) -> u64 {
        self.cable.tally.faults.iter().sum()
    }
}

struct Bench {
    master: Master<AXES>,
    /// Words of a block: of 16 bytes or of 32.
    words: usize,
    drives: [Drive; AXES],
    down: [Line; AXES],
    up: [Line; AXES],
    cut: [bool; AXES],
    turned: [bool; AXES],
    refused: [bool; AXES],
    /// Answers come a period later than they do; the bank of reception is not switched.
    late: bool,
    frozen: bool,
    stuck: Option<usize>,
    /// What the memory held in the periods before, the latest first.
    held: Vec<[u32; AXES * 8]>,
    /// Where each motor was, the latest first, and what went out in CP with the servo on: position and step.
    truth: [Vec<i32>; AXES],
    before: [Option<(i32, i32)>; AXES],
    /// Blocks that an axis took, and decelerations that were judged.
    taken: u64,
    /// The end of the last time that the master hung.
    hung: u64,
    /// The last period in which an old frame was put into the memory.
    old: u64,
    slowed: u64,
    tx: [u32; AXES * 8],
    rx: [u32; AXES * 8],
    /// What the host sees of it.
    seen: [u32; AXES * 8],
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

/// What the drive answers to a block of either size.
fn hear(drive: &mut Drive, command: &[u8]) -> Vec<u8> {
    match command.first_chunk::<32>() {
        Some(command) => drive.hear(command).unwrap().to_vec(),
        None => drive.hear(command.first_chunk::<16>().unwrap()).unwrap().to_vec(),
    }
}

impl Bench {
    fn new(draw: &mut Draw, size: BlockSize) -> Self {
        let limit = NonZeroU16::new(LIMIT).unwrap();
        let limits = Limits::new(limit, 80).with_ready(Some(200)).with_stop(20);
        let policies = [StopCategory::Zero, StopCategory::One];
        let axis = |place: usize| {
            let config = AxisConfig::new(mac_id(place), ActiveCode::CyclicPosition, 500_000, limits);
            Axis::new(config.with_stop(Some(policies[place % 2])).with_deceleration(40).with_gear(gear(place)))
        };
        let table: [Slave; AXES] = core::array::from_fn(|place| Slave { mac_id: mac_id(place), kind: 3 });
        let periods = Periods::from_a6n(3, 1, None).unwrap();
        let config = MasterConfig::new(size, periods, TimerSystem::Internal).with_watchdog(Some(limit));
        let mut master = Master::new(config, table, core::array::from_fn(axis)).unwrap();
        master.control(Asic::RingConfig, None);
        assert_eq!(master.control(Asic::Ready, Some(&table)), ControlPhase::Prepare);
        let mut bench = Self {
            master,
            words: size.bytes() / 4,
            drives: core::array::from_fn(|place| {
                let config = DriveConfig::new(mac_id(place), CODES).with_gear(gear(place));
                let mut drive = Drive::new(config);
                drive.set_behaviour(behaviour(draw));
                drive
            }),
            down: core::array::from_fn(|_| Line::new(draw)),
            up: core::array::from_fn(|_| Line::new(draw)),
            cut: [false; AXES],
            turned: [false; AXES],
            refused: [false; AXES],
            late: false,
            frozen: false,
            stuck: None,
            held: Vec::new(),
            truth: Default::default(),
            before: [None; AXES],
            taken: 0,
            hung: 0,
            old: 0,
            slowed: 0,
            tx: [0; AXES * 8],
            rx: [0; AXES * 8],
            seen: [0; AXES * 8],
            now: 0,
            hurt: 0,
            started: false,
        };
        bench.update();
        bench.master.control(Asic::Ready, None);
        assert_eq!(bench.master.control(Asic::Running, None), ControlPhase::Running);
        bench
    }

    /// The words of a place.
    fn of(&self, place: usize) -> core::ops::Range<usize> {
        place * self.words..(place + 1) * self.words
    }

    fn update(&mut self) {
        let all = ..AXES * self.words;
        self.master.exchange_words(&self.seen[all], &mut self.tx[all], self.now * PERIOD_NS).unwrap();
        self.judge();
        self.frame();
    }

    /// The laws of every update period, on the blocks as they are in the memory.
    fn judge(&mut self) {
        let fault = self.master.error();
        for place in 0..AXES {
            let mut block = [0; 32];
            pack::from_words(&self.tx[self.of(place)], &mut block[..4 * self.words]).unwrap();
            let main = *block.first_chunk().unwrap();
            let view = CommandBlock::of(&main).unwrap();
            self.started |= view.obeys_control();
            assert_eq!(view.obeys_control(), self.started, "a NOP at {}", self.now);
            let state = self.master.ring().axes()[place].state();
            assert!(view.is_servo_off() || state.is_servo_on() || !self.started, "{state} at {}", self.now);
            // A failure of the communication is servo-off for all, at once.
            assert!(fault.is_none() || view.is_servo_off() || !self.started, "{state} at {}", self.now);
            self.judge_motion(place, &main, state);
            self.judge_position(place);
        }
    }

    /// Speed and acceleration of the command positions, by the bytes.
    fn judge_motion(&mut self, place: usize, main: &[u8; 16], state: AxisState) {
        let at = i32::from_le_bytes(main[4..8].try_into().unwrap());
        let follows = matches!(state, AxisState::On | AxisState::Stopping(_) | AxisState::Held(_));
        let before = self.before[place];
        self.before[place] = None;
        if main[2] & 0x80 == 0 || main[1] >> 4 != 2 || !follows {
            return;
        }
        let step = before.map_or(0, |(last, _)| at.wrapping_sub(last));
        self.before[place] = Some((at, step));
        let Some((_, last_step)) = before else { return };
        // 200 000 pulses in half a millisecond.
        let most = [200_000, 66_666, 114_285, 1_600][place];
        assert!(step.abs() <= most, "axis {place} at {}: a step of {step}", self.now);
        if matches!(state, AxisState::Stopping(_)) {
            self.slowed += 1;
            let slower = last_step.abs() - step.abs();
            assert!((0..=40).contains(&slower) && step * last_step >= 0, "axis {place}: {last_step}, then {step}");
        }
        assert!(!matches!(state, AxisState::Held(_)) || step == 0, "axis {place} is held and moves by {step}");
    }

    /// A block that counts as on time says where the motor was just now: the drive measures a block before, and shows it as late as
    /// it likes.
    fn judge_position(&mut self, place: usize) {
        let axis = &self.master.ring().axes()[place];
        if axis.arrival() == Arrival::OnTime && self.started {
            self.taken += 1;
            let sample = axis.evidence().at(self.now * PERIOD_NS, Policy::new(0).tolerating(Tolerated::ALARM));
            if self.hung == self.now {
                // In which frame it came nobody can say.
                assert!(matches!(sample, Err(Doubt::Old { .. })), "axis {place} at {}: {sample:?}", self.now);
                return;
            }
            let said = sample.unwrap_or_else(|doubt| panic!("axis {place} at {}: {doubt}", self.now)).position();
            // A frame of a whole turn of the counter ago has the echo of a new one.
            let allowed = if self.now - self.old <= 1 { 24 } else { 12 };
            let was = self.truth[place].iter().take(allowed).any(|at| *at == said);
            assert!(was, "axis {place} at {}: {said} is not one of {:?}", self.now, self.truth[place]);
        }
    }

    /// A frame goes round with what the master wrote last.
    fn frame(&mut self) {
        self.now += 1;
        let before: u64 = self.down.iter().chain(&self.up).map(Line::faults).sum();
        let mut any = false;
        for place in 0..AXES {
            let words = self.of(place);
            let mut block = vec![0; 4 * self.words];
            pack::from_words(&self.tx[words.clone()], &mut block).unwrap();
            let from = self.drives[place].position();
            let command = if self.cut[place] { None } else { self.down[place].carry(&block, self.now) };
            if let Some(command) = command {
                let mut response = hear(&mut self.drives[place], &command);
                // Before and after each exchange: the drive counts its lateness by them.
                if self.stuck != Some(place) {
                    self.truth[place].insert(0, from);
                    self.truth[place].insert(0, self.drives[place].position());
                    self.truth[place].truncate(24);
                }
                response[0] ^= u8::from(self.turned[place]);
                if self.refused[place] {
                    // 0021h, to whatever was sent.
                    response[1] |= 0x80;
                    response[8..16].copy_from_slice(&[0x21, 0, 0, 0, 0, 0, 0, 0]);
                }
                if let Some(block) = self.up[place].carry(&response, self.now) {
                    any = true;
                    pack::to_words(&block, &mut self.rx[words]).unwrap();
                }
            } else {
                // What was on its way is lost too.
                self.up[place].late.clear();
                self.drives[place].framing_error();
            }
            let by = self.drives[place].position().wrapping_sub(from);
            assert!(by.abs() <= 3_000, "axis {place} jumps by {by} at {}", self.now);
        }
        self.held.insert(0, self.rx);
        self.held.truncate(8);
        if !self.frozen {
            self.seen = self.held[usize::from(self.late).min(self.held.len() - 1)];
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
        // A drive whose processing stands still obeys nobody; the others are released for it.
        (0..AXES).all(|place| self.stuck == Some(place) || !self.drives[place].is_active())
    }

    /// Clears until every axis is on; a frame that is lost may spoil an attempt, the next one succeeds.
    fn recover(&mut self, draw: &mut Draw) {
        (self.cut, self.turned, self.refused) = ([false; AXES], [false; AXES], [false; AXES]);
        (self.late, self.frozen, self.stuck) = (false, false, None);
        for drive in &mut self.drives {
            drive.set_behaviour(behaviour(draw));
            drive.set_fault(Fault::None);
        }
        // A drive that shows everything later from now on shows once more what it has shown already: no drive does that.
        for _ in 0..4 {
            self.update();
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

/// Faults of this kind at an axis; whether every motor has to be released by them.
fn hurt(bench: &mut Bench, kind: usize, place: usize, draw: &mut Draw) -> bool {
    match kind {
        0 => bench.drives[place].set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
        1 => bench.drives[place].set_fault(Fault::NoMainPower),
        2 => bench.cut[place] = true,
        3 => bench.cut = [true; AXES],
        4 => bench.turned[place] = true,
        5 => bench.drives[place].set_fault(Fault::ServoDrop),
        6 => bench.master.ring_mut().switch_off(),
        // The master hangs: the same blocks go round again and again, and the command positions stand still. A drive that loses one
        // of them has not yet seen the counter stand still for as long as it bears, so there are more.
        7 => {
            (0..LIMIT + 4).for_each(|_| bench.frame());
            bench.before.iter_mut().flatten().for_each(|(_, step)| *step = 0);
            bench.hung = bench.now;
        }
        8 => bench.drives[place].set_fault(Fault::EmergencyStop),
        9 => {
            bench.stuck = Some(place);
            bench.drives[place].set_fault(Fault::StaleEcho);
        }
        10 => bench.drives[place].set_fault(Fault::WrongMacId(MacId::new(30).unwrap())),
        11 => bench.late = true,
        12 => bench.frozen = true,
        13 => bench.refused[place] = true,
        14 => bench.master.ring_mut().stop([StopCategory::Zero, StopCategory::One][draw.below(2) as usize]),
        // A frame of one to seven periods ago, of one drive or of all, once.
        15 => {
            let old = bench.held[(1 + draw.below(7) as usize).min(bench.held.len() - 1)];
            let all = draw.below(2) == 0;
            let words = if all { 0..AXES * bench.words } else { bench.of(place) };
            bench.seen[words.clone()].copy_from_slice(&old[words]);
            (bench.hurt, bench.old) = (bench.now, bench.now);
            return false;
        }
        _ => {
            bench.master.ring_mut().stop(StopCategory::Two);
            return false;
        }
    }
    true
}

const KINDS: usize = 17;

#[test]
fn hostile_every_servo_is_off_in_time() {
    every_servo_is_off_in_time(BlockSize::Bytes32);
}

#[test]
fn hostile_every_servo_is_off_in_time_with_short_blocks() {
    every_servo_is_off_in_time(BlockSize::Bytes16);
}

fn every_servo_is_off_in_time(size: BlockSize) {
    let (wanted, seed) = (wanted_events(1_000), first_seed());
    let (_said, mut draw) = (Seed(seed), Draw::seeded(seed));
    let mut bench = Bench::new(&mut draw, size);
    let mut faults = [0_u64; KINDS];
    let mut spurious = 0_u32;
    bench.recover(&mut draw);
    while faults.iter().sum::<u64>() < wanted {
        for _ in 0..10 + draw.below(60) {
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
            let (place, kind) = (draw.below(AXES as u64) as usize, draw.below(KINDS as u64) as usize);
            faults[kind] += 1;
            if !hurt(&mut bench, kind, place, &mut draw) {
                // Held, or not even noticed: nobody is off but by what the lines do beside it.
                for _ in 0..12 {
                    bench.update();
                }
                let failed = bench.master.ring().failure();
                assert!(failed.is_none() || bench.now - bench.hurt <= 20, "kind {kind} at {}: {failed:?}", bench.now);
                let held = |axis: &Axis| matches!(axis.state(), AxisState::Held(_));
                assert!(kind == 15 || failed.is_some() || bench.master.ring().axes().iter().all(held));
                bench.recover(&mut draw);
                continue;
            }
            let orderly = kind == 6;
            let what = format!("every motor released after kind {kind} at axis {place}");
            bench.until(&what, OFF_WITHIN + 8, |bench| bench.all_off());
            bench.until("the master knows", OFF_WITHIN, |bench| orderly || bench.master.ring().failure().is_some());
            let by_line = matches!(kind, 2..=4 | 9..=12);
            assert!(!by_line || bench.master.error() == Some(ControlError::Timeout), "kind {kind} at {}", bench.now);
        }
        bench.until("every motor released", OFF_WITHIN + 8, |bench| bench.all_off());
        bench.recover(&mut draw);
    }
    let mut tally = Tally::default();
    bench.down.iter().chain(&bench.up).for_each(|line| tally.add(&line.cable.tally));
    let Bench { now, taken, slowed, .. } = bench;
    println!(
        "{now} update periods, {taken} positions and {slowed} decelerations judged, faults by kind {faults:?}, stops by the lines \
         {spurious}\n{tally}"
    );
    assert!(wanted < 1_000 || faults.iter().all(|&n| n > 0) && slowed > 10, "{faults:?} {slowed}");
}
