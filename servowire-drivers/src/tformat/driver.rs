//! The text of both drivers. What they wait with is in [`blocking`](super::blocking) and `asynch` (feature `async`).

macro_rules! driver {
    ($wait:ident, [$($uart:path),+], $clock:path $(, $asynch:tt)?) => {
        use servowire_core::{ClockError, Procedure};
        use tformat::master::{Detection, EEPROM_POLLING, EepromAccess, Exchange, Line, Progress, Reset, Transaction};
        use tformat::{
            Address, AllData, BitRate, Doubt, Evidence, Page, Policy, Request, Resolution, Response, Sample, SingleTurn,
        };

        use super::tuning::{Tuned, Tuning};
        use super::{LOST, MAX_BYTES, Released, all_data, longest_ns, refused, silence_ns};
        use crate::direction::Switch;
        use crate::quiet::{self, Heard, Settle};
        use crate::sending::Sending;
        use crate::{Direction, Error, PinTooSlow, exchange};

        /// Why a call of a [`Driver`] failed.
        pub type Failure<U, D> = Error<<U as ErrorType>::Error, <D as Direction>::Error, tformat::Error, Doubt>;

        /// An encoder, alone at its UART.
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
            /// An encoder at this UART, set to the rate of `line`, 8 data bits, no parity, one stop bit.
            ///
            /// Whether the receiver is on while the request goes out makes no difference: an echo is known by its time.
            ///
            /// # Errors
            /// [`PinTooSlow`] if `direction` is a pin that software cannot switch off for certain between a request and its answer.
            pub fn new(uart: U, direction: D, clock: C, line: Line) -> Result<Self, PinTooSlow> {
                let direction = Switch::new(direction);
                direction.check(line.turn_around_ns)?;
                let state = quiet::Line::new(silence_ns(&line));
                Ok(Self { uart, direction, clock, line, state, late_ns: 0 })
            }

            /// Gives UART, direction and clock back.
            pub fn release(self) -> Released<U, D, C> {
                Released { uart: self.uart, direction: self.direction.release(), clock: self.clock }
            }

            /// By how much the direction pin may have gone off too late after the last request, ns; 0 if it was certainly in
            /// time. If not, [`Worst`](crate::Worst) was too optimistic, or the processor was busy elsewhere.
            pub const fn late_ns(&self) -> u64 {
                self.late_ns
            }

            /// The position, if it may be used now, and when it was sampled: [`read_evidence`](Self::read_evidence), judged at
            /// once by the rules of [`Evidence::at`]. The answer alone lasts 44 us at 2.5 Mbit/s and 22 us at 5, so it is never younger.
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

            /// What the encoder says of its position, from ID 3, to be judged where it is used. If the request was held up on its
            /// way out, the position is younger by that.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_evidence(&mut self, resolution: Resolution) -> Result<Evidence, Failure<U, D>> {
                Ok($wait!(self.transact(Request::ReadAll))?.evidence(resolution))
            }

            /// ID 3: the fields for position, turns, encoder ID and alarms as they came. For a position that may be used take
            /// [`read_position`](Self::read_position).
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_data(&mut self) -> Result<AllData, Failure<U, D>> {
                all_data($wait!(self.transact(Request::ReadAll))?.response).map_err(Error::Protocol)
            }

            /// ID 7, ten times: clears the latched alarms. Position and turns stay.
            ///
            /// # Errors
            /// [`Error`]; read the alarms to see whether they were cleared.
            pub $($asynch)? fn clear_errors(&mut self) -> Result<SingleTurn, Failure<U, D>> {
                $wait!(self.run(&mut Reset::clear_errors()))
            }

            /// ID D: the byte at `address` of `page`, which is checked before and after.
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

            /// ID 6: writes a byte and reads it back. Motor makers keep commutation data in this memory: know what you overwrite.
            ///
            /// # Errors
            /// [`Error`]: whether the byte was written is not known then. Read it.
            pub $($asynch)? fn write_eeprom(
                &mut self,
                page: Page,
                address: Address,
                data: u8,
            ) -> Result<u8, Failure<U, D>> {
                $wait!(self.run(&mut EepromAccess::write(page, address, data, EEPROM_POLLING)))
            }

            /// Finds the encoder after its supply was switched on, now or before: at either rate, of which the driver keeps the one at
            /// which it was found. `set_rate` sets the UART, and is called before the first request too. Take
            /// `Detection::on([line, line])` if one rate is enough, or if the lines need other times than the defaults.
            ///
            /// # Errors
            /// [`Error`], that of `set_rate` as [`Error::Io`]; [`Error::PinTooSlow`] if the pin is too slow for one of the rates.
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

            /// A procedure of several transactions at the driver's rate: does what its steps ask for. [`Detection`] has its [own
            /// call](Self::detect).
            ///
            /// # Errors
            /// [`Error`]: that of the procedure, for which a fault of the UART is a lost answer; or at once one of the pin or of a line
            /// that cannot be used, and then whether the last request had its effect is not known.
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
                    let exchanged = $wait!(self.transact(request)).map(|exchange| exchange.response);
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

            /// One request and its answer.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn transact(&mut self, request: Request) -> Result<Exchange, Failure<U, D>> {
                self.check()?;
                self.direction.off().map_err(Error::Pin)?;
                $wait!(self.settle())?;
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

            /// Waits until the line is free, and throws away what comes meanwhile, errors of the UART included.
            $($asynch)? fn settle(&mut self) -> Result<(), Failure<U, D>> {
                let mut until_ns = self.state.first_ns(&mut self.clock)?;
                let mut settling = self.state.settle(until_ns);
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

            /// Sends a request, until its last bit has left: when it began.
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
