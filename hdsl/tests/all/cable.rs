//! A simulated cable between master and encoder: delay, jitter, glitches, bit errors and the encoder's clock.

#![allow(dead_code, reason = "fuzz targets, examples and kernels take it too, and none of them all of it")]

use hdsl::Window;
use hdsl::device::{Heard, Transmission};
use hdsl::frame::{ANSWER_BITS, Head, SAMPLES_PER_BIT};
use hdsl::sampling::WINDOW;

/// What the line does to what passes. All zero is a perfect line of no length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Disturbance {
    /// From the start of reception to the first bit of an answer, in eighths of a bit (13.333 ns): there and back.
    pub(crate) delay: u32,
    /// How much of that is on the way to the encoder.
    pub(crate) down_delay: u32,
    /// Every edge is moved by up to this many samples either way.
    pub(crate) jitter: u8,
    /// Samples that are inverted, of a million.
    pub(crate) glitches: u32,
    /// Bits that are inverted, of a million, in each direction.
    pub(crate) bit_errors: u32,
    /// How much the bits of an answer are longer than the master's, in parts of a million. (Heads are too short to show it.)
    pub(crate) clock_ppm: i32,
}

impl Disturbance {
    pub(crate) const fn with_delay(self, delay: u32) -> Self {
        Self { delay, ..self }
    }

    pub(crate) const fn with_jitter(self, jitter: u8) -> Self {
        Self { jitter, ..self }
    }

    pub(crate) const fn with_glitches(self, glitches: u32) -> Self {
        Self { glitches, ..self }
    }

    pub(crate) const fn with_bit_errors(self, bit_errors: u32) -> Self {
        Self { bit_errors, ..self }
    }

    pub(crate) const fn with_clock_ppm(self, clock_ppm: i32) -> Self {
        Self { clock_ppm, ..self }
    }

    /// A clean line of `metres`: 5 ns a metre each way, and most of a bit for encoder and transceivers.
    pub(crate) const fn metres(metres: u32) -> Self {
        // 3/40 eighths of a bit a ns.
        let delay = metres.saturating_mul(10).saturating_mul(3) / 40;
        let down_delay = metres.saturating_mul(5).saturating_mul(3) / 40;
        Self { delay: delay.saturating_add(7), down_delay, jitter: 0, glitches: 0, bit_errors: 0, clock_ppm: 0 }
    }
}

/// The cable with its source of noise. A seed gives always the same noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cable {
    /// What happens to what passes.
    pub(crate) disturbance: Disturbance,
    noise: Noise,
}

impl Cable {
    /// With a seed for the noise.
    pub(crate) const fn new(disturbance: Disturbance, seed: u64) -> Self {
        Self { disturbance, noise: Noise(seed.wrapping_mul(2).wrapping_add(1)) }
    }

    /// The head of an H-frame as it reaches the encoder.
    pub(crate) fn down(&mut self, head: Window) -> Window {
        let mut bits = head.bits();
        for at in 0..head.len() {
            bits ^= u128::from(self.noise.hits(self.disturbance.bit_errors)) << at;
        }
        Window::from_bits(bits, head.len()).unwrap_or(head)
    }

    /// The head of an H-frame as it reaches the encoder, at eight samples a bit: a byte each, its first sample in bit 7. The time of
    /// the first sample is that at which SYNC leaves the master.
    pub(crate) fn down_samples(&mut self, head: Head) -> [u8; DOWN_WINDOW] {
        let mut words = [0; DOWN_WINDOW / 8];
        let mut high = true;
        for (at, byte) in (0_u32..).step_by(8).zip(head.samples()) {
            let byte = if self.noise.hits(self.disturbance.bit_errors) { !byte } else { byte };
            for sample in 0..8 {
                if (byte << sample & 0x80 != 0) != high {
                    high = !high;
                    self.edge(&mut words, i64::from(at.saturating_add(sample)), self.disturbance.down_delay);
                }
            }
        }
        self.sampled(words)
    }

    /// What the master samples of an answer: a byte a bit time, the first sample in bit 7. Without an answer the line
    /// stays high.
    pub(crate) fn up(&mut self, answer: Option<Transmission>) -> [u8; WINDOW] {
        self.up_from(answer, self.disturbance.delay)
    }

    /// The same of an encoder that keeps time by what it has heard: its answer begins one bit after PARA by its own clock.
    pub(crate) fn up_heard(&mut self, answer: Option<Transmission>, heard: &Heard) -> [u8; WINDOW] {
        let there = u32::from(heard.start).saturating_sub(self.disturbance.down_delay);
        let early = self.disturbance.down_delay.saturating_sub(heard.start.into());
        self.up_from(answer, self.disturbance.delay.saturating_add(there).saturating_sub(early))
    }

    fn up_from(&mut self, answer: Option<Transmission>, delay: u32) -> [u8; WINDOW] {
        let mut words = [0; WINDOW / 8];
        if let Some(answer) = answer {
            let bits = self.spoilt(answer.bits);
            self.edges(bits, delay, &mut words);
        }
        self.sampled(words)
    }

    /// From edges to samples, with glitches.
    fn sampled<const WORDS: usize, const BYTES: usize>(&mut self, mut words: [u64; WORDS]) -> [u8; BYTES] {
        fill(&mut words);
        if self.disturbance.glitches > 0 {
            for word in &mut words {
                for at in 0..64 {
                    *word ^= u64::from(self.noise.hits(self.disturbance.glitches)) << at;
                }
            }
        }
        let mut samples = [0; BYTES];
        for (to, from) in samples.chunks_exact_mut(8).zip(words) {
            to.copy_from_slice(&from.to_be_bytes());
        }
        samples
    }

    fn spoilt(&mut self, mut bits: u64) -> u64 {
        if self.disturbance.bit_errors > 0 {
            for at in 0..ANSWER_BITS {
                bits ^= u64::from(self.noise.hits(self.disturbance.bit_errors)) << at;
            }
        }
        bits
    }

    /// Marks the samples at which the level changes, the first sample in bit 63 of the first word.
    fn edges(&mut self, bits: u64, delay: u32, words: &mut [u64]) {
        // Ones before and after the answer.
        let line = u128::from(bits) << 1 | 1 | u128::MAX << ANSWER_BITS.wrapping_add(1);
        let mut changes = (line ^ line >> 1) & (1_u128 << ANSWER_BITS.wrapping_add(1)).wrapping_sub(1);
        let scale = i64::from(self.disturbance.clock_ppm).saturating_add(1_000_000);
        while changes != 0 {
            let bit = changes.trailing_zeros();
            changes &= changes.wrapping_sub(1);
            let nominal = i64::from(bit.saturating_mul(SAMPLES_PER_BIT)).saturating_mul(scale) / 1_000_000;
            self.edge(words, nominal, delay);
        }
    }

    /// One edge after a delay, with jitter.
    fn edge(&mut self, words: &mut [u64], nominal: i64, delay: u32) {
        let place = nominal.saturating_add(i64::from(delay)).saturating_add(self.jitter());
        let place = usize::try_from(place).unwrap_or(0);
        if let Some(word) = words.get_mut(place / 64) {
            *word ^= 1 << (63 & !place);
        }
    }

    fn jitter(&mut self) -> i64 {
        let jitter = self.disturbance.jitter;
        if jitter == 0 {
            return 0;
        }
        let span = u64::from(jitter).saturating_mul(2).saturating_add(1);
        let drawn = self.noise.below(span);
        i64::try_from(drawn).unwrap_or(0).saturating_sub(i64::from(jitter))
    }
}

/// Bytes of samples in which the encoder hears a head: 35 bits with the longest EXTRA window, and room for a delay of 13.
pub(crate) const DOWN_WINDOW: usize = 48;

// In words of 64 samples.
#[allow(clippy::manual_is_multiple_of, reason = "the oldest Rust has it not")]
const _: () = assert!(WINDOW % 8 == 0 && DOWN_WINDOW % 8 == 0);

/// From edges to levels: every sample is the level before it, inverted at each edge. The line is high at first.
fn fill(words: &mut [u64]) {
    let mut high = true;
    for word in words {
        let mut level = *word;
        for shift in [1, 2, 4, 8, 16, 32] {
            level ^= level >> shift;
        }
        *word = if high { !level } else { level };
        high = *word & 1 == 1;
    }
}

/// A small generator of pseudo-random numbers (xorshift).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Noise(u64);

impl Noise {
    const fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32
    }

    /// 0..limit, for limits far below 2^32.
    const fn below(&mut self, limit: u64) -> u64 {
        self.next().wrapping_mul(limit) >> 32
    }

    /// True `rate` times of a million.
    const fn hits(&mut self, rate: u32) -> bool {
        rate != 0 && self.below(1_000_000) < rate as u64
    }
}
