//! Time in ns from the SysTick timer, which counts down 24 bits with the system clock.

use cortex_m::peripheral::{SYST, syst::SystClkSource};

/// A clock that must be looked at every 100 ms, or it misses a turn of the timer.
pub struct Clock {
    _timer: SYST,
    last: u32,
    ns: u64,
    /// Thirds of a ns.
    rest: u32,
}

/// The timer starts at the top of its range again after this value.
const RELOAD: u32 = 0x00ff_ffff;

impl Clock {
    /// Starts at 0. The system clock must be [`crate::programs::SYSTEM_HZ`].
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        Self { _timer: timer, last: 0, ns: 0, rest: 0 }
    }

    /// The time in ns: a cycle of 120 MHz is 25/3 ns.
    pub fn now_ns(&mut self) -> u64 {
        let now = SYST::get_current();
        let thirds = (self.last.wrapping_sub(now) & RELOAD) * 25 + self.rest;
        // The processor has no division; this is one by 3.
        let ns = ((u64::from(thirds) * 0xaaaa_aaab) >> 33) as u32;
        self.last = now;
        self.rest = thirds - 3 * ns;
        self.ns += u64::from(ns);
        self.ns
    }
}
