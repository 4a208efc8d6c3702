use servowire_core::Polling;

use super::Step;
use crate::data::Data;
use crate::error::Error;
use crate::number::{EncoderAddress, EncoderId, U19, UserAddress};
use crate::operation::Operation;
use crate::request::Request;
use crate::response::Response;
use crate::status::EncoderStatus;
use crate::timing::{READ_BUSY_NS, WRITE_BUSY_NS};

/// For reads: every 300 us, the longest time that a read takes, ten times.
pub const READ_POLLING: Polling = Polling { interval_ns: READ_BUSY_NS, max_tries: 10 };

/// For the status after a write: every millisecond, ten times, on top of the 30 ms that a write takes.
pub const WRITE_POLLING: Polling = Polling { interval_ns: 1_000_000, max_tries: 10 };

/// Whether ES0 is set.
pub(super) fn is_busy(response: Response) -> bool {
    response.es().is_some_and(|es| es.contains(EncoderStatus::BUSY))
}

/// Reads one EEPROM word: the whole request again and again until the memory is no longer busy. The transaction checks
/// that every response repeats the address and the bank.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EepromRead {
    request: Request,
    polling: Polling,
    /// The data of the first response are never used.
    discard_first: bool,
    tries: u16,
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
        Self { request, polling: READ_POLLING, discard_first: true, tries: 0 }
    }

    /// With another interval or number of tries.
    pub const fn with_polling(self, polling: Polling) -> Self {
        Self { polling, ..self }
    }

    /// Uses the data of the first response if ES0 is clear in it.
    ///
    /// "Nikon Protocol Design" says that they are undetermined, and not that ES0 tells it: only for an encoder whose ES0 is
    /// known to be set in its first response.
    pub const fn trusting_es0_of_the_first_response(self) -> Self {
        Self { discard_first: false, ..self }
    }

    /// The encoder that is asked.
    pub const fn ea(&self) -> EncoderAddress {
        self.request.ea
    }

    /// The first request, at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<u16> {
        self.tries = 0;
        Step::Send { request: self.request, not_before_ns: now_ns }
    }

    /// A transaction ended at `now_ns` with this outcome.
    ///
    /// A response that is missing or refused counts as a try; [`Error::BankError`] ends the procedure at once.
    pub fn receive(&mut self, outcome: Result<Response, Error>, now_ns: u64) -> Step<u16> {
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = now_ns.saturating_add(self.polling.interval_ns.into());
        let error = match outcome {
            Ok(response) => match response.data() {
                Some(Data::Eeprom { data, .. } | Data::EepromBank { data, .. })
                    if !is_busy(response) && (self.tries > 1 || !self.discard_first) =>
                {
                    return Step::Done { value: data, ready_ns: now_ns };
                }
                Some(Data::Eeprom { .. } | Data::EepromBank { .. }) => Error::Busy { tries: self.tries },
                _ => Error::NotCarried,
            },
            Err(error) => error,
        };
        if self.tries >= self.polling.max_tries || error == Error::BankError {
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request: self.request, not_before_ns }
    }
}

/// Writes something that outlasts the supply: an EEPROM word, an identification code, an address, the velocity
/// coefficient.
///
/// The request is sent **once**: repeating it wears the EEPROM. Its response repeats the arguments, which the transaction
/// checks; then the encoder is left alone for 30 ms and its status read until it is no longer busy. If the response to the
/// write is missing or refused, the procedure ends: read back what is there before you write again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Write {
    request: Request,
    /// Whom to ask for the status, once the write is answered.
    written: Option<EncoderAddress>,
    tries: u16,
}

impl Write {
    /// Writes an EEPROM word.
    pub const fn eeprom(ea: EncoderAddress, address: UserAddress, data: u16) -> Self {
        Self::of(ea, Operation::EepromWrite { address, data })
    }

    /// Writes an EEPROM word of a bank. Version 3.0.
    pub const fn eeprom_of_bank(ea: EncoderAddress, bank: u8, address: u8, data: u16) -> Self {
        Self::of(ea, Operation::EepromWriteBank { bank, address, data })
    }

    /// Writes the identification code of the encoder `ea` (command 18).
    pub const fn id(ea: EncoderAddress, id: EncoderId) -> Self {
        Self::of(ea, Operation::IdWrite1 { id })
    }

    /// Writes the identification code of the only encoder on the line, whatever its address (command 19).
    pub const fn id_of_the_only_encoder(id: EncoderId) -> Self {
        Self::of(EncoderAddress::ZERO, Operation::IdWrite2 { id })
    }

    /// Gives the encoder with the identification code `id` the address `new` (command 20).
    pub const fn address(id: EncoderId, new: EncoderAddress) -> Self {
        Self::of(new, Operation::SetAddress2 { id })
    }

    /// Writes the velocity coefficient of the encoder `ea`. Version 3.0.
    pub const fn coefficient(ea: EncoderAddress, coefficient: U19) -> Self {
        Self::of(ea, Operation::CoefficientWrite { coefficient })
    }

    const fn of(ea: EncoderAddress, operation: Operation) -> Self {
        Self { request: Request::new(ea, operation), written: None, tries: 0 }
    }

    /// The request, at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<Response> {
        self.written = None;
        self.tries = 0;
        Step::Send { request: self.request, not_before_ns: now_ns }
    }

    /// A transaction ended at `now_ns` with this outcome. The value is the response to STATUS.
    pub fn receive(&mut self, outcome: Result<Response, Error>, now_ns: u64) -> Step<Response> {
        let Some(ea) = self.written else {
            let not_before_ns = now_ns.saturating_add(WRITE_BUSY_NS.into());
            return match outcome {
                Ok(response) => {
                    // Command 19 reaches an encoder of any address; its response says which.
                    let any = matches!(self.request.operation, Operation::IdWrite2 { .. });
                    let ea = if any { response.ea } else { self.request.ea };
                    self.written = Some(ea);
                    Step::Send { request: Request::new(ea, Operation::Status), not_before_ns }
                }
                Err(error) => Step::Failed { error, ready_ns: not_before_ns },
            };
        };
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = now_ns.saturating_add(WRITE_POLLING.interval_ns.into());
        let error = match outcome {
            Ok(value) if !is_busy(value) => return Step::Done { value, ready_ns: now_ns },
            Ok(_) => Error::Busy { tries: self.tries },
            Err(error) => error,
        };
        if self.tries >= WRITE_POLLING.max_tries {
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request: Request::new(ea, Operation::Status), not_before_ns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::status::{Alm, EncoderStatus, PmAlm};

    const EA: EncoderAddress = EncoderAddress::ZERO;

    fn word(es: u8, data: u16) -> Response {
        Response::new(EA, Command::EepromRead, EncoderStatus::from_bits_truncate(es), Data::Eeprom { data, address: 9 })
    }

    fn status(ea: EncoderAddress, es: u8) -> Response {
        let data = Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() };
        Response::new(ea, Command::Status, EncoderStatus::from_bits_truncate(es), data)
    }

    #[test]
    fn the_first_data_are_not_used() {
        let mut read = EepromRead::new(EA, 9);
        let request = Request::new(EA, Operation::EepromRead { address: 9 });
        assert_eq!(read.start(5), Step::Send { request, not_before_ns: 5 });
        let again = Step::Send { request, not_before_ns: 300_100 };
        assert_eq!(read.receive(Ok(word(0, 0xdead)), 100), again);
        assert_eq!(read.receive(Ok(word(1, 0xdead)), 100), again);
        assert_eq!(read.receive(Err(Error::NoResponse), 100), again);
        assert_eq!(read.receive(Ok(word(0, 7)), 100), Step::Done { value: 7, ready_ns: 100 });
    }

    #[test]
    fn reading_is_bounded_and_a_wrong_bank_ends_it() {
        let mut read = EepromRead::new(EA, 9).with_polling(Polling { max_tries: 3, ..READ_POLLING });
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

    #[test]
    fn a_write_is_sent_once() {
        let id = EncoderId::truncate(0x12_3456);
        let answered = EncoderAddress::truncate(5);
        let mut write = Write::id_of_the_only_encoder(id);
        assert!(
            matches!(write.start(0), Step::Send { request, .. } if request.operation == Operation::IdWrite2 { id })
        );
        let raw = Response::new(answered, Command::IdWrite2, EncoderStatus::from_bits_truncate(1), Data::Id { id });
        let ask = Request::new(answered, Operation::Status);
        assert_eq!(write.receive(Ok(raw), 0), Step::Send { request: ask, not_before_ns: 30_000_000 });
        let again = write.receive(Ok(status(answered, 1)), 40_000_000);
        assert_eq!(again, Step::Send { request: ask, not_before_ns: 41_000_000 });
        let value = status(answered, 0);
        assert_eq!(write.receive(Ok(value), 9), Step::Done { value, ready_ns: 9 });
        let _ = write.start(0);
        let failed = write.receive(Err(Error::NoResponse), 0);
        assert_eq!(failed, Step::Failed { error: Error::NoResponse, ready_ns: 30_000_000 });
    }
}
