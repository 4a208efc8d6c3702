//! The independent watchdog: it restarts the image if nothing has been read for a second.

use stm32_metapac::IWDG;
use stm32_metapac::iwdg::vals::{Key, Pr};

/// About a second: 1,000 periods of 32 clocks of an oscillator of 32 kHz, which may have 17 to 47.
const PERIODS: u16 = 1_000;

/// Starts it; it cannot be stopped.
pub fn start() {
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY32));
    IWDG.rlr().write(|w| w.set_rl(PERIODS));
    feed();
}

/// Feeds it; call this before the second has passed.
pub fn feed() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
