//! Lengths of lines, what the axes permit along them, and the speed at their corners.

use super::Path;
use crate::limits::Bounds;
use crate::real::Real;
use servowire_core::Direction;

/// 1 less the cosine of an angle so small that the ends of one line, rounded to steps, may have it: 1.4 mrad.
const STRAIGHT: Real = Real::fixed(1, 20);

impl<const N: usize, const M: usize> Path<N, M> {
    /// Returns the distance that an axis moves, in units.
    pub(super) fn way(&self, axis: usize, steps: i32) -> Real {
        let scale = self.axes.get(axis).map_or(1, |axis| axis.steps_per_m);
        Real::new(steps.unsigned_abs().into()) * self.unit / Real::new(scale.into())
    }

    pub(super) fn length(&self, steps: &[i32; N]) -> Real {
        let squares = steps.iter().enumerate().map(|(axis, &steps)| self.way(axis, steps).squared());
        squares.fold(Real::ZERO, |sum, square| sum + square).sqrt()
    }

    /// The limits along the line that every axis permits, and the requested speed.
    pub(super) fn bounds(&self, steps: &[i32; N], length: Real, feed: u32) -> (Bounds, Real) {
        let second = Real::new(self.clock.moments().into());
        let feed = self.unit * Real::new(feed.into()) / (Real::new(1_000_000) * second);
        let (mut v, mut a, mut j) = (Real::HUGE, Real::HUGE, None);
        for (axis, &steps) in self.axes.iter().zip(steps).filter(|(_, steps)| **steps != 0) {
            let own = axis.limits.bounds(self.clock);
            let part = length / Real::new(steps.unsigned_abs().into());
            (v, a) = (v.min(own.v * part), a.min(own.a * part));
            if let Some(jerk) = own.jerk {
                let most = jerk.j * part;
                j = Some(j.map_or(most, |j: Real| j.min(most)));
            }
        }
        (Bounds::new(v, a, j), feed)
    }

    /// The speed at which axes that reverse at a corner have their pause between the two steps, whatever they do there
    /// within their limits:
    /// half a step at the axis's speed v takes t if v t + a t² / 2 is half a step.
    pub(super) fn turning(&self, (from, long): (&[i32; N], Real), (to, length): (&[i32; N], Real)) -> Real {
        let mut most = Real::HUGE;
        for (((axis, way), &before), &after) in self.axes.iter().zip(self.ways).zip(from).zip(to) {
            let turns = way != Some(Direction::of(after.into()));
            if after == 0 || axis.reversal_pause == 0 || !turns {
                continue;
            }
            let pause = Real::new(self.clock.moment(axis.reversal_pause.into()));
            // It has half of it on either side, or all of it after the corner.
            let time = if before == 0 { pause } else { pause.half() };
            let v = Real::ONE.half() / time - (axis.limits.bounds(self.clock).a * time).half();
            for (steps, length) in [(before, long), (after, length)].into_iter().filter(|(steps, _)| *steps != 0) {
                most = most.min(v * length / Real::new(steps.unsigned_abs().into()));
            }
        }
        most
    }

    /// The speed at a corner: v² = a δ s / (1 - s), with s the sine of half the angle between the lines, which is 1 for
    /// straight on. 1 - s is computed as (1 - s²) / (1 + s), which avoids cancellation. a is the acceleration that the axes
    /// allow in the direction in which the corner turns.
    ///
    /// A smaller angle than [`STRAIGHT`] may come from rounding: there the deviation is at least half a step, of each axis as far as it
    /// takes part in the turn.
    ///
    /// Chords of a circle are bounded by its radius, however small they are: with l the shorter line, v² = a l/2 s / sqrt(1 - s²), which
    /// is a r.
    pub(super) fn corner(&self, (from, long): (&[i32; N], Real), (to, length): (&[i32; N], Real)) -> Real {
        let (mut along, mut against) = (Real::ZERO, Real::ZERO);
        let parts = |axis, before, after| (self.way(axis, before) / long, self.way(axis, after) / length);
        for (axis, (&before, &after)) in from.iter().zip(to).enumerate() {
            let (part, next) = parts(axis, before, after);
            if (before < 0) == (after < 0) {
                along = along + part * next;
            } else {
                against = against + part * next;
            }
        }
        // Twice s², and twice 1 - s².
        let one = Real::new(1);
        let (open, shut) = ((one + along) - against, (one + against) - along);
        if shut < Real::fixed(1, 48) {
            return Real::HUGE;
        }
        if open < STRAIGHT {
            return Real::ZERO;
        }
        // The speed turns along the difference of both directions, which is as long as this; an axis takes its part of that.
        let whole = shut.scaled(1).sqrt();
        let (mut most, mut rounded) = (Real::HUGE, Real::ZERO);
        for (axis, (setup, (&before, &after))) in self.axes.iter().zip(from.iter().zip(to)).enumerate() {
            let (part, next) = parts(axis, before, after);
            let turn = if (before < 0) == (after < 0) { part.distance(next) } else { part + next };
            let step = self.way(axis, 1);
            most = most.min(setup.limits.bounds(self.clock).a * step * whole / turn);
            rounded = rounded + turn * step.half() / whole;
        }
        let (s, rest) = (open.half().sqrt(), shut.half());
        let chord = long.min(length).half() * s / rest.sqrt();
        let deviation = if shut < STRAIGHT { self.deviation.max(rounded) } else { self.deviation };
        let bow = deviation * s * (one + s) / rest;
        (most * bow.min(chord)).sqrt()
    }
}
