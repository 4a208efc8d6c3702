//! The command line.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use rtex_block::position::Gear;

use crate::capture::{Format, Hints, time};
use crate::output::filter::Filter;
use crate::output::say;
use crate::protocols::{Protocol, Settings, Widths, rtex};
use crate::{cnc, decode, line, profile, registers, talk, timing};

/// Decodes what servo drives, controllers and encoders say to each other.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Decode captures of a line.
    Decode(Decode),
    /// Times of the steps of a move on a 4 us cycle.
    Profile(profile::Arguments),
    /// The reference machine: SORTE master, four devices, four motors.
    Cnc(cnc::Arguments),
    /// Talk to a T-Format encoder at a USB-RS485 adapter, or be one.
    Talk(talk::Arguments),
    /// Who is on an encoder's line when: shortest cycle, worst fault.
    Timing(timing::Arguments),
    /// The register map of a HIPERFACE DSL receiver in words.
    Registers(registers::Arguments),
    /// Completions for a shell: put them where it looks for them.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// The manual page of the program, or of a command: `servowire man decode | man -l -`.
    Man {
        /// The command.
        command: Option<String>,
    },
}

impl Cli {
    /// Does what was asked. 0: all frames good; 1: a frame was refused, or a file could not be decoded.
    pub fn run(self) -> ExitCode {
        match self.command {
            Command::Decode(arguments) => decode::run(&arguments),
            Command::Profile(arguments) => arguments.run(),
            Command::Cnc(arguments) => arguments.run(),
            Command::Talk(arguments) => arguments.run(),
            Command::Timing(arguments) => arguments.run(),
            Command::Registers(arguments) => arguments.run(),
            Command::Completions { shell } => {
                let mut text = Vec::new();
                clap_complete::generate(shell, &mut Self::command(), "servowire", &mut text);
                print(&text)
            }
            Command::Man { command } => man(command.as_deref()),
        }
    }
}

fn print(text: &[u8]) -> ExitCode {
    match say(format_args!("{}", String::from_utf8_lossy(text))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: cannot write: {e}");
            ExitCode::FAILURE
        }
    }
}

fn man(command: Option<&str>) -> ExitCode {
    let mut whole = Cli::command();
    whole.build();
    let page = match command {
        None => Some(whole),
        Some(name) => whole.find_subcommand(name).cloned(),
    };
    let Some(page) = page else {
        eprintln!("error: there is no command {:?}", command.unwrap_or_default());
        return ExitCode::from(2);
    };
    let mut text = Vec::new();
    match clap_mangen::Man::new(page).render(&mut text) {
        Ok(()) => print(&text),
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// Decode captures of a line.
///
/// Prints a transaction a line: `<>` a request with its answer, `>` a request, `<` an answer alone. Format, channel,
/// polarity and bit rate are found from the capture; what was found is said on the error output. Exit code 0: all
/// frames good; 1: a frame was refused or a file could not be decoded; 2: wrong use.
#[derive(Debug, Args)]
pub struct Decode {
    /// VCD, FST, sigrok and DSView sessions, Saleae exports, CSV of analysers and oscilloscopes, pcapng, also packed by
    /// gzip or zstd; raw samples with --rate; hex bytes with --bytes; - for the standard input. Without a file, what
    /// comes through a pipe, else the captures that come with the program.
    pub files: Vec<PathBuf>,
    /// What is spoken on the line; otherwise every protocol is tried on every channel, and each line found is decoded.
    #[arg(short, long, value_enum, default_value_t = Protocol::Auto)]
    pub protocol: Protocol,
    /// JSON Lines, an object a frame; times in picoseconds.
    #[arg(long)]
    pub json: bool,
    /// A table for spreadsheets, a row a frame, a column a field; times in microseconds.
    #[arg(long, conflicts_with_all = ["json", "stats"])]
    pub csv: bool,
    /// Figures instead of frames: errors by class, cycle time, answer delay, largest move of the position.
    #[arg(long)]
    pub stats: bool,
    /// With --stats, list moves of the position by more than this from one frame to the next.
    #[arg(long, value_name = "COUNTS", requires = "stats")]
    pub jump: Option<u64>,
    /// Write the capture as VCD, with the decoded fields beside it as strings.
    #[arg(long, value_name = "OUT")]
    pub vcd: Option<PathBuf>,
    /// Draw position and errors over time, and how long answers took.
    #[arg(long, value_name = "OUT")]
    pub svg: Option<PathBuf>,
    /// Which frames are shown.
    #[command(flatten)]
    pub filter: FilterArgs,
    /// How the file is to be read.
    #[command(flatten)]
    pub file: FileArgs,
    /// How the line is to be taken.
    #[command(flatten)]
    pub line: LineArgs,
    /// What the frames of encoders do not tell.
    #[command(flatten)]
    pub tformat: TformatArgs,
    /// What RTEX blocks do not tell.
    #[command(flatten)]
    pub rtex: RtexArgs,
}

/// Which frames are shown and counted.
#[derive(Debug, Args)]
#[command(next_help_heading = "Filter")]
pub struct FilterArgs {
    /// Only frames of these kinds, as 3 or D (T-Format), ABS40, H-frame.
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub id: Vec<String>,
    /// Only the encoder (EA), drive (MAC-ID) or device (SA) of this address.
    #[arg(long, value_name = "N")]
    pub address: Option<u16>,
    /// Only frames from this time of the capture on, as 20us, 1.5ms or 2s.
    #[arg(long, value_name = "TIME", value_parser = moment, allow_hyphen_values = true)]
    pub from: Option<i64>,
    /// Only frames before this time.
    #[arg(long, value_name = "TIME", value_parser = moment, allow_hyphen_values = true)]
    pub to: Option<i64>,
    /// Only what is refused.
    #[arg(long)]
    pub errors: bool,
}

/// How the file is to be read.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "File")]
pub struct FileArgs {
    /// File format, where the content does not tell it.
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Samples a second of a raw file, as 24000000 or 24M; a file given with it is raw unless --format says otherwise.
    #[arg(long, value_name = "HZ", value_parser = frequency)]
    pub rate: Option<u64>,
    /// Bytes a sample of a raw file, otherwise 1.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    pub unit_size: Option<u8>,
    /// The files are logs of bytes as hex digits, a burst a line.
    #[arg(long, conflicts_with_all = ["format", "rate"])]
    pub bytes: bool,
    /// The files are binary records of this many bytes, a burst each.
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u16).range(1..), conflicts_with_all = ["rate", "bytes"])]
    pub record_size: Option<u16>,
    /// The file still grows: what comes to it is decoded too, until the program is stopped.
    #[arg(long)]
    pub follow: bool,
    /// Voltage above which a column of an oscilloscope's table is high; otherwise half-way between its levels.
    #[arg(long, value_name = "VOLTS", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
}

/// How the line is to be taken.
#[derive(Debug, Args)]
#[command(next_help_heading = "Line")]
pub struct LineArgs {
    /// Channel by name or number; otherwise the one that decodes best.
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Channel of the requests, where the answers are on another one.
    #[arg(long, value_name = "NAME", requires = "rx", conflicts_with = "channel")]
    pub tx: Option<String>,
    /// Channel of the answers.
    #[arg(long, value_name = "NAME", requires = "tx", conflicts_with = "channel")]
    pub rx: Option<String>,
    /// Bits a second, as 2500000 or 2.5M; otherwise found from the lengths of the runs.
    #[arg(long, value_name = "HZ", value_parser = bit_rate)]
    pub bit_rate: Option<u32>,
    /// Whether the line idles high (normal) or low; otherwise the one that decodes best.
    #[arg(long, value_enum)]
    pub polarity: Option<Polarity>,
}

/// Which way up a line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Polarity {
    /// Idles high.
    Normal,
    /// Idles low: A and B swapped.
    Inverted,
}

/// What the frames of encoders do not tell.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Encoder (T-Format, A-format)")]
pub struct TformatArgs {
    /// Bits of a turn; otherwise from the encoder ID or type word seen on the line.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(1..=24))]
    pub single_turn_bits: Option<u8>,
    /// Bits that count turns; otherwise from the encoder ID or type word, else 16.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(0..=24))]
    pub multi_turn_bits: Option<u8>,
}

/// What RTEX blocks do not tell.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "RTEX")]
pub struct RtexArgs {
    /// Bytes of a block, 16 or 32; otherwise what the log looks like. A line or record may hold several blocks.
    #[arg(long, value_name = "BYTES", value_parser = block_size)]
    pub block_size: Option<u8>,
    /// Update period, as 500us or 0.5ms: gives the log times (for --stats and --jump) and checks the steps of the position.
    #[arg(long, value_name = "TIME", value_parser = period)]
    pub period: Option<u32>,
    /// Electronic gear of the drives as 8/1: the steps of the position are checked after it.
    #[arg(long, value_name = "N/D", value_parser = gear, requires = "period")]
    pub gear: Option<Gear>,
    /// Only the blocks of this drive.
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(0..=31))]
    pub mac_id: Option<u8>,
}

/// A time of the capture in ps.
fn moment(text: &str) -> Result<i64, String> {
    time::duration(text).ok_or_else(|| format!("\"{text}\" is not a time with its unit, as 20us, 1.5ms or 2s"))
}

/// A period in ns.
fn period(text: &str) -> Result<u32, String> {
    match time::duration(text).map(|time| (time + 500) / 1000) {
        Some(ns) if (1..=1_000_000_000).contains(&ns) => Ok(ns as u32),
        _ => Err(format!("\"{text}\" is not a period from 1 ns to 1000 ms, as 500us or 0.5ms")),
    }
}

fn gear(text: &str) -> Result<Gear, String> {
    let read = text.split_once('/').and_then(|(n, d)| Gear::new(n.trim().parse().ok()?, d.trim().parse().ok()?));
    read.ok_or_else(|| format!("\"{text}\" is not a gear of two whole numbers above 0, as 8/1"))
}

fn block_size(text: &str) -> Result<u8, String> {
    match text {
        "16" => Ok(16),
        "32" => Ok(32),
        _ => Err(format!("\"{text}\" is neither 16 nor 32")),
    }
}

impl Decode {
    /// An option that says something of a file.
    pub(crate) fn describes_a_file(&self) -> Option<&'static str> {
        let said = [
            (self.file.format.is_some(), "--format"),
            (self.file.rate.is_some(), "--rate"),
            (self.file.bytes, "--bytes"),
            (self.file.record_size.is_some(), "--record-size"),
            (self.file.threshold.is_some(), "--threshold"),
            (self.file.follow, "--follow"),
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

    /// Which frames are asked for.
    pub(crate) fn filter(&self) -> Filter {
        let FilterArgs { id, address, from, to, errors } = &self.filter;
        Filter::new(id.clone(), address.map(i64::from), (*from, *to), *errors)
    }

    /// What was said about the files.
    pub(crate) fn hints(&self) -> Hints {
        let format = if self.file.bytes { Some(Format::Hex) } else { self.file.format };
        Hints {
            format,
            sample_rate: self.file.rate,
            unit_size: usize::from(self.file.unit_size.unwrap_or(1)),
            record_size: self.file.record_size.map(usize::from),
            threshold: self.file.threshold,
            grows: self.file.follow,
        }
    }

    /// What was said about line and protocol.
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            line: line::Options {
                channel: self.line.channel.clone(),
                pair: self.line.tx.clone().zip(self.line.rx.clone()),
                bit_rate: self.line.bit_rate,
                inverted: self.line.polarity.map(|polarity| polarity == Polarity::Inverted),
            },
            widths: Widths {
                single_turn_bits: self.tformat.single_turn_bits,
                multi_turn_bits: self.tformat.multi_turn_bits,
            },
            rtex: rtex::Settings {
                block_size: self.rtex.block_size.map(usize::from),
                mac_id: self.rtex.mac_id,
                period_ns: self.rtex.period,
                gear: self.rtex.gear.unwrap_or(Gear::UNITY),
            },
        }
    }
}

/// Frequencies as people write them: `24000000`, `24M`, `2.5MHz`, `100 kHz`.
pub(crate) fn frequency(text: &str) -> Result<u64, String> {
    match time::frequency(text) {
        Some(hertz) if (1.0..=1e12).contains(&hertz.round()) => Ok(hertz.round() as u64),
        _ => Err(format!("\"{text}\" is not a frequency from 1 to 10^12 Hz, as 24M or 2500000")),
    }
}

/// Rates for which the receiver's grid of 80 samples a bit can be laid.
fn bit_rate(text: &str) -> Result<u32, String> {
    match frequency(text)? {
        rate @ 1..=1_000_000_000 => Ok(rate as u32),
        rate => Err(format!("{rate} bits a second are more than 10^9")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies() {
        for (text, want) in [
            ("24000000", 24_000_000),
            ("24M", 24_000_000),
            ("2.5 MHz", 2_500_000),
            ("100k", 100_000),
            ("1MHz", 1_000_000),
        ] {
            assert_eq!(frequency(text), Ok(want), "{text}");
        }
        for text in ["", "M", "fast", "-1", "0", "1e13", "inf", "NaN"] {
            assert!(frequency(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
