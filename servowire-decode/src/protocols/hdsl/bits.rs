//! Converts edges of the pair to bits, with the time of each.

mod again;
mod grid;

use std::cell::Cell;
use std::ops::Range;

use hdsl::Window;

use crate::event::Place;
use crate::line::receive::Rates;
use crate::line::spikes::Spikes;
use crate::time::{Clock, Time};

pub(super) use again::{Again, RESET};

/// Samples per bit on a grid of samples.
pub(super) const SAMPLES: u64 = 8;
/// Longest run that is taken bit by bit; a longer one is a pause.
pub(super) const PAUSE: u64 = 200;
/// How far a speaker's bit may be from the nominal one, in per cent.
const OFF: i64 = 6;
/// An edge at least this far from the grid, in per cent of a bit, comes from another speaker.
const ELSEWHERE: i64 = 30;
/// An edge within one part in this many of a bit is on the grid: neither the grid nor the bit length is adjusted to it.
const ON_GRID: i64 = 32;
/// How many heads are measured first, and out of how many two are measured after that.
const MEASURED: u64 = 256;
const SOME: u64 = 16;
/// The distance of two heads counts as whole bits if it is at most this far from them, in bits.
const WHOLE: f64 = 0.3;
/// If the mean distance of edges from the grid is more than one part in this many of a bit, some edges may fall on the
/// wrong side.
const JITTERY: i64 = 13;
/// Number of edges in this mean, as a power of two.
const JITTER_EDGES: u32 = 6;
/// Edges after runs longer than this say nothing about the bit length.
pub(super) const LONGEST_RUN: usize = ADAPT.len() - 1;
/// Fraction bits of the bit length in picoseconds, and of positions in bits.
const FINE: u32 = 16;
const PART: u32 = 40;
/// How much the distance of an edge from the grid changes the bit length, in fractions of a picosecond, for each length of
/// the preceding run in bits: 0.06 of it after one bit. Longer runs say nothing.
const ADAPT: [i64; 11] = {
    const ONE: i64 = (6 << FINE) / 100;
    [0, ONE, ONE / 2, ONE / 3, ONE / 4, ONE / 5, ONE / 6, ONE / 7, ONE / 8, ONE / 9, ONE / 10]
};

/// Bits of the line. The grid follows the edges of the present driver.
pub(super) struct Bits {
    spikes: Spikes,
    /// The nominal length of a bit in picoseconds, and in fractions of a picosecond.
    nominal: i64,
    fine: i64,
    /// The present length in fractions of a picosecond, and a recent value of its inverse.
    bit: i64,
    inverse: i64,
    inverse_of: i64,
    /// The mean distance of edges from the grid in picoseconds, times 2^`JITTER_EDGES`.
    jitter: i64,
    /// Where the last edge lies on the grid, and the level since.
    last: Option<(Time, bool)>,
    /// 64 bits each, the first in bit 0.
    words: Vec<u64>,
    /// Number of the first bit in `words`, a multiple of 64, and of the one after the last.
    first: u64,
    end: u64,
    /// Places of edges.
    marks: Vec<Mark>,
    /// The mark looked up last: the next look-up is near it.
    asked: Cell<usize>,
    /// The bit after a pause that was too long to keep its bits.
    pub(super) paused: Option<u64>,
    heard: Heard,
}

/// The place of an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    /// Number of the bit that begins there.
    pub(super) bit: u64,
    pub(super) time: Time,
    /// The level after it.
    pub(super) level: bool,
    /// The grid of samples on which all edges up to the next mark lie.
    pub(super) grid: Option<Grid>,
}

/// Where edges without their own marks lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// Number of the sample at the mark.
    pub(super) sample: u64,
    pub(super) clock: Clock,
}

/// Measurements of the line: edges, spikes, and heads with the time and the bits between them.
#[derive(Debug, Clone, Copy, Default)]
struct Heard {
    edges: u64,
    spikes: u64,
    heads: u64,
    /// The last head that was measured.
    last: Option<(u64, Time)>,
    time: i64,
    bits: i64,
}

impl Bits {
    pub(super) fn new(bit: f64) -> Self {
        let mut bits = Self {
            spikes: Spikes::new(bit),
            nominal: bit as i64,
            fine: (bit * f64::from(1 << FINE)) as i64,
            bit: (bit * f64::from(1 << FINE)) as i64,
            inverse: 0,
            inverse_of: 0,
            jitter: 0,
            last: None,
            words: Vec::new(),
            first: 0,
            end: 0,
            marks: Vec::new(),
            asked: Cell::new(0),
            paused: None,
            heard: Heard::default(),
        };
        bits.invert();
        bits
    }

    /// Length of a bit in picoseconds.
    fn length(&self) -> f64 {
        self.bit as f64 / f64::from(1 << FINE)
    }

    /// Half a bit in picoseconds.
    pub(super) fn half(&self) -> i64 {
        self.nominal / 2
    }

    fn invert(&mut self) {
        self.inverse_of = self.bit;
        self.inverse = (1_i64 << (PART + FINE)) / self.bit.max(1);
    }

    /// Returns the measurements of the line.
    pub(super) fn rates(&self) -> Rates {
        let mut rates = Rates::of(self.heard.edges, self.heard.spikes);
        if self.heard.bits > 0 {
            // One clock for both sides.
            rates.measured(self.nominal as f64 / self.mean());
        }
        rates
    }

    /// Returns the mean length of a bit in picoseconds, measured from the heads.
    pub(super) fn mean(&self) -> f64 {
        let Heard { time, bits, .. } = self.heard;
        if bits > 0 { time as f64 / bits as f64 } else { self.nominal as f64 }
    }

    /// Notes that the heads at two bits are this many bits of the same clock apart.
    pub(super) fn learn(&mut self, heads: Range<u64>, bits: u64) {
        self.measure(self.time(heads.end) - self.time(heads.start), bits as i64);
    }

    fn measure(&mut self, time: i64, bits: i64) {
        (self.heard.time, self.heard.bits) = (self.heard.time.saturating_add(time), self.heard.bits + bits);
    }

    /// Notes a head at bit `at`: the first ones are all measured, later only some. All frames are whole bits.
    pub(super) fn heard_head(&mut self, at: u64) {
        self.heard.heads += 1;
        if self.heard.heads > MEASURED && self.heard.heads % SOME > 1 {
            return;
        }
        let time = self.time(at);
        let Some((before, since)) = self.heard.last.replace((at, time)) else { return };
        let apart = (time - since) as f64 / self.mean();
        let near = (apart - apart.round()).abs() <= WHOLE && apart <= PAUSE as f64;
        if self.heard.bits == 0 {
            self.measure(time - since, (at - before) as i64);
        } else if near {
            self.measure(time - since, apart.round() as i64);
        }
    }

    /// Returns whether edges are so far from the grid that bits may be wrong although they pass their checks.
    pub(super) fn is_jittery(&self) -> bool {
        (self.jitter >> JITTER_EDGES) * JITTERY > self.nominal
    }

    #[inline]
    pub(super) fn change(&mut self, time: Time, level: bool) {
        if self.last.is_none() {
            self.last = Some((time, level));
            self.mark(time, level);
        }
        if let Some(edge) = self.spikes.plain_change(time, level) {
            return self.edge(edge.time, edge.level, edge.spikes);
        }
        for edge in self.spikes.change(time, level).into_iter().flatten() {
            self.edge(edge.time, edge.level, edge.spikes);
        }
    }

    /// The line has not changed until `time`: turns the certain part of it into bits.
    pub(super) fn reach(&mut self, time: Time) {
        for edge in self.spikes.reach(time).into_iter().flatten() {
            self.edge(edge.time, edge.level, edge.spikes);
        }
    }

    /// The capture ends at `time`; the last level is held for some bits so that a frame under way can be read.
    pub(super) fn finish(&mut self, time: Time, hold: f64) {
        self.reach(time + self.length() as i64);
        if let Some((since, level)) = self.last {
            let until = time.max(since + (hold * self.length()) as i64);
            let count = ((until - since) as f64 / self.length()).round().max(0.0) as u64;
            self.push(level, count.min(PAUSE));
            self.last = None;
        }
    }

    #[inline]
    fn edge(&mut self, time: Time, level: bool, spikes: u32) {
        self.heard.edges += 1;
        self.heard.spikes += u64::from(spikes);
        let Some((since, before)) = self.last else { return };
        let run = time - since;
        let longest = (PAUSE as i64 + 50) * self.nominal;
        if run >= longest {
            self.pause(time, before, level);
            return;
        }
        // Half a bit, where another speaker begins, is always rounded the same way.
        let count = (run * self.inverse + (1 << (PART - 1)) - (1 << (PART - 6))) >> PART;
        let off = run - ((count * self.bit + (1 << (FINE - 1))) >> FINE);
        self.jitter -= self.jitter >> JITTER_EDGES;
        let place = match usize::try_from(count).ok().and_then(|count| ADAPT.get(count)) {
            Some(_) if off.abs() * ON_GRID <= self.nominal => time,
            Some(part) if off.abs() * 100 <= ELSEWHERE * self.nominal => {
                self.jitter += off.abs();
                self.adapt(off * part);
                // The grid moves half-way to the edge.
                time - (off >> 1)
            }
            _ => time,
        };
        let count = count.max(0) as u64;
        if count > PAUSE {
            self.paused = Some(self.end + PAUSE);
        }
        self.push(before, count.min(PAUSE));
        self.last = Some((place, level));
        self.mark(time, level);
    }

    fn mark(&mut self, time: Time, level: bool) {
        self.marks.push(Mark { bit: self.end, time, level, grid: None });
    }

    /// Takes an edge after a pause.
    #[cold]
    fn pause(&mut self, time: Time, before: bool, level: bool) {
        self.paused = Some(self.end + PAUSE);
        self.push(before, PAUSE);
        self.last = Some((time, level));
        self.mark(time, level);
    }

    /// Lengthens the bit by this many fractions of a picosecond.
    #[inline]
    fn adapt(&mut self, parts: i64) {
        let most = self.fine / 100 * OFF;
        self.bit = (self.bit + parts).clamp(self.fine - most, self.fine + most);
        if (self.bit - self.inverse_of).abs() > self.fine >> 11 {
            self.invert();
        }
    }

    fn push(&mut self, level: bool, count: u64) {
        let used = self.end % 64;
        if used != 0 && used + count <= 64 {
            if let (true, Some(word)) = (level, self.words.last_mut()) {
                *word |= (u64::MAX >> ((64 - count) & 63)) << used & if count == 0 { 0 } else { u64::MAX };
            }
            self.end += count;
            return;
        }
        let mut left = count;
        while left > 0 {
            let used = (self.end - self.first) % 64;
            if used == 0 {
                self.words.push(0);
            }
            let now = left.min(64 - used);
            if let (true, Some(word)) = (level, self.words.last_mut()) {
                *word |= (u64::MAX >> (64 - now)) << used;
            }
            self.end += now;
            left -= now;
        }
    }

    /// Returns the number of the bit after the last one.
    pub(super) fn end(&self) -> u64 {
        self.end
    }

    /// Returns up to 128 bits from bit `at` onwards.
    pub(super) fn window(&self, at: u64) -> Window {
        let len = self.end.saturating_sub(at).min(128) as u32;
        Window::from_bits(self.load(at), len).unwrap_or(Window::EMPTY)
    }

    /// Returns 128 bits from bit `at` onwards; they are 0 after the end.
    pub(super) fn load(&self, at: u64) -> u128 {
        let from = at.saturating_sub(self.first);
        let word = |k: u64| usize::try_from(from / 64 + k).ok().and_then(|k| self.words.get(k)).copied().unwrap_or(0);
        let low = u128::from(word(0)) | u128::from(word(1)) << 64;
        match from % 64 {
            0 => low,
            by => low >> by | u128::from(word(2)) << (128 - by),
        }
    }

    /// Returns when a bit begins.
    pub(super) fn time(&self, at: u64) -> Time {
        let is_after = |mark: usize| self.marks.get(mark).is_none_or(|mark| mark.bit > at);
        let mut mark = self.asked.get().min(self.marks.len());
        while !is_after(mark + 1) {
            mark += 1;
        }
        while mark > 0 && is_after(mark) {
            mark -= 1;
        }
        self.asked.set(mark);
        let Some(Mark { mut bit, mut time, grid, .. }) = self.marks.get(mark).copied() else { return Time::ZERO };
        if let Some(grid) = grid.filter(|_| bit < at) {
            let edge = self.last_edge(bit, at);
            time = grid.clock.time(grid.sample + (edge - bit) * SAMPLES);
            bit = edge;
        }
        time + ((at as i64 - bit as i64) as f64 * self.length()) as i64
    }

    /// Returns when bit `at` begins by the clock of the speaker after it: the edge before it may belong to another speaker.
    pub(super) fn time_by_next(&self, at: u64) -> Time {
        let bits = self.load(at.saturating_sub(1));
        let edge = u64::from((bits ^ bits >> 1).trailing_zeros());
        let edge = if at + edge < self.end { edge } else { 0 };
        self.time(at + edge) - (edge as f64 * self.length()) as i64
    }

    /// Returns the last bit up to `at` that differs from the previous one; `first` if none does.
    fn last_edge(&self, first: u64, at: u64) -> u64 {
        // Runs on a grid are short.
        let from = first.max(at.saturating_sub(LONGEST_RUN as u64)).max(self.first);
        let bits = self.load(from) as u64;
        let edges = (bits ^ bits >> 1) & ((1 << at.saturating_sub(from)) - 1);
        if edges == 0 { first } else { from + 64 - u64::from(edges.leading_zeros()) }
    }

    pub(super) fn place(&self, bits: Range<u64>) -> Place {
        let start = self.time(bits.start);
        Place::Time { start, end: start + ((bits.end - bits.start) as f64 * self.length()) as i64 }
    }

    /// Forgets the bits before `at`.
    pub(super) fn forget(&mut self, at: u64) {
        let words = (at.saturating_sub(self.first) / 64).min(self.words.len() as u64);
        if words < 64 {
            return;
        }
        self.words.drain(..words as usize);
        self.first += words * 64;
        let keep = self.marks.partition_point(|mark| mark.bit <= self.first).saturating_sub(1);
        self.marks.drain(..keep);
        self.asked.set(self.asked.get().saturating_sub(keep));
    }
}
