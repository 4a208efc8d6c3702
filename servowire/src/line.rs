//! From a recorded line to start-stop fields: find the channel, the rate and the polarity, then receive.

mod preview;
mod receive;
mod survey;

use std::fmt;
use std::io;

use preview::Preview;
pub use receive::{EdgeReceiver, SampleReceiver};
pub use survey::{Survey, survey};

use crate::capture::hexlog::Burst;
use crate::capture::raw::{Raw, Words};
use crate::capture::{Capture, Line};
use crate::fault::{At, Fault};
use crate::output::{Output, Sink};

/// A field of a start-stop line with its place in the capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineField {
    /// The content bits, the first of the line in bit 0.
    pub content: u16,
    /// Whether the delimiter was read as 1.
    pub delimiter: bool,
    /// The edge of the start bit, in picoseconds.
    pub start: i64,
    /// The end of the delimiter at the nominal rate.
    pub end: i64,
    /// Spikes that were dropped before it.
    pub spikes: u32,
}

/// What is known of the line before decoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setup {
    /// The channel.
    pub channel: u16,
    /// Bits a second.
    pub rate: u32,
    /// Whether the line idles low.
    pub inverted: bool,
}

impl Setup {
    /// Length of a bit in picoseconds.
    pub fn bit(&self) -> i64 {
        crate::capture::time::SECOND / i64::from(self.rate.max(1))
    }
}

/// A protocol on a start-stop line: takes fields, gives events.
pub trait StartStop {
    /// The name of the protocol for messages.
    const NAME: &'static str;
    /// Nominal bit rates.
    const RATES: &'static [u32];
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

/// Decodes a capture of a start-stop protocol. `make` builds the decoder for a bit length in picoseconds.
pub fn decode<P: StartStop>(
    file: &str,
    capture: Capture,
    options: &Options,
    make: &dyn Fn(i64) -> P,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    match capture {
        Capture::Bytes(mut log) => {
            let mut protocol = make(0);
            let end = loop {
                out.tick();
                match log.burst() {
                    Ok(Some(burst)) => protocol.burst(&burst, out)?,
                    Ok(None) => break Ok(()),
                    Err(fault) => break Err(fault),
                }
            };
            protocol.finish(None, out)?;
            Ok(end?)
        }
        Capture::Packets(_) => Err(Fault::new(file, At::File, "packets of a network are no start-stop line").into()),
        Capture::Edges(mut line) => {
            let preview = Preview::read(line.as_mut());
            let found = preview.survey(file, line.channels(), options, make)?;
            out.note(&format!("{file}: {found}"));
            edges(line.as_mut(), preview, found.setup, &mut make(found.setup.bit()), out)?;
            right_way_up(file, options, found.setup, out)
        }
        Capture::Samples(mut raw) => {
            let preview = Preview::read(&mut raw);
            let found = preview.survey(file, raw.channels(), options, make)?;
            out.note(&format!("{file}: {found}"));
            let setup = found.setup;
            let mut protocol = make(setup.bit());
            if let Some(what) = too_coarse(raw.clock().rate(), setup.rate) {
                return Err(Fault::new(file, At::File, what).into());
            }
            match SampleReceiver::new(raw.clock(), setup, P::CONTENT_BITS) {
                Some(receiver) if !out.wants_changes() => samples(&mut raw, preview, receiver, &mut protocol, out),
                _ => edges(&mut raw, preview, setup, &mut protocol, out),
            }?;
            right_way_up(file, options, setup, out)
        }
    }
}

/// A line that was found upside down is decoded, but it is not good: somebody has to look at the wires. Where hardly
/// anything could be decoded, the polarity was only a guess and says nothing.
fn right_way_up(file: &str, options: &Options, setup: Setup, out: &Output<'_>) -> Result<(), Stop> {
    if !setup.inverted || options.inverted.is_some() || out.tally.ok <= out.tally.refused {
        return Ok(());
    }
    let what = "the line is inverted: exchange A and B, or say that it is meant so with --polarity inverted";
    Err(Fault::new(file, At::File, what).into())
}

/// Fewer than four samples a bit.
fn too_coarse(rate: u64, bit_rate: u32) -> Option<String> {
    let need = 4 * u64::from(bit_rate);
    let digits = |value: f64| format!("{value:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let (a_bit, mhz) = (digits(rate as f64 / f64::from(bit_rate)), digits(need as f64 / 1e6));
    let what = format!("{a_bit} samples a bit are too few: 4 or more are needed, so sample at {mhz} MHz or faster");
    (rate < need).then_some(what)
}

/// Decodes changes with their times.
fn edges<P: StartStop>(
    line: &mut dyn Line,
    preview: Preview,
    setup: Setup,
    protocol: &mut P,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    protocol.begin(preview.begin());
    let Preview { mut changes, mut more, mut fault, .. } = preview;
    let mut receiver = EdgeReceiver::new(setup, P::CONTENT_BITS);
    out.channels(line.channels(), setup.channel)?;
    let tap = out.wants_changes();
    loop {
        for change in &changes {
            if tap {
                out.change(change)?;
            }
            if change.channel == setup.channel {
                if let Some(field) = receiver.change(change.time, change.level) {
                    protocol.field(&field, out)?;
                }
            }
        }
        out.tick();
        if !more {
            break;
        }
        changes.clear();
        match line.read(&mut changes) {
            Ok(again) => more = again,
            Err(e) => (more, fault) = (false, Some(e)),
        }
    }
    let end = line.reached();
    if let Some(field) = receiver.finish(end) {
        protocol.field(&field, out)?;
    }
    protocol.finish(Some(end), out)?;
    fault.map_or(Ok(()), |fault| Err(fault.into()))
}

/// Decodes packed samples, the fast way.
fn samples<P: StartStop>(
    raw: &mut Raw,
    preview: Preview,
    mut receiver: SampleReceiver,
    protocol: &mut P,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    protocol.begin(preview.begin());
    let Preview { changes, more, mut fault, .. } = preview;
    let channel = receiver.channel();
    for change in changes.iter().filter(|change| change.channel == channel) {
        if let Some(field) = receiver.change(change.time, change.level) {
            protocol.field(&field, out)?;
        }
    }
    if let Some(field) = receiver.reach(raw.samples()) {
        protocol.field(&field, out)?;
    }
    drop(changes);
    let mut block = Words::default();
    while more && fault.is_none() {
        out.tick();
        match raw.words(channel, &mut block) {
            Ok(true) => receiver.words(&block, |field| protocol.field(field, out))?,
            Ok(false) => break,
            Err(e) => fault = Some(e),
        }
    }
    if let Some(field) = receiver.finish() {
        protocol.field(&field, out)?;
    }
    protocol.finish(Some(raw.reached()), out)?;
    fault.map_or(Ok(()), |fault| Err(fault.into()))
}
