//! Time in ns from the SysTick timer, which counts down 24 bits with the system clock.

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use servowire_core::{ClockError, TickRate, TimeBase};

use crate::programs::SYSTEM_HZ;

/// A clock that must be looked at every 69 ms, or it misses a turn of the timer. Copies have the same origin.
#[derive(Clone, Copy)]
pub struct Clock(TimeBase<24>);

impl Clock {
    /// Starts at 0. The system clock must be [`SYSTEM_HZ`].
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(0x00ff_ffff);
        timer.clear_current();
        timer.enable_counter();
        Self(TimeBase::new(TickRate::of::<SYSTEM_HZ>(), !SYST::get_current()))
    }

    /// The time, for one who may not have looked for too long, as the encoder's end between requests: it stands for that long then.
    pub fn latest_ns(&mut self) -> u64 {
        let now = !SYST::get_current();
        self.0.now_ns(now).or_else(|_| self.0.now_ns(now)).unwrap_or_default()
    }
}

impl servowire_drivers::Clock for Clock {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.0.now_ns(!SYST::get_current())
    }
}
