//! From a recorded line to what is said on it: find the channels, the protocol, the rate and the polarity, then receive.

pub(crate) mod evidence;
pub(crate) mod lane;
mod nothing;
pub(crate) mod receive;
pub(crate) mod spikes;
pub(crate) mod start_stop;
mod survey;
mod watch;

use std::io;

pub use evidence::Weights;
pub use lane::{LineDecoder, StartStopLine, Tap, Wires};
pub use receive::{EdgeReceiver, Rates};
pub use start_stop::{LineField, StartStop};
use survey::{Candidates, Found};
use watch::Watch;

use crate::capture::raw::Raw;
use crate::capture::{Change, Hole, Input, Line};
use crate::codec::Codec;
use crate::fault::{At, Fault, Stop};
use crate::output::Output;
use crate::protocols::meant;
use crate::settings::{Options, Settings};
use crate::time::Time;

/// Decodes a recording of lines that is pushed in piece by piece: edges in, events out.
pub struct PushDecoder {
    watch: Watch,
    protocol: Option<&'static dyn Codec>,
    /// The channels that the user named.
    only: Option<Vec<u16>>,
}

impl PushDecoder {
    /// Of a recording called `file` with channels of these names; `protocol`: otherwise all are tried.
    pub fn new(
        file: &str,
        channels: &[String],
        protocol: Option<&'static dyn Codec>,
        settings: &Settings,
    ) -> Result<Self, Fault> {
        let only = wanted(&settings.line, channels).map_err(|what| Fault::new(file, At::File, what))?;
        let pair = match only.as_deref() {
            Some([requests, answers]) => Some([*requests, *answers]),
            _ => None,
        };
        let candidates = Candidates::new(protocol, settings.clone(), pair);
        Ok(Self { watch: Watch::new(file, channels, candidates, only.as_deref()), protocol, only })
    }

    /// The next changes, in the order of time; the first of a channel is its level at the beginning.
    pub fn changes(&mut self, changes: &[Change], out: &mut Output<'_>) -> io::Result<()> {
        self.watch.changes(changes, out)
    }

    /// A hole in the recording before the next changes.
    pub fn hole(&mut self, hole: Hole, out: &mut Output<'_>) -> io::Result<()> {
        self.watch.hole(hole, out)
    }

    /// Nothing else has changed until `time`. To be called after each piece: what was held back to see what it is, is
    /// judged here.
    pub fn reach(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        if self.watch.is_due() {
            self.watch.survey(false, out)?;
        }
        self.watch.reach(time, out)
    }

    /// Nothing comes for a while: what is certain so far is decoded and shown.
    pub fn pause(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        self.watch.early(out)?;
        self.watch.reach(time, out)?;
        out.flush()
    }

    /// The recording ends at `time`. Lines of which nothing was found, or that were upside down, are a fault.
    pub fn finish(mut self, time: Time, out: &mut Output<'_>) -> Result<(), Stop> {
        self.end(time, out)?;
        self.judge(out).map_err(Stop::Fault)
    }

    fn end(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        self.watch.survey(true, out)?;
        self.watch.finish(time, out)
    }

    fn judge(&self, out: &Output<'_>) -> Result<(), Fault> {
        let watch = &self.watch;
        if watch.found.is_empty() {
            let what = nothing::nothing(&watch.seen(), self.protocol, self.only.as_deref());
            return Err(Fault::new(watch.file(), At::File, what));
        }
        // A line that was found upside down is decoded, but it is not good: somebody has to look at the wires. Where
        // hardly anything could be decoded, the polarity was only a guess and says nothing.
        let inverted = watch.found.iter().any(Found::is_inverted);
        if !inverted || watch.settings().line.inverted.is_some() || out.tally.ok <= out.tally.faults() {
            return Ok(());
        }
        let what = "the line is inverted: exchange A and B, or say that it is meant so with --polarity inverted";
        Err(Fault::new(watch.file(), At::File, what))
    }

    /// Takes what comes next as samples where that can be, else as changes; whether there is more, or why it cannot be
    /// read.
    fn read(
        &mut self,
        line: &mut dyn Line,
        changes: &mut Vec<Change>,
        out: &mut Output<'_>,
    ) -> io::Result<Result<bool, Fault>> {
        let straight = if self.watch.takes_samples(out) { line.samples() } else { None };
        Ok(match straight {
            Some(Ok(samples)) => {
                self.watch.samples(samples, out)?;
                Ok(samples.first() != samples.end())
            }
            Some(Err(fault)) => Err(fault),
            None => line.read(changes),
        })
    }
}

/// Decodes what is said on the lines of a capture.
pub(crate) fn decode(
    file: &str,
    line: &mut dyn Line,
    protocol: Option<&'static dyn Codec>,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let mut decoder = PushDecoder::new(file, line.channels(), protocol, settings)?;
    let mut changes = Vec::new();
    let broken = loop {
        changes.clear();
        if line.input().is_some_and(Input::is_due) {
            decoder.pause(line.reached(), out)?;
        }
        let more = decoder.read(line, &mut changes, out)?;
        if let Some(hole) = line.hole() {
            decoder.hole(hole, out)?;
        }
        decoder.changes(&changes, out)?;
        out.tick();
        match more {
            Ok(true) => decoder.reach(line.reached(), out)?,
            Ok(false) => break Ok(()),
            Err(fault) => break Err(fault),
        }
        if out.is_over(line.reached()) {
            break Ok(());
        }
    };
    decoder.end(line.reached(), out)?;
    broken?;
    Ok(decoder.judge(out)?)
}

/// Decodes samples at a fixed rate.
pub(crate) fn samples(
    file: &str,
    raw: &mut Raw,
    protocol: Option<&'static dyn Codec>,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let rate = raw.clock().rate();
    // A sample a bit: what a receiver has read already.
    let is_stream = |protocol: &&dyn Codec| {
        protocol.is_clocked() && protocol.rates().iter().any(|bit| rate.abs_diff(u64::from(*bit)) * 1000 < rate)
    };
    if let Some(stream) = meant(protocol).find(is_stream) {
        return decode(file, raw, Some(stream), settings, out);
    }
    let slowest = meant(protocol).flat_map(Codec::rates).min().copied().unwrap_or(1);
    if let Some(what) = too_coarse(rate, settings.line.bit_rate.unwrap_or(slowest)) {
        return Err(Fault::new(file, At::File, what).into());
    }
    decode(file, raw, protocol, settings, out)
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
