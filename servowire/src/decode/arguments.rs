//! What `servowire decode` is told.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use servowire_decode::output::filter::{Choice, Filter};
use servowire_decode::time::Time;

use crate::reading::Reading;
use crate::units::moment;

/// Decode captures of a line.
///
/// Prints one transaction per line: `<>` a request with its answer, `>` a request, `<` an answer alone. Format, channel,
/// polarity and bit rate are found from the capture; what was found is reported on standard error. Exit code 0: all
/// frames good; 1: a frame was refused or a file could not be decoded; 2: wrong use; 4: all frames good, but a drive reported an
/// alarm, did not answer or stood still; 5: both 1 and 4.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  servowire decode line.vcd
  servowire decode --stats --jump 4000 session.sr
  servowire decode --errors --from 1ms --to 20ms digital.csv
  servowire decode --cut 1ms..2ms -o piece.vcd line.vcd
  sigrok-cli --driver fx2lafw --config samplerate=24M --continuous -O binary |
    servowire decode --rate 24M --stats --until error --around 5ms -o fault.vcd -
  sigrok-cli --driver fx2lafw --config samplerate=24M --continuous -O binary | servowire decode --rate 24M -
  servowire decode --stats --serial /dev/ttyUSB0")]
pub(crate) struct Decode {
    /// Captures: VCD, FST, sigrok and DSView sessions, Saleae exports, CSV of analysers and oscilloscopes, pcapng, also
    /// compressed with gzip or zstd; raw samples with --rate; hex bytes with --bytes; - for standard input. Without a file,
    /// standard input is read if it is a pipe; otherwise the bundled captures are decoded.
    pub(super) files: Vec<PathBuf>,
    /// Listen to a T-Format line through this serial port without sending anything, at 2.5 Mbit/s unless --bit-rate says
    /// otherwise. A port gives no times, so no delays and cycle times are shown.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["files", "format", "rate", "unit_size", "bytes", "record_size", "follow", "fcs", "threshold", "channel", "tx", "rx", "polarity"])]
    pub(super) serial: Option<String>,
    /// JSON Lines, one object per frame; times in picoseconds.
    #[arg(long)]
    pub(super) json: bool,
    /// A table for spreadsheets, one row per frame and one column per field; times in microseconds.
    #[arg(long, conflicts_with_all = ["json", "stats"])]
    pub(super) csv: bool,
    /// Figures instead of frames: errors by class, cycle time, answer delay, largest move of the position.
    #[arg(long)]
    pub(super) stats: bool,
    /// With --stats, list moves of the position by more than this from one frame to the next.
    #[arg(long, value_name = "COUNTS", requires = "stats")]
    pub(super) jump: Option<u64>,
    /// With --stats and live input (a pipe, --follow, --serial): at this interval, such as 1s or 200ms, also show the figures of
    /// the time since then, one line per encoder. On a terminal this happens every second by default.
    #[arg(long, value_name = "TIME", value_parser = interval, requires = "stats")]
    pub(super) every: Option<Duration>,
    /// Write the capture as VCD, with the decoded fields beside it as strings.
    #[arg(short = 'o', long, value_name = "OUT")]
    pub(super) vcd: Option<PathBuf>,
    /// With -o, write only this part of the capture, such as 1ms..2ms, and show only its frames.
    #[arg(long, value_name = "FROM..TO", value_parser = stretch, allow_hyphen_values = true, requires = "vcd", conflicts_with_all = ["from", "to"])]
    pub(super) cut: Option<(Time, Time)>,
    /// With -o, write only this much of the line before and after each refused frame or missing answer; no more is held in
    /// memory. With --until error, continue for this long after the error.
    #[arg(long, value_name = "TIME", value_parser = around, requires = "vcd", conflicts_with = "cut")]
    pub(super) around: Option<i64>,
    /// Stop at the first refused frame or missing answer.
    #[arg(long, value_name = "EVENT", value_enum)]
    pub(super) until: Option<Until>,
    /// Draw positions, errors and answer delays over time.
    #[arg(long, value_name = "OUT")]
    pub(super) svg: Option<PathBuf>,
    /// What to read, and how.
    #[command(flatten)]
    pub(super) reading: Reading,
    /// Which frames to show.
    #[command(flatten)]
    pub(super) filter: FilterArgs,
}

/// Which frames are shown and counted.
#[derive(Debug, Args)]
#[command(next_help_heading = "Filter")]
pub(crate) struct FilterArgs {
    /// Only frames of these kinds, such as 3 or D (T-Format), ABS40, H-frame.
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(super) id: Vec<String>,
    /// Only the encoder (EA), drive (MAC-ID) or device (SA) of this address.
    #[arg(long, value_name = "N")]
    pub(super) address: Option<u16>,
    /// Only the encoder with this name in the tables: its channel, its address, or both, such as A/3.
    #[arg(long, value_name = "NAME")]
    pub(super) encoder: Option<String>,
    /// Only frames from this time onwards, such as 20us, 1.5ms or 2s.
    #[arg(long, value_name = "TIME", value_parser = moment, allow_hyphen_values = true)]
    pub(super) from: Option<Time>,
    /// Only frames before this time.
    #[arg(long, value_name = "TIME", value_parser = moment, allow_hyphen_values = true)]
    pub(super) to: Option<Time>,
    /// Only refused frames.
    #[arg(long)]
    pub(super) errors: bool,
}

/// What ends a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Until {
    /// A frame is refused, or an answer is missing.
    Error,
}

/// How often something is shown.
fn interval(text: &str) -> Result<Duration, String> {
    match moment(text)?.ps() / 1_000_000 {
        us @ 1_000..=3_600_000_000 => Ok(Duration::from_micros(us as u64)),
        _ => Err(format!("\"{text}\" is not a time from 1ms to 3600s")),
    }
}

/// A time before and after something, in picoseconds.
fn around(text: &str) -> Result<i64, String> {
    match moment(text)?.ps() {
        ps @ 1..=10_000_000_000_000 => Ok(ps as i64),
        _ => Err(format!("\"{text}\" is not a time above 0, up to 10s")),
    }
}

/// Two times with two dots between them.
fn stretch(text: &str) -> Result<(Time, Time), String> {
    let (from, to) = text.split_once("..").ok_or_else(|| format!("\"{text}\" is not two times, such as 1ms..2ms"))?;
    let (from, to) = (moment(from)?, moment(to)?);
    if from < to { Ok((from, to)) } else { Err(format!("nothing lies in \"{text}\"")) }
}

impl Decode {
    /// What cannot be meant.
    pub(super) fn contradiction(&self) -> Option<&'static str> {
        let empty = self.filter.from.zip(self.filter.to).is_some_and(|(from, to)| from >= to);
        empty.then_some("--from is not before --to")
    }

    /// Which frames are asked for.
    pub(super) fn filter(&self) -> Filter {
        let FilterArgs { id, address, encoder, from, to, errors } = &self.filter;
        let (from, to) = self.cut.map_or((*from, *to), |(from, to)| (Some(from), Some(to)));
        let (address, encoder) = (address.map(i64::from), encoder.clone());
        Filter::new(Choice { kinds: id.clone(), address, encoder, from, to, errors: *errors })
    }
}
