//! Plans of an axis, from the present motion to the requested one.

use crate::limits::Bounds;
use crate::phases::{Frame, P, Phases, steps};
use crate::planner::{Found, Goal, Motion, Search};
use crate::real::Real;
use crate::stepper::Stepper;
use servowire_core::Direction;

use super::runner::{Aim, Runner};

impl Runner {
    /// Returns the moment of a request. An axis that moves is somewhere between its last step and the next one, whatever the
    /// caller's clock says: an earlier time would plan steps that have already been made, and a later one would make the missing
    /// steps in a burst.
    pub(super) fn moment(&self, now: u64) -> u64 {
        let now = self.clock.within_reach(now).max(self.free.saturating_sub(1));
        self.clock.moment(self.due.map_or(now, |due| now.min(due)))
    }

    /// Returns how the plan of a request begins that changes the present motion, unless that is a quick stop.
    pub(super) fn change(&self, now: u64) -> Option<Begin> {
        let moment = self.moment(now);
        // A stop under way stays the same, whichever request causes it.
        let same = self.braking && self.goal(self.direction, &self.bounds).is_none();
        if !self.is_moving(moment) || !self.requests.is_quick() && !same {
            return Some(self.from(moment));
        }
        // After the last step of the stop nothing else would begin what follows it.
        if self.due.is_none() { self.go_on() } else { None }
    }

    /// Returns how the plan of a quick stop begins.
    pub(super) fn stop_quickly(&self, now: u64) -> Option<Begin> {
        let moment = self.moment(now);
        if self.requests.is_quick() && self.is_moving(moment) {
            return Some(Begin { quick: true, ..self.from(moment) });
        }
        // To the caller the motion has ended: the caller's clock may be ahead.
        self.change(now)
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

    /// Returns how the plan begins that follows the present one, if the axis is not at its aim.
    pub(super) fn go_on(&self) -> Option<Begin> {
        self.has_work().then(|| self.from(self.phases.end()))
    }

    /// Returns whether the axis is to go on to its aim.
    pub(crate) fn has_work(&self) -> bool {
        !self.requests.brakes()
            && match self.aim {
                Aim::Rest => false,
                Aim::At(target) => target != self.commanded,
                Aim::Run(direction, _, end) => {
                    let end = self.end_of_run(direction, end);
                    end.is_none_or(|end| self.ahead(end, direction).is_some_and(|steps| steps > 0))
                }
            }
    }

    /// Returns how a plan from a moment to the aim begins.
    pub(super) fn from(&self, moment: u64) -> Begin {
        let moment = moment.max(self.phases.frame.begin);
        let stage = if self.is_moving(moment) { Stage::Onward(moment) } else { Stage::Anew(moment) };
        Begin { stage, quick: false }
    }

    /// Does a slice of a plan. Returns whether there is more of it.
    pub(crate) fn plan(&mut self, planning: &mut Planning) -> bool {
        match planning.stage {
            Stage::Over => return false,
            Stage::Onward(moment) => self.onward(moment, planning),
            Stage::Anew(moment) => self.anew(moment, planning),
            Stage::Search => match planning.search.step(&planning.own) {
                None => {}
                Some(Ok(found)) => (planning.stage, planning.found) = (Stage::Draw, found),
                Some(Err(_)) => self.beyond_reach(planning),
            },
            Stage::Draw => {
                planning.search.draw(&mut self.phases.curve, &planning.found, &planning.own);
                planning.stage = self.drawn(&planning.origin);
            }
        }
        !planning.is_over()
    }

    /// Returns the limits of a plan.
    const fn bounds_of(&self, planning: &Planning) -> Bounds {
        if planning.quick { self.quick } else { self.bounds }
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
            let turned = self.turn.map_or(0, |turn| turn.saturating_add(1));
            self.stepper.next(curve, frame).map(|due| due.max(turned))
        };
        self.due = due.map(|due| due.max(self.free).max(begin)).filter(|due| self.clock.is_in_time(*due));
    }

    /// Plans on from the present motion. Positions are counted from the steps made.
    fn onward(&mut self, moment: u64, planning: &mut Planning) {
        let Phases { curve, frame } = &self.phases;
        let (state, last) = (frame.within(curve, moment), self.braking.then(|| frame.last(curve)));
        let made = i64::try_from(self.commanded.abs_diff(self.origin)).unwrap_or(0) << 32;
        let motion = Motion { v: state.v, a: state.a.0, up: state.a.1 };
        let frame = Frame { to: None, ..Frame::rest(self.clock.shift(), moment, state.p.wrapping_sub(made)) };
        // Rounding must not add a step to a stop within higher limits.
        let most = last.map(|last| last.saturating_sub(made));
        let bounds = self.bounds_of(planning).holding(state.v, state.a);
        planning.origin = Origin { rest: None, motion, frame, bounds, most };
        if !self.seek(motion, frame, &bounds, planning) {
            self.beyond_reach(planning);
        }
    }

    /// Begins the search for a plan to the aim, in the present direction; returns false if that is behind, or to rest.
    fn seek(&mut self, start: Motion, frame: Frame, bounds: &Bounds, planning: &mut Planning) -> bool {
        let Some((want, own)) = self.goal(self.direction, bounds) else { return false };
        let (goal, to) = match want {
            Want::Speed(v) => (Goal::Speed(v), None),
            Want::At(target) => {
                let Some(left) = self.ahead(target, self.direction) else { return false };
                let to = i64::from(left) << 32;
                let Ok(way) = u64::try_from(to.saturating_sub(frame.from)) else { return false };
                (Goal::At(Real::fixed(way, P), Real::ZERO), Some(to))
            }
        };
        self.braking = false;
        self.phases.anew(Frame { to, endless: to.is_none(), ..frame });
        planning.search(start, goal, own);
        true
    }

    /// Returns the steps to a target in a direction, of which a plan has no more than 2^31 - 1; `None` if the target is behind.
    fn ahead(&self, target: i64, direction: Direction) -> Option<u32> {
        let ahead = if direction.dir() { target <= self.commanded } else { target >= self.commanded };
        let steps = target.abs_diff(self.commanded).min(u64::from(u32::MAX / 2));
        u32::try_from(steps).ok().filter(|_| ahead)
    }

    /// Returns where a run ends: at its own end, or at the last position that there is, once a plan may get there.
    fn end_of_run(&self, direction: Direction, end: Option<i64>) -> Option<i64> {
        let last = if direction.dir() { i64::MIN } else { i64::MAX };
        end.or_else(|| (last.abs_diff(self.commanded) <= u64::from(u32::MAX / 2)).then_some(last))
    }

    /// Plans a stop, from a motion that cannot reach the aim; from rest, nothing.
    fn beyond_reach(&mut self, planning: &mut Planning) {
        let Origin { rest, motion, frame, bounds, .. } = planning.origin;
        if let Some(end) = rest {
            self.rest(end);
            planning.stage = Stage::Over;
        } else {
            self.braking = true;
            self.phases.anew(frame);
            // A stop always has room.
            planning.search(motion, Goal::Speed(Real::ZERO), bounds);
        }
    }

    /// Starts a plan that has been drawn; if there is no step on the way to rest, the next plan begins there.
    fn drawn(&mut self, origin: &Origin) -> Stage {
        if let Some(most) = origin.most.filter(|_| self.braking) {
            let Phases { curve, frame } = &mut self.phases;
            frame.to = Some(frame.last(curve).min(most));
        }
        self.adopt();
        let anew = origin.rest.is_none() && self.due.is_none() && self.has_work();
        if anew { Stage::Anew(self.phases.end()) } else { Stage::Over }
    }

    /// Plans from rest.
    fn anew(&mut self, moment: u64, planning: &mut Planning) {
        let (end, bounds) = (self.phases.end(), self.bounds_of(planning));
        self.rest(end);
        self.due = None;
        let mut begin = moment.max(end);
        if let Some(last) = self.free.checked_sub(1) {
            // The axis has come to rest up to half a step beyond that step, but the plan begins at the step.
            let half = (Real::ONE.half() / bounds.v).to_fixed(0);
            begin = begin.max(self.clock.moment(last).saturating_add(half));
        }
        self.braking = false;
        if !self.has_work() {
            planning.stage = Stage::Over;
            return;
        }
        let direction = match self.aim {
            Aim::At(target) if target < self.commanded => Direction::Reverse,
            Aim::Run(direction, ..) => direction,
            _ => Direction::Forward,
        };
        if self.dir != Some(direction) {
            // Before the motion begins: once it has, another request may make the first step earlier.
            let idle = begin.div_ceil(self.clock.moment(1));
            (self.turn, self.dir) = (Some(idle.saturating_add(u64::from(self.pause / 2))), None);
            begin = begin.saturating_add(self.clock.moment(self.pause.into()));
        }
        self.direction = direction;
        let frame = Frame::rest(self.clock.shift(), self.clock.aligned(begin), 0);
        planning.origin.rest = Some(end);
        if !self.seek(Motion::steady(Real::ZERO), frame, &bounds, planning) {
            self.beyond_reach(planning);
        }
    }

    /// Returns what to do in this direction; `None` for a stop.
    fn goal(&self, direction: Direction, bounds: &Bounds) -> Option<(Want, Bounds)> {
        let part = self.requests.part()?;
        match self.aim {
            Aim::Rest => None,
            Aim::At(target) => Some((Want::At(target), bounds.slower(bounds.v * part))),
            Aim::Run(way, ..) if way != direction => None,
            Aim::Run(_, speed, end) => {
                let v = Real::new(speed.into()) / Real::new(self.clock.moments().into());
                let v = v.min(bounds.v) * part;
                match self.end_of_run(direction, end) {
                    Some(end) => Some((Want::At(end), bounds.slower(v))),
                    None => Some((Want::Speed(v), *bounds)),
                }
            }
        }
    }
}

/// How a plan begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Begin {
    stage: Stage,
    /// Within the limits of the quick stop.
    quick: bool,
}

impl Begin {
    /// Nothing is to be planned.
    pub(crate) const OVER: Self = Self { stage: Stage::Over, quick: false };
}

/// A plan while it is being made. It is large, so all of it stays in place.
#[derive(Debug)]
pub(crate) struct Planning {
    stage: Stage,
    quick: bool,
    origin: Origin,
    /// The search, within its own limits, and what it has found.
    search: Search,
    own: Bounds,
    found: Found,
}

impl Planning {
    pub(crate) const OVER: Self = Self {
        stage: Stage::Over,
        quick: false,
        origin: Origin {
            rest: Some(0),
            motion: Motion::steady(Real::ZERO),
            frame: Frame::rest(0, 0, 0),
            bounds: Bounds::NONE,
            most: None,
        },
        search: Search::NONE,
        own: Bounds::NONE,
        found: Found::NONE,
    };

    pub(crate) const fn begin(&mut self, Begin { stage, quick }: Begin) {
        (self.stage, self.quick) = (stage, quick);
    }

    /// Returns the moment from which on a plan from rest is to be made next.
    pub(super) const fn anew(&mut self) -> Option<&mut u64> {
        if let Stage::Anew(moment) = &mut self.stage { Some(moment) } else { None }
    }

    pub(crate) const fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Over)
    }

    fn search(&mut self, start: Motion, goal: Goal, own: Bounds) {
        (self.search, self.own, self.stage) = (Search::new(start, goal, &own), own, Stage::Search);
    }
}

/// What comes next.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// From the motion at a moment, or from the rest after it.
    Onward(u64),
    Anew(u64),
    Search,
    Draw,
    Over,
}

/// Where a plan begins: at a rest since a moment, or else in a motion.
#[derive(Debug, Clone, Copy)]
struct Origin {
    rest: Option<u64>,
    motion: Motion,
    frame: Frame,
    /// The limits, as high as the motion needs.
    bounds: Bounds,
    /// Where the stop under way ends, if there is one.
    most: Option<i64>,
}

/// The goal of a plan.
#[derive(Debug, Clone, Copy)]
enum Want {
    At(i64),
    Speed(Real),
}

#[cfg(test)]
mod tests {
    use crate::Mover;
    use crate::limits::{Clock, Limits};

    /// Where no step of a plan is in time, nothing follows that plan.
    #[test]
    fn an_axis_at_the_end_of_time_stands() {
        let mut mover = Mover::new(Clock::MICROSECONDS, Limits::new(1, 1).unwrap()).unwrap();
        mover.runner.ask_move(10, 0).unwrap();
        mover.runner.rest(u64::MAX - 5);
        mover.replan(u64::MAX - 5);
        assert_eq!((mover.due(), mover.commanded()), (None, 0));
    }
}
