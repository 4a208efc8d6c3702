//! The times of steps near a rest, from the first of them: roots of odd numbers.

use core::num::NonZeroU64;

use super::Demand;
use super::part::{P2, Slower, bits};
use super::segment::{log, power};
use crate::phases::Frame;
use crate::real::{Real, high};

/// How many steps after a rest are found by a root.
const KNOWN: u32 = 64;

/// Roots of 1, 3, 5 and so on, in 2^-60.
type Table = [u64; KNOWN as usize];

/// The `degree`th root of a number, in 2^-60.
#[expect(clippy::arithmetic_side_effects, clippy::cast_possible_truncation, reason = "the compiler evaluates it")]
const fn root(n: u64, degree: u32) -> u64 {
    let (mut root, mut bit) = (0_u64, 1_u64 << 31);
    // 28 bits below the point as whole numbers: a root of 31 bits, to the power of 3, has 93 bits.
    while bit > 0 {
        let with = (root | bit) as u128;
        let power = if degree == 2 { with * with } else { with * with * with };
        if power <= (n as u128) << (28 * degree) {
            root |= bit;
        }
        bit >>= 1;
    }
    // One of Newton's steps doubles them: r + (n - r^d) / (d r^(d - 1)).
    let wide = root as u128;
    let power = if degree == 2 { wide } else { wide * wide };
    let rest = ((n as u128) << (28 * degree)) - power * wide;
    let more = (rest << 32) / (degree as u128 * power);
    (root << 32) + more as u64
}

#[expect(clippy::arithmetic_side_effects, clippy::indexing_slicing, reason = "the compiler evaluates it")]
const fn roots(degree: u32) -> Table {
    let mut all = [0; KNOWN as usize];
    let mut at = 0;
    while at < all.len() {
        all[at] = root(2 * at as u64 + 1, degree);
        at += 1;
    }
    all
}

static SQUARE: Table = roots(2);
static CUBE: Table = roots(3);

/// What counts as exact, in 2^-32 ticks.
const EXACT: u64 = 1 << 15;
/// Rounding leaves no more than this part of a speed or an acceleration where it should be 0, as a power of 2.
const ROUNDING: i32 = -56;

/// The steps of a piece near its slower end, if that is a rest at a step, with constant acceleration or jerk. The position
/// is half the acceleration times t² or a sixth of the jerk times t³: all steps follow from the first one.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct FromRest {
    /// Time of the rest, of the first step on its side from there, and of the whole piece, in 2^-32 ticks.
    begin: i128,
    first: NonZeroU64,
    lasts: u64,
    /// The number of the step next to the rest.
    at: u32,
    /// A segment this near to the rest is no better than steps found one by one; `None` before it is needed.
    few: Option<u32>,
    /// The acceleration or the jerk.
    per: Real,
    cubic: bool,
    back: bool,
}

impl FromRest {
    /// Returns the steps beside a rest; `before` are those of an earlier piece of the same axis.
    pub(super) fn new(slower: &Slower, frame: &Frame, before: Option<&Self>) -> Option<Self> {
        let Slower { v, a, j, back, lasts, begin, origin, .. } = *slower;
        let cubic = !j.is_zero();
        let (per, most) = if cubic { (j, j * lasts) } else { (a, a) };
        if v >= (most * lasts).scaled(ROUNDING) || cubic && a >= most.scaled(ROUNDING) {
            return None;
        }
        let (whole, part) = (origin >> P2, origin & ((1 << P2) - 1));
        let whole = if part >> (P2 - 1) == 0 { whole } else { whole.saturating_add(1) };
        let off = origin.saturating_sub(whole << P2).unsigned_abs();
        if off >> (P2 - 20) != 0 {
            return None;
        }
        let at = u32::try_from(whole).ok()?;
        let bits = bits(frame);
        let like = before.filter(|before| before.cubic == cubic && before.per == per);
        let first = if let Some(before) = like {
            before.first
        } else {
            // Half a step is half of a t², or a sixth of j t³.
            let per = per * frame.scale;
            let first = if cubic { (Real::new(3) / per).cbrt() } else { per.per_sqrt() };
            NonZeroU64::new(first.to_fixed(bits))?
        };
        let lasts = lasts.to_fixed(bits);
        // A rest beside the step makes the first step early or late by that part of its time.
        if lasts >> 63 != 0 || high(u64::try_from(off).unwrap_or(u64::MAX), first.get()) >= EXACT {
            return None;
        }
        Some(Self { begin, first, lasts, at, few: None, per, cubic, back })
    }

    /// Returns the time of a step, if it is near the rest.
    pub(super) fn time(&self, count: u32) -> Option<i128> {
        let since = i128::from(self.since(self.far(count)?)?);
        Some(if self.back { self.begin.wrapping_sub(since) } else { self.begin.wrapping_add(since) })
    }

    /// Returns whether a segment that begins with this step would have only few.
    pub(super) fn is_near(&mut self, count: u32, frame: &Frame, demand: &Demand) -> bool {
        let Some(far) = self.far(count) else { return false };
        let first = self.first.get();
        far < *self.few.get_or_insert_with(|| few(first, demand.off.to_fixed(bits(frame)), demand.coarse))
    }

    /// Returns a time, and the steps from `count` on that are near the rest as from there, up to `left` of them.
    pub(super) fn steps(&self, count: u32, left: u32) -> Option<(i128, Roots)> {
        let far = self.far(count)?;
        let left = left.min(if self.back { far.saturating_add(1) } else { KNOWN.saturating_sub(far) });
        let last = far.saturating_add(left).saturating_sub(1);
        let longest = self.since(if self.back { far } else { last })?;
        let (from, to) = if self.back { (far.saturating_add(1).saturating_sub(left), far) } else { (far, last) };
        let roots = table(self.cubic).get(usize::try_from(from).ok()?..=usize::try_from(to).ok()?)?;
        let base = if self.back { longest } else { 0 };
        let begin = self.begin.wrapping_sub(base.into());
        Some((begin, Roots { left: roots, base, first: shifted(self.first.get())?, back: self.back }))
    }

    /// How far a step is from the rest, in steps; `None` if that is too far, or on the other side.
    fn far(&self, count: u32) -> Option<u32> {
        let far = if self.back { self.at.checked_sub(count)?.checked_sub(1) } else { count.checked_sub(self.at) };
        far.filter(|far| *far < KNOWN)
    }

    /// Returns the time between the rest and a step; `None` if that is not within the piece.
    fn since(&self, far: u32) -> Option<u64> {
        let root = table(self.cubic).get(usize::try_from(far).ok()?)?;
        Some(high(shifted(self.first.get())?, *root)).filter(|since| *since <= self.lasts)
    }
}

/// Steps near a rest, one after another.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Roots {
    /// Those that are left; before a rest the last one comes first.
    left: &'static [u64],
    /// The time from which they count, in 2^-32 ticks, and how far from it the rest is.
    pub(crate) base: u64,
    /// In 2^-36 ticks.
    first: u64,
    back: bool,
}

impl Roots {
    pub(crate) const NONE: Self = Self { left: &[], base: 0, first: 0, back: false };

    pub(crate) const fn left(&self) -> u32 {
        #[expect(clippy::cast_possible_truncation, reason = "as many as in a table")]
        let left = self.left.len() as u32;
        left
    }

    /// Returns the time of the next step.
    #[inline]
    pub(crate) fn next(&mut self) -> Option<u64> {
        let since = |root: &u64| high(self.first, *root);
        if self.back {
            let (root, left) = self.left.split_last()?;
            self.left = left;
            Some(self.base.wrapping_sub(since(root)))
        } else {
            let (root, left) = self.left.split_first()?;
            self.left = left;
            Some(self.base.wrapping_add(since(root)))
        }
    }
}

fn table(cubic: bool) -> &'static Table {
    if cubic { &CUBE } else { &SQUARE }
}

/// Returns a time in 2^-36 ticks, to be multiplied by a root, which is below 2^4: that of 127 is 11.3.
fn shifted(time: u64) -> Option<u64> {
    (time.leading_zeros() >= 4).then_some(time << 4)
}

/// Returns how many steps next to a rest are better found one by one. A segment that begins with step k and has five is off
/// by about 2.1 k^-3.5 of the `first` one's time; twice as far from the rest, one is worth what it costs. An interval there is
/// about 0.7 k^-0.5 of that time.
fn few(first: u64, off: u64, coarse: Option<u32>) -> u32 {
    // Off to either side by half of it.
    let by = log(first).saturating_sub(log(off)).saturating_add(28).saturating_mul(2) / 7;
    let fine = power(2 << 16, by.clamp(0, 32 << 8)) >> 16;
    let coarse = coarse.map(|by| i32::try_from(by << 8).unwrap_or(i32::MAX).saturating_add(406) / 3);
    let few = coarse.map_or(fine, |by| fine.min(power(1 << 16, by.min(32 << 8)) >> 16));
    u32::try_from(few).unwrap_or(u32::MAX)
}

#[cfg(test)]
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "numbers of small cases, compared with floating point"
)]
mod tests;
