//! For tools: decodes all that can be decoded, lists every finding and guesses the cause.
//!
//! A block has no check sum, so nothing here proves that it came over unharmed. What can be said is whether it is
//! one that an encoder may write: length, C/R, defined codes, a pair that goes together, reserved bits 0.
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
pub use log::{DriveTrouble, LogAnalysis, LogFinding, LogShape, Trouble, Unfinished};

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
    /// All bytes are 0: memory that nothing was written to. As a command it is a NOP, not a servo-off.
    AllZero,
    /// All bytes are FFh: a bus without a device behind it.
    AllOnes,
    /// The two bytes of each 16-bit word are exchanged.
    SwappedWords16,
    /// The four bytes of each 32-bit word are in the other order.
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

/// Something that the reader of a valid block should know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Note {
    /// Servo_On is 1 in a NOP: the drive does not look at it.
    ServoOnIgnored,
    /// Servo_On is 0 in a NOP: this does not switch the servo off.
    NopIsNotServoOff,
    /// CMD_Error or Sub_CMD_Err: a command was not accepted.
    NotAccepted,
    /// ERR or Sub_ERR: a command failed while it was executed.
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

/// A block that lenient decoding takes.
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

/// What an inspection found out about a block.
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

/// A field with another value than in the block before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Change {
    /// The field as it is.
    pub field: Field,
    /// The value that it had; `None` if the block before did not have the field.
    pub before: Option<Value>,
}

/// A command of 32 bytes: two codes, bytes 2, 3, 9 and 10, Sub_Chk and the sub code, byte 16. A response: a code, six bytes
/// of an error answer, five of a refused sub-command.
const MOST_FINDINGS: usize = 12;

impl Report {
    /// Returns whether C/R says response; `None` if there is no byte.
    pub const fn is_response(&self) -> Option<bool> {
        self.is_response
    }

    /// Returns whether lenient decoding, and so a drive, takes the block.
    pub const fn is_usable(&self) -> bool {
        self.message.is_some()
    }

    /// The fault that strict decoding reports: the first of them.
    pub const fn error(&self) -> Option<Error> {
        self.error
    }

    /// Every fault of the block, in the order of the checks: each as if the ones before it were corrected.
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

    /// The command, or the main half of it, if lenient decoding takes the block.
    pub const fn command(&self) -> Option<Command> {
        match self.message {
            Some(Message::Command(main) | Message::Command32(Command32 { main, .. })) => Some(main),
            _ => None,
        }
    }

    /// The sub half of a command, if lenient decoding takes the block.
    pub const fn sub_command(&self) -> Option<SubCommand> {
        match self.message {
            Some(Message::Command32(Command32 { sub, .. })) => Some(sub),
            _ => None,
        }
    }

    /// The response, or the main half of it, if lenient decoding takes the block.
    pub const fn response(&self) -> Option<Response> {
        match self.message {
            Some(Message::Response(main) | Message::Response32(Response32 { main, .. })) => Some(main),
            _ => None,
        }
    }

    /// The sub half of a response, if lenient decoding takes the block.
    pub const fn sub_response(&self) -> Option<SubResponse> {
        match self.message {
            Some(Message::Response32(Response32 { sub, .. })) => Some(sub),
            _ => None,
        }
    }

    /// Every field, in the order of the block; as far as the bytes go.
    pub fn fields(&self) -> impl Iterator<Item = Field> {
        self.fields.iter()
    }

    /// What the reader should know.
    pub fn notes(&self) -> impl Iterator<Item = Note> {
        self.notes.into_iter().flatten()
    }

    /// The fields that are new or have another value than in `before`, each with the value it had.
    ///
    /// Blocks of opposite direction have no field in common but those of bytes 0 and 1.
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

/// Decodes strictly, mends what is reported, and decodes again.
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

/// Changes the bits that an error names, so that the check passes and no other layout applies than must.
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
mod tests {
    use super::*;
    use crate::header::{MacId, UpdateCounter};
    use proptest::prelude::*;
    use std::string::ToString;
    use std::vec::Vec;

    fn swapped(bytes: &[u8], width: usize) -> Vec<u8> {
        bytes.chunks(width).flat_map(|c| c.iter().rev().copied()).collect()
    }

    #[test]
    fn causes() {
        let command = Command { command_data1: 1_000, ..Command::idle(MacId::new(5).unwrap(), UpdateCounter::ZERO) };
        let block = Command { control: ControlBits::SERVO_ON, ..command }.emit();
        assert_eq!(inspect(&block).cause(), None);
        assert_eq!(inspect(&swapped(&block, 2)).cause(), Some(Cause::SwappedWords16));
        assert_eq!(inspect(&swapped(&block, 4)).cause(), Some(Cause::SwappedWords32));
        let mut stray = block;
        stray[2] |= 0x03;
        assert_eq!(inspect(&stray).cause(), None);
        assert_eq!(inspect(&[0; 16]).cause(), Some(Cause::AllZero));
        assert_eq!(inspect(&[0xff; 32]).cause(), Some(Cause::AllOnes));
        for size in (0..40).filter(|n| ![16, 32].contains(n)) {
            let report = inspect(&[0x20; 40][..size]);
            assert_eq!(report.cause(), Some(Cause::OtherSize));
            assert!(
                matches!(report.error(), Some(Error::Truncated { .. } | Error::TooLong { .. })) && !report.is_usable()
            );
        }
    }

    #[test]
    fn every_finding_is_listed() {
        let mut block = [0; 32];
        block[..4].copy_from_slice(&[0x05, 0x52, 0x02, 0x10]);
        block[9] = 0x30;
        block[16] = 0x41;
        let want = [
            Error::CyclicCode { code: 5 },
            Error::SubChk { byte16: 0x41 },
            Error::SubCommandCode { code: 1 },
            Error::Reserved { byte: 2, bits: 0x02 },
            Error::Reserved { byte: 3, bits: 0x10 },
            Error::Reserved { byte: 9, bits: 0x30 },
            Error::Reserved { byte: 16, bits: 0x40 },
        ];
        assert!(inspect(&block).errors().eq(want));
    }

    #[test]
    fn values_and_one_line() {
        let report = inspect(&[0xc5, 0x20, 0xc1, 0, 0xe6, 0x03, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!((report.response().map(|r| r.response_data1), report.command()), (Some(998), None));
        assert_eq!((report.findings(), report.sub_response()), (Findings::NONE, None));
        assert_eq!(report.to_string(), "from 5 #2 CP normal (20h) [SERVO_ACTIVE SERVO_READY IN_POSITION] 998, 0 0");
        let mut stray =
            Command32 { main: Command::idle(MacId::new(5).unwrap(), UpdateCounter::ZERO), sub: SubCommand::IDLE }
                .emit();
        stray[2] = 0x01;
        let report = inspect(&stray);
        assert_eq!(report.findings().iter().collect::<Vec<_>>(), [ErrorClass::Reserved]);
        assert_eq!((report.command().is_some(), report.sub_command()), (true, Some(SubCommand::IDLE)));
        assert!(report.to_string().ends_with("; byte 2 has reserved bits 0x01 set"), "{report}");
        assert_eq!(
            inspect(&[]).to_string(),
            "not usable; 0 bytes, a block has 16; the size is neither 16 nor 32 bytes"
        );
    }

    #[test]
    fn changes_from_block_to_block() {
        let first = Command { command_data1: 1_000, ..Command::idle(MacId::new(5).unwrap(), UpdateCounter::ZERO) };
        let second = Command {
            command_data1: 1_010,
            control: ControlBits::SERVO_ON,
            update_counter: first.update_counter.next(),
            ..first
        };
        let (before, after) = (inspect(&first.emit()), inspect(&second.emit()));
        let changes: Vec<_> = after
            .changes(&before)
            .map(|c| (c.field.name, c.before.unwrap().to_string(), c.field.value.to_string()))
            .collect();
        let text: Vec<_> = changes.iter().map(|(n, a, b)| (*n, a.as_str(), b.as_str())).collect();
        assert_eq!(text, [("Update_Counter", "0", "1"), ("SERVO_ON", "0", "1"), ("Command_Position", "1000", "1010")]);
        assert_eq!(after.changes(&after).count(), 0);
        assert_eq!(inspect(&[0; 16]).notes().collect::<Vec<_>>(), [Note::NopIsNotServoOff]);
    }

    /// The longest list: a profile answer with a sub block.
    #[test]
    fn no_field_is_left_out() {
        let mut block = [0; 32];
        block[0] = 0x80;
        block[1] = 0x17;
        let report = inspect(&block);
        assert_eq!((report.fields().count(), report.fields().last().unwrap().name), (42, "Sub_Response_Data3"));
    }

    proptest! {
        /// Never fails, and agrees with the decoders.
        #[test]
        fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..48)) {
            let report = inspect(&bytes);
            prop_assert_eq!(report.error(), strict(&bytes).err());
            prop_assert!(report.is_usable() || report.error().is_some());
            // The list is long enough: one place is always left.
            prop_assert!(report.errors().count() < MOST_FINDINGS);
            prop_assert_eq!(report.changes(&report).count(), 0);
            if bytes.len() >= LEN {
                prop_assert!(report.fields().count() >= 5);
            }
            for field in report.fields() {
                prop_assert!(usize::from(field.last) < bytes.len() && field.first <= field.last);
            }
        }
    }
}
