//! What a step becomes on the wire: the PTO word and the payload of the master frame, made by sorte-proto.

use serde::Deserialize;
use sorte_proto::{Direction, MotorMask, OutOfRange, Payload, Pto, Slice, StartTime};
use step_profile::{Command, Motors};

use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

/// The word of a motor's command.
pub(super) fn pto(command: Command) -> Result<Pto, OutOfRange> {
    match command {
        Command::Disable => Ok(Pto::DriverOff),
        Command::Hold { direction } => Ok(Pto::NoPulse { direction: level(direction) }),
        Command::Pulse { direction, sync_time } => Pto::from_step(sync_time, level(direction)),
    }
}

/// The level of DIR, which both crates give the same code.
fn level(direction: step_profile::Direction) -> Direction {
    Direction::from_code(direction.code()).unwrap_or_default()
}

/// The command of a word; `None` for a reserved one.
fn command(pto: Pto) -> Option<Command> {
    let code = pto.direction().unwrap_or_default().code();
    let direction = step_profile::Direction::from_code(code).unwrap_or_default();
    match pto {
        Pto::DriverOff => Some(Command::Disable),
        Pto::NoPulse { .. } => Some(Command::Hold { direction }),
        Pto::Pulse { start, .. } => Some(Command::Pulse { direction, sync_time: start.ns().into() }),
        Pto::Reserved(_) => None,
    }
}

#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
enum Word {
    Encode {
        sync: u32,
        dir: u8,
        word: Option<Hex>,
        wire_le: Option<Bytes>,
        shifted_ns: Option<i64>,
        error: Option<String>,
    },
    Decode {
        word: Hex,
        wire_le: Bytes,
        kind: Option<String>,
        dir: Option<u8>,
        sync: Option<u16>,
        start_ticks_5ns: Option<u16>,
        error: Option<String>,
    },
}

pub(super) fn pto_word(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Word| match row {
        Word::Encode { sync, dir, word, wire_le, shifted_ns, error } => {
            let direction = step_profile::Direction::from_code(dir).unwrap_or_default();
            let pto = pto(Command::Pulse { direction, sync_time: sync });
            same("error", &error, &pto.err().map(|_| "SyncTimeOutOfRange".to_owned()))?;
            let pto = pto.ok();
            same("word", &word.map(|word| word.0), &pto.map(|pto| pto.word().into()))?;
            same("wire_le", &wire_le.map(|bytes| bytes.0), &pto.map(wire))?;
            let sent = pto.and_then(Pto::start).map(|start| i64::from(start.ns()) - i64::from(sync));
            same("shifted_ns", &shifted_ns, &sent)
        }
        Word::Decode { word, wire_le, kind, dir, sync, start_ticks_5ns, error } => {
            let raw = u16::try_from(word.0).map_err(|e| Fault::Unreadable(e.to_string()))?;
            same("wire_le", &wire_le.0, &wire(Pto::from_word(raw)))?;
            let pto = Pto::checked(raw);
            same("error", &error, &pto.err().map(|error| format!("{:?}", error.class())))?;
            let name = |pto| match pto {
                Pto::NoPulse { .. } => "no_pulse",
                Pto::Pulse { .. } => "pulse",
                Pto::DriverOff => "disable_driver",
                Pto::Reserved(_) => "reserved",
            };
            let pto = pto.ok();
            same("kind", &kind.as_deref(), &pto.map(name))?;
            same("dir", &dir, &pto.and_then(Pto::direction).map(|direction| direction.is_high().into()))?;
            same("sync", &sync, &pto.and_then(Pto::start).map(StartTime::ns))?;
            same("start_ticks_5ns", &start_ticks_5ns, &pto.and_then(Pto::start).map(StartTime::ticks))
        }
    })
}

/// The two bytes of a word at the front of a device's slice.
fn wire(pto: Pto) -> Vec<u8> {
    let [low, high, _, _] = Slice::from(pto).emit();
    vec![low, high]
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PayloadRow {
    mask: Option<u8>,
    word: Option<Hex>,
    #[serde(default)]
    independent: bool,
    device_words: [Hex; 4],
    payload: Bytes,
}

pub(super) fn payload(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: PayloadRow| {
        let pto = |word: Hex| Pto::from_word(word.0 as u16);
        let payload = match (row.mask.and_then(MotorMask::from_bits), row.word, row.independent) {
            (Some(motors), Some(word), false) => Payload::shared(pto(word), motors),
            (None, None, true) => Payload::independent(row.device_words.map(pto)),
            _ => return Err(Fault::Unreadable("neither a mask with a word nor four words".to_owned())),
        };
        let words = row.device_words.map(pto);
        same("device_words", &words, &payload.0.map(|slice| slice.pto))?;
        if let (Some(mask), Some(command)) = (row.mask, row.word.and_then(|word| command(pto(word)))) {
            let motors = Motors::try_from(mask).map_err(|e| Fault::Unreadable(e.to_string()))?;
            let commanded = motors.distribute(command).into_iter().map(self::pto).collect::<Result<Vec<_>, _>>();
            same("device_words, by the commands", &Ok(words.to_vec()), &commanded)?;
        }
        same("payload", &row.payload.0, &payload.emit().to_vec())?;
        let back = row.payload.0.try_into().map(Payload::parse);
        same("parsed", &Ok(payload), &back)
    })
}
