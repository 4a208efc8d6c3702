use core::fmt;

/// Why a position must not be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Doubt {
    /// The link is not up, or was lost.
    NoLink,
    /// The last acceleration word could not be used: the position is estimated.
    Estimated,
    /// The fast position does not agree with the safe one yet, or no more.
    Alignment,
    /// The velocity is beyond a sixteenth of the range a frame, where it is known modulo an eighth of the range only.
    Speed,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoLink => "the link is down",
            Self::Estimated => "the position is estimated",
            Self::Alignment => "the fast position is not aligned with the safe one",
            Self::Speed => "the speed is beyond a sixteenth of the range a frame",
        })
    }
}

impl core::error::Error for Doubt {}
