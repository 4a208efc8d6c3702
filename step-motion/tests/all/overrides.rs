//! A feed override acts wherever it is asked for.

use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

/// The second axis limits the acceleration, and the third one the jerk, of lines nearly along the first one.
fn three() -> [AxisSetup; 3] {
    [(1 << 30, 1 << 43), (50, 1 << 43), (1 << 30, 1000)].map(|(acceleration, jerk)| {
        AxisSetup::new(Limits::new(100_000, acceleration).unwrap().with_jerk(jerk).unwrap(), 1_000_000)
    })
}

/// Takes the steps of 100 steps and 3000 more in one direction, asks for another feed after some of them, and returns how many
/// ticks apart the steps 2000 and 2001 are.
fn apart(feeds: [u32; 2], behind: i64, percent: u16) -> u64 {
    let limits = Limits::new(1000, 5000).unwrap().with_jerk(50_000).unwrap();
    let axis = AxisSetup::new(limits, 1_000_000);
    let mut machine = PathMover::new(Path::<1, 8>::new(Clock::MICROSECONDS, [axis], 20).unwrap());
    machine.push([100], feeds[0], 0).unwrap();
    machine.push([3100], feeds[1], 0).unwrap();
    let mut ticks = vec![0];
    while let Some(pulse) = machine.pulse() {
        ticks.push(pulse.tick);
        if machine.commanded() == [behind] {
            machine.set_override(percent, pulse.tick);
        }
    }
    assert_eq!(machine.commanded(), [3100]);
    ticks[2001] - ticks[2000]
}

/// Also where the acceleration cannot get to 0 on what is left of a line, and the next one is run at another speed from then on.
#[test]
fn a_lower_feed_is_kept_behind_a_joint() {
    for feeds in [[1000, 1000], [2000, 1000], [1000, 2000]] {
        for behind in 1..150 {
            for percent in [10, 40, 80] {
                let feed = (feeds[1] * u32::from(percent) / 100).min(1000);
                let (got, want) = (apart(feeds, behind, percent), 1_000_000 / u64::from(feed));
                assert!(got.abs_diff(want) <= want / 100 + 1, "{got} for {want}: {feeds:?} {behind} {percent}");
            }
        }
    }
}

/// At the lower feed, lines that were one run are several, or the other way round, so the speed that was right for them is too high:
/// until this was tested, some motions went on at it, and stopped dead at the end of the path from up to 2100 steps/s.
#[test]
fn the_end_of_the_path_is_a_rest_whatever_the_feed_was() {
    let lines = [[297, 2, 2], [539, 5, 7], [232, 2, 2], [137, 1, 2], [154, 1, 2]];
    for behind in (500..1100).step_by(3) {
        for percent in [30, 100, 200] {
            let mut machine = PathMover::new(Path::<3, 8>::new(Clock::MICROSECONDS, three(), 1000).unwrap());
            machine.set_override(250, 0);
            let mut end = [0; 3];
            for by in lines {
                end = [0, 1, 2].map(|axis: usize| end[axis] + by[axis]);
                machine.push(end, 1000, 0).unwrap();
            }
            let mut ticks = Vec::new();
            while let Some(pulse) = machine.pulse() {
                if pulse.axis == 0 {
                    ticks.push(pulse.tick);
                    if ticks.len() == behind {
                        machine.set_override(percent, pulse.tick);
                    }
                }
            }
            let last: Vec<u64> = ticks.windows(2).rev().take(3).map(|pair| pair[1] - pair[0]).collect();
            assert!(
                last[0] > 5000 && last[0] > last[1] && last[1] > last[2],
                "{last:?} before the rest: {behind} {percent}"
            );
            assert_eq!(machine.commanded(), end);
        }
    }
}

/// With a limit of jerk slowing down to a third of the speed takes the greatest distance, and to almost nothing takes less. So a line
/// that can just slow down to 99 % of the feed of the next one cannot slow down to 100 % of it: it ends below that, not above.
#[test]
fn another_override_does_not_pass_the_feed_of_a_slow_line() {
    let limits = Limits::new(80_000, 2_000_000_000).unwrap().with_jerk(1_200_000_000_000).unwrap();
    for (at, percent) in (0..14).flat_map(|at| [(at, 50), (at, 90), (at, 99)]) {
        for (length, feed) in [(1, 200), (1, 2000), (2, 500), (5, 1000), (9, 200)] {
            let path =
                Path::<1, 8>::new(Clock::new(50_000_000).unwrap(), [AxisSetup::new(limits, 1_000_000)], 20).unwrap();
            let mut machine = PathMover::new(path);
            machine.set_override(percent, 0);
            let ends = [5, 5 + length, 25 + length, 90 + length];
            for (to, feed) in ends.into_iter().zip([700_000, 4_000_000, feed, 4_000_000]) {
                machine.push([to], feed, 0).unwrap();
            }
            let mut last = 0;
            while let Some(pulse) = machine.pulse() {
                let made = machine.commanded()[0];
                if made == at {
                    machine.set_override(100, pulse.tick);
                }
                // From step to step of that line.
                if made > ends[1] + 1 && made <= ends[2] {
                    let least = 50_000_000 / u64::from(feed);
                    let apart = pulse.tick - last;
                    assert!(apart + 1 >= least, "{percent} % until {at}: {apart} rather than {least} at {made}");
                }
                last = pulse.tick;
            }
        }
    }
}

/// Two lines that are one run at the override under way are two at the new one, and the motion can only come to rest along both, a
/// little before their end: 66 steps from 600 steps/s. It goes on from there.
#[test]
fn a_brake_that_nobody_asked_for_goes_on_to_the_end() {
    let limits = Limits::new(1000, 5000).unwrap().with_jerk(50_000).unwrap();
    for behind in 300..400 {
        for (first, second) in [(34, 34), (35, 35), (36, 36), (30, 42)] {
            let axis = AxisSetup::new(limits, 1_000_000);
            let mut machine = PathMover::new(Path::<1, 8>::new(Clock::MICROSECONDS, [axis], 20).unwrap());
            machine.set_override(200, 0);
            for (to, feed) in [(400, 300), (400 + first, 1000), (400 + first + second, 500)] {
                machine.push([to], feed, 0).unwrap();
            }
            while let Some(pulse) = machine.pulse() {
                if machine.commanded() == [behind] {
                    machine.set_override(100, pulse.tick);
                }
            }
            assert_eq!(machine.commanded(), [400 + first + second], "{behind}");
        }
    }
}

/// An axis runs two lines as fast as it can, which are asked for at more than that; what follows is slow. A lower override, wherever it
/// is asked for, makes the feeds of both differ. The slow line has its own feed at each step.
#[test]
fn a_lower_override_does_not_run_into_a_slow_line() {
    let machine = |scale: u32, limits: Limits, lines: &[(i64, u32)]| {
        let mut machine =
            PathMover::new(Path::<1, 8>::new(Clock::MICROSECONDS, [AxisSetup::new(limits, scale)], 20).unwrap());
        for (to, feed) in lines {
            machine.push([*to], *feed, 0).unwrap();
        }
        machine
    };
    let limits = |v, a, j| Limits::new(v, a).unwrap().with_jerk(j).unwrap();
    let one = (80_000, limits(3000, 27_200, 168_560), [(654, 40_000), (985, 60_000), (1100, 1000)]);
    let two = (80_000, limits(7071, 141_454, 3_804_488), [(329, 101_616), (765, 266_158), (1296, 353)]);
    for (scale, limits, lines) in [one, two] {
        let slowest = 1e9 / f64::from(lines[2].1) / f64::from(scale) * 1e3;
        for at in (5..lines[1].0 - 5).step_by(7) {
            for (first, then) in [(50, 50), (90, 30), (50, 100), (1, 100), (0, 60)] {
                let mut own = machine(scale, limits, &lines);
                let (mut last, mut asked) = (0, 0);
                while let Some(pulse) = own.pulse().or_else(|| {
                    // On hold.
                    own.set_override(then, last + 1_000_000);
                    own.pulse()
                }) {
                    let behind = own.commanded()[0] - lines[1].0;
                    let apart = (pulse.tick - last) as f64;
                    assert!(
                        behind < 2 || apart > slowest * 0.98,
                        "{apart} us, {behind} steps behind it: {at} {first} {then}"
                    );
                    last = pulse.tick;
                    if own.commanded() == [at] {
                        own.set_override(first, last);
                        asked = last;
                    } else if own.commanded() == [at + 3] {
                        own.set_override(then, last);
                    }
                }
                assert!(own.commanded() == [lines[2].0] && asked > 0);
            }
        }
    }
}
