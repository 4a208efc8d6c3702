//! Options on captures and on the lines in them, for every command that decodes.

use std::cell::RefCell;
use std::error::Error;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::LazyLock;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use rtex_block::position::Gear;
use servowire_decode::capture::{self, Capture, Format, Hints};
use servowire_decode::codec::Codec;
use servowire_decode::fault::{At, Fault, Stop};
use servowire_decode::output::Output;
use servowire_decode::output::filter::Filter;
use servowire_decode::output::printer::Printer;
use servowire_decode::protocols::CODECS;
use servowire_decode::recognition::Note;
use servowire_decode::settings::{Options, Rtex, Settings, Widths};
use servowire_decode::time;

use crate::units::{bit_rate, frequency};
use crate::{files, interrupt};

/// A protocol by its name, or whatever the capture holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Meant(pub(crate) Option<&'static dyn Codec>);

impl ValueEnum for Meant {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<Meant>> =
            LazyLock::new(|| [None].into_iter().chain(CODECS.iter().copied().map(Some)).map(Meant).collect());
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, about) = self.0.map_or(("auto", "Whatever the capture holds"), |codec| (codec.name, codec.about));
        Some(PossibleValue::new(name).help(about))
    }
}

/// A file format by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Named(Format);

impl ValueEnum for Named {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<[Named; Format::ALL.len()]> =
            LazyLock::new(|| Format::ALL.map(|(format, ..)| Named(format)));
        ALL.as_slice()
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (_, names, about) = Format::ALL.into_iter().find(|(format, ..)| *format == self.0)?;
        let (name, aliases) = names.split_first()?;
        Some(PossibleValue::new(*name).aliases(aliases.iter().copied()).help(about))
    }
}

/// Returns from a call that panics, without printing anything about it.
fn guarded(call: &mut dyn FnMut()) {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| ()));
    let _ = panic::catch_unwind(AssertUnwindSafe(call));
    panic::set_hook(hook);
}

/// What to read, and how.
#[derive(Debug, Args)]
pub(crate) struct Reading {
    /// Protocol on the line; by default every protocol is tried on every channel, and each line found is decoded.
    #[arg(short, long, value_enum, default_value_t = Meant(None))]
    pub(crate) protocol: Meant,
    /// How the file is to be read.
    #[command(flatten)]
    pub(crate) file: FileArgs,
    /// How the line is to be taken.
    #[command(flatten)]
    line: LineArgs,
    /// What the frames of encoders do not tell.
    #[command(flatten)]
    tformat: TformatArgs,
    /// What RTEX blocks do not tell.
    #[command(flatten)]
    pub(crate) rtex: RtexArgs,
}

/// How the file is to be read.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "File")]
pub(crate) struct FileArgs {
    /// File format, if the content does not tell it.
    #[arg(long, value_enum)]
    format: Option<Named>,
    /// Samples per second of a raw file, such as 24000000 or 24M; with it, a file is read as raw samples unless --format says
    /// otherwise.
    #[arg(long, value_name = "HZ", value_parser = frequency)]
    rate: Option<u64>,
    /// Bytes per sample of a raw file; 1 by default.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    unit_size: Option<u8>,
    /// The files are logs of bytes in hex, one burst per line.
    #[arg(long, conflicts_with_all = ["format", "rate"])]
    bytes: bool,
    /// The files are binary records of this many bytes, one burst each.
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u16).range(1..), conflicts_with_all = ["rate", "bytes"])]
    record_size: Option<u16>,
    /// The file is still growing: decode what is appended to it, until the program is stopped.
    #[arg(long)]
    pub(crate) follow: bool,
    /// Whether the packets of a network capture end with their frame check sequence, which most network cards strip; by default
    /// as stated in the file.
    #[arg(long, value_name = "yes|no", value_parser = yes_or_no)]
    fcs: Option<bool>,
    /// Voltage above which a column of an oscilloscope's table is high; by default halfway between its two levels.
    #[arg(long, value_name = "VOLTS", allow_negative_numbers = true)]
    threshold: Option<f64>,
}

/// How the line is to be taken.
#[derive(Debug, Args)]
#[command(next_help_heading = "Line")]
pub(crate) struct LineArgs {
    /// Channel by name or number; by default all channels are examined.
    #[arg(long, value_name = "NAME")]
    channel: Option<String>,
    /// Channel of the requests, if the answers are on another one.
    #[arg(long, value_name = "NAME", requires = "rx", conflicts_with = "channel")]
    tx: Option<String>,
    /// Channel of the answers.
    #[arg(long, value_name = "NAME", requires = "tx", conflicts_with = "channel")]
    rx: Option<String>,
    /// Bits per second, such as 2500000 or 2.5M; by default determined from the capture.
    #[arg(long, value_name = "HZ", value_parser = bit_rate)]
    bit_rate: Option<u32>,
    /// Whether the line idles high (normal) or low; by default whichever decodes better.
    #[arg(long, value_enum)]
    polarity: Option<Polarity>,
}

/// Which way up a line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Polarity {
    /// Idles high.
    Normal,
    /// Idles low: A and B swapped.
    Inverted,
}

/// What the frames of encoders do not tell.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Encoder (T-Format, A-format)")]
pub(crate) struct TformatArgs {
    /// Bits per turn; by default taken from the encoder ID or type word on the line.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(1..=24))]
    single_turn_bits: Option<u8>,
    /// Bits of the turn counter; by default taken from the encoder ID or type word, otherwise 16.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(0..=24))]
    multi_turn_bits: Option<u8>,
}

/// What RTEX blocks do not tell.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "RTEX")]
pub(crate) struct RtexArgs {
    /// Bytes per block, 16 or 32; by default determined from the log. A line or record may hold several blocks.
    #[arg(long, value_name = "BYTES", value_parser = block_size)]
    block_size: Option<u8>,
    /// Update period, such as 500us or 0.5ms: supplies the times of a log that has none, and is used to check the steps of the
    /// position.
    #[arg(long, value_name = "TIME", value_parser = period)]
    pub(crate) period: Option<u32>,
    /// Electronic gear of the drives, such as 8/1: steps of the position are checked against it.
    #[arg(long, value_name = "N/D", value_parser = gear, requires = "period")]
    gear: Option<Gear>,
    /// Only the blocks of this drive.
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(0..=31))]
    mac_id: Option<u8>,
}

/// A period in ns.
fn period(text: &str) -> Result<u32, String> {
    match time::duration(text).map(|time| (time.ps() + 500) / 1000) {
        Some(ns) if (1..=1_000_000_000).contains(&ns) => Ok(ns as u32),
        _ => Err(format!("\"{text}\" is not a period from 1 ns to 1000 ms, such as 500us or 0.5ms")),
    }
}

fn yes_or_no(text: &str) -> Result<bool, &'static str> {
    match text {
        "yes" => Ok(true),
        "no" => Ok(false),
        _ => Err("yes or no"),
    }
}

fn gear(text: &str) -> Result<Gear, String> {
    let read = text.split_once('/').and_then(|(n, d)| Gear::new(n.trim().parse().ok()?, d.trim().parse().ok()?));
    read.ok_or_else(|| format!("\"{text}\" is not a gear of two whole numbers above 0, such as 8/1"))
}

fn block_size(text: &str) -> Result<u8, String> {
    match text {
        "16" => Ok(16),
        "32" => Ok(32),
        _ => Err(format!("\"{text}\" is neither 16 nor 32")),
    }
}

impl Reading {
    /// Returns an option that describes a file.
    pub(crate) fn describes_a_file(&self) -> Option<&'static str> {
        let said = [
            (self.file.format.is_some(), "--format"),
            (self.file.rate.is_some(), "--rate"),
            (self.file.bytes, "--bytes"),
            (self.file.record_size.is_some(), "--record-size"),
            (self.file.threshold.is_some(), "--threshold"),
            (self.file.follow, "--follow"),
            (self.file.fcs.is_some(), "--fcs"),
            (self.line.channel.is_some(), "--channel"),
            (self.line.tx.is_some(), "--tx"),
            (self.file.unit_size.is_some(), "--unit-size"),
            (self.line.bit_rate.is_some(), "--bit-rate"),
            (self.line.polarity.is_some(), "--polarity"),
            (self.rtex.block_size.is_some(), "--block-size"),
            (self.rtex.period.is_some(), "--period"),
            (self.rtex.mac_id.is_some(), "--mac-id"),
        ];
        said.into_iter().find(|(is, _)| *is).map(|(_, option)| option)
    }

    /// Returns what to say of an option that a capture of this kind has no use for.
    pub(crate) fn misplaced(&self, capture: &Capture) -> Option<String> {
        let (levels, bytes, packets) = match capture {
            Capture::Edges(_) | Capture::Samples(_) => (true, false, false),
            Capture::Bytes(_) => (false, true, false),
            Capture::Packets(_) => (false, false, true),
        };
        let rtex = bytes && self.protocol.0.is_none_or(|codec| codec.name == "rtex");
        let (of_levels, of_rtex, of_packets) = (
            (levels, "captures of levels"),
            (rtex, "RTEX blocks in logs of bytes"),
            (packets, "captures of a network"),
        );
        let said = [
            (self.line.channel.is_some(), "--channel", of_levels),
            (self.line.tx.is_some(), "--tx", of_levels),
            (self.line.polarity.is_some(), "--polarity", of_levels),
            (self.file.fcs.is_some(), "--fcs", of_packets),
            (self.rtex.block_size.is_some(), "--block-size", of_rtex),
            (self.rtex.period.is_some(), "--period", of_rtex),
            (self.rtex.mac_id.is_some(), "--mac-id", of_rtex),
        ];
        let misplaced = said.into_iter().find(|(is, _, (holds, _))| *is && !holds);
        misplaced.map(|(_, option, (_, what))| format!("{option} is for {what}"))
    }

    /// Returns the rate of the line, if it was given.
    pub(crate) fn bit_rate(&self) -> Option<u32> {
        self.line.bit_rate
    }

    /// Returns the options on the files.
    pub(crate) fn hints(&self) -> Hints {
        let format = if self.file.bytes { Some(Format::Hex) } else { self.file.format.map(|Named(format)| format) };
        Hints {
            format,
            sample_rate: self.file.rate,
            unit_size: self.file.unit_size.map(usize::from),
            record_size: self.file.record_size.map(usize::from),
            threshold: self.file.threshold,
            grows: self.file.follow,
            guard: Some(guarded),
        }
    }

    /// Returns the options on line and protocol.
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            line: Options {
                channel: self.line.channel.clone(),
                pair: self.line.tx.clone().zip(self.line.rx.clone()),
                bit_rate: self.line.bit_rate,
                inverted: self.line.polarity.map(|polarity| polarity == Polarity::Inverted),
            },
            widths: Widths {
                single_turn_bits: self.tformat.single_turn_bits,
                multi_turn_bits: self.tformat.multi_turn_bits,
            },
            rtex: Rtex {
                block_size: self.rtex.block_size.map(usize::from),
                mac_id: self.rtex.mac_id,
                period_ns: self.rtex.period,
                gear: self.rtex.gear.unwrap_or(Gear::UNITY),
                whole: false,
            },
            fcs: self.file.fcs,
        }
    }
}

/// The result of decoding a file.
#[derive(Debug, Default)]
pub(crate) struct Read {
    /// What was found, in sentences.
    pub(crate) notes: Vec<String>,
    /// Why nothing more could be read.
    pub(crate) fault: Option<String>,
    /// The refused frames in a sentence.
    pub(crate) refusals: Option<String>,
    /// When it was recorded, as the file says.
    pub(crate) date: Option<String>,
}

impl Reading {
    /// Decodes a file into several printers.
    pub(crate) fn decode<'a>(
        &self,
        path: &Path,
        first: &'a mut dyn Printer,
        beside: Vec<&'a mut dyn Printer>,
        filter: Option<&'a mut Filter>,
    ) -> Result<Read, Box<dyn Error>> {
        let input = files::open(path, false)?;
        let name = input.name().to_owned();
        let capture = capture::open(input, self.hints())?;
        if let Some(what) = self.misplaced(&capture) {
            return Err(Fault::new(&name, At::File, what).into());
        }
        let date = capture.date().map(str::to_owned);
        let notes = RefCell::new(Vec::new());
        let note = |note: &Note| notes.borrow_mut().push(note.to_string());
        let mut out = Output::new(&name, first).with_notes(&note).with_enough(&interrupt::asked);
        for printer in beside {
            out = out.with_beside(Some(printer));
        }
        if let Some(filter) = filter {
            out = out.with_filter(filter);
        }
        out.begin()?;
        let fault = match servowire_decode::decode(&name, capture, self.protocol.0, &self.settings(), &mut out) {
            Ok(()) => None,
            Err(Stop::Fault(fault) | Stop::Trouble { fault, .. }) => Some(fault.to_string()),
            Err(Stop::Output(error)) => return Err(error.into()),
        };
        out.end()?;
        let refusals = out.refusals();
        drop(out);
        Ok(Read { notes: notes.into_inner(), fault, refusals, date })
    }
}
