//! Requests at any moment along a path: on the line, within the limits of every axis, no jump, no step lost.

use std::collections::VecDeque;

use proptest::prelude::*;
use step_motion::{AxisSetup, Clock, Direction, Error, Limits, Path, PathMover, Plan, Setpoint};

const N: usize = 3;
const HZ: f64 = 72e6;

type Machine = PathMover<N, 6>;

#[derive(Debug, Clone, Copy)]
enum Request {
    Push([i64; N], u32),
    MoveTo([i64; N], u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
}

fn place() -> impl Strategy<Value = [i64; N]> {
    [-600..600_i64, -600..600_i64, -200..200_i64]
}

fn request() -> impl Strategy<Value = Request> {
    let feed = 1000..300_000_u32;
    prop_oneof![
        6 => (place(), feed.clone()).prop_map(|(to, feed)| Request::Push(to, feed)),
        2 => (place(), feed).prop_map(|(to, feed)| Request::MoveTo(to, feed)),
        3 => (0..250_u16).prop_map(Request::Override),
        3 => Just(Request::Hold),
        3 => Just(Request::Resume),
        1 => Just(Request::Stop),
    ]
}

/// A line that is to be followed, and where it is left.
#[derive(Debug, Clone, Copy)]
struct Segment {
    from: [i64; N],
    to: [i64; N],
    end: [i64; N],
}

struct Watched {
    machine: Machine,
    axes: [AxisSetup; N],
    lines: VecDeque<Segment>,
    position: [i64; N],
    last: [Option<u64>; N],
    now: u64,
    steps: u32,
    /// The last step of a line has been made, and none of the next one.
    ended: bool,
}

impl Watched {
    fn new(j: u64, deviation: u32) -> Self {
        let axes = [axis(20_000, 400_000, j, 80_000), axis(15_000, 200_000, j, 80_000), axis(4000, 50_000, 0, 400_000)];
        let machine = PathMover::new(Path::new(Clock::new(72_000_000).unwrap(), axes, deviation).unwrap());
        Self { machine, axes, lines: VecDeque::new(), position: [0; N], last: [None; N], now: 0, steps: 0, ended: true }
    }

    /// No axis exceeds what it can take, neither as it says nor as two places a little apart say.
    fn limits_hold(&self, tick: u64) -> Result<(), TestCaseError> {
        let then = self.machine.due().map_or(tick, |due| due.min(tick + 7200));
        let (states, later) = (self.machine.at(tick), self.machine.at(then));
        // The next line, which it comes to within half a step, leads somewhere else.
        let (then, later) = if self.ended { (tick, states) } else { (then, later) };
        let seconds = then.saturating_sub(tick) as f64 / HZ;
        for ((s, l), axis) in states.iter().zip(&later).zip(&self.axes) {
            let within = |value: f64, limit: f64| value.abs() <= limit * (1.0 + 1e-6) + 0.01;
            let (v, a) = (f64::from(axis.limits.speed()), f64::from(axis.limits.acceleration()));
            let j = axis.limits.jerk().map_or(f64::INFINITY, |j| j as f64);
            prop_assert!(within(speed(s), v + a * 1e-9), "{s:?} {}", axis.limits);
            prop_assert!(within(acceleration(s), a + j.min(1e12) * 2e-9), "{s:?} {}", axis.limits);
            prop_assert!(within(s.jerk as f64 / 65536.0, j), "{s:?} {}", axis.limits);
            let (dv, da) = (speed(l) - speed(s), acceleration(l) - acceleration(s));
            prop_assert!(dv.abs() <= a * (seconds + 3e-9) * (1.0 + 1e-6) + 1e-3, "{dv} in {seconds}: {s:?} {l:?}");
            prop_assert!(j.is_infinite() || da.abs() <= j * (seconds + 3e-9) + 1.0, "{da} in {seconds}: {s:?} {l:?}");
            let way = (l.position - s.position) as f64 / 2_f64.powi(32);
            let mean = f64::midpoint(speed(s), speed(l));
            prop_assert!((way - mean * seconds).abs() <= a * seconds * seconds + v * 2e-9 + 1e-8, "{way}: {s:?} {l:?}");
        }
        Ok(())
    }

    /// Takes all steps before `until`.
    fn run_until(&mut self, until: u64) -> Result<(), TestCaseError> {
        while let Some(due) = self.machine.due().filter(|due| *due < until) {
            self.limits_hold(self.now.max(self.last.iter().filter_map(|last| *last).max().unwrap_or(0)))?;
            let before = self.machine.at(due);
            let line = *self.lines.front().unwrap();
            let pulse = self.machine.pulse().unwrap();
            let i = usize::from(pulse.axis);
            prop_assert_eq!(pulse.tick, due);
            prop_assert!(pulse.tick >= self.now && self.last[i].is_none_or(|last| pulse.tick > last), "{pulse:?}");
            let middle = self.position[i] * 2;
            self.position[i] += if pulse.direction == Direction::Forward { 1 } else { -1 };
            let middle = (middle + self.position[i] * 2) << 30;
            prop_assert_eq!(self.machine.commanded(), self.position);
            // Half a tick from where the unrounded axis is in the middle of the step.
            let s = before[i];
            let slack = (speed(&s).abs() / HZ * 0.5 + acceleration(&s).abs() / HZ / HZ) * 2_f64.powi(32);
            let off = (s.position - middle).abs() as f64;
            prop_assert!(off <= slack * 1.002 + 16.0, "{pulse:?}: {off} of {slack}, {s:?}");
            // On the line: half a step from where this axis is between two steps.
            let n = (line.to[i] - line.from[i]).abs() as f64;
            let part = ((self.position[i] - line.from[i]).abs() as f64 - 0.5) / n;
            for k in 0..N {
                let want = line.from[k] as f64 + part * (line.to[k] - line.from[k]) as f64;
                let slack = f64::from(self.axes[k].limits.speed()) / HZ + 1e-6;
                prop_assert!((self.position[k] as f64 - want).abs() <= 0.5 + slack, "axis {k}: {:?}", self.position);
            }
            (self.last[i], self.now, self.steps) = (Some(pulse.tick), pulse.tick, self.steps + 1);
            self.ended = self.machine.len() < self.lines.len();
            // More than one if a stop has cut the next one off before its first step.
            while self.machine.len() < self.lines.len() {
                prop_assert_eq!(self.position, self.lines.pop_front().unwrap().end);
            }
            prop_assert!(self.steps < 500_000, "never at rest");
        }
        self.now = self.now.max(until);
        Ok(())
    }

    /// The lines end where the machine says that it will stop.
    fn stopped(&mut self, kept: usize, target: [i64; N]) -> Result<(), TestCaseError> {
        prop_assert!(kept <= self.lines.len());
        self.ended |= kept == 0;
        self.lines.truncate(kept);
        if let Some(last) = self.lines.back_mut() {
            last.end = target;
        } else {
            prop_assert_eq!(target, self.position);
        }
        Ok(())
    }

    fn push(&mut self, from: [i64; N], to: [i64; N]) {
        if from != to {
            self.lines.push_back(Segment { from, to, end: to });
        }
    }

    fn tell(&mut self, request: Request) -> Result<(), TestCaseError> {
        let (before, moving) = (self.machine.at(self.now), self.machine.due().is_some());
        let (now, was) = (self.now, self.lines.len());
        match request {
            Request::Push(to, feed) => {
                let from = self.machine.target();
                let full = self.machine.is_full();
                prop_assert_eq!(self.machine.push(to, feed, now), if full { Err(Error::QueueFull) } else { Ok(()) });
                if !full {
                    self.push(from, to);
                }
            }
            Request::MoveTo(to, feed) => {
                let mut other = self.machine.clone();
                other.stop(now);
                let (kept, from) = (other.len(), other.target());
                match self.machine.move_to(to, feed, now) {
                    Ok(()) => {
                        self.stopped(kept, from)?;
                        self.push(from, to);
                    }
                    refused => prop_assert!(refused == Err(Error::QueueFull) && kept == 6, "{refused:?}"),
                }
            }
            Request::Override(percent) => self.machine.set_override(percent, now),
            Request::Hold => self.machine.hold(now),
            Request::Resume => self.machine.resume(now),
            Request::Stop => {
                self.machine.stop(now);
                let (kept, target) = (self.machine.len(), self.machine.target());
                self.stopped(kept, target)?;
            }
        }
        prop_assert_eq!(self.machine.len(), self.lines.len());
        self.limits_hold(now)?;
        // No jump, unless nothing moved or the line is another one.
        let after = self.machine.at(now);
        if moving && was > 0 && !self.lines.is_empty() && !self.ended {
            for ((b, a), axis) in before.iter().zip(&after).zip(&self.axes) {
                let limits = axis.limits;
                if b.speed == 0 {
                    continue;
                }
                prop_assert!((b.position - a.position).abs() <= 64, "{request:?}: {b:?} {a:?}");
                let off = (speed(b) - speed(a)).abs();
                prop_assert!(off <= 0.01 + f64::from(limits.speed()) * 1e-6, "{request:?}: {b:?} {a:?}");
                if let Some(jerk) = limits.jerk() {
                    let off = (acceleration(b) - acceleration(a)).abs();
                    let slack = f64::from(limits.acceleration()) * 1e-3 + jerk as f64 * 3e-9;
                    prop_assert!(off <= slack, "{request:?}: {b:?} {a:?}");
                }
            }
        }
        Ok(())
    }
}

fn speed(state: &Setpoint) -> f64 {
    state.speed as f64 / 65536.0
}

fn acceleration(state: &Setpoint) -> f64 {
    state.acceleration as f64 / 65536.0
}

fn axis(v: u32, a: u32, j: u64, steps_per_m: u32) -> AxisSetup {
    let limits = Limits::new(v, a).unwrap();
    AxisSetup::new(if j == 0 { limits } else { limits.with_jerk(j).unwrap() }, steps_per_m)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2 * ProptestConfig::default().cases, ..ProptestConfig::default() })]

    #[test]
    fn requests_at_any_moment(
        first in prop::collection::vec((place(), 1000..300_000_u32), 1..6),
        deviation in 0..200_u32,
        j in prop_oneof![Just(0_u64), 100_000..100_000_000_u64],
        requests in prop::collection::vec((request(), 0..6_000_000_u64), 1..14),
    ) {
        let mut watched = Watched::new(j, deviation);
        for (to, feed) in first {
            watched.tell(Request::Push(to, feed))?;
        }
        for (request, wait) in requests {
            watched.tell(request)?;
            let until = watched.now + wait;
            watched.run_until(until)?;
        }
        // In the end all lines are run, and it is at rest at the end of the last one.
        watched.tell(Request::Override(100))?;
        watched.tell(Request::Resume)?;
        let target = watched.machine.target();
        watched.run_until(u64::MAX)?;
        prop_assert_eq!(watched.position, target);
        prop_assert!(watched.lines.is_empty() && watched.machine.is_empty());
        prop_assert!(watched.machine.due().is_none() && watched.machine.is_at_rest(1 << 50));
        prop_assert!(watched.machine.at(1 << 50).iter().zip(target).all(|(s, at)| s.speed == 0 && s.position == at << 32));
    }
}

const CLOCK: Clock = Clock::MICROSECONDS;

/// 10,000 steps/s, 100,000 steps/s² and a jerk; 80 steps/mm, so a feed of 125 mm/s is the greatest speed.
fn two_axes(j: u64) -> PathMover<2, 24> {
    PathMover::new(Path::new(CLOCK, [axis(10_000, 100_000, j, 80_000); 2], 20).unwrap())
}

fn steps(machine: &mut PathMover<2, 24>, count: usize) -> u64 {
    (0..count).fold(0, |_, _| machine.pulse().unwrap().tick)
}

fn to_rest(machine: &mut PathMover<2, 24>) -> u64 {
    let mut now = 0;
    while let Some(pulse) = machine.pulse() {
        now = pulse.tick;
    }
    now
}

/// v²/2a, and with a jerk (v/2)(v/a + a/j): as long as on one line, however many the way is made of.
#[test]
fn a_hold_takes_the_stopping_distance_over_any_number_of_lines() {
    for (j, parts, least) in [(0, 1, 500), (0, 40, 500), (0, 200, 500), (2_000_000, 1, 750), (2_000_000, 4, 750)] {
        let mut machine = two_axes(j);
        let mut queued = 0;
        let mut now = 0;
        while machine.commanded()[0] < 4000 {
            while queued < parts && !machine.is_full() {
                queued += 1;
                machine.push([8000 * queued / parts, 0], 1_000_000, now).unwrap();
            }
            now = machine.pulse().unwrap().tick;
        }
        let speed = speed(&machine.at(now)[0]);
        assert!(speed > if parts > 4 { 9000.0 } else { 9999.0 }, "{speed} over {parts} lines");
        machine.hold(now);
        to_rest(&mut machine);
        let way = machine.commanded()[0] - 4000;
        // With jerk a line ends at acceleration 0: the last that is left too fast costs more of the way.
        assert!((least - 60..=least + if j == 0 { 2 } else { 400 }).contains(&way), "{way} steps over {parts} lines");
        assert!(machine.is_at_rest(now + 2_000_000) && !machine.is_empty());
    }
}

#[test]
fn an_override_scales_the_feed_and_not_the_limits() {
    for (percent, want) in [(50, 4000.0), (100, 8000.0), (110, 8800.0), (125, 10_000.0), (1000, 10_000.0)] {
        let mut machine = two_axes(2_000_000);
        machine.push([20_000, 0], 100_000, 0).unwrap();
        let now = steps(&mut machine, 5000);
        assert!((speed(&machine.at(now)[0]) - 8000.0).abs() < 0.1);
        machine.set_override(percent, now);
        let now = steps(&mut machine, 5000);
        assert!((speed(&machine.at(now)[0]) - want).abs() < 0.1, "{:?} at {percent} %", machine.at(now)[0]);
        machine.set_override(0, now);
        to_rest(&mut machine);
        let held = machine.commanded()[0];
        assert!((10_000..12_000).contains(&held), "{held}");
        machine.set_override(100, now + 1_000_000);
        to_rest(&mut machine);
        assert_eq!(machine.commanded(), [20_000, 0]);
    }
}

/// Lines that come while the one before them runs are as good as those that were there.
#[test]
fn a_line_that_is_added_in_time_costs_no_stop() {
    for j in [0, 2_000_000] {
        let mut machine = two_axes(j);
        machine.push([4000, 2000], 1_000_000, 0).unwrap();
        let now = steps(&mut machine, 2000);
        machine.push([8000, 4000], 1_000_000, now).unwrap();
        let mut slowest = f64::MAX;
        while machine.commanded()[0] < 7000 {
            let now = machine.pulse().unwrap().tick;
            slowest = slowest.min(if machine.commanded()[0] > 2000 { speed(&machine.at(now)[0]) } else { f64::MAX });
        }
        assert!(slowest > 9999.0, "{slowest}");
        let end = to_rest(&mut machine);
        let limits = axis(10_000, 100_000, j, 80_000).limits;
        let whole = Plan::new(CLOCK, limits, 8000).unwrap().pulses().last().unwrap();
        assert!(end.abs_diff(whole) <= 2, "{end} for {whole}");
    }
}

#[test]
fn a_stop_says_where_it_ends_and_a_new_target_begins_there() {
    let mut machine = two_axes(2_000_000);
    machine.push([4000, 0], 1_000_000, 0).unwrap();
    machine.push([8000, 500], 1_000_000, 0).unwrap();
    let now = steps(&mut machine, 3000);
    machine.stop(now);
    let end = machine.target();
    assert!((3740..3760).contains(&end[0]) && end[1] == 0 && machine.len() == 1, "{end:?}");
    machine.stop(now);
    assert_eq!((machine.target(), machine.len()), (end, 1));
    // Nothing brings it back to what it has left.
    machine.resume(now);
    machine.set_override(30, now);
    machine.push([end[0], 200], 1_000_000, now).unwrap();
    to_rest(&mut machine);
    assert_eq!((machine.commanded(), machine.is_empty()), ([end[0], 200], true));
    machine.set_override(100, 10_000_000);
    machine.push([0, 200], 1_000_000, 10_000_000).unwrap();
    let now = steps(&mut machine, 1000);
    machine.move_to([end[0], -70], 1_000_000, now).unwrap();
    assert_eq!(machine.len(), 2);
    to_rest(&mut machine);
    assert_eq!(machine.commanded(), [end[0], -70]);
}

#[test]
fn refusals_change_nothing_and_a_halt_keeps_the_position() {
    let axes = [axis(10_000, 100_000, 0, 80_000); 2];
    let mut machine = PathMover::<2, 1>::new(Path::new(CLOCK, axes, 20).unwrap());
    machine.push([3000, 300], 1_000_000, 0).unwrap();
    let now = (0..500).fold(0, |_, _| machine.pulse().unwrap().tick);
    let (due, target) = (machine.due(), machine.target());
    assert_eq!(machine.move_to([0, 0], 5, now), Err(Error::QueueFull));
    assert!(matches!(machine.move_to([0, 1 << 40], 5, now), Err(Error::TooManySteps { .. })));
    assert_eq!(machine.push([0, 0], 5, now), Err(Error::QueueFull));
    assert_eq!((machine.due(), machine.target()), (due, target));
    let position = machine.commanded();
    machine.halt(now);
    assert_eq!((machine.due(), machine.commanded(), machine.target()), (None, position, position));
    assert!(machine.is_halted() && machine.is_empty() && machine.is_at_rest(now + 1));
    machine.push([0, 0], 1_000_000, now + 10).unwrap();
    assert!(!machine.is_halted() && machine.due() > Some(now + 10));
    while machine.pulse().is_some() {}
    assert_eq!(machine.commanded(), [0, 0]);
}

/// A path that has lines in it already, and one that has run some.
#[test]
fn what_is_in_the_path_is_run() {
    let axes = [axis(10_000, 100_000, 0, 80_000); 2];
    let mut path = Path::<2, 24>::new(CLOCK, axes, 20).unwrap();
    path.push([100, 50], 1_000_000).unwrap();
    path.next_line().unwrap().for_each(drop);
    path.push([300, 70], 1_000_000).unwrap();
    let mut machine = PathMover::new(path);
    assert_eq!((machine.commanded(), machine.target(), machine.due()), ([100, 50], [300, 70], None));
    machine.resume(5_000_000);
    assert!(machine.due() > Some(5_000_000));
    to_rest(&mut machine);
    assert_eq!(machine.commanded(), [300, 70]);
}

/// As a hold, but the path ends there: where it says at once, and within the acceleration all the way.
#[test]
fn a_stop_takes_the_stopping_distance_over_any_number_of_lines() {
    for (j, parts, most) in [(0, 1, 502), (0, 40, 502), (0, 200, 502), (2_000_000, 4, 1150)] {
        let mut machine = two_axes(j);
        let (mut queued, mut now) = (0, 0);
        while machine.commanded()[0] < 4000 {
            while queued < parts && !machine.is_full() {
                queued += 1;
                machine.push([8000 * queued / parts, 0], 1_000_000, now).unwrap();
            }
            now = machine.pulse().unwrap().tick;
        }
        machine.stop(now);
        let [end, _] = machine.target();
        assert!((4440..=4000 + most).contains(&end), "{end} over {parts} lines");
        let mut last = now;
        while let Some(pulse) = machine.pulse() {
            let state = machine.at(pulse.tick)[0];
            assert!(acceleration(&state).abs() <= 100_000.1, "{state:?}");
            last = pulse.tick;
        }
        assert_eq!((machine.commanded(), machine.is_empty()), ([end, 0], true));
        // From 9000 steps/s at least, with 100,000 steps/s², but for the last half step.
        assert!(last - now >= 84_000, "at rest in {} over {parts} lines", last - now);
    }
}

/// A request on the ramp of a line costs nothing where the next line begins.
#[test]
fn the_speed_is_kept_from_line_to_line_after_an_override() {
    for j in [0, 2_000_000] {
        let mut machine = two_axes(j);
        machine.push([3000, 0], 1_000_000, 0).unwrap();
        machine.push([6000, 0], 1_000_000, 0).unwrap();
        let now = steps(&mut machine, 200);
        machine.set_override(90, now);
        machine.set_override(100, now);
        let mut last = now;
        for step in 200..3400 {
            let now = machine.pulse().unwrap().tick;
            let most = if step < 2600 { 1000 } else { 101 };
            assert!((99..=most).contains(&(now - last)), "{} at {:?}", now - last, machine.commanded());
            last = now;
        }
    }
}

/// At rest is not before the last step, nor before the half step after it; and what follows does not begin before that.
#[test]
fn at_rest_is_when_nothing_moves() {
    let mut machine = two_axes(0);
    machine.push([8000, 0], 1_000_000, 0).unwrap();
    let now = steps(&mut machine, 4000);
    assert!(!machine.is_at_rest(now) && !machine.is_at_rest(1 << 40));
    machine.hold(now);
    let last = to_rest(&mut machine);
    let rest = (last..last + 10_000).find(|now| machine.is_at_rest(*now)).unwrap();
    // From 10,000 steps/s with 100,000 steps/s² in 0.1 s.
    assert!(rest.abs_diff(now + 100_000) <= 1 && rest > last, "{rest} after {now}, {last}");
    machine.stop(last);
    machine.resume(last);
    machine.push([0, 0], 1_000_000, last).unwrap();
    // Half a step from rest takes sqrt(1 / 100,000) s.
    let first = machine.due().unwrap();
    assert!(first >= rest + 3161, "{first} after {rest}");
    to_rest(&mut machine);
    machine.push([-3, 2], 1_000_000, 1 << 40).unwrap();
    to_rest(&mut machine);
    assert_eq!(machine.at(1 << 41).map(|state| (state.position, state.speed)), [(-3 << 32, 0), (2 << 32, 0)]);
}
