//! A T-Format encoder at a UART with an RS-485 transceiver.
//!
//! The transceiver's driver must be off before the encoder answers, about 3 us after the last bit of the request: on a
//! real board let the UART switch it (hardware driver enable), or wait for *transmission complete*, not for an empty
//! transmit buffer. `flush` of `embedded-io` promises the former.

use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write};
use tformat::master::{Line, Progress, Transaction};
use tformat::{Error, Request, Response};

/// A free-running clock.
pub trait Clock {
    /// Nanoseconds from any origin.
    fn now_ns(&mut self) -> u64;
}

/// The encoder, blocking: a transaction takes 23 to 51 us at 2.5 Mbit/s.
#[derive(Debug)]
pub struct Encoder<U, D, C> {
    uart: U,
    driver_enable: D,
    clock: C,
    line: Line,
}

/// Why a transaction failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure<U, D> {
    /// The UART reports a fault.
    Uart(U),
    /// The driver-enable pin does.
    Pin(D),
    /// The answer was refused, or there was none.
    Protocol(Error),
}

impl<U: Read + ReadReady + Write, D: OutputPin, C: Clock> Encoder<U, D, C> {
    /// The receiver of `line` is on all the time if its `echo` is set.
    pub const fn new(uart: U, driver_enable: D, clock: C, line: Line) -> Self {
        Self { uart, driver_enable, clock, line }
    }

    /// One request and its answer.
    ///
    /// # Errors
    /// [`Failure`]; after any of them the next transaction starts clean.
    pub fn transact(&mut self, request: Request) -> Result<Response, Failure<U::Error, D::Error>> {
        let mut transaction = Transaction::start(request, self.line, self.clock.now_ns());
        self.driver_enable.set_high().map_err(Failure::Pin)?;
        let sent = self.send(transaction.frame().as_bytes());
        self.driver_enable.set_low().map_err(Failure::Pin)?;
        sent?;
        loop {
            let progress = match self.receive()? {
                Some(byte) => transaction.bytes(&[byte], self.clock.now_ns()),
                None => transaction.poll(self.clock.now_ns()),
            };
            match progress {
                Progress::Pending { .. } => {}
                Progress::Done { value, .. } => return Ok(value.response),
                Progress::Failed { error, .. } => return Err(Failure::Protocol(error)),
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), Failure<U::Error, D::Error>> {
        self.uart.write_all(bytes).map_err(Failure::Uart)?;
        self.uart.flush().map_err(Failure::Uart)
    }

    fn receive(&mut self) -> Result<Option<u8>, Failure<U::Error, D::Error>> {
        if !self.uart.read_ready().map_err(Failure::Uart)? {
            return Ok(None);
        }
        let mut byte = [0];
        let count = self.uart.read(&mut byte).map_err(Failure::Uart)?;
        Ok(byte.first().copied().filter(|_| count == 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated_uart::{Bench, Pin, Uart};
    use tformat::device::Fault;
    use tformat::{Abm, Abs, BitRate};

    fn encoder(bench: &Bench) -> Encoder<Uart<'_>, Pin, &Bench> {
        Encoder::new(Uart::new(bench), Pin, bench, Line::new(BitRate::Mbit2_5).with_echo())
    }

    #[test]
    fn positions_arrive() {
        let bench = Bench::new(0x17);
        let mut encoder = encoder(&bench);
        for position in [0, 1, 0x7f_ffff] {
            bench.turn_to(Abs::truncate(position), Abm::truncate(3));
            let answer = encoder.transact(Request::ReadSingleTurn).unwrap();
            assert_eq!(answer.abs(), Some(Abs::truncate(position)));
            let Ok(Response::ReadAll(data)) = encoder.transact(Request::ReadAll) else { panic!() };
            assert_eq!((data.abm.get(), data.enid), (3, 0x17));
        }
    }

    #[test]
    fn a_silent_or_disturbed_encoder_is_an_error_and_not_a_hang() {
        let bench = Bench::new(0x11);
        let mut encoder = encoder(&bench);
        bench.break_it(Fault::Silent);
        assert_eq!(encoder.transact(Request::ReadSingleTurn), Err(Failure::Protocol(Error::NoResponse { echo: true })));
        bench.break_it(Fault::CutAfter { fields: 2 });
        assert_eq!(
            encoder.transact(Request::ReadSingleTurn),
            Err(Failure::Protocol(Error::Truncated { got: 2, want: 6 }))
        );
        bench.break_it(Fault::None);
        assert!(encoder.transact(Request::ReadSingleTurn).is_ok());
    }
}
