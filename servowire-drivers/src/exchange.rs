//! What every driver does while an exchange goes on, and between two exchanges of a procedure.

use core::ops::ControlFlow;

use servowire_core::{ClockError, Ended, Progress};

use crate::quiet::Line;
use crate::{Clock, Error};

/// Up to when to wait for more of the answer, or how the exchange has ended; then it is known from when on the line is free.
pub(crate) fn next<T, E>(
    progress: Progress<T, E>,
    line: &mut Line,
    clock: &mut impl Clock,
) -> Result<ControlFlow<Result<T, E>, u64>, ClockError> {
    match progress {
        Progress::Pending { until_ns } => Ok(ControlFlow::Continue(until_ns)),
        Progress::Done { value, ready_ns } => {
            line.clean(ready_ns);
            Ok(ControlFlow::Break(Ok(value)))
        }
        Progress::Failed { error, ready_ns } => {
            let now_ns = line.now_ns(clock)?;
            line.failed(ready_ns, now_ns);
            Ok(ControlFlow::Break(Err(error)))
        }
    }
}

/// An exchange as a procedure hears of it: a fault of the port is a lost answer, and what that means is for the procedure to
/// say. Everything else that is not of the protocol ends the procedure.
pub(crate) fn ended<T, IO, PIN, P, D>(
    exchanged: Result<T, Error<IO, PIN, P, D>>,
    lost: P,
    line: &mut Line,
    clock: &mut impl Clock,
) -> Result<Ended<T, P>, Error<IO, PIN, P, D>> {
    let outcome = match exchanged {
        Ok(value) => Ok(value),
        Err(Error::Protocol(error)) => Err(error),
        Err(Error::Io(_) | Error::DriverLate { .. }) => Err(lost),
        Err(other) => return Err(other),
    };
    let now_ns = line.now_ns(clock)?;
    Ok(Ended { outcome, ready_ns: line.free_ns(now_ns) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quiet::Settle;

    type Fault = Error<u8, u8, u8, u8>;

    /// A line on which a request of 10 us left at 10 us, and how an exchange goes on at 20 us.
    fn after(progress: Progress<u8, u8>) -> (ControlFlow<Result<u8, u8>, u64>, Line) {
        let mut line = Line::new(8_000);
        line.begin(90_000);
        line.sent(10_000);
        (next(progress, &mut line, &mut || 20_000).unwrap(), line)
    }

    #[test]
    fn a_good_answer_frees_the_line_and_a_refused_one_does_not() {
        let (flow, mut line) = after(Progress::Pending { until_ns: 70_000 });
        assert_eq!(flow, ControlFlow::Continue(70_000));
        assert_eq!(line.settle(30_000).next(false, 30_000), Settle::Until(100_000));
        let (flow, mut line) = after(Progress::Done { value: 2, ready_ns: 25_000 });
        assert_eq!(flow, ControlFlow::Break(Ok(2)));
        assert_eq!(line.settle(24_999).next(false, 24_999), Settle::Until(25_000));
        assert_eq!(line.settle(25_000).next(false, 25_000), Settle::Quiet);
        let (flow, mut line) = after(Progress::Failed { error: 3, ready_ns: 25_000 });
        assert_eq!(flow, ControlFlow::Break(Err(3)));
        assert_eq!(line.settle(30_000).next(false, 99_999), Settle::Until(100_000));
    }

    #[test]
    fn only_faults_of_the_answer_are_for_the_procedure() {
        let heard = |exchanged| ended(exchanged, 9, &mut Line::new(8_000), &mut || 5_000);
        assert_eq!(heard(Ok(1)), Ok(Ended { outcome: Ok(1), ready_ns: 5_000 }));
        assert_eq!(heard(Err(Fault::Protocol(4))), Ok(Ended { outcome: Err(4), ready_ns: 5_000 }));
        for fault in [Fault::Io(4), Fault::DriverLate { by_ns: 4 }] {
            assert_eq!(heard(Err(fault)), Ok(Ended { outcome: Err(9), ready_ns: 5_000 }));
        }
        for other in
            [Fault::Pin(1), Fault::Closed, Fault::NeverQuiet, Fault::Clock(ClockError::Stopped), Fault::Doubt(1)]
        {
            assert_eq!(heard(Err(other)), Err(other));
        }
    }

    /// What was lost may still be answered.
    #[test]
    fn a_procedure_hears_when_the_line_is_free() {
        let mut line = Line::new(8_000);
        line.begin(90_000);
        let ended = ended::<u8, _, _, _, _>(Err(Fault::Io(4)), 9, &mut line, &mut || 5_000);
        assert_eq!(ended, Ok(Ended { outcome: Err(9), ready_ns: 95_000 }));
    }
}
