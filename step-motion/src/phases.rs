//! A curve on the time and in the steps of one axis.

use crate::curve::{Bend, Curve, Piece};
use crate::real::Real;

/// Fraction bits of a position.
pub(super) const P: i32 = 32;

/// Where an axis is on a curve: its positions are in 2^-32 steps, its times in moments.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Frame {
    /// A tick has 2^shift moments.
    pub(super) shift: u32,
    /// Moment at which the curve begins.
    pub(super) begin: u64,
    /// Position at which it begins.
    pub(super) from: i64,
    /// Position at which it ends, if that is known; otherwise the end of the curve counts.
    pub(super) to: Option<i64>,
    /// How much later than `begin` the curve begins, less than half a tick.
    pub(super) offset: Real,
    /// Steps of the axis in a unit of the curve.
    pub(super) scale: Real,
    /// The last piece has no end.
    pub(super) endless: bool,
}

/// A state on a curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    /// Position.
    pub(super) p: i64,
    /// Speed, never below 0, in steps per moment.
    pub(super) v: Real,
    /// Size of the acceleration, and whether it increases the speed.
    pub(super) a: (Real, bool),
    /// Size of the jerk, and whether it acts in the direction of the speed.
    pub(super) j: (Real, bool),
}

impl Frame {
    /// Creates a frame at rest at a position.
    pub(super) const fn rest(shift: u32, moment: u64, at: i64) -> Self {
        let (offset, scale) = (Real::ZERO, Real::ONE);
        Self { shift, begin: moment, from: at, to: Some(at), offset, scale, endless: false }
    }

    /// Returns the moments from `begin` to a time of the curve.
    pub(super) fn since(&self, curve: &Curve, time: Real) -> Real {
        self.offset + (time - curve.skipped.0)
    }

    /// Returns the time of the curve at a moment.
    pub(super) fn time(&self, curve: &Curve, moment: u64) -> Real {
        (Real::new(moment.saturating_sub(self.begin)) + curve.skipped.0) - self.offset
    }

    fn position(&self, curve: &Curve, p: Real) -> i64 {
        let behind = curve.skipped.1;
        let (back, size) = if p < behind { (true, behind - p) } else { (false, p - behind) };
        let way = i64::try_from((size * self.scale).to_fixed(P)).unwrap_or(i64::MAX);
        if back { self.from.saturating_sub(way) } else { self.from.saturating_add(way) }
    }

    /// Moment at which the curve ends.
    pub(super) fn end(&self, curve: &Curve) -> u64 {
        self.begin.saturating_add(self.since(curve, curve.time).to_fixed(0))
    }

    /// Position at its end: the motor's, which is a whole step.
    pub(super) fn last(&self, curve: &Curve) -> i64 {
        self.to.unwrap_or_else(|| i64::from(steps(self.position(curve, curve.p))) << P)
    }

    /// Returns the steps made at the end of piece `at`, 0 if that is before the curve was joined; `None` after the last piece.
    pub(super) fn until(&self, curve: &Curve, at: u8) -> Option<u32> {
        let at = usize::from(at);
        curve.pieces().get(at)?;
        let last = || if self.endless { u32::MAX } else { steps(self.last(curve)) };
        Some(match curve.pieces().get(at.saturating_add(1)) {
            Some(next) if next.time <= curve.skipped.0 => 0,
            Some(next) => steps(self.position(curve, next.p)).min(last()),
            None => last(),
        })
    }

    /// Returns the state at a moment; at rest after the end.
    pub(super) fn at(&self, curve: &Curve, moment: u64) -> State {
        if !self.endless && moment >= self.end(curve) { self.rests(curve) } else { self.within(curve, moment) }
    }

    /// Returns the same, but at rest the place at which the curve ends, which may be between steps.
    pub(super) fn unrounded(&self, curve: &Curve, moment: u64) -> State {
        if moment < self.end(curve) {
            return self.within(curve, moment);
        }
        State { p: self.position(curve, curve.p), ..self.rests(curve) }
    }

    fn rests(&self, curve: &Curve) -> State {
        State { p: self.last(curve), v: Real::ZERO, a: (Real::ZERO, true), j: (Real::ZERO, true) }
    }

    /// Returns the state at a moment before the end.
    pub(super) fn within(&self, curve: &Curve, moment: u64) -> State {
        let Some(Piece { p, v, a, j, up, bend, .. }) = curve.at(self.time(curve, moment)) else {
            return self.rests(curve);
        };
        State {
            p: self.position(curve, p),
            v: v * self.scale,
            a: (a * self.scale, up),
            j: (j * self.scale, up == (bend != Bend::Fading)),
        }
    }
}

/// The curve of one axis.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Phases {
    pub(super) curve: Curve,
    pub(super) frame: Frame,
}

impl Phases {
    /// At rest.
    pub(super) const fn rest(shift: u32, moment: u64, at: i64) -> Self {
        Self { curve: Curve::new(), frame: Frame::rest(shift, moment, at) }
    }

    /// Removes all pieces, and sets another frame.
    pub(super) const fn anew(&mut self, frame: Frame) -> &mut Self {
        self.frame = frame;
        self.curve.clear();
        self
    }

    pub(super) fn end(&self) -> u64 {
        self.frame.end(&self.curve)
    }

    pub(super) fn last(&self) -> i64 {
        self.frame.last(&self.curve)
    }

    pub(super) fn at(&self, moment: u64) -> State {
        self.frame.at(&self.curve, moment)
    }
}

/// Converts steps to a position, modulo 2^32 steps.
pub(super) const fn fine(steps: i64) -> i64 {
    steps.wrapping_mul(1 << P)
}

/// Returns the steps made at a position: step k falls where the position is k - 1/2.
pub(super) fn steps(p: i64) -> u32 {
    u32::try_from(p.saturating_add(1 << 31) >> P).unwrap_or(if p < 0 { 0 } else { u32::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit in 64 moments, which is half a step; the curve is joined after one unit, a quarter of a moment late.
    #[test]
    fn a_frame_is_where_its_curve_is() {
        let mut curve = Curve::new();
        curve.cruise(Real::ONE.scaled(-6), Real::new(10));
        curve.skipped = (Real::new(64), Real::new(1));
        let (offset, scale) = (Real::ONE.scaled(-2), Real::ONE.half());
        let frame = Frame { to: None, offset, scale, ..Frame::rest(10, 1000, 5 << P) };
        assert!(frame.time(&curve, 1100) + frame.offset == Real::new(164));
        assert_eq!(frame.end(&curve), 1000 + 576);
        let place = |moment| frame.within(&curve, moment).p;
        // In 2^-9 steps.
        let fine = |quarters: i64| (5 << P) + (quarters << (P - 9));
        assert_eq!([1000, 1001, 1100].map(place), [fine(-1), fine(3), fine(399)]);
        assert!(frame.at(&curve, 1575).v == Real::ONE.scaled(-7));
        let end = frame.at(&curve, 1576);
        // Steps are whole: the half that is left is rounded up.
        assert!(end.p == 10 << P && end.v.is_zero());
    }

    /// 6 units/moment³ from rest, on an axis that makes half a step in a unit.
    #[test]
    fn an_axis_has_its_share_of_acceleration_and_jerk() {
        let mut curve = Curve::new();
        curve.push((Real::new(8), Real::new(512)), [Real::ZERO, Real::ZERO, Real::new(6)], true, Bend::Growing);
        let frame = Frame { to: None, scale: Real::ONE.half(), ..Frame::rest(10, 0, 0) };
        let State { p, v, a, j } = frame.within(&curve, 4);
        assert!(p.abs_diff(32 << P) < 16 && v == Real::new(24));
        assert!(a == (Real::new(12), true) && j == (Real::new(3), true));
    }

    /// Three pieces of 64 units, at half a step each, joined in the first one, at its end or in the second one.
    #[test]
    fn steps_made_at_the_end_of_each_piece() {
        let mut curve = Curve::new();
        for _ in 0..3 {
            let all = Real::new(64);
            curve.push((all, all), [Real::ONE, Real::ZERO, Real::ZERO], true, Bend::Flat);
        }
        let frame = Frame { to: None, scale: Real::ONE.half(), ..Frame::rest(10, 0, 5 << P) };
        let until = |curve: &Curve, frame: &Frame| [0, 1, 2, 3].map(|at| frame.until(curve, at));
        assert_eq!(until(&curve, &frame), [Some(37), Some(69), Some(101), None]);
        let ends = Frame { to: Some(60 << P), ..frame };
        assert_eq!(until(&curve, &ends), [Some(37), Some(60), Some(60), None]);
        assert_eq!(until(&curve, &Frame { endless: true, ..ends }), [Some(37), Some(69), Some(u32::MAX), None]);
        for (joined, wants) in [
            (10, [Some(32), Some(64), Some(96), None]),
            (63, [Some(6), Some(38), Some(70), None]),
            (64, [Some(0), Some(37), Some(69), None]),
            (74, [Some(0), Some(32), Some(64), None]),
            (128, [Some(0), Some(0), Some(37), None]),
        ] {
            curve.skipped = (Real::new(joined), Real::new(joined));
            assert_eq!(until(&curve, &frame), wants, "{joined}");
        }
        assert_eq!(until(&Curve::new(), &frame), [None; 4]);
    }
}
