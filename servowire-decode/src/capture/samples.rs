//! A block of packed samples, for a decoder that does not need individual edges.

use crate::time::{Clock, Time};

/// Samples of one channel, eight per byte, the oldest in bit 0.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    bytes: &'a [u8],
    /// Number of the first sample.
    first: u64,
    /// The level of the sample before it, or of the first sample itself if there is none before it.
    before: bool,
    clock: Clock,
    inverted: bool,
}

impl<'a> Samples<'a> {
    /// Creates a block. `first`: number of the first sample; `before`: the level of the sample before it.
    pub fn new(bytes: &'a [u8], first: u64, before: bool, clock: Clock) -> Self {
        Self { bytes, first, before, clock, inverted: false }
    }

    /// Returns the same samples, inverted.
    #[must_use]
    pub fn inverted(self) -> Self {
        Self { inverted: !self.inverted, before: !self.before, ..self }
    }

    /// Number of the first sample.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Number of the sample after the last one.
    pub fn end(&self) -> u64 {
        self.first + 8 * self.bytes.len() as u64
    }

    /// The level before the first sample.
    pub fn before(&self) -> bool {
        self.before
    }

    /// The level of the last sample.
    pub fn last(&self) -> bool {
        self.bytes.last().map_or(self.before, |last| (last >> 7 == 1) != self.inverted)
    }

    /// Converts between sample numbers and times.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Returns the 64 samples from number `at` onwards, the oldest in bit 0, if all of them exist.
    #[inline]
    pub fn word(&self, at: u64) -> Option<u64> {
        let place = at.checked_sub(self.first)?;
        let nine = self.bytes.get((place / 8) as usize..)?.get(..9);
        let word = match (nine, place % 8) {
            (Some(nine), by) => {
                let (low, high) = nine.split_at(8);
                // Takes the lowest `by` bits of the ninth byte.
                little_endian(low) >> by | u64::from(*high.first()?) << 1 << (63 - by)
            }
            (None, 0) => u64::from_le_bytes(*self.bytes.get((place / 8) as usize..)?.first_chunk()?),
            (None, _) => return None,
        };
        Some(if self.inverted { !word } else { word })
    }

    /// Returns the number of the first sample, `at` or later, whose level is not `level`.
    #[inline]
    pub fn change(&self, mut at: u64, level: bool) -> Option<u64> {
        let same = if level { u64::MAX } else { 0 };
        while let Some(word) = self.word(at) {
            if word != same {
                return Some(at + u64::from((word ^ same).trailing_zeros()));
            }
            at += 64;
        }
        self.last_change(at, level)
    }

    /// Does the same for the last samples, which are fewer than 64.
    #[cold]
    fn last_change(&self, at: u64, level: bool) -> Option<u64> {
        (at..self.end()).find(|at| {
            let place = at - self.first;
            let byte = self.bytes.get((place / 8) as usize).copied().unwrap_or(0);
            (byte >> (place % 8) & 1 == 1) != (level != self.inverted)
        })
    }

    /// Returns all changes, by time.
    pub fn changes(self) -> impl Iterator<Item = (Time, bool)> + 'a {
        let Self { before, clock, .. } = self;
        let mut room = Vec::new();
        let numbers = self.pieces().flat_map(move |piece| piece.numbers(&mut room).to_vec());
        numbers.zip([!before, before].into_iter().cycle()).map(move |(at, level)| (clock.time(at), level))
    }

    /// Returns the same samples in pieces so small that the numbers of their changes fit into the cache.
    pub(crate) fn pieces(self) -> impl Iterator<Item = Self> + 'a {
        let mut before = self.before;
        let mut first = self.first;
        self.bytes.chunks(PIECE).map(move |bytes| {
            let piece = Self { bytes, first, before, ..self };
            (first, before) = (piece.end(), piece.last());
            piece
        })
    }

    /// Returns all changes of a [piece](Self::pieces) by time; `room` holds their numbers. A run is even if it lasts between
    /// `least` and `most` picoseconds.
    pub(crate) fn turns(self, room: &mut Vec<u64>, least: i64, most: i64) -> Turns<'_> {
        let (level, clock) = (self.before, self.clock);
        let numbers = self.numbers(room);
        // The times of samples are rounded.
        let fewest = clock.fewest(least.saturating_add(1));
        let even = clock.most(most.saturating_sub(1)).checked_sub(fewest).map(|range| (fewest, range));
        let whole = numbers.last().and_then(|last| clock.whole(*last));
        Turns { numbers, told: 0, level, clock, whole, even }
    }

    /// Returns the number of each sample before which the level changes, in `room`, of at most [`PIECE`] bytes.
    fn numbers(self, room: &mut Vec<u64>) -> &[u64] {
        let flip = if self.inverted { u64::MAX } else { 0 };
        let mut before = u64::from(self.before);
        // There are at most as many changes as samples.
        room.resize(8 * PIECE + AT_ONCE, 0);
        let Some(found) = room.first_chunk_mut::<{ 8 * PIECE + AT_ONCE }>() else { return &[] };
        let mut count = 0;
        let mut see = |at: u64, mut edges: u64| {
            if edges == 0 {
                return;
            }
            let mut place = count % (8 * PIECE);
            count += edges.count_ones() as usize;
            // The processor need not guess how many there are: what is written too much is overwritten.
            for k in 0..AT_ONCE {
                if let Some(place) = found.get_mut(place + k) {
                    *place = at + u64::from(edges.trailing_zeros());
                }
                edges &= edges.wrapping_sub(1);
            }
            while edges != 0 {
                place += 1;
                if let Some(place) = found.get_mut(place + AT_ONCE - 1) {
                    *place = at + u64::from(edges.trailing_zeros());
                }
                edges &= edges - 1;
            }
        };
        let words = self.bytes.chunks_exact(8);
        let (mut at, rest) = (self.first, words.remainder());
        for eight in words {
            let word = little_endian(eight) ^ flip;
            see(at, word ^ (word << 1 | before));
            before = word >> 63;
            at += 64;
        }
        if !rest.is_empty() {
            let word = little_endian(rest) ^ flip;
            see(at, (word ^ (word << 1 | before)) & ((1 << (8 * rest.len())) - 1));
        }
        room.get(..count).unwrap_or_default()
    }
}

/// Changes taken of each word of 64 samples; seldom are there more.
const AT_ONCE: usize = 6;

/// Bytes of samples that are examined together.
const PIECE: usize = 1 << 10;

/// The changes of a piece of a recording.
#[derive(Debug, Clone)]
pub(crate) struct Turns<'a> {
    /// Numbers of the samples before which the level changes.
    numbers: &'a [u64],
    /// Number of changes reported so far.
    told: usize,
    /// The level after the last of these.
    level: bool,
    clock: Clock,
    /// Picoseconds from each sample to the next, if they are whole.
    whole: Option<u64>,
    /// The fewest samples of an even run, and how many more it may have.
    even: Option<(u64, u64)>,
}

impl Turns<'_> {
    /// Returns the time of the change reported last.
    pub(crate) fn told_at(&self) -> Option<Time> {
        Some(self.clock.time(*self.numbers.get(self.told.checked_sub(1)?)?))
    }

    /// Appends at most this many changes, starting with the one reported last, each followed by an even run, and returns how
    /// many. All of them then count as reported, and so does the change after them.
    pub(crate) fn even<T>(&mut self, most: usize, out: &mut Vec<T>, make: impl Fn(Time, bool) -> T) -> usize {
        let from = self.numbers.get(self.told.wrapping_sub(1)..).unwrap_or_default();
        let (Some((first, rest)), Some((fewest, range))) = (from.split_first(), self.even) else { return 0 };
        let (mut before, mut count) = (*first, 0);
        for next in rest.get(..most.min(rest.len())).unwrap_or_default() {
            if (next - before).wrapping_sub(fewest) > range {
                break;
            }
            (before, count) = (*next, count + 1);
        }
        let (clock, begun) = (self.clock, self.level);
        let level = |at: usize| begun ^ (at % 2 == 1);
        let even = from.get(..count).unwrap_or_default().iter().enumerate();
        match self.whole {
            Some(picoseconds) => {
                out.extend(even.map(|(at, number)| make(Time::from_ps((number * picoseconds).into()), level(at))));
            }
            None => out.extend(even.map(|(at, number)| make(clock.time(*number), level(at)))),
        }
        (self.told, self.level) = (self.told + count, level(count));
        count
    }
}

impl Iterator for Turns<'_> {
    type Item = (Time, bool);

    fn next(&mut self) -> Option<(Time, bool)> {
        let at = *self.numbers.get(self.told)?;
        self.told += 1;
        self.level = !self.level;
        Some((self.clock.time(at), self.level))
    }
}

/// Reads up to 8 bytes as a number.
pub(super) fn little_endian(bytes: &[u8]) -> u64 {
    match bytes.first_chunk() {
        Some(whole) => u64::from_le_bytes(*whole),
        None => bytes.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// One sample after the other.
    fn plain(bytes: &[u8], before: bool) -> Vec<(Time, bool)> {
        let mut level = before;
        let mut out = Vec::new();
        for at in 0..8 * bytes.len() {
            let next = bytes[at / 8] >> (at % 8) & 1 == 1;
            if next != level {
                out.push((Time::from_ps(at as i128 * 1_000_000), next));
            }
            level = next;
        }
        out
    }

    proptest! {
        #[test]
        fn changes_are_those_of_the_samples(
            bytes in proptest::collection::vec(prop_oneof![Just(0_u8), Just(0xff), any::<u8>()], 0..80),
            before: bool,
            inverted: bool,
        ) {
            let samples = Samples::new(&bytes, 64, before, Clock::new(1_000_000));
            let samples = if inverted { samples.inverted() } else { samples };
            let want: Vec<_> =
                plain(&bytes, before).iter().map(|(time, level)| (*time + 64_000_000, *level != inverted)).collect();
            prop_assert_eq!(samples.changes().collect::<Vec<_>>(), want);
        }

        #[test]
        fn a_word_is_64_samples(bytes in proptest::collection::vec(any::<u8>(), 8..20), by in 0..100_u64) {
            let samples = Samples::new(&bytes, 0, false, Clock::new(1));
            let bit = |at: u64| u64::from(bytes[(at / 8) as usize] >> (at % 8) & 1);
            let want = (by + 64 <= 8 * bytes.len() as u64).then(|| (0..64).fold(0, |word, k| word | bit(by + k) << k));
            prop_assert_eq!(samples.word(by), want);
        }
    }
}
