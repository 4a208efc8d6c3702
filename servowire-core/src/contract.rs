//! The traits that code generic over protocols relies on. Users of a single crate call its inherent methods, which have the same
//! names; these traits only forward to them.

use crate::{Progress, Step};

/// One exchange with the other end: what is sent, what is received as the answer, and how it ends.
///
/// A machine does no I/O and reads no clock. It is told what arrived and when that ended, and is then asked for the result.
pub trait Machine {
    /// What is sent, and when.
    type Transmission;
    /// What is received: bytes of a UART, frames of a line.
    type Unit: ?Sized;
    /// The result of the exchange.
    type Value;
    /// Why the exchange failed.
    type Error;

    /// Returns what is to be sent.
    fn transmission(&self) -> Self::Transmission;

    /// Takes units that were received one after the other; the last bit of the last one ended at `end_ns`.
    fn hear(&mut self, unit: &Self::Unit, end_ns: u64) -> Progress<Self::Value, Self::Error>;

    /// Reports a framing error in a unit that ended at `end_ns`.
    fn framing_error(&mut self, end_ns: u64) -> Progress<Self::Value, Self::Error>;

    /// Ends the exchange if its time has run out at `now_ns`. Hand over everything that was received before calling it.
    fn poll(&mut self, now_ns: u64) -> Progress<Self::Value, Self::Error>;

    /// Returns the state of the exchange.
    fn progress(&self) -> Progress<Self::Value, Self::Error>;
}

/// An operation that takes several exchanges: a reset, a memory access, the search for an encoder.
pub trait Procedure {
    /// A message to the other end.
    type Request;
    /// A message from the other end.
    type Response;
    /// The result of the procedure.
    type Value;
    /// Why the procedure, or one of its exchanges, failed.
    type Error;

    /// Restarts the procedure at `now_ns`.
    fn start(&mut self, now_ns: u64) -> Step<Self::Request, Self::Value, Self::Error>;

    /// Takes the outcome of an exchange, refused answers included; the line is free from `ready_ns`.
    fn receive(
        &mut self,
        outcome: Result<Self::Response, Self::Error>,
        ready_ns: u64,
    ) -> Step<Self::Request, Self::Value, Self::Error>;
}

/// Implements [`Machine`](crate::Machine) by forwarding to the inherent methods of the same names.
///
/// `servowire_core::machine!(Transaction { Frame, [u8] => Exchange, Error });`
#[macro_export]
macro_rules! machine {
    ($machine:ty { $transmission:ty, $unit:ty => $value:ty, $error:ty }) => {
        impl $crate::Machine for $machine {
            type Transmission = $transmission;
            type Unit = $unit;
            type Value = $value;
            type Error = $error;

            fn transmission(&self) -> $transmission {
                self.transmission()
            }

            fn hear(&mut self, unit: &$unit, end_ns: u64) -> $crate::Progress<$value, $error> {
                self.hear(unit, end_ns)
            }

            fn framing_error(&mut self, end_ns: u64) -> $crate::Progress<$value, $error> {
                self.framing_error(end_ns)
            }

            fn poll(&mut self, now_ns: u64) -> $crate::Progress<$value, $error> {
                self.poll(now_ns)
            }

            fn progress(&self) -> $crate::Progress<$value, $error> {
                self.progress()
            }
        }
    };
}

/// Implements [`Procedure`](crate::Procedure) by forwarding to the inherent methods of the same names.
///
/// `servowire_core::procedures!(Request => Response, Error { Reset => SingleTurn; Detection => AllData; });`
#[macro_export]
macro_rules! procedures {
    ($request:ty => $response:ty, $error:ty { $($procedure:ty => $value:ty;)+ }) => {
        $(
            impl $crate::Procedure for $procedure {
                type Request = $request;
                type Response = $response;
                type Value = $value;
                type Error = $error;

                fn start(&mut self, now_ns: u64) -> $crate::Step<$request, $value, $error> {
                    self.start(now_ns)
                }

                fn receive(
                    &mut self,
                    outcome: Result<$response, $error>,
                    ready_ns: u64,
                ) -> $crate::Step<$request, $value, $error> {
                    self.receive(outcome, ready_ns)
                }
            }
        )+
    };
}

/// Writes the inherent method `receive` of a procedure that has a field `end` and a method `next` that does the work. A
/// procedure that has ended stays ended, whatever it receives.
///
/// `servowire_core::receive! { SingleTurn }`
#[macro_export]
macro_rules! receive {
    ($(#[$more:meta])* $value:ty) => {
        /// Takes the outcome of a transaction; the line is free from `ready_ns`. A procedure that is done or has failed
        /// stays in that state until it is restarted.
        ///
        $(#[$more])*
        pub fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<$value> {
            let step = self.end.unwrap_or_else(|| self.next(outcome, ready_ns));
            self.end = step.ended();
            step
        }
    };
}

#[cfg(test)]
mod tests {
    use crate::{Machine, Procedure, Progress, Step};

    /// Every method gives back its name and what it was told.
    struct Echo;

    type Said = (&'static str, usize);

    #[expect(clippy::unused_self, reason = "the shape of a machine")]
    impl Echo {
        fn transmission(&self) -> &'static str {
            "transmission"
        }

        fn hear(&mut self, unit: &[u8], end_ns: u64) -> Progress<usize, Said> {
            Progress::Done { value: unit.len(), ready_ns: end_ns }
        }

        fn framing_error(&mut self, end_ns: u64) -> Progress<usize, Said> {
            Progress::Failed { error: ("framing_error", 0), ready_ns: end_ns }
        }

        fn poll(&mut self, now_ns: u64) -> Progress<usize, Said> {
            Progress::Failed { error: ("poll", 0), ready_ns: now_ns }
        }

        fn progress(&self) -> Progress<usize, Said> {
            Progress::Pending { until_ns: 5 }
        }

        fn start(&mut self, now_ns: u64) -> Step<&'static str, usize, Said> {
            Step::Send { request: "start", not_before_ns: now_ns }
        }

        fn receive(&mut self, outcome: Result<usize, Said>, ready_ns: u64) -> Step<&'static str, usize, Said> {
            match outcome {
                Ok(value) => Step::Done { value, ready_ns },
                Err(error) => Step::Failed { error, ready_ns },
            }
        }
    }

    machine!(Echo { &'static str, [u8] => usize, Said });
    procedures!(&'static str => usize, Said { Echo => usize; });

    #[test]
    fn a_machine_is_forwarded_with_all_that_it_is_told() {
        type Ended<M> = Progress<<M as Machine>::Value, <M as Machine>::Error>;
        fn all<M: Machine<Unit = [u8]>>(mut machine: M) -> (M::Transmission, [Ended<M>; 4]) {
            let heard = machine.hear(&[1, 2, 3], 1 << 40);
            let damaged = machine.framing_error(2 << 40);
            let asked = machine.poll(3 << 40);
            (machine.transmission(), [heard, damaged, asked, machine.progress()])
        }
        let said = [
            Progress::Done { value: 3, ready_ns: 1 << 40 },
            Progress::Failed { error: ("framing_error", 0), ready_ns: 2 << 40 },
            Progress::Failed { error: ("poll", 0), ready_ns: 3 << 40 },
            Progress::Pending { until_ns: 5 },
        ];
        assert_eq!(all(Echo), ("transmission", said));
    }

    #[test]
    fn a_procedure_is_forwarded_with_all_that_it_is_told() {
        fn all<P: Procedure>(
            mut procedure: P,
            value: P::Response,
            error: P::Error,
        ) -> [Step<P::Request, P::Value, P::Error>; 3] {
            [procedure.start(1 << 40), procedure.receive(Ok(value), 2 << 40), procedure.receive(Err(error), 3 << 40)]
        }
        let said = [
            Step::Send { request: "start", not_before_ns: 1 << 40 },
            Step::Done { value: 7, ready_ns: 2 << 40 },
            Step::Failed { error: ("x", 1), ready_ns: 3 << 40 },
        ];
        assert_eq!(all(Echo, 7, ("x", 1)), said);
    }
}
