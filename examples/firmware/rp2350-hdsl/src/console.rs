//! Prints a digit a frame, so that the link is never late for it.

use hdsl::Policy;
use hdsl::master::Master;
use rp235x_hal::gpio::bank0::{Gpio0, Gpio1};
use rp235x_hal::gpio::{FunctionUart, Pin, PullDown};
use rp235x_hal::pac::UART0;
use rp235x_hal::uart::{Enabled, UartPeripheral};

type Uart = UartPeripheral<Enabled, UART0, (Pin<Gpio0, FunctionUart, PullDown>, Pin<Gpio1, FunctionUart, PullDown>)>;

/// A position of the last four frames.
const FRESH: Policy = Policy::new(50_000);
/// Frames from one line to the next: ten a second.
const PERIOD: u32 = 4_000;
const DIGITS: u32 = 16;

/// `position 0123456789abcdef` in hexadecimal, or `no position`.
pub struct Console {
    uart: Uart,
    frame: u32,
    position: Option<u64>,
}

impl Console {
    /// At this UART.
    pub fn new(uart: Uart) -> Self {
        Self { uart, frame: 0, position: None }
    }

    /// A piece of a line, at most as long as the UART's FIFO.
    pub fn step(&mut self, master: &Master, now_ns: u64) {
        match (self.frame, self.position) {
            (0, _) => {
                let fast = master.fast().at(now_ns, FRESH).ok();
                self.position = fast.map(|fast| u64::from_ne_bytes(fast.position().to_ne_bytes()));
            }
            (1, Some(_)) => self.put(b"position "),
            (1, None) => self.put(b"no position"),
            (2..18, Some(position)) => {
                let shift = 4 * (DIGITS + 1 - self.frame);
                let digit = (position >> shift & 0xf) as u8;
                self.put(&[if digit < 10 { b'0' + digit } else { b'a' + digit - 10 }]);
            }
            (18, _) => self.put(b"\r\n"),
            _ => {}
        }
        self.frame = (self.frame + 1) % PERIOD;
    }

    fn put(&mut self, text: &[u8]) {
        // The FIFO of 32 is empty: the last line is long over.
        let _ = self.uart.write_raw(text);
    }
}
