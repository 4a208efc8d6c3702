//! What is asked for near a joint of two lines: each axis keeps its limits on both of them.

use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

fn machine(limits: [Limits; 2], deviation: u32, lines: &[[i64; 2]]) -> PathMover<2, 6> {
    let axes = limits.map(|limits| AxisSetup::new(limits, 80_000));
    let mut machine = PathMover::new(Path::new(Clock::MICROSECONDS, axes, deviation).unwrap());
    for to in lines {
        machine.push(*to, 1_000_000, 0).unwrap();
    }
    machine
}

fn limits(v: u32, a: u32, j: u64) -> Limits {
    Limits::new(v, a).unwrap().with_jerk(j).unwrap()
}

/// Slower, and faster again, between the last step of a line and its end: the second line is steeper, so the first axis allows more of a
/// speed along it. On the first line it stays at 100 steps/s.
#[test]
fn the_last_half_step_of_a_line_belongs_to_it() {
    for at in 0..20 {
        let own = [limits(100, 26_000, 84_000_000), limits(300, 20_000, 100_000_000)];
        let mut machine = machine(own, 100, &[[45, 21], [91, 43]]);
        let (mut now, mut last) = (0, None);
        while machine.len() > 1 {
            let pulse = machine.pulse().unwrap();
            now = pulse.tick;
            last = if pulse.axis == 0 { Some(now) } else { last };
        }
        now += at * 200;
        machine.set_override(54, now);
        machine.set_override(100, now + 20);
        for tick in now + 20..machine.due().unwrap() {
            let speed = machine.at(tick)[0].speed as f64 / 65536.0;
            assert!(speed <= 100.001, "{speed} steps/s at {tick}");
        }
        while let Some(pulse) = machine.pulse() {
            if pulse.axis == 0 {
                let before = last.replace(pulse.tick).unwrap();
                assert!(pulse.tick - before >= 9999, "{} us after {before}", pulse.tick - before);
            }
        }
    }
}

/// A quick stop in the brake of a hold, with low limits: along the second line the second axis allows less than along the first.
#[test]
fn a_quick_stop_in_a_brake_keeps_the_limits_behind_a_corner() {
    let own = [limits(1200, 9000, 55_000), limits(100, 2300, 25_000)];
    let quick = [limits(1, 9000, 90_000), limits(1, 600, 90_000)];
    for (hold, later) in (60_000..200_000).step_by(4000).flat_map(|at| [500, 3000].map(|later| (at, later))) {
        let mut machine = machine(own, 500, &[[4, 4], [6, 9], [8, 60]]);
        let mut now = 0;
        for time in [hold, hold + later, u64::MAX] {
            while let Some(due) = machine.due().filter(|due| *due <= time) {
                for tick in (now..=due).step_by(50) {
                    for (state, most) in machine.at(tick).iter().zip([9000.0, 2300.0]) {
                        let a = (state.acceleration as f64 / 65536.0).abs();
                        assert!(a <= most * 1.0001, "{a} steps/s² of {most} at {tick}, held at {hold}");
                    }
                }
                machine.pulse();
                now = due;
            }
            now = now.max(time);
            if time == hold {
                machine.hold(now);
            } else {
                machine.quick_stop(quick, now);
            }
        }
    }
}
