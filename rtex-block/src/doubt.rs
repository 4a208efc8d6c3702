//! Why an actual position must not be used for control.

use crate::error::ErrorClass;

/// Why the actual position of a drive must not be used.
///
/// Blocks carry no checksum: a flipped bit in the position itself cannot be detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Doubt {
    /// No good block has come yet.
    Never,
    /// No block has come on time for longer than the policy allows.
    Old {
        /// Time since the last block that came on time, ns.
        age_ns: u64,
    },
    /// The position is too old because the last block was refused.
    Refused {
        /// Why it was.
        class: ErrorClass,
        /// Time since the last block that came on time, ns.
        age_ns: u64,
    },
    /// The drive reports an alarm: it may have lost its encoder.
    Alarm,
}

servowire_core::one_line!(Doubt {
    Self::Never => "no good block has been received yet";
    Self::Old { age_ns } => "the position is {} ns old", age_ns;
    Self::Refused { class, age_ns } => "the position is {} ns old, the last block was refused: {}", age_ns, class.name();
    Self::Alarm => "the drive reports an alarm";
});

impl core::error::Error for Doubt {}
