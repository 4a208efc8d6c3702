//! What the line before allows, and for how long that counts.

use super::*;
use crate::limits::Clock;
use crate::path::AxisSetup;
use crate::planner::Motion;
use crate::tests::model::{Most, change};
use crate::tests::path::{limits, near, outcome, second};
use crate::tests::real;

/// Along the first axis, and along the second one, which allows more; in steps and seconds.
const FIRST: Most = Most { v: 100.0, a: 1000.0, j: Some(20_000.0) };
const SECOND: Most = Most { v: 300.0, a: 2000.0, j: Some(50_000.0) };
/// The motion begins this far before the second line.
const BEFORE: f64 = 0.4;

fn axis(v: u32, a: u32, j: u64) -> Limits {
    Limits::new(v, a).unwrap().with_jerk(j).unwrap()
}

/// A path whose first line has been taken out; 1000 steps of the second one are left.
fn path() -> Path<2, 4> {
    let setups = [axis(100, 1000, 20_000), axis(300, 2000, 50_000)].map(|own| AxisSetup::new(own, 1_000_000));
    let mut path = Path::new(Clock::MICROSECONDS, setups, 1000).unwrap();
    path.push([500, 0], 1_000_000).unwrap();
    path.push([500, 1000], 1_000_000).unwrap();
    path.pass();
    path
}

fn steady(v: f64) -> Motion {
    Motion::steady(real(v / second()))
}

/// Whoever is as fast as the first line allows before the joint, or may be by then, keeps to its speed; from anywhere below, the motion
/// goes on to the speed of the second line. The acceleration and the jerk are those of the first line either way.
#[test]
fn only_what_may_be_too_fast_keeps_to_the_speed_of_the_line_before() {
    for (v, top) in [(20.0, SECOND.v), (90.0, SECOND.v), (91.5, SECOND.v), (92.0, FIRST.v), (100.0, FIRST.v)] {
        let from = (Real::ZERO, real(BEFORE));
        let (course, bounds) = path().course(0, steady(v), from, (Real::ONE, None)).unwrap();
        let most = limits(&bounds);
        assert!(near(most.v, top) && near(most.a, 1000.0) && near(most.j.unwrap(), 20_000.0), "{v}: {most:?}");
        let [there, back] = [change([v, 0.0], top, FIRST), change([top, 0.0], 0.0, FIRST)];
        let time = there.0 + (1000.0 + BEFORE - there.1 - back.1) / top + back.0;
        let (way, took, exit) = outcome(&course);
        assert!(near(way, 1000.0 + BEFORE) && near(took, time) && exit == 0.0, "{v}: {took} s for {time}");
    }
}

/// On its own line a motion has the limits of that one.
#[test]
fn behind_the_joint_the_line_before_does_not_count() {
    let (_, bounds) = path().course(0, steady(90.0), (Real::ZERO, Real::ZERO), (Real::ONE, None)).unwrap();
    let most = limits(&bounds);
    assert!(near(most.v, SECOND.v) && near(most.a, SECOND.a) && near(most.j.unwrap(), 50_000.0), "{most:?}");
}

/// A stop with higher limits has these before the joint too, and a stop after it the ordinary ones again.
#[test]
fn a_quick_stop_has_its_own_limits_on_what_is_left_of_the_line_before() {
    let mut path = path();
    let way = |path: &Path<2, 4>| {
        let stop = path.stop(0, steady(90.0), (Real::ZERO, real(BEFORE)), (None, false), None);
        outcome(&stop.unwrap().unwrap().0).0
    };
    let quick = Most { v: 100.0, a: 8000.0, j: Some(800_000.0) };
    let [slow, fast] = [FIRST, quick].map(|most| change([90.0, 0.0], 0.0, most).1);
    let before = path.hurry(&[axis(1, 8000, 800_000); 2]);
    let got = way(&path);
    assert!(near(got, fast), "{got} for {fast}");
    path.calm(before);
    let got = way(&path);
    assert!(near(got, slow), "{got} for {slow}");
}
