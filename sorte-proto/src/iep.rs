//! An ideal IEP timer with its SYNC0 output and a [`Sync0`] handler, for test benches and simulators.
//!
//! The counter runs in ticks of 5 ns: 0, 5, .. 3995, 0. A compare fires in the tick in which the counter reaches or
//! passes its value, if it is enabled then. The handler runs a fixed time after the first event that is not yet served, after
//! the compares of that tick, and serves all events that have fired by then. Its register writes take effect at once, or one
//! after the other, see [`Channel::with_write_time`].
//!
//! Nothing is simulated between events, so a cycle costs a handful of steps instead of 800.
//!
//! ```
//! use sorte_proto::StartTime;
//! use sorte_proto::iep::{Channel, Edge};
//! use sorte_proto::sync0::Variant;
//! let mut axis = Channel::new(Variant::Lossless, 2000, 300);
//! axis.set_start(StartTime::new(600)); // for the cycle after this one
//! assert_eq!(axis.next_edge(8000), Some(Edge { ns: 4595, high: true }));
//! assert_eq!(axis.next_edge(8000), Some(Edge { ns: 6595, high: false }));
//! ```

use core::hash::{Hash, Hasher};

use crate::pins::{Levels, Pins};
use crate::pto::{Pto, StartTime};
use crate::sync0::{PULSE_NS, Register, Sync0, Variant, Write, Writes};

/// One tick of the counter in ns.
pub(crate) const TICK_NS: u64 = 5;
/// Ticks of one cycle.
const CYCLE: u64 = 800;
/// CMP0 in ticks.
const WRAP: u64 = 799;
const PULSE: u64 = PULSE_NS as u64 / TICK_NS;
const NEVER: u64 = u64::MAX;

/// A change of the SYNC0 output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Edge {
    /// When it changes, in ns since the start.
    pub ns: u64,
    /// The new level.
    pub high: bool,
}

servowire_core::one_line!(Edge {
    Self { ns, high: true } => "rises at {} ns", ns;
    Self { ns, high: false } => "falls at {} ns", ns;
});

/// Events that wait for the handler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Events {
    /// The pulse has ended.
    pub cmp6: bool,
    /// The counter has wrapped.
    pub cmp0: bool,
    /// New data.
    pub cmp7: bool,
}

/// One run of the handler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Served {
    /// When it changes, in ns since the start.
    pub ns: u64,
    /// The events that it served.
    pub events: Events,
    /// The writes made for CMP6, CMP0 and CMP7.
    pub writes: [Option<Writes>; 3],
    /// New levels of DIR and enable, if they change.
    pub levels: Option<Levels>,
}

/// The next change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Activity {
    /// SYNC0 changes.
    Edge(Edge),
    /// The handler has run.
    Served(Served),
}

/// One axis: timer, SYNC0 output and handler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Channel {
    sync0: Sync0,
    pins: Pins,
    word: Pto,
    latency: u64,
    /// The last tick that has been simulated.
    now: u64,
    /// Ticks of the next events.
    cmp0: u64,
    cmp1: u64,
    cmp6: u64,
    cmp7: u64,
    serve: u64,
    rise: u64,
    fall: u64,
    /// Registers.
    cmp1_ns: u16,
    cmp6_ns: u16,
    cfg: u16,
    sync_start: u16,
    armed: bool,
    pending: Events,
    /// The writes of the handler, in order, and how many of them have been made; the time that one takes, and the times of the
    /// next and of the last.
    queue: [Writes; 3],
    made: u8,
    write_ticks: u64,
    write: u64,
    busy_until: u64,
}

/// The fields that nearly always distinguish two channels.
impl Hash for Channel {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (self.sync0, self.word, self.cmp6_ns).hash(state);
        (self.cmp1, self.cmp6, self.serve, self.rise, self.fall).hash(state);
    }
}

impl Channel {
    /// Creates a timer at 0. `cmp7_ns` is when new data are taken, 2000 in the reference design; `latency_ns` is the time from
    /// an event to its handler, rounded up to ticks.
    pub const fn new(variant: Variant, cmp7_ns: u16, latency_ns: u16) -> Self {
        Self {
            sync0: Sync0::new(variant),
            pins: Pins::new(),
            word: Pto::NoPulse { direction: crate::pto::Direction::Low },
            latency: (latency_ns as u64).div_ceil(TICK_NS),
            now: 0,
            cmp0: WRAP,
            cmp1: NEVER,
            cmp6: NEVER,
            cmp7: (cmp7_ns as u64).div_ceil(TICK_NS),
            serve: NEVER,
            rise: NEVER,
            fall: NEVER,
            cmp1_ns: 0,
            cmp6_ns: 0,
            cfg: crate::sync0::CMP_CFG_IDLE,
            sync_start: 0,
            armed: true,
            pending: Events { cmp6: false, cmp0: false, cmp7: false },
            queue: [Writes::NONE; 3],
            made: 0,
            write_ticks: 0,
            write: NEVER,
            busy_until: 0,
        }
    }

    /// Makes each register write take `write_ns`, rounded up to ticks: the first takes effect this long after the handler's
    /// start, the second twice as long, and so on. New events wait until the last write is made.
    pub const fn with_write_time(mut self, write_ns: u16) -> Self {
        self.write_ticks = (write_ns as u64).div_ceil(TICK_NS);
        self
    }

    /// Puts a word into the output buffer, where CMP7 will find it.
    pub const fn set_word(&mut self, word: Pto) {
        self.word = word;
    }

    /// The word in the output buffer.
    pub const fn word(&self) -> Pto {
        self.word
    }

    /// Sets a word with this start and the present DIR level.
    pub const fn set_start(&mut self, start: Option<StartTime>) {
        let direction = self.pins.levels().direction;
        self.word = match start {
            Some(start) => Pto::Pulse { start, direction },
            None => Pto::NoPulse { direction },
        };
    }

    /// DIR and enable.
    pub const fn levels(&self) -> Levels {
        self.pins.levels()
    }

    /// The handler's state.
    pub const fn sync0(&self) -> &Sync0 {
        &self.sync0
    }

    /// Returns the value last written to a register.
    pub const fn register(&self, register: Register) -> u16 {
        match register {
            Register::CmpCfg => self.cfg,
            Register::Cmp1 => self.cmp1_ns,
            Register::Cmp6 => self.cmp6_ns,
            Register::SyncStart => self.sync_start,
            Register::SyncCtrl => {
                if self.armed {
                    3
                } else {
                    2
                }
            }
        }
    }

    /// Returns the same channel with its time origin moved `cycles` later: the times of later events are smaller by that many
    /// cycles. Run it up to that point first, with [`next`](Self::next).
    ///
    /// Channels that will behave alike then compare equal, whatever they did before, so a bench need not compute the same
    /// behaviour twice.
    ///
    /// ```
    /// use sorte_proto::iep::Channel;
    /// use sorte_proto::sync0::Variant;
    /// let start = Channel::new(Variant::Lossless, 2000, 0);
    /// let mut idle = start;
    /// while idle.next(3_000_000).is_some() {}
    /// assert_eq!(idle.rebased(750), start);
    /// ```
    pub const fn rebased(mut self, cycles: u64) -> Self {
        let ticks = cycles.saturating_mul(CYCLE);
        self.cmp0 = earlier(self.cmp0, ticks);
        self.cmp1 = earlier(self.cmp1, ticks);
        self.cmp6 = earlier(self.cmp6, ticks);
        self.cmp7 = earlier(self.cmp7, ticks);
        self.serve = earlier(self.serve, ticks);
        self.rise = earlier(self.rise, ticks);
        self.fall = earlier(self.fall, ticks);
        self.write = earlier(self.write, ticks);
        self.busy_until = self.busy_until.saturating_sub(ticks);
        // The tick dealt with last is no longer of interest.
        self.now = 0;
        self
    }

    /// Returns the next edge before `until_ns`.
    pub fn next_edge(&mut self, until_ns: u64) -> Option<Edge> {
        loop {
            if let Activity::Edge(edge) = self.next(until_ns)? {
                return Some(edge);
            }
        }
    }

    /// Returns the next edge or run of the handler before `until_ns`.
    pub fn next(&mut self, until_ns: u64) -> Option<Activity> {
        loop {
            let compare = self.cmp0.min(self.cmp1).min(self.cmp6).min(self.cmp7);
            let edge = self.rise.min(self.fall);
            let at = compare.min(edge).min(self.serve).min(self.write);
            if at.saturating_mul(TICK_NS) >= until_ns {
                return None;
            }
            self.now = at;
            if compare == at {
                self.compare();
            } else if self.write == at {
                self.write_queued();
            } else if edge == at {
                return Some(Activity::Edge(self.edge()));
            } else {
                return Some(self.run_handler());
            }
        }
    }

    fn compare(&mut self) {
        let at = self.now;
        let next = at.saturating_add(CYCLE);
        if self.cmp1 == at {
            self.cmp1 = next;
            if self.armed {
                self.armed = false;
                self.rise = at.saturating_add(u64::from(self.sync_start)).saturating_add(1);
            }
        }
        let interrupt = self.cmp0 == at || self.cmp6 == at || self.cmp7 == at;
        if self.cmp0 == at {
            self.cmp0 = next;
            self.pending.cmp0 = true;
        }
        if self.cmp6 == at {
            self.cmp6 = next;
            self.pending.cmp6 = true;
        }
        if self.cmp7 == at {
            self.cmp7 = next;
            self.pending.cmp7 = true;
        }
        if interrupt && self.serve == NEVER {
            self.serve = at.saturating_add(self.latency).max(self.busy_until);
        }
    }

    fn edge(&mut self) -> Edge {
        let high = self.rise == self.now;
        if high {
            self.rise = NEVER;
            self.fall = self.now.saturating_add(PULSE);
        } else {
            self.fall = NEVER;
        }
        self.at(high)
    }

    const fn at(&self, high: bool) -> Edge {
        Edge { ns: self.now.saturating_mul(TICK_NS), high }
    }

    /// A pulse that is cut falls right after the handler, in the same tick.
    fn run_handler(&mut self) -> Activity {
        let events = core::mem::take(&mut self.pending);
        self.serve = NEVER;
        let (mut writes, mut levels) = ([None; 3], None);
        let [six, zero, seven] = &mut writes;
        if events.cmp6 {
            *six = Some(self.sync0.cmp6());
            levels = self.pins.cmp6();
        }
        if events.cmp0 {
            *zero = Some(self.sync0.cmp0());
        }
        if events.cmp7 {
            levels = self.pins.cmp7(self.word, self.sync0.flags()).or(levels);
            *seven = Some(self.sync0.cmp7(self.word.start()));
        }
        self.write_all(writes.map(|writes| writes.unwrap_or(Writes::NONE)));
        Activity::Served(Served { ns: self.now.saturating_mul(TICK_NS), events, writes, levels })
    }

    /// Makes the writes at once, or one after the other. The handler never runs while writes of its previous run are
    /// pending.
    fn write_all(&mut self, writes: [Writes; 3]) {
        let all = writes.into_iter().flatten();
        if self.write_ticks == 0 {
            return all.for_each(|write| self.make(write));
        }
        self.queue = writes;
        self.busy_until = all.fold(self.now, |last, _| last.saturating_add(self.write_ticks));
        if self.busy_until > self.now {
            self.write = self.now.saturating_add(self.write_ticks);
        }
    }

    /// Makes the oldest write take effect.
    fn write_queued(&mut self) {
        let mut left = self.queue.into_iter().flatten().skip(self.made.into());
        let next = left.next();
        if left.next().is_some() {
            self.made = self.made.saturating_add(1);
            self.write = self.now.saturating_add(self.write_ticks);
        } else {
            (self.queue, self.made, self.write) = ([Writes::NONE; 3], 0, NEVER);
        }
        if let Some(write) = next {
            self.make(write);
        }
    }

    fn make(&mut self, Write { register, value }: Write) {
        match register {
            Register::CmpCfg => self.cfg = value,
            Register::Cmp1 => self.cmp1_ns = value,
            Register::Cmp6 => self.cmp6_ns = value,
            Register::SyncStart => self.sync_start = value,
            Register::SyncCtrl if value == 2 => {
                self.armed = false;
                self.rise = NEVER;
                self.fall = if self.fall == NEVER { NEVER } else { self.now };
            }
            Register::SyncCtrl => self.armed = true,
        }
        match register {
            Register::CmpCfg => {
                self.cmp1 = self.next_match(2, self.cmp1_ns);
                self.cmp6 = self.next_match(7, self.cmp6_ns);
            }
            Register::Cmp1 => self.cmp1 = self.next_match(2, value),
            Register::Cmp6 => self.cmp6 = self.next_match(7, value),
            Register::SyncStart | Register::SyncCtrl => {}
        }
    }

    /// Returns the next tick after this one in which the counter reaches `value_ns`, if bit `enable` of CMP_CFG is set.
    fn next_match(&self, enable: u8, value_ns: u16) -> u64 {
        let tick = u64::from(value_ns).div_ceil(TICK_NS);
        if self.cfg >> enable & 1 == 0 || tick > WRAP {
            return NEVER;
        }
        let in_cycle = self.now.checked_rem(CYCLE).unwrap_or(0);
        let start = self.now.saturating_sub(in_cycle);
        let wait = if tick > in_cycle { tick } else { tick.saturating_add(CYCLE) };
        start.saturating_add(wait)
    }
}

const fn earlier(at: u64, ticks: u64) -> u64 {
    if at == NEVER { NEVER } else { at.saturating_sub(ticks) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The counter goes to 3995 and back to 0, so no event comes of a value beyond that.
    #[test]
    fn a_compare_value_the_counter_never_reaches() {
        for (value, edge) in
            [(3990, Some(3995)), (3991, Some(4000)), (3995, Some(4000)), (3996, None), (4000, None), (5600, None)]
        {
            let mut axis = Channel::new(Variant::Published, 2000, 0);
            axis.make(Write { register: Register::SyncStart, value: 0 });
            axis.make(Write { register: Register::Cmp1, value });
            axis.make(Write { register: Register::CmpCfg, value: 0x107 });
            assert_eq!(axis.next_edge(20_000).map(|edge| edge.ns), edge, "{value}");
        }
    }
}
