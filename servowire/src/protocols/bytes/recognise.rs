//! Which protocol a log of bytes holds, and whether its lines are its bursts.

use super::Reader;
use crate::capture::hexlog::Burst;
use crate::output::{Output, Tally};
use crate::protocols::{Protocol, Settings};

/// Bytes of a burst by which it is recognised.
const MOST_TRIED: usize = 1 << 14;
/// Per cent of the frames that hold where a log is what it was taken for.
const SURE: u64 = 80;
/// Lines of fewer bytes are written as they came.
const NARROW: usize = 8;

/// What a log may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Reading {
    pub(super) protocol: Protocol,
    /// Its lines are as long as the tool that wrote them makes them, wherever the frames end.
    pub(super) wrapped: bool,
}

/// All of them. Lines as they are come before lines in one piece. A block of RTEX has no check sum, so it comes last among
/// equals; what leaves fewest refused wins.
const READINGS: [Reading; 5] = [
    Reading { protocol: Protocol::Tformat, wrapped: false },
    Reading { protocol: Protocol::Nikon, wrapped: false },
    Reading { protocol: Protocol::Tformat, wrapped: true },
    Reading { protocol: Protocol::Nikon, wrapped: true },
    Reading { protocol: Protocol::Rtex, wrapped: false },
];

/// The reading that was asked for, or the one of which most holds.
pub(super) fn recognise(
    bursts: &[Burst],
    protocol: Protocol,
    settings: &Settings,
    out: &Output<'_>,
) -> Result<Reading, &'static str> {
    let sample = Sample::new(bursts, settings);
    if protocol == Protocol::Auto {
        let (best, reading) = sample.best(|_| true).ok_or("no protocol of logs")?;
        if best.ok > 0 && reading.protocol != Protocol::Tformat {
            let title = reading.protocol.title();
            out.note(&format!("taken as {title}, of which {} % of the first frames hold", share(best)));
        }
        return Ok(reading);
    }
    let asked = sample.best(|known| known == protocol);
    if let Some((other, title)) = sample.rather(protocol, asked.map_or(0, |(tally, _)| share(tally))) {
        let (ok, all) = (other.ok, other.ok + other.faults());
        out.note(&format!("it looks like {title}: {ok} of {all} frames hold so; leave out what says otherwise"));
    }
    asked.map(|(_, reading)| reading).ok_or(match protocol {
        Protocol::Sorte => "SORTE is decoded from a pcapng file",
        _ => "HIPERFACE DSL is decoded from edges or samples of the line",
    })
}

/// The first bursts of a log, as they are tried.
struct Sample<'a> {
    lines: Vec<Burst>,
    /// All of them in one piece, where the lines may be those of a dump.
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

    /// What holds by this reading; `None` where the lines are none of a dump.
    fn tally(&self, reading: Reading) -> Option<Tally> {
        let bursts = if reading.wrapped { self.joined.as_ref()?.as_slice() } else { self.lines.as_slice() };
        let mut tally = Tally::default();
        let mut reader = Reader::new(reading.protocol, self.settings, &self.lines);
        // A tally takes whatever comes.
        let _ = bursts.iter().try_for_each(|burst| reader.burst(burst, &mut tally));
        let _ = reader.finish(&mut tally);
        Some(tally)
    }

    /// The reading of which most holds, among those of the protocols that are meant.
    fn best(&self, meant: impl Fn(Protocol) -> bool) -> Option<(Tally, Reading)> {
        let tried = READINGS.into_iter().filter(|reading| meant(reading.protocol));
        let tried = tried.filter_map(|reading| Some((self.tally(reading)?, reading)));
        tried.reduce(|best, next| if share(next.0) > share(best.0) { next } else { best })
    }

    /// What the log is rather than what was asked for, of which `held` per cent hold.
    fn rather(&self, asked: Protocol, held: u64) -> Option<(Tally, &'static str)> {
        let (other, reading) = self.best(|known| known != asked)?;
        // Blocks of RTEX have no check sum: not one may be refused, and hardly anything hold as it was meant.
        let sure = match reading.protocol {
            Protocol::Rtex => share(other) == 100 && 10 * held <= 100,
            _ => share(other) >= SURE && 2 * held <= share(other),
        };
        (other.ok > 1 && sure).then(|| (other, reading.protocol.title()))
    }
}

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
