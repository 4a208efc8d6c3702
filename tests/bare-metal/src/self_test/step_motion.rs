//! Moves whose durations are known by hand, and how many steps they have.

use step_motion::{Clock, Limits, Plan};

use super::{Tally, Topic, each};

/// A move on a timer of 1 MHz: steps, speed, acceleration, jerk (0: none), and its duration in us.
struct Known {
    name: &'static str,
    steps: u32,
    speed: u32,
    acceleration: u32,
    jerk: u64,
    us: u64,
}

/// Without jerk limit and below its speed a move of `n` steps takes 2 √(n / a); at that speed n / v + v / a.
const KNOWN: &[Known] = &[
    Known { name: "triangle", steps: 500, speed: 20_000, acceleration: 100_000, jerk: 0, us: 141_421 },
    Known { name: "trapezoid", steps: 8_000, speed: 20_000, acceleration: 100_000, jerk: 0, us: 600_000 },
    // n / v + v / a + a / j
    Known { name: "s-curve", steps: 51_200, speed: 250_000, acceleration: 2_000_000, jerk: 40_000_000, us: 379_800 },
];

pub(crate) const TOPICS: &[Topic] = &[("step-motion/durations", durations)];

fn durations() -> Tally {
    each(
        KNOWN,
        |row| row.name,
        |row| {
            let limits = Limits::new(row.speed, row.acceleration).ok();
            let limits = if row.jerk == 0 { limits } else { limits.and_then(|limits| limits.with_jerk(row.jerk).ok()) };
            let plan = limits.and_then(|limits| Plan::new(Clock::MICROSECONDS, limits, row.steps).ok());
            plan.is_some_and(|plan| plan.duration().abs_diff(row.us) <= 1 && plan.pulses().count() as u32 == row.steps)
        },
    )
}
