//! Logs of bytes: which protocol they hold, and its events.

mod recognise;

use std::io;

use recognise::recognise;

use crate::capture::ByteLog;
use crate::capture::hexlog::Burst;
use crate::codec::{Codec, Found, LogDecoder};
use crate::fault::{At, Fault, Stop};
use crate::output::Output;
use crate::recognition::Note;
use crate::settings::Settings;
use crate::sink::Sink;
use crate::time::{SECOND, Time};

/// Number of bursts from which the protocol is recognised.
const SAMPLE: usize = 256;
/// The same for a log that arrives slowly.
const FEW: usize = 16;

/// Decodes a log; if the protocol is unknown, with the one that has the most good frames.
pub(crate) fn decode(
    file: &str,
    mut log: ByteLog,
    protocol: Option<&'static dyn Codec>,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let mut bursts = Vec::new();
    let mut end = Ok(true);
    let mut origin = None;
    while bursts.len() < SAMPLE && end == Ok(true) && !is_enough(bursts.len(), &mut log) {
        match log.burst() {
            Ok(Some(burst)) => bursts.push(since_first(burst, &mut origin)),
            Ok(None) => end = Ok(false),
            Err(fault) => end = Err(fault),
        }
    }
    let reading = recognise(&bursts, protocol, settings, out);
    let (reading, mut reader) = reading.map_err(|what| Fault::new(file, At::File, what))?;
    if let Some(note) = reader.note() {
        out.note(&Note::Shape(note));
    }
    let mut whole = reading.wrapped.then(|| Burst::new(1, Vec::new()));
    for burst in bursts {
        join(reader.as_mut(), burst, &mut whole, out)?;
    }
    while end == Ok(true) && !out.is_done() {
        if log.is_due() {
            out.flush()?;
        }
        out.tick();
        match log.burst() {
            Ok(Some(burst)) => join(reader.as_mut(), since_first(burst, &mut origin), &mut whole, out)?,
            Ok(None) => end = Ok(false),
            Err(fault) => end = Err(fault),
        }
    }
    if let Some(whole) = whole.filter(|whole| !whole.bytes.is_empty()) {
        reader.take(&whole, out)?;
    }
    reader.end(out)?;
    finish(file, end.err(), reader.found())
}

/// What is wrong with the log where it breaks off and as a whole, and what needs attention all the same.
fn finish(file: &str, end: Option<Fault>, Found { misread, trouble }: Found) -> Result<(), Stop> {
    let (broken, needs_attention) = (end.is_some() || misread.is_some(), trouble.is_some());
    let (at, cut) = end.map_or((At::File, None), |fault| (fault.at, Some(fault.what)));
    let all: Vec<String> = [cut, misread, trouble].into_iter().flatten().collect();
    let fault = Fault::new(file, at, all.join("; "));
    match (broken, needs_attention) {
        (false, false) => Ok(()),
        (true, false) => Err(Stop::Fault(fault)),
        (_, true) => Err(Stop::Trouble { fault, broken }),
    }
}

/// Returns whether this many bursts have to be enough: no more arrive for now, or they arrive slowly.
fn is_enough(bursts: usize, log: &mut ByteLog) -> bool {
    bursts > 0 && log.pauses() || bursts >= FEW && log.is_due()
}

/// Counts times of day and dates from the first one, as in a capture; other times are already relative to the log.
fn since_first(burst: Burst, origin: &mut Option<Time>) -> Burst {
    let first = |time| if time < LATER { Time::ZERO } else { time };
    let time = burst.time.map(|time| time.since(*origin.get_or_insert_with(|| first(time))));
    Burst { time, ..burst }
}

/// A log whose first time is later than this has times of day or dates.
const LATER: Time = Time::from_ps(1_000 * SECOND as i128);

/// Passes on a burst, or joined lines once they are complete.
fn join(reader: &mut dyn LogDecoder, burst: Burst, whole: &mut Option<Burst>, out: &mut dyn Sink) -> io::Result<()> {
    match whole {
        Some(whole) if burst.spoilt.is_none() && whole.bytes.len() < MOST_JOINED => {
            whole.bytes.extend(burst.bytes);
            Ok(())
        }
        Some(whole) => {
            let line = burst.line;
            let before = std::mem::replace(whole, Burst::new(line, Vec::new()));
            reader.take(&before, out)?;
            reader.take(&burst, out)
        }
        None => reader.take(&burst, out),
    }
}

/// Maximum number of bytes of joined lines.
const MOST_JOINED: usize = 1 << 24;
