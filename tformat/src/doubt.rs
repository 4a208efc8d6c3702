use crate::status::{Almc, StatusField};

/// Why a position must not be used. The raw fields of the response stay readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Doubt {
    /// Nothing was heard yet.
    #[error("no position was heard yet")]
    Never,
    /// The position was sampled too long ago, or by a clock that was set back in the meantime.
    #[error("the position is {age_ns} ns old")]
    Old {
        /// How far the instant of sampling is away, in ns.
        age_ns: u64,
    },
    /// The response carries no such position: ID 2, the EEPROM, turns where only ABS comes.
    #[error("the response carries no such position")]
    Absent,
    /// Information bits of SF are set, which are always 0: the fields are not where they should be.
    #[error("the fields are shifted: status [{sf}]")]
    Shifted {
        /// The status.
        sf: StatusField,
    },
    /// The encoder says that the request was damaged (CA0, CA1): it may be a response to something else.
    #[error("the request was damaged: [{sf}]")]
    RequestDamaged {
        /// The status.
        sf: StatusField,
    },
    /// The response says that it comes from an encoder with another number of single-turn bits. Not checked where
    /// [`Resolution::with_upper_bits_ignored`](crate::Resolution::with_upper_bits_ignored) says that the encoder has rules of its
    /// own.
    #[error("the encoder calls itself {enid:#04x}, the resolution has {abs_bits} single-turn bits")]
    OtherEncoder {
        /// ENID of the response.
        enid: u8,
        /// Single-turn bits of the resolution.
        abs_bits: u8,
    },
    /// Bits above the width of the encoder are set.
    #[error("data field {value:#08x} has bits set that this encoder keeps at 0: {excess:#08x}")]
    UpperBits {
        /// The 24-bit field.
        value: u32,
        /// Those of its bits that must be 0.
        excess: u32,
    },
    /// The encoder reports errors that are not tolerated.
    #[error("the encoder reports [{alarms}]")]
    Alarms {
        /// Those alarms.
        alarms: Almc,
    },
    /// EA0 or EA1 of a response without ALMC: some alarm that is not tolerated. ID 3 says which. In a response to ID 3: one
    /// that ALMC does not tell.
    #[error("the encoder reports errors: status [{sf}]")]
    Status {
        /// Those bits of the status.
        sf: StatusField,
    },
}
