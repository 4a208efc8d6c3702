//! One axis: SYNC0 generator, DIR, motor, and what becomes of each step.

use std::collections::VecDeque;

use sorte_proto::drv8711::{STEP_NS, WAKE_NS};
use sorte_proto::iep::Channel;
use sorte_proto::pins::{DIR_SETUP_HOLD_NS, Levels};
use sorte_proto::sync0::{CMP7_NS, Variant};
use sorte_proto::{Direction, Pto};

use super::driver::Driver;
use super::periods::{Change, Generator, PERIOD};

/// Maximum number of steps in progress; older ones are lost.
const UNDER_WAY: usize = 8;

/// Counts of the steps of an axis, by outcome.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Tally {
    /// Steps requested by the motion.
    pub(super) asked: u64,
    /// Steps that the device ordered from its generator, including those caught up.
    pub(super) ordered: u64,
    /// Pulses in time.
    pub(super) on_time: u64,
    /// Pulses at the wrong time.
    pub(super) late: u64,
    /// Pulses without a step: the published device repeats its last step when a frame is lost.
    pub(super) extra: u64,
    /// Steps without a pulse.
    pub(super) lost: u64,
    /// Steps that the motor made: pulses with the driver on.
    pub(super) moved: u64,
    /// Steps made later, in a cycle that had no step itself, because their frame was lost.
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

/// A word received in a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Incoming {
    /// When the device has received it, in ns since the start of its generator.
    pub(super) at: u64,
    pub(super) word: Pto,
    /// The master's time of its step.
    pub(super) expected: f64,
}

/// Settings of the generators, and the threshold for a late pulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Build {
    pub(super) variant: Variant,
    pub(super) latency_ns: u16,
    pub(super) write_ns: u16,
    /// A pulse this far from its time or further is late.
    pub(super) tolerance_ns: f64,
}

impl Build {
    pub(super) fn generator(self) -> Generator {
        Generator::new(Channel::new(self.variant, CMP7_NS, self.latency_ns).with_write_time(self.write_ns))
    }
}

#[derive(Debug, Clone)]
pub(super) struct Axis {
    build: Build,
    /// The master's time of the steps in progress.
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

    /// Restarts the generator. Pulses of an earlier run have ended.
    pub(super) fn start(&mut self) {
        self.tally.lost += self.expected.len() as u64;
        self.expected.clear();
    }

    /// Handles an activity; `word`: the word in progress. Passes changes to `seen`, if that is set.
    pub(super) fn take(
        &mut self,
        change: Change,
        at: impl FnOnce() -> f64,
        word: Option<Incoming>,
        seen: Option<&mut Vec<(u64, Seen)>>,
    ) {
        match (change, word) {
            (Change::Word, Some(word)) => self.order(word),
            (Change::Word, None) => {}
            (Change::Step(high), _) => self.step(high, at(), seen),
            (Change::Pins(levels), _) => self.pins(levels, at(), seen),
        }
    }

    /// Notes that the word is in the buffer, so that its step will come.
    fn order(&mut self, Incoming { word, expected, .. }: Incoming) {
        if word.start().is_some() {
            self.tally.ordered += 1;
            self.expected.push_back(expected);
            if self.expected.len() > UNDER_WAY {
                self.expected.pop_front();
                self.tally.lost += 1;
            }
        }
    }

    fn step(&mut self, high: bool, at: f64, seen: Option<&mut Vec<(u64, Seen)>>) {
        if high {
            self.pulse(at);
        } else {
            self.tally.step_faults += u64::from(at - self.rise < f64::from(STEP_NS));
            self.fall = at;
        }
        if let Some(seen) = seen {
            seen.push((at as u64, Seen::Step(high)));
            seen.extend(high.then_some((at as u64, Seen::Position(self.position))));
        }
    }

    fn pins(&mut self, levels: Levels, at: f64, seen: Option<&mut Vec<(u64, Seen)>>) {
        let dir = levels.direction == Direction::High;
        if let Some(seen) = seen {
            seen.extend((dir != self.dir).then_some((at as u64, Seen::Dir(dir))));
            seen.extend((levels.enabled != self.enabled).then_some((at as u64, Seen::Enable(levels.enabled))));
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

    /// Matches a step of the motor with one of the expected steps.
    fn pulse(&mut self, at: f64) {
        if self.enabled && self.driver.drives() {
            self.position += if self.dir { -1 } else { 1 };
            self.tally.moved += 1;
        }
        self.tally.dir_faults += u64::from(at - self.changed < DIR_SETUP_HOLD_NS as f64);
        self.tally.step_faults += u64::from(at - self.fall < f64::from(STEP_NS));
        self.tally.wake_faults += u64::from(!self.enabled || at - self.woken < f64::from(WAKE_NS));
        self.rise = at;
        // What is long over will not come.
        while self.expected.front().is_some_and(|want| at - want > PERIOD as f64) {
            self.expected.pop_front();
            self.tally.lost += 1;
        }
        // The nearest is meant: steps are 4 us apart.
        let near = |want: &f64| (at - want).abs() < PERIOD as f64 / 2.0;
        let Some(place) = self.expected.iter().position(near) else {
            // Nobody asked for it: a step made twice.
            self.tally.extra += 1;
            return;
        };
        self.tally.lost += place as u64;
        let error = self.expected.drain(..=place).next_back().map_or(0.0, |want| (at - want).abs());
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

#[cfg(test)]
mod tests {
    use super::*;

    const BUILD: Build = Build { variant: Variant::Lossless, latency_ns: 0, write_ns: 0, tolerance_ns: 100.0 };

    /// An awake axis after this many changes: at a time, of STEP or the pins.
    fn after(changes: &[(u32, Change)]) -> Axis {
        let mut axis = Axis::new(BUILD);
        axis.driver.set_up().unwrap();
        for (ns, change) in changes {
            axis.take(*change, || f64::from(*ns), None, None);
        }
        axis
    }

    const UP: Change = Change::Step(true);
    const DOWN: Change = Change::Step(false);

    const fn pins(direction: Direction, enabled: bool) -> Change {
        Change::Pins(Levels { direction, enabled })
    }

    /// 200 ns before and after a rising STEP, the driver wants DIR to be still.
    #[test]
    fn a_change_of_dir_within_200_ns_of_a_step_is_seen() {
        let high = pins(Direction::High, true);
        let faults = |changes: &[(u32, Change)]| after(changes).tally.dir_faults;
        assert_eq!(faults(&[(1000, high), (1199, UP)]), 1);
        assert_eq!(faults(&[(1000, high), (1200, UP)]), 0);
        assert_eq!(faults(&[(1000, UP), (1199, high)]), 1);
        assert_eq!(faults(&[(1000, UP), (1200, high)]), 0);
        // The driver is switched, DIR stays.
        assert_eq!(faults(&[(1000, UP), (1100, pins(Direction::Low, false))]), 0);
    }

    /// 1.9 us high and low.
    #[test]
    fn a_pulse_too_short_or_too_close_is_seen() {
        let faults = |changes: &[(u32, Change)]| after(changes).tally.step_faults;
        assert_eq!(faults(&[(1000, UP), (2900, DOWN), (4800, UP)]), 0);
        assert_eq!(faults(&[(1000, UP), (2899, DOWN)]), 1);
        assert_eq!(faults(&[(1000, UP), (3000, DOWN), (4899, UP)]), 1);
    }

    /// 1 ms from nSLEEP to the first step.
    #[test]
    fn a_step_before_the_driver_is_awake_is_seen_and_moves_nothing_while_it_is_off() {
        let (off, on) = (pins(Direction::Low, false), pins(Direction::Low, true));
        let faults = |changes: &[(u32, Change)]| {
            let axis = after(changes);
            (axis.tally.wake_faults, axis.tally.moved, axis.position)
        };
        assert_eq!(faults(&[(1000, off), (5000, UP)]), (1, 0, 0));
        assert_eq!(faults(&[(1000, off), (2000, on), (1_001_999, UP)]), (1, 1, 1));
        assert_eq!(faults(&[(1000, off), (2000, on), (1_002_000, UP)]), (0, 1, 1));
    }

    #[test]
    fn a_pulse_is_on_time_late_or_instead_of_a_lost_one() {
        let word = |expected| Incoming { at: 0, word: Pto::from_step(500, Direction::Low).unwrap(), expected };
        let mut axis = after(&[]);
        for expected in [10_000.0, 14_000.0, 18_000.0, 22_000.0] {
            axis.take(Change::Word, || 0.0, Some(word(expected)), None);
        }
        for at in [10_100.0, 18_101.0] {
            axis.take(UP, || at, None, None);
        }
        let Tally { ordered, on_time, late, lost, worst_ns, .. } = axis.tally;
        assert_eq!((ordered, on_time, late, lost, worst_ns), (4, 1, 1, 1, 101.0));
        assert_eq!(axis.under_way(), 1);
        axis.start();
        assert_eq!((axis.tally.lost, axis.under_way()), (2, 0));
    }
}
