//! Converts 75 MHz samples to bits: where to sample, how long the cable delays the answer, and how good the edges are.
//!
//! Reception begins one bit after the end of PARA. A byte holds the eight samples of one bit time of the master, the first one
//! in bit 7. The line is high until the encoder drives it.

mod gather;

use crate::error::Error;
use crate::frame::ANSWER_BITS;
use crate::ranged::ranged;
use crate::rssi::{EdgeWatch, Rssi, edges, lowest};
use gather::{Gather, Words};

/// Number of bytes of samples that a receiver takes for one answer: 61 bits and room for a delay of up to 11.
pub const WINDOW: usize = 72;

/// The test pattern that the encoder answers during START, LEARN and CHECK, first line bit in bit 0.
///
/// ```text
/// 0100110011001000000100010101110111111011001100110100010011001
/// ```
#[expect(clippy::indexing_slicing, reason = "runs at compile time")]
pub const TEST_PATTERN: u64 = {
    let text = b"0100110011001000000100010101110111111011001100110100010011001";
    let mut bits = 0;
    let mut at = 0;
    while at < text.len() {
        if text[at] == b'1' {
            bits |= 1 << at;
        }
        at += 1;
    }
    bits
};

servowire_core::number! {
    /// The index in every byte of samples at which the bit is taken, 0..=7; 0 is the first sample in time.
    pub struct SampleIndex(u8, 3);
}

ranged! {
    /// Number of bits before an answer, 0..=11: the round-trip delay of the cable, about 100 ns or 10 m per bit.
    pub struct Delay(0..=11);
}

impl SampleIndex {
    /// E = (4 + n) mod 8 with n ones in the byte that holds a falling edge (HDSL Protocol Design): the middle of the
    /// bits that begin at that edge.
    ///
    /// ```
    /// use hdsl::sampling::SampleIndex;
    /// // The bit begins at sample 5; its middle is sample 1 of the next byte.
    /// assert_eq!(SampleIndex::after_falling_edge(0b1111_1000).get(), 1);
    /// ```
    #[expect(clippy::cast_possible_truncation, reason = "at most eight ones")]
    pub const fn after_falling_edge(byte: u8) -> Self {
        Self::truncate((byte.count_ones() as u8).wrapping_add(4))
    }

    /// Does the same for a byte that holds a rising edge, as drawn in the design document, where the formula counts from the
    /// last sample.
    ///
    /// ```
    /// use hdsl::sampling::SampleIndex;
    /// // The drawing: the bit begins at sample 3, E is 1 from the right.
    /// assert_eq!(SampleIndex::after_rising_edge(0b0001_1111).get(), 6);
    /// ```
    pub const fn after_rising_edge(byte: u8) -> Self {
        Self::truncate(7_u8.wrapping_sub(Self::after_falling_edge(byte).get()))
    }

    /// Returns the bit that a byte of samples represents.
    #[inline]
    pub const fn bit(self, samples: u8) -> bool {
        samples >> (7 & !self.get()) & 1 == 1
    }

    /// Returns the first 128 bits of a line, the first one in bit 0.
    pub fn bits(self, samples: &[u8]) -> u128 {
        let mut parts = [0; 4];
        for (part, bytes) in parts.iter_mut().zip(samples.chunks(32)) {
            *part = self.word(bytes);
        }
        let [a, b, c, d] = parts.map(u128::from);
        a | b << 32 | c << 64 | d << 96
    }

    /// Returns the bits of up to 32 bytes, the first in bit 0.
    #[inline]
    fn word(self, samples: &[u8]) -> u32 {
        let mut words = samples.chunks_exact(4);
        let gather = Gather::new(self);
        let mut bits = 0;
        let mut len = 0_u32;
        for word in &mut words {
            let [a, b, c, d] = *word else { break };
            bits = bits >> 4 | gather.four(u32::from_le_bytes([a, b, c, d]));
            len = len.saturating_add(4);
        }
        // The newest bits are at the top; at most eight words have come.
        let whole = bits.checked_shr(32_u32.saturating_sub(len)).unwrap_or(0);
        let rest = (len..).zip(words.remainder());
        rest.fold(whole, |bits, (at, byte)| bits | u32::from(self.bit(*byte)).wrapping_shl(at))
    }
}

/// How the first falling edge is derived from its byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum EdgeRule {
    /// The ones before the edge count.
    #[default]
    Leading,
    /// All ones of the byte count, as in the vendor's receiver. If the edge falls on the boundary of two bytes and the next
    /// edge comes a sample early, the one after that edge is counted too, and the pattern is not found.
    All,
}

/// What the receiver learns from the answer to a START frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Alignment {
    /// Where to sample.
    pub index: SampleIndex,
    /// Number of bits before the answer.
    pub delay: Delay,
}

/// An answer extracted from its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SampledAnswer {
    /// The 61 bits, the first in bit 0.
    pub bits: u64,
    /// Where the edges were.
    pub edges: EdgeWatch,
}

impl Alignment {
    /// Finds the sampling index from the first falling edge, and the delay from the position of the test pattern.
    ///
    /// The vendor's receiver begins at a delay of 1; even at 0 m, encoder and transceivers need most of a bit.
    ///
    /// `samples` holds one byte per bit time, the first sample in bit 7; [`WINDOW`] of them allow for every delay.
    ///
    /// # Errors
    /// [`Error::Truncated`] for fewer than 61 bytes, [`Error::NoEdge`] if the line stayed high,
    /// [`Error::PatternNotFound`].
    pub fn learn(rule: EdgeRule, samples: &[u8]) -> Result<Self, Error> {
        let room = room(samples, Delay::MIN)?;
        let Some(edge) = samples.iter().find(|byte| **byte != 0xff) else { return Err(Error::NoEdge) };
        let edge = match rule {
            EdgeRule::All => *edge,
            // Without what comes after the first zero.
            EdgeRule::Leading => *edge & !(!*edge).checked_ilog2().map_or(0, |zero| (1_u8 << zero).wrapping_sub(1)),
        };
        let index = SampleIndex::after_falling_edge(edge);
        let line = index.bits(samples);
        // Shifted bit by bit.
        let mut rest = line;
        let found = (0..=room).map_while(Delay::new).find(|_| {
            let found = low61(rest) == TEST_PATTERN;
            rest >>= 1;
            found
        });
        found.map(|delay| Self { index, delay }).ok_or(Error::PatternNotFound { index: index.get() })
    }

    /// Returns the 61 bits of an answer, the first in bit 0.
    ///
    /// # Errors
    /// [`Error::Truncated`] if the samples end before the answer.
    pub fn bits(self, samples: &[u8]) -> Result<u64, Error> {
        match samples.first_chunk() {
            Some(window) => Ok(Words::of_bytes(window, self.delay).bits(self)),
            None => self.read(samples).map(|read| read.bits),
        }
    }

    /// Returns bits and edges of the answer.
    ///
    /// # Errors
    /// [`Error::Truncated`] if the samples end before the answer.
    pub fn read(self, samples: &[u8]) -> Result<SampledAnswer, Error> {
        match samples.first_chunk() {
            Some(window) => Ok(self.read_window(window)),
            None => self.read_short(samples),
        }
    }

    /// Does the same for a whole window.
    pub(crate) fn read_window(self, samples: &[u8; WINDOW]) -> SampledAnswer {
        Words::of_bytes(samples, self.delay).read(self)
    }

    /// Does the same for words of four bytes each, the first byte in the low bits, for processors that load only whole words.
    pub fn read_words(self, samples: &[u32; WINDOW / 4]) -> SampledAnswer {
        Words::of_words(samples, self.delay).read(self)
    }

    /// EDGES: the sample periods of an answer in which there are edges.
    pub(crate) fn edges(self, samples: &[u8; WINDOW]) -> u8 {
        let from = usize::from(self.delay.get());
        let answer = samples.iter().skip(from).take(ANSWER_BITS as usize);
        let before = from.checked_sub(1).and_then(|at| samples.get(at)).copied().unwrap_or(0xff);
        let fold = |(seen, before): (u8, u8), byte: &u8| (seen | edges(before & 1 == 1, *byte), *byte);
        answer.fold((0, before), fold).0.reverse_bits()
    }

    /// Returns the bits of an answer, and the RSSI of one `quarter` of them, 0..=3.
    #[inline]
    pub(crate) fn read_quarter(self, samples: &[u8; WINDOW], quarter: u8) -> (u64, Rssi) {
        let at = usize::from(self.delay.get() & !3).saturating_add(usize::from(quarter).wrapping_mul(16));
        let (before, from) = samples.split_at_checked(at).unwrap_or((&[], samples));
        // A window has room for the last quarter after the longest delay.
        let four: u128 = from.first_chunk().map_or(u128::MAX, |four| u128::from_le_bytes(*four));
        let word = |at: u32| low32(four >> at).swap_bytes();
        let words = [word(0), word(32), word(64), word(96)].into_iter();
        let before = before.last().map_or(u32::MAX, |byte| u32::from(*byte));
        (Words::of_bytes(samples, self.delay).bits(self), self.quarter(before, words, quarter))
    }

    /// Does the same for words.
    #[inline]
    pub(crate) fn read_quarter_words(self, samples: &[u32; WINDOW / 4], quarter: u8) -> (u64, Rssi) {
        let at = usize::from(self.delay.get() / 4).saturating_add(usize::from(quarter).wrapping_mul(4));
        let (before, from) = samples.split_at_checked(at).unwrap_or((&[], samples));
        let before = before.last().map_or(u32::MAX, |word| word.swap_bytes());
        let words = from.iter().map(|word| word.swap_bytes());
        (Words::of_words(samples, self.delay).bits(self), self.quarter(before, words, quarter))
    }

    #[inline(always)]
    fn quarter(self, before: u32, words: impl Iterator<Item = u32>, quarter: u8) -> Rssi {
        let eighths = u32::from(self.delay.get() & 3).wrapping_mul(8);
        // The first bytes are before the answer, the last ones after it.
        let begin = if quarter == 0 { u32::MAX.wrapping_shr(eighths) } else { u32::MAX };
        let end = if quarter == 3 { u32::MAX.wrapping_shl(24_u32.wrapping_sub(eighths)) } else { u32::MAX };
        Rssi::of_ones(lowest(before, words.zip([begin, u32::MAX, u32::MAX, end])))
    }

    /// Does the same for fewer bytes than a window has, which may be enough for a short delay.
    #[cold]
    fn read_short(self, samples: &[u8]) -> Result<SampledAnswer, Error> {
        room(samples, self.delay)?;
        let mut window = [0xff; WINDOW];
        for (to, from) in window.iter_mut().zip(samples) {
            *to = *from;
        }
        Ok(self.read_window(&window))
    }

    /// RSSI of the answer: the smallest over its bits (HDSL Protocol Design).
    ///
    /// # Errors
    /// [`Error::Truncated`] if the samples end before the answer.
    pub fn rssi(self, samples: &[u8]) -> Result<Rssi, Error> {
        self.read(samples).map(|read| read.edges.rssi())
    }
}

/// Returns how many bytes there are beyond those of an answer that begins after `delay`; 255 at most.
fn room(samples: &[u8], delay: Delay) -> Result<u8, Error> {
    let want = usize::from(delay.get()).saturating_add(ANSWER_BITS as usize);
    let rest = samples.len().checked_sub(want).ok_or_else(|| short(samples, delay))?;
    Ok(u8::try_from(rest).unwrap_or(u8::MAX))
}

#[cold]
fn short(samples: &[u8], delay: Delay) -> Error {
    let want = usize::from(delay.get()).saturating_add(ANSWER_BITS as usize);
    Error::Truncated {
        got: u16::try_from(samples.len()).unwrap_or(u16::MAX),
        want: u16::try_from(want).unwrap_or(u16::MAX),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the lower 32 bits")]
const fn low32(line: u128) -> u32 {
    line as u32
}

#[expect(clippy::cast_possible_truncation, reason = "masked to 61 bits")]
const fn low61(line: u128) -> u64 {
    line as u64 & (u64::MAX >> 3)
}

/// Creates the samples of a line that carries an answer `delay` eighths of a bit after reception began, with ones before and
/// after it: the input of [`Alignment::bits`].
///
/// ```
/// use hdsl::sampling::{Alignment, EdgeRule, TEST_PATTERN, line};
/// let found = Alignment::learn(EdgeRule::Leading, &line(TEST_PATTERN, 13));
/// assert_eq!(found.map(|a| (a.index.get(), a.delay.get())), Ok((1, 2)));
/// ```
pub fn line(bits: u64, delay: u32) -> [u8; WINDOW] {
    // Eight bits at a time: the one under way and the one before it.
    let bit = |at: u32| if at < ANSWER_BITS { bits >> at & 1 == 1 } else { true };
    let byte = |at: u32| if bit(at) { 0xff_u8 } else { 0 };
    let (whole, part) = (delay / 8, delay % 8);
    core::array::from_fn(|k| {
        let at = u32::try_from(k).unwrap_or(u32::MAX);
        let present = at.checked_sub(whole).map_or(0xff, byte);
        let before = at.checked_sub(whole.saturating_add(1)).map_or(0xff, byte);
        let pair = u16::from_be_bytes([before, present]);
        let [_, samples] = (pair >> part).to_be_bytes();
        samples
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_delay_of_a_clean_line() {
        for delay in (0..=100_u32).step_by(crate::thin(9)) {
            let got = Alignment::learn(EdgeRule::All, &line(TEST_PATTERN, delay));
            if delay >= 92 {
                assert!(matches!(got, Err(Error::PatternNotFound { .. })), "{delay}");
                continue;
            }
            let got = got.unwrap();
            assert_eq!(u32::from(got.index.get()), (delay + 4) % 8);
            assert_eq!(u32::from(got.delay.get()), (delay + 4) / 8);
            assert_eq!(got.rssi(&line(TEST_PATTERN, delay)).map(Rssi::get), Ok(12));
            for bits in [0, 0x0123_4567_89ab_cdef, u64::MAX >> 3] {
                assert_eq!(got.bits(&line(bits, delay)), Ok(bits & u64::MAX >> 3));
            }
        }
        assert_eq!(Alignment::learn(EdgeRule::All, &[0xff; 72]), Err(Error::NoEdge));
        assert_eq!(Alignment::learn(EdgeRule::All, &[0xff; 60]), Err(Error::Truncated { got: 60, want: 61 }));
        let late = Alignment { index: SampleIndex::truncate(4), delay: Delay(5) };
        assert_eq!(late.bits(&[0; 65]), Err(Error::Truncated { got: 65, want: 66 }));
    }

    /// Four bytes at a time against one by one, at all indices and delays, with edges anywhere.
    #[test]
    fn words_equal_bytes() {
        let mut seed = 1_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        };
        // Any number of bytes, of which the first 128 count.
        let long: std::vec::Vec<u8> = (0..140).map(|_| noise()).collect();
        for (len, index) in (0..=140).zip((0..8).cycle()) {
            let index = SampleIndex::truncate(index);
            let slow = (0..len.min(128)).fold(0_u128, |bits, at| bits | u128::from(index.bit(long[at])) << at);
            assert_eq!(index.bits(&long[..len]), slow);
        }
        for round in (0..200).step_by(crate::thin(150)) {
            let mut samples = line(0x0f0f_3355_1234_5678, 3 + round % 40);
            for byte in &mut samples {
                // From clean to nothing but noise.
                *byte ^= if u32::from(noise()) < round { noise() } else { 0 };
            }
            for index in 0..8 {
                let index = SampleIndex::truncate(index);
                let slow = (0..72).fold(0_u128, |bits, at| bits | u128::from(index.bit(samples[at])) << at);
                assert_eq!(index.bits(&samples), slow);
                for delay in (0..=11).map_while(Delay::new) {
                    let from = usize::from(delay.get());
                    let mut watch = EdgeWatch::new(from == 0 || samples[from - 1] & 1 == 1);
                    for byte in &samples[from..from + 61] {
                        watch.step(*byte);
                    }
                    let bits = (slow >> from) as u64 & (u64::MAX >> 3);
                    let place = Alignment { index, delay };
                    let read = SampledAnswer { bits, edges: watch };
                    assert_eq!((place.read(&samples), place.bits(&samples)), (Ok(read), Ok(bits)));
                    // Not one byte more than the answer is needed.
                    let short = &samples[..from + 61];
                    assert_eq!((place.read(short), place.bits(short)), (Ok(read), Ok(bits)));
                    assert!(place.read(&samples[..from + 60]).is_err() && place.bits(&samples[..from + 60]).is_err());
                    let words = core::array::from_fn(|k| u32::from_le_bytes(*samples[4 * k..].first_chunk().unwrap()));
                    assert_eq!(place.read_words(&words), read);
                    // A quarter of the signal at a time is all of it after four.
                    let quarters = [0, 1, 2, 3].map(|quarter| place.read_quarter(&samples, quarter));
                    assert_eq!(quarters, [0, 1, 2, 3].map(|quarter| place.read_quarter_words(&words, quarter)));
                    let rssi = quarters.iter().map(|(_, rssi)| *rssi).min();
                    assert_eq!(place.edges(&samples), watch.edges());
                    assert_eq!((rssi, quarters.map(|(bits, _)| bits)), (Some(watch.rssi()), [bits; 4]));
                }
            }
        }
    }

    /// Every wrong bit of the pattern is refused.
    #[test]
    fn a_wrong_bit_of_the_pattern() {
        for at in (0..61).step_by(crate::thin(20)) {
            for delay in (0..88).step_by(crate::thin(29)) {
                assert!(Alignment::learn(EdgeRule::All, &line(TEST_PATTERN ^ 1 << at, delay)).is_err());
            }
        }
    }

    #[test]
    fn both_kinds_of_edge() {
        let falling: Vec<u8> = (0..=8).map(|n| SampleIndex::after_falling_edge(!(0xff_u16 >> n) as u8).get()).collect();
        assert_eq!(falling, [4, 5, 6, 7, 0, 1, 2, 3, 4]);
        assert_eq!(SampleIndex::after_rising_edge(0b0001_1111).get(), 6);
        assert_eq!(SampleIndex::new(8), None);
    }
}
