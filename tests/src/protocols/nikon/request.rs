//! What a master sends, and what an encoder makes of it.

use nikon_aformat::BitOrder::MsbFirst;
use nikon_aformat::{
    Command, EncoderAddress, EncoderId, Error, FRAME_GAP_NS, FrameCode, Operation, Request, RequestFrame, Resolution,
    U19, UserAddress, Version,
};
use serde::Deserialize;

use super::{RowVersion, address, class, command, frame_text, or_unreadable, same_name, text, window};
use crate::hex::{Bits, Bytes, Hex};
use crate::row::{Fault, Verdict, same};

fn frame_code(fc: u8) -> Result<FrameCode, Fault> {
    let found = FrameCode::from_code(fc);
    found.ok_or_else(|| Fault::Unreadable(format!("no frame code {fc}")))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CdfRow {
    cmd: u8,
    ea: u32,
    fc: u8,
    min_version: RowVersion,
    wire: Bits,
    word16: Hex,
    packed: Bytes,
    ti_word32: Hex,
}

pub(super) fn cdf(name: &str, row: CdfRow) -> Verdict {
    let (command, code) = (command(row.cmd)?, frame_code(row.fc)?);
    let frame = RequestFrame::cdf(code, address(row.ea)?, row.cmd);
    forms(frame, &row.wire, row.word16, row.ti_word32)?;
    // The last byte is filled with idle line.
    let mut packed = vec![0xff; row.packed.0.len()];
    or_unreadable(frame.line().write(&mut packed, 0, MsbFirst))?;
    same("packed", &row.packed.0, &packed)?;
    same("frames that follow", &true, &Request::expected_frames(frame).is_ok())?;
    let operation = match (code, row.cmd) {
        (FrameCode::Fc3, 13) => Operation::EepromReadBank { bank: 0, address: 0 },
        (FrameCode::Fc3, 14) => Operation::EepromWriteBank { bank: 0, address: 0, data: 0 },
        (FrameCode::Fc3, 16) => Operation::CoefficientRead,
        (FrameCode::Fc3, _) => Operation::CoefficientWrite { coefficient: U19::default() },
        _ => return plain(name, command, row.min_version),
    };
    let names = ["EEPROM_READ_BANK", "EEPROM_WRITE_BANK", "VELCOEF_READ", "VELCOEF_WRITE"];
    same("name is one of version 3.0", &true, &names.contains(&name))?;
    same("min_version", &(row.min_version.0 > Version::V2_1), &operation.needs_version_3())
}

fn plain(name: &str, command: Command, version: RowVersion) -> Verdict {
    same_name(name, command)?;
    same("min_version", &version.0, &command.min_version())
}

/// One frame in every form.
fn forms(frame: RequestFrame, wire: &Bits, word16: Hex, word32: Hex) -> Verdict {
    let line = window(&wire.0)?;
    same("wire", &text(line), &text(frame.line()))?;
    same("word16", &word16.0, &u64::from(frame.word(MsbFirst)))?;
    same("ti_word32", &word32.0, &u64::from(frame.transmit_word()))?;
    same("received", &Ok(frame), &RequestFrame::from_line(line))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MdfRow {
    frame: String,
    fc: u8,
    byte: u8,
    wire: Bits,
    word16: Hex,
    ti_word32: Hex,
}

pub(super) fn mdf(_: &str, row: MdfRow) -> Verdict {
    let code = frame_code(row.fc)?;
    let index = FrameCode::MDF.into_iter().position(|mdf| mdf == code);
    same("frame", &row.frame, &format!("MDF{}", index.unwrap_or(9)))?;
    forms(RequestFrame::mdf(code, row.byte), &row.wire, row.word16, row.ti_word32)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JudgedRow {
    #[serde(rename = "case")]
    _case: String,
    wire: Bits,
    expect: JudgedFrame,
}

#[derive(Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum JudgedFrame {
    Error { error: String },
    Good { fc: u8, ea: u8, cc: u8, byte: u8 },
}

pub(super) fn judged(_: &str, row: JudgedRow) -> Verdict {
    match (row.expect, RequestFrame::from_line(window(&row.wire.0)?)) {
        (JudgedFrame::Error { error }, got) => same("error", &Err(error.as_str()), &got.map_err(class)),
        (JudgedFrame::Good { fc, ea, cc, byte }, got) => {
            let fields = got.map(|frame| (frame.frame_code().code(), frame.ea().get(), frame.code(), frame.byte()));
            same("fields", &Ok((fc, ea, cc, byte)), &fields)
        }
    }
}

#[derive(Deserialize)]
#[serde(tag = "call", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum RangeRow {
    Cdf { cmd: u8, ea: u32, version: RowVersion, expect_error: Option<String> },
    EepromRead { addr: u32, bank: Option<u32>, expect_error: Option<String> },
    EepromWrite { addr: u32, bank: Option<u32>, data: u32, expect_error: Option<String> },
    IdWrite { ident: u32, expect_error: Option<String> },
    VelocityCoefficientWrite { coef: u32, expect_error: Option<String> },
}

/// Arguments are types that hold nothing else, so the range is checked where a number becomes one of them, and what is
/// refused there names the argument.
pub(super) fn range(_: &str, row: RangeRow) -> Verdict {
    let (want, got) = match row {
        RangeRow::Cdf { cmd, ea, version, expect_error } => (expect_error, command_in_range(cmd, ea, version.0)),
        RangeRow::EepromRead { addr, bank, expect_error } => {
            let bank = fits::<u8, u32>(bank.unwrap_or(0), "bank_range");
            (expect_error, fits::<u8, u32>(addr, "address_range").and(bank))
        }
        RangeRow::EepromWrite { addr, bank, data, expect_error } => {
            let byte = fits::<u8, u32>(addr, "address_range");
            let address = match (bank, u8::try_from(addr)) {
                (Some(bank), _) => byte.and(fits::<u8, u32>(bank, "bank_range")),
                (None, Ok(addr)) => fits::<UserAddress, u8>(addr, "address_range"),
                (None, Err(_)) => byte,
            };
            (expect_error, address.and(fits::<u16, u32>(data, "data_range")))
        }
        RangeRow::IdWrite { ident, expect_error } => (expect_error, fits::<EncoderId, u32>(ident, "data_range")),
        RangeRow::VelocityCoefficientWrite { coef, expect_error } => {
            (expect_error, fits::<U19, u32>(coef, "data_range"))
        }
    };
    same("expect_error", &want.as_deref(), &got.err())
}

/// Whether `value` becomes a `T`.
fn fits<T: TryFrom<V>, V>(value: V, class: &'static str) -> Result<(), &'static str> {
    T::try_from(value).map(|_| ()).map_err(|_| class)
}

fn command_in_range(code: u8, ea: u32, version: Version) -> Result<(), &'static str> {
    let command = Command::from_code(code).ok_or("unknown_command")?;
    let ea = u8::try_from(ea).ok().and_then(EncoderAddress::new).ok_or("address_range")?;
    let operation = Operation::without_arguments(command).unwrap_or(Operation::EepromRead { address: 0 });
    Request::new(ea, operation).check(Resolution::default().with_version(version)).map(|_| ()).map_err(class)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TransactionRow {
    cmd: u8,
    ea: u32,
    args: Arguments,
    frames: Vec<FrameRow>,
    gap_between_frames_min_ns: Option<u32>,
    repeat: u8,
    multi_response: bool,
    response_layout: String,
    response_frames: u8,
    response_bits: u32,
    profile: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Arguments {
    addr: Option<u8>,
    bank: Option<u8>,
    data: Option<u16>,
    ident: Option<u32>,
    coef: Option<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRow {
    frame: String,
    wire: Bits,
    word16: Hex,
}

pub(super) fn transaction(name: &str, row: TransactionRow) -> Verdict {
    let (command, ea) = (command(row.cmd)?, address(row.ea)?);
    let request = Request::new(ea, operation(name, row.cmd, &row.args)?);
    same("command", &command, &request.command())?;
    let emitted = request.emit();
    let want: Vec<_> = row.frames.iter().map(|f| (window(&f.wire.0).map(text), f.word16.0 as u16)).collect();
    let got: Vec<_> = emitted.as_slice().iter().map(|frame| frame_text(*frame)).map(|(t, w)| (Ok(t), w)).collect();
    same("frames", &want, &got)?;
    let names: Vec<_> = (0..).zip(emitted.as_slice()).map(|(k, frame)| frame_name(k, *frame)).collect();
    same("frame names", &row.frames.iter().map(|f| f.frame.clone()).collect::<Vec<_>>(), &names)?;
    same("received", &Ok(request), &Request::parse(emitted.as_slice()))?;
    same("gap", &row.gap_between_frames_min_ns, &(names.len() > 1).then_some(FRAME_GAP_NS))?;
    same("repeat", &row.repeat, &command.repeats())?;
    same("multi_response", &row.multi_response, &command.is_multi_response())?;
    let resolution = match row.profile.as_str() {
        "standard" => Resolution::default(),
        "factory_option" => Resolution::default().with_velocity_in_low().with_position_in_resets(),
        other => return Err(Fault::Unreadable(format!("no profile {other:?}"))),
    };
    let layout = request.layout(resolution);
    same("response_layout", &row.response_layout.as_str(), &layout.name())?;
    same("response size", &(row.response_frames, row.response_bits), &(layout.frames(), layout.line_bits()))
}

/// CDF first; then the frame code tells which memory frame it is.
fn frame_name(index: usize, frame: RequestFrame) -> String {
    let memory = FrameCode::MDF.into_iter().position(|code| code == frame.frame_code());
    if index == 0 { "CDF".to_owned() } else { format!("MDF{}", memory.unwrap_or(9)) }
}

fn operation(name: &str, code: u8, args: &Arguments) -> Result<Operation, Fault> {
    let id = || or_unreadable(EncoderId::try_from(args.ident.unwrap_or(u32::MAX)));
    let user = |address: u8| or_unreadable(UserAddress::try_from(address));
    Ok(match (code, args.addr, args.bank, args.data) {
        (13, Some(address), None, None) => Operation::EepromRead { address },
        (13, Some(address), Some(bank), None) => Operation::EepromReadBank { bank, address },
        (14, Some(address), None, Some(data)) => Operation::EepromWrite { address: user(address)?, data },
        (14, Some(address), Some(bank), Some(data)) => Operation::EepromWriteBank { bank, address, data },
        (16, ..) if name == "VELCOEF_READ" => Operation::CoefficientRead,
        (18, ..) if args.coef.is_some() => {
            let coefficient = or_unreadable(U19::try_from(args.coef.unwrap_or(u32::MAX)))?;
            Operation::CoefficientWrite { coefficient }
        }
        (18, ..) => Operation::IdWrite1 { id: id()? },
        (19, ..) => Operation::IdWrite2 { id: id()? },
        (20, ..) => Operation::SetAddress2 { id: id()? },
        _ => or_unreadable(Operation::without_arguments(command(code)?).ok_or(Error::NotCarried))?,
    })
}
