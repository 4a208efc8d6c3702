use crate::layout::FRAME_BITS;
use crate::layout::Layout;

/// The five bit rates of A-format encoders; which one an encoder uses is part of its order code and cannot be changed
/// over the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum BitRate {
    /// 2.5 Mbit/s, 400 ns per bit.
    Mbit2_5,
    /// 4 Mbit/s, 250 ns per bit.
    Mbit4,
    /// 6.67 Mbit/s, exactly 20/3, 150 ns per bit.
    Mbit6_67,
    /// 8 Mbit/s, 125 ns per bit.
    Mbit8,
    /// 16 Mbit/s, 62.5 ns per bit.
    Mbit16,
}

/// Shortest time between two frames of a request, in ns.
///
/// Later releases of the AM243x Motor Control SDK use 1 us and list the 10 us of release 9.2 as a defect; an upper limit is
/// not documented.
pub const FRAME_GAP_NS: u32 = 1_000;

/// Shortest time from the end of a transaction to the next request, in ns, as used by one drive maker.
pub const REQUEST_GAP_NS: u32 = 10_000;

/// Longest time that the EEPROM is busy with a read, in ns ("Nikon Protocol Design").
pub const READ_BUSY_NS: u32 = 300_000;

/// Longest time that an encoder is busy with a write, an address setting or a reset, in ns ("Nikon Protocol Design").
pub const WRITE_BUSY_NS: u32 = 30_000_000;

/// Time from power-up to the first request, in ns.
pub const POWER_UP_NS: u32 = 500_000_000;

impl BitRate {
    /// All five rates, the slowest first.
    pub const ALL: [Self; 5] = [Self::Mbit2_5, Self::Mbit4, Self::Mbit6_67, Self::Mbit8, Self::Mbit16];

    /// Duration of one bit in ps.
    pub const fn bit_ps(self) -> u32 {
        match self {
            Self::Mbit2_5 => 400_000,
            Self::Mbit4 => 250_000,
            Self::Mbit6_67 => 150_000,
            Self::Mbit8 => 125_000,
            Self::Mbit16 => 62_500,
        }
    }

    /// Bits per second, rounded.
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::Mbit2_5 => 2_500_000,
            Self::Mbit4 => 4_000_000,
            Self::Mbit6_67 => 6_666_667,
            Self::Mbit8 => 8_000_000,
            Self::Mbit16 => 16_000_000,
        }
    }

    /// Duration of `bits` bits in ns, rounded up.
    pub const fn bits_ns(self, bits: u32) -> u32 {
        let ps = (self.bit_ps() as u64).wrapping_mul(bits as u64).saturating_add(999);
        narrow(ps / 1000)
    }

    /// Number of bits that last at least `ns`.
    pub const fn bits(self, ns: u32) -> u32 {
        let ps = (ns as u64).wrapping_mul(1000);
        // One division a rate: the compiler makes a multiplication of each.
        narrow(match self {
            Self::Mbit2_5 => ps.div_ceil(400_000),
            Self::Mbit4 => ps.div_ceil(250_000),
            Self::Mbit6_67 => ps.div_ceil(150_000),
            Self::Mbit8 => ps.div_ceil(125_000),
            Self::Mbit16 => ps.div_ceil(62_500),
        })
    }

    /// The gap between the responses of two encoders to a multi-response request, in ns.
    ///
    /// This is the time that the AM243x Motor Control SDK waits before it looks for the next start bit, so it is a lower bound.
    pub const fn response_gap_ns(self) -> u32 {
        match self {
            Self::Mbit2_5 => 3_000,
            Self::Mbit4 | Self::Mbit6_67 => 2_000,
            Self::Mbit8 | Self::Mbit16 => 1_500,
        }
    }

    /// Line time of a response in ns, rounded up.
    pub const fn response_ns(self, layout: Layout) -> u32 {
        self.bits_ns(layout.line_bits())
    }

    /// Line time of a request of one frame, `encoders` responses and the gaps between them, in ns, rounded up. The turn-around
    /// of the encoders and the delay of the cable (5 ns per metre each way) have to be added.
    pub const fn transaction_ns(self, layout: Layout, encoders: u8) -> u32 {
        let bits = layout.line_bits().wrapping_mul(encoders as u32).wrapping_add(FRAME_BITS);
        let gaps = (encoders as u32).saturating_sub(1);
        self.bits_ns(bits).saturating_add(gaps.wrapping_mul(self.response_gap_ns()))
    }

    /// Shortest cycle in which a multi-response command with this layout can be repeated: the transaction, the turn-around
    /// time `turn_around_ns` and [`REQUEST_GAP_NS`].
    pub const fn min_cycle_ns(self, layout: Layout, encoders: u8, turn_around_ns: u32) -> u32 {
        self.transaction_ns(layout, encoders).saturating_add(turn_around_ns).saturating_add(REQUEST_GAP_NS)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "checked")]
const fn narrow(value: u64) -> u32 {
    if value > u32::MAX as u64 { u32::MAX } else { value as u32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_does_not_fit_is_as_long_as_can_be() {
        assert_eq!((BitRate::Mbit2_5.bits_ns(u32::MAX), BitRate::Mbit16.bits(u32::MAX)), (u32::MAX, 68_719_477));
    }

    /// Request and response on the line, without turn-around, as the tables of the protocol have them.
    #[test]
    fn line_times() {
        let ns = |layout| BitRate::ALL.map(|rate| rate.transaction_ns(layout, 1));
        assert_eq!(ns(Layout::Abs17), [21_600, 13_500, 8_100, 6_750, 3_375]);
        assert_eq!(ns(Layout::Status), [28_800, 18_000, 10_800, 9_000, 4_500]);
        assert_eq!(ns(Layout::Abs40), [36_000, 22_500, 13_500, 11_250, 5_625]);
        assert_eq!(ns(Layout::Abs24Vel), [43_200, 27_000, 16_200, 13_500, 6_750]);
        assert_eq!(ns(Layout::Abs40Vel), [50_400, 31_500, 18_900, 15_750, 7_875]);
        assert_eq!(BitRate::Mbit2_5.transaction_ns(Layout::Abs40, 8), 258_600);
        assert_eq!(BitRate::Mbit16.transaction_ns(Layout::Temperature, 8), 38_625);
    }

    #[test]
    fn bits_last_at_least_as_long() {
        for rate in BitRate::ALL {
            for ns in (0..40_000).step_by(7 * crate::STRIDE) {
                let bits = rate.bits(ns);
                assert!(rate.bits_ns(bits) >= ns);
                assert!(
                    bits == 0
                        || rate.bits_ns(bits - 1) < ns
                        || u64::from(bits - 1) * u64::from(rate.bit_ps()) < u64::from(ns) * 1000
                );
            }
        }
        assert_eq!(BitRate::ALL.map(|rate| rate.bits(FRAME_GAP_NS)), [3, 4, 7, 8, 16]);
    }
}
