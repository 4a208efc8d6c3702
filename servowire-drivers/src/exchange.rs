//! The steps that every driver takes between two exchanges of a procedure.

use servowire_core::Ended;

use crate::quiet::Line;
use crate::{Clock, Error};

/// Converts the result of an exchange to the outcome that a procedure receives: a fault of the port counts as a lost answer,
/// and the procedure decides what that means. Any other error outside the protocol ends the procedure.
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
    use servowire_core::ClockError;

    type Fault = Error<u8, u8, u8, u8>;

    #[test]
    fn only_faults_of_the_answer_are_for_the_procedure() {
        let heard = |exchanged| {
            let mut line = Line::new(8_000, 0);
            line.clean(0);
            ended(exchanged, 9, &mut line, &mut || 5_000)
        };
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
        let mut line = Line::new(8_000, 0);
        line.begin(90_000);
        let ended = ended::<u8, _, _, _, _>(Err(Fault::Io(4)), 9, &mut line, &mut || 5_000);
        assert_eq!(ended, Ok(Ended { outcome: Err(9), ready_ns: 95_000 }));
    }
}
