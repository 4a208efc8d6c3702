use crate::status::Status;

/// The place of a frame in its phase of the start-up. Only the last carries STATE_CHANGE, which takes the devices
/// to the next phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Place {
    /// More frames of the phase follow.
    #[default]
    Inner,
    /// The last frame of the phase.
    Last,
}

impl Place {
    /// Returns the place of frame `frame`, counted from 0, among this many.
    pub(crate) const fn of(frame: u16, frames: u16) -> Self {
        if frame.saturating_add(1) >= frames { Self::Last } else { Self::Inner }
    }

    /// Returns the STATUS for this place: one for the last frame, another for all others.
    pub(crate) const fn choose(self, last: Status, inner: Status) -> Status {
        match self {
            Self::Last => last,
            Self::Inner => inner,
        }
    }
}

impl core::fmt::Display for Place {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Inner => "inner",
            Self::Last => "last",
        })
    }
}
