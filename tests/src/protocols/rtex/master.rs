//! What master and drive find in blocks, one after the other.

use core::num::NonZeroU16;

use rtex_block::master::{
    Acknowledgement, Checked, CommandCounter, EchoWatch, Expected, Failure, Handshake, Progress, ServoOff, Turn,
};
use rtex_block::{
    BlockSize, Command, CommandBlock, ControlBits, Error, Execution, MacId, NonCyclicCode, NonCyclicCommand, Response,
};
use rtex_block::{Codes, device};
use serde::Deserialize;

use super::fields::{code, counter, mac_id, size, unreadable};
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

fn class(result: &Result<Checked, Error>) -> String {
    match result {
        Err(Error::Truncated { .. } | Error::TooLong { .. }) => "wrong_length",
        Err(Error::Direction { .. }) => "not_a_response",
        Err(Error::MacId { .. }) => "mac_id_mismatch",
        Ok(Checked { acknowledgement: Acknowledgement::CounterNotEchoed, .. }) => "counter_not_echoed",
        Ok(Checked { acknowledgement: Acknowledgement::CodeNotYetEchoed, .. }) => "code_not_yet_echoed",
        Ok(Checked { acknowledgement: Acknowledgement::CommandError(_), .. }) => "command_error",
        Ok(Checked { acknowledgement: Acknowledgement::Accepted, .. }) => "ok",
        Err(other) => return other.to_string(),
    }
    .to_owned()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MasterCheck {
    mode: u8,
    expected_mac_id: u8,
    sent_counter: u8,
    sent_code: Hex,
    /// How the block was made; the class follows from its bytes.
    #[serde(rename = "case")]
    _case: String,
    hex: Bytes,
    class: String,
}

pub(super) fn master_check(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: MasterCheck| {
        let expected = Expected {
            size: size(row.mode)?,
            mac_id: mac_id(row.expected_mac_id)?,
            update_counter: counter(row.sent_counter)?,
            code: code(row.sent_code.0)?,
        };
        same("class", &row.class, &class(&expected.check(&row.hex.0)))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BitFlip {
    base: Bytes,
    bit: usize,
    hex: Bytes,
    expected_mac_id: u8,
    sent_counter: u8,
    sent_code: Hex,
    class: String,
}

pub(super) fn bitflips(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: BitFlip| {
        let size = size(u8::try_from(row.base.0.len()).unwrap_or(0))?;
        let expected = Expected {
            size,
            mac_id: mac_id(row.expected_mac_id)?,
            update_counter: counter(row.sent_counter)?,
            code: code(row.sent_code.0)?,
        };
        let mut flipped = row.base.0.clone();
        let byte = flipped.get_mut(row.bit / 8).ok_or_else(|| unreadable("bit after the block"))?;
        *byte ^= 1 << (row.bit % 8);
        same("hex", &row.hex.0, &flipped)?;
        same("class of the base", &"ok".to_owned(), &class(&expected.check(&row.base.0)))?;
        same("class", &row.class, &class(&expected.check(&flipped)))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveCheck {
    mode: u8,
    drive_mac_id: u8,
    fault: String,
    hex: Bytes,
    error_code: Option<Hex>,
    sub_error_code: Option<Hex>,
    alarm: Option<String>,
}

pub(super) fn drive_check(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: DriveCheck| {
        let (size, own) = (size(row.mode)?, mac_id(row.drive_mac_id)?);
        let found = device::check(&row.hex.0, size, own);
        same("error_code", &row.error_code.map(|c| c.0), &found.error.map(|c| c.0.into()))?;
        same("sub_error_code", &row.sub_error_code.map(|c| c.0), &found.sub_error.map(|c| c.0.into()))?;
        same("alarm", &row.alarm, &found.alarm.map(|a| a.to_string()))?;
        let (main, sub) = row.hex.0.split_at_checked(16).ok_or_else(|| unreadable("hex is too short"))?;
        same("fault", &row.fault, &fault(main, sub, size, own).to_owned())
    })
}

/// The row's word for the fault, from what decoding says.
fn fault(main: &[u8], sub: &[u8], size: BlockSize, own: MacId) -> &'static str {
    let Ok(block) = CommandBlock::new(main) else { return "c_r_set" };
    if block.mac_id() != own {
        return "mac_id_mismatch";
    }
    match Command::parse(main) {
        Err(Error::CyclicCode { .. }) => return "undefined_cyclic",
        Err(_) => return "undefined_noncyclic",
        Ok(_) => {}
    }
    if size == BlockSize::Bytes32 {
        let whole = [main, sub].concat();
        match rtex_block::Command32::parse(&whole) {
            Err(Error::SubChk { .. }) => return "sub_chk_clear",
            Err(_) => return "undefined_sub_command",
            Ok(_) => {}
        }
    }
    let [_, _, two, three, ..] = *block.bytes();
    if ControlBits::reserved([two, three]) != [0, 0] {
        return "reserved_control_bit_set";
    }
    "none"
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CounterTrace {
    limit: u16,
    echoes: Vec<u8>,
    tripped: Vec<bool>,
    first_trip: Option<usize>,
}

pub(super) fn update_counter_traces(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: CounterTrace| {
        let mut watch = EchoWatch::new(NonZeroU16::new(row.limit).ok_or_else(|| unreadable("limit 0"))?);
        let tripped = row
            .echoes
            .iter()
            .map(|&echo| counter(echo).map(|echo| watch.sample(Some(echo))))
            .collect::<Result<Vec<_>, _>>()?;
        same("tripped", &row.tripped, &tripped)?;
        same("first_trip", &row.first_trip, &tripped.iter().position(|&t| t))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CounterStart {
    nop_cycles: u32,
    counter: Vec<u8>,
    code: Vec<Hex>,
}

pub(super) fn counter_start(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: CounterStart| {
        let mut source = CommandCounter::new(row.nop_cycles);
        let sent: Vec<(u8, u64)> = row
            .counter
            .iter()
            .map(|_| match source.next() {
                Turn::Invalid => Command::nop(MacId::default()),
                Turn::Valid(counter) => Command::idle(MacId::default(), counter),
            })
            .map(|command| (command.update_counter.get(), command.code().get().into()))
            .collect();
        let want: Vec<(u8, u64)> = row.counter.iter().copied().zip(row.code.iter().map(|c| c.0)).collect();
        same("a code a counter", &row.counter.len(), &row.code.len())?;
        same("counter and code", &want, &sent)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NonCyclicTrace {
    request: RequestKeys,
    responses: Vec<Bytes>,
    expect: Vec<Expect>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RequestKeys {
    code: Hex,
    mac_id: u8,
    type_code: u16,
    index: u16,
}

#[derive(Deserialize, Debug, PartialEq)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Expect {
    Pending,
    Failed,
    Rejected(Hex),
    #[serde(untagged)]
    Done {
        done: Done,
    },
}

#[derive(Deserialize, Debug, PartialEq)]
#[serde(deny_unknown_fields)]
struct Done {
    monitor_data: i32,
    warning: u8,
}

fn request(keys: &RequestKeys) -> Result<(rtex_block::CyclicCode, NonCyclicCommand), Fault> {
    let Codes { cyclic, noncyclic } = code(keys.code.0)?.codes().map_err(|e| unreadable(e.to_string()))?;
    let [type_low, type_high] = keys.type_code.to_le_bytes();
    let [index_low, index_high] = keys.index.to_le_bytes();
    Ok((cyclic, NonCyclicCommand::parse(noncyclic, [type_low, type_high, index_low, index_high, 0, 0, 0, 0])))
}

pub(super) fn noncyclic_traces(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: NonCyclicTrace| {
        let (cyclic, request) = request(&row.request)?;
        let handshake = Handshake::new(mac_id(row.request.mac_id)?, cyclic, request, u32::MAX);
        let mut handshake = handshake.ok_or_else(|| unreadable("a command without a handshake"))?;
        same("request of another kind", &false, &(request.code() == NonCyclicCode::Normal))?;
        let seen: Vec<Expect> = row
            .responses
            .iter()
            .map(|bytes| match handshake.receive(Response::parse(&bytes.0).ok().as_ref()) {
                Progress::Pending { .. } => Ok(Expect::Pending),
                Progress::Failed { error: Failure::Execution } => Ok(Expect::Failed),
                Progress::Failed { error: Failure::CommandError(code) } => Ok(Expect::Rejected(Hex(code.0.into()))),
                Progress::Failed { error } => Err(unreadable(error.to_string())),
                Progress::Done { value } => {
                    let warning = value.execution().is_some_and(|e| e.contains(Execution::WNG)).into();
                    let data = value.data().ok_or_else(|| unreadable("no data"))?;
                    Ok(Expect::Done { done: Done { monitor_data: data, warning } })
                }
            })
            .collect::<Result<_, Fault>>()?;
        same("expect", &row.expect, &seen)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BlockPair {
    before: Bytes,
    servo_off: Bytes,
    effective: bool,
}

pub(super) fn servo_off(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: BlockPair| {
        let before = Command::parse(&row.before.0).map_err(|e| unreadable(e.to_string()))?;
        let block = CommandBlock::new(&row.servo_off.0).map_err(|e| unreadable(e.to_string()))?;
        same("effective", &row.effective, &block.is_servo_off())?;
        same("counter of the next block", &before.update_counter.next(), &block.update_counter())?;
        let made = ServoOff::after(&before).map(|off| off.emit().to_vec());
        if row.effective {
            return same("servo_off", &Some(row.servo_off.0.clone()), &made);
        }
        same("never made by the encoder", &false, &(made.as_ref() == Some(&row.servo_off.0)))
    })
}
