//! Conversions of numbers beside whole numbers of 128 bits.

use crate::real::{Inverse, Real, middle};
use proptest::prelude::*;

/// Moved by a power of two, truncated; `None` if it does not fit.
fn moved(n: u128, by: i32) -> Option<u128> {
    match u32::try_from(by) {
        Ok(up) => (n == 0 || up <= n.leading_zeros()).then(|| n.checked_shl(up).unwrap_or(0)),
        Err(_) => Some(n.checked_shr(by.unsigned_abs()).unwrap_or(0)),
    }
}

fn number() -> impl Strategy<Value = u64> {
    (any::<u64>(), 0..64_u32).prop_map(|(n, by)| n >> by)
}

fn divisor() -> impl Strategy<Value = u64> {
    number().prop_map(|n| n.max(2))
}

/// 2^126 - 1, the largest wide number.
const MOST: i128 = (1 << 126) - 1;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 16 } else { 20_000 }))]

    #[test]
    fn whole_numbers_of_any_unit(n in number(), own in -70..70_i32, bits in -140..140_i32) {
        let (x, exact) = (Real::fixed(n, own), moved(n.into(), bits - own));
        prop_assert_eq!(x.to_fixed(bits), exact.and_then(|n| u64::try_from(n).ok()).unwrap_or(u64::MAX));
        let wide = exact.and_then(|n| i128::try_from(n).ok()).filter(|n| *n < MOST).unwrap_or(MOST);
        prop_assert_eq!(x.to_wide(bits), wide);
    }

    #[test]
    fn a_product_of_any_unit(n in divisor(), own in -70..70_i32, x in divisor(), bits in -140..140_i32) {
        let got = Real::fixed(n, own).times(x, bits);
        let exact = moved(u128::from(n) * u128::from(x), bits - own);
        // What is from 2^126 to below 2^127 may be either.
        match exact.and_then(|n| i128::try_from(n).ok()) {
            Some(exact) if exact < MOST || got != MOST => prop_assert_eq!(got, exact),
            _ => prop_assert_eq!(got, MOST),
        }
    }

    #[test]
    fn a_part(n in number(), own in -70..70_i32, x in number()) {
        let (number, exact) = (Real::fixed(n, own), moved(u128::from(n) * u128::from(x), -own));
        let unit = (number.exponent() - 63).max(0);
        if unit < 64 {
            let got = number.part(x);
            let exact = exact.map_or(u64::MAX, |n| (n >> 64) as u64);
            prop_assert!(got <= exact || got == u64::MAX && exact.leading_ones() >= 63 - unit.unsigned_abs(), "{got} for {exact}");
            prop_assert!(exact - got.min(exact) < 1 << unit, "{got} for {exact}");
        }
    }

    /// Exact to 56 bits, and to a unit of the result.
    #[test]
    fn a_quotient(n in number(), own in -70..70_i32, by in divisor()) {
        let number = Real::fixed(n, own);
        if number.exponent() < 100 {
            let (got, exact) = (number.over(Inverse::new(by)), moved(u128::from(n) << 64, -2 - own));
            let exact = exact.map_or(u128::MAX, |n| n / u128::from(by)).min(u64::MAX.into()) as u64;
            let lost = moved(u128::from(n) << 64, -2 - own).is_none();
            prop_assert!(lost || got.abs_diff(exact) <= (exact >> 56) + 1, "{got} for {exact}");
        }
    }

    #[test]
    fn a_rough_quotient(x: u32, by in divisor()) {
        let (got, exact) = (Inverse::new(by).rough(x), (u128::from(x) << 64) / u128::from(by));
        let unit = 2_u128 << by.leading_zeros();
        let most = exact + 4 * unit;
        prop_assert!(u128::from(got) + unit > exact.min(u32::MAX.into()), "{got} for {exact}");
        prop_assert!(u128::from(got) <= most || got == u32::MAX && most + unit > u32::MAX.into(), "{got} for {exact}");
    }

    #[test]
    fn the_middle_of_a_product(a in number(), b in number(), down in 1..64_u32) {
        prop_assert_eq!(middle(a, b, down), ((u128::from(a) * u128::from(b)) >> down) as u64);
    }
}

/// A part of nothing is 0, whatever the unit; and 0 is one number, whichever way it came.
#[test]
fn nothing() {
    for x in [Real::new(4), Real::fixed(1, 80), Real::ONE.scaled(80)] {
        assert_eq!([Real::ZERO * x, x * Real::ZERO, Real::ZERO.scaled(3)], [Real::ZERO; 3]);
        assert!(Real::ZERO < x && x * Real::ZERO < Real::fixed(1, 1000));
    }
    assert_eq!(Real::ZERO.to_fixed(i32::MAX), 0);
}
