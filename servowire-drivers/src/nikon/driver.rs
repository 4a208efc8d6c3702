//! The common source text of both drivers. How they wait is defined in [`blocking`](super::blocking) and `asynch` (feature
//! `async`).

macro_rules! driver {
    ($wait:ident, $clock:path $(, $asynch:tt)?) => {
        use core::convert::Infallible;

        use nikon_aformat::bus::Addresses;
        use nikon_aformat::master::{
            BusTransaction, Cycle, EepromRead, Exchange, GuardedReset, Line, Progress, Reset, Transaction,
        };
        use nikon_aformat::{
            Doubt, EncoderAddress, Evidence, Operation, Policy, Request, Resolution, Response, Sample,
        };
        use servowire_core::{ClockError, Machine, Procedure};

        use super::{LOST, Released, hear, longest_ns, silence_ns, unknown_ns};
        use crate::quiet::{self, Heard, Settle};
        use crate::{Error, exchange};

        /// Why a call to a [`Driver`] failed.
        pub type Failure<F> = Error<<F as FramePort>::Error, Infallible, nikon_aformat::Error, Doubt>;

        /// The controller's end of a line with up to eight encoders of one resolution.
        #[derive(Debug)]
        pub struct Driver<F, C> {
            port: F,
            clock: C,
            resolution: Resolution,
            line: Line,
            state: quiet::Line,
        }

        impl<F: FramePort, C: $clock> Driver<F, C> {
            /// Creates a driver for a line with encoders of this resolution. The port must be asked for frames within
            /// `line.latency_budget_ns()` of their end, unless it reports their times. So either nothing but the driver may run
            /// meanwhile, or the line needs a larger budget.
            pub const fn new(port: F, clock: C, resolution: Resolution, line: Line) -> Self {
                let state = quiet::Line::new(silence_ns(line), unknown_ns(line, resolution));
                Self { port, clock, resolution, line, state }
            }

            /// Returns port and clock.
            pub fn release(self) -> Released<F, C> {
                Released { port: self.port, clock: self.clock }
            }

            /// Reads the position of an encoder, if it may be used now, and when it was sampled:
            /// [`read_evidence`](Self::read_evidence), judged at once by the rules of [`Evidence::at`]. The answer alone
            /// lasts 72 bits, so the position is at least that old.
            ///
            /// # Errors
            /// [`Error`], [`Error::Doubt`] among them.
            pub $($asynch)? fn read_position(
                &mut self,
                ea: EncoderAddress,
                policy: Policy,
            ) -> Result<Sample, Failure<F>> {
                let evidence = $wait!(self.read_evidence(ea))?;
                evidence.at(self.state.now_ns(&mut self.clock)?, policy).map_err(Error::Doubt)
            }

            /// Reads with command 0 what an encoder reports about its position, to be judged where it is used.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_evidence(&mut self, ea: EncoderAddress) -> Result<Evidence, Failure<F>> {
                Ok($wait!(self.read_abs40(ea))?.evidence(self.resolution))
            }

            /// Sends command 0 and returns the field of the whole position and the encoder status as received. For a position
            /// that may be used, call [`read_position`](Self::read_position).
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_abs40(&mut self, ea: EncoderAddress) -> Result<Exchange, Failure<F>> {
                $wait!(self.transact(Request::new(ea, Operation::Abs40)))
            }

            /// Sends a multi-response command and receives the answers of all encoders to this one request.
            /// [`BusTransaction::exchange`] returns each of them; a missing or damaged answer does not affect the others.
            ///
            /// # Errors
            /// [`Error`]. A missing answer is not an error.
            pub $($asynch)? fn read_bus(
                &mut self,
                operation: Operation,
                asked: Addresses,
            ) -> Result<BusTransaction, Failure<F>> {
                let from_ns = self.state.first_ns(&mut self.clock)?;
                $wait!(self.bus(from_ns, operation, asked))
            }

            $($asynch)? fn bus(
                &mut self,
                from_ns: u64,
                operation: Operation,
                asked: Addresses,
            ) -> Result<BusTransaction, Failure<F>> {
                let request = Request::new(asked.highest().unwrap_or(EncoderAddress::MAX), operation);
                let line = self.line.with_highest(self.line.highest.max(request.ea));
                let (resolution, plain) = (self.resolution, self.line);
                let start = |now_ns| BusTransaction::start(request, resolution, asked, plain, now_ns);
                let (transaction, ()) = $wait!(self.exchange(from_ns, request, line, start))?;
                Ok(transaction)
            }

            /// Calls [`read_bus`](Self::read_bus) when the cycle is due: waits for the next start and keeps to its grid.
            ///
            /// # Errors
            /// [`Error`]. After [`Error::Clock`] create a new cycle, because the grid of this one dates from before the clock
            /// was set back.
            pub $($asynch)? fn read_cycle(
                &mut self,
                cycle: &mut Cycle,
                operation: Operation,
                asked: Addresses,
            ) -> Result<BusTransaction, Failure<F>> {
                let _ = self.state.first_ns(&mut self.clock)?;
                $wait!(sleep(&mut self.state, &mut self.clock, cycle.next_ns()))?;
                let now_ns = self.state.now_ns(&mut self.clock)?;
                let _ = cycle.is_due(now_ns);
                $wait!(self.bus(now_ns, operation, asked))
            }

            /// Clears the alarms of an encoder: command 8, eight times. Position and turns are unchanged.
            ///
            /// # Errors
            /// [`Error`]; read the status to see whether they were cleared.
            pub $($asynch)? fn clear_status(&mut self, ea: EncoderAddress) -> Result<Response, Failure<F>> {
                $wait!(self.run(&mut GuardedReset::new(Reset::clear_status(ea))))
            }

            /// Reads the word at an address of the EEPROM (command 13). To write, pass a procedure to [`run`](Self::run).
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn read_eeprom(&mut self, ea: EncoderAddress, address: u8) -> Result<u16, Failure<F>> {
                $wait!(self.run(&mut EepromRead::new(ea, address)))
            }

            /// Runs a procedure of several transactions, for example [`Detection`](nikon_aformat::master::Detection).
            ///
            /// # Errors
            /// [`Error`]: the error of the procedure, for which a fault of the port counts as a lost answer;
            /// [`Error::NeverQuiet`] and [`Error::Clock`] at once, and it is then not known whether the last request took effect.
            pub $($asynch)? fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Failure<F>>
            where
                P: Procedure<Request = Request, Response = Response, Error = nikon_aformat::Error>,
            {
                let now_ns = self.state.first_ns(&mut self.clock)?;
                let exchange = $($asynch)? |request, not_before_ns| {
                    // What is never sent has no effect that could be unknown.
                    let refused = Transaction::start(request, self.resolution, self.line, now_ns).progress();
                    if let Progress::Failed { error, .. } = refused {
                        return Err(Error::Protocol(error));
                    }
                    $wait!(sleep(&mut self.state, &mut self.clock, not_before_ns))?;
                    let from_ns = self.state.now_ns(&mut self.clock)?;
                    let exchanged = $wait!(self.single(from_ns, request)).map(|exchange| exchange.response);
                    exchange::ended(exchanged, LOST, &mut self.state, &mut self.clock)
                };
                let ended = $wait!(run(procedure, now_ns, exchange))?;
                self.state.keep(ended.ready_ns);
                ended.outcome.map_err(Error::Protocol)
            }

            /// Sends one request and receives its answer.
            ///
            /// # Errors
            /// [`Error`].
            pub $($asynch)? fn transact(&mut self, request: Request) -> Result<Exchange, Failure<F>> {
                let from_ns = self.state.first_ns(&mut self.clock)?;
                $wait!(self.single(from_ns, request))
            }

            $($asynch)? fn single(&mut self, from_ns: u64, request: Request) -> Result<Exchange, Failure<F>> {
                let (resolution, line) = (self.resolution, self.line);
                let start = |now_ns| Transaction::start(request, resolution, line, now_ns);
                let (_, exchange) = $wait!(self.exchange(from_ns, request, line, start))?;
                Ok(exchange)
            }

            /// Sends one request and receives all answers. The clock was last read at `from_ns`.
            $($asynch)? fn exchange<M: Machine<Unit = [Option<u16>], Error = nikon_aformat::Error>>(
                &mut self,
                from_ns: u64,
                request: Request,
                line: Line,
                start: impl FnOnce(u64) -> M,
            ) -> Result<(M, M::Value), Failure<F>> {
                $wait!(self.settle(from_ns))?;
                let start_ns = self.state.now_ns(&mut self.clock)?;
                let mut transaction = start(start_ns);
                match transaction.progress() {
                    // Encoders of this version do not know it, or nobody is asked: nothing is sent.
                    Progress::Failed { error, .. } => return Err(Error::Protocol(error)),
                    Progress::Done { value, .. } => return Ok((transaction, value)),
                    Progress::Pending { .. } => {}
                }
                self.state.begin(longest_ns(line, request, self.resolution));
                let gap_bits = line.rate.bits(line.frame_gap_ns);
                $wait!(self.port.send(request.emit().as_slice(), gap_bits)).map_err(Error::Io)?;
                let now_ns = self.state.now_ns(&mut self.clock)?;
                self.state.sent(now_ns);
                let mut progress = transaction.progress();
                loop {
                    let until_ns = match progress {
                        Progress::Pending { until_ns } => until_ns,
                        Progress::Done { value, ready_ns } => {
                            self.state.clean(ready_ns);
                            return Ok((transaction, value));
                        }
                        Progress::Failed { error, ready_ns } => {
                            let now_ns = self.state.now_ns(&mut self.clock)?;
                            self.state.failed(ready_ns, now_ns);
                            return Err(Error::Protocol(error));
                        }
                    };
                    let (port, state, clock) = (&mut self.port, &mut self.state, &mut self.clock);
                    let Heard { what, now_ns } = $wait!(take(port, state, clock, until_ns))?;
                    progress = match what {
                        Some(frame) => hear(&mut transaction, frame.map_err(Error::Io)?, now_ns),
                        None => transaction.poll(now_ns),
                    };
                }
            }

            /// Waits until the line is free and discards what arrives meanwhile, errors of the port included.
            $($asynch)? fn settle(&mut self, from_ns: u64) -> Result<(), Failure<F>> {
                let (mut until_ns, mut settling) = (from_ns, self.state.settle(from_ns));
                loop {
                    let (port, state, clock) = (&mut self.port, &mut self.state, &mut self.clock);
                    let Heard { what, now_ns } = $wait!(take(port, state, clock, until_ns))?;
                    match settling.next(what.is_some(), now_ns) {
                        Settle::Quiet => return Ok(()),
                        Settle::Never => return Err(Error::NeverQuiet),
                        Settle::Until(ns) => until_ns = ns,
                    }
                }
            }
        }
    };
}
