//! A move planned as a whole.

use core::fmt;
use core::iter::FusedIterator;

use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::phases::{self, Phases, fine, steps};
use crate::planner::{Goal, Motion, plan_into};
use crate::real::Real;
use crate::stepper::Stepper;
use servowire_core::Direction;

/// A move of a number of steps: the fastest within its limits.
///
/// ```
/// use step_motion::{Clock, Limits, Plan};
/// let limits = Limits::new(250_000, 2_000_000)?.with_jerk(40_000_000)?;
/// let plan = Plan::new(Clock::MICROSECONDS, limits, 51_200)?;
/// assert_eq!(plan.duration(), 379_800); // µs
/// assert_eq!(plan.pulses().count(), 51_200);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Plan {
    clock: Clock,
    phases: Phases,
}

impl Plan {
    /// Plans a move from rest to rest.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] if two steps could fall into one tick, [`Error::TooManySteps`] above 2^31 - 1.
    pub fn new(clock: Clock, limits: Limits, steps: u32) -> Result<Self, Error> {
        Self::between(clock, limits, steps, 0, 0)
    }

    /// Plans a move from an entry speed to an exit speed, in steps/s; each at most the greatest speed. Acceleration is 0 at
    /// both ends.
    ///
    /// An entry speed other than 0 at a standstill (a *start speed*) shortens the first step; the motor has to be able to
    /// follow it without a ramp.
    ///
    /// # Errors
    /// Those of [`new`](Self::new), and [`Error::TooShort`] if the change of speed needs more steps.
    pub fn between(clock: Clock, limits: Limits, steps: u32, entry: u32, exit: u32) -> Result<Self, Error> {
        check(clock, limits)?;
        let to = position(steps)?;
        let moment = clock.seconds();
        let bounds = limits.bounds_in(moment);
        let speed = |hz: u32| (Real::new(hz.into()) * moment).min(bounds.v);
        let goal = Goal::At(Real::new(steps.into()), speed(exit));
        Self::planned(clock, (steps, to), Motion::steady(speed(entry)), goal, &bounds)
    }

    /// Makes the plan in place, because it is large.
    fn planned(
        clock: Clock,
        (steps, to): (u32, i64),
        start: Motion,
        goal: Goal,
        bounds: &Bounds,
    ) -> Result<Self, Error> {
        let mut own = Ok(Self { clock, phases: Phases::rest(clock.shift(), 0, 0) });
        if let Ok(Self { phases: Phases { curve, frame }, .. }) = &mut own {
            frame.to = Some(to);
            if let Err(need) = plan_into(curve, start, goal, bounds) {
                own = Err(too_short(steps, need));
            }
        }
        own
    }

    /// The clock of the ticks.
    pub const fn clock(&self) -> Clock {
        self.clock
    }

    /// Time from the start to the standstill (or the exit speed), in ticks.
    pub fn duration(&self) -> u64 {
        self.clock.tick(self.phases.end())
    }

    /// The steps.
    pub fn steps(&self) -> u32 {
        steps(self.phases.last())
    }

    /// The ticks of the steps, in order.
    pub fn pulses(&self) -> Pulses<'_> {
        Pulses { plan: self, stepper: Stepper::new() }
    }

    /// Returns position and speed of the move at a tick after its start.
    pub fn at(&self, tick: u64) -> Setpoint {
        Setpoint::new(self.clock, self.phases.at(self.clock.moment(tick)))
    }

    /// Starts of the phases of constant jerk, and the end, in ticks.
    pub fn corners(&self) -> impl Iterator<Item = u64> {
        let Phases { curve, frame } = &self.phases;
        let moment = |time| frame.begin.saturating_add(frame.since(curve, time).to_fixed(0));
        let ticks = curve.pieces().iter().map(move |piece| self.clock.tick(moment(piece.time)));
        ticks.chain([self.duration()])
    }
}

/// The ticks of the steps of a [`Plan`], counted from its start. Step k falls where the position passes k - 1/2. All of them in one go
/// (`for_each`, `fold`) take less time than one after another.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulses<'p> {
    plan: &'p Plan,
    stepper: Stepper,
}

impl Iterator for Pulses<'_> {
    type Item = u64;

    #[inline]
    fn next(&mut self) -> Option<u64> {
        self.stepper.next(&self.plan.phases.curve, &self.plan.phases.frame)
    }

    #[inline]
    fn fold<B, F: FnMut(B, u64) -> B>(self, first: B, f: F) -> B {
        let Phases { curve, frame } = &self.plan.phases;
        self.stepper.fold((curve, frame), first, f)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.plan.steps().saturating_sub(self.stepper.count());
        let left = usize::try_from(left).ok();
        (left.unwrap_or(usize::MAX), left)
    }
}

impl FusedIterator for Pulses<'_> {}

/// Position, speed, acceleration and jerk at a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Setpoint {
    /// In 2^-32 steps. Beyond 2^31 steps from 0 it is counted modulo 2^32 steps, as a counter does: differences stay right.
    pub position: i64,
    /// In 2^-16 steps/s.
    pub speed: i64,
    /// In 2^-16 steps/s².
    pub acceleration: i64,
    /// In 2^-16 steps/s³.
    pub jerk: i64,
}

impl Setpoint {
    /// Creates a setpoint at rest at a position in 2^-32 steps.
    pub(super) const fn at_rest(position: i64) -> Self {
        Self { position, speed: 0, acceleration: 0, jerk: 0 }
    }

    /// Converts it to an axis that moves in a direction from a position in steps.
    pub(super) const fn on_axis(self, origin: i64, direction: Direction) -> Self {
        let origin = fine(origin);
        match direction {
            Direction::Forward => Self { position: origin.wrapping_add(self.position), ..self },
            Direction::Reverse => Self {
                position: origin.wrapping_sub(self.position),
                speed: self.speed.wrapping_neg(),
                acceleration: self.acceleration.wrapping_neg(),
                jerk: self.jerk.wrapping_neg(),
            },
        }
    }

    pub(super) fn new(clock: Clock, state: phases::State) -> Self {
        let second = Real::new(clock.moments().into());
        let unit = |(size, up): (Real, bool), per: Real| {
            let size = i64::try_from((size * per).to_fixed(16)).unwrap_or(i64::MAX);
            if up { size } else { size.wrapping_neg() }
        };
        Self {
            position: state.p,
            speed: unit((state.v, true), second),
            acceleration: unit(state.a, second.squared()),
            jerk: unit(state.j, second.squared() * second),
        }
    }
}

/// `12.250 steps, 800 steps/s, -4000 steps/s²`.
impl fmt::Display for Setpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let thousandths = i128::from(self.position).saturating_mul(1000) >> 32;
        let (sign, size) = (if thousandths < 0 { "-" } else { "" }, thousandths.unsigned_abs());
        let (whole, part) = (size / 1000, size % 1000);
        let (speed, acceleration) = (self.speed >> 16, self.acceleration >> 16);
        write!(f, "{sign}{whole}.{part:03} steps, {speed} steps/s, {acceleration} steps/s²")
    }
}

/// Refuses speeds above half the clock, so that no tick has two steps.
fn check(clock: Clock, limits: Limits) -> Result<(), Error> {
    let limit = clock.hz() / 2;
    let speed = limits.speed();
    if speed > limit { Err(Error::SpeedAboveClock { speed, limit }) } else { Ok(()) }
}

/// Returns the limits in units of the clock, if the clock allows them.
pub(super) fn checked(clock: Clock, limits: Limits) -> Result<Bounds, Error> {
    check(clock, limits)?;
    Ok(limits.bounds(clock))
}

/// Converts a number of steps to a position.
pub(super) fn position(steps: u32) -> Result<i64, Error> {
    let limit = u32::MAX / 2;
    if steps > limit { Err(Error::TooManySteps { steps, limit }) } else { Ok(i64::from(steps) << 32) }
}

/// Converts a position for [`Error::SoftLimit`].
pub(super) fn clamp(target: i64) -> i32 {
    i32::try_from(target).unwrap_or(if target < 0 { i32::MIN } else { i32::MAX })
}

pub(super) fn too_short(steps: u32, need: Real) -> Error {
    let whole = (need - Real::fixed(1, 16)).to_fixed(0).saturating_add(1);
    Error::TooShort { steps, needed: whole }
}
