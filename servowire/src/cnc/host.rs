//! The host above the master: runs the program, watches the reports of the axes, slows down, stops, and says why.

use sorte_proto::Pto;

use super::feed::Feed;
use super::node::Node;
use super::power::Power;

/// Number of missing steps at which the host slows down, so that the axis finds cycles in which to catch up.
const SLOW_LAG: u16 = 32;
/// The rate in that case: at least 12 us between two steps, so two cycles in a row without a step.
const SLOW: f64 = 0.3;
/// Cycles from the last word until all pulses have ended.
const DRAIN: u32 = 6;
/// Cycles after which the host stops waiting for an axis that does not catch up.
const PATIENCE: u32 = 20_000;

pub(super) struct Host {
    pub(super) program: Power,
    feed: Feed,
    words: Vec<Pto>,
    max_lag: u16,
    /// Cycles of motion; `None`: until the program ends.
    cycles: Option<u64>,
    cycle: u64,
    /// Why the motion was ended early.
    pub(super) ended: Option<String>,
    /// Set after the master has restarted: nothing moves until the axes are where they should be.
    resuming: bool,
    catching_up: bool,
    /// Cycles since the last work was done, and since motion resumed.
    idle: u32,
    waited: u32,
}

impl Host {
    pub(super) fn new(program: Power, axes: usize, cycles: Option<u64>, max_lag: u16) -> Self {
        Self {
            program,
            feed: Feed::new(axes),
            words: vec![Pto::default(); axes],
            max_lag,
            cycles,
            cycle: 0,
            ended: None,
            resuming: false,
            catching_up: false,
            idle: 0,
            waited: 0,
        }
    }

    /// The master restarts; words on their way are lost.
    pub(super) fn restarted(&mut self) {
        (self.resuming, self.waited) = (true, 0);
    }

    /// Returns the words of the next cycle. `stop`: the master is about to restart.
    pub(super) fn plan(&mut self, stop: bool, nodes: &[Node]) {
        self.cycle += 1;
        let worst = nodes.iter().map(|node| node.lag.unsigned_abs()).max().unwrap_or(0);
        if self.ended.is_none() {
            self.ended = self.trouble(stop, worst, nodes);
        }
        if self.resuming && !stop {
            self.waited += 1;
            self.resuming = worst > 0 || self.waited <= DRAIN;
        }
        self.catching_up = worst > if self.catching_up { 0 } else { SLOW_LAG };
        let over = self.cycles.is_some_and(|cycles| self.cycle > cycles);
        let halt = stop || over || self.resuming || self.ended.is_some();
        self.feed.set(if halt {
            0.0
        } else if self.catching_up {
            SLOW
        } else {
            1.0
        });
        for (axis, _) in nodes.iter().enumerate().filter(|(_, node)| node.lag != 0) {
            self.program.keep(axis);
        }
        self.feed.next(&mut self.program, &mut self.words);
        let finished =
            (self.program.is_over() && self.feed.is_empty()) || (over || self.ended.is_some()) && self.feed.is_still();
        self.idle = if finished { self.idle + 1 } else { 0 };
        if worst > 0 && self.idle > DRAIN && self.idle < PATIENCE {
            // The axis still has something to catch up.
            self.idle = self.idle.max(DRAIN + 1);
        } else if worst == 0 && self.idle > DRAIN {
            self.idle = PATIENCE;
        }
    }

    fn trouble(&self, stop: bool, worst: u16, nodes: &[Node]) -> Option<String> {
        for (axis, node) in (1..).zip(nodes) {
            if let Err(error) = node.set_up {
                return Some(format!("the driver of axis {axis} does not accept its settings: {error}"));
            }
            if node.status.looks_unpowered() {
                return Some(format!("the driver of axis {axis} has no supply"));
            }
            // A stall is not a fault of the chip, but the motor is not where it was sent.
            if !node.status.is_empty() {
                return Some(format!("the driver of axis {axis} reports {}", node.status));
            }
        }
        if !stop && self.resuming && self.waited > 1 {
            if let Some(missing) = nodes.iter().position(|node| !node.is_running()) {
                return Some(format!("device {} is missing", missing + 1));
            }
        }
        if worst > self.max_lag {
            let axis = nodes.iter().position(|node| node.lag.unsigned_abs() == worst).unwrap_or(0);
            return Some(format!("axis {} is {worst} steps behind", axis + 1));
        }
        if self.resuming && self.waited >= PATIENCE {
            return Some("an axis does not catch up".to_owned());
        }
        None
    }

    /// One for each axis.
    pub(super) fn words(&self) -> &[Pto] {
        &self.words
    }

    /// Returns whether the axes are at rest.
    pub(super) fn is_still(&self) -> bool {
        self.feed.is_still()
    }

    /// Returns whether the motion and all its pulses have ended.
    pub(super) fn is_done(&self) -> bool {
        self.idle >= PATIENCE
    }
}
