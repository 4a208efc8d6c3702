//! Waits by spinning.

use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_core::run;

use crate::Clock;
use crate::quiet::spin;

driver!(spun, [Read, ReadReady, Write], Clock);

<<<<<<< HEAD
/// An encoder, alone at its UART.
#[derive(Debug)]
pub struct Driver<U, D, C> {
    uart: U,
    direction: Switch<D>,
    clock: C,
    line: Line,
    state: quiet::Line,
}

impl<U: Read + ReadReady + Write, D: Direction, C: Clock> Driver<U, D, C> {
    /// An encoder at this UART, set to the rate of `line`, 8 data bits, no parity, one stop bit.
    ///
    /// Whether the receiver is on while the request goes out makes no difference: an echo is known by its time.
    pub fn new(uart: U, direction: D, clock: C, line: Line) -> Self {
        Self { uart, direction: Switch::new(direction), clock, line, state: quiet::Line::new(silence_ns(&line)) }
    }

    /// Gives UART, direction and clock back.
    pub fn release(self) -> Released<U, D, C> {
        Released { uart: self.uart, direction: self.direction.release(), clock: self.clock }
    }

    /// The position, if it may be used now, and when it was sampled: [`read_evidence`](Self::read_evidence), judged at
    /// once by the rules of [`Evidence::at`]. The answer alone lasts 44 us at 2.5 Mbit/s and 22 us at 5, so it is never younger.
    ///
    /// # Errors
    /// [`Error`], [`Error::Doubt`] among them.
    pub fn read_position(&mut self, resolution: Resolution, policy: Policy) -> Result<Sample, Failure<U, D>> {
        let evidence = self.read_evidence(resolution)?;
        evidence.at(self.state.now_ns(&mut self.clock)?, policy).map_err(Error::Doubt)
    }

    /// What the encoder says of its position, from ID 3, to be judged where it is used. If the request was held up on its
    /// way out, the position is younger by that.
    ///
    /// # Errors
    /// [`Error`].
    pub fn read_evidence(&mut self, resolution: Resolution) -> Result<Evidence, Failure<U, D>> {
        Ok(self.transact(Request::ReadAll)?.evidence(resolution))
    }

    /// ID 3: the fields for position, turns, encoder ID and alarms as they came. For a position that may be used take
    /// [`read_position`](Self::read_position).
    ///
    /// # Errors
    /// [`Error`].
    pub fn read_data(&mut self) -> Result<AllData, Failure<U, D>> {
        match self.transact(Request::ReadAll)?.response {
            Response::ReadAll(all) => Ok(all),
            _ => Err(Error::Protocol(other(Request::ReadAll))),
        }
    }

    /// ID 7, ten times: clears the latched alarms. Position and turns stay.
    ///
    /// # Errors
    /// [`Error`]; read the alarms to see whether they were cleared.
    pub fn clear_errors(&mut self) -> Result<SingleTurn, Failure<U, D>> {
        self.run(&mut Reset::clear_errors())
    }

    /// ID D: the byte at `address` of `page`, which is looked at before and after.
    ///
    /// # Errors
    /// [`Error`].
    pub fn read_eeprom(&mut self, page: Page, address: Address) -> Result<u8, Failure<U, D>> {
        self.run(&mut EepromAccess::read(page, address, EEPROM_POLLING))
    }

    /// ID 6: writes a byte and reads it back. Motor makers keep commutation data in this memory: know what is there.
    ///
    /// # Errors
    /// [`Error`]: whether the byte was written is not known then. Read it.
    pub fn write_eeprom(&mut self, page: Page, address: Address, data: u8) -> Result<u8, Failure<U, D>> {
        self.run(&mut EepromAccess::write(page, address, data, EEPROM_POLLING))
    }

    /// A procedure of several transactions: does what its steps ask for.
    ///
    /// # Errors
    /// [`Error`]: that of the procedure, for which a fault of the UART is a lost answer; or at once one of the pin or of a line
    /// that cannot be used, and then whether the last request had its effect is not known.
    pub fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Failure<U, D>>
    where
        P: Procedure<Request = Request, Response = Response, Error = tformat::Error>,
    {
        let now_ns = self.state.now_ns(&mut self.clock)?;
        let exchange = |request, not_before_ns| {
            self.state.wait_until(&mut self.clock, not_before_ns)?;
            let exchanged = self.transact(request).map(|exchange| exchange.response);
            exchange::ended(exchanged, LOST, &mut self.state, &mut self.clock)
        };
        let Ended { outcome, ready_ns } = servowire_core::run(procedure, now_ns, exchange)?;
        self.state.keep(ready_ns);
        outcome.map_err(Error::Protocol)
    }

    /// One request and its answer.
    ///
    /// # Errors
    /// [`Error`].
    pub fn transact(&mut self, request: Request) -> Result<Exchange, Failure<U, D>> {
        self.direction.off().map_err(Error::Pin)?;
        self.settle()?;
        let frame = request.emit();
        let guard = self.direction.transmit().map_err(Error::Pin)?;
        self.state.pause(&mut self.clock, self.line.driver_lead_ns.into())?;
        self.state.begin(longest_ns(&self.line, request));
        let request_ns = self.line.rate.fields_ns(frame.fields()).into();
        let sent = send(&mut self.uart, &mut self.clock, &mut self.state, &self.line, &frame);
        if matches!(sent, Err(Error::Clock(_))) {
            // A request of which the end is cut off may be another one: it leaves, by the time that it is now.
            let _: Result<(), _> = self.state.pause(&mut self.clock, request_ns);
        }
        let start_ns = sent?;
        guard.receive().map_err(Error::Pin)?;
        let mut transaction = Transaction::start(request, self.line, start_ns);
        loop {
            let ended = match self.receive(&mut transaction)? {
                // At once: a look at the UART that finds nothing is the most frequent one.
                Progress::Pending { .. } => continue,
                ended => ended,
            };
            if let ControlFlow::Break(outcome) = exchange::next(ended, &mut self.state, &mut self.clock)? {
                return outcome.map_err(Error::Protocol);
            }
        }
    }

    /// Takes what is there; asks the clock only if there is nothing.
    fn receive(&mut self, transaction: &mut Transaction) -> Result<Progress, Failure<U, D>> {
        if !self.uart.read_ready().map_err(Error::Io)? {
            // What came while the clock was read is not late.
            let now_ns = self.state.now_ns(&mut self.clock)?;
            if !self.uart.read_ready().map_err(Error::Io)? {
                return Ok(transaction.poll(now_ns));
            }
        }
        let mut buffer = [0; MAX_BYTES];
        let count = self.uart.read(&mut buffer).map_err(Error::Io)?;
        let bytes = buffer.get(..count).filter(|bytes| !bytes.is_empty()).ok_or(Error::Closed)?;
        Ok(transaction.hear(bytes, self.state.now_ns(&mut self.clock)?))
    }

    /// Waits until the line is free, and throws away what comes meanwhile, errors of the UART included.
    fn settle(&mut self) -> Result<(), Failure<U, D>> {
        let uart = &mut self.uart;
        let quiet = quiet::wait(&mut self.state, &mut self.clock, || match uart.read_ready() {
            Ok(true) => match uart.read(&mut [0; MAX_BYTES]) {
                Ok(0) => Err(Error::Closed),
                Ok(_) | Err(_) => Ok(true),
            },
            Ok(false) => Ok(false),
            Err(_) => Ok(true),
        });
        if quiet? { Ok(()) } else { Err(Error::NeverQuiet) }
    }
}

/// Sends a request, until its last bit has left: when it began.
fn send<U: Write, PIN, P, D>(
=======
/// What comes until a time, or an error of the UART.
#[inline(always)]
fn read<U: Read + ReadReady>(
>>>>>>> drivers
    uart: &mut U,
    bytes: &mut [u8],
    line: &mut quiet::Line,
    clock: &mut impl Clock,
    until_ns: u64,
) -> Result<Heard<Result<usize, U::Error>>, ClockError> {
    spin(line, clock, until_ns, || match uart.read_ready() {
        Ok(true) => Some(uart.read(bytes)),
        Ok(false) => None,
        Err(error) => Some(Err(error)),
    })
}

fn sleep(line: &mut quiet::Line, clock: &mut impl Clock, until_ns: u64) -> Result<(), ClockError> {
    line.wait_until(clock, until_ns)
}
