//! Whole moves, in steps a second, beside two other crates for step timing.
//!
//! `cargo bench -p step-motion`
//!
//! The crates do not compute the same: `ramp-maker` and `stepgen` give a delay a step of a trapezoid, this crate
//! gives cycle and sync_time of a sin² ramp, and absolute ticks of trapezoids and S-curves. All make moves of the same length, with ramps of the same length, to
//! the same speed of 100 kHz, through their iterators: all steps in one go (`for_each`), and the trapezoid also step by step (`next`).
#![allow(missing_docs, clippy::arithmetic_side_effects, clippy::cast_precision_loss)]
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
#![allow(clippy::std_instead_of_core, clippy::unwrap_used)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use ramp_maker::{MotionProfile, Trapezoidal};
use step_motion::{Clock, Limits, Plan};
use step_profile::{Arithmetic, Axis, Command, Direction, Parameters, Profile, Speed};
use stepgen::Stepgen;

/// Steps of the move and steps of each ramp.
struct Case {
    name: &'static str,
    steps: u32,
    ramp: u32,
}

const CASES: [Case; 3] = [
    Case { name: "full turn, 51200 steps, ramps of 3200", steps: 51_200, ramp: 3200 },
    Case { name: "ramps alone, 6400 steps, ramps of 3200", steps: 6400, ramp: 3200 },
    Case { name: "shortest ramps alone, 64 steps, ramps of 32", steps: 64, ramp: 32 },
];

type Move = fn(&Case) -> u64;

const MOVES: [(&str, Move); 8] = [
    ("step-profile, steps", corrected),
    ("step-motion, trapezoid", trapezoid),
    ("step-motion, trapezoid, step by step", stepwise),
    ("step-motion, S-curve", s_curve),
    ("step-profile, one axis by the cycle", axis),
    ("ramp-maker, f32", ramp_maker_f32),
    ("ramp-maker, 32.32 fixed point", ramp_maker_fixed),
    ("stepgen", stepgen),
];

fn main() {
    for case in &CASES {
        println!("{}", case.name);
        // In turn, so that whatever else the machine does meets all of them.
        let mut rates = [0.0; MOVES.len()];
        for _ in 0..15 {
            for (best, (_, whole_move)) in rates.iter_mut().zip(MOVES) {
                *best = f64::max(*best, rate(|| whole_move(case)));
            }
        }
        let [ours, ..] = rates;
        for (rate, (name, _)) in rates.iter().zip(MOVES) {
            let (millions, ns, ratio) = (rate / 1e6, 1e9 / rate, ours / rate);
            println!("  {name:<38}{millions:>8.1} million steps/s{ns:>8.2} ns a step{ratio:>8.2} times as long");
        }
    }
}

/// Steps a second over 50 ms.
fn rate(whole_move: impl Fn() -> u64) -> f64 {
    let begin = Instant::now();
    let mut steps = 0;
    while begin.elapsed() < Duration::from_millis(50) {
        steps += whole_move();
    }
    steps as f64 / begin.elapsed().as_secs_f64()
}

fn profile(case: &Case) -> Profile<'static> {
    let parameters = Parameters::at(Speed::KHZ_100).with_steps_per_entry(case.ramp / 32);
    Profile::new(parameters.with_arithmetic(black_box(Arithmetic::Corrected))).unwrap()
}

fn corrected(case: &Case) -> u64 {
    let mut steps = 0;
    profile(case).steps(black_box(case.steps)).for_each(|step| {
        black_box((step.cycle, step.sync_time));
        steps += 1;
    });
    steps
}

fn limits(case: &Case) -> Limits {
    Limits::new(100_000, (acceleration(case) * 1e6) as u32).unwrap()
}

fn plan(limits: Limits, case: &Case) -> Plan {
    Plan::new(Clock::new(10_000_000).unwrap(), black_box(limits), black_box(case.steps)).unwrap()
}

fn ticks(plan: &Plan) -> u64 {
    let mut steps = 0;
    plan.pulses().for_each(|tick| {
        black_box(tick);
        steps += 1;
    });
    steps
}

fn trapezoid(case: &Case) -> u64 {
    ticks(&plan(limits(case), case))
}

fn stepwise(case: &Case) -> u64 {
    let plan = plan(limits(case), case);
    let mut steps = 0;
    for tick in plan.pulses() {
        black_box(tick);
        steps += 1;
    }
    steps
}

/// A jerk that reaches the acceleration in a tenth of the ramp's time.
fn s_curve(case: &Case) -> u64 {
    let acceleration = acceleration(case) * 1e6;
    let jerk = acceleration * acceleration / 100_000.0 * 10.0;
    ticks(&plan(limits(case).with_jerk((jerk as u64).min(Limits::MAX_JERK)).unwrap(), case))
}

/// Ten cycles a step at full speed, more on the ramps.
fn axis(case: &Case) -> u64 {
    let mut axis = Axis::new();
    axis.start(profile(case), black_box(case.steps), Direction::Forward).unwrap();
    let mut left = case.steps;
    while left > 0 {
        if let Command::Pulse { sync_time, .. } = axis.tick() {
            black_box(sync_time);
            left -= 1;
        }
    }
    case.steps.into()
}

/// v² = 2 a s, in steps and milliseconds.
fn acceleration(case: &Case) -> f64 {
    100.0 * 100.0 / (2.0 * f64::from(case.ramp))
}

fn ramp_maker_f32(case: &Case) -> u64 {
    let mut profile = Trapezoidal::<f32>::new(black_box(acceleration(case) as f32));
    profile.enter_position_mode(100.0, black_box(case.steps));
    let mut steps = 0;
    while let Some(delay) = profile.next_delay() {
        black_box(delay);
        steps += 1;
    }
    steps
}

fn ramp_maker_fixed(case: &Case) -> u64 {
    type Number = ramp_maker::trapezoidal::DefaultNum;
    let mut profile = Trapezoidal::<Number>::new(Number::from_num(black_box(acceleration(case))));
    profile.enter_position_mode(Number::from_num(100), black_box(case.steps));
    let mut steps = 0;
    while let Some(delay) = profile.next_delay() {
        black_box(delay);
        steps += 1;
    }
    steps
}

fn stepgen(case: &Case) -> u64 {
    // 10 MHz ticks: its delays have 16 bits, and none may be below 30.
    let mut profile = Stepgen::new(10_000_000);
    profile.set_acceleration(black_box((acceleration(case) * 1e6) as u32) << 8).unwrap();
    profile.set_target_speed(black_box(100_000) << 8).unwrap();
    profile.set_target_step(black_box(case.steps)).unwrap();
    let mut steps = 0;
    profile.for_each(|delay| {
        black_box(delay);
        steps += 1;
    });
    steps
}
