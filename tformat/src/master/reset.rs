use super::Step;
use crate::data_id::DataId;
use crate::error::Error;
use crate::message::SingleTurn;
use crate::request::Request;
use crate::response::Response;
use crate::status::StatusField;

/// Runs a reset: sends the same one-field request ten times, at least 40 us apart, with no other request in between.
///
/// The documents state the number and the spacing. They do not say whether the spacing counts from start to start or from the
/// end of the response; this procedure uses the longer one, 40 us of idle line after every response. Nor do they say whether
/// another request or a damaged one restarts the count.
///
/// The ten requests are one operation. Clearing errors twice (ID 7) does no harm: a refused response restarts the count, and the
/// third one ends the reset. ID 8 and ID C are **never sent again by themselves**: a refused or lost response ends them with
/// [`Error::EffectUnknown`], because the encoder counts requests no matter who sent them and when. Nine requests from an
/// abandoned attempt plus one more make ten.
///
/// A response whose CA0 or CA1 says that the request was damaged counts as refused: the encoder has not counted the request.
///
/// Confirm the effect by reading ID 3 afterwards; [`SingleTurnZero`](super::SingleTurnZero) does it for ID 8 and
/// [`MultiTurnZero`](super::MultiTurnZero) for ID C, whatever happened before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reset {
    request: Request,
    answered: u8,
    refused: u8,
    end: Option<Step<SingleTurn>>,
}

impl Reset {
    /// The number of requests in a sequence.
    pub const REQUESTS: u8 = 10;
    /// Idle line between the end of a response and the next request.
    pub const SPACING_NS: u32 = 40_000;
    /// Wait after the last response to ID 8, while the encoder stores the offset.
    pub const ZERO_WAIT_NS: u32 = 18_000_000;
    /// Number of refused responses after which clearing the errors ends.
    pub const MAX_REFUSED: u8 = 3;

    /// Clears all latched errors (ID 7). Position and turns are unchanged.
    pub const fn clear_errors() -> Self {
        Self::of(Request::ResetErrors)
    }

    /// Sets the turns to 0 and clears all errors (ID C). **The multi-turn reference of the machine is lost.**
    pub const fn clear_turns_and_lose_multi_turn_reference() -> Self {
        Self::of(Request::ResetTurnsAndErrors)
    }

    /// Makes the present position the zero of the turn (ID 8). **This shifts the commutation angle of the motor.**
    ///
    /// A drive that uses the encoder for commutation will then drive the current into the wrong phases; drive manuals
    /// forbid it on a motor in service. It is meant for encoders that are being fitted.
    pub const fn set_single_turn_zero_and_shift_commutation_angle() -> Self {
        Self::of(Request::SetSingleTurnZero)
    }

    const fn of(request: Request) -> Self {
        Self { request, answered: 0, refused: 0, end: None }
    }

    /// The data ID that is sent.
    pub const fn data_id(&self) -> DataId {
        self.request.data_id()
    }

    /// Number of valid responses in a row so far.
    pub const fn answered(&self) -> u8 {
        self.answered
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<SingleTurn> {
        self.answered = 0;
        self.refused = 0;
        self.end = None;
        self.send(now_ns)
    }

    servowire_core::receive! { SingleTurn }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<SingleTurn> {
        let spaced_ns = ready_ns.saturating_add(Self::SPACING_NS.into());
        let value = match (outcome, self.request) {
            (Ok(Response::ResetErrors(value)), Request::ResetErrors)
            | (Ok(Response::SetSingleTurnZero(value)), Request::SetSingleTurnZero)
            | (Ok(Response::ResetTurnsAndErrors(value)), Request::ResetTurnsAndErrors) => value,
            (Ok(other), request) => return self.refuse(mismatch(other, request), ready_ns),
            (Err(error), _) => return self.refuse(error, ready_ns),
        };
        if value.sf.intersects(StatusField::REQUEST_DAMAGED) {
            return self.refuse(Error::Rejected { sf: value.sf }, ready_ns);
        }
        self.answered = self.answered.saturating_add(1);
        if self.answered < Self::REQUESTS {
            return self.send(spaced_ns);
        }
        Step::Done { value, ready_ns: ready_ns.saturating_add(self.wait_ns()) }
    }

    const fn send(&self, not_before_ns: u64) -> Step<SingleTurn> {
        Step::Send { request: self.request, not_before_ns }
    }

    const fn wait_ns(self) -> u64 {
        match self.request {
            Request::SetSingleTurnZero => Self::ZERO_WAIT_NS as u64,
            _ => 0,
        }
    }

    fn refuse(&mut self, error: Error, ready_ns: u64) -> Step<SingleTurn> {
        let spaced_ns = ready_ns.saturating_add(Self::SPACING_NS.into());
        self.answered = 0;
        self.refused = self.refused.saturating_add(1);
        if self.request == Request::ResetErrors {
            if self.refused < Self::MAX_REFUSED {
                return self.send(spaced_ns);
            }
            return Step::Failed { error, ready_ns: spaced_ns };
        }
        let stored_ns = spaced_ns.max(ready_ns.saturating_add(self.wait_ns()));
        Step::Failed { error: Error::EffectUnknown { because: error.class() }, ready_ns: stored_ns }
    }
}

/// Returns the error for a response of another kind: the caller passed in the outcome of another request.
pub(super) fn mismatch(response: Response, request: Request) -> Error {
    let (got, want) = (response.data_id().control_field().get(), request.data_id().control_field().get());
    Error::CfMismatch { got, want }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::count::Abs;
    use std::vec::Vec;

    const SINGLE: SingleTurn = SingleTurn { sf: StatusField::from_bits_retain(0), abs: Abs::MAX };
    const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });

    /// Ten requests (three drivers), 40 us (one driver's comment) after a response that ends 31 us after its request
    /// began; 18 ms after ID 8.
    #[test]
    fn ten_requests_40_us_after_each_response() {
        for (mut reset, response, wait) in [
            (Reset::clear_errors(), Response::ResetErrors(SINGLE), 0),
            (
                Reset::set_single_turn_zero_and_shift_commutation_angle(),
                Response::SetSingleTurnZero(SINGLE),
                18_000_000,
            ),
            (Reset::clear_turns_and_lose_multi_turn_reference(), Response::ResetTurnsAndErrors(SINGLE), 0),
        ] {
            let mut step = reset.start(0);
            let mut starts = Vec::new();
            while let Step::Send { request, not_before_ns } = step {
                assert_eq!(request.data_id(), response.data_id());
                starts.push(not_before_ns / 1000);
                step = reset.receive(Ok(response), not_before_ns + 31_000);
            }
            assert_eq!(starts, [0, 71, 142, 213, 284, 355, 426, 497, 568, 639]);
            assert_eq!(step, Step::Done { value: SINGLE, ready_ns: 670_000 + wait });
        }
    }

    #[test]
    fn clearing_errors_counts_again_after_a_refused_response_and_ends_with_the_third() {
        let mut reset = Reset::clear_errors();
        let _ = reset.start(0);
        for _ in 0..9 {
            let _ = reset.receive(Ok(Response::ResetErrors(SINGLE)), 0);
        }
        let again = Step::Send { request: Request::ResetErrors, not_before_ns: 40_000 };
        assert_eq!((reset.receive(LOST, 0), reset.answered()), (again, 0));
        assert_eq!(reset.receive(Ok(Response::ReadSingleTurn(SINGLE)), 0), again);
        let end = reset.receive(Err(Error::Crc { got: 0, want: 1 }), 5);
        assert_eq!(end, Step::Failed { error: Error::Crc { got: 0, want: 1 }, ready_ns: 40_005 });
    }

    /// Each reset takes responses to its own ID and to no other.
    #[test]
    fn responses_to_other_resets_are_refused() {
        let responses =
            [Response::ResetErrors(SINGLE), Response::SetSingleTurnZero(SINGLE), Response::ResetTurnsAndErrors(SINGLE)];
        for (own, request) in
            [Request::ResetErrors, Request::SetSingleTurnZero, Request::ResetTurnsAndErrors].into_iter().enumerate()
        {
            for (k, response) in responses.into_iter().enumerate() {
                let mut reset = Reset::of(request);
                let _ = reset.start(0);
                let _ = reset.receive(Ok(response), 0);
                assert_eq!(reset.answered(), u8::from(k == own));
            }
        }
    }

    /// One lost response ends ID 8 and ID C, the first one too: what the encoder had counted before is not known.
    #[test]
    fn what_cannot_be_undone_is_not_sent_again() {
        for lost in 1..=10 {
            for (mut reset, response, wait) in [
                (
                    Reset::set_single_turn_zero_and_shift_commutation_angle(),
                    Response::SetSingleTurnZero(SINGLE),
                    18_000_000,
                ),
                (Reset::clear_turns_and_lose_multi_turn_reference(), Response::ResetTurnsAndErrors(SINGLE), 40_000),
            ] {
                let _ = reset.start(0);
                for _ in 1..lost {
                    let _ = reset.receive(Ok(response), 0);
                }
                let because = crate::ErrorClass::NoResponse;
                let want = Step::Failed { error: Error::EffectUnknown { because }, ready_ns: wait };
                assert_eq!(reset.receive(LOST, 0), want);
            }
        }
    }

    /// Three refused responses end clearing errors, each time that it is started.
    #[test]
    fn each_start_counts_its_own_refusals() {
        let mut reset = Reset::clear_errors();
        for _ in 0..2 {
            let _ = reset.start(0);
            for _ in 0..2 {
                assert!(matches!(reset.receive(LOST, 0), Step::Send { .. }));
            }
            assert!(matches!(reset.receive(LOST, 0), Step::Failed { .. }));
        }
    }

    /// A refusal is no evidence: it may answer noise on the line, and the tenth request was taken all the same.
    #[test]
    fn a_refusal_of_the_tenth_request_is_no_evidence() {
        let mut reset = Reset::set_single_turn_zero_and_shift_commutation_angle();
        let _ = reset.start(0);
        for _ in 1..10 {
            let _ = reset.receive(Ok(Response::SetSingleTurnZero(SINGLE)), 0);
        }
        let end = reset.receive(Err(Error::Rejected { sf: StatusField::CA0 }), 0);
        assert!(matches!(end, Step::Failed { error: Error::EffectUnknown { .. }, .. }), "{end:?}");
    }
}
