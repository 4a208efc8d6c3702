//! An axis that can be told something else at any time.

use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::phases::{Frame, P, Phases};
use crate::plan::{Setpoint, checked};
use crate::planner::{Goal, Motion, plan};
use crate::real::Real;
use crate::stepper::Stepper;
use servowire_core::Direction;

/// A step: when, and which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pulse {
    /// Tick of the clock.
    pub tick: u64,
    /// DIR; it changes at a standstill only.
    pub direction: Direction,
}

/// What an axis is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Aim {
    /// Come to rest.
    Rest,
    /// Be at a position.
    At(i64),
    /// Keep a speed in steps/s.
    Run(Direction, u32),
}

/// An axis whose target, speed and override may change at any tick.
///
/// Each request is a new plan from the present state: position, speed and, with a jerk limit, acceleration go on without
/// a jump. A target that cannot be reached any more in this direction is reached by a stop and a move back; the position
/// is kept all the time.
///
/// [`due`](Self::due) is the tick of the next step: load it into a compare timer, take the step with
/// [`pulse`](Self::pulse) when it is there, and load the next. After a request load it again, for it may have moved.
///
/// ```
/// use step_motion::{Clock, Limits, Mover};
/// let mut x = Mover::new(Clock::MICROSECONDS, Limits::new(20_000, 100_000)?)?;
/// x.move_to(3000, 0)?;
/// while let Some(pulse) = x.pulse() {
///     if x.commanded() == 1000 {
///         x.move_to(-50, pulse.tick)?; // it stops, and comes back
///     }
/// }
/// assert_eq!(x.commanded(), -50);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mover {
    clock: Clock,
    limits: Limits,
    bounds: Bounds,
    phases: Phases,
    stepper: Stepper,
    direction: Direction,
    /// Position of the motor where the position of the plan is 0.
    origin: i64,
    commanded: i64,
    /// Tick of the next step.
    due: Option<u64>,
    /// Tick from which on it may come.
    free: u64,
    aim: Aim,
    held: bool,
    percent: u16,
    soft: Option<(i64, i64)>,
    /// Ticks of rest before the direction changes.
    pause: u32,
    /// A stop with limits of its own is under way.
    quick: bool,
    halted: bool,
}

impl Mover {
    /// At rest at position 0.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock.
    pub fn new(clock: Clock, limits: Limits) -> Result<Self, Error> {
        Ok(Self {
            clock,
            limits,
            bounds: checked(clock, limits)?,
            phases: Phases::rest(clock.shift(), 0, 0),
            stepper: Stepper::new(),
            direction: Direction::Forward,
            origin: 0,
            commanded: 0,
            due: None,
            free: 0,
            aim: Aim::Rest,
            held: false,
            percent: 100,
            soft: None,
            pause: 0,
            quick: false,
            halted: false,
        })
    }

    /// With a rest before each change of direction, in ticks: what the driver and the mechanics need between DIR and
    /// STEP.
    pub const fn with_reversal_pause(self, ticks: u32) -> Self {
        Self { pause: ticks, ..self }
    }

    /// With a range that no target may leave, both ends included; [`run`](Self::run) ends at it.
    pub const fn with_soft_limits(self, low: i64, high: i64) -> Self {
        Self { soft: Some((low, high)), ..self }
    }

    /// The tick of the next step; `None` if there is none to come.
    pub const fn due(&self) -> Option<u64> {
        self.due
    }

    /// Takes the next step.
    #[inline]
    pub fn pulse(&mut self) -> Option<Pulse> {
        let tick = self.due?;
        let pulse = Pulse { tick, direction: self.direction };
        self.commanded = self.direction.advance(self.commanded);
        self.free = tick.saturating_add(1);
        let Phases { curve, frame } = &self.phases;
        self.due = self.stepper.next(curve, frame).map(|due| due.max(self.free));
        if self.due.is_none() {
            self.go_on();
        } else if frame.endless && self.stepper.count() >= 1 << 30 {
            self.replan(self.clock.moment(tick));
        }
        Some(pulse)
    }

    /// Steps commanded so far, forward less reverse ones. What the motor has made of them is not known here.
    pub const fn commanded(&self) -> i64 {
        self.commanded
    }

    /// DIR of the next step, or of the last one at rest.
    pub const fn direction(&self) -> Direction {
        self.direction
    }

    /// Position, speed, acceleration and jerk at a tick that is not before the last step.
    pub fn at(&self, now: u64) -> Setpoint {
        let state = Setpoint::new(self.clock, self.phases.at(self.clock.moment(now)));
        state.on_axis(self.origin, self.direction)
    }

    /// Whether the axis stands still at a tick, with nothing to come (or held).
    pub fn is_at_rest(&self, now: u64) -> bool {
        self.due.is_none() && self.clock.moment(now) >= self.phases.end()
    }

    /// Whether the last stop was [`halt`](Self::halt): the steps are counted, but the motor may have run on.
    pub const fn is_halted(&self) -> bool {
        self.halted
    }

    /// Moves to a position, from rest or from whatever is under way.
    ///
    /// # Errors
    /// [`Error::SoftLimit`] outside the soft limits, [`Error::Moving`] during a [`quick_stop`](Self::quick_stop),
    /// [`Error::TooManySteps`] more than 2^31 - 1 steps away.
    pub fn move_to(&mut self, target: i64, now: u64) -> Result<(), Error> {
        self.ready(now)?;
        if let Some((low, high)) = self.soft {
            if target < low || target > high {
                return Err(Error::SoftLimit { target: clamp(target) });
            }
        }
        let away = target.abs_diff(self.commanded);
        if away > u64::from(u32::MAX / 2) {
            return Err(Error::TooManySteps { steps: u32::try_from(away).unwrap_or(u32::MAX), limit: u32::MAX / 2 });
        }
        self.aim_at(Aim::At(target), now);
        Ok(())
    }

    /// Runs at a speed in steps/s until told otherwise, or to the soft limit; at most the greatest speed. 0 stops.
    ///
    /// # Errors
    /// [`Error::Moving`] during a [`quick_stop`](Self::quick_stop).
    pub fn run(&mut self, direction: Direction, speed: u32, now: u64) -> Result<(), Error> {
        self.ready(now)?;
        self.aim_at(if speed == 0 { Aim::Rest } else { Aim::Run(direction, speed) }, now);
        Ok(())
    }

    /// Feed override, in percent of the greatest speed (or of that of [`run`](Self::run)); more than 100 is 100. 0 holds.
    pub fn set_override(&mut self, percent: u16, now: u64) {
        self.percent = percent.min(100);
        if !self.quick {
            self.replan(self.clock.moment(now));
        }
    }

    /// Feed hold: slows down to rest and keeps the aim.
    pub fn hold(&mut self, now: u64) {
        self.held = true;
        if !self.quick {
            self.replan(self.clock.moment(now));
        }
    }

    /// Goes on after a [`hold`](Self::hold), also while it still slows down.
    pub fn resume(&mut self, now: u64) {
        self.held = false;
        if !self.quick {
            self.replan(self.clock.moment(now));
        }
    }

    /// Slows down to rest and forgets the aim.
    pub fn stop(&mut self, now: u64) {
        self.aim = Aim::Rest;
        if !self.quick {
            self.replan(self.clock.moment(now));
        }
    }

    /// Slows down to rest within other limits, higher ones for a limit switch, and forgets the aim. Until it is at rest, moves
    /// are refused. An acceleration that it has already is kept where the limits are below that, and so is the jerk that it takes
    /// to end it at rest.
    pub fn quick_stop(&mut self, limits: Limits, now: u64) {
        self.aim = Aim::Rest;
        let bounds = limits.bounds(self.clock);
        self.replan_within(self.clock.moment(now), &bounds);
        self.quick = true;
    }

    /// No further step. The position is that of the steps made; a motor at speed runs on and loses it.
    pub fn halt(&mut self, now: u64) {
        let moment = self.clock.moment(now.max(self.free));
        self.halted = !self.is_at_rest(now);
        (self.aim, self.held, self.quick, self.due) = (Aim::Rest, false, false, None);
        self.rest(moment);
    }

    /// Declares at rest that so many steps lead to where the axis is, 0 at a reference for instance.
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest.
    pub fn set_commanded(&mut self, steps: i64, now: u64) -> Result<(), Error> {
        if !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.commanded = steps;
        self.aim = Aim::Rest;
        self.rest(self.phases.end());
        Ok(())
    }

    /// Other limits, at rest.
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest, [`Error::SpeedAboveClock`] above half the clock.
    pub fn set_limits(&mut self, limits: Limits, now: u64) -> Result<(), Error> {
        if !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.bounds = checked(self.clock, limits)?;
        self.limits = limits;
        Ok(())
    }

    /// The limits.
    pub const fn limits(&self) -> Limits {
        self.limits
    }

    fn ready(&mut self, now: u64) -> Result<(), Error> {
        if self.quick && !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.quick = false;
        Ok(())
    }

    fn aim_at(&mut self, aim: Aim, now: u64) {
        (self.aim, self.halted) = (aim, false);
        self.replan(self.clock.moment(now));
    }

    /// At rest, the position of the plan is 0 where the motor is.
    fn rest(&mut self, moment: u64) {
        self.origin = self.commanded;
        self.phases = Phases::rest(self.clock.shift(), moment, 0);
        self.stepper = Stepper::new();
    }

    /// A plan is over: on to the aim if that is somewhere else.
    fn go_on(&mut self) {
        let end = self.phases.end();
        self.quick = false;
        if self.has_work() {
            self.replan(end);
        }
    }

    fn has_work(&self) -> bool {
        !self.held
            && self.percent > 0
            && match self.aim {
                Aim::Rest => false,
                Aim::At(target) => target != self.commanded,
                Aim::Run(direction, _) => self.soft.is_none_or(|soft| edge(soft, direction) != self.commanded),
            }
    }

    fn replan(&mut self, moment: u64) {
        let bounds = self.bounds;
        self.replan_within(moment, &bounds);
    }

    /// From the state at a moment to the aim.
    fn replan_within(&mut self, moment: u64, bounds: &Bounds) {
        let moment = moment.max(self.phases.frame.begin);
        let moving = self.phases.frame.endless || moment < self.phases.end();
        let next = if moving { self.onward(moment, bounds) } else { self.anew(moment, bounds) };
        self.adopt(next);
        if self.due.is_none() && self.has_work() {
            // No step on the way to rest: what follows begins there.
            let next = self.anew(self.phases.end(), bounds);
            self.adopt(next);
        }
    }

    fn adopt(&mut self, next: Option<Phases>) {
        self.due = None;
        if let Some(phases) = next {
            self.origin = self.commanded;
            self.stepper = Stepper::new();
            let begin = phases.frame.begin.div_ceil(self.clock.moment(1));
            self.due = self.stepper.next(&phases.curve, &phases.frame).map(|due| due.max(self.free).max(begin));
            self.phases = phases;
        }
    }

    /// The plan of an axis in motion. Its positions count from the steps made.
    fn onward(&self, moment: u64, bounds: &Bounds) -> Option<Phases> {
        let state = self.phases.at(moment);
        let made = self.commanded.abs_diff(self.origin);
        let p = state.p.wrapping_sub(i64::try_from(made).unwrap_or(0) << 32);
        let start = Motion { v: state.v, a: state.a.0, up: state.a.1 };
        let bounds = &bounds.holding(state.v, state.a);
        let mut frame = Frame { to: None, ..Frame::rest(self.clock.shift(), moment, p) };
        let curve = self.goal(self.direction, bounds).and_then(|(goal, bounds)| match goal {
            Want::At(target) => {
                let left = ahead(self.commanded, target, self.direction)?;
                let to = i64::from(left) << 32;
                frame.to = Some(to);
                let distance = Real::fixed(u64::try_from(to.checked_sub(p)?).ok()?, P);
                plan(start, Goal::At(distance, Real::ZERO), &bounds).ok()
            }
            Want::Speed(v) => {
                frame.endless = true;
                plan(start, Goal::Speed(v), &bounds).ok()
            }
        });
        if let Some(curve) = curve {
            return Some(Phases { curve, frame });
        }
        (frame.to, frame.endless) = (None, false);
        let curve = plan(start, Goal::Speed(Real::ZERO), bounds).ok()?;
        Some(Phases { curve, frame })
    }

    /// The plan of an axis at rest.
    fn anew(&mut self, moment: u64, bounds: &Bounds) -> Option<Phases> {
        let end = self.phases.end();
        self.rest(end);
        let mut begin = moment.max(end);
        if !self.has_work() {
            return None;
        }
        let direction = match self.aim {
            Aim::At(target) if target < self.commanded => Direction::Reverse,
            Aim::Run(direction, _) => direction,
            _ => Direction::Forward,
        };
        if direction != self.direction {
            begin = begin.saturating_add(self.clock.moment(self.pause.into()));
            self.direction = direction;
        }
        let mut frame = Frame { to: None, ..Frame::rest(self.clock.shift(), self.clock.aligned(begin), 0) };
        let start = Motion::steady(Real::ZERO);
        let curve = self.goal(direction, bounds).and_then(|(goal, bounds)| match goal {
            Want::At(target) => {
                let left = ahead(self.commanded, target, direction)?;
                frame.to = Some(i64::from(left) << 32);
                plan(start, Goal::At(Real::new(left.into()), Real::ZERO), &bounds).ok()
            }
            Want::Speed(v) => {
                frame.endless = true;
                plan(start, Goal::Speed(v), &bounds).ok()
            }
        });
        curve.map(|curve| Phases { curve, frame })
    }

    /// What to do in this direction; `None` if that is a stop.
    fn goal(&self, direction: Direction, bounds: &Bounds) -> Option<(Want, Bounds)> {
        if self.held || self.percent == 0 {
            return None;
        }
        let part = Real::new(self.percent.into()) / Real::new(100);
        match self.aim {
            Aim::Rest => None,
            Aim::At(target) => Some((Want::At(target), bounds.slower(bounds.v * part))),
            Aim::Run(way, _) if way != direction => None,
            Aim::Run(_, speed) => {
                let v = Real::new(speed.into()) / Real::new(self.clock.moments().into());
                let v = v.min(bounds.v) * part;
                match self.soft {
                    Some(soft) => Some((Want::At(edge(soft, direction)), bounds.slower(v))),
                    None => Some((Want::Speed(v), *bounds)),
                }
            }
        }
    }
}

/// Where a plan leads.
enum Want {
    At(i64),
    Speed(Real),
}

/// Steps from here to there in a direction; `None` if there is behind.
fn ahead(position: i64, target: i64, direction: Direction) -> Option<u32> {
    let steps = match direction {
        Direction::Forward => target.checked_sub(position)?,
        Direction::Reverse => position.checked_sub(target)?,
    };
    u32::try_from(steps).ok().filter(|steps| *steps <= u32::MAX / 2)
}

/// The end of a range in a direction.
const fn edge((low, high): (i64, i64), direction: Direction) -> i64 {
    match direction {
        Direction::Forward => high,
        Direction::Reverse => low,
    }
}

fn clamp(target: i64) -> i32 {
    i32::try_from(target).unwrap_or(if target < 0 { i32::MIN } else { i32::MAX })
}
