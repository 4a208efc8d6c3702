use super::Step;
use crate::data_id::DataId;
use crate::error::Error;
use crate::message::SingleTurn;
use crate::request::Request;
use crate::response::Response;

/// A reset: the same one-field request ten times, at least 40 us apart, with no other request in between.
///
/// The documents give the number and the spacing. Whether the spacing counts from start to start or from the end of
/// the answer is not said; this takes the longer one, 40 us of idle line after every answer. Whether another request
/// starts the count again is not said either, so a refused answer starts it again here; three of them end the
/// procedure.
///
/// Confirm the effect by reading ID 3 afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reset {
    request: Request,
    answered: u8,
    refused: u8,
}

impl Reset {
    /// Requests in a sequence.
    pub const REQUESTS: u8 = 10;
    /// Idle line between the end of an answer and the next request.
    pub const SPACING_NS: u32 = 40_000;
    /// Wait after the last answer to ID 8, while the encoder stores the offset.
    pub const ZERO_WAIT_NS: u32 = 18_000_000;
    /// Refused answers that end the procedure.
    pub const MAX_REFUSED: u8 = 3;

    /// ID 7: clears all latched errors. Position and turns stay.
    pub const fn clear_errors() -> Self {
        Self::of(Request::ResetErrors)
    }

    /// ID C: sets the turns to 0 and clears all errors. **The multi-turn reference of the machine is lost.**
    pub const fn clear_turns_and_errors() -> Self {
        Self::of(Request::ResetTurnsAndErrors)
    }

    /// ID 8: makes the present position the zero of the turn. **This shifts the commutation angle of the motor.**
    ///
    /// A drive that uses the encoder for commutation will then drive the current into the wrong phases; drive manuals
    /// forbid it on a motor in service. It is for encoders that are being fitted.
    pub const fn set_single_turn_zero_and_shift_commutation_angle() -> Self {
        Self::of(Request::SetSingleTurnZero)
    }

    const fn of(request: Request) -> Self {
        Self { request, answered: 0, refused: 0 }
    }

    /// The data ID that is sent.
    pub const fn data_id(&self) -> DataId {
        self.request.data_id()
    }

    /// Sound answers in a row so far.
    pub const fn answered(&self) -> u8 {
        self.answered
    }

    /// The first request, at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<SingleTurn> {
        self.answered = 0;
        self.refused = 0;
        Step::Send { request: self.request, not_before_ns: now_ns }
    }

    /// A transaction ended at `now_ns` with this outcome.
    pub fn receive(&mut self, outcome: Result<Response, Error>, now_ns: u64) -> Step<SingleTurn> {
        let not_before_ns = now_ns.saturating_add(Self::SPACING_NS.into());
        match outcome {
            Ok(
                Response::ResetErrors(value)
                | Response::SetSingleTurnZero(value)
                | Response::ResetTurnsAndErrors(value),
            ) => {
                self.answered = self.answered.saturating_add(1);
                if self.answered >= Self::REQUESTS {
                    let wait = if self.request.data_id() == DataId::SetSingleTurnZero { Self::ZERO_WAIT_NS } else { 0 };
                    return Step::Done { value, ready_ns: now_ns.saturating_add(wait.into()) };
                }
            }
            Ok(other) => return self.refuse(mismatch(other, self.request), not_before_ns),
            Err(error) => return self.refuse(error, not_before_ns),
        }
        Step::Send { request: self.request, not_before_ns }
    }

    fn refuse(&mut self, error: Error, not_before_ns: u64) -> Step<SingleTurn> {
        self.answered = 0;
        self.refused = self.refused.saturating_add(1);
        if self.refused >= Self::MAX_REFUSED {
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request: self.request, not_before_ns }
    }
}

/// What an answer of another kind means: the caller handed in the outcome of another request.
pub(super) fn mismatch(response: Response, request: Request) -> Error {
    let (got, want) = (response.data_id().control_field().get(), request.data_id().control_field().get());
    Error::CfMismatch { got, want }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::StatusField;
    use crate::timing::BitRate;
    use servowire_core::U24;
    use std::vec::Vec;

    const SINGLE: SingleTurn = SingleTurn { sf: StatusField::from_bits_retain(0), abs: U24::MAX };

    #[test]
    fn ten_requests_40_us_after_each_answer() {
        for (mut reset, response, wait) in [
            (Reset::clear_errors(), Response::ResetErrors(SINGLE), 0),
            (
                Reset::set_single_turn_zero_and_shift_commutation_angle(),
                Response::SetSingleTurnZero(SINGLE),
                18_000_000,
            ),
            (Reset::clear_turns_and_errors(), Response::ResetTurnsAndErrors(SINGLE), 0),
        ] {
            let transaction = u64::from(BitRate::Mbit2_5.transaction_ns(reset.data_id()));
            let mut step = reset.start(0);
            let mut starts = Vec::new();
            while let Step::Send { request, not_before_ns } = step {
                assert_eq!(request.data_id(), response.data_id());
                starts.push(not_before_ns / 1000);
                step = reset.receive(Ok(response), not_before_ns + transaction);
            }
            assert_eq!(starts, [0, 71, 142, 213, 284, 355, 426, 497, 568, 639]);
            assert_eq!(step, Step::Done { value: SINGLE, ready_ns: 670_000 + wait });
        }
    }

    #[test]
    fn a_refused_answer_starts_the_count_again_and_the_third_ends_it() {
        let mut reset = Reset::clear_errors();
        let _ = reset.start(0);
        for _ in 0..9 {
            let _ = reset.receive(Ok(Response::ResetErrors(SINGLE)), 0);
        }
        let _ = reset.receive(Err(Error::NoResponse { echo: false }), 0);
        assert_eq!(reset.answered(), 0);
        let _ = reset.receive(Ok(Response::ReadSingleTurn(SINGLE)), 0);
        let end = reset.receive(Err(Error::Crc { got: 0, want: 1 }), 5);
        assert_eq!(end, Step::Failed { error: Error::Crc { got: 0, want: 1 }, ready_ns: 40_005 });
    }
}
