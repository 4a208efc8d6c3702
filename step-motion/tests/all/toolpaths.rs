//! How long ten toolpaths take, beside the time-optimal motion within the same limits and beside a planner of grbl's kind. Both are
//! reckoned here in floating point, and share nothing with the crate.
//!
//! The limits are those of each axis, on lines and in the direction in which a corner turns; a corner may be rounded by the deviation,
//! and by no more than an arc that touches both lines in their middles: so chords of a circle are bounded by its radius. grbl has no such
//! bound, and exceeds the acceleration of its axes on short chords; it gets it here, or it would be compared with what no axis can do.

mod ten;

use core::fmt::Write;

use step_motion::{AxisSetup, Clock, Limits, Path};

use ten::{AHEAD, AXES, DEVIATION, N, Place, Toolpath, on_steps, toolpaths};

const HZ: u32 = 10_000_000;

/// A line in floating point.
struct Stretch {
    length: f64,
    direction: Place,
    speed: f64,
    acceleration: f64,
}

fn stretches(lines: &[(Place, f64)]) -> Vec<Stretch> {
    let mut at = [0; N];
    let mut made = Vec::new();
    for (to, feed) in lines {
        let to = on_steps(*to);
        let way: Place = core::array::from_fn(|axis| (to[axis] - at[axis]) as f64 / AXES[axis][0]);
        at = to;
        let length = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        let direction = way.map(|part| part / length);
        let least = |of: usize| {
            let of_axis = |axis: usize| AXES[axis][of] / direction[axis].abs();
            (0..N).map(of_axis).fold(f64::INFINITY, f64::min)
        };
        made.push(Stretch { length, direction, speed: feed.min(least(1)), acceleration: least(2) });
    }
    made
}

/// The square of the speed at a corner.
fn corner(from: &Stretch, to: &Stretch) -> f64 {
    let turn: Place = core::array::from_fn(|axis| to.direction[axis] - from.direction[axis]);
    let whole = turn.iter().map(|part| part * part).sum::<f64>().sqrt();
    if whole < 1e-7 {
        return f64::INFINITY;
    }
    let acceleration = (0..N).map(|axis| AXES[axis][2] * whole / turn[axis].abs()).fold(f64::INFINITY, f64::min);
    // Half the change of direction is the cosine of half the angle between the lines.
    let cosine = (whole / 2.0).min(1.0);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let bow = DEVIATION * sine * (1.0 + sine) / (cosine * cosine);
    let arc = from.length.min(to.length) / 2.0 * sine / cosine;
    acceleration * bow.min(arc)
}

/// Squares of the greatest speeds at the begin of each line, and of 0 after the last one.
fn corners(path: &[Stretch]) -> Vec<f64> {
    let mut squares = vec![0.0];
    for pair in path.windows(2) {
        let [from, to] = pair else { unreachable!() };
        squares.push(corner(from, to).min(from.speed * from.speed).min(to.speed * to.speed));
    }
    squares.push(0.0);
    squares
}

/// Time on a line from one square of a speed to another.
fn time(line: &Stretch, from: f64, to: f64) -> f64 {
    let a = line.acceleration;
    let peak = (a * line.length + f64::midpoint(from, to)).min(line.speed * line.speed);
    let ramps = (2.0 * peak - from - to) / (2.0 * a);
    let cruise = (line.length - ramps).max(0.0) / peak.sqrt();
    (2.0 * peak.sqrt() - from.sqrt() - to.sqrt()) / a + cruise
}

/// The optimum: as fast at each corner as it and all lines before and after allow.
fn optimum(path: &[Stretch]) -> f64 {
    let mut squares = corners(path);
    for (k, line) in path.iter().enumerate().rev() {
        squares[k] = squares[k].min(squares[k + 1] + 2.0 * line.acceleration * line.length);
    }
    for (k, line) in path.iter().enumerate() {
        squares[k + 1] = squares[k + 1].min(squares[k] + 2.0 * line.acceleration * line.length);
    }
    path.iter().zip(squares.windows(2)).map(|(line, pair)| time(line, pair[0], pair[1])).sum()
}

/// As grbl plans: whenever a line begins, from rest after the last one of its buffer back to it.
fn grbl(path: &[Stretch]) -> f64 {
    let corners = corners(path);
    let (mut entry, mut whole) = (0.0, 0.0);
    for (k, line) in path.iter().enumerate() {
        let end = path.len().min(k + AHEAD);
        let mut exit = 0.0;
        for at in (k + 1..end).rev() {
            exit = corners[at].min(exit + 2.0 * path[at].acceleration * path[at].length);
        }
        exit = exit.min(entry + 2.0 * line.acceleration * line.length);
        whole += time(line, entry, exit);
        entry = exit;
    }
    whole
}

/// As the crate does it.
fn planned(lines: &[(Place, f64)], jerk: Option<[u64; N]>) -> f64 {
    let axes = core::array::from_fn(|axis| {
        let [per_mm, speed, acceleration, _] = AXES[axis];
        let limits = Limits::new((speed * per_mm) as u32, (acceleration * per_mm) as u32).unwrap();
        let limits = jerk.map_or(limits, |jerk| limits.with_jerk(jerk[axis]).unwrap());
        AxisSetup::new(limits, (per_mm * 1000.0) as u32)
    });
    let clock = Clock::new(HZ).unwrap();
    let mut path = Path::<N, AHEAD>::new(clock, axes, (DEVIATION * 1000.0) as u32).unwrap();
    let (mut left, mut end) = (lines.iter(), 0);
    loop {
        while !path.is_full() {
            let Some((to, feed)) = left.next() else { break };
            path.push(on_steps(*to), (feed * 1000.0) as u32).unwrap();
        }
        let Some(line) = path.next_line() else { break };
        end = line.end();
    }
    end as f64 / f64::from(HZ)
}

/// Percent by which a path without a limit of jerk may take longer than the optimum, and than with grbl.
const MOST: f64 = 0.1;

/// Without a limit of jerk the planner is at the optimum, and never slower than grbl, which knows no jerk. The optimum looks ahead without
/// end, the crate and grbl over 16 lines.
#[test]
fn ten_toolpaths_beside_the_optimum_and_grbl() {
    let (mut table, mut faults) = (String::new(), String::new());
    for Toolpath { name, lines, smooth } in toolpaths() {
        let path = stretches(&lines);
        let (best, other) = (optimum(&path), grbl(&path));
        let above = |time: f64, than: f64| (time / than - 1.0) * 100.0;
        let time = planned(&lines, None);
        // A limit that hardly matters, and one that does.
        let jerks = [[4_000_000_000; N], AXES.map(|[per_mm, .., jerk]| (jerk * per_mm) as u64)];
        let [little, much] = jerks.map(|jerk| above(planned(&lines, Some(jerk)), best));
        let found = [above(time, best), above(time, other), little, much];
        let [flat, slower, ..] = found;
        let line = format!("{name:<14} {best:>8.3} s {flat:>+7.2} % {slower:>+7.2} % {little:>+7.2} % {much:>+7.2} %");
        writeln!(table, "{line}").unwrap();
        if found.iter().zip([MOST, MOST, 5.0, smooth]).any(|(found, most)| *found > most) {
            writeln!(faults, "{line} of {smooth} %").unwrap();
        }
        assert!(flat > -MOST, "{name} is faster than its limits allow");
    }
    println!("path            optimum  beside it beside grbl with much, with little jerk\n{table}");
    assert!(faults.is_empty(), "{faults}");
}
