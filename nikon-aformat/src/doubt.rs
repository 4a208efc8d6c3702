use crate::status::{Alm, EncoderStatus};

/// Why a position must not be used. The raw fields of the response remain readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Doubt {
    /// Nothing has been received yet.
    Never,
    /// The position was sampled too long ago, or by a clock that was set back in the meantime.
    Old {
        /// Distance to the instant of sampling, in ns.
        age_ns: u64,
    },
    /// The response carries no position, only its upper bits, or less than a turn of this encoder; or, if turns are used, it
    /// carries fewer bits of them than the encoder counts.
    Absent,
    /// Bits are set above the widths of the encoder: another encoder, or a wrong [`Resolution`](crate::Resolution).
    UpperBits {
        /// Number of single-turn and turn bits together.
        width: u8,
    },
    /// The single status bit of commands 21 and 22 is set; it does not say which of the four it stands for.
    AnyStatus,
    /// Status bits are set that are not tolerated. With [`EncoderStatus::BUSY`] the position is being determined.
    Status {
        /// Those bits.
        es: EncoderStatus,
    },
    /// Alarms are set that are not tolerated.
    Alarms {
        /// The alarms.
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
