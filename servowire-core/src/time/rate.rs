use super::ClockError;

/// The longest tick that a clock may have, ns: an encoder answers 3 us after its request, and a field lasts 2 us at 5 Mbit/s. A
/// slower clock cannot distinguish one field from the next.
pub const MAX_TICK_NS: u32 = 1_000;

/// The lowest rate of a clock, Hz: ticks of [`MAX_TICK_NS`].
pub const MIN_TICK_HZ: u32 = NS_PER_S / MAX_TICK_NS;

const NS_PER_S: u32 = 1_000_000_000;

/// ARMv6-M (Cortex-M0+) has no multiplication of 32 by 32 bits to 64 and calls a 64-by-64 function for it. It has no
/// compare-and-swap either, which a crate can test for.
const MULTIPLIES_TO_32_BITS: bool = cfg!(all(target_arch = "arm", not(target_has_atomic = "32")));

/// How fast a clock counts, as the length of its tick: whole nanoseconds and a fraction of 32 bits.
///
/// The tick is rounded by 2^-33 ns at most, which is at most 0.5 ppb up to the highest rate, 0.005 ppb at 170 MHz, and zero if
/// the tick is a whole number of ns, or a fraction that terminates in binary: 1, 8, 10, 64, 125 or 200 MHz, 32.768 MHz.
///
/// ```
/// use servowire_core::{ClockError, TickRate};
///
/// const CYCLES: TickRate = TickRate::of::<170_000_000>();
/// assert_eq!(CYCLES.ns(170_000_000), 1_000_000_000);
/// // a rate that is known at run time
/// assert_eq!(TickRate::new(170_000_000), Ok(CYCLES));
/// assert_eq!(TickRate::new(32_768), Err(ClockError::TooCoarse { hz: 32_768, limit_hz: 1_000_000 }));
/// ```
///
/// A constant that is too low does not compile, nor does a tick of zero length:
///
/// ```compile_fail,E0080
/// let _ = servowire_core::TickRate::of::<999_999>();
/// ```
///
/// ```compile_fail,E0080
/// let _ = servowire_core::TickRate::of_ratio::<0, 1_000_000>();
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TickRate {
    /// Whole ns per tick, at most [`MAX_TICK_NS`].
    whole: u32,
    /// Fraction of a tick, in units of 2^-32 ns.
    fraction: u32,
}

impl TickRate {
    /// Creates a rate that is known at compile time, in Hz. A rate below [`MIN_TICK_HZ`] does not compile.
    pub const fn of<const HZ: u32>() -> Self {
        Self::of_ratio::<1, HZ>()
    }

    /// Creates the rate from the length of a tick, `NUM` / `DENOM` seconds, as in the types of `fugit`.
    pub const fn of_ratio<const NUM: u32, const DENOM: u32>() -> Self {
        const {
            assert!(
                DENOM as u64 >= NUM as u64 * MIN_TICK_HZ as u64,
                "the clock is too coarse: its tick has to be 1 us or shorter"
            );
            assert!(NUM > 0, "a tick lasts no time");
            Self::from_ratio(NUM, DENOM)
        }
    }

    /// Creates a rate that is known at run time, in Hz.
    ///
    /// # Errors
    /// [`ClockError::TooCoarse`] below [`MIN_TICK_HZ`].
    pub const fn new(hz: u32) -> Result<Self, ClockError> {
        if hz < MIN_TICK_HZ {
            return Err(ClockError::TooCoarse { hz, limit_hz: MIN_TICK_HZ });
        }
        Ok(Self::from_ratio(1, hz))
    }

    #[expect(
        clippy::arithmetic_side_effects,
        clippy::cast_possible_truncation,
        reason = "the denominator is not 0, and the tick is short: both callers have looked"
    )]
    const fn from_ratio(num: u32, denom: u32) -> Self {
        let (ns, denom) = (num as u64 * NS_PER_S as u64, denom as u64);
        // The rest has 32 bits, so 64 are enough. Rounded it is never a whole ns, for the denominator has 32 bits too.
        let fraction = (((ns % denom) << 32) + denom / 2) / denom;
        Self { whole: (ns / denom) as u32, fraction: fraction as u32 }
    }

    /// Returns the duration of `ticks` in ns, rounded down, modulo 2^64 ns, which is 584 years.
    ///
    /// A 64-bit counter needs nothing else. For a counter that wraps use [`TimeBase`](super::TimeBase).
    #[inline]
    pub const fn ns(self, ticks: u64) -> u64 {
        let [low, high] = words(ticks);
        self.turns_ns(high).wrapping_add(self.low_ns(low))
    }

    /// 2^32 ticks in ns: the tick with its fraction shifted up by 32 bits.
    #[inline]
    pub(super) const fn turn_ns(self) -> u64 {
        (self.whole as u64) << 32 | self.fraction as u64
    }

    const fn turns_ns(self, turns: u32) -> u64 {
        self.turn_ns().wrapping_mul(turns as u64)
    }

    /// Returns the duration of fewer than 2^32 ticks in ns, rounded down.
    #[inline]
    pub(super) const fn low_ns(self, ticks: u32) -> u64 {
        if MULTIPLIES_TO_32_BITS { self.low_ns_by_halves(ticks) } else { self.low_ns_by_words(ticks) }
    }

    #[inline]
    const fn low_ns_by_words(self, ticks: u32) -> u64 {
        let ticks = ticks as u64;
        let fraction = ticks.wrapping_mul(self.fraction as u64) >> 32;
        ticks.wrapping_mul(self.whole as u64).wrapping_add(fraction)
    }

    /// Computes the same from products of 16 bits. No sum exceeds 32 bits.
    #[inline]
    const fn low_ns_by_halves(self, ticks: u32) -> u64 {
        let (low, high) = (ticks & 0xffff, ticks >> 16);
        let (fine, coarse) = (self.fraction & 0xffff, self.fraction >> 16);
        let finest = high.wrapping_mul(fine).wrapping_add(low.wrapping_mul(fine) >> 16);
        let finer = low.wrapping_mul(coarse).wrapping_add(finest & 0xffff);
        let of_high = high.wrapping_mul(coarse).wrapping_add(finest >> 16);
        let of_low = low.wrapping_mul(self.whole).wrapping_add(finer >> 16);
        let whole_of_high = (high.wrapping_mul(self.whole) as u64) << 16;
        whole_of_high.wrapping_add(of_high as u64).wrapping_add(of_low as u64)
    }
}

/// Returns the low and the high word.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the words are what is wanted")]
const fn words(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks and rates at which a carry between the halves could get lost.
    const EDGES: [u32; 12] =
        [0, 1, 2, 0x7fff, 0xffff, 0x1_0000, 0x1_0001, 0x7fff_ffff, 0x8000_0000, 0xfffe_ffff, 0xffff_0000, u32::MAX];

    #[test]
    fn halves_and_words_give_the_exact_product() {
        for whole in [0, 1, 5, 999, 1000] {
            for fraction in EDGES {
                for ticks in EDGES {
                    let exact = (u128::from(ticks) * (u128::from(whole) << 32 | u128::from(fraction))) >> 32;
                    let rate = TickRate { whole, fraction };
                    assert_eq!(u128::from(rate.low_ns_by_halves(ticks)), exact, "{ticks} of {whole}+{fraction}");
                    assert_eq!(u128::from(rate.low_ns_by_words(ticks)), exact, "{ticks} of {whole}+{fraction}");
                }
            }
        }
    }

    #[test]
    fn a_tick_is_rounded_to_the_nearest() {
        for (hz, whole, fraction) in [
            (1_000_000, 1000, 0),
            (3_000_000, 333, 0x5555_5555),
            // 666.6666...
            (1_500_000, 666, 0xaaaa_aaab),
            (32_768_000, 30, 0x8480_0000),
            (u32::MAX, 0, 1_000_000_000),
        ] {
            assert_eq!(TickRate::new(hz), Ok(TickRate { whole, fraction }), "{hz} Hz");
        }
        // As near to a whole ns as can be: a 4th of a thousand-millionth below 1.
        assert_eq!(TickRate::from_ratio(4, 4_000_000_001), TickRate { whole: 0, fraction: 0xffff_ffff });
    }
}
