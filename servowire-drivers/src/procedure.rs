//! Procedures of several exchanges: what every driver does between two of them.

use core::ops::ControlFlow;

use servowire_core::Step;

use crate::Error;
use crate::quiet::Line;

/// The request that is next and its time, or how the procedure has ended; then the line is free from its `ready_ns` on, and not before
/// that of the last exchange.
pub(crate) fn next<R, T, E>(step: Step<R, T, E>, line: &mut Line) -> ControlFlow<Result<T, E>, (R, u64)> {
    match step {
        Step::Send { request, not_before_ns } => ControlFlow::Continue((request, not_before_ns)),
        Step::Done { value, ready_ns } => {
            line.keep(ready_ns);
            ControlFlow::Break(Ok(value))
        }
        Step::Failed { error, ready_ns } => {
            line.keep(ready_ns);
            ControlFlow::Break(Err(error))
        }
    }
}

/// The outcome of an exchange as a procedure hears it: a fault of the UART is a lost answer, and what that means is for the
/// procedure to say. Everything else that is not of the protocol ends the procedure.
pub(crate) fn outcome<T, IO, PIN, P, D>(
    exchanged: Result<T, Error<IO, PIN, P, D>>,
    lost: P,
) -> Result<Result<T, P>, Error<IO, PIN, P, D>> {
    match exchanged {
        Ok(value) => Ok(Ok(value)),
        Err(Error::Protocol(error)) => Ok(Err(error)),
        Err(Error::Io(_)) => Ok(Err(lost)),
        Err(other) => Err(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quiet::Settle;
    use servowire_core::ClockError;

    #[test]
    fn an_end_says_when_the_line_is_free() {
        let mut line = Line::new(8_000);
        let step: Step<u8, u8, u8> = Step::Send { request: 1, not_before_ns: 7 };
        assert_eq!(next(step, &mut line), ControlFlow::Continue((1, 7)));
        let step: Step<u8, u8, u8> = Step::Done { value: 2, ready_ns: 90 };
        assert_eq!(next(step, &mut line), ControlFlow::Break(Ok(2)));
        assert_eq!(line.settle(89).poll(89), Settle::Until(90));
        let step: Step<u8, u8, u8> = Step::Failed { error: 3, ready_ns: 120 };
        assert_eq!(next(step, &mut line), ControlFlow::Break(Err(3)));
        assert_eq!(line.settle(119).poll(119), Settle::Until(120));
        assert_eq!(line.settle(120).poll(120), Settle::Quiet);
    }

    /// A procedure that had ended before, or never sent anything, does not know of the exchange before it.
    #[test]
    fn an_end_frees_no_line_that_somebody_else_may_be_using() {
        for step in [Step::Done { value: 2, ready_ns: 0 }, Step::Failed { error: 3, ready_ns: 50 }] {
            let step: Step<u8, u8, u8> = step;
            let mut line = Line::new(8_000);
            line.begin(90_000);
            line.sent(10_000);
            assert!(next(step, &mut line).is_break());
            assert_eq!(line.settle(60_000).poll(99_999), Settle::Until(100_000));
        }
    }

    #[test]
    fn only_faults_of_the_answer_are_for_the_procedure() {
        type Fault = Error<u8, u8, u8, u8>;
        assert_eq!(outcome::<_, u8, u8, u8, u8>(Ok(1), 9), Ok(Ok(1)));
        assert_eq!(outcome::<u8, u8, u8, u8, u8>(Err(Fault::Protocol(4)), 9), Ok(Err(4)));
        assert_eq!(outcome::<u8, u8, u8, u8, u8>(Err(Fault::Io(4)), 9), Ok(Err(9)));
        for other in
            [Fault::Pin(1), Fault::Closed, Fault::NeverQuiet, Fault::Clock(ClockError::Stopped), Fault::Doubt(1)]
        {
            assert_eq!(outcome::<u8, u8, u8, u8, u8>(Err(other), 9), Err(other));
        }
    }
}
