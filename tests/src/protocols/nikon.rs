//! Nikon A-format: `tests/vectors/nikon`.

mod bus;
mod peer;
mod reply;
mod request;
mod session;
mod value;

use nikon_aformat::{Command, EncoderAddress, Error, Layout, RequestFrame, Resolution, Version};
use serde::{Deserialize, Deserializer, de};

use nikon_aformat::BitOrder::MsbFirst;

use crate::row::{Check, Fault, Row, Verdict, same};

pub(crate) const TOPICS: &[(&str, Check)] = &[
    ("alarm", |rows| each(rows, value::alarm)),
    ("anchors", |rows| each(rows, reply::anchor)),
    ("crc", |rows| each(rows, value::crc)),
    ("decode_math", |rows| each(rows, value::decode_math)),
    ("eeprom_type_word", |rows| each(rows, value::type_word)),
    ("peer_driver_v9_2", |rows| each(rows, peer::driver)),
    ("rx_bitflips", |rows| each(rows, reply::judged)),
    ("rx_bus", |rows| each(rows, bus::line)),
    ("rx_negative", |rows| each(rows, reply::judged)),
    ("rx_oversampled", |rows| each(rows, reply::oversampled)),
    ("rx_responses", |rows| each(rows, reply::response)),
    ("rx_unaligned", |rows| each(rows, reply::unaligned)),
    ("sessions", |rows| each(rows, session::procedure)),
    ("temperature", |rows| each(rows, value::temperature)),
    ("timing", |rows| each(rows, value::timing)),
    ("tx_cdf", |rows| each(rows, request::cdf)),
    ("tx_mdf", |rows| each(rows, request::mdf)),
    ("tx_negative", |rows| each(rows, request::judged)),
    ("tx_ranges", |rows| each(rows, request::range)),
    ("tx_transactions", |rows| each(rows, request::transaction)),
];

/// Checks rows that do not depend on each other. `n` is the number of a row in the file that it comes from and states
/// nothing; `name`, where a row has one, names its command.
fn each<T: de::DeserializeOwned>(rows: &[Row], check: impl Fn(&str, T) -> Verdict) -> Vec<Verdict> {
    let verdict = |row: &Row| {
        let mut row = row.clone();
        row.keys.remove("n");
        check(&row.name, row.read()?)
    };
    rows.iter().map(verdict).collect()
}

/// The name of a row against the name of its command.
fn same_name(name: &str, command: Command) -> Verdict {
    if name.is_empty() { Ok(()) } else { same("name", &name, &command.name()) }
}

/// The rows' name of an error.
fn class(error: Error) -> &'static str {
    error.class().name()
}

/// A number that a row may not have: the row is at fault, not the crate.
fn or_unreadable<T, E: std::fmt::Display>(result: Result<T, E>) -> Result<T, Fault> {
    result.map_err(|error| Fault::Unreadable(error.to_string()))
}

fn command(code: u8) -> Result<Command, Fault> {
    Command::from_code(code).ok_or_else(|| Fault::Unreadable(format!("no command {code}")))
}

fn address(ea: u32) -> Result<EncoderAddress, Fault> {
    let ea = or_unreadable(u8::try_from(ea))?;
    or_unreadable(EncoderAddress::try_from(ea))
}

fn layout(name: &str) -> Result<Layout, Fault> {
    let found = Layout::ALL.into_iter().find(|layout| layout.name() == name);
    found.ok_or_else(|| Fault::Unreadable(format!("no layout {name:?}")))
}

fn resolution(st_bits: u8, mt_bits: u8, version: RowVersion) -> Result<Resolution, Fault> {
    Ok(or_unreadable(Resolution::new(st_bits, mt_bits))?.with_version(version.0))
}

/// A version as the rows write it.
#[derive(Debug, Clone, Copy)]
struct RowVersion(Version);

impl<'de> Deserialize<'de> for RowVersion {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match String::deserialize(from)?.as_str() {
            "2.1" => Ok(Self(Version::V2_1)),
            "3.0" => Ok(Self(Version::V3_0)),
            other => Err(de::Error::custom(format!("no version {other:?}"))),
        }
    }
}

/// Line bits in text.
fn text(line: nrz_line::Window) -> String {
    (0..line.len()).map(|at| if line.get(at) == Some(true) { '1' } else { '0' }).collect()
}

/// Line bits of a frame in text, and its word.
fn frame_text(frame: RequestFrame) -> (String, u16) {
    (text(frame.line()), frame.word(MsbFirst))
}

/// Bits as a window, for those that fit one.
fn window(bits: &[bool]) -> Result<nrz_line::Window, Fault> {
    let value = bits.iter().rev().fold(0_u128, |value, bit| value << 1 | u128::from(*bit));
    let len = u32::try_from(bits.len()).unwrap_or(u32::MAX);
    nrz_line::Window::from_bits(value, len).ok_or_else(|| Fault::Unreadable(format!("{len} bits are no reply")))
}
