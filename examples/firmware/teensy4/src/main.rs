//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them.
#![no_std]
#![no_main]

mod console;
mod uart;
mod watchdog;

use core::fmt::Write;

use cortex_m::peripheral::DWT;
use servowire_boards::{Board, Counter, FirstLine, Pin, RESOLUTION, Readings, Source};
use servowire_core::TickRate;
use servowire_drivers::{Clock as _, DirectionPin, Worst, tformat::blocking::Driver};
use teensy4_bsp::board::{self, ARM_FREQUENCY, T40Resources};
use teensy4_bsp::hal::ccm::uart_clk;
use teensy4_bsp::hal::lpuart::{Baud, Direction, Lpuart, Pins};
use tformat::master::Line;
use tformat::{BitRate, EvidenceCell};

use crate::console::Console;
use crate::uart::Uart;
use crate::watchdog::Watchdog;

const RATE: BitRate = BitRate::Mbit2_5;
/// PLL 3 divided by 6; with the crystal's 24 MHz, 2.5 Mbit/s would be 9.6 clocks per bit.
const UART_HZ: u32 = 80_000_000;
const ENCODER_BAUD: Baud = Baud::compute(UART_HZ, RATE.bits_per_second());
const CONSOLE_BAUD: Baud = Baud::compute(UART_HZ, 1_000_000);
const _: () = assert!(ENCODER_BAUD.value(UART_HZ) == RATE.bits_per_second(), "exact");
/// The UART begins with its next bit clock. No interrupt comes, and the program is in memory without waits. A tick of the clock is
/// 1.7 ns.
const WORST: Worst = Worst { uart_start_ns: 400, wake_ns: 400, clock_ns: 2 };
/// One position in this many is printed.
const PRINTED: u32 = 4_096;

/// The pins; no power stage is near.
static BOARD: Board = Board::plain(
    "Teensy 4.0",
    24_000_000,
    &[
        Pin::new("AD_B0_02", "DI", "pin 1"),
        Pin::new("EMC_04", "DE and /RE", "pin 2"),
        Pin::new("AD_B0_03", "RO", "pin 0"),
        Pin::new("AD_B1_02", "console", "pin 14"),
    ],
);

#[teensy4_bsp::rt::entry]
fn main() -> ! {
    let T40Resources { pins, mut gpio4, mut ccm, lpuart2, lpuart6, .. } = board::t40(board::instances());
    let mut core = cortex_m::Peripherals::take().expect("called once");
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    uart_clk::set_selection(&mut ccm, uart_clk::Selection::Pll3Div6);
    uart_clk::set_divider(&mut ccm, uart_clk::MIN_DIVIDER);
    let mut console = Lpuart::with_pins(lpuart2, Pins { tx: pins.p14, rx: pins.p15 });
    start(&mut console, &CONSOLE_BAUD);
    let mut console = Console(console);
    let bits_per_second = RATE.bits_per_second();
    let version = env!("CARGO_PKG_VERSION");
    let source = Source::Crystal;
    let line = FirstLine { image: "teensy4", version, board: &BOARD, core_hz: ARM_FREQUENCY, source, bits_per_second };
    let _ = writeln!(console, "{line}");
    let mut uart = Lpuart::with_pins(lpuart6, Pins { tx: pins.p1, rx: pins.p0 });
    start(&mut uart, &ENCODER_BAUD);
    let de = gpio4.output(pins.p2).expect("pin 2 is of GPIO 4");
    de.clear();
    // It has to be read every 3.5 s.
    let cycles = Counter::<32>::new(TickRate::of::<ARM_FREQUENCY>(), DWT::cycle_count);
    let mut clock = &cycles;
    let pin = DirectionPin::new(de, WORST);
    let mut encoder = Driver::new(Uart(uart), pin, clock, Line::new(RATE)).expect("0.9 us fit four bits");
    let mut cell = EvidenceCell::new();
    let mut readings = Readings::new(&mut cell, PRINTED);
    let mut watchdog = Watchdog::start();
    loop {
        watchdog.feed();
        let read = encoder.read_evidence(RESOLUTION);
        let _ = readings.take(&mut console, read, clock.now_ns());
    }
}

/// 8N1.
fn start(uart: &mut Lpuart, baud: &Baud) {
    uart.disable(|uart| {
        uart.set_baud(baud);
        uart.set_parity(None);
    });
    uart.set_enable(Direction::Tx, true);
    uart.set_enable(Direction::Rx, true);
}
