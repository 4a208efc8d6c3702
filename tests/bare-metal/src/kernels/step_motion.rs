//! step-motion: plans, their steps, an axis that is told something new, lines of two axes.

use step_motion::{AxisSetup, Clock, Direction, Limits, Mover, Path, Plan, Reloads, Setpoint};

use super::kernels;

/// A move within limits: steps, entry and exit speed, and speed, acceleration and jerk (0: none).
struct Limited {
    steps: u32,
    ends: [u32; 2],
    speed: u32,
    acceleration: u32,
    jerk: u64,
}

const TRAPEZOID: Limited = Limited { steps: 500, ends: [0; 2], speed: 20_000, acceleration: 100_000, jerk: 0 };
const S_CURVE: Limited = Limited { jerk: 5_000_000, ..TRAPEZOID };
const S_SHORT: Limited = Limited { steps: 20, ..S_CURVE };
const S_ENTRY: Limited = Limited { steps: 100, ends: [1000, 500], ..S_CURVE };
const S_ENTRY_FAST: Limited = Limited { steps: 120, ends: [1900, 500], ..S_CURVE };
const CRUISE: Limited = Limited { steps: 500, ends: [20_000; 2], ..TRAPEZOID };
const TRAPEZOID_64: Limited = Limited { steps: 64, ..TRAPEZOID };
const S_CURVE_64: Limited = Limited { steps: 64, ..S_CURVE };

fn limits(move_: &Limited) -> Option<Limits> {
    let limits = Limits::new(move_.speed, move_.acceleration).ok()?;
    if move_.jerk == 0 { Some(limits) } else { limits.with_jerk(move_.jerk).ok() }
}

fn planned(move_: &Limited) -> Option<Plan> {
    let [entry, exit] = move_.ends;
    Plan::between(Clock::MICROSECONDS, limits(move_)?, move_.steps, entry, exit).ok()
}

kernels! {
    /// A trapezoid is planned.
    fn step_motion_plan(move_: &Limited) -> Option<u64> {
        Some(planned(move_)?.duration())
    } over [TRAPEZOID];

    /// An S-curve is planned: seven phases, four phases.
    fn step_motion_plan_s(move_: &Limited) -> Option<u32> {
        Some(planned(move_)?.steps())
    } over [S_CURVE, S_SHORT];

    /// An S-curve with entry and exit speed, whose peak has no closed form: neither slope reaches the greatest acceleration, one
    /// of them does.
    fn step_motion_plan_s_entry(move_: &Limited) -> Option<Setpoint> {
        Some(planned(move_)?.at(0))
    } over [S_ENTRY, S_ENTRY_FAST];

    /// A trapezoid planned, and its 64 steps, each one exactly.
    fn step_motion_ramp_64(move_: &Limited) -> Option<u64> {
        Some(planned(move_)?.pulses().fold(0, |sum, tick| sum ^ tick))
    } over [TRAPEZOID_64];

    /// An S-curve planned, and its 64 steps, each one exactly.
    fn step_motion_s_ramp_64(move_: &Limited) -> Option<u64> {
        Some(planned(move_)?.pulses().fold(1, |sum, tick| sum ^ tick))
    } over [S_CURVE_64];

    /// 500 steps at constant speed, and their plan.
    fn step_motion_cruise_500(move_: &Limited) -> Option<u64> {
        Some(planned(move_)?.pulses().fold(2, |sum, tick| sum ^ tick))
    } over [CRUISE];

    /// An axis that is told another target after 200 of 1000 steps, and held, and sent on.
    fn step_motion_mover(move_: &Limited) -> Option<(i64, Setpoint)> {
        let mut mover = Mover::new(Clock::MICROSECONDS, limits(move_)?).ok()?.with_soft_limits(-5000, 5000);
        mover.move_to(1000, 0).ok()?;
        let mut now = 0;
        for _ in 0..200 {
            now = mover.pulse()?.tick;
        }
        mover.move_to(i64::from(move_.steps), now).ok()?;
        mover.set_override(50, now);
        mover.hold(now);
        mover.resume(now);
        mover.run(Direction::Reverse, 5, now).ok()?;
        mover.quick_stop(limits(move_)?, now);
        let state = mover.at(now);
        mover.halt(now);
        mover.set_commanded(0, now + 1).ok()?;
        Some((mover.commanded(), state))
    } over [TRAPEZOID, S_CURVE];

    /// Reloads of a 16-bit timer over a short move.
    fn step_motion_reloads(move_: &Limited) -> Option<u32> {
        let plan = Plan::new(Clock::MICROSECONDS, limits(move_)?, 16).ok()?;
        Some(Reloads::new(plan.pulses(), 65_535).fold(0, |sum, reload| sum ^ reload.ticks))
    } over [TRAPEZOID, S_CURVE];

    /// Three lines of two axes with their corners, planned and run: 60 steps.
    fn step_motion_lines(move_: &Limited) -> Option<u64> {
        let axis = AxisSetup::new(limits(move_)?, 80_000);
        let mut path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).ok()?;
        for corner in [[20, 10], [40, 6], [40, 16]] {
            path.push(corner, 100_000).ok()?;
        }
        let mut sum = 0;
        while let Some(line) = path.next_line() {
            sum ^= line.fold(0, |sum, pulse| sum ^ pulse.tick);
        }
        Some(sum)
    } over [TRAPEZOID, S_CURVE];
}
