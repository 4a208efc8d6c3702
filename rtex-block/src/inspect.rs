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
//! assert_eq!(report.cause, Some(Cause::SwappedWords16));
//!
//! let report = inspect(&[0x65, 0x20, 0x80, 0, 0xe8, 0x03, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
//! assert_eq!(report.error(), None);
//! assert_eq!(report.fields().find(|f| f.name == "Command_Position").unwrap().value.to_string(), "1000");
//! ```

mod fields;
mod log;

use core::fmt;

pub use fields::{Field, Fields, Value};
pub use log::{LogAnalysis, LogFinding, LogShape, Unfinished};

use crate::block::{LEN, LEN32};
use crate::code::Code;
use crate::command::{Command, CommandBlock};
use crate::control::ControlBits;
use crate::error::Error;
use crate::execution::Execution;
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::{Command32, Response32};

/// What most likely went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AllZero => "all bytes are 0: nothing was written here (as a command: a NOP, not a servo-off)",
            Self::AllOnes => "all bytes are FFh: nothing answers on this bus",
            Self::SwappedWords16 => "the bytes of each 16-bit word are exchanged: pack with shifts",
            Self::SwappedWords32 => "the bytes of each 32-bit word are in the other order: pack with shifts",
            Self::OtherSize => "the size is neither 16 nor 32 bytes",
        })
    }
}

/// Something about a sound block that its reader should know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ServoOnIgnored => "Servo_On in a NOP is ignored",
            Self::NopIsNotServoOff => "a NOP does not switch the servo off",
            Self::NotAccepted => "command not accepted",
            Self::FailedToExecute => "command failed while executing",
            Self::Alarm => "alarm",
        })
    }
}

/// What there is to say about a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Report {
    /// Whether C/R says response; `None` if there is no byte.
    pub is_response: Option<bool>,
    /// Whether lenient decoding, and so a drive, takes the block.
    pub is_usable: bool,
    /// The most likely cause of the fault, or of a suspicious block.
    pub cause: Option<Cause>,
    findings: [Option<Error>; MOST_FINDINGS],
    notes: [Option<Note>; 4],
    fields: Fields,
}

/// A command of 32 bytes: two codes, bytes 2, 3, 9 and 10, Sub_Chk and the sub code, byte 16. A response: a code, six bytes
/// of an error answer, five of a refused sub-command.
const MOST_FINDINGS: usize = 12;

impl Report {
    /// The fault that strict decoding reports: the first of the findings.
    pub const fn error(&self) -> Option<Error> {
        self.findings[0]
    }

    /// Every fault of the block, in the order of the checks: each as if the ones before it were mended.
    pub fn findings(&self) -> impl Iterator<Item = Error> {
        self.findings.into_iter().flatten()
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
    pub fn changes(&self, before: &Self) -> impl Iterator<Item = (Field, Option<Value>)> {
        self.fields.iter().filter_map(move |field| {
            let old = before.fields.iter().find(|old| old.name == field.name).map(|old| old.value);
            (old != Some(field.value)).then_some((field, old))
        })
    }
}

/// Looks at a block of either direction and either size.
pub fn inspect(bytes: &[u8]) -> Report {
    let is_response = bytes.first().map(|byte0| byte0 & 0x80 != 0);
    let findings = findings(bytes);
    Report {
        is_response,
        is_usable: lenient(bytes).is_ok(),
        cause: cause(bytes, findings[0]),
        findings,
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

fn lenient(bytes: &[u8]) -> Result<(), Error> {
    match (is_response(bytes), bytes.len() > LEN) {
        (false, false) => Command::parse(bytes).map(drop),
        (false, true) => Command32::parse(bytes).map(drop),
        (true, false) => Response::parse(bytes).map(drop),
        (true, true) => Response32::parse(bytes).map(drop),
    }
}

/// Decodes strictly, mends what is reported, and decodes again.
fn findings(bytes: &[u8]) -> [Option<Error>; MOST_FINDINGS] {
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

fn cause(bytes: &[u8], error: Option<Error>) -> Option<Cause> {
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
    if lenient(bytes).is_ok() && !nop {
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
        assert_eq!(inspect(&block).cause, None);
        assert_eq!(inspect(&swapped(&block, 2)).cause, Some(Cause::SwappedWords16));
        assert_eq!(inspect(&swapped(&block, 4)).cause, Some(Cause::SwappedWords32));
        let mut stray = block;
        stray[2] |= 0x03;
        assert_eq!(inspect(&stray).cause, None);
        assert_eq!(inspect(&[0; 16]).cause, Some(Cause::AllZero));
        assert_eq!(inspect(&[0xff; 32]).cause, Some(Cause::AllOnes));
        for size in (0..40).filter(|n| ![16, 32].contains(n)) {
            let report = inspect(&[0x20; 40][..size]);
            assert_eq!(report.cause, Some(Cause::OtherSize));
            assert!(
                matches!(report.error(), Some(Error::Truncated { .. } | Error::TooLong { .. })) && !report.is_usable
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
        assert!(inspect(&block).findings().eq(want));
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
        let changes: Vec<_> =
            after.changes(&before).map(|(f, old)| (f.name, old.unwrap().to_string(), f.value.to_string())).collect();
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
            prop_assert!(report.is_usable || report.error().is_some());
            // The list is long enough: one place is always left.
            prop_assert!(report.findings().count() < MOST_FINDINGS);
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
