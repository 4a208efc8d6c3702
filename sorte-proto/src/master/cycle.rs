//! The frames that came in the cycles of the IO exchange.

use crate::discovery::MAX_DEVICES;
use crate::tally::Tally;

/// A cycle whose device frames may still come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Cycle {
    pub(super) number: u64,
    /// When its master frame is triggered.
    pub(super) trigger_ns: u64,
    /// A bit for each address that has answered.
    seen: [u64; 4],
    /// A device frame was damaged.
    pub(super) damaged: bool,
    /// A frame was late, came twice, or belonged to another cycle.
    pub(super) disorderly: bool,
}

impl Cycle {
    pub(super) const fn new(number: u64, trigger_ns: u64) -> Self {
        Self { number, trigger_ns, seen: [0; 4], damaged: false, disorderly: false }
    }

    /// Marks the device as having answered; returns whether this was its first answer.
    pub(super) fn mark(&mut self, address: u8) -> bool {
        let new = !self.has(address);
        if let Some(word) = self.seen.get_mut(usize::from(address >> 6)) {
            *word |= 1 << (address & 63);
        }
        new
    }

    pub(super) fn has(&self, address: u8) -> bool {
        self.seen.get(usize::from(address >> 6)).is_some_and(|word| word >> (address & 63) & 1 == 1)
    }

    /// Number of devices seen, for a fast check that none is missing.
    pub(super) const fn count(&self) -> u32 {
        let [a, b, c, d] = self.seen;
        // At most 256.
        a.count_ones().saturating_add(b.count_ones()).saturating_add(c.count_ones()).saturating_add(d.count_ones())
    }
}

/// The cycles that are open, and how many before them were bad in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Cycles {
    /// The cycle returned last, and the one before it while its frames may still come.
    pub(super) present: Option<Cycle>,
    pub(super) before: Option<Cycle>,
    /// This is the first cycle of the exchange, in which the devices are silent.
    pub(super) first: Option<u64>,
    /// The last closed cycle had a fault: the next master frame reports it.
    pub(super) fault: bool,
    pub(super) damaged_in_a_row: u8,
    pub(super) silent_in_a_row: u8,
    /// From the trigger of a master frame to the end of the last device frame, in ns.
    pub(super) end_ns: u32,
    /// Time from one device to the next, averaged over the line, in ns.
    pub(super) hop_ns: u32,
}

impl Cycles {
    pub(super) const NEW: Self = Self {
        present: None,
        before: None,
        first: None,
        fault: false,
        damaged_in_a_row: 0,
        silent_in_a_row: 0,
        end_ns: 0,
        hop_ns: 0,
    };
}

/// What became of the frames of each device.
pub(super) type Tallies = [Tally; MAX_DEVICES];

/// Returns the nearest whole number of periods from `from_ns` to `at_ns`, and how far `at_ns` is from there.
pub(super) fn nearest(at_ns: u64, from_ns: u64, period_ns: u32) -> (i64, i64) {
    let off = i64::from_le_bytes(at_ns.wrapping_sub(from_ns).to_le_bytes());
    let period = i64::from(period_ns.max(1));
    let periods = off.saturating_add(period >> 1).checked_div_euclid(period).unwrap_or_default();
    (periods, off.saturating_sub(periods.saturating_mul(period)))
}
