//! Logs of bytes: which protocol they hold, and its events.

use std::io;

use super::{Protocol, Settings, nikon, rtex, tformat};
use crate::capture::ByteLog;
use crate::capture::hexlog::Burst;
use crate::event::{Event, Place, Refusal};
use crate::fault::{At, Fault};
use crate::line::{StartStop, Stop};
use crate::output::{Output, Sink, Tally};

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
    let Some(protocol) = recognise(&bursts, protocol, settings, out) else {
        return Err(Fault::new(file, At::File, "HIPERFACE DSL is decoded from edges or samples of the line").into());
    };
    let mut reader = Reader::new(protocol, settings, &bursts);
    if let Reader::Rtex(decoder) = &reader {
        decoder.shape_note().iter().for_each(|note| out.note(note));
    }
    for burst in &bursts {
        reader.burst(burst, out)?;
    }
    while end == Ok(true) {
        if log.pauses() {
            out.flush()?;
        }
        out.tick();
        match log.burst() {
            Ok(Some(burst)) => reader.burst(&burst, out)?,
            Ok(None) => end = Ok(false),
            Err(fault) => end = Err(fault),
        }
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

/// The protocol asked for, or the one of which most holds.
fn recognise(bursts: &[Burst], protocol: Protocol, settings: &Settings, out: &Output<'_>) -> Option<Protocol> {
    match protocol {
        Protocol::Tformat | Protocol::Rtex | Protocol::Nikon => return Some(protocol),
        Protocol::Hdsl | Protocol::Sorte => return None,
        Protocol::Auto => {}
    }
    // A block of RTEX has no check sum, so it comes last among equals; what leaves fewest refused wins.
    let tried = [Protocol::Tformat, Protocol::Nikon, Protocol::Rtex].map(|protocol| {
        let mut tally = Tally::default();
        let mut reader = Reader::new(protocol, settings, bursts);
        // A tally takes whatever comes.
        let _ = bursts.iter().try_for_each(|burst| reader.burst(burst, &mut tally));
        let _ = reader.finish(&mut tally);
        (share(tally), protocol)
    });
    let (best, protocol) = tried.into_iter().reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    if best > 0 && protocol != Protocol::Tformat {
        out.note(&format!("taken as {}, of which {best} % of the first frames hold", protocol.title()));
    }
    Some(protocol)
}

/// Frames that hold, in per cent.
fn share(tally: Tally) -> u64 {
    (100 * tally.ok).checked_div(tally.ok + tally.refused).unwrap_or(0)
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

    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(what) = &burst.spoilt {
            if let Self::Rtex(decoder) = self {
                decoder.spoilt();
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

/// A line of a log that is not bytes.
fn spoilt(line: u64, what: &str) -> Event {
    Event::new(Place::Line(line), None, "line", Vec::new(), Refusal::new("hex", what).into())
}
