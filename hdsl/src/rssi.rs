//! Signal quality, derived from the positions of the edges in the sample byte.

use crate::ranged::ranged;

ranged! {
    /// Received signal strength of an answer, 0..=12: how far apart the edges in a bit time are.
    ///
    /// It is 12 with no edge or one, otherwise 2 (G - 2) for the longest gap G between neighbouring edges, counted cyclically
    /// over the eight sample periods; 0 for G <= 2.
    pub struct Rssi(0..=12);
}

impl Rssi {
    /// Returns the RSSI of an edge byte, see [`edges`].
    ///
    /// ```
    /// use hdsl::rssi::{Rssi, edges};
    /// // previous sample 1, samples 10000001: edges before sample 1 and before sample 7
    /// assert_eq!(edges(true, 0b1000_0001), 0b0100_0001);
    /// assert_eq!(Rssi::of_edges(0b0100_0001).get(), 8);
    /// ```
    #[expect(clippy::indexing_slicing, reason = "a byte is below 256")]
    pub const fn of_edges(edges: u8) -> Self {
        Self::of_ones(ONES[edges as usize])
    }

    /// Half the RSSI in unary, as that many ones in a row, so that the smaller of two is their bitwise AND.
    #[expect(clippy::cast_possible_truncation, reason = "at most six ones")]
    pub(crate) const fn of_ones(ones: u8) -> Self {
        Self(2_u8.wrapping_mul(ones.trailing_ones() as u8))
    }
}

/// Returns where the level changes in a byte of samples: bit 7 for a change before the first sample.
pub const fn edges(previous: bool, samples: u8) -> u8 {
    samples ^ (samples >> 1 | (previous as u8) << 7)
}

/// Returns the longest distance between neighbouring edges, counted cyclically over the byte: 8 with one edge, `None` without any.
pub const fn longest_gap(edges: u8) -> Option<u8> {
    if edges == 0 {
        return None;
    }
    let mut longest = 0;
    let mut at: u32 = 0;
    while at < 8 {
        if edges.rotate_left(at) & 0x80 != 0 {
            // From this edge to the next one, at the latest to itself.
            let gap = edges.rotate_left(at.wrapping_add(1)).leading_zeros().wrapping_add(1);
            if gap > longest {
                longest = gap;
            }
        }
        at = at.wrapping_add(1);
    }
    // At most 8.
    Some(longest.to_le_bytes()[0])
}

/// The value for a bit time with one edge or none.
const PERFECT: u8 = 0x3f;

/// Half the RSSI of an edge byte, in unary.
#[expect(clippy::indexing_slicing, clippy::cast_possible_truncation, reason = "runs at compile time")]
static ONES: [u8; 256] = {
    let mut table = [0; 256];
    let mut edges = 0;
    while edges < 256 {
        table[edges] = match longest_gap(edges as u8) {
            None | Some(8..) => PERFECT,
            Some(gap) if gap > 2 => !(0xff << (gap - 2)),
            Some(_) => 0,
        };
        edges += 1;
    }
    table
};

/// Collects edges over bit times, for [`Rssi`] and the register EDGES (SICK manual, p. 41).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EdgeWatch {
    previous: bool,
    seen: u8,
    /// Half the lowest RSSI, in unary.
    ones: u8,
}

impl EdgeWatch {
    /// Starts with `previous`, the level of the sample before the first byte.
    pub const fn new(previous: bool) -> Self {
        Self { previous, seen: 0, ones: PERFECT }
    }

    /// Takes the samples of one bit time.
    #[expect(clippy::indexing_slicing, reason = "a byte is below 256")]
    pub const fn step(&mut self, samples: u8) {
        let edges = edges(self.previous, samples);
        self.previous = samples & 1 == 1;
        self.seen |= edges;
        self.ones &= ONES[edges as usize];
    }

    /// The lowest RSSI of the bits so far.
    pub const fn rssi(self) -> Rssi {
        Rssi::of_ones(self.ones)
    }

    /// The sample periods in which an edge was seen, as bits of the register EDGES: bit n stands for period n.
    pub const fn edges(self) -> u8 {
        self.seen.reverse_bits()
    }
}

/// An [`EdgeWatch`] over four bit times at once, the first sample in bit 31.
#[derive(Clone, Copy)]
pub(crate) struct WordWatch {
    previous: u32,
    seen: u32,
    ones: u8,
}

impl WordWatch {
    /// Starts with `previous`, the samples before the first word.
    pub(crate) const fn after(previous: u32) -> Self {
        Self { previous, seen: 0, ones: PERFECT }
    }

    /// Takes the samples of four bit times. Counts only edges in `of`.
    #[inline(always)]
    pub(crate) fn step(&mut self, samples: u32, of: u32) {
        let edges = (samples ^ samples >> 1 ^ self.previous << 31) & of;
        self.previous = samples;
        // In each byte, the lowest of bits 6:0 taken away: nothing is left of a single edge, which is the best signal.
        if edges & (edges | 0x8080_8080).wrapping_sub(0x0101_0101) == 0 {
            self.seen |= edges;
        } else {
            // What is seen goes through here too: a sum that has to be there at each word stays in a register.
            (self.seen, self.ones) = several(self.seen, self.ones, edges);
        }
    }

    /// Returns the result after the first `bytes` + 1 bytes of the last word.
    pub(crate) const fn finish(self, bytes: u8) -> EdgeWatch {
        let [a, b, c, d] = self.seen.to_le_bytes();
        let last = self.previous.wrapping_shr(24_u32.wrapping_sub((bytes as u32).wrapping_mul(8)));
        EdgeWatch { previous: last & 1 == 1, seen: a | b | c | d, ones: self.ones }
    }
}

/// Returns half the lowest RSSI, in unary, of the bit times in four words; the word before them holds the samples before them.
#[inline(always)]
pub(crate) fn lowest(before: u32, words: impl IntoIterator<Item = (u32, u32)>) -> u8 {
    let (mut previous, mut ones) = (before, PERFECT);
    for (samples, of) in words {
        let edges = (samples ^ samples >> 1 ^ previous << 31) & of;
        previous = samples;
        if edges & (edges | 0x8080_8080).wrapping_sub(0x0101_0101) != 0 {
            ones &= of_four(edges);
        }
    }
    ones
}

#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "a byte is below 256")]
fn of_four(edges: u32) -> u8 {
    let at = |shift: u32| ONES[(edges >> shift & 0xff) as usize];
    at(0) & at(8) & at(16) & at(24)
}

/// Handles four bit times, one of which has several edges. A value that is already the lowest cannot become lower.
#[cold]
#[inline(never)]
fn several(seen: u32, ones: u8, edges: u32) -> (u32, u8) {
    if ones == 0 {
        return (seen | edges, 0);
    }
    (seen | edges, ones & of_four(edges))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn histogram_of_the_table() {
        let mut count = [0; 13];
        for edges in 0..=255 {
            count[usize::from(Rssi::of_edges(edges).get())] += 1;
        }
        assert_eq!(count, [47, 0, 84, 0, 60, 0, 32, 0, 16, 0, 8, 0, 9]);
    }

    #[test]
    fn gaps_by_walking_round() {
        for edges in 1..=255_u8 {
            let on = |k: usize| edges >> (7 - k % 8) & 1 == 1;
            let gap = (0..8).filter(|k| on(*k)).map(|k| (1..=8).find(|d| on(k + d)).unwrap()).max().unwrap();
            assert_eq!(longest_gap(edges), Some(gap as u8));
        }
        assert_eq!(longest_gap(0), None);
    }

    #[test]
    fn edges_of_a_bit() {
        for previous in [false, true] {
            for samples in 0..=255_u8 {
                let line: u16 = u16::from(previous) << 8 | u16::from(samples);
                let want = (0..8).fold(0, |e, k| e | u8::from(line >> k & 1 != line >> (k + 1) & 1) << k);
                assert_eq!(edges(previous, samples), want);
            }
        }
        let mut watch = EdgeWatch::new(true);
        watch.step(0b0000_1111);
        assert_eq!((watch.edges(), watch.rssi().get()), (0b0001_0001, 4));
    }
}
