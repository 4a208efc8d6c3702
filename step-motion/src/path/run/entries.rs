//! How fast runs may begin, so that all lines after them can slow down in time.

use super::alike::Kind;
use super::{Ahead, Path, Run};
use crate::planner::greatest;
use crate::real::Real;

impl<const N: usize, const M: usize> Path<N, M> {
    /// Returns the speed at which line `at` is to end so that all lines after it can slow down in time.
    pub(crate) fn exit(&mut self, at: usize, part: Real) -> Real {
        self.find_exit(at, part, usize::MAX).unwrap_or(Real::ZERO)
    }

    /// Does the same, or a slice of it: finds up to `most` runs and speeds. What was found before holds on, unless a line that was
    /// added changes it: a new line changes the last run, and the speeds from there back to one that stays the same.
    pub(crate) fn find_exit(&mut self, at: usize, part: Real, mut most: usize) -> Option<Real> {
        if part != self.part {
            self.part = part;
            self.times.other_part();
        }
        let (mut runs, mut len, mut next) = ([0; M], 0, at.saturating_add(1));
        while let (Some(place), Some(line)) = (runs.get_mut(len), self.line(next)) {
            if line.ahead.entry(self.times).is_some() {
                break;
            }
            (*place, len) = (next, len.saturating_add(1));
            let more = if let Some(more) = line.ahead.run(self.times) {
                more
            } else {
                most = most.checked_sub(1)?;
                self.find_run(next, part)?
            };
            next = next.saturating_add(more).saturating_add(1);
        }
        let mut speed = self.known(next).unwrap_or(Real::ZERO);
        for at in runs.get(..len)?.iter().rev() {
            let entry = if let Some(entry) = self.line(*at)?.ahead.entry_to(speed) {
                entry
            } else {
                most = most.checked_sub(1)?;
                self.entry(*at, &self.run_from(*at, part)?, speed)
            };
            let times = self.times;
            self.ahead(*at)?.know_entry(speed, entry, times);
            speed = entry;
        }
        Some(speed)
    }

    /// Finds how far a run ahead leads, and keeps it.
    fn find_run(&mut self, at: usize, part: Real) -> Option<usize> {
        let more = self.run_from(at, part)?.more;
        let open = self.line(at.saturating_add(more).saturating_add(1)).is_none();
        let times = self.times;
        self.ahead(at)?.know_run(more, open, times);
        Some(more)
    }

    fn ahead(&mut self, at: usize) -> Option<&mut Ahead> {
        let at = self.first.wrapping_add(at).checked_rem(M)?;
        Some(&mut self.lines.get_mut(at)?.as_mut()?.ahead)
    }

    /// Returns the speed at the end of line `at` if it is known, or follows from what is known.
    pub(super) fn known_exit(&self, at: usize) -> Option<Real> {
        let next = at.saturating_add(1);
        self.known(next).or_else(|| {
            let run = self.run_from(next, self.part)?;
            let speed = self.known(next.saturating_add(run.more).saturating_add(1))?;
            Some(self.entry(next, &run, speed))
        })
    }

    /// Returns the greatest speed at the end of line `at` that was found since lines have only been added.
    pub(super) fn promised(&self, at: usize) -> Real {
        self.line(at.saturating_add(1)).map_or(Real::ZERO, |line| line.ahead.promised(self.times))
    }

    /// Returns the speed at the start of line `at`, or after the last one, if it is known.
    pub(super) fn known(&self, at: usize) -> Option<Real> {
        self.line(at).map_or(Some(Real::ZERO), |line| line.ahead.entry(self.times))
    }

    /// Returns the greatest speed at which a run may begin that is to end at a speed.
    fn entry(&self, at: usize, run: &Run, exit: Real) -> Real {
        greatest(exit, run.length, &run.bounds).min(self.allowed(at, run, self.part))
    }

    /// Returns the greatest speed at which line `at` may end, whatever was requested: one from which each run that follows
    /// can be left at its corner's speed or, which takes less distance than some speeds between, come to rest at its end.
    pub(super) fn most(&self, at: usize) -> Real {
        let (mut runs, mut next, mut speed) = ([(0, Run::NONE); M], at.saturating_add(1), Real::ZERO);
        for place in &mut runs {
            let Some(run) = self.run_from(next, Real::HUGE) else { break };
            let most = self.allowed(next, &run, Real::HUGE);
            if self.known(next).is_some_and(|known| known >= most) {
                speed = most;
                break;
            }
            *place = (next, run);
            next = next.saturating_add(run.more).saturating_add(1);
        }
        for (at, run) in runs.iter().rev().filter(|(at, _)| *at > 0) {
            let (Run { length, bounds, .. }, most) = (run, self.allowed(*at, run, Real::HUGE));
            let fastest = greatest(speed, *length, bounds);
            // Only to a speed below 0.618 of it can slowing down take more distance than coming to rest.
            let or_rest = fastest < most && speed + speed.half() < fastest;
            speed = if or_rest { fastest.max(greatest(Real::ZERO, *length, bounds)) } else { fastest }.min(most);
        }
        speed
    }

    /// Returns the run that begins at line `at`, from the corner before it, at a fraction of the requested speeds.
    pub(super) fn run_from(&self, at: usize, part: Real) -> Option<Run> {
        self.run(
            at,
            Kind {
                part: Some(part),
                speed: Real::ZERO,
                held: [Real::ZERO; 2],
                corner: Real::ZERO,
                any: false,
                feeds: false,
                early: Real::ZERO,
            },
            M,
        )
    }

    /// Returns the greatest speed at the start of a run that its corner and the lines on both sides allow.
    fn allowed(&self, at: usize, run: &Run, part: Real) -> Real {
        let before = self.line(at.wrapping_sub(1)).map_or(Real::ZERO, |before| before.speed(part));
        let corner = self.line(at).map_or(Real::ZERO, |line| line.corner);
        corner.min(before).min(run.bounds.v)
    }
}
