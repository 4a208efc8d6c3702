//! The console: LPUART2.

use core::fmt;
use core::panic::PanicInfo;

use teensy4_bsp::hal::lpuart::Lpuart;
use teensy4_bsp::ral::{self, lpuart};

/// Prints.
pub struct Console(pub Lpuart);

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            while !self.0.try_write(byte) {}
        }
        Ok(())
    }
}

/// The console, for a panic: its previous owner no longer runs.
struct LastWords(lpuart::LPUART2);

impl fmt::Write for LastWords {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            while ral::read_reg!(lpuart, self.0, STAT, TDRE == 0) {}
            ral::write_reg!(lpuart, self.0, DATA, u32::from(byte));
        }
        Ok(())
    }
}

/// Prints the location; the watchdog then restarts the image.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    // SAFETY: interrupts are off, and nothing else runs again.
    let mut console = LastWords(unsafe { lpuart::LPUART2::instance() });
    let _ = fmt::Write::write_fmt(&mut console, format_args!("\n{info}\n"));
    loop {
        cortex_m::asm::nop();
    }
}
