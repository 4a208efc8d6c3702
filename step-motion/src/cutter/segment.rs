//! The segments that fit into a piece.

use super::Demand;
use super::part::{ALL, LONGEST, Part, Spot, along};
use super::stretch::Stretch;
use crate::real::{Inverse, THIRD_OF_A_WORD, high, middle, upper};

/// Maximum number of steps in a segment; a segment of a stop that is only a precaution may have more.
const MOST: u32 = 512;
const MOST_COARSE: u32 = 2048;
/// A segment this short has no advantage over steps found one by one.
const FEW: u32 = 1;
/// One that is expected to have fewer steps than this, as a power of 2 in 256ths, is not tried.
const FEWEST: i32 = 384;
/// How many other ends are tried.
const TRIES: u8 = 6;

impl Part {
    /// Returns a segment that begins at a place and has as many steps as it may, and where it ends. `count` steps have been
    /// made, and `left` are left of
    /// the piece.
    pub(super) fn many(
        &self,
        (count, left): (u32, u32),
        begin: &Spot,
        next: Option<u64>,
        demand: &Demand,
    ) -> Option<(Stretch, Spot, u64)> {
        if begin.pace >= LONGEST {
            return None;
        }
        let first = self.ahead(begin.way, self.place(count))?;
        if first.saturating_sub(1 << (self.bits & 63)) >> (self.bits.wrapping_sub(16) & 63) != 0 {
            // The line begins later than the piece.
            return None;
        }
        let step = begin.v.of(self.step);
        // Off to either side by half of it, if it may be.
        let even = demand.coarse.is_none() && self.is_bent_one_way();
        let (most, cap) = match demand.coarse {
            Some(by) => (self.off.max(step >> by), MOST_COARSE),
            None => (self.off << u32::from(even), MOST),
        };
        let limit = if self.back { begin.time } else { !begin.time };
        let longest = self.part_of(demand.time.min(ALL - 1)).max(1);
        let mut long = match next {
            Some(long) => long,
            None => self.about(step, begin, most)?,
        };
        long = long.min(longest);
        for _ in 0..TRIES {
            let whole = long >= limit;
            // Makes two of about the same length, rather than a long one and a short one.
            long = if whole { limit } else { long.min((limit >> 1).saturating_add(1)) };
            let end = self.spot(along(begin.time, long, !self.back))?;
            let off = self.off_by(begin, &end);
            if off > most {
                let by = (log(most).saturating_sub(log(off)) >> 2).clamp(-1024, -32);
                long = power(long, by);
                continue;
            }
            let way = end.way.abs_diff(begin.way);
            let mut steps = way.checked_sub(first).map_or(0, |rest| (rest >> self.bits).saturating_add(1));
            if whole && u64::from(left) <= steps.saturating_add(1) {
                // The last step lies here, apart from rounding.
                steps = left.into();
            }
            let steps = u32::try_from(steps).unwrap_or(u32::MAX).min(left);
            if steps > cap {
                long = long.checked_div(steps.into()).unwrap_or(0).saturating_mul(cap.saturating_sub(1).into());
                continue;
            }
            if steps == 0 || steps <= FEW && steps < left && long < longest {
                return None;
            }
            let mut stretch = self.join([begin, &end], way, first)?;
            if even {
                let half = i128::from(self.ticks(off) >> 1);
                stretch.first = stretch.first.wrapping_add(if self.back { half } else { half.wrapping_neg() });
            }
            // The error grows with the fourth power of the time, and by itself while the axis slows down.
            let by = log(most).saturating_sub(log(off)).saturating_sub(if self.back { 256 } else { 0 }) >> 2;
            return Some((
                Stretch { count: u16::try_from(steps).ok()?, ..stretch },
                end,
                power(long, by.clamp(-256, 256)),
            ));
        }
        None
    }

    /// Returns the distance from one position to another in the direction of motion; `None` if the other is behind.
    fn ahead(&self, from: u64, to: i64) -> Option<u64> {
        let to = u64::try_from(to);
        if self.back { from.checked_sub(to.unwrap_or(0)) } else { to.ok()?.checked_sub(from) }
    }

    /// Estimates the time that a segment may take; `None` if it would have only a few steps. The estimate starts from one
    /// step at that speed: the time that it takes, and half of the change of speed.
    fn about(&self, step: u64, begin: &Spot, most: u64) -> Option<u64> {
        let w = begin.v.of(high(begin.half, step));
        let y = if self.sixth == 0 { 0 } else { begin.v.of(high(high(self.sixth, step), step)) };
        // The error grows with the fourth power.
        let one =
            log(step).saturating_add(log(w)).saturating_add(log(self.bend(w, y))).saturating_sub(2 * 64 * 256 + 430);
        let steps = log(most).saturating_sub(one) >> 2;
        if steps < FEWEST {
            return None;
        }
        let w = power(w, steps.min(32 * 256));
        let d = power(step, steps.min(40 * 256));
        // Faster at its end, or slower.
        let by = if self.back { w.saturating_mul(4) } else { w };
        Some(along(d, high(d, by), false).max(d >> 2))
    }

    /// Returns how far off a segment is at most: distance⁴ / 384 times the greatest fourth derivative.
    ///
    /// That is (10 a j v - 15 a³) / v⁷. With d the time of the distance at the lower speed, w = a d / v and y = j d² / v it
    /// is d (15 w³ + 10 w y) / 384,
    /// or only the greater of the two terms if they have different signs. In the code w is half of that value, and y a sixth.
    ///
    /// Computed in 32-bit words and rounded up.
    fn off_by(&self, from: &Spot, to: &Spot) -> u64 {
        let word = |x: u64| word(x).saturating_add(1);
        let slow = if self.back { to.v } else { from.v };
        let d = word(slow.of(from.p.abs_diff(to.p)));
        let w = slow.rough(upper(word(from.half.max(to.half)), d));
        let y = if self.sixth == 0 { 0 } else { slow.rough(upper(upper(word(self.sixth), d), d)) };
        if d == u32::MAX || w >> 30 != 0 {
            return u64::MAX;
        }
        let off = high(u64::from(d).wrapping_mul(w.into()), self.bend(u64::from(w) << 32, u64::from(y) << 32));
        (off >> 2).saturating_add(off >> 4)
    }

    /// Returns the segment that joins two places, from the pace at each and the time between them; `way` and `first` step
    /// are in 2^-`bits` steps.
    fn join(&self, [from, to]: [&Spot; 2], way: u64, first: u64) -> Option<Stretch> {
        if to.pace >= LONGEST {
            return None;
        }
        let (per, down) = Inverse::new(way).part(self.bits)?;
        let mean = high(self.ticks(from.time.abs_diff(to.time)), per) >> (down & 63);
        let [begin, mean, end] = [from.pace, mean, to.pace].map(|pace| i64::try_from(pace).unwrap_or(0));
        let x = if first >> self.bits == 0 { first << (64_u32.wrapping_sub(self.bits) & 63) } else { u64::MAX };
        // begin u + b u² + c u³; what rounding takes from c is given to b, so that the end is met.
        let over = |x: i64| times(x, word(per)) >> (down & 63);
        let bow = begin.wrapping_add(end).wrapping_sub(mean << 1);
        let c6 = over(over(bow.wrapping_mul(6)));
        let bend = i64::try_from(middle(c6.unsigned_abs(), way, self.bits)).unwrap_or(0);
        let bend = times(if c6 < 0 { bend.wrapping_neg() } else { bend }, THIRD_OF_A_WORD);
        let b2 = over(mean.wrapping_sub(begin) << 1).wrapping_sub(bend);
        let part = word(x);
        let c = times(c6, SIXTH);
        let slope = begin.wrapping_add(times((b2 >> 1).wrapping_add(times(c, part)), part));
        let start = high(u64::try_from(slope).unwrap_or(0), x);
        let add = b2.wrapping_add(times(c6, part)).wrapping_add(c6);
        let interval = begin.wrapping_add(b2 >> 1).wrapping_add(c).wrapping_add(times(b2.wrapping_add(add) >> 1, part));
        Some(Stretch {
            count: 0,
            first: self.tick(from.time).wrapping_add(start.into()),
            differences: [interval, add, c6],
        })
    }
}

/// 2^32 / 6.
const SIXTH: u32 = u32::MAX / 6 + 1;

/// Returns the upper half of a number.
const fn word(x: u64) -> u32 {
    (x >> 32) as u32
}

/// Multiplies a number by a fraction.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "halves of a number"
)]
const fn times(x: i64, part: u32) -> i64 {
    let low = (x as u32 as u64).wrapping_mul(part as u64) >> 32;
    (x >> 32).wrapping_mul(part as i64).wrapping_add(low as i64)
}

/// Returns the base-2 logarithm in 256ths, linear between the powers of 2: at most 22 too small.
#[inline(never)]
pub(super) fn log(x: u64) -> i32 {
    let zeros = x.leading_zeros();
    let part = x.checked_shl(zeros).unwrap_or(0) << 1 >> 56;
    i32::try_from(u64::from(63_u32.saturating_sub(zeros)) << 8 | part).unwrap_or(0)
}

/// Multiplies a number by a power of 2 whose exponent is in 256ths, linear between whole exponents: at most 6 per cent too
/// much.
pub(super) fn power(x: u64, by: i32) -> u64 {
    let part = u64::from(by.rem_euclid(256).unsigned_abs());
    let x = x.saturating_add(high(x, part << 56));
    let whole = by >> 8;
    if whole < 0 {
        x.checked_shr(whole.unsigned_abs()).unwrap_or(0)
    } else if whole.unsigned_abs() < x.leading_zeros() {
        x << whole
    } else {
        u64::MAX
    }
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "numbers compared with floating point")]
mod tests {
    use super::super::part::Slower;
    use super::*;
    use crate::curve::{Bend, Curve};
    use crate::phases::Frame;
    use crate::real::Real;

    #[test]
    fn logarithms_and_powers() {
        for bits in 0..64 {
            for x in [1_u64 << 63, u64::MAX, 3 << 62, 0xb504_f333 << 32, 0x9_0101 << 44].map(|x| x >> bits) {
                let (got, exact) = (log(x), (x as f64).log2() * 256.0);
                assert!(f64::from(got) > exact - 24.0 && f64::from(got) <= exact + 0.1, "{got} for {exact}");
            }
        }
        for by in -3000..3000 {
            for x in [1 << 16, 1 << 40, 0xb504_f333_u64] {
                let (got, exact) = (power(x, by), x as f64 * (f64::from(by) / 256.0).exp2());
                if exact < 2_f64.powi(62) {
                    assert!(got as f64 <= exact * 1.062 && got as f64 + 1.0 >= exact * 0.9999, "{got} for {exact}");
                } else {
                    assert!(got as f64 >= exact.min(2_f64.powi(63)), "{got} for {exact}");
                }
            }
        }
        assert_eq!(
            [power(1, -1 << 20), power(1 << 20, 0), power(1, 63 << 8), power(3, 1 << 30)],
            [0, 1 << 20, u64::MAX, u64::MAX]
        );
    }

    /// A piece of so many steps, as a power of 2, and 2^30 ticks, whose slower end has half the mean speed; how far off they may be, in
    /// moments.
    fn part(steps: i32, back: bool, off: Real) -> Part {
        let (mut curve, slow) = (Curve::new(), Real::ONE.scaled(steps - 41));
        let v = if back { slow + slow.scaled(1) } else { slow };
        let state = [v, Real::ONE.scaled(steps - 80), Real::ZERO];
        curve.push((Real::new(1 << 40), Real::new(1 << steps)), state, !back, Bend::Flat);
        let frame = Frame { to: None, ..Frame::rest(10, 0, 0) };
        Part::new(&Slower::new(&curve, &frame, curve.piece(0).unwrap()), &frame, off)
    }

    /// The first estimate is off by about as much as may be.
    #[test]
    fn a_first_estimate() {
        for back in [false, true] {
            let part = part(16, back, Real::ZERO);
            for time in [1 << 61, 3 << 62, 5 << 61, 15 << 60] {
                let begin = part.spot(time).unwrap();
                for most in (16..40).map(|by| 1 << by) {
                    let step = begin.v.of(part.step);
                    let Some(about) = part.about(step, &begin, most) else { continue };
                    let to = along(time, about, !back);
                    let off = part.off_by(&begin, &part.spot(to).unwrap());
                    assert!(off >> 4 <= most && off >= most >> 5, "{off} for {most} from {time}, {about}, {back}");
                }
            }
        }
    }

    /// A segment begins at the next step: if that is more than a step ahead, there is none.
    #[test]
    fn a_segment_begins_at_a_step() {
        for (steps, back) in [(16, false), (16, true), (22, false), (22, true)] {
            let part = part(steps, back, Real::ONE);
            // As long as 32 steps.
            let about = Some(1 << (69 - steps));
            let demand = Demand { off: Real::ZERO, coarse: None, time: u64::MAX, searches: 2 };
            let begin = part.spot(1 << 63).unwrap();
            let next = (0..1 << steps).find(|count| part.ahead(begin.way, part.place(*count)).is_some()).unwrap();
            for (more, some) in [(-1, false), (0, true), (1, false), (9, false)] {
                let got = part.many((next.wrapping_add_signed(more), 1000), &begin, about, &demand);
                assert_eq!(got.is_some(), some, "{more} {steps} {back}");
            }
        }
    }
}
