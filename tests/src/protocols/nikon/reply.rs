//! What an encoder sends, good and damaged.

use nikon_aformat::BitOrder::MsbFirst;
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{
    Alm, Body, Crc, Data, Echo, EchoField, EncoderId, EncoderStatus, Error, Expected, Layout, RawResponse, Resolution,
    Response, U19, Version, Window,
};
use serde::Deserialize;

use super::value::{alarm_names, notice_names, shown};
use super::{RowVersion, address, class, command, layout, or_unreadable, resolution, same_name, text, window};
use crate::hex::{Bits, Bytes, Hex};
use crate::row::{Fault, Verdict, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ResponseRow {
    cmd: u8,
    layout: String,
    version: RowVersion,
    request_ea: u32,
    st_bits: u8,
    mt_bits: u8,
    frames: u8,
    bits: u32,
    wire: Bits,
    words: Vec<Hex>,
    packed: Bytes,
    expect: Fields,
}

/// The decoded fields; each key is there if the layout carries the field.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    sync: u16,
    ea: u8,
    cc: Option<u8>,
    fixed: Option<u16>,
    es: Option<u8>,
    es_any: Option<u8>,
    es_flags: Option<Flags>,
    abs: Option<u64>,
    abs_high: Option<u32>,
    alm: Option<u16>,
    alm_reserved: Option<u16>,
    alm_set: Option<Vec<String>>,
    pm_alm: Option<u8>,
    pm_alm_set: Option<Vec<String>>,
    data: Option<u16>,
    bank: Option<u8>,
    addr: Option<u8>,
    bank_error: Option<u8>,
    temp_raw: Option<u32>,
    temp_milli_c: Option<u32>,
    id: Option<u32>,
    velocity: Option<i32>,
    acceleration: Option<i16>,
    velocity_coefficient: Option<u32>,
    crc: u8,
    single_turn: Option<u32>,
    turns_visible_bits: Option<u8>,
    turns: Option<u32>,
    turns_signed: Option<i16>,
    angle_deg_f64: Option<f64>,
    angle_deg_f32_bits: Option<Hex>,
}

#[derive(Deserialize, Debug, PartialEq)]
#[serde(deny_unknown_fields)]
struct Flags {
    busy: u8,
    battery: u8,
    warning: u8,
    error: u8,
}

/// What the row's encoder is expected to send.
fn expected(cmd: u8, name: &str, request_ea: u32) -> Result<Expected, Fault> {
    let command = command(cmd)?;
    let expected = Expected::new(layout(name)?, command);
    let checked = command.answers_with_own_address();
    Ok(if checked { expected.from_address(address(request_ea)?) } else { expected })
}

/// 16-bit words as the rows write them.
pub(super) fn words(hex: &[Hex]) -> Vec<u16> {
    hex.iter().map(|word| word.0 as u16).collect()
}

pub(super) fn response(name: &str, row: ResponseRow) -> Verdict {
    let expected = expected(row.cmd, &row.layout, row.request_ea)?;
    let resolution = resolution(row.st_bits, row.mt_bits, row.version)?;
    same_name(name, command(row.cmd)?)?;
    same("size", &(row.frames, row.bits), &(expected.layout().frames(), expected.layout().line_bits()))?;
    let words = words(&row.words);
    let reply = or_unreadable(RawResponse::from_words(expected.layout(), &words, MsbFirst))?;
    same("wire", &text(window(&row.wire.0)?), &text(reply.line()))?;
    let mut packed = vec![0xff; row.packed.0.len()];
    or_unreadable(reply.line().write(&mut packed, 0, MsbFirst))?;
    same("packed", &row.packed.0, &packed)?;
    let response = match Response::parse_line(&expected, window(&row.wire.0)?) {
        Ok(response) => response,
        Err(error) => return same("outcome", &"good", &class(error)),
    };
    same("from words", &Ok(response), &Response::parse_words(&expected, &words, MsbFirst))?;
    let at_offset = or_unreadable(Window::read(&row.packed.0, 0, row.bits, MsbFirst))?;
    same("from packed bytes", &Ok(response), &Response::parse_line(&expected, at_offset))?;
    same("sent again", &Ok(response), &Response::parse(&expected, &response.emit()))?;
    same("crc", &Crc { got: row.expect.crc, want: row.expect.crc }, &reply.crc())?;
    let first = reply.contents().first().copied().unwrap_or(0);
    same("sync", &row.expect.sync, &(first & 7))?;
    same("fixed", &row.expect.fixed, &response.command().map(|_| first >> 11 & 1))?;
    information(&row.expect, response)?;
    data(&row.expect, response, row.version.0)?;
    position(&row.expect, response, resolution)
}

fn information(want: &Fields, got: Response) -> Verdict {
    same("ea", &want.ea, &got.ea.get())?;
    same("cc", &want.cc, &got.command().map(nikon_aformat::Command::code))?;
    let es = got.es();
    same("es", &want.es, &es.map(|es| es.bits()))?;
    let any = match got.body {
        Body::Abs17 { es_any, .. } => Some(u8::from(es_any)),
        Body::Full { .. } => None,
    };
    same("es_any", &want.es_any, &any)?;
    let flags = es.map(|es| Flags {
        busy: es.contains(EncoderStatus::BUSY).into(),
        battery: es.contains(EncoderStatus::BATT).into(),
        warning: es.contains(EncoderStatus::WARNING).into(),
        error: es.contains(EncoderStatus::ERROR).into(),
    });
    same("es_flags", &want.es_flags, &flags)
}

fn data(want: &Fields, got: Response, version: Version) -> Verdict {
    same("abs", &want.abs, &got.abs())?;
    same("temp_raw", &want.temp_raw, &got.temperature().map(|temperature| temperature.raw().into()))?;
    same("temp_milli_c", &want.temp_milli_c, &got.temperature().map(nikon_aformat::Temperature::milli_celsius))?;
    same("velocity", &want.velocity, &got.velocity())?;
    let alm = got.alm();
    same("alm", &want.alm, &alm.map(|alm| alm.bits()))?;
    same("alm_set", &want.alm_set, &alm.map(|alm| alarm_names(alm, version)))?;
    let reserved = alm.filter(|_| version < Version::V3_0).map(|alm| alm.difference(Alm::known(version)).bits() >> 11);
    same("alm_reserved", &want.alm_reserved, &reserved)?;
    let mut rest = Rest::default();
    match got.data() {
        Some(Data::Abs24High { abs }) => rest.abs_high = Some(abs.get()),
        Some(Data::Status { pm_alm, .. }) => {
            rest.pm_alm = Some(pm_alm.bits());
            rest.pm_alm_set = (version >= Version::V3_0).then(|| notice_names(pm_alm));
        }
        Some(Data::Eeprom { data, address }) => rest.memory = (Some(data), None, Some(address), None),
        Some(Data::EepromBank { data, bank, address, bank_error }) => {
            rest.memory = (Some(data), Some(bank), Some(address), Some(bank_error.into()));
        }
        Some(Data::Id { id }) => rest.id = Some(id.get()),
        Some(Data::Coefficient { coefficient }) => rest.coefficient = Some(coefficient.get()),
        Some(Data::Abs24VelAcc { acceleration, .. }) => rest.acceleration = Some(acceleration),
        _ => {}
    }
    let expected = Rest {
        abs_high: want.abs_high,
        pm_alm: want.pm_alm,
        pm_alm_set: want.pm_alm_set.clone(),
        memory: (want.data, want.bank, want.addr, want.bank_error),
        id: want.id,
        coefficient: want.velocity_coefficient,
        acceleration: want.acceleration,
    };
    same("data", &expected, &rest)
}

/// The fields that one layout alone has.
#[derive(Debug, Default, PartialEq)]
struct Rest {
    abs_high: Option<u32>,
    pm_alm: Option<u8>,
    pm_alm_set: Option<Vec<String>>,
    memory: (Option<u16>, Option<u8>, Option<u8>, Option<u8>),
    id: Option<u32>,
    coefficient: Option<u32>,
    acceleration: Option<i16>,
}

fn position(want: &Fields, got: Response, resolution: Resolution) -> Verdict {
    let position = shown(resolution, got);
    let position = position.as_ref();
    same("single_turn", &want.single_turn, &position.map(|p| p.single_turn))?;
    same("turns_visible_bits", &want.turns_visible_bits, &position.map(|p| p.turns_bits))?;
    same("turns", &want.turns, &position.map(|p| p.turns))?;
    same("turns_signed", &want.turns_signed, &position.and_then(|p| p.signed))?;
    same("angle_deg_f64", &want.angle_deg_f64, &position.map(|p| resolution.degrees(p.single_turn)))?;
    let single = position.map(|p| u64::from(resolution.degrees_f32(p.single_turn).to_bits()));
    same("angle_deg_f32_bits", &want.angle_deg_f32_bits.map(|bits| bits.0), &single)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JudgedRow {
    cmd: u8,
    layout: String,
    version: RowVersion,
    request_ea: u32,
    st_bits: u8,
    mt_bits: u8,
    #[serde(rename = "case")]
    _case: String,
    wire: Bits,
    options: Option<Options>,
    expect: Outcome,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    check_addr: Option<bool>,
    echo: Option<Arguments>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Arguments {
    addr: Option<u8>,
    bank: Option<u8>,
    data: Option<u16>,
    id: Option<u32>,
    coef: Option<u32>,
}

impl Arguments {
    fn echo(&self) -> Result<Echo, Fault> {
        Ok(match (self.addr, self.id, self.coef) {
            (Some(address), None, None) => Echo::Eeprom { address, bank: self.bank, data: self.data },
            (None, Some(id), None) => Echo::Id(or_unreadable(EncoderId::try_from(id))?),
            (None, None, Some(coefficient)) => Echo::Coefficient(or_unreadable(U19::try_from(coefficient))?),
            _ => return Err(Fault::Unreadable("one argument to repeat, of three kinds".to_owned())),
        })
    }
}

/// `ok`, or an error with its numbers.
#[derive(Deserialize, Debug, Default, PartialEq)]
#[serde(deny_unknown_fields)]
struct Outcome {
    ok: Option<bool>,
    error: Option<String>,
    have: Option<u16>,
    need: Option<u16>,
    frame: Option<u8>,
    calculated: Option<u8>,
    received: Option<u8>,
    field: Option<String>,
    got: Option<u32>,
    want: Option<u32>,
}

impl Outcome {
    fn of(result: Result<Response, Error>) -> Self {
        let Err(error) = result else { return Self { ok: Some(true), ..Self::default() } };
        let outcome = Self { error: Some(class(error).to_owned()), ..Self::default() };
        match error {
            Error::Truncated { got, want } => Self { have: Some(got), need: Some(want), ..outcome },
            Error::StartBit { frame } | Error::Delimiter { frame } => Self { frame: Some(frame), ..outcome },
            Error::Crc { got, want } => Self { calculated: Some(want), received: Some(got), ..outcome },
            Error::SyncCode { got } => Self { got: Some(got.into()), ..outcome },
            Error::AddressMismatch { got, want } | Error::CommandMismatch { got, want } => {
                Self { got: Some(got.into()), want: Some(want.into()), ..outcome }
            }
            Error::EchoMismatch { field, got, want } => {
                let field = match field {
                    EchoField::Address => "addr",
                    EchoField::Bank => "bank",
                    EchoField::Data => "data",
                    EchoField::Id => "id",
                    _ => "coef",
                };
                Self { field: Some(field.to_owned()), got: Some(got), want: Some(want), ..outcome }
            }
            _ => outcome,
        }
    }
}

pub(super) fn judged(name: &str, row: JudgedRow) -> Verdict {
    same_name(name, command(row.cmd)?)?;
    resolution(row.st_bits, row.mt_bits, row.version)?;
    let mut expected = expected(row.cmd, &row.layout, row.request_ea)?;
    if let Some(Options { check_addr, echo }) = row.options {
        if check_addr == Some(false) {
            expected = expected.any_address();
        }
        if let Some(arguments) = echo {
            expected = expected.echoing(arguments.echo()?);
        }
    }
    same("outcome", &row.expect, &Outcome::of(Response::parse_line(&expected, window(&row.wire.0)?)))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnchorRow {
    cmd: u8,
    layout: String,
    words: Vec<Hex>,
    expect: Published,
}

/// What the publication shows.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Published {
    ea: u8,
    cc: u8,
    es: u8,
    es_wire_order: Option<u8>,
    abs: Option<u64>,
    single_turn: Option<u32>,
    turns: Option<u32>,
    angle_deg: Option<f64>,
    crc: u8,
    crc_lsb_first_as_printed: Option<u8>,
}

pub(super) fn anchor(_: &str, row: AnchorRow) -> Verdict {
    let expected = Expected::new(layout(&row.layout)?, command(row.cmd)?);
    let words = words(&row.words);
    let response = match Response::parse_words(&expected, &words, MsbFirst) {
        Ok(response) => response,
        Err(error) => return same("outcome", &"good", &class(error)),
    };
    let want = row.expect;
    same("ea", &want.ea, &response.ea.get())?;
    same("cc", &Some(want.cc), &response.command().map(nikon_aformat::Command::code))?;
    let es = response.es().map_or(0, |es: nikon_aformat::EncoderStatus| es.bits());
    same("es", &want.es, &es)?;
    same("es_wire_order", &want.es_wire_order.unwrap_or(es.reverse_bits() >> 4), &(es.reverse_bits() >> 4))?;
    same("abs", &want.abs.or(response.abs()), &response.abs())?;
    let crc = response.emit().crc().want;
    same("crc", &want.crc, &crc)?;
    same("crc as printed", &want.crc_lsb_first_as_printed.unwrap_or(crc.reverse_bits()), &crc.reverse_bits())?;
    let (Some(single_turn), Some(turns)) = (want.single_turn, want.turns) else { return Ok(()) };
    // The row does not say the widths: one of those that exist has to fit.
    let fitting = |st_bits| {
        let resolution = Resolution::new(st_bits, 16).ok()?;
        let position = shown(resolution, response)?;
        let angle = format!("{:.9}", resolution.degrees(position.single_turn));
        Some((position.single_turn, position.turns, want.angle_deg.map(|_| angle)))
    };
    let published = (single_turn, turns, want.angle_deg.map(|angle| format!("{angle:.9}")));
    let fits = [17, 20, 22, 24].into_iter().filter_map(fitting).any(|shown| shown == published);
    same("position fits a width", &true, &fits)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OversampledRow {
    oversampling: u32,
    #[serde(rename = "bit_time_error")]
    _bit_time_error: f64,
    layout: String,
    cmd: u8,
    frames: u8,
    samples: usize,
    samples_packed_msb_first: Bytes,
    expect_wire: Bits,
    expect_words: Vec<Hex>,
}

pub(super) fn oversampled(_: &str, row: OversampledRow) -> Verdict {
    let layout = layout(&row.layout)?;
    same("frames", &row.frames, &layout.frames())?;
    let mut receiver =
        or_unreadable(LineReceiver::oversampled(row.oversampling, layout))?.allowing_idle_between_frames();
    let reply = received(&mut receiver, &row.samples_packed_msb_first, row.samples)?;
    same("wire", &text(window(&row.expect_wire.0)?), &text(reply.line()))?;
    sound(reply, &row.expect_words, layout, row.cmd)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UnalignedRow {
    layout: String,
    cmd: u8,
    frames: u8,
    leading_idle_bits: usize,
    stream_bits: usize,
    stream_packed_msb_first: Bytes,
    expect_words: Vec<Hex>,
}

pub(super) fn unaligned(_: &str, row: UnalignedRow) -> Verdict {
    let layout = layout(&row.layout)?;
    same("frames", &row.frames, &layout.frames())?;
    let start = or_unreadable(Window::read(&row.stream_packed_msb_first.0, row.leading_idle_bits, 1, MsbFirst))?;
    same("a start bit after the idle bits", &0, &start.bits())?;
    let reply = received(
        &mut LineReceiver::bits(layout).allowing_idle_between_frames(),
        &row.stream_packed_msb_first,
        row.stream_bits,
    )?;
    sound(reply, &row.expect_words, layout, row.cmd)
}

/// The only reply in `len` samples.
fn received(receiver: &mut LineReceiver, packed: &Bytes, len: usize) -> Result<RawResponse, Fault> {
    let samples = packed.0.iter().flat_map(|byte| (0..8).rev().map(move |k| byte >> k & 1 == 1)).take(len);
    let replies: Vec<_> = samples.filter_map(|sample| receiver.push(sample)).collect();
    same("left over", &None, &receiver.finish())?;
    match replies[..] {
        [Ok(reply)] => Ok(reply),
        _ => Err(Fault::Differs { what: "replies", expected: "one".to_owned(), real: format!("{replies:?}") }),
    }
}

fn sound(reply: RawResponse, want: &[Hex], layout: Layout, cmd: u8) -> Verdict {
    same("words", &words(want), &reply.words(MsbFirst).collect())?;
    let parsed = Response::parse(&Expected::new(layout, command(cmd)?), &reply);
    same("outcome", &Ok(()), &parsed.map(|_| ()).map_err(class))
}
