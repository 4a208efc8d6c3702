//! Splits arcs into chords.

use crate::error::Error;

/// A point in a plane, in any unit: units of 0.1 µm reach 107 m.
type Point = [i32; 2];

/// Direction of an arc, seen with the second axis to the left of the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Turning {
    /// G2 of a part program.
    Clockwise,
    /// G3 of a part program.
    Counterclockwise,
}

/// The chords of an arc, in integers: the ends of straight lines, the last one at the end of the arc.
///
/// The arc is halved until no chord is further from it than requested; the ends of the chords are on the circle to 2 units,
/// so a chord is off by at most `error` + 2 units.
///
/// ```
/// use step_motion::{Arc, Turning};
/// // A quarter of a circle of 10 mm, counter-clockwise, in µm, exact to 5 µm.
/// let chords: Vec<_> = Arc::new([10_000, 0], [0, 10_000], [0, 0], Turning::Counterclockwise, 5)?.collect();
/// assert_eq!((chords.len(), chords[31]), (32, [0, 10_000]));
/// # Ok::<_, step_motion::Error>(())
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Arc {
    center: Point,
    radius: i64,
    /// An arc between two points is not split further if the square of their vectors' sum is at least this.
    split: u64,
    /// Present position, relative to the center.
    at: [i64; 2],
    /// End points of the parts still to be split; the next one is last.
    ends: [[i64; 2]; Self::DEPTH],
    len: usize,
    to: Point,
}

impl Arc {
    /// Room for the four quarters, and for one halving per bit of a coordinate.
    const DEPTH: usize = 40;
    /// Largest permitted radius, the distance of `from` and `to` from the center.
    pub const MAX_RADIUS: u32 = 1 << 30;

    /// Creates the chords from one point on a circle around `center` to another; the whole circle if the points are the
    /// same. `error` is how far a chord may be from the arc, at least 1.
    ///
    /// # Errors
    /// [`Error::ArcRadius`] for a radius of 0 or above [`MAX_RADIUS`](Self::MAX_RADIUS), and if the radii at the two ends
    /// differ by more than `error` plus a thousandth.
    pub fn new(from: Point, to: Point, center: Point, turning: Turning, error: u32) -> Result<Self, Error> {
        let clockwise = turning == Turning::Clockwise;
        let (at, end) = (away(from, center), away(to, center));
        let (radius, other) = (length(at), length(end));
        let tolerance = i64::from(error.max(1)).saturating_add(radius / 1000);
        if radius == 0
            || radius.max(other) > i64::from(Self::MAX_RADIUS)
            || radius.abs_diff(other) > tolerance.unsigned_abs()
        {
            let narrow = |length: i64| u32::try_from(length).unwrap_or(u32::MAX);
            return Err(Error::ArcRadius { from: narrow(radius), to: narrow(other) });
        }
        let chord = radius.saturating_sub(error.max(1).into()).max(0).unsigned_abs().saturating_mul(2);
        let mut new =
            Self { center, radius, split: chord.saturating_mul(chord), at, ends: [end; Self::DEPTH], len: 1, to };
        let (ahead, turn) = (dot(at, end), if clockwise { dot(quarter(end), at) } else { dot(quarter(at), end) });
        let quarters = match (turn.signum(), ahead.signum()) {
            (1, 0 | 1) => 0,
            (1, _) | (0, -1) => 1,
            (-1, -1 | 0) => 2,
            _ => 3,
        };
        let mut ends = [at; 3];
        let mut mark = at;
        for end in &mut ends {
            mark = if clockwise { quarter(quarter(quarter(mark))) } else { quarter(mark) };
            *end = mark;
        }
        for end in ends.into_iter().take(quarters).rev() {
            new.push(end);
        }
        Ok(new)
    }

    fn push(&mut self, end: [i64; 2]) {
        if let Some(place) = self.ends.get_mut(self.len) {
            *place = end;
            self.len = self.len.saturating_add(1);
        }
    }

    /// Returns the point on the circle half-way between two points at most a quarter apart.
    fn middle(&self, [x, y]: [i64; 2]) -> [i64; 2] {
        let long = length([x, y]).max(1);
        let scaled = |x: i64| {
            let half = if x < 0 { long.wrapping_neg() } else { long } / 2;
            x.saturating_mul(self.radius).saturating_add(half).checked_div(long).unwrap_or(0)
        };
        [scaled(x), scaled(y)]
    }
}

impl Iterator for Arc {
    type Item = Point;

    fn next(&mut self) -> Option<Point> {
        loop {
            let end = *self.ends.get(self.len.checked_sub(1)?)?;
            let sum = [self.at[0].saturating_add(end[0]), self.at[1].saturating_add(end[1])];
            let middle = self.middle(sum);
            let full = self.len >= Self::DEPTH || middle == self.at || middle == end;
            if !full && square(sum) < self.split {
                self.push(middle);
                continue;
            }
            self.len = self.len.saturating_sub(1);
            self.at = end;
            if self.len == 0 {
                return Some(self.to);
            }
            let place = |center: i32, x: i64| i32::try_from(i64::from(center).saturating_add(x)).unwrap_or(center);
            return Some([place(self.center[0], end[0]), place(self.center[1], end[1])]);
        }
    }
}

fn away(point: Point, center: Point) -> [i64; 2] {
    [i64::from(point[0]).saturating_sub(center[0].into()), i64::from(point[1]).saturating_sub(center[1].into())]
}

/// Rotates the point a quarter turn counter-clockwise.
const fn quarter([x, y]: [i64; 2]) -> [i64; 2] {
    [y.wrapping_neg(), x]
}

fn dot(a: [i64; 2], b: [i64; 2]) -> i64 {
    a[0].saturating_mul(b[0]).saturating_add(a[1].saturating_mul(b[1]))
}

fn square(a: [i64; 2]) -> u64 {
    dot(a, a).max(0).unsigned_abs()
}

/// Divides and rounds to the nearest.
fn length(a: [i64; 2]) -> i64 {
    let square = square(a);
    let root = square.isqrt();
    let up = square.saturating_sub(root.saturating_mul(root)) > root;
    i64::try_from(root.saturating_add(up.into())).unwrap_or(i64::MAX)
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, clippy::cast_sign_loss, reason = "compared within a unit")]
mod tests {
    use super::*;

    fn turning(clockwise: bool) -> Turning {
        if clockwise { Turning::Clockwise } else { Turning::Counterclockwise }
    }
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Returns the angle from `from` to `to` in the direction of the arc, above 0 and at most one turn.
    fn angle(from: [f64; 2], to: [f64; 2], clockwise: bool) -> f64 {
        let turn = core::f64::consts::TAU;
        let angle = to[1].atan2(to[0]) - from[1].atan2(from[0]);
        let angle = if clockwise { -angle } else { angle }.rem_euclid(turn);
        if angle < 1e-9 { turn } else { angle }
    }

    proptest! {
        #[test]
        fn every_chord_is_near_the_arc(
            radius in 1..1_000_000_000_i32, a in 0.0..6.0_f64, sweep in 0.01..6.2_f64,
            center in [-1000..1000_i32, -1000..1000_i32], clockwise: bool, part in 1e-5..0.1_f64,
        ) {
            let error = ((f64::from(radius) * part) as u32).max(1);
            let on = |angle: f64| [0, 1].map(|i| {
                let x = if i == 0 { angle.cos() } else { angle.sin() } * f64::from(radius);
                center[i] + x.round() as i32
            });
            let (from, to) = (on(a), on(if clockwise { a - sweep } else { a + sweep }));
            prop_assume!(from != to && radius > 50);
            let chords: Vec<_> = Arc::new(from, to, center, turning(clockwise), error).unwrap().collect();
            prop_assert_eq!(*chords.last().unwrap(), to);
            let rel = |p: [i32; 2]| [f64::from(p[0] - center[0]), f64::from(p[1] - center[1])];
            let (mut last, mut turned) = (rel(from), 0.0);
            for chord in &chords {
                let point = rel(*chord);
                let long = point[0].hypot(point[1]);
                prop_assert!((long - f64::from(radius)).abs() <= 2.5, "{long} for {radius}");
                let middle = f64::midpoint(last[0], point[0]).hypot(f64::midpoint(last[1], point[1]));
                prop_assert!(f64::from(radius) - middle <= f64::from(error) + 2.5, "{middle}, {radius}, {error}");
                turned += angle(last, point, clockwise);
                last = point;
            }
            // All the way round and no turn more.
            prop_assert!((turned - angle(rel(from), rel(to), clockwise)).abs() < 1e-6, "{turned} for {sweep}");
            // No more chords than twice the fewest.
            let fewest = sweep / (2.0 * (1.0 - f64::from(error) / f64::from(radius)).max(-1.0).acos());
            prop_assert!(chords.len() as f64 <= 2.0 * fewest + 5.0, "{} chords, {fewest}", chords.len());
        }
    }

    #[test]
    fn a_whole_circle_and_what_is_none() {
        let circle: Vec<_> =
            Arc::new([7000, 2000], [7000, 2000], [2000, 2000], Turning::Clockwise, 1500).unwrap().collect();
        assert_eq!(circle, [[2000, -3000], [-3000, 2000], [2000, 7000], [7000, 2000]]);
        for (from, to) in [([5, 5], [9, 9]), ([15, 5], [5, 25]), ([i32::MAX, 5], [i32::MAX, 5])] {
            assert!(
                matches!(Arc::new(from, to, [5, 5], Turning::Counterclockwise, 1), Err(Error::ArcRadius { .. })),
                "{from:?}"
            );
        }
        let half: Vec<_> = Arc::new([100, 0], [-100, 0], [0, 0], Turning::Counterclockwise, 50).unwrap().collect();
        assert_eq!(half, [[0, 100], [-100, 0]]);
    }

    #[test]
    fn what_is_just_allowed() {
        let most = i32::try_from(Arc::MAX_RADIUS).unwrap();
        assert_eq!(Arc::new([most, 0], [0, most], [0, 0], Turning::Counterclockwise, 1 << 29).unwrap().count(), 1);
        assert!(Arc::new([most + 1, 0], [0, most + 1], [0, 0], Turning::Counterclockwise, 1 << 29).is_err());
        // 5 units and a thousandth of 1000.
        assert!(Arc::new([1000, 0], [0, 1006], [0, 0], Turning::Counterclockwise, 5).is_ok());
        assert!(Arc::new([1000, 0], [0, 1007], [0, 0], Turning::Counterclockwise, 5).is_err());
        // With 3, 4, 5 the chord is 5 - 4 from the arc: just as much as is allowed, and more.
        let chords =
            |error| Arc::new([300, 400], [-300, 400], [0, 0], Turning::Counterclockwise, error).unwrap().count();
        assert_eq!((chords(100), chords(99)), (1, 2));
    }

    /// 5000 cos 45° = 3535.53; and the roots of 2, 5 and 8 are 1.41, 2.24 and 2.83.
    #[test]
    fn all_is_to_the_nearest() {
        let half: Vec<_> = Arc::new([5000, 0], [0, 5000], [0, 0], Turning::Counterclockwise, 500).unwrap().collect();
        assert_eq!(half, [[3536, 3536], [0, 5000]]);
        for (from, radius) in [([1, 1], 1), ([1, 2], 2), ([2, 2], 3)] {
            let refused = Arc::new(from, [100, 0], [0, 0], Turning::Counterclockwise, 1);
            assert!(matches!(refused, Err(Error::ArcRadius { from, to: 100 }) if from == radius), "{refused:?}");
        }
    }
}
