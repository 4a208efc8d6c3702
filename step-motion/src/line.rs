//! A straight line of several axes, and its steps.

use crate::curve::{Curve, Piece};
use crate::cutter::{Demand, Slice};
use crate::limits::{Bounds, Clock};
use crate::path::Ahead;
use crate::phases::{self, Frame, P};
use crate::planner::Motion;
use crate::real::Real;
use crate::stepper::Stepper;
use servowire_core::Direction;

/// A line that is waiting or running.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Line<const N: usize> {
    /// Steps of each axis to its end.
    pub(super) steps: [i32; N],
    /// Length in units; a unit is a step of the finest axis.
    pub(super) whole: Real,
    /// Length up to the point where the path leaves the line: its end, or where a stop has cut it off.
    pub(super) length: Real,
    /// Steps that each axis has made there.
    pub(super) ends: [u32; N],
    /// The limits of the axes, along the line, in units.
    pub(super) bounds: Bounds,
    /// The requested speed.
    pub(super) feed: Real,
    /// Greatest speed at its start, for the corner.
    pub(super) corner: Real,
    /// The line was cut off by a stop.
    pub(super) cut: bool,
    /// The speed at which a stop that ends on a later line leaves this one.
    pub(super) leave: Option<Real>,
    pub(super) ahead: Ahead,
}

impl<const N: usize> Line<N> {
    pub(super) fn new(steps: [i32; N], whole: Real, bounds: Bounds, (feed, corner): (Real, Real)) -> Self {
        let ends = steps.map(i32::unsigned_abs);
        Self { steps, whole, length: whole, ends, bounds, feed, corner, cut: false, leave: None, ahead: Ahead::NONE }
    }

    /// Returns a fraction of the requested speed, never above the limits of the axes.
    pub(super) fn speed(&self, part: Real) -> Real {
        self.bounds.v.min(self.feed * part)
    }

    /// Returns the steps that each axis has made at a place on the line; all steps at its end.
    pub(super) fn steps_at(&self, place: Real) -> [u32; N] {
        if place >= self.length {
            return self.ends;
        }
        self.steps.map(|steps| phases::steps(self.place(steps, place)).min(steps.unsigned_abs()))
    }

    /// Returns the last direction of each axis where the path leaves the line, from those at its start. It is unknown if the axis was to
    /// turn and has not made a step, because DIR may have changed for that.
    pub(super) fn ways_after(&self, mut ways: [Option<Direction>; N]) -> [Option<Direction>; N] {
        for ((way, steps), end) in ways.iter_mut().zip(self.steps).zip(self.ends).filter(|((_, steps), _)| *steps != 0)
        {
            let own = Some(Direction::of(steps.into()));
            *way = own.filter(|_| end > 0 || *way == own);
        }
        ways
    }

    /// Returns the position of an axis at a place on the line, in 2^-32 steps.
    fn place(&self, steps: i32, at: Real) -> i64 {
        let place = Real::new(steps.unsigned_abs().into()) * at / self.whole;
        i64::try_from(place.to_fixed(P)).unwrap_or(i64::MAX)
    }
}

/// A step of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisPulse {
    /// Which axis, from 0.
    pub axis: u8,
    /// Tick of the clock.
    pub tick: u64,
    /// DIR.
    pub direction: Direction,
}

/// Where and when a curve begins on a line, and how it ends.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Start<const N: usize> {
    /// Place in units from the start of the line, or before it.
    pub(super) place: Real,
    pub(super) before: Real,
    /// Steps of the line that have been made.
    pub(super) made: [u32; N],
    pub(super) moment: u64,
    /// How much later than that it begins, less than half a tick.
    pub(super) offset: Real,
    /// It ends with the line rather than at a rest before its end.
    pub(super) whole: bool,
}

/// The steps of all axes on a line, in the order of time.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinePulses<const N: usize> {
    clock: Clock,
    pub(super) curve: Curve,
    pub(super) axes: [(Frame, Stepper); N],
    pub(super) due: [Option<u64>; N],
    pub(super) directions: [Direction; N],
    pub(super) start: Start<N>,
    /// Moments at which the curve and the line end.
    end: u64,
    pub(super) left: u64,
}

/// By hand, because the derived `clone_from` copies it twice.
impl<const N: usize> Clone for LinePulses<N> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        *self = Self { ..*source };
    }
}

/// How the steps of a line are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Steps {
    /// One by one: the time of the next step is known.
    Single,
    /// In stretches: it is known whether there is a next step, but only once its line has begun.
    Stretches,
}

impl<const N: usize> LinePulses<N> {
    /// Creates the steps along a line, none of which is taken yet.
    pub(super) fn new(clock: Clock, curve: &Curve, line: &Line<N>, start: Start<N>, steps: Steps) -> Self {
        let mut new = Self::none(clock, start);
        new.begin(curve, line, start, steps);
        new
    }

    /// No steps, on no line.
    pub(super) fn none(clock: Clock, start: Start<N>) -> Self {
        let axes = [(Frame::rest(clock.shift(), 0, 0), Stepper::new()); N];
        let directions = [Direction::Forward; N];
        Self { clock, curve: Curve::new(), axes, due: [None; N], directions, start, end: 0, left: 0 }
    }

    /// Begins a line on a curve. All of this is done in place, because it is large.
    pub(super) fn begin(&mut self, curve: &Curve, line: &Line<N>, start: Start<N>, steps: Steps) {
        self.curve.clone_from(curve);
        self.go_on(line, start, steps);
    }

    /// Goes on along another line, to which the same curve leads.
    pub(super) fn go_on(&mut self, line: &Line<N>, start: Start<N>, steps: Steps) {
        let Start { moment, offset, .. } = start;
        let rest = Frame::rest(self.clock.shift(), moment, 0);
        let ends = line.steps.into_iter().zip(start.made).zip(line.ends);
        for ((frame, stepper), ((steps, made), end)) in self.axes.iter_mut().zip(ends) {
            let scale = Real::new(steps.unsigned_abs().into()) / line.whole;
            let from = line.place(steps, start.place).saturating_sub(line.place(steps, start.before));
            let from = from.saturating_sub(i64::from(made) << P);
            let to = start.whole.then_some(i64::from(end.saturating_sub(made)) << P);
            *frame = Frame { from, to, offset, scale, ..rest };
            *stepper = Stepper::new();
        }
        let end = self.axes.first().map_or(moment, |(frame, _)| frame.end(&self.curve));
        (self.start, self.end, self.left) = (start, end, end);
        self.directions = line.steps.map(|steps| Direction::of(steps.into()));
        for ((frame, stepper), due) in self.axes.iter_mut().zip(&mut self.due) {
            *due = match steps {
                Steps::Single => stepper.next(&self.curve, frame).filter(|due| self.clock.is_in_time(*due)),
                Steps::Stretches if self.curve.pieces().is_empty() => None,
                Steps::Stretches => (phases::steps(frame.last(&self.curve)) > 0).then_some(0),
            };
        }
    }

    /// Tick at which the line ends.
    pub const fn end(&self) -> u64 {
        self.clock.tick(self.left)
    }

    /// Moment at which its curve ends.
    pub(super) const fn over(&self) -> u64 {
        self.end
    }

    /// Returns speed and acceleration along the line at a moment, the place on the line, and how far before the line that is.
    pub(super) fn motion(&self, moment: u64) -> (Motion, Real, Real) {
        let Start { place, before, .. } = self.start;
        let piece = self.axes.first().and_then(|(frame, _)| self.curve.at(frame.time(&self.curve, moment)));
        let Some(Piece { p, v, a, up, .. }) = piece else { return (Motion::steady(Real::ZERO), place, before) };
        let at = place + (p - self.curve.skipped.1);
        (Motion { v, a, up }, at - before, before - at)
    }

    /// Returns whether the machine is on the line, or after it, at a moment.
    pub(super) fn has_begun(&self, moment: u64) -> bool {
        let Start { place, before, moment: begin, .. } = self.start;
        if before.is_zero() {
            return moment >= begin || !place.is_zero();
        }
        self.motion(moment.min(self.end)).2.is_zero()
    }

    /// Returns the motion at a moment on a way that leads to the start of the line, if its curve leads along that.
    pub(super) fn before(&self, moment: u64, way: Real) -> Option<Piece> {
        let Start { place, before, .. } = self.start;
        let (frame, _) = self.axes.first().filter(|_| !before.is_zero())?;
        let there = self.curve.at(frame.time(&self.curve, moment.min(self.end)))?;
        let p = (way + place + (there.p - self.curve.skipped.1)) - before;
        Some(if moment < self.end { Piece { p, ..there } } else { Piece { p, ..Piece::steady(Real::ZERO) } })
    }

    /// Returns the distance from a moment to the end of the curve, and the motion from there on: if there is more than one piece
    /// of the curve, at the mean speed.
    pub(super) fn to_the_end(&self, moment: u64) -> (Real, Piece) {
        let time = self.axes.first().map_or(Real::ZERO, |(frame, _)| frame.time(&self.curve, moment));
        let (Some(there), Some(last)) = (self.curve.at(time), self.curve.pieces().last()) else {
            return (Real::ZERO, Piece::steady(Real::ZERO));
        };
        let way = self.curve.p - there.p;
        if moment >= self.start.moment && time >= last.time {
            return (way, Piece { p: Real::ZERO, ..there });
        }
        (way, Piece::steady(way / Real::new(self.end.saturating_sub(moment).max(1))))
    }

    /// Returns when the next step is due, and on which axis.
    pub(super) fn first(&self) -> Option<(u64, usize)> {
        self.due.iter().enumerate().filter_map(|(axis, due)| due.map(|due| (due, axis))).min()
    }

    /// Takes it.
    pub(super) fn advance(&mut self, at: usize) {
        if let (Some((frame, stepper)), Some(due)) = (self.axes.get_mut(at), self.due.get_mut(at)) {
            *due = stepper.next(&self.curve, frame).filter(|due| self.clock.is_in_time(*due));
        }
    }

    /// Does a slice of the work for the next steps of an axis.
    pub(super) fn slice(&mut self, at: usize, demand: &Demand) -> Slice {
        let Some((frame, stepper)) = self.axes.get_mut(at) else { return Slice::End };
        stepper.cutter.slice(&self.curve, frame, demand)
    }

    pub(super) fn set_due(&mut self, at: usize, tick: Option<u64>) {
        if let Some(due) = self.due.get_mut(at) {
            *due = tick;
        }
    }

    /// Returns whether an axis has more steps.
    pub(super) fn has_more(&self, at: usize) -> bool {
        let more =
            |(frame, stepper): &(Frame, Stepper)| stepper.cutter.count() < phases::steps(frame.last(&self.curve));
        self.axes.get(at).is_some_and(more)
    }

    /// Returns the steps of each axis on the line at the end of the curve.
    pub(super) fn steps_at_end(&self) -> [u32; N] {
        let mut all = self.start.made;
        for (steps, (frame, _)) in all.iter_mut().zip(&self.axes) {
            *steps = steps.saturating_add(phases::steps(frame.last(&self.curve)));
        }
        all
    }

    pub(super) fn pulse(&self, (tick, at): (u64, usize)) -> AxisPulse {
        let direction = self.directions.get(at).copied().unwrap_or_default();
        AxisPulse { axis: u8::try_from(at).unwrap_or(u8::MAX), tick, direction }
    }
}

impl<const N: usize> Iterator for LinePulses<N> {
    type Item = AxisPulse;

    fn next(&mut self) -> Option<AxisPulse> {
        let first = self.first()?;
        self.advance(first.1);
        Some(self.pulse(first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use servowire_core::Direction::{Forward, Reverse};

    /// Steps of the line, those made before a stop, and the last direction before it and after it.
    #[test]
    fn an_axis_that_was_to_turn_may_have_turned() {
        let bounds = Bounds::new(Real::ONE, Real::ONE, None);
        for (steps, end, before, after) in [
            (5, 3, Some(Reverse), Some(Forward)),
            (5, 0, Some(Reverse), None),
            (-5, 0, Some(Forward), None),
            (5, 0, Some(Forward), Some(Forward)),
            (-5, 0, Some(Reverse), Some(Reverse)),
            (5, 0, None, None),
            (-5, 1, None, Some(Reverse)),
            (0, 0, Some(Forward), Some(Forward)),
            (0, 0, None, None),
        ] {
            let line = Line::new([steps], Real::new(5), bounds, (Real::ONE, Real::ZERO));
            let line = Line { ends: [end], ..line };
            assert_eq!(line.ways_after([before]), [after], "{steps} {end} {before:?}");
        }
    }
}
