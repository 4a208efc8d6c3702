//! Plans of an axis, from the present motion to the requested one.

use crate::limits::Bounds;
use crate::phases::{Frame, P, Phases, steps};
use crate::planner::{Goal, Motion, plan_into};
use crate::real::Real;
use crate::stepper::Stepper;
use servowire_core::Direction;

use super::{Aim, Mover};

impl Mover {
    /// Returns the moment of a request. An axis that moves is somewhere between its last step and the next one, whatever
    /// the caller's
    /// clock says: an earlier time would plan steps that have already been made, and a later one would make the missing
    /// steps in a burst.
    pub(super) fn moment(&self, now: u64) -> u64 {
        let now = self.clock.within_reach(now).max(self.free.saturating_sub(1));
        self.clock.moment(self.due.map_or(now, |due| now.min(due)))
    }

    /// Plans a request that changes the present motion, unless that is a quick stop. Returns whether the plan has changed.
    pub(super) fn change(&mut self, now: u64) -> bool {
        let moment = self.moment(now);
        // A stop under way stays the same, whichever request causes it.
        let same = self.braking && self.goal(self.direction, &self.bounds).is_none();
        let other = !self.is_moving(moment) || !self.requests.is_quick() && !same;
        if other {
            self.replan(moment);
            return true;
        }
        // Behind the last step of the stop nothing else would begin what follows it.
        let goes_on = self.due.is_none() && self.has_work();
        if goes_on {
            self.go_on();
        }
        goes_on
    }

    /// Plans a quick stop.
    pub(super) fn stop_quickly(&mut self, now: u64) {
        let moment = self.moment(now);
        if self.requests.is_quick() && self.is_moving(moment) {
            let bounds = self.quick;
            self.replan_within(moment, &bounds);
        } else {
            // To the caller the motion has ended: the caller's clock may be ahead.
            self.change(now);
        }
    }

    pub(super) fn is_moving(&self, moment: u64) -> bool {
        self.phases.frame.endless || moment < self.phases.end()
    }

    /// Plans a rest, with position 0 where the motor is.
    pub(super) fn rest(&mut self, moment: u64) {
        self.origin = self.commanded;
        self.phases = Phases::rest(self.clock.shift(), moment, 0);
        (self.stepper, self.left) = (Stepper::new(), None);
    }

    /// Makes no further step, because of a halt.
    pub(super) fn stand(&mut self, now: u64, was_moving: bool) {
        self.requests.halted(was_moving);
        (self.due, self.turn) = (None, None);
        self.rest(self.clock.moment(self.clock.within_reach(now).max(self.free)));
    }

    /// Ends a plan, and continues to the aim if the axis is not there.
    pub(super) fn go_on(&mut self) {
        let end = self.phases.end();
        if self.has_work() {
            self.replan(end);
        }
    }

    pub(super) fn has_work(&self) -> bool {
        !self.requests.brakes()
            && match self.aim {
                Aim::Rest => false,
                Aim::At(target) => target != self.commanded,
                Aim::Run(direction, _) => self.soft.is_none_or(|soft| edge(soft, direction) != self.commanded),
            }
    }

    pub(super) fn replan(&mut self, moment: u64) {
        let bounds = self.bounds;
        self.replan_within(moment, &bounds);
    }

    /// Plans from the state at a moment to the aim.
    fn replan_within(&mut self, moment: u64, bounds: &Bounds) {
        let moment = moment.max(self.phases.frame.begin);
        if self.is_moving(moment) {
            self.onward(moment, bounds);
        } else {
            self.anew(moment, bounds);
        }
        if self.due.is_none() && self.has_work() {
            // There is no step on the way to rest, so the next plan begins there.
            self.anew(self.phases.end(), bounds);
        }
    }

    /// Starts the plan that has just been made.
    pub(super) fn adopt(&mut self) {
        self.origin = self.commanded;
        (self.stepper, self.left) = (Stepper::new(), None);
        let Phases { curve, frame } = &self.phases;
        let begin = frame.begin.div_ceil(self.clock.moment(1));
        let due = if self.cuts {
            // Any tick that is not after the next step is good enough.
            self.all = if frame.endless { u32::MAX } else { steps(frame.last(curve)) };
            (self.all > 0).then_some(begin)
        } else {
            self.stepper.next(curve, frame)
        };
        self.due = due.map(|due| due.max(self.free).max(begin)).filter(|due| self.clock.is_in_time(*due));
        self.turn = None;
        if self.dir != Some(self.direction) {
            self.turn = self.due.map(|due| self.idle.max(self.free.saturating_sub(1)).midpoint(due));
            self.dir = None;
        }
    }

    /// Plans on from the present motion. Positions are counted from the steps made.
    fn onward(&mut self, moment: u64, bounds: &Bounds) {
        let Phases { curve, frame } = &self.phases;
        let (state, last) = (frame.within(curve, moment), if self.braking { frame.last(curve) } else { 0 });
        let made = i64::try_from(self.commanded.abs_diff(self.origin)).unwrap_or(0) << 32;
        let p = state.p.wrapping_sub(made);
        let start = Motion { v: state.v, a: state.a.0, up: state.a.1 };
        let bounds = &bounds.holding(state.v, state.a);
        let frame = Frame { to: None, ..Frame::rest(self.clock.shift(), moment, p) };
        let again = self.braking;
        self.braking = !self.plan(self.direction, start, frame, bounds);
        if self.braking {
            let Phases { curve, frame } = self.phases.anew(frame);
            // A stop always has room.
            let _: Result<_, _> = plan_into(curve, start, Goal::Speed(Real::ZERO), bounds);
            if again {
                // Rounding must not add a step to a stop within higher limits.
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
            // The axis has come to rest up to half a step beyond that step, but the plan begins at the step.
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
        let frame = Frame::rest(self.clock.shift(), self.clock.aligned(begin), 0);
        if self.plan(direction, Motion::steady(Real::ZERO), frame, bounds) {
            self.adopt();
        } else {
            self.rest(end);
        }
    }

    /// Replaces the present plan by one to the aim; returns false if the aim is a stop, or can no longer be reached.
    fn plan(&mut self, direction: Direction, start: Motion, frame: Frame, bounds: &Bounds) -> bool {
        let Some((want, bounds)) = self.goal(direction, bounds) else { return false };
        let Phases { curve, frame } = self.phases.anew(frame);
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

    /// Returns what to do in this direction; `None` for a stop.
    fn goal(&self, direction: Direction, bounds: &Bounds) -> Option<(Want, Bounds)> {
        let part = self.requests.part()?;
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

/// The goal of a plan.
enum Want {
    At(i64),
    Speed(Real),
}

/// Returns the steps from a position to a target in a direction; `None` if the target is behind.
fn ahead(position: i64, target: i64, direction: Direction) -> Option<u32> {
    let steps = match direction {
        Direction::Forward => target.checked_sub(position)?,
        Direction::Reverse => position.checked_sub(target)?,
    };
    u32::try_from(steps).ok().filter(|steps| *steps <= u32::MAX / 2)
}

/// Returns the end of a range in a direction.
const fn edge((low, high): (i64, i64), direction: Direction) -> i64 {
    match direction {
        Direction::Forward => high,
        Direction::Reverse => low,
    }
}
