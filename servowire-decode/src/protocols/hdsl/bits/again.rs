//! Reads the edges of a failed frame a second time, in the way a receiver samples them: its clock runs on from head to
//! head, and
//! the answer has one fixed offset from it. Edges may then be off by nearly half a bit.

use hdsl::frame::{ANSWER_BITS, DELAY_RESERVE_BITS};

use super::{Bits, SAMPLES};
use crate::time::Time;

/// Bits from the end of a head to TRAILER; the first two are not driven.
const TO_TRAILER: f64 = (1 + ANSWER_BITS + DELAY_RESERVE_BITS) as f64;
/// How far, in bits, jitter alone may move a head from where the mean bit length puts it.
const SAME_CLOCK: f64 = 0.25;
/// Places of the edges in SYNC, and of the bits from CYCLE RESET onwards; before CYCLE RESET an EXTRA window may end anywhere.
const SYNC: [u64; 4] = [0, 2, 3, 4];
pub(in super::super) const RESET: u64 = 17;

/// The clock of a master: when a head began, its number of bits, and the length of a bit in picoseconds.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Beat {
    start: Time,
    len: u64,
    bit: f64,
}

/// What is placed on the grid again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Again {
    /// Only the answer: everything after it stays as it is.
    Answer,
    /// Everything that follows.
    Rest,
}

impl Bits {
    /// Returns the clock of the head of `len` bits at bit `at`; `before`: an earlier head sent by the same clock.
    pub(in super::super) fn beat(&self, at: u64, len: u64, before: Option<u64>) -> Beat {
        let mean = self.mean();
        let start = self.head_start(at, len, mean);
        let bit = before.map_or(mean, |before| {
            let time = (start - self.head_start(before, len.min(at - before), mean)) as f64;
            let bits = (time / mean).round().max(1.0);
            // The mean of many heads is more exact than two of them, unless the clock has drifted.
            if (time - bits * mean).abs() < SAME_CLOCK * mean { mean } else { time / bits }
        });
        let end = self.time(at + len);
        Beat { start, len: ((end - start) as f64 / bit).round().max(0.0) as u64, bit }
    }

    /// Returns when a head began, according to all its edges.
    fn head_start(&self, at: u64, len: u64, bit: f64) -> Time {
        let begin = self.time(at);
        let mean = |offs: &[f64]| offs.iter().sum::<f64>() / offs.len().max(1) as f64;
        let off = |bits: u64| (self.time(at + bits) - begin) as f64 - bits as f64 * bit;
        let first = mean(&SYNC.map(off));
        let edges = self.edges(begin, self.time(at + len)).into_iter();
        let window = (self.time(at + SYNC[3] + 1), self.time(at + len.saturating_sub(RESET)));
        let offs = edges.filter(|(time, _)| *time < window.0 || *time >= window.1).map(|(time, _)| {
            let off = (time - begin) as f64 - first;
            off - (off / bit).round() * bit + first
        });
        begin + mean(&offs.collect::<Vec<_>>()) as i64
    }

    /// Returns the edges from `from` to before `to`, and the level after each.
    fn edges(&self, from: Time, to: Time) -> Vec<(Time, bool)> {
        let first = self.marks.partition_point(|mark| mark.time < from).saturating_sub(1);
        let marks = self.marks.get(first..).unwrap_or_default();
        let mut edges = Vec::new();
        for (at, mark) in marks.iter().enumerate() {
            if mark.time >= to {
                break;
            }
            edges.push((mark.time, mark.level));
            let (Some(grid), Some(next)) = (mark.grid, marks.get(at + 1)) else { continue };
            let mut level = mark.level;
            for bit in mark.bit + 1..next.bit {
                if (self.load(bit) & 1 == 1) != level {
                    level = !level;
                    edges.push((grid.clock.time(grid.sample + (bit - mark.bit) * SAMPLES), level));
                }
            }
        }
        edges.retain(|(time, _)| *time >= from && *time < to);
        edges
    }

    /// Places the edges from the head at bit `at` onwards on the grid again.
    pub(in super::super) fn lay(&mut self, at: u64, beat: Beat, what: Again) {
        let Beat { start, len, bit } = beat;
        let len = len as f64;
        let place = |time: Time| (time - start) as f64 / bit;
        let edges = self.edges(self.time(at), Time::MAX);
        let (from, to) = (len + 0.6, len + TO_TRAILER + 0.4);
        let of_answer = |place: f64| place > from && place < to;
        let phase = phase(&edges.iter().map(|(time, _)| place(*time)).filter(|place| of_answer(*place)));
        let olds: Vec<u64> = edges.iter().map(|(time, _)| self.nearest_mark(*time)).collect();
        let Some(first) = self.marks.iter().rposition(|mark| mark.bit <= at) else { return };
        // At the end of a capture the level after the last edge has already become bits.
        let held = olds.last().filter(|_| self.last.is_none()).map(|last| self.end.saturating_sub(*last));
        // A stretch on a grid continues to the next mark.
        let begins = self.marks.get(first).is_some_and(|mark| mark.bit == at);
        self.marks.truncate(first + usize::from(!begins));
        self.truncate(at);
        let mut before: Option<(bool, Option<u64>)> = None;
        for ((time, level), old) in edges.iter().copied().zip(olds) {
            let now = place(time);
            let off = if of_answer(now) { phase } else { 0.0 };
            let whole = (now - off).round();
            let count = match before {
                // It keeps its distance from the previous edge.
                Some((_, Some(last))) if what == Again::Answer => old.saturating_sub(last),
                _ => (at + whole.max(0.0) as u64).saturating_sub(self.end),
            };
            if let Some((level, _)) = before {
                self.push(level, count);
            }
            self.mark(time, level);
            let place = start + ((whole + off) * bit) as i64;
            self.last = Some((if now >= to && what == Again::Answer { time } else { place }, level));
            before = Some((level, (now >= to).then_some(old)));
        }
        if let (Some(held), Some((level, _))) = (held, before) {
            self.push(level, held);
            self.last = None;
        }
    }

    /// Returns the number of the bit that begins at an edge.
    fn nearest_mark(&self, time: Time) -> u64 {
        let mark = self.marks.partition_point(|mark| mark.time <= time).saturating_sub(1);
        let Some(mark) = self.marks.get(mark) else { return 0 };
        mark.bit
            + mark.grid.map_or(0, |grid| {
                ((time - mark.time) as f64 * grid.clock.rate() as f64 / 1e12 / SAMPLES as f64).round() as u64
            })
    }

    /// Removes the bits from `at` onwards.
    fn truncate(&mut self, at: u64) {
        let left = at.saturating_sub(self.first);
        self.words.truncate(left.div_ceil(64) as usize);
        if let (Some(word), 1..) = (self.words.last_mut(), left % 64) {
            *word &= (1 << (left % 64)) - 1;
        }
        self.end = at;
        self.asked.set(0);
    }
}

/// Returns the mean of all offsets from a bit boundary, -0.5 to 0.5. They lie on a circle, so it uses their distances from
/// the first, then from their mean.
fn phase(places: &(impl Iterator<Item = f64> + Clone)) -> f64 {
    let within = |place: f64| place - place.round();
    let mut phase = places.clone().next().map_or(0.0, within);
    for _ in 0..2 {
        let (sum, count) = places.clone().fold((0.0, 0.0), |(sum, count), at| (sum + within(at - phase), count + 1.0));
        phase = within(phase + if count > 0.0 { sum / count } else { 0.0 });
    }
    phase
}

#[cfg(test)]
mod tests {
    use super::phase;

    #[test]
    fn the_phase_is_a_mean_on_a_circle() {
        let near = |places: &[f64], due: f64| (phase(&places.iter().copied()) - due).abs() < 1e-9;
        assert!(near(&[3.2, 5.0, 9.1], 0.1) && near(&[], 0.0));
        // On both sides of the half.
        assert!(near(&[3.45, 5.55, 8.5], 0.5) || near(&[3.45, 5.55, 8.5], -0.5));
        assert!(near(&[1.65, 2.75, 7.85], -0.25));
    }
}
