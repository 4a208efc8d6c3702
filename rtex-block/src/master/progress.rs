use core::fmt;

use super::state::{AskError, StopReason};
use crate::error_code::ErrorCode;
use crate::type_code::Pr;

/// The progress of a procedure. Its time is counted in update periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Progress<T> {
    /// Not finished.
    Pending {
        /// Number of update periods left until it fails for lack of an answer.
        left: u32,
    },
    /// Finished.
    Done {
        /// Its result.
        value: T,
    },
    /// Failed.
    Failed {
        /// Why.
        error: Failure,
    },
}

impl<T: fmt::Display> fmt::Display for Progress<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pending { left } => write!(f, "pending, {left} update periods left"),
            Self::Done { value } => write!(f, "done: {value}"),
            Self::Failed { error } => write!(f, "failed: {error}"),
        }
    }
}

impl<T> Progress<T> {
    /// Applies `then` to the value, once it is available.
    pub(super) fn and_then<U>(self, then: impl FnOnce(T) -> Progress<U>) -> Progress<U> {
        match self {
            Self::Pending { left } => Progress::Pending { left },
            Self::Done { value } => then(value),
            Self::Failed { error } => Progress::Failed { error },
        }
    }

    /// Returns whether it is still pending.
    pub const fn is_pending(&self) -> bool {
        matches!(self, Self::Pending { .. })
    }
}

impl<T: Copy> Progress<T> {
    /// Returns how it ended; `None` while it is pending.
    pub(super) const fn ended(&self) -> Option<Self> {
        if self.is_pending() { None } else { Some(*self) }
    }
}

/// Why a procedure failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Failure {
    /// ERR: the command was accepted but failed during execution.
    Execution,
    /// CMD_Error: the command was not accepted.
    CommandError(ErrorCode),
    /// No answer came within the caller's limit. It is not known whether the drive has executed the command.
    TimedOut,
    /// The drive answered the start of a profile motion but did not set In_Progress within the caller's limit. The motion may
    /// still start.
    NotStarted,
    /// The servo was switched off, or was not on.
    ServoOff,
    /// Aborted: the axis has stopped, or is stopping, for this reason.
    Stopped(StopReason),
    /// The axis did not accept the request of a procedure.
    NotSent(AskError),
    /// The axis is not in the mode that the procedure needs.
    Mode,
    /// The parameter does not have the value that was written to it.
    Differs(Pr),
}

servowire_core::one_line!(Failure {
    Self::Execution => "failed while it was executed (ERR)";
    Self::CommandError(code) => "not accepted: {}", code;
    Self::TimedOut => "no answer in time";
    Self::ServoOff => "the servo was switched off";
    Self::Stopped(reason) => "broken off: {}", reason;
    Self::NotSent(error) => "not sent: {}", error;
    Self::Mode => "the axis is in another mode";
    Self::Differs(pr) => "{} did not take its value", pr;
    Self::NotStarted => "the motion did not start in time";
});

impl core::error::Error for Failure {}
