//! The console: GPIO 0 and 1 with 1,000,000 baud, 8N1, and a serial port at the USB socket. Both print the same, and accept
//! input.

use core::fmt::{self, Write};

use cortex_m::singleton;
use servowire_boards::FirstLine;
use usb_device::bus::UsbBusAllocator;
use usb_device::device::{StringDescriptors, UsbDevice, UsbDeviceBuilder, UsbVidPid};
use usbd_serial::{SerialPort, USB_CLASS_CDC};

use crate::hal::clocks::{Clock as _, ClocksManager};
use crate::hal::fugit::RateExtU32;
use crate::hal::gpio::bank0::{Gpio0, Gpio1};
use crate::hal::gpio::{FunctionUart, Pin, PullDown};
use crate::hal::pac::{RESETS, UART0};
use crate::hal::uart::{DataBits, Enabled, StopBits, UartConfig, UartPeripheral};
use crate::hal::usb::UsbBus;
use crate::last_words::Before;

/// The console at the pins.
pub type Uart = UartPeripheral<Enabled, UART0, UartPins>;
type UartPins = (Pin<Gpio0, FunctionUart, PullDown>, Pin<Gpio1, FunctionUart, PullDown>);

/// 1,000,000 baud, 8N1.
///
/// # Panics
/// If the peripheral clock is too slow for it.
pub fn uart(uart: UART0, pins: UartPins, resets: &mut RESETS, clocks: &ClocksManager) -> Uart {
    let config = UartConfig::new(BAUD.Hz(), DataBits::Eight, None, StopBits::One);
    UartPeripheral::new(uart, pins, resets).enable(config, clocks.peripheral_clock.freq()).expect("7.5 clocks a sample")
}

const BAUD: u32 = 1_000_000;

/// For private tests; a product needs its own number.
const TEST: UsbVidPid = UsbVidPid(0x1209, 0x0001);
/// Holds some lines until the port has taken them.
const LINES: usize = 1_024;

/// Both consoles.
pub struct Console {
    uart: Uart,
    device: UsbDevice<'static, UsbBus>,
    port: SerialPort<'static, UsbBus, [u8; 64], [u8; LINES]>,
    /// Somebody has opened the port.
    open: bool,
    first: FirstLine,
    before: Option<Before>,
}

impl Console {
    /// Replaces the console at the pins, which has printed the first line and why the previous run ended; the port prints
    /// these whenever it is opened.
    ///
    /// # Panics
    /// If called twice.
    pub fn new(uart: Uart, usb: UsbBusAllocator<UsbBus>, first: FirstLine, before: Option<Before>) -> Self {
        let bus = singleton!(: UsbBusAllocator<UsbBus> = usb).expect("one console");
        let port = SerialPort::new_with_store(bus, [0; 64], [0; LINES]);
        let strings = StringDescriptors::default().manufacturer("servowire").product(first.image);
        let device = UsbDeviceBuilder::new(bus, TEST)
            .strings(&[strings])
            .expect("one language")
            .max_packet_size_0(64)
            .expect("a size of full speed")
            .device_class(USB_CLASS_CDC)
            .build();
        Self { uart, device, port, open: false, first, before }
    }

    /// Handles the USB host's requests; call it every few milliseconds.
    pub fn poll(&mut self) {
        self.device.poll(&mut [&mut self.port]);
        let open = self.port.dtr();
        if open && !self.open {
            let (first, before) = (self.first, self.before);
            let _ = writeln!(Port(self), "{first}");
            if let Some(before) = before {
                let _ = writeln!(Port(self), "{before}");
            }
        }
        self.open = open;
    }

    /// Returns what was typed at either console.
    pub fn read(&mut self) -> Option<u8> {
        let mut byte = [0];
        let heard = self.uart.read_raw(&mut byte).is_ok() || matches!(self.port.read(&mut byte), Ok(1));
        heard.then_some(byte[0])
    }
}

/// The port alone. Anything that does not fit is lost, because nobody reads it.
struct Port<'a>(&'a mut Console);

impl Write for Port<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let _ = self.0.port.write(text.as_bytes());
        Ok(())
    }
}

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.open {
            Port(self).write_str(text)?;
        }
        self.uart.write_str(text)
    }
}
