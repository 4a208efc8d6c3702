//! Runs of lines that one curve covers, and the plans along them.
//!
//! A jerk-limited curve has acceleration 0 at both ends. So that it need not be 0 at every joint, lines with nearly the
//! same limits, whose corners need no lower speed, form a run: one curve leads along all of them.

use super::{Course, Path};
use crate::curve::Curve;
use crate::limits::Bounds;
use crate::line::Line;
use crate::planner::{Goal, Motion, SLACK, fastest_exit, greatest, plan, slowest_exit};
use crate::real::Real;

/// Consecutive lines of the queue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// Lines after the first one.
    more: usize,
    length: Real,
    /// The limits that hold on all of them.
    bounds: Bounds,
}

impl Run {
    /// All bytes are zero, so an array of it is cleared rather than copied.
    const NONE: Self = Self {
        more: 0,
        length: Real::ZERO,
        bounds: Bounds { v: Real::ZERO, a: Real::ZERO, per_a: Real::ZERO, jerk: None },
    };
}

/// How much more acceleration or jerk a line may allow than another one of the same run.
const ALIKE: Real = Real::fixed(3, 1);
/// How much more speed it may allow.
const EQUAL: Real = Real::fixed(129, 7);

impl<const N: usize, const M: usize> Path<N, M> {
    /// Returns the run that begins at line `at`, with a speed of at most `speed` and of what its lines allow, and with an
    /// acceleration and jerk under way: limits below these would make them jump. It has at most `most` lines after the
    /// first one; with `any`, also such as allow other accelerations.
    fn run(
        &self,
        at: usize,
        part: Option<Real>,
        (speed, held): (Real, [Real; 2]),
        (most, any): (usize, bool),
    ) -> Option<Run> {
        let mut last = self.line(at)?;
        // A fraction of the requested speed; without one, all that the axes allow.
        let allowed = |line: &Line<N>| part.map_or(line.bounds.v, |part| line.speed(part));
        let mut run = Run { more: 0, length: last.length, bounds: Bounds { v: allowed(last), ..last.bounds } };
        while let Some(jerk) = run.bounds.jerk.filter(|_| !last.cut && last.leave.is_none()) {
            if run.more >= most {
                break;
            }
            let next = at.saturating_add(run.more).saturating_add(1);
            let Some(line) = self.line(next) else { break };
            let Bounds { a: own, jerk: Some(other), .. } = &line.bounds else { break };
            let most = allowed(line);
            let fastest = if part.is_some() { run.bounds.v.max(speed) } else { speed };
            let alike = |a: Real, b: Real, by: Real| a <= b * by && b <= a * by;
            let fits = line.corner >= fastest && most >= speed;
            let v = part.is_none() || alike(most, run.bounds.v, EQUAL);
            let same = any || alike(*own, run.bounds.a, ALIKE) && alike(other.j, jerk.j, ALIKE);
            if !fits || !v || !same {
                break;
            }
            let (a, j) = (run.bounds.a.min(*own), jerk.j.min(other.j));
            if a < held[0] || j < held[1] {
                break;
            }
            let v = run.bounds.v.min(most);
            let same = a == run.bounds.a && j == jerk.j;
            run.bounds = if same { Bounds { v, ..run.bounds } } else { Bounds::new(v, a, Some(j)) };
            (run.more, run.length) = (run.more.saturating_add(1), run.length + line.length);
            last = line;
        }
        Some(run)
    }

    /// Plans from a motion at a place on line `at`, or a distance before it: it brakes at once, and may come to rest before
    /// the end. `None` if rounding leaves no solution.
    ///
    /// Also returns the limits of the run. `present` are those of the motion; braking under way keeps them if lines have
    /// been added that allow less.
    pub(crate) fn brake(
        &self,
        at: usize,
        start: Motion,
        (place, before): (Real, Real),
        how: (Option<Bounds>, bool),
    ) -> Option<(Course, Bounds)> {
        // If it does not fit, as far as it can to the end of the run.
        self.stop(at, start, (place, before), how, false)?.map_or_else(
            |(run, own)| {
                let left = (run.length + before) - place;
                self.leave(at, start, left, (&run, own, own.slower(start.v)), (Real::ZERO, Real::ZERO))
            },
            Some,
        )
    }

    /// Plans in the same way, keeping to a fraction of the requested speeds.
    pub(crate) fn course(
        &mut self,
        at: usize,
        start: Motion,
        (place, before): (Real, Real),
        (part, present): (Real, Option<Bounds>),
    ) -> Option<(Course, Bounds)> {
        let run = self.run(at, Some(part), self.under_way(at, start, present)?, (M, false))?;
        let left = (run.length + before) - place;
        let most = self.exit(at.saturating_add(run.more), part);
        let wish = most.min(fastest_exit(start, left, &run.bounds));
        self.leave(at, start, left, (&run, run.bounds, run.bounds), (wish, most))
    }

    /// Returns the speed that a motion on line `at` reaches if it goes on as it is, and the acceleration and jerk under way.
    fn under_way(&self, at: usize, start: Motion, present: Option<Bounds>) -> Option<(Real, [Real; 2])> {
        let first = self.line(at)?;
        let (mut fastest, mut held) = (start.v, [Real::ZERO; 2]);
        if let Some(jerk) = first.bounds.jerk.filter(|_| !start.a.is_zero()) {
            let j = present.and_then(|bounds| bounds.jerk).map_or(jerk.j, |own| own.j.min(jerk.j));
            held = [start.a - start.a.scaled(-20), j - j.scaled(-20)];
            if start.up {
                // When the acceleration is back at 0.
                fastest = start.v + (start.a.squared() / j).half();
            }
        }
        Some((fastest, held))
    }

    /// Plans a stop on one curve, over as many lines as it takes: lines that allow about the same or, with `any`, lines that may
    /// allow other accelerations, within the least of all of them. If it does not fit, returns the longest run that there is,
    /// with the limits on it.
    pub(crate) fn stop(
        &self,
        at: usize,
        start: Motion,
        (place, before): (Real, Real),
        (present, brakes): (Option<Bounds>, bool),
        any: bool,
    ) -> Option<Result<(Course, Bounds), (Run, Bounds)>> {
        let under_way = self.under_way(at, start, present)?;
        // With the limits of no more lines than the stop takes.
        let mut run = self.run(at, None, under_way, (0, any))?;
        let mut own = run.bounds;
        for _ in 0..M {
            own = present.filter(|_| brakes).map_or(run.bounds, |least| run.bounds.or_higher(&least));
            let Ok(curve) = plan(start, Goal::Speed(Real::ZERO), &own) else { break };
            let way = (place + curve.way()) - before;
            if curve.way() <= ((run.length + before) - place) + SLACK {
                // Rounding must not let it begin a line behind the run.
                let (end, rest) = self.locate(at, way, at.saturating_add(run.more));
                let whole = self.line(end).is_some_and(|line| line.cut || line.length <= rest + SLACK);
                let more = end.saturating_sub(at);
                return Some(Ok((Course { curve, exit: Real::ZERO, wish: Real::ZERO, whole, more }, own)));
            }
            let (end, _) = self.locate(at, way, self.len);
            let most = end.saturating_sub(at).max(run.more.saturating_add(1));
            let more = self.run(at, None, under_way, (most, any))?;
            if more.more == run.more {
                break;
            }
            run = more;
        }
        Some(Err((run, own)))
    }

    /// Plans over the rest of a run, within `bounds`, to a speed at its end; if that is not possible, to the nearest one that is.
    /// `own` and `wish` go into the course.
    fn leave(
        &self,
        at: usize,
        start: Motion,
        left: Real,
        (run, own, bounds): (&Run, Bounds, Bounds),
        (speed, wish): (Real, Real),
    ) -> Option<(Course, Bounds)> {
        let last = at.saturating_add(run.more);
        let leave = self.line(last)?.leave;
        let to = |exit| {
            let curve = plan(start, Goal::At(left, exit), &bounds).ok()?;
            Some((Course { curve, exit, wish, whole: true, more: run.more }, own))
        };
        if leave.is_some() {
            return leave.and_then(to);
        }
        to(speed).or_else(|| {
            let most = self.most(last);
            let slowest = slowest_exit(start, left, speed, &bounds).min(most);
            [slowest, most, Real::ZERO].into_iter().find_map(to)
        })
    }

    /// Returns the line that lies a distance beyond the start of line `at`, at most line `last`, and the place on it.
    pub(crate) fn locate(&self, at: usize, mut way: Real, last: usize) -> (usize, Real) {
        let last = last.min(self.len.saturating_sub(1));
        for i in at..last {
            let Some(line) = self.line(i) else { break };
            if way <= line.length {
                return (i, way);
            }
            way = way - line.length;
        }
        (last, way)
    }

    /// Plans from the start of line `at`, at a speed, keeping to a fraction of the requested speeds. If rounding leaves no
    /// solution, it continues at that speed.
    pub(crate) fn begin(&mut self, at: usize, speed: Real, part: Real) -> Option<(Course, Bounds)> {
        let course = self.course(at, Motion::steady(speed), (Real::ZERO, Real::ZERO), (part, None));
        course.or_else(|| self.steady(at, speed))
    }

    /// Plans in the same way, braking at once.
    pub(crate) fn begin_to_brake(&self, at: usize, speed: Real) -> Option<(Course, Bounds)> {
        let course = self.brake(at, Motion::steady(speed), (Real::ZERO, Real::ZERO), (None, false));
        course.or_else(|| self.steady(at, speed))
    }

    /// Continues along line `at` at a speed.
    fn steady(&self, at: usize, speed: Real) -> Option<(Course, Bounds)> {
        let line = self.line(at)?;
        let mut curve = Curve::new();
        curve.cruise(speed, line.length);
        Some((Course { curve, exit: speed, wish: speed, whole: true, more: 0 }, line.bounds))
    }

    /// Returns the line, and the place on it, where a stop ends that has a given speed at the start of line `at`; and how long
    /// it takes from there.
    pub(crate) fn end_of_stop(&self, mut at: usize, mut speed: Real) -> ((usize, Real), Real) {
        let mut time = Real::ZERO;
        while let Some((Course { curve, exit, more, .. }, _)) = self.begin_to_brake(at, speed) {
            time = time + curve.time;
            if exit.is_zero() {
                return (self.locate(at, curve.way(), at.saturating_add(more)), time);
            }
            (at, speed) = (at.saturating_add(more).saturating_add(1), exit);
        }
        let last = self.len.saturating_sub(1);
        ((last, self.line(last).map_or(Real::ZERO, |line| line.length)), time)
    }

    /// Returns the speed at which line `at` is to end so that all lines after it can slow down in time; worked out from the
    /// last line back, unless it is known since the lines last changed.
    pub(crate) fn exit(&mut self, at: usize, part: Real) -> Real {
        if part != self.part {
            self.part = part;
            self.changed();
        }
        let (edition, mut found, mut count) = (self.edition, [(0, Real::ZERO); M], 0_usize);
        let known = |line: &Line<N>| (line.edition == edition).then_some(line.enter);
        let speed = self.slow_down(at, (part, greatest), known, |found_at, speed| {
            if let Some(place) = found.get_mut(count) {
                *place = (found_at, speed);
                count = count.saturating_add(1);
            }
        });
        for (at, enter) in found.into_iter().take(count) {
            let place = self.first.wrapping_add(at).checked_rem(M).and_then(|at| self.lines.get_mut(at));
            if let Some(Some(line)) = place {
                (line.enter, line.edition) = (enter, edition);
            }
        }
        speed
    }

    /// Returns the greatest speed at which line `at` may end, whatever was requested: one from which each run that follows
    /// can be
    /// left at its corner's speed or, which takes less distance than some speeds between, come to rest at its end.
    fn most(&self, at: usize) -> Real {
        let fastest = |to, n, bounds: &Bounds| greatest(to, n, bounds).max(greatest(Real::ZERO, n, bounds));
        self.slow_down(at, (Real::HUGE, fastest), |_| None, |_, _| {})
    }

    /// `known` is the speed at the start of a line if that is known; `each` takes those that are worked out.
    fn slow_down(
        &self,
        at: usize,
        (part, fastest): (Real, impl Fn(Real, Real, &Bounds) -> Real),
        known: impl Fn(&Line<N>) -> Option<Real>,
        mut each: impl FnMut(usize, Real),
    ) -> Real {
        let (mut runs, mut next, mut speed) = ([(0, Run::NONE); M], at.saturating_add(1), Real::ZERO);
        for place in &mut runs {
            if let Some(known) = self.line(next).and_then(&known) {
                speed = known;
                break;
            }
            let Some(run) = self.run(next, Some(part), (Real::ZERO, [Real::ZERO; 2]), (M, false)) else { break };
            *place = (next, run);
            next = next.saturating_add(run.more).saturating_add(1);
        }
        for (at, run) in runs.iter().rev().filter(|(at, _)| *at > 0) {
            if let (Some(before), Some(line)) = (self.line(at.wrapping_sub(1)), self.line(*at)) {
                let most = line.corner.min(before.speed(part)).min(run.bounds.v);
                speed = fastest(speed, run.length, &run.bounds).min(most);
                each(*at, speed);
            }
        }
        speed
    }
}
