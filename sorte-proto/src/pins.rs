//! DIR and the driver's enable, and when they may follow a word.

use crate::pto::{Direction, Pto};
use crate::sync0::Flags;

/// A general-purpose pin of the AM335x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gpio {
    /// GPIO module, 0..=3.
    pub module: u8,
    /// Bit in it, 0..=31.
    pub bit: u8,
}

/// The motor driver on the board of the reference design (TIDEP-0061, section 2.4.1). STEP is the SYNC0 output of the IEP, and
/// the registers are at SPI1 with chip select 0.
pub mod ice {
    use super::Gpio;

    /// DIR.
    pub const DIR: Gpio = Gpio { module: 1, bit: 31 };
    /// RESET, active high: the registers take their reset values.
    pub const RESET: Gpio = Gpio { module: 1, bit: 14 };
    /// nSLEEP, active low. Wait [`WAKE_NS`](crate::drv8711::WAKE_NS) after it rises.
    pub const N_SLEEP: Gpio = Gpio { module: 1, bit: 15 };
    /// nSTALL, active low, from the driver.
    pub const N_STALL: Gpio = Gpio { module: 0, bit: 12 };
    /// nFAULT, active low, from the driver.
    pub const N_FAULT: Gpio = Gpio { module: 0, bit: 13 };
}

/// Shortest time from a STEP edge to a change of DIR, and from a change of DIR to the next STEP edge: set-up and hold time
/// of the DRV8711 in ns.
pub const DIR_SETUP_HOLD_NS: u64 = crate::drv8711::DIR_SETUP_HOLD_NS as u64;

/// The levels of the pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Levels {
    /// DIR.
    pub direction: Direction,
    /// Whether the motor driver is on.
    pub enabled: bool,
}

/// DIR and enable of an axis, beside its [`Sync0`](crate::sync0::Sync0).
///
/// A word, including its DIR and enable, applies to the next cycle. If a pulse is still programmed when CMP7 takes the word,
/// the pins follow at the end of that pulse, in the CMP6 handler: at least 2000 ns after its rise and, with steps 4000 ns
/// apart, at least 1380 ns before the next one. Otherwise they follow at once, at least 1380 ns before the earliest pulse of
/// the next cycle. Both are far beyond the 200 ns of set-up and hold time that the driver requires, at every latency up to
/// [`MAX_LATENCY_NS`](crate::sync0::MAX_LATENCY_NS). (A change at the wrap, or at a fixed time, is not safe: a pulse that
/// begins 3960 ns into the cycle leaves 40 ns.)
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pins {
    now: Levels,
    next: Levels,
}

impl Pins {
    /// Creates the state with DIR low and the driver on.
    pub const fn new() -> Self {
        let levels = Levels { direction: Direction::Low, enabled: true };
        Self { now: levels, next: levels }
    }

    /// The present levels of the pins.
    pub const fn levels(&self) -> Levels {
        self.now
    }

    /// Takes a word at CMP7. `before` holds the flags of its [`Sync0`](crate::sync0::Sync0) before this event. Returns the
    /// levels to write, if they change.
    pub fn cmp7(&mut self, word: Pto, before: Flags) -> Option<Levels> {
        // A driver-off word holds DIR.
        let direction = word.direction().unwrap_or(self.next.direction);
        self.next = Levels { direction, enabled: word.driver_enabled() };
        if before.contains(Flags::PENDING_PULSE) { None } else { self.follow() }
    }

    /// Takes the end of the pulse. Returns the levels to write, if they change.
    pub fn cmp6(&mut self) -> Option<Levels> {
        self.follow()
    }

    fn follow(&mut self) -> Option<Levels> {
        let changed = self.now != self.next;
        self.now = self.next;
        changed.then_some(self.now)
    }
}

impl Default for Pins {
    fn default() -> Self {
        Self::new()
    }
}

servowire_core::one_line!(Levels {
    Self { direction, enabled: true } => "{}, driver on", direction;
    Self { direction, enabled: false } => "{}, driver off", direction;
});
