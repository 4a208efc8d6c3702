//! The common source text of both drivers. How they wait is defined in [`blocking`](super::blocking) and `asynch` (feature
//! `async`).

macro_rules! driver {
    ($wait:ident, [$($uart:path),+], $clock:path $(, $asynch:tt)?) => {
        use servowire_core::{ClockError, Procedure};
        use tformat::master::{Detection, EEPROM_POLLING, EepromAccess, Exchange, Line, Progress, Reset, Transaction};
        use tformat::{
            Address, AllData, BitRate, Doubt, Evidence, Page, Policy, Request, Resolution, Response, Sample, SingleTurn,
        };

        use super::tuning::{Tuned, Tuning};
        use super::{LOST, MAX_BYTES, Released, all_data, longest_ns, refused, silence_ns, unknown_ns};
        use crate::direction::Switch;
        use crate::quiet::{self, Heard, Settle};
        use crate::sending::{self, Sending};
        use crate::{Direction, Error, PinTooSlow, exchange};

        /// Why a call to a [`Driver`] failed.
        pub type Failure<U, D> = Error<<U as ErrorType>::Error, <D as Direction>::Error, tformat::Error, Doubt>;

        /// The driver of an encoder that is alone on its UART.
        #[derive(Debug)]
        pub struct Driver<U, D, C> {
            uart: U,
            direction: Switch<D>,
            clock: C,
            line: Line,
            state: quiet::Line,
            late_ns: u64,
        }

        impl<U: $($uart +)+, D: Direction, C: $clock> Driver<U, D, C> {
            /// Creates a driver for an encoder on this UART, which has to be set to the rate of `line`, 8 data bits, no parity,
            /// one stop bit.
            ///
            /// It makes no difference whether the receiver is enabled while the request is sent: an echo is recognised by its time.
            ///
            /// # Errors
            /// [`PinTooSlow`] if `direction` is a pin that software cannot reliably switch off between a request and its answer.
            pub fn new(uart: U, direction: D, clock: C, line: Line) -> Result<Self, PinTooSlow> {
                let direction = Switch::new(direction);
                direction.check(line.turn_around_ns)?;
                let state = quiet::Line::new(silence_ns(&line), unknown_ns(&line));
                Ok(Self { uart, direction, clock, line, state, late_ns: 0 })
            }

            /// Returns UART, direction and clock.
            pub fn release(self) -> Released<U, D, C> {
                Released { uart: self.uart, direction: self.direction.release(), clock: self.clock }
            }

            /// How much too late the direction pin may have been switched off after the last request, in ns; 0 if it was
            /// certainly in time. A value other than 0 means that [`Worst`](crate::Worst) was too optimistic or the processor
            /// was busy elsewhere.
            pub const fn late_ns(&self) -> u64 {
                self.late_ns
            }

            /// Reads the position, if it may be used now, and when it was sampled: [`read_evidence`](Self::read_evidence),
            /// judged at once by the rules of [`Evidence::at`]. The answer alone lasts 44 us at 2.5 Mbit/s and 22 us at 5
            /// Mbit/s, so the position is at least that old.
            ///
            /// # Errors
            /// [`Error`], [`Error::Doubt`] among them.
            pub $($asynch)? fn read_position(
                &mut self,
                resolution: Resolution,
                policy: Policy,
            ) -> Result<Sample, Failure<U, D>> {
                let evidence = $wait!(self.read_evidence(resolution))?;
                evidence.at(self.state.now_ns(&mut self.clock)?, policy).map_err(Error::Doubt)
            }

            /// Reads with ID 3 what the encoder reports about its position, to be judged where it is used. If the request was
            /// held up on its way out, the position is younger by that time.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_evidence(&mut self, resolution: Resolution) -> Result<Evidence, Failure<U, D>> {
                Ok($wait!(self.transact(Request::ReadAll))?.evidence(resolution))
            }

            /// Sends ID 3 and returns the fields for position, turns, encoder ID and alarms as received. For a position that may
            /// be used, call [`read_position`](Self::read_position).
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_data(&mut self) -> Result<AllData, Failure<U, D>> {
                all_data($wait!(self.transact(Request::ReadAll))?.response).map_err(Error::Protocol)
            }

            /// Clears the latched alarms: ID 7, ten times. Position and turns are unchanged.
            ///
            /// # Errors
            /// [`Error`]; read the alarms to see whether they were cleared.
            pub $($asynch)? fn clear_errors(&mut self) -> Result<SingleTurn, Failure<U, D>> {
                $wait!(self.run(&mut Reset::clear_errors()))
            }

            /// Reads the byte at `address` of `page` (ID D); the page is checked before and after.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_eeprom(
                &mut self,
                page: Page,
                address: Address,
            ) -> Result<u8, Failure<U, D>> {
                $wait!(self.run(&mut EepromAccess::read(page, address, EEPROM_POLLING)))
            }

            /// Writes a byte and reads it back (ID 6). Motor makers keep commutation data in this memory: make sure that you
            /// know what you overwrite.
            ///
            /// # Errors
            /// [`Error`]; it is then not known whether the byte was written. Read it.
            pub $($asynch)? fn write_eeprom(
                &mut self,
                page: Page,
                address: Address,
                data: u8,
            ) -> Result<u8, Failure<U, D>> {
                $wait!(self.run(&mut EepromAccess::write(page, address, data, EEPROM_POLLING)))
            }

            /// Finds the encoder at either rate, after power-on, whether that was just now or earlier; the driver keeps the
            /// rate at which the encoder was found. `set_rate` sets the rate of the UART, and is also called before the
            /// first request. Use `Detection::on([line, line])` if one rate is enough, or if the lines need other times than
            /// the defaults.
            ///
            /// # Errors
            /// [`Error`], with the error of `set_rate` as [`Error::Io`]; [`Error::PinTooSlow`] if the pin is too slow for one of
            /// the rates.
            pub $($asynch)? fn detect(
                &mut self,
                mut detection: Detection,
                mut set_rate: impl FnMut(&mut U, BitRate) -> Result<(), U::Error>,
            ) -> Result<AllData, Failure<U, D>> {
                let tune = |driver: &mut Self, Tuned { request, line }| {
                    driver.direction.check(line.turn_around_ns)?;
                    driver.line = line;
                    driver.state.set_silence_ns(silence_ns(&line));
                    set_rate(&mut driver.uart, line.rate).map_err(Error::Io)?;
                    Ok(request)
                };
                $wait!(self.drive(&mut Tuning(&mut detection), tune))
            }

            /// Runs a procedure of several transactions at the driver's rate. [`Detection`] has its [own
            /// call](Self::detect).
            ///
            /// # Errors
            /// [`Error`]: the error of the procedure, for which a fault of the UART counts as a lost answer; or at once an error
            /// of the pin or of a line that cannot be used, and it is then not known whether the last request took effect.
            pub $($asynch)? fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Failure<U, D>>
            where
                P: Procedure<Request = Request, Response = Response, Error = tformat::Error>,
            {
                $wait!(self.drive(procedure, |_, request| Ok(request)))
            }

            $($asynch)? fn drive<P: Procedure<Response = Response, Error = tformat::Error>>(
                &mut self,
                procedure: &mut P,
                mut tune: impl FnMut(&mut Self, P::Request) -> Result<Request, Failure<U, D>>,
            ) -> Result<P::Value, Failure<U, D>> {
                let now_ns = self.state.first_ns(&mut self.clock)?;
                let exchange = $($asynch)? |request, not_before_ns| {
                    $wait!(sleep(&mut self.state, &mut self.clock, not_before_ns))?;
                    let request = tune(self, request)?;
                    self.check()?;
                    let looked = self.state.now_ns(&mut self.clock);
                    let exchanged = $wait!(self.exchange(looked, request)).map(|exchange| exchange.response);
                    exchange::ended(exchanged, LOST, &mut self.state, &mut self.clock)
                };
                let ended = $wait!(run(procedure, now_ns, exchange))?;
                self.state.keep(ended.ready_ns);
                ended.outcome.map_err(Error::Protocol)
            }

            /// Nothing is sent on a line whose settings leave no time for an answer.
            fn check(&self) -> Result<(), Failure<U, D>> {
                if self.line.leaves_time() { Ok(()) } else { Err(Error::Protocol(tformat::Error::Line)) }
            }

            /// Sends one request and receives its answer.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn transact(&mut self, request: Request) -> Result<Exchange, Failure<U, D>> {
                let looked = self.state.first_ns(&mut self.clock);
                $wait!(self.exchange(looked, request))
            }

            /// `looked` is the result of the last look at the clock.
            $($asynch)? fn exchange(
                &mut self,
                looked: Result<u64, ClockError>,
                request: Request,
            ) -> Result<Exchange, Failure<U, D>> {
                self.check()?;
                let (clock, state) = (&mut self.clock, &mut self.state);
                let from_ns = sending::off(&mut self.direction, clock, state, &self.line, looked).map_err(Error::Pin)??;
                $wait!(self.settle(from_ns))?;
                let start_ns = $wait!(self.send(request))?;
                let mut transaction = Transaction::start(request, self.line, start_ns);
                let (mut progress, mut bytes) = (transaction.progress(), [0; MAX_BYTES]);
                loop {
                    let until_ns = match progress {
                        Progress::Pending { until_ns } => until_ns,
                        Progress::Done { value, ready_ns } => {
                            self.state.clean(ready_ns);
                            return Ok(value);
                        }
                        Progress::Failed { error, ready_ns } => {
                            let now_ns = self.state.now_ns(&mut self.clock)?;
                            // What was on the line until then may be handed over as late as that.
                            let ready_ns = ready_ns.saturating_add(self.line.hand_over_ns.into());
                            self.state.failed(ready_ns, now_ns);
                            return Err(refused(error, self.late_ns));
                        }
                    };
                    let (uart, state, clock) = (&mut self.uart, &mut self.state, &mut self.clock);
                    let Heard { what, now_ns } = $wait!(read(uart, &mut bytes, state, clock, until_ns))?;
                    progress = match what {
                        Some(count) => {
                            let heard = bytes.get(..count.map_err(Error::Io)?).filter(|heard| !heard.is_empty());
                            transaction.hear(heard.ok_or(Error::Closed)?, now_ns)
                        }
                        None => transaction.poll(now_ns),
                    };
                }
            }

            /// Waits until the line is free and discards what arrives meanwhile, errors of the UART included.
            $($asynch)? fn settle(&mut self, from_ns: u64) -> Result<(), Failure<U, D>> {
                let (mut until_ns, mut settling) = (from_ns, self.state.settle(from_ns));
                loop {
                    let (uart, state, clock) = (&mut self.uart, &mut self.state, &mut self.clock);
                    let Heard { what, now_ns } =
                        $wait!(read(uart, &mut [0; MAX_BYTES], state, clock, until_ns))?;
                    if matches!(what, Some(Ok(0))) {
                        return Err(Error::Closed);
                    }
                    match settling.next(what.is_some(), now_ns) {
                        Settle::Quiet => return Ok(()),
                        Settle::Never => return Err(Error::NeverQuiet),
                        Settle::Until(ns) => until_ns = ns,
                    }
                }
            }

            /// Sends a request until its last bit has left; returns when it began.
            $($asynch)? fn send(&mut self, request: Request) -> Result<u64, Failure<U, D>> {
                let (line, frame) = (self.line, request.emit());
                self.late_ns = 0;
                let mut sending = Sending::begin(&mut self.direction, &mut self.clock, &mut self.state, &line)
                    .map_err(Error::Pin)?;
                if let Some(ns) = sending.lead_until_ns(line.driver_lead_ns)? {
                    $wait!(sleep(sending.line, sending.clock, ns))?;
                }
                sending.line.begin(longest_ns(&line, &frame));
                let mut fields = frame.as_bytes();
                while !fields.is_empty() {
                    let piece = sending.piece(fields);
                    let asked_ns = sending.ask(piece)?;
                    let count = $wait!(self.uart.write(piece)).map_err(Error::Io)?;
                    fields = fields.get(count..).filter(|_| count > 0).ok_or(Error::Closed)?;
                    sending.taken(count, asked_ns)?;
                }
                $wait!(self.uart.flush()).map_err(Error::Io)?;
                if let Some(ns) = sending.off_ns() {
                    $wait!(sleep(sending.line, sending.clock, ns))?;
                }
                let sent = sending.end().map_err(Error::Pin)??;
                self.late_ns = sent.late_ns;
                Ok(sent.start_ns)
            }
        }
    };
}
