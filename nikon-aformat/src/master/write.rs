use super::Step;
use super::eeprom::{WRITE_POLLING, is_busy, status_of};
use crate::data::Data;
use crate::error::Error;
use crate::number::{EncoderAddress, EncoderId, U19, UserAddress};
use crate::operation::Operation;
use crate::request::Request;
use crate::response::Response;
use crate::status::Alm;
use crate::timing::WRITE_BUSY_NS;

/// Writes something that survives power-off: an EEPROM word, an identification code, an address, the velocity coefficient.
///
/// The request is sent **once**, because repeating it wears the EEPROM. Its response repeats the arguments, which the transaction
/// checks; then the encoder is left alone for 30 ms and its status is read until it is no longer busy. If the response to the
/// write is missing or refused, the procedure ends with [`Error::EffectUnknown`].
///
/// What was written is not read back, although an encoder that is busy repeats the arguments and does nothing; to be sure, use
/// [`VerifiedWrite`](super::VerifiedWrite).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Write {
    request: Request,
    /// The encoder to ask for the status, once the write has been answered.
    written: Option<EncoderAddress>,
    /// The last status had MEMERR set: two in a row are evidence.
    faulty: bool,
    tries: u16,
    end: Option<Step<Response>>,
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

    /// Assigns the address `new` to the encoder with the identification code `id` (command 20).
    pub const fn address(id: EncoderId, new: EncoderAddress) -> Self {
        Self::of(new, Operation::SetAddress2 { id })
    }

    /// Writes the velocity coefficient of the encoder `ea`. Version 3.0.
    pub const fn coefficient(ea: EncoderAddress, coefficient: U19) -> Self {
        Self::of(ea, Operation::CoefficientWrite { coefficient })
    }

    const fn of(ea: EncoderAddress, operation: Operation) -> Self {
        Self { request: Request::new(ea, operation), written: None, faulty: false, tries: 0, end: None }
    }

    /// Returns the request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<Response> {
        self.written = None;
        self.faulty = false;
        self.tries = 0;
        self.end = None;
        Step::Send { request: self.request, not_before_ns: now_ns }
    }

    /// The request: what is written, and where.
    pub const fn request(&self) -> Request {
        self.request
    }

    servowire_core::receive! {
        /// The value is the response to STATUS.
        ///
        /// Fails with [`Error::BankError`] if the encoder has no such bank: nothing was written; with
        /// [`Error::EffectUnknown`] if no response to this write or no status comes, and with [`Error::MemoryFault`] if
        /// MEMERR is set in two statuses, by this write or earlier.
        Response
    }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<Response> {
        let Some(ea) = self.written else {
            let not_before_ns = ready_ns.saturating_add(WRITE_BUSY_NS.into());
            return match outcome {
                Ok(response) if self.is_answer(response) => {
                    // Command 19 reaches an encoder of any address; its response says which.
                    let any = matches!(self.request.operation, Operation::IdWrite2 { .. });
                    let ea = if any { response.ea } else { self.request.ea };
                    self.written = Some(ea);
                    Step::Send { request: Request::new(ea, Operation::Status), not_before_ns }
                }
                Err(error @ Error::BankError) => Step::Failed { error, ready_ns },
                _ => Step::Failed { error: Error::EffectUnknown, ready_ns: not_before_ns },
            };
        };
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = ready_ns.saturating_add(WRITE_POLLING.interval_ns.into());
        match status_of(ea, outcome) {
            Ok((_, alm)) if alm.contains(Alm::MEMERR) => {
                if core::mem::replace(&mut self.faulty, true) {
                    return Step::Failed { error: Error::MemoryFault, ready_ns };
                }
            }
            Ok((value, _)) if !is_busy(value) => return Step::Done { value, ready_ns },
            Ok(_) => self.faulty = false,
            Err(_) => {}
        }
        if self.tries >= WRITE_POLLING.max_tries {
            return Step::Failed { error: Error::EffectUnknown, ready_ns: not_before_ns };
        }
        Step::Send { request: Request::new(ea, Operation::Status), not_before_ns }
    }

    /// Returns whether this is the response to the write: from the encoder that was asked, with the arguments repeated.
    fn is_answer(&self, response: Response) -> bool {
        let Request { ea, operation } = self.request;
        let repeats = match (operation, response.data()) {
            (Operation::EepromWrite { address, data }, Some(Data::Eeprom { data: got, address: at })) => {
                (at, got) == (address.get(), data)
            }
            (
                Operation::EepromWriteBank { bank, address, data },
                Some(Data::EepromBank { data: got, bank: of, address: at, .. }),
            ) => (of, at, got) == (bank, address, data),
            (
                Operation::IdWrite1 { id } | Operation::IdWrite2 { id } | Operation::SetAddress2 { id },
                Some(Data::Id { id: got }),
            ) => got == id,
            (Operation::CoefficientWrite { coefficient }, Some(Data::Coefficient { coefficient: got })) => {
                got == coefficient
            }
            _ => false,
        };
        let own = response.ea == ea || !operation.command().answers_with_own_address();
        repeats && own && response.command() == Some(operation.command())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::status::{EncoderStatus, PmAlm};

    fn status(ea: EncoderAddress, es: u8, alm: Alm) -> Response {
        let data = Data::Status { alm, pm_alm: PmAlm::empty() };
        Response::new(ea, Command::Status, EncoderStatus::from_bits_truncate(es), data)
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
        let again = write.receive(Ok(status(answered, 1, Alm::empty())), 40_000_000);
        assert_eq!(again, Step::Send { request: ask, not_before_ns: 41_000_000 });
        let value = status(answered, 0, Alm::empty());
        assert_eq!(write.receive(Ok(value), 9), Step::Done { value, ready_ns: 9 });
        let _ = write.start(0);
        let failed = write.receive(Err(Error::NoResponse), 0);
        assert_eq!(failed, Step::Failed { error: Error::EffectUnknown, ready_ns: 30_000_000 });
    }

    /// A status that shows MEMERR, one that never comes, and a response to something else.
    #[test]
    fn what_is_no_success() {
        let ea = EncoderAddress::truncate(3);
        let mut write = Write::eeprom(ea, UserAddress::MAX, 0x1234);
        let data = Data::Eeprom { data: 0x1234, address: 0xef };
        let echo = |command| Response::new(ea, command, EncoderStatus::empty(), data);
        let _ = write.start(0);
        let other = write.receive(Ok(echo(Command::EepromRead)), 7);
        assert_eq!(other, Step::Failed { error: Error::EffectUnknown, ready_ns: 30_000_007 });
        let _ = write.start(0);
        let _ = write.receive(Ok(echo(Command::EepromWrite)), 0);
        let again = Step::Send { request: Request::new(ea, Operation::Status), not_before_ns: 1_000_005 };
        assert_eq!(write.receive(Ok(status(ea, 0, Alm::MEMERR)), 5), again);
        let fault = write.receive(Ok(status(ea, 0, Alm::MEMERR)), 5);
        assert_eq!(fault, Step::Failed { error: Error::MemoryFault, ready_ns: 5 });
        let _ = write.start(0);
        let _ = write.receive(Ok(echo(Command::EepromWrite)), 0);
        // Nothing else is taken for the status: neither a response to the write nor another encoder's.
        let ask = Request::new(ea, Operation::Status);
        let elsewhere = status(EncoderAddress::ZERO, 0, Alm::empty());
        for no_status in [Ok(echo(Command::EepromWrite)), Ok(elsewhere), Err(Error::NoResponse)] {
            assert_eq!(write.receive(no_status, 0), Step::Send { request: ask, not_before_ns: 1_000_000 });
        }
        for _ in 0..6 {
            assert!(matches!(write.receive(Err(Error::NoResponse), 0), Step::Send { .. }));
        }
        let end = Step::Failed { error: Error::EffectUnknown, ready_ns: 1_000_000 };
        assert_eq!(write.receive(Err(Error::NoResponse), 0), end);
    }
}
