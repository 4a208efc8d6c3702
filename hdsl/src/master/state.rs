//! The state of the receiver in its start-up, and why it restarted.

use crate::error::Error;

/// The state of the receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum State {
    /// Two frames without an answer.
    Reset,
    /// Sixteen frames without an answer: the encoder synchronises.
    Sync,
    /// Nine frames: sampling index and delay are searched in the test pattern.
    Start,
    /// Nine frames: the test pattern has to appear at the learned delay.
    Learn,
    /// Sixteen more such frames: line check.
    Check,
    /// One frame: the encoder identifier.
    IdReq,
    /// Frames with INIT until VSYNC comes.
    WaitVsync,
    /// RX0..RX7, V-frame after V-frame.
    Running,
}

impl State {
    /// Number of frames that the state lasts; `None` if that depends on the encoder.
    pub const fn frames(self) -> Option<u8> {
        match self {
            Self::Reset => Some(2),
            Self::Sync | Self::Check => Some(16),
            Self::Start | Self::Learn => Some(9),
            Self::IdReq => Some(1),
            Self::WaitVsync | Self::Running => None,
        }
    }

    pub(super) const fn next(self) -> Self {
        match self {
            Self::Reset => Self::Sync,
            Self::Sync => Self::Start,
            Self::Start => Self::Learn,
            Self::Learn => Self::Check,
            Self::Check => Self::IdReq,
            Self::IdReq => Self::WaitVsync,
            Self::WaitVsync | Self::Running => Self::Running,
        }
    }
}

/// Why the link was restarted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum RestartReason {
    /// The application requested it (PRST).
    Requested,
    /// In a START frame, there was no encoder or no test pattern.
    Learn(Error),
    /// In a LEARN or CHECK frame, the test pattern had a wrong bit.
    Pattern,
    /// The identifier was damaged, or belongs to an encoder that this receiver does not support.
    Identifier(Error),
    /// No VSYNC within the frames that [`Dialect::vsync_frames`](crate::Dialect::vsync_frames) allows.
    NoVsync,
    /// The quality monitor has reached its lower limit.
    Quality,
    /// Too many acceleration words in a row could not be used.
    AccelerationErrors,
}

servowire_core::one_line!(RestartReason {
    Self::Requested => "asked for";
    Self::Learn(error) | Self::Identifier(error) => "{}", error;
    Self::Pattern => "the test pattern came with a wrong bit";
    Self::NoVsync => "no VSYNC after INIT";
    Self::Quality => "the quality monitor has run out";
    Self::AccelerationErrors => "too many acceleration words in a row could not be used";
});

impl core::error::Error for RestartReason {}

servowire_core::one_line!(State {
    Self::Reset => "RESET";
    Self::Sync => "SYNC";
    Self::Start => "START";
    Self::Learn => "LEARN";
    Self::Check => "CHECK";
    Self::IdReq => "IDREQ";
    Self::WaitVsync => "WAIT VSYNC";
    Self::Running => "RUNNING";
});
