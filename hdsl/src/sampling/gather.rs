//! The bits and the edges of an answer, four bit times at a time.

use core::iter::Copied;
use core::slice::Iter;

use super::{Alignment, Delay, SampleIndex, SampledAnswer, WINDOW};
use crate::rssi::WordWatch;

/// Takes one bit from each of four bytes.
///
/// The mask leaves bits s, s + 8, s + 16 and s + 24; the product moves them next to each other, and no two of its other
/// terms meet.
#[derive(Clone, Copy)]
pub(super) struct Gather {
    mask: u32,
    factor: u32,
}

impl Gather {
    pub(super) const fn new(index: SampleIndex) -> Self {
        let shift = 7 & !index.get();
        Self { mask: 0x0101_0101 << shift, factor: (1 << 28 | 1 << 21 | 1 << 14 | 1 << 7) >> shift }
    }

    /// Returns the bits of four bytes, the first one in the low byte, in bits 31:28.
    #[inline]
    pub(super) const fn four(self, samples: u32) -> u32 {
        (samples & self.mask).wrapping_mul(self.factor) & 0xf000_0000
    }

    /// Adds the bits of four bytes at the top of `bits`, after those already there.
    #[inline]
    const fn after(self, bits: u32, samples: u32) -> u32 {
        bits >> 4 | self.four(samples)
    }
}

/// The sixteen words that hold an answer, whatever its delay: 61 bytes and up to three before it. A word is four bytes, the
/// first one in its low bits.
pub(super) struct Words<I> {
    before: u32,
    first: u32,
    /// Seven words.
    low: I,
    /// Takes seven more words.
    high: I,
    last: u32,
}

impl<'a> Words<Bytes<'a>> {
    #[inline(always)]
    pub(super) fn of_bytes(samples: &'a [u8; WINDOW], delay: Delay) -> Self {
        let (before, answer) = samples.split_at_checked(usize::from(delay.get() & !3)).unwrap_or((&[], samples));
        // Never without: a delay is 11 at most.
        let answer = answer.first_chunk::<64>().unwrap_or(&[0xff; 64]);
        let (low, high) = answer.split_at(32);
        let (high, last) = high.split_at(28);
        let mut low = Bytes(low);
        Self {
            before: before.last_chunk().map_or(u32::MAX, |bytes| u32::from_le_bytes(*bytes)),
            first: low.next().unwrap_or(u32::MAX),
            low,
            high: Bytes(high),
            last: Bytes(last).next().unwrap_or(u32::MAX),
        }
    }
}

impl<'a> Words<Copied<Iter<'a, u32>>> {
    #[inline(always)]
    pub(super) fn of_words(samples: &'a [u32; WINDOW / 4], delay: Delay) -> Self {
        let (before, answer) = samples.split_at_checked(usize::from(delay.get() / 4)).unwrap_or((&[], samples));
        // Never without: a delay is 11 at most.
        let [first, middle @ .., last] = answer.first_chunk::<16>().unwrap_or(&[u32::MAX; 16]);
        let (low, high) = middle.split_at(7);
        Self {
            before: before.last().copied().unwrap_or(u32::MAX),
            first: *first,
            low: low.iter().copied(),
            high: high.iter().copied(),
            last: *last,
        }
    }
}

impl<I: Iterator<Item = u32>> Words<I> {
    /// Returns bits and edges of the answer.
    #[inline(always)]
    pub(super) fn read(self, alignment: Alignment) -> SampledAnswer {
        // Bytes of the first word before the answer; in the last word one more is of the answer.
        let lead = alignment.delay.get() & 3;
        let (gather, eighths) = (Gather::new(alignment.index), u32::from(lead).wrapping_mul(8));
        let mut watch = WordWatch::after(self.before.swap_bytes());
        watch.step(self.first.swap_bytes(), u32::MAX.wrapping_shr(eighths));
        let mut take = |bits, samples: u32| {
            watch.step(samples.swap_bytes(), u32::MAX);
            gather.after(bits, samples)
        };
        let low = self.low.fold(gather.four(self.first), &mut take);
        let high = self.high.fold(0, take);
        watch.step(self.last.swap_bytes(), u32::MAX.wrapping_shl(24_u32.wrapping_sub(eighths)));
        SampledAnswer { bits: whole(low, gather.after(high, self.last), lead), edges: watch.finish(lead) }
    }

    /// Returns only the bits.
    #[inline(always)]
    pub(super) fn bits(self, alignment: Alignment) -> u64 {
        let gather = Gather::new(alignment.index);
        let low = self.low.fold(gather.four(self.first), |bits, samples| gather.after(bits, samples));
        let high = self.high.fold(0, |bits, samples| gather.after(bits, samples));
        whole(low, gather.after(high, self.last), alignment.delay.get() & 3)
    }
}

/// Returns the 61 bits after the first `lead`.
const fn whole(low: u32, high: u32, lead: u8) -> u64 {
    ((high as u64) << 32 | low as u64) >> lead & (u64::MAX >> 3)
}

/// Reads bytes four at a time.
pub(super) struct Bytes<'a>(&'a [u8]);

impl Iterator for Bytes<'_> {
    type Item = u32;

    #[inline(always)]
    fn next(&mut self) -> Option<u32> {
        let (word, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u32::from_le_bytes(*word))
    }
}
