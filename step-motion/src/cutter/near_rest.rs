//! The times of steps near a rest, from the first of them: roots of odd numbers.

use core::num::NonZeroU64;

use crate::real::high;

/// How many steps after a rest are found by a root.
const KNOWN: usize = 64;

/// Roots of 1, 3, 5 and so on, in 2^-60.
type Roots = [u64; KNOWN];

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
const fn roots(degree: u32) -> Roots {
    let mut all = [0; KNOWN];
    let mut at = 0;
    while at < KNOWN {
        all[at] = root(2 * at as u64 + 1, degree);
        at += 1;
    }
    all
}

static SQUARE: Roots = roots(2);
static CUBE: Roots = roots(3);

/// A piece that is at rest at its slower end, where the position is half the acceleration times t² or a sixth of the jerk
/// times t³: all its steps follow from the first one.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct FromRest {
    /// The number of the step next to the rest.
    at: u32,
    /// Time of the first step on either side, as a part of the piece and in 2^-32 ticks; `None` if a piece is too long for these.
    first: u64,
    ticks: Option<NonZeroU64>,
    cubic: bool,
}

impl FromRest {
    pub(super) const fn new(at: u32, (first, ticks): (u64, Option<NonZeroU64>), cubic: bool) -> Self {
        Self { at, first, ticks, cubic }
    }

    /// Returns the time of a step, if it is near the rest.
    pub(super) fn step(&self, count: u32) -> Option<u64> {
        scaled(self.first, self.root(count)?)
    }

    /// Returns the same, and how far from the rest it is in 2^-32 ticks.
    #[inline]
    pub(super) fn step_and_ticks(&self, count: u32) -> Option<(u64, u64)> {
        let root = self.root(count)?;
        Some((scaled(self.first, root)?, scaled(self.ticks?.get(), root)?))
    }

    fn root(&self, count: u32) -> Option<u64> {
        // Steps behind a rest are counted from it, and those before it backwards.
        let far =
            if count >= self.at { count.wrapping_sub(self.at) } else { self.at.wrapping_sub(count).wrapping_sub(1) };
        if self.cubic { &CUBE } else { &SQUARE }.get(usize::try_from(far).ok()?).copied()
    }
}

/// Multiplies a time by a root, which is below 2^4: that of 127 is 11.3.
fn scaled(time: u64, root: u64) -> Option<u64> {
    let time = high(time, root);
    (time.leading_zeros() >= 4).then_some(time << 4)
}
