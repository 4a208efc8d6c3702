//! step-motion: plans, paths and an axis in two halves against their laws.

use step_motion::{
    Axes, AxesQueue, AxesTimer, Axis, AxisSetup, Clock, Direction, Error, Limits, Path, PathMover, Plan, Queue,
    StepTimer, Work,
};

use crate::{byte, word};

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
    let queue = Queue::new();
    let (axis, timer) = Axis::new(&queue, Clock::MICROSECONDS, limits).expect("a speed below the clock's");
    let axis = axis.with_reach(500 + reach * 40).with_soft_limits(LOW, HIGH);
    let mut halves =
        Halves { axis, timer, now: 0, compare: None, position: 0, last: None, fastest: 1_000_000 / u64::from(speed) };
    while let [command, a, b, rest @ ..] = data {
        data = rest;
        let (value, axis) = (i64::from(i16::from_le_bytes([*a, *b])), &mut halves.axis);
        match command & 15 {
            0 | 1 => assert_eq!(axis.move_to(value).is_ok(), (LOW..=HIGH).contains(&value) && !halves.refuses()),
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
            11 => halves.until(halves.now + u64::from(*a) * 64),
            _ => halves.run(halves.now + (u64::from(*a) << (b & 7))),
        }
    }
    // Afterwards it can be started again.
    halves.axis.stop();
    halves.run(halves.now + 100_000_000);
    halves.axis.set_override(100);
    halves.axis.resume();
    halves.axis.move_to(77).expect("it is at rest");
    halves.run(halves.now + 100_000_000);
    assert_eq!((halves.position, halves.axis.is_at_rest()), (77, true));
}

/// A background and a timer.
struct Halves<'q> {
    axis: Axis<'q, SLOTS>,
    timer: StepTimer<'q, SLOTS>,
    now: u64,
    compare: Option<u64>,
    position: i64,
    /// The last step: when and which way.
    last: Option<(u64, Direction)>,
    /// Ticks of a step at the greatest speed.
    fastest: u64,
}

impl Halves<'_> {
    /// Moves are refused in a quick stop, and before a halt has been seen.
    fn refuses(&mut self) -> bool {
        let at = self.axis.commanded();
        self.axis.move_to(at) == Err(Error::Moving)
    }

    fn slice(&mut self) -> Work {
        let work = self.axis.poll();
        if work == Work::Start {
            self.fire();
        }
        work
    }

    fn fire(&mut self) {
        let fired = self.timer.fire();
        let direction = fired.direction();
        if fired.is_step() {
            self.position = direction.advance(self.position);
            assert!((LOW..=HIGH).contains(&self.position), "{} is beyond the soft limits", self.position);
            if let Some((last, before)) = self.last {
                let ticks = self.now - last;
                // Each step of a stop that nobody asked for is exact to a sixteenth of an interval.
                assert!(
                    ticks > 0 && (before != direction || ticks + 2 + self.fastest / 8 >= self.fastest),
                    "{ticks} ticks"
                );
            }
            self.last = Some((self.now, direction));
        }
        self.compare = (fired.wait() > 0).then(|| self.now + u64::from(fired.wait()));
        assert_eq!(self.axis.commanded(), self.position);
    }

    /// Time goes on, without a background.
    fn until(&mut self, time: u64) {
        while let Some(compare) = self.compare.filter(|compare| *compare <= time) {
            self.now = compare;
            self.fire();
        }
        self.now = self.now.max(time);
    }

    /// With one, every 250 us; until it is at rest, or until a time.
    fn run(&mut self, time: u64) {
        loop {
            let mut slices = 0;
            let work = loop {
                match self.slice() {
                    Work::More | Work::Start => slices += 1,
                    other => break other,
                }
                assert!(slices < 2000, "the background does not end");
            };
            if self.now >= time || work == Work::Rest {
                return;
            }
            self.until((self.now + 250).min(time));
        }
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
    let queue = AxesQueue::new();
    let (axes, timer) = Axes::new(&queue, path);
    let fastest = 1_000_000 / u64::from(speed);
    let mut both = Both { axes, timer, now: 0, compare: None, position: [0; 2], last: [None; 2], fastest };
    while let [command, a, b, rest @ ..] = data {
        data = rest;
        let to = [a, b].map(|value| i64::from(i8::from_le_bytes([*value])) * 20);
        match command & 15 {
            0..=2 => {
                let inside = to.iter().all(|to| (LOW..=HIGH).contains(to));
                let added = both.axes.push(to, 200_000).is_ok();
                assert!(inside || !added, "{to:?} is beyond the soft limits");
            }
            3 => drop(both.axes.move_to(to, 50_000)),
            4 => both.axes.set_override(u16::from(*a)),
            5 => both.axes.hold(),
            6 => both.axes.resume(),
            7 => both.axes.stop(),
            8 => both.axes.quick_stop([Limits::new(1, u32::from(*b) * 10_000 + 1).expect("in range"); 2]),
            9 => both.axes.halt(),
            10 | 11 => {
                for _ in 0..*a {
                    both.slice();
                }
            }
            12 => both.until(both.now + u64::from(*a) * 64),
            _ => both.run(both.now + (u64::from(*a) << (b & 7))),
        }
    }
    // Afterwards it can be started again.
    both.axes.stop();
    both.run(both.now + 100_000_000);
    both.axes.set_override(100);
    both.axes.resume();
    both.axes.push([77, -5], 200_000).expect("it is at rest");
    both.run(both.now + 100_000_000);
    assert_eq!((both.position, both.axes.is_at_rest()), ([77, -5], true));
}

/// A background and a timer of two axes.
struct Both<'q> {
    axes: Axes<'q, 2, 4, SLOTS_OF_AN_AXIS>,
    timer: AxesTimer<'q, 2, SLOTS_OF_AN_AXIS>,
    now: u64,
    compare: Option<u64>,
    position: [i64; 2],
    /// The last step of each: when and whether backwards.
    last: [Option<(u64, bool)>; 2],
    /// Ticks of a step at the greatest speed.
    fastest: u64,
}

impl Both<'_> {
    fn slice(&mut self) -> Work {
        let work = self.axes.poll();
        if work == Work::Start && self.compare.is_none() {
            self.fire();
        }
        work
    }

    fn fire(&mut self) {
        let fired = self.timer.fire();
        for axis in 0..2 {
            let back = fired.reverse() >> axis & 1 != 0;
            if fired.steps() >> axis & 1 == 0 {
                continue;
            }
            self.position[axis] += if back { -1 } else { 1 };
            assert!((LOW..=HIGH).contains(&self.position[axis]), "{:?} is beyond the soft limits", self.position);
            if let Some((last, before)) = self.last[axis].replace((self.now, back)) {
                let ticks = self.now - last;
                // Each step of a stop that nobody asked for is exact to a sixteenth of an interval.
                let fast = before == back && ticks + 3 + self.fastest / 8 < self.fastest;
                assert!(ticks > 0 && !fast, "{ticks} ticks of axis {axis}");
            }
        }
        self.compare = (fired.wait() > 0).then(|| self.now + u64::from(fired.wait()));
        assert_eq!(self.axes.commanded(), self.position);
    }

    /// Time goes on, without a background.
    fn until(&mut self, time: u64) {
        while let Some(compare) = self.compare.filter(|compare| *compare <= time) {
            self.now = compare;
            self.fire();
        }
        self.now = self.now.max(time);
    }

    /// With one, every 2 ms; until it is at rest, or until a time.
    fn run(&mut self, time: u64) {
        loop {
            let mut slices = 0;
            let work = loop {
                let stands = self.compare.is_none();
                match self.slice() {
                    Work::More => slices += 1,
                    // After a halt the timer may still be running.
                    Work::Start if stands => slices += 1,
                    other => break other,
                }
                assert!(slices < 20_000, "the background does not end");
            };
            if self.now >= time || work == Work::Rest {
                return;
            }
            self.until((self.now + 2000).min(time));
        }
    }
}
