//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them.
#![no_std]
#![no_main]

mod clock;
mod stack;
mod uart;

use core::fmt::Write;

use panic_halt as _;
use servowire_drivers::{DriverEnable, Error, tformat::blocking::Driver};
use tformat::master::Line;
use tformat::{Address, BitRate, Page};

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
    let mut encoder = Driver::new(uart, DriverEnable(de), clock, line());
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
