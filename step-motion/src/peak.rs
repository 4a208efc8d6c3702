//! The peak speed of a jerk-limited move that never cruises.
//!
//! Seen from the peak, the move is two slopes downwards: one to the lower end speed, one to the higher. Where a slope does
//! not reach the greatest
//! acceleration, its change of speed is j x² and its distance (2 v + j x²) x, with v its lower speed and x the time of either
//! jerk. The distance of the move is therefore a polynomial of degree 4 in a time. Its root is found to 16 bits in 32-bit
//! words, and then refined to 48 bits by one third-order step.

use crate::limits::{Bounds, Jerk};
use crate::real::Real;

/// The end speeds of the slopes, the lower one first, and the total distance of both.
pub(super) struct Peak {
    pub(super) low: Real,
    pub(super) high: Real,
    pub(super) n: Real,
}

impl Peak {
    /// The peak speed. The distance must be enough for the change from one end speed to the other.
    pub(super) fn speed(&self, bounds: &Bounds, jerk: &Jerk) -> Real {
        let Self { low, high, n } = *self;
        if n.is_zero() {
            return high;
        }
        let (between, edge) = (high - low, jerk.edge);
        let apart = between * jerk.per_j;
        // From this peak speed upwards, the slope to the lower speed reaches the greatest acceleration.
        let full = low + jerk.knee;
        let over = n - (low + full) * edge;
        let square = edge.squared();
        let is_short = || over.squared() < (high + full).squared() * (square - apart);
        let x = if over.is_zero() || full > high && is_short() {
            self.bends(jerk, apart)
        } else {
            // From this one upwards, the other slope does too.
            let full = high + jerk.knee;
            let time = between * bounds.per_a + edge;
            let way = (high + full) * edge + (low + full).half() * (time + edge);
            if n >= way {
                return self.trapezoids(bounds, jerk);
            }
            self.trapezoid_and_bend(jerk, square, time)
        };
        high + jerk.j * x.squared()
    }

    /// Returns the peak speed if both slopes reach the greatest acceleration: v² + (a²/j) v = a n + (v0² + v1²) / 2 - (v0 +
    /// v1) a²/2j.
    fn trapezoids(&self, bounds: &Bounds, jerk: &Jerk) -> Real {
        let knee = jerk.knee.half();
        let sum = bounds.a * self.n + (self.low.squared() + self.high.squared()).half();
        let rest = sum - (self.low + self.high) * knee;
        rest / (knee + (knee.squared() + rest).sqrt())
    }

    /// Returns the jerk time of the slope to the higher speed, if only the other slope reaches the greatest acceleration.
    ///
    /// With e the time to the greatest acceleration and u = 2 v1 / j, x² (x + e)² + u x (x + 2e) = 2e/j (n - n0). n0 is the
    /// distance from one end speed to the other in the `time` that this would take if the slope reached that acceleration;
    /// `square` is e².
    fn trapezoid_and_bend(&self, jerk: &Jerk, square: Real, time: Real) -> Real {
        let edge = jerk.edge;
        let n0 = (self.low + self.high).half() * time;
        let twice = edge.scaled(1) * jerk.per_j;
        let right = (self.n - n0) * twice;
        let u = self.high.scaled(1) * jerk.per_j;
        let ue = u * edge;
        let x = rough([right, ue.scaled(1), u + square, edge.scaled(1)], false, edge.exponent().wrapping_add(1));
        let t = x + edge;
        let (xt, ut, sum) = (x * t, u * t, x + t);
        let left = xt.squared() + x * (ut + ue);
        nearer(x, [left, right], (xt * sum + ut).scaled(1), sum.squared() + xt.scaled(1) + u)
    }

    /// Returns the jerk time of the slope to the higher speed, if neither slope reaches the greatest acceleration.
    ///
    /// With z the jerk time of the other slope, z² - x² = (v1 - v0) / j = k is `apart`. With w = x + z, x = (w - k/w) / 2, and
    /// w⁴ + 4 (v0 + v1) / j w² = 4n/j w + k².
    fn bends(&self, jerk: &Jerk, apart: Real) -> Real {
        let square = ((self.low + self.high) * jerk.per_j).scaled(2);
        let linear = (self.n * jerk.per_j).scaled(2);
        let rest = apart.squared();
        // w³ + square w = linear + k²/w, where w is not below the root of k.
        let twice = linear.exponent().wrapping_add(2);
        let most = twice.wrapping_add(2).div_euclid(3).min(twice.wrapping_sub(square.exponent()));
        let most = most.max((apart.exponent() >> 1).wrapping_add(2));
        let w = rough([rest, linear, square, Real::ZERO], true, most);
        let squared = w.squared();
        let sum = squared + square;
        let slope = ((sum + squared) * w).scaled(1) - linear;
        let w = nearer(w, [sum * squared, linear * w + rest], slope, sum + squared + squared.scaled(2));
        if apart.is_zero() { w.half() } else { (w - apart / w).half() }
    }
}

/// Returns a better approximation of the root, by Chebyshev's method of third order. `slope` is the derivative of `left` -
/// `right`, and `bend` half of their second derivative.
fn nearer(x: Real, [left, right]: [Real; 2], slope: Real, bend: Real) -> Real {
    let per = Real::ONE / slope;
    let by = left.distance(right) * per;
    x.along(by, left < right) - by.squared() * bend * per
}

/// Returns the root of x⁴ + c3 x³ + c2 x² + c1 x = c0, or with c1 on the `other` side, not above 2^`most`; exact to at
/// least 16 bits.
///
/// Uses Newton's method from 2^`most` downwards, in units of 2^`most` and of the greatest coefficient.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers of 31 bits")]
fn rough([c0, c1, c2, c3]: [Real; 4], other: bool, most: i32) -> Real {
    let scaled = |c: Real, by: i32| c.scaled(most.wrapping_mul(by));
    let terms = [c0, scaled(c1, 1), scaled(c2, 2), scaled(c3, 3), scaled(Real::ONE, 4)];
    let top = terms.iter().map(|term| term.exponent()).max().unwrap_or(0);
    let [c0, c1, c2, c3, c4] = terms.map(|term| term.to_fixed(26_i32.wrapping_sub(top)) as i32);
    let c1 = if other { c1.wrapping_neg() } else { c1 };
    let mut x = i32::MAX;
    for _ in 0..12 {
        let times = |c: i32| (i64::from(c).wrapping_mul(x.into()) >> 31) as i32;
        let (mut value, mut slope) = (c4, c4);
        for c in [c3, c2, c1] {
            value = times(value).wrapping_add(c);
            slope = times(slope).wrapping_add(value);
        }
        value = times(value).wrapping_sub(c0);
        let zeros = slope.leading_zeros();
        let Some(inverse) = (1_u32 << 31).checked_div((slope as u32).wrapping_shl(zeros) >> 16) else { break };
        let step = (i64::from(value).wrapping_mul(inverse.into()) << zeros >> 16) as i32;
        x = x.saturating_sub(step);
        // The next step is about the square of this one.
        if step < 1 << 16 {
            break;
        }
    }
    Real::fixed(x.max(0) as u64, 31).scaled(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slope::distance;
    use proptest::prelude::*;

    /// The peak is exact to 46 bits: a slightly lower one needs no more than the distance, a slightly higher one no less.
    fn check(low: Real, high: Real, n: Real, bounds: &Bounds) -> Result<(), TestCaseError> {
        let need = |v| distance(low, v, bounds) + distance(v, high, bounds);
        if n < need(high) {
            return Ok(());
        }
        let v = Peak { low, high, n }.speed(bounds, &bounds.jerk.unwrap());
        let part = v.scaled(-46);
        let (less, more) = ((v - part).max(high), v + part);
        prop_assert!(v >= high, "{v:?} for {n:?} from {low:?} {high:?}");
        prop_assert!(need(less) <= n && n <= need(more), "{v:?} for {n:?} from {low:?} {high:?}");
        Ok(())
    }

    fn number() -> impl Strategy<Value = Real> {
        (1_u64 << 52..1 << 53, -20..20_i32).prop_map(|(m, e)| Real::fixed(m, 52).scaled(e))
    }

    /// In units of the change of speed that just reaches the greatest acceleration, and of its distance from rest; over the
    /// whole range that a nanosecond clock allows.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn the_peak_needs_the_distance() {
        let ends = prop_oneof![Just(Real::ZERO), number()];
        let all = (ends.clone(), ends, number(), -30..30_i32, -30..30_i32);
        proptest!(ProptestConfig::with_cases(20_000), |((low, more, n, a, j) in all)| {
            let bounds = Bounds::new(Real::HUGE, Real::ONE.scaled(a), Some(Real::ONE.scaled(j)));
            let Jerk { edge, knee, .. } = bounds.jerk.unwrap();
            let (low, high) = (low * knee, (low + more) * knee);
            check(low, high, n * (knee * edge), &bounds)?;
            // That much above the minimum, and about as much as reaches the greatest acceleration once or twice.
            let least = distance(low, high, &bounds);
            check(low, high, least + n * (knee * edge), &bounds)?;
            for full in [low + knee, (low + high).half() + knee, high + knee] {
                let far = distance(low, full, &bounds) + distance(full, high, &bounds);
                check(low, high, far, &bounds)?;
                check(low, high, far + far.scaled(-50), &bounds)?;
                check(low, high, far - far.scaled(-50), &bounds)?;
            }
        });
    }

    /// From rest to v and back the distance is 2 v sqrt(v / j).
    #[test]
    fn from_rest_to_rest() {
        let bounds = Bounds::new(Real::HUGE, Real::new(1000), Some(Real::new(8)));
        let v = |n| Peak { low: Real::ZERO, high: Real::ZERO, n: Real::new(n) }.speed(&bounds, &bounds.jerk.unwrap());
        for root in 1..100 {
            let want = Real::new(8 * root * root);
            let got = v(16 * root * root * root);
            assert!(got.distance(want) <= want.scaled(-48), "{got:?} for {want:?}");
        }
        assert_eq!(v(0), Real::ZERO);
    }
}
