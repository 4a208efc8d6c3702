//! One change of speed.

use crate::limits::Bounds;
use crate::real::Real;

/// From one speed to another in the least time: jerk, constant acceleration, jerk back; without a jerk limit only the
/// middle part.
///
/// A change of speed dv of at least a² / j reaches the greatest acceleration and takes dv / a + a / j. A smaller one takes
/// 2 sqrt(dv / j) and has no middle part. The distance is the mean of both speeds times the time in either case.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slope {
    pub(super) from: Real,
    pub(super) to: Real,
    /// Time of either jerk.
    pub(super) edge: Real,
    /// Time at constant acceleration.
    pub(super) flat: Real,
    /// Size of the jerk.
    pub(super) j: Real,
    /// Size of the acceleration between them.
    pub(super) a: Real,
    /// How far it goes.
    pub(super) distance: Real,
}

impl Slope {
    pub(super) fn new(from: Real, to: Real, bounds: &Bounds) -> Self {
        let dv = from.distance(to);
        let (edge, flat, j, a) = match bounds.jerk {
            None => (Real::ZERO, dv * bounds.per_a, Real::ZERO, bounds.a),
            Some(jerk) if dv < jerk.knee => {
                let edge = (dv * jerk.per_j).sqrt();
                (edge, Real::ZERO, jerk.j, jerk.j * edge)
            }
            Some(jerk) => (jerk.edge, dv * bounds.per_a - jerk.edge, jerk.j, bounds.a),
        };
        let time = edge.scaled(1) + flat;
        Self { from, to, edge, flat, j, a, distance: (from + to).half() * time }
    }

    /// The same change, the other way round.
    pub(super) const fn reversed(&self) -> Self {
        Self { from: self.to, to: self.from, ..*self }
    }
}

/// Returns the least distance of a change of speed.
pub(super) fn distance(from: Real, to: Real, bounds: &Bounds) -> Real {
    if from == to { Real::ZERO } else { Slope::new(from, to, bounds).distance }
}

/// Returns at least that distance, without taking a root: as if the greatest acceleration were reached.
pub(super) fn most_distance(from: Real, to: Real, bounds: &Bounds) -> Real {
    let edge = bounds.jerk.map_or(Real::ZERO, |jerk| jerk.edge);
    (from + to).half() * (from.distance(to) * bounds.per_a + edge)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 2 to 6 at 4 of acceleration, with 2 of jerk or without a limit of it: a mean speed of 4, for 1 and 2 more.
    #[test]
    fn the_most_that_a_change_of_speed_may_take() {
        let [from, to, a] = [2, 6, 4].map(Real::new);
        for (jerk, want) in [(None, 4), (Some(Real::new(2)), 12)] {
            let (bounds, most) = (Bounds::new(Real::new(10), a, jerk), Real::new(want));
            for got in [most_distance(from, to, &bounds), most_distance(to, from, &bounds)] {
                assert!(got.distance(most) < most.scaled(-40));
            }
            assert!(distance(from, to, &bounds) <= most + most.scaled(-40));
        }
    }
}
