//! Time in ns from the SysTick timer, which counts down 24 bits with the system clock.

use core::cell::Cell;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use servowire_core::{ClockError, TickRate, TimeBase};

use crate::programs::SYSTEM_HZ;

/// A clock at which somebody has to look every 69 ms, or it misses a turn of the timer.
pub struct Clock(Cell<TimeBase<24>>);

impl Clock {
    /// Starts at 0. The system clock must be [`SYSTEM_HZ`].
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(0x00ff_ffff);
        timer.clear_current();
        timer.enable_counter();
        Self(Cell::new(TimeBase::new(TickRate::of::<SYSTEM_HZ>(), !SYST::get_current())))
    }

    /// The time, for one who may not have looked for too long, as the encoder's end between requests: it stands for that long then.
    pub fn latest_ns(&self) -> u64 {
        self.look().or_else(|_| self.look()).unwrap_or_default()
    }

    #[inline]
    fn look(&self) -> Result<u64, ClockError> {
        let mut time = self.0.get();
        let now_ns = time.now_ns(!SYST::get_current());
        self.0.set(time);
        now_ns
    }
}

impl servowire_drivers::Clock for &Clock {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.look()
    }
}
