//! Checksums and long-header frames.

use serde::Deserialize;
use sorte_proto::{CrcMode, Discovery, Error, LongFrame, Param, ParamView, Parameters, Status, Sync, strip_preamble};

use super::{Origin, outcome};
use crate::hex::{Bytes, Hex};
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Crc8 {
    Params {
        width: u32,
        poly: Hex,
        init: Hex,
        refin: bool,
        refout: bool,
        xorout: Hex,
        check_123456789: Hex,
        residue: Hex,
    },
    Lut {
        lut: Bytes,
    },
    Crc {
        data: Bytes,
        crc8: Hex,
    },
    Stream {
        part1: Bytes,
        crc_after_part1: Hex,
        part2: Bytes,
        crc8: Hex,
    },
}

pub(super) fn crc8(rows: &[Row]) -> Vec<Verdict> {
    use sorte_proto::{crc8, crc8_update};
    each(rows, |row: Crc8| match row {
        Crc8::Params { width, poly, init, refin, refout, xorout, check_123456789, residue } => {
            same("width", &width, &u8::BITS)?;
            // The CRC of a 1 is the polynomial; of nothing, the start value; of zeros, again.
            same("poly", &poly.0, &crc8(&[1]).into())?;
            same("init", &init.0, &crc8(&[]).into())?;
            same("xorout", &xorout.0, &crc8(&[0; 4]).into())?;
            same("refin", &refin, &(crc8(&[0x80]) == 7))?;
            same("refout", &refout, &(crc8(&[1]) == 7_u8.reverse_bits()))?;
            let check = crc8(b"123456789");
            same("check", &check_123456789.0, &check.into())?;
            same("residue", &residue.0, &crc8_update(check, &[check]).into())
        }
        Crc8::Lut { lut } => same("lut", &lut.0, &(0..=u8::MAX).map(|byte| crc8(&[byte])).collect()),
        Crc8::Crc { data, crc8: want } => same("crc8", &want.0, &crc8(&data.0).into()),
        Crc8::Stream { part1, crc_after_part1, part2, crc8: want } => {
            let first = crc8(&part1.0);
            same("crc_after_part1", &crc_after_part1.0, &first.into())?;
            same("crc8", &want.0, &crc8_update(first, &part2.0).into())
        }
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParamRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    fields: Fields,
    status: u8,
    frame: Bytes,
    device_stores_payload: Bytes,
    state_after: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    cycle_time_ns: u32,
    sync_cycle: u32,
    delay_period_ms: u16,
    delay_burst: u8,
    delay_gap_ms: u8,
    delay_fwd_time_ns: u32,
    ipg_5ns: u32,
    t_in_ns: u32,
    t_out_ns: u32,
    topology: u8,
    diagnostics: u8,
    alarm: u8,
    crc_mode: u8,
}

impl From<Fields> for Parameters {
    fn from(f: Fields) -> Self {
        Self {
            cycle_time_ns: f.cycle_time_ns,
            sync_cycle: f.sync_cycle,
            delay_period_ms: f.delay_period_ms,
            delay_burst: f.delay_burst,
            delay_gap_ms: f.delay_gap_ms,
            delay_fwd_time_ns: f.delay_fwd_time_ns,
            ipg_5ns: f.ipg_5ns,
            t_in_ns: f.t_in_ns,
            t_out_ns: f.t_out_ns,
            topology: f.topology,
            diagnostics: f.diagnostics,
            alarm: f.alarm,
            crc_mode: CrcMode::from_byte(f.crc_mode),
        }
    }
}

pub(super) fn param(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ParamRow| {
        let frame = Param { source: 0, status: Status::from_bits_retain(row.status), parameters: row.fields.into() };
        same("frame", &row.frame.0, &frame.emit().to_vec())?;
        same("fields", &Ok(frame), &Param::parse(&row.frame.0))?;
        let stored = ParamView::parse(&row.frame.0).map(|view| view.bytes().to_vec());
        same("device_stores_payload", &Ok(row.device_stores_payload.0.clone()), &stored)?;
        let (state, stored) = super::device::after_param(&row.frame.0);
        same("state_after", &row.state_after, &state)?;
        same("device_stores_payload", &Some(row.device_stores_payload.0), &stored.map(|bytes| bytes.to_vec()))
    })
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Negative {
    Preamble(PreambleRow),
    Frame(FrameRow),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PreambleRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "type")]
    kind: String,
    #[serde(rename = "base")]
    _base: String,
    preamble: Bytes,
    wire: Bytes,
    expect: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "type")]
    kind: String,
    #[serde(rename = "base")]
    _base: String,
    frame: Bytes,
    expect: String,
}

pub(super) fn negative(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Negative| match row {
        Negative::Preamble(row) => {
            let frame = strip_preamble(&row.wire.0);
            same("expect", &row.expect, &outcome(&frame))?;
            same("preamble", &true, &row.wire.0.starts_with(&row.preamble.0))?;
            let Ok(frame) = frame else { return Ok(()) };
            same("frame", &row.wire.0.get(row.preamble.0.len()..), &Some(frame))?;
            same("type", &"Ok".to_owned(), &outcome(&parse(&row.kind, frame)))
        }
        Negative::Frame(row) => {
            same("expect", &row.expect, &outcome(&LongFrame::parse(&row.frame.0)))?;
            same("by its type", &row.expect, &outcome(&parse(&row.kind, &row.frame.0)))
        }
    })
}

/// The frame through the type of its kind; what was accepted gives itself back.
fn parse(kind: &str, frame: &[u8]) -> Result<(), Error> {
    let again = match kind {
        "DISCOVERY" => Discovery::parse(frame)?.emit().to_vec(),
        "PARAM" => Param::parse(frame)?.emit().to_vec(),
        "DELAY_REQ" => sorte_proto::DelayReq::parse(frame)?.emit().to_vec(),
        "SYNC" => Sync::parse(frame)?.emit().to_vec(),
        _ => return Err(Error::UnknownType { got: 0 }),
    };
    assert_eq!(again, frame, "{kind}");
    Ok(())
}
