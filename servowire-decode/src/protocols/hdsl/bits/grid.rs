//! Turns packed samples into bits, eight at once: the same bits that the edges one by one would give.
//!
//! A controller that samples by its own clock, or a dump of its logic, has eight samples per bit, and all edges of a
//! speaker lie at the same sample within a bit. As long as that holds, the edges lie on the grid, which need not be
//! adjusted, and 64 samples are eight bits.

use super::{Bits, FINE, Grid, JITTER_EDGES, LONGEST_RUN, Mark, ON_GRID, PAUSE, SAMPLES};
use crate::capture::samples::Samples;

/// The first sample of each bit.
const FIRST: u64 = 0x0101_0101_0101_0101;
/// How far the samples were taken.
pub(in super::super) struct Taken {
    /// The number of the first sample not taken.
    pub(in super::super) next: u64,
    /// Where the line last changed, and the level since.
    pub(in super::super) since: u64,
    pub(in super::super) level: bool,
}

/// Gathers the first samples of eight bits, the first in bit 0.
fn gather(word: u64) -> u64 {
    (word & FIRST).wrapping_mul(0x0102_0408_1020_4080) >> 56
}

/// Returns the edges of eight bits after `level`, the first in bit 0; `None` if an edge is not on the grid.
fn edges_in(word: u64, level: bool) -> Option<u64> {
    let edges = word ^ (word << 1 | u64::from(level));
    (edges & !FIRST == 0).then(|| gather(edges))
}

/// Returns whether each of the edges in eight bits, at least one, is at most `longest` bits after the previous one.
fn are_near(edges: u64, longest: u64) -> bool {
    if longest >= SAMPLES - 1 {
        return true;
    }
    let near = (0..longest).fold(0, |near, by| near | edges << by);
    let between = (1 << edges.ilog2()) - (1 << edges.trailing_zeros());
    near & between == between
}

impl Bits {
    /// Returns whether `samples` has about eight samples per bit.
    pub(in super::super) fn may_be_on_grid(&self, samples: &Samples<'_>) -> bool {
        let period = 1_000_000_000_000 * SAMPLES as i64 / samples.clock().rate() as i64;
        (period - self.nominal).abs() * 100 <= self.nominal
    }

    /// Takes samples from number `at` onwards as long as they are on the grid of the last change, at sample `since`, and
    /// until there are `most` bits.
    pub(in super::super) fn on_grid(&mut self, samples: &Samples<'_>, since: u64, at: u64, most: u64) -> Option<Taken> {
        let clock = samples.clock();
        let (changed, mut level) = self.spikes.last_change()?;
        let mut next = since + at.saturating_sub(since) / SAMPLES * SAMPLES;
        if next < samples.first() {
            // The first samples of this bit have gone.
            next += SAMPLES;
            if samples.change(at, level).is_some_and(|change| change < next) {
                return None;
            }
        }
        if changed != clock.time(since) || edges_in(samples.word(next)?, level).is_none() {
            return None;
        }
        // The level has lasted.
        self.reach(changed + self.nominal);
        if self.spikes.settled() != Some((changed, level)) || self.last != Some((changed, level)) {
            return None;
        }
        let longest = self.longest_run(samples);
        let (begun, from) = (self.end, since);
        let mut run = (next - since) / SAMPLES;
        let mut edges = 0;
        while self.end + 2 * LONGEST_RUN as u64 <= most {
            let Some(word) = samples.word(next) else { break };
            let Some(here) = edges_in(word, level) else { break };
            if here == 0 {
                if run + SAMPLES > longest {
                    break;
                }
                run += SAMPLES;
                next += 64;
                continue;
            }
            let first = u64::from(here.trailing_zeros());
            if run + first > longest || !are_near(here, longest) {
                break;
            }
            let last = u64::from(here.ilog2());
            let before = if level { (1 << run) - 1 } else { 0 };
            self.append((before | gather(word) << run) & ((1 << (run + last)) - 1), run + last);
            edges += here.count_ones();
            level = word >> 63 == 1;
            run = SAMPLES - last;
            next += 64;
        }
        let mut since = since;
        if edges > 0 {
            if let Some(mark) = self.marks.last_mut() {
                mark.grid = Some(Grid { sample: from, clock });
            }
            since = from + (self.end - begun) * SAMPLES;
            let time = clock.time(since);
            self.marks.push(Mark { bit: self.end, time, level, grid: None });
            self.spikes.settle(time, level);
            self.last = Some((time, level));
            self.heard.edges += u64::from(edges);
            self.jitter -= (self.jitter >> JITTER_EDGES) * i64::from(edges).min(1 << JITTER_EDGES);
        }
        Some(Taken { next, since, level })
    }

    /// Returns the longest run that is on the grid however its time was rounded.
    fn longest_run(&self, samples: &Samples<'_>) -> u64 {
        let bit = (1_000_000_000_000 << FINE) * i128::from(SAMPLES) / i128::from(samples.clock().rate());
        let off = (bit - i128::from(self.bit)).unsigned_abs().max(1);
        // Two times and a length are rounded.
        let room = u128::from((self.nominal / ON_GRID).unsigned_abs().saturating_sub(3)) << FINE;
        (room / off).min(LONGEST_RUN as u128) as u64
    }

    /// Appends up to 63 bits, the first in bit 0.
    fn append(&mut self, bits: u64, count: u64) {
        let used = self.end % 64;
        if used == 0 {
            self.words.push(bits);
        } else {
            if let Some(word) = self.words.last_mut() {
                *word |= bits << used;
            }
            if used + count > 64 {
                self.words.push(bits >> (64 - used));
            }
        }
        self.end += count;
    }
}

const _: () = assert!(LONGEST_RUN as u64 + SAMPLES < PAUSE && LONGEST_RUN < 50);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_between_the_edges_of_eight_bits() {
        for edges in 1..256_u64 {
            let at: Vec<u64> = (0..8).filter(|bit| edges >> bit & 1 == 1).collect();
            let most = at.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
            for longest in 1..=10 {
                assert_eq!(are_near(edges, longest), most <= longest, "{edges:08b} {longest}");
            }
        }
    }

    #[test]
    fn the_first_samples_of_eight_bits() {
        for bits in 0..256_u64 {
            let word = (0..64).fold(0, |word, at| word | (bits >> (at / 8) & 1) << at);
            assert_eq!(gather(word), bits);
            let edges = edges_in(word, bits & 1 == 1).unwrap();
            assert_eq!(edges, bits ^ (bits << 1 & 0xff | bits & 1));
            assert_eq!(edges_in(word ^ 1 << 12, false), None);
        }
    }
}
