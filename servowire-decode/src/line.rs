//! From a recorded line to its events: find the channels, the protocol, the rate and the polarity, then receive.

mod again;
mod blame;
pub(crate) mod evidence;
pub(crate) mod exchanges;
mod floating;
pub(crate) mod lane;
mod nothing;
mod push;
pub(crate) mod receive;
pub(crate) mod spikes;
pub(crate) mod start_stop;
mod survey;
mod trial;

use std::io;

pub use evidence::Weights;
pub use lane::LineDecoder;
pub use push::PushDecoder;
pub use receive::Rates;
pub use start_stop::{LineField, StartStop};

use crate::capture::raw::Raw;
use crate::capture::{Change, Input, Line};
use crate::codec::Codec;
use crate::fault::{At, Fault, Stop};
use crate::output::Output;
use crate::protocols::meant;
use crate::settings::Settings;

/// Takes the next data as samples if possible, otherwise as changes; returns whether there is more, or why it cannot be
/// read.
fn read(
    line: &mut dyn Line,
    decoder: &mut PushDecoder,
    changes: &mut Vec<Change>,
    out: &mut Output<'_>,
) -> io::Result<Result<bool, Fault>> {
    let straight = decoder.takes_samples(out).and_then(|channel| line.samples(channel));
    Ok(match straight {
        Some(Ok(samples)) => {
            decoder.samples(samples, out)?;
            Ok(samples.first() != samples.end())
        }
        Some(Err(fault)) => Err(fault),
        None => line.read(changes),
    })
}

/// Time decoded before a requested window, in picoseconds: within it a HIPERFACE DSL link finds its position again.
const LEAD: i64 = 100_000_000_000;

/// Skips to shortly before the requested window, if the recording allows it and its lines are known; the decoders keep what
/// they have learnt.
fn skip(line: &mut dyn Line, decoder: &PushDecoder, out: &Output<'_>) -> Result<bool, Fault> {
    match out.from() {
        Some(from) if decoder.is_settled() && line.reached() < from - 2 * LEAD => line.skip(from - LEAD),
        _ => Ok(false),
    }
}

/// Decodes the lines of a capture.
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
        if out.is_done() {
            break Ok(());
        }
        if let Err(fault) = skip(line, &decoder, out) {
            break Err(fault);
        }
        let more = read(line, &mut decoder, &mut changes, out)?;
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
    Ok(decoder.verdict(out)?)
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
    // One sample per bit: a stream that a receiver has already sampled.
    let is_stream = |protocol: &&dyn Codec| {
        protocol.clocked && protocol.rates.iter().any(|bit| rate.abs_diff(u64::from(*bit)) * 1000 < rate)
    };
    if let Some(stream) = meant(protocol).find(is_stream) {
        return decode(file, raw, Some(stream), settings, out);
    }
    let slowest = meant(protocol).flat_map(|protocol| protocol.rates).min().copied().unwrap_or(1);
    if let Some(what) = too_coarse(rate, settings.line.bit_rate.unwrap_or(slowest)) {
        return Err(Fault::new(file, At::File, what).into());
    }
    decode(file, raw, protocol, settings, out)
}

/// Returns a message if there are fewer than four samples per bit.
fn too_coarse(rate: u64, bit_rate: u32) -> Option<String> {
    // A line may be a little faster than its nominal rate.
    let need = 4 * u64::from(bit_rate);
    let digits = |value: f64| format!("{value:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let (a_bit, mhz) = (digits(rate as f64 / f64::from(bit_rate)), digits(need as f64 / 1e6));
    let what = format!("{a_bit} samples per bit are too few: at least 4 are needed, so sample at {mhz} MHz or faster");
    (rate < need).then_some(what)
}
