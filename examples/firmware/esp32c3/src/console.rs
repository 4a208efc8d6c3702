//! The console: the USB port in the chip.

use core::fmt;
use core::panic::PanicInfo;

use esp_hal::Blocking;
use esp_hal::peripherals::USB_DEVICE;
use esp_hal::usb_serial_jtag::UsbSerialJtag;

/// How often a full FIFO is polled before a character is dropped: nobody has opened the port.
const LOOKS: u32 = 20_000;

/// Prints; output that nobody reads is lost.
pub struct Console(UsbSerialJtag<'static, Blocking>);

impl Console {
    /// At this port.
    pub fn new(usb: USB_DEVICE<'static>) -> Self {
        Self(UsbSerialJtag::new(usb))
    }
}

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            let _ = (0..LOOKS).any(|_| self.0.write_byte_nb(byte).is_ok());
        }
        let _ = self.0.flush_tx_nb();
        Ok(())
    }
}

/// Prints the location; the watchdog then restarts the image.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    // SAFETY: whoever had the port is gone.
    let mut console = Console::new(unsafe { USB_DEVICE::steal() });
    let _ = fmt::Write::write_fmt(&mut console, format_args!("\n{info}\n"));
    loop {
        core::hint::spin_loop();
    }
}
