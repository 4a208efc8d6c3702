//! step-motion: plans, paths and an axis in two halves against their laws.

use step_motion::{
    Axes, AxesQueue, Axis, AxisSetup, Clock, Direction, Error, Limits, Path, PathMover, Plan, Queue, Work,
};

use crate::{byte, word};

#[path = "../../step-motion/tests/all/machine.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod machine;
use machine::{Background, Machine, Timer};

/// Steps of a plan that are looked at.
const LOOKED_AT: u32 = 4000;

/// A plan of any limits: speed, acceleration, steps, entry speed, exit speed and clock, four bytes each, and eight of jerk,
/// low byte first; 0 is no jerk limit.
pub fn plan(mut data: &[u8]) {
    let [speed, acceleration, steps, entry, exit, hz, low, high] = core::array::from_fn(|_| word(&mut data));
    let jerk = u64::from(high) << 32 | u64::from(low);
    let Ok(limits) = Limits::new(speed, acceleration) else { return };
    let limits = if jerk == 0 { Ok(limits) } else { limits.with_jerk(jerk) };
    let (Ok(limits), Some(clock)) = (limits, Clock::new(hz)) else { return };
    let plan = match Plan::between(clock, limits, steps, entry, exit) {
        Ok(plan) => plan,
        Err(Error::SpeedAboveClock { .. }) => return assert!(speed > hz / 2),
        Err(Error::TooManySteps { .. }) => return assert!(steps > u32::MAX / 2),
        Err(Error::TooShort { needed, .. }) => {
            assert!(needed > u64::from(steps));
            if let Some(needed) = u32::try_from(needed).ok().filter(|needed| *needed <= u32::MAX / 2) {
                assert!(Plan::between(clock, limits, needed, entry, exit).is_ok(), "{needed} steps are not enough");
            }
            return;
        }
        Err(e) => panic!("{e}"),
    };
    assert_eq!(plan.steps(), steps);
    let mut last = None;
    let mut made = 0_i64;
    for tick in plan.pulses().take(LOOKED_AT as usize) {
        assert!(last.is_none_or(|last| tick > last) && tick <= plan.duration(), "step {made} at {tick} after {last:?}");
        (last, made) = (Some(tick), made + 1);
        let state = plan.at(tick);
        // Per mille of the limits, and the part of a tick that a corner may be off.
        let most = |limit: u64, part: u64| (i128::from(limit) + i128::from(limit / 1000 + part)) << 16;
        assert!(i128::from(state.speed) <= most(speed.into(), 1 + u64::from(acceleration >> 28)), "{state}");
        assert!(i128::from(state.acceleration.abs()) <= most(acceleration.into(), 1 + (jerk >> 28)), "{state}");
    }
    assert_eq!(made, i64::from(steps.min(LOOKED_AT)));
    assert_eq!(plan.at(plan.duration() + 1).position, i64::from(steps) << 32);
}

/// Two axes along a path, and requests to them: limits of the axes in four bytes, then commands of three.
///
/// ```text
/// 0     speed / 100     1     acceleration / 1000     2     jerk / 100000, 0 for none     3     deviation at corners in um
/// 4..   command, and two values: a line, a new target, time, an override, hold, resume, stop, halt
/// ```
pub fn path(mut data: &[u8]) {
    let [speed, acceleration, jerk, deviation] = core::array::from_fn(|_| u32::from(byte(&mut data)));
    let limits = Limits::new(speed * 100 + 50, acceleration * 1000 + 500).expect("in range");
    let limits = if jerk == 0 { limits } else { limits.with_jerk(u64::from(jerk) * 100_000).expect("in range") };
    let axis = AxisSetup::new(limits, 80_000);
    let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], deviation).expect("a speed below the clock's");
    let mut watched = Watched { machine: PathMover::new(path), position: [0; 2], now: 0 };
    while let [command, a, b, rest @ ..] = data {
        data = rest;
        let to = [a, b].map(|value| i64::from(i8::from_le_bytes([*value])) * 4);
        let (now, machine) = (watched.now, &mut watched.machine);
        match command & 7 {
            0 => {
                let full = machine.is_full();
                assert_eq!(machine.push(to, 200_000, now).is_err(), full);
            }
            1 => drop(machine.move_to(to, 50_000, now)),
            2 => watched.until(now + (u64::from(*a) << (b & 15))),
            3 => machine.set_override(u16::from(*a), now),
            4 => machine.hold(now),
            5 => machine.resume(now),
            6 => machine.stop(now),
            _ => machine.halt(now),
        }
    }
    let now = watched.now;
    watched.machine.set_override(100, now);
    watched.machine.resume(now);
    watched.until(u64::MAX);
    assert_eq!((watched.position, watched.machine.is_empty()), (watched.machine.target(), true));
    assert!(watched.machine.is_at_rest(u64::MAX >> 24));
}

struct Watched {
    machine: PathMover<2, 4>,
    position: [i64; 2],
    now: u64,
}

impl Watched {
    /// Takes all steps before a time: each later than the one before, and one at a time.
    fn until(&mut self, time: u64) {
        while let Some(due) = self.machine.due().filter(|due| *due < time) {
            let pulse = self.machine.pulse().expect("a step is due");
            assert!(pulse.tick == due && due >= self.now, "{pulse:?} before {}", self.now);
            self.position[usize::from(pulse.axis)] += if pulse.direction.dir() { -1 } else { 1 };
            assert_eq!(self.machine.commanded(), self.position);
            self.now = due;
        }
        if time < u64::MAX {
            self.now = self.now.max(time);
        }
    }
}

/// Slots between the halves of an axis, and its soft limits.
const SLOTS: usize = 129;
const LOW: i64 = -2000;
const HIGH: i64 = 3000;

/// An axis in two halves, and requests to it while its background is in time, late, or not there: limits in four bytes, then
/// commands of three.
///
/// ```text
/// 0     speed / 100     1     acceleration / 1000     2     jerk / 100000, 0 for none     3     reach / 40 us
/// 4..   command, and two values: a target, a speed, an override, hold, resume, stop, quick stop, halt, some slices, time with and without
///       a background
/// ```
pub fn axis(mut data: &[u8]) {
    let [speed, acceleration, jerk, reach] = core::array::from_fn(|_| u32::from(byte(&mut data)));
    let speed = speed * 100 + 100;
    let limits = Limits::new(speed, acceleration * 1000 + 5000).expect("in range");
    let limits = if jerk == 0 { limits } else { limits.with_jerk(u64::from(jerk) * 100_000).expect("in range") };
    let queue = Queue::<SLOTS>::new();
    let (axis, timer) = Axis::new(&queue, Clock::MICROSECONDS, limits).expect("a speed below the clock's");
    let axis = axis.with_reach(500 + reach * 40).with_soft_limits(LOW, HIGH);
    let mut halves = Halves::new(axis, timer, speed, 2, 250);
    while let [command, a, b, rest @ ..] = data {
        data = rest;
        let (value, axis) = (i64::from(i16::from_le_bytes([*a, *b])), &mut halves.background);
        match command & 15 {
            0 | 1 => {
                let taken = axis.move_to(value).is_ok();
                // Refused in a quick stop, and before a halt has been seen.
                let refuses = axis.move_to(axis.commanded()) == Err(Error::Moving);
                assert_eq!(taken, (LOW..=HIGH).contains(&value) && !refuses);
            }
            2 => {
                let direction = if value < 0 { Direction::Reverse } else { Direction::Forward };
                let _: Result<_, _> = axis.run(direction, u32::from(*a) * 100);
            }
            3 => axis.set_override(u16::from(*a)),
            4 => axis.hold(),
            5 => axis.resume(),
            6 => axis.stop(),
            7 => axis.quick_stop(Limits::new(1, u32::from(*b) * 10_000 + 1).expect("in range")),
            8 => axis.halt(),
            9 | 10 => {
                for _ in 0..*a {
                    halves.slice();
                }
            }
            11 => halves.until(u64::from(*a) * 64),
            _ => halves.run(u64::from(*a) << (b & 7)),
        }
    }
    // Afterwards it can be started again.
    halves.background.stop();
    halves.run(100_000_000);
    halves.background.set_override(100);
    halves.background.resume();
    halves.background.move_to(77).expect("it is at rest");
    halves.run(100_000_000);
    assert_eq!((halves.machine.position, halves.background.is_at_rest()), ([77], true));
}

/// A background and a timer, with what their steps have to keep.
struct Halves<B, T, const N: usize> {
    background: B,
    machine: Machine<T, N>,
    /// Where the steps have led, and the last one of each axis: when and which way.
    position: [i64; N],
    last: [Option<(u64, i64)>; N],
    /// Ticks of a step at the greatest speed, how many fewer rounding may cost, and how often the background is called.
    fastest: u64,
    rounding: u64,
    every: u64,
}

impl<B: Background<N>, T: Timer, const N: usize> Halves<B, T, N> {
    fn new(background: B, timer: T, speed: u32, rounding: u64, every: u64) -> Self {
        let fastest = 1_000_000 / u64::from(speed);
        let machine = Machine::new(timer);
        Self { background, machine, position: [0; N], last: [None; N], fastest, rounding, every }
    }

    fn slice(&mut self) -> Work {
        let work = self.machine.slice(&mut self.background);
        self.look();
        work
    }

    /// Time goes on, without a background.
    fn until(&mut self, ticks: u64) {
        self.machine.until(self.machine.now + ticks);
        self.look();
    }

    /// With one; until it is at rest, or for a time.
    fn run(&mut self, ticks: u64) {
        self.machine.run(&mut self.background, self.every, self.machine.now + ticks);
        self.look();
    }

    fn look(&mut self) {
        for (tick, axis, by) in self.machine.steps.drain(..) {
            self.position[axis] += by;
            assert!((LOW..=HIGH).contains(&self.position[axis]), "{:?} is beyond the soft limits", self.position);
            if let Some((last, before)) = self.last[axis].replace((tick, by)) {
                let ticks = tick - last;
                // Each step of a stop that nobody asked for is exact to a sixteenth of an interval.
                let fast = before == by && ticks + self.rounding + self.fastest / 8 < self.fastest;
                assert!(!fast, "{ticks} ticks of axis {axis}");
            }
        }
        assert_eq!(self.background.made(), self.position);
    }
}

/// Slots for each axis of a path.
const SLOTS_OF_AN_AXIS: usize = 257;

/// Two axes of a path in two halves, and requests to them while their background is in time, late, or not there: limits in four bytes,
/// the pause of the first axis, then commands of three.
///
/// ```text
/// 0     speed / 100     1     acceleration / 1000     2     jerk / 100000, 0 for none     3     deviation at corners in um
/// 4     pause / 40 us
/// 5..   command, and two values: a line, a new target, an override, hold, resume, stop, quick stop, halt, some slices, time with and
///       without a background
/// ```
pub fn axes(mut data: &[u8]) {
    let [speed, acceleration, jerk, deviation, pause] = core::array::from_fn(|_| u32::from(byte(&mut data)));
    let speed = speed * 100 + 100;
    let limits = Limits::new(speed, acceleration * 1000 + 5000).expect("in range");
    let limits = if jerk == 0 { limits } else { limits.with_jerk(u64::from(jerk) * 100_000).expect("in range") };
    let axis = AxisSetup::new(limits, 80_000).with_soft_limits(LOW, HIGH);
    let axes = [axis.with_reversal_pause(pause * 40), axis];
    let path = Path::<2, 4>::new(Clock::MICROSECONDS, axes, deviation).expect("a speed below the clock's");
    let queue = AxesQueue::<2, SLOTS_OF_AN_AXIS>::new();
    let (axes, timer) = Axes::new(&queue, path);
    let mut both = Halves::new(axes, timer, speed, 3, 2000);
    while let [command, a, b, rest @ ..] = data {
        data = rest;
        let to = [a, b].map(|value| i64::from(i8::from_le_bytes([*value])) * 20);
        match command & 15 {
            0..=2 => {
                let inside = to.iter().all(|to| (LOW..=HIGH).contains(to));
                let added = both.background.push(to, 200_000).is_ok();
                assert!(inside || !added, "{to:?} is beyond the soft limits");
            }
            3 => drop(both.background.move_to(to, 50_000)),
            4 => both.background.set_override(u16::from(*a)),
            5 => both.background.hold(),
            6 => both.background.resume(),
            7 => both.background.stop(),
            8 => both.background.quick_stop([Limits::new(1, u32::from(*b) * 10_000 + 1).expect("in range"); 2]),
            9 => both.background.halt(),
            10 | 11 => {
                for _ in 0..*a {
                    both.slice();
                }
            }
            12 => both.until(u64::from(*a) * 64),
            _ => both.run(u64::from(*a) << (b & 7)),
        }
    }
    // Afterwards it can be started again.
    both.background.stop();
    both.run(100_000_000);
    both.background.set_override(100);
    both.background.resume();
    both.background.push([77, -5], 200_000).expect("it is at rest");
    both.run(100_000_000);
    assert_eq!((both.machine.position, both.background.is_at_rest()), ([77, -5], true));
}
