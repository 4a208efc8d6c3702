//! T-Format: `tests/vectors/tformat`.

mod clb;
mod response;

use serde::Deserialize;

use nrz_line::{Format, Receiver};
use servowire_core::Ended;
use tformat::device::Device;
use tformat::master::Reset;
use tformat::{
    Abm, Abs, Adf, AllData, Almc, BitRate, ControlField, DataId, Doubt, Error, Evidence, Frame, Policy, Request,
    Resolution, Response, Sample, StatusField, spi,
};

use crate::hex::{Bits, Bytes, Hex};
use crate::row::{Check, Row, Verdict, each, same};

pub(crate) const TOPICS: &[(&str, Check)] = &[
    ("clb_fsm", clb::rows),
    ("control_field", |rows| each(rows, control_field)),
    ("crc", |rows| each(rows, crc)),
    ("negatives", |rows| each(rows, response::negative)),
    ("oversampled", |rows| each(rows, oversampled)),
    ("position", |rows| each(rows, position)),
    ("procedures", procedures),
    ("request_decode", |rows| each(rows, request_decode)),
    ("requests", |rows| each(rows, request)),
    ("responses", response::responses),
    ("uart_echo", response::uart_echoes),
];

/// The rows' name of an error: the crate's own.
fn class(error: Error) -> &'static str {
    error.class().name()
}

/// The rows' name of an outcome: `ok` or the class of the error.
fn outcome<T>(result: &Result<T, Error>) -> String {
    result.as_ref().map_or_else(|error| class(*error), |_| "ok").to_owned()
}

/// A data ID as the rows write it, one hex digit.
fn data_id(Hex(code): Hex) -> DataId {
    // A row with another ID is answered by a mismatch, not by a panic.
    DataId::from_code(code as u8).unwrap_or(DataId::ReadSingleTurn)
}

fn line_of(frame: Frame) -> String {
    let line = frame.line();
    (0..line.len()).map(|at| if line.get(at) == Some(true) { '1' } else { '0' }).collect()
}

fn bits_of(bits: &Bits) -> String {
    bits.0.iter().map(|bit| if *bit { '1' } else { '0' }).collect()
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum ControlFieldRow {
    Id {
        data_id: Hex,
        documented: bool,
        parity: u8,
        cf: Hex,
        cf_bit_reversed: Hex,
        wire: Bits,
        request_fields: Option<u8>,
        response_fields: Option<u8>,
    },
    Classify {
        cf: Hex,
        result: String,
        data_id: Option<Hex>,
    },
}

fn control_field(row: ControlFieldRow) -> Verdict {
    match row {
        ControlFieldRow::Id {
            data_id,
            documented,
            parity,
            cf,
            cf_bit_reversed,
            wire,
            request_fields,
            response_fields,
        } => {
            let composed = ControlField::compose(data_id.0 as u8);
            let byte = composed.get();
            let known = composed.data_id().ok();
            same("cf", &cf.0, &byte.into())?;
            same("cf_bit_reversed", &cf_bit_reversed.0, &byte.reverse_bits().into())?;
            same("parity", &parity, &(byte >> 7))?;
            same("documented", &documented, &known.is_some())?;
            let frame = Frame::new(&[byte]).map(line_of);
            same("wire", &Some(bits_of(&wire)), &frame)?;
            same("request_fields", &request_fields, &known.map(DataId::request_fields))?;
            same("response_fields", &response_fields, &known.map(DataId::response_fields))
        }
        ControlFieldRow::Classify { cf, result, data_id } => {
            let parsed = ControlField::parse(cf.0 as u8);
            let known = parsed.and_then(ControlField::data_id);
            same("result", &result, &outcome(&known))?;
            if let Some(code) = data_id {
                same("data_id", &Ok(code.0), &parsed.map(|cf| cf.code().into()))?;
            }
            Ok(())
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CrcRow {
    bytes: Bytes,
    crc: Hex,
    lfsr_wire: Hex,
}

fn crc(row: CrcRow) -> Verdict {
    same("crc", &row.crc.0, &tformat::crc(&row.bytes.0).into())?;
    let mut register = tformat::clb::SerialCrc::new();
    for byte in &row.bytes.0 {
        register.field(*byte);
    }
    same("lfsr_wire", &row.lfsr_wire.0, &register.register().into())
}

/// A request by its data ID and, for the EEPROM, address and data.
fn compose(id: DataId, adf: Option<u8>, edf: Option<u8>) -> Request {
    Request::of(id, Adf::from_bits(adf.unwrap_or(0)), edf.unwrap_or(0))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RequestRow {
    data_id: Hex,
    adf: Option<u8>,
    edf: Option<u8>,
    bytes: Bytes,
    wire: Bits,
    bits: u32,
    #[serde(rename = "ns_2M5")]
    ns_2m5: u32,
    #[serde(rename = "ns_5M")]
    ns_5m: u32,
    response_fields: u8,
    spi10_words: Vec<Hex>,
    pru_tx_bytes: Bytes,
}

fn request(row: RequestRow) -> Verdict {
    let id = data_id(row.data_id);
    let request = compose(id, row.adf, row.edf);
    let frame = request.emit();
    same("bytes", &row.bytes.0[..], frame.as_bytes())?;
    same("wire", &bits_of(&row.wire), &line_of(frame))?;
    same("bits", &row.bits, &frame.line_bits())?;
    same("ns_2M5", &row.ns_2m5, &BitRate::Mbit2_5.fields_ns(frame.fields()))?;
    same("ns_5M", &row.ns_5m, &BitRate::Mbit5.fields_ns(frame.fields()))?;
    same("response_fields", &row.response_fields, &id.response_fields())?;
    let words: Vec<u64> = row.spi10_words.iter().map(|w| w.0).collect();
    same("spi10_words", &words, &spi::spi10_words(&frame).map(u64::from).collect())?;
    let packed = frame.line().to_bytes(tformat::BitOrder::MsbFirst);
    let packed = packed.get(..frame.line_bits().div_ceil(8) as usize).unwrap_or(&packed);
    same("pru_tx_bytes", &row.pru_tx_bytes.0[..], packed)?;
    same("decoded", &Ok(request), &Request::parse(frame.as_bytes()))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RequestDecodeRow {
    bytes: Bytes,
    /// Which bit was damaged: says how the row was made.
    #[serde(rename = "flipped_bit")]
    _flipped_bit: Option<u32>,
    expect: String,
    error: Option<String>,
    data_id: Option<Hex>,
    adf: Option<u8>,
    busy_bit: Option<bool>,
    edf: Option<u8>,
}

fn request_decode(row: RequestDecodeRow) -> Verdict {
    let parsed = Request::parse(&row.bytes.0);
    let expected = if row.expect == "ok" { row.expect } else { row.error.unwrap_or_default() };
    same("outcome", &expected, &outcome(&parsed))?;
    let Ok(request) = parsed else { return Ok(()) };
    same("data_id", &row.data_id.map(|id| id.0 as u8), &Some(request.data_id().code()))?;
    let (adf, edf) = match request {
        Request::WriteEeprom { adf, edf } => (Some(adf), Some(edf)),
        Request::ReadEeprom { adf } => (Some(adf), None),
        _ => (None, None),
    };
    same("adf", &row.adf, &adf.map(|adf| adf.address().get()))?;
    same("busy_bit", &row.busy_bit, &adf.map(Adf::busy))?;
    same("edf", &row.edf, &edf)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PositionRow {
    abs: u32,
    abm: u32,
    abs_bits: u8,
    abm_bits: u8,
    high_bits_nonzero: bool,
    combined_unsigned: Option<i64>,
    turns_signed: Option<i32>,
    combined_signed: Option<i64>,
    fraction32: Option<u32>,
}

fn position(row: PositionRow) -> Verdict {
    let Ok(resolution) = Resolution::new(row.abs_bits, row.abm_bits) else {
        return same("widths", &"possible", &"refused");
    };
    let data = AllData {
        sf: StatusField::empty(),
        abs: Abs::truncate(row.abs),
        enid: 0,
        abm: Abm::truncate(row.abm),
        almc: Almc::empty(),
    };
    let read = |resolution| Evidence::of(Response::ReadAll(data), resolution, 0).at(0, Policy::new(0));
    let signed = read(resolution);
    same("high_bits_nonzero", &row.high_bits_nonzero, &matches!(signed, Err(Doubt::UpperBits { .. })))?;
    if row.high_bits_nonzero {
        return Ok(());
    }
    let unsigned = read(resolution.with_unsigned_turns()).ok();
    let signed = signed.ok();
    same("combined_unsigned", &row.combined_unsigned, &unsigned.and_then(Sample::counts))?;
    same("turns_signed", &row.turns_signed, &signed.and_then(Sample::turns))?;
    same("combined_signed", &row.combined_signed, &signed.and_then(Sample::counts))?;
    same("fraction32", &row.fraction32, &signed.map(|sample| sample.angle().to_bits()))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OversampledRow {
    n: u32,
    /// How the line was made; the samples are what counts.
    #[serde(rename = "baud_ppm")]
    _baud_ppm: i32,
    #[serde(rename = "jitter")]
    _jitter: f64,
    #[serde(rename = "gaps")]
    gaps: Option<Vec<f64>>,
    #[serde(rename = "phase")]
    _phase: f64,
    #[serde(rename = "spikes")]
    _spikes: serde_json::Value,
    first: u8,
    runs: Vec<u64>,
    expect: String,
    expect_bytes: Bytes,
    start_samples: Option<Vec<u64>>,
    spikes_dropped: u32,
    bits: Option<Bits>,
}

fn oversampled(row: OversampledRow) -> Verdict {
    let Ok(format) = Format::new(row.n, 8) else { return same("n", &"possible", &"refused") };
    let mut receiver = Receiver::new(format);
    let levels = (0..).map(|k| (k % 2 == 0) == (row.first == 1));
    let fields: Vec<_> = levels.zip(&row.runs).filter_map(|(level, &len)| receiver.run(level, len)).collect();
    let framed = fields.iter().all(|f| f.delimiter);
    same("expect", &row.expect.as_str(), &if framed { "ok" } else { "framing" })?;
    let received: Vec<u8> = fields.iter().map(|f| f.content as u8).collect();
    same("expect_bytes", &row.expect_bytes.0, &received)?;
    if let Some(starts) = row.start_samples {
        same("start_samples", &starts, &fields.iter().map(|f| f.start).collect())?;
    }
    same("spikes_dropped", &row.spikes_dropped, &fields.iter().map(|f| f.spikes).sum())?;
    match (row.bits, row.gaps) {
        // The free-running rule and the receiver take the same bits from fields without gaps.
        (Some(bits), None) => same("bits", &Some(bits_of(&bits)), &Frame::new(&received).map(line_of)),
        _ => Ok(()),
    }
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum ProcedureRow {
    Reset {
        data_id: Hex,
        effect: String,
        request: Bytes,
        count: u8,
        min_gap_us: u32,
        response_delay_us: u32,
        earliest_start_us: Vec<u64>,
        wait_after_us: u64,
    },
    Eeprom {
        run: u32,
        t_us: u64,
        request: Bytes,
        response: Bytes,
        busy: bool,
        adf: u8,
        edf: Option<u8>,
        page: u8,
    },
}

/// Rows of one EEPROM run follow each other on the same encoder.
fn procedures(rows: &[Row]) -> Vec<Verdict> {
    let mut encoder = (None, Device::<6>::new(0x17, BitRate::Mbit2_5));
    let mut check = |row: &Row| match row.read()? {
        ProcedureRow::Eeprom { run, t_us, request, response, busy, adf, edf, page } => {
            if encoder.0 != Some(run) {
                encoder = (Some(run), Device::new(0x17, BitRate::Mbit2_5));
            }
            let device = &mut encoder.1;
            let answered = Request::parse(&request.0).ok().and_then(|asked| device.answer(asked, t_us * 1000));
            same("response", &Some(response.0), &answered.map(|r| r.emit().as_bytes().to_vec()))?;
            let Some(Response::WriteEeprom(memory) | Response::ReadEeprom(memory)) = answered else {
                return same("response", &"of the EEPROM", &"another");
            };
            same("busy", &busy, &memory.adf.busy())?;
            same("adf", &adf, &memory.adf.address().get())?;
            if let Some(edf) = edf {
                same("edf", &edf, &memory.edf)?;
            }
            same("page", &page, &device.page())
        }
        ProcedureRow::Reset {
            data_id,
            effect,
            request,
            count,
            min_gap_us,
            response_delay_us,
            earliest_start_us,
            wait_after_us,
        } => {
            let mut reset = match self::data_id(data_id) {
                DataId::ResetErrors => Reset::clear_errors(),
                DataId::SetSingleTurnZero => Reset::set_single_turn_zero_and_shift_commutation_angle(),
                _ => Reset::clear_turns_and_lose_multi_turn_reference(),
            };
            same("min_gap_us", &min_gap_us, &(Reset::SPACING_NS / 1000))?;
            same("count", &count, &Reset::REQUESTS)?;
            let mut device = Device::<6>::new(0x17, BitRate::Mbit2_5);
            device.set_position(Abs::truncate(5), Abm::truncate(7));
            device.raise_alarms(Almc::CE);
            device.end_alarms(Almc::CE);
            // A field takes 4 us; the response has six of them and begins when this encoder likes.
            let transaction_ns = u64::from(4 + response_delay_us + 24) * 1000;
            let (mut starts, mut end) = (Vec::new(), 0);
            let ended = servowire_core::run(&mut reset, 0, |asked, not_before_ns| {
                same("request", &request.0[..], asked.emit().as_bytes())?;
                starts.push(not_before_ns / 1000);
                end = not_before_ns + transaction_ns;
                let answer = device.answer(asked, not_before_ns);
                Ok(Ended { outcome: answer.ok_or(Error::NoResponse { echo: false }), ready_ns: end })
            })?;
            same("earliest_start_us", &earliest_start_us, &starts)?;
            // What the encoder has done: to the position, the turns, the errors.
            let does = match (device.abs().get(), device.abm().get(), device.almc().is_empty()) {
                (5, 7, true) => "all errors",
                (0, 7, false) => "single turn data (zero position)",
                (5, 0, true) => "multi turn data and all errors",
                _ => "something else",
            };
            same("effect", &effect.as_str(), &does)?;
            same("end", &"ok".to_owned(), &outcome(&ended.outcome))?;
            same("wait_after_us", &wait_after_us, &((ended.ready_ns - end) / 1000))
        }
    };
    rows.iter().map(&mut check).collect()
}
