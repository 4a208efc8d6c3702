//! A-format encoders: Nikon, 2.5 to 16 Mbit/s, up to eight on a line.
//!
//! Frames have 18 bits, which hardly any UART can do: what sends and receives them is a [`FramePort`], made of a PIO, an SPI
//! that samples, or a FIFO in an FPGA.

use core::convert::Infallible;

use nikon_aformat::master::{Line, Progress, Reading, Step, Transaction};
use nikon_aformat::{EncoderAddress, FRAME_BITS, Operation, Request, RequestFrame, Resolution, Response};

use crate::quiet::{self, Settle};
use crate::{Clock, Error};

/// A frame as it came from the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame {
    /// The 16 bits between start bit and delimiter, the first of the line in bit 0.
    pub content: u16,
    /// Whether the delimiter was 1.
    pub framed: bool,
}

/// What sends and receives frames.
pub trait FramePort {
    /// Why it cannot.
    type Error;
    /// Sends these frames with `gap_bits` idle bits between two, and begins at once. It switches the line driver on
    /// before and off after by itself: the encoder answers some microseconds later.
    ///
    /// # Errors
    /// Those of the port.
    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error>;
    /// The next frame that was received, if there is one. Between two looks the port keeps at least the frames of a response.
    ///
    /// # Errors
    /// Those of the port: the exchange is lost.
    fn take(&mut self) -> Result<Option<Frame>, Self::Error>;
}

/// Why a call of an [`Encoder`] failed.
pub type Failure<F> = Error<<F as FramePort>::Error, Infallible, nikon_aformat::Error, Infallible>;

/// An encoder at a port; others may be on the line.
#[derive(Debug)]
pub struct Encoder<F, C> {
    port: F,
    clock: C,
    address: EncoderAddress,
    resolution: Resolution,
    line: Line,
    state: quiet::Line,
}

impl<F: FramePort, C: Clock> Encoder<F, C> {
    /// The encoder with this address and resolution. The port must be asked for frames within `line.latency_ns` of their end:
    /// nothing but the driver may run meanwhile, or give the line a larger budget.
    pub const fn new(port: F, clock: C, address: EncoderAddress, resolution: Resolution, line: Line) -> Self {
        let state = quiet::Line::new(line.rate.bits_ns(FRAME_BITS).saturating_mul(2));
        Self { port, clock, address, resolution, line, state }
    }

    /// Gives port and clock back.
    pub fn release(self) -> (F, C) {
        (self.port, self.clock)
    }

    /// Command 0: the whole position. Look at its encoder status before you use it.
    ///
    /// # Errors
    /// [`Error`].
    pub fn read_abs40(&mut self) -> Result<Reading, Failure<F>> {
        self.transact(Request::new(self.address, Operation::Abs40))
    }

    /// A procedure of several transactions: does what its steps ask for and hands the outcomes to `receive`.
    ///
    /// # Errors
    /// [`Error`]: that of the procedure, for which a fault of the port is a lost answer; [`Error::NeverQuiet`] at once, and
    /// then whether the last request had its effect is not known.
    pub fn run<T>(
        &mut self,
        mut step: Step<T>,
        mut receive: impl FnMut(Result<Response, nikon_aformat::Error>, u64) -> Step<T>,
    ) -> Result<T, Failure<F>> {
        loop {
            match step {
                Step::Send { request, not_before_ns } => {
                    while self.clock.now_ns() < not_before_ns {}
                    let outcome = match self.transact(request) {
                        Ok(reading) => Ok(reading.response),
                        Err(Error::Protocol(error)) => Err(error),
                        Err(Error::Io(_)) => Err(nikon_aformat::Error::NoResponse),
                        Err(other) => return Err(other),
                    };
                    step = receive(outcome, self.state.free_ns(self.clock.now_ns()));
                }
                Step::Done { value, ready_ns } => {
                    self.state.clean(ready_ns);
                    return Ok(value);
                }
                Step::Failed { error, ready_ns } => {
                    self.state.clean(ready_ns);
                    return Err(Error::Protocol(error));
                }
            }
        }
    }

    /// One request and its answer.
    ///
    /// # Errors
    /// [`Error`].
    pub fn transact(&mut self, request: Request) -> Result<Reading, Failure<F>> {
        self.settle()?;
        let start_ns = self.clock.now_ns();
        let mut transaction = Transaction::start(request, self.resolution, self.line, start_ns);
        if let Progress::Failed { error, .. } = transaction.progress() {
            // Encoders of this version do not know it: nothing is sent.
            return Err(Error::Protocol(error));
        }
        let longest_ns = self.line.longest_ns(request, &request.expected(self.resolution));
        // The worst is assumed until the end is known: an early return leaves it so.
        self.state.soil(start_ns.saturating_add(longest_ns.into()));
        let gap_bits = self.line.rate.bits(self.line.frame_gap_ns);
        self.port.send(request.emit().as_slice(), gap_bits).map_err(Error::Io)?;
        loop {
            match self.receive(&mut transaction)? {
                Progress::Pending { .. } => {}
                Progress::Done { value, ready_ns } => {
                    self.state.clean(ready_ns);
                    return Ok(value);
                }
                Progress::Failed { error, ready_ns } => {
                    self.state.failed(ready_ns, self.clock.now_ns());
                    return Err(Error::Protocol(error));
                }
            }
        }
    }

    /// Takes what is there; asks whether the time is over only if there is nothing.
    fn receive(&mut self, transaction: &mut Transaction) -> Result<Progress<Reading>, Failure<F>> {
        let before_ns = self.clock.now_ns();
        let frame = self.port.take().map_err(Error::Io)?;
        Ok(match frame {
            Some(Frame { content, framed: true }) => transaction.frame(content, self.clock.now_ns()),
            Some(Frame { framed: false, .. }) => transaction.framing_error(self.clock.now_ns()),
            None => transaction.poll(before_ns),
        })
    }

    /// Waits until the line is free, and throws away what comes meanwhile, errors of the port included.
    fn settle(&mut self) -> Result<(), Failure<F>> {
        let mut settling = self.state.settle(self.clock.now_ns());
        loop {
            let heard = !matches!(self.port.take(), Ok(None));
            let now_ns = self.clock.now_ns();
            if heard {
                settling.heard(now_ns);
            }
            match settling.poll(now_ns) {
                Settle::Quiet => return Ok(()),
                Settle::Never => return Err(Error::NeverQuiet),
                Settle::Until(_) => {}
            }
        }
    }
}
