//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them.
#![no_std]
#![no_main]

mod clock;
mod stack;
mod uart;

use core::fmt::Write;

use panic_halt as _;
use servowire_drivers::{DirectionPin, Error, Worst, tformat::blocking::Driver};
use tformat::master::Line;
use tformat::{Address, BitRate, Page};

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

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::paint();
    let source = clock::start();
    let core = cortex_m::Peripherals::take().expect("called once");
    let (uart, de, mut console) = uart::start(BitRate::Mbit2_5.bits_per_second());
    let clock = clock::time(core.SYST);
    let _ = writeln!(console, "T-Format master, 2500000 bit/s, clock {source:?}");
    let pin = DirectionPin::new(de, WORST);
    let mut encoder = Driver::new(uart, pin, clock, line()).expect("1.4 us fit four bits");
    match encoder.read_eeprom(Page::truncate(0), Address::truncate(0)) {
        Ok(byte) => drop(writeln!(console, "EEPROM 0: {byte:02x}")),
        Err(error) => drop(writeln!(console, "EEPROM: {error}")),
    }
    let (mut good, mut bad) = (0_u32, 0_u32);
    loop {
        match encoder.read_data() {
            Ok(all) => {
                good += 1;
                if good % 16 == 1 {
                    let (abs, abm, enid, stack) = (all.abs.get(), all.abm.get(), all.enid, stack::used());
                    let _ = writeln!(
                        console,
                        "abs {abs} abm {abm} enid {enid:02x}, {good} good, {bad} bad, stack {stack} bytes"
                    );
                }
            }
            Err(error) => {
                bad += 1;
                let _ = match error {
                    Error::Io(fault) => writeln!(console, "fault: {fault}, {good} good, {bad} bad"),
                    error => writeln!(console, "fault: {error}, {good} good, {bad} bad"),
                };
            }
        }
    }
}
