//! Rows about what an encoder answers.

use serde::Deserialize;

use tformat::master::parse_echoed;
use tformat::{AllData, Almc, Error, Request, Resolution, Response, StatusField, Window};

use super::{bits_of, class, compose, data_id, line_of, outcome};
use crate::hex::{Bits, Bytes, Hex};
use crate::row::{Row, Verdict, same};

/// What a row says of a decoded answer.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Status {
    raw: u8,
    info: u8,
    ea0_counting_error: bool,
    ea1_other_error: bool,
    ca0_parity_error: bool,
    ca1_delimiter_error: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Alarms {
    raw: u8,
    over_speed: bool,
    full_absolute_status: bool,
    counting_error: bool,
    counter_overflow: bool,
    over_heat: bool,
    multi_turn_error: bool,
    battery_error: bool,
    battery_alarm: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Width {
    abs_bits: u8,
    abm_bits: u8,
    enid_documented: bool,
}

fn check_status(expected: Option<&Status>, real: Option<StatusField>) -> Verdict {
    let (Some(want), Some(sf)) = (expected, real) else {
        return same("sf", &expected.is_some(), &real.is_some());
    };
    same("sf.raw", &want.raw, &sf.bits())?;
    same("sf.info", &want.info, &(sf.bits() & 0x0f))?;
    same("sf.ea0_counting_error", &want.ea0_counting_error, &sf.contains(StatusField::EA0))?;
    same("sf.ea1_other_error", &want.ea1_other_error, &sf.contains(StatusField::EA1))?;
    same("sf.ca0_parity_error", &want.ca0_parity_error, &sf.contains(StatusField::CA0))?;
    same("sf.ca1_delimiter_error", &want.ca1_delimiter_error, &sf.contains(StatusField::CA1))
}

fn check_alarms(expected: Option<&Alarms>, real: Option<Almc>) -> Verdict {
    let (Some(want), Some(almc)) = (expected, real) else {
        return same("almc", &expected.is_some(), &real.is_some());
    };
    same("almc.raw", &want.raw, &almc.bits())?;
    let flags = [
        (want.over_speed, "over_speed", Almc::OS),
        (want.full_absolute_status, "full_absolute_status", Almc::FS),
        (want.counting_error, "counting_error", Almc::CE),
        (want.counter_overflow, "counter_overflow", Almc::OF),
        (want.over_heat, "over_heat", Almc::OH),
        (want.multi_turn_error, "multi_turn_error", Almc::ME),
        (want.battery_error, "battery_error", Almc::BE),
        (want.battery_alarm, "battery_alarm", Almc::BA),
    ];
    flags.iter().try_for_each(|(want, name, alarm)| same(name, want, &almc.contains(*alarm)))
}

/// The statements that a row may make about an answer.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    cf: Option<u8>,
    crc: Option<u8>,
    sf: Option<Status>,
    abs: Option<u32>,
    abm: Option<u32>,
    enid: Option<u8>,
    almc: Option<Alarms>,
    width: Option<Width>,
    adf: Option<u8>,
    busy: Option<bool>,
    edf: Option<u8>,
}

fn check_content(want: &Content, response: Response) -> Verdict {
    let frame = response.emit();
    same("cf", &want.cf, &frame.as_bytes().first().copied())?;
    same("crc", &want.crc, &frame.as_bytes().last().copied())?;
    check_status(want.sf.as_ref(), response.status())?;
    same("abs", &want.abs, &response.abs().map(tformat::Abs::get))?;
    let (abm, enid, almc) = match response {
        Response::ReadMultiTurn(v) => (Some(v.abm), None, None),
        Response::ReadEncoderId(v) => (None, Some(v.enid), None),
        Response::ReadAll(v) => (Some(v.abm), Some(v.enid), Some(v.almc)),
        _ => (None, None, None),
    };
    same("abm", &want.abm, &abm.map(tformat::Abm::get))?;
    same("enid", &want.enid, &enid)?;
    check_alarms(want.almc.as_ref(), almc)?;
    if let Some(width) = &want.width {
        let hint = enid.and_then(Resolution::from_enid);
        let real = hint.map(|h| (h.resolution.abs_bits(), h.resolution.abm_bits(), h.documented));
        same("width", &Some((width.abs_bits, width.abm_bits, width.enid_documented)), &real)?;
    }
    let memory = match response {
        Response::WriteEeprom(memory) | Response::ReadEeprom(memory) => Some(memory),
        _ => None,
    };
    same("adf", &want.adf, &memory.map(|m| m.adf.address().get()))?;
    same("busy", &want.busy, &memory.map(|m| m.adf.busy()))?;
    // While the memory is busy a row need not say what the data byte is.
    if want.edf.is_some() || want.busy != Some(true) {
        same("edf", &want.edf, &memory.map(|m| m.edf))?;
    }
    Ok(())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ResponseRow {
    request_id: Hex,
    bytes: Bytes,
    wire: Bits,
    /// Where the frame comes from: `capture` or `made`.
    #[serde(rename = "origin")]
    _origin: String,
    expect: String,
}

/// The first 128 bits of a line, more than any frame has.
fn window(bits: &Bits) -> Window {
    let value = bits.0.iter().take(128).rev().fold(0, |value, bit| value << 1 | u128::from(*bit));
    Window::from_bits(value, bits.0.len().min(128) as u32).unwrap_or(Window::EMPTY)
}

pub(super) fn responses(rows: &[Row]) -> Vec<Verdict> {
    let keys = ["request_id", "bytes", "wire", "origin", "expect"];
    rows.iter().map(|row| row.read_parts(&keys).and_then(|(row, content)| response(&row, &content))).collect()
}

fn response(row: &ResponseRow, content: &Content) -> Verdict {
    let request = compose(data_id(row.request_id), content.adf, content.edf);
    let parsed = Response::parse(request, &row.bytes.0);
    same("expect", &row.expect, &outcome(&parsed))?;
    let Ok(response) = parsed else { return Ok(()) };
    check_content(content, response)?;
    same("from the line", &parsed, &Response::parse_line(request, window(&row.wire)))?;
    same("bytes", &row.bytes.0[..], response.emit().as_bytes())?;
    same("wire", &bits_of(&row.wire), &line_of(response.emit()))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NegativeRow {
    /// How the frame was damaged.
    kind: String,
    level: Level,
    request_id: Hex,
    adf: Option<u8>,
    edf: Option<u8>,
    wire: Option<Bits>,
    bytes: Option<Bytes>,
    #[serde(rename = "flipped_bit")]
    _flipped_bit: Option<u32>,
    #[serde(rename = "original")]
    _original: Option<Bytes>,
    /// Classes of decoders with another order of checks; the documented order is held here.
    #[serde(rename = "accept")]
    _accept: Vec<String>,
    error: Option<String>,
    sf: Option<Status>,
    consumed: Option<u8>,
    xor_is_zero: Option<bool>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Level {
    Wire,
    Bytes,
}

pub(super) fn negative(row: NegativeRow) -> Verdict {
    let id = data_id(row.request_id);
    let bytes = row.bytes.map(|b| b.0).unwrap_or_default();
    // Rows about damage that the check field does not see, and about trailing bytes, leave the EEPROM request open: it is
    // one that the answer fits. All other rows are refused before the address is looked at, or say what was asked.
    let fits = row.kind.starts_with("crc_blind") || row.kind == "trailing_bytes";
    let request = match Request::answered_by(&bytes) {
        Ok(request) if fits => request,
        _ => compose(id, row.adf, row.edf),
    };
    let parsed = match (&row.level, &row.wire) {
        (Level::Bytes, _) => Response::parse(request, &bytes),
        (Level::Wire, Some(wire)) => Response::parse_line(request, window(wire)),
        (Level::Wire, None) => return same("wire", &"line bits", &"none"),
    };
    same("error", &row.error.as_deref().unwrap_or("ok"), &parsed.as_ref().map_or_else(|e| class(*e), |_| "ok"))?;
    if let Some(zero) = row.xor_is_zero {
        same("xor_is_zero", &zero, &(tformat::crc(&bytes) == 0))?;
    }
    if let Some(consumed) = row.consumed {
        same("consumed", &Some(consumed), &parsed.ok().map(|r| r.emit().fields()))?;
    }
    match (parsed, row.sf) {
        (Err(Error::Rejected { sf }), want @ Some(_)) => check_status(want.as_ref(), Some(sf)),
        (_, None) => Ok(()),
        (_, Some(_)) => same("sf", &"a status", &"none"),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EchoRow {
    request: Bytes,
    rx: Bytes,
    skip: usize,
    expect: String,
    error: Option<String>,
}

pub(super) fn uart_echoes(rows: &[Row]) -> Vec<Verdict> {
    let keys = ["request", "rx", "skip", "expect", "error"];
    rows.iter().map(|row| row.read_parts(&keys).and_then(|(row, content)| uart_echo(row, &content))).collect()
}

fn uart_echo(row: EchoRow, content: &Content) -> Verdict {
    let Ok(request) = Request::parse(&row.request.0) else { return same("request", &"a sound one", &"refused") };
    same("skip", &row.skip, &usize::from(request.data_id().request_fields()))?;
    let parsed = parse_echoed(request, &row.rx.0);
    let expected = if row.expect == "ok" { row.expect } else { row.error.unwrap_or_default() };
    same("outcome", &expected, &outcome(&parsed))?;
    match parsed {
        Ok(response) => check_content(content, response),
        // The row describes the ID 3 frame in which the encoder refused.
        Err(Error::Rejected { .. }) if content.cf.is_some() => {
            match AllData::parse(row.rx.0.get(row.skip..).unwrap_or(&[])) {
                Ok(full) => check_content(content, Response::ReadAll(full)),
                Err(error) => same("refusal", &"an ID 3 frame", &class(error)),
            }
        }
        Err(_) => Ok(()),
    }
}
