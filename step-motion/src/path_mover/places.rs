//! Where the axes are, for a cyclic master: on the line, and where they are not on it yet, or no more. The next line is the first one from
//! the last step of a line on, half a step before its end; and a stop ends between steps, while a line begins at whole ones.

use crate::curve::Piece;
use crate::line::Steps;
use crate::path::AxisSetup;
use crate::phases::fine;
use crate::places::{between, gap, since};
use crate::plan::Setpoint;
use crate::real::Real;

use super::PathMover;

/// What is left of the lines that have ended.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Behind<const N: usize> {
    /// Positions at its start and its end, in 2^-32 steps, and the distance between them.
    from: [i64; N],
    to: [i64; N],
    way: Real,
    /// How that is covered from a moment to another, unless the curve of the first line leads along it.
    motion: Piece,
    begin: u64,
    end: u64,
    /// When all axes are at whole steps after it; 0 if they are there at its end. No line begins before that.
    pub(super) over: u64,
}

impl<const N: usize> Behind<N> {
    /// Nothing, at positions in 2^-32 steps from a moment on.
    const fn nothing(at: [i64; N], moment: u64) -> Self {
        let (way, motion) = (Real::ZERO, Piece::steady(Real::ZERO));
        Self { from: at, to: at, way, motion, begin: moment, end: moment, over: 0 }
    }

    /// Nothing, at a position in steps.
    pub(super) fn rest(steps: [i64; N]) -> Self {
        Self::nothing(steps.map(fine), 0)
    }
}

impl<const N: usize, const M: usize> PathMover<N, M> {
    /// Returns position, speed, acceleration and jerk of each axis at a tick that is not before the last step. The position does not
    /// jump, whatever is asked for: an axis that a stop or a halt has left between two steps goes on to the last step that was made, at
    /// its greatest speed, and what follows begins after that.
    pub fn at(&self, now: u64) -> [Setpoint; N] {
        self.places(self.clock().moment(now))
    }

    fn places(&self, moment: u64) -> [Setpoint; N] {
        let (clock, line) = (self.clock(), self.line.as_ref());
        let mut states = [Setpoint::at_rest(0); N];
        if let Some(line) = line.filter(|line| line.has_begun(moment)) {
            let own = line.axes.iter().zip(line.directions).zip(self.origin);
            for (state, (((frame, _), direction), origin)) in states.iter_mut().zip(own) {
                *state = Setpoint::new(clock, frame.unrounded(&line.curve, moment)).on_axis(origin, direction);
            }
            return states;
        }
        let Behind { from, to, way, motion, begin, end, .. } = self.behind;
        let there = line.and_then(|line| line.before(moment, way));
        let there = there.or_else(|| (moment < end).then(|| motion.after(since(begin, moment))));
        let whole = line.map_or(self.commanded, |_| self.origin).map(fine);
        let own = from.into_iter().zip(to).zip(whole).zip(self.path.axes());
        for (state, (((from, to), whole), axis)) in states.iter_mut().zip(own) {
            *state = if let Some(there) = &there {
                between(clock, (from, to), way, there)
            } else {
                let there = Piece::steady(self.fastest(axis)).after(since(end, moment));
                between(clock, (to, whole), gap(to, whole), &there)
            };
        }
        states
    }

    /// Keeps what is left of the first line, whose last step has been made, from a step or a request at a tick on.
    pub(super) fn leave_behind(&mut self, now: u64) {
        let (Some(line), Some(first), Steps::Single) = (&self.line, self.path.line(0), self.steps) else { return };
        let begin = self.clock().moment(self.tick(now));
        let from = self.positions(begin);
        if self.more > 0 {
            let (_, place, before) = line.motion(begin);
            let way = (first.length + before) - place;
            self.behind = Behind { from, way, ..Behind::rest(self.commanded) };
            return;
        }
        // A brake may end after the last step, in front of the end.
        let (whole, end, (way, motion)) = (line.start.whole && !first.cut, line.over(), line.to_the_end(begin));
        self.behind = Behind { from, to: self.positions(end), way, motion, begin, end, over: 0 };
        if !whole {
            self.behind.over = self.over_behind();
        }
    }

    /// Keeps where the axes are, because they go no further.
    pub(super) fn stay_behind(&mut self, moment: u64) {
        if self.steps == Steps::Single {
            self.behind = Behind::nothing(self.positions(moment), moment);
            self.behind.over = self.over_behind();
        }
    }

    fn positions(&self, moment: u64) -> [i64; N] {
        self.places(moment).map(|state| state.position)
    }

    /// Returns the greatest speed of an axis.
    fn fastest(&self, axis: &AxisSetup) -> Real {
        Real::new(axis.limits.speed().into()) * self.clock().seconds()
    }

    /// Returns when all axes have gone on to whole steps; 0 if they are there.
    fn over_behind(&self) -> u64 {
        let own = self.behind.to.into_iter().zip(self.commanded).zip(self.path.axes());
        let off = own.map(|((to, whole), axis)| (gap(to, fine(whole)) / self.fastest(axis)).to_fixed(0));
        match off.max() {
            None | Some(0) => 0,
            Some(time) => self.behind.end.saturating_add(time),
        }
    }
}
