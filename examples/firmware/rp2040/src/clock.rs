//! Time in ns from the SysTick timer, which counts down 24 bits with the system clock.

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use servowire_boards::Counter;
use servowire_core::TickRate;

use crate::programs::SYSTEM_HZ;

/// A clock that has to be read every 69 ms, or it misses a wrap of the timer.
pub type Clock = Counter<24>;

/// Starts at 0. The system clock must be [`SYSTEM_HZ`].
pub fn start(mut timer: SYST) -> Clock {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(0x00ff_ffff);
    timer.clear_current();
    timer.enable_counter();
    Counter::new(TickRate::of::<SYSTEM_HZ>(), || !SYST::get_current())
}
