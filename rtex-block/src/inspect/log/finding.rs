//! Findings that concern more than one block of a log.

use core::fmt;

use crate::code::Code;
use crate::header::{MacId, UpdateCounter};

/// A finding that concerns more than one block of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum LogFinding {
    /// The counter echo has not changed for more than the two communications that an update period can have.
    EchoStands {
        /// Number of responses in a row with the same echo.
        responses: u32,
    },
    /// The counter echo had not changed for longer than that, and now counts again.
    EchoGoesOn {
        /// Number of responses in a row with the same echo.
        responses: u32,
    },
    /// The counter of the commands neither advanced by one nor stayed the same for the second communication of an update
    /// period.
    CounterJumps {
        /// Before.
        from: UpdateCounter,
        /// Now.
        to: UpdateCounter,
    },
    /// The code of the commands has come back, but more than one command after it was sent.
    CodeLate {
        /// Number of responses from the first command with this code to its echo.
        responses: u32,
    },
    /// A step of the command position above 400 M pulses per second after the electronic gear: Err27.4.
    PositionStep {
        /// The step, in command units.
        step: i32,
        /// The largest permitted step, in command units.
        max: u32,
    },
    /// A request was answered.
    Answered {
        /// Number of responses from the first command with the request to the first answer without Busy.
        responses: u32,
        /// Number of these that had Busy.
        busy: u32,
    },
    /// An alarm command with Index 0 was answered with another index. Only a request for the attributes is answered like this:
    /// bytes 12-15 are neither alarm nor warning.
    Attributes {
        /// Index_Echo: the present alarm.
        alarm: u16,
        /// Bytes 12-15, byte 12 in bits 7-0.
        bits: u32,
    },
    /// Another request, or the normal command, replaces a request that had no answer in more than three responses.
    GivenUp {
        /// The code of the request.
        code: Code,
        /// Number of responses since the first command with it.
        responses: u32,
        /// Number of these that had Busy.
        busy: u32,
    },
    /// The drive has answered before but not to the last commands, for more than the two communications that an update
    /// period can have.
    NoAnswer {
        /// Number of commands without an answer.
        commands: u32,
    },
    /// The drive was silent for longer than that, and answers again.
    AnswersAgain {
        /// Number of commands without an answer.
        commands: u32,
    },
    /// Commands were sent to this drive, and it never answered.
    NeverAnswered(MacId),
    /// This drive answers although no command was sent to it.
    NeverAsked(MacId),
    /// Something is still in progress for a drive at the end of the log.
    AtEnd(MacId, Unfinished),
}

servowire_core::codes! {
    /// Something in the behaviour of a drive that needs attention.
    pub enum Trouble: u8 {
        /// The drive reported an alarm.
        Alarm = 1 => "reported an alarm",
        /// The counter echo did not change: the communication, or the drive, had stopped.
        EchoStood = 2 => "sent a counter echo that stood still",
        /// The drive did not answer.
        Silence = 3 => "did not answer",
    }
}

/// A drive that needs attention.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DriveTrouble {
    /// Its address.
    pub mac_id: MacId,
    /// What it did.
    pub trouble: Trouble,
}

/// What is still in progress at the end of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Unfinished {
    /// The counter echo does not change.
    Echo {
        /// Number of responses in a row with the same echo.
        responses: u32,
    },
    /// The drive does not answer.
    Silence {
        /// Number of commands without an answer.
        commands: u32,
    },
    /// A request is not answered.
    Request {
        /// The code of the request.
        code: Code,
        /// Number of responses since the first command with it.
        responses: u32,
        /// Number of these that had Busy.
        busy: u32,
    },
    /// The code of the commands has not come back.
    Code {
        /// The code.
        code: Code,
        /// Number of responses since the first command with it.
        responses: u32,
    },
}

impl fmt::Display for LogFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::EchoStands { responses } => write!(f, "the counter echo stands still for {responses} responses"),
            Self::EchoGoesOn { responses } => write!(f, "the counter echo goes on after {responses} responses"),
            Self::CounterJumps { from, to } => write!(f, "the counter goes from {from} to {to}"),
            Self::CodeLate { responses } => write!(f, "the code came back after {responses} responses"),
            Self::PositionStep { step, max } => write!(f, "position step {step}, at most {max}: Err27.4"),
            Self::Answered { responses, busy } => {
                write!(f, "answered after {responses} responses, {busy} of them busy")
            }
            Self::Attributes { alarm, bits } => {
                write!(f, "attributes {bits:08X}h of the alarm with index {alarm:04X}h")
            }
            Self::GivenUp { code, responses, busy } => {
                code.write(f)?;
                write!(f, " is given up after {responses} responses, {busy} of them busy")
            }
            Self::NoAnswer { commands } => write!(f, "no answer to the last {commands} commands"),
            Self::AnswersAgain { commands } => write!(f, "answers again after {commands} commands"),
            Self::NeverAnswered(mac_id) => write!(f, "drive {mac_id} never answered"),
            Self::NeverAsked(mac_id) => write!(f, "drive {mac_id} answers and was never sent a command"),
            Self::AtEnd(mac_id, unfinished) => write!(f, "at the end drive {mac_id} {unfinished}"),
        }
    }
}

impl fmt::Display for Unfinished {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Echo { responses } => write!(f, "has sent the same counter echo in {responses} responses"),
            Self::Silence { commands } => write!(f, "has not answered the last {commands} commands"),
            Self::Request { code, responses, busy } => {
                f.write_str("has not answered ")?;
                code.write(f)?;
                write!(f, " in {responses} responses, {busy} of them busy")
            }
            Self::Code { code, responses } => {
                f.write_str("has not sent back ")?;
                code.write(f)?;
                write!(f, " in {responses} responses")
            }
        }
    }
}
