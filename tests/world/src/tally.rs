use std::fmt;

use crate::Kind;

/// What has happened, counted. Print it at the end of a test: a fault that never happened was never survived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Faults by [`Kind::ALL`].
    pub faults: [u64; Kind::ALL.len()],
    /// Transmissions of host and devices.
    pub sent: u64,
    /// Transmissions of noise and foreign speakers.
    pub spurious: u64,
    /// Pairs of units of two speakers that were on the line at once.
    pub collisions: u64,
    /// Units that a device heard, counted for each.
    pub heard: u64,
    /// Units that ended on the line where the host listened.
    pub for_host: u64,
    /// Of these: handed over.
    pub delivered: u64,
    /// Of these: not heard by the host's receiver.
    pub missed: u64,
    /// Of these: lost in a collision.
    pub swallowed: u64,
    /// Of these: lost because the receiver was full.
    pub overrun: u64,
    /// Hand-overs.
    pub blocks: u64,
}

impl Tally {
    /// How many faults of this kind.
    pub const fn of(&self, kind: Kind) -> u64 {
        self.faults[kind as usize]
    }

    /// All faults.
    pub fn all_faults(&self) -> u64 {
        self.faults.iter().sum()
    }

    /// All events: faults, transmissions and units.
    pub fn events(&self) -> u64 {
        self.all_faults() + self.sent + self.spurious + self.heard + self.for_host
    }

    /// Takes in another run.
    pub fn add(&mut self, other: &Self) {
        self.faults.iter_mut().zip(other.faults).for_each(|(sum, more)| *sum += more);
        self.sent += other.sent;
        self.spurious += other.spurious;
        self.collisions += other.collisions;
        self.heard += other.heard;
        self.for_host += other.for_host;
        self.delivered += other.delivered;
        self.missed += other.missed;
        self.swallowed += other.swallowed;
        self.overrun += other.overrun;
        self.blocks += other.blocks;
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} faults:", self.all_faults())?;
        Kind::ALL.iter().try_for_each(|kind| write!(f, " {kind:?} {}", self.of(*kind)))?;
        write!(f, "; {} transmissions, {} spurious, {} collisions; ", self.sent, self.spurious, self.collisions)?;
        write!(f, "units heard by devices {}, by the host {} (", self.heard, self.for_host)?;
        write!(f, "delivered {} in {} blocks, missed {}, ", self.delivered, self.blocks, self.missed)?;
        write!(f, "swallowed {}, overrun {})", self.swallowed, self.overrun)
    }
}
