//! The text of a panic: printed at once at the pins, and again after the watchdog has restarted the image, for users who
//! have only the USB port.

use core::fmt::{self, Write};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;

use crate::hal::pac;

/// Of a text in RAM that a reset has left there.
const MAGIC: u32 = 0x1a57_30d5;
const MOST: usize = 160;

#[repr(C)]
struct Kept {
    magic: u32,
    len: u32,
    text: [u8; MOST],
}

#[unsafe(link_section = ".uninit.last_words")]
static mut KEPT: MaybeUninit<Kept> = MaybeUninit::uninit();

/// Why the image was restarted.
#[derive(Clone, Copy)]
pub struct Before {
    text: [u8; MOST],
    len: usize,
}

impl Before {
    /// Returns what the previous run has left, if the watchdog ended it: its panic, or nothing. Call it once, at the start.
    pub fn take(watchdog: &pac::WATCHDOG) -> Option<Self> {
        let kept = (&raw mut KEPT).cast::<Kept>();
        // SAFETY: nobody else has it but a panic, after which nothing runs; all words of it are numbers, whatever RAM held.
        let Kept { magic, len, text } = unsafe { ptr::read_volatile(kept) };
        // SAFETY: as above.
        unsafe { ptr::write_volatile(&raw mut (*kept).magic, 0) };
        // The boot ROM also starts a newly flashed image through the watchdog.
        let ours = watchdog.scratch2().read().bits() == MAGIC && watchdog.reason().read().timer().bit_is_set();
        // SAFETY: the register is for whatever a program likes.
        watchdog.scratch2().write(|w| unsafe { w.bits(MAGIC) });
        let len = if magic == MAGIC { (len as usize).min(MOST) } else { 0 };
        ours.then_some(Self { text, len })
    }
}

impl fmt::Display for Before {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.text.get(..self.len).and_then(|text| core::str::from_utf8(text).ok()).unwrap_or_default();
        match text.trim() {
            "" => f.write_str("the watchdog has restarted this image: it stood still"),
            text => write!(f, "the watchdog has restarted this image: {text}"),
        }
    }
}

/// The console at the pins, whoever had it, and RAM.
struct LastWords(usize);

impl Write for LastWords {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        // SAFETY: interrupts are off, and nothing else runs again.
        let uart = unsafe { &*pac::UART0::ptr() };
        let kept = (&raw mut KEPT).cast::<Kept>();
        for byte in text.bytes() {
            while uart.uartfr().read().txff().bit_is_set() {}
            // SAFETY: as above; a byte is written, and read after the next start only.
            unsafe {
                uart.uartdr().write(|w| w.data().bits(byte));
                if self.0 < MOST {
                    // One line.
                    let byte = if byte == b'\n' { b' ' } else { byte };
                    ptr::write_volatile((&raw mut (*kept).text).cast::<u8>().add(self.0), byte);
                    self.0 += 1;
                }
            }
        }
        // SAFETY: as above.
        unsafe {
            ptr::write_volatile(&raw mut (*kept).len, self.0 as u32);
            ptr::write_volatile(&raw mut (*kept).magic, MAGIC);
        }
        Ok(())
    }
}

/// Prints the location; the watchdog then restarts the image.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let _ = writeln!(LastWords(0), "\n{info}");
    loop {
        cortex_m::asm::nop();
    }
}
