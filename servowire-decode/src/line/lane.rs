//! A line that is decoded: one channel, or two that are the same conversation.

use std::io;

use super::evidence::{CERTAIN, Evidence, Weights};
use super::receive::{EdgeReceiver, Rates};
use super::start_stop::StartStop;
use crate::capture::Hole;
use crate::capture::samples::Samples;
use crate::event::{Event, Verdict};
use crate::sink::Sink;
use crate::time::Time;

/// A channel and which way up it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Tap {
    /// Index of the channel.
    pub(crate) channel: u16,
    /// Whether it idles low.
    pub(crate) inverted: bool,
}

/// Turns the levels of one idle-high line into events.
pub trait LineDecoder {
    /// The line takes a level.
    fn change(&mut self, time: Time, level: bool, out: &mut dyn Sink) -> io::Result<()>;

    /// The next samples: the same as their changes.
    fn samples(&mut self, samples: Samples<'_>, out: &mut dyn Sink) -> io::Result<()> {
        for (time, level) in samples.changes() {
            self.change(time, level, out)?;
        }
        Ok(())
    }

    /// The line has not changed until `time`.
    fn reach(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()>;

    /// The recording has a hole: nothing is known of the line there.
    fn hole(&mut self, hole: Hole, out: &mut dyn Sink) -> io::Result<()>;

    /// The capture ends at `time`.
    fn finish(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()>;

    /// What was measured of the line.
    fn rates(&self) -> Rates;
}

/// Decodes a start-stop protocol.
pub(crate) struct StartStopLine<P> {
    receiver: EdgeReceiver,
    protocol: P,
    weights: Weights,
    bit: i64,
    /// The level at the beginning was given.
    begun: bool,
    /// The first changes, as long as it is not known where the first field begins.
    opening: Vec<(Time, bool)>,
}

/// Changes from which the first field is found at most.
const OPENING: usize = 256;
/// Bits of idle line after which what was said at first is over.
const OPENED: i64 = 60;
/// Falling edges that may be the first start bit.
const STARTS: u32 = 18;

/// The last level of a recording is taken to last. If a frame does not hold so, it was cut off.
struct Held<'a> {
    out: &'a mut dyn Sink,
    end: Time,
    /// What a frame is then.
    cut: &'a Verdict,
}

impl Sink for Held<'_> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        let lasts = event.place.end().is_some_and(|end| end > self.end);
        let refused = !event.verdict.is_ok() && !event.verdict.is_silence();
        if event.verdict == Verdict::cut_off() || lasts && refused {
            return self.out.event(&Event { fields: Vec::new(), verdict: self.cut.clone(), ..event.clone() });
        }
        self.out.event(event)
    }
}

impl<P: StartStop + Clone> StartStopLine<P> {
    /// `bit`: nominal length in picoseconds; `weights`: what sound frames of the protocol prove.
    pub(crate) fn new(bit: f64, protocol: P, weights: Weights) -> Self {
        let receiver = EdgeReceiver::new(bit, P::CONTENT_BITS);
        Self { receiver, protocol, weights, bit: bit as i64, begun: false, opening: Vec::new() }
    }

    fn give(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        for field in self.receiver.take() {
            self.protocol.field(&field, out)?;
        }
        Ok(())
    }

    fn take(&mut self, time: Time, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        if self.receiver.change(time, level) { self.give(out) } else { Ok(()) }
    }

    /// Nothing more is known from `time` on; `cut`: what becomes of a frame that is not over.
    fn end(&mut self, time: Time, cut: &Verdict, out: &mut dyn Sink) -> io::Result<()> {
        if !self.opening.is_empty() {
            self.open(out)?;
        }
        let mut out = Held { out, end: time + self.bit, cut };
        if self.receiver.finish(time) {
            self.give(&mut out)?;
        }
        self.protocol.finish(time, &mut out)
    }

    /// Whether the line is at work when the recording begins, so that the first falling edge need not be a start bit.
    fn begins_inside(&self) -> bool {
        match self.opening.as_slice() {
            [(begin, true), (fall, _), ..] => *fall - *begin < i64::from(P::CONTENT_BITS + 3) * self.bit,
            _ => true,
        }
    }

    /// What was said at first is over: finds the start bit from which most of it holds, and takes it.
    fn open(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let opening = std::mem::take(&mut self.opening);
        let whole = 2 * i64::from(P::CONTENT_BITS + 2) * self.bit;
        let falls = |(_, level): &&(Time, bool)| !level;
        let first = opening.iter().skip(1).find(falls).map_or(Time::ZERO, |(time, _)| *time);
        let starts = opening.iter().skip(1).filter(falls).filter(|(time, _)| *time - first < whole).count() as u32;
        let (mut best, mut most) = (0, i64::MIN);
        for skipped in 0..starts.min(STARTS) {
            let mut evidence = Evidence::new(self.weights);
            let receiver = EdgeReceiver::new(self.bit as f64, P::CONTENT_BITS).beginning_at(skipped);
            let mut trial = Self { receiver, protocol: self.protocol.clone(), opening: Vec::new(), ..*self };
            for (time, level) in &opening {
                trial.take(*time, *level, &mut evidence)?;
            }
            let end = opening.last().map_or(Time::ZERO, |(time, _)| *time) + OPENED * self.bit;
            trial.finish(end, &mut evidence)?;
            if evidence.score > most {
                (best, most) = (skipped, evidence.score);
            }
            if skipped == 0 && evidence.score >= CERTAIN && evidence.tally.faults() == 0 {
                break;
            }
        }
        self.receiver = EdgeReceiver::new(self.bit as f64, P::CONTENT_BITS).beginning_at(best);
        for (time, level) in opening {
            self.take(time, level, out)?;
        }
        Ok(())
    }
}

impl<P: StartStop + Clone> LineDecoder for StartStopLine<P> {
    fn change(&mut self, time: Time, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        if !self.begun {
            self.begun = true;
            self.protocol.begin(time);
            self.opening.push((time, level));
            return Ok(());
        }
        let Some((last, _)) = self.opening.last() else { return self.take(time, level, out) };
        let over = self.opening.len() > 1 && time - *last > OPENED * self.bit || self.opening.len() >= OPENING;
        if over {
            self.open(out)?;
            return self.take(time, level, out);
        }
        self.opening.push((time, level));
        if self.begins_inside() {
            return Ok(());
        }
        for (time, level) in std::mem::take(&mut self.opening) {
            self.take(time, level, out)?;
        }
        Ok(())
    }

    fn reach(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        if let [_, .., (last, _)] = self.opening.as_slice() {
            if time - *last <= OPENED * self.bit {
                return Ok(());
            }
            self.open(out)?;
        }
        if self.opening.is_empty() && self.receiver.reach(time) { self.give(out) } else { Ok(()) }
    }

    fn hole(&mut self, hole: Hole, out: &mut dyn Sink) -> io::Result<()> {
        self.end(hole.from, &Verdict::in_a_hole(), out)?;
        self.receiver = EdgeReceiver::new(self.bit as f64, P::CONTENT_BITS);
        self.begun = false;
        Ok(())
    }

    fn finish(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        self.end(time, &Verdict::cut_off(), out)
    }

    fn rates(&self) -> Rates {
        self.receiver.rates()
    }
}

/// The wires of a lane as one idle-high line: a wire that is at work is low, so that both together are a half-duplex
/// line.
#[derive(Debug, Clone)]
pub(crate) struct Wires {
    taps: Vec<Tap>,
    levels: Vec<Option<bool>>,
    level: Option<bool>,
}

impl Wires {
    /// One tap, or that of the requests and that of the answers.
    pub(crate) fn new(taps: &[Tap]) -> Self {
        Self { taps: taps.to_vec(), levels: vec![None; taps.len()], level: None }
    }

    /// Nothing is known of the levels any more.
    pub(crate) fn forget(&mut self) {
        self.levels.fill(None);
        self.level = None;
    }

    /// The level of the line after a change of a channel, where it changes.
    pub(crate) fn change(&mut self, channel: u16, level: bool) -> Option<bool> {
        for (tap, own) in self.taps.iter().zip(&mut self.levels) {
            if tap.channel == channel {
                *own = Some(level != tap.inverted);
            }
        }
        let all = self.levels.iter().all(|level| level.unwrap_or(true));
        (self.level != Some(all)).then(|| {
            self.level = Some(all);
            all
        })
    }
}
