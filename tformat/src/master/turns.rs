use super::witness::Witness;
use super::{Reset, Step};
use crate::error::Error;
use crate::message::MultiTurn;
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::Response;

/// Sets the turns to 0, clears all errors, and verifies the result: reads the turns by ID 1, sends ID C ten times,
/// waits 18 ms, and reads the turns again. **The multi-turn reference of the machine is lost**, see
/// [`Reset::clear_turns_and_lose_multi_turn_reference`].
///
/// The vendors' documents say that the effect is to be confirmed by reading, and specify no wait after ID C. This uses the only
/// storage time that any of them states, so that a count that is updated late is not mistaken for one that was not reset.
///
/// A shaft at rest on the boundary of a turn may count a turn more or less if it vibrates. `tolerance` says how many turns
/// are allowed: 1 in general, 0 if the shaft is known to rest elsewhere. A count is believed if it is read twice in a row within
/// the tolerance. The result is the count read afterwards, within the tolerance of 0. Otherwise it ends with
///
/// * [`Error::NotDone`]: the count is what it was before, or no two readings before agreed and nothing was sent;
/// * [`Error::EffectUnknown`]: the count could not be read afterwards, or it is inconclusive: it was at or near 0 before, or is
///   now neither at 0 nor what it was;
/// * the error of the exchange, if the count could not be read before: nothing was sent.
///
/// The result is judged only by the two counts, so the procedure may follow any history. ID C is sent at most ten times. A
/// procedure that is done or has failed stays in that state until it is restarted. Read ID 3 to see whether the errors are
/// gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MultiTurnZero {
    resolution: Resolution,
    tolerance: u32,
    witness: Witness,
    end: Option<Step<MultiTurn>>,
}

impl MultiTurnZero {
    /// Creates the procedure. `tolerance` is how far from 0, in turns, the count may be afterwards.
    pub const fn set_and_lose_multi_turn_reference(resolution: Resolution, tolerance: u32) -> Self {
        let reset = Reset::clear_turns_and_lose_multi_turn_reference();
        let witness = Witness::new(reset, Request::ReadMultiTurn);
        Self { resolution, tolerance, witness, end: None }
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<MultiTurn> {
        self.end = None;
        self.witness.start(now_ns)
    }

    /// Takes the outcome of a transaction; the line is free from `ready_ns`.
    pub fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<MultiTurn> {
        if let Some(end) = self.end {
            return end;
        }
        let Self { resolution, tolerance, witness, end } = self;
        let value = |response| match response {
            Response::ReadMultiTurn(multi) => Some(resolution.turns(multi.abm).map(|_| (multi, multi.abm.get()))),
            _ => None,
        };
        let near = |from, to| resolution.turns_between(from, to).unsigned_abs() <= *tolerance;
        let step = witness.receive(outcome, ready_ns, value, near);
        *end = step.ended();
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::count::{Abm, Abs};
    use crate::error::ErrorClass;
    use crate::message::SingleTurn;
    use crate::status::StatusField;

    const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });

    fn multi(abm: u32) -> MultiTurn {
        MultiTurn { sf: StatusField::empty(), abm: Abm::truncate(abm) }
    }

    /// Turns before, which of the ten responses is lost (0: none), and turns after (none: they cannot be read), with a
    /// tolerance of one turn and 16 bits of turns.
    fn run(before: u32, lost: u8, after: Option<u32>) -> (Step<MultiTurn>, u8) {
        let mut zero = MultiTurnZero::set_and_lose_multi_turn_reference(Resolution::new(17, 16).unwrap(), 1);
        let mut step = zero.start(0);
        let mut sent = 0;
        while let Step::Send { request, not_before_ns } = step {
            let outcome = match request {
                Request::ResetTurnsAndErrors => {
                    sent += 1;
                    let single = SingleTurn { sf: StatusField::empty(), abs: Abs::truncate(5) };
                    if sent == lost { LOST } else { Ok(Response::ResetTurnsAndErrors(single)) }
                }
                _ if sent == 0 => Ok(Response::ReadMultiTurn(multi(before))),
                _ => after.map_or(LOST, |after| Ok(Response::ReadMultiTurn(multi(after)))),
            };
            step = zero.receive(outcome, not_before_ns + 31_000);
        }
        (step, sent)
    }

    /// Twice 31 us, 40 us of idle line, ten times 71 us but for the last pause, 18 ms, twice 31 us.
    #[test]
    fn turns_that_read_zero_are_done() {
        let ready_ns = 62_000 + 40_000 + 670_000 + 18_000_000 + 62_000;
        assert_eq!(run(700, 0, Some(0)), (Step::Done { value: multi(0), ready_ns }, 10));
        // The last response was lost, but the count shows it.
        assert!(matches!(run(700, 10, Some(0)).0, Step::Done { .. }));
    }

    /// On the boundary of a turn the count goes to 1 or to -1, which is 0xffff in 16 bits.
    #[test]
    fn a_count_that_trembles_is_done() {
        for after in [0, 1, 0xffff] {
            assert!(matches!(run(700, 0, Some(after)).0, Step::Done { value, .. } if value == multi(after)));
        }
        // Neither 0 nor what it was: something has happened.
        for after in [2, 0xfffe] {
            assert!(matches!(run(700, 0, Some(after)).0, Step::Failed { error: Error::EffectUnknown { .. }, .. }));
        }
    }

    #[test]
    fn turns_that_stay_are_not_done() {
        for after in [700, 701, 699] {
            let (step, sent) = run(700, 10, Some(after));
            assert!(matches!(step, Step::Failed { error: Error::NotDone { sent: 10, .. }, .. }), "{step:?}");
            assert_eq!(sent, 10);
        }
        let (step, sent) = run(700, 9, Some(700));
        assert!(matches!(step, Step::Failed { error: Error::NotDone { sent: 9, .. }, .. }), "{step:?}");
        assert_eq!(sent, 9);
        // One request, and nine that somebody else had left in the encoder.
        assert!(matches!(run(700, 1, Some(0)), (Step::Done { .. }, 1)));
    }

    /// After a lost response, turns that were near 0 before say nothing, nor does another count than before.
    #[test]
    fn what_cannot_be_seen_is_unknown() {
        let because = ErrorClass::NoResponse;
        for (before, after) in [(700, None), (0, Some(0)), (1, Some(0)), (0xffff, Some(1)), (700, Some(350))] {
            let (step, sent) = run(before, 10, after);
            let unknown =
                matches!(step, Step::Failed { error: Error::EffectUnknown { because: got }, .. } if got == because);
            assert!(unknown && sent == 10, "{before} {after:?}: {step:?}");
        }
        // All ten were answered, and the turns cannot be read.
        assert!(matches!(run(700, 0, None).0, Step::Failed { error: Error::EffectUnknown { .. }, .. }));
    }

    /// Three times 31 us after the rest of the idle line: nobody is storing then, so there is nothing to wait for.
    #[test]
    fn turns_that_cannot_be_read_are_read_again_at_once() {
        let ready_ns = 62_000 + 40_000 + 670_000 + 18_000_000 + 3 * 31_000;
        let error = Error::EffectUnknown { because: ErrorClass::NoResponse };
        assert_eq!(run(700, 0, None), (Step::Failed { error, ready_ns }, 10));
    }

    #[test]
    fn an_end_is_an_end() {
        let mut zero = MultiTurnZero::set_and_lose_multi_turn_reference(Resolution::new(17, 16).unwrap(), 1);
        let _ = zero.start(0);
        let _ = zero.receive(LOST, 7);
        let _ = zero.receive(LOST, 7);
        let end = Step::Failed { error: Error::NoResponse { echo: false }, ready_ns: 7 };
        assert_eq!(zero.receive(LOST, 7), end);
        assert_eq!(zero.receive(Ok(Response::ReadMultiTurn(multi(0))), 99), end);
    }

    /// Bits above the width are no count: read again, and given up.
    #[test]
    fn a_count_that_is_too_wide_says_nothing() {
        let (step, sent) = run(0x1_0000, 0, Some(0));
        assert!(matches!(step, Step::Failed { error: Error::UpperBits { .. }, .. }), "{step:?}");
        assert_eq!(sent, 0);
    }
}
