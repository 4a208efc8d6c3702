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
    /// The write was not sent, or the same other value was read twice instead.
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
/// value. A memory that reports busy is polled by reading.
///
/// **One response is no evidence**, because the check field misses two wrong bits in one column. Before a write the register
/// has to show the page twice, or once after a selection that was answered. A byte whose write was answered has to be read
/// back once, and any other twice; another value has to be read twice.
///
/// | it ends with | the cell of the page |
/// |---|---|
/// | `Done` | holds the byte |
/// | [`Error::NotDone`] | holds another byte, as reading back has shown |
/// | [`Error::EffectUnknown`] | may hold the byte: it cannot be read back, or the register then holds another page, to which the write may have gone |
/// | any other error | was not written to; that of an access whose page the encoder does not select is [`Error::DataMismatch`] |
///
/// A response for another address is refused, like a response of another kind. Once it is done or has failed, it stays in that
/// state until it is restarted.
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
    /// Number of times that the byte was written.
    writes: u8,
    /// The value that the cell held.
    value: u8,
    /// What was read last of the register or of the cell since it may have changed, to be read once more.
    seen: Option<u8>,
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
            writes: 0,
            value: 0,
            seen: None,
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
            Ok(_) => Error::Busy { tries: self.tries.saturating_add(1) },
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
            Phase::CheckBefore => self.before(edf, ready_ns),
            Phase::CheckAfter if on_page => self.judge(ready_ns),
            // The write may have gone to the other page.
            Phase::CheckAfter if self.written != Sent::Not => {
                Step::Failed { error: Error::EffectUnknown { because: ErrorClass::DataMismatch }, ready_ns }
            }
            Phase::CheckAfter => self.other_page(edf, ready_ns),
        }
    }

    /// Takes what the register holds before an access.
    fn before(&mut self, edf: u8, ready_ns: u64) -> Step<u8> {
        let on_page = edf == self.page.get();
        // A read looks again afterwards, and a page is not selected in vain yet.
        let once = match self.selection {
            Sent::Not => !on_page || self.write.is_none(),
            Sent::Unknown => on_page && self.write.is_none(),
            Sent::Confirmed => on_page,
        };
        if !once {
            if let Some(again) = self.unless_seen_twice(edf, ready_ns) {
                return again;
            }
        }
        if !on_page {
            return match self.selection {
                Sent::Not => self.enter(Phase::Select, ready_ns),
                Sent::Unknown | Sent::Confirmed => self.other_page(edf, ready_ns),
            };
        }
        self.selection = Sent::Not;
        if !self.on_page {
            self.on_page = true;
            self.tries = 0;
        }
        self.enter(if self.write.is_some() { Phase::Write } else { Phase::Read }, ready_ns)
    }

    /// Selects the page, unless the encoder had confirmed that.
    fn other_page(&mut self, edf: u8, ready_ns: u64) -> Step<u8> {
        let confirmed = core::mem::replace(&mut self.selection, Sent::Not) == Sent::Confirmed;
        let error = Error::DataMismatch { got: edf, want: self.page.get() };
        self.differs(error, confirmed, Phase::Select, ready_ns)
    }

    /// Judges the value that was read from the cell of the page.
    fn judge(&mut self, ready_ns: u64) -> Step<u8> {
        let Self { value, written, .. } = *self;
        let done = Step::Done { value, ready_ns };
        let Some(want) = self.write else { return done };
        let confirmed = written == Sent::Confirmed;
        if confirmed && value == want {
            return done;
        }
        if let Some(again) = self.unless_seen_twice(value, ready_ns) {
            return again;
        }
        if value == want {
            return done;
        }
        self.written = Sent::Not;
        let error = Error::NotDone { sent: self.writes, because: ErrorClass::DataMismatch };
        self.differs(error, confirmed, Phase::Write, ready_ns)
    }

    /// Reads again unless the last reading gave the same value. The first reading costs no try, one that contradicts it does.
    fn unless_seen_twice(&mut self, value: u8, ready_ns: u64) -> Option<Step<u8>> {
        let seen = self.seen.replace(value);
        if seen == Some(value) {
            return None;
        }
        let read = if self.phase == Phase::CheckAfter { Phase::Read } else { self.phase };
        Some(match seen {
            Some(want) if self.is_given_up() => self.failed(Error::DataMismatch { got: value, want }, ready_ns),
            _ => self.enter(read, ready_ns),
        })
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
            Phase::Select => {
                self.selection = Sent::Unknown;
                self.seen = None;
            }
            Phase::Write => {
                self.written = Sent::Unknown;
                self.writes = self.writes.saturating_add(1);
                self.seen = None;
            }
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
