//! One axis: SYNC0 generator, DIR, motor, and what became of each step.

use std::collections::VecDeque;

use sorte_proto::drv8711::{STEP_NS, WAKE_NS};
use sorte_proto::iep::{Channel, Edge, Happening};
use sorte_proto::pins::DIR_SETUP_HOLD_NS;
use sorte_proto::sync0::{CMP7_NS, Variant};
use sorte_proto::{Direction, Pto};

use super::clock::Clock;
use super::driver::Driver;

/// Period of the generator.
pub(super) const PERIOD: u64 = 4000;
/// Steps under way at most; older ones are lost.
const UNDER_WAY: usize = 8;

/// What became of the steps of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Tally {
    /// Steps that the motion asked for.
    pub(super) asked: u64,
    /// Steps that the device ordered from its generator, those that it caught up with among them.
    pub(super) ordered: u64,
    /// Pulses at their time.
    pub(super) on_time: u64,
    /// Pulses at another time.
    pub(super) late: u64,
    /// Steps without a pulse.
    pub(super) lost: u64,
    /// Steps made in a cycle of their own because their frame was lost.
    pub(super) caught_up: u64,
    /// DIR too close to a rising STEP.
    pub(super) dir_faults: u64,
    /// STEP high or low for less than the driver needs.
    pub(super) step_faults: u64,
    /// Steps before the driver was awake.
    pub(super) wake_faults: u64,
    /// Largest distance of a pulse from its time, in ns.
    pub(super) worst_ns: f64,
}

/// A change that a logic analyser would see at the motor driver, in ns of the simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    Step(bool),
    Dir(bool),
    Enable(bool),
    Position(i64),
}

/// How the generators are made, and what a late pulse is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Build {
    pub(super) variant: Variant,
    pub(super) latency_ns: u16,
    pub(super) write_ns: u16,
    /// A pulse further from its time is late.
    pub(super) tolerance_ns: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Axis {
    build: Build,
    channel: Channel,
    /// Own counter at the start of the generator.
    zero: f64,
    /// The master's time of the steps that are under way.
    expected: VecDeque<f64>,
    rise: f64,
    fall: f64,
    changed: f64,
    woken: f64,
    enabled: bool,
    dir: bool,
    pub(super) driver: Driver,
    pub(super) position: i64,
    pub(super) tally: Tally,
}

impl Axis {
    pub(super) fn new(build: Build) -> Self {
        Self {
            build,
            channel: channel(build),
            zero: 0.0,
            expected: VecDeque::with_capacity(UNDER_WAY),
            rise: f64::NEG_INFINITY,
            fall: f64::NEG_INFINITY,
            changed: f64::NEG_INFINITY,
            woken: f64::NEG_INFINITY,
            enabled: true,
            dir: false,
            driver: Driver::new(),
            position: 0,
            tally: Tally::default(),
        }
    }

    /// The generator starts when the own counter holds `zero`. Pulses of a run before are over.
    pub(super) fn start(&mut self, zero: f64) {
        self.tally.lost += self.expected.len() as u64;
        self.expected.clear();
        (self.channel, self.zero) = (channel(self.build), zero);
    }

    /// The word in the device's buffer from now on, and its time if it has a step.
    pub(super) fn set(&mut self, word: Pto, expected: f64) {
        self.channel.set_word(word);
        if word.start().is_some() {
            self.tally.ordered += 1;
            self.expected.push_back(expected);
            if self.expected.len() > UNDER_WAY {
                self.expected.pop_front();
                self.tally.lost += 1;
            }
        }
    }

    /// The word has been taken.
    pub(super) fn rest(&mut self) {
        self.channel.set_start(None);
    }

    /// Goes on until the own counter is `until` ns after the start of the generator. Changes are given to `seen`, if anybody
    /// wants them.
    pub(super) fn run(&mut self, until: u64, clock: &Clock, mut seen: Option<&mut Vec<(u64, Seen)>>) {
        while let Some(happening) = self.channel.next(until) {
            match happening {
                Happening::Edge(Edge { ns, high }) => {
                    let at = clock.when(self.zero + ns as f64);
                    if let Some(seen) = &mut seen {
                        seen.push((at as u64, Seen::Step(high)));
                    }
                    if high {
                        self.pulse(at);
                        if let Some(seen) = &mut seen {
                            seen.push((at as u64, Seen::Position(self.position)));
                        }
                    } else {
                        self.tally.step_faults += u64::from(at - self.rise < f64::from(STEP_NS));
                        self.fall = at;
                    }
                }
                Happening::Served(served) => {
                    let Some(levels) = served.levels else { continue };
                    let at = clock.when(self.zero + served.ns as f64);
                    let dir = levels.direction == Direction::High;
                    if let Some(seen) = &mut seen {
                        seen.extend((dir != self.dir).then_some((at as u64, Seen::Dir(dir))));
                        seen.extend(
                            (levels.enabled != self.enabled).then_some((at as u64, Seen::Enable(levels.enabled))),
                        );
                    }
                    if dir != self.dir {
                        self.changed = at;
                        self.tally.dir_faults += u64::from(at - self.rise < DIR_SETUP_HOLD_NS as f64);
                    }
                    if levels.enabled && !self.enabled {
                        self.woken = at;
                    }
                    (self.dir, self.enabled) = (dir, levels.enabled);
                }
            }
        }
    }

    /// The motor takes a step; which of the expected was it?
    fn pulse(&mut self, at: f64) {
        if self.enabled && self.driver.drives() {
            self.position += if self.dir { -1 } else { 1 };
        }
        self.tally.dir_faults += u64::from(at - self.changed < DIR_SETUP_HOLD_NS as f64);
        self.tally.step_faults += u64::from(at - self.fall < f64::from(STEP_NS));
        self.tally.wake_faults += u64::from(!self.enabled || at - self.woken < f64::from(WAKE_NS));
        self.rise = at;
        // The nearest is meant: steps are 4 us apart.
        let near = |want: &f64| (at - want).abs() < PERIOD as f64 / 2.0;
        let error = match self.expected.iter().position(near) {
            Some(place) => {
                self.tally.lost += place as u64;
                self.expected.drain(..=place).next_back().map_or(f64::INFINITY, |want| (at - want).abs())
            }
            // A step of a cycle before, or one that nobody asked for.
            None => self.expected.pop_front().map_or(f64::INFINITY, |want| (at - want).abs()),
        };
        self.tally.worst_ns = self.tally.worst_ns.max(error);
        if error <= self.build.tolerance_ns {
            self.tally.on_time += 1;
        } else {
            self.tally.late += 1;
        }
    }

    /// Steps whose pulse is still to come.
    pub(super) fn under_way(&self) -> usize {
        self.expected.len()
    }
}

const fn channel(build: Build) -> Channel {
    Channel::new(build.variant, CMP7_NS, build.latency_ns).with_write_time(build.write_ns)
}
