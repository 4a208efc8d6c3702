//! Runs of lines, beside sums of their lengths and the least of their limits.

use super::model::{Most, braking_way, change, coasted};
use super::{float, real};
use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::path::{AxisSetup, Course, End, Leaving, Path};
use crate::path_mover::PathMover;
use crate::planner::Motion;
use crate::real::Real;
use proptest::prelude::*;
use std::vec::Vec;

const N: usize = 3;
pub(crate) type Lines = Path<N, 8>;

/// The second axis limits the acceleration, and the third one the jerk; lines are nearly along the first one.
const LIMITS: [(u32, u32, u64); N] = [(100_000, 1 << 30, 1 << 43), (100_000, 50, 1 << 43), (100_000, 1 << 30, 1000)];

fn clock() -> Clock {
    Clock::new(1_000_000).unwrap()
}

/// Moments in a second.
pub(crate) fn second() -> f64 {
    f64::from(clock().moments())
}

fn axes(pause: u32) -> [AxisSetup; N] {
    LIMITS.map(|(v, a, j)| {
        AxisSetup::new(Limits::new(v, a).unwrap().with_jerk(j).unwrap(), 1_000_000).with_reversal_pause(pause)
    })
}

/// A line in steps, and its speed in steps/s.
pub(crate) type To = ([i64; N], u32);

pub(crate) fn path(lines: &[To]) -> Lines {
    let (mut path, mut at) = (Lines::new(clock(), axes(0), 1000).unwrap(), [0; N]);
    for (by, feed) in lines {
        at = [0, 1, 2].map(|axis: usize| at[axis] + by[axis]);
        path.push(at, *feed).unwrap();
    }
    path
}

/// Lengths in steps and limits in seconds.
pub(crate) fn modelled((by, feed): &To) -> (f64, Most) {
    let length = by.iter().map(|steps| (*steps as f64).powi(2)).sum::<f64>().sqrt();
    let least = |of: fn((u32, u32, u64)) -> f64| {
        let own = |axis: usize| of(LIMITS[axis]) * length / by[axis].abs() as f64;
        (0..N).map(own).fold(f64::INFINITY, f64::min)
    };
    let v = f64::from(*feed).min(least(|(v, ..)| v.into()));
    (length, Most { v, a: least(|(_, a, _)| a.into()), j: Some(least(|(.., j)| j as f64)) })
}

pub(crate) fn limits(bounds: &Bounds) -> Most {
    let second = second();
    let jerk = bounds.jerk.map(|jerk| float(jerk.j) * second.powi(3));
    Most { v: float(bounds.v) * second, a: float(bounds.a) * second.powi(2), j: jerk }
}

pub(crate) fn motion([v, a]: [f64; 2]) -> Motion {
    Motion { v: real(v / second()), a: real(a.abs() / second().powi(2)), up: a >= 0.0 }
}

/// The distance of a curve, its time in seconds and the speed at its end.
pub(crate) fn outcome(course: &Course) -> (f64, f64, f64) {
    let curve = &course.curve;
    (float(curve.way()), float(curve.time - curve.skipped.0) / second(), float(course.exit) * second())
}

pub(crate) fn near(got: f64, want: f64) -> bool {
    (got - want).abs() <= want.abs() * 1e-6 + 1e-4
}

pub(crate) fn lines() -> impl Strategy<Value = Vec<To>> {
    let way = prop_oneof![
        Just([10, 10]),
        Just([13, 10]),
        Just([10, 13]),
        Just([16, 10]),
        Just([10, 16]),
        [8..18_i64, 8..18_i64]
    ];
    let feed = prop_oneof![8 => Just(1000_u32), 1 => Just(1005), 1 => Just(1010), 1 => 300..1000_u32];
    prop::collection::vec(
        (prop_oneof![60..200_i64, 200..2000_i64], way, feed)
            .prop_map(|(x, [y, z], feed)| ([x, y * x / 1000, z * x / 1000], feed)),
        2..8,
    )
}

/// How many lines after the first one belong to its run, and the limits there; `None` if rounding decides.
fn run(path: &Lines, lines: &[(f64, Most)], [v, a]: [f64; 2], fastest: f64) -> Option<(usize, Most)> {
    let (first, mut more) = (lines[0].1, 0);
    let mut most = first;
    let sure = core::cell::Cell::new(true);
    let is_at_least = |a: f64, b: f64| {
        sure.set(sure.get() && (a / b - 1.0).abs() > 1e-6);
        a >= b
    };
    let alike = |a: f64, b: f64, by: f64| is_at_least(by, a.max(b) / a.min(b));
    let held = if a == 0.0 { [0.0; 2] } else { [a.abs(), first.j?] };
    let (mut slowest, mut whole, mut longest) = (first.v, lines[0].0, lines[0].0);
    for (at, (length, line)) in lines.iter().enumerate().skip(1) {
        let corner = float(path.line(at)?.corner) * second();
        let is_open = is_at_least(corner, fastest);
        let least = Most { v: most.v.min(line.v), a: most.a.min(line.a), j: Some(most.j?.min(line.j?)) };
        (whole, longest) = (whole + length, longest.max(*length));
        let next = corner.min(least.v);
        let cap = slowest.min(next);
        // Where a corner allows less than the lines, they are a bend if they are short for it.
        let speeds = if is_at_least(cap, least.v) {
            alike(line.v, most.v, 129.0 / 128.0)
        } else {
            let before = if more > 0 { slowest } else { cap };
            let is_short = |way: f64, part: f64| is_at_least(cap.powi(3) / part, least.j.unwrap() * way.powi(2));
            let near = is_at_least(cap * 1.125, before) && is_at_least(cap * 1.125, next);
            is_short(longest, 8.0) && (near || is_short(whole, 2.0))
        };
        let same = [speeds, alike(line.a, most.a, 1.5), alike(line.j?, most.j?, 1.5)];
        if same != [true; 3]
            || !is_open
            || line.v < fastest.max(v)
            || least.a < held[0] * 0.999_999
            || least.j? < held[1] * 0.999_999
        {
            break;
        }
        (more, most, slowest) = (more + 1, least, cap);
    }
    sure.get().then_some((more, Most { v: slowest, ..most }))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 1 } else { 2000 }))]

    /// A curve leads along all lines of a run, within the least of their limits, from anywhere on its first line or right before it.
    #[test]
    fn a_curve_leads_to_the_end_of_its_run(
        lines in lines(), part in 0.0..0.9, a in prop_oneof![Just(0.0), Just(1.0), 0.0..1.0], place in prop_oneof![Just(0.0), -50.0..100.0_f64],
    ) {
        let (mut path, all) = (path(&lines), lines.iter().map(modelled).collect::<Vec<_>>());
        let (first, case) = (all[0].1, std::format!("{lines:?} {part} {a} {place}"));
        let (v, place): (f64, f64) = (first.v * part, place.min(all[0].0 / 2.0));
        let j = first.j.unwrap();
        // As it speeds up, below its greatest speed.
        let most = (2.0 * j * v.min(first.v - v)).sqrt() * 0.999;
        let a = if a >= 1.0 && most >= first.a { first.a } else { a * most.min(first.a) };
        let fastest = coasted([v, a], first);
        let Some((more, least)) = run(&path, &all, [v, a], fastest) else { return Ok(()) };
        let at = [place, -place].map(|x: f64| real(x.max(0.0)));
        let start = motion([v, a]);
        let Some((course, bounds)) = path.course(0, start, (at[0], at[1]), (Real::ONE, None)) else { return Ok(()) };
        if course.slow {
            // It cannot be slow enough at the end of its run: it brakes over more lines.
            prop_assert!(course.more > more, "{case}");
            return Ok(());
        }
        let got = limits(&bounds);
        prop_assert_eq!(course.more, more, "{}", case);
        prop_assert!(near(got.v, least.v) && near(got.a / least.a, 1.0) && near(got.j.unwrap() / least.j.unwrap(), 1.0), "{got:?} {least:?} {case}");
        let length: f64 = all[..=more].iter().map(|(length, _)| length).sum();
        let (way, ..) = outcome(&course);
        prop_assert!(near(way, length - place) && course.whole, "{way} of {length} {case}");
    }

    /// A stop is as short as the limits of the lines that it takes allow, and knows where it ends.
    #[test]
    fn a_stop_ends_where_its_curve_ends(
        lines in lines(), part in 0.1..1.0, a in prop_oneof![Just(0.0), -1.0..1.0], place in prop_oneof![Just(0.0), -50.0..200.0_f64], any: bool,
    ) {
        let (path, all) = (path(&lines), lines.iter().map(modelled).collect::<Vec<_>>());
        let (first, case) = (all[0].1, std::format!("{lines:?} {part} {a} {place}"));
        let (v, place): (f64, f64) = (first.v * part, place.min(all[0].0 / 2.0));
        let room = if a > 0.0 { first.v - v } else { v };
        let most: f64 = 2.0 * first.j.unwrap() * room;
        let a = a * most.sqrt().min(first.a);
        let at = [place, -place].map(|x: f64| real(x.max(0.0)));
        let Some(stop) = path.stop(0, motion([v, a]), (at[0], at[1]), (None, false), any.then_some(Bounds::NONE)) else { return Ok(()) };
        // The longest run that the motion may take, whatever was asked for as its speed.
        let alike = |a: f64, b: f64| a.max(b) / a.min(b) < 1.499_999;
        let Ok((course, bounds)) = stop else {
            // Then it would take more lines than there are, or lines that are too different.
            let way = change([v, a], 0.0, first).1;
            let open = (1..all.len()).all(|at| float(path.line(at).unwrap().corner) * second() > v);
            let same = open && all.iter().all(|(_, line)| alike(line.a, first.a) && alike(line.j.unwrap(), first.j.unwrap()));
            let total: f64 = all.iter().map(|(length, _)| length).sum();
            prop_assert!(!(same || any && open) || a != 0.0 || way * 1.6 > total - place, "{way} of {total} {case}");
            return Ok(());
        };
        let least = limits(&bounds);
        let (way, time, exit) = outcome(&course);
        let (want_time, want) = change([v, a], 0.0, least);
        prop_assert!(near(way, want) && near(time, want_time) && exit == 0.0, "{way} for {want} {case}");
        let (mut before, mut at) = (0.0, 0);
        while at + 1 < all.len() && before + all[at].0 < place + way - 2e-5 {
            (before, at) = (before + all[at].0, at + 1);
        }
        prop_assert_eq!(course.more, at, "{}", case);
        let left = before + all[at].0 - (place + way);
        prop_assert!(left.abs() < 3e-5 || course.whole == (left < 0.0), "{left} {case}");
        for next in 1..=at {
            let corner = float(path.line(next).unwrap().corner) * second();
            let joint: f64 = all[..next].iter().map(|(length, _)| length).sum();
            let way_left = place + way - joint;
            prop_assert!(way_left <= braking_way([v, a], corner, least) * 1.000_001 + 1e-4, "{corner} {way_left} {case}");
        }
        prop_assert!(at > 0 || left > -3e-5 && near(least.a, first.a), "{least:?} {case}");
        for (_, line) in &all[..=at] {
            prop_assert!(least.a <= line.a * 1.000_001 && least.j.unwrap() <= line.j.unwrap() * 1.000_001, "{case}");
        }
    }

    /// What was found before lines came, ended or were asked for at another speed is not taken for what holds then.
    #[test]
    fn speeds_found_in_slices_are_those_found_at_once(
        lines in lines(), asked in prop::collection::vec((0..8_usize, 0..3_usize, 0..20_usize), 1..9), ended in 0..3_usize,
    ) {
        let part = |at: usize| Real::new([100, 40, 250][at]) / Real::new(100);
        let mut known = Lines::new(clock(), axes(0), 1000).unwrap();
        let (mut at, mut asked) = ([0; N], asked.into_iter().cycle());
        let mut find = |known: &mut Lines| {
            let (line, speed, slices) = asked.next().unwrap();
            let found = (0..slices).find_map(|_| known.find_exit(line, part(speed), 1));
            let at_once = known.clone().exit(line, part(speed));
            (found.is_none_or(|found| found == at_once), line, speed)
        };
        for (done, (by, feed)) in lines.iter().enumerate() {
            at = [0, 1, 2].map(|axis: usize| at[axis] + by[axis]);
            known.push(at, *feed).unwrap();
            let (same, line, speed) = find(&mut known);
            let afresh = path(&lines[..=done]).exit(line, part(speed));
            prop_assert!(same && known.clone().exit(line, part(speed)) == afresh);
        }
        for _ in 0..ended.min(lines.len() - 1) {
            known.pass();
            prop_assert!(find(&mut known).0);
        }
        let (_, line, speed) = find(&mut known);
        let mut afresh = path(&lines);
        for _ in 0..ended.min(lines.len() - 1) {
            afresh.pass();
        }
        prop_assert_eq!(known.exit(line, part(speed)), afresh.exit(line, part(speed)));
    }

    #[test]
    fn a_place_on_a_path(lines in lines(), first in 0..3_usize, way in 0.0..9000.0, last in 0..9_usize) {
        let (path, all) = (path(&lines), lines.iter().map(modelled).collect::<Vec<_>>());
        prop_assume!(first < all.len() && first <= last);
        let (mut left, mut at) = (way, first);
        while at < last.min(all.len() - 1) && left > all[at].0 {
            (left, at) = (left - all[at].0, at + 1);
        }
        let (got, place) = path.locate(first, real(way), last);
        prop_assert!(got == at && near(float(place), left), "{got} {place:?} for {at} {left}");
    }
}

/// Four lines of 1000 steps.
pub(crate) fn four(ways: [[i64; 2]; 4]) -> Lines {
    path(&ways.map(|[y, z]| ([1000, y, z], 1000)))
}

/// What is under way is kept up: a line that allows less is not in the same run.
#[test]
fn an_acceleration_or_jerk_under_way_is_held() {
    let more = |path: &mut Lines, a: f64| {
        path.course(0, motion([300.0, a]), (Real::ZERO, Real::ZERO), (Real::ONE, None)).unwrap().0.more
    };
    // 5000 steps/s² on the first line, 4167 on the others.
    let mut path = four([[10, 10], [12, 10], [12, 10], [12, 10]]);
    assert_eq!([0.0, 2000.0, 4100.0, 4200.0, 5000.0].map(|a| more(&mut path, a)), [3, 3, 3, 0, 0]);
    // 100,000 and 83,333 steps/s³: more than nothing is under way.
    let mut path = four([[10, 10], [10, 12], [10, 12], [10, 12]]);
    assert_eq!([0.0, 10.0, 4100.0].map(|a| more(&mut path, a)), [3, 0, 0]);
    let mut path = four([[10, 10]; 4]);
    assert_eq!(more(&mut path, 5000.25), 3, "rounding must not end a run");
}

fn steady(v: f64) -> Motion {
    motion([v, 0.0])
}

/// The time of a stop over several lines is that of all its curves.
#[test]
fn the_time_of_a_stop_over_lines_that_differ() {
    let path = path(&[([60, 1, 1], 1000), ([60, 40, 1], 1000), ([60, 1, 1], 1000), ([600, 1, 1], 1000)]);
    let (mut at, mut speed, mut want, mut curves) = (0, real(1000.0 / second()), 0.0, 0);
    while let Some((course, _)) = path.begin_to_brake(at, speed) {
        curves += 1;
        want += outcome(&course).1;
        if course.exit.is_zero() {
            break;
        }
        (at, speed) = (at + course.more + 1, course.exit);
    }
    let (_, time) = path.end_of_stop(0, real(1000.0 / second()));
    assert!(curves > 1 && near(float(time) / second(), want), "{time:?} for {want} in {curves}");
}

/// On a line that is too short to slow down on, a motion gets as slow as it can; without a plan it goes on at the speed that it has.
#[test]
fn a_line_that_is_too_short_to_slow_down_on() {
    for (length, more) in [(10, 1.0), (60, 1.0), (10, 1e-9)] {
        let mut path = path(&[([length, 1, 1], 1000)]);
        let (course, _) = path.begin(0, real(1000.0 * more / second()), Real::ONE).unwrap();
        let (way, _, exit) = outcome(&course);
        let (length, most) = modelled(&([length, 1, 1], 1000));
        let want = super::model::slowest_exit([1000.0 * more, 0.0], length, 0.0, most);
        assert!(near(way, length) && (exit - want).abs() < 0.1 && course.whole, "{exit} for {want} {course:?}");
    }
}

/// So that a line for one of two paths may be added to the other.
#[test]
fn paths_that_end_in_the_same_way() {
    let one = path(&[([100, 1, 1], 1000), ([100, 1, 1], 1000)]);
    assert!(one.ends_as(&one.clone()));
    // At another place, after another line, with another direction of an axis, or full.
    let place = path(&[([100, 1, 1], 1000), ([100, 1, 1], 1000), ([-1, 0, 0], 10), ([1, 0, 0], 10), ([100, 1, 1], 10)]);
    let before = path(&[([90, 1, 1], 1000), ([110, 1, 1], 1000)]);
    let way = path(&[([100, 1, 2], 1000), ([50, 1, -1], 1000), ([50, 0, 1], 1000)]);
    let same = path(&[([100, 1, 2], 1000), ([50, 1, 0], 1000), ([50, 0, 0], 1000)]);
    let full = path(&[([10, 1, 1], 1000); 8]);
    assert!(way.target() == same.target() && one.target() == before.target());
    for (one, other) in [(&one, &place), (&one, &before), (&way, &same), (&full, &full)] {
        assert!(!one.ends_as(other));
    }
}

/// Lines for a quick stop, and as they were.
#[test]
fn lines_that_hurry_and_calm_down() {
    let mut path = four([[10, 10]; 4]);
    let accelerations = |path: &Lines| [0, 3].map(|at| limits(&path.line(at).unwrap().bounds).a.round() as u64);
    assert_eq!(accelerations(&path), [5000; 2]);
    let lines = path.hurry(&[Limits::new(1, 1 << 30).unwrap().with_jerk(1 << 43).unwrap(); N]);
    assert!(accelerations(&path)[1] > 100_000_000);
    path.calm(lines);
    assert_eq!(accelerations(&path), [5000; 2]);
}

/// The second axis turns round with a pause of a tenth of a second on either side: from half a step off at 2.5 steps/s it gets there in
/// that time with its 50 steps/s². Where it stood before, it has all of the pause after the corner. Nothing turns where it comes to rest.
#[test]
fn the_speed_at_which_an_axis_turns_round() {
    let corner = |pause: u32, lines: &[[i64; N]]| {
        let (mut path, mut at) = (Lines::new(clock(), axes(pause), 1000).unwrap(), [0; N]);
        for by in lines {
            at = [0, 1, 2].map(|axis: usize| at[axis] + by[axis]);
            path.push(at, 1000).unwrap();
        }
        float(path.line(lines.len() - 1).unwrap().corner) * second()
    };
    let turned = corner(200_000, &[[1000, -10, 0], [1000, 10, 0]]);
    assert!((turned - 250.0).abs() < 0.1, "{turned}");
    let late = corner(100_000, &[[1000, -10, 0], [1000, 0, 0], [1000, 10, 0]]);
    assert!((late - 250.0).abs() < 0.1, "{late}");
    let straight = corner(200_000, &[[1000, -10, 0], [1000, 0, 0]]);
    assert!(straight > 1500.0 && straight < 3000.0, "{straight}");
    // Nearly back the way that it came is back.
    assert!(corner(0, &[[1000, 0, 0], [-1000, 1, 0]]) < 1e-9);
}

/// Lines that a stop leaves one by one, and the curves on them: more lines, exit, time and distance.
fn chain(path: &Lines, mut at: usize, mut speed: Real) -> Vec<(usize, f64, f64, f64)> {
    let mut found = Vec::new();
    while let Some((course, _)) = path.begin_to_brake(at, speed).filter(|_| found.len() < 9) {
        let (way, time, exit) = outcome(&course);
        found.push((course.more, exit, time, way));
        if course.exit.is_zero() {
            break;
        }
        (at, speed) = (at + course.more + 1, course.exit);
    }
    found
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 1 } else { 2000 }))]

    /// A stop stays the same when the path is cut off where it ends; what is cut off is not made, and no step that has been made is undone.
    #[test]
    fn a_path_is_cut_off_where_a_stop_ends(
        lines in prop::collection::vec((30..200_i64, prop_oneof![2 => 0..6_i64, 1 => 0..20_i64], 0..6_i64), 2..8), part in 0.3..1.0, made in 0..30_u32,
    ) {
        let lines: Vec<To> = lines.into_iter().map(|(x, y, z)| ([x, y, z], 1000)).collect();
        let (mut path, all) = (path(&lines), lines.iter().map(modelled).collect::<Vec<_>>());
        let case = std::format!("{lines:?} {part} {made}");
        let start = steady(all[0].1.v * part);
        let Some((course, bounds)) = path.brake(0, start, (Real::ZERO, Real::ZERO), (None, false)) else { return Ok(()) };
        let (more, exit) = (course.more, course.exit);
        let end = if exit.is_zero() { path.locate(0, course.curve.way(), more) } else { path.end_of_stop(more + 1, exit).0 };
        let before = if exit.is_zero() { Vec::new() } else { chain(&path, more + 1, exit) };
        let made = [made, 0, 0];
        let place = path.place(&End { at: end, least: [0; N], most: [u32::MAX; N] }, [7; N], made);
        path.cut(&End { at: end, least: [0; N], most: [u32::MAX; N] }, [7; N], made, Leaving { more, exit, bounds: Some(bounds) });
        prop_assert_eq!((path.len(), path.target()), (end.0 + 1, place), "{}", case);
        prop_assert!(path.end_of_cut().is_some_and(|(at, length)| at == end.0 && near(float(length), float(end.1))), "{case}");
        for axis in 0..N {
            let whole: i64 = lines[..end.0].iter().map(|(by, _)| by[axis]).sum();
            let last = lines[end.0].0[axis] as f64 * float(end.1) / all[end.0].0;
            let last = if end.0 == 0 { last.max(made[axis].into()) } else { last };
            prop_assert!((place[axis] - 7 - whole) as f64 - last <= 0.501 && last - (place[axis] - 7 - whole) as f64 <= 0.501, "{axis} at {place:?} {case}");
        }
        // The first curve's limits hold on its lines, however many of them are left.
        let want = limits(&bounds);
        for at in 0..=more.min(end.0) {
            let got = limits(&path.line(at).unwrap().bounds);
            prop_assert!(near(got.a, want.a) && near(got.j.unwrap() / want.j.unwrap(), 1.0), "{at}: {got:?} {want:?} {case}");
        }
        let after = if exit.is_zero() { Vec::new() } else { chain(&path, more + 1, exit) };
        prop_assert_eq!(before.len(), after.len(), "{} {:?} {:?}", case, before, after);
        for (before, after) in before.iter().zip(&after) {
            let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs() + 1e-4;
            prop_assert!(same(before.1, after.1) && same(before.2, after.2) && same(before.3, after.3), "{before:?} {after:?} {case}");
        }
        let leaves = (0..path.len()).filter(|at| path.line(*at).unwrap().leave.is_some()).count();
        prop_assert_eq!(leaves, before.len(), "{}", case);
    }
}

/// The same of movers; in a quick stop no line is added.
#[test]
fn movers_that_end_in_the_same_way() {
    let mover = |lines: &[To]| PathMover::new(path(lines));
    let one = mover(&[([500, 1, 1], 1000), ([500, 1, 1], 1000)]);
    let mut moving = one.clone();
    moving.resume(0);
    for _ in 0..50 {
        moving.pulse().unwrap();
    }
    assert!(one.ends_as(&one.clone()) && moving.ends_as(&moving.clone()));
    assert!(!one.ends_as(&mover(&[([500, 1, 1], 1000), ([400, 1, 1], 1000)])));
    moving.quick_stop(LIMITS.map(|(v, a, _)| Limits::new(v, a).unwrap()), 0);
    assert!(moving.due().is_some() && moving.ready(false) == Err(Error::Moving));
}

/// A short line whose third axis allows a fifth less jerk is pushed after a line has been planned to the joint before it. Until
/// this was tested, the last two lines were one run, the machine was too fast for it, and stopped dead from 4500 steps/s.
#[test]
fn a_line_that_is_pushed_late_breaks_no_promise() {
    let along_x = |line: crate::line::LinePulses<N>| line.filter(|pulse| pulse.axis == 0).map(|pulse| pulse.tick);
    for [length, up] in [[72, 1], [68, 1], [143, 2]] {
        let mut path = path(&[([20_000, 0, 80], 4500), ([1000, 0, 10], 4500)]);
        let mut ticks: Vec<u64> = along_x(path.next_line().unwrap()).collect();
        path.push([21_000 + length, 0, 90 + up], 4500).unwrap();
        while let Some(line) = path.next_line() {
            ticks.extend(along_x(line));
        }
        let last: Vec<u64> = ticks.windows(2).rev().take(3).map(|pair| pair[1] - pair[0]).collect();
        assert!(last[0] > 10_000 && last[0] > last[1] && last[1] > last[2], "{last:?} before the rest");
        assert_eq!(ticks.len(), usize::try_from(21_000 + length).unwrap());
    }
}
