//! Another target or speed while an axis brakes: it is let go, kept or passed, whichever is the fastest.

use step_motion::{Clock, Direction, Limits, Mover};

/// 10,000 steps/s, 100,000 steps/s² and 2,000,000 steps/s³ to 4000, which brakes from 0.4 to 0.55 s; at 0.475 s the axis is at
/// 3864.583, at 5000 steps/s and -100,000 steps/s², and is told another target. Gives when it is at rest.
fn another_target(target: i64) -> u64 {
    let limits = Limits::new(10_000, 100_000).unwrap().with_jerk(2_000_000).unwrap();
    let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
    mover.move_to(4000, 0).unwrap();
    while mover.due().is_some_and(|due| due <= 475_000) {
        mover.pulse().unwrap();
    }
    mover.move_to(target, 475_000).unwrap();
    let mut last = 0;
    while let Some(pulse) = mover.pulse() {
        last = pulse.tick;
    }
    assert_eq!(mover.commanded(), target);
    (last..=1 << 21).find(|now| mover.is_at_rest(*now)).unwrap()
}

/// The brake is let go in 0.05 s, which takes 166.667 steps to 2500 steps/s. From there 0.125 s and 781.25 steps to full speed, and
/// 0.15 s and 750 steps from it to rest.
#[test]
fn a_farther_target_ends_the_brake_at_once() {
    let cruise = (10_000.0 - 3_864.583_333 - 166.666_667 - 781.25 - 750.0) / 10_000.0;
    let want = (0.475 + 0.05 + 0.125 + cruise + 0.15) * 1e6;
    let got = another_target(10_000) as f64;
    assert!((got - want).abs() <= 2.0, "{got} for {want}");
}

/// Within 119 steps of the old target the brake cannot be let go: it is kept to a speed from which less jerk is left, such that
/// both parts take all of the way. At full brake it would end at 4000.
#[test]
fn a_little_farther_target_keeps_the_brake() {
    let time = |dv: f64| if dv >= 5000.0 { dv / 1e5 + 0.05 } else { 2.0 * (dv / 2e6).sqrt() };
    for more in [0.0, 1.0, 20.0, 60.0, 110.0] {
        // The brake as if it had begun at 7500 steps/s, 0.05 s and 333.333 steps before.
        let way = 4000.0 + more - 3_864.583_333 + 333.333_333;
        let need = |v: f64| f64::midpoint(7500.0, v) * time(7500.0 - v) + v / 2.0 * time(v);
        let (mut low, mut high) = (0.0, 2500.0);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if need(middle) <= way { low = middle } else { high = middle }
        }
        let want = (0.475 - 0.05 + time(7500.0 - low) + time(low)) * 1e6;
        let got = another_target(4000 + more as i64) as f64;
        assert!(got >= want - 2.0 && got <= want * 1.001, "{got} for {want}, {more} steps farther");
    }
}

/// 5 steps before the end of a brake it cannot be cut short: the axis goes to the end, and comes back.
#[test]
fn a_target_inside_the_last_of_the_brake_is_passed() {
    let limits = Limits::new(10_000, 100_000).unwrap().with_jerk(2_000_000).unwrap();
    let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
    mover.move_to(4000, 0).unwrap();
    while mover.due().is_some_and(|due| due <= 525_000) {
        mover.pulse().unwrap();
    }
    mover.move_to(3997, 525_000).unwrap();
    let mut most = 0;
    while mover.pulse().is_some() {
        most = most.max(mover.commanded());
    }
    assert_eq!((most, mover.commanded()), (4000, 3997));
}

/// 9500 steps/s of change take 0.095 + 0.05 s, also if the last 500 of them are asked for under way.
#[test]
fn a_lower_speed_while_it_brakes_keeps_the_brake() {
    let limits = Limits::new(10_000, 100_000).unwrap().with_jerk(2_000_000).unwrap();
    let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
    for (speed, from, until) in [(10_000, 0, 1_000_000), (1000, 1_000_000, 1_075_000), (500, 1_075_000, 1_145_100)] {
        mover.run(Direction::Forward, speed, from).unwrap();
        while mover.due().is_some_and(|due| due <= until) {
            mover.pulse().unwrap();
        }
    }
    let state = mover.at(1_145_100);
    assert!((state.speed >> 16).abs_diff(500) <= 1 && state.acceleration == 0, "{state:?}");
}
