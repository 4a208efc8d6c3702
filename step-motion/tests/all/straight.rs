//! A path along one axis: whatever is asked for, its speed and acceleration change by no more than the limits allow. What is looked at
//! are the steps, at a clock so fast that rounding to its ticks does not matter.

use proptest::prelude::*;
use step_motion::{Axes, AxesQueue, AxesTimer, AxisSetup, Clock, Limits, Path, PathMover, Work};

use crate::machine::Machine;

const HZ: f64 = 1e9;

/// Speed, acceleration and jerk of the axis, in steps and seconds.
type Most = (u32, u32, u64);
const MOST: Most = (5000, 50_000, 2_000_000);

/// The last steps: their times in seconds and their places.
#[derive(Debug, Clone)]
struct Track {
    most: [f64; 3],
    /// Steps are in the tick nearest to their time. A stop that is only a precaution may have steps that are off by a quarter of an
    /// interval.
    exact: bool,
    steps: Vec<(f64, f64)>,
    place: f64,
}

impl Track {
    fn of((v, a, j): Most) -> Self {
        Self { most: [v.into(), a.into(), j as f64], exact: true, steps: Vec::new(), place: 0.0 }
    }

    /// Speeds between the last steps are means, and differ by no more than the acceleration in the time between their middles; likewise
    /// the accelerations.
    fn step(&mut self, tick: u64, by: f64) -> Result<(), TestCaseError> {
        // A step is made halfway.
        self.steps.push((tick as f64 / HZ, self.place + by / 2.0));
        self.place += by;
        let [.., a, b, c, d] = self.steps[..] else { return Ok(()) };
        let speed = |(from, before): (f64, f64), (to, after): (f64, f64)| {
            (f64::midpoint(from, to), (after - before) / (to - from))
        };
        let speeds = [speed(a, b), speed(b, c), speed(c, d)];
        let change =
            |from: (f64, f64), to: (f64, f64)| (f64::midpoint(from.0, to.0), (to.1 - from.1) / (to.0 - from.0));
        let [first, second] = [change(speeds[0], speeds[1]), change(speeds[1], speeds[2])];
        let jerk = (second.1 - first.1) / (d.0 - a.0) * 3.0;
        if !self.exact {
            return Ok(());
        }
        // Each step may be half a tick early or late, which counts up to four times in an acceleration, and eight times in a jerk.
        let [v, a, j] = self.most;
        let [first_speed, before, speed] = speeds.map(|(_, speed)| speed.abs());
        prop_assert!(speed <= v * 1.001, "{speed} steps/s at {d:?}");
        // Over a step, even with a rest between.
        prop_assert!((speed.powi(2) - before.powi(2)).abs() <= 4.0 * a, "from {before} to {speed} steps/s at {d:?}");
        if first_speed.min(before).min(speed).powi(2) < 3.0 * a {
            // Maybe a rest, which is at a whole step.
            return Ok(());
        }
        let short = 1.0 / speed;
        prop_assert!(second.1.abs() <= a * 1.02 + 2.0 / HZ / short.powi(3), "{} steps/s2 at {d:?}", second.1);
        prop_assert!(jerk.abs() <= j * 3.1 + 4.0 / HZ / short.powi(4), "{jerk} steps/s3 at {d:?}");
        Ok(())
    }

    /// The machine is at rest: half a step after its last step, to which it came no faster than the acceleration takes back. The next
    /// motion begins at a step.
    fn rest(&mut self) -> Result<(), TestCaseError> {
        if let [.., (before, _), (last, _)] = self.steps[..] {
            let speed = 1.0 / (last - before);
            let [_, a, _] = self.most;
            let most = (2.0 * a * 1.5).sqrt() * if self.exact { 1.01 } else { 2.0 };
            prop_assert!(speed <= most, "at rest from {speed} steps/s at {last}");
        }
        self.steps.clear();
        Ok(())
    }
}

/// What is asked of a path of `N` axes that leads along the first one.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Request<const N: usize> {
    /// On from the target, by so many steps.
    Push([i64; N], u32),
    MoveTo(i64),
    Override(u16),
    Hold,
    Resume,
    Stop,
}

/// `at`, and so many steps on along the first axis.
fn along<const N: usize>(mut at: [i64; N], by: i64) -> [i64; N] {
    at[0] += by;
    at
}

fn on<const N: usize>(from: [i64; N], by: [i64; N]) -> [i64; N] {
    core::array::from_fn(|axis| from[axis] + by[axis])
}

impl<const N: usize> Request<N> {
    pub(crate) fn tell(self, machine: &mut PathMover<N, 6>, now: u64) {
        match self {
            Self::Push(by, feed) => drop(machine.push(on(machine.target(), by), feed, now)),
            Self::MoveTo(by) => drop(machine.move_to(along(machine.commanded(), by), 50_000, now)),
            Self::Override(percent) => machine.set_override(percent, now),
            Self::Hold => machine.hold(now),
            Self::Resume => machine.resume(now),
            Self::Stop => machine.stop(now),
        }
    }
}

/// Mostly lines, by the given ways.
pub(crate) fn request<const N: usize>(way: impl Strategy<Value = [i64; N]>) -> impl Strategy<Value = Request<N>> {
    let feed = prop_oneof![4 => Just(50_000_u32), 1 => 5000..50_000_u32];
    prop_oneof![
        12 => (way, feed).prop_map(|(by, feed)| Request::Push(by, feed)),
        1 => (-200..600_i64).prop_map(Request::MoveTo),
        2 => (20..200_u16).prop_map(Request::Override),
        3 => Just(Request::Hold),
        4 => Just(Request::Resume),
        2 => Just(Request::Stop),
    ]
}

fn way() -> impl Strategy<Value = [i64; 1]> {
    (20..300_i64).prop_map(|x| [x])
}

fn until(machine: &mut PathMover<1, 6>, track: &mut Track, time: u64) -> Result<(), TestCaseError> {
    while machine.due().is_some_and(|due| due <= time) {
        if machine.is_at_rest(machine.due().unwrap() - 1) {
            track.rest()?;
        }
        let pulse = machine.pulse().unwrap();
        track.step(pulse.tick, if pulse.direction.dir() { -1.0 } else { 1.0 })?;
    }
    if machine.is_at_rest(time) {
        track.rest()?;
    }
    Ok(())
}

fn path((speed, acceleration, jerk): Most) -> Path<1, 6> {
    let limits = Limits::new(speed, acceleration).unwrap().with_jerk(jerk).unwrap();
    let axis = AxisSetup::new(limits, 100_000);
    Path::new(Clock::new(HZ as u32).unwrap(), [axis], 20).unwrap()
}

fn machine(most: Most) -> PathMover<1, 6> {
    PathMover::new(path(most))
}

/// The same in two halves.
struct Halves {
    axes: Axes<'static, 1, 6, 257>,
    machine: Machine<AxesTimer<'static, 1, 257>, 1>,
    track: Track,
    looked_at: usize,
}

impl Halves {
    fn of(most: Most) -> Self {
        let queue: &'static AxesQueue<1, 257> = Box::leak(Box::default());
        let (axes, timer) = Axes::new(queue, path(most));
        Self { axes, machine: Machine::new(timer), track: Track { exact: false, ..Track::of(most) }, looked_at: 0 }
    }

    fn tell(&mut self, request: Request<1>) {
        let axes = &mut self.axes;
        match request {
            Request::Push(by, feed) => drop(axes.push(on(axes.target(), by), feed)),
            Request::MoveTo(by) => drop(axes.move_to(along(axes.commanded(), by), 50_000)),
            Request::Override(percent) => axes.set_override(percent),
            Request::Hold => axes.hold(),
            Request::Resume => axes.resume(),
            Request::Stop => axes.stop(),
        }
    }

    fn until(&mut self, time: u64, background: bool) -> Result<(), TestCaseError> {
        if background {
            prop_assert_ne!(self.machine.run(&mut self.axes, 2_000_000, time), Work::TooFewSlots);
        } else {
            self.machine.until(time);
        }
        for (tick, _, by) in &self.machine.steps[self.looked_at..] {
            self.track.step(*tick, *by as f64)?;
        }
        self.looked_at = self.machine.steps.len();
        if self.machine.compare.is_none() {
            self.track.rest()?;
        }
        Ok(())
    }
}

/// How many sequences, and how many in the nightly run.
pub(crate) fn cases() -> u32 {
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(1000)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn a_straight_path_keeps_its_limits(
        most in prop_oneof![Just(MOST), (500..5000_u32, 5000..200_000_u32, 200_000..50_000_000_u64)],
        requests in prop::collection::vec((request(way()), 0..40_000_000_u64), 4..24),
    ) {
        let (mut machine, mut track, mut now) = (machine(most), Track::of(most), 0);
        for (request, wait) in requests {
            request.tell(&mut machine, now);
            now += wait;
            until(&mut machine, &mut track, now)?;
        }
        machine.set_override(100, now);
        machine.resume(now);
        now += 20_000_000_000;
        until(&mut machine, &mut track, now)?;
        prop_assert_eq!(machine.commanded(), machine.target());
        prop_assert!(machine.is_empty() && machine.is_at_rest(now));
    }

    /// The same in two halves, and with a background that is not there for a while.
    #[test]
    fn a_straight_path_in_two_halves(
        most in prop_oneof![Just(MOST), (500..5000_u32, 5000..200_000_u32, 200_000..50_000_000_u64)],
        requests in prop::collection::vec((request(way()), 0..40_000_000_u64, 0..6_u8), 4..24),
    ) {
        let mut halves = Halves::of(most);
        for (request, wait, here) in requests {
            halves.tell(request);
            halves.until(halves.machine.now + wait, here > 0)?;
        }
        halves.axes.set_override(100);
        halves.axes.resume();
        halves.until(halves.machine.now + 20_000_000_000, true)?;
        prop_assert_eq!(halves.axes.commanded(), halves.axes.target());
        prop_assert!(halves.axes.is_at_rest());
    }
}

/// What is asked of a machine, with the wait after each request in ns.
fn ask(machine: &mut PathMover<1, 6>, requests: &[(Request<1>, u64)]) {
    let (mut track, mut now) = (Track::of(MOST), 0);
    for &(request, wait) in requests {
        request.tell(machine, now);
        now += wait;
        until(machine, &mut track, now).unwrap();
    }
    machine.set_override(100, now);
    machine.resume(now);
    until(machine, &mut track, now + 20_000_000_000).unwrap();
    assert_eq!((machine.commanded(), machine.is_empty()), (machine.target(), true));
}

/// Two lines of 139 and 79 steps are just long enough for a stop on one curve over both. After an override their speeds are no longer
/// those of one run, so the first of them begins with a stop.
#[test]
fn a_speed_from_which_only_a_stop_is_possible() {
    use Request::{Override, Push};
    let push = |by, wait| (Push([by], 50_000), wait);
    let lines =
        [(199, 39_299_024), (49, 13_545_461), (203, 9_237_832), (195, 57_804_610), (139, 5_037_632), (79, 32_383_257)];
    for wait in (0..40).map(|step| step * 1_000_000) {
        let mut requests = Vec::from(lines.map(|(by, wait)| push(by, wait)));
        requests.push((Override(20), wait));
        ask(&mut machine(MOST), &requests);
        // The stop is not asked for, so it is left where that is possible again.
        requests.push((Override(120), 0));
        ask(&mut machine(MOST), &requests);
        requests.push((Request::MoveTo(0), 0));
        ask(&mut machine(MOST), &requests);
    }
}

/// A line that comes while such a stop runs: it stays one, and the path goes on after it.
#[test]
fn a_line_behind_a_stop_that_nobody_asked_for() {
    use Request::{Override, Push};
    let requests = [
        (Push([226], 30_079), 8_610_351),
        (Push([20], 50_000), 0),
        (Push([23], 9367), 16_789_480),
        (Override(191), 5_159_296),
        (Push([31], 50_000), 25_848_195),
    ];
    ask(&mut machine(MOST), &requests);
}

/// A hold that comes to rest at a joint but for rounding, and another aim when the line before that joint has begun.
#[test]
fn a_stop_at_a_joint_is_one_on_the_line_before() {
    use Request::{Hold, MoveTo, Override, Push, Resume};
    let push = |by, wait| (Push([by], 50_000), wait);
    let requests = [
        push(76, 1_750_533),
        push(256, 5_167_294),
        (Resume, 16_607_176),
        (Resume, 29_060_092),
        push(93, 10_202_074),
        (Resume, 19_892_583),
        push(86, 18_036_297),
        push(138, 13_610_484),
        (Override(20), 511_752),
        push(20, 20_711_833),
        (Hold, 2_148_581),
        (Override(20), 31_258_929),
        (MoveTo(0), 0),
    ];
    ask(&mut machine(MOST), &requests);
}

/// A brake over a joint to a slower line, resumed when it cannot go over the joint with less deceleration: it comes to rest, and goes on
/// from there.
#[test]
fn a_brake_that_cannot_be_left_is_resumed_at_rest() {
    for resumed in (0..100_000_000).step_by(1_000_000) {
        let (mut machine, mut track, mut now) = (machine(MOST), Track::of(MOST), 0);
        machine.push([152], 50_000, 0).unwrap();
        machine.push([215], 17_606, 0).unwrap();
        while machine.at(now)[0].speed >> 16 < 2300 {
            now += 100_000;
            until(&mut machine, &mut track, now).unwrap();
        }
        machine.hold(now);
        until(&mut machine, &mut track, now + resumed).unwrap();
        machine.resume(now + resumed);
        until(&mut machine, &mut track, now + 1_000_000_000).unwrap();
        assert_eq!((machine.commanded(), machine.is_empty()), ([215], true), "resumed after {resumed} ns");
    }
}
