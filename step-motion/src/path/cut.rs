//! Where a stop cuts a path off.

use super::Path;
use crate::limits::Bounds;
use crate::line::Line;
use crate::real::Real;

/// How a stop leaves the lines of its first curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaving {
    /// Lines after the first one.
    pub(crate) more: usize,
    pub(crate) exit: Real,
    /// The limits of the run that they belong to, if that run has been planned again.
    pub(crate) bounds: Option<Bounds>,
}

/// Where a stop ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End<const N: usize> {
    /// The line, and the place on it.
    pub(crate) at: (usize, Real),
    /// The least and the most steps on that line: those of a stop under way. Rounding must not add one.
    pub(crate) least: [u32; N],
    pub(crate) most: [u32; N],
}

impl<const N: usize> End<N> {
    fn steps(&self, line: &Line<N>) -> [u32; N] {
        let mut steps = line.steps_at(self.at.1);
        for ((steps, least), most) in steps.iter_mut().zip(self.least).zip(self.most) {
            *steps = most.min(least.max(*steps));
        }
        steps
    }
}

impl<const N: usize, const M: usize> Path<N, M> {
    /// Returns the line that was cut off, and the place on it.
    pub(crate) fn end_of_cut(&self) -> Option<(usize, Real)> {
        (0..self.len).find_map(|at| self.line(at).filter(|line| line.cut).map(|line| (at, line.length)))
    }

    /// Returns the position in whole steps at an end, if the first line begins at `from`.
    /// `made`: the steps made on the first line, which cannot be undone.
    pub(crate) fn place(&self, end: &End<N>, from: [i64; N], made: [u32; N]) -> [i64; N] {
        let mut to = from;
        for i in 0..=end.at.0 {
            let Some(line) = self.line(i) else { break };
            let mut ends = if i == end.at.0 { end.steps(line) } else { line.ends };
            if i == 0 {
                ends = at_least(ends, made);
            }
            for ((to, end), steps) in to.iter_mut().zip(ends).zip(line.steps) {
                let way = i64::from(end);
                *to = to.saturating_add(if steps < 0 { way.wrapping_neg() } else { way });
            }
        }
        to
    }

    /// Cuts the queue off at an end, if the first line begins at `from` and a stop leaves it as `first` says.
    pub(crate) fn cut(&mut self, to: &End<N>, from: [i64; N], made: [u32; N], first: Leaving) {
        self.target = self.place(to, from, made);
        let (at, place) = to.at;
        let Leaving { more: mut end, exit: mut speed, mut bounds } = first;
        for i in 0..self.len {
            if i > end && i <= at {
                let course = self.begin_to_brake(i, speed);
                (end, speed, bounds) = course.map_or((i, speed, None), |(course, bounds)| {
                    (i.saturating_add(course.more), course.exit, Some(bounds))
                });
            }
            let mut entry = self.first.wrapping_add(i).checked_rem(M).and_then(|at| self.lines.get_mut(at));
            if let (Some(Some(line)), Some(bounds)) = (&mut entry, bounds.filter(|_| i <= end)) {
                // The stop must stay the same when its run gets shorter.
                line.bounds = bounds;
            }
            match entry {
                Some(Some(line)) if i < at && i == end => line.leave = line.leave.or(Some(speed)),
                Some(Some(_)) if i < at => {}
                Some(Some(line)) if i == at => {
                    line.ends = to.steps(line);
                    if i == 0 {
                        line.ends = at_least(line.ends, made);
                    }
                    (line.length, line.cut) = (place.min(line.length), true);
                }
                Some(entry) => *entry = None,
                None => {}
            }
        }
        (self.len, self.before) = (at.saturating_add(1).min(self.len), None);
        self.forget();
        // Lines that were cut off turn no axis.
        let mut ways = self.gone;
        for line in (0..self.len).filter_map(|at| self.line(at)) {
            ways = line.ways_after(ways);
        }
        self.ways = ways;
    }
}

/// Raises the steps to those already made: a step falls into the nearest tick, so it may have been made before its place
/// was reached.
fn at_least<const N: usize>(mut ends: [u32; N], made: [u32; N]) -> [u32; N] {
    for (end, made) in ends.iter_mut().zip(made) {
        *end = made.max(*end);
    }
    ends
}
