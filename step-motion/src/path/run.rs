//! Runs of lines that one curve covers, and the plans along them.
//!
//! A jerk-limited curve has acceleration 0 at both ends. So that it need not be 0 at every joint, lines with nearly the
//! same limits, whose corners need no lower speed, form a run: one curve leads along all of them.

mod alike;
mod entries;

use super::{Ahead, Course, Path};
use crate::curve::Curve;
use crate::limits::Bounds;
use crate::planner::{Goal, Motion, SLACK, fastest_exit, plan, slower_exit, slowest_exit};
use crate::real::Real;

pub(crate) use alike::Run;
use alike::{Kind, allowed};

#[cfg(test)]
mod tests;

/// How runs of fewer lines are found, and the limits of a brake under way.
#[derive(Debug, Clone, Copy)]
struct Shorter {
    kind: Kind,
    how: (Option<Bounds>, bool),
}

impl<const N: usize, const M: usize> Path<N, M> {
    /// Returns the run that begins at line `at`; it has at most `most` lines after the first one.
    fn run(&self, at: usize, kind: Kind, most: usize) -> Option<Run> {
        let mut run = self.single(at, kind)?;
        self.lengthen(at, &mut run, kind, most);
        Some(run)
    }

    /// Returns a run of one line, and of what is left of the line before.
    fn single(&self, at: usize, Kind { part, early, .. }: Kind) -> Option<Run> {
        let line = self.line(at)?;
        let bounds = Bounds { v: allowed(line, part), ..line.bounds };
        let mut run = Run::of(line.length, bounds);
        if !early.is_zero() {
            self.slow_before(&mut run, early);
        }
        Some(run)
    }

    /// Lowers the limits of a run to those of the line before, and its speed.
    #[cold]
    fn slow_before(&self, run: &mut Run, most: Real) {
        if let Some(passed) = &self.passed {
            *run = Run::of(run.length, passed.lower(&run.bounds, most));
        }
    }

    /// Adds lines to a run that begins at line `at`, up to `most` after the first one.
    fn lengthen(&self, at: usize, run: &mut Run, kind: Kind, most: usize) {
        let Some(mut last) = self.line(at.saturating_add(run.more)) else { return };
        while run.more < most && !last.cut && last.leave.is_none() {
            let next = at.saturating_add(run.more).saturating_add(1);
            let Some(line) = self.line(next).filter(|line| run.add(line, kind)) else { break };
            last = line;
        }
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
        let (run, own) = match self.stop(at, start, (place, before), how, None)? {
            Ok(course) => return Some(course),
            Err(run) => run,
        };
        // It does not fit: as far as it can to the end of the run.
        let left = (run.length + before) - place;
        let shorter = Shorter { kind: self.under_way(at, (start, before), (None, how.0))?, how };
        let limits = (&run, own, own.slower(start.v));
        self.leave(at, start, left, limits, (Real::ZERO, Real::ZERO), shorter)
    }

    /// Returns the limits of a brake on a run: on a single line braking under way keeps its own if these are higher. Other lines may
    /// not allow those.
    fn own(run: &Run, (present, brakes): (Option<Bounds>, bool)) -> Bounds {
        present.filter(|_| brakes && run.more == 0).map_or(run.bounds, |least| run.bounds.or_higher(&least))
    }

    /// Plans in the same way, keeping to a fraction of the requested speeds.
    pub(crate) fn course(
        &mut self,
        at: usize,
        start: Motion,
        from: (Real, Real),
        how: (Real, Option<Bounds>),
    ) -> Option<(Course, Bounds)> {
        let (run, left, speeds) = self.goal(at, start, from, how)?;
        let kind = self.under_way(at, (start, from.1), (Some(how.0), how.1))?;
        let shorter = Shorter { kind, how: (None, false) };
        self.leave(at, start, left, (&run, run.bounds, run.bounds), speeds, shorter)
    }

    /// Plans a motion again that has a course already, after lines have been added. `None` if that would lead along more
    /// lines, and within their limits it cannot slow down in time: the course that it has is still right.
    pub(crate) fn better_course(
        &mut self,
        at: usize,
        start: Motion,
        from: (Real, Real),
        how: (Real, Option<Bounds>),
    ) -> Option<(Course, Bounds)> {
        let (run, left, speeds) = self.goal(at, start, from, how)?;
        self.lead(at, start, left, (&run, run.bounds, run.bounds), speeds)
    }

    /// Does a slice of the look-ahead for a course from a motion on the first line. Returns whether there is more of it.
    pub(crate) fn has_to_find(&mut self, from: (Motion, Real), (part, present): (Real, Option<Bounds>)) -> bool {
        let run = self.under_way(0, from, (Some(part), present)).and_then(|kind| self.run(0, kind, M));
        run.is_some_and(|run| self.find_exit(run.more, part, 1).is_none())
    }

    /// Returns the run that a course leads along, what is left of it, and the speed at its end: the one to plan for, and the
    /// one that the later lines ask for.
    fn goal(
        &mut self,
        at: usize,
        start: Motion,
        (place, before): (Real, Real),
        (part, present): (Real, Option<Bounds>),
    ) -> Option<(Run, Real, (Real, Real))> {
        let run = self.run(at, self.under_way(at, (start, before), (Some(part), present))?, M)?;
        let left = (run.length + before) - place;
        let wish = self.exit(at.saturating_add(run.more), part);
        Some((run, left, (wish.min(fastest_exit(start, left, &run.bounds)), wish)))
    }

    /// Returns the runs for a motion on line `at`, or a distance before it: with the speed that it reaches if it goes on as it is, and
    /// its acceleration and jerk.
    fn under_way(
        &self,
        at: usize,
        (start, before): (Motion, Real),
        (part, present): (Option<Real>, Option<Bounds>),
    ) -> Option<Kind> {
        let first = self.line(at)?;
        let (mut speed, mut held) = (start.v, [Real::ZERO; 2]);
        if let Some(jerk) = first.bounds.jerk.filter(|_| !start.a.is_zero()) {
            let j = present.and_then(|bounds| bounds.jerk).map_or(jerk.j, |own| own.j.min(jerk.j));
            held = [start.a - start.a.scaled(-20), j - j.scaled(-20)];
            if start.up {
                // When the acceleration is back at 0; rounding makes it no faster than the lines.
                speed = start.v + (start.a.squared() / j).half();
                speed = speed - speed.scaled(-40);
            }
        }
        let early = self.early(start, before, &first.bounds);
        Some(Kind { part, speed, held, corner: speed, any: false, feeds: false, early })
    }

    /// Returns the greatest speed of a motion a distance before a line, if that is less than it can reach there; 0 on the line.
    fn early(&self, Motion { v, a, .. }: Motion, before: Real, bounds: &Bounds) -> Real {
        let Some(passed) = self.passed.as_ref().filter(|_| !before.is_zero()) else { return Real::ZERO };
        let most = passed.speed();
        let reached = v.squared() + (bounds.a.max(a) * before).scaled(1);
        if bounds.v > most && reached > most.squared() { most } else { Real::HUGE }
    }

    /// Plans a stop on one curve, over as many lines as it takes: lines that allow about the same or, with limits `any`, lines that may
    /// allow other accelerations, within the least of all of them but not within less than those. If it does not fit, returns the longest
    /// run that there is, with the limits on it.
    pub(crate) fn stop(
        &self,
        at: usize,
        start: Motion,
        (place, before): (Real, Real),
        how: (Option<Bounds>, bool),
        any: Option<Bounds>,
    ) -> Option<Result<(Course, Bounds), (Run, Bounds)>> {
        let kind = Kind { any: any.is_some(), ..self.under_way(at, (start, before), (None, how.0))? };
        // With the limits of no more lines than the stop takes.
        let mut run = self.single(at, kind)?;
        let (mut own, mut up_to_corner) = (run.bounds, None);
        for _ in 0..M {
            own = Self::own(&run, how);
            if any.is_some_and(|least| least.allows_more(&own)) {
                break;
            }
            let Ok(curve) = plan(start, Goal::Speed(Real::ZERO), &own) else { break };
            let way = (place + curve.way()) - before;
            let left = (run.length + before) - place;
            if curve.way() <= left + SLACK {
                if up_to_corner.is_some() && !self.is_slow_at_corners(at, &run, kind.speed, (&curve, left)) {
                    break;
                }
                // Rounding must not let it begin a line after the run.
                let (end, rest) = self.locate(at, way, at.saturating_add(run.more));
                let whole = self.line(end).is_some_and(|line| line.cut || line.length <= rest + SLACK);
                let more = end.saturating_sub(at);
                return Some(Ok((Course { curve, exit: Real::ZERO, wish: Real::ZERO, whole, more, slow: false }, own)));
            }
            let (end, _) = self.locate(at, way, self.len);
            let most = end.saturating_sub(at).max(run.more.saturating_add(1));
            let known = run.more;
            self.lengthen(at, &mut run, kind, most);
            if run.more == known {
                // The next corner is for less speed than the present one; the stop may have slowed down to that.
                up_to_corner = up_to_corner.or(Some((run, own)));
                let next = known.saturating_add(1);
                if self.line(at.saturating_add(next)).is_some_and(|line| curve.has_slowed_down(left, line.corner)) {
                    self.lengthen(at, &mut run, Kind { corner: Real::ZERO, ..kind }, next);
                }
            }
            if run.more == known {
                break;
            }
        }
        Some(Err(up_to_corner.unwrap_or((run, own))))
    }

    /// Returns whether a curve along a run, which is `left` long, passes each corner for less than `speed` as slowly as that allows.
    fn is_slow_at_corners(&self, at: usize, run: &Run, speed: Real, (curve, mut left): (&Curve, Real)) -> bool {
        (at..at.saturating_add(run.more)).rev().all(|at| {
            let Some(line) = self.line(at.saturating_add(1)) else { return false };
            left = left - line.length;
            line.corner >= speed || curve.has_slowed_down(left, line.corner)
        })
    }

    /// Plans over the rest of a run, within `bounds`, to a speed at its end; if that is not possible, to the nearest one that is.
    /// `own` and `wish` go into the course. `shorter` says how runs of fewer lines are found.
    fn leave(
        &self,
        at: usize,
        start: Motion,
        left: Real,
        limits: (&Run, Bounds, Bounds),
        (speed, wish): (Real, Real),
        shorter: Shorter,
    ) -> Option<(Course, Bounds)> {
        let to = |exit| self.lead(at, start, left, limits, (exit, wish));
        let (full, _, bounds) = &limits;
        let last = at.saturating_add(full.more);
        if self.line(last)?.leave.is_some() {
            return to(speed);
        }
        // Less than was asked for may take less distance.
        let slower = || to(slower_exit(start, left, speed, bounds)?);
        // A brake is here because no rest fits.
        let asked = if shorter.kind.part.is_some() { to(speed).or_else(slower) } else { None };
        asked.or_else(|| {
            let slowest = slowest_exit(start, left, speed, bounds);
            // Mostly it comes near a speed from which all lines are known to be slow enough in time.
            let known = self.known_exit(last).map(|known| known.max(self.promised(last)));
            // A line that allows less may have come into the run: what was promised before, or a rest, can be kept without it.
            let without = |run: &Run| {
                let own = Self::own(run, shorter.how);
                let bounds = if shorter.kind.part.is_none() { own.slower(start.v) } else { own };
                let promised = self.promised(at.saturating_add(run.more));
                if promised.is_zero() && !own.allows_more(&limits.1) {
                    return None;
                }
                let left = left - (full.length - run.length);
                let exit =
                    if promised.is_zero() { promised } else { slowest_exit(start, left, speed, &bounds).min(promised) };
                self.lead(at, start, left, (run, own, bounds), (exit, wish))
            };
            let keeps = known.and_then(|known| to(slowest.min(known)));
            let longer = || self.longer(at, start, left, (full, shorter.kind));
            let shorter = || self.shorter(at, shorter.kind, full.more);
            keeps.or_else(|| shorter().iter().rev().flatten().find_map(without)).or_else(longer).or_else(|| {
                let most = self.most(last);
                [slowest.min(most), most, Real::ZERO].into_iter().find_map(to)
            })
        })
    }

    /// Plans over a run of more lines, as few as possible, at whatever speed they are requested: within the least of them, because the
    /// next line can only be slow enough if the motion slows down over all of these.
    fn longer(&self, at: usize, start: Motion, left: Real, (full, kind): (&Run, Kind)) -> Option<(Course, Bounds)> {
        kind.part?;
        let kind = Kind { feeds: true, ..kind };
        let mut run = self.single(at, kind)?;
        for more in full.more.saturating_add(1)..M {
            self.lengthen(at, &mut run, kind, more);
            if run.more < more {
                return None;
            }
            let left = (left + run.length) - full.length;
            let last = at.saturating_add(more);
            let known = self.known_exit(last).unwrap_or(Real::ZERO);
            let exit = slowest_exit(start, left, known, &run.bounds).min(known.max(self.promised(last)));
            let to = |exit| self.lead(at, start, left, (&run, run.bounds, run.bounds), (exit, exit));
            if let Some((course, bounds)) = to(exit).or_else(|| to(Real::ZERO)) {
                return Some((Course { slow: true, ..course }, bounds));
            }
        }
        None
    }

    /// Returns the runs of fewer lines, the shortest first.
    fn shorter(&self, at: usize, kind: Kind, than: usize) -> [Option<Run>; M] {
        let mut runs = [None; M];
        let mut run = self.single(at, kind);
        for (more, place) in runs.iter_mut().take(than).enumerate() {
            if let Some(run) = &mut run {
                self.lengthen(at, run, kind, more);
            }
            *place = run;
        }
        runs
    }

    /// Plans in the same way to this speed only; after a run where a stop leaves a line, to the speed of that stop.
    fn lead(
        &self,
        at: usize,
        start: Motion,
        left: Real,
        (run, own, bounds): (&Run, Bounds, Bounds),
        (speed, wish): (Real, Real),
    ) -> Option<(Course, Bounds)> {
        let exit = self.line(at.saturating_add(run.more))?.leave.unwrap_or(speed);
        let curve = plan(start, Goal::At(left, exit), &bounds).ok()?;
        Some((Course { curve, exit, wish, whole: true, more: run.more, slow: false }, own))
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

    /// Plans from the start of line `at`, at a speed, keeping to a fraction of the requested speeds. If it can only come to rest,
    /// over more lines than those that allow this fraction of the speed, it brakes.
    pub(crate) fn begin(&mut self, at: usize, speed: Real, part: Real) -> Option<(Course, Bounds)> {
        let course = self.course(at, Motion::steady(speed), (Real::ZERO, Real::ZERO), (part, None));
        course.or_else(|| self.begin_to_brake(at, speed))
    }

    /// Plans from the start of line `at`, at a speed, braking at once. If that leaves no solution, it gets as slow as it can.
    pub(crate) fn begin_to_brake(&self, at: usize, speed: Real) -> Option<(Course, Bounds)> {
        let course = self.brake(at, Motion::steady(speed), (Real::ZERO, Real::ZERO), (None, false));
        course.or_else(|| self.slow_down(at, speed))
    }

    /// Slows down along line `at` from a speed as far as it can; if rounding leaves no solution, continues at that speed.
    fn slow_down(&self, at: usize, speed: Real) -> Option<(Course, Bounds)> {
        let line = self.line(at)?;
        let (start, bounds) = (Motion::steady(speed), line.bounds.slower(speed));
        let exit = line.leave.unwrap_or(slowest_exit(start, line.length, Real::ZERO, &bounds));
        let (curve, exit) = plan(start, Goal::At(line.length, exit), &bounds).map_or_else(
            |_| {
                let mut curve = Curve::new();
                curve.cruise(speed, line.length);
                (curve, speed)
            },
            |curve| (curve, exit),
        );
        Some((Course { curve, exit, wish: exit, whole: true, more: 0, slow: false }, line.bounds))
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
}
