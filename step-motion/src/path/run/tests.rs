//! What is found of the lines ahead, and what is kept where a curve does not fit.

use super::*;
use crate::limits::Limits;
use crate::tests::model::{braking_way, change};
use crate::tests::path::{Lines, To, four, limits, modelled, motion, near, outcome, path, second};
use crate::tests::{float, real};

fn steady(v: f64) -> Motion {
    Motion::steady(real(v / second()))
}

const HERE: (Real, Real) = (Real::ZERO, Real::ZERO);

/// A line that is requested a little slower belongs to the run of a motion that is no faster, or so fast that it slows down at once.
#[test]
fn which_motions_lead_on_to_a_slower_line() {
    let mut path = path(&[([1000, 1, 1], 1010), ([1000, 1, 1], 1005)]);
    let requested = Motion::steady(path.line(0).unwrap().speed(Real::ONE));
    let starts = [steady(1000.0), steady(1008.0), requested, steady(1200.0)];
    let more = starts.map(|start| path.course(0, start, HERE, (Real::ONE, None)).unwrap().0.more);
    assert_eq!(more, [1, 0, 0, 1]);
}

/// But never to one whose axes do not allow its speed.
#[test]
fn no_motion_leads_on_to_a_line_that_is_too_slow_for_it() {
    let mut path = path(&[([1000, 0, 1], 1000), ([1000, 1000, 1000], 1000)]);
    // 173,205 steps/s at most along the second line, where all axes have 100,000; the corner does not count here.
    path.lines[1].as_mut().unwrap().corner = Real::HUGE;
    let more = |path: &Lines, v: f64| {
        let kind = Kind {
            part: Some(Real::ONE),
            speed: real(v / second()),
            held: [Real::ZERO; 2],
            corner: Real::ZERO,
            any: true,
            feeds: false,
            early: Real::ZERO,
        };
        path.run(0, kind, 8).unwrap().more
    };
    assert_eq!([2000.0, 173_000.0, 174_000.0].map(|v| more(&path, v)), [1, 1, 0]);
}

/// Lines of one length, with the same jerk, of which one allows less acceleration: 50 steps/s² of the second axis.
#[test]
fn a_run_has_the_least_acceleration_of_its_lines() {
    for turned in [false, true] {
        let mut ways = [25, 33].map(|y: i64| ([(65_i64.pow(2) - y.pow(2)).isqrt(), y, 1], 1000));
        if turned {
            ways.reverse();
        }
        let mut path = path(&ways);
        path.lines[1].as_mut().unwrap().corner = Real::HUGE;
        let run = path.run_from(0, Real::ONE).unwrap();
        let least = limits(&run.bounds);
        let length = 4226_f64.sqrt();
        assert_eq!(run.more, 1);
        assert!(near(least.a, 50.0 * length / 33.0) && near(least.j.unwrap(), 1000.0 * length), "{least:?}");
    }
}

/// Lines of which no two are one run.
fn apart() -> [To; 4] {
    [([200, 0, 2], 1000), ([60, 0, 1], 1000), ([70, 0, 3], 1000), ([80, 0, 1], 1000)]
}

/// A line that is added changes the speeds from the end back to the first that stays the same, and no others are found again: here the
/// corners allow so little that each line can come to rest.
#[test]
fn a_line_that_is_added_costs_the_same_behind_any_number_of_lines() {
    let lines: std::vec::Vec<To> = (0..8).map(|at| ([400, 0, 1 + at % 2], 1000)).collect();
    let slices = |path: &mut Lines| (1..100).find(|_| path.find_exit(0, Real::ONE, 1).is_some()).unwrap();
    let mut all = path(&lines[..1]);
    let mut costs = std::vec::Vec::new();
    let mut at = all.target();
    for (by, feed) in &lines[1..] {
        at = [0, 1, 2].map(|axis: usize| at[axis] + by[axis]);
        all.push(at, *feed).unwrap();
        costs.push(slices(&mut all));
    }
    assert!(costs.iter().all(|cost| *cost <= 5), "{costs:?}");
}

/// From what is known of the last lines, as from their end.
#[test]
fn what_is_known_is_gone_on_from() {
    let (mut known, mut afresh) = (path(&apart()), path(&apart()));
    let last = known.exit(2, Real::ONE);
    let all = known.exit(0, Real::ONE);
    assert!(!last.is_zero() && all == afresh.exit(0, Real::ONE), "{all:?}");
    assert_eq!(all, known.exit(0, Real::ONE));
    assert_eq!((known.known(1), known.promised(0)), (Some(all), all));
}

/// What was found of lines does not hold once they allow more, or end elsewhere; nor does what was promised. Where lines are only added,
/// the promise remains.
#[test]
fn nothing_is_known_of_lines_that_have_changed() {
    let mut path = path(&apart());
    for line in path.lines.iter_mut().flatten() {
        line.corner = Real::HUGE;
    }
    let found = path.exit(0, Real::ONE);
    path.push([500, 0, 30], 1000).unwrap();
    assert_eq!((path.known(1), path.promised(0)), (None, found));
    let longer = path.exit(0, Real::ONE);
    path.hurry(&[Limits::new(100_000, 1 << 30).unwrap().with_jerk(1 << 43).unwrap(); 3]);
    assert_eq!((path.known(1), path.promised(0)), (None, Real::ZERO));
    let quicker = path.exit(0, Real::ONE);
    assert!(longer < quicker, "{longer:?} {quicker:?}");
    let mut afresh = path.clone();
    for line in afresh.lines.iter_mut().flatten() {
        line.ahead = Ahead::NONE;
    }
    assert_eq!(quicker, afresh.exit(0, Real::ONE));
}

/// The greatest speed from which a corner's speed or a rest can be had: of speeds below 0.618 of it the rest takes less distance.
#[test]
fn the_most_before_a_line_that_ends_at_a_corner() {
    let greatest = |way: &dyn Fn(f64) -> f64, from: f64, length: f64| {
        (0..100_000).map(|tenths| from + f64::from(tenths) / 10.0).take_while(|v| way(*v) <= length).last().unwrap()
    };
    let lines = [([300, 0, 2], 1000), ([100, 0, 3], 1000), ([400, 0, 3], 1000), ([400, 0, 0], 1000)];
    let mut rests = 0;
    for corner in [50.0, 150.0, 250.0, 400.0, 500.0, 600.0, 700.0] {
        for known in [false, true] {
            let mut path = path(&lines);
            path.lines[2].as_mut().unwrap().corner = real(corner / second());
            if known {
                assert!(near(float(path.exit(1, Real::ONE)) * second(), corner));
            }
            let line = path.line(1).unwrap();
            let (length, most) = (float(line.length), limits(&line.bounds));
            let [rest, leaves] = [0.0, corner].map(|to| greatest(&|v| change([v, 0.0], to, most).1, to, length));
            let got = float(path.most(0)) * second();
            assert!((got - rest.max(leaves)).abs() < 0.2, "{got} for {rest} or {leaves}, {corner} {known}");
            rests += usize::from(rest > leaves + 10.0);
        }
    }
    assert!((4..12).contains(&rests), "{rests}");
}

/// What is known to be slower than a corner, here for the end of the path, leaves the most before it what it is without that.
#[test]
fn what_is_known_to_be_slow_is_no_corner() {
    let mut path = path(&[([300, 0, 2], 1000), ([100, 0, 3], 1000), ([40, 0, 3], 1000)]);
    path.lines[2].as_mut().unwrap().corner = real(700.0 / second());
    let most = path.most(0);
    let known = float(path.exit(1, Real::ONE)) * second();
    assert!(known > 0.0 && known < 600.0, "{known}");
    assert_eq!(path.most(0), most);
}

/// A line that allows less jerk comes when the motion has just as much room left as it needs to come to rest before it.
#[test]
fn a_rest_that_fits_is_kept_before_a_line_that_allows_less() {
    let mut path = path(&[([2000, 0, 20], 4500)]);
    let line = path.line(0).unwrap();
    let (length, most) = (float(line.length), limits(&line.bounds));
    let way = change([4500.0, 0.0], 0.0, most).1 + 1e-3;
    path.push([2072, 0, 21], 4500).unwrap();
    assert_eq!(path.run_from(0, Real::ONE).unwrap().more, 1);
    let from = (real(length - way), Real::ZERO);
    for braking in [false, true] {
        let planned = if braking {
            path.brake(0, steady(4500.0), from, (None, false))
        } else {
            path.course(0, steady(4500.0), from, (Real::ONE, None))
        };
        let (course, bounds) = planned.unwrap();
        let (got, _, exit) = outcome(&course);
        assert!(near(got, way) && exit == 0.0 && course.more == 0, "{got} for {way}, {exit}");
        assert!(near(limits(&bounds).j.unwrap() / most.j.unwrap(), 1.0));
    }
}

/// A stop that fits on the first line does not keep to the limits of the next one, also if it begins a little before the first.
#[test]
fn a_stop_that_fits_takes_no_limits_of_the_next_line() {
    let path = path(&[([2000, 0, 20], 4500), ([72, 0, 1], 4500)]);
    let line = path.line(0).unwrap();
    let (length, most) = (float(line.length), limits(&line.bounds));
    let way = change([4500.0, 0.0], 0.0, most).1;
    for (before, room) in [(0.0, 1e-3), (0.4, 1e-3), (0.4, 0.7)] {
        let from = (real(length + before - way - room), real(before));
        let stop = path.stop(0, steady(4500.0), from, (None, false), None).unwrap();
        let (course, bounds) = stop.unwrap();
        let (got, _, exit) = outcome(&course);
        assert!(near(got, way) && exit == 0.0 && course.more == 0, "{got} for {way}, {exit}");
        assert!(near(limits(&bounds).j.unwrap() / most.j.unwrap(), 1.0), "{before} {room}");
    }
}

/// What was promised for full speed holds at an override of 30 %: the motion leaves its run at the least speed that the distance allows,
/// although it could come to rest at the joint between the two lines, of which the first one allows more jerk.
#[test]
fn an_override_stops_at_no_joint() {
    let lines = [([2000, 0, 20], 4500), ([72, 0, 1], 4500), ([6000, 0, 0], 4500)];
    let mut path = path(&lines);
    for line in path.lines.iter_mut().flatten() {
        line.corner = Real::HUGE;
    }
    let [first, next] = [0, 1].map(|at| path.line(at).unwrap());
    let (length, most) = (float(first.length), limits(&first.bounds));
    let (all, least) = (length + float(next.length), limits(&next.bounds));
    let rest = change([4500.0, 0.0], 0.0, most).1;
    let place = length - rest - 40.0;
    let left = all - place;
    assert!(left < change([4500.0, 0.0], 0.0, least).1 && left < change([4500.0, 0.0], 1350.0, least).1);
    assert!(near(float(path.exit(1, Real::ONE)) * second(), 4500.0));
    let part = real(0.3);
    let (course, _) = path.course(0, steady(4500.0), (real(place), Real::ZERO), (part, None)).unwrap();
    let (got, _, exit) = outcome(&course);
    assert!(course.more == 1 && near(got, left), "{} {got} for {left}", course.more);
    assert!(exit > 1350.0 && (change([4500.0, 0.0], exit, least).1 - left).abs() < 1e-2, "{exit}");
}

/// From 1000 steps/s, 100 steps before the end of a line that allows 5000 steps/s² and one that allows 4167: at the joint, the least of both
/// counts. Slower corners are not passed on one curve, all others are.
#[test]
fn a_stop_is_slow_enough_for_each_corner_on_its_way() {
    let mut path = path(&[([1000, 10, 10], 1000), ([1000, 12, 10], 1000)]);
    let length = float(path.line(0).unwrap().length);
    let mut passed = std::vec::Vec::new();
    for corner in 1..1000_u16 {
        path.lines[1].as_mut().unwrap().corner = real(f64::from(corner) / second());
        let from = (real(length - 100.0), Real::ZERO);
        let Ok((course, bounds)) = path.stop(0, steady(1000.0), from, (None, false), None).unwrap() else { continue };
        let left = outcome(&course).0 - 100.0;
        let most = braking_way([1000.0, 0.0], f64::from(corner), limits(&bounds));
        assert!(course.more == 1 && left <= most * 1.000_001, "{corner}: {left} of {most}");
        passed.push(corner);
    }
    let least = passed[0];
    assert!((200..999).contains(&least) && passed.len() == usize::from(1000 - least), "{passed:?}");
}

/// A corner is slow enough for what a motion that still speeds up comes to: with 250 steps/s² and 5100 steps/s³, 6 steps/s more.
#[test]
fn a_stop_leads_over_no_corner_that_is_too_slow() {
    let path = path(&[([1000, 10, 200], 1000), ([1000, 200, 200], 1000)]);
    let corner = float(path.line(1).unwrap().corner) * second();
    assert!((100.0..600.0).contains(&corner), "{corner}");
    let stops = |v: f64| {
        path.stop(0, motion([v, 250.0]), (real(1000.0), Real::ZERO), (None, false), Some(Bounds::NONE)).unwrap().is_ok()
    };
    assert_eq!([corner - 7.0, corner - 5.0].map(stops), [true, false]);
}

/// A stop that is whole ends with its line, to 2^-16 of a step.
#[test]
fn a_stop_right_at_the_end_of_a_line() {
    let path = four([[10, 10]; 4]);
    let stop =
        |place: f64| path.stop(0, steady(1000.0), (real(place), Real::ZERO), (None, false), None).unwrap().unwrap().0;
    let (way, ..) = outcome(&stop(0.0));
    let (length, slack) = (float(path.line(0).unwrap().length), 16_f64.exp2().recip());
    for (short, more, whole) in [
        (1.0, 0, false),
        (2.0 * slack, 0, false),
        (0.5 * slack, 0, true),
        (-0.5 * slack, 0, true),
        (-2.0 * slack, 1, false),
        (-1.0, 1, false),
    ] {
        let course = stop(length - way - short);
        assert_eq!((course.more, course.whole), (more, whole), "{short}");
    }
}

/// If it does not fit: as slow as it can get to the end of the run, which is all that is left of the line.
#[test]
fn a_brake_that_is_too_late() {
    let path = path(&[([100, 1, 1], 1000), ([1000, 10, 20], 1000)]);
    for (place, before) in [(0.0, 0.0), (30.0, 0.0), (0.0, 20.0)] {
        let (course, _) = path.brake(0, steady(1000.0), (real(place), real(before)), (None, false)).unwrap();
        let (way, _, exit) = outcome(&course);
        let (length, most) = modelled(&([100, 1, 1], 1000));
        assert!(near(way, length + before - place), "{way}");
        let need = change([1000.0, 0.0], exit, most).1;
        assert!(exit > 0.0 && (need / way - 1.0).abs() < 1e-3, "{need} of {way} to {exit}");
    }
}
