//! One axis: SYNC0 generator, DIR, motor, and what became of each step.

use std::collections::VecDeque;

use sorte_proto::iep::{Channel, Edge};
use sorte_proto::sync0::{CMP7_NS, Variant};
use sorte_proto::{Direction, Pto};

/// A pulse may be so far from its time: two ticks of the 5 ns timer.
const TOLERANCE_NS: u64 = 10;
const CYCLE_NS: u64 = 4000;

/// What became of the steps of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Tally {
    /// Steps that the motion asked for.
    pub(super) asked: u64,
    /// Steps in frames that the device accepted.
    pub(super) carried: u64,
    /// Pulses at their time.
    pub(super) on_time: u64,
    /// Pulses at another time.
    pub(super) late: u64,
    /// Steps without a pulse.
    pub(super) lost: u64,
}

/// A change that a logic analyser would see at the motor driver, in ns of the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    Step(bool),
    Dir(bool),
    Enable(bool),
    Position(i64),
}

#[derive(Debug, Clone)]
pub(super) struct Axis {
    channel: Channel,
    latency_ns: u64,
    /// Cycles since the generator was started.
    cycle: u64,
    /// Times of the steps that are under way.
    expected: VecDeque<u64>,
    /// The word of the cycle before, which is about this one.
    taken: Option<Pto>,
    dir: bool,
    enabled: bool,
    pub(super) position: i64,
    pub(super) tally: Tally,
}

impl Axis {
    pub(super) fn new(variant: Variant, latency_ns: u16) -> Self {
        Self {
            channel: Channel::new(variant, CMP7_NS, latency_ns),
            latency_ns: latency_ns.into(),
            cycle: 0,
            expected: VecDeque::new(),
            taken: None,
            dir: false,
            enabled: true,
            position: 0,
            tally: Tally::default(),
        }
    }

    /// The next cycle. `word`: what the frame of the cycle before has brought; `None` if it was not accepted. The
    /// changes are given to `seen` with their time in this cycle, if anybody wants them.
    pub(super) fn run_cycle(&mut self, word: Option<Pto>, mut seen: Option<&mut Vec<(u64, Seen)>>) {
        let begin = self.cycle * CYCLE_NS;
        let start = word.and_then(Pto::start);
        if let Some(start) = start {
            self.expected.push_back(begin + CYCLE_NS + u64::from(start.ns()));
            self.tally.carried += 1;
        }
        self.channel.set_start(start);
        // A word is about the next cycle, DIR and the enable too: they follow at the wrap, behind the last pulse.
        self.edges(begin, begin + self.latency_ns, seen.as_deref_mut());
        if let Some(word) = core::mem::replace(&mut self.taken, word) {
            self.outputs(word, seen.as_deref_mut());
        }
        self.edges(begin, begin + CYCLE_NS, seen);
        self.cycle += 1;
    }

    /// DIR and the enable as the word says; a driver-off word leaves DIR.
    fn outputs(&mut self, word: Pto, seen: Option<&mut Vec<(u64, Seen)>>) {
        let dir = word.direction().map_or(self.dir, Direction::is_high);
        let enabled = word.driver_enabled();
        if let Some(seen) = seen {
            let at = self.latency_ns;
            seen.extend((dir != self.dir).then_some((at, Seen::Dir(dir))));
            seen.extend((enabled != self.enabled).then_some((at, Seen::Enable(enabled))));
        }
        (self.dir, self.enabled) = (dir, enabled);
    }

    fn edges(&mut self, begin: u64, until: u64, mut seen: Option<&mut Vec<(u64, Seen)>>) {
        while let Some(Edge { ns, high }) = self.channel.next_edge(until) {
            if let Some(seen) = &mut seen {
                seen.push((ns - begin, Seen::Step(high)));
            }
            if high {
                self.pulse(ns);
                if let Some(seen) = &mut seen {
                    seen.push((ns - begin, Seen::Position(self.position)));
                }
            }
        }
    }

    /// The motor takes a step; which of the expected was it?
    fn pulse(&mut self, ns: u64) {
        if self.enabled {
            self.position += if self.dir { -1 } else { 1 };
        }
        let at_its_time = self.expected.iter().position(|want| ns.abs_diff(*want) <= TOLERANCE_NS);
        if let Some(skipped) = at_its_time {
            self.tally.on_time += 1;
            self.tally.lost += skipped as u64;
            self.expected.drain(..=skipped);
        } else {
            self.tally.late += 1;
            self.expected.pop_front();
        }
    }

    /// The device starts again: pulses that are programmed still come, everything else is gone.
    pub(super) fn restart(&mut self, variant: Variant) {
        for _ in 0..3 {
            self.run_cycle(None, None);
        }
        self.tally.lost += self.expected.len() as u64;
        self.expected.clear();
        self.channel = Channel::new(variant, CMP7_NS, self.latency_ns as u16);
        self.cycle = 0;
    }
}
