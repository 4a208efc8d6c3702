//! A line that is decoded: one channel, or two that carry the same conversation.

use std::io;

use super::receive::Rates;
use crate::capture::Hole;
use crate::capture::samples::Samples;
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

    /// Takes the next samples; equivalent to taking their changes.
    fn samples(&mut self, samples: Samples<'_>, out: &mut dyn Sink) -> io::Result<()> {
        for (time, level) in samples.changes() {
            self.change(time, level, out)?;
        }
        Ok(())
    }

    /// The line has not changed until `time`.
    fn reach(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()>;

    /// The recording has a hole, in which nothing is known about the line.
    fn hole(&mut self, hole: Hole, out: &mut dyn Sink) -> io::Result<()>;

    /// The capture ends at `time`.
    fn finish(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()>;

    /// From now on failed frames are not read a second time, for a first impression of the line.
    fn look_once(&mut self) {}

    /// Returns the measurements of the line.
    fn rates(&self) -> Rates;
}

/// The wires of a lane combined into one idle-high line: an active wire is low, so both together form a half-duplex line.
#[derive(Debug, Clone)]
pub(crate) struct Wires {
    taps: Vec<Tap>,
    levels: Vec<Option<bool>>,
    level: Option<bool>,
}

impl Wires {
    /// Creates the wires from one tap, or from one for the requests and one for the answers.
    pub(crate) fn new(taps: &[Tap]) -> Self {
        Self { taps: taps.to_vec(), levels: vec![None; taps.len()], level: None }
    }

    /// Sets the level of the only wire, as an idle-high line, whose changes were not passed here.
    pub(crate) fn keep(&mut self, level: bool) {
        self.levels.fill(Some(level));
        self.level = Some(level);
    }

    /// Forgets the levels.
    pub(crate) fn forget(&mut self) {
        self.levels.fill(None);
        self.level = None;
    }

    /// Returns the level of the line after a change of a channel, if it changes.
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
