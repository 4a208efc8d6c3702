//! Capture files: recordings of a logic analyser, a simulator or a serial port.
//!
//! One file per format under `capture/`. Every reader streams with fixed buffers and yields one of two things: level
//! changes of named channels with their times ([`Line`]), or bytes ([`ByteLog`]).

pub mod analyzer;
mod archive;
mod byte_table;
mod can;
mod columns;
pub mod fst;
pub mod hexlog;
mod hints;
mod input;
pub mod isf;
mod kinds;
mod memory;
pub mod ols;
pub mod pcapng;
pub mod raw;
mod recording;
pub mod records;
pub mod saleae_binary;
pub mod samples;
pub mod sigrok_text;
pub mod table;
mod utf16;
pub mod vcd;

use std::path::Path;

pub use columns::{Column, columns};
pub use hints::{Format, Guard, Hints};
pub use input::{Input, Live, SeekRead};
pub use kinds::{ByteLog, Capture};
pub use memory::Memory;
pub use recording::{Change, Hole, Line};

use crate::fault::{At, Fault};

/// Opens a capture, finding its format from its beginning, otherwise from its name.
pub fn open(input: Input, mut hints: Hints) -> Result<Capture, Fault> {
    let mut input = if hints.format.is_none_or(Format::is_text) { input.unpacked()? } else { input };
    if hints.sample_rate.is_none() && hints.record_size.is_none() {
        input = input.in_utf8()?;
    }
    let rate = sigrok_text::announced(&mut input)?;
    if hints.format.is_none() && known(input.peek()?).is_none() {
        hints.sample_rate = hints.sample_rate.or(rate);
    }
    let format = match hints.format {
        Some(format) => format,
        None if hints.record_size.is_some() => Format::Records,
        None => guess(&mut input, hints.sample_rate.is_some())?,
    };
    if let Some(what) = hints.misplaced(format) {
        return Err(input.fault(At::File, what));
    }
    decoder(input, format, hints)
}

/// Returns the format, if the first bytes identify it beyond doubt.
fn known(head: &[u8]) -> Option<Format> {
    const VCD: [&[u8]; 7] = [b"$comment", b"$date", b"$enddefinitions", b"$scope", b"$timescale", b"$var", b"$version"];
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let begins = |words: &[&[u8]]| {
        words.iter().any(|word| text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word)))
    };
    if head.starts_with(b"<SALEAE>") {
        Some(Format::SaleaeBinary)
    } else if head.starts_with(pcapng::MAGIC) || pcapng::CLASSIC.iter().any(|magic| head.starts_with(magic)) {
        Some(Format::Pcapng)
    } else if head.starts_with(b"PK\x03\x04") {
        Some(Format::Session)
    } else if head.starts_with(FST) || head.first() == Some(&0xfe) && head.get(17..19) == Some(&[0x1f, 0x8b]) {
        Some(Format::Fst)
    } else if VCD.iter().any(|keyword| text.starts_with(keyword)) {
        Some(Format::Vcd)
    } else if text.starts_with(b"libsigrok ") {
        Some(Format::SigrokText)
    } else if begins(&[b";rate:", b";size:", b";channels:"]) {
        Some(Format::Ols)
    } else if byte_table::looks_like(text) {
        Some(Format::ByteTable)
    } else if analyzer::looks_like(text) {
        Some(Format::AnalyzerTable)
    } else if isf::looks_like(text) {
        Some(Format::Isf)
    } else if begins(TABLES) {
        Some(Format::Csv)
    } else {
        None
    }
}

/// The first bytes of an FST file: a header block of 329 bytes.
const FST: &[u8] = &[0, 0, 0, 0, 0, 0, 0, 1, 0x49];

/// The first words of the tables of analysers and oscilloscopes.
const TABLES: &[&[u8]] = &[
    b"time",
    b"zeit",
    b"trigger [s]",
    b"; csv",
    b"#digilent",
    b"x,ch",
    b"x-axis",
    b"record length",
    b"model,",
    b"source,",
    b"ch1(v)",
    b"ch1v",
    b"in s,",
    b"lecroy",
    b"#,time",
    b"nanoseconds",
    b"microseconds",
    b"milliseconds",
];

/// Packed formats that are not supported, by their first bytes.
const PACKED: &[(&[u8], &str)] =
    &[(b"BZh", "bzip2"), (b"\xfd7zXZ\0", "xz"), (b"\x04\x22\x4d\x18", "lz4"), (b"7z\xbc\xaf", "7z")];

fn decoder(mut input: Input, format: Format, hints: Hints) -> Result<Capture, Fault> {
    if input.peek()?.is_empty() {
        return Err(input.fault(At::File, "the file is empty"));
    }
    if hints.grows && matches!(format, Format::Session | Format::Fst | Format::SaleaeBinary) {
        return Err(input.fault(At::File, "this format is complete at its end: it cannot be followed while it grows"));
    }
    Ok(match format {
        Format::Vcd => Capture::Edges(Box::new(vcd::Vcd::new(input)?)),
        Format::Csv => Capture::Edges(Box::new(table::Table::new(input, hints)?)),
        Format::AnalyzerTable => Capture::Edges(Box::new(analyzer::Analyzer::new(input)?)),
        Format::Isf => Capture::Edges(Box::new(isf::Isf::new(input, hints.threshold)?)),
        Format::Session => archive::open(input)?,
        Format::Fst => Capture::Edges(Box::new(fst::Fst::new(input, hints.guard)?)),
        Format::SigrokText => Capture::Edges(Box::new(sigrok_text::SigrokText::new(input)?)),
        Format::Ols => Capture::Edges(Box::new(ols::Ols::new(input)?)),
        Format::SaleaeBinary => Capture::Edges(Box::new(saleae_binary::SaleaeBinary::new(input)?)),
        Format::Raw | Format::Packed => {
            let Some(rate) = hints.sample_rate else {
                return Err(
                    input.fault(At::File, "raw samples carry no rate: give it with --rate, for example --rate 24M")
                );
            };
            let unit = if format == Format::Packed {
                raw::Unit::Bit
            } else {
                raw::Unit::Bytes(hints.unit_size.unwrap_or(1).max(1))
            };
            Capture::Samples(raw::Raw::new(input, rate, unit))
        }
        Format::ByteTable => Capture::Bytes(ByteLog::Table(byte_table::ByteTable::new(input)?)),
        // Hex bytes in a table are still hex bytes.
        Format::Hex if byte_table::looks_like(input.peek()?) => decoder(input, Format::ByteTable, hints)?,
        Format::Hex => Capture::Bytes(ByteLog::Hex(hexlog::HexLog::new(input))),
        Format::Records => {
            let Some(size) = hints.record_size else {
                return Err(input.fault(At::File, "binary records need their size: give it with --record-size"));
            };
            Capture::Bytes(ByteLog::Records(records::Records::new(input, size)))
        }
        Format::Pcapng => Capture::Packets(pcapng::Pcapng::new(input)?),
    })
}

/// Describes the beginning of a file, for people.
fn seen(head: &[u8]) -> String {
    let line = head.split(|byte| *byte == b'\n').next().unwrap_or_default();
    match std::str::from_utf8(line) {
        Ok(text) if !text.chars().any(|c| c.is_control() && !matches!(c, '\t' | '\r')) => {
            format!("begins with {:?}", text.trim_end().chars().take(40).collect::<String>())
        }
        _ => {
            let bytes: Vec<String> = head.iter().take(8).map(|byte| format!("{byte:02X}")).collect();
            format!("begins with the bytes {}", bytes.join(" "))
        }
    }
}

/// Returns the format from the first bytes, otherwise from the hints and the name.
fn guess(input: &mut Input, has_rate: bool) -> Result<Format, Fault> {
    let head = input.peek()?;
    if head.is_empty() {
        return Err(input.fault(At::File, "the file is empty"));
    }
    if let Some(format) = known(head) {
        let what = "the file has times of its own: --rate is for raw samples, --bit-rate for the rate of the line";
        return if has_rate { Err(input.fault(At::File, what)) } else { Ok(format) };
    }
    if has_rate {
        return Ok(Format::Raw);
    }
    if let Some((_, name)) = PACKED.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Err(input.fault(At::File, format!("packed by {name}: unpack it first")));
    }
    if can::looks_like(head) {
        return Err(input.fault(At::File, can::REFUSED));
    }
    if hexlog::looks_like(head) {
        return Ok(Format::Hex);
    }
    let extension =
        Path::new(input.name()).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "vcd" => Ok(Format::Vcd),
        "csv" => Ok(Format::Csv),
        "hex" => Ok(Format::Hex),
        _ => {
            let seen = seen(input.peek()?);
            let what = format!(
                "{seen}: no format that is known. Export it as CSV, VCD or samples; for raw samples give --rate, for a log \
                of hex bytes --bytes, else --format"
            );
            Err(input.fault(At::File, what))
        }
    }
}
