use servowire_core::Polling;

use super::Step;
use super::reset::mismatch;
use crate::address::{Address, Page};
use crate::error::{Error, ErrorClass};
use crate::message::Memory;
use crate::request::Request;
use crate::response::Response;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    /// The page register is read before the cell.
    CheckBefore,
    /// The page is written to the register.
    Select,
    /// The byte is written.
    Write,
    /// The byte is read, because it was requested or to find out what became of a write.
    Read,
    /// The register is read again, to confirm that the cell belonged to the page.
    CheckAfter,
}

/// The state of a write to the page register or to the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Sent {
    /// The write was not sent, or reading has shown that it was not done.
    Not,
    /// The write may have been done, and nothing that was read shows whether it was.
    Unknown,
    /// The write was answered with its own data and without the busy flag.
    Confirmed,
}

/// Reads or writes one EEPROM byte of a page, at an address below that of the page register.
///
/// An encoder that has restarted is on page 0 and does not say so. Therefore the page register is read before and after every
/// access; the page is selected if the register holds another one. A written byte is read back, and the access waits while
/// the memory is busy. The result is the byte read.
///
/// **No write is repeated without evidence that it was not done.** After a lost or refused response to a write, including
/// one to the page register, the cell is read. It is written again only if the cell of the requested page holds another
/// value. A memory that reports busy is polled by reading. It ends with [`Error::EffectUnknown`] if nothing can be read
/// after a write has been sent, or if the register then holds another page: the write may have gone there. A response for
/// another address is refused, like a response of another kind. Once it is done or has failed, it stays in that state until
/// it is restarted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EepromAccess {
    page: Page,
    address: Address,
    write: Option<u8>,
    polling: Polling,
    phase: Phase,
    /// Number of failed requests since the page was first found, or since the write was accepted.
    tries: u16,
    /// The register has been seen to hold the page.
    on_page: bool,
    selection: Sent,
    written: Sent,
    /// The value that the cell held.
    value: u8,
    end: Option<Step<u8>>,
}

impl EepromAccess {
    /// Reads the byte at `address` of `page`.
    pub const fn read(page: Page, address: Address, polling: Polling) -> Self {
        Self::new(page, address, None, polling)
    }

    /// Writes `data` to `address` of `page`, then reads it back.
    ///
    /// Motor makers keep name plate and commutation data in this memory: make sure that you know what is at the address.
    pub const fn write(page: Page, address: Address, data: u8, polling: Polling) -> Self {
        Self::new(page, address, Some(data), polling)
    }

    const fn new(page: Page, address: Address, write: Option<u8>, polling: Polling) -> Self {
        Self {
            page,
            address,
            write,
            polling,
            phase: Phase::CheckBefore,
            tries: 0,
            on_page: false,
            selection: Sent::Not,
            written: Sent::Not,
            value: 0,
            end: None,
        }
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<u8> {
        *self = Self::new(self.page, self.address, self.write, self.polling);
        self.enter(Phase::CheckBefore, now_ns)
    }

    servowire_core::receive! { u8 }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<u8> {
        let error = match self.memory(outcome) {
            Ok(memory) if !memory.adf.busy() => return self.answered(memory.edf, ready_ns),
            Ok(_) => {
                // What is busy did not take a write.
                match self.phase {
                    Phase::Select => self.selection = Sent::Not,
                    Phase::Write => self.written = Sent::Not,
                    Phase::CheckBefore | Phase::Read | Phase::CheckAfter => {}
                }
                Error::Busy { tries: self.tries.saturating_add(1) }
            }
            Err(error) => error,
        };
        let not_before_ns = ready_ns.saturating_add(self.polling.interval_ns.into());
        if self.is_given_up() {
            return self.failed(error, not_before_ns);
        }
        // What was read is read again, what was written is read first.
        self.enter(
            match self.phase {
                Phase::Select => Phase::CheckBefore,
                Phase::Write => Phase::Read,
                read => read,
            },
            not_before_ns,
        )
    }

    /// Takes the response to the last request; anything else does not count.
    fn memory(&self, outcome: Result<Response, Error>) -> Result<Memory, Error> {
        let memory = match (outcome?, self.phase) {
            (Response::WriteEeprom(memory), Phase::Select | Phase::Write)
            | (Response::ReadEeprom(memory), Phase::CheckBefore | Phase::Read | Phase::CheckAfter) => memory,
            (other, _) => return Err(mismatch(other, self.request())),
        };
        let (got, want) = (memory.adf.address(), self.cell());
        if got == want { Ok(memory) } else { Err(Error::AddressMismatch { got: got.get(), want: want.get() }) }
    }

    fn answered(&mut self, edf: u8, ready_ns: u64) -> Step<u8> {
        let on_page = edf == self.page.get();
        match self.phase {
            Phase::Select => {
                self.selection = Sent::Confirmed;
                self.enter(Phase::CheckBefore, ready_ns)
            }
            Phase::Write => {
                self.written = Sent::Confirmed;
                self.tries = 0;
                self.enter(Phase::Read, ready_ns)
            }
            Phase::Read => {
                self.value = edf;
                self.enter(Phase::CheckAfter, ready_ns)
            }
            Phase::CheckBefore if on_page => {
                self.selection = Sent::Not;
                if !self.on_page {
                    self.on_page = true;
                    self.tries = 0;
                }
                self.enter(if self.write.is_some() { Phase::Write } else { Phase::Read }, ready_ns)
            }
            Phase::CheckAfter if on_page => self.judge(ready_ns),
            // The write may have gone to the other page.
            Phase::CheckAfter if self.written != Sent::Not => {
                Step::Failed { error: Error::EffectUnknown { because: ErrorClass::DataMismatch }, ready_ns }
            }
            // Another page is not selected in vain yet.
            Phase::CheckBefore if self.selection == Sent::Not => self.enter(Phase::Select, ready_ns),
            Phase::CheckBefore | Phase::CheckAfter => {
                let confirmed = core::mem::replace(&mut self.selection, Sent::Not) == Sent::Confirmed;
                self.differs(
                    Error::DataMismatch { got: edf, want: self.page.get() },
                    confirmed,
                    Phase::Select,
                    ready_ns,
                )
            }
        }
    }

    /// Judges the value that was read from the cell of the page.
    fn judge(&mut self, ready_ns: u64) -> Step<u8> {
        let Self { value, .. } = *self;
        match self.write {
            Some(want) if value != want => {
                let confirmed = core::mem::replace(&mut self.written, Sent::Not) == Sent::Confirmed;
                self.differs(Error::DataMismatch { got: value, want }, confirmed, Phase::Write, ready_ns)
            }
            _ => Step::Done { value, ready_ns },
        }
    }

    /// Handles a write that evidently was not done. The write is sent again, unless the encoder had confirmed it.
    fn differs(&mut self, error: Error, confirmed: bool, again: Phase, ready_ns: u64) -> Step<u8> {
        if confirmed || self.is_given_up() {
            return self.failed(error, ready_ns);
        }
        self.enter(again, ready_ns)
    }

    /// Counts a request without success.
    const fn is_given_up(&mut self) -> bool {
        self.tries = self.tries.saturating_add(1);
        self.tries >= self.polling.max_tries
    }

    fn failed(&self, error: Error, ready_ns: u64) -> Step<u8> {
        let unknown = self.selection != Sent::Not || self.written != Sent::Not;
        let error = if unknown { Error::EffectUnknown { because: error.class() } } else { error };
        Step::Failed { error, ready_ns }
    }

    const fn enter(&mut self, phase: Phase, not_before_ns: u64) -> Step<u8> {
        self.phase = phase;
        match phase {
            Phase::Select => self.selection = Sent::Unknown,
            Phase::Write => self.written = Sent::Unknown,
            Phase::CheckBefore | Phase::Read | Phase::CheckAfter => {}
        }
        Step::Send { request: self.request(), not_before_ns }
    }

    const fn request(&self) -> Request {
        match (self.phase, self.write) {
            (Phase::Select, _) => Request::write_eeprom(self.cell(), self.page.get()),
            (Phase::Write, Some(data)) => Request::write_eeprom(self.cell(), data),
            _ => Request::read_eeprom(self.cell()),
        }
    }

    /// Returns the address that the request of this phase accesses.
    const fn cell(&self) -> Address {
        match self.phase {
            Phase::CheckBefore | Phase::Select | Phase::CheckAfter => Address::PAGE_REGISTER,
            Phase::Write | Phase::Read => self.address,
        }
    }
}

#[cfg(test)]
mod tests;
