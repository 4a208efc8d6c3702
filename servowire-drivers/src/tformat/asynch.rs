//! Waits by giving the time back. Every future may be dropped at any point: a request that has begun goes out whole, for which the
//! destructor waits some microseconds if software switches the line driver, and the next call waits until the line is free.
//! Whether a request that changes the encoder has had its effect is not known then.
//!
//! The UART's `read` should be free of side effects when it is dropped, as that of buffered UARTs is; otherwise bytes are lost,
//! which costs the exchange in which it happens. Its `write` should take all bytes or none when it is dropped.

use embedded_io_async::{ErrorType, Read, Write};
use servowire_core::run_async as run;

use crate::Timer;
use crate::race::race;

driver!(awaited, [Read, Write], Timer, async);

<<<<<<< HEAD
/// An encoder, alone at its UART.
#[derive(Debug)]
pub struct Driver<U, D, T> {
    uart: U,
    direction: Switch<D>,
    timer: T,
    line: Line,
    state: quiet::Line,
}

impl<U: Read + Write, D: Direction, T: Timer> Driver<U, D, T> {
    /// An encoder at this UART, set to the rate of `line`, 8 data bits, no parity, one stop bit.
    ///
    /// Whether the receiver is on while the request goes out makes no difference: an echo is known by its time.
    pub fn new(uart: U, direction: D, timer: T, line: Line) -> Self {
        Self { uart, direction: Switch::new(direction), timer, line, state: quiet::Line::new(silence_ns(&line)) }
    }

    /// Gives UART, direction and timer back.
    pub fn release(self) -> Released<U, D, T> {
        Released { uart: self.uart, direction: self.direction.release(), clock: self.timer }
    }

    /// The position, if it may be used now, and when it was sampled: [`read_evidence`](Self::read_evidence), judged at
    /// once by the rules of [`Evidence::at`]. The answer alone lasts 44 us at 2.5 Mbit/s and 22 us at 5, so it is never younger.
    ///
    /// # Errors
    /// [`Error`], [`Error::Doubt`] among them.
    pub async fn read_position(&mut self, resolution: Resolution, policy: Policy) -> Result<Sample, Failure<U, D>> {
        let evidence = self.read_evidence(resolution).await?;
        evidence.at(self.state.now_ns(&mut self.timer)?, policy).map_err(Error::Doubt)
    }

    /// What the encoder says of its position, from ID 3, to be judged where it is used. If the request was held up on its
    /// way out, the position is younger by that.
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_evidence(&mut self, resolution: Resolution) -> Result<Evidence, Failure<U, D>> {
        Ok(self.transact(Request::ReadAll).await?.evidence(resolution))
    }

    /// ID 3: the fields for position, turns, encoder ID and alarms as they came. For a position that may be used take
    /// [`read_position`](Self::read_position).
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_data(&mut self) -> Result<AllData, Failure<U, D>> {
        match self.transact(Request::ReadAll).await?.response {
            Response::ReadAll(all) => Ok(all),
            _ => Err(Error::Protocol(other(Request::ReadAll))),
        }
    }

    /// ID 7, ten times: clears the latched alarms. Position and turns stay.
    ///
    /// # Errors
    /// [`Error`]; read the alarms to see whether they were cleared.
    pub async fn clear_errors(&mut self) -> Result<SingleTurn, Failure<U, D>> {
        self.run(&mut Reset::clear_errors()).await
    }

    /// ID D: the byte at `address` of `page`, which is looked at before and after.
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_eeprom(&mut self, page: Page, address: Address) -> Result<u8, Failure<U, D>> {
        self.run(&mut EepromAccess::read(page, address, EEPROM_POLLING)).await
    }

    /// ID 6: writes a byte and reads it back. Motor makers keep commutation data in this memory: know what is there.
    ///
    /// # Errors
    /// [`Error`]: whether the byte was written is not known then. Read it.
    pub async fn write_eeprom(&mut self, page: Page, address: Address, data: u8) -> Result<u8, Failure<U, D>> {
        self.run(&mut EepromAccess::write(page, address, data, EEPROM_POLLING)).await
    }

    /// A procedure of several transactions: does what its steps ask for.
    ///
    /// # Errors
    /// [`Error`]: that of the procedure, for which a fault of the UART is a lost answer; or at once one of the pin or of a line
    /// that cannot be used, and then whether the last request had its effect is not known.
    pub async fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Failure<U, D>>
    where
        P: Procedure<Request = Request, Response = Response, Error = tformat::Error>,
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
    pub async fn transact(&mut self, request: Request) -> Result<Exchange, Failure<U, D>> {
        self.direction.off().map_err(Error::Pin)?;
        self.settle().await?;
        let frame = request.emit();
        let guard = self.direction.transmit().map_err(Error::Pin)?;
        self.state.pause_asynch(&mut self.timer, self.line.driver_lead_ns.into()).await?;
        self.state.begin(longest_ns(&self.line, request));
        let request_ns = self.line.rate.fields_ns(frame.fields()).into();
        let sent = send(&mut self.uart, &mut self.timer, &mut self.state, &self.line, &frame).await;
        if matches!(sent, Err(Error::Clock(_))) {
            // A request of which the end is cut off may be another one: it leaves, by the time that it is now.
            let _: Result<(), _> = self.state.pause_asynch(&mut self.timer, request_ns).await;
        }
        let start_ns = sent?;
        guard.receive().map_err(Error::Pin)?;
        let mut transaction = Transaction::start(request, self.line, start_ns);
        let mut progress = transaction.progress();
        loop {
            match exchange::next(progress, &mut self.state, &mut self.timer)? {
                ControlFlow::Continue(until_ns) => progress = self.receive(&mut transaction, until_ns).await?,
                ControlFlow::Break(outcome) => return outcome.map_err(Error::Protocol),
            }
        }
    }

    /// Takes what is there, or waits for it; asks the clock only if there is nothing.
    async fn receive(&mut self, transaction: &mut Transaction, until_ns: u64) -> Result<Progress, Failure<U, D>> {
        let mut buffer = [0; MAX_BYTES];
        // The time is over after `until_ns`, not at it.
        let wait = self.timer.wait_until(until_ns.saturating_add(1));
        match race(self.uart.read(&mut buffer), wait).await? {
            None => Ok(transaction.poll(self.state.now_ns(&mut self.timer)?)),
            Some(count) => {
                let count = count.map_err(Error::Io)?;
                let bytes = buffer.get(..count).filter(|bytes| !bytes.is_empty()).ok_or(Error::Closed)?;
                Ok(transaction.hear(bytes, self.state.now_ns(&mut self.timer)?))
            }
        }
    }

    /// Waits until the line is free, and throws away what comes meanwhile, errors of the UART included.
    async fn settle(&mut self) -> Result<(), Failure<U, D>> {
        let uart = &mut self.uart;
        let listen = async || match uart.read(&mut [0; MAX_BYTES]).await {
            Ok(0) => Err(Error::Closed),
            Ok(_) | Err(_) => Ok(()),
        };
        if quiet::wait_asynch(&mut self.state, &mut self.timer, listen).await? {
            Ok(())
        } else {
            Err(Error::NeverQuiet)
        }
    }
}

/// Sends a request, until its last bit has left: when it began.
async fn send<U: Write, PIN, P, D>(
=======
/// What comes until a time, or an error of the UART.
async fn read<U: Read>(
>>>>>>> drivers
    uart: &mut U,
    bytes: &mut [u8],
    line: &mut quiet::Line,
    timer: &mut impl Timer,
    until_ns: u64,
) -> Result<Heard<Result<usize, U::Error>>, ClockError> {
    let what = race(uart.read(bytes), timer.wait_until(until_ns)).await?;
    Ok(Heard { what, now_ns: line.now_ns(timer)? })
}

async fn sleep(_: &mut quiet::Line, timer: &mut impl Timer, until_ns: u64) -> Result<(), ClockError> {
    timer.wait_until(until_ns).await
}
