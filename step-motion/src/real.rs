//! Numbers for planning: floating point made of integers.

use core::cmp::Ordering;
use core::ops::{Add, Div, Mul, Sub};

/// A non-negative number with 64 significant bits: `m · 2^(e - BIAS)`, with the top bit of `m` set; or 0, all of whose bits
/// are zero, so that its `e` is below that of any other number.
///
/// Results are exact to at least 58 bits. A difference below 0 is 0, and a quotient by 0 is 2^1000; nothing
/// can overflow or panic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Real {
    #[cfg(target_pointer_width = "64")]
    m: u64,
    /// Upper and lower half of `m`, so that the number takes three words without padding.
    #[cfg(not(target_pointer_width = "64"))]
    high: u32,
    #[cfg(not(target_pointer_width = "64"))]
    low: u32,
    e: i32,
}

/// Far enough from both ends that no sum of the exponents in a plan overflows the word.
const BIAS: i32 = 1 << 29;

impl Real {
    pub(super) const ZERO: Self = Self::raw(0, 0);
    pub(super) const ONE: Self = Self::new(1);
    /// Larger than any value in a plan.
    pub(super) const HUGE: Self = Self::from_parts(1 << 63, 937);

    /// Creates the number from its stored exponent.
    #[cfg(target_pointer_width = "64")]
    const fn raw(m: u64, e: i32) -> Self {
        Self { m, e }
    }

    #[cfg(not(target_pointer_width = "64"))]
    #[expect(clippy::cast_possible_truncation, reason = "halves of a wider number")]
    const fn raw(m: u64, e: i32) -> Self {
        Self { high: (m >> 32) as u32, low: m as u32, e }
    }

    /// `m · 2^e` with the top bit of `m` set.
    const fn from_parts(m: u64, e: i32) -> Self {
        Self::raw(m, e.wrapping_add(BIAS))
    }

    /// The same for any `m` other than 0.
    const fn normal(m: u64, e: i32) -> Self {
        let zeros = m.leading_zeros();
        Self::raw(m << (zeros & 63), e.wrapping_sub_unsigned(zeros))
    }

    #[cfg(target_pointer_width = "64")]
    const fn m(self) -> u64 {
        self.m
    }

    #[cfg(not(target_pointer_width = "64"))]
    const fn m(self) -> u64 {
        (self.high as u64) << 32 | self.low as u64
    }

    /// Returns the exponent of `m`.
    const fn e(self) -> i32 {
        self.e.wrapping_sub(BIAS)
    }

    /// Converts a whole number.
    pub(super) const fn new(n: u64) -> Self {
        Self::fixed(n, 0)
    }

    /// `n · 2^-bits`.
    pub(super) const fn fixed(n: u64, bits: i32) -> Self {
        if n == 0 {
            return Self::ZERO;
        }
        let zeros = n.leading_zeros();
        Self::from_parts(n << zeros, 0_i32.wrapping_sub_unsigned(zeros).wrapping_sub(bits))
    }

    /// Converts to units of `2^-bits`, truncated; the largest number if it does not fit.
    pub(super) const fn to_fixed(self, bits: i32) -> u64 {
        let shift = self.e().saturating_add(bits);
        match shift {
            _ if self.is_zero() => 0,
            1.. => u64::MAX,
            _ => match self.m().checked_shr(shift.unsigned_abs()) {
                Some(n) => n,
                None => 0,
            },
        }
    }

    /// Does the same as [`to_fixed`](Self::to_fixed), up to 2^126.
    #[inline(never)]
    pub(super) const fn to_wide(self, bits: i32) -> i128 {
        let shift = self.e().saturating_add(bits);
        match shift {
            ..=0 => self.to_fixed(bits) as i128,
            1..=62 => (self.m() as i128) << shift,
            _ => i128::MAX >> 1,
        }
    }

    /// Multiplies by `x` and 2^`bits`, up to 2^126.
    #[expect(clippy::cast_possible_wrap, reason = "the top bit is shifted out or known to be 0")]
    pub(super) const fn times(self, x: u64, bits: i32) -> i128 {
        let (high, low) = product(self.m(), x);
        let wide = (high as u128) << 64 | low as u128;
        let shift = self.e().saturating_add(bits);
        let by = shift.unsigned_abs();
        if shift < 0 {
            (if by < 128 { wide >> by } else { 0 }) as i128
        } else if by < wide.leading_zeros() {
            (wide << by) as i128
        } else {
            i128::MAX >> 1
        }
    }

    /// Multiplies by a fraction in 2^-64, truncated; the largest number if it does not fit.
    pub(super) const fn part(self, x: u64) -> u64 {
        let whole = high(self.m(), x);
        let by = self.e().unsigned_abs();
        if self.e() <= 0 {
            if by < 64 { whole >> by } else { 0 }
        } else if by <= whole.leading_zeros() && by < 64 {
            whole << by
        } else {
            u64::MAX
        }
    }

    /// Divides by a number in units of 2^-62, truncated; the largest number if it does not fit.
    pub(super) const fn over(self, by: Inverse) -> u64 {
        let quotient = high(self.m(), by.per);
        let shift = self.e().saturating_add_unsigned(by.zeros).saturating_sub(1);
        match (shift, shift.unsigned_abs()) {
            (..=-64, _) => 0,
            (..=0, by) => quotient >> by,
            (_, by) if by <= quotient.leading_zeros() && by < 64 => quotient << by,
            _ => u64::MAX,
        }
    }

    /// Returns it as a divisor: its digits, and the power of 2 of their unit.
    pub(super) const fn inverse(self) -> (Inverse, i32) {
        (Inverse::new(self.m()), self.e())
    }

    /// Returns the exponent of the top bit: the number is at least 2^this and less than twice that.
    pub(super) const fn exponent(self) -> i32 {
        self.e().wrapping_add(63)
    }

    pub(super) const fn is_zero(self) -> bool {
        self.e == 0
    }

    /// Multiplies by 2^`by`.
    pub(super) const fn scaled(self, by: i32) -> Self {
        if self.is_zero() { self } else { Self { e: self.e.wrapping_add(by), ..self } }
    }

    pub(super) const fn half(self) -> Self {
        self.scaled(-1)
    }

    pub(super) fn squared(self) -> Self {
        self * self
    }

    pub(super) fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }

    pub(super) fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }

    /// Returns the digits g, from 1/4 to 1, with an even exponent, and in 2^-30 the reciprocal of their root, exact to 30 bits: from a
    /// table, made better by two steps y + y (1 - g y²) / 2.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "differences in two's complement"
    )]
    fn per_root(self) -> (u64, i32, u32) {
        let (m, e) = (self.m(), self.e());
        let (m, e) = if e & 1 == 0 { (m, e) } else { (m >> 1, e.wrapping_add(1)) };
        let upper = (m >> 32) as u32;
        let at = (upper >> 24).wrapping_sub(64) as usize;
        let mut y = u32::from(ROOTS.get(at).copied().unwrap_or(0)) << 15;
        for _ in 0..2 {
            let rest = (1_u32 << 30).wrapping_sub(shifted(upper, shifted(y, y, 30), 32)) as i32;
            y = y.wrapping_add((i64::from(y).wrapping_mul(rest.into()) >> 31) as u32);
        }
        (m, e, y)
    }

    /// The root: s = g y, then s + y (g - s²) / 2.
    #[expect(clippy::cast_possible_wrap, clippy::cast_sign_loss, reason = "differences in two's complement")]
    pub(super) fn sqrt(self) -> Self {
        if self.is_zero() {
            return self;
        }
        let (m, e, y) = self.per_root();
        // In 2^-63.
        let s = high(m, u64::from(y) << 33);
        let off = (m >> 2).wrapping_sub(high(s, s)) as i64;
        let s = s.wrapping_add(((off >> 1).wrapping_mul(y.into()) >> 29) as u64);
        Self::fixed(s, 31).scaled(e >> 1)
    }

    /// The reciprocal of the root, with one step more.
    #[expect(clippy::cast_possible_wrap, clippy::cast_sign_loss, reason = "differences in two's complement")]
    pub(super) fn per_sqrt(self) -> Self {
        if self.is_zero() {
            return Self::HUGE;
        }
        let (m, e, y) = self.per_root();
        // In 2^-62.
        let fine = u64::from(y) << 32;
        let rest = (1_u64 << 60).wrapping_sub(high(m, high(fine, fine))) as i64;
        let fine = fine.wrapping_add((rest.wrapping_mul(y.into()) >> 29) as u64);
        Self::fixed(fine, 94).scaled((e >> 1).wrapping_neg())
    }

    /// The cube root, exact to at least 55 bits: of the digits g, from 1/2 to 1, the reciprocal of the root by steps
    /// y + y (1 - g y³) / 3, the first three of them in 32 bits; then g y².
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "differences in two's complement"
    )]
    pub(super) fn cbrt(self) -> Self {
        /// The roots of 2 and 4.
        const ROOTS: [Real; 2] =
            [Real::from_parts(0xa145_17cc_6b94_5711, -63), Real::from_parts(0xcb2f_f529_eb71_e416, -63)];
        if self.is_zero() {
            return self;
        }
        let (m, e) = (self.m(), self.e().wrapping_add(64));
        let upper = (m >> 32) as u32;
        // A line within 1.5 per cent of it, in 2^-30.
        let mut y = 1_618_128_371_u32.wrapping_sub(shifted(upper, 558_345_748, 32));
        for _ in 0..3 {
            let cube = shifted(shifted(y, y, 30), y, 30);
            let rest = (1_u32 << 30).wrapping_sub(shifted(upper, cube, 32)) as i32;
            let more = i64::from(shifted(y, THIRD_OF_A_WORD, 32)).wrapping_mul(rest.into()) >> 30;
            y = y.wrapping_add(more as u32);
        }
        let y = u64::from(y) << 32;
        let rest = (1_u64 << 58).wrapping_sub(high(m, high(high(y, y), y))) as i64;
        let third = i64::from(shifted((y >> 32) as u32, THIRD_OF_A_WORD, 32));
        let y = y.wrapping_add((third.wrapping_mul(rest) >> 26) as u64);
        let root = Self::from_parts(m, -64) * Self::fixed(y, 62).squared();
        let root = match ROOTS.get((e.rem_euclid(3) as usize).wrapping_sub(1)) {
            Some(more) => root * *more,
            None => root,
        };
        root.scaled(e.div_euclid(3))
    }

    /// `self + by` or `self - by`.
    pub(super) fn along(self, by: Self, up: bool) -> Self {
        if up { self + by } else { self - by }
    }

    /// `|self - other|`.
    pub(super) fn distance(self, other: Self) -> Self {
        if self > other { self - other } else { other - self }
    }
}

/// The reciprocals of the roots of numbers from 1/4 to 1, in 2^-15: each for the middle of a 256th.
#[expect(clippy::indexing_slicing, clippy::cast_possible_truncation, reason = "the compiler evaluates it")]
static ROOTS: [u16; 192] = {
    let mut all = [0; 192];
    let mut at = 0;
    while at < all.len() {
        // 2^39 / (2 at + 129) is 2^30 / g.
        all[at] = ((1_u64 << 39) / (2 * at as u64 + 129)).isqrt() as u16;
        at += 1;
    }
    all
};

/// 1/3, as a number and in 2^-32.
pub(super) const THIRD: Real = Real::from_parts(0xaaaa_aaaa_aaaa_aaab, -65);
pub(super) const THIRD_OF_A_WORD: u32 = u32::MAX / 3 + 1;

impl PartialOrd for Real {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Real {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.e, self.m()).cmp(&(other.e, other.m()))
    }
}

impl Add for Real {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (a, b) = if self.e < other.e { (other, self) } else { (self, other) };
        let down = a.e.wrapping_sub(b.e).unsigned_abs();
        let (sum, carry) = a.m().overflowing_add(b.m().checked_shr(down).unwrap_or(0));
        if carry { Self::raw(sum >> 1 | 1 << 63, a.e.wrapping_add(1)) } else { Self::raw(sum, a.e) }
    }
}

/// 0 for a difference below 0.
impl Sub for Real {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        if self <= other {
            return Self::ZERO;
        }
        let down = self.e.wrapping_sub(other.e).unsigned_abs();
        let rest = self.m().wrapping_sub(other.m().checked_shr(down).unwrap_or(0));
        Self::normal(rest, self.e)
    }
}

impl Mul for Real {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (high, low) = product(self.m(), other.m());
        let e = self.e.wrapping_add(other.e).wrapping_sub(BIAS - 64);
        match high {
            0 => Self::ZERO,
            _ if high >> 63 == 1 => Self::raw(high, e),
            _ => Self::raw(high << 1 | low >> 63, e.wrapping_sub(1)),
        }
    }
}

/// 2^1000 for a quotient by 0.
impl Div for Real {
    type Output = Self;

    fn div(self, by: Self) -> Self {
        if self.is_zero() {
            return self;
        }
        if by.is_zero() {
            return Self::HUGE;
        }
        let (quotient, _) = product(self.m(), reciprocal(by.m()));
        Self::normal(quotient, self.e.wrapping_sub(by.e).wrapping_add(const { BIAS - 63 }))
    }
}

/// A 64-bit divisor.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Inverse {
    /// 2^127 divided by it, with its leading `zeros` shifted out.
    per: u64,
    zeros: u32,
}

impl Inverse {
    /// No divisor.
    pub(super) const NONE: Self = Self { per: 0, zeros: 0 };

    pub(super) const fn new(x: u64) -> Self {
        let zeros = x.leading_zeros();
        if zeros == 64 { Self { per: u64::MAX, zeros } } else { Self { per: reciprocal(x << zeros), zeros } }
    }

    /// Does the same as [`of`](Self::of) in units of 2^-32, for a number in units of 2^32 times its own; the result is at
    /// most a few units too large.
    pub(super) fn rough(self, x: u32) -> u32 {
        let quotient = upper(x, (self.per >> 32) as u32);
        if quotient.leading_zeros() > self.zeros { quotient << self.zeros << 1 } else { u32::MAX }
    }

    /// Returns 2^`bits` divided by it, as the first digits in 2^-64 and a power of 2; `None` if it is less than 2^`bits`.
    pub(super) fn part(self, bits: u32) -> Option<(u64, u32)> {
        Some((self.per, 63_u32.checked_sub(bits)?.checked_sub(self.zeros)?))
    }

    /// Returns `x` divided by it in units of 2^-64; the largest number if the quotient is 1 or more.
    #[inline(never)]
    pub(super) const fn of(self, x: u64) -> u64 {
        let quotient = high(x, self.per);
        if quotient == 0 {
            0
        } else if quotient.leading_zeros() > self.zeros {
            quotient << self.zeros << 1
        } else {
            u64::MAX
        }
    }
}

/// Returns a product divided by 2^`down`, 1 to 63, modulo 2^64.
#[inline]
pub(super) const fn middle(a: u64, b: u64, down: u32) -> u64 {
    let (high, low) = product(a, b);
    high << (64_u32.wrapping_sub(down) & 63) | low >> (down & 63)
}

/// Returns a product divided by 2^`down`, modulo 2^32.
#[expect(clippy::cast_possible_truncation, reason = "modulo 2^32")]
const fn shifted(a: u32, b: u32, down: u32) -> u32 {
    ((a as u64).wrapping_mul(b as u64) >> (down & 63)) as u32
}

/// Returns the upper half of a 64-bit product, rounded up.
pub(super) const fn upper(a: u32, b: u32) -> u32 {
    ((a as u64).wrapping_mul(b as u64) >> 32).saturating_add(1) as u32
}

/// Returns the upper half of a product.
#[inline]
pub(super) const fn high(a: u64, b: u64) -> u64 {
    product(a, b).0
}

/// Returns both halves of a 128-bit product; on a 32-bit core it uses only multiplications that the core has.
#[expect(clippy::cast_possible_truncation, reason = "halves of a wider number")]
#[inline]
const fn product(a: u64, b: u64) -> (u64, u64) {
    if cfg!(target_pointer_width = "64") {
        let wide = (a as u128).wrapping_mul(b as u128);
        return ((wide >> 64) as u64, wide as u64);
    }
    let (a1, a0, b1, b0) = (a >> 32, a as u32 as u64, b >> 32, b as u32 as u64);
    let low = a0.wrapping_mul(b0);
    let middle = a1.wrapping_mul(b0).wrapping_add(low >> 32);
    let other = a0.wrapping_mul(b1).wrapping_add(middle as u32 as u64);
    let high = a1.wrapping_mul(b1).wrapping_add(middle >> 32).wrapping_add(other >> 32);
    (high, other << 32 | low as u32 as u64)
}

/// Returns `2^127 / d` for a `d` with its top bit set, exact to at least 59 bits: 16 bits by division, then doubled twice
/// by Newton steps x (2 - d x).
#[expect(
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "the upper half of a number; a difference in two's complement"
)]
#[inline]
const fn reciprocal(d: u64) -> u64 {
    let upper = (d >> 32) as u32;
    // 2^63 / upper, a little too small or too large.
    let rough = match u32::MAX.checked_div(upper >> 16) {
        Some(rough) => (rough as u64) << 15,
        None => 1 << 31,
    };
    let off = (1_u64 << 63).wrapping_sub(rough.wrapping_mul(upper as u64)) as i64;
    let better = rough.wrapping_add(((rough as i64).wrapping_mul(off >> 18) >> 45) as u64);
    let x = if better >> 32 == 0 { better << 32 } else { u64::MAX };
    let (whole, _) = product(x, d);
    // Twice what is missing from 2^63, or too much: its top bit is shifted out.
    if whole < 1 << 63 {
        let (more, _) = product(x, whole.wrapping_neg() << 1);
        x.saturating_add(more)
    } else {
        let (less, _) = product(x, whole << 1);
        x.wrapping_sub(less)
    }
}

#[cfg(test)]
mod tests;
