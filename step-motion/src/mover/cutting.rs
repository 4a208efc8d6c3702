//! Cuts the steps of an axis into stretches, for [`Axis`](crate::Axis), which decides when a request is planned.

use crate::cutter::{Cut, Demand, Slice};
use crate::phases::Phases;
use crate::real::Real;
use crate::stepper::tick;
use servowire_core::Direction;

use super::planning::Begin;
use super::runner::Runner;

/// A request that is not planned yet; of two, the greater one counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum News {
    None,
    /// A request that a stop in progress ignores.
    Change,
    /// Another aim.
    Aim,
    /// A quick stop.
    Quick,
}

impl Runner {
    /// Prepares the mover for [`cut`](Self::cut) in place of [`pulse`](Self::pulse).
    pub(crate) const fn cutting(self) -> Self {
        Self { cuts: true, ..self }
    }

    /// Returns the next steps as a stretch, if they begin before a tick; use it in place of [`pulse`](Self::pulse).
    pub(crate) fn cut(&mut self, demand: &Demand, until: u64) -> Cut {
        let Some(due) = self.due else { return Cut::Rest };
        if due >= until {
            return Cut::Later;
        }
        let (Phases { curve, frame }, cutter) = (&self.phases, &mut self.stepper.cutter);
        let next = self.left.take().map_or_else(|| cutter.slice(curve, frame, demand), Slice::Steps);
        let stretch = match next {
            Slice::Steps(stretch) => stretch,
            Slice::More => return Cut::More,
            Slice::End => {
                self.due = None;
                return Cut::Rest;
            }
        };
        let first = tick(stretch.first);
        if first >= until {
            (self.due, self.left) = (Some(first.max(self.free)), Some(stretch));
            return Cut::Later;
        }
        let (direction, count) = (self.direction, i64::from(stretch.count));
        self.commanded = self.commanded.saturating_add(if direction.dir() { count.wrapping_neg() } else { count });
        let last = tick(stretch.last()).max(self.free);
        self.free = last.saturating_add(1);
        (self.turn, self.dir) = (None, Some(direction));
        self.due = (cutter.count() < self.all).then_some(self.free);
        Cut::Steps(stretch, direction)
    }

    /// The tick at which the present plan begins.
    pub(crate) fn begin(&self) -> u64 {
        self.phases.frame.begin.div_ceil(self.clock.moment(1))
    }

    /// The tick after the last step.
    pub(crate) const fn free(&self) -> u64 {
        self.free
    }

    /// The tick at which the present plan ends; the greatest number if it has no end.
    pub(crate) fn over(&self) -> u64 {
        if self.phases.frame.endless { u64::MAX } else { self.phases.end().div_ceil(self.clock.moment(1)) }
    }

    /// Returns whether the plan has more steps.
    pub(crate) const fn has_steps(&self) -> bool {
        self.due.is_some()
    }

    /// Returns whether steps are to come, from the present plan or one that follows it.
    pub(crate) fn has_more(&self) -> bool {
        self.due.is_some() || self.has_work()
    }

    /// Returns how the plan of a request begins, from a tick onwards, or without one the plan that follows the present one.
    /// `None` if a request changes nothing.
    pub(crate) fn pursue(&self, news: News, now: u64) -> Option<Begin> {
        match news {
            News::None if self.due.is_none() => Some(self.go_on().unwrap_or(Begin::OVER)),
            // The steps of a plan are counted in 32 bits.
            News::None if self.phases.frame.endless && self.stepper.count() >= 1 << 29 => {
                Some(self.from(self.clock.moment(self.free.saturating_sub(1))))
            }
            News::None => Some(Begin::OVER),
            News::Change => self.change(now),
            News::Aim => Some(self.from(self.moment(now))),
            News::Quick => Some(self.stop_quickly(now).unwrap_or(Begin::OVER)),
        }
    }

    /// Takes back the last steps of the present plan, as of a tick; `free` is the tick after the last step that remains. If
    /// none remains, DIR may differ.
    pub(crate) fn back_to(&mut self, steps: u32, now: u64, (free, dir): (u64, Option<Direction>)) {
        let back = i64::from(steps);
        let back = if self.direction.dir() { back } else { back.wrapping_neg() };
        self.commanded = self.commanded.saturating_add(back);
        (self.free, self.dir) = (free, dir);
        self.due = Some(now.saturating_add(1).max(free));
    }

    /// Halves the greatest speed until there are other limits. Returns whether a step a second is left of it.
    pub(crate) fn slow_down(&mut self) -> bool {
        let least = Real::ONE / Real::new(self.clock.moments().into());
        let enough = self.bounds.v.half() >= least;
        if enough {
            self.bounds = self.bounds.slower(self.bounds.v.half());
        }
        enough
    }

    /// Takes over the requests made to another mover.
    pub(crate) const fn wish_as(&mut self, other: &Self) {
        (self.aim, self.requests, self.quick) = (other.aim, other.requests, other.quick);
    }

    /// Records that the axis has been at rest at a position since a tick, after a stop that was not requested.
    pub(crate) fn rest_at(&mut self, position: i64, now: u64) {
        (self.commanded, self.due) = (position, None);
        self.requests.stopped();
        self.free = now.saturating_add(1);
        self.rest(self.clock.moment(now));
    }

    /// Records a halt at a position; DIR may have changed since the last step, and that may have been made just before.
    pub(crate) fn halt_at(&mut self, position: i64, now: u64, was_moving: bool) {
        (self.commanded, self.dir, self.free) = (position, None, now);
        self.stand(now, was_moving);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mover;
    use crate::limits::{Clock, Limits};

    /// More steps than 32 bits count, without a stop or a change of speed.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn a_run_has_no_end() {
        let limits = Limits::new(400_000, 8_000_000).unwrap();
        let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
        mover.runner = mover.runner.cutting();
        mover.runner.ask_run(Direction::Forward, 400_000, None);
        mover.follow(mover.runner.pursue(News::Aim, 0));
        let demand = Demand { off: Clock::MICROSECONDS.blur(), coarse: None, time: u64::MAX, searches: 2 };
        let (mut last, interval) = (None, 5_i128 << 31);
        while mover.commanded() < 3 << 32 {
            mover.follow(mover.runner.pursue(News::None, 0));
            match mover.runner.cut(&demand, u64::MAX) {
                Cut::Steps(stretch, direction) => {
                    let gap = last.map(|last: i128| stretch.first - last);
                    assert!(gap.is_none_or(|gap| mover.commanded() < 20_000 || gap.abs_diff(interval) < 1 << 32));
                    assert_eq!(direction, Direction::Forward);
                    last = Some(stretch.last());
                }
                Cut::More => {}
                other => panic!("{other:?} at {}", mover.commanded()),
            }
        }
    }
}
