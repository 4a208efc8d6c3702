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

/// What is known of a write that was sent, to the page register or to the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Sent {
    /// It may have been done, and nothing that was read tells.
    unknown: bool,
    /// It was answered with its own data and without the busy flag.
    confirmed: bool,
}

impl Sent {
    const NONE: Self = Self { unknown: false, confirmed: false };
    const NOW: Self = Self { unknown: true, confirmed: false };
}

/// Reads or writes one EEPROM byte: selects the page if one is named and reads the register back, waits while the memory
/// is busy, and reads a written byte back.
///
/// The result is the byte read. A page is selected by naming it. After a response that is missing or refused the page
/// register is read again before anything else: an encoder that has started anew is on page 0.
///
/// **No write is repeated without evidence that it was not done.** After a lost or refused response to a write, to the
/// page register too, the cell is read: only if it holds another value is it written again. A memory that says that it
/// is busy is asked by reading. If nothing can be read after a write has been sent, the access ends with
/// [`Error::EffectUnknown`]. A response that is for another address is refused like one of another kind. Once done or failed
/// it stays so, until it is started again.
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
    /// The register has held the page that is named.
    on_page: bool,
    /// The selection of the page; a response that is lost after it takes the confirmation away.
    selection: Sent,
    /// The write to the cell; `None` as long as it has not been sent.
    written: Option<Sent>,
    end: Option<Step<u8>>,
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
        Self {
            address,
            write,
            page,
            polling,
            phase: Phase::Read,
            tries: 0,
            on_page: false,
            selection: Sent::NONE,
            written: None,
            end: None,
        }
    }

    /// What is done on the page: the write, once; after that the cell is read.
    const fn operation(&self) -> Phase {
        match (self.write, self.written) {
            (Some(_), None) => Phase::Write,
            _ => Phase::Read,
        }
    }

    /// The first request, at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<u8> {
        *self = Self::new(self.address, self.write, self.page, self.polling);
        let first = if self.page.is_some() { Phase::SelectPage } else { self.operation() };
        self.enter(first, now_ns)
    }

    servowire_core::receive! { u8 }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<u8> {
        match self.memory(outcome) {
            Ok(memory) => self.answered(memory, ready_ns),
            Err(error) => self.lost(error, ready_ns),
        }
    }

    /// The response to the request that was sent last; all else is none.
    fn memory(&self, outcome: Result<Response, Error>) -> Result<Memory, Error> {
        let memory = match (outcome?, self.phase) {
            (Response::WriteEeprom(memory), Phase::SelectPage | Phase::Write)
            | (Response::ReadEeprom(memory), Phase::CheckPage | Phase::Read) => memory,
            (other, _) => return Err(mismatch(other, self.request())),
        };
        let (got, want) = (memory.adf.address(), self.cell());
        if got == want { Ok(memory) } else { Err(Error::AddressMismatch { got: got.get(), want: want.get() }) }
    }

    fn answered(&mut self, memory: Memory, ready_ns: u64) -> Step<u8> {
        if memory.adf.busy() {
            // What is busy did not take a write.
            match self.phase {
                Phase::SelectPage => self.selection = Sent::NONE,
                Phase::Write => self.written = Some(Sent::NONE),
                Phase::CheckPage | Phase::Read => {}
            }
            return self.unclear(Error::Busy { tries: self.tries.saturating_add(1) }, self.looking(), ready_ns);
        }
        match self.phase {
            Phase::SelectPage => {
                self.selection.confirmed = true;
                self.enter(Phase::CheckPage, ready_ns)
            }
            Phase::Write => {
                self.written = Some(Sent { unknown: true, confirmed: true });
                self.tries = 0;
                self.enter(Phase::Read, ready_ns)
            }
            Phase::CheckPage => self.page_is(memory, ready_ns),
            Phase::Read => self.byte_is(memory, ready_ns),
        }
    }

    /// No sound response: the encoder may have started anew since the page was looked at.
    fn lost(&mut self, error: Error, ready_ns: u64) -> Step<u8> {
        self.selection.confirmed = false;
        let next = if self.page.is_some() { Phase::CheckPage } else { self.looking() };
        self.unclear(error, next, ready_ns)
    }

    /// What was read is read again, what was written is read first.
    const fn looking(&self) -> Phase {
        match self.phase {
            Phase::SelectPage | Phase::CheckPage => Phase::CheckPage,
            Phase::Write | Phase::Read => Phase::Read,
        }
    }

    /// The page register holds this.
    fn page_is(&mut self, memory: Memory, ready_ns: u64) -> Step<u8> {
        let want = self.page.map_or(0, Page::get);
        let Sent { confirmed, .. } = core::mem::replace(&mut self.selection, Sent::NONE);
        if memory.edf == want {
            if !self.on_page {
                self.on_page = true;
                self.tries = 0;
            }
            return self.enter(self.operation(), ready_ns);
        }
        self.differs(Error::DataMismatch { got: memory.edf, want }, confirmed, Phase::SelectPage, ready_ns)
    }

    /// The cell holds this.
    fn byte_is(&mut self, memory: Memory, ready_ns: u64) -> Step<u8> {
        match self.write {
            Some(want) if memory.edf != want => {
                let Sent { confirmed, .. } = self.written.replace(Sent::NONE).unwrap_or_default();
                self.differs(Error::DataMismatch { got: memory.edf, want }, confirmed, Phase::Write, ready_ns)
            }
            _ => Step::Done { value: memory.edf, ready_ns },
        }
    }

    /// A write was not done: it shows. It is sent again unless the encoder had said that it took it.
    fn differs(&mut self, error: Error, confirmed: bool, again: Phase, ready_ns: u64) -> Step<u8> {
        self.tries = self.tries.saturating_add(1);
        if confirmed || self.tries >= self.polling.max_tries {
            return self.failed(error, ready_ns);
        }
        self.enter(again, ready_ns)
    }

    /// Nothing new is known: `next` tells.
    fn unclear(&mut self, error: Error, next: Phase, ready_ns: u64) -> Step<u8> {
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = ready_ns.saturating_add(self.polling.interval_ns.into());
        if self.tries >= self.polling.max_tries {
            return self.failed(error, not_before_ns);
        }
        self.enter(next, not_before_ns)
    }

    fn failed(&self, error: Error, ready_ns: u64) -> Step<u8> {
        let unknown = self.selection.unknown || self.written.is_some_and(|written| written.unknown);
        let error = if unknown { Error::EffectUnknown { because: error.class() } } else { error };
        Step::Failed { error, ready_ns }
    }

    const fn enter(&mut self, phase: Phase, not_before_ns: u64) -> Step<u8> {
        self.phase = phase;
        match phase {
            Phase::SelectPage => self.selection = Sent::NOW,
            Phase::Write => self.written = Some(Sent::NOW),
            Phase::CheckPage | Phase::Read => {}
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

    const fn memory(address: Address, busy: bool, edf: u8) -> Memory {
        Memory { adf: Adf::answered(address, busy), edf }
    }

    const fn wrote(busy: bool, edf: u8) -> Response {
        Response::WriteEeprom(memory(ADDRESS, busy, edf))
    }

    const fn read(busy: bool, edf: u8) -> Response {
        Response::ReadEeprom(memory(ADDRESS, busy, edf))
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

    /// Writing, reading, and no response at all.
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
        for _ in 0..2 {
            assert_eq!(access.receive(LOST, 0), send(CHECK, 1000));
            assert_eq!(access.receive(page, 1000), send(READ, 1000));
        }
        assert_eq!(access.receive(Ok(read(false, 7)), 9), Step::Done { value: 7, ready_ns: 9 });
    }

    /// A page that answers and a cell that does not: looking at the page does not count the tries anew.
    #[test]
    fn looking_at_the_page_again_does_not_go_on_for_ever() {
        let mut access = EepromAccess::read(Page::new(2), ADDRESS, POLLING);
        let page = Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, 2)));
        let mut step = access.start(0);
        for requests in 1.. {
            let Step::Send { request, .. } = step else { break };
            assert!(requests <= 7, "a selection, and three times a page and a cell");
            step = access.receive(if request == READ { LOST } else { page }, 0);
        }
        assert!(matches!(step, Step::Failed { error: Error::NoResponse { .. }, .. }), "{step:?}");
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
            assert_eq!(access.receive(elsewhere(edf), 0), send(CHECK, 1000));
            assert_eq!(access.receive(page, 1000), send(READ, 1000));
        }
        let end = access.receive(elsewhere(0x5a), 0);
        let because = ErrorClass::AddressMismatch;
        assert_eq!(end, Step::Failed { error: Error::EffectUnknown { because }, ready_ns: 1000 });
        let mut access = EepromAccess::read(None, ADDRESS, Polling { max_tries: 1, ..POLLING });
        let _ = access.start(0);
        let error = Error::AddressMismatch { got: 6, want: 5 };
        assert_eq!(access.receive(elsewhere(7), 0), Step::Failed { error, ready_ns: 1000 });
    }

    /// A read is never taken for the response to a write, nor the other way round.
    #[test]
    fn responses_of_the_other_kind_are_refused() {
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, POLLING);
        let _ = access.start(0);
        assert_eq!(access.receive(Ok(read(false, 0x5a)), 0), send(READ, 1000));
        assert_eq!(access.receive(Ok(wrote(false, 0x5a)), 0), send(READ, 1000));
    }
}
