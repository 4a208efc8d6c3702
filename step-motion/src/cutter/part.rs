//! A piece of a curve, scaled to its own time and distance, and the segments that fit into it.

use super::stretch::Stretch;
use crate::curve::{Bend, Curve, Piece};
use crate::phases::{Frame, P};
use crate::real::{Inverse, Real, THIRD, high};

/// A piece seen from its slower end. Times are in 2^-64 of its duration, distances in 2^-62 of its length, and speeds in
/// 2^-62 of its mean speed.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Part {
    /// The speed, half the acceleration and a sixth of the jerk at the slower end, and whether that is the end of the piece.
    speed: u64,
    half: u64,
    pub(super) sixth: u64,
    /// The jerk adds to the acceleration.
    grows: bool,
    pub(super) back: bool,
    /// The speed is constant, so nothing is scaled.
    pub(super) even: bool,
    /// Time and position of the slower end: in 2^-32 ticks of the clock, and in 2^-64 steps from position 0.
    begin: i128,
    origin: i128,
    /// Duration of the piece, also as a divisor, and of a step at its mean speed, in 2^-32 ticks.
    lasts: Real,
    per: Inverse,
    pace: Real,
    /// Length of the piece in twice the unit of positions (a step has 2^`bits` of those), the same as a divisor with the
    /// power of 2 of its unit, and a step as a part of the length.
    steps: Real,
    pub(super) bits: u32,
    /// Distance from the place of step 0 to the slower end, in the unit of positions, modulo 2^64.
    first: i64,
    way: (Inverse, i32),
    pub(super) step: u64,
    /// How far off a step may be.
    pub(super) off: u64,
}

/// The slower end of a piece, or of what is left of the piece after the point where the curve was joined.
pub(super) struct Slower {
    /// Speed, acceleration and jerk there.
    pub(super) v: Real,
    pub(super) a: Real,
    pub(super) j: Real,
    /// It is the end of the piece, rather than the start.
    pub(super) back: bool,
    /// The speed of the piece is constant; or the acceleration grows from here on.
    even: bool,
    grows: bool,
    /// Duration of the piece, in moments.
    pub(super) lasts: Real,
    /// Time and position there: in 2^-32 ticks of the clock, and in 2^-64 steps from position 0.
    pub(super) begin: i128,
    pub(super) origin: i128,
}

impl Slower {
    /// Finds it for a piece that ends at a time and a place.
    pub(super) fn new(curve: &Curve, frame: &Frame, (piece, (end, p_end)): (&Piece, (Real, Real))) -> Self {
        let &Piece { time, p, v, a, j, up, bend } = piece;
        let (joined, skipped) = curve.skipped;
        let even = a.is_zero() && j.is_zero();
        let back = !up && !even;
        let begin = time.max(joined);
        let lasts = end - begin;
        let (time, p, (v, a)) = if back {
            (end, p_end, piece.speed(end - time))
        } else if begin == time {
            (time, p, (v, a))
        } else {
            let Piece { time, p, v, a, .. } = piece.after(begin - time);
            (time, p, (v, a))
        };
        let bits = bits(frame);
        // Each is less than 2^126.
        let since = frame.since(curve, time).to_wide(bits);
        let begin = (i128::from(frame.begin) << (bits.unsigned_abs() & 63)).wrapping_add(since);
        let steps = |p: Real| (p * frame.scale).to_wide(P2);
        let origin = (i128::from(frame.from) << P).wrapping_add(steps(p).wrapping_sub(steps(skipped)));
        Self { v, a, j, back, even, grows: (bend != Bend::Fading) != back, lasts, begin, origin }
    }
}

/// A moment has 2^this times 2^-32 ticks.
pub(super) fn bits(frame: &Frame) -> i32 {
    32_i32.saturating_sub(i32::try_from(frame.shift).unwrap_or(0))
}

/// Fraction bits of a position in this file.
pub(super) const P2: i32 = 2 * P;
/// Fraction bits of a position that has to be as exact as a step.
const FINEST: i32 = 44;
/// Intervals within a segment are below 2^28 ticks, so that three of them do not overflow.
pub(super) const LONGEST: u64 = 1 << 60;
/// Maximum duration of a segment.
pub(super) const ALL: u64 = 1 << 62;

/// A correction of a time after which it is exact, whatever the acceleration is.
const CLOSE: u64 = 1 << 20;

/// A step so much shorter than the time from the slower end, as a power of 2, is exact if the acceleration is taken into
/// account: the error is about the cube of that ratio.
const NEAR: u32 = 21;

/// A position, with the speed and half the acceleration at it.
struct Place {
    p: u64,
    v: u64,
    half: u64,
}

/// Where a segment may begin.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Spot {
    pub(super) time: u64,
    pub(super) p: u64,
    pub(super) half: u64,
    /// The speed, as a divisor.
    pub(super) v: Inverse,
    /// Its distance from the slower end in parts of a step, and the pace there in 2^-32 ticks per step.
    pub(super) way: u64,
    pub(super) pace: u64,
}

impl Part {
    /// All bytes are zero, so it is cleared rather than copied.
    pub(super) const NONE: Self = Self {
        speed: 0,
        half: 0,
        sixth: 0,
        grows: false,
        back: false,
        even: false,
        begin: 0,
        origin: 0,
        lasts: Real::ZERO,
        per: Inverse::NONE,
        pace: Real::ZERO,
        steps: Real::ZERO,
        bits: 0,
        first: 0,
        way: (Inverse::NONE, 0),
        step: 0,
        off: 0,
    };

    /// Scales a piece.
    pub(super) fn new(slower: &Slower, frame: &Frame, off: Real) -> Self {
        let Slower { v, a, j, back, even, grows, lasts: time, begin, origin } = *slower;
        let (scale, bits) = (frame.scale, bits(frame));
        let own = Self { grows, back, even, begin, origin, ..Self::NONE };
        if even {
            return Self { pace: (Real::ONE / (v * scale)).scaled(bits), ..own };
        }
        let (v, a, j) = (v * time, a * time.squared().half(), j * (time.squared() * time) * (THIRD.half()));
        let all = (v + a).along(j, own.grows);
        let way = all * scale;
        let step = Real::ONE / way;
        let per = step * scale;
        let part = |x: Real| (x * per).to_fixed(62);
        let lasts = time.scaled(bits);
        // Up to 2^63 for all of it.
        let bits = 62_i32.saturating_sub(way.exponent()).clamp(P, FINEST);
        Self {
            speed: part(v),
            half: part(a),
            sixth: part(j),
            lasts,
            per: lasts.inverse().0,
            pace: lasts * step,
            steps: way.scaled(bits.saturating_add(1)),
            bits: bits.unsigned_abs(),
            first: own.first_of(bits.unsigned_abs()),
            way: way.inverse(),
            step: step.to_fixed(62),
            off: (off / time).to_fixed(64),
            ..own
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "modulo 2^64, of which a piece has no more than half")]
    const fn first_of(&self, bits: u32) -> i64 {
        let origin = (self.origin >> (64_u32.wrapping_sub(bits) & 63)) as i64;
        origin.wrapping_sub(1 << (bits.wrapping_sub(1) & 63))
    }

    /// Returns when the piece begins.
    pub(super) const fn entry(&self) -> u64 {
        if self.back { u64::MAX } else { 0 }
    }

    /// Returns the place at a time; `None` at rest.
    pub(super) fn spot(&self, time: u64) -> Option<Spot> {
        let Place { p, v, half } = self.at(time);
        if v == 0 {
            return None;
        }
        let v = Inverse::new(v);
        Some(Spot { time, p, half, v, way: self.steps.part(p << 1), pace: self.pace.over(v) })
    }

    /// Distance from the slower end to the place of step `count`, in parts of a step.
    pub(super) const fn place(&self, count: u32) -> i64 {
        let at = ((count as i64) << (self.bits & 63)).wrapping_sub(self.first);
        if self.back { at.wrapping_neg() } else { at }
    }

    /// Converts a part of the piece's time to 2^-32 ticks.
    pub(super) const fn ticks(&self, part: u64) -> u64 {
        self.lasts.part(part)
    }

    /// Converts 2^-32 ticks to a part of the piece's time; the greatest number for its whole time or more. In a piece of
    /// 2^32 ticks or more the later parts come out too small: enough for where a search begins.
    pub(super) fn part_of(&self, ticks: u64) -> u64 {
        let part = self.per.of(ticks);
        let up = self.lasts.exponent().saturating_sub(63);
        let by = up.unsigned_abs();
        if up >= 0 {
            part.checked_shr(by).unwrap_or(0)
        } else if by <= part.leading_zeros() {
            part.checked_shl(by).unwrap_or(0)
        } else {
            u64::MAX
        }
    }

    /// Distance from the slower end to the place of step `count` (from 0), in 2^-64 steps; below 0 or beyond the other end
    /// if the step was due when a request came.
    fn away(&self, count: u32) -> i128 {
        let at = (i128::from(count) << P2).saturating_add(1 << (P2 - 1)).saturating_sub(self.origin);
        if self.back { at.saturating_neg() } else { at }
    }

    /// Returns the same distance as a part of the piece's length.
    fn target(&self, count: u32) -> u64 {
        let (way, unit) = self.way;
        let away = self.away(count).max(0);
        let down = unit.saturating_add(P2);
        let away = if down < 0 { away << down.unsigned_abs().min(63) } else { away >> down.unsigned_abs().min(127) };
        way.of(u64::try_from(away).unwrap_or(u64::MAX)) >> 2
    }

    /// Converts a time of the piece to the clock, in 2^-32 ticks.
    #[inline(never)]
    pub(super) fn tick(&self, time: u64) -> i128 {
        let since = if self.lasts.exponent() < 64 { self.ticks(time).into() } else { self.lasts.times(time, -64) };
        if self.back { self.begin.saturating_sub(since) } else { self.begin.saturating_add(since) }
    }

    /// Converts a time on the clock, in 2^-32 ticks, to one of the piece.
    pub(super) fn time(&self, tick: i128) -> u64 {
        let since = if self.back { self.begin.saturating_sub(tick) } else { tick.saturating_sub(self.begin) };
        self.part_of(u64::try_from(since.max(0)).unwrap_or(u64::MAX))
    }

    /// Returns whether the fourth derivative keeps the sign of the acceleration from end to end.
    pub(super) const fn is_bent_one_way(&self) -> bool {
        !self.grows || self.sixth == 0 || self.speed == 0
    }

    /// Combines w² and y for the fourth derivative of a segment: their sum, or the greater one if their signs differ.
    pub(super) fn bend(&self, w: u64, y: u64) -> u64 {
        let square = high(w, w);
        if self.grows { square.max(y) } else { square.saturating_add(y) }
    }

    /// Returns up to `left` steps at constant speed.
    pub(super) fn cruise(&self, (count, left): (u32, u32), time: u64) -> Stretch {
        let interval = self.pace.to_fixed(0);
        let away = self.away(count);
        let (far, wide) = (away.max(0).unsigned_abs(), 64_u32.saturating_sub(away.max(0).leading_zeros()));
        let far = u64::try_from(far >> wide).unwrap_or(u64::MAX);
        let first = self.begin.saturating_add(self.pace.times(far, P2.saturating_neg().saturating_add_unsigned(wide)));
        let room = if away < 0 || interval >= LONGEST {
            0
        } else {
            time.min(ALL).checked_div(interval).unwrap_or(0).min(0xffff)
        };
        let count = u64::from(left).min(room.max(1));
        let interval = i64::try_from(interval).unwrap_or(0);
        Stretch { count: u16::try_from(count).unwrap_or(1), first, differences: [interval, 0, 0] }
    }

    #[inline(never)]
    fn at(&self, time: u64) -> Place {
        let bent = high(self.sixth, time);
        let bow = high(along(self.half, bent, self.grows), time);
        let thrice = bent.wrapping_mul(3);
        Place {
            p: high(self.speed.wrapping_add(bow), time),
            v: self.speed.wrapping_add(high(along(self.half << 1, thrice, self.grows), time)),
            half: along(self.half, thrice, self.grows),
        }
    }

    /// Returns the time from the slower end to a step: by Newton's method from the `last` one.
    pub(super) fn search(&self, count: u32, last: Option<u64>, near: u64) -> u64 {
        let way = self.target(count);
        let mut time = 0;
        if let Some(last) = last {
            // By the speed, and the change of it: what is left is of the third order.
            let Place { p, v, half } = self.at(last);
            let v = Inverse::new(v);
            let ahead = v.of(p.abs_diff(way));
            let w = v.of(high(half, ahead));
            time = along(last, along(ahead, high(ahead, w), p >= way), p < way);
            if ahead <= last >> NEAR {
                return time;
            }
        }
        if time == 0 || time == u64::MAX {
            time = self.guess(way);
        }
        let mut last = u64::MAX;
        for _ in 0..32 {
            let Place { p, v, .. } = self.at(time);
            let by = Inverse::new(v).of(p.abs_diff(way));
            time = along(time, by, p < way);
            // The error that is left is about the square of this one over the time: near enough, or in the last bit; or
            // rounding is all that is left.
            if by <= near.max(CLOSE) || high(by, by) < high(near, time) || by >= last && by < u64::MAX {
                return time;
            }
            last = by;
        }
        time
    }

    /// Returns at least the time that a distance takes.
    fn guess(&self, way: u64) -> u64 {
        // While the acceleration fades to 0 it makes two thirds at least of what it would make.
        let more = if self.grows { way } else { way.saturating_add(way >> 1) };
        let square = Inverse::new(self.half).of(more).isqrt().saturating_add(1).saturating_mul(1 << 32);
        let mut time = Inverse::new(self.speed).of(way).min(square);
        if self.grows {
            // The third of a power of 2 above a cube.
            let zeros = Inverse::new(self.sixth).of(way).leading_zeros();
            let third = u64::MAX >> zeros.div_euclid(3);
            let third = match zeros.rem_euclid(3) {
                0 => third,
                1 => high(third, 0xcb5 << 52),
                _ => high(third, 0xa15 << 52),
            };
            time = time.min(third);
        }
        time
    }
}

/// Adds or subtracts, saturating at the greatest number or at 0.
pub(super) fn along(x: u64, by: u64, up: bool) -> u64 {
    if up { x.saturating_add(by) } else { x.saturating_sub(by) }
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "numbers compared with floating point")]
mod tests {
    use super::*;

    /// 2^-62 and 2^-64.
    const ONE: u64 = 1 << 62;
    const WHOLE: f64 = 18_446_744_073_709_551_616.0;

    /// Pieces that gather speed and pieces whose acceleration fades, by the shares of their terms in 16ths.
    fn parts() -> impl Iterator<Item = Part> {
        let growing = [[0, 0, 16], [0, 16, 0], [0, 5, 11], [1, 0, 15], [8, 0, 8], [5, 5, 6], [15, 1, 0], [12, 0, 4]];
        let fading = [[0, 24, 8], [1, 20, 5], [8, 12, 4], [0, 20, 4], [15, 1, 0]];
        let part = |grows| {
            move |shares: [u64; 3]| {
                let [speed, half, sixth] = shares.map(|share| share * (ONE / 16));
                Part { speed, half, sixth, grows, ..Part::NONE }
            }
        };
        growing.into_iter().map(part(true)).chain(fading.into_iter().map(part(false)))
    }

    /// 1000 steps, from position 0 or to it.
    fn steps(part: Part, back: bool) -> Part {
        let way = Real::new(1000);
        let origin = if back { 1000 << P2 } else { 0 };
        let own = Part { back, origin, way: way.inverse(), step: (Real::ONE / way).to_fixed(62), ..part };
        Part { bits: P as u32, first: own.first_of(P as u32), steps: way.scaled(P + 1), ..own }
    }

    #[test]
    fn a_guess_is_late_but_not_by_much() {
        for part in parts() {
            for by in 0..60 {
                for time in [u64::MAX, 0xb << 60, 0x9_5555 << 44].map(|time| time >> by) {
                    let way = part.at(time).p;
                    if way < 1 << 12 {
                        continue;
                    }
                    let (guess, most) = (part.guess(way), time as f64 * 1.8);
                    assert!(guess >= time - (time >> 9) && guess as f64 <= most, "{guess} for {time} of {part:?}");
                }
            }
        }
    }

    /// Whatever is known of the step before.
    #[test]
    fn a_search_finds_each_step() {
        for part in parts() {
            for back in [false, true] {
                let part = steps(part, back);
                for count in [0, 1, 2, 17, 500, 501, 998, 999] {
                    let way = part.target(count);
                    let from = part.search(count, None, 0);
                    let lasts =
                        [from, from - (from >> 22), from - (from >> 10), from / 2, from | from >> 3, u64::MAX, 0];
                    for time in lasts.into_iter().map(|last| part.search(count, Some(last), 0)).chain([from]) {
                        let Place { p, v, .. } = part.at(time);
                        let off = p.abs_diff(way);
                        assert!(off <= high(v, 64) + 8, "{off} at {time}, {count} of {part:?}");
                    }
                }
            }
        }
    }

    /// From ticks to parts of a piece and back, from a piece of 2^-40 ticks to one of 2^40 ticks.
    #[test]
    fn times_of_a_piece_and_of_the_clock() {
        for (size, back) in (-7..72).flat_map(|size| [(size, false), (size, true)]) {
            for digits in [4, 5, 6, 7] {
                let lasts = Real::new(digits).scaled(size - 2);
                let part = Part { lasts, per: lasts.inverse().0, back, begin: 1 << 90, ..Part::NONE };
                for time in [u64::MAX, 3 << 62, 1 << 63, 5 << 61, 0x123_4567 << 39, 1 << 40] {
                    let since = (time as f64 / WHOLE) * digits as f64 * 2_f64.powi(size - 2);
                    let tick = part.tick(time) - part.begin;
                    let tick = if back { -tick } else { tick };
                    assert!((tick as f64 - since).abs() <= since * 1e-12 + 1.0, "{tick} for {since}, {size} {digits}");
                    let ticks = part.ticks(time) as f64;
                    assert!(size > 63 || (ticks - since).abs() <= since * 1e-12 + 1.0, "{ticks} for {since}");
                    if tick > 1 << 50 && size < 64 {
                        let got = part.time(part.begin + if back { -tick } else { tick }) as f64;
                        assert!((got - time as f64).abs() <= 1e-12 * WHOLE, "{got} for {time}, {size} {digits}");
                        assert_eq!(part.time(part.begin - if back { -tick } else { tick }), 0);
                    }
                }
                if size < 63 {
                    let whole = part.part_of(lasts.to_fixed(0).saturating_mul(2).saturating_add(2));
                    assert_eq!(whole, u64::MAX, "{size} {digits}");
                }
            }
        }
    }

    /// (10 a j v - 15 a³) / v⁷ is the fourth derivative.
    #[test]
    fn where_the_fourth_derivative_changes_its_sign() {
        for part in parts() {
            let [v, h, s] = [part.speed, part.half, part.sixth].map(|x| x as f64 / ONE as f64);
            let sign = if part.grows { 1.0 } else { -1.0 };
            let (mut up, mut down) = (false, false);
            for t in (1..=1000).map(|t| f64::from(t) / 1000.0) {
                let (v, a, j) =
                    (v + 2.0 * h * t + 3.0 * sign * s * t * t, 2.0 * h + 6.0 * sign * s * t, 6.0 * sign * s);
                let bent = 10.0 * a * j * v - 15.0 * a.powi(3);
                (up, down) = (up || bent > 1e-9, down || bent < -1e-9);
            }
            assert!(!(part.is_bent_one_way() && up && down), "{part:?}");
            assert!(part.is_bent_one_way() || part.grows && part.speed > 0, "{part:?}");
        }
    }

    /// A step that is late already is alone, and so is one before a wait that is too long; the others are as many as fit.
    #[test]
    fn steps_at_constant_speed() {
        let cruise = |(place, pace): (i128, u64), time| {
            // `place` is how far after step 7 the piece begins.
            let origin = (15 << (P2 - 1)) + place;
            let part = Part { even: true, begin: 5000, origin, pace: Real::new(pace), ..Part::NONE };
            let Stretch { count, first, differences } = part.cruise((7, 50), time);
            assert_eq!(differences[1..], [0, 0]);
            (count, first, differences[0])
        };
        assert_eq!(cruise((1, 1000), u64::MAX), (1, 5000, 1000));
        assert_eq!(cruise((0, 1000), u64::MAX), (50, 5000, 1000));
        assert_eq!(cruise((-(1 << P2), 1000), 7999), (7, 6000, 1000));
        assert_eq!(cruise((-(1 << (P2 - 1)), 1000), 0), (1, 5500, 1000));
        assert_eq!(cruise((0, LONGEST - 1), u64::MAX), (4, 5000, (1 << 60) - 1));
        assert_eq!(cruise((0, LONGEST), u64::MAX), (1, 5000, 1 << 60));
        assert_eq!(cruise((0, 1 << 62), u64::MAX).0, 1);
    }
}
