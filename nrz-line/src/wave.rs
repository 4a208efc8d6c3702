/// The instants at which the bits of a transmitter begin, in samples of a receiver whose clock differs.
///
/// This is the line as seen by a logic analyser or an oversampling receiver, for simulated lines, rendered captures and
/// tolerance tests.
///
/// ```
/// use nrz_line::Wave;
/// let exact = Wave::new(8, 0, 0);
/// assert_eq!((exact.first_sample(0), exact.first_sample(10)), (0, 80));
/// // 2 % fast: ten bits take 78.43 samples; the eleventh bit is first seen by sample 79
/// assert_eq!(Wave::new(8, 20_000, 0).first_sample(10), 79);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wave {
    /// Samples per bit in 32.32 fixed point.
    period: u64,
    /// Fraction of a sample period by which bit 0 begins after a sampling instant, 0.32 fixed point.
    phase: u32,
}

impl Wave {
    /// Describes a transmitter with `samples_per_bit` at the nominal rate that is `ppm` parts per million faster (negative:
    /// slower; lower numbers count as -999 999), with the `phase` of bit 0 as a fraction of a sample period (2^32 = a whole one).
    #[expect(
        clippy::cast_sign_loss,
        clippy::cast_possible_truncation,
        reason = "the rate is positive, the period below 2^64"
    )]
    pub const fn new(samples_per_bit: u32, ppm: i32, phase: u32) -> Self {
        let rate = 1_000_000_i64.saturating_add(ppm as i64);
        let rate = if rate < 1 { 1 } else { rate as u64 };
        let period = match (((samples_per_bit as u128) << 32).saturating_mul(1_000_000)).checked_div(rate as u128) {
            Some(period) => period as u64,
            None => 0,
        };
        Self { period, phase }
    }

    /// Returns the index of the first sample that sees bit `bit`.
    #[expect(clippy::cast_possible_truncation, reason = "captures are shorter than 2^64 samples")]
    pub const fn first_sample(self, bit: u64) -> u64 {
        let time = (self.period as u128).saturating_mul(bit as u128).saturating_add(self.phase as u128);
        (time.saturating_add(u32::MAX as u128) >> 32) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::Wave;

    /// A millionth of the rate is the lowest: a bit of 8 samples lasts 8 million.
    #[test]
    fn the_slowest_transmitter() {
        for ppm in [-999_999, -1_000_000, -1_000_001, i32::MIN] {
            assert_eq!(Wave::new(8, ppm, 0).first_sample(1), 8_000_000, "{ppm}");
        }
        assert_eq!(Wave::new(8, -999_998, 0).first_sample(1), 4_000_000);
    }
}
