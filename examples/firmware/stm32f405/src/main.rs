//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them.
#![no_std]
#![no_main]

mod clock;
mod stack;
mod uart;

use core::fmt::Write;
use core::panic::PanicInfo;

use servowire_boards::{Board, FirstLine, Pin, Report, Source};
use servowire_drivers::{Clock as _, DirectionPin, Error, Worst, tformat::blocking::Driver};
use tformat::master::Line;
use tformat::{Address, BitRate, EvidenceCell, Page, Policy, Resolution};

use crate::clock::{CORE_HZ, CRYSTAL_HZ};

/// The pins; where they are is up to the board.
static BOARD: Board = const {
    Board {
        name: "STM32F405RG",
        crystal_hz: CRYSTAL_HZ,
        pins: &[
            Pin { name: "PA9", signal: "DI", at: "USART1" },
            Pin { name: "PA8", signal: "DE and /RE", at: "GPIO" },
            Pin { name: "PA10", signal: "RO", at: "USART1" },
            Pin { name: "PA2", signal: "console", at: "USART2" },
        ],
        power_stage: &[],
    }
    .checked()
};

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

/// That of the encoder.
const RESOLUTION: Resolution = match Resolution::new(23, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};

/// One position in so many is printed.
const PRINTED: u32 = 16;
/// A position that is printed is no older than this.
const MAX_AGE_NS: u64 = if cfg!(feature = "emulated") { u64::MAX } else { 200_000 };

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
    let (mut writer, mut reader) = cell.split();
    let mut report = Report::new(PRINTED);
    loop {
        let read = encoder.read_evidence(RESOLUTION).map(|evidence| writer.put(evidence));
        let policy = Policy::new(MAX_AGE_NS);
        let _ = match (read, clock.now_ns()) {
            (Ok(()), Ok(now_ns)) => match report.good(&mut console, || reader.at(now_ns, policy)) {
                Ok(true) => writeln!(console, "stack {} bytes", stack::used()),
                said => said.map(drop),
            },
            (Err(Error::Io(fault)), _) => report.fault(&mut console, fault),
            (Err(error), _) => report.fault(&mut console, error),
            (_, Err(error)) => report.fault(&mut console, error),
        };
    }
}

fn first_line(source: Source) -> FirstLine {
    let bits_per_second = BitRate::Mbit2_5.bits_per_second();
    let version = env!("CARGO_PKG_VERSION");
    FirstLine { image: "stm32f405", version, board: &BOARD, core_hz: CORE_HZ, source, bits_per_second }
}

/// Says where; there is nothing that could go on.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let _ = writeln!(uart::Console::last_words(), "\n{info}");
    loop {
        cortex_m::asm::nop();
    }
}
