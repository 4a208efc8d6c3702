//! An axis that can be told something else at any time.

use crate::cutter::{Demand, Stretch};
use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::phases::{Frame, P, Phases, steps};
use crate::plan::{Setpoint, checked};
use crate::planner::{Goal, Motion, plan_into};
use crate::real::Real;
use crate::stepper::{Stepper, tick};
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
    /// Its steps are cut into stretches, not taken one by one.
    cuts: bool,
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
    /// Tick at which DIR changes for the next step, and from which on it may.
    turn: Option<u64>,
    idle: u64,
    /// DIR of the last step; `None` if DIR may have changed since.
    dir: Option<Direction>,
    /// What is under way is a stop.
    braking: bool,
    /// What a quick stop that is under way may use, until the axis is at rest.
    quick: Option<Bounds>,
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
            cuts: false,
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
            turn: None,
            idle: 0,
            dir: Some(Direction::Forward),
            braking: false,
            quick: None,
            halted: false,
        })
    }

    /// With a rest before each change of direction, in ticks: what the driver and the mechanics need between a step and DIR, and
    /// between DIR and the next step. It is kept after a [`halt`](Self::halt) too.
    pub const fn with_reversal_pause(self, ticks: u32) -> Self {
        Self { pause: ticks, ..self }
    }

    /// With a range that no target may leave, both ends included; [`run`](Self::run) ends at it.
    pub const fn with_soft_limits(self, low: i64, high: i64) -> Self {
        Self { soft: Some((low, high)), ..self }
    }

    /// The tick of the next step; `None` if no step is to come.
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
        (self.turn, self.dir) = (None, Some(self.direction));
        let Phases { curve, frame } = &self.phases;
        self.due = self.stepper.next(curve, frame).map(|due| due.max(self.free));
        if self.due.is_none() {
            self.go_on();
        } else if frame.endless && self.stepper.count() >= 1 << 30 {
            self.replan(self.clock.moment(tick));
        }
        Some(pulse)
    }

    /// Steps commanded so far, forward less reverse ones. Whether the motor followed is not known here.
    pub const fn commanded(&self) -> i64 {
        self.commanded
    }

    /// DIR of the next step, or of the last one at rest.
    pub const fn direction(&self) -> Direction {
        self.direction
    }

    /// The tick at which DIR is to be switched to [`direction`](Self::direction) for the next step: in the middle of the rest
    /// between the steps on either side, so that the driver has half of it before the edge and half of it after. `None` if DIR
    /// does not change before the next step.
    pub const fn turn(&self) -> Option<u64> {
        self.turn
    }

    /// Position, speed, acceleration and jerk at a tick that is not before the last step.
    pub fn at(&self, now: u64) -> Setpoint {
        let state = Setpoint::new(self.clock, self.phases.at(self.clock.moment(now)));
        state.on_axis(self.origin, self.direction)
    }

    /// Returns whether the axis stands still at a tick, with no step to come (or held back).
    pub fn is_at_rest(&self, now: u64) -> bool {
        self.due.is_none() && self.clock.moment(now) >= self.phases.end()
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motor may have run on.
    pub const fn is_halted(&self) -> bool {
        self.halted
    }

    /// Moves to a position, from rest or from any motion.
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
        self.change(now);
    }

    /// Feed hold: slows down to rest and keeps the target.
    pub fn hold(&mut self, now: u64) {
        self.held = true;
        self.change(now);
    }

    /// Resumes after a [`hold`](Self::hold), even while it is still slowing down.
    pub fn resume(&mut self, now: u64) {
        self.held = false;
        self.change(now);
    }

    /// Slows down to rest and forgets the target.
    pub fn stop(&mut self, now: u64) {
        self.aim = Aim::Rest;
        self.change(now);
    }

    /// Slows down to rest within other limits, higher ones for a limit switch, and forgets the target. Until it is at rest, moves
    /// are refused. Where its own limits, or those of a quick stop under way, are higher, those are used: a quick stop is never
    /// longer than a normal one.
    pub fn quick_stop(&mut self, limits: Limits, now: u64) {
        self.aim = Aim::Rest;
        let moment = self.moment(now);
        if self.is_moving(moment) {
            let bounds = limits.bounds(self.clock).or_higher(self.quick.as_ref().unwrap_or(&self.bounds));
            self.quick = Some(bounds);
            self.replan_within(moment, &bounds);
        } else {
            self.change(now);
        }
    }

    /// No further step. The position is that of the steps made; a motor at speed runs on and loses it.
    pub fn halt(&mut self, now: u64) {
        let moment = self.clock.moment(now.max(self.free));
        self.halted = !self.is_at_rest(now);
        (self.aim, self.held, self.quick, self.due, self.turn) = (Aim::Rest, false, None, None, None);
        self.rest(moment);
    }

    /// Declares, at rest, the count of steps at which the axis stands, for instance 0 at a reference.
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

    /// Sets other limits, at rest.
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

    /// For [`cut`](Self::cut) in place of [`pulse`](Self::pulse).
    pub(super) const fn cutting(self) -> Self {
        Self { cuts: true, ..self }
    }

    /// The next steps as a stretch, if they begin before a tick; in place of [`pulse`](Self::pulse).
    pub(super) fn cut(&mut self, demand: &Demand, until: u64) -> Cut {
        if self.due.is_none() {
            return Cut::Rest;
        }
        let (Phases { curve, frame }, mut cutter) = (&self.phases, self.stepper.cutter);
        let Some(stretch) = cutter.next(curve, frame, demand) else {
            self.due = None;
            self.go_on();
            return Cut::Rest;
        };
        let first = tick(stretch.first);
        if first >= until {
            self.due = Some(first.max(self.free));
            return Cut::Later;
        }
        let (endless, all) = (frame.endless, steps(frame.last(curve)));
        let (direction, count) = (self.direction, i64::from(stretch.count));
        self.commanded = self.commanded.saturating_add(if direction.dir() { count.wrapping_neg() } else { count });
        self.stepper.cutter = cutter;
        let last = tick(stretch.last()).max(self.free);
        self.free = last.saturating_add(1);
        (self.turn, self.dir) = (None, Some(direction));
        self.due = Some(self.free);
        if !endless && cutter.count() >= all {
            self.due = None;
            self.go_on();
        } else if endless && cutter.count() >= 1 << 30 {
            self.replan(self.clock.moment(last));
        }
        Cut::Steps(stretch, direction)
    }

    /// The tick at which the plan under way ends; the greatest for one without end.
    pub(super) fn over(&self) -> u64 {
        if self.phases.frame.endless { u64::MAX } else { self.phases.end().div_ceil(self.clock.moment(1)) }
    }

    /// At rest at a position since a tick, after a stop that nobody asked for: it goes on from there.
    pub(super) fn rest_at(&mut self, position: i64, now: u64) {
        (self.commanded, self.due, self.quick) = (position, None, None);
        self.free = now.saturating_add(1);
        self.rest(self.clock.moment(now));
        if self.has_work() {
            self.replan(self.clock.moment(now));
        }
    }

    /// Halted at a position, DIR not known.
    pub(super) fn halt_at(&mut self, position: i64, now: u64, was_moving: bool) {
        self.halt(now);
        (self.commanded, self.halted, self.dir) = (position, was_moving, None);
        self.rest(self.phases.end());
    }

    fn ready(&mut self, now: u64) -> Result<(), Error> {
        if self.quick.is_some() && !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.quick = None;
        Ok(())
    }

    /// The moment of a request. An axis that moves is somewhere between its last step and the next one, whatever the caller's
    /// clock says: an earlier or later time would plan steps that are over, or make those that are missing in a burst.
    fn moment(&self, now: u64) -> u64 {
        let now = now.max(self.free.saturating_sub(1));
        self.clock.moment(self.due.map_or(now, |due| now.min(due)))
    }

    /// A request that changes what is under way, unless that is a quick stop.
    fn change(&mut self, now: u64) {
        let moment = self.moment(now);
        // A stop that is under way is the same one whoever asks for it.
        let same = self.braking && self.goal(self.direction, &self.bounds).is_none();
        if !self.is_moving(moment) || self.quick.is_none() && !same {
            self.replan(moment);
        }
    }

    fn is_moving(&self, moment: u64) -> bool {
        self.phases.frame.endless || moment < self.phases.end()
    }

    fn aim_at(&mut self, aim: Aim, now: u64) {
        (self.aim, self.halted) = (aim, false);
        self.replan(self.moment(now));
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
        if self.is_moving(moment) {
            self.onward(moment, bounds);
        } else {
            self.anew(moment, bounds);
        }
        if self.due.is_none() && self.has_work() {
            // No step on the way to rest: what follows begins there.
            self.anew(self.phases.end(), bounds);
        }
    }

    /// Begins with the plan that there is.
    fn adopt(&mut self) {
        self.origin = self.commanded;
        self.stepper = Stepper::new();
        let Phases { curve, frame } = &self.phases;
        let begin = frame.begin.div_ceil(self.clock.moment(1));
        let due = if self.cuts {
            // Not after the next step is enough.
            (frame.endless || steps(frame.last(curve)) > 0).then_some(begin)
        } else {
            self.stepper.next(curve, frame)
        };
        self.due = due.map(|due| due.max(self.free).max(begin));
        self.turn = None;
        if self.dir != Some(self.direction) {
            self.turn = self.due.map(|due| self.idle.max(self.free.saturating_sub(1)).midpoint(due));
            self.dir = None;
        }
    }

    /// Plans on from the motion that there is. Positions count from the steps made.
    fn onward(&mut self, moment: u64, bounds: &Bounds) {
        let (state, last) = (self.phases.at(moment), self.phases.last());
        let made = i64::try_from(self.commanded.abs_diff(self.origin)).unwrap_or(0) << 32;
        let p = state.p.wrapping_sub(made);
        let start = Motion { v: state.v, a: state.a.0, up: state.a.1 };
        let bounds = &bounds.holding(state.v, state.a);
        let frame = Frame { to: None, ..Frame::rest(self.clock.shift(), moment, p) };
        let again = self.braking;
        self.braking = !self.plan(self.direction, start, frame, bounds);
        if self.braking {
            self.phases = Phases { frame, ..Phases::rest(0, 0, 0) };
            let Phases { curve, frame } = &mut self.phases;
            // A stop has always room.
            let _: Result<_, _> = plan_into(curve, start, Goal::Speed(Real::ZERO), bounds);
            if again {
                // Rounding makes no step more of a stop within higher limits.
                frame.to = Some(frame.last(curve).min(last.saturating_sub(made)));
            }
        }
        self.adopt();
    }

    /// Plans from rest.
    fn anew(&mut self, moment: u64, bounds: &Bounds) {
        let end = self.phases.end();
        self.rest(end);
        (self.due, self.turn) = (None, None);
        let mut begin = moment.max(end);
        if let Some(last) = self.free.checked_sub(1) {
            // The axis has come to rest up to half a step behind that step, and begins at it.
            let half = (Real::ONE.half() / bounds.v).to_fixed(0);
            begin = begin.max(self.clock.moment(last).saturating_add(half));
        }
        self.braking = false;
        if !self.has_work() {
            return;
        }
        self.idle = begin.div_ceil(self.clock.moment(1));
        let direction = match self.aim {
            Aim::At(target) if target < self.commanded => Direction::Reverse,
            Aim::Run(direction, _) => direction,
            _ => Direction::Forward,
        };
        if self.dir != Some(direction) {
            begin = begin.saturating_add(self.clock.moment(self.pause.into()));
        }
        self.direction = direction;
        let frame = Frame { to: None, ..Frame::rest(self.clock.shift(), self.clock.aligned(begin), 0) };
        if self.plan(direction, Motion::steady(Real::ZERO), frame, bounds) {
            self.adopt();
        } else {
            self.rest(end);
        }
    }

    /// Puts a plan to the aim in the place of the one that there is; false if that is a stop, or cannot be reached any more.
    fn plan(&mut self, direction: Direction, start: Motion, frame: Frame, bounds: &Bounds) -> bool {
        let Some((want, bounds)) = self.goal(direction, bounds) else { return false };
        self.phases = Phases { frame, ..Phases::rest(0, 0, 0) };
        let Phases { curve, frame } = &mut self.phases;
        let goal = match want {
            Want::At(target) => {
                let Some(left) = ahead(self.commanded, target, direction) else { return false };
                let to = i64::from(left) << 32;
                frame.to = Some(to);
                let Ok(way) = u64::try_from(to.saturating_sub(frame.from)) else { return false };
                Goal::At(Real::fixed(way, P), Real::ZERO)
            }
            Want::Speed(v) => {
                frame.endless = true;
                Goal::Speed(v)
            }
        };
        plan_into(curve, start, goal, &bounds).is_ok()
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

/// What [`Mover::cut`] gives.
pub(super) enum Cut {
    /// Steps, and which way.
    Steps(Stretch, Direction),
    /// The next step is later.
    Later,
    /// There is no step to come.
    Rest,
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
