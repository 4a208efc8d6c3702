//! Fields against bytes.

use std::collections::BTreeMap;

use rtex_block::{
    Alarm, Arguments, Command, Command32, ControlBits, CyclicCode, Error, ErrorCode, Execution, Header, LatchFlags,
    Nibble, NonCyclicCode, NonCyclicCommand, NonCyclicResponse, ProfileFlags, Response, Response32, Results,
    StatusFlags, SubCommand, SubResponse, TypeCode, UpdateCounter, pack,
};
use serde::Deserialize;
use serde_json::Value;

use super::fields::{
    Bits, control, control_from, counter, cyclic, mac_id, noncyclic, noncyclic_name, size, status, status_from,
    sub_code, unreadable,
};
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ZeroRow {
    byte0: Hex,
    c_r: u8,
    update_counter: u8,
    mac_id: u8,
}

pub(super) fn header_byte0(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ZeroRow| {
        let byte = row.byte0.0 as u8;
        let header = Header::parse(byte);
        same("c_r", &row.c_r, &header.response.into())?;
        same("update_counter", &row.update_counter, &header.update_counter.get())?;
        same("mac_id", &row.mac_id, &header.mac_id.get())?;
        let made = Header {
            response: row.c_r == 1,
            update_counter: counter(row.update_counter)?,
            mac_id: mac_id(row.mac_id)?,
        };
        same("byte0", &byte, &made.emit())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OneRow {
    byte1: Hex,
    bit7: u8,
    cyclic_code: u8,
    noncyclic_code: u8,
    cyclic: Option<String>,
    noncyclic: Option<String>,
    error_code: Option<Hex>,
}

pub(super) fn header_byte1(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: OneRow| {
        let byte = row.byte1.0 as u8;
        let block = {
            let mut block = [0x80; 16];
            block[1] = byte;
            block
        };
        let response = Response::parse(&block).map_err(|e| unreadable(e.to_string()))?;
        same("bit7", &row.bit7, &response.cmd_error.into())?;
        let code = response.code;
        same("cyclic_code", &row.cyclic_code, &code.cyclic_bits())?;
        same("noncyclic_code", &row.noncyclic_code, &code.noncyclic_bits())?;
        same("cyclic", &row.cyclic.as_deref(), &code.cyclic().map(CyclicCode::name))?;
        same("noncyclic", &row.noncyclic, &code.noncyclic().map(noncyclic_name))?;
        same("error_code", &row.error_code.map(|c| ErrorCode(c.0 as u16)), &code.error_code())?;
        same("byte1", &byte, &response.emit()[1])?;

        let mut sent = [0; 16];
        sent[1] = byte;
        let refused = Command::parse(&sent).map(|command| (command.tmg_cnt, command.emit()[1]));
        let want = match (code.cyclic(), code.noncyclic()) {
            (None, _) => Err(Error::CyclicCode { code: row.cyclic_code }),
            (_, None) => Err(Error::NonCyclicCode { code: row.noncyclic_code }),
            _ => Ok((row.bit7 == 1, byte)),
        };
        same("the same byte in a command", &want, &refused)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OneBit {
    bits: Vec<String>,
    bytes2_3: Bytes,
    reserved_set: Option<u8>,
}

impl OneBit {
    fn parts(&self) -> Result<(Bits, [u8; 2]), Fault> {
        let bytes = self.bytes2_3.0.as_slice().try_into().map_err(|_| unreadable("bytes2_3 is not two bytes"))?;
        Ok((self.bits.iter().map(|name| (name.clone(), 1)).collect(), bytes))
    }
}

fn only_set(bits: Bits) -> Bits {
    bits.into_iter().filter(|(_, set)| *set == 1).collect()
}

pub(super) fn control_bits(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: OneBit| {
        let (names, bytes) = row.parts()?;
        let bits = ControlBits::from_bytes(bytes);
        same("bits", &names, &only_set(control(bits)))?;
        let reserved = ControlBits::reserved(bytes);
        let set = reserved != [0, 0];
        same("reserved_set", &row.reserved_set.unwrap_or(0), &set.into())?;
        // Reserved bits are never written, so the bytes come back without them.
        let want = [bytes[0] & !reserved[0], bytes[1] & !reserved[1]];
        same("bytes2_3", &want, &control_from(&names)?.to_bytes())?;
        let mut block = Command::idle(mac_id(0)?, UpdateCounter::ZERO).emit();
        block[2..4].copy_from_slice(&bytes);
        same("lenient decoding takes it", &true, &Command::parse(&block).is_ok())?;
        same("strict decoding takes it", &!set, &Command::parse_strict(&block).is_ok())
    })
}

pub(super) fn status_flags(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: OneBit| {
        let (names, bytes) = row.parts()?;
        same("bits", &names, &only_set(status(StatusFlags::from_bytes(bytes))))?;
        same("bytes2_3", &bytes, &status_from(&names)?.to_bytes())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Packing {
    mode: u8,
    hex: Bytes,
    words32: Vec<Hex>,
    words16: Vec<Hex>,
}

pub(super) fn packing(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Packing| {
        let bytes = &row.hex.0;
        same("mode", &usize::from(row.mode), &bytes.len())?;
        let want32: Vec<u32> = row.words32.iter().map(|w| w.0 as u32).collect();
        let want16: Vec<u16> = row.words16.iter().map(|w| w.0 as u16).collect();
        let (mut words32, mut words16, mut back) = (vec![0; want32.len()], vec![0; want16.len()], vec![0; bytes.len()]);
        same("sizes agree", &Ok(()), &pack::to_words(bytes, &mut words32))?;
        same("sizes agree", &Ok(()), &pack::to_words(bytes, &mut words16))?;
        same("words32", &want32, &words32)?;
        same("words16", &want16, &words16)?;
        same("sizes agree", &Ok(()), &pack::from_words(&want32, &mut back))?;
        same("hex from words32", bytes, &back)?;
        back.fill(0);
        same("sizes agree", &Ok(()), &pack::from_words(&want16, &mut back))?;
        same("hex from words16", bytes, &back)
    })
}

fn flag<F: Default>(set: bool, flag: F) -> F {
    if set { flag } else { F::default() }
}

/// The keys of `data` and `sub`, by name; what is read is taken out, so that nothing is left unlooked at.
struct Keys(BTreeMap<String, Value>);

impl Keys {
    fn number<T: TryFrom<i64>>(&mut self, key: &str) -> Result<T, Fault> {
        let value = self.0.remove(key).ok_or_else(|| unreadable(format!("{key} is missing")))?;
        let number = value.as_i64().and_then(|n| T::try_from(n).ok());
        number.ok_or_else(|| unreadable(format!("{key} is {value}")))
    }

    /// A key that rows may leave out, where the layout has 0.
    fn number_or_0<T: TryFrom<i64> + From<u8>>(&mut self, key: &str) -> Result<T, Fault> {
        if self.0.contains_key(key) { self.number(key) } else { Ok(T::from(0)) }
    }

    fn bit(&mut self, key: &str) -> Result<bool, Fault> {
        Ok(self.number_or_0::<u8>(key)? == 1)
    }

    fn nibble(&mut self, key: &str) -> Result<Nibble, Fault> {
        Nibble::new(self.number_or_0(key)?).ok_or_else(|| unreadable(format!("{key} above 15")))
    }

    fn type_code(&mut self, key: &str) -> Result<TypeCode, Fault> {
        TypeCode::new(self.number(key)?).ok_or_else(|| unreadable(format!("{key} above 12 bits")))
    }

    fn execution(&mut self) -> Result<Execution, Fault> {
        let (err, wng, busy) = (self.bit("err")?, self.bit("wng")?, self.bit("busy")?);
        Ok(flag(err, Execution::ERR) | flag(wng, Execution::WNG) | flag(busy, Execution::BUSY))
    }

    fn end(self) -> Verdict {
        match self.0.keys().next() {
            None => Ok(()),
            Some(key) => Err(unreadable(format!("key {key} does not belong to this command"))),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CommandRow {
    mode: u8,
    dir: String,
    update_counter: u8,
    mac_id: u8,
    tmg_cnt: u8,
    cyclic: String,
    noncyclic: String,
    control: Bits,
    command_data1: i32,
    data: BTreeMap<String, Value>,
    sub: Option<BTreeMap<String, Value>>,
    hex: Bytes,
}

fn noncyclic_command(code: NonCyclicCode, keys: BTreeMap<String, Value>) -> Result<NonCyclicCommand, Fault> {
    let mut keys = Keys(keys);
    let arguments = |keys: &mut Keys, data: &str| {
        Ok(Arguments {
            type_code: keys.type_code("type_code")?,
            index: keys.number("index")?,
            data: keys.number(data)?,
        })
    };
    let request = match code {
        NonCyclicCode::Normal => NonCyclicCommand::Normal {
            command_data2: keys.number("command_data2")?,
            command_data3: keys.number("command_data3")?,
        },
        NonCyclicCode::Reset => NonCyclicCommand::Reset(arguments(&mut keys, "command_data3")?),
        NonCyclicCode::SystemId => NonCyclicCommand::SystemId(arguments(&mut keys, "command_data3")?),
        NonCyclicCode::Alarm => NonCyclicCommand::Alarm(arguments(&mut keys, "command_data3")?),
        NonCyclicCode::Monitor => NonCyclicCommand::Monitor(arguments(&mut keys, "command_data3")?),
        NonCyclicCode::Parameter => NonCyclicCommand::Parameter(arguments(&mut keys, "setting_data")?),
        NonCyclicCode::Homing => NonCyclicCommand::Homing {
            type_code: keys.number("type_code")?,
            latch_sel1: keys.nibble("latch_sel1")?,
            latch_sel2: keys.nibble("latch_sel2")?,
            monitor_sel: keys.number_or_0("monitor_sel")?,
            setting_data: keys.number("setting_data")?,
        },
        NonCyclicCode::Profile => NonCyclicCommand::Profile {
            type_code: keys.number("type_code")?,
            latch_sel1: keys.nibble("latch_sel1")?,
            monitor_sel: keys.number_or_0("monitor_sel")?,
            target_speed: keys.number("target_speed")?,
        },
    };
    keys.end().map(|()| request)
}

pub(super) fn commands(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: CommandRow| {
        same("dir", &"cmd", &row.dir.as_str())?;
        same("mode", &usize::from(row.mode), &row.hex.0.len())?;
        size(row.mode)?;
        let main = Command {
            mac_id: mac_id(row.mac_id)?,
            update_counter: counter(row.update_counter)?,
            tmg_cnt: row.tmg_cnt == 1,
            cyclic: cyclic(&row.cyclic)?,
            control: control_from(&row.control)?,
            command_data1: row.command_data1,
            noncyclic: noncyclic_command(noncyclic(&row.noncyclic)?, row.data)?,
        };
        let Some(sub) = row.sub else {
            same("fields", &Ok(main), &Command::parse(&row.hex.0))?;
            same("fields, strictly", &Ok(main), &Command::parse_strict(&row.hex.0))?;
            same("control", &row.control, &control(main.control))?;
            return same("hex", &row.hex.0, &main.emit().to_vec());
        };
        let mut sub = Keys(sub);
        let name = sub.0.remove("sub_command").and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
        let sub_command = SubCommand {
            code: sub_code(&name)?,
            type_code: sub.number_or_0("sub_type_code")?,
            index: sub.number_or_0("sub_index")?,
            data1: sub.number("sub_command_data1")?,
            data2: sub.number("sub_command_data2")?,
            data3: sub.number("sub_command_data3")?,
        };
        sub.end()?;
        let command = Command32 { main, sub: sub_command };
        same("fields", &Ok(command), &Command32::parse(&row.hex.0))?;
        same("fields, strictly", &Ok(command), &Command32::parse_strict(&row.hex.0))?;
        same("hex", &row.hex.0, &command.emit().to_vec())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ResponseRow {
    mode: u8,
    dir: String,
    update_counter_echo: u8,
    actual_mac_id: u8,
    cmd_error: u8,
    cyclic: String,
    noncyclic: String,
    status: Bits,
    response_data1: i32,
    data: BTreeMap<String, Value>,
    sub: Option<BTreeMap<String, Value>>,
    hex: Bytes,
}

fn noncyclic_response(
    code: NonCyclicCode,
    cmd_error: bool,
    keys: BTreeMap<String, Value>,
) -> Result<NonCyclicResponse, Fault> {
    let mut keys = Keys(keys);
    if cmd_error {
        let code = ErrorCode(keys.number("error_code")?);
        return keys.end().map(|()| NonCyclicResponse::CommandError(code));
    }
    let response = match code {
        NonCyclicCode::Normal => NonCyclicResponse::Normal {
            response_data2: keys.number("response_data2")?,
            response_data3: keys.number("response_data3")?,
        },
        NonCyclicCode::Reset => NonCyclicResponse::Reset(results(&mut keys, code)?),
        NonCyclicCode::SystemId => NonCyclicResponse::SystemId(results(&mut keys, code)?),
        NonCyclicCode::Alarm => NonCyclicResponse::Alarm(results(&mut keys, code)?),
        NonCyclicCode::Parameter => NonCyclicResponse::Parameter(results(&mut keys, code)?),
        NonCyclicCode::Monitor => NonCyclicResponse::Monitor(results(&mut keys, code)?),
        NonCyclicCode::Homing => NonCyclicResponse::Homing {
            execution: keys.execution()?,
            type_code: keys.number("type_code_echo")?,
            latch: flag(keys.bit("latch_comp1")?, LatchFlags::LATCH_COMP1)
                | flag(keys.bit("latch_comp2")?, LatchFlags::LATCH_COMP2),
            latch_sel1: keys.nibble("latch_sel1_echo")?,
            latch_sel2: keys.nibble("latch_sel2_echo")?,
            monitor_sel: keys.number_or_0("monitor_sel_echo")?,
            monitor_data: keys.number("monitor_data")?,
        },
        NonCyclicCode::Profile => NonCyclicResponse::Profile {
            execution: keys.execution()?,
            type_code: keys.number("type_code_echo")?,
            flags: flag(keys.bit("psl")?, ProfileFlags::PSL)
                | flag(keys.bit("nsl")?, ProfileFlags::NSL)
                | flag(keys.bit("near")?, ProfileFlags::NEAR)
                | flag(keys.bit("latch_comp1")?, ProfileFlags::LATCH_COMP1),
            latch_sel1: keys.nibble("latch_sel1_echo")?,
            monitor_sel: keys.number_or_0("monitor_sel_echo")?,
            monitor_data: keys.number("monitor_data")?,
        },
    };
    keys.end().map(|()| response)
}

fn results(keys: &mut Keys, code: NonCyclicCode) -> Result<Results, Fault> {
    let data = match code {
        NonCyclicCode::Alarm => {
            let alarm = Alarm { main: keys.number("alarm_main")?, sub: keys.number("alarm_sub")? };
            Results::alarm_data(alarm, keys.number("warning_code")?)
        }
        NonCyclicCode::SystemId => {
            let text = keys.0.remove("ascii_hex").unwrap_or_default();
            let bytes: Bytes = serde_json::from_value(text).map_err(|e| unreadable(e.to_string()))?;
            i32::from_le_bytes(bytes.0.try_into().map_err(|_| unreadable("ascii_hex is not four bytes"))?)
        }
        _ => keys.number("monitor_data")?,
    };
    let type_code = keys.type_code("type_code_echo")?;
    Ok(Results { execution: keys.execution()?, type_code, index: keys.number("index_echo")?, data })
}

fn sub_response(keys: BTreeMap<String, Value>) -> Result<SubResponse, Fault> {
    let mut keys = Keys(keys);
    let name = keys.0.remove("sub_command").and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let code = Nibble::new(sub_code(&name)? as u8).ok_or_else(|| unreadable("sub-command above 15"))?;
    let cmd_error = keys.bit("sub_cmd_err")?;
    let execution = flag(keys.bit("sub_err")?, Execution::ERR)
        | flag(keys.bit("sub_wng")?, Execution::WNG)
        | flag(keys.bit("sub_busy")?, Execution::BUSY);
    let index = keys.number(if cmd_error { "sub_error_code" } else { "sub_index_echo" })?;
    let (type_code, data1) = if cmd_error {
        (keys.number_or_0("sub_type_code_echo")?, keys.number_or_0("sub_response_data1")?)
    } else {
        (keys.number("sub_type_code_echo")?, keys.number("sub_response_data1")?)
    };
    let (data2, data3) = (keys.number("sub_response_data2")?, keys.number("sub_response_data3")?);
    keys.end().map(|()| SubResponse { cmd_error, execution, code, type_code, index, data1, data2, data3 })
}

pub(super) fn responses(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ResponseRow| {
        same("dir", &"rsp", &row.dir.as_str())?;
        same("mode", &usize::from(row.mode), &row.hex.0.len())?;
        size(row.mode)?;
        let noncyclic = noncyclic(&row.noncyclic)?;
        let data = noncyclic_response(noncyclic, row.cmd_error == 1, row.data)?;
        let main = Response {
            mac_id: mac_id(row.actual_mac_id)?,
            update_counter_echo: counter(row.update_counter_echo)?,
            cmd_error: false,
            code: rtex_block::Code::of(cyclic(&row.cyclic)?, noncyclic),
            status: status_from(&row.status)?,
            response_data1: row.response_data1,
            response_data2: 0,
            response_data3: 0,
        }
        .with_noncyclic(&data);
        let Some(sub) = row.sub else {
            let parsed = Response::parse(&row.hex.0).map_err(|e| unreadable(e.to_string()))?;
            same("fields", &main, &parsed)?;
            same("fields, strictly", &Ok(main), &Response::parse_strict(&row.hex.0))?;
            same("data", &data, &parsed.noncyclic())?;
            same("cmd_error", &row.cmd_error, &parsed.cmd_error.into())?;
            same("status", &row.status, &status(parsed.status))?;
            return same("hex", &row.hex.0, &main.emit().to_vec());
        };
        let response = Response32 { main, sub: sub_response(sub)? };
        let parsed = Response32::parse(&row.hex.0).map_err(|e| unreadable(e.to_string()))?;
        same("fields", &response, &parsed)?;
        same("fields, strictly", &Ok(response), &Response32::parse_strict(&row.hex.0))?;
        same("data", &data, &parsed.main.noncyclic())?;
        same("hex", &row.hex.0, &response.emit().to_vec())
    })
}
