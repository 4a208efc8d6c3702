//! Recognises which protocol a log of bytes holds, and whether each line is a burst.

use crate::capture::hexlog::Burst;
use crate::codec::{Codec, LogDecoder};
use crate::output::Output;
use crate::protocols::CODECS;
use crate::recognition::Note;
use crate::settings::Settings;
use crate::sink::Tally;

/// Bytes of a burst that are used to recognise it.
const MOST_TRIED: usize = 1 << 14;
/// Minimum share of good frames, in per cent, if a log is what it was assumed to be.
const SURE: u64 = 80;
/// Lines shorter than this contain bytes as they arrived.
const NARROW: usize = 8;

/// A possible reading of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Reading {
    pub(super) protocol: &'static dyn Codec,
    /// The tool that wrote its lines set their length, regardless of where frames end.
    pub(super) wrapped: bool,
}

/// All of them. Lines as they are take precedence over joined lines. Among equals a protocol without a check comes last,
/// and only with lines as they are; the reading with the fewest refused frames wins.
fn readings() -> impl Iterator<Item = Reading> {
    let of = |checked: bool, wrapped: bool| {
        let codecs = CODECS.iter().filter(move |codec| codec.checked == checked);
        codecs.map(move |protocol| Reading { protocol: *protocol, wrapped })
    };
    of(true, false).chain(of(true, true)).chain(of(false, false))
}

/// Returns the requested reading, or the one with the most good frames, and a decoder for it.
pub(super) fn recognise(
    bursts: &[Burst],
    protocol: Option<&'static dyn Codec>,
    settings: &Settings,
    out: &Output<'_>,
) -> Result<(Reading, Box<dyn LogDecoder>), &'static str> {
    let sample = Sample::new(bursts, settings);
    let reading = match protocol {
        None => {
            let (best, reading) = sample.best(|_| true).ok_or("no protocol of logs")?;
            // That it is the first of the table goes without saying.
            if best.ok > 0 && CODECS.first() != Some(&reading.protocol) {
                out.note(&Note::Log { protocol: reading.protocol, share: share(best) });
            }
            reading
        }
        Some(asked) => {
            let best = sample.best(|known| known == asked);
            if let Some((tally, protocol)) = sample.rather(asked, best.map_or(0, |(tally, _)| share(tally))) {
                out.note(&Note::LogRather { protocol, tally });
            }
            best.ok_or(asked.needs)?.1
        }
    };
    let reader = reading.protocol.log(settings, bursts).ok_or(reading.protocol.needs)?;
    Ok((reading, reader))
}

/// The first bursts of a log, as they are tried.
struct Sample<'a> {
    lines: Vec<Burst>,
    /// All of them joined, if the lines may be those of a dump.
    joined: Option<[Burst; 1]>,
    settings: &'a Settings,
}

impl<'a> Sample<'a> {
    fn new(bursts: &[Burst], settings: &'a Settings) -> Self {
        let begin = |burst: &Burst| {
            let bytes = burst.bytes.get(..MOST_TRIED.min(burst.bytes.len())).unwrap_or_default().to_vec();
            Burst { bytes, spoilt: burst.spoilt.clone(), ..*burst }
        };
        let lines: Vec<Burst> = bursts.iter().map(begin).collect();
        let joined = may_be_wrapped(bursts).then(|| {
            let bytes = lines.iter().flat_map(|burst| burst.bytes.iter().copied()).take(MOST_TRIED).collect();
            [Burst::new(1, bytes)]
        });
        Self { lines, joined, settings }
    }

    /// Returns the frames that are good in this reading; `None` if the lines are not a dump, or if no protocol decodes logs.
    fn tally(&self, reading: Reading) -> Option<Tally> {
        let bursts = if reading.wrapped { self.joined.as_ref()?.as_slice() } else { self.lines.as_slice() };
        let mut tally = Tally::default();
        let mut reader = reading.protocol.log(self.settings, &self.lines)?;
        // A tally takes whatever comes.
        let _ = bursts.iter().try_for_each(|burst| reader.take(burst, &mut tally));
        let _ = reader.end(&mut tally);
        Some(tally)
    }

    /// Returns the reading with the most good frames, among those of the protocols in question.
    fn best(&self, meant: impl Fn(&'static dyn Codec) -> bool) -> Option<(Tally, Reading)> {
        let tried = readings().filter(|reading| meant(reading.protocol));
        let tried = tried.filter_map(|reading| Some((self.tally(reading)?, reading)));
        tried.reduce(|best, next| if share(next.0) > share(best.0) { next } else { best })
    }

    /// Returns what the log is, if that differs from what was requested; as requested, `held` per cent of its frames are good.
    fn rather(&self, asked: &'static dyn Codec, held: u64) -> Option<(Tally, &'static dyn Codec)> {
        let (other, reading) = self.best(|known| known != asked)?;
        // Of what has no check not one may be refused, and hardly anything hold as it was meant.
        let sure = if reading.protocol.checked {
            share(other) >= SURE && 2 * held <= share(other)
        } else {
            share(other) == 100 && 10 * held <= 100
        };
        (other.ok > 1 && sure).then_some((other, reading.protocol))
    }
}

/// Returns whether all lines except the last have as many bytes as the lines of a dump.
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

/// Returns the share of good frames, in per cent.
fn share(tally: Tally) -> u64 {
    (100 * tally.ok).checked_div(tally.ok + tally.faults()).unwrap_or(0)
}
