//! Edges of the pair as bits, with the time of each.

use std::ops::Range;

use hdsl::Window;

use crate::event::Place;
use crate::line::{Rates, Spikes};

/// Longest run that is taken bit by bit; a longer one is a pause.
pub(super) const PAUSE: u64 = 200;
/// A speaker's bit may be so far from the nominal one.
const OFF: f64 = 0.06;
/// How much an edge moves the grid, and the bit length for a run of one bit.
const FOLLOW: f64 = 0.5;
const ADAPT: f64 = 0.06;
/// An edge so far from the grid, in bits, is that of another speaker.
const ELSEWHERE: f64 = 0.3;

/// Bits of the line. The grid follows the edges of whoever drives.
pub(super) struct Bits {
    spikes: Spikes,
    nominal: f64,
    bit: f64,
    /// Where the grid has the last edge, and the level since.
    last: Option<(f64, bool)>,
    /// 64 bits each, the first in bit 0.
    words: Vec<u64>,
    /// Number of the first bit in `words`, a multiple of 64, and of the one behind the last.
    first: u64,
    end: u64,
    /// Places of edges: number of the bit, time.
    marks: Vec<(u64, i64)>,
    /// Bit behind a pause too long for its bits to be kept.
    pub(super) paused: Option<u64>,
    pub(super) rates: Rates,
}

impl Bits {
    pub(super) fn new(bit: f64) -> Self {
        Self {
            spikes: Spikes::new(bit),
            nominal: bit,
            bit,
            last: None,
            words: Vec::new(),
            first: 0,
            end: 0,
            marks: Vec::new(),
            paused: None,
            rates: Rates::default(),
        }
    }

    pub(super) fn change(&mut self, time: i64, level: bool) {
        if self.last.is_none() {
            self.last = Some((time as f64, level));
            self.marks.push((0, time));
        }
        for edge in self.spikes.change(time, level) {
            self.edge(edge.time, edge.level, edge.spikes);
        }
    }

    /// The line has not changed until `time`: what is certain of it becomes bits.
    pub(super) fn reach(&mut self, time: i64) {
        for edge in self.spikes.reach(time) {
            self.edge(edge.time, edge.level, edge.spikes);
        }
    }

    /// The capture ends at `time`; the last level is held for some bits so that what it began can be read.
    pub(super) fn finish(&mut self, time: i64, hold: f64) {
        self.reach(time.saturating_add(self.bit as i64));
        if let Some((since, level)) = self.last {
            let until = (time as f64).max(since + hold * self.bit);
            let count = ((until - since) / self.bit).round().max(0.0) as u64;
            self.push(level, count.min(PAUSE));
            self.last = None;
        }
    }

    fn edge(&mut self, time: i64, level: bool, spikes: u32) {
        self.rates.count_edge(spikes);
        let Some((since, before)) = self.last else { return };
        let run = (time as f64 - since) / self.bit;
        let count = run.round().max(0.0);
        let off = run - count;
        let place = if count > 20.0 || off.abs() > ELSEWHERE {
            time as f64
        } else {
            if count > 0.0 {
                self.bit += ADAPT * off * self.bit / count;
                self.bit = self.bit.clamp(self.nominal * (1.0 - OFF), self.nominal * (1.0 + OFF));
                self.rates.measured(self.nominal / self.bit);
            }
            time as f64 - off * self.bit * (1.0 - FOLLOW)
        };
        let count = count as u64;
        if count > PAUSE {
            self.paused = Some(self.end + PAUSE);
        }
        self.push(before, count.min(PAUSE));
        self.last = Some((place, level));
        self.marks.push((self.end, time));
    }

    fn push(&mut self, level: bool, count: u64) {
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

    /// Number of the bit behind the last one.
    pub(super) fn end(&self) -> u64 {
        self.end
    }

    /// Up to 128 bits from bit `at` on.
    pub(super) fn window(&self, at: u64) -> Window {
        let len = self.end.saturating_sub(at).min(128) as u32;
        Window::from_bits(self.load(at), len).unwrap_or(Window::EMPTY)
    }

    /// 128 bits from bit `at` on; behind the end they are 0.
    pub(super) fn load(&self, at: u64) -> u128 {
        let from = at.saturating_sub(self.first);
        let word = |k: u64| usize::try_from(from / 64 + k).ok().and_then(|k| self.words.get(k)).copied().unwrap_or(0);
        let low = u128::from(word(0)) | u128::from(word(1)) << 64;
        match from % 64 {
            0 => low,
            by => low >> by | u128::from(word(2)) << (128 - by),
        }
    }

    /// When a bit begins.
    pub(super) fn time(&self, at: u64) -> i64 {
        let behind = self.marks.partition_point(|(bit, _)| *bit <= at);
        let Some((bit, time)) = self.marks.get(behind.saturating_sub(1)) else { return 0 };
        time + ((at as i64 - *bit as i64) as f64 * self.bit) as i64
    }

    pub(super) fn place(&self, bits: Range<u64>) -> Place {
        let start = self.time(bits.start);
        Place::Time { start, end: start + ((bits.end - bits.start) as f64 * self.bit) as i64 }
    }

    /// Bits before `at` are of no more interest.
    pub(super) fn forget(&mut self, at: u64) {
        let words = (at.saturating_sub(self.first) / 64).min(self.words.len() as u64);
        if words < 64 {
            return;
        }
        self.words.drain(..words as usize);
        self.first += words * 64;
        let keep = self.marks.partition_point(|(bit, _)| *bit <= self.first).saturating_sub(1);
        self.marks.drain(..keep);
    }
}
