use core::num::NonZeroU32;

use crate::Samples;

/// Shape of a start-stop field and how densely the line is sampled.
///
/// ```text
///  idle ─┐     ┌─────┬─────┬─   ─┬─────┬─────
///        │  0  │ c0  │ c1  │ ... │ cK-1│  1      K = 8 or 16 content bits, LSB first
///        └─────┴─────┴─────┴─   ─┴─────┘
///        start                    delimiter       N samples a bit
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Format {
    samples_per_bit: NonZeroU32,
    content_bits: u32,
}

/// A [`Format`] that the receiver does not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FormatError {
    /// 2 and 3 samples leave no room to find an edge; above 80 the limits below are not proved.
    #[error("{got} samples a bit: 1 (a plain bit stream) or 4 to 80 are possible")]
    SamplesPerBit {
        /// What was asked for.
        got: u32,
    },
    /// Fields carry a byte or a 16-bit word.
    #[error("{got} content bits: 8 or 16 are possible")]
    ContentBits {
        /// What was asked for.
        got: u32,
    },
}

impl Format {
    /// `samples_per_bit`: 4..=80, or 1 for a plain bit stream; `content_bits`: 8 or 16.
    ///
    /// # Errors
    /// [`FormatError`] for any other number.
    pub const fn new(samples_per_bit: u32, content_bits: u32) -> Result<Self, FormatError> {
        if !matches!(samples_per_bit, 1 | 4..=80) {
            return Err(FormatError::SamplesPerBit { got: samples_per_bit });
        }
        if !matches!(content_bits, 8 | 16) {
            return Err(FormatError::ContentBits { got: content_bits });
        }
        match NonZeroU32::new(samples_per_bit) {
            Some(samples_per_bit) => Ok(Self { samples_per_bit, content_bits }),
            None => Err(FormatError::SamplesPerBit { got: samples_per_bit }),
        }
    }

    /// Samples in one bit.
    pub const fn samples_per_bit(self) -> u32 {
        self.samples_per_bit.get()
    }

    /// Content bits of one field.
    pub const fn content_bits(self) -> u32 {
        self.content_bits
    }

    /// Bits of one field with start bit and delimiter: 10 or 18.
    pub const fn field_bits(self) -> u32 {
        self.content_bits.saturating_add(2)
    }

    /// Samples from the edge of a bit to the place where its level is taken.
    const fn middle(self) -> u32 {
        self.samples_per_bit.get() >> 1
    }
}

/// One field as it came from the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Field {
    /// The content bits, the first of the line in bit 0; 8 or 16 of them.
    pub content: u16,
    /// Whether the delimiter read 1. A field with `delimiter: false` is a framing error: nothing in it can be trusted.
    pub delimiter: bool,
    /// Index of the first low sample of the start bit, counted from the receiver's first sample.
    pub start: u64,
    /// Start bits that were dropped since the previous field because their middle read 1.
    pub spikes: u32,
}

/// Start-stop reception of a sampled line, with the clock recovered from every edge.
///
/// A falling edge on an idle line begins a field. A counter of N samples restarts at *every* edge, and a bit
/// is taken where it reaches N / 2. A start bit that reads 1 there was a spike and is dropped; a delimiter that
/// reads 0 is a framing error. After the delimiter the receiver hunts for the next falling edge, so fields may
/// follow each other with any pause or none.
///
/// The line may be fed sample by sample ([`push`](Self::push)), as runs of equal samples ([`run`](Self::run)) or
/// as packed words ([`feed`](Self::feed)); the results are identical, and the three may be mixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Receiver {
    format: Format,
    /// Level of the last sample.
    level: bool,
    /// Whether a field has begun.
    receiving: bool,
    /// Samples since the last edge, modulo the samples of a bit; meaningful while receiving.
    phase: u32,
    /// Bits taken of the present field, and how many.
    bits: u32,
    taken: u32,
    start: u64,
    spikes: u32,
    now: u64,
}

impl Receiver {
    /// A receiver on an idle (high) line.
    pub const fn new(format: Format) -> Self {
        Self { format, level: true, receiving: false, phase: 0, bits: 0, taken: 0, start: 0, spikes: 0, now: 0 }
    }

    /// The format it was made for.
    pub const fn format(&self) -> Format {
        self.format
    }

    /// Samples taken so far: the index of the next one.
    pub const fn position(&self) -> u64 {
        self.now
    }

    /// Whether a field has begun and not ended; at the end of a capture: whether it was cut off.
    pub const fn is_receiving(&self) -> bool {
        self.receiving
    }

    /// Takes one sample; gives a field when its delimiter was sampled.
    pub const fn push(&mut self, sample: bool) -> Option<Field> {
        let at = self.now;
        self.now = at.wrapping_add(1);
        let edge = sample != self.level;
        self.level = sample;
        if !self.receiving {
            if sample || !edge {
                return None;
            }
            self.begin(at);
        } else if edge {
            self.phase = 0;
        } else {
            self.phase = self.phase.wrapping_add(1);
            if self.phase == self.format.samples_per_bit.get() {
                self.phase = 0;
            }
        }
        if self.phase == self.format.middle() { self.take(sample, 1) } else { None }
    }

    /// Takes `len` samples of the same level at once: what is between two edges of a capture, or a part of it.
    ///
    /// At most one field ends in a run, because a field holds both levels.
    pub const fn run(&mut self, level: bool, len: u64) -> Option<Field> {
        if len == 0 {
            return None;
        }
        let at = self.now;
        self.now = at.wrapping_add(len);
        let edge = level != self.level;
        self.level = level;
        if !self.receiving {
            if level || !edge {
                return None;
            }
            self.begin(at);
        }
        let period = self.format.samples_per_bit.get();
        let middle = self.format.middle();
        // Samples since the edge before this run, and after it. A field is over long before LONGEST.
        let before = if edge { 0 } else { self.phase.wrapping_add(1) };
        let after = before.wrapping_add(if len < LONGEST as u64 { (len & 0xffff) as u32 } else { LONGEST });
        // Middles passed in `s` samples after an edge: (s + period - 1 - middle) / period.
        let shifted = after.wrapping_add(period).wrapping_sub(1).wrapping_sub(middle);
        let passed = div(shifted, self.format.samples_per_bit);
        let rest = shifted.wrapping_sub(passed.wrapping_mul(period)).wrapping_add(middle);
        self.phase = if rest < period { rest } else { rest.wrapping_sub(period) };
        let earlier = (before > middle) as u32;
        match passed.wrapping_sub(earlier) {
            0 => None,
            count => self.take(level, count),
        }
    }

    /// Takes samples off the front of `samples` until a field is complete or none are left.
    ///
    /// ```
    /// use nrz_line::{Format, Receiver, Samples};
    /// # use nrz_line::FormatError;
    /// # fn main() -> Result<(), FormatError> {
    /// let mut receiver = Receiver::new(Format::new(4, 8)?);
    /// // idle, start, 0x0f LSB first, delimiter: four samples each
    /// let mut samples = Samples::partial(0xf_0000_ffff_0fff, 52);
    /// let mut got = None;
    /// while let Some(field) = receiver.feed(&mut samples) {
    ///     got = Some((field.start, field.content, field.delimiter));
    /// }
    /// assert_eq!(got, Some((12, 0x0f, true)));
    /// # Ok(())
    /// # }
    /// ```
    pub const fn feed(&mut self, samples: &mut Samples) -> Option<Field> {
        while !samples.is_empty() {
            let (level, len) = samples.front_run();
            samples.skip(len);
            if let Some(field) = self.run(level, len as u64) {
                return Some(field);
            }
        }
        None
    }

    const fn begin(&mut self, at: u64) {
        self.receiving = true;
        self.phase = 0;
        self.bits = 0;
        self.taken = 0;
        self.start = at;
    }

    /// `count` bits of the same level were sampled, 1 or more; what is beyond the delimiter is idle line.
    const fn take(&mut self, level: bool, count: u32) -> Option<Field> {
        if level && self.taken == 0 {
            self.receiving = false;
            self.spikes = self.spikes.saturating_add(1);
            return None;
        }
        let whole = self.format.field_bits();
        let left = whole.wrapping_sub(self.taken);
        let count = if count < left { count } else { left };
        if level {
            self.bits |= 1_u32.wrapping_shl(count).wrapping_sub(1).wrapping_shl(self.taken);
        }
        self.taken = self.taken.wrapping_add(count);
        if self.taken < whole {
            return None;
        }
        self.receiving = false;
        let content = self.bits >> 1 & 1_u32.wrapping_shl(self.format.content_bits).wrapping_sub(1);
        let field =
            Field { content: (content & 0xffff) as u16, delimiter: level, start: self.start, spikes: self.spikes };
        self.spikes = 0;
        Some(field)
    }
}

/// More samples than the longest field (18 bits of 80 samples) and its next middle need.
const LONGEST: u32 = 2048;

/// A division that the compiler knows cannot fail.
const fn div(a: u32, by: NonZeroU32) -> u32 {
    match a.checked_div(by.get()) {
        Some(quotient) => quotient,
        None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wave;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Line bits of fields sent back to back, with idle line before and behind.
    fn line(content_bits: u32, fields: &[u16]) -> Vec<bool> {
        let mut bits = std::vec![true; 3];
        for field in fields {
            bits.push(false);
            bits.extend((0..content_bits).map(|k| field >> k & 1 == 1));
            bits.push(true);
        }
        bits.extend([true; 3]);
        bits
    }

    fn render(bits: &[bool], wave: Wave) -> Vec<(bool, u64)> {
        (0..).zip(bits).map(|(k, &b)| (b, wave.first_sample(k + 1) - wave.first_sample(k))).collect()
    }

    fn receive(format: Format, runs: &[(bool, u64)]) -> Vec<Field> {
        let mut receiver = Receiver::new(format);
        runs.iter().filter_map(|&(level, len)| receiver.run(level, len)).collect()
    }

    /// All contents that stress the clock: every 8-bit content; for 16 bits all with one or two runs and their neighbours.
    fn worst(content_bits: u32) -> Vec<u16> {
        if content_bits == 8 {
            return (0..=255).step_by(if cfg!(miri) { 51 } else { 1 }).collect();
        }
        let mut out: Vec<u16> = (0..=16)
            .flat_map(|k| {
                let low = (1_u32 << k) as u16;
                let ones = low.wrapping_sub(1);
                [ones, !ones, low, !low]
            })
            .collect();
        out.extend([0x5555, 0xaaaa, 0x8001, 0x7ffe, 0x00ff, 0xff00]);
        out
    }

    /// Whether fields of every worst content arrive at every phase of the sampler when the sender is `ppm` too fast.
    fn survives(samples: u32, content_bits: u32, ppm: i32) -> bool {
        let format = Format::new(samples, content_bits).unwrap();
        worst(content_bits).iter().all(|&content| {
            (0..32).step_by(if cfg!(miri) { 31 } else { 1 }).all(|phase| {
                let wave = Wave::new(samples, ppm, phase << 27);
                let fields = [content, content, !content];
                let got = receive(format, &render(&line(content_bits, &fields), wave));
                let mask = if content_bits == 8 { 0xff } else { 0xffff };
                got.len() == 3 && got.iter().zip(fields).all(|(g, want)| g.delimiter && g.content == want & mask)
            })
        })
    }

    /// The limits of the alignment rule, in per mille of the bit rate: (N, K, fast, slow).
    const LIMITS: [(u32, u32, i32, i32); 10] = [
        (8, 8, 43, 52),
        (13, 8, 54, 49),
        (16, 8, 51, 52),
        (40, 8, 55, 52),
        (80, 8, 57, 52),
        (4, 16, 15, 28),
        (5, 16, 24, 23),
        (6, 16, 20, 28),
        (8, 16, 22, 28),
        (80, 16, 29, 28),
    ];

    #[test]
    fn rate_tolerance_reaches_the_limits_and_ends_there() {
        for (samples, content_bits, fast, slow) in LIMITS.into_iter().take(if cfg!(miri) { 1 } else { LIMITS.len() }) {
            for ppm in (-slow * 1000 + 500..=fast * 1000 - 500).step_by(if cfg!(miri) { 80_000 } else { 3500 }) {
                assert!(survives(samples, content_bits, ppm), "N {samples}, K {content_bits}, {ppm} ppm");
            }
            for ppm in [fast * 1000 - 500, -slow * 1000 + 500] {
                assert!(survives(samples, content_bits, ppm), "N {samples}, K {content_bits}, {ppm} ppm");
            }
            // One per cent further the nine or seventeen bits without an edge are misread somewhere.
            for ppm in [fast * 1000 + 10_000, -slow * 1000 - 10_000] {
                assert!(!survives(samples, content_bits, ppm), "N {samples}, K {content_bits}, {ppm} ppm");
            }
        }
    }

    #[test]
    fn a_plain_bit_stream_at_any_offset() {
        let format = Format::new(1, 8).unwrap();
        for idle in 0..20 {
            let mut bits = std::vec![true; idle];
            bits.extend(line(8, &[0x92, 0x00, 0xff]));
            let runs: Vec<_> = bits.iter().map(|&b| (b, 1)).collect();
            let got = receive(format, &runs);
            let first = idle as u64 + 3;
            assert_eq!(
                got.iter().map(|f| (f.content, f.start)).collect::<Vec<_>>(),
                [(0x92, first), (0, first + 10), (0xff, first + 20)]
            );
        }
    }

    #[test]
    fn spikes_are_dropped_and_counted() {
        let format = Format::new(8, 8).unwrap();
        let mut receiver = Receiver::new(format);
        for (level, len) in [(true, 40), (false, 2), (true, 30), (false, 1), (true, 9)] {
            assert_eq!(receiver.run(level, len), None);
        }
        let got: Vec<_> =
            render(&line(8, &[0x1a]), Wave::new(8, 0, 0)).iter().filter_map(|&(l, n)| receiver.run(l, n)).collect();
        assert_eq!(got, [Field { content: 0x1a, delimiter: true, start: 82 + 24, spikes: 2 }]);
    }

    #[test]
    fn a_low_delimiter_is_a_framing_error_and_the_line_must_rise_again() {
        let mut receiver = Receiver::new(Format::new(4, 8).unwrap());
        assert_eq!(receiver.run(true, 8), None);
        let broken = receiver.run(false, 400).unwrap();
        assert!(!broken.delimiter);
        assert!(!receiver.is_receiving());
        assert_eq!(receiver.run(false, 400), None);
        let got: Vec<_> =
            render(&line(8, &[0x55]), Wave::new(4, 0, 0)).iter().filter_map(|&(l, n)| receiver.run(l, n)).collect();
        assert_eq!((got.len(), got[0].content, got[0].delimiter), (1, 0x55, true));
    }

    #[test]
    fn other_formats_are_refused() {
        for samples in (0..200).filter(|n| !matches!(n, 1 | 4..=80)) {
            assert_eq!(Format::new(samples, 8), Err(FormatError::SamplesPerBit { got: samples }));
        }
        assert_eq!(Format::new(8, 9), Err(FormatError::ContentBits { got: 9 }));
    }

    proptest! {
        /// Sample by sample, run by run and word by word give the same fields, however the input is cut.
        #[test]
        fn all_three_ways_agree(
            words in prop::collection::vec(prop_oneof![any::<u64>(), Just(0), Just(u64::MAX), (0..64u32).prop_map(|k| u64::MAX << k)], 1..60),
            cuts in prop::collection::vec(1..=64u32, 60),
            samples in prop_oneof![Just(1u32), 4..=80u32],
            content_bits in prop_oneof![Just(8u32), Just(16)],
        ) {
            let format = Format::new(samples, content_bits).unwrap();
            let (mut a, mut b, mut c) = (Receiver::new(format), Receiver::new(format), Receiver::new(format));
            let (mut by_sample, mut by_run, mut by_word) = (Vec::new(), Vec::new(), Vec::new());
            let all: Vec<bool> = words.iter().flat_map(|w| (0..64).map(move |k| w >> k & 1 == 1)).collect();
            by_sample.extend(all.iter().filter_map(|&s| a.push(s)));
            for run in all.chunk_by(|x, y| x == y) {
                by_run.extend(b.run(run[0], run.len() as u64));
            }
            for (word, cut) in words.iter().zip(cuts) {
                for mut part in [Samples::partial(*word, cut), Samples::partial(word.checked_shr(cut).unwrap_or(0), 64 - cut)] {
                    while let Some(field) = c.feed(&mut part) {
                        by_word.push(field);
                    }
                }
            }
            prop_assert_eq!(&by_sample, &by_run);
            prop_assert_eq!(&by_sample, &by_word);
            // While receiving, the whole state is the same; outside a field the phase has no meaning.
            prop_assert_eq!(a.is_receiving(), c.is_receiving());
            prop_assert_eq!(a.position(), c.position());
            if a.is_receiving() {
                prop_assert_eq!(a, b);
                prop_assert_eq!(a, c);
            }
        }
    }
}
