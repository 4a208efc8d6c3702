//! An axis that accepts a new request at any time.

pub(super) mod cutting;
pub(super) mod planning;

use crate::cutter::Stretch;
use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::phases::Phases;
use crate::plan::{Setpoint, checked, clamp};
use crate::requests::Requests;
use crate::stepper::Stepper;
use servowire_core::Direction;

/// A step: its time and direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pulse {
    /// Tick of the clock.
    pub tick: u64,
    /// DIR; it changes only at a standstill.
    pub direction: Direction,
}

/// The aim of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Aim {
    /// None: to rest.
    Rest,
    /// Be at a position.
    At(i64),
    /// Keep a speed, in steps/s, and come to rest at this position if there is one.
    Run(Direction, u32, Option<i64>),
}

/// What has been asked of an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wish {
    aim: Aim,
    requests: Requests,
}

impl Wish {
    /// Returns whether another request has changed nothing.
    pub(super) fn is_as(self, other: Self) -> bool {
        self.aim == other.aim && self.requests.are_as(other.requests)
    }
}

/// An axis whose target, speed and override may change at any tick.
///
/// Each request is a new plan from the present state: position, speed and, with a jerk limit, acceleration continue without
/// a jump. A target that can no longer be reached in this direction is reached by a stop and a move back; the position is
/// kept throughout.
///
/// [`due`](Self::due) is the tick of the next step: load it into a compare timer, take the step with [`pulse`](Self::pulse)
/// when that time has come, and load the next. Load it again after a request, because it may have changed.
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
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mover {
    clock: Clock,
    limits: Limits,
    bounds: Bounds,
    phases: Phases,
    stepper: Stepper,
    /// Its steps are cut into stretches, not taken one by one.
    cuts: bool,
    /// The next stretch, if it is known.
    left: Option<Stretch>,
    /// Steps of the plan; the greatest number for a plan without end.
    all: u32,
    direction: Direction,
    /// Position of the motor where the position of the plan is 0.
    origin: i64,
    commanded: i64,
    /// Tick of the next step.
    due: Option<u64>,
    /// Earliest tick at which it may come.
    free: u64,
    aim: Aim,
    requests: Requests,
    /// The limits of a quick stop in progress.
    quick: Bounds,
    soft: Option<(i64, i64)>,
    /// Ticks of rest before the direction changes.
    pause: u32,
    /// Tick at which DIR changes for the next step.
    turn: Option<u64>,
    /// DIR of the last step; `None` if DIR may have changed since.
    dir: Option<Direction>,
    /// The present plan is a stop.
    braking: bool,
}

/// By hand, because the derived `clone_from` copies it twice.
impl Clone for Mover {
    fn clone(&self) -> Self {
        Self { ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        *self = Self { ..*source };
    }
}

impl Mover {
    /// Creates an axis at rest at position 0.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock.
    pub fn new(clock: Clock, limits: Limits) -> Result<Self, Error> {
        let bounds = checked(clock, limits)?;
        Ok(Self {
            clock,
            limits,
            bounds,
            phases: Phases::rest(clock.shift(), 0, 0),
            stepper: Stepper::new(),
            cuts: false,
            left: None,
            all: 0,
            direction: Direction::Forward,
            origin: 0,
            commanded: 0,
            due: None,
            free: 0,
            aim: Aim::Rest,
            requests: Requests::NONE,
            quick: bounds,
            soft: None,
            pause: 0,
            turn: None,
            dir: Some(Direction::Forward),
            braking: false,
        })
    }

    /// Sets a rest before each change of direction, in ticks: the time that the driver and the mechanics need between a
    /// step and DIR, and between DIR and the next step. It is kept after a [`halt`](Self::halt) too.
    pub const fn with_reversal_pause(self, ticks: u32) -> Self {
        Self { pause: ticks, ..self }
    }

    /// Sets a range that no target may leave, both ends included, except those of a [`Homing`](crate::Homing); [`run`](Self::run) stops at
    /// its end.
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
        self.due = self.due.filter(|due| self.clock.is_in_time(*due));
        if self.due.is_none() {
            self.follow(self.go_on());
        } else if frame.endless && self.stepper.count() >= 1 << 30 {
            self.replan(self.clock.moment(tick));
        }
        Some(pulse)
    }

    /// Steps commanded so far, forward minus reverse. This does not say whether the motor followed.
    pub const fn commanded(&self) -> i64 {
        self.commanded
    }

    /// DIR of the next step, or of the last one at rest.
    pub const fn direction(&self) -> Direction {
        self.direction
    }

    /// The tick at which DIR is to be switched to [`direction`](Self::direction): in the middle of the
    /// [pause](Self::with_reversal_pause), which ends where the motion begins, so that the driver has at least half of the pause before
    /// the edge and half after it. It is between the steps on either side without a pause too, and it is never before the request that
    /// has changed it: whatever is asked for then, the first step comes no earlier than the pause allows.
    /// `None` if DIR has not changed since the last step, and is not to change.
    pub const fn turn(&self) -> Option<u64> {
        self.turn
    }

    /// Returns position, speed, acceleration and jerk at a tick that is not before the last step.
    pub fn at(&self, now: u64) -> Setpoint {
        let state = Setpoint::new(self.clock, self.phases.at(self.clock.moment(now)));
        state.on_axis(self.origin, self.direction)
    }

    /// Returns whether the axis is at rest at a tick with no step pending (or on hold).
    pub fn is_at_rest(&self, now: u64) -> bool {
        self.due.is_none() && self.clock.moment(now) >= self.phases.end()
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motor may have run on.
    pub const fn is_halted(&self) -> bool {
        self.requests.is_halted()
    }

    /// Moves to a position, from rest or from any motion.
    ///
    /// # Errors
    /// [`Error::SoftLimit`] outside the soft limits, [`Error::Moving`] during a [`quick_stop`](Self::quick_stop),
    /// [`Error::TooManySteps`] more than 2^31 - 1 steps away.
    pub fn move_to(&mut self, target: i64, now: u64) -> Result<(), Error> {
        self.check(target)?;
        self.move_freely(target, now)
    }

    /// Runs at a speed in steps/s until another request or to the soft limit; the speed is at most the greatest one. 0
    /// stops. On the way to a soft limit it comes to rest for a moment every 2^31 - 1 steps.
    ///
    /// # Errors
    /// [`Error::Moving`] during a [`quick_stop`](Self::quick_stop).
    pub fn run(&mut self, direction: Direction, speed: u32, now: u64) -> Result<(), Error> {
        self.run_to(direction, speed, self.soft_end(direction), now)
    }

    /// Sets the feed override, in percent of the greatest speed (or of that of [`run`](Self::run)); values above 100 count
    /// as 100. 0 holds.
    pub fn set_override(&mut self, percent: u16, now: u64) {
        self.request(now, |mover| mover.ask_override(percent));
    }

    /// Slows down to rest and keeps the target (feed hold).
    pub fn hold(&mut self, now: u64) {
        self.request(now, Self::ask_hold);
    }

    /// Resumes after a [`hold`](Self::hold), even while it is still slowing down.
    pub fn resume(&mut self, now: u64) {
        self.request(now, Self::ask_resume);
    }

    /// Slows down to rest and forgets the target.
    pub fn stop(&mut self, now: u64) {
        self.request(now, Self::ask_stop);
    }

    /// Slows down to rest within other limits, for example higher ones for a limit switch, and forgets the target. Moves
    /// are refused until it is at rest. Its own limits, or those of a quick stop in progress, are used where they are
    /// higher: a quick stop is never longer than a normal one.
    pub fn quick_stop(&mut self, limits: Limits, now: u64) {
        self.ask_quick_stop(limits);
        self.follow(self.stop_quickly(now));
    }

    /// Makes no further step. The position is that of the steps made; a motor at speed runs on and loses it.
    pub fn halt(&mut self, now: u64) {
        let was_moving = !self.is_at_rest(now);
        self.ask_halt(was_moving);
        // Whatever the caller's clock says, it is not later than the next step.
        self.stand(self.due.map_or(now, |due| now.min(due)), was_moving);
    }

    /// Sets, at rest, the step count of the present position, for instance 0 at a reference.
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest.
    pub fn set_commanded(&mut self, steps: i64, now: u64) -> Result<(), Error> {
        if !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.commanded = steps;
        self.ask_stop();
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
        // A request whose clock is behind must not find the motion before, which these limits may not bring to rest.
        self.rest(self.moment(now));
        Ok(())
    }

    /// The limits.
    pub const fn limits(&self) -> Limits {
        self.limits
    }

    // Requests are recorded first and planned afterwards.

    /// Refuses moves during a quick stop, which ends at rest.
    pub(super) const fn ready(&self, at_rest: bool) -> Result<(), Error> {
        self.requests.ready(at_rest)
    }

    pub(super) const fn requests(&self) -> Requests {
        self.requests
    }

    pub(super) const fn wish(&self) -> Wish {
        Wish { aim: self.aim, requests: self.requests }
    }

    /// Moves to a target that may be outside the soft limits.
    pub(super) fn move_freely(&mut self, target: i64, now: u64) -> Result<(), Error> {
        self.ready(self.is_at_rest(now))?;
        let before = self.wish();
        self.ask_move(target, self.commanded)?;
        self.go_another_way(before, now);
        Ok(())
    }

    /// Runs to a position, if there is one.
    pub(super) fn run_to(&mut self, direction: Direction, speed: u32, end: Option<i64>, now: u64) -> Result<(), Error> {
        self.ready(self.is_at_rest(now))?;
        let before = self.wish();
        self.ask_run(direction, speed, end);
        self.go_another_way(before, now);
        Ok(())
    }

    /// Plans what has been asked for, if it is not so already.
    fn go_another_way(&mut self, before: Wish, now: u64) {
        if !self.wish().is_as(before) {
            self.replan(self.moment(now));
        }
    }

    /// Takes a request, unless it is for what is so already.
    fn request(&mut self, now: u64, ask: impl FnOnce(&mut Self)) {
        let before = self.wish();
        ask(self);
        if !self.wish().is_as(before) {
            self.follow(self.change(now));
        }
    }

    /// Refuses a target outside the soft limits.
    pub(super) fn check(&self, target: i64) -> Result<(), Error> {
        let outside = self.soft.is_some_and(|(low, high)| target < low || target > high);
        if outside { Err(Error::SoftLimit { target: clamp(target) }) } else { Ok(()) }
    }

    /// Returns the soft limit in a direction.
    pub(super) fn soft_end(&self, direction: Direction) -> Option<i64> {
        self.soft.map(|(low, high)| if direction.dir() { low } else { high })
    }

    pub(super) fn ask_move(&mut self, target: i64, from: i64) -> Result<(), Error> {
        let away = target.abs_diff(from);
        if away > u64::from(u32::MAX / 2) {
            return Err(Error::TooManySteps { steps: u32::try_from(away).unwrap_or(u32::MAX), limit: u32::MAX / 2 });
        }
        self.aim = Aim::At(target);
        self.requests.go();
        Ok(())
    }

    pub(super) const fn ask_run(&mut self, direction: Direction, speed: u32, end: Option<i64>) {
        if speed == 0 {
            return self.ask_stop();
        }
        self.aim = Aim::Run(direction, speed, end);
        self.requests.go();
    }

    pub(super) fn ask_override(&mut self, percent: u16) {
        self.requests.set_override(percent.min(100));
    }

    pub(super) const fn ask_hold(&mut self) {
        self.requests.hold();
    }

    pub(super) const fn ask_resume(&mut self) {
        self.requests.resume();
    }

    pub(super) const fn ask_stop(&mut self) {
        self.aim = Aim::Rest;
        self.requests.stop();
    }

    pub(super) fn ask_quick_stop(&mut self, limits: Limits) {
        self.aim = Aim::Rest;
        let least = if self.requests.is_quick() { &self.quick } else { &self.bounds };
        self.quick = limits.bounds(self.clock).or_higher(least);
        self.requests.quick_stop();
    }

    pub(super) const fn ask_halt(&mut self, was_moving: bool) {
        self.aim = Aim::Rest;
        self.requests.halt();
        self.requests.halted(was_moving);
    }
}
