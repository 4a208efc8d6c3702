//! A bench on the host: the encoder model of `tformat` behind a UART whose time advances with every byte.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_drivers::{Clock, ClockError, Worst};
use tformat::device::{Device, Fault};
use tformat::{Abm, Abs, BitRate};

/// Time of one field at 2.5 Mbit/s.
const FIELD_NS: u64 = 4_000;

/// The encoder and the time that master and encoder share.
#[derive(Debug)]
pub struct Bench {
    encoder: RefCell<Device<6>>,
    now_ns: Cell<u64>,
    /// When what the master has handed over has left.
    sent_ns: Cell<u64>,
    /// Bytes on their way to the master, each with the time of its end.
    line: RefCell<Line>,
}

#[derive(Debug, Default)]
struct Line {
    bytes: [(u64, u8); 16],
    head: usize,
    tail: usize,
}

impl Line {
    fn put(&mut self, at_ns: u64, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.tail % 16) {
            *place = (at_ns, byte);
            self.tail = self.tail.wrapping_add(1);
        }
    }

    fn next(&self) -> Option<(u64, u8)> {
        if self.head == self.tail { None } else { self.bytes.get(self.head % 16).copied() }
    }
}

impl Bench {
    /// An encoder with this encoder ID.
    pub fn new(enid: u8) -> Self {
        let encoder = RefCell::new(Device::new(enid, BitRate::Mbit2_5));
        Self { encoder, now_ns: Cell::new(0), sent_ns: Cell::new(0), line: RefCell::default() }
    }

    /// Turns the shaft.
    pub fn turn_to(&self, abs: Abs, abm: Abm) {
        self.encoder.borrow_mut().set_position(abs, abm);
    }

    /// Switches a fault on.
    pub fn break_it(&self, fault: Fault) {
        self.encoder.borrow_mut().set_fault(fault);
    }

    fn pass(&self, ns: u64) -> u64 {
        self.now_ns.set(self.now_ns.get().wrapping_add(ns));
        self.now_ns.get()
    }
}

impl Clock for &Bench {
    /// Every look at the clock costs 100 ns, so that waiting ends.
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        Ok(self.pass(100))
    }
}

/// The master's UART; it hears itself.
#[derive(Debug)]
pub struct Uart<'a>(&'a Bench);

impl<'a> Uart<'a> {
    /// The UART at this bench, after a pause on the line.
    pub fn new(bench: &'a Bench) -> Self {
        bench.pass(100_000);
        Self(bench)
    }
}

impl ErrorType for Uart<'_> {
    type Error = Infallible;
}

impl Write for Uart<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for byte in bytes {
            let end_ns = self.0.sent_ns.get().max(self.0.now_ns.get()).wrapping_add(FIELD_NS);
            self.0.sent_ns.set(end_ns);
            let mut line = self.0.line.borrow_mut();
            line.put(end_ns, *byte);
            if let Some(sent) = self.0.encoder.borrow_mut().hear(&[*byte], end_ns) {
                for (k, byte) in (1..).zip(sent.frame.as_bytes()) {
                    line.put(sent.start_ns.wrapping_add(FIELD_NS.wrapping_mul(k)), *byte);
                }
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl ReadReady for Uart<'_> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.line.borrow().next().is_some_and(|(at_ns, _)| at_ns <= self.0.now_ns.get()))
    }
}

impl Read for Uart<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let mut line = self.0.line.borrow_mut();
        match (bytes.first_mut(), line.next()) {
            (Some(place), Some((_, byte))) => {
                *place = byte;
                line.head = line.head.wrapping_add(1);
                Ok(1)
            }
            _ => Ok(0),
        }
    }
}

/// This UART begins at once, and looks at its clock last 100 ns.
pub const WORST: Worst = Worst { uart_start_ns: 0, wake_ns: 100, clock_ns: 100 };

/// A driver-enable pin that is not there.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pin;

impl PinErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use servowire_drivers::tformat::blocking::Driver;
    use servowire_drivers::{DirectionPin, Error};
    use tformat::master::Line;

    #[test]
    fn positions_arrive_and_a_fault_is_over_with_the_next_call() {
        let bench = Bench::new(0x17);
        let line = Line::new(BitRate::Mbit2_5);
        let mut encoder = Driver::new(Uart::new(&bench), DirectionPin::new(Pin, WORST), &bench, line).unwrap();
        for position in [0, 1, 0x7f_ffff] {
            bench.turn_to(Abs::truncate(position), Abm::truncate(3));
            let all = encoder.read_data().unwrap();
            assert_eq!((all.abs.get(), all.abm.get(), all.enid), (position, 3, 0x17));
        }
        bench.break_it(Fault::Silent);
        assert_eq!(encoder.read_data(), Err(Error::Protocol(tformat::Error::NoResponse { echo: true })));
        bench.break_it(Fault::CutAfter { fields: 2 });
        assert!(encoder.read_data().is_err());
        bench.break_it(Fault::None);
        assert!(encoder.read_data().is_ok());
    }
}
