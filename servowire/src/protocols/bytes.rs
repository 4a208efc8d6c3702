//! Logs of bytes: which protocol they hold, and its events.

use std::io;

use super::{Protocol, Settings, nikon, rtex, tformat};
use crate::capture::ByteLog;
use crate::capture::hexlog::Burst;
use crate::event::{Event, Place, Refusal};
use crate::fault::{At, Fault};
use crate::line::{StartStop, Stop};
use crate::output::{Output, Sink, Tally};

/// Bytes of a burst by which it is recognised.
const MOST_TRIED: usize = 1 << 14;
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

/// What a log may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Reading {
    protocol: Protocol,
    /// Its lines are as long as the tool that wrote them makes them, wherever the frames end.
    wrapped: bool,
}

/// The reading that was asked for, or the one of which most holds.
fn recognise(
    bursts: &[Burst],
    protocol: Protocol,
    settings: &Settings,
    out: &Output<'_>,
) -> Result<Reading, &'static str> {
    let wrapped = may_be_wrapped(bursts);
    let begin = |burst: &Burst| {
        let bytes = burst.bytes.get(..MOST_TRIED.min(burst.bytes.len())).unwrap_or_default().to_vec();
        Burst { bytes, spoilt: burst.spoilt.clone(), ..*burst }
    };
    let lines: Vec<Burst> = bursts.iter().map(begin).collect();
    let joined = lines.iter().flat_map(|burst| burst.bytes.iter().copied()).take(MOST_TRIED).collect();
    let joined = [Burst::new(1, joined)];
    let tally = |reading: Reading| {
        let mut tally = Tally::default();
        let bursts = if reading.wrapped { joined.as_slice() } else { lines.as_slice() };
        let mut reader = Reader::new(reading.protocol, settings, &lines);
        // A tally takes whatever comes.
        let _ = bursts.iter().try_for_each(|burst| reader.burst(burst, &mut tally));
        let _ = reader.finish(&mut tally);
        tally
    };
    // Lines as they are come before lines in one piece. A block of RTEX has no check sum, so it comes last among equals;
    // what leaves fewest refused wins.
    let all = [
        (Protocol::Tformat, false),
        (Protocol::Nikon, false),
        (Protocol::Tformat, true),
        (Protocol::Nikon, true),
        (Protocol::Rtex, false),
    ]
    .map(|(protocol, wrapped)| Reading { protocol, wrapped });
    let of = |meant: &dyn Fn(Protocol) -> bool| {
        let tried = all.into_iter().filter(|reading| meant(reading.protocol) && (wrapped || !reading.wrapped));
        let tried = tried.map(|reading| (tally(reading), reading));
        tried.reduce(|best, next| if share(next.0) > share(best.0) { next } else { best })
    };
    if protocol == Protocol::Auto {
        let Some((best, reading)) = of(&|_| true) else { return Err("no protocol of logs") };
        if best.ok > 0 && reading.protocol != Protocol::Tformat {
            out.note(&format!(
                "taken as {}, of which {} % of the first frames hold",
                reading.protocol.title(),
                share(best)
            ));
        }
        return Ok(reading);
    }
    let asked = of(&|known| known == protocol);
    if let Some((other, reading)) = of(&|known| known != protocol) {
        let held = asked.map_or(0, |(tally, _)| share(tally));
        // Blocks of RTEX have no check sum: not one may be refused, and hardly anything hold as it was meant.
        let sure = match reading.protocol {
            Protocol::Rtex => share(other) == 100 && 10 * held <= 100,
            _ => share(other) >= SURE && 2 * held <= share(other),
        };
        if other.ok > 1 && sure {
            let (title, all) = (reading.protocol.title(), other.ok + other.faults());
            out.note(&format!(
                "it looks like {title}: {} of {all} frames hold so; leave out what says otherwise",
                other.ok
            ));
        }
    }
    match (asked, protocol) {
        (Some((_, reading)), _) => Ok(reading),
        (None, Protocol::Sorte) => Err("SORTE is decoded from a pcapng file"),
        (None, _) => Err("HIPERFACE DSL is decoded from edges or samples of the line"),
    }
}

/// Per cent of the frames that hold where a log is what it was taken for.
const SURE: u64 = 80;

/// Lines of fewer bytes are written as they came.
const NARROW: usize = 8;

/// Whether all lines have as many bytes as a dump's, but for the last.
fn may_be_wrapped(bursts: &[Burst]) -> bool {
    let Some((last, rest)) = bursts.split_last() else { return false };
    let width = bursts.first().map_or(0, |first| first.bytes.len());
    let said = |burst: &Burst| burst.direction.is_some() || burst.spoilt.is_some();
    width >= NARROW
        && !rest.is_empty()
        && rest.iter().all(|burst| burst.bytes.len() == width)
        && last.bytes.len() <= width
        && !bursts.iter().any(said)
}

/// Frames that hold, in per cent.
fn share(tally: Tally) -> u64 {
    (100 * tally.ok).checked_div(tally.ok + tally.faults()).unwrap_or(0)
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
