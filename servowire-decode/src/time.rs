//! Instants in a capture, and conversions from the file formats.

use std::fmt;
use std::ops::{Add, AddAssign, Neg, Sub};

use serde::{Serialize, Serializer};

/// Picoseconds in a second.
pub const SECOND: i64 = 1_000_000_000_000;

/// An instant of a capture in picoseconds: since its beginning or its trigger (negative before the trigger), or since 1970
/// if the format gives the date. It can hold any number of years; the time between two instants is a plain number of
/// picoseconds, at most 106 days.
///
/// Its alignment in memory is at most eight bytes, so an edge with a level takes 24.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C, packed(8))]
pub struct Time(i128);

impl Time {
    /// The beginning of a capture that does not specify another one.
    pub const ZERO: Self = Self(0);
    /// An instant after all captures.
    pub const MAX: Self = Self(i128::MAX);

    /// Creates an instant from picoseconds.
    pub const fn from_ps(picoseconds: i128) -> Self {
        Self(picoseconds)
    }

    /// In picoseconds.
    pub const fn ps(self) -> i128 {
        self.0
    }

    /// In microseconds, approximately.
    pub fn us(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// Returns the time since `earlier` in picoseconds, if it is known to be shorter than 106 days.
    #[inline]
    pub(crate) const fn after(self, earlier: Self) -> i64 {
        (self.0 as i64).wrapping_sub(earlier.0 as i64)
    }

    /// The saturated result of an addition: the last instant that can be represented.
    #[cold]
    fn far(self, picoseconds: i128) -> Self {
        Self(self.0.saturating_add(picoseconds))
    }

    /// The saturated difference of two instants that are more than 106 days apart.
    #[cold]
    fn longest(self, before: Self) -> i64 {
        if self < before { i64::MIN } else { i64::MAX }
    }

    /// Returns the same instant on a clock that is 0 at `origin`.
    #[must_use]
    pub(crate) const fn since(self, origin: Self) -> Self {
        Self(self.0.saturating_sub(origin.0))
    }
}

impl Add<i64> for Time {
    type Output = Self;

    #[inline]
    fn add(self, picoseconds: i64) -> Self {
        match self.0.overflowing_add(picoseconds.into()) {
            (sum, false) => Self(sum),
            _ => self.far(picoseconds.into()),
        }
    }
}

impl AddAssign<i64> for Time {
    fn add_assign(&mut self, picoseconds: i64) {
        *self = *self + picoseconds;
    }
}

impl Sub<i64> for Time {
    type Output = Self;

    #[inline]
    fn sub(self, picoseconds: i64) -> Self {
        Self(self.0.saturating_sub(picoseconds.into()))
    }
}

/// Returns the time from one to the other, at most 106 days.
impl Sub for Time {
    type Output = i64;

    #[inline]
    fn sub(self, before: Self) -> i64 {
        let (way, over) = self.0.overflowing_sub(before.0);
        let near = way as i64;
        if !over && i128::from(near) == way { near } else { self.longest(before) }
    }
}

impl Neg for Time {
    type Output = Self;

    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.ps().fmt(f)
    }
}

impl Serialize for Time {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i128(self.0)
    }
}

/// The longest representable time: 30 million years.
const MOST: i128 = 1_000_000_000_000_000_000_000_000_000;

/// Converts decimal seconds (`-0.000012345`, `1.5e-6`) to picoseconds; further digits are dropped.
pub(crate) fn from_decimal(text: &str) -> Option<Time> {
    let text = text.trim();
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() && part.is_empty() {
        return None;
    }
    if !all_digits(whole) || !all_digits(part) {
        // Only an exponent is left as a legal form.
        return if text.contains(['e', 'E']) { from_seconds(text.parse().ok()?) } else { None };
    }
    let whole: i128 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
    let part = part.bytes().chain(std::iter::repeat(b'0')).take(12).fold(0, |n, b| n * 10 + i128::from(b - b'0'));
    let time = whole.checked_mul(SECOND.into())?.checked_add(part)?;
    (time < MOST).then_some(Time(if negative { -time } else { time }))
}

/// Converts floating-point seconds to picoseconds; `None` if no capture can hold the result.
pub(crate) fn from_seconds(seconds: f64) -> Option<Time> {
    let time = (seconds * 1e12).round();
    (time.abs() < MOST as f64).then_some(Time(time as i128))
}

/// Reads a frequency in hertz as people and files write it: digits, a prefix of the powers of a thousand, `Hz` in any case.
/// A small `m` means mega, as in sigrok.
pub fn frequency(text: &str) -> Option<f64> {
    let bare = text.trim();
    let bare = match bare.len().checked_sub(2).map(|at| (bare.get(..at), bare.get(at..))) {
        Some((Some(before), Some(unit))) if unit.eq_ignore_ascii_case("hz") => before.trim_end(),
        _ => bare,
    };
    let last = bare.chars().last()?;
    let factor = match last.to_ascii_lowercase() {
        'k' => 1e3,
        'm' => 1e6,
        'g' => 1e9,
        't' => 1e12,
        'p' => 1e15,
        'e' => 1e18,
        _ => 1.0,
    };
    let digits = if factor > 1.0 { bare.get(..bare.len() - 1)? } else { bare };
    let number: f64 = digits.trim().parse().ok()?;
    (number.is_finite() && number >= 0.0).then_some(number * factor)
}

/// Reads a time as people write it, with its unit: `500us`, `0.5 ms`, `-2s`; in picoseconds.
pub fn duration(text: &str) -> Option<Time> {
    let bare = text.trim();
    let digits = bare.trim_end_matches(char::is_alphabetic);
    let picoseconds = match bare.get(digits.len()..)? {
        "ps" => 1.0,
        "ns" => 1e3,
        "us" | "µs" | "μs" => 1e6,
        "ms" => 1e9,
        "s" => 1e12,
        _ => return None,
    };
    let number: f64 = digits.trim_end().parse().ok()?;
    from_seconds(number * picoseconds / 1e12)
}

/// Converts sample indices to picoseconds and back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clock {
    rate: u64,
    /// A number of samples and their duration in picoseconds, in the smallest whole numbers.
    samples: u64,
    picoseconds: u64,
}

impl Clock {
    /// Creates a clock; `rate` in samples per second, 1 to 10^12.
    pub fn new(rate: u64) -> Self {
        let rate = rate.clamp(1, SECOND as u64);
        let (mut common, mut rest) = (SECOND as u64, rate);
        while rest != 0 {
            (common, rest) = (rest, common % rest);
        }
        Self { rate, samples: rate / common, picoseconds: SECOND as u64 / common }
    }

    /// Samples per second.
    pub fn rate(self) -> u64 {
        self.rate
    }

    /// Returns when sample `index` was taken.
    #[inline]
    pub fn time(self, index: u64) -> Time {
        let time = index.checked_mul(self.picoseconds).and_then(|time| time.checked_add(self.samples / 2));
        match time {
            Some(time) if self.samples == 1 => Time(time.into()),
            Some(time) => Time((time / self.samples).into()),
            None => self.late(index),
        }
    }

    /// Returns the picoseconds of a sample if they are whole and the time of sample `last` fits into 64 bits: the time of each
    /// sample before it is then its number times this.
    pub(crate) fn whole(self, last: u64) -> Option<u64> {
        (self.samples == 1 && last.checked_mul(self.picoseconds).is_some()).then_some(self.picoseconds)
    }

    /// Returns the number of samples that take at least this many picoseconds.
    pub(crate) fn fewest(self, picoseconds: i64) -> u64 {
        let samples = u128::from(picoseconds.max(0).unsigned_abs()) * u128::from(self.samples);
        u64::try_from(samples.div_ceil(self.picoseconds.into())).unwrap_or(u64::MAX)
    }

    /// Returns the number of samples that take at most this many picoseconds.
    pub(crate) fn most(self, picoseconds: i64) -> u64 {
        let samples = u128::from(picoseconds.max(0).unsigned_abs()) * u128::from(self.samples);
        u64::try_from(samples / u128::from(self.picoseconds)).unwrap_or(u64::MAX)
    }

    /// Does the same if the product exceeds 64 bits.
    #[cold]
    fn late(self, index: u64) -> Time {
        let time = u128::from(index) * u128::from(self.picoseconds) + u128::from(self.samples / 2);
        Time((time / u128::from(self.samples)) as i128)
    }

    /// Returns the sample nearest to a non-negative time.
    pub fn index(self, time: Time) -> u64 {
        let index =
            time.0.max(0).saturating_mul(self.rate.into()).saturating_add(i128::from(SECOND / 2)) / i128::from(SECOND);
        u64::try_from(index).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn decimal_seconds() {
        for (text, want) in [
            ("0", Some(0)),
            ("0.000000000", Some(0)),
            ("-0.000012345", Some(-12_345_000)),
            (" 1.5 ", Some(1_500_000_000_000)),
            (".25", Some(250_000_000_000)),
            ("0.0000000000019", Some(1)),
            ("4.8e-07", Some(480_000)),
            ("1.2.3", None),
            ("", None),
            (".", None),
            ("one", None),
            ("2021-05-12T10:00:00", None),
            ("9999999999999999", None),
            ("1e300", None),
        ] {
            assert_eq!(from_decimal(text).map(Time::ps), want, "{text:?}");
        }
    }

    #[test]
    fn times_with_units() {
        for (text, want) in [
            ("500us", Some(500_000_000)),
            ("0.5 ms", Some(500_000_000)),
            ("-2s", Some(-2_000_000_000_000)),
            ("1e3ns", Some(1_000_000)),
            ("7 µs", Some(7_000_000)),
            ("5", None),
            ("us", None),
            ("5 h", None),
            ("", None),
            ("1e30s", None),
        ] {
            assert_eq!(duration(text).map(Time::ps), want, "{text:?}");
        }
    }

    #[test]
    fn years_are_no_limit() {
        // 100 years after 1970, to the picosecond.
        let late = from_decimal("3155760000.000000000001").unwrap();
        assert_eq!(late.ps(), 3_155_760_000_000_000_000_001);
        assert_eq!((late + 1 - late, late.since(late + -5).ps()), (1, 5));
        // Between two instants lie at most 106 days.
        assert_eq!([late - Time::ZERO, Time::ZERO - late], [i64::MAX, i64::MIN]);
        assert_eq!(Clock::new(1).time(u64::MAX).ps(), i128::from(u64::MAX) * 1_000_000_000_000);
        assert!([Time::MAX + 1, Time::MAX - -1, -(-Time::MAX - 1)].iter().all(|time| *time == Time::MAX));
    }

    proptest! {
        #[test]
        fn a_sample_has_one_time(rate in 1..=1_000_000_000_u64, index in 0..1_u64 << 40) {
            let clock = Clock::new(rate);
            prop_assume!(u128::from(index) * SECOND as u128 / u128::from(rate) < 9_000_000_000_000_000_000);
            prop_assert_eq!(clock.index(clock.time(index)), index);
        }
    }
}
