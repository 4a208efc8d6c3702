//! The line before the first one, whose limits count until the machine has left it; and the limits of a stop.

use super::Path;
use crate::limits::{Bounds, Limits};
use crate::line::Line;
use crate::real::Real;

#[cfg(test)]
mod tests;

/// What a line has allowed that has been taken out.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Passed<const N: usize> {
    steps: [i32; N],
    whole: Real,
    bounds: Bounds,
}

/// The lines of a queue, and the one before them.
pub(crate) type Lines<const N: usize, const M: usize> = ([Option<Line<N>>; M], Option<Passed<N>>);

impl<const N: usize> Passed<N> {
    pub(super) const fn new(line: &Line<N>) -> Self {
        let Line { steps, whole, bounds, .. } = *line;
        Self { steps, whole, bounds }
    }

    /// The greatest speed along it, whatever was requested.
    pub(super) const fn speed(&self) -> Real {
        self.bounds.v
    }

    /// Returns limits of which acceleration and jerk are no higher than on the line, for at most a speed.
    pub(super) fn lower(&self, bounds: &Bounds, most: Real) -> Bounds {
        let v = bounds.v.min(most);
        if bounds.allows_more(&self.bounds) { Bounds { v, ..bounds.or_lower(&self.bounds) } } else { bounds.slower(v) }
    }
}

impl<const N: usize, const M: usize> Path<N, M> {
    /// Lets the lines use the higher of their own limits and these, for a stop that is to be planned again. Returns the lines
    /// as they were.
    pub(crate) fn hurry(&mut self, limits: &[Limits; N]) -> Lines<N, M> {
        self.forget();
        let (own, before) = (self.axes, (self.lines, self.passed));
        for (axis, limits) in self.axes.iter_mut().zip(limits) {
            axis.limits = axis.limits.or_higher(*limits);
        }
        for i in 0..self.len {
            let Some(line) = self.line(i) else { break };
            let (bounds, _) = self.bounds(&line.steps, line.whole, 1);
            let place = self.first.wrapping_add(i).checked_rem(M).and_then(|at| self.lines.get_mut(at));
            if let Some(Some(line)) = place {
                (line.bounds, line.leave) = (bounds.or_higher(&line.bounds), None);
            }
        }
        if let Some(Passed { steps, whole, bounds, .. }) = self.passed {
            let (higher, _) = self.bounds(&steps, whole, 1);
            self.passed = self.passed.map(|passed| Passed { bounds: higher.or_higher(&bounds), ..passed });
        }
        self.axes = own;
        before
    }

    /// Takes the lines as they were before [`hurry`](Self::hurry).
    pub(crate) const fn calm(&mut self, (lines, passed): Lines<N, M>) {
        (self.lines, self.passed) = (lines, passed);
    }
}
