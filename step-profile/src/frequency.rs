use core::fmt;

use crate::error::Error;

/// A step frequency as a fraction in Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Ratio"))]
pub struct Frequency {
    numerator: u32,
    denominator: u16,
}

impl Frequency {
    /// Creates a frequency of `hz` steps per second.
    pub const fn from_hz(hz: u32) -> Self {
        Self { numerator: hz, denominator: 1 }
    }

    /// Creates a frequency of `numerator / denominator` steps per second; `None` for a denominator of 0.
    pub const fn from_ratio(numerator: u32, denominator: u16) -> Option<Self> {
        if denominator == 0 { None } else { Some(Self { numerator, denominator }) }
    }

    /// Converts a tone in tenths of a hertz by Equation 5 of TIDEP0061, section 2.3.3: x\[kHz\] = (y\[Hz\] - 9) · 49 / 187.
    ///
    /// `None` for tones of 9 Hz and below, and above 87 kHz.
    pub const fn of_tone(tenths_hz: u32) -> Option<Self> {
        // (tenths - 90) / 10 Hz * 49 / 187 * 1000
        match tenths_hz.checked_sub(90) {
            None | Some(0) => None,
            Some(above) => match above.checked_mul(4900) {
                Some(numerator) => Some(Self { numerator, denominator: 187 }),
                None => None,
            },
        }
    }

    /// The numerator in Hz, as given.
    pub const fn numerator(self) -> u32 {
        self.numerator
    }

    /// The denominator, as given: 1 or more.
    pub const fn denominator(self) -> u16 {
        self.denominator
    }

    /// Returns the steps in `ms` milliseconds at this frequency, rounded half up; 2^32 - 1 if there are more.
    ///
    /// Columns P125 and P250 of Table 3 in TIDEP0061, section 2.3.3.
    #[expect(clippy::cast_possible_truncation, reason = "compared with the largest 32-bit number")]
    pub const fn steps_in(self, ms: u16) -> u32 {
        let thousandfold = (self.numerator as u64).saturating_mul(ms as u64);
        let steps = round(thousandfold, (self.denominator as u64).saturating_mul(1000));
        if steps > u32::MAX as u64 { u32::MAX } else { steps as u32 }
    }
}

/// `94570 Hz`, or `13136900/187 Hz`.
impl fmt::Display for Frequency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.denominator {
            1 => write!(f, "{} Hz", self.numerator),
            denominator => write!(f, "{}/{denominator} Hz", self.numerator),
        }
    }
}

/// A frequency that is not checked yet.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Ratio {
    numerator: u32,
    denominator: u16,
}

#[cfg(feature = "serde")]
impl TryFrom<Ratio> for Frequency {
    type Error = Error;

    fn try_from(Ratio { numerator, denominator }: Ratio) -> Result<Self, Error> {
        Self::from_ratio(numerator, denominator).ok_or(Error::ZeroDenominator)
    }
}

#[cfg(feature = "arbitrary")]
#[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
impl<'a> arbitrary::Arbitrary<'a> for Frequency {
    fn arbitrary(u: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self { numerator: u.arbitrary()?, denominator: u.int_in_range(1..=u16::MAX)? })
    }
}

/// One of the speeds named in TI's `sorte_master_cfg.inc`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NamedSpeed {
    /// Steps per second.
    pub hz: u32,
    /// Its constant.
    pub speed: Speed,
}

/// The speed constant 2^16 / f\[MHz\]: the period of full speed in microseconds, 16.16 fixed point.
///
/// TIDEP0061, section 2.3.2 (operand R29 of Table 2). Any 32-bit word is accepted here; whether it can be run is checked,
/// together with the ramp table, by [`Profile::new`](crate::Profile::new).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Speed(u32);

impl Speed {
    /// 250 kHz, the fastest: a pulse in every cycle.
    pub const KHZ_250: Self = Self(262_144);
    /// 160 kHz.
    pub const KHZ_160: Self = Self(409_600);
    /// 100 kHz.
    pub const KHZ_100: Self = Self(655_360);
    /// 50 kHz.
    pub const KHZ_50: Self = Self(1_310_720);
    /// 20 kHz.
    pub const KHZ_20: Self = Self(3_276_800);
    /// 10 kHz.
    pub const KHZ_10: Self = Self(6_553_600);
    /// 5 kHz.
    pub const KHZ_5: Self = Self(13_107_200);
    /// 2 kHz.
    pub const KHZ_2: Self = Self(32_768_000);
    /// 1 kHz.
    pub const KHZ_1: Self = Self(65_536_000);
    /// 100 Hz.
    pub const HZ_100: Self = Self(655_360_000);

    /// The ten speeds of TI's `sorte_master_cfg.inc`, in Hz, the fastest first.
    pub const NAMED: [NamedSpeed; 10] = [
        NamedSpeed { hz: 250_000, speed: Self::KHZ_250 },
        NamedSpeed { hz: 160_000, speed: Self::KHZ_160 },
        NamedSpeed { hz: 100_000, speed: Self::KHZ_100 },
        NamedSpeed { hz: 50_000, speed: Self::KHZ_50 },
        NamedSpeed { hz: 20_000, speed: Self::KHZ_20 },
        NamedSpeed { hz: 10_000, speed: Self::KHZ_10 },
        NamedSpeed { hz: 5_000, speed: Self::KHZ_5 },
        NamedSpeed { hz: 2_000, speed: Self::KHZ_2 },
        NamedSpeed { hz: 1_000, speed: Self::KHZ_1 },
        NamedSpeed { hz: 100, speed: Self::HZ_100 },
    ];

    /// Creates the speed from the constant itself, as carried by the host interface word `speed`.
    pub const fn from_raw(constant: u32) -> Self {
        Self(constant)
    }

    /// The constant itself.
    pub const fn raw(self) -> u32 {
        self.0
    }

    /// Returns the constant of `hz` steps per second, rounded half up.
    ///
    /// # Errors
    /// [`Error::FrequencyTooLow`] below 15.26 Hz.
    pub const fn from_hz(hz: u32) -> Result<Self, Error> {
        Self::from_frequency(Frequency::from_hz(hz))
    }

    /// Returns the constant of a step frequency, rounded half up.
    ///
    /// # Errors
    /// [`Error::FrequencyTooLow`] below 15.26 Hz.
    #[expect(clippy::cast_possible_truncation, reason = "compared with the largest 32-bit number")]
    pub const fn from_frequency(frequency: Frequency) -> Result<Self, Error> {
        // 2^16 µs in units of 1/denominator; below 2^52.
        let scaled = 65_536_000_000_u64.saturating_mul(frequency.denominator as u64);
        let constant = round(scaled, frequency.numerator as u64);
        if constant > u32::MAX as u64 { Err(Error::FrequencyTooLow) } else { Ok(Self(constant as u32)) }
    }
}

/// The constant: `262144`.
impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// `dividend / divisor` rounded half up; the largest number for a divisor of 0.
const fn round(dividend: u64, divisor: u64) -> u64 {
    match (dividend.checked_div(divisor), dividend.checked_rem(divisor)) {
        (Some(quotient), Some(rest)) => {
            let up = rest >= divisor.saturating_sub(rest);
            quotient.saturating_add(up as u64)
        }
        _ => u64::MAX,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn named_speeds_are_exact() {
        for NamedSpeed { hz, speed } in Speed::NAMED {
            assert_eq!(u64::from(speed.raw()) * u64::from(hz), 65_536_000_000);
            assert_eq!(Speed::from_hz(hz), Ok(speed));
        }
    }

    /// Half a step counts as one, a little less does not.
    #[test]
    fn steps_are_rounded_half_up() {
        let steps = |numerator, denominator, ms| Frequency::from_ratio(numerator, denominator).unwrap().steps_in(ms);
        assert_eq!([steps(1, 1, 499), steps(1, 1, 500), steps(1, 1, 501)], [0, 1, 1]);
        assert_eq!([steps(3, 1, 500), steps(5, 3, 300), steps(4999, 10_000, 1000), steps(1, 2, 1000)], [2, 1, 0, 1]);
        // An odd divisor has no half: 3·333/1000 is below it by little, 334/333 above 1 by little.
        assert_eq!([steps(1, 999, 499), steps(334, 333, 1000)], [0, 1]);
    }

    #[test]
    fn frequencies_are_printed_in_hertz() {
        assert_eq!(Frequency::from_hz(94_570).to_string(), "94570 Hz");
        assert_eq!(Frequency::of_tone(2771).unwrap().to_string(), "13136900/187 Hz");
        assert_eq!(Speed::KHZ_250.to_string(), "262144");
    }

    #[test]
    fn the_slowest_frequency_and_none() {
        assert_eq!(Speed::from_hz(0), Err(Error::FrequencyTooLow));
        assert_eq!(Speed::from_hz(15), Err(Error::FrequencyTooLow));
        assert_eq!(Speed::from_hz(16), Ok(Speed(4_096_000_000)));
        assert_eq!(Frequency::from_ratio(1, 0), None);
        assert_eq!(Frequency::of_tone(90), None);
        assert_eq!(Frequency::of_tone(91), Frequency::from_ratio(4900, 187));
        assert_eq!(Frequency::of_tone(u32::MAX), None);
        assert_eq!(Frequency::from_hz(u32::MAX).steps_in(u16::MAX), u32::MAX);
    }

    proptest! {
        #[test]
        fn rounded_to_nearest_half_up(numerator in 1..=u32::MAX, denominator in 1..=u16::MAX) {
            let exact = 65_536_000_000_u128 * u128::from(denominator);
            let f = u128::from(numerator);
            let want = (2 * exact + f) / (2 * f);
            let got = Speed::from_frequency(Frequency::from_ratio(numerator, denominator).unwrap());
            prop_assert_eq!(got, u32::try_from(want).map(Speed).map_err(|_| Error::FrequencyTooLow));
        }

        #[test]
        fn a_ratio_in_lower_terms_is_the_same_speed(hz in 16..=250_000_u32, by in 1..=1000_u16) {
            let ratio = Frequency::from_ratio(hz * u32::from(by), by).unwrap();
            prop_assert_eq!(Speed::from_frequency(ratio), Speed::from_hz(hz));
            prop_assert_eq!(ratio.steps_in(125), Frequency::from_hz(hz).steps_in(125));
        }
    }
}
