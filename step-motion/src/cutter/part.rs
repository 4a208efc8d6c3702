//! A piece of a curve in parts of itself, and the segments that fit into it.

use super::stretch::Stretch;
use super::{Demand, FEW};
use crate::curve::{Bend, Curve};
use crate::phases::{Frame, P};
use crate::real::{Inverse, Real, THIRD, high};

/// A piece from its slower end. Times are in 2^-64 of its time, ways and speeds in 2^-62 of its way and of that in its time.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Part {
    /// The speed, half the acceleration and a sixth of the jerk at the slower end, which is the end of the piece.
    speed: u64,
    half: u64,
    sixth: u64,
    /// The jerk adds to the acceleration.
    grows: bool,
    pub(super) back: bool,
    /// Constant speed: there are no parts of it.
    pub(super) even: bool,
    /// When and where the slower end is: in 2^-32 ticks of the clock, and 2^-64 steps from where the positions are 0.
    begin: i128,
    origin: i128,
    /// What the piece takes, and what a step takes at its mean speed, in 2^-32 ticks.
    lasts: Real,
    pace: Real,
    /// Its way, with the power of 2 of its unit, and a step of it.
    way: (Inverse, i32),
    pub(super) step: u64,
    /// How far off a step may be.
    pub(super) off: u64,
}

/// Fraction bits of a position here.
const P2: i32 = 2 * P;
/// Intervals within a segment are below 2^28 ticks, so that three of them are no overflow.
pub(super) const LONGEST: u64 = 1 << 60;

/// A position, the speed and half the acceleration there.
struct Place {
    p: u64,
    v: u64,
    half: u64,
}

impl Part {
    pub(super) const NONE: Self = Self {
        speed: 0,
        half: 0,
        sixth: 0,
        grows: false,
        back: false,
        even: true,
        begin: 0,
        origin: 0,
        lasts: Real::ZERO,
        pace: Real::ZERO,
        way: (Inverse::ONE, 0),
        step: 0,
        off: 0,
    };

    /// Of a piece with its end, or of what is left of it where the curve was joined.
    pub(super) fn new(curve: &Curve, frame: &Frame, (piece, end): (&crate::curve::Piece, Real), off: Real) -> Self {
        let begin = piece.time.max(curve.skipped.0);
        let first = piece.after(begin - piece.time);
        let even = piece.a.is_zero() && piece.j.is_zero();
        let back = !piece.up && !even;
        let time = end - begin;
        let slow = if back { first.after(time) } else { first };
        let scale = frame.scale;
        let bits = 32_i32.saturating_sub(i32::try_from(frame.shift).unwrap_or(0));
        let ticks = |time: Real| time.scaled(bits);
        let since = frame.since(curve, slow.time).to_wide(bits);
        let steps = |p: Real| (p * scale).to_wide(P2);
        let own = Self {
            even,
            back,
            grows: (piece.bend != Bend::Fading) != back,
            begin: (i128::from(frame.begin) << bits.unsigned_abs()).saturating_add(since),
            origin: (i128::from(frame.from) << P).saturating_add(steps(slow.p)).saturating_sub(steps(curve.skipped.1)),
            ..Self::NONE
        };
        if even {
            return Self { pace: ticks(Real::ONE / (piece.v * scale)), ..own };
        }
        let (v, a, j) =
            (slow.v * time, slow.a * time.squared().half(), slow.j * (time.squared() * time) * (THIRD.half()));
        let all = (v + a).along(j, own.grows);
        let per = Real::ONE / all;
        let part = |x: Real| (x * per).to_fixed(62);
        let way = all * scale;
        Self {
            speed: part(v),
            half: part(a),
            sixth: part(j),
            lasts: ticks(time),
            pace: ticks(time) / way,
            way: way.inverse(),
            step: (Real::ONE / way).to_fixed(62),
            off: (off / time).to_fixed(64),
            ..own
        }
    }

    /// 2^-64 steps from the slower end to where step `count` (from 0) is made; below 0 or beyond the other end if it was due when a
    /// request came.
    fn away(&self, count: u32) -> i128 {
        let at = (i128::from(count) << P2).saturating_add(1 << (P2 - 1)).saturating_sub(self.origin);
        if self.back { at.saturating_neg() } else { at }
    }

    /// The same as a part of the way.
    fn target(&self, count: u32) -> u64 {
        let (way, unit) = self.way;
        let away = self.away(count).max(0);
        let down = unit.saturating_add(P2);
        let away = if down < 0 { away << down.unsigned_abs().min(63) } else { away >> down.unsigned_abs().min(127) };
        way.of(u64::try_from(away).unwrap_or(u64::MAX)) >> 2
    }

    /// A time on the clock, in 2^-32 ticks.
    pub(super) fn tick(&self, time: u64) -> i128 {
        let since = self.lasts.times(time, -64);
        if self.back { self.begin.saturating_sub(since) } else { self.begin.saturating_add(since) }
    }

    /// Up to `left` steps at constant speed.
    pub(super) fn cruise(&self, count: u32, left: u32, time: u64) -> Stretch {
        let interval = self.pace.to_fixed(0);
        let away = self.away(count);
        let (far, wide) = (away.max(0).unsigned_abs(), 64_u32.saturating_sub(away.max(0).leading_zeros()));
        let far = u64::try_from(far >> wide).unwrap_or(u64::MAX);
        let first = self.begin.saturating_add(self.pace.times(far, P2.saturating_neg().saturating_add_unsigned(wide)));
        let room =
            if away < 0 || interval >= LONGEST { 0 } else { time.checked_div(interval).unwrap_or(0).min(0xffff) };
        let count = u64::from(left).min(room.max(1));
        let interval = i64::try_from(interval).unwrap_or(0);
        Stretch { count: u16::try_from(count).unwrap_or(1), first, differences: [interval, 0, 0] }
    }

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

    /// Two steps or more from the last one on: what the last of them leaves, too.
    pub(super) fn many(
        &self,
        count: u32,
        left: u32,
        (time, v): (u64, Inverse),
        demand: &Demand,
    ) -> Option<(Stretch, (u64, Inverse))> {
        let pace = self.pace.over(v);
        if pace >= LONGEST {
            return None;
        }
        let step = v.of(self.step);
        // Of one step: w / 2. Five steps are not to be more than half of the way to rest.
        let half = self.at(time).half;
        let w = v.of(high(half, step));
        if left >= FEW.into() && w > u64::MAX / 20 {
            return None;
        }
        let y = v.of(high(high(self.sixth, step), step));
        // How far the first three terms may miss.
        let most = demand.coarse.map_or(self.off, |by| self.off.max(step >> by)).saturating_mul(6);
        let long = if demand.coarse.is_some() { 2048 } else { 512 };
        let mut n = about(step, w, y, most).min(left).min(long);
        if pace.saturating_mul(n.into()) > demand.time {
            n = u32::try_from(demand.time.checked_div(pace).unwrap_or(0)).unwrap_or(n);
        }
        let least = left.clamp(2, u32::from(FEW).saturating_add(1));
        while n >= least {
            let x = step.saturating_mul(n.into());
            let (w, y) = (w.saturating_mul(n.into()), y.saturating_mul(u64::from(n).wrapping_mul(n.into())));
            // Half of the way to rest, or as far again as from there, by the greater speed at either end: beyond it the derivative is too far from the same everywhere.
            if w.saturating_add(y.saturating_mul(3)) > u64::MAX >> if self.back { 3 } else { 2 } {
                n = n.saturating_sub((n >> 2).max(1));
                continue;
            }
            let ahead = along(x, high(x, w), self.back).saturating_add(high(x, high(w, w)) << 1);
            let ahead = along(ahead, high(x, y), !self.grows);
            let there = along(time, ahead, !self.back);
            // The end of the piece is as far as a place can be; where they lead beyond it, that is missed, too.
            let beyond = ahead.saturating_sub(if self.back { time } else { !time });
            let Place { p, v, half } = self.at(there);
            let way = self.target(count.saturating_add(n).saturating_sub(1));
            let miss = Inverse::new(v).of(p.abs_diff(way));
            if miss.saturating_add(beyond) <= most {
                let there = along(there, miss, p < way);
                let v_there = Inverse::new(along(v, high(half, miss) << 1, p < way));
                let mean = self.lasts.times(time.abs_diff(there), -64);
                let stretch =
                    self.join(n, time, [pace, u64::try_from(mean).unwrap_or(u64::MAX), self.pace.over(v_there)])?;
                return Some((stretch, (there, v_there)));
            }
            n = n.saturating_sub((n >> 2).max(1));
        }
        None
    }

    /// The segment between two steps from the paces at both, and the time between.
    fn join(&self, count: u32, time: u64, [first, all, last]: [u64; 3]) -> Option<Stretch> {
        if first.max(last) >= LONGEST || all == u64::MAX {
            return None;
        }
        let per = part(count);
        let [first, mean, last] = [first, high(all, per), last].map(|pace| i64::try_from(pace).unwrap_or(0));
        let n = i64::from(count);
        // first u + b u² + c u³; what rounding takes from c is given to b, so that the end is met.
        let bow = first.wrapping_add(last).wrapping_sub(mean << 1);
        let c6 = times(times(bow.wrapping_mul(6), per), per);
        let sixth = |x: i64| times(x, SIXTH);
        let slant = mean.wrapping_sub(first).wrapping_sub(sixth(c6.wrapping_mul(n).wrapping_mul(n)));
        let (b2, c) = (times(slant << 1, per), sixth(c6));
        let start = first.wrapping_add(b2 >> 1).wrapping_add(c);
        Some(Stretch {
            count: u16::try_from(count).ok()?,
            first: self.tick(time).saturating_add(start.into()),
            differences: [start.wrapping_add(b2).wrapping_add(c6), b2.wrapping_add(c6 << 1), c6],
        })
    }

    /// The time from the slower end to a step, and the speed then, by Newton's method.
    pub(super) fn search(&self, count: u32, last: Option<(u64, Inverse)>, near: u64) -> (u64, Inverse) {
        let way = self.target(count);
        let mut time = last.map_or(0, |(last, v)| {
            // By the speed, and the change of it.
            let step = v.of(self.step);
            let w = v.of(high(self.at(last).half, step));
            along(last, along(step, high(step, w), self.back), !self.back)
        });
        if time == 0 || time == u64::MAX {
            time = self.guess(way);
        }
        for _ in 0..32 {
            let Place { p, v, half } = self.at(time);
            let by = Inverse::new(v).of(p.abs_diff(way));
            let next = along(time, by, p < way);
            if by <= near.max(2) || next == time {
                return (next, Inverse::new(along(v, high(half, by) << 1, p < way)));
            }
            time = next;
        }
        (time, Inverse::new(self.at(time).v))
    }

    /// At least the time for a way.
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

/// 2^64 / 6.
const SIXTH: u64 = u64::MAX / 6 + 1;

/// A number times a part.
fn times(x: i64, part: u64) -> i64 {
    let size = i64::try_from(high(x.unsigned_abs(), part)).unwrap_or(0);
    if x < 0 { size.wrapping_neg() } else { size }
}

/// 2^64 / n of up to 16 bits, in divisions that a 32-bit core has.
fn part(n: u32) -> u64 {
    let digit = |left: u32| (left.checked_div(n).unwrap_or(0), left.checked_rem(n).unwrap_or(0) << 16 | 0xffff);
    let (first, left) = digit(u32::MAX);
    let (second, left) = digit(left);
    let (third, _) = digit(left);
    u64::from(first) << 32 | u64::from(second) << 16 | u64::from(third)
}

/// A sum that ends at the greatest number, or a difference that ends at 0.
fn along(x: u64, by: u64, up: bool) -> u64 {
    if up { x.saturating_add(by) } else { x.saturating_sub(by) }
}

/// About as many steps as the two terms left out allow to be off by `most`, from those of one step.
fn about(step: u64, w: u64, y: u64, most: u64) -> u32 {
    // Of 16 steps, lest they are too small; of one where those are too large.
    let many = if step >> 60 | w >> 58 | y >> 52 == 0 { 4 } else { 0 };
    let (x, w, y) = (step << many, w << many, y << (many << 1));
    let square = high(w, w);
    // In the middle a segment is off by a sixteenth of the one and by 5/32 of the other: half of the one counts, and twice the other.
    let fourth = high(high(x, w), square.saturating_mul(5).saturating_add(y.saturating_mul(15) >> 1)) >> 1;
    let both = square.saturating_mul(4).saturating_add(y.saturating_mul(3));
    let fifth = high(x, high(both, both)).saturating_mul(2);
    let root = |term: u64, degree: u32| {
        // From 2^-60 of those steps on.
        let octaves = term.leading_zeros().saturating_add(60).saturating_sub(most.leading_zeros());
        let (whole, part) = (octaves.checked_div(degree).unwrap_or(0), octaves.checked_rem(degree).unwrap_or(0));
        let steps = u64::from(degree.saturating_add(part)) << whole.min(40);
        let down = 60_u32.checked_div(degree).unwrap_or(0).saturating_sub(many);
        u32::try_from((steps >> down).checked_div(degree.into()).unwrap_or(0)).unwrap_or(u32::MAX)
    };
    root(fourth, 4).min(root(fifth, 5))
}
