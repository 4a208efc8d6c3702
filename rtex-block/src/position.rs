//! Command positions: 32-bit numbers that wrap.

use servowire_core::OutOfRange;

/// Returns the step from one position to the next, the short way round: 7FFFFFFFh to 80000000h is a step of +1.
///
/// SX-DSV02310, "Command error protection".
pub const fn step(old: i32, new: i32) -> i32 {
    new.wrapping_sub(old)
}

/// Electronic gear: encoder pulses per command unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "(u32, u32)", into = "(u32, u32)")
)]
pub struct Gear {
    numerator: u32,
    denominator: u32,
}

impl Gear {
    /// 1/1.
    pub const UNITY: Self = Self { numerator: 1, denominator: 1 };

    /// Creates the gear; `None` if either number is 0.
    pub const fn new(numerator: u32, denominator: u32) -> Option<Self> {
        if numerator == 0 || denominator == 0 { None } else { Some(Self { numerator, denominator }) }
    }
}

impl TryFrom<(u32, u32)> for Gear {
    type Error = OutOfRange;

    /// Numerator and denominator.
    fn try_from((numerator, denominator): (u32, u32)) -> Result<Self, OutOfRange> {
        Self::new(numerator, denominator).ok_or(OutOfRange { got: 0, max: 1 })
    }
}

impl From<Gear> for (u32, u32) {
    fn from(gear: Gear) -> Self {
        (gear.numerator, gear.denominator)
    }
}

/// Largest rate of command pulses after the electronic gear, in pulses per second.
pub const MAX_PULSES_PER_S: u32 = 400_000_000;

/// Returns the largest step of the command position in an update period, command units, rounded down.
///
/// A larger step raises alarm Err27.4. So does a step above the over-speed level of the drive, which is usually lower.
/// At gear 1/1 and 0.5 ms the largest step is 200 000. SX-DSV02310, "Command error protection".
pub const fn max_step(update_ns: u32, gear: Gear) -> u32 {
    let (pulses, per_unit) = limit(update_ns, gear);
    quotient(pulses, per_unit)
}

/// The limit as a ratio, because 400 M pulse/s x update_ns / 1e9 is update_ns x 2/5: a numerator of at most 65 bits, and a
/// denominator of at most 35 bits that is never 0.
const fn limit(update_ns: u32, gear: Gear) -> (u128, u64) {
    let pulses = (update_ns as u128).wrapping_mul(2).wrapping_mul(gear.denominator as u128);
    (pulses, (gear.numerator as u64).wrapping_mul(5))
}

/// Divides a number of at most 65 bits by a divisor of 2 to 2^63; returns `u32::MAX` if the quotient is larger.
///
/// The division is made bit by bit, once per axis, because the divisions of the compiler's library take 1.4 KiB of a
/// Cortex-M4's flash.
#[inline(never)]
#[expect(clippy::cast_possible_truncation, reason = "clamped just before")]
const fn quotient(dividend: u128, divisor: u64) -> u32 {
    let (mut quotient, mut rest, mut bits) = (0_u64, 0_u64, 65_u32);
    let mut left = dividend << 63;
    while bits > 0 {
        bits = bits.wrapping_sub(1);
        rest = rest << 1 | (left >> 127) as u64;
        left <<= 1;
        quotient <<= 1;
        if rest >= divisor {
            rest = rest.wrapping_sub(divisor);
            quotient |= 1;
        }
    }
    if quotient > u32::MAX as u64 { u32::MAX } else { quotient as u32 }
}

/// Returns the largest step of the command position in an update period at a given speed, in command units, rounded down: for
/// the over-speed level of a drive in command units per second.
pub(crate) const fn max_step_at(units_per_s: u32, update_ns: u32) -> u32 {
    quotient((units_per_s as u128).wrapping_mul(update_ns as u128), 1_000_000_000)
}

/// Returns the largest torque command in 0.1 % of rated, rounded down, from the parameters of a linear drive: `peak` is
/// Pr9.07 (peak current) and `rated` Pr9.06 (rated current, r.m.s.), both in 0.1 A. `None` if `rated` is 0.
///
/// The formula is 100 % x Pr9.07 / (Pr9.06 x sqrt 2). SX-DSV02310, "Command torque"; the root sign is missing in the available
/// text, but follows from the ratio of a peak to an r.m.s. value.
pub fn max_torque(peak: u16, rated: u16) -> Option<u32> {
    let thousandfold = u128::from(peak).saturating_mul(1_000);
    let squared = thousandfold.saturating_mul(thousandfold);
    let root = squared.checked_div(u128::from(rated).saturating_mul(rated.into()).saturating_mul(2))?.isqrt();
    u32::try_from(root).ok()
}

/// Returns whether a step stays within [`max_step`].
pub const fn is_within_limit(step: i32, update_ns: u32, gear: Gear) -> bool {
    let (pulses, per_unit) = limit(update_ns, gear);
    (step.unsigned_abs() as u128).wrapping_mul(per_unit as u128) <= pulses
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn published_figures() {
        for (update_ns, want) in [(62_500, 25_000), (500_000, 200_000), (4_000_000, 1_600_000)] {
            assert_eq!(max_step(update_ns, Gear::UNITY), want);
        }
        assert_eq!(max_step(500_000, Gear::new(2, 1).unwrap()), 100_000);
        let within = |step| is_within_limit(step, 500_000, Gear::UNITY);
        assert_eq!([-200_001, -200_000, 0, 200_000, 200_001].map(within), [false, true, true, true, false]);
        assert_eq!(max_step(u32::MAX, Gear::new(1, u32::MAX).unwrap()), u32::MAX);
        assert_eq!(Gear::new(0, 1), None);
        assert_eq!(Gear::new(1, 0), None);
    }

    /// The formula of SX-DSV02310, section "Command torque", by hand: 100 % x 141.4 A / (100.0 A x 1.41421) = 99.98 %.
    #[test]
    fn torque_limit() {
        assert_eq!(max_torque(1_414, 1_000), Some(999));
        assert_eq!(max_torque(1_415, 1_000), Some(1_000));
        assert_eq!(max_torque(6_000, 1_414), Some(3_000));
        assert_eq!(max_torque(0, 5), Some(0));
        assert_eq!(max_torque(5, 0), None);
        assert_eq!(max_torque(u16::MAX, 1), Some(46_340_242));
    }

    #[test]
    fn steps_at_a_speed() {
        assert_eq!(max_step_at(400_000_000, 500_000), 200_000);
        assert_eq!(max_step_at(1_999, 500_000), 0);
        assert_eq!(max_step_at(2_000, 500_000), 1);
        assert_eq!(max_step_at(u32::MAX, u32::MAX), u32::MAX);
    }

    proptest! {
        #[test]
        fn steps_add_up(old: i32, by: i32) {
            prop_assert_eq!(step(old, old.wrapping_add(by)), by);
        }

        /// Divided by the machine, over all that can be written down.
        #[test]
        fn the_largest_step_is_the_quotient(update_ns: u32, n in 1u32.., d in 1u32..) {
            let quotient = 2 * u128::from(update_ns) * u128::from(d) / (5 * u128::from(n));
            prop_assert_eq!(u128::from(max_step(update_ns, Gear::new(n, d).unwrap())), quotient.min(u32::MAX.into()));
        }

        /// By the definition of the limit, in rationals.
        #[test]
        fn limit_by_definition(s: i32, update_ns in 1u32..10_000_000, n in 1u32..1000, d in 1u32..1000) {
            let left = u128::from(s.unsigned_abs()) * u128::from(n) * 1_000_000_000;
            let right = u128::from(MAX_PULSES_PER_S) * u128::from(update_ns) * u128::from(d);
            prop_assert_eq!(is_within_limit(s, update_ns, Gear::new(n, d).unwrap()), left <= right);
        }
    }
}
