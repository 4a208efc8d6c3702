//! Time in ns from the SysTick timer, which counts down 24 bits with the system clock.

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use servowire_core::{TickRate, TimeBase};

use crate::programs::SYSTEM_HZ;

/// A clock that must be looked at every 69 ms, or it misses a turn of the timer.
pub struct Clock {
    _timer: SYST,
    time: TimeBase<24>,
}

impl Clock {
    /// Starts at 0. The system clock must be [`SYSTEM_HZ`].
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(0x00ff_ffff);
        timer.clear_current();
        timer.enable_counter();
        Self { _timer: timer, time: TimeBase::new(TickRate::of::<SYSTEM_HZ>(), !SYST::get_current()) }
    }

    /// The time in ns.
    pub fn now_ns(&mut self) -> u64 {
        let now = !SYST::get_current();
        // Time stands for a reading if nobody has looked for too long, which the encoder's end does between requests.
        self.time.now_ns(now).or_else(|_| self.time.now_ns(now)).unwrap_or_default()
    }
}
