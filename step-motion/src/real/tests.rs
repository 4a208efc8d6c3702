//! Numbers beside floating point, and conversions beside whole numbers of 128 bits.

use super::*;
use proptest::prelude::*;

#[expect(clippy::cast_precision_loss, reason = "compared within 2^-50")]
fn float(x: Real) -> f64 {
    // The power of two is built from its bits: Miri makes the last bits of `exp2` wrong, as they may be.
    if x.is_zero() { 0.0 } else { x.m() as f64 * f64::from_bits(u64::try_from(x.e() + 1023).unwrap() << 52) }
}

fn near(got: Real, want: f64) {
    assert!((float(got) - want).abs() <= want.abs() * 1e-15 * 4.0, "{} for {want}", float(got));
}

fn any_real() -> impl Strategy<Value = Real> {
    (any::<u64>(), -100..100_i32).prop_map(|(n, bits)| Real::fixed(n, bits))
}

proptest! {
    #[test]
    fn as_with_floats(a in any_real(), b in any_real()) {
        let (x, y) = (float(a), float(b));
        near(a + b, x + y);
        near(a * b, x * y);
        near(a.sqrt(), x.sqrt());
        near(a.per_sqrt() * a.sqrt(), if a.is_zero() { 0.0 } else { 1.0 });
        let third = float(a.cbrt());
        prop_assert!((third.powi(3) - x).abs() <= x * 3.0 / 2.0_f64.powi(50), "{third} of {x}");
        prop_assert!(a.cmp(&b) == b.cmp(&a).reverse() && (x - y).abs() <= x * 1e-15 || (a < b) == (x < y));
        if b > Real::ZERO {
            near(a / b, x / y);
            let wide = ((u128::from(u64::MAX) << 63) / u128::from(b.m())) as u64;
            prop_assert!(reciprocal(b.m()).abs_diff(wide) <= 32, "{} for {wide}", reciprocal(b.m()));
        }
        let (high, low) = if a > b { (a, b) } else { (b, a) };
        prop_assert!((float(high - low) - (x - y).abs()).abs() <= x.max(y) * 1e-15);
        prop_assert_eq!(low - high, Real::ZERO);
        prop_assert!(high >= low && high.max(low) == high && high.min(low) == low);
        prop_assert!(low.max(high) == high && low.min(high) == low && low.distance(high) == high.distance(low));
    }

    #[test]
    fn there_and_back(n: u64, bits in -10..60_i32) {
        prop_assert_eq!(Real::fixed(n, bits).to_fixed(bits), n);
        prop_assert_eq!(Real::new(n).to_fixed(0), n);
        prop_assert_eq!(Real::fixed(n, 7).to_fixed(0), n >> 7);
    }
}

/// The roots of squares of whole numbers are exact to 58 bits.
#[test]
fn roots_of_squares() {
    for bits in 0..32_u32 {
        for n in
            [1_u64 << bits, (1 << bits) + 1, (2 << bits) - 1, (3 << bits) / 2, (1 << bits) | 0x5555_5555 >> (31 - bits)]
        {
            let (n, root) = (Real::new(n), Real::new(n * n).sqrt());
            assert!(root.distance(n) <= n.scaled(-58), "{root:?} for {n:?}");
            let per = Real::new(n.to_fixed(0) * n.to_fixed(0)).per_sqrt();
            let want = Real::ONE / n;
            assert!(per.distance(want) <= want.scaled(-57), "{per:?} for {want:?}");
            let root = Real::new(n.to_fixed(0) * n.to_fixed(0)).scaled(-63).sqrt();
            let want = n.scaled(-32) * Real::new(2).sqrt();
            assert!(root.distance(want) <= want.scaled(-57), "{root:?} for {want:?}");
        }
    }
    for m in [u64::MAX, u64::MAX - 1, 1 << 63, (1 << 63) + 1, u64::MAX >> 1, 1 << 62, u64::MAX << 32, u64::MAX << 31] {
        let root = Real::new(m).sqrt();
        assert!(root.squared().distance(Real::new(m)) <= Real::new(m).scaled(-57), "{root:?} of {m}");
        let per = Real::new(m).per_sqrt();
        assert!((per * root).distance(Real::ONE) <= Real::ONE.scaled(-56), "{per:?} of {m}");
    }
}

/// At both ends of each entry of the table, and at both parities of the exponent.
#[test]
fn roots_from_each_entry_of_the_table() {
    for at in 64..256_u64 {
        for m in [at << 56, (at << 56) | (u64::MAX >> 8), (at << 56) | (1 << 32)] {
            for e in [0, 7] {
                let x = Real::fixed(m, e);
                let root = x.sqrt();
                assert!(root.squared().distance(x) <= x.scaled(-57), "{root:?} of {x:?}");
                let per = x.per_sqrt();
                assert!((per * root).distance(Real::ONE) <= Real::ONE.scaled(-56), "{per:?} of {x:?}");
            }
        }
    }
}

/// The cube roots of cubes of whole numbers, and of twice and four times these.
#[test]
fn roots_of_cubes() {
    for n in (1..2000).chain((1..1_321_123).step_by(997)).chain([1_321_122, 1 << 20, 1_048_575]) {
        let cube = Real::new(n * n) * Real::new(n);
        for (more, want) in
            [(0, 1.0), (1, 2.0_f64.cbrt()), (2, 4.0_f64.cbrt()), (-1, 0.5_f64.cbrt()), (-300, 2.0_f64.powi(-100))]
        {
            let root = cube.scaled(more).cbrt();
            near(root, want * float(Real::new(n)));
            assert!(more != 0 || root.distance(Real::new(n)) <= root.scaled(-55), "{root:?} for {n}");
        }
    }
}

#[test]
fn the_edges() {
    let (zero, one) = (Real::ZERO, Real::new(1));
    assert_eq!((zero + one, one - one, zero * one, zero / one, zero.sqrt()), (one, zero, zero, zero, zero));
    assert_eq!(zero.per_sqrt(), Real::HUGE);
    assert_eq!((one / zero, zero - one, one + zero, one - zero), (Real::HUGE, zero, one, one));
    assert_eq!((Real::HUGE.to_fixed(0), Real::HUGE.to_fixed(-2000)), (u64::MAX, 0));
    near(Real::new(9).sqrt(), 3.0);
    assert!(reciprocal(1 << 63) > u64::MAX - 16);
    assert_eq!(one.along(one, false), zero);
    near(THIRD, 1.0 / 3.0);
    assert_eq!((zero.cmp(&zero), zero.cmp(&one), one.cmp(&zero)), (Ordering::Equal, Ordering::Less, Ordering::Greater));
    // 2^64 - 1, to the last bit.
    assert_eq!(Real::new((1 << 32) - 1) * Real::new((1 << 32) + 1), Real::new(u64::MAX));
}

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
