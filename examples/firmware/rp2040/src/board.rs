//! Clocks, pins and console of a board with a crystal of 12 MHz.

use core::fmt::Write;

use cortex_m::peripheral::Peripherals as Core;
use servowire_boards::{FirstLine, Source};
use usb_device::bus::UsbBusAllocator;

use crate::chip::{self, CRYSTAL_HZ};
use crate::clock::{self, Clock};
use crate::console::{self, Uart};
use crate::hal::clocks::{ClockSource, ClocksManager};
use crate::hal::dma::{CH0, Channel, DMAExt};
use crate::hal::fugit::{ExtU32, RateExtU32};
use crate::hal::gpio::{FunctionPio0, Pin, Pins, PullUp};
use crate::hal::pac::{CLOCKS, PLL_SYS, PLL_USB, Peripherals, RESETS, XOSC};
use crate::hal::pio::PIOExt;
use crate::hal::pll::{PLLConfig, common_configs::PLL_USB_48MHZ, setup_pll_blocking};
use crate::hal::usb::UsbBus;
use crate::hal::xosc::setup_xosc_blocking;
use crate::hal::{Sio, Watchdog};
use crate::last_words::Before;
use crate::port::{self, Receiver, Transmitter};
use crate::programs::{Rate, SYSTEM_HZ};

/// Everything that an image uses.
pub struct Board {
    /// The console at the pins.
    pub uart: Uart,
    /// The USB socket.
    pub usb: UsbBusAllocator<UsbBus>,
    /// The first output.
    pub first: FirstLine,
    /// Why the previous run ended, if the watchdog ended it.
    pub before: Option<Before>,
    /// Time.
    pub clock: Clock,
    /// Bits to the line.
    pub transmitter: Transmitter,
    /// Units from the line.
    pub receiver: Receiver,
    /// For [`port::RingReceiver`].
    pub channel: Channel<CH0>,
    /// Has to be fed, or the chip restarts.
    pub watchdog: Watchdog,
}

/// Longer than any wait here.
const WATCHDOG_MS: u32 = 1_000;

/// 12 MHz x 120 / 6 / 2 = 120 MHz.
const PLL_120MHZ: PLLConfig =
    PLLConfig { vco_freq: crate::hal::fugit::HertzU32::MHz(1440), refdiv: 1, post_div1: 6, post_div2: 2 };

impl Board {
    /// Sets everything up for units of `bits` bits between start and stop bit at `rate`, and prints the first line.
    ///
    /// # Panics
    /// If called twice, or if a clock does not start.
    pub fn new(image: &'static str, bits_per_second: u32, rate: Rate, bits: u8) -> Self {
        let mut p = Peripherals::take().expect("called once");
        let core = Core::take().expect("called once");
        let before = Before::take(&p.WATCHDOG);
        let mut watchdog = Watchdog::new(p.WATCHDOG);
        let clocks = clocks(&mut watchdog, p.XOSC, p.CLOCKS, (p.PLL_SYS, p.PLL_USB), &mut p.RESETS);

        let pins = Pins::new(p.IO_BANK0, p.PADS_BANK0, Sio::new(p.SIO).gpio_bank0, &mut p.RESETS);
        let uart_pins = (pins.gpio0.into_function(), pins.gpio1.into_function());
        let mut uart = console::uart(p.UART0, uart_pins, &mut p.RESETS, &clocks);
        let _: Pin<_, FunctionPio0, _> = pins.gpio2.into_function();
        let _: Pin<_, FunctionPio0, _> = pins.gpio3.into_function();
        // The receiver is off while the driver is on: its output floats then.
        let _: Pin<_, FunctionPio0, PullUp> = pins.gpio4.into_function().into_pull_type();
        let (block, sm0, sm1, ..) = p.PIO0.split(&mut p.RESETS);
        let (transmitter, receiver) = port::start(block, sm0, sm1, rate, bits);
        let channel = p.DMA.split(&mut p.RESETS).ch0;
        let usb = chip::usb_bus!(p, clocks.usb_clock);
        let first = FirstLine {
            image,
            version: env!("CARGO_PKG_VERSION"),
            board: &chip::BOARD,
            core_hz: SYSTEM_HZ,
            source: Source::Crystal,
            bits_per_second,
        };
        let _ = writeln!(uart, "{first}");
        if let Some(before) = before {
            let _ = writeln!(uart, "{before}");
        }
        watchdog.start(WATCHDOG_MS.millis());
        let usb = UsbBusAllocator::new(usb);
        Self { uart, usb, first, before, clock: clock::start(core.SYST), transmitter, receiver, channel, watchdog }
    }
}

/// Starts the crystal and both PLLs: 120 MHz for the system, 48 MHz for USB.
///
/// # Panics
/// If a clock does not start.
pub fn clocks(
    watchdog: &mut Watchdog,
    crystal: XOSC,
    clocks: CLOCKS,
    (system, usb): (PLL_SYS, PLL_USB),
    resets: &mut RESETS,
) -> ClocksManager {
    watchdog.enable_tick_generation((CRYSTAL_HZ / 1_000_000) as _);
    let crystal = setup_xosc_blocking(crystal, CRYSTAL_HZ.Hz()).expect("crystal");
    let mut clocks = ClocksManager::new(clocks);
    let system = setup_pll_blocking(system, crystal.get_freq(), PLL_120MHZ, &mut clocks, resets);
    let usb = setup_pll_blocking(usb, crystal.get_freq(), PLL_USB_48MHZ, &mut clocks, resets);
    clocks.init_default(&crystal, &system.expect("PLL"), &usb.expect("PLL")).expect("clocks");
    clocks
}
