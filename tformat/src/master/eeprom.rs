use servowire_core::Polling;

use super::Step;
use super::reset::mismatch;
use crate::address::{Address, Page};
use crate::error::Error;
use crate::message::Memory;
use crate::request::Request;
use crate::response::Response;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    /// The page is written to the register.
    SelectPage,
    /// The register is read back.
    CheckPage,
    /// The byte is written.
    Write,
    /// The byte is read: because that is what was asked for, or to see what became of a write.
    Read,
}

/// Reads or writes one EEPROM byte: selects the page if one is named and reads the register back, waits while the memory
/// is busy, and reads a written byte back.
///
/// The result is the byte read. A page is selected by naming it.
///
/// **No write is repeated without evidence that it was not done.** After a lost or refused response to a write, to the
/// page register too, the cell is read: only if it holds another value is it written again. A memory that says that it
/// is busy is asked by reading. If nothing can be read after a write has been sent, the access ends with
/// [`Error::EffectUnknown`]. A response that is for another address is refused like one of another kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EepromAccess {
    address: Address,
    write: Option<u8>,
    page: Option<Page>,
    polling: Polling,
    phase: Phase,
    /// Requests of this phase and of the writes it looks after that had no success.
    tries: u16,
    /// A write has been sent, and nothing is known of it yet.
    unknown: bool,
    /// The last write was answered with its own data and without the busy flag.
    confirmed: bool,
}

impl EepromAccess {
    /// Reads the byte at `address`, on the page that is selected now if `page` is `None`.
    pub const fn read(page: Option<Page>, address: Address, polling: Polling) -> Self {
        Self::new(address, None, page, polling)
    }

    /// Writes `data` to `address`, then reads it back.
    ///
    /// Motor makers keep name plate and commutation data in this memory: know what is at the address.
    pub const fn write(page: Option<Page>, address: Address, data: u8, polling: Polling) -> Self {
        Self::new(address, Some(data), page, polling)
    }

    const fn new(address: Address, write: Option<u8>, page: Option<Page>, polling: Polling) -> Self {
        Self { address, write, page, polling, phase: Phase::Read, tries: 0, unknown: false, confirmed: false }
    }

    const fn first(&self) -> Phase {
        match self.page {
            Some(_) => Phase::SelectPage,
            None => self.operation(),
        }
    }

    const fn operation(&self) -> Phase {
        match self.write {
            Some(_) => Phase::Write,
            None => Phase::Read,
        }
    }

    /// The first request, at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<u8> {
        self.tries = 0;
        self.unknown = false;
        self.enter(self.first(), now_ns)
    }

    /// A transaction ended with this outcome; the line is free from `ready_ns` on.
    pub fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<u8> {
        let memory = match (outcome, self.phase) {
            (Ok(Response::WriteEeprom(memory)), Phase::SelectPage | Phase::Write)
            | (Ok(Response::ReadEeprom(memory)), Phase::CheckPage | Phase::Read) => memory,
            (Ok(other), _) => return self.unclear(mismatch(other, self.request()), ready_ns),
            (Err(error), _) => return self.unclear(error, ready_ns),
        };
        let (got, want) = (memory.adf.address(), self.cell());
        if got != want {
            return self.unclear(Error::AddressMismatch { got: got.get(), want: want.get() }, ready_ns);
        }
        if memory.adf.busy() {
            // What is busy did not take a write.
            self.unknown &= matches!(self.phase, Phase::CheckPage | Phase::Read);
            return self.unclear(Error::Busy { tries: self.tries.saturating_add(1) }, ready_ns);
        }
        match self.phase {
            Phase::SelectPage => {
                self.confirmed = true;
                self.enter(Phase::CheckPage, ready_ns)
            }
            Phase::Write => {
                self.confirmed = true;
                self.tries = 0;
                self.enter(Phase::Read, ready_ns)
            }
            Phase::CheckPage => self.page_is(memory, ready_ns),
            Phase::Read => self.byte_is(memory, ready_ns),
        }
    }

    /// The page register holds this.
    fn page_is(&mut self, memory: Memory, ready_ns: u64) -> Step<u8> {
        let want = self.page.map_or(0, Page::get);
        if memory.edf == want {
            self.unknown = false;
            self.tries = 0;
            return self.enter(self.operation(), ready_ns);
        }
        self.differs(memory.edf, want, Phase::SelectPage, ready_ns)
    }

    /// The cell holds this.
    fn byte_is(&mut self, memory: Memory, ready_ns: u64) -> Step<u8> {
        match self.write {
            Some(want) if memory.edf != want => self.differs(memory.edf, want, Phase::Write, ready_ns),
            _ => Step::Done { value: memory.edf, ready_ns },
        }
    }

    /// A write was not done: it shows. It is sent again unless the encoder had said that it took it.
    fn differs(&mut self, got: u8, want: u8, again: Phase, ready_ns: u64) -> Step<u8> {
        let error = Error::DataMismatch { got, want };
        self.unknown = false;
        self.tries = self.tries.saturating_add(1);
        if self.confirmed || self.tries >= self.polling.max_tries {
            return Step::Failed { error, ready_ns };
        }
        self.enter(again, ready_ns)
    }

    /// No sound answer, or one that says busy: what was read is read again, what was written is read first.
    fn unclear(&mut self, error: Error, ready_ns: u64) -> Step<u8> {
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = ready_ns.saturating_add(self.polling.interval_ns.into());
        if self.tries >= self.polling.max_tries {
            let error = if self.unknown { Error::EffectUnknown { because: error.class() } } else { error };
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        let next = match self.phase {
            Phase::SelectPage | Phase::CheckPage => Phase::CheckPage,
            Phase::Write | Phase::Read => Phase::Read,
        };
        self.enter(next, not_before_ns)
    }

    const fn enter(&mut self, phase: Phase, not_before_ns: u64) -> Step<u8> {
        self.phase = phase;
        if matches!(phase, Phase::SelectPage | Phase::Write) {
            self.unknown = true;
            self.confirmed = false;
        }
        Step::Send { request: self.request(), not_before_ns }
    }

    const fn request(&self) -> Request {
        match (self.phase, self.page, self.write) {
            (Phase::SelectPage, Some(page), _) => Request::write_eeprom(self.cell(), page.get()),
            (Phase::Write, _, Some(data)) => Request::write_eeprom(self.cell(), data),
            _ => Request::read_eeprom(self.cell()),
        }
    }

    /// What the request of this phase is about.
    const fn cell(&self) -> Address {
        match self.phase {
            Phase::SelectPage | Phase::CheckPage => Address::PAGE_REGISTER,
            Phase::Write | Phase::Read => self.address,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ErrorClass;
    use crate::address::Adf;

    const ADDRESS: Address = Address::truncate(5);
    const POLLING: Polling = Polling { interval_ns: 1000, max_tries: 3 };
    const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });

    fn memory(address: Address, busy: bool, edf: u8) -> Memory {
        Memory { adf: Adf::of(address, busy), edf }
    }

    const fn wrote(busy: bool, edf: u8) -> Response {
        Response::WriteEeprom(Memory { adf: Adf::of(ADDRESS, busy), edf })
    }

    const fn read(busy: bool, edf: u8) -> Response {
        Response::ReadEeprom(Memory { adf: Adf::of(ADDRESS, busy), edf })
    }

    fn send(request: Request, not_before_ns: u64) -> Step<u8> {
        Step::Send { request, not_before_ns }
    }

    const WRITE: Request = Request::write_eeprom(ADDRESS, 0x5a);
    const READ: Request = Request::read_eeprom(ADDRESS);
    const SELECT: Request = Request::write_eeprom(Address::PAGE_REGISTER, 2);
    const CHECK: Request = Request::read_eeprom(Address::PAGE_REGISTER);

    #[test]
    fn a_write_selects_the_page_checks_it_writes_and_reads_back() {
        let mut access = EepromAccess::write(Page::new(2), ADDRESS, 0x5a, POLLING);
        assert_eq!(access.start(0), send(SELECT, 0));
        let selected = Ok(Response::WriteEeprom(memory(Address::PAGE_REGISTER, false, 2)));
        assert_eq!(access.receive(selected, 10), send(CHECK, 10));
        let page = Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, 2)));
        assert_eq!(access.receive(page, 15), send(WRITE, 15));
        assert_eq!(access.receive(Ok(wrote(false, 0x5a)), 20), send(READ, 20));
        assert_eq!(access.receive(Ok(read(true, 0)), 30), send(READ, 1030));
        assert_eq!(access.receive(Ok(read(false, 0x5a)), 1040), Step::Done { value: 0x5a, ready_ns: 1040 });
    }

    /// An encoder that has no such page answers the selection and keeps another: nothing is written.
    #[test]
    fn a_page_that_does_not_come_is_an_error() {
        let mut access = EepromAccess::write(Page::new(2), ADDRESS, 0x5a, POLLING);
        let _ = access.start(0);
        let _ = access.receive(Ok(Response::WriteEeprom(memory(Address::PAGE_REGISTER, false, 2))), 0);
        let step = access.receive(Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, 0))), 7);
        assert_eq!(step, Step::Failed { error: Error::DataMismatch { got: 0, want: 2 }, ready_ns: 7 });
    }

    /// A selection while the memory is busy was not taken: the register shows it, and the page is selected again.
    #[test]
    fn a_busy_answer_to_a_selection_is_followed_by_reading_the_register() {
        let mut access = EepromAccess::read(Page::new(2), ADDRESS, POLLING);
        let _ = access.start(0);
        let busy = access.receive(Ok(Response::WriteEeprom(memory(Address::PAGE_REGISTER, true, 2))), 0);
        assert_eq!(busy, send(CHECK, 1000));
        let other = access.receive(Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, 0))), 1000);
        assert_eq!(other, send(SELECT, 1000));
    }

    #[test]
    fn a_byte_that_did_not_stick_is_an_error() {
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, POLLING);
        assert_eq!(access.start(0), send(WRITE, 0));
        let _ = access.receive(Ok(wrote(false, 0x5a)), 0);
        let step = access.receive(Ok(read(false, 0xff)), 7);
        assert_eq!(step, Step::Failed { error: Error::DataMismatch { got: 0xff, want: 0x5a }, ready_ns: 7 });
    }

    /// After a lost response the cell is read; it is written again only if it holds another value.
    #[test]
    fn a_write_is_repeated_only_when_the_cell_differs() {
        for holds in [0x5a, 0xff] {
            let mut access = EepromAccess::write(None, ADDRESS, 0x5a, POLLING);
            let _ = access.start(0);
            assert_eq!(access.receive(LOST, 0), send(READ, 1000));
            let step = access.receive(Ok(read(false, holds)), 1000);
            let want = if holds == 0x5a { Step::Done { value: 0x5a, ready_ns: 1000 } } else { send(WRITE, 1000) };
            assert_eq!(step, want);
        }
    }

    /// Writing, reading, and no answer at all.
    #[test]
    fn polling_is_bounded_and_says_what_is_known() {
        let because = ErrorClass::NoResponse;
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, POLLING);
        let _ = access.start(0);
        let _ = access.receive(LOST, 0);
        let _ = access.receive(LOST, 0);
        let end = access.receive(LOST, 0);
        assert_eq!(end, Step::Failed { error: Error::EffectUnknown { because }, ready_ns: 1000 });

        let mut access = EepromAccess::read(None, ADDRESS, POLLING);
        let _ = access.start(0);
        let _ = access.receive(Ok(read(true, 0)), 0);
        let _ = access.receive(LOST, 0);
        let end = access.receive(Ok(read(true, 0)), 0);
        assert_eq!(end, Step::Failed { error: Error::Busy { tries: 3 }, ready_ns: 1000 });

        // A write to a busy memory was not taken.
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, Polling { max_tries: 1, ..POLLING });
        let _ = access.start(0);
        let end = access.receive(Ok(wrote(true, 0x5a)), 0);
        assert_eq!(end, Step::Failed { error: Error::Busy { tries: 1 }, ready_ns: 1000 });
    }

    /// Two tries: the write whose response was lost, and the reading that shows that it was not done.
    #[test]
    fn a_write_is_not_repeated_beyond_the_tries() {
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, Polling { max_tries: 2, ..POLLING });
        let _ = access.start(0);
        assert_eq!(access.receive(LOST, 0), send(READ, 1000));
        let end = access.receive(Ok(read(false, 0xff)), 1000);
        assert_eq!(end, Step::Failed { error: Error::DataMismatch { got: 0xff, want: 0x5a }, ready_ns: 1000 });
    }

    /// What was tried for the page does not count against the byte.
    #[test]
    fn each_phase_has_its_own_tries() {
        let mut access = EepromAccess::read(Page::new(2), ADDRESS, POLLING);
        let _ = access.start(0);
        let _ = access.receive(LOST, 0);
        let _ = access.receive(LOST, 0);
        let page = Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, 2)));
        assert_eq!(access.receive(page, 0), send(READ, 0));
        let _ = access.receive(LOST, 0);
        let _ = access.receive(LOST, 0);
        assert_eq!(access.receive(Ok(read(false, 7)), 9), Step::Done { value: 7, ready_ns: 9 });
    }

    /// What another cell holds says nothing of this one, nor of the page register.
    #[test]
    fn responses_of_another_address_are_refused() {
        let mut access = EepromAccess::write(Page::new(2), ADDRESS, 0x5a, POLLING);
        let _ = access.start(0);
        let elsewhere = |edf| Ok(Response::ReadEeprom(memory(Address::truncate(6), false, edf)));
        assert_eq!(access.receive(Ok(wrote(false, 2)), 0), send(CHECK, 1000));
        assert_eq!(access.receive(elsewhere(2), 0), send(CHECK, 1000));
        let page = Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, 2)));
        assert_eq!(access.receive(page, 0), send(WRITE, 0));
        assert_eq!(access.receive(Ok(wrote(false, 0x5a)), 0), send(READ, 0));
        for edf in [0x5a, 0xff] {
            assert_eq!(access.receive(elsewhere(edf), 0), send(READ, 1000));
        }
        let end = access.receive(elsewhere(0x5a), 0);
        let because = ErrorClass::AddressMismatch;
        assert_eq!(end, Step::Failed { error: Error::EffectUnknown { because }, ready_ns: 1000 });
        let mut access = EepromAccess::read(None, ADDRESS, Polling { max_tries: 1, ..POLLING });
        let _ = access.start(0);
        let error = Error::AddressMismatch { got: 6, want: 5 };
        assert_eq!(access.receive(elsewhere(7), 0), Step::Failed { error, ready_ns: 1000 });
    }

    /// A read is never taken for the answer to a write, nor the other way round.
    #[test]
    fn responses_of_the_other_kind_are_refused() {
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, POLLING);
        let _ = access.start(0);
        assert_eq!(access.receive(Ok(read(false, 0x5a)), 0), send(READ, 1000));
        assert_eq!(access.receive(Ok(wrote(false, 0x5a)), 0), send(READ, 1000));
    }
}
