use core::num::NonZeroU16;

use crate::header::UpdateCounter;

/// Notices that the echo of the counter stands still.
///
/// Sample once per update period. `limit` consecutive samples that equal the one before trip the watch, and it
/// stays tripped: command servo-off to **all** axes then ([`ServoOff`](super::ServoOff)). The time is not given by the
/// vendor, so the limit is the caller's. System Design Guide for Master, "Time-out by the counter echo".
///
/// Two traps: sampling every communication period when two of them make an update period sees every value twice
/// (the limit must be 2 or more then), and sampling every fourth update period always sees the same value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EchoWatch {
    limit: NonZeroU16,
    echo: Standstill,
}

impl EchoWatch {
    /// A watch that trips after `limit` unchanged samples.
    pub const fn new(limit: NonZeroU16) -> Self {
        Self { limit, echo: Standstill::new() }
    }

    /// Takes a sample; `None` where the update period brought no block of the drive, which counts as unchanged.
    /// Gives whether the watch is tripped.
    pub fn sample(&mut self, echo: Option<UpdateCounter>) -> bool {
        if !self.is_tripped() {
            self.echo.sample(echo);
        }
        self.is_tripped()
    }

    /// Whether the limit was reached.
    pub const fn is_tripped(&self) -> bool {
        self.echo.updates >= self.limit.get() as u32
    }

    /// Forgets everything: the link was set up anew.
    pub const fn reset(&mut self) {
        *self = Self::new(self.limit);
    }
}

/// The last echo of the counter, and how long it has stood still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Standstill {
    last: Option<UpdateCounter>,
    /// Samples since the last one that was another than the one before.
    updates: u32,
}

impl Standstill {
    pub(super) const fn new() -> Self {
        Self { last: None, updates: 0 }
    }

    pub(super) fn sample(&mut self, echo: Option<UpdateCounter>) {
        if echo.is_none() || echo == self.last {
            self.updates = self.updates.saturating_add(1);
        } else {
            (self.last, self.updates) = (echo, 0);
        }
    }
}

/// Notices that receptions stop, where the receive interrupt (XINTRX) is used.
///
/// Its handler calls [`frame_received`](Self::frame_received), the NC interrupt [`tick`](Self::tick). In the internal-timer system the
/// receive interrupt must have the lower priority of the two, in the external-timer system the higher. System Design
/// Guide for Master, chapters 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReceiveWatchdog {
    limit: NonZeroU16,
    ticks: u16,
}

impl ReceiveWatchdog {
    /// A watchdog that trips at the `limit`-th tick without a reception.
    pub const fn new(limit: NonZeroU16) -> Self {
        Self { limit, ticks: 0 }
    }

    /// A frame was received. A watchdog that has tripped stays so.
    pub const fn frame_received(&mut self) {
        if !self.is_tripped() {
            self.ticks = 0;
        }
    }

    /// An update period has passed; gives whether the watchdog is tripped.
    pub const fn tick(&mut self) -> bool {
        self.ticks = self.ticks.saturating_add(1);
        self.is_tripped()
    }

    /// Whether the limit was reached.
    pub const fn is_tripped(&self) -> bool {
        self.ticks >= self.limit.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn receptions_hold_the_watchdog_off_until_it_trips() {
        let mut watchdog = ReceiveWatchdog::new(NonZeroU16::new(2).unwrap());
        for _ in 0..5 {
            assert!(!watchdog.tick());
            watchdog.frame_received();
        }
        assert!(!watchdog.tick());
        assert!(watchdog.tick());
        watchdog.frame_received();
        assert!(watchdog.is_tripped() && watchdog.tick());
    }

    #[test]
    fn a_drive_that_never_answers_trips_too() {
        let mut watch = EchoWatch::new(NonZeroU16::new(3).unwrap());
        assert_eq!([None; 4].map(|echo| watch.sample(echo)), [false, false, true, true]);
        watch.reset();
        assert!(!watch.sample(UpdateCounter::new(1)));
        assert!(!watch.sample(None));
        assert!(!watch.sample(None));
        assert!(!watch.sample(UpdateCounter::new(2)));
    }
}
