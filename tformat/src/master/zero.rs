use super::witness::Witness;
use super::{Reset, Step};
use crate::error::Error;
use crate::message::SingleTurn;
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::Response;

/// Sets the single-turn zero and verifies the result: reads the position, sends ID 8 ten times, waits 18 ms, and reads
/// the position again. **This shifts the commutation angle of the motor**, see
/// [`Reset::set_single_turn_zero_and_shift_commutation_angle`].
///
/// The shaft must stand still. A position counts if it is read twice in a row within the tolerance. The result is the position
/// read afterwards, within the tolerance of 0. Otherwise it ends with
///
/// * [`Error::NotDone`]: the position is what it was before, or no two readings before agreed and nothing was sent;
/// * [`Error::EffectUnknown`]: the position could not be read afterwards, or it is inconclusive: it was at zero before, or is
///   now neither at zero nor where it was;
/// * the error of the exchange, if the position could not be read before: nothing was sent.
///
/// The result is judged by the two positions alone, so the procedure may follow any history: an abandoned attempt, a controller
/// that has restarted, another master. ID 8 is sent at most ten times. A procedure that is done or has failed stays in that
/// state until it is restarted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SingleTurnZero {
    resolution: Resolution,
    tolerance: u32,
    witness: Witness,
    end: Option<Step<SingleTurn>>,
}

impl SingleTurnZero {
    /// Creates the procedure. `tolerance` is how far from zero, in counts, the shaft may appear to be afterwards.
    pub const fn set_and_shift_commutation_angle(resolution: Resolution, tolerance: u32) -> Self {
        let reset = Reset::set_single_turn_zero_and_shift_commutation_angle();
        Self { resolution, tolerance, witness: Witness::new(reset, Request::ReadSingleTurn), end: None }
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<SingleTurn> {
        self.end = None;
        self.witness.start(now_ns)
    }

    /// Takes the outcome of a transaction; the line is free from `ready_ns`.
    pub fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<SingleTurn> {
        if let Some(end) = self.end {
            return end;
        }
        let Self { resolution, tolerance, witness, end } = self;
        let value = |response| match response {
            Response::ReadSingleTurn(single) => Some(resolution.single_turn(single.abs).map(|abs| (single, abs))),
            _ => None,
        };
        let near = |from, to| resolution.difference(from, to).unsigned_abs() <= *tolerance;
        let step = witness.receive(outcome, ready_ns, value, near);
        *end = step.ended();
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::count::Abs;
    use crate::error::ErrorClass;
    use crate::status::StatusField;

    const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });

    fn single(abs: u32) -> SingleTurn {
        SingleTurn { sf: StatusField::empty(), abs: Abs::truncate(abs) }
    }

    /// Position before, which of the ten responses is lost (0: none), and position after (none: it cannot be read).
    fn run(before: u32, lost: u8, after: Option<u32>) -> (Step<SingleTurn>, u8) {
        let resolution = Resolution::new(17, 16).unwrap();
        let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
        let mut step = zero.start(0);
        let mut sent = 0;
        while let Step::Send { request, not_before_ns } = step {
            let outcome = match request {
                Request::SetSingleTurnZero => {
                    sent += 1;
                    if sent == lost { LOST } else { Ok(Response::SetSingleTurnZero(single(before))) }
                }
                _ if sent == 0 => Ok(Response::ReadSingleTurn(single(before))),
                _ => after.map_or(LOST, |after| Ok(Response::ReadSingleTurn(single(after)))),
            };
            step = zero.receive(outcome, not_before_ns + 31_000);
        }
        (step, sent)
    }

    #[test]
    fn a_zero_that_shows_is_done() {
        // Twice 31 us, 40 us of idle line, ten times 71 us, 18 ms, twice 31 us.
        let ready_ns = 62_000 + 40_000 + 670_000 + 18_000_000 + 62_000;
        assert_eq!(run(5_000, 0, Some(2)), (Step::Done { value: single(2), ready_ns }, 10));
        // The other side of zero, and a shaft that was at zero already.
        assert!(matches!(run(5_000, 0, Some(131_069)).0, Step::Done { .. }));
        assert!(matches!(run(1, 0, Some(1)).0, Step::Done { .. }));
        // The last response was lost, but the zero shows.
        assert!(matches!(run(5_000, 10, Some(4)).0, Step::Done { .. }));
    }

    #[test]
    fn a_zero_that_does_not_show_is_not_done() {
        for (before, lost, after, sent) in [(5_000, 0, 5_000, 10), (5_000, 10, 5_003, 10), (5_000, 3, 5_000, 3)] {
            let (step, requests) = run(before, lost, Some(after));
            assert!(matches!(step, Step::Failed { error: Error::NotDone { sent: got, .. }, .. } if got == sent));
            assert_eq!(requests, sent);
        }
    }

    /// Nine requests were left in the encoder by somebody who did not live to see the tenth: the first one here is that, and
    /// the encoder stores in silence.
    #[test]
    fn what_an_earlier_attempt_began_is_seen() {
        assert!(matches!(run(5_000, 1, Some(0)), (Step::Done { .. }, 1)));
        let (step, sent) = run(5_000, 1, None);
        assert!(matches!(step, Step::Failed { error: Error::EffectUnknown { .. }, .. }) && sent == 1, "{step:?}");
    }

    #[test]
    fn what_cannot_be_seen_is_unknown() {
        let because = ErrorClass::NoResponse;
        for (before, after) in [(5_000, None), (1, Some(1)), (5_000, Some(9_000)), (5_000, Some(5)), (6, Some(3))] {
            let (step, requests) = run(before, 10, after);
            assert!(
                matches!(step, Step::Failed { error: Error::EffectUnknown { because: got }, .. } if got == because)
            );
            assert_eq!(requests, 10);
        }
        assert!(matches!(run(5_000, 0, None).0, Step::Failed { error: Error::EffectUnknown { .. }, .. }));
    }

    /// The check field misses two wrong bits in one column: one reading proves neither that the zero was set nor that it was not.
    #[test]
    fn a_position_is_read_twice() {
        let run = |before: &[u32], after: &[u32]| {
            let mut readings = [before, after].map(|all| all.iter().copied());
            let resolution = Resolution::new(17, 16).unwrap();
            let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
            let (mut step, mut sent) = (zero.start(0), 0);
            while let Step::Send { request, not_before_ns } = step {
                let response = if request == Request::SetSingleTurnZero {
                    sent += 1;
                    Response::SetSingleTurnZero(single(0))
                } else {
                    let Some(abs) = readings[usize::from(sent > 0)].next() else { return (Some(request), sent) };
                    Response::ReadSingleTurn(single(abs))
                };
                step = zero.receive(Ok(response), not_before_ns + 31_000);
            }
            let left: usize = readings.into_iter().map(Iterator::count).sum();
            assert_eq!(left, 0, "{step:?}");
            (None, if matches!(step, Step::Done { .. }) { 100 } else { sent })
        };
        let open = Some(Request::ReadSingleTurn);
        assert_eq!(
            [run(&[5_000], &[]), run(&[5_000, 5_003], &[0]), run(&[5_000, 5_000], &[5_000])],
            [(open, 0), (open, 10), (open, 10)]
        );
        assert_eq!(run(&[5_000, 5_000], &[5_000, 3, 2]), (None, 100));
        assert_eq!(run(&[5_000, 5_000], &[0, 5_000, 5_004]), (None, 10));
        assert_eq!(run(&[9_000, 5_000, 5_000], &[0, 0]), (None, 100));
        // A shaft that turns: nothing is sent.
        assert_eq!(run(&[1_000, 2_000, 3_000, 4_000], &[]), (None, 0));
    }

    /// Readings that contradict each other: before nothing was sent, and afterwards nobody knows.
    #[test]
    fn readings_that_contradict_each_other_end_it() {
        let turning = |sent_before: bool| {
            let resolution = Resolution::new(17, 16).unwrap();
            let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
            let (mut step, mut abs, mut sent) = (zero.start(0), 50_000, 0);
            while let Step::Send { request, not_before_ns } = step {
                let outcome = if request == Request::SetSingleTurnZero {
                    sent += 1;
                    Response::SetSingleTurnZero(single(0))
                } else {
                    abs += if sent > 0 || !sent_before { 1_000 } else { 0 };
                    Response::ReadSingleTurn(single(abs))
                };
                step = zero.receive(Ok(outcome), not_before_ns);
            }
            step
        };
        let because = ErrorClass::DataMismatch;
        let Step::Failed { error, .. } = turning(false) else { panic!("it turns") };
        assert_eq!(error, Error::NotDone { sent: 0, because });
        let Step::Failed { error, .. } = turning(true) else { panic!("it turns") };
        assert_eq!(error, Error::EffectUnknown { because });
    }

    #[test]
    fn without_a_position_before_nothing_is_sent() {
        let mut zero = SingleTurnZero::set_and_shift_commutation_angle(Resolution::new(17, 16).unwrap(), 4);
        let _ = zero.start(0);
        // An encoder that stores is silent for 18 ms.
        let again = Step::Send { request: Request::ReadSingleTurn, not_before_ns: 18_000_007 };
        for _ in 0..2 {
            assert_eq!(zero.receive(LOST, 7), again);
        }
        assert_eq!(zero.receive(LOST, 7), Step::Failed { error: Error::NoResponse { echo: false }, ready_ns: 7 });
    }
}
