//! Frames, answers, V-frames and sampling.

use hdsl::frame::{Extra, Head};
use hdsl::rssi::{Rssi, edges as edge_byte, longest_gap};
use hdsl::sampling::{Alignment, Delay, EdgeRule, SampleIndex, TEST_PATTERN};
use hdsl::symbol::{Character, Reading, Rule};
use hdsl::{
    Answer, Content, DeltaDelta, EncoderByte, Equalisation, Error, LineDisparity, ParameterByte, SafeBlock, VFrame,
};
use serde::Deserialize;

use super::{Line, Pair, character, disparity, sign};
use crate::hex::{Bytes, Hex};
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum MasterHeader {
    Equalisation { d_in: i8, eq: Line, d_out: i8 },
    Free { param: Hex, d_in: i8, bits: Line, d_out: i8 },
    Sync { param: Hex, edge_eighths: u8, window_bits: u8, eq: Line, para: Line, samples: Bytes },
}

pub(super) fn master_header(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: MasterHeader| match row {
        MasterHeader::Equalisation { d_in, eq, d_out } => {
            let want = Equalisation { bits: eq.bits as u8, disparity: LineDisparity::new(d_out) };
            same("eq and d_out", &want, &LineDisparity::new(d_in).equalisation())
        }
        MasterHeader::Free { param, d_in, bits, d_out } => {
            let byte = ParameterByte::new(param.0 as u8);
            let head = Head::new(byte, None, LineDisparity::new(d_in));
            same("bits", &bits.window(), &head.bits())?;
            same("d_out", &LineDisparity::new(d_out), &LineDisparity::new(d_in).after_head(byte))?;
            same("param", &Ok(byte), &Head::parse(bits.window()).map(|got| got.byte))
        }
        MasterHeader::Sync { param, edge_eighths, window_bits, eq, para, samples } => {
            let byte = ParameterByte::new(param.0 as u8);
            let extra = Extra::new(edge_eighths);
            same("window_bits", &Some(window_bits), &extra.map(Extra::bits))?;
            let head = Head::new(byte, extra, LineDisparity::ZERO.with_ones(window_bits));
            same("eq", &(eq.bits as u8), &head.equalisation())?;
            same("para", &para.word(), &head.para())?;
            same("samples", &samples.0, &head.samples().collect())?;
            let got = Head::parse(head.bits()).map(|got| (got.byte, got.extra_bits));
            same("param", &Ok((byte, u32::from(window_bits))), &got)
        }
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnswerRow {
    bits: Line,
    switch_ok: Option<bool>,
    fields: Option<Vec<Field>>,
    acc: Option<String>,
    dd: Option<i16>,
    rd_in: Option<i8>,
    sent: Option<Sent>,
    rd_out: Option<i8>,
    flip: Option<u32>,
    #[serde(default)]
    truncated: bool,
    error: Option<String>,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Field {
    strict: Option<Pair>,
    byte: Hex,
    byte_error: bool,
    special: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sent {
    vertical: Hex,
    parameter: Hex,
    pipe: Pair,
    acc: Hex,
    acc_k: bool,
    secondary: Pair,
}

fn field(strict: Reading, reduced: Reading) -> Field {
    Field {
        strict: strict.byte().ok().map(|byte| (Hex(byte.into()), strict.is_special())),
        byte: Hex(reduced.raw().into()),
        byte_error: reduced.is_byte_error(),
        special: reduced.is_special(),
    }
}

fn acceleration_class(answer: Answer) -> &'static str {
    match answer.delta_delta() {
        Ok(_) => "ok",
        Err(Error::InvalidWord { .. }) => "byte_error",
        Err(Error::EncoderError) => "encoder_error",
        Err(Error::WrongKind { .. }) => "special_error",
        Err(Error::AccelerationCrc { .. }) => "crc_error",
        Err(_) => "unexpected",
    }
}

pub(super) fn answer(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: AnswerRow| {
        let line = row.bits.window();
        if row.truncated {
            let error = match Answer::parse(Rule::Strict, line) {
                Err(Error::Truncated { .. }) => Some("truncated".to_owned()),
                _ => None,
            };
            return same("error", &row.error, &error);
        }
        let (Ok(strict), Ok(reduced)) = (Answer::parse(Rule::Strict, line), Answer::parse(Rule::Reduced, line)) else {
            return same("accepted", &true, &false);
        };
        same("error", &row.error, &None)?;
        let fields: Vec<_> = strict.words().into_iter().zip(reduced.words()).map(|(s, r)| field(s, r)).collect();
        same("fields", &row.fields, &Some(fields))?;
        same("switch_ok", &row.switch_ok, &Some(strict.switch_ok()))?;
        same("acc", &row.acc.as_deref(), &Some(acceleration_class(reduced)))?;
        same("dd", &row.dd, &reduced.delta_delta().ok().map(DeltaDelta::get))?;
        if let (Some(sent), Some(rd_in)) = (&row.sent, row.rd_in) {
            let dd = if sent.acc_k { None } else { DeltaDelta::from_word(sent.acc.0 as u16).ok() };
            let content = Content {
                vertical: Character::data(sent.vertical.0 as u8),
                parameter: EncoderByte::new(sent.parameter.0 as u8),
                pipe: character(sent.pipe)?,
                acceleration: dd,
                secondary: character(sent.secondary)?,
            };
            let coded = content.emit(disparity(rd_in));
            let bits = coded.bits ^ row.flip.map_or(0, |flip| 1 << flip);
            same("bits", &row.bits.bits, &bits.into())?;
            same("rd_out", &row.rd_out, &Some(sign(coded.disparity)))?;
        }
        Ok(())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnswerStrict {
    bits: Line,
    acc: String,
    dd: Option<i16>,
}

pub(super) fn answer_strict(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: AnswerStrict| {
        let Ok(answer) = Answer::parse(Rule::Strict, row.bits.window()) else { return same("accepted", &true, &false) };
        same("acc", &row.acc.as_str(), &acceleration_class(answer))?;
        same("dd", &row.dd, &answer.delta_delta().ok().map(DeltaDelta::get))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct VFrameStrict {
    frames: Vec<Line>,
    safe1: String,
    summary: Option<Hex>,
    vpos: Option<Hex>,
    crc1: Option<Hex>,
    safe2: String,
    status2: Option<Hex>,
    vpos2: Option<Hex>,
    crc2: Option<Hex>,
    vsync: Vec<Option<bool>>,
}

/// Status, position and CRC of a block; nothing where one of the words is in no table.
fn strict_bytes(block: SafeBlock, words: &[Reading]) -> [Option<Hex>; 3] {
    let [status, position, crc] = safe_bytes(block);
    let good = |range: core::ops::Range<usize>| words.get(range).is_some_and(|w| w.iter().all(|w| !w.is_byte_error()));
    [good(0..1).then_some(status), good(1..6).then_some(position), good(6..8).then_some(crc)]
}

pub(super) fn vframe_strict(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: VFrameStrict| {
        let answers: Vec<_> = row.frames.iter().map(|f| Answer::from_bits(Rule::Strict, f.bits as u64)).collect();
        let Ok(answers) = <[Answer; 8]>::try_from(answers) else { return same("frames", &8, &row.frames.len()) };
        let frame = VFrame::of(Rule::Strict, &answers);
        same("safe1", &row.safe1.as_str(), &safe_class(frame.safe1))?;
        let first = strict_bytes(frame.safe1, &answers.map(Answer::vertical));
        same("summary, vpos, crc1", &[row.summary, row.vpos, row.crc1], &first)?;
        same("safe2", &row.safe2.as_str(), &safe_class(frame.safe2))?;
        let second = strict_bytes(frame.safe2, &answers.map(Answer::secondary));
        same("status2, vpos2, crc2", &[row.status2, row.vpos2, row.crc2], &second)?;
        same("vsync", &row.vsync, &answers.iter().map(|a| a.parameter().ok().map(EncoderByte::vsync)).collect())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct VFrameRow {
    frames: Vec<Line>,
    safe1: String,
    summary: Hex,
    vpos: Hex,
    crc1: Hex,
    safe2: String,
    status2: Hex,
    vpos2: Hex,
    crc2: Hex,
    vsync: Vec<Option<bool>>,
}

fn safe_class(block: SafeBlock) -> &'static str {
    match block.vpos() {
        Ok(_) => "ok",
        Err(Error::InvalidWord { .. }) => "byte_error",
        Err(Error::Crc { .. }) => "crc_error",
        Err(Error::PositionInvalid { .. }) => "position_invalid",
        Err(_) => "unexpected",
    }
}

fn safe_bytes(block: SafeBlock) -> [Hex; 3] {
    [Hex(block.status().into()), Hex(block.raw_vpos()), Hex(block.raw_crc().into())]
}

pub(super) fn vframe(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: VFrameRow| {
        let answers: Vec<_> = row.frames.iter().map(|f| Answer::from_bits(Rule::Reduced, f.bits as u64)).collect();
        let Ok(answers) = <[Answer; 8]>::try_from(answers) else { return same("frames", &8, &row.frames.len()) };
        let frame = VFrame::of(Rule::Reduced, &answers);
        same("safe1", &row.safe1.as_str(), &safe_class(frame.safe1))?;
        same("summary, vpos, crc1", &[row.summary, row.vpos, row.crc1], &safe_bytes(frame.safe1))?;
        same("safe2", &row.safe2.as_str(), &safe_class(frame.safe2))?;
        same("status2, vpos2, crc2", &[row.status2, row.vpos2, row.crc2], &safe_bytes(frame.safe2))?;
        same("vsync", &row.vsync, &answers.iter().map(|a| a.parameter().ok().map(EncoderByte::vsync)).collect())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Learn {
    #[serde(rename = "kind")]
    _kind: String,
    samples: Bytes,
    time_index: Option<u8>,
    delay: Option<u8>,
    error: Option<String>,
    delay_eighths: Option<u32>,
    jitter: Option<u32>,
    flip: Option<u32>,
}

/// A line at eight samples a bit that carries `bits` after `delay` eighths, ones before and after.
fn sampled(bits: u64, delay: u32, bytes: usize) -> Vec<u8> {
    let level = |at: u32| at.checked_sub(delay).filter(|at| at / 8 < 61).is_none_or(|at| bits >> (at / 8) & 1 == 1);
    (0..bytes as u32).map(|byte| (0..8).fold(0, |b, k| b << 1 | u8::from(level(byte * 8 + k)))).collect()
}

pub(super) fn learn(rows: &[Row]) -> Vec<Verdict> {
    learn_by(EdgeRule::All, rows)
}

pub(super) fn learn_leading(rows: &[Row]) -> Vec<Verdict> {
    learn_by(EdgeRule::Leading, rows)
}

fn learn_by(rule: EdgeRule, rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Learn| {
        let samples = row.samples.0;
        if let (Some(delay), None) = (row.delay_eighths, row.jitter) {
            let pattern = TEST_PATTERN ^ row.flip.map_or(0, |flip| 1 << flip);
            same("samples", &samples, &sampled(pattern, delay, samples.len()))?;
        }
        let (index, delay, error) = match Alignment::learn(rule, &samples) {
            Ok(found) => (Some(found.index.get()), Some(found.delay.get()), None),
            Err(Error::PatternNotFound { index }) => (Some(index), None, Some("pattern_not_found")),
            Err(Error::NoEdge) => (None, None, Some("no_edge")),
            Err(_) => (None, None, Some("unexpected")),
        };
        same("error", &row.error.as_deref(), &error)?;
        same("time_index", &row.time_index, &index)?;
        same("delay", &row.delay, &delay)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SampledAnswer {
    delay_eighths: u32,
    jitter: u32,
    glitches: Vec<u32>,
    time_index: u8,
    delay: u8,
    samples: Bytes,
    sent: Line,
    bits: Line,
    bit_errors: u32,
    rssi: u8,
}

pub(super) fn sampled_answer(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SampledAnswer| {
        let samples = row.samples.0;
        if row.jitter == 0 && row.glitches.is_empty() {
            same("samples", &samples, &sampled(row.sent.bits as u64, row.delay_eighths, samples.len()))?;
        }
        let index = SampleIndex::new(row.time_index);
        let (Some(index), Some(delay)) = (index, Delay::new(row.delay)) else {
            return same("time_index, delay", &true, &false);
        };
        let alignment = Alignment { index, delay };
        let Ok(bits) = alignment.bits(&samples) else { return same("complete", &true, &false) };
        same("bits", &row.bits.bits, &bits.into())?;
        same("bit_errors", &row.bit_errors, &(u128::from(bits) ^ row.sent.bits).count_ones())?;
        same("rssi", &Ok(row.rssi), &alignment.rssi(&samples).map(Rssi::get))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RssiRow {
    edges: Hex,
    longest: Option<u8>,
    rssi: u8,
    ti_lut: u8,
}

pub(super) fn rssi(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: RssiRow| {
        let edges = row.edges.0 as u8;
        same("longest", &row.longest, &longest_gap(edges))?;
        same("rssi", &row.rssi, &Rssi::of_edges(edges).get())?;
        // The table of the Motor Control SDK calls many edges perfect.
        let vendors = if matches!(longest_gap(edges), Some(1..=2)) { 12 } else { row.rssi };
        same("ti_lut", &row.ti_lut, &vendors)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Edges {
    prev_last_sample: u8,
    samples: Hex,
    #[serde(rename = "edges")]
    edge_byte: Hex,
    rssi: u8,
}

pub(super) fn edges(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Edges| {
        let edges = edge_byte(row.prev_last_sample == 1, row.samples.0 as u8);
        same("edges", &row.edge_byte, &Hex(edges.into()))?;
        same("rssi", &row.rssi, &Rssi::of_edges(edges).get())
    })
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum SampleEdge {
    Falling(Edge),
    Rising(Edge),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Edge {
    samples: Hex,
    ones: u32,
    #[serde(rename = "E")]
    e: u8,
    time_index: u8,
    lsb_index: u8,
}

pub(super) fn sample_edge(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SampleEdge| {
        let (edge, index, e) = match row {
            SampleEdge::Falling(edge) => {
                let index = SampleIndex::after_falling_edge(edge.samples.0 as u8);
                (edge, index, index.get())
            }
            SampleEdge::Rising(edge) => {
                let index = SampleIndex::after_rising_edge(edge.samples.0 as u8);
                (edge, index, 7 - index.get())
            }
        };
        same("ones", &edge.ones, &(edge.samples.0 as u8).count_ones())?;
        same("E", &edge.e, &e)?;
        same("time_index, lsb_index", &(edge.time_index, edge.lsb_index), &(index.get(), 7 - index.get()))
    })
}
