//! Logs of bytes: which protocol they hold, and its events.

mod recognise;

use std::io;

use recognise::recognise;

use super::{Protocol, Settings, nikon, rtex, tformat};
use crate::capture::ByteLog;
use crate::capture::hexlog::Burst;
use crate::event::{Event, Place, Refusal};
use crate::fault::{At, Fault};
use crate::line::{StartStop, Stop};
use crate::output::{Output, Sink};

/// Bursts by which the protocol is recognised.
const SAMPLE: usize = 256;

/// Decodes a log; of an unknown protocol, by the one of which most holds.
pub(super) fn decode(
    file: &str,
    mut log: ByteLog,
    protocol: Protocol,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let mut bursts = Vec::new();
    let mut end = Ok(true);
    while bursts.len() < SAMPLE && end == Ok(true) && (bursts.is_empty() || !log.pauses()) {
        match log.burst() {
            Ok(Some(burst)) => bursts.push(burst),
            Ok(None) => end = Ok(false),
            Err(fault) => end = Err(fault),
        }
    }
    let reading = recognise(&bursts, protocol, settings, out);
    let reading = reading.map_err(|what| Fault::new(file, At::File, what))?;
    let mut reader = Reader::new(reading.protocol, settings, &bursts);
    if let Reader::Rtex(decoder) = &reader {
        decoder.shape_note().iter().for_each(|note| out.note(note));
    }
    let mut whole = reading.wrapped.then(|| Burst::new(1, Vec::new()));
    for burst in bursts {
        reader.take(burst, &mut whole, out)?;
    }
    while end == Ok(true) {
        if log.pauses() {
            out.flush()?;
        }
        out.tick();
        match log.burst() {
            Ok(Some(burst)) => reader.take(burst, &mut whole, out)?,
            Ok(None) => end = Ok(false),
            Err(fault) => end = Err(fault),
        }
    }
    if let Some(whole) = whole.filter(|whole| !whole.bytes.is_empty()) {
        reader.burst(&whole, out)?;
    }
    reader.finish(out)?;
    end?;
    match &reader {
        Reader::Rtex(decoder) => {
            decoder.shape_fault().map_or(Ok(()), |what| Err(Fault::new(file, At::File, what).into()))
        }
        _ => Ok(()),
    }
}

/// A protocol of logs.
enum Reader {
    Tformat(Box<tformat::Decoder>),
    Nikon(Box<nikon::Decoder>),
    Rtex(Box<rtex::Decoder>),
}

impl Reader {
    fn new(protocol: Protocol, settings: &Settings, sample: &[Burst]) -> Self {
        match protocol {
            Protocol::Nikon => Self::Nikon(Box::new(nikon::Decoder::new(0, settings.widths))),
            Protocol::Rtex => Self::Rtex(Box::new(rtex::Decoder::new(settings.rtex, sample))),
            _ => Self::Tformat(Box::new(tformat::Decoder::new(0, settings.widths))),
        }
    }

    /// Takes a burst; of lines in one piece, when they are complete.
    fn take(&mut self, burst: Burst, whole: &mut Option<Burst>, out: &mut dyn Sink) -> io::Result<()> {
        match whole {
            Some(whole) if burst.spoilt.is_none() && whole.bytes.len() < MOST_JOINED => {
                whole.bytes.extend(burst.bytes);
                Ok(())
            }
            Some(whole) => {
                let line = burst.line;
                let before = std::mem::replace(whole, Burst::new(line, Vec::new()));
                self.burst(&before, out)?;
                self.burst(&burst, out)
            }
            None => self.burst(&burst, out),
        }
    }

    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(what) = &burst.spoilt {
            match self {
                Self::Tformat(decoder) => decoder.spoilt(out)?,
                Self::Nikon(decoder) => decoder.spoilt(),
                Self::Rtex(decoder) => decoder.spoilt(),
            }
            return out.event(&spoilt(burst.line, what));
        }
        match self {
            Self::Tformat(decoder) => decoder.burst(burst, out),
            Self::Nikon(decoder) => decoder.burst(burst, out),
            Self::Rtex(decoder) => decoder.burst(burst, out),
        }
    }

    fn finish(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        match self {
            Self::Tformat(decoder) => decoder.finish(None, out),
            Self::Nikon(decoder) => decoder.finish(None, out),
            Self::Rtex(decoder) => decoder.finish(out),
        }
    }
}

/// Bytes of lines that are taken in one piece, at most.
const MOST_JOINED: usize = 1 << 24;

/// A line of a log that is not bytes.
fn spoilt(line: u64, what: &str) -> Event {
    Event::new(Place::Line(line), None, "line", Vec::new(), Refusal::new("hex", what).into())
}
