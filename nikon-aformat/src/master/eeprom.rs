use servowire_core::Polling;

use super::Step;
use crate::command::Command;
use crate::data::Data;
use crate::error::Error;
use crate::number::EncoderAddress;
use crate::operation::Operation;
use crate::request::Request;
use crate::response::Response;
use crate::status::{Alm, EncoderStatus};
use crate::timing::READ_BUSY_NS;

/// Polling of reads: every 300 us, the longest time that a read takes, ten times.
pub const READ_POLLING: Polling = Polling { interval_ns: READ_BUSY_NS, max_tries: 10 };

/// Polling of the status after a write: every millisecond, ten times, on top of the 30 ms that a write takes.
pub const WRITE_POLLING: Polling = Polling { interval_ns: 1_000_000, max_tries: 10 };

/// Polling until an encoder is ready: every millisecond, forty times, which is longer than any access.
pub(super) const READY_POLLING: Polling = Polling { interval_ns: 1_000_000, max_tries: 40 };

/// Returns whether ES0 is set.
pub(super) fn is_busy(response: Response) -> bool {
    response.es().is_some_and(|es| es.contains(EncoderStatus::BUSY))
}

/// Returns the alarms of a response to STATUS from this encoder; nothing else counts as an answer to it.
pub(super) fn status_of(ea: EncoderAddress, outcome: Result<Response, Error>) -> Result<(Response, Alm), Error> {
    let response = outcome?;
    match (response.command(), response.alm()) {
        (Some(Command::Status), Some(alm)) if response.ea == ea => Ok((response, alm)),
        _ => Err(Error::NotCarried),
    }
}

/// Reads one EEPROM word.
///
/// The data of the first response are undetermined, and the memory is busy for up to 300 us ("Nikon Protocol Design"). So
/// the whole request is sent again, and the data of the second response are used if its ES0 is clear. If a read was
/// abandoned, by this controller before a restart or by another one, it is not known which response is the first: the
/// response to the next request then has the data of the old read, and the response after it is undetermined. A busy memory
/// does not start a read either. So another address is read first, until ES0 is clear: at the beginning and after a response
/// that is missing or refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EepromRead {
    request: Request,
    polling: Polling,
    /// The data of the first response are never used.
    discard_first: bool,
    /// Set if the caller knows that no read of this address was abandoned and that the memory is not busy.
    known: bool,
    started: bool,
    next: Next,
    tries: u16,
    end: Option<Step<u16>>,
}

/// Which response is expected next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Next {
    /// The response to the read of another address.
    Other,
    First,
    Second,
}

impl EepromRead {
    /// Reads the word at `address` of the encoder `ea`, with [`READ_POLLING`].
    pub const fn new(ea: EncoderAddress, address: u8) -> Self {
        Self::of(Request::new(ea, Operation::EepromRead { address }))
    }

    /// Reads the word at `address` of `bank`. Version 3.0.
    pub const fn of_bank(ea: EncoderAddress, bank: u8, address: u8) -> Self {
        Self::of(Request::new(ea, Operation::EepromReadBank { bank, address }))
    }

    const fn of(request: Request) -> Self {
        Self {
            request,
            polling: READ_POLLING,
            discard_first: true,
            known: false,
            started: false,
            next: Next::Other,
            tries: 0,
            end: None,
        }
    }

    /// Sets another interval or number of tries; a read takes at least three requests. After another address was read,
    /// the memory is left alone for 300 us regardless of the interval.
    pub const fn with_polling(self, polling: Polling) -> Self {
        Self { polling, ..self }
    }

    /// Begins with the address itself, which takes two requests instead of three or four. Use this only if it is known that no
    /// read of the address was abandoned and that the memory is not busy. This setting is dropped once a read has failed or was
    /// restarted before its end.
    pub const fn knowing_that_none_was_broken_off(self) -> Self {
        Self { known: true, ..self }
    }

    /// Uses the data of the first response if ES0 is clear in it.
    ///
    /// "Nikon Protocol Design" says that they are undetermined, but not that ES0 shows it, so use this only for an encoder whose
    /// ES0 is known to be set in its first response.
    pub const fn trusting_es0_of_the_first_response(self) -> Self {
        Self { discard_first: false, ..self }
    }

    /// The encoder that is queried.
    pub const fn ea(&self) -> EncoderAddress {
        self.request.ea
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<u16> {
        Step::Send { request: self.begin(), not_before_ns: now_ns }
    }

    /// Returns the first request.
    pub(super) const fn begin(&mut self) -> Request {
        // A read that was started and has not ended is broken off by this.
        self.known = self.known && (!self.started || self.end.is_some());
        self.started = true;
        self.tries = 0;
        self.end = None;
        self.next = if self.known { Next::First } else { Next::Other };
        self.next_request()
    }

    servowire_core::receive! {
        /// A response that is missing or refused counts as a try; [`Error::BankError`] ends the procedure at once.
        u16
    }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<u16> {
        self.tries = self.tries.saturating_add(1);
        let word = outcome.and_then(|response| self.word(response));
        let mut wait_ns = self.polling.interval_ns;
        let error = match (word, self.next) {
            (Err(error), _) => {
                self.next = if self.discard_first { Next::Other } else { Next::First };
                error
            }
            (Ok((word, false)), Next::Second) => return Step::Done { value: word, ready_ns },
            (Ok((word, false)), Next::First) if !self.discard_first => {
                return Step::Done { value: word, ready_ns };
            }
            // A busy memory has not begun with the other address, and will not begin with this one.
            (Ok((_, busy)), Next::Other) => {
                self.next = if busy { Next::Other } else { Next::First };
                wait_ns = wait_ns.max(READ_BUSY_NS);
                Error::Busy { tries: self.tries }
            }
            (Ok(_), Next::First | Next::Second) => {
                self.next = Next::Second;
                Error::Busy { tries: self.tries }
            }
        };
        let not_before_ns = ready_ns.saturating_add(wait_ns.into());
        if self.tries >= self.polling.max_tries || error == Error::BankError {
            // Whether the encoder has the word ready is not known.
            self.known = false;
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request: self.next_request(), not_before_ns }
    }

    const fn next_request(&self) -> Request {
        match self.next {
            Next::First | Next::Second => self.request,
            Next::Other => self.other_request(),
        }
    }

    const fn other_request(&self) -> Request {
        let operation = match self.request.operation {
            Operation::EepromRead { address } => Operation::EepromRead { address: address ^ 1 },
            Operation::EepromReadBank { bank, address } => Operation::EepromReadBank { bank, address: address ^ 1 },
            // Never: only these two are made.
            other => other,
        };
        Request::new(self.request.ea, operation)
    }

    /// Returns the word in a response to the last request, and whether the memory is busy.
    fn word(&self, response: Response) -> Result<(u16, bool), Error> {
        let fits = match (self.next_request().operation, response.data()) {
            (Operation::EepromRead { address: want }, Some(Data::Eeprom { data, address })) if address == want => {
                Some(data)
            }
            (
                Operation::EepromReadBank { bank: bank_want, address: want },
                Some(Data::EepromBank { data, bank, address, .. }),
            ) if (bank, address) == (bank_want, want) => Some(data),
            _ => None,
        };
        match fits {
            Some(data) if response.command() == Some(Command::EepromRead) && response.ea == self.request.ea => {
                Ok((data, is_busy(response)))
            }
            _ => Err(Error::NotCarried),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EA: EncoderAddress = EncoderAddress::ZERO;

    fn word(es: u8, data: u16) -> Response {
        Response::new(EA, Command::EepromRead, EncoderStatus::from_bits_truncate(es), Data::Eeprom { data, address: 9 })
    }

    fn word_of(es: u8, data: u16, address: u8) -> Response {
        Response::new(EA, Command::EepromRead, EncoderStatus::from_bits_truncate(es), Data::Eeprom { data, address })
    }

    #[test]
    fn the_first_data_are_not_used() {
        let mut read = EepromRead::new(EA, 9).knowing_that_none_was_broken_off();
        let request = Request::new(EA, Operation::EepromRead { address: 9 });
        assert_eq!(read.start(5), Step::Send { request, not_before_ns: 5 });
        let again = Step::Send { request, not_before_ns: 300_100 };
        assert_eq!(read.receive(Ok(word(0, 0xdead)), 100), again);
        assert_eq!(read.receive(Ok(word(1, 0xdead)), 100), again);
        assert_eq!(read.receive(Ok(word(0, 7)), 100), Step::Done { value: 7, ready_ns: 100 });
        let mut trusting =
            EepromRead::new(EA, 9).knowing_that_none_was_broken_off().trusting_es0_of_the_first_response();
        let _ = trusting.start(0);
        assert_eq!(trusting.receive(Ok(word(1, 0xdead)), 0), Step::Send { request, not_before_ns: 300_000 });
        assert_eq!(trusting.receive(Ok(word(0, 8)), 3), Step::Done { value: 8, ready_ns: 3 });
        let _ = trusting.start(0);
        assert_eq!(trusting.receive(Ok(word(0, 8)), 3), Step::Done { value: 8, ready_ns: 3 });
    }

    /// Where ES0 tells a first response, it is told after a missing one too: nothing has to be read in between.
    #[test]
    fn a_trusted_encoder_is_asked_for_the_same_address_again() {
        let request = Request::new(EA, Operation::EepromRead { address: 9 });
        let mut trusting =
            EepromRead::new(EA, 9).knowing_that_none_was_broken_off().trusting_es0_of_the_first_response();
        let _ = trusting.start(0);
        let again = Step::Send { request, not_before_ns: 300_000 };
        assert_eq!(trusting.receive(Err(Error::NoResponse), 0), again);
        assert_eq!(trusting.receive(Ok(word(0, 8)), 3), Step::Done { value: 8, ready_ns: 3 });
    }

    /// After a missing response nobody knows whether the next one is a first one: another address is read in between.
    #[test]
    fn an_error_does_not_count_as_the_first_response() {
        let request = |address| Request::new(EA, Operation::EepromRead { address });
        let again = |address| Step::Send { request: request(address), not_before_ns: 300_000 };
        let other = Response { body: word(0, 1).body, ..word(0, 1) };
        for bad in [Err(Error::NoResponse), Ok(word_of(0, 5, 8)), Ok(Response { ea: EncoderAddress::MAX, ..other })] {
            let mut read = EepromRead::new(EA, 9).knowing_that_none_was_broken_off();
            let _ = read.start(0);
            assert_eq!(read.receive(Ok(word(0, 0xdead)), 0), again(9));
            assert_eq!(read.receive(bad, 0), again(8));
            // Of the other address only that it was answered counts.
            assert_eq!(read.receive(Ok(word(0, 0xdead)), 0), again(8));
            assert_eq!(read.receive(Ok(word_of(0, 0xbad, 8)), 0), again(9));
            assert_eq!(read.receive(Ok(word(0, 0xdead)), 0), again(9));
            assert_eq!(read.receive(Ok(word(0, 7)), 0), Step::Done { value: 7, ready_ns: 0 });
        }
    }

    /// A controller that starts again does not know what it was doing: a read of another address ends what is open.
    #[test]
    fn another_address_is_read_before() {
        let mut read = EepromRead::new(EA, 9);
        let request = |address| Request::new(EA, Operation::EepromRead { address });
        assert_eq!(read.start(5), Step::Send { request: request(8), not_before_ns: 5 });
        let own = Step::Send { request: request(9), not_before_ns: 300_000 };
        assert_eq!(read.receive(Ok(word_of(0, 0xbad, 8)), 0), own);
        assert_eq!(read.receive(Ok(word(0, 0xdead)), 0), own);
        assert_eq!(read.receive(Ok(word(0, 7)), 0), Step::Done { value: 7, ready_ns: 0 });
        // What happened meanwhile is not known either.
        assert_eq!(read.start(5), Step::Send { request: request(8), not_before_ns: 5 });
        // A memory that is busy has not begun with the other address.
        let other = Step::Send { request: request(8), not_before_ns: 300_000 };
        assert_eq!(read.receive(Ok(word_of(1, 0xbad, 8)), 0), other);
        // One that is known to be idle shows its own read; after a failure nothing is known.
        let mut read = EepromRead::new(EA, 9).knowing_that_none_was_broken_off();
        for _ in 0..2 {
            assert_eq!(read.start(5), Step::Send { request: request(9), not_before_ns: 5 });
            assert_eq!(read.receive(Ok(word(1, 0xdead)), 0), own);
            assert_eq!(read.receive(Ok(word(0, 7)), 0), Step::Done { value: 7, ready_ns: 0 });
        }
        let _ = read.start(0);
        while let Step::Send { .. } = read.receive(Err(Error::NoResponse), 0) {}
        assert_eq!(read.start(5), Step::Send { request: request(8), not_before_ns: 5 });
        let bank = Operation::EepromReadBank { bank: 3, address: 0x41 };
        let other = Request::new(EA, Operation::EepromReadBank { bank: 3, address: 0x40 });
        assert_eq!(EepromRead::of_bank(EA, 3, 0x41).start(1), Step::Send { request: other, not_before_ns: 1 });
        assert_eq!(EepromRead::of_bank(EA, 3, 0x41).request.operation, bank);
    }

    #[test]
    fn reading_is_bounded_and_a_wrong_bank_ends_it() {
        let mut read = EepromRead::new(EA, 9)
            .knowing_that_none_was_broken_off()
            .with_polling(Polling { max_tries: 3, ..READ_POLLING });
        let _ = read.start(0);
        let _ = read.receive(Ok(word(1, 0)), 0);
        let _ = read.receive(Ok(word(1, 0)), 0);
        let end = Step::Failed { error: Error::Busy { tries: 3 }, ready_ns: 300_000 };
        assert_eq!(read.receive(Ok(word(1, 0)), 0), end);
        let mut read = EepromRead::of_bank(EA, 1, 9);
        let _ = read.start(0);
        let end = Step::Failed { error: Error::BankError, ready_ns: 300_000 };
        assert_eq!(read.receive(Err(Error::BankError), 0), end);
    }
}
