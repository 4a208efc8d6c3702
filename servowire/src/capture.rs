//! Capture files: what a logic analyser, a simulator or a serial port recorded.
//!
//! One file per format under `capture/`. Every reader streams with fixed buffers and gives the same thing: level
//! changes of named channels with the time in picoseconds ([`Line`]), or bytes ([`ByteLog`]).

pub mod analyzer;
pub mod archive;
mod can;
pub mod fst;
pub mod hexlog;
mod input;
pub mod isf;
pub mod ols;
pub mod pcapng;
mod pipe;
pub mod raw;
pub mod records;
pub mod saleae_binary;
pub mod samples;
pub mod sigrok_text;
pub mod table;
pub mod time;
mod utf16;
pub mod vcd;

use std::cell::Cell;
use std::path::Path;
use std::rc::Rc;

pub use input::{Input, Piped};

use crate::fault::{At, Fault};

/// A channel takes a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// When, in picoseconds of the capture's own time (negative before its trigger).
    pub time: i64,
    /// Index into [`Line::channels`].
    pub channel: u16,
    /// The level from here on.
    pub level: bool,
}

/// A part of a recording in which nothing is known of the lines; times in picoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// Where the recording stops.
    pub from: i64,
    /// Where it goes on.
    pub to: i64,
}

/// A recording of lines.
pub trait Line {
    /// The channels by name. A change refers to them by index.
    fn channels(&self) -> &[String];

    /// Appends the next changes, in the order of time, and says whether there may be more.
    ///
    /// The first change of a channel is its level at the beginning. With a fault, the changes before it were
    /// appended; no more will come.
    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault>;

    /// The next samples instead of the next changes, of a recording that is one channel of packed samples; nothing of
    /// another one, or as long as its first level has not been read.
    fn samples(&mut self) -> Option<Result<samples::Samples<'_>, Fault>> {
        None
    }

    /// The time up to which the recording was read, in picoseconds.
    fn reached(&self) -> i64;

    /// The hole in the recording before what was read last, if there is one.
    fn hole(&mut self) -> Option<Hole> {
        None
    }

    /// The file that is read, if it is read as it comes.
    fn input(&self) -> Option<&Input> {
        None
    }
}

/// An opened file.
pub enum Capture {
    /// Changes with their times: VCD, Saleae.
    Edges(Box<dyn Line>),
    /// Samples at a fixed rate.
    Samples(raw::Raw),
    /// Bytes without time.
    Bytes(ByteLog),
    /// Packets of a network.
    Packets(pcapng::Pcapng),
}

/// Bytes without time, in bursts.
pub enum ByteLog {
    /// Hex digits, a burst a line.
    Hex(hexlog::HexLog),
    /// Records of one size.
    Records(records::Records),
}

impl ByteLog {
    /// The next burst; none at the end.
    pub fn burst(&mut self) -> Result<Option<hexlog::Burst>, Fault> {
        match self {
            Self::Hex(log) => log.burst(),
            Self::Records(log) => log.burst(),
        }
    }

    /// Whether the next burst has to be waited for.
    pub fn pauses(&self) -> bool {
        match self {
            Self::Hex(log) => log.input().pauses(),
            Self::Records(log) => log.input().pauses(),
        }
    }
}

/// File formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Value change dump (IEEE 1364).
    Vcd,
    /// A table of a logic analyser or an oscilloscope.
    #[value(alias = "saleae-csv")]
    Csv,
    /// A table of bytes of an analyser of Saleae Logic 2.
    AnalyzerTable,
    /// A waveform of a Tektronix oscilloscope (.isf).
    Isf,
    /// Saleae Logic 2 binary export.
    SaleaeBinary,
    /// A session of sigrok, PulseView (.sr) or DSView (.dsl).
    Session,
    /// FST, as GTKWave and Verilator write it.
    Fst,
    /// Text of sigrok-cli -O bits or -O hex.
    SigrokText,
    /// A file of the OLS client, or of sigrok-cli -O ols.
    Ols,
    /// One sample in one or more whole bytes, a bit a channel (sigrok-cli -O binary).
    Raw,
    /// One channel, eight samples a byte, the oldest in bit 0.
    Packed,
    /// Bytes as hex digits, a burst a line.
    Hex,
    /// Binary records of one size (--record-size), a burst each.
    Records,
    /// Packets of a network capture, pcap or pcapng.
    #[value(alias = "pcap")]
    Pcapng,
}

/// What the user said about the files.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Hints {
    /// The format; otherwise it is found from the content and the name.
    pub format: Option<Format>,
    /// Samples a second of a raw file.
    pub sample_rate: Option<u64>,
    /// Bytes a sample of a raw file.
    pub unit_size: usize,
    /// Bytes of a record.
    pub record_size: Option<usize>,
    /// The voltage above which a column of a table is high; otherwise half-way between its levels.
    pub threshold: Option<f64>,
    /// The file still grows: its end is waited for.
    pub grows: bool,
}

/// Opens a file, finding its format. The number beside it counts the bytes read, for a progress bar.
pub fn open(path: &Path, hints: Hints) -> Result<(Capture, Rc<Cell<u64>>), Fault> {
    let input = Input::open(path, hints.grows)?;
    let meter = input.meter();
    Ok((open_input(input, path, hints)?, meter))
}

/// Opens what comes from `input`; `path` is only looked at for its ending.
pub fn open_input(input: Input, path: &Path, hints: Hints) -> Result<Capture, Fault> {
    let mut input = if hints.format.is_none_or(Format::is_text) { input.unpacked()? } else { input };
    if hints.sample_rate.is_none() && hints.record_size.is_none() {
        input = input.in_utf8()?;
    }
    let format = match hints.format {
        Some(format) => format,
        None if hints.record_size.is_some() => Format::Records,
        None => guess(&mut input, path, hints.sample_rate.is_some())?,
    };
    decoder(input, format, hints)
}

/// The format that the first bytes show beyond doubt.
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

/// What an FST file begins with: a header block of 329 bytes.
const FST: &[u8] = &[0, 0, 0, 0, 0, 0, 0, 1, 0x49];

/// What the tables of analysers and oscilloscopes begin with.
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

impl Format {
    /// Text may be packed; of the others the first bytes are the format's own.
    fn is_text(self) -> bool {
        matches!(
            self,
            Self::Vcd | Self::Csv | Self::AnalyzerTable | Self::Isf | Self::SigrokText | Self::Ols | Self::Hex
        )
    }
}

/// Packed files that are not unpacked, by their first bytes.
const PACKED: &[(&[u8], &str)] =
    &[(b"BZh", "bzip2"), (b"\xfd7zXZ\0", "xz"), (b"\x04\x22\x4d\x18", "lz4"), (b"7z\xbc\xaf", "7z")];

/// Opens bytes that are part of the program.
pub fn open_embedded(name: &str, bytes: &'static [u8]) -> Result<Capture, Fault> {
    decoder(Input::embedded(name, bytes), Format::Vcd, Hints::default())
}

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
        Format::Fst => Capture::Edges(Box::new(fst::Fst::new(input)?)),
        Format::SigrokText => Capture::Edges(Box::new(sigrok_text::SigrokText::new(input)?)),
        Format::Ols => Capture::Edges(Box::new(ols::Ols::new(input)?)),
        Format::SaleaeBinary => Capture::Edges(Box::new(saleae_binary::SaleaeBinary::new(input)?)),
        Format::Raw | Format::Packed => {
            let Some(rate) = hints.sample_rate else {
                return Err(
                    input.fault(At::File, "raw samples carry no rate: say it with --rate, for example --rate 24M")
                );
            };
            let unit = if format == Format::Packed { raw::Unit::Bit } else { raw::Unit::Bytes(hints.unit_size.max(1)) };
            Capture::Samples(raw::Raw::new(input, rate, unit))
        }
        Format::Hex => Capture::Bytes(ByteLog::Hex(hexlog::HexLog::new(input))),
        Format::Records => {
            let Some(size) = hints.record_size else {
                return Err(input.fault(At::File, "binary records need their size: say it with --record-size"));
            };
            Capture::Bytes(ByteLog::Records(records::Records::new(input, size)))
        }
        Format::Pcapng => Capture::Packets(pcapng::Pcapng::new(input)?),
    })
}

/// What a file begins with, for people.
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

/// The format from the first bytes, else from what was said and from the name.
fn guess(input: &mut Input, path: &Path, has_rate: bool) -> Result<Format, Fault> {
    let head = input.peek()?;
    if head.is_empty() {
        return Err(input.fault(At::File, "the file is empty"));
    }
    if let Some(format) = known(head) {
        let what =
            "the file says its times itself: --rate is for raw samples; for the rate of the line there is --bit-rate";
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
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
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
