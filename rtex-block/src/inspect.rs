//! For tools: decodes everything that can be decoded, lists every finding and guesses the cause.
//!
//! A block has no checksum, so nothing here proves that it arrived undamaged. This module can only tell whether an encoder
//! may write such a block: length, C/R, defined codes, a permitted pair of codes, reserved bits 0.
//!
//! ```
//! use rtex_block::inspect::{Cause, inspect};
//!
//! // Written as 16-bit words by a host that swaps their bytes
//! let report = inspect(&[0x20, 0x65, 0x00, 0x80, 0x03, 0xe8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
//! assert_eq!(report.cause(), Some(Cause::SwappedWords16));
//!
//! let report = inspect(&[0x65, 0x20, 0x80, 0, 0xe8, 0x03, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
//! assert_eq!(report.error(), None);
//! assert_eq!(report.fields().find(|f| f.name == "Command_Position").unwrap().value.to_string(), "1000");
//! ```

mod fields;
mod log;

use core::fmt;

pub use fields::{Field, Fields, Value};
pub use log::{DriveTrouble, LogAnalysis, LogFinding, LogShape, ShapeDoubt, Trouble, Unfinished};

use crate::block::{LEN, LEN32};
use crate::code::Code;
use crate::command::{Command, CommandBlock};
use crate::control::ControlBits;
use crate::error::{Error, ErrorClass};
use crate::execution::Execution;
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::{Command32, Response32, SubCommand, SubResponse};

/// What most likely went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// All bytes are 0: memory that was never written. As a command it is a NOP, not a servo-off.
    AllZero,
    /// All bytes are FFh: a bus without a device behind it.
    AllOnes,
    /// The two bytes of each 16-bit word are exchanged.
    SwappedWords16,
    /// The four bytes of each 32-bit word are in reverse order.
    SwappedWords32,
    /// A 32-byte block in a log of 16-byte blocks, or the other way round.
    OtherSize,
}

servowire_core::one_line!(Cause {
    Self::AllZero => "all bytes are 0: nothing was written here (as a command: a NOP, not a servo-off)";
    Self::AllOnes => "all bytes are FFh: nothing answers on this bus";
    Self::SwappedWords16 => "the bytes of each 16-bit word are exchanged: pack with shifts";
    Self::SwappedWords32 => "the bytes of each 32-bit word are in the other order: pack with shifts";
    Self::OtherSize => "the size is neither 16 nor 32 bytes";
});

/// A remark on a valid block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Note {
    /// Servo_On is 1 in a NOP: the drive ignores it.
    ServoOnIgnored,
    /// Servo_On is 0 in a NOP: this does not switch the servo off.
    NopIsNotServoOff,
    /// CMD_Error or Sub_CMD_Err: a command was not accepted.
    NotAccepted,
    /// ERR or Sub_ERR: a command failed during execution.
    FailedToExecute,
    /// Alarm is 1.
    Alarm,
}

servowire_core::one_line!(Note {
    Self::ServoOnIgnored => "Servo_On in a NOP is ignored";
    Self::NopIsNotServoOff => "a NOP does not switch the servo off";
    Self::NotAccepted => "command not accepted";
    Self::FailedToExecute => "command failed while executing";
    Self::Alarm => "alarm";
});

/// A block that lenient decoding accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
enum Message {
    Command(Command),
    Command32(Command32),
    Response(Response),
    Response32(Response32),
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command(command) => command.fmt(f),
            Self::Command32(command) => command.fmt(f),
            Self::Response(response) => response.fmt(f),
            Self::Response32(response) => response.fmt(f),
        }
    }
}

/// The kinds of faults found, as a set.
pub type Findings = servowire_core::Findings<ErrorClass>;

/// The result of inspecting a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report {
    error: Option<Error>,
    findings: Findings,
    cause: Option<Cause>,
    is_response: Option<bool>,
    message: Option<Message>,
    #[cfg_attr(feature = "serde", serde(serialize_with = "each"))]
    errors: [Option<Error>; MOST_FINDINGS],
    #[cfg_attr(feature = "serde", serde(serialize_with = "each"))]
    notes: [Option<Note>; 4],
    fields: Fields,
}

#[cfg(feature = "serde")]
fn each<T: serde::Serialize, S: serde::Serializer>(list: &[Option<T>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(list.iter().flatten())
}

/// A field whose value differs from that in the previous block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Change {
    /// The field as it is.
    pub field: Field,
    /// Its previous value; `None` if the previous block did not have the field.
    pub before: Option<Value>,
}

/// The largest number of faults in a command of 32 bytes: two codes, bytes 2, 3, 9 and 10, Sub_Chk and the sub code, byte 16.
/// The largest number of faults in a response: a code, six bytes of an error answer, five of a refused sub-command.
const MOST_FINDINGS: usize = 12;

impl Report {
    /// Returns whether C/R says response; `None` if there is no byte.
    pub const fn is_response(&self) -> Option<bool> {
        self.is_response
    }

    /// Returns whether lenient decoding, and so a drive, accepts the block.
    pub const fn is_usable(&self) -> bool {
        self.message.is_some()
    }

    /// The fault that strict decoding reports, which is the first one.
    pub const fn error(&self) -> Option<Error> {
        self.error
    }

    /// All faults of the block, in the order of the checks; each is found as if the previous ones were corrected.
    pub fn errors(&self) -> impl Iterator<Item = Error> {
        self.errors.into_iter().flatten()
    }

    /// The classes of all faults.
    pub const fn findings(&self) -> Findings {
        self.findings
    }

    /// The most likely cause of the fault, or of a suspicious block.
    pub const fn cause(&self) -> Option<Cause> {
        self.cause
    }

    /// The command, or the main half of it, if lenient decoding accepts the block.
    pub const fn command(&self) -> Option<Command> {
        match self.message {
            Some(Message::Command(main) | Message::Command32(Command32 { main, .. })) => Some(main),
            _ => None,
        }
    }

    /// The sub half of a command, if lenient decoding accepts the block.
    pub const fn sub_command(&self) -> Option<SubCommand> {
        match self.message {
            Some(Message::Command32(Command32 { sub, .. })) => Some(sub),
            _ => None,
        }
    }

    /// The response, or the main half of it, if lenient decoding accepts the block.
    pub const fn response(&self) -> Option<Response> {
        match self.message {
            Some(Message::Response(main) | Message::Response32(Response32 { main, .. })) => Some(main),
            _ => None,
        }
    }

    /// The sub half of a response, if lenient decoding accepts the block.
    pub const fn sub_response(&self) -> Option<SubResponse> {
        match self.message {
            Some(Message::Response32(Response32 { sub, .. })) => Some(sub),
            _ => None,
        }
    }

    /// Returns every field that the bytes contain, in the order of the block.
    pub fn fields(&self) -> impl Iterator<Item = Field> {
        self.fields.iter()
    }

    /// Returns the remarks on a valid block.
    pub fn notes(&self) -> impl Iterator<Item = Note> {
        self.notes.into_iter().flatten()
    }

    /// Returns the fields that are new or whose value differs from that in `before`, each with its previous value.
    ///
    /// Blocks of opposite directions have only the fields of bytes 0 and 1 in common.
    pub fn changes(&self, before: &Self) -> impl Iterator<Item = Change> {
        self.fields.iter().filter_map(move |field| {
            let old = before.fields.iter().find(|old| old.name == field.name).map(|old| old.value);
            (old != Some(field.value)).then_some(Change { field, before: old })
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.message {
            Some(message) => message.fmt(f)?,
            None => f.write_str("not usable")?,
        }
        self.errors().try_for_each(|error| write!(f, "; {error}"))?;
        match self.cause {
            Some(cause) => write!(f, "; {cause}"),
            None => Ok(()),
        }
    }
}

/// Inspects a block of either direction and either size.
pub fn inspect(bytes: &[u8]) -> Report {
    let (errors, message) = (errors(bytes), lenient(bytes));
    let mut findings = Findings::NONE;
    errors.iter().flatten().for_each(|error| findings.insert(error.class()));
    Report {
        error: errors[0],
        findings,
        is_response: bytes.first().map(|byte0| byte0 & 0x80 != 0),
        message,
        cause: cause(bytes, errors[0], message.is_some()),
        errors,
        notes: notes(bytes),
        fields: Fields::of(bytes),
    }
}

fn is_response(bytes: &[u8]) -> bool {
    bytes.first().is_some_and(|byte0| byte0 & 0x80 != 0)
}

fn strict(bytes: &[u8]) -> Result<(), Error> {
    match (is_response(bytes), bytes.len() > LEN) {
        (false, false) => Command::parse_strict(bytes).map(drop),
        (false, true) => Command32::parse_strict(bytes).map(drop),
        (true, false) => Response::parse_strict(bytes).map(drop),
        (true, true) => Response32::parse_strict(bytes).map(drop),
    }
}

fn lenient(bytes: &[u8]) -> Option<Message> {
    match (is_response(bytes), bytes.len() > LEN) {
        (false, false) => Command::parse(bytes).map(Message::Command),
        (false, true) => Command32::parse(bytes).map(Message::Command32),
        (true, false) => Response::parse(bytes).map(Message::Response),
        (true, true) => Response32::parse(bytes).map(Message::Response32),
    }
    .ok()
}

/// Decodes strictly, repairs what is reported, and decodes again.
fn errors(bytes: &[u8]) -> [Option<Error>; MOST_FINDINGS] {
    let mut copy = [0; LEN32];
    let mut found = [None; MOST_FINDINGS];
    let Some(block) = copy.get_mut(..bytes.len()) else {
        found[0] = strict(bytes).err();
        return found;
    };
    block.copy_from_slice(bytes);
    for place in &mut found {
        let Err(error) = strict(block) else { break };
        *place = Some(error);
        if !mend(block, error) {
            break;
        }
    }
    found
}

/// Changes the bits that an error names so that the check passes; changes the layout only if necessary.
fn mend(block: &mut [u8], error: Error) -> bool {
    let (byte, clear, set) = match error {
        Error::Reserved { byte, bits } => (byte, bits, 0),
        // With PP every non-cyclic code is allowed; the normal command has no reserved bits.
        Error::CyclicCode { .. } | Error::CodePair { .. } => (1, 0x70, 0x10),
        Error::NonCyclicCode { .. } => (1, 0x0f, 0),
        Error::SubChk { .. } => (16, 0, 0x80),
        Error::SubCommandCode { .. } => (16, 0x0f, 0),
        _ => return false,
    };
    match block.get_mut(usize::from(byte)) {
        Some(byte) => {
            *byte = *byte & !clear | set;
            true
        }
        None => false,
    }
}

fn cause(bytes: &[u8], error: Option<Error>, is_usable: bool) -> Option<Cause> {
    let size = bytes.len();
    if size != LEN && size != LEN32 {
        return Some(Cause::OtherSize);
    }
    if bytes.iter().all(|&b| b == 0) {
        return Some(Cause::AllZero);
    }
    if bytes.iter().all(|&b| b == 0xff) {
        return Some(Cause::AllOnes);
    }
    error?;
    // A stray bit in a command with sense is no reason to doubt its order.
    let nop = bytes.get(1).is_some_and(|byte1| Code::truncate(*byte1).cyclic_bits() == 0);
    if is_usable && !nop {
        return None;
    }
    let sound = |width| {
        let mut turned = [0; LEN32];
        let turned = turned.get_mut(..size)?;
        for (to, from) in turned.chunks_exact_mut(width).zip(bytes.chunks_exact(width)) {
            for (to, from) in to.iter_mut().zip(from.iter().rev()) {
                *to = *from;
            }
        }
        // A NOP is too little to go by: it is mostly zeros, whatever their order.
        let nop = turned.get(1).is_some_and(|byte1| Code::truncate(*byte1) == Code::NOP);
        strict(turned).ok().filter(|()| !nop)
    };
    match (sound(2), sound(4)) {
        (Some(()), None) => Some(Cause::SwappedWords16),
        (None, Some(())) => Some(Cause::SwappedWords32),
        _ => None,
    }
}

fn notes(bytes: &[u8]) -> [Option<Note>; 4] {
    let Some(main) = bytes.first_chunk::<LEN>() else { return [None; 4] };
    let when = |condition: bool, note| condition.then_some(note);
    if let Ok(command) = CommandBlock::of(main) {
        let nop = command.code() == Code::NOP;
        let on = command.control().contains(ControlBits::SERVO_ON);
        return [when(nop && on, Note::ServoOnIgnored), when(nop && !on, Note::NopIsNotServoOff), None, None];
    }
    let Ok(response) = Response::parse(main) else { return [None; 4] };
    let sub = Response32::parse(bytes).ok().map(|r| r.sub);
    let failed = response.noncyclic().execution().is_some_and(|e| e.contains(Execution::ERR))
        || sub.is_some_and(|s| s.execution.contains(Execution::ERR));
    [
        when(response.cmd_error || sub.is_some_and(|s| s.cmd_error), Note::NotAccepted),
        when(failed, Note::FailedToExecute),
        when(response.status.contains(StatusFlags::ALARM), Note::Alarm),
        None,
    ]
}

#[cfg(test)]
mod tests;
