//! A path along one axis: whatever is asked for, its speed and acceleration change by no more than the limits allow. What is looked at
//! are the steps, at a clock so fast that rounding to its ticks does not matter.

use proptest::prelude::*;
use step_motion::{AxisPulse, AxisSetup, Clock, Limits, Path, PathMover};

const HZ: f64 = 1e9;
const SPEED: f64 = 5000.0;
const ACCELERATION: f64 = 50_000.0;
const JERK: f64 = 2e6;

/// The last steps: their times in seconds and their places.
#[derive(Debug, Default, Clone)]
struct Track {
    steps: Vec<(f64, f64)>,
    place: f64,
}

impl Track {
    /// Speeds between the last steps are means, and differ by no more than the acceleration in the time between their middles; likewise
    /// the accelerations.
    fn step(&mut self, pulse: &AxisPulse) -> Result<(), TestCaseError> {
        let by = if pulse.direction.dir() { -0.5 } else { 0.5 };
        // A step is made halfway.
        self.steps.push((pulse.tick as f64 / HZ, self.place + by));
        self.place += 2.0 * by;
        let [.., a, b, c, d] = self.steps[..] else { return Ok(()) };
        let speed = |(from, before): (f64, f64), (to, after): (f64, f64)| {
            (f64::midpoint(from, to), (after - before) / (to - from))
        };
        let speeds = [speed(a, b), speed(b, c), speed(c, d)];
        let change =
            |from: (f64, f64), to: (f64, f64)| (f64::midpoint(from.0, to.0), (to.1 - from.1) / (to.0 - from.0));
        let [first, second] = [change(speeds[0], speeds[1]), change(speeds[1], speeds[2])];
        let jerk = (second.1 - first.1) / (d.0 - a.0) * 3.0;
        prop_assert!(speeds[2].1.abs() <= SPEED * 1.001, "{} steps/s at {d:?}", speeds[2].1);
        prop_assert!(second.1.abs() <= ACCELERATION * 1.02, "{} steps/s2 at {d:?}", second.1);
        prop_assert!(jerk.abs() <= JERK * 3.1, "{jerk} steps/s3 at {d:?}");
        Ok(())
    }

    /// The next motion begins at a step.
    fn rest(&mut self) {
        self.steps.clear();
    }
}

#[derive(Debug, Clone, Copy)]
enum Request {
    Push(i64, u32),
    MoveTo(i64),
    Override(u16),
    Hold,
    Resume,
    Stop,
}

fn request() -> impl Strategy<Value = Request> {
    let feed = prop_oneof![4 => Just(50_000_u32), 1 => 5000..50_000_u32];
    prop_oneof![
        12 => (20..300_i64, feed).prop_map(|(by, feed)| Request::Push(by, feed)),
        1 => (-200..600_i64).prop_map(Request::MoveTo),
        2 => (20..200_u16).prop_map(Request::Override),
        3 => Just(Request::Hold),
        4 => Just(Request::Resume),
        2 => Just(Request::Stop),
    ]
}

fn until(machine: &mut PathMover<1, 6>, track: &mut Track, time: u64) -> Result<(), TestCaseError> {
    while machine.due().is_some_and(|due| due <= time) {
        if machine.is_at_rest(machine.due().unwrap() - 1) {
            track.rest();
        }
        track.step(&machine.pulse().unwrap())?;
    }
    if machine.is_at_rest(time) {
        track.rest();
    }
    Ok(())
}

fn machine() -> PathMover<1, 6> {
    let limits = Limits::new(SPEED as u32, ACCELERATION as u32).unwrap().with_jerk(JERK as u64).unwrap();
    let axis = AxisSetup::new(limits, 100_000);
    PathMover::new(Path::new(Clock::new(HZ as u32).unwrap(), [axis], 20).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_straight_path_keeps_its_limits(requests in prop::collection::vec((request(), 0..40_000_000_u64), 4..24)) {
        let (mut machine, mut track, mut now) = (machine(), Track::default(), 0);
        for (request, wait) in requests {
            match request {
                Request::Push(by, feed) => drop(machine.push([machine.target()[0] + by], feed, now)),
                Request::MoveTo(by) => drop(machine.move_to([machine.commanded()[0] + by], 50_000, now)),
                Request::Override(percent) => machine.set_override(percent, now),
                Request::Hold => machine.hold(now),
                Request::Resume => machine.resume(now),
                Request::Stop => machine.stop(now),
            }
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
}

/// A brake over a joint to a slower line, resumed when it cannot go over the joint with less deceleration: it comes to rest, and goes on
/// from there.
#[test]
fn a_brake_that_cannot_be_left_is_resumed_at_rest() {
    for resumed in (0..100_000_000).step_by(1_000_000) {
        let (mut machine, mut track, mut now) = (machine(), Track::default(), 0);
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
