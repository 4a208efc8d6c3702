//! Plans of a path mover, from the present motion along its lines.

use crate::limits::Bounds;
use crate::line::{LinePulses, Start, Steps};
use crate::path::{Course, End, Leaving};
use crate::planner::Motion;
use crate::real::Real;

use super::PathMover;

#[cfg(test)]
mod tests;

/// How a stop runs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop<const N: usize> {
    /// The line where it ends, and the place on it.
    pub(super) end: (usize, Real),
    /// How it leaves the lines of its first curve.
    pub(super) left: Leaving,
    /// The path has been cut off there already.
    pub(super) cut: bool,
    /// Its first curve, if it is not the present one.
    pub(super) first: Option<(Course, Start<N>, Bounds)>,
    /// Time from the end of that curve to the rest, if it is known.
    pub(super) after: Option<Real>,
}

impl<const N: usize, const M: usize> PathMover<N, M> {
    /// Returns the motion from which a new plan starts; `None` if the present plan ends before that, at the end of the line.
    pub(super) fn here(&self, now: u64) -> Option<(Motion, Start<N>)> {
        let line = self.line.as_ref()?;
        let moment = self.clock().moment(self.tick(now));
        let mut start = Start { made: self.made, ..line.start };
        if moment >= line.over() {
            let at = start.place + line.curve.way();
            (start.place, start.before) = (at - start.before, start.before - at);
            (start.moment, start.offset) = (self.clock().aligned(moment), Real::ZERO);
            return (!start.whole).then_some((Motion::steady(Real::ZERO), start));
        }
        let begin = line.start.moment;
        if moment <= begin {
            return Some((line.motion(begin).0, start));
        }
        let (motion, place, before) = line.motion(moment);
        Some((motion, Start { place, before, moment, offset: Real::ZERO, ..start }))
    }

    /// Returns how the present motion leaves its lines.
    pub(super) const fn leaving(&self) -> Leaving {
        Leaving { more: self.more, exit: self.exit, bounds: None }
    }

    /// Returns how a stop runs; `None` at rest.
    pub(super) fn stop_from(&self, now: u64) -> Option<Stop<N>> {
        self.line.as_ref()?;
        if self.requests.is_stopping() {
            let end = self.path.end_of_cut()?;
            return Some(Stop { end, left: self.leaving(), cut: true, first: None, after: None });
        }
        self.stop_anew(now, None)
    }

    /// Returns how a stop runs that begins now, plain or quick, whatever stop is under way; `None` at rest. `plain`: the limits within
    /// which the plain one begins that is there instead of a quick one.
    pub(super) fn stop_anew(&self, now: u64, plain: Option<Bounds>) -> Option<Stop<N>> {
        let present = |end| Stop { end, left: self.leaving(), cut: false, first: None, after: None };
        let here = self.here(now);
        // Without speed the distance to rest is 0: a step that is due, its tick being the nearest one, is no longer made.
        if here.as_ref().is_some_and(|(motion, _)| motion.v.is_zero()) {
            return None;
        }
        let Some((motion, start)) = here else {
            return Some(present((self.more, self.path.line(self.more)?.length)));
        };
        if self.braking && plain.is_none() {
            // A stop under way stays the same.
            let line = self.line.as_ref()?;
            let end = if self.exit.is_zero() {
                self.path.locate(0, (line.start.place + line.curve.way()) - line.start.before, self.more)
            } else {
                self.path.end_of_stop(self.more.saturating_add(1), self.exit).0
            };
            return Some(present(end));
        }
        let from = (start.place, start.before);
        let how = (self.bounds, self.braking);
        let planned = |(mut course, bounds): (Course, Bounds)| {
            let end = self.path.locate(0, (start.place + course.curve.way()) - start.before, course.more);
            let left = Leaving { more: course.more, exit: course.exit, bounds: Some(bounds) };
            // It is whole once the path has been cut off where it ends.
            course.whole = true;
            Stop { end, left, cut: false, first: Some((course, start, bounds)), after: None }
        };
        let stop = match self.path.brake(0, motion, from, how) {
            Some(course) => planned(course),
            None => present((self.more, self.path.line(self.more)?.length)),
        };
        let Leaving { more, exit, .. } = stop.left;
        if exit.is_zero() {
            return Some(stop);
        }
        let (end, after) = self.path.end_of_stop(more.saturating_add(1), exit);
        let stop = Stop { end, after: Some(after), ..stop };
        // At each joint it would have acceleration 0; on one curve it may be shorter. Within lower limits, those of a later line, it would
        // be faster at first.
        let Some(plain) = plain else { return Some(stop) };
        let once = self.path.stop(0, motion, from, how, Some(plain)).and_then(Result::ok).map(planned);
        once.filter(|once| once.end < stop.end).or(Some(stop))
    }

    /// Returns where a stop ends: with the steps of a stop under way, or no more than these.
    pub(super) fn end_of(&self, stop: &Stop<N>) -> End<N> {
        let (at, under_way) = (stop.end, self.braking && !stop.cut && self.exit.is_zero());
        let most = if under_way && at.0 == self.more { self.steps_at_end() } else { None };
        let least = most.filter(|_| stop.first.is_none()).unwrap_or([0; N]);
        End { at, least, most: most.unwrap_or([u32::MAX; N]) }
    }

    /// Returns the steps of each axis on the last line of the present curve, at the end of the curve.
    fn steps_at_end(&self) -> Option<[u32; N]> {
        let line = self.line.as_ref()?;
        if self.more == 0 {
            return Some(line.steps_at_end());
        }
        let lengths =
            (0..self.more).filter_map(|at| self.path.line(at)).fold(Real::ZERO, |sum, line| sum + line.length);
        let before = (line.start.before + lengths) - line.start.place;
        let start = Start { place: Real::ZERO, before, made: [0; N], whole: self.whole, ..line.start };
        let last = self.path.line(self.more)?;
        Some(LinePulses::new(self.clock(), &line.curve, last, start, Steps::Stretches).steps_at_end())
    }

    /// Returns the moment at which a stop comes to rest.
    pub(super) fn rest_of(&self, stop: &Stop<N>) -> u64 {
        let first = match &stop.first {
            Some((Course { curve, .. }, start, _)) => {
                let time = start.offset + (curve.time - curve.skipped.0);
                start.moment.saturating_add(time.to_fixed(0))
            }
            None => self.line.as_ref().map_or(0, LinePulses::over),
        };
        let Leaving { more, exit, .. } = stop.left;
        if exit.is_zero() {
            return first;
        }
        let after = stop.after.unwrap_or_else(|| self.path.end_of_stop(more.saturating_add(1), exit).1);
        first.saturating_add(after.to_fixed(0))
    }

    /// Ends the path where a stop ends, and adopts the stop's first curve: it is not planned again, because a plan along
    /// the shorter path may differ by its rounding, and leave a line at a speed that it had not.
    pub(super) fn leave_at(&mut self, stop: &Stop<N>, now: u64) {
        self.path.cut(&self.end_of(stop), self.begun(), self.made, stop.left);
        if let Some((course, start, bounds)) = &stop.first {
            self.adopt(course, *start, *bounds);
        }
        if stop.end.0 < self.more {
            // A stop at a joint, but for rounding: on the line before it.
            (self.more, self.whole) = (stop.end.0, true);
        }
        self.settle(now);
    }

    /// Plans the rest of the motion after a request.
    pub(crate) fn replan(&mut self, now: u64) {
        // A stop that is under way is the same one whoever asks for it.
        let brakes = self.requests.brakes();
        if self.requests.is_stopping() || self.line.is_some() && self.braking && brakes {
            return;
        }
        if self.line.is_none() {
            if !brakes {
                self.path.not_before(now.saturating_add(self.turning()));
            }
            self.begin();
        } else {
            self.plan(now);
        }
        self.settle(now);
    }

    /// Plans the rest of the running line.
    pub(super) fn plan(&mut self, now: u64) {
        let Some((motion, mut start)) = self.here(now) else { return };
        if motion.v.is_zero() {
            start.moment = start.moment.max(self.clock().moment(now.saturating_add(self.turning())));
        }
        let from = (start.place, start.before);
        let part = self.requests.part();
        self.late = part.is_some();
        let course = match part {
            Some(part) => self.path.course(0, motion, from, (part, self.bounds)),
            None => self.path.brake(0, motion, from, (self.bounds, self.braking)),
        };
        if let Some((course, bounds)) = course {
            self.adopt(&course, start, bounds);
        }
    }

    /// Returns how many ticks DIR has to change before the first line begins, or goes on from a rest.
    fn turning(&self) -> u64 {
        let steps = self.path.line(0).map_or([0; N], |line| line.steps);
        let turns = self.path.turns(steps).into_iter().zip(self.made).zip(self.path.axes());
        let leads = turns.filter(|((turns, made), _)| *turns && *made == 0);
        leads.map(|(_, axis)| u64::from((axis.reversal_pause / 2).min(self.lead))).max().unwrap_or(0)
    }

    /// Plans the rest of the running line again after lines have been added, which ask for another speed at its end. If it
    /// cannot reach that any more, the present plan stays.
    pub(super) fn plan_better(&mut self, now: u64, part: Real) {
        self.wish = self.path.exit(self.more, part);
        let Some((motion, start)) = self.here(now) else { return };
        let course = self.path.better_course(0, motion, (start.place, start.before), (part, self.bounds));
        if let Some((course, bounds)) = course {
            self.adopt(&course, start, bounds);
        }
        self.settle(now);
    }

    /// Begins the first line.
    pub(super) fn begin(&mut self) {
        (self.made, self.exit, self.more) = ([0; N], Real::ZERO, 0);
        if !self.begins() {
            self.line = None;
        }
    }

    /// Begins the first line in place of the one before, if it can be begun; returns whether it has.
    fn begins(&mut self) -> bool {
        let part = self.requests.part();
        if self.path.is_empty() || self.path.speed().is_zero() && part.is_none() {
            return false;
        }
        self.path.not_before_steps(self.free);
        self.path.not_before_moment(self.behind.over);
        self.path.not_before_turning();
        let speed = self.path.speed();
        let course = match part {
            Some(part) => self.path.begin(0, speed, part),
            None => self.path.begin_to_brake(0, speed),
        };
        course.is_some_and(|(course, bounds)| self.adopt(&course, self.path.start(), bounds))
    }

    /// Replaces the running curve, unless rounding has left the new one without the remaining steps; returns whether it has.
    pub(super) fn adopt(&mut self, course: &Course, start: Start<N>, bounds: Bounds) -> bool {
        let Some(first) = self.path.line(0) else { return false };
        let whole = course.more > 0 || course.whole;
        let none = course.curve.pieces().is_empty() || first.ends.iter().zip(&self.made).all(|(end, made)| end <= made);
        if whole && none && self.made != first.ends {
            return false;
        }
        let (clock, start) = (self.path.clock(), Start { whole, ..start });
        let line = self.line.get_or_insert_with(|| LinePulses::none(clock, start));
        line.begin(&course.curve, first, start, self.steps);
        let begin = start.moment.div_ceil(clock.moment(1));
        for (due, free) in line.due.iter_mut().zip(self.free) {
            *due = due.map(|due| due.max(free).max(begin));
        }
        (self.exit, self.origin) = (course.exit, self.commanded);
        (self.more, self.whole, self.wish, self.bounds) = (course.more, course.whole, course.wish, Some(bounds));
        // A curve that ends before its lines is one to rest.
        (self.braking, self.late) = (self.requests.brakes() || !course.whole, course.slow);
        self.left = [None; N];
        true
    }

    /// Continues with the next line on the same curve.
    pub(super) fn go_on(&mut self) {
        let (Some(line), Some(length)) = (&mut self.line, self.path.line(0).map(|line| line.length)) else { return };
        let before = (line.start.before + length) - line.start.place;
        self.path.pass();
        let Some(next) = self.path.line(0) else { return };
        self.more = self.more.saturating_sub(1);
        let (place, whole) = (Real::ZERO, self.more > 0 || self.whole);
        let start = Start { place, before, made: [0; N], whole, ..line.start };
        line.go_on(next, start, self.steps);
        for (due, free) in line.due.iter_mut().zip(self.free) {
            *due = due.map(|due| due.max(free));
        }
        (self.origin, self.made, self.left) = (self.commanded, [0; N], [None; N]);
        if self.late && !self.requests.brakes() {
            self.plan(0);
        }
    }

    /// Takes out lines that have ended, and begins the next one.
    pub(super) fn settle(&mut self, now: u64) {
        for _ in 0..=M {
            if !self.go_over(now) {
                return;
            }
        }
    }

    /// Takes out the first line if it has ended, and begins the next one. Returns whether that may have ended as well.
    pub(super) fn go_over(&mut self, now: u64) -> bool {
        let (Some(line), Some(first)) = (&self.line, self.path.line(0)) else { return false };
        if line.first().is_some() {
            return false;
        }
        if self.made != first.ends {
            if self.braking && !self.requests.brakes() {
                // It could not leave a brake that is no longer asked for: on from where that comes to rest.
                self.plan(self.over());
            }
            return false;
        }
        let cut = first.cut;
        self.leave_behind(now);
        if self.more > 0 {
            self.go_on();
        } else if let Some(line) = &self.line {
            self.path.finish(&line.curve, line.start.moment, line.start.offset, self.exit);
            if cut {
                self.requests.stopped();
            }
            self.begin();
        }
        true
    }
}
