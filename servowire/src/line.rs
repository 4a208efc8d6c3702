//! From a recorded line to start-stop fields: find the channel, the rate and the polarity, then receive.

mod receive;
mod survey;

use std::fmt;
use std::io;

pub use receive::{EdgeReceiver, SampleReceiver};
pub use survey::{Survey, survey};

use crate::capture::hexlog::Burst;
use crate::capture::raw::{Raw, Words};
use crate::capture::{Capture, Change, Line};
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

/// Changes looked at before decoding begins.
const PREVIEW: usize = 1 << 16;

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
        Capture::Edges(mut line) => {
            let preview = Preview::read(line.as_mut());
            let found = preview.survey(file, line.channels(), options, make)?;
            out.note(&format!("{file}: {found}"));
            edges(line.as_mut(), preview, found.setup, &mut make(found.setup.bit()), out)
        }
        Capture::Samples(mut raw) => {
            let preview = Preview::read(&mut raw);
            let found = preview.survey(file, raw.channels(), options, make)?;
            out.note(&format!("{file}: {found}"));
            let setup = found.setup;
            let mut protocol = make(setup.bit());
            let (rate, bit_rate) = (raw.clock().rate(), u64::from(setup.rate));
            if rate < 4 * bit_rate {
                let what = format!(
                    "{} samples a bit are too few: 4 or more are needed, so sample at {} MHz or faster",
                    two_digits(rate as f64 / bit_rate as f64),
                    two_digits(4e-6 * bit_rate as f64)
                );
                return Err(Fault::new(file, At::File, what).into());
            }
            match SampleReceiver::new(raw.clock(), setup, P::CONTENT_BITS) {
                Some(receiver) if !out.wants_changes() => samples(&mut raw, preview, receiver, &mut protocol, out),
                _ => edges(&mut raw, preview, setup, &mut protocol, out),
            }
        }
    }
}

fn two_digits(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The beginning of a capture, and whether it went wrong there.
struct Preview {
    changes: Vec<Change>,
    more: bool,
    fault: Option<Fault>,
    reached: i64,
}

impl Preview {
    /// Time of the first change of any channel.
    fn begin(&self) -> i64 {
        self.changes.first().map_or(0, |change| change.time)
    }

    fn read(line: &mut dyn Line) -> Self {
        let mut changes = Vec::new();
        let (mut more, mut fault) = (true, None);
        while more && changes.len() < PREVIEW {
            match line.read(&mut changes) {
                Ok(again) => more = again,
                Err(e) => (more, fault) = (false, Some(e)),
            }
        }
        Self { changes, more, fault, reached: line.reached() }
    }

    /// With nothing to decode, the fault of the file is the better message.
    fn survey<P: StartStop>(
        &self,
        file: &str,
        channels: &[String],
        options: &Options,
        make: &dyn Fn(i64) -> P,
    ) -> Result<Survey, Fault> {
        let found = survey(&self.changes, self.reached, channels, options, make);
        found.map_err(|what| match &self.fault {
            Some(fault) => fault.clone(),
            None => Fault::new(file, At::File, what),
        })
    }
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
