//! Waits by giving the time back. Every future may be dropped at any point: the next call waits until the line is free. Whether
//! a request that changes the encoder has had its effect is not known then.

use core::convert::Infallible;
use core::ops::ControlFlow;

use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{
    BusTransaction, Cycle, EepromRead, Exchange, GuardedReset, Line, Progress, Reset, Transaction,
};
use nikon_aformat::{
    Doubt, EncoderAddress, Evidence, Operation, Policy, Request, RequestFrame, Resolution, Response, Sample,
};
use servowire_core::{Ended, Machine, Procedure};

use super::{Frame, LOST, Released, hear, longest_ns, silence_ns};
use crate::exchange;
use crate::quiet;
use crate::race::race;
use crate::{Error, Timer};

/// What sends and receives frames.
#[allow(async_fn_in_trait, reason = "drivers are used by one executor; Send is left to the implementation")]
pub trait FramePort {
    /// Why it cannot.
    type Error;
    /// Sends these frames with `gap_bits` idle bits between two, and begins at once. It switches the line driver on
    /// before and off after by itself, also when the future is dropped: the encoder answers some microseconds later.
    ///
    /// # Errors
    /// Those of the port.
    async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error>;
    /// Ends when a frame has been received, and gives it. Dropped before that it should lose none: a lost frame costs the
    /// exchange in which it happens. Between two calls the port keeps at least the frames of a response.
    ///
    /// # Errors
    /// Those of the port: the exchange is lost.
    async fn take(&mut self) -> Result<Frame, Self::Error>;
}

/// Why a call of a [`Driver`] failed.
pub type Failure<F> = Error<<F as FramePort>::Error, Infallible, nikon_aformat::Error, Doubt>;

/// The controller's end of a line with up to eight encoders of one resolution.
#[derive(Debug)]
pub struct Driver<F, T> {
    port: F,
    timer: T,
    resolution: Resolution,
    line: Line,
    state: quiet::Line,
}

impl<F: FramePort, T: Timer> Driver<F, T> {
    /// A line with encoders of this resolution. The port must be asked for frames within `line.latency_budget_ns()` of their end, unless it gives their times:
    /// nothing but the driver may run meanwhile, or give the line a larger budget.
    pub const fn new(port: F, timer: T, resolution: Resolution, line: Line) -> Self {
        Self { port, timer, resolution, line, state: quiet::Line::new(silence_ns(line)) }
    }

    /// Gives port and timer back.
    pub fn release(self) -> Released<F, T> {
        Released { port: self.port, clock: self.timer }
    }

    /// The position of an encoder, if it may be used now, and when it was sampled: [`read_evidence`](Self::read_evidence),
    /// judged at once by the rules of [`Evidence::at`]. The answer alone has 72 bits, so it is never younger than those.
    ///
    /// # Errors
    /// [`Error`], [`Error::Doubt`] among them.
    pub async fn read_position(&mut self, ea: EncoderAddress, policy: Policy) -> Result<Sample, Failure<F>> {
        let evidence = self.read_evidence(ea).await?;
        evidence.at(self.state.now_ns(&mut self.timer)?, policy).map_err(Error::Doubt)
    }

    /// What an encoder says of its position, from command 0, to be judged where it is used.
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_evidence(&mut self, ea: EncoderAddress) -> Result<Evidence, Failure<F>> {
        Ok(self.read_abs40(ea).await?.evidence(self.resolution))
    }

    /// Command 0: the field for the whole position and the encoder status, as they came. For a position that may be used take
    /// [`read_position`](Self::read_position).
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_abs40(&mut self, ea: EncoderAddress) -> Result<Exchange, Failure<F>> {
        self.transact(Request::new(ea, Operation::Abs40)).await
    }

    /// A multi-response command: the answers of all encoders to one request. What came of each
    /// [`BusTransaction::exchange`] says; one that is missing or damaged costs no other one.
    ///
    /// # Errors
    /// [`Error`]. An answer that is missing is no error.
    pub async fn read_bus(&mut self, operation: Operation, asked: Addresses) -> Result<BusTransaction, Failure<F>> {
        let request = Request::new(asked.highest().unwrap_or(EncoderAddress::MAX), operation);
        let line = self.line.with_highest(self.line.highest.max(request.ea));
        let (resolution, plain) = (self.resolution, self.line);
        let start = |now_ns| BusTransaction::start(request, resolution, asked, plain, now_ns);
        let (transaction, ()) = self.exchange(request, line, start).await?;
        Ok(transaction)
    }

    /// [`read_bus`](Self::read_bus) when the cycle is due: waits for the next start and keeps to its grid.
    ///
    /// # Errors
    /// [`Error`]. After [`Error::Clock`] make a new cycle: the grid of this one is of the time before the clock was set back.
    pub async fn read_cycle(
        &mut self,
        cycle: &mut Cycle,
        operation: Operation,
        asked: Addresses,
    ) -> Result<BusTransaction, Failure<F>> {
        self.timer.wait_until(cycle.next_ns()).await?;
        let _ = cycle.is_due(self.state.now_ns(&mut self.timer)?);
        self.read_bus(operation, asked).await
    }

    /// Command 8, eight times: clears the alarms of an encoder. Position and turns stay.
    ///
    /// # Errors
    /// [`Error`]; read the status to see whether they were cleared.
    pub async fn clear_status(&mut self, ea: EncoderAddress) -> Result<Response, Failure<F>> {
        self.run(&mut GuardedReset::new(Reset::clear_status(ea))).await
    }

    /// Command 13: the word at an address of the EEPROM. Writing is a procedure for [`run`](Self::run).
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_eeprom(&mut self, ea: EncoderAddress, address: u8) -> Result<u16, Failure<F>> {
        self.run(&mut EepromRead::new(ea, address)).await
    }

    /// A procedure of several transactions: does what its steps ask for.
    ///
    /// # Errors
    /// [`Error`]: that of the procedure, for which a fault of the port is a lost answer; [`Error::NeverQuiet`] and
    /// [`Error::Clock`] at once, and then whether the last request had its effect is not known.
    pub async fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Failure<F>>
    where
        P: Procedure<Request = Request, Response = Response, Error = nikon_aformat::Error>,
    {
        let now_ns = self.state.now_ns(&mut self.timer)?;
        let exchange = async |request, not_before_ns| {
            self.timer.wait_until(not_before_ns).await?;
            let exchanged = self.transact(request).await.map(|exchange| exchange.response);
            exchange::ended(exchanged, LOST, &mut self.state, &mut self.timer)
        };
        let Ended { outcome, ready_ns } = servowire_core::run_async(procedure, now_ns, exchange).await?;
        self.state.keep(ready_ns);
        outcome.map_err(Error::Protocol)
    }

    /// One request and its answer.
    ///
    /// # Errors
    /// [`Error`].
    pub async fn transact(&mut self, request: Request) -> Result<Exchange, Failure<F>> {
        let (resolution, line) = (self.resolution, self.line);
        let start = |now_ns| Transaction::start(request, resolution, line, now_ns);
        let (_, exchange) = self.exchange(request, line, start).await?;
        Ok(exchange)
    }

    /// One request and all that answers.
    async fn exchange<M: Machine<Unit = [Option<u16>], Error = nikon_aformat::Error>>(
        &mut self,
        request: Request,
        line: Line,
        start: impl FnOnce(u64) -> M,
    ) -> Result<(M, M::Value), Failure<F>> {
        self.settle().await?;
        let start_ns = self.state.now_ns(&mut self.timer)?;
        let mut transaction = start(start_ns);
        match transaction.progress() {
            // Encoders of this version do not know it, or nobody is asked: nothing is sent.
            Progress::Failed { error, .. } => return Err(Error::Protocol(error)),
            Progress::Done { value, .. } => return Ok((transaction, value)),
            Progress::Pending { .. } => {}
        }
        self.state.begin(longest_ns(line, request, self.resolution));
        let gap_bits = line.rate.bits(line.frame_gap_ns);
        self.port.send(request.emit().as_slice(), gap_bits).await.map_err(Error::Io)?;
        let now_ns = self.state.now_ns(&mut self.timer)?;
        self.state.sent(now_ns);
        let mut progress = transaction.progress();
        loop {
            match exchange::next(progress, &mut self.state, &mut self.timer)? {
                ControlFlow::Continue(until_ns) => progress = self.receive(&mut transaction, until_ns).await?,
                ControlFlow::Break(outcome) => {
                    return outcome.map(|value| (transaction, value)).map_err(Error::Protocol);
                }
            }
        }
    }

    /// Takes what is there, or waits for it; asks the clock only if there is nothing.
    async fn receive<M: Machine<Unit = [Option<u16>], Error = nikon_aformat::Error>>(
        &mut self,
        machine: &mut M,
        until_ns: u64,
    ) -> Result<Progress<M::Value>, Failure<F>> {
        // The time is over after `until_ns`, not at it.
        let wait = self.timer.wait_until(until_ns.saturating_add(1));
        match race(self.port.take(), wait).await? {
            None => Ok(machine.poll(self.state.now_ns(&mut self.timer)?)),
            Some(frame) => Ok(hear(machine, frame.map_err(Error::Io)?, self.state.now_ns(&mut self.timer)?)),
        }
    }

    /// Waits until the line is free, and throws away what comes meanwhile, errors of the port included.
    async fn settle(&mut self) -> Result<(), Failure<F>> {
        let port = &mut self.port;
        let listen = async || {
            let _: Result<Frame, _> = port.take().await;
            Ok::<_, Failure<F>>(())
        };
        if quiet::wait_asynch(&mut self.state, &mut self.timer, listen).await? {
            Ok(())
        } else {
            Err(Error::NeverQuiet)
        }
    }
}
