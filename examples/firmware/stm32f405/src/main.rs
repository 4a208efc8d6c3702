//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them.
#![no_std]
#![no_main]

use core::fmt::Write;

use servowire_boards::{Board, FirstLine, Pin, RESOLUTION, Readings, Source};
use servowire_drivers::{Clock as _, DirectionPin, Worst, tformat::blocking::Driver};
use tformat::master::Line;
use tformat::{Address, BitRate, EvidenceCell, Page};

use servowire_stm32f405::clock::{CORE_HZ, CRYSTAL_HZ};
use servowire_stm32f405::{POWER_STAGES, clock, stack, uart, watchdog};

/// Their places depend on the board.
const PINS: &[Pin] = &[
    Pin::new("PB6", "DI", "USART1"),
    Pin::new("PB8", "DE and /RE", "GPIO"),
    Pin::new("PB7", "RO", "USART1"),
    Pin::new("PA2", "console", "USART2"),
];

static BOARD: Board =
    const { Board { name: "STM32F405RG", crystal_hz: CRYSTAL_HZ, pins: PINS, power_stage: POWER_STAGES }.checked() };

/// The UART begins with its next bit clock; the interrupt of a byte, which may come in between, takes less than 0.9 us; a tick of the
/// clock is 50 ns.
const WORST: Worst = Worst { uart_start_ns: 400, wake_ns: 900, clock_ns: 50 };

fn line() -> Line {
    let line = Line::new(BitRate::Mbit2_5);
    if cfg!(feature = "emulated") {
        line.with_response_timeout_ns(500_000_000).with_field_timeout_ns(500_000_000)
    } else {
        line
    }
}

/// One position in this many is printed.
const PRINTED: u32 = 16;

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::paint();
    let source = clock::start();
    let core = cortex_m::Peripherals::take().expect("called once");
    let (uart, de, mut console) = uart::start(BitRate::Mbit2_5.bits_per_second());
    let ticks = clock::ticks(core.SYST);
    let mut clock = &ticks;
    let _ = match source {
        Some(source) => writeln!(console, "{}", first_line(source)),
        None => console.write_str("stm32f405: no clock gets ready, so no rate is right\n"),
    };
    let pin = DirectionPin::new(de, WORST);
    let mut encoder = Driver::new(uart, pin, clock, line()).expect("1.4 us fit four bits");
    match encoder.read_eeprom(Page::truncate(0), Address::truncate(0)) {
        Ok(byte) => drop(writeln!(console, "EEPROM 0: {byte:02x}")),
        Err(error) => drop(writeln!(console, "EEPROM: {error}")),
    }
    let mut cell = EvidenceCell::new();
    let mut readings = Readings::new(&mut cell, PRINTED);
    if cfg!(feature = "emulated") {
        readings = readings.with_max_age_ns(u64::MAX);
    }
    watchdog::start();
    loop {
        watchdog::feed();
        let read = encoder.read_evidence(RESOLUTION);
        if let Ok(true) = readings.take(&mut console, read, clock.now_ns()) {
            let _ = writeln!(console, "stack {} bytes", stack::used());
        }
    }
}

fn first_line(source: Source) -> FirstLine {
    let bits_per_second = BitRate::Mbit2_5.bits_per_second();
    let version = env!("CARGO_PKG_VERSION");
    FirstLine { image: "stm32f405", version, board: &BOARD, core_hz: CORE_HZ, source, bits_per_second }
}
