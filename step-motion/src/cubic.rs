//! The position of an axis at whole ticks, in exact integers.

use crate::curve::{Bend, Piece};
use crate::real::{Real, THIRD};

/// The integers of a [`Cubic`]: 64 bits, or 128 where 64 are too few. All sums wrap.
pub(super) trait Word: Copy {
    /// In units of `2^-bits`, rounded.
    fn rounded(x: Real, bits: i32) -> Self;
    /// 2^bits.
    fn power(bits: i32) -> Self;
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    /// `self` times `by`, plus `more`.
    fn times_plus(self, by: u64, more: Self) -> Self;
    fn is_negative(self) -> bool;
    fn is_zero(self) -> bool;
    /// Bits of a number above 0; 0 for any other.
    fn bits(self) -> u32;
    /// `self` is from 0 to less than `other`.
    fn is_below(self, other: Self) -> bool;
    /// About `self / by`, rounded down; `None` if `by` is not above 0.
    fn quotient(self, by: Self) -> Option<i64>;
}

macro_rules! word {
    ($word:ty, $shift:expr, $times_plus:item) => {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            clippy::cast_sign_loss,
            clippy::cast_lossless,
            reason = "words in two's complement"
        )]
        impl Word for $word {
            fn rounded(x: Real, bits: i32) -> Self {
                let bits = bits.saturating_add(1);
                // Most often 64 bits hold it; what is above them is cut off.
                let is_short = x.exponent().saturating_add(bits) < 64;
                let twice = if is_short { x.to_fixed(bits) as Self } else { x.to_wide(bits) as Self };
                twice.wrapping_add(1) >> 1
            }

            fn power(bits: i32) -> Self {
                Self::wrapping_shl(1, bits.unsigned_abs())
            }

            #[inline]
            fn plus(self, other: Self) -> Self {
                self.wrapping_add(other)
            }

            #[inline]
            fn minus(self, other: Self) -> Self {
                self.wrapping_sub(other)
            }

            #[inline]
            $times_plus

            #[inline]
            fn is_negative(self) -> bool {
                self < 0
            }

            #[inline]
            fn is_zero(self) -> bool {
                self == 0
            }

            fn bits(self) -> u32 {
                if self > 0 { Self::BITS.saturating_sub(self.leading_zeros()) } else { 0 }
            }

            #[inline]
            fn is_below(self, other: Self) -> bool {
                // The sign of the difference, unless it is that of `self`.
                self.wrapping_sub(other) & !self < 0
            }

            fn quotient(self, by: Self) -> Option<i64> {
                if by <= 0 {
                    return None;
                }
                let down = $shift.saturating_sub(by.leading_zeros());
                let (dividend, divisor) = (self >> down, (by >> down) as i32);
                if let Ok(dividend) = i32::try_from(dividend) {
                    return dividend.checked_div_euclid(divisor).map(i64::from);
                }
                let coarse = i32::try_from(dividend >> 16).unwrap_or(if self < 0 { i32::MIN } else { i32::MAX });
                coarse.checked_div_euclid(divisor).map(|by| i64::from(by) << 16)
            }
        }
    };
}

// By halves, in two multiplications with addition of a 32-bit core.
word!(
    i64,
    49_u32,
    fn times_plus(self, by: u64, more: Self) -> Self {
        if cfg!(target_pointer_width = "32") && by >> 32 == 0 {
            let low = (self as u32 as u64).wrapping_mul(by).wrapping_add(more as u64);
            let high = ((self >> 32) as u32).wrapping_mul(by as u32);
            low.wrapping_add((high as u64) << 32) as i64
        } else {
            self.wrapping_mul(by as i64).wrapping_add(more)
        }
    }
);
word!(
    i128,
    113_u32,
    fn times_plus(self, by: u64, more: Self) -> Self {
        self.wrapping_mul(by as i128).wrapping_add(more)
    }
);

/// The position less the one at which the next step is made, at a whole tick, with its derivatives.
///
/// With x ticks from any whole tick on, a position of constant jerk is p + v x + h x² + j x³. In a unit in which h or, with a
/// jerk, j is a power of 2 all four are integers, so the sums below are exact at every tick: nothing is rounded after the
/// first one. What is rounded there is the time at which h (or, without a jerk, v) is a whole number, by less than 2^-`bits`
/// of a tick. That costs the size of the unit: a step has up to 2^59 units in 64 bits.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Cubic<W> {
    /// Position, less the one at which the step is made; from 0 to less than a tick's way when it has just been made.
    pub(super) off: W,
    v: W,
    h: W,
    j: W,
    /// A step.
    pub(super) step: W,
}

impl<W: Word> Cubic<W> {
    /// In the unit in which 1 / `inverse` is 2^bits, with 2^shift moments in a tick, from a piece on an axis `wait` moments after its begin. `ahead` gives
    /// the steps to the next one, and the steps that it is behind.
    pub(super) fn new(
        piece: &Piece,
        wait: Real,
        (inverse, bits, shift): (Real, i32, i32),
        scale: impl Fn(Real, i32) -> Real,
        ahead: impl Fn(Real) -> (Real, Real),
    ) -> Self {
        let zero = W::rounded(Real::ZERO, bits);
        let signed = |x: W, up: bool| if up { x } else { zero.minus(x) };
        let Piece { up, bend, .. } = *piece;
        let grows = bend != Bend::Fading;
        let bent = bend != Bend::Flat;
        // The first number below the leading one, up or down to a whole number as it is a little later.
        let (exact, part) = if bent {
            (scale(piece.a.along(piece.j * wait, grows).half(), 2), THIRD)
        } else {
            (scale(piece.v.along(piece.a * wait, up), 1), Real::ONE.half())
        };
        let units = (exact * inverse).scaled(bits);
        let whole = units.floor();
        let more = if bent { grows } else { up };
        let (whole, rest) = match units - whole {
            rest if rest.is_zero() || !more => (whole, rest),
            rest => (whole + Real::ONE, Real::ONE - rest),
        };
        let (p, v) = piece.way(wait + (rest * part).scaled(shift.wrapping_sub(bits)));
        let (ahead, behind) = ahead(p);
        let fixed = |x: Real| W::rounded(x * inverse, bits);
        let exact = W::rounded(whole, 0);
        let one = W::power(bits);
        Self {
            off: fixed(behind).minus(fixed(ahead)),
            v: if bent { fixed(scale(v, 1)) } else { exact },
            h: signed(if bent { exact } else { one }, up),
            j: if bent { signed(one, up == grows) } else { zero },
            step: W::rounded(inverse, bits),
        }
    }

    /// Without jerk: at the next step, if that is made `by` ticks on. That there is none is written down anew, so that no
    /// register has to keep it.
    #[inline(always)]
    pub(super) fn straight(&self, by: u64) -> Self {
        let mean = self.h.times_plus(by, self.v);
        let (off, v) = (mean.times_plus(by, self.off.minus(self.step)), self.h.times_plus(by, mean));
        Self { off, v, j: self.j.minus(self.j), ..*self }
    }

    /// At the next step, if that is made `by` ticks on.
    #[inline(always)]
    pub(super) fn bent(&self, by: u64) -> Self {
        let first = self.j.times_plus(by, self.h);
        let second = self.j.times_plus(by, first);
        let mean = first.times_plus(by, self.v);
        Self {
            off: mean.times_plus(by, self.off.minus(self.step)),
            v: second.times_plus(by, mean),
            h: self.j.times_plus(by, second),
            ..*self
        }
    }

    /// At the next step, if that is made `by` ticks on.
    #[inline(always)]
    fn at(&self, by: u64) -> Self {
        if self.j.is_zero() { self.straight(by) } else { self.bent(by) }
    }

    /// What the position has grown by since the tick before.
    #[inline(always)]
    fn speed(&self) -> W {
        self.v.minus(self.h).plus(self.j)
    }

    /// The position has passed that of the step, and had not at the tick before.
    #[inline(always)]
    pub(super) fn is_there(&self) -> bool {
        self.off.is_below(self.speed())
    }

    /// About as many ticks as the next step takes.
    pub(super) fn interval(&self) -> u64 {
        self.at_most(self.step)
    }

    /// Ticks for a way: no more than the speed alone would take, and half a power of 2 that h or j alone would take.
    fn at_most(&self, need: W) -> u64 {
        let mut guess = need.quotient(self.v).and_then(|ticks| u64::try_from(ticks).ok()).unwrap_or(u64::MAX);
        let doublings = |size: W| need.bits().saturating_add(1).saturating_sub(size.bits());
        if self.h.bits() > 0 {
            guess = guess.min(half_power_of_2(doublings(self.h).div_ceil(2)));
        }
        if self.j.bits() > 0 {
            guess = guess.min(half_power_of_2(doublings(self.j).div_ceil(3)));
        }
        guess
    }

    /// The first step, up to `last` ticks on.
    pub(super) fn first(&self, last: u64) -> (u64, Self) {
        if !self.off.is_negative() || last == 0 {
            return (0, *self);
        }
        let zero = self.off.minus(self.off);
        let guess = self.at_most(zero.minus(self.off));
        Self { off: self.off.plus(self.step), ..*self }.solve(guess, last)
    }

    /// The step after the one that has just been made, `guess` ticks on or as many as it is, up to `last`: Newton's method
    /// between the ticks that are known to be too early and late enough; if it takes long, halving.
    ///
    /// The guess is such that no sum there leaves its word: the way there is 12 steps at most, and so is the way to twice a
    /// time that is too early. So no tick is looked at that is later than that, unless it is known to be before a late one.
    pub(super) fn solve(&self, guess: u64, last: u64) -> (u64, Self) {
        let (mut early, mut late, mut is_known) = (0, last.max(1), false);
        let mut by = guess.max(1).min(late);
        let mut round = 0_u8;
        loop {
            let next = self.at(by);
            if next.off.is_negative() {
                early = by;
            } else {
                (late, is_known) = (by, true);
                if next.is_there() {
                    return (by, next);
                }
            }
            let left = late.saturating_sub(early);
            if left <= 1 {
                return (late, self.at(late));
            }
            round = round.saturating_add(1);
            let newton = next.off.quotient(next.speed()).filter(|_| round < 12);
            let next = match newton {
                Some(over) if over < 0 => by.saturating_add(over.unsigned_abs()).min(by.saturating_mul(2)),
                Some(over) => by.saturating_sub(over.unsigned_abs()),
                None if is_known => early.saturating_add(left >> 1),
                None => by.saturating_mul(2),
            };
            by = next.max(early.saturating_add(1)).min(late.saturating_sub(1));
        }
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "words in two's complement")]
impl Cubic<i64> {
    /// The upper words of the position past the step, and of what it has grown by since the tick before; the lower words make that
    /// less by one at most.
    #[inline(always)]
    fn upper(&self) -> (i32, i32) {
        let upper = |word: i64| (word >> 32) as i32;
        (upper(self.off), upper(self.v).wrapping_sub(upper(self.h)).wrapping_add(upper(self.j)))
    }

    /// The upper words alone say [`is_there`](Self::is_there); near the edges they do not, in a word of 2^26 to a step.
    #[inline(always)]
    pub(super) fn is_surely_there(&self) -> bool {
        let (off, speed) = self.upper();
        off.wrapping_add(1).wrapping_sub(speed) & !off < 0
    }

    /// The way to the next step, in 2^37 units; 0 if that is behind.
    #[inline(always)]
    pub(super) fn ahead(&self) -> i32 {
        ((self.step >> 37) as i32).wrapping_sub(self.past()).max(0)
    }

    /// What the position is past the step, in 2^37 units.
    #[inline(always)]
    pub(super) const fn past(&self) -> i32 {
        (self.off >> 37) as i32
    }

    /// Newton's step to the tick of the step from this one, `by` ticks on; up to twice as far, as in [`solve`](Self::solve).
    #[inline(always)]
    pub(super) fn nearer(&self, by: u32) -> Option<u32> {
        let (off, speed) = self.upper();
        if speed <= 0 {
            return None;
        }
        let over = off.checked_div_euclid(speed)?;
        Some(by.saturating_add_signed(over.wrapping_neg()).min(by.saturating_mul(2)))
    }

    /// Step, v, h and j without their signs.
    pub(super) fn sizes(&self) -> [Real; 4] {
        [self.step, self.v, self.h, self.j].map(|word| Real::new(word.unsigned_abs()))
    }

    /// Without jerk.
    pub(super) const fn is_straight(&self) -> bool {
        self.j == 0
    }

    /// Whether h and j are not below 0.
    pub(super) const fn signs(&self) -> (bool, bool) {
        (self.h >= 0, self.j >= 0)
    }

    /// At the step that comes 2^`doublings` steps later, if that is made `by` ticks on.
    #[inline]
    pub(super) fn onward(&self, by: u64, doublings: u32) -> Self {
        let off = self.off.wrapping_add(self.step).wrapping_sub(self.step.wrapping_shl(doublings));
        Self { off, ..*self }.at(by)
    }

    /// What the speed has changed by since, and what it was.
    #[inline]
    pub(super) const fn change(&self, since: &Self) -> (u64, u64) {
        (self.v.wrapping_sub(since.v).unsigned_abs(), since.v.unsigned_abs())
    }

    /// The step was due within two ticks of this one.
    #[inline]
    pub(super) const fn is_near(&self) -> bool {
        self.off.unsigned_abs() >> 1 < self.v.unsigned_abs()
    }

    /// What is left of a step after `interval` at the speed here, in 2^25 units; the interval is in 2^-7 ticks and wrong by a
    /// quarter at most.
    #[inline]
    pub(super) const fn rest(&self, interval: i64) -> i64 {
        (self.step << 7).wrapping_sub(self.v.wrapping_mul(interval)) >> 32
    }

    /// What the position is past the step, times the interval at the speed here in 2^-12 ticks; in 2^48 units.
    #[inline]
    pub(super) const fn part(&self, interval: i64) -> i64 {
        (self.off >> 16).wrapping_mul(interval) >> 32
    }

    /// What the next of two intervals of `ticks` is longer in units of 2^-15 of them; 0 if that is more than an eighth.
    pub(super) fn growth(&self, ticks: u64) -> i32 {
        let more = self.h.wrapping_mul(ticks as i64) << 1;
        if self.v <= 0 || more.unsigned_abs() > self.v.unsigned_abs() >> 3 {
            return 0;
        }
        let up = self.v.leading_zeros().wrapping_sub(1);
        let (more, v) = ((more << up) >> 32, (self.v << up) >> 47);
        (more as i32).checked_div(v as i32).map_or(0, i32::wrapping_neg)
    }

    /// What the step was due before this tick, in 2^-32 ticks and exact to 2^-14 ticks; less than 0 if it is due after it. `None`
    /// if that is more than a tick.
    #[inline]
    pub(super) fn late(&self) -> Option<i64> {
        if self.v <= 0 || self.off.unsigned_abs() > self.v.unsigned_abs() {
            return None;
        }
        let up = self.v.leading_zeros().wrapping_sub(1);
        let (off, v) = ((self.off << up) >> 32, (self.v << up) >> 47);
        let part = (off as i32).checked_div(v as i32)?;
        Some(i64::from(part) << 17)
    }

    /// At a step `steps` before this one, `by` ticks on or, below 0, back.
    #[inline(always)]
    pub(super) const fn back(&self, by: i64, steps: u32) -> Self {
        let Self { off, v, h, j, step } = *self;
        let off = off.wrapping_add(step.wrapping_mul(steps as i64));
        let first = j.wrapping_mul(by).wrapping_add(h);
        let second = j.wrapping_mul(by).wrapping_add(first);
        let mean = first.wrapping_mul(by).wrapping_add(v);
        Self {
            off: mean.wrapping_mul(by).wrapping_add(off),
            v: second.wrapping_mul(by).wrapping_add(mean),
            h: j.wrapping_mul(by).wrapping_add(second),
            ..*self
        }
    }

    /// Whether a step `left` before the present one is made later than `by` ticks after it.
    pub(super) fn is_early(&self, by: u64, left: u32) -> bool {
        let by = by as i64;
        let mean = self.j.wrapping_mul(by).wrapping_add(self.h).wrapping_mul(by).wrapping_add(self.v);
        mean.wrapping_mul(by).wrapping_add(self.off).wrapping_add(self.step.wrapping_mul(left.into())) < 0
    }
}

/// 2^(`doublings` - 1), and 0 for none; no more than half the range.
fn half_power_of_2(doublings: u32) -> u64 {
    1_u64.checked_shl(doublings).unwrap_or(u64::MAX) >> 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lower 63 bits of a number that has more of them, as 0 would be another position.
    #[test]
    fn what_is_above_a_word_is_cut_off() {
        for n in [1, 3, 0x0123_4567_89ab_cdef, u64::MAX] {
            for bits in 0..60 {
                let whole = i128::from(n) << bits;
                assert_eq!(i64::rounded(Real::new(n), bits), (whole << 1) as i64 >> 1, "{n} {bits}");
                assert_eq!(i128::rounded(Real::new(n), bits), whole, "{n} {bits}");
            }
            assert_eq!(i64::rounded(Real::fixed(n, 4), 0), ((i128::from(n) + 8) >> 4) as i64, "{n}");
        }
    }
}
