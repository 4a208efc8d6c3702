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
  sigrok-cli --driver fx2lafw --config samplerate=24M --continuous -O binary | servowire decode --rate 24M -")]
pub(crate) struct Decode {
    /// VCD, FST, sigrok and DSView sessions, Saleae exports, CSV of analysers and oscilloscopes, pcapng, also packed by
    /// gzip or zstd; raw samples with --rate; hex bytes with --bytes; - for the standard input. Without a file, what
    /// comes through a pipe, or else the bundled captures.
    pub(super) files: Vec<PathBuf>,
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
    /// With --stats, of what comes in live (a pipe, --follow): also the figures of what came since the last ones, so often, such
    /// as 1s or 200ms, a line an encoder. On a terminal every second without being asked.
    #[arg(long, value_name = "TIME", value_parser = interval, requires = "stats")]
    pub(super) every: Option<Duration>,
    /// Write the capture as VCD, with the decoded fields beside it as strings.
    #[arg(short = 'o', long, value_name = "OUT")]
    pub(super) vcd: Option<PathBuf>,
    /// Write only this piece of it, such as 1ms..2ms, and show only its frames.
    #[arg(long, value_name = "FROM..TO", value_parser = stretch, allow_hyphen_values = true, requires = "vcd", conflicts_with_all = ["from", "to"])]
    pub(super) cut: Option<(Time, Time)>,
    /// With -o, write only the line so long before and after each refused frame or missing answer; no more of it is held in
    /// memory. With --until error, go on for so long.
    #[arg(long, value_name = "TIME", value_parser = around, requires = "vcd", conflicts_with = "cut")]
    pub(super) around: Option<i64>,
    /// Stop at the first refused frame or missing answer.
    #[arg(long, value_name = "EVENT", value_enum)]
    pub(super) until: Option<Until>,
    /// Draw position and errors over time, and how long answers took.
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
    /// Only the encoder of this channel, address, or both as A/3, as the tables name it.
    #[arg(long, value_name = "NAME")]
    pub(super) encoder: Option<String>,
    /// Only frames from this time of the capture on, such as 20us, 1.5ms or 2s.
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
    /// Which frames are asked for.
    pub(super) fn filter(&self) -> Filter {
        let FilterArgs { id, address, encoder, from, to, errors } = &self.filter;
        let (from, to) = self.cut.map_or((*from, *to), |(from, to)| (Some(from), Some(to)));
        let (address, encoder) = (address.map(i64::from), encoder.clone());
        Filter::new(Choice { kinds: id.clone(), address, encoder, from, to, errors: *errors })
    }
}
