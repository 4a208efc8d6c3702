//! Why an actual position is not one to control with.

/// Why the actual position of a drive must not be used. What the last good block said stays readable beside it.
///
/// Blocks carry no check sum: a flipped bit of the position itself cannot be seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Doubt {
    /// No good block has come yet.
    #[error("no good block has come yet")]
    Absent,
    /// The counter echo has stood still, or no good block has come, for longer than is tolerated.
    #[error("the position is {updates} update periods old")]
    Old {
        /// Update periods since the last good block with a new counter echo.
        updates: u32,
    },
    /// The drive reports an alarm: it may have lost its encoder.
    #[error("the drive reports an alarm")]
    Alarm,
}
