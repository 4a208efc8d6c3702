//! A clock for a driver, and for the code that judges its readings.

use core::cell::Cell;

use servowire_core::{ClockError, TickRate, TimeBase};
use servowire_drivers::Clock;

/// Time from a counter of `BITS` bits that wraps. Several users may read it through references, and one of them has to read
/// it within half of its range.
pub struct Counter<const BITS: u32> {
    counter: fn() -> u32,
    time: Cell<TimeBase<BITS>>,
}

impl<const BITS: u32> Counter<BITS> {
    /// Its time is 0 now.
    pub fn new(rate: TickRate, counter: fn() -> u32) -> Self {
        Self { counter, time: Cell::new(TimeBase::new(rate, counter())) }
    }

    /// Returns the time for a caller that may have waited too long: time then stands still until the counter catches up.
    pub fn latest_ns(&self) -> u64 {
        self.look().or_else(|_| self.look()).unwrap_or_default()
    }

    /// Waits for this long.
    pub fn pause(&self, ns: u64) {
        let until_ns = self.latest_ns().saturating_add(ns);
        while self.latest_ns() < until_ns {}
    }

    #[inline]
    fn look(&self) -> Result<u64, ClockError> {
        let mut time = self.time.get();
        let now_ns = time.now_ns((self.counter)());
        self.time.set(time);
        now_ns
    }
}

impl<const BITS: u32> Clock for &Counter<BITS> {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.look()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn all_who_look_see_one_time_and_a_look_too_late_stands() {
        static TICKS: AtomicU32 = AtomicU32::new(0xffff_ff00);
        let clock = Counter::<24>::new(TickRate::of::<16_000_000>(), || TICKS.load(Ordering::Relaxed) & 0x00ff_ffff);
        let (mut driver, mut judge) = (&clock, &clock);
        TICKS.fetch_add(0x0080, Ordering::Relaxed);
        assert_eq!(driver.now_ns(), Ok(8_000));
        // Across the wrap of the counter.
        TICKS.fetch_add(0x0200, Ordering::Relaxed);
        assert_eq!((judge.now_ns(), driver.now_ns(), clock.latest_ns()), (Ok(40_000), Ok(40_000), 40_000));
        // More than half of its range.
        TICKS.fetch_add(0x0090_0000, Ordering::Relaxed);
        assert!(driver.now_ns().is_err());
        TICKS.fetch_add(0x0090_0000, Ordering::Relaxed);
        assert!(clock.latest_ns() >= 40_000);
    }
}
