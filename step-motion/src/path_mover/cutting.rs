//! Runs the lines in stretches of steps, for [`Axes`](crate::Axes), which decides when they are cut and when a line is added.

use servowire_core::Direction;

use crate::cutter::{Cut, Demand, Slice};
use crate::error::Error;
use crate::line::{Line, LinePulses, Steps};
use crate::requests::Requests;
use crate::stepper::tick;

use super::PathMover;

/// Half a tick, in times.
const HALF: i128 = 1 << 31;

impl<const N: usize, const M: usize> PathMover<N, M> {
    /// Prepares the mover for [`cut`](Self::cut) in place of [`pulse`](Self::pulse).
    pub(crate) const fn cutting(self) -> Self {
        Self { steps: Steps::Stretches, ..self }
    }

    /// Leaves so many ticks before a step for DIR, if half of the axis's pause is not less.
    pub(crate) const fn set_lead(&mut self, ticks: u32) {
        self.lead = ticks;
    }

    /// Does a slice of the work for the next steps of an axis that fall before a tick, in place of [`pulse`](Self::pulse).
    pub(crate) fn cut(&mut self, at: usize, demand: &Demand, until: u64) -> Cut {
        if self.ended {
            self.ended = self.go_over(0);
            return Cut::More;
        }
        self.cut_line(at, demand, until).unwrap_or(Cut::Later)
    }

    /// Does the same on the present line; `None` if the axis has no step there before that tick.
    fn cut_line(&mut self, at: usize, demand: &Demand, until: u64) -> Option<Cut> {
        let line = self.line.as_mut()?;
        let due = line.due.get_mut(at)?;
        let left = self.left.get_mut(at)?;
        let soonest = (*due)?;
        let stretch = match left.take().map_or_else(|| line.slice(at, demand), Slice::Steps) {
            Slice::Steps(stretch) => stretch,
            Slice::More => return Some(Cut::More),
            Slice::End => {
                line.set_due(at, None);
                return None;
            }
        };
        let first = tick(stretch.first).max(soonest);
        if first >= until {
            *left = Some(stretch);
            line.set_due(at, Some(first));
            return None;
        }
        let (stretch, later) = stretch.split((i128::from(until) << 32).saturating_sub(HALF));
        *left = later;
        let free = tick(stretch.last()).max(first).saturating_add(1);
        line.set_due(at, (later.is_some() || line.has_more(at)).then_some(free));
        let direction = line.directions.get(at).copied()?;
        if let (Some(made), Some(own), Some(position)) =
            (self.made.get_mut(at), self.free.get_mut(at), self.commanded.get_mut(at))
        {
            (*made, *own) = (made.saturating_add(stretch.count.into()), free);
            let count = i64::from(stretch.count);
            *position = position.saturating_add(if direction.dir() { count.wrapping_neg() } else { count });
        }
        self.ended = line.first().is_none();
        Some(Cut::Steps(stretch, direction))
    }

    /// The tick of the last step of each axis.
    pub(crate) fn last_steps(&self) -> [u64; N] {
        self.free.map(|free| free.saturating_sub(1))
    }

    /// The direction of the next step of an axis, if that is on the present line.
    pub(crate) fn direction(&self, at: usize) -> Option<Direction> {
        let line = self.line.as_ref()?;
        line.due.get(at)?.and(line.directions.get(at).copied())
    }

    /// The tick at which the present plan ends.
    pub(crate) fn over(&self) -> u64 {
        let over = self.line.as_ref().map_or(self.path.start().moment, LinePulses::over);
        over.div_ceil(self.clock().moment(1))
    }

    /// Returns the line that a push would add, if the mover is [ready](Self::ready) for it.
    pub(crate) fn line_to(&self, target: [i64; N], feed: u32) -> Result<Option<Line<N>>, Error> {
        self.path.line_to(target, feed)
    }

    /// Does the same as [`push`](Self::push) with a line that [`line_to`](Self::line_to) has returned, but the present motion
    /// ignores the line until [`look_ahead`](Self::look_ahead) is called.
    pub(crate) fn append(&mut self, line: Option<Line<N>>, target: [i64; N], now: u64) {
        if let Some(line) = line {
            self.path.add(line, target);
        }
        self.requests.go_later();
        if self.line.is_none() {
            self.replan(now);
        }
    }

    /// Returns whether a line of another mover would be the same here.
    pub(crate) fn ends_as(&self, other: &Self) -> bool {
        self.path.ends_as(&other.path)
    }

    /// Records a request, which [`replan`](Self::replan) follows. Returns whether it changes anything.
    pub(crate) fn ask(&mut self, ask: impl FnOnce(&mut Requests)) -> bool {
        let before = self.requests;
        ask(&mut self.requests);
        !self.requests.are_as(before)
    }

    /// Returns whether there are lines, and nothing holds them.
    pub(crate) const fn has_work(&self) -> bool {
        !self.path.is_empty() && !self.requests.brakes()
    }

    /// Does a slice of the work for [`look_ahead`](Self::look_ahead), and for a stop on these lines; or, `asked` at a tick, for
    /// [`replan`](Self::replan). Returns whether there is more of it.
    pub(crate) fn has_to_find(&mut self, asked: Option<u64>) -> bool {
        if let (Some(now), Some(part)) = (asked, self.requests.part()) {
            if let Some((motion, start)) = self.here(now) {
                return self.path.has_to_find((motion, start.before), (part, self.bounds));
            }
        }
        let at = if self.line.is_some() { self.more } else { 0 };
        let part = self.requests.part().unwrap_or(self.path.part());
        self.path.find_exit(at, part, 1).is_none()
    }

    /// Takes over the requests to hold, or to go on, of another mover.
    pub(crate) const fn hold_as(&mut self, other: Requests) {
        self.requests.hold_as(other);
    }

    /// Continues as another mover would, from a rest after a stop that was not requested.
    pub(crate) fn go_on_as(&mut self, other: &Self, now: u64) {
        self.requests.hold_as(other.requests);
        self.replan(now);
    }

    /// Makes no further step, because of a halt whose position is not known yet.
    pub(crate) fn halt_before(&mut self, now: u64) {
        self.requests.halt();
        self.stand(now, self.due().is_some());
    }

    /// Records a halt at a position. The last step of any axis may have been made just before.
    pub(crate) fn halt_at(&mut self, commanded: [i64; N], now: u64, was_moving: bool) {
        (self.commanded, self.free) = (commanded, [now; N]);
        self.stand(now, was_moving);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::{Clock, Limits};
    use crate::path::{AxisSetup, Path};

    /// The interrupt makes a step in the tick that is nearest to its time. All steps whose tick is before the end of a block are in it,
    /// and no others, wherever it ends.
    #[test]
    fn a_step_belongs_to_the_block_of_its_tick() {
        for apart in 1..8 {
            let axis = AxisSetup::new(Limits::new(300_000, 1 << 30).unwrap(), 1_000_000);
            let path = Path::<1, 4>::new(Clock::MICROSECONDS, [axis], 20).unwrap();
            let demand = Demand { off: path.clock().blur(), coarse: None, time: u64::MAX, searches: 2 };
            let mut mover = PathMover::new(path).cutting();
            mover.push([2000], 1_000_000, 0).unwrap();
            let mut begin = 0;
            while mover.commanded() != [2000] {
                let until = begin + apart;
                loop {
                    match mover.cut(0, &demand, until) {
                        Cut::Steps(stretch, _) => {
                            let ticks = [stretch.first, stretch.last()].map(tick);
                            assert!(begin <= ticks[0] && ticks[1] < until, "{ticks:?} in {begin}..{until}");
                        }
                        Cut::More => {}
                        Cut::Later | Cut::Rest => break,
                    }
                }
                begin = until;
            }
        }
    }
}
