//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them over the USB port of the chip.
#![no_std]
#![no_main]

mod console;

use core::fmt::Write;

use esp_hal::clock::CpuClock;
use esp_hal::gpio::{Level, Output, OutputConfig};
use esp_hal::time::Duration;
use esp_hal::timer::systimer::{SystemTimer, Unit};
use esp_hal::timer::timg::{MwdtStage, TimerGroup};
use esp_hal::uart::{Config, RxConfig, Uart};
use servowire_boards::{Board, Counter, FirstLine, Pin, RESOLUTION, Readings, Source};
use servowire_core::TickRate;
use servowire_drivers::{Clock as _, DirectionPin, Worst, tformat::blocking::Driver};
use tformat::master::Line;
use tformat::{BitRate, EvidenceCell};

use crate::console::Console;

esp_bootloader_esp_idf::esp_app_desc!();

const RATE: BitRate = BitRate::Mbit2_5;
const CORE_HZ: u32 = 160_000_000;
const TIMER_HZ: u32 = 16_000_000;
/// The UART begins with its next bit clock. There are no interrupts; only a miss of the flash cache can come in between. A
/// tick of the
/// clock is 62.5 ns.
const WORST: Worst = Worst { uart_start_ns: 400, wake_ns: 1_000, clock_ns: 63 };
/// Longer than any wait here.
const WATCHDOG_MS: u64 = 1_000;
/// One position in this many is printed.
const PRINTED: u32 = 4_096;

/// The pins; no power stage is near.
static BOARD: Board = Board::plain(
    "ESP32-C3-DevKitM-1",
    40_000_000,
    &[Pin::new("GPIO4", "DI", "J1"), Pin::new("GPIO5", "DE and /RE", "J1"), Pin::new("GPIO6", "RO", "J3")],
);

#[esp_hal::main]
fn main() -> ! {
    let p = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::_160MHz));
    let mut watchdog = TimerGroup::new(p.TIMG0).wdt;
    watchdog.set_timeout(MwdtStage::Stage0, Duration::from_millis(WATCHDOG_MS));
    watchdog.enable();
    let mut console = Console::new(p.USB_DEVICE);
    let _ = SystemTimer::new(p.SYSTIMER);
    let bits_per_second = RATE.bits_per_second();
    let version = env!("CARGO_PKG_VERSION");
    let source = Source::Crystal;
    let line = FirstLine { image: "esp32c3", version, board: &BOARD, core_hz: CORE_HZ, source, bits_per_second };
    let _ = writeln!(console, "{line}");
    let config =
        Config::default().with_baudrate(bits_per_second).with_rx(RxConfig::default().with_fifo_full_threshold(1));
    let uart = Uart::new(p.UART1, config).expect("32 clocks a bit").with_tx(p.GPIO4).with_rx(p.GPIO6);
    let de = DirectionPin::new(Output::new(p.GPIO5, Level::Low, OutputConfig::default()), WORST);
    // Its lower 32 bits have to be read every 134 s.
    let ticks = Counter::<32>::new(TickRate::of::<TIMER_HZ>(), || SystemTimer::unit_value(Unit::Unit0) as u32);
    let mut clock = &ticks;
    let mut encoder = Driver::new(uart, de, clock, Line::new(RATE)).expect("1.6 us fit four bits");
    let mut cell = EvidenceCell::new();
    let mut readings = Readings::new(&mut cell, PRINTED);
    loop {
        watchdog.feed();
        let read = encoder.read_evidence(RESOLUTION);
        let _ = readings.take(&mut console, read, clock.now_ns());
    }
}
