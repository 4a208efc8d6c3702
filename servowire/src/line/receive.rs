//! The receiver of `nrz-line` fed from changes with times and from packed samples.

use std::io;

use nrz_line::{Field, Format, Receiver, Samples};

use super::{LineField, Setup};
use crate::capture::raw::Words;
use crate::capture::time::Clock;

/// Samples a bit of the grid on which changes with times are laid.
const GRID: u32 = 80;

/// Behind a capture that ends with an idle line, so that the last delimiter is taken: bits.
const TAIL_BITS: u64 = 2;

/// Places fields of a receiver in the capture's time.
#[derive(Debug, Clone, Copy)]
struct Scale {
    clock: Clock,
    origin: i64,
    /// Length of a field in picoseconds.
    length: i64,
}

impl Scale {
    fn place(&self, field: Field) -> LineField {
        let start = self.origin.saturating_add(self.clock.time(field.start));
        LineField {
            content: field.content,
            delimiter: field.delimiter,
            start,
            end: start.saturating_add(self.length),
            spikes: field.spikes,
        }
    }
}

fn receiver(samples_per_bit: u32, content_bits: u32, setup: Setup) -> Option<(Receiver, i64)> {
    let format = Format::new(samples_per_bit, content_bits).ok()?;
    Some((Receiver::new(format), setup.bit() * i64::from(format.field_bits())))
}

/// Receives from level changes, on a grid of 80 samples a bit.
#[derive(Debug, Clone, Copy)]
pub struct EdgeReceiver {
    receiver: Option<Receiver>,
    scale: Scale,
    inverted: bool,
    /// Level since the last change, none before the first.
    level: Option<bool>,
    /// Samples of the grid up to the last change.
    ticks: u64,
}

impl EdgeReceiver {
    /// For fields of `content_bits`, 8 or 16.
    pub fn new(setup: Setup, content_bits: u32) -> Self {
        let clock = Clock::new(u64::from(setup.rate) * u64::from(GRID));
        let (receiver, length) = receiver(GRID, content_bits, setup).unzip();
        let scale = Scale { clock, origin: 0, length: length.unwrap_or_default() };
        Self { receiver, scale, inverted: setup.inverted, level: None, ticks: 0 }
    }

    /// The line takes a level.
    pub fn change(&mut self, time: i64, level: bool) -> Option<LineField> {
        let level = level != self.inverted;
        let before = self.level.replace(level);
        let Some(before) = before else {
            self.scale.origin = time;
            return None;
        };
        if before == level { None } else { self.lasted(before, time, 0) }
    }

    /// The capture ends.
    pub fn finish(&mut self, end: i64) -> Option<LineField> {
        let level = self.level?;
        self.lasted(level, end, if level { TAIL_BITS * u64::from(GRID) } else { 0 })
    }

    fn lasted(&mut self, level: bool, until: i64, more: u64) -> Option<LineField> {
        let ticks = self.scale.clock.index(until.saturating_sub(self.scale.origin)).max(self.ticks);
        let field = self.receiver.as_mut()?.run(level, ticks - self.ticks + more);
        self.ticks = ticks;
        field.map(|field| self.scale.place(field))
    }
}

/// Receives from samples at a whole number of samples a bit.
#[derive(Debug, Clone, Copy)]
pub struct SampleReceiver {
    receiver: Receiver,
    scale: Scale,
    channel: u16,
    inverted: bool,
    /// Level of the line at the receiver's position.
    level: bool,
}

impl SampleReceiver {
    /// Nothing where the samples of a bit are not a whole number from 4 to 80.
    pub fn new(clock: Clock, setup: Setup, content_bits: u32) -> Option<Self> {
        let rate = u64::from(setup.rate);
        if rate == 0 || clock.rate() % rate != 0 {
            return None;
        }
        let samples_per_bit = u32::try_from(clock.rate() / rate).ok()?;
        let (receiver, length) = receiver(samples_per_bit, content_bits, setup)?;
        let scale = Scale { clock, origin: 0, length };
        Some(Self { receiver, scale, channel: setup.channel, inverted: setup.inverted, level: true })
    }

    /// The channel to feed.
    pub fn channel(&self) -> u16 {
        self.channel
    }

    /// The line takes a level.
    pub fn change(&mut self, time: i64, level: bool) -> Option<LineField> {
        let field = self.reach(self.scale.clock.index(time));
        self.level = level != self.inverted;
        field
    }

    /// The line keeps its level up to sample `index`.
    pub fn reach(&mut self, index: u64) -> Option<LineField> {
        let field = self.receiver.run(self.level, index.saturating_sub(self.receiver.position()));
        field.map(|field| self.scale.place(field))
    }

    /// The next samples.
    pub fn words(&mut self, block: &Words, mut take: impl FnMut(&LineField) -> io::Result<()>) -> io::Result<()> {
        let flip = if self.inverted { u64::MAX } else { 0 };
        let mut left = block.samples;
        for word in &block.words {
            let mut samples = Samples::partial(word ^ flip, left.min(64) as u32);
            left = left.saturating_sub(64);
            while let Some(field) = self.receiver.feed(&mut samples) {
                take(&self.scale.place(field))?;
            }
        }
        if let Some(last) = block.words.last() {
            let used = (block.samples + 63) % 64;
            self.level = (last >> used & 1 == 1) != self.inverted;
        }
        Ok(())
    }

    /// The capture ends.
    pub fn finish(&mut self) -> Option<LineField> {
        let tail = if self.level { TAIL_BITS * u64::from(self.receiver.format().samples_per_bit()) } else { 0 };
        self.reach(self.receiver.position() + tail)
    }
}
