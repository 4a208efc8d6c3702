//! Where the axis is, for a cyclic master: on the curve of its plan, and until that begins on what is left of the plan before. A stop ends
//! between steps, while a plan from rest begins at a whole one.

use crate::curve::Piece;
use crate::limits::Clock;
use crate::phases::{Phases, fine};
use crate::places::{between, gap, since};
use crate::plan::Setpoint;
use crate::real::Real;
use servowire_core::Direction;

use super::Mover;
use super::planning::Planning;
use super::runner::Runner;

/// What is left of the plan before the present one.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Behind {
    phases: Phases,
    origin: i64,
    direction: Direction,
    /// The greatest speed.
    v: Real,
    /// Moment from which on the present plan counts; the greatest number for a rest.
    next: u64,
}

impl Behind {
    /// The present plan, and no other one yet.
    pub(super) const fn new(runner: &Runner) -> Self {
        let Runner { phases, origin, direction, .. } = *runner;
        Self { phases, origin, direction, v: runner.bounds.v, next: u64::MAX }
    }

    /// The same with other numbers for its steps.
    pub(super) const fn renumbered(self, by: i64) -> Self {
        Self { origin: self.origin.wrapping_add(by), ..self }
    }

    fn way(&self) -> Way<'_> {
        Way { phases: &self.phases, origin: self.origin, direction: self.direction }
    }
}

/// The way along a curve.
struct Way<'a> {
    phases: &'a Phases,
    origin: i64,
    direction: Direction,
}

impl Way<'_> {
    /// Returns the position at its end.
    fn end(&self, clock: Clock) -> i64 {
        let Phases { curve, frame } = self.phases;
        Setpoint::new(clock, frame.unrounded(curve, u64::MAX)).on_axis(self.origin, self.direction).position
    }

    /// Returns the state at a moment; from the end on, which may be between steps, it goes on to a whole one.
    fn at(&self, clock: Clock, moment: u64, (whole, v): (i64, Real)) -> Setpoint {
        let Phases { curve, frame } = self.phases;
        let end = frame.end(curve);
        if frame.endless || moment < end {
            return Setpoint::new(clock, frame.within(curve, moment)).on_axis(self.origin, self.direction);
        }
        let from = self.end(clock);
        between(clock, (from, whole), gap(from, whole), &Piece::steady(v).after(since(end, moment)))
    }
}

impl Mover {
    /// Returns position, speed, acceleration and jerk at a tick that is not before the last step. The position does not jump, whatever is
    /// asked for: an axis that a stop or a halt has left between two steps goes on to the last step that was made, at its greatest
    /// speed, and what follows begins after that.
    pub fn at(&self, now: u64) -> Setpoint {
        self.place(self.runner.clock.moment(now))
    }

    fn place(&self, moment: u64) -> Setpoint {
        let Runner { clock, phases, origin, direction, bounds, .. } = &self.runner;
        let Behind { v, next, .. } = self.behind;
        if moment < next {
            return self.behind.way().at(*clock, moment, (fine(*origin), v));
        }
        let way = Way { phases, origin: *origin, direction: *direction };
        let last = Setpoint::at_rest(phases.last()).on_axis(*origin, *direction);
        way.at(*clock, moment, (last.position, bounds.v))
    }

    /// Does a slice of a plan. One from rest begins when the axis is at a whole step.
    pub(super) fn plan(&mut self, planning: &mut Planning) -> bool {
        let Some(moment) = planning.anew() else { return self.runner.plan(planning) };
        self.behind = self.left_behind();
        *moment = (*moment).max(self.over_behind());
        let more = self.runner.plan(planning);
        if more {
            self.behind.next = self.runner.phases.frame.begin;
        }
        more
    }

    /// Returns what is left at a rest: of the present plan, or of the one before if the present one never begins.
    pub(super) fn left_behind(&self) -> Behind {
        let Phases { curve, frame } = &self.runner.phases;
        if curve.pieces().is_empty() && frame.begin <= self.behind.next {
            return Behind { next: u64::MAX, ..self.behind };
        }
        Behind::new(&self.runner)
    }

    /// Keeps where the axis is, because it goes no further.
    pub(super) fn stay_behind(&mut self, now: u64) {
        let moment = self.runner.moment(now);
        let Runner { clock, commanded, .. } = self.runner;
        let off = self.place(moment).position.wrapping_sub(fine(commanded));
        let phases = Phases::rest(clock.shift(), moment, off);
        self.behind = Behind { phases, origin: commanded, direction: Direction::Forward, ..Behind::new(&self.runner) };
    }

    /// Returns when the axis has gone on to a whole step.
    fn over_behind(&self) -> u64 {
        let Behind { phases, v, .. } = &self.behind;
        let way = gap(self.behind.way().end(self.runner.clock), fine(self.runner.commanded));
        if way.is_zero() { 0 } else { phases.end().saturating_add((way / *v).to_fixed(0)) }
    }
}
