use crate::status::{Almc, StatusField};

/// Why a position must not be used. The raw fields of the response remain readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Doubt {
    /// Nothing has been received yet.
    #[error("no position was heard yet")]
    Never,
    /// The position was sampled too long ago, or by a clock that was set back in the meantime.
    #[error("the position is {age_ns} ns old")]
    Old {
        /// Distance to the instant of sampling, in ns.
        age_ns: u64,
    },
    /// The response carries no such position: it answers ID 2 or an EEPROM request, or turns are used and it carries only ABS.
    #[error("the response carries no such position")]
    Absent,
    /// Information bits of SF are set, although they are always 0: the fields are not where they should be.
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
    /// According to its ENID, the response comes from an encoder with another number of single-turn bits. Not checked if
    /// [`Resolution::with_upper_bits_ignored`](crate::Resolution::with_upper_bits_ignored) says that the encoder has its own
    /// rules.
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
        /// The bits of the field that are set but must be 0.
        excess: u32,
    },
    /// The encoder reports errors that are not tolerated.
    #[error("the encoder reports [{alarms}]")]
    Alarms {
        /// The alarms.
        alarms: Almc,
    },
    /// EA0 or EA1 is set in a response without ALMC: some alarm is not tolerated. ID 3 says which. In a response to ID 3, it is
    /// an alarm that ALMC does not show.
    #[error("the encoder reports errors: status [{sf}]")]
    Status {
        /// The status bits concerned.
        sf: StatusField,
    },
}
