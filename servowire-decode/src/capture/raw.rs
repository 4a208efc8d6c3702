//! Samples at a fixed rate without a header: `sigrok-cli -O binary`, memory dumps of an FPGA, the content of a session.

use super::input::Input;
use super::recording::{Change, Hole, Line};
use super::samples::{Samples, little_endian};
use crate::fault::{At, Fault};
use crate::time::{Clock, Time};

/// How a file holds a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// One channel, eight samples per byte, the oldest in bit 0.
    Bit,
    /// This many bytes per sample, little endian, bit k = channel k.
    Bytes(usize),
}

/// Bytes read at once: a multiple of 64 samples of any unit.
const BLOCK: usize = 1 << 16;

/// A file of samples.
pub struct Raw {
    input: Input,
    unit: Unit,
    clock: Clock,
    channels: Vec<String>,
    /// The channel of each bit of a sample.
    of_bit: Vec<Option<u16>>,
    block: Vec<u8>,
    /// How much of it is filled and has not been read yet, in bytes and samples.
    filled: Option<(usize, u64)>,
    /// The samples of one channel in it, eight per byte.
    packed: Vec<u8>,
    /// The last sample, from which changes are determined.
    last: Option<u64>,
    samples: u64,
    /// Reported when the whole samples before it have been taken.
    ragged: Option<Fault>,
    /// What was skipped before the next data.
    hole: Option<Hole>,
}

impl Raw {
    /// Creates a recording; `rate` in samples per second. Channels are named by their numbers.
    pub fn new(input: Input, rate: u64, unit: Unit) -> Self {
        let bits = match unit {
            Unit::Bit => 1,
            Unit::Bytes(n) => 8 * n.clamp(1, 8) as u16,
        };
        Self::with_channels(input, rate, unit, (0..bits).map(|bit| (bit, bit.to_string())).collect())
    }

    /// `channels`: bit of the sample and name.
    pub(crate) fn with_channels(input: Input, rate: u64, unit: Unit, channels: Vec<(u16, String)>) -> Self {
        let unit = match unit {
            Unit::Bit => Unit::Bit,
            Unit::Bytes(n) => Unit::Bytes(n.clamp(1, 8)),
        };
        let mut of_bit = vec![None; 64];
        for (channel, (bit, _)) in (0..).zip(&channels) {
            if let Some(place) = of_bit.get_mut(usize::from(*bit)) {
                *place = Some(channel);
            }
        }
        let channels = channels.into_iter().map(|(_, name)| name).collect();
        Self {
            input,
            unit,
            clock: Clock::new(rate),
            channels,
            of_bit,
            block: vec![0; BLOCK],
            filled: None,
            packed: Vec::new(),
            last: None,
            samples: 0,
            ragged: None,
            hole: None,
        }
    }

    /// Converts between sample numbers and times.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Reads a block; returns its length in bytes and in samples, 0 at the end.
    fn fill(&mut self) -> Result<(usize, u64), Fault> {
        if let Some(filled) = self.filled.take() {
            return Ok(filled);
        }
        if let Some(fault) = self.ragged.take() {
            return Err(fault);
        }
        let Unit::Bytes(n) = self.unit else {
            let at = At::Byte(self.samples / 8);
            let got = self.input.read_full(&mut self.block, 1).map_err(|e| self.input.io_fault(at, &e))?;
            return Ok((got, got as u64 * 8));
        };
        let at = self.samples * n as u64;
        let buffer = self.block.get_mut(..BLOCK / 8 / n * 8 * n).unwrap_or_default();
        let got = self.input.read_full(buffer, n).map_err(|e| self.input.io_fault(At::Byte(at), &e))?;
        let rest = got % n;
        if rest != 0 {
            let what = format!("{rest} bytes are left over, but a sample has {n}: cut off, or another --unit-size");
            self.ragged = Some(self.input.fault(At::Byte(at + (got - rest) as u64), what));
        }
        Ok((got - rest, (got / n) as u64))
    }

    /// Packs the samples of one channel, if a sample is one byte. Returns `None` if another channel moves, or if the
    /// samples do not fill whole bytes.
    fn pack(&mut self, channel: u16, bytes: usize) -> Option<()> {
        const ONES: u64 = 0x0101_0101_0101_0101;
        let last = self.last?;
        let bit = self.of_bit.iter().position(|own| *own == Some(channel))?;
        if bytes % 8 != 0 || bit >= 8 {
            return None;
        }
        let others = (self.mask() & 0xff & !(1 << bit)) * ONES;
        let still = ((last & 0xff) * ONES) & others;
        self.packed.resize(bytes / 8, 0);
        for (packed, eight) in self.packed.iter_mut().zip(self.block.get(..bytes)?.chunks_exact(8)) {
            let samples = little_endian(eight);
            if samples & others != still {
                return None;
            }
            // This gathers the bits of eight bytes in the highest byte.
            *packed = ((samples >> bit & ONES).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8;
        }
        self.last = self.block.get(..bytes)?.last().map_or(self.last, |last| Some(u64::from(*last)));
        Some(())
    }

    /// Returns the bits that are channels.
    fn mask(&self) -> u64 {
        (0..64).filter(|bit| self.of_bit.get(*bit).copied().flatten().is_some()).fold(0, |m, bit| m | 1 << bit)
    }

    /// Appends the changes between the last sample and the next ones, if the bits of a sample are the channels.
    fn differences(&mut self, bytes: usize, changes: &mut Vec<Change>) {
        let mask = self.mask();
        let block = self.block.get(..bytes).unwrap_or_default();
        let mut last = self.last;
        let (clock, of_bit) = (self.clock, &self.of_bit);
        let mut see = |last: &mut Option<u64>, index: u64, sample: u64| {
            let mut changed = last.map_or(mask, |last| (last ^ sample) & mask);
            *last = Some(sample);
            while changed != 0 {
                let bit = changed.trailing_zeros();
                if let Some(channel) = of_bit.get(bit as usize).copied().flatten() {
                    changes.push(Change { time: clock.time(index), channel, level: sample >> bit & 1 == 1 });
                }
                changed &= changed - 1;
            }
        };
        match self.unit {
            Unit::Bit => {
                for (index, chunk) in (self.samples..).step_by(64).zip(block.chunks(8)) {
                    let (word, count) = (little_endian(chunk), 8 * chunk.len() as u64);
                    if last.is_none() {
                        see(&mut last, index, word & 1);
                    }
                    // A bit is 1 where a sample differs from the previous one.
                    let before = last.unwrap_or(0);
                    let mut edges = word ^ (word << 1 | before);
                    if count < 64 {
                        edges &= (1 << count) - 1;
                    }
                    while edges != 0 {
                        let at = u64::from(edges.trailing_zeros());
                        see(&mut last, index + at, word >> at & 1);
                        edges &= edges - 1;
                    }
                }
            }
            Unit::Bytes(1) => {
                for (index, eight) in (self.samples..).step_by(8).zip(block.chunks(8)) {
                    // Eight samples like the previous one: no change.
                    let same = last.is_some_and(|last| little_endian(eight) == (last & 0xff) * 0x0101_0101_0101_0101);
                    if !same {
                        for (k, sample) in (0..).zip(eight) {
                            if last != Some(u64::from(*sample)) {
                                see(&mut last, index + k, u64::from(*sample));
                            }
                        }
                    }
                }
            }
            Unit::Bytes(n) => {
                for (index, sample) in (self.samples..).zip(block.chunks(n)) {
                    let sample = little_endian(sample);
                    if last != Some(sample) {
                        see(&mut last, index, sample);
                    }
                }
            }
        }
        self.last = last;
    }
}

impl Line for Raw {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.input)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let (bytes, samples) = self.fill()?;
        self.differences(bytes, changes);
        self.samples += samples;
        Ok(samples != 0 || self.ragged.is_some())
    }

    fn samples(&mut self, channel: u16) -> Option<Result<Samples<'_>, Fault>> {
        if !matches!(self.unit, Unit::Bit | Unit::Bytes(1)) {
            return None;
        }
        let last = self.last?;
        let (bytes, samples) = match self.fill() {
            Ok(got) => got,
            Err(fault) => return Some(Err(fault)),
        };
        let first = self.samples;
        let (block, before) = if self.unit == Unit::Bit {
            let block = self.block.get(..bytes).unwrap_or_default();
            self.last = Some(block.last().map_or(last & 1, |last| u64::from(last >> 7)));
            (block, last & 1)
        } else if self.pack(channel, bytes).is_some() {
            let bit = self.of_bit.iter().position(|own| *own == Some(channel))?;
            (self.packed.as_slice(), last >> bit & 1)
        } else {
            self.filled = Some((bytes, samples));
            return None;
        };
        self.samples += samples;
        Some(Ok(Samples::new(block, first, before == 1, self.clock)))
    }

    fn reached(&self) -> Time {
        self.clock.time(self.samples)
    }

    fn hole(&mut self) -> Option<Hole> {
        self.hole.take()
    }

    /// Skips whole blocks of 64 samples, in a file that can seek.
    fn skip(&mut self, to: Time) -> Result<bool, Fault> {
        let (from, next) = (self.samples, self.clock.index(to) / 64 * 64);
        let bytes = |samples: u64| match self.unit {
            Unit::Bit => samples / 8,
            Unit::Bytes(n) => samples.saturating_mul(n as u64),
        };
        if next <= from || from % 64 != 0 || self.ragged.is_some() {
            return Ok(false);
        }
        let at = At::Byte(bytes(from));
        if !self.input.skip(bytes(next - from)).map_err(|e| self.input.io_fault(at, &e))? {
            return Ok(false);
        }
        self.hole = Some(Hole { from: self.clock.time(from), to: self.clock.time(next) });
        (self.samples, self.last) = (next, None);
        Ok(true)
    }
}
