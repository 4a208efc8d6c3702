use bitflags::bitflags;

use crate::status::{Alm, EncoderStatus};

/// All that can speak against a position, in one word, so that one mask says what is tolerated of it.
///
/// ```text
///  bit  23     22          21      20        19 ... 16  15 ... 0
///       NEVER  UPPER_BITS  ABSENT  NO_TURNS  ES         ALM
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub(crate) struct Marks(u32);

bitflags! {
    impl Marks: u32 {
        /// The response carries fewer bits of the turns than the encoder counts.
        const NO_TURNS = 1 << 20;
        /// It carries not even a whole turn.
        const ABSENT = 1 << 21;
        /// Bits are set above the widths.
        const UPPER_BITS = 1 << 22;
        /// There was no response.
        const NEVER = 1 << 23;

        const _ = 0xff_ffff;
    }
}

impl Marks {
    /// Status bits.
    pub(crate) const fn of_status(status: EncoderStatus) -> Self {
        Self((status.bits() as u32 & 0xf) << 16)
    }

    /// Alarms.
    pub(crate) const fn of_alarms(alarms: Alm) -> Self {
        Self(alarms.bits() as u32)
    }

    /// The status bits among them.
    #[expect(clippy::cast_possible_truncation, reason = "four bits are kept")]
    pub(crate) const fn status(self) -> EncoderStatus {
        EncoderStatus::from_bits_truncate((self.0 >> 16) as u8)
    }

    /// The alarms among them.
    #[expect(clippy::cast_possible_truncation, reason = "the lower half")]
    pub(crate) const fn alarms(self) -> Alm {
        Alm::from_bits_retain(self.0 as u16)
    }
}
