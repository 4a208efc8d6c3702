//! Requests at any moment: no jump, no limit passed, no step lost, at rest at the target.

use proptest::prelude::*;
use step_motion::{Clock, Direction, Error, Limits, Mover, Setpoint};

#[derive(Debug, Clone, Copy)]
enum Request {
    MoveTo(i64),
    Run(bool, u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        4 => (-3000..3000_i64).prop_map(Request::MoveTo),
        2 => (any::<bool>(), 0..30_000_u32).prop_map(|(way, speed)| Request::Run(way, speed)),
        2 => (0..120_u16).prop_map(Request::Override),
        2 => Just(Request::Hold),
        2 => Just(Request::Resume),
        1 => Just(Request::Stop),
    ]
}

struct Watched {
    mover: Mover,
    limits: Limits,
    hz: f64,
    last: Option<u64>,
    position: i64,
    now: u64,
    /// When the last request came.
    told: u64,
}

impl Watched {
    fn new(limits: Limits, hz: u32) -> Self {
        let mover = Mover::new(Clock::new(hz).unwrap(), limits).unwrap();
        Self { mover, limits, hz: hz.into(), last: None, position: 0, now: 0, told: 0 }
    }

    fn limits_hold(&self, s: Setpoint) -> Result<(), TestCaseError> {
        let within = |value: i64, limit: f64| (value as f64 / 65536.0).abs() <= limit * (1.0 + 1e-6) + 0.01;
        let (a, j) = (f64::from(self.limits.acceleration()), self.limits.jerk().map_or(0.0, |j| j as f64));
        prop_assert!(within(s.speed, f64::from(self.limits.speed()) + a * 1e-9), "{s:?}");
        prop_assert!(within(s.acceleration, a + j * 2e-9), "{s:?} {}", self.limits);
        prop_assert!(within(s.jerk, j), "{s:?} {}", self.limits);
        Ok(())
    }

    /// Takes all steps before `until`.
    fn run_until(&mut self, until: u64) -> Result<(), TestCaseError> {
        let mut count = 0;
        while let Some(due) = self.mover.due().filter(|due| *due < until) {
            let before = self.mover.at(due);
            let pulse = self.mover.pulse().unwrap();
            prop_assert_eq!(pulse.tick, due);
            prop_assert!(self.last.is_none_or(|last| pulse.tick > last), "{pulse:?} after {:?}", self.last);
            self.position += if pulse.direction == Direction::Forward { 1 } else { -1 };
            prop_assert_eq!(self.mover.commanded(), self.position);
            self.limits_hold(before)?;
            // The position of the plan is within half a step of the motor, and of a tick.
            let off = (before.position - (self.position << 32)).abs() as f64 / 2_f64.powi(32);
            let tick = (before.speed as f64 / 65536.0).abs() / self.hz;
            prop_assert!(off <= 0.5 + tick + 1e-3, "{before:?} at {}", self.position);
            // Half a tick from where the unrounded axis is in the middle of the step, unless a request has just come.
            let back = if pulse.direction == Direction::Forward { -1 } else { 1 };
            let middle = (self.position * 2 + back) << 31;
            let way = tick * 0.5 + (before.acceleration as f64 / 65536.0).abs() / self.hz / self.hz;
            let off = (before.position - middle).abs() as f64 / 2_f64.powi(32);
            prop_assert!(off <= way * 1.002 + 4e-9 || pulse.tick == self.told, "{off} of {way}: {before:?}");
            self.last = Some(pulse.tick);
            self.now = pulse.tick;
            count += 1;
            prop_assert!(count < 2_000_000, "never at rest");
        }
        self.now = self.now.max(until);
        Ok(())
    }

    fn tell(&mut self, request: Request) -> Result<(), TestCaseError> {
        self.told = self.now;
        let before = self.mover.at(self.now);
        let direction = self.mover.direction();
        match request {
            Request::MoveTo(target) => self.mover.move_to(target, self.now).unwrap(),
            Request::Run(way, speed) => {
                self.mover.run(if way { Direction::Reverse } else { Direction::Forward }, speed, self.now).unwrap();
            }
            Request::Override(percent) => self.mover.set_override(percent, self.now),
            Request::Hold => self.mover.hold(self.now),
            Request::Resume => self.mover.resume(self.now),
            Request::Stop => self.mover.stop(self.now),
        }
        let after = self.mover.at(self.now);
        self.limits_hold(after)?;
        if before.speed != 0 && direction == self.mover.direction() {
            // No jump: in position, in speed, and with a jerk limit in acceleration.
            let off = |a: i64, b: i64| (a - b).abs() as f64 / 65536.0;
            let jerk = self.limits.jerk().map_or(0.0, |j| j as f64);
            let (a, v) = (f64::from(self.limits.acceleration()), f64::from(self.limits.speed()));
            prop_assert!(
                (before.position - after.position).abs() as f64 <= 64.0 + v / 1e9 * 2_f64.powi(33),
                "{before:?} {after:?}"
            );
            prop_assert!(off(before.speed, after.speed) <= 0.01 + a * 3e-9 + v * 1e-6, "{before:?} {after:?}");
            if jerk > 0.0 {
                let small = off(before.acceleration, after.acceleration) <= a * 1e-3 + jerk * 3e-9;
                prop_assert!(small, "{request:?}: {before:?} {after:?}");
            }
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2 * ProptestConfig::default().cases, ..ProptestConfig::default() })]

    #[test]
    fn requests_at_any_moment(
        v in 200..30_000_u32,
        a in 2000..500_000_u32,
        j in prop_oneof![Just(0_u64), 50_000..50_000_000_u64],
        requests in prop::collection::vec((request(), 0..200_000_u64), 1..12),
        target in -3000..3000_i64,
        hz in prop_oneof![Just(1_000_000_u32), Just(72_000_000)],
    ) {
        let limits = Limits::new(v, a).unwrap();
        let limits = if j == 0 { limits } else { limits.with_jerk(j).unwrap() };
        let mut watched = Watched::new(limits, hz);
        for (request, wait) in requests {
            watched.tell(request)?;
            let until = watched.now + wait * u64::from(hz / 1_000_000);
            watched.run_until(until)?;
        }
        // In the end it goes where it is told, at rest.
        watched.tell(Request::Override(100))?;
        watched.tell(Request::Resume)?;
        watched.tell(Request::MoveTo(target))?;
        watched.run_until(u64::MAX)?;
        prop_assert_eq!(watched.position, target);
        prop_assert_eq!(watched.mover.due(), None);
        let end = 1 << 50;
        prop_assert!(watched.mover.is_at_rest(end));
        prop_assert_eq!((watched.mover.at(end).position, watched.mover.at(end).speed), (target << 32, 0));
    }
}

/// A step that is due in the tick of a request, and so before the stop begins: those after it are at their ticks.
#[test]
fn a_stop_in_the_tick_of_a_step() {
    for target in [-1575, -900] {
        let mut watched = Watched::new(Limits::new(21_485, 354_788).unwrap(), 1_000_000);
        watched.tell(Request::Run(true, 6840)).unwrap();
        watched.run_until(59_014).unwrap();
        watched.tell(Request::MoveTo(target)).unwrap();
        watched.run_until(59_014 + 41_333).unwrap();
        watched.tell(Request::MoveTo(0)).unwrap();
        watched.run_until(u64::MAX).unwrap();
        assert_eq!(watched.position, 0);
    }
}

fn mover() -> Mover {
    Mover::new(Clock::MICROSECONDS, Limits::new(10_000, 100_000).unwrap().with_jerk(2_000_000).unwrap()).unwrap()
}

#[test]
fn a_change_takes_effect_within_a_long_interval() {
    let mut mover = mover();
    mover.run(Direction::Forward, 1, 0).unwrap();
    let first = mover.due().unwrap();
    assert!(first > 400_000);
    mover.pulse();
    assert!(mover.due().unwrap() > first + 900_000);
    mover.run(Direction::Forward, 10_000, first + 1000).unwrap();
    assert!(mover.due().unwrap() < first + 100_000, "{:?}", mover.due());
}

#[test]
fn held_twice_resumed_while_stopping_and_told_to_stay() {
    let mut mover = mover();
    mover.move_to(2000, 0).unwrap();
    let mut now = 0;
    for _ in 0..500 {
        now = mover.pulse().unwrap().tick;
    }
    mover.hold(now);
    mover.hold(now);
    for _ in 0..10 {
        now = mover.pulse().unwrap().tick;
    }
    mover.resume(now);
    mover.hold(now);
    while let Some(pulse) = mover.pulse() {
        now = pulse.tick;
    }
    let stopped = mover.commanded();
    assert!((510..1700).contains(&stopped), "{stopped}");
    now += 1_000_000;
    assert!(mover.is_at_rest(now));
    mover.move_to(stopped, now).unwrap();
    mover.resume(now);
    assert_eq!(mover.due(), None);
    mover.move_to(2000, now).unwrap();
    while mover.pulse().is_some() {}
    assert_eq!(mover.commanded(), 2000);
}

#[test]
fn soft_limits_a_halt_and_a_quick_stop() {
    let mut mover = mover().with_soft_limits(-100, 900).with_reversal_pause(5000);
    assert_eq!(mover.move_to(901, 0), Err(Error::SoftLimit { target: 901 }));
    mover.run(Direction::Forward, 8000, 0).unwrap();
    let mut now = 0;
    while let Some(pulse) = mover.pulse() {
        now = pulse.tick;
    }
    assert_eq!(mover.commanded(), 900);
    let turned = mover.due();
    assert_eq!(turned, None);
    let rest = now + 1_000_000;
    mover.move_to(-50, rest).unwrap();
    assert!(mover.due().unwrap() > rest + 5000);
    for _ in 0..300 {
        now = mover.pulse().unwrap().tick;
    }
    let hard = Limits::new(10_000, 1_000_000).unwrap();
    mover.quick_stop(hard, now);
    assert_eq!(mover.move_to(0, now), Err(Error::Moving));
    let mut steps = 0;
    while let Some(pulse) = mover.pulse() {
        now = pulse.tick;
        steps += 1;
    }
    assert!(steps <= 50, "{steps} steps of v²/2a");
    now += 100_000;
    mover.move_to(0, now).unwrap();
    for _ in 0..200 {
        now = mover.pulse().unwrap().tick;
    }
    let position = mover.commanded();
    assert_eq!(mover.set_commanded(0, now), Err(Error::Moving));
    mover.halt(now);
    assert_eq!((mover.commanded(), mover.due(), mover.is_halted()), (position, None, true));
    mover.set_commanded(0, now + 1).unwrap();
    mover.move_to(10, now + 1).unwrap();
    assert!(!mover.is_halted());
    while mover.pulse().is_some() {}
    assert_eq!(mover.commanded(), 10);
}

/// Limits below the deceleration that it has: it goes on from where it is, as fast as it is.
#[test]
fn a_quick_stop_within_low_limits_does_not_jump() {
    for (acceleration, jerk) in [(10_000, 1_000_000), (152, 1_282_555), (1, 50_000_000), (99_000, 200_000), (5, 10)] {
        let limits = Limits::new(20_000, 100_000).unwrap().with_jerk(1_000_000).unwrap();
        let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
        mover.run(Direction::Forward, 20_000, 0).unwrap();
        let mut now = 0;
        while now < 400_000 {
            now = mover.pulse().unwrap().tick;
        }
        mover.stop(now);
        // Slowing down with 90,000 steps/s².
        let then = now + 90_000;
        while mover.due().unwrap() <= then {
            now = mover.pulse().unwrap().tick;
        }
        let before = mover.at(now);
        mover.quick_stop(Limits::new(20_000, acceleration).unwrap().with_jerk(jerk).unwrap(), now);
        let after = mover.at(now);
        assert!(before.position.abs_diff(after.position) < 1 << 16, "{acceleration}, {jerk}: {before} {after}");
        assert!(before.speed.abs_diff(after.speed) < 1 << 8, "{acceleration}, {jerk}: {before} {after}");
        let next = mover.pulse().map(|pulse| pulse.tick - now);
        assert!(next.is_some_and(|ticks| (40..90).contains(&ticks)), "{acceleration}, {jerk}: {next:?}");
    }
}

/// A step is due in the tick of a request, and the axis is past it by part of a tick: the steps after it are not.
#[test]
fn a_step_that_is_due_when_a_request_comes() {
    let clock = Clock::new(100_000).unwrap();
    for (limits, speed) in [(Limits::new(9000, 50_000).unwrap(), 9000), (Limits::new(9000, 50_000).unwrap(), 777)] {
        for steps in 40..240 {
            let mut mover = Mover::new(clock, limits).unwrap();
            mover.run(Direction::Forward, speed, 0).unwrap();
            for _ in 0..steps {
                mover.pulse();
            }
            let now = mover.due().unwrap();
            mover.set_override(99, now);
            mover.pulse();
            for step in steps + 1..steps + 20 {
                let due = mover.due().unwrap();
                let state = mover.at(due);
                let off = state.position - (step << 32) - (1 << 31);
                let way = state.speed as f64 / 65536.0 / 1e5 * 2_f64.powi(31);
                assert!(off.abs() as f64 <= way * 1.005, "step {step} after {steps} at {due}: {off} of {way}");
                mover.pulse();
            }
        }
    }
}

/// The last step of a phase can lie in the half tick in which the phase ends: the next one is a step on all the same.
#[test]
fn a_step_at_the_end_of_a_phase() {
    let limits = Limits::new(15_290, 459_337).unwrap().with_jerk(23_056_699).unwrap();
    let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
    mover.set_override(92, 0);
    mover.run(Direction::Reverse, 9947, 0).unwrap();
    while mover.due().is_some_and(|due| due < 118_480) {
        mover.pulse();
    }
    mover.move_to(-1597, 118_480).unwrap();
    let mut last = mover.pulse().unwrap().tick;
    for _ in 0..400 {
        let now = mover.pulse().unwrap().tick;
        assert!((60..=115).contains(&(now - last)), "{last}, {now}");
        last = now;
    }
}

/// Both ends of the soft limits may be reached, and neither may be passed.
#[test]
fn soft_limits_have_two_ends() {
    let mut mover = mover().with_soft_limits(-40, 30);
    assert_eq!(mover.move_to(-41, 0), Err(Error::SoftLimit { target: -41 }));
    assert_eq!(mover.move_to(31, 0), Err(Error::SoftLimit { target: 31 }));
    assert_eq!(mover.move_to(i64::MIN, 0), Err(Error::SoftLimit { target: i32::MIN }));
    assert_eq!(mover.move_to(i64::MAX, 0), Err(Error::SoftLimit { target: i32::MAX }));
    for (target, now) in [(-40, 0), (30, 10_000_000)] {
        mover.move_to(target, now).unwrap();
        assert!(!mover.is_at_rest(now), "there are steps to come");
        let mut last = 0;
        while let Some(pulse) = mover.pulse() {
            last = pulse.tick;
        }
        assert_eq!(mover.commanded(), target);
        // Half a step is left.
        assert!(!mover.is_at_rest(last) && mover.is_at_rest(now + 9_000_000));
    }
}

/// A speed of its own is kept, at most the greatest; an override is a part of it.
#[test]
fn velocity_is_what_was_asked_for() {
    let mut mover = mover();
    for (asked, percent, want) in [(1234, 100, 1234), (1234, 50, 617), (99_999, 100, 10_000), (8000, 25, 2000)] {
        let now = mover.due().unwrap_or(0);
        mover.set_override(percent, now);
        mover.run(Direction::Reverse, asked, now).unwrap();
        while mover.due().unwrap() < now + 1_000_000 {
            mover.pulse().unwrap();
        }
        let state = mover.at(now + 1_000_000);
        assert!((-state.speed).abs_diff(want << 16) <= 1 << 8, "{state}");
        assert_eq!((state.acceleration, state.jerk), (0, 0));
    }
}

/// The speed is reached at the first step; then there is one in each millisecond, for as long as it runs.
#[test]
fn a_run_does_not_drift() {
    let mut mover = Mover::new(Clock::NANOSECONDS, Limits::new(1000, 1_000_000).unwrap()).unwrap();
    mover.run(Direction::Forward, 1000, 0).unwrap();
    for step in 1..20_000 {
        assert_eq!(mover.pulse().map(|pulse| pulse.tick), Some(step * 1_000_000));
    }
}

#[test]
fn limits_are_changed_at_rest_only() {
    let mut mover = mover();
    let (old, fast) = (mover.limits(), Limits::new(20_000, 1_000_000).unwrap());
    mover.move_to(500, 0).unwrap();
    assert_eq!(mover.set_limits(fast, 10), Err(Error::Moving));
    assert_eq!(mover.limits(), old);
    let mut slow = 0;
    while let Some(pulse) = mover.pulse() {
        slow = pulse.tick;
    }
    mover.set_limits(fast, 1_000_000).unwrap();
    assert_eq!(mover.limits(), fast);
    let refused = mover.set_limits(Limits::new(500_001, 1).unwrap(), 1_000_000);
    assert_eq!(refused, Err(Error::SpeedAboveClock { speed: 500_001, limit: 500_000 }));
    mover.move_to(0, 1_000_000).unwrap();
    let mut quick = 0;
    while let Some(pulse) = mover.pulse() {
        quick = pulse.tick;
    }
    // 2 sqrt(n / a) less the last half step, 44.7 ms.
    assert!((43_000..44_722).contains(&(quick - 1_000_000)) && slow > 100_000, "{quick} {slow}");
}

#[test]
fn a_move_has_two_to_the_31_steps_at_most() {
    let most = (1_i64 << 31) - 1;
    for (target, steps) in [(most + 1, 1 << 31), (-most - 1, 1 << 31), (i64::MAX, u32::MAX)] {
        let refused = mover().move_to(target, 0);
        assert_eq!(refused, Err(Error::TooManySteps { steps, limit: u32::MAX / 2 }));
    }
    for target in [-most, most] {
        let mut mover = mover();
        mover.move_to(target, 0).unwrap();
        assert_eq!(mover.pulse().map(|pulse| pulse.direction.dir()), Some(target < 0));
    }
}

/// Told to run the other way it stops and does so, at the new speed.
#[test]
fn a_run_turns_round() {
    for (soft, jerk) in [(false, None), (true, None), (false, Some(1_000_000)), (true, Some(1_000_000))] {
        let limits = Limits::new(2000, 20_000).unwrap();
        let limits = jerk.map_or(limits, |jerk| limits.with_jerk(jerk).unwrap());
        let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
        if soft {
            mover = mover.with_soft_limits(-100_000, 100_000);
        }
        for (direction, speed, sign) in
            [(Direction::Forward, 2000, 1), (Direction::Reverse, 500, -1), (Direction::Forward, 1000, 1)]
        {
            let now = mover.due().unwrap_or(0);
            mover.run(direction, speed, now).unwrap();
            for _ in 0..1000 {
                mover.pulse();
            }
            let (from, since) = (mover.commanded(), mover.due().unwrap());
            while mover.due().is_some_and(|due| due < since + 1_000_000) {
                mover.pulse();
            }
            let made = mover.commanded() - from;
            assert!(
                (made * sign).abs_diff(speed.into()) <= 1,
                "{made} steps in a second at {speed} steps/s {direction:?}"
            );
        }
    }
}

/// The way to rest at 100 is over, also for a clock that is behind: with a thousandth of the acceleration it would lead 1000 steps on.
#[test]
fn other_limits_do_not_act_on_the_motion_before() {
    let mut x =
        Mover::new(Clock::MICROSECONDS, Limits::new(8000, 2_000_000).unwrap()).unwrap().with_soft_limits(-100, 100);
    x.move_to(100, 0).unwrap();
    while x.pulse().is_some() {}
    x.set_limits(Limits::new(8000, 1000).unwrap(), 1_000_000).unwrap();
    x.hold(0);
    assert_eq!((x.due(), x.commanded(), x.is_at_rest(1_000_000)), (None, 100, true));
}
