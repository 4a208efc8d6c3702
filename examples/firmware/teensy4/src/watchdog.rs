//! WDOG1: 16 bits, half seconds.

use teensy4_bsp::ral::{self, wdog};

/// Restarts the chip a second after it was last fed.
pub struct Watchdog(wdog::WDOG1);

impl Watchdog {
    /// Starts it.
    pub fn start() -> Self {
        // SAFETY: nobody else uses it.
        let watchdog = unsafe { wdog::WDOG1::instance() };
        ral::modify_reg!(wdog, watchdog, WCR, WT: 1, SRS: 1, WDA: 1, WDE: 1);
        Self(watchdog)
    }

    /// Feeds it for another second.
    pub fn feed(&mut self) {
        ral::write_reg!(wdog, self.0, WSR, 0x5555);
        ral::write_reg!(wdog, self.0, WSR, 0xaaaa);
    }
}
