//! Curves made of consecutive pieces of constant jerk.

use crate::real::{Real, THIRD};
use crate::slope::Slope;

/// How the acceleration changes during a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Bend {
    /// It grows.
    Growing,
    /// It stays the same, possibly 0.
    Flat,
    /// It decreases.
    Fading,
}

/// A piece of constant jerk, described by the state at its start.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Piece {
    /// Start, in the curve's time.
    pub(super) time: Real,
    /// Distance from the start of the curve.
    pub(super) p: Real,
    pub(super) v: Real,
    /// Size of the acceleration.
    pub(super) a: Real,
    /// Size of the jerk.
    pub(super) j: Real,
    /// The acceleration increases the speed.
    pub(super) up: bool,
    pub(super) bend: Bend,
}

impl Piece {
    /// Creates a piece at constant speed from the start of a curve.
    pub(super) const fn steady(v: Real) -> Self {
        let none = Real::ZERO;
        Self { time: none, p: none, v, a: none, j: none, up: true, bend: Bend::Flat }
    }

    /// Returns the state `t` after the start.
    #[inline(never)]
    pub(super) fn after(&self, t: Real) -> Self {
        let Self { time, a, j, up, bend, .. } = *self;
        let (p, v) = self.way(t);
        Self { time: time + t, p, v, a: a.along(j * t, bend != Bend::Fading), j, up, bend }
    }

    /// Returns distance and speed `t` after the start.
    pub(super) fn way(&self, t: Real) -> (Real, Real) {
        let Self { p, v, a, j, up, bend, .. } = *self;
        let growing = bend != Bend::Fading;
        let speed = a * t;
        let bent = j * t.squared().half();
        let dv = speed.along(bent, growing);
        let dp = (speed.half().along(bent * THIRD, growing)) * t;
        (p + (v * t).along(dp, up), v.along(dv, up))
    }

    /// Returns the speed and the size of the acceleration `t` after the start.
    pub(super) fn speed(&self, t: Real) -> (Real, Real) {
        let Self { v, a, j, up, bend, .. } = *self;
        match bend {
            Bend::Flat => (v.along(a * t, up), a),
            _ => (self.way(t).1, a.along(j * t, bend == Bend::Growing)),
        }
    }
}

/// Up to eight pieces: a return to acceleration 0, a slope, a cruise, and another slope.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Curve {
    pieces: [Piece; Curve::MAX],
    len: usize,
    /// Where the next piece begins.
    pub(super) time: Real,
    pub(super) p: Real,
    /// Time of the curve that had passed before it was planned, and the distance covered in that time.
    pub(super) skipped: (Real, Real),
}

impl Curve {
    pub(super) const MAX: usize = 8;

    /// All bytes are zero, so it is cleared rather than copied.
    const EMPTY: Self = {
        let none = Real::ZERO;
        let none = Piece { time: none, p: none, v: none, a: none, j: none, up: false, bend: Bend::Growing };
        Self { pieces: [none; Self::MAX], len: 0, time: Real::ZERO, p: Real::ZERO, skipped: (Real::ZERO, Real::ZERO) }
    };

    pub(super) const fn new() -> Self {
        Self::EMPTY
    }

    /// Creates a curve without pieces.
    pub(super) const fn clear(&mut self) {
        (self.len, self.time, self.p, self.skipped) = (0, Real::ZERO, Real::ZERO, (Real::ZERO, Real::ZERO));
    }

    pub(super) fn pieces(&self) -> &[Piece] {
        self.pieces.get(..self.len).unwrap_or(&[])
    }

    /// Returns a piece by its number, with time and place at its end.
    #[inline]
    pub(super) fn piece(&self, at: usize) -> Option<(&Piece, (Real, Real))> {
        let mut left = self.pieces().get(at..)?.iter();
        let piece = left.next()?;
        Some((piece, left.next().map_or((self.time, self.p), |next| (next.time, next.p))))
    }

    /// Returns the state at a time of the curve, even before its start or after its end; `None` without pieces.
    pub(super) fn at(&self, time: Real) -> Option<Piece> {
        let pieces = self.pieces();
        let piece = pieces.iter().rev().find(|piece| piece.time <= time).or(pieces.first())?;
        Some(piece.after(time - piece.time))
    }

    /// Returns the state after a distance from the point where the curve was joined.
    pub(super) fn after(&self, way: Real) -> Option<Piece> {
        let p = self.skipped.1 + way;
        let (piece, mut high) = self.piece_at(p)?;
        let mut low = Real::ZERO;
        // By halves: it is needed once a line, by a caller that goes from line to line.
        for _ in 0..64 {
            let middle = (low + high).half();
            if piece.way(middle).0 < p { low = middle } else { high = middle }
        }
        Some(piece.after(high))
    }

    /// Returns whether it has slowed down to a speed after a distance from the point where it was joined.
    pub(super) fn has_slowed_down(&self, way: Real, to: Real) -> bool {
        let p = self.skipped.1 + way;
        let Some((piece, mut high)) = self.piece_at(p).filter(|(piece, _)| !piece.up) else { return false };
        if piece.v <= to {
            return true;
        }
        let mut low = Real::ZERO;
        for _ in 0..64 {
            let middle = (low + high).half();
            let (place, v) = piece.way(middle);
            // It only gets slower.
            match (place < p, v <= to) {
                (true, true) => return true,
                (false, false) => return false,
                (true, false) => low = middle,
                (false, true) => high = middle,
            }
        }
        false
    }

    /// Returns the piece at a distance from the start of the curve, and how long it lasts.
    fn piece_at(&self, p: Real) -> Option<(&Piece, Real)> {
        let at = self.pieces().iter().rposition(|piece| piece.p <= p).unwrap_or(0);
        self.piece(at).map(|(piece, (end, _))| (piece, end - piece.time))
    }

    /// Returns the planned distance, from the point where the curve was joined to its end.
    pub(super) fn way(&self) -> Real {
        self.p - self.skipped.1
    }

    /// Adds a piece with its duration and distance; a piece of zero duration is omitted.
    pub(super) fn push(&mut self, (lasts, distance): (Real, Real), [v, a, j]: [Real; 3], up: bool, bend: Bend) {
        if lasts.is_zero() {
            return;
        }
        let piece = Piece { time: self.time, p: self.p, v, a, j, up, bend };
        if let Some(place) = self.pieces.get_mut(self.len) {
            *place = piece;
            self.len = self.len.saturating_add(1);
        }
        (self.time, self.p) = (self.time + lasts, self.p + distance);
    }

    /// Adds a change of speed.
    pub(super) fn slope(&mut self, slope: &Slope) {
        let Slope { from, to, edge, flat, j, a, distance: whole, .. } = *slope;
        if from == to {
            return;
        }
        let up = to > from;
        if edge.is_zero() {
            self.push((flat, whole), [from, a, Real::ZERO], up, Bend::Flat);
            return;
        }
        let bent = (a * edge).half();
        let mut way = from.along(bent * THIRD, up) * edge;
        self.push((edge, way), [from, Real::ZERO, j], up, Bend::Growing);
        if !flat.is_zero() {
            // It has the mean speed.
            let middle = (from + to).half() * flat;
            self.push((flat, middle), [from.along(bent, up), a, Real::ZERO], up, Bend::Flat);
            way = way + middle;
        }
        self.push((edge, whole - way), [to.along(bent, !up), a, j], up, Bend::Fading);
    }

    /// Adds a stretch at constant speed.
    pub(super) fn cruise(&mut self, v: Real, distance: Real) {
        if distance.is_zero() || v.is_zero() {
            return;
        }
        self.push((distance / v, distance), [v, Real::ZERO, Real::ZERO], true, Bend::Flat);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of whole numbers: 3 and 5 as speed and acceleration, 2 as jerk, each way.
    #[test]
    fn the_speed_of_a_piece() {
        let [three, five, two, zero] = [3, 5, 2, 0].map(Real::new);
        for (up, bend, a, j, t, speed, after) in [
            (true, Bend::Flat, five, zero, 4, 23, 5),
            (false, Bend::Flat, two, zero, 1, 1, 2),
            (true, Bend::Growing, five, two, 4, 39, 13),
            (true, Bend::Fading, five, two, 2, 9, 1),
            (false, Bend::Growing, zero, two, 1, 2, 2),
        ] {
            let piece = Piece { time: five, p: two, v: three, a, j, up, bend };
            let (v, a) = piece.speed(Real::new(t));
            assert!(v == Real::new(speed) && a == Real::new(after), "{v:?} {a:?} for {piece:?}");
            let then = piece.after(Real::new(t));
            assert!(then.v == v && then.a == a && then.time == Real::new(5 + t), "{then:?} for {piece:?}");
        }
    }

    /// No phase is added where nothing is to be gone, or cannot be.
    #[test]
    fn a_cruise_of_nothing_is_none() {
        let mut curve = Curve::new();
        for (v, distance) in [(2, 0), (0, 2), (0, 0)] {
            curve.cruise(Real::new(v), Real::new(distance));
            assert!(curve.pieces().is_empty() && curve.time.is_zero(), "{curve:?}");
        }
        curve.cruise(Real::new(2), Real::new(8));
        assert!(curve.pieces().len() == 1 && curve.way() == Real::new(8), "{curve:?}");
    }

    #[test]
    fn a_piece_ends_where_the_next_one_begins() {
        let mut curve = Curve::new();
        for (time, v) in [(32, 2), (16, 4)] {
            curve.push((Real::new(time), Real::new(64)), [Real::new(v), Real::ZERO, Real::ZERO], true, Bend::Flat);
        }
        let (middle, end) = ((Real::new(32), Real::new(64)), (Real::new(48), Real::new(128)));
        assert_eq!([0, 1, 2, 3].map(|at| curve.piece(at).map(|(_, end)| end)), [Some(middle), Some(end), None, None]);
        for way in [1, 63, 65, 100] {
            let there = curve.after(Real::new(way)).unwrap();
            assert!(there.p.distance(Real::new(way)) <= Real::ONE.scaled(-40), "{there:?} for {way}");
        }
    }

    /// From 16 at 2 to 8, over 48, and at 1 to rest, over 32; joined after 8.
    #[test]
    fn where_a_brake_has_slowed_down() {
        let mut curve = Curve::new();
        for (time, way, v, a) in [(4, 48, 16, 2), (8, 32, 8, 1)] {
            let [time, way, v, a] = [time, way, v, a].map(Real::new);
            curve.push((time, way), [v, a, Real::ZERO], false, Bend::Flat);
        }
        curve.skipped.1 = Real::new(8);
        for (way, v) in [(20, 12), (40, 8), (54, 6), (64, 4), (70, 2)] {
            let has = [v - 1, v + 1].map(|to| curve.has_slowed_down(Real::new(way), Real::new(to)));
            assert_eq!(has, [false, true], "{way}");
        }
        assert!(!Curve::new().has_slowed_down(Real::ZERO, Real::HUGE));
        let mut faster = Curve::new();
        faster.push((Real::new(4), Real::new(16)), [Real::ZERO, Real::new(2), Real::ZERO], true, Bend::Flat);
        assert!(!faster.has_slowed_down(Real::new(4), Real::new(100)), "it gets faster");
    }
}
