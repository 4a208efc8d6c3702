//! Lines in several axes: on the line, within the limits of every axis, at rest only where it must be.

use proptest::prelude::*;
use step_motion::{Arc, AxisPulse, AxisSetup, Clock, Direction, Error, Limits, Path, PathMover, Plan, Turning};

fn axis(v: u32, a: u32, j: u64, steps_per_m: u32) -> AxisSetup {
    let limits = Limits::new(v, a).unwrap();
    AxisSetup::new(if j == 0 { limits } else { limits.with_jerk(j).unwrap() }, steps_per_m)
}

/// Runs a line, and checks that no axis leaves it by more than half a step (and a tick). Returns its end.
fn follow<const N: usize>(
    line: impl Iterator<Item = AxisPulse>,
    from: [i64; N],
    to: [i64; N],
    axes: &[AxisSetup; N],
    hz: f64,
) -> Result<u64, TestCaseError> {
    let mut at = from;
    let mut last: [Option<u64>; N] = [None; N];
    let mut now = 0;
    for pulse in line {
        let i = usize::from(pulse.axis);
        prop_assert!(pulse.tick >= now, "{pulse:?} after {now}");
        now = pulse.tick;
        at[i] += if pulse.direction == Direction::Forward { 1 } else { -1 };
        if let Some(last) = last[i] {
            let least = hz / f64::from(axes[i].limits.speed());
            prop_assert!((now - last) as f64 >= least - 1.01, "{pulse:?} after {last}");
        }
        last[i] = Some(now);
        // Where the line is when this axis is between two steps.
        let n = (to[i] - from[i]).abs() as f64;
        let part = (((at[i] - from[i]).abs() as f64) - 0.5) / n;
        for k in 0..N {
            let want = from[k] as f64 + part * (to[k] - from[k]) as f64;
            let slack = f64::from(axes[k].limits.speed()) / hz;
            prop_assert!((at[k] as f64 - want).abs() <= 0.5 + slack + 1e-6, "axis {k} at {} for {want}", at[k]);
        }
    }
    prop_assert_eq!(at, to);
    Ok(now)
}

proptest! {
    #[test]
    fn lines_of_three_axes(
        corners in prop::collection::vec([-600..600_i64, -600..600_i64, -200..200_i64], 1..14),
        feed in 1000..300_000_u32,
        deviation in 0..200_u32,
        j in prop_oneof![Just(0_u64), 100_000..100_000_000_u64],
    ) {
        let axes = [axis(20_000, 400_000, j, 80_000), axis(15_000, 200_000, j, 80_000), axis(4000, 50_000, 0, 400_000)];
        let clock = Clock::new(72_000_000).unwrap();
        let mut path = Path::<3, 6>::new(clock, axes, deviation).unwrap();
        let mut corners = corners.into_iter().peekable();
        let (mut at, mut ends) = ([0; 3], std::collections::VecDeque::new());
        let mut end = 0;
        loop {
            while let Some(corner) = corners.next_if(|_| !path.is_full()) {
                if corner != path.target() {
                    ends.push_back(corner);
                }
                path.push(corner, feed).unwrap();
            }
            let Some(line) = path.next_line() else { break };
            let to = ends.pop_front().unwrap();
            prop_assert!(line.end() >= end);
            end = line.end();
            let last = follow(line, at, to, &axes, 72e6)?;
            prop_assert!(last <= end);
            at = to;
        }
        prop_assert!(ends.is_empty() && path.is_empty());
    }
}

/// Straight on, a line in ten parts takes as long as in one; with a stop at each corner ten times the ramps.
#[test]
fn look_ahead_over_a_straight_line() {
    let axes = [axis(20_000, 400_000, 0, 80_000), axis(20_000, 400_000, 0, 80_000)];
    let run = |parts: i64, deviation: u32, zigzag: i64| {
        let mut path = Path::<2, 16>::new(Clock::MICROSECONDS, axes, deviation).unwrap();
        for part in 1..=parts {
            path.push([part * 10_000 / parts, (part % 2) * zigzag], 1_000_000).unwrap();
        }
        let mut end = 0;
        while let Some(line) = path.next_line() {
            end = line.end();
        }
        end
    };
    let whole = run(1, 10, 0);
    assert_eq!(whole, Plan::new(Clock::MICROSECONDS, axes[0].limits, 10_000).unwrap().duration());
    assert!(run(10, 10, 0).abs_diff(whole) <= 2, "{} for {whole}", run(10, 10, 0));
    assert!(run(10, 0, 500) > run(10, 50, 500));
    assert!(run(10, 50, 500) > run(10, 500, 500));
    assert!(run(10, 500, 500) > whole);
}

/// At a right angle s = sin 45°, so v² = a δ / (sqrt 2 - 1). The speed turns by as much in both axes, and each has its limit there: together
/// they have sqrt 2 times that.
#[test]
fn the_speed_at_a_right_angle() {
    let axes = [axis(50_000, 100_000, 0, 100_000); 2];
    let mut path = Path::<2, 4>::new(Clock::NANOSECONDS, axes, 100).unwrap();
    path.push([3000, 0], 500_000).unwrap();
    path.push([3000, 3000], 500_000).unwrap();
    let before: Vec<u64> = path.next_line().unwrap().map(|pulse| pulse.tick).collect();
    let gap = (before[2999] - before[2998]) as f64 / 1e9;
    // a = 1.414 m/s², δ = 100 µm: 18.48 mm/s, or 1848 steps/s; a step before it is 1901.
    let corner = (100_000.0 * 2_f64.sqrt() * 10.0 / (2_f64.sqrt() - 1.0)).sqrt();
    let want = (corner * corner + 2.0 * 100_000.0).sqrt();
    assert!((1.0 / gap - want).abs() < 2.0, "{} steps/s for {want}", 1.0 / gap);
}

#[test]
fn refusals_leave_the_path_as_it_was() {
    let axes = [axis(1000, 1000, 0, 1000)];
    let mut path = Path::<1, 1>::new(Clock::MICROSECONDS, axes, 5).unwrap();
    assert!(path.next_line().is_none());
    path.push([0], 5).unwrap();
    assert!(path.is_empty());
    for far in [1 << 31, -(1 << 31), 1 << 40, i64::MIN] {
        assert!(matches!(path.push([far], 5), Err(Error::TooManySteps { limit: 0x7fff_ffff, .. })), "{far}");
    }
    path.push([10], 5).unwrap();
    assert_eq!((path.push([20], 5), path.len(), path.target()), (Err(Error::QueueFull), 1, [10]));
    path.not_before(1000);
    assert!(path.next_line().unwrap().all(|pulse| pulse.tick > 1000));
    let scale = [AxisSetup::new(axes[0].limits, 0)];
    assert!(matches!(Path::<1, 1>::new(Clock::MICROSECONDS, scale, 5), Err(Error::NoScale)));
}

/// An axis with three steps on a line whose ramps last 20 s: the first one is 11.5 s away, on the ramp.
#[test]
fn a_step_long_after_the_start_of_a_ramp() {
    let axes = [axis(20_000, 1000, 0, 80_000); 2];
    for hz in [1_000_000, 1_000_000_000] {
        let mut path = Path::<2, 2>::new(Clock::new(hz).unwrap(), axes, 0).unwrap();
        path.push([400_000, 3], u32::MAX).unwrap();
        let slow: Vec<u64> =
            path.next_line().unwrap().filter(|pulse| pulse.axis == 1).map(|pulse| pulse.tick).collect();
        let (half, hz) = ((400_000_f64 / 1000.0).sqrt(), f64::from(hz));
        let first = (2.0 * 400_000.0 / 6.0 / 1000.0_f64).sqrt();
        let want = [first, half, 2.0 * half - first].map(|seconds| seconds * hz);
        for (tick, want) in slow.iter().zip(want) {
            assert!((*tick as f64 - want).abs() <= 0.51 + want * 1e-12, "{slow:?} for {want}");
        }
        assert_eq!(slow.len(), 3);
    }
}

/// The last steps of the first line of two, as a speed in steps/s: that of the corner and what is braked to it over a step
/// and a half of the faster axis.
fn speed_at_the_corner(first: [i64; 2], second: [i64; 2], deviation: u32) -> f64 {
    let axes = [axis(50_000, 100_000, 0, 100_000); 2];
    let mut path = Path::<2, 4>::new(Clock::NANOSECONDS, axes, deviation).unwrap();
    path.push(first, 500_000).unwrap();
    path.push([first[0] + second[0], first[1] + second[1]], 500_000).unwrap();
    let fast = u8::from(first[1].abs() > first[0].abs());
    let ticks: Vec<u64> = path.next_line().unwrap().filter(|p| p.axis == fast).map(|p| p.tick).collect();
    let gap = ticks[ticks.len() - 1] - ticks[ticks.len() - 2];
    1e9 / gap as f64
}

/// v² = a δ s / (1 - s) with s the sine of half the angle between the lines, whichever way they lead. Along 3, 4 the slower axis may
/// have as much speed as the limit of the faster one gives it.
#[test]
fn the_speed_at_a_corner_is_that_of_its_angle() {
    for (sx, sy) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
        for (second, angle) in
            [([4000, -3000], 90.0_f64), ([-4000, 3000], 90.0), ([3000, 4000], 180.0), ([-3000, -4000], 0.0)]
        {
            let turn = |[x, y]: [i64; 2]| [sx * x, sy * y];
            let got = speed_at_the_corner(turn([3000, 4000]), turn(second), 100);
            // At 90° the speed turns by (1, -7) of sqrt(50): the second axis has 7 of these parts. Along either line that axis would have
            // a = 100,000 · 5/4.
            let a = if (angle - 90.0).abs() < 1.0 { 100_000.0 * 50_f64.sqrt() / 7.0 } else { 125_000.0 };
            let s = (angle.to_radians() / 2.0).sin();
            let corner = (a * 10.0 * s / (1.0 - s).max(1e-12)).min(2.0 * a * 5000.0);
            // The faster axis has 4/5 of the speed, and brakes with 100,000 over a step; at the middle of the gap.
            let want = (corner * 0.64 + 2.0 * 100_000.0).sqrt();
            assert!(got > want * 0.99 - 60.0 && got < want * 1.01 + 60.0, "{got} for {want} at {angle}°");
        }
    }
    // All but straight on is no corner, however small the deviation: 0.03°.
    assert!(speed_at_the_corner([1000, 3000], [1001, 3000], 0) > 15_000.0);
    assert!(speed_at_the_corner([1000, 3000], [1100, 3000], 0) < 700.0);
    // 1.2 and 1.5 mrad: a corner is one from 2^-20 of 1 less the cosine on, 1.38 mrad.
    let near = [1004, 1005].map(|x| speed_at_the_corner([1000, 3000], [x, 3000], 0));
    assert!(near[0] > 15_000.0 && near[1] < 700.0, "{near:?}");
}

/// The time goes on from line to line without being rounded.
#[test]
fn many_lines_in_motion_take_the_time_of_one() {
    let axes = [axis(3333, 100_000, 0, 80_000)];
    let mut path = Path::<1, 300>::new(Clock::MICROSECONDS, axes, 20).unwrap();
    for part in 1..=300 {
        path.push([7 * part], u32::MAX).unwrap();
    }
    let mut ticks = Vec::new();
    while let Some(line) = path.next_line() {
        ticks.extend(line.map(|pulse| pulse.tick));
    }
    let whole = Plan::new(Clock::MICROSECONDS, axes[0].limits, 2100).unwrap();
    let other = ticks.iter().zip(whole.pulses()).filter(|(tick, alone)| **tick != *alone).count();
    assert!(ticks.len() == 2100 && other <= 20, "{other} ticks are others");
}

/// A line after a rest begins at a half tick: at every other place its steps are those of a plan of its own.
#[test]
fn a_line_after_a_rest_begins_on_the_grid() {
    let axes = [axis(20_000, 400_000, 0, 80_000)];
    let alone: Vec<u64> = Plan::new(Clock::MICROSECONDS, axes[0].limits, 300).unwrap().pulses().collect();
    let mut same = 0;
    for first in 100..140 {
        let mut path = Path::<1, 2>::new(Clock::MICROSECONDS, axes, 20).unwrap();
        path.push([first], u32::MAX).unwrap();
        path.push([first - 300], u32::MAX).unwrap();
        path.next_line().unwrap();
        let ticks: Vec<u64> = path.next_line().unwrap().map(|pulse| pulse.tick).collect();
        let shift = ticks[0] - alone[0];
        same += u32::from(ticks.iter().zip(&alone).all(|(tick, alone)| tick - alone == shift));
    }
    assert!(same >= 12, "{same} of 40");
}

/// A circle of chords at more feed than its radius allows: v² / r is what an axis can take, however small the chords and however large the
/// deviation.
#[test]
fn on_chords_of_a_circle_the_axes_keep_their_acceleration() {
    // Chords of nine steps turn by more than the circle does, for they end at whole steps.
    for (radius, error, deviation, least) in
        [(5000, 2, 20, 1.0), (5000, 20, 500, 1.0), (20_000, 2, 20, 1.0), (1000, 1, 100, 0.5)]
    {
        // 100 steps/mm, 2 m/s².
        let axes = [axis(100_000, 200_000, 0, 100_000); 2];
        let mut path = Path::<2, 512>::new(Clock::new(100_000_000).unwrap(), axes, deviation).unwrap();
        let circle = Arc::new([radius, 0], [radius, 0], [0, 0], Turning::Counterclockwise, error).unwrap();
        let begin = [i64::from(radius) / 10, 0];
        for [x, y] in circle {
            path.push([i64::from(x) / 10 - begin[0], i64::from(y) / 10], 1_000_000).unwrap();
        }
        let mut lines = Vec::new();
        let mut begin = 0;
        while let Some(line) = path.next_line() {
            lines.push(line.end() - begin);
            begin = line.end();
        }
        // The middle half of it, without the ramps.
        let part = lines.len() / 4;
        let seconds = lines[part..part * 3].iter().sum::<u64>() as f64 / 1e8;
        let speed = core::f64::consts::PI * f64::from(radius) / 1e6 / seconds;
        let acceleration = speed * speed / (f64::from(radius) / 1e6);
        // At the corners; along a chord it gains and loses a part of that.
        let chord = (8.0 * f64::from(error) / f64::from(radius)).sqrt();
        let most = 2.0 * (1.02 + chord / 2.0);
        assert!((least..most).contains(&acceleration), "{acceleration} m/s² of {most} at {radius} um, {error} um");
    }
}

/// Chords of a millimetre that bend a little, with a limit of jerk: as fast as one line of their length, and with the steps of each.
#[test]
fn short_lines_carry_their_acceleration_over_the_joints() {
    for (jerk, lines) in [(1_000_000, 40), (200_000, 40), (1_000_000, 200)] {
        let axis = AxisSetup::new(Limits::new(20_000, 100_000).unwrap().with_jerk(jerk).unwrap(), 80_000);
        let run = |ends: &[[i64; 2]]| {
            let mut path = Path::<2, 256>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
            for end in ends {
                path.push(*end, 100_000).unwrap();
            }
            let (mut end, mut steps) = (0, [0_i64; 2]);
            while let Some(line) = path.next_line() {
                assert!(line.end() >= end);
                end = line.end();
                for pulse in line {
                    steps[usize::from(pulse.axis)] += 1;
                }
            }
            assert_eq!(steps, ends[ends.len() - 1]);
            end as f64
        };
        let chords: Vec<[i64; 2]> = (1..=lines).map(|n| [80 * n, n * n / 16]).collect();
        let last = chords[chords.len() - 1];
        let (chords, whole) = (run(&chords), run(&[last]));
        assert!(chords <= whole * 1.05, "{jerk}, {lines}: {chords} us in short lines, {whole} in one");
    }
}

/// Lines that were pushed under an override of 50 % are joined at the full speed once the override is 100 %.
#[test]
fn an_override_holds_at_joints_too() {
    let path = Path::<1, 8>::new(Clock::MICROSECONDS, [axis(20_000, 200_000, 0, 80_000)], 20).unwrap();
    let mut machine = PathMover::new(path);
    machine.set_override(50, 0);
    for line in 1..=8 {
        machine.push([line * 800], 100_000, 0).unwrap();
    }
    let mut ticks: Vec<u64> = Vec::new();
    while let Some(pulse) = machine.pulse() {
        ticks.push(pulse.tick);
        if ticks.len() == 1000 {
            machine.set_override(100, pulse.tick);
        }
    }
    assert_eq!(ticks.len(), 6400);
    // 4000 and 8000 steps/s, on a line and where two meet.
    for (step, wants) in [(600, 250), (800, 250), (2400, 125), (2800, 125), (4000, 125)] {
        assert!((ticks[step] - ticks[step - 1]).abs_diff(wants) <= 1, "{step}: {:?}", &ticks[step - 1..=step]);
    }
}

/// An axis that goes on as before does not wait for its pause, nor does one that stands; one that turns round does.
#[test]
fn only_an_axis_that_turns_round_waits() {
    let axes = [axis(20_000, 400_000, 0, 80_000).with_reversal_pause(50_000); 2];
    let first = |lines: &[[i64; 2]]| {
        let mut path = Path::<2, 4>::new(Clock::MICROSECONDS, axes, 0).unwrap();
        let (mut rest, mut wait) = (0, 0);
        for to in lines {
            path.push(*to, 100_000).unwrap();
            let mut line = path.next_line().unwrap();
            let end = line.end();
            wait = line.next().unwrap().tick - rest;
            rest = end;
        }
        wait
    };
    assert!(first(&[[400, 0]]) < 3000 && first(&[[400, 0], [800, 0]]) < 3000 && first(&[[400, 0], [400, 200]]) < 3000);
    assert!(first(&[[400, 0], [0, 0]]) > 50_000 && first(&[[-400, 0]]) > 50_000);
}

/// Lines that come one by one while it moves are planned for again and again, from where the line before ends: no step is too early.
#[test]
fn lines_that_come_one_by_one_continue_each_other() {
    let axes = [axis(20_000, 200_000, 2_000_000, 80_000)];
    let mut path = Path::<1, 3>::new(Clock::new(100_000_000).unwrap(), axes, 20).unwrap();
    let (mut ticks, mut at) = (Vec::new(), 0);
    for _ in 0..60 {
        while !path.is_full() {
            at += 97;
            path.push([at], 250_000).unwrap();
        }
        ticks.extend(path.next_line().unwrap().map(|pulse| pulse.tick as f64 / 1e8));
    }
    for three in ticks.windows(3) {
        let speeds = [1.0 / (three[1] - three[0]), 1.0 / (three[2] - three[1])];
        let acceleration = (speeds[1] - speeds[0]) / (three[2] - three[0]) * 2.0;
        assert!(
            speeds[1] <= 20_010.0 && acceleration.abs() <= 200_000.0 * 1.05,
            "{speeds:?} {acceleration} at {}",
            three[2]
        );
    }
    assert!(ticks.len() == 60 * 97);
}

/// A line that allows less acceleration or jerk is pushed after lines in its direction, at any time: the machine comes to its end
/// as slowly as the acceleration of the first axis lets it come to rest.
#[test]
fn a_weak_line_that_is_pushed_late_is_slow_enough_in_time() {
    const LIMITS: [(u32, u32, u64); 3] =
        [(100_000, 200_000, 1 << 40), (100_000, 50, 1 << 40), (100_000, 1 << 30, 1000)];
    let axes = LIMITS.map(|(v, a, j)| AxisSetup::new(Limits::new(v, a).unwrap().with_jerk(j).unwrap(), 1_000_000));
    for [before, up] in [[1000, 10], [1000, 8], [800, 8], [2000, 20]] {
        for [length, rise] in [[72, 1], [60, 1], [100, 1], [143, 2], [500, 6]] {
            for late in [300, 100, 30, 3, 1] {
                let [first, second] = [[20_000, 0, 80], [20_000 + before, 0, 80 + up]];
                let end = [second[0] + length, 0, second[2] + rise];
                let mut machine = PathMover::new(Path::<3, 8>::new(Clock::MICROSECONDS, axes, 1000).unwrap());
                machine.push(first, 4500, 0).unwrap();
                machine.push(second, 4500, 0).unwrap();
                let (mut last, mut interval) = (0, 0);
                while let Some(pulse) = machine.pulse().filter(|_| machine.commanded() != end || interval == 0) {
                    if pulse.axis == 0 {
                        (last, interval) = (pulse.tick, pulse.tick - last);
                    }
                    if machine.commanded()[0] == first[0] - late && machine.target() != end {
                        machine.push(end, 4500, pulse.tick).unwrap();
                    }
                }
                assert_eq!(machine.commanded(), end);
                assert!(interval > 2000, "{interval} us before the rest: {before} {up}, {length} {rise}, {late}");
            }
        }
    }
}

/// Equal lines in one direction, whose joint is in the middle of a curve, where a piece of it begins: each begins where and when the one
/// before ends, whether all are known from the start or one is pushed under way. In a symmetric move the joint is at its peak.
#[test]
fn a_line_begins_when_the_one_before_ends() {
    let limits = |v, a, j| Limits::new(v, a).unwrap().with_jerk(j).unwrap();
    let slow = (10_000, limits(10_000, 100, 100_000), 1000, vec![(2, 100), (4, 10_000), (6, 10_000)], 1_000_000, 300);
    let fast = vec![(12, 5000), (244, 100_000), (476, 100_000), (708, 100_000)];
    let fast = (80_000, limits(100_000, 12_468, 3_520_137), 1000, fast, 168_000_000, 300);
    for (scale, limits, deviation, lines, hz, times) in [slow, fast] {
        for late in 0..=lines.len() {
            for longer in 0..times {
                let axis = AxisSetup::new(limits, scale);
                let mut path = Path::<1, 8>::new(Clock::new(hz).unwrap(), [axis], deviation).unwrap();
                let mut left = lines.iter().map(|(to, feed)| (to + longer * (to - 1), *feed));
                let (mut end, mut last, mut interval) = (0, 0, u64::MAX);
                for taken in 0..lines.len() {
                    let known = if taken >= late { lines.len() } else { late };
                    while path.len() + taken < known.max(taken + 1) {
                        let (to, feed) = left.next().unwrap();
                        path.push([to], feed).unwrap();
                    }
                    let line = path.next_line().unwrap();
                    let (begin, over) = (end, line.end());
                    for pulse in line {
                        let now = pulse.tick - last;
                        assert!(pulse.tick + 1 >= begin && pulse.tick <= over + 1, "{} in {begin}..{over}", pulse.tick);
                        let stands = last == 0 || begin == last;
                        assert!(stands || now < 8 * interval.max(1000), "{now} after {interval}, {late} {longer}");
                        (last, interval) = (pulse.tick, now);
                    }
                    end = over;
                }
            }
        }
    }
}

/// How long a circle of 50 mm takes at a feed in mm/s: of chords that are no more than 2 um from it, at 400 steps/mm, within 500 mm/s² and
/// 10,000 mm/s³.
fn circle(feed: f64) -> f64 {
    let scale = 400.0;
    let limits = Limits::new(400_000, 200_000).unwrap().with_jerk(4_000_000).unwrap();
    let path = Path::<2, 64>::new(Clock::MICROSECONDS, [AxisSetup::new(limits, 400_000); 2], 20).unwrap();
    let mut machine = PathMover::new(path);
    let place = |k: i32| {
        let angle = core::f64::consts::TAU * f64::from(k) / 512.0;
        [1.0 - angle.cos(), angle.sin()].map(|part| (50.0 * scale * part).round() as i64)
    };
    let mut left = (1..=512).map(place).peekable();
    let mut now = 0;
    machine.hold(0);
    while !machine.is_full() {
        machine.push(left.next().unwrap(), (feed * 1e3) as u32, now).unwrap();
    }
    machine.resume(0);
    while let Some(pulse) = machine.pulse() {
        now = pulse.tick;
        if !machine.is_full() {
            if let Some(to) = left.next() {
                machine.push(to, (feed * 1e3) as u32, now).unwrap();
            }
        }
    }
    assert_eq!(machine.commanded(), [0, 0]);
    now as f64 / 1e6
}

/// A curve of short lines is passed at the speed of its corners without a rest of the acceleration at each: with a limit of jerk no more
/// than an eighth above the time of an S-curve to the root of a r, 158 mm/s, over the whole circle; and a higher feed takes no longer.
#[test]
fn a_circle_is_as_fast_as_its_corners() {
    // To 158 mm/s: 500 mm/s² are reached in 50 ms.
    let speed = (500.0 * 50.0_f64).sqrt();
    let ramp = speed / 500.0 + 0.05;
    let least = 2.0 * ramp + (core::f64::consts::TAU * 50.0 - speed * ramp) / speed;
    let [half, whole, more, most] = [0.5, 1.0, 2.0, 10.0].map(|part| circle(speed * part));
    assert!(whole < least * 1.16 && more < least * 1.16 && most < least * 1.16, "{whole} {more} {most} for {least}");
    assert!(most <= whole && whole < half, "{half} {whole} {most}");
}

/// Between lines that differ by less than 1.4 mrad the speed is that of the corner as well, for a deviation of half a step at least: a fine
/// and slow axis beside a coarse and fast one. v² = a δ s / (1 - s), with 1 - s = θ²/8.
#[test]
fn a_small_corner_is_a_corner() {
    for (deviation, um) in [(0, 0.5), (1, 1.0), (20, 20.0)] {
        let axes = [axis(80_000, 400_000, 0, 80_000), axis(1000, 1000, 0, 1_000_000)];
        let mut path = Path::<2, 4>::new(Clock::NANOSECONDS, axes, deviation).unwrap();
        path.push([80_000, 0], 500_000).unwrap();
        path.push([160_000, 1375], 500_000).unwrap();
        let last: Vec<u64> = path.next_line().unwrap().map(|pulse| pulse.tick).collect();
        let speed = 1e9 / (last[79_999] - last[79_998]) as f64 / 80.0;
        let angle: f64 = 1.375e-3;
        let want = (1e-3 * um * 1e-6 * 8.0 / angle.powi(2)).sqrt() * 1e3;
        // A step before it.
        assert!(speed < want * 1.02 + 5.0 && speed > want * 0.98, "{speed} mm/s for {want} at {deviation}");
    }
}
