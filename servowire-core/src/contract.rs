//! What code that is generic over protocols may rely on. Whoever uses one crate calls its inherent methods, which have the
//! same names; these traits only forward.

use crate::{Progress, Step};

/// One exchange with the other end: what is sent, what is received as the answer, and how it ends.
///
/// A machine does no I/O and reads no clock. It is told what arrived and when that ended, and asked what became of it.
pub trait Machine {
    /// What leaves, and when.
    type Transmission;
    /// What is heard: bytes of a UART, frames of a line.
    type Unit: ?Sized;
    /// What the exchange is made for.
    type Value;
    /// Why it fails.
    type Error;

    /// What is to be sent.
    fn transmission(&self) -> Self::Transmission;

    /// These units were heard one after the other; the last bit of the last one ended at `end_ns`.
    fn hear(&mut self, unit: &Self::Unit, end_ns: u64) -> Progress<Self::Value, Self::Error>;

    /// A unit that ended at `end_ns` was damaged in its framing.
    fn framing_error(&mut self, end_ns: u64) -> Progress<Self::Value, Self::Error>;

    /// Ends the exchange if its time is over at `now_ns`. Hand over what was heard first.
    fn poll(&mut self, now_ns: u64) -> Progress<Self::Value, Self::Error>;

    /// Where the exchange stands.
    fn progress(&self) -> Progress<Self::Value, Self::Error>;
}

/// Something that takes several exchanges: a reset, access to a memory, the search for an encoder.
pub trait Procedure {
    /// A message to the other end.
    type Request;
    /// A message back.
    type Response;
    /// What the procedure is made for.
    type Value;
    /// Why it, or one of its exchanges, fails.
    type Error;

    /// Begins anew at `now_ns`.
    fn start(&mut self, now_ns: u64) -> Step<Self::Request, Self::Value, Self::Error>;

    /// An exchange ended with this outcome, refused answers included; the line is free from `ready_ns` on.
    fn receive(
        &mut self,
        outcome: Result<Self::Response, Self::Error>,
        ready_ns: u64,
    ) -> Step<Self::Request, Self::Value, Self::Error>;
}

/// Implements [`Machine`](crate::Machine) by the inherent methods of the same names.
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

/// Implements [`Procedure`](crate::Procedure) by the inherent methods of the same names.
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

/// The inherent method `receive` of a procedure with a field `end` and a method `next` that does the work: once it has ended, it
/// stays ended, whatever it is fed.
///
/// `servowire_core::receive! { SingleTurn }`
#[macro_export]
macro_rules! receive {
    ($(#[$more:meta])* $value:ty) => {
        /// A transaction ended with this outcome; the line is free from `ready_ns` on. Once done or failed it stays so, until it
        /// is started again.
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
