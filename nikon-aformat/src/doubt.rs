use crate::status::{Alm, EncoderStatus};

/// Why a position must not be used. The raw fields of the response stay readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Doubt {
    /// Nothing was heard yet.
    Never,
    /// The position was sampled too long ago, or by a clock that was set back in the meantime.
    Old {
        /// How far the instant of sampling is away, in ns.
        age_ns: u64,
    },
    /// The response carries no position, or only its upper bits; less than a turn of this encoder; or, where turns are used, fewer
    /// bits of them than it counts.
    Absent,
    /// Bits are set above the widths of the encoder: another encoder, or a wrong [`Resolution`](crate::Resolution).
    UpperBits {
        /// Single-turn and turn bits together.
        width: u8,
    },
    /// The one status bit of commands 21 and 22 is set; which of the four it stands for is not told.
    AnyStatus,
    /// Status bits are set that are not tolerated. With [`EncoderStatus::BUSY`] the position is being determined.
    Status {
        /// Those bits.
        es: EncoderStatus,
    },
    /// Alarms are set that are not tolerated.
    Alarms {
        /// Those alarms.
        alarms: Alm,
    },
}

servowire_core::one_line!(Doubt {
    Self::Never => "no position was heard yet";
    Self::Old { age_ns } => "the position is {} ns old", age_ns;
    Self::Absent => "the response does not carry the whole position";
    Self::UpperBits { width } => "the position has bits set above bit {} that this encoder keeps at 0", width;
    Self::AnyStatus => "the encoder shows that something is wrong";
    Self::Status { es } => "the encoder shows {}", es;
    Self::Alarms { alarms } => "the encoder shows {}", alarms;
});

impl core::error::Error for Doubt {}
