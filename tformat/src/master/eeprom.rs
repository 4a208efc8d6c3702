use servowire_core::Polling;

use super::Step;
use super::reset::mismatch;
use crate::address::{Address, Page};
use crate::error::Error;
use crate::request::Request;
use crate::response::Response;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    SelectPage,
    Operate,
    ReadBack,
}

/// Reads or writes one EEPROM byte: selects the page if one is named, retries while the memory is busy or an answer
/// is refused, and reads a written byte back.
///
/// The result is the byte read. Writing the page register is done by naming a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EepromAccess {
    address: Address,
    write: Option<u8>,
    page: Option<Page>,
    polling: Polling,
    phase: Phase,
    tries: u16,
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
        let phase = if page.is_some() { Phase::SelectPage } else { Phase::Operate };
        Self { address, write, page, polling, phase, tries: 0 }
    }

    /// The first request, at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<u8> {
        self.phase = if self.page.is_some() { Phase::SelectPage } else { Phase::Operate };
        self.tries = 0;
        Step::Send { request: self.request(), not_before_ns: now_ns }
    }

    /// A transaction ended at `now_ns` with this outcome.
    pub fn receive(&mut self, outcome: Result<Response, Error>, now_ns: u64) -> Step<u8> {
        let memory = match outcome {
            Ok(Response::WriteEeprom(memory) | Response::ReadEeprom(memory)) => memory,
            Ok(other) => return self.retry(mismatch(other, self.request()), now_ns),
            Err(error) => return self.retry(error, now_ns),
        };
        if memory.adf.busy() {
            return self.retry(Error::Busy { tries: self.tries.saturating_add(1) }, now_ns);
        }
        self.tries = 0;
        self.phase = match (self.phase, self.write) {
            (Phase::SelectPage, _) => Phase::Operate,
            (Phase::Operate, Some(_)) => Phase::ReadBack,
            (Phase::ReadBack, Some(want)) if memory.edf != want => {
                return Step::Failed { error: Error::DataMismatch { got: memory.edf, want }, ready_ns: now_ns };
            }
            (Phase::Operate | Phase::ReadBack, _) => return Step::Done { value: memory.edf, ready_ns: now_ns },
        };
        Step::Send { request: self.request(), not_before_ns: now_ns }
    }

    const fn request(&self) -> Request {
        match (self.phase, self.page, self.write) {
            (Phase::SelectPage, Some(page), _) => Request::write_eeprom(Address::PAGE_REGISTER, page.get()),
            (Phase::Operate, _, Some(data)) => Request::write_eeprom(self.address, data),
            _ => Request::read_eeprom(self.address),
        }
    }

    fn retry(&mut self, error: Error, now_ns: u64) -> Step<u8> {
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = now_ns.saturating_add(self.polling.interval_ns.into());
        if self.tries >= self.polling.max_tries {
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request: self.request(), not_before_ns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::address::Adf;
    use crate::message::Memory;

    const ADDRESS: Address = match Address::new(5) {
        Some(address) => address,
        None => panic!(),
    };
    const POLLING: Polling = Polling { interval_ns: 1000, max_tries: 3 };

    fn memory(address: Address, busy: bool, edf: u8) -> Memory {
        Memory { adf: Adf::of(address, busy), edf }
    }

    fn send(request: Request, not_before_ns: u64) -> Step<u8> {
        Step::Send { request, not_before_ns }
    }

    #[test]
    fn a_write_selects_the_page_writes_and_reads_back() {
        let mut access = EepromAccess::write(Page::new(2), ADDRESS, 0x5a, POLLING);
        assert_eq!(access.start(0), send(Request::write_eeprom(Address::PAGE_REGISTER, 2), 0));
        let step = access.receive(Ok(Response::WriteEeprom(memory(Address::PAGE_REGISTER, false, 2))), 10);
        assert_eq!(step, send(Request::write_eeprom(ADDRESS, 0x5a), 10));
        let step = access.receive(Ok(Response::WriteEeprom(memory(ADDRESS, false, 0x5a))), 20);
        assert_eq!(step, send(Request::read_eeprom(ADDRESS), 20));
        let step = access.receive(Ok(Response::ReadEeprom(memory(ADDRESS, true, 0))), 30);
        assert_eq!(step, send(Request::read_eeprom(ADDRESS), 1030));
        let step = access.receive(Ok(Response::ReadEeprom(memory(ADDRESS, false, 0x5a))), 1040);
        assert_eq!(step, Step::Done { value: 0x5a, ready_ns: 1040 });
    }

    #[test]
    fn a_byte_that_did_not_stick_is_an_error() {
        let mut access = EepromAccess::write(None, ADDRESS, 0x5a, POLLING);
        let _ = access.start(0);
        let _ = access.receive(Ok(Response::WriteEeprom(memory(ADDRESS, false, 0x5a))), 0);
        let step = access.receive(Ok(Response::ReadEeprom(memory(ADDRESS, false, 0xff))), 7);
        let error = Error::DataMismatch { got: 0xff, want: 0x5a };
        assert_eq!(step, Step::Failed { error, ready_ns: 7 });
    }

    #[test]
    fn polling_is_bounded() {
        let mut access = EepromAccess::read(None, ADDRESS, POLLING);
        let _ = access.start(0);
        let busy = Ok(Response::ReadEeprom(memory(ADDRESS, true, 0)));
        let _ = access.receive(busy, 0);
        let _ = access.receive(Err(Error::NoResponse { echo: false }), 0);
        assert_eq!(access.receive(busy, 0), Step::Failed { error: Error::Busy { tries: 3 }, ready_ns: 1000 });
    }
}
