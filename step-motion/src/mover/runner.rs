//! An axis and the plan that it is on, for [`Mover`](crate::Mover) and [`Axis`](crate::Axis).

use crate::cutter::Stretch;
use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::phases::Phases;
use crate::plan::{checked, clamp};
use crate::requests::Requests;
use crate::stepper::Stepper;
use servowire_core::Direction;

/// The aim of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Aim {
    /// None: to rest.
    Rest,
    /// Be at a position.
    At(i64),
    /// Keep a speed, in steps/s, and come to rest at this position if there is one.
    Run(Direction, u32, Option<i64>),
}

/// What has been asked of an axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish {
    aim: Aim,
    requests: Requests,
}

impl Wish {
    /// Returns whether another request has changed nothing.
    pub(crate) fn is_as(self, other: Self) -> bool {
        self.aim == other.aim && self.requests.are_as(other.requests)
    }
}

/// The requests to an axis, its plan, and the steps that have been made of it.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Runner {
    pub(super) clock: Clock,
    pub(super) limits: Limits,
    pub(super) bounds: Bounds,
    pub(super) phases: Phases,
    pub(super) stepper: Stepper,
    /// Its steps are cut into stretches, not taken one by one.
    pub(super) cuts: bool,
    /// The next stretch, if it is known.
    pub(super) left: Option<Stretch>,
    /// Steps of the plan; the greatest number for a plan without end.
    pub(super) all: u32,
    pub(super) direction: Direction,
    /// Position of the motor where the position of the plan is 0.
    pub(super) origin: i64,
    pub(super) commanded: i64,
    /// Tick of the next step.
    pub(super) due: Option<u64>,
    /// Earliest tick at which it may come.
    pub(super) free: u64,
    pub(super) aim: Aim,
    pub(super) requests: Requests,
    /// The limits of a quick stop in progress.
    pub(super) quick: Bounds,
    pub(super) soft: Option<(i64, i64)>,
    /// Ticks of rest before the direction changes.
    pub(super) pause: u32,
    /// Tick at which DIR changes for the next step.
    pub(super) turn: Option<u64>,
    /// DIR of the last step; `None` if DIR may have changed since.
    pub(super) dir: Option<Direction>,
    /// The present plan is a stop.
    pub(super) braking: bool,
}

/// By hand, because the derived `clone_from` copies it twice.
impl Clone for Runner {
    fn clone(&self) -> Self {
        Self { ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        *self = Self { ..*source };
    }
}

impl Runner {
    /// Creates an axis at rest at position 0.
    pub(crate) fn new(clock: Clock, limits: Limits) -> Result<Self, Error> {
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

    pub(crate) const fn with_reversal_pause(self, ticks: u32) -> Self {
        Self { pause: ticks, ..self }
    }

    pub(crate) const fn with_soft_limits(self, low: i64, high: i64) -> Self {
        Self { soft: Some((low, high)), ..self }
    }

    pub(crate) const fn commanded(&self) -> i64 {
        self.commanded
    }

    pub(crate) const fn direction(&self) -> Direction {
        self.direction
    }

    pub(crate) fn is_at_rest(&self, now: u64) -> bool {
        self.due.is_none() && self.clock.moment(now) >= self.phases.end()
    }

    pub(crate) const fn is_halted(&self) -> bool {
        self.requests.is_halted()
    }

    pub(crate) fn set_commanded(&mut self, steps: i64, now: u64) -> Result<(), Error> {
        if !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.commanded = steps;
        self.ask_stop();
        self.rest(self.phases.end());
        Ok(())
    }

    pub(crate) fn set_limits(&mut self, limits: Limits, now: u64) -> Result<(), Error> {
        if !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.bounds = checked(self.clock, limits)?;
        self.limits = limits;
        // A request whose clock is behind must not find the motion before, which these limits may not bring to rest.
        self.rest(self.moment(now));
        Ok(())
    }

    // Requests are recorded first and planned afterwards.

    pub(crate) const fn requests(&self) -> Requests {
        self.requests
    }

    pub(crate) const fn wish(&self) -> Wish {
        Wish { aim: self.aim, requests: self.requests }
    }

    /// Refuses a target outside the soft limits.
    pub(crate) fn check(&self, target: i64) -> Result<(), Error> {
        let outside = self.soft.is_some_and(|(low, high)| target < low || target > high);
        if outside { Err(Error::SoftLimit { target: clamp(target) }) } else { Ok(()) }
    }

    /// Returns the soft limit in a direction.
    pub(crate) fn soft_end(&self, direction: Direction) -> Option<i64> {
        self.soft.map(|(low, high)| if direction.dir() { low } else { high })
    }

    /// Refuses moves during a quick stop, which ends at rest.
    pub(crate) const fn ready(&self, at_rest: bool) -> Result<(), Error> {
        self.requests.ready(at_rest)
    }

    pub(crate) fn ask_move(&mut self, target: i64, from: i64) -> Result<(), Error> {
        let away = target.abs_diff(from);
        if away > u64::from(u32::MAX / 2) {
            return Err(Error::TooManySteps { steps: u32::try_from(away).unwrap_or(u32::MAX), limit: u32::MAX / 2 });
        }
        self.aim = Aim::At(target);
        self.requests.go();
        Ok(())
    }

    pub(crate) const fn ask_run(&mut self, direction: Direction, speed: u32, end: Option<i64>) {
        if speed == 0 {
            return self.ask_stop();
        }
        self.aim = Aim::Run(direction, speed, end);
        self.requests.go();
    }

    pub(crate) fn ask_override(&mut self, percent: u16) {
        self.requests.set_override(percent.min(100));
    }

    pub(crate) const fn ask_hold(&mut self) {
        self.requests.hold();
    }

    pub(crate) const fn ask_resume(&mut self) {
        self.requests.resume();
    }

    pub(crate) const fn ask_stop(&mut self) {
        self.aim = Aim::Rest;
        self.requests.stop();
    }

    pub(crate) fn ask_quick_stop(&mut self, limits: Limits) {
        self.aim = Aim::Rest;
        let least = if self.requests.is_quick() { &self.quick } else { &self.bounds };
        self.quick = limits.bounds(self.clock).or_higher(least);
        self.requests.quick_stop();
    }

    pub(crate) const fn ask_halt(&mut self, was_moving: bool) {
        self.aim = Aim::Rest;
        self.requests.halt();
        self.requests.halted(was_moving);
    }
}
