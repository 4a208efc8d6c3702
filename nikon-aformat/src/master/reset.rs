use super::Step;
use super::eeprom::{WRITE_POLLING, is_busy, status_of};
use crate::command::Command;
use crate::error::Error;
use crate::number::EncoderAddress;
use crate::operation::Operation;
use crate::request::Request;
use crate::response::Response;
use crate::status::Alm;
use crate::timing::{REQUEST_GAP_NS, WRITE_BUSY_NS};

/// Runs a reset: sends the same request eight times in succession, waits 30 ms, then reads the status.
///
/// Every response has to be good: if one is missing or refused, the encoder may not have received the request, and the count
/// would restart. The reset is not repeated on its own; [`start`](Self::start) begins again with the first request.
///
/// The encoder counts requests, not procedures: seven from an interrupted reset and one more make eight. So a failure never
/// proves that nothing was done. Use [`GuardedReset`](super::GuardedReset), which restarts the count before it begins.
///
/// Release 9.2 of the AM243x Motor Control SDK sends the command a ninth time, which later releases call a defect. The effect
/// shows in the response to the next request, here STATUS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reset {
    request: Request,
    done: u8,
    tries: u16,
    end: Option<Step<Response>>,
}

impl Reset {
    /// The number of requests in a sequence.
    pub const REQUESTS: u8 = 8;

    /// Clears the alarms of one encoder (command 8).
    pub const fn clear_status(ea: EncoderAddress) -> Self {
        Self::of(ea, Operation::ClearStatus)
    }

    /// Sets the turns to 0 (command 9). **The multi-turn reference of the machine is lost.**
    pub const fn clear_multiturn(ea: EncoderAddress) -> Self {
        Self::of(ea, Operation::ClearMultiturn)
    }

    /// Clears alarms and turns (command 10). **The multi-turn reference of the machine is lost.**
    pub const fn clear_status_and_multiturn(ea: EncoderAddress) -> Self {
        Self::of(ea, Operation::ClearStatusMultiturn)
    }

    /// Assigns the address `new` to the only encoder on the line (command 11).
    ///
    /// EA carries the new address, because there is no other field for it; no document says so.
    pub const fn set_address_of_the_only_encoder(new: EncoderAddress) -> Self {
        Self::of(new, Operation::SetAddress1)
    }

    /// Makes the present position the single-turn zero (command 12). **This shifts the commutation angle of the motor.**
    pub const fn set_single_turn_zero_and_shift_commutation_angle(ea: EncoderAddress) -> Self {
        Self::of(ea, Operation::ZeroPreset)
    }

    const fn of(ea: EncoderAddress, operation: Operation) -> Self {
        Self { request: Request::new(ea, operation), done: 0, tries: 0, end: None }
    }

    /// The request that is sent eight times.
    pub const fn request(&self) -> Request {
        self.request
    }

    /// The command that is sent.
    pub const fn command(&self) -> Command {
        self.request.command()
    }

    /// Good responses in succession so far, 0..=8.
    pub const fn done(&self) -> u8 {
        self.done
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<Response> {
        self.done = 0;
        self.tries = 0;
        self.end = None;
        Step::Send { request: self.request, not_before_ns: now_ns }
    }

    servowire_core::receive! {
        /// The value is the response to STATUS.
        ///
        /// Fails with [`Error::Interrupted`] if one of the first seven responses does not come, and with
        /// [`Error::EffectUnknown`] if the eighth or the status does not: the encoder may have done it, and be busy for 30 ms.
        /// It also fails with the latter if MEMERR is set in the status after commands 11 and 12, whose effect is kept in the
        /// EEPROM.
        Response
    }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<Response> {
        let soon_ns = ready_ns.saturating_add(REQUEST_GAP_NS.into());
        if self.done >= Self::REQUESTS {
            return self.status(outcome, ready_ns);
        }
        if !outcome.is_ok_and(|response| self.is_answer(response)) {
            let error = match core::mem::take(&mut self.done) {
                7.. => Error::EffectUnknown,
                done => Error::Interrupted { done },
            };
            return Step::Failed { error, ready_ns: ready_ns.saturating_add(WRITE_BUSY_NS.into()) };
        }
        self.done = self.done.saturating_add(1);
        if self.done < Self::REQUESTS {
            return Step::Send { request: self.request, not_before_ns: soon_ns };
        }
        self.ask_status(ready_ns.saturating_add(WRITE_BUSY_NS.into()))
    }

    /// Returns whether the effect is kept in the EEPROM.
    pub(super) const fn is_stored(&self) -> bool {
        matches!(self.request.operation, Operation::SetAddress1 | Operation::ZeroPreset)
    }

    /// Returns whether this is the response to the reset. The response to command 11 may show the old or the new address.
    fn is_answer(&self, response: Response) -> bool {
        response.command() == Some(self.request.command())
            && (response.ea == self.request.ea || !self.request.command().answers_with_own_address())
    }

    const fn ask_status(&self, not_before_ns: u64) -> Step<Response> {
        Step::Send { request: Request::new(self.request.ea, Operation::Status), not_before_ns }
    }

    fn status(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<Response> {
        self.tries = self.tries.saturating_add(1);
        match status_of(self.request.ea, outcome) {
            Ok((value, _)) if is_busy(value) => {}
            Ok((_, alm)) if self.is_stored() && alm.contains(Alm::MEMERR) => {
                return Step::Failed { error: Error::EffectUnknown, ready_ns };
            }
            Ok((value, _)) => return Step::Done { value, ready_ns },
            Err(_) => {}
        }
        let not_before_ns = ready_ns.saturating_add(WRITE_POLLING.interval_ns.into());
        if self.tries >= WRITE_POLLING.max_tries {
            return Step::Failed { error: Error::EffectUnknown, ready_ns: not_before_ns };
        }
        self.ask_status(not_before_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Data;
    use crate::status::{EncoderStatus, PmAlm};

    const EA: EncoderAddress = EncoderAddress::MAX;

    fn status(command: Command, es: u8) -> Response {
        let data = Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() };
        Response::new(EA, command, EncoderStatus::from_bits_truncate(es), data)
    }

    #[test]
    fn eight_requests_then_the_status() {
        for mut reset in [
            Reset::clear_status(EA),
            Reset::clear_multiturn(EA),
            Reset::clear_status_and_multiturn(EA),
            Reset::set_address_of_the_only_encoder(EA),
            Reset::set_single_turn_zero_and_shift_commutation_angle(EA),
        ] {
            let command = reset.command();
            let mut step = reset.start(0);
            for k in 1..=8 {
                let Step::Send { request, not_before_ns } = step else { panic!("{step:?}") };
                assert_eq!((request.command(), request.ea), (command, EA));
                assert!(command.is_reset());
                step = reset.receive(Ok(status(command, 2)), not_before_ns);
                assert_eq!(reset.done(), k);
            }
            // 8 requests 10 us apart, then 30 ms
            let ask = Request::new(EA, Operation::Status);
            assert_eq!(step, Step::Send { request: ask, not_before_ns: 30_070_000 });
            let busy = reset.receive(Ok(status(Command::Status, 1)), 30_080_000);
            assert_eq!(busy, Step::Send { request: ask, not_before_ns: 31_080_000 });
            let value = status(Command::Status, 0);
            assert_eq!(reset.receive(Ok(value), 5), Step::Done { value, ready_ns: 5 });
        }
    }

    #[test]
    fn a_missing_response_ends_it_and_a_new_start_counts_from_one() {
        let mut reset = Reset::clear_status(EA);
        for done in 0..8 {
            let _ = reset.start(0);
            for _ in 0..done {
                let _ = reset.receive(Ok(status(Command::ClearStatus, 0)), 0);
            }
            let end = reset.receive(Err(Error::NoResponse), 0);
            let want = match done {
                7 => Step::Failed { error: Error::EffectUnknown, ready_ns: 30_000_000 },
                _ => Step::Failed { error: Error::Interrupted { done }, ready_ns: 30_000_000 },
            };
            assert_eq!(end, want);
            assert_eq!(reset.done(), 0);
        }
    }

    /// A response to something else does not answer the reset, nor STATUS.
    #[test]
    fn only_its_own_responses_count() {
        let mut reset = Reset::set_single_turn_zero_and_shift_commutation_angle(EA);
        let _ = reset.start(0);
        let word = Data::Eeprom { data: 0, address: 0 };
        let word = Response::new(EA, Command::EepromRead, EncoderStatus::empty(), word);
        let elsewhere = Response { ea: EncoderAddress::ZERO, ..status(Command::ZeroPreset, 0) };
        for other in [word, elsewhere, status(Command::Status, 0)] {
            let _ = reset.start(0);
            let end = reset.receive(Ok(other), 0);
            assert_eq!(end, Step::Failed { error: Error::Interrupted { done: 0 }, ready_ns: 30_000_000 });
        }
        let _ = reset.start(0);
        for _ in 0..8 {
            let _ = reset.receive(Ok(status(Command::ZeroPreset, 0)), 0);
        }
        for other in
            [word, status(Command::ZeroPreset, 0), Response { ea: EncoderAddress::ZERO, ..status(Command::Status, 0) }]
        {
            assert!(matches!(reset.receive(Ok(other), 0), Step::Send { .. }));
        }
        assert!(matches!(reset.receive(Ok(status(Command::Status, 0)), 0), Step::Done { .. }));
    }

    #[test]
    fn waiting_for_the_status_is_bounded() {
        let mut reset = Reset::clear_status(EA);
        let _ = reset.start(0);
        for _ in 0..8 {
            let _ = reset.receive(Ok(status(Command::ClearStatus, 0)), 0);
        }
        let mut polls = 0;
        while let Step::Send { .. } = reset.receive(Ok(status(Command::Status, 1)), 0) {
            polls += 1;
        }
        assert_eq!(polls + 1, WRITE_POLLING.max_tries);
    }
}
