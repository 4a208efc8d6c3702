//! A line that is decoded: one channel, or two that are the same conversation.

use std::io;

use super::{EdgeReceiver, Rates, StartStop};
use crate::event::{Event, Place, Verdict};
use crate::output::Sink;

/// A channel and which way up it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tap {
    /// Index of the channel.
    pub channel: u16,
    /// Whether it idles low.
    pub inverted: bool,
}

/// Turns the levels of one idle-high line into events.
pub trait LineDecoder {
    /// The line takes a level.
    fn change(&mut self, time: i64, level: bool, out: &mut dyn Sink) -> io::Result<()>;

    /// The line has not changed until `time`.
    fn reach(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()>;

    /// The capture has a hole from the last change to `time`: nothing is known of the line there.
    fn gap(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()>;

    /// The capture ends at `time`.
    fn finish(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()>;

    /// What was measured of the line.
    fn rates(&self) -> Rates;
}

/// Decodes a start-stop protocol.
pub struct StartStopLine<P> {
    receiver: EdgeReceiver,
    protocol: P,
    bit: i64,
    begun: bool,
}

/// The last level of a capture is taken to last. If a frame does not hold so, it was cut off.
struct Held<'a> {
    out: &'a mut dyn Sink,
    end: i64,
}

impl Sink for Held<'_> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        match (event.place, &event.verdict) {
            (Place::Time { end, .. }, Verdict::Refused(_)) if end > self.end && !event.verdict.is_silence() => {
                self.out.event(&Event { fields: Vec::new(), verdict: Verdict::cut_off("a frame"), ..event.clone() })
            }
            _ => self.out.event(event),
        }
    }
}

impl<P: StartStop> StartStopLine<P> {
    /// `bit`: nominal length in picoseconds.
    pub fn new(bit: f64, protocol: P) -> Self {
        Self { receiver: EdgeReceiver::new(bit, P::CONTENT_BITS), protocol, bit: bit as i64, begun: false }
    }

    fn give(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        for field in self.receiver.take() {
            self.protocol.field(&field, out)?;
        }
        Ok(())
    }
}

impl<P: StartStop> LineDecoder for StartStopLine<P> {
    fn change(&mut self, time: i64, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        if !self.begun {
            self.begun = true;
            self.protocol.begin(time);
        }
        if self.receiver.change(time, level) { self.give(out) } else { Ok(()) }
    }

    fn reach(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()> {
        if self.receiver.reach(time) { self.give(out) } else { Ok(()) }
    }

    fn gap(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()> {
        self.finish(time, out)?;
        self.receiver = EdgeReceiver::new(self.bit as f64, P::CONTENT_BITS);
        self.begun = false;
        Ok(())
    }

    fn finish(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()> {
        let mut out = Held { out, end: time + self.bit };
        if self.receiver.finish(time) {
            self.give(&mut out)?;
        }
        self.protocol.finish(Some(time), &mut out)
    }

    fn rates(&self) -> Rates {
        self.receiver.rates()
    }
}

/// The wires of a lane as one idle-high line: a wire that is at work is low, so that both together are a half-duplex
/// line.
#[derive(Debug, Clone)]
pub struct Wires {
    taps: Vec<Tap>,
    levels: Vec<Option<bool>>,
    level: Option<bool>,
}

impl Wires {
    /// One tap, or that of the requests and that of the answers.
    pub fn new(taps: &[Tap]) -> Self {
        Self { taps: taps.to_vec(), levels: vec![None; taps.len()], level: None }
    }

    /// Nothing is known of the levels any more.
    pub fn forget(&mut self) {
        self.levels.fill(None);
        self.level = None;
    }

    /// The level of the line behind a change of a channel, where it changes.
    pub fn change(&mut self, channel: u16, level: bool) -> Option<bool> {
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
