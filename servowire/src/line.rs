//! From a recorded line to what is said on it: find the channels, the protocol, the rate and the polarity, then receive.

mod evidence;
mod lane;
mod receive;
mod report;
mod spikes;
mod survey;
mod watch;

use std::fmt;
use std::io;
use std::time::{Duration, Instant};

pub use evidence::Weights;
pub use lane::{LineDecoder, StartStopLine, Tap, Wires};
pub use receive::{EdgeReceiver, Rates};
pub(crate) use spikes::Spikes;
use survey::{Candidates, Found};
use watch::Watch;

use crate::capture::hexlog::Burst;
use crate::capture::raw::Raw;
use crate::capture::{Change, Line};
use crate::fault::{At, Fault};
use crate::output::{Output, Sink};
use crate::protocols::{Protocol, Settings};

/// What comes live is shown after this time at the latest, if it is complete.
const SHOWN: Duration = Duration::from_millis(250);

/// A field of a start-stop line with its place in the capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineField {
    /// The content bits, the first of the line in bit 0.
    pub content: u16,
    /// Whether the delimiter was read as 1.
    pub delimiter: bool,
    /// The edge of the start bit, in picoseconds.
    pub start: i64,
    /// The end of the delimiter at the speaker's rate.
    pub end: i64,
    /// Spikes that were dropped before it or in it.
    pub spikes: u32,
    /// For the first field of a speaker: the bits of the line from its start bit on, as long as he speaks, the first in
    /// bit 0; those after it are 1. Otherwise 0.
    pub bits: u128,
}

/// A protocol on a start-stop line: takes fields, gives events.
pub trait StartStop {
    /// Content bits of a field: 8 or 16.
    const CONTENT_BITS: u32;

    /// The capture begins, at `start`.
    fn begin(&mut self, start: i64);

    /// The next field of the line.
    fn field(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()>;

    /// Bytes that followed each other, without times.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()>;

    /// The capture ends, at `end` where it has times.
    fn finish(&mut self, end: Option<i64>, out: &mut dyn Sink) -> io::Result<()>;
}

/// What the user said about the line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    /// The channel by name or number.
    pub channel: Option<String>,
    /// The channels of the requests and of the answers, where they are two.
    pub pair: Option<(String, String)>,
    /// Bits a second.
    pub bit_rate: Option<u32>,
    /// Whether the line idles low.
    pub inverted: Option<bool>,
}

/// Why decoding ended early.
#[derive(Debug)]
pub enum Stop {
    /// The input is broken from here on, or nothing in it can be decoded.
    Fault(Fault),
    /// The output takes no more.
    Output(io::Error),
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) => fault.fmt(f),
            Self::Output(error) => write!(f, "cannot write: {error}"),
        }
    }
}

/// Decodes what is said on the lines of a capture.
pub fn decode(
    file: &str,
    line: &mut dyn Line,
    protocol: Protocol,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let names = line.channels().to_vec();
    let only = wanted(&settings.line, &names).map_err(|what| Fault::new(file, At::File, what))?;
    let pair = match only.as_deref() {
        Some([requests, answers]) => Some([*requests, *answers]),
        _ => None,
    };
    let mut watch = Watch::new(file, &names, Candidates::new(protocol, settings, pair), only.as_deref());
    let (mut changes, mut fault) = (Vec::new(), None);
    let mut shown = Instant::now();
    loop {
        changes.clear();
        if line.input().is_some_and(|input| input.is_live() && (shown.elapsed() > SHOWN || input.pauses())) {
            watch.early(out)?;
            watch.reach(line.reached(), out)?;
            out.flush()?;
            shown = Instant::now();
        }
        let more = read(line, &mut watch, &mut changes, out)?.unwrap_or_else(|e| {
            fault = Some(e);
            false
        });
        if let Some(hole) = line.hole() {
            watch.hole(hole, out)?;
        }
        watch.changes(&changes, out)?;
        out.tick();
        if !more {
            break;
        }
        if watch.is_due() {
            watch.survey(false, out)?;
        }
        watch.reach(line.reached(), out)?;
        if out.is_over(line.reached()) {
            break;
        }
    }
    let end = line.reached();
    watch.survey(true, out)?;
    watch.finish(end, out)?;
    if let Some(fault) = fault {
        return Err(fault.into());
    }
    if watch.found.is_empty() {
        let what = report::nothing(&watch, protocol, &names, only.as_deref());
        return Err(Fault::new(file, At::File, what).into());
    }
    right_way_up(file, settings, &watch.found, out)
}

/// Takes what comes next as samples where that can be, else as changes; whether there is more, or why it cannot be read.
fn read(
    line: &mut dyn Line,
    watch: &mut Watch<'_>,
    changes: &mut Vec<Change>,
    out: &mut Output<'_>,
) -> io::Result<Result<bool, Fault>> {
    let straight = if watch.takes_samples(out) { line.samples() } else { None };
    Ok(match straight {
        Some(Ok(samples)) => {
            watch.samples(samples, out)?;
            Ok(samples.first() != samples.end())
        }
        Some(Err(fault)) => Err(fault),
        None => line.read(changes),
    })
}

/// Decodes samples at a fixed rate.
pub fn samples(
    file: &str,
    raw: &mut Raw,
    protocol: Protocol,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let rate = raw.clock().rate();
    // A sample a bit: what a receiver has read already. Only HIPERFACE DSL is recorded so.
    let is_stream = |protocol: &Protocol| {
        *protocol == Protocol::Hdsl && protocol.rates().iter().any(|bit| rate.abs_diff(u64::from(*bit)) * 1000 < rate)
    };
    if protocol.of_lines().iter().any(is_stream) {
        return decode(file, raw, Protocol::Hdsl, settings, out);
    }
    let slowest = protocol.of_lines().iter().flat_map(|protocol| protocol.rates()).min().copied().unwrap_or(1);
    if let Some(what) = too_coarse(rate, settings.line.bit_rate.unwrap_or(slowest)) {
        return Err(Fault::new(file, At::File, what).into());
    }
    decode(file, raw, protocol, settings, out)
}

/// A line that was found upside down is decoded, but it is not good: somebody has to look at the wires. Where hardly
/// anything could be decoded, the polarity was only a guess and says nothing.
fn right_way_up(file: &str, settings: &Settings, found: &[Found], out: &Output<'_>) -> Result<(), Stop> {
    let inverted = found.iter().any(Found::is_inverted);
    if !inverted || settings.line.inverted.is_some() || out.tally.ok <= out.tally.faults() {
        return Ok(());
    }
    let what = "the line is inverted: exchange A and B, or say that it is meant so with --polarity inverted";
    Err(Fault::new(file, At::File, what).into())
}

/// Fewer than four samples a bit.
fn too_coarse(rate: u64, bit_rate: u32) -> Option<String> {
    // A line may be a little faster than its name.
    let need = 4 * u64::from(bit_rate);
    let digits = |value: f64| format!("{value:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let (a_bit, mhz) = (digits(rate as f64 / f64::from(bit_rate)), digits(need as f64 / 1e6));
    let what = format!("{a_bit} samples a bit are too few: 4 or more are needed, so sample at {mhz} MHz or faster");
    (rate < need).then_some(what)
}

/// The channels that the user named.
fn wanted(options: &Options, names: &[String]) -> Result<Option<Vec<u16>>, String> {
    match (&options.pair, &options.channel) {
        (Some((requests, answers)), _) => Ok(Some(vec![find(requests, names)?, find(answers, names)?])),
        (None, Some(channel)) => Ok(Some(vec![find(channel, names)?])),
        (None, None) => Ok(None),
    }
}

/// A channel by its name, or by its number from 0.
fn find(name: &str, channels: &[String]) -> Result<u16, String> {
    let by_name = channels.iter().position(|c| c == name).or_else(|| {
        let last = |c: &String| c.rsplit('.').next().is_some_and(|end| end == name);
        channels.iter().position(last)
    });
    let by_number = || name.parse().ok().filter(|&n: &usize| n < channels.len());
    by_name.or_else(by_number).and_then(|index| u16::try_from(index).ok()).ok_or_else(|| {
        let shown = channels.iter().take(20).map(|c| format!("\"{c}\"")).collect::<Vec<_>>().join(", ");
        let more = if channels.len() > 20 { ", ..." } else { "" };
        format!("no channel \"{name}\"; the file has {shown}{more}")
    })
}
