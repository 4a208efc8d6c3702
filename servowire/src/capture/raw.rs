//! Samples at a fixed rate without a header: `sigrok-cli -O binary`, memory dumps of an FPGA.
//!
//! Two ways out: level changes of all channels, as from every other format; and for one channel the samples
//! themselves, packed 64 a word, which is what a receiver takes fastest.

use super::time::Clock;
use super::{Change, Input, Line};
use crate::fault::{At, Fault};

/// How a file holds a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// One channel, eight samples a byte, the oldest in bit 0.
    Bit,
    /// So many bytes a sample, little endian, bit k = channel k.
    Bytes(usize),
}

/// Bytes read at once: a multiple of 64 samples of every unit.
const BLOCK: usize = 1 << 16;

/// A file of samples.
pub struct Raw {
    input: Input,
    unit: Unit,
    clock: Clock,
    channels: Vec<String>,
    block: Vec<u8>,
    /// The last sample, for the changes.
    last: Option<u64>,
    samples: u64,
    /// Reported when the whole samples before it have been taken.
    ragged: Option<Fault>,
}

/// Samples of one channel.
#[derive(Debug, Default)]
pub struct Words {
    /// 64 samples each, the oldest in bit 0.
    pub words: Vec<u64>,
    /// Samples in all words together; the last word may be filled in part.
    pub samples: u64,
}

impl Raw {
    /// `rate` in samples a second.
    pub fn new(input: Input, rate: u64, unit: Unit) -> Self {
        let (unit, channels) = match unit {
            Unit::Bit => (Unit::Bit, 1),
            Unit::Bytes(n) => (Unit::Bytes(n.clamp(1, 8)), 8 * n.clamp(1, 8)),
        };
        let channels = (0..channels).map(|c| c.to_string()).collect();
        Self {
            input,
            unit,
            clock: Clock::new(rate),
            channels,
            block: vec![0; BLOCK],
            last: None,
            samples: 0,
            ragged: None,
        }
    }

    /// Between sample numbers and times.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Samples read so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Reads a block; gives its length in bytes and in samples, 0 at the end.
    fn fill(&mut self) -> Result<(usize, u64), Fault> {
        if let Some(fault) = self.ragged.take() {
            return Err(fault);
        }
        let Unit::Bytes(n) = self.unit else {
            let at = At::Byte(self.samples / 8);
            let got = self.input.read_full(&mut self.block).map_err(|e| self.input.io_fault(at, &e))?;
            return Ok((got, got as u64 * 8));
        };
        let at = self.samples * n as u64;
        // Whole words of 64 samples for units of 3, 5, 6 or 7 bytes too.
        let buffer = self.block.get_mut(..BLOCK / 64 / n * 64 * n).unwrap_or_default();
        let got = self.input.read_full(buffer).map_err(|e| self.input.io_fault(At::Byte(at), &e))?;
        let rest = got % n;
        if rest != 0 {
            let what = format!("{rest} bytes are left, where a sample has {n}: cut off, or another --unit-size");
            self.ragged = Some(self.input.fault(At::Byte(at + (got - rest) as u64), what));
        }
        Ok((got - rest, (got / n) as u64))
    }

    /// The next samples of a channel, packed; none at the end.
    pub fn words(&mut self, channel: u16, out: &mut Words) -> Result<bool, Fault> {
        let (bytes, samples) = self.fill()?;
        self.samples += samples;
        let block = self.block.get(..bytes).unwrap_or_default();
        out.samples = samples;
        out.words.clear();
        match self.unit {
            Unit::Bit => out.words.extend(block.chunks(8).map(little_endian)),
            Unit::Bytes(1) => out.words.extend(block.chunks(64).map(|chunk| pack_bytes(chunk, channel))),
            Unit::Bytes(n) => out.words.extend(block.chunks(64 * n).map(|chunk| {
                chunk.chunks(n).rev().fold(0, |word, sample| word << 1 | little_endian(sample) >> channel & 1)
            })),
        }
        Ok(samples != 0 || self.ragged.is_some())
    }

    /// The changes between the last sample and the next ones, whose bits are the channels.
    fn differences(&mut self, bytes: usize, changes: &mut Vec<Change>) {
        let block = self.block.get(..bytes).unwrap_or_default();
        let all = if self.channels.len() == 64 { u64::MAX } else { (1 << self.channels.len()) - 1 };
        let mut see = |index: u64, sample: u64| {
            let mut changed = self.last.map_or(all, |last| last ^ sample);
            while changed != 0 {
                let channel = changed.trailing_zeros() as u16;
                changes.push(Change { time: self.clock.time(index), channel, level: sample >> channel & 1 == 1 });
                changed &= changed - 1;
            }
            self.last = Some(sample);
        };
        match self.unit {
            Unit::Bit => {
                for (index, &byte) in (self.samples..).step_by(8).zip(block) {
                    for bit in 0..8 {
                        see(index + bit, u64::from(byte >> bit & 1));
                    }
                }
            }
            Unit::Bytes(n) => {
                for (index, sample) in (self.samples..).zip(block.chunks(n)) {
                    see(index, little_endian(sample));
                }
            }
        }
    }
}

impl Line for Raw {
    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let (bytes, samples) = self.fill()?;
        self.differences(bytes, changes);
        self.samples += samples;
        Ok(samples != 0 || self.ragged.is_some())
    }

    fn reached(&self) -> i64 {
        self.clock.time(self.samples)
    }
}

/// Up to 8 bytes as a number.
fn little_endian(bytes: &[u8]) -> u64 {
    match bytes.first_chunk() {
        Some(whole) => u64::from_le_bytes(*whole),
        None => bytes.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte)),
    }
}

/// Bit `channel` of up to 64 bytes in one word: of eight bytes at a time, a product gathers the bits in its top byte.
fn pack_bytes(chunk: &[u8], channel: u16) -> u64 {
    let mut word = 0;
    for (k, eight) in chunk.chunks(8).enumerate() {
        let ones = little_endian(eight) >> channel & 0x0101_0101_0101_0101;
        word |= (ones.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * k);
    }
    word
}
