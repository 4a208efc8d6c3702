//! Feed override: slows down, stops and restarts a program on its path.
//!
//! The words of the program are steps at times. Here the program's time runs at a rate of 0 to 1, so all axes slow down
//! together and stay on their path, whatever the program is; steps only move apart, so two steps of an axis that are 4 us
//! apart stay at least 4
//! us apart.

use sorte_proto::{Pto, StartTime};

use super::power::{Power, rest};

/// Change of the rate in a cycle: from full speed to rest in 5000 cycles, 20 ms at 4 us.
const SLOPE: f64 = 1.0 / 5000.0;
const PERIOD: f64 = 4000.0;

#[derive(Debug)]
pub(super) struct Feed {
    rate: f64,
    target: f64,
    /// Nanoseconds of the program's cycle that have passed.
    done: f64,
    /// The program's cycle.
    words: Vec<Pto>,
}

impl Feed {
    pub(super) fn new(axes: usize) -> Self {
        Self { rate: 1.0, target: 1.0, done: 0.0, words: vec![Pto::default(); axes] }
    }

    /// Sets the rate from now on, which is reached by a ramp.
    pub(super) fn set(&mut self, target: f64) {
        self.target = target;
    }

    pub(super) fn is_still(&self) -> bool {
        self.rate == 0.0 && self.target == 0.0
    }

    /// Returns whether everything taken from the program has been passed on.
    pub(super) fn is_empty(&self) -> bool {
        self.done == 0.0
            || self.words.iter().all(|word| word.start().is_none_or(|start| f64::from(start.ns()) < self.done))
    }

    /// Returns the words of the next cycle.
    pub(super) fn next(&mut self, program: &mut Power, words: &mut [Pto]) {
        if self.rate >= 1.0 && self.target >= 1.0 && self.done == 0.0 {
            program.next(words);
            return;
        }
        let before = self.rate;
        self.rate += (self.target - before).clamp(-SLOPE, SLOPE);
        let rate = f64::midpoint(before, self.rate);
        for (to, word) in words.iter_mut().zip(&self.words) {
            *to = rest(*word);
        }
        if rate == 0.0 {
            return;
        }
        let end = self.done + rate * PERIOD;
        self.part(words, self.done, end.min(PERIOD), rate, 0.0);
        if end >= PERIOD {
            let taken = (PERIOD - self.done) / rate;
            program.next(&mut self.words);
            for (to, word) in words.iter_mut().zip(&self.words) {
                if to.start().is_none() {
                    *to = rest(*word);
                }
            }
            self.part(words, 0.0, end - PERIOD, rate, taken);
            self.done = end - PERIOD;
        } else {
            self.done = end;
        }
    }

    /// Passes on the steps of the program's cycle from `from` to before `to`; they begin `offset` into the resulting cycle.
    fn part(&self, words: &mut [Pto], from: f64, to: f64, rate: f64, offset: f64) {
        for (out, word) in words.iter_mut().zip(&self.words) {
            let Pto::Pulse { start, direction } = *word else { continue };
            let at = f64::from(start.ns());
            if (from..to).contains(&at) {
                let ns = (offset + (at - from) / rate) as u16;
                *out = Pto::Pulse { start: StartTime::truncate(ns), direction };
            }
        }
    }
}
