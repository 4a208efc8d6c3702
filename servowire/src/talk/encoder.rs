//! An encoder at a serial port: its readings, the content of its memory, and the results of resets, as values.

use std::thread;
use std::time::{Duration, SystemTime};

use servowire_core::Procedure;
use tformat::master::{EEPROM_POLLING, EepromAccess, MultiTurnZero, Reset, SingleTurnZero};
use tformat::{Address, AllData, Error, Page, Request, Resolution, Response};

use super::backup::{Backup, PAGE_LEN, PageData};
use super::fault::Fault;
use super::link::Link;
use super::port::Port;

/// An encoder that has answered.
#[derive(Debug)]
pub struct Encoder<P> {
    link: Link<P>,
}

/// The answers of an encoder to ID 3 before and after a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Changed {
    /// Before.
    pub before: AllData,
    /// After.
    pub after: AllData,
}

/// A byte of the memory to be changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// Its page.
    pub page: Page,
    /// Its address in the page, below that of the page register.
    pub address: Address,
    /// The present byte.
    pub from: u8,
    /// The new byte.
    pub to: u8,
}

/// The bytes to write so that a memory matches a backup, and its previous content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Restore {
    before: Backup,
    changes: Vec<Change>,
}

impl Restore {
    /// The memory as it was when this was planned.
    pub const fn before(&self) -> &Backup {
        &self.before
    }

    /// The bytes that differ.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }
}

/// The progress of writing a [`Restore`].
#[derive(Debug)]
pub struct Written {
    /// Bytes written and read back.
    pub bytes: usize,
    /// Whether all bytes were written. After [`Error::EffectUnknown`] one more byte may have been written.
    pub end: Result<(), Fault>,
}

impl<P: Port> Encoder<P> {
    /// Connects to the encoder at the other end of an open port.
    ///
    /// # Errors
    /// [`Fault`] if no encoder answers within `timeout`.
    pub fn open(port: P, timeout: Duration) -> Result<Self, Fault> {
        Ok(Self { link: Link::open(port, timeout)? })
    }

    /// Returns whether the adapter hears itself.
    pub const fn echo(&self) -> bool {
        self.link.echo()
    }

    /// Reads position, turns, encoder ID and alarms with ID 3.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn read(&mut self) -> Result<AllData, Fault> {
        match self.link.exchange(Request::ReadAll)? {
            Response::ReadAll(all) => Ok(all),
            _ => Err(Fault::Input("the answer is to another request".to_owned())),
        }
    }

    /// Clears latched alarms; position and turns stay. The values show which alarms were cleared.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn clear_errors(&mut self) -> Result<Changed, Fault> {
        let before = self.read()?;
        self.after(before, Reset::clear_errors())
    }

    /// Sets the turns to 0, clears all errors and reads both back. **The multi-turn reference of the machine is lost.**
    ///
    /// `tolerance`: how far from 0, in turns, the count may be afterwards; see [`MultiTurnZero`].
    ///
    /// # Errors
    /// [`Fault`]; [`Error::NotDone`] or [`Error::EffectUnknown`] in it says what became of the turns.
    pub fn zero_turns_and_lose_multi_turn_reference(&mut self, tolerance: u32) -> Result<Changed, Fault> {
        let before = self.read()?;
        let resolution = resolution(before.enid)?;
        self.after(before, MultiTurnZero::set_and_lose_multi_turn_reference(resolution, tolerance))
    }

    /// Makes the present position the zero of the turn and reads it back. **This shifts the commutation angle of the
    /// motor.** The shaft must be at rest.
    ///
    /// `tolerance`: how far from 0, in counts, the shaft may seem to be afterwards; see [`SingleTurnZero`].
    ///
    /// # Errors
    /// [`Fault`]; [`Error::NotDone`] or [`Error::EffectUnknown`] in it says what became of the zero.
    pub fn zero_single_turn_and_shift_commutation_angle(&mut self, tolerance: u32) -> Result<Changed, Fault> {
        let before = self.read()?;
        let resolution = resolution(before.enid)?;
        self.after(before, SingleTurnZero::set_and_shift_commutation_angle(resolution, tolerance))
    }

    fn after<R>(&mut self, before: AllData, reset: R) -> Result<Changed, Fault>
    where
        R: Procedure<Request = Request, Response = Response, Error = Error>,
    {
        let _ = self.link.run(reset)?;
        Ok(Changed { before, after: self.read()? })
    }

    /// Reads the first `pages` pages of the memory, with the identity of the encoder. The page register is restored
    /// afterwards, even after a failure.
    ///
    /// # Errors
    /// [`Fault`]; [`Fault::PageLeft`] if the page register could not be put back.
    pub fn backup(&mut self, pages: u8) -> Result<Backup, Fault> {
        let enid = self.read()?.enid;
        let pages = self.keeping_page(|encoder| (0..pages).map(|number| encoder.page(number)).collect())?;
        Ok(Backup::new(SystemTime::now(), enid, pages))
    }

    /// Compares the memory with a backup. Nothing is written except the page register, which is restored.
    ///
    /// # Errors
    /// [`Fault::Input`] if the backup belongs to an encoder of another kind; all other faults.
    pub fn plan(&mut self, want: &Backup) -> Result<Restore, Fault> {
        want.fits(self.read()?.enid)?;
        let before = self.backup(want.pages().len().try_into().unwrap_or(u8::MAX))?;
        let cells = before.cells().zip(want.cells());
        let changes = cells.filter(|(have, want)| have.2 != want.2);
        let changes = changes.map(|((page, address, from), (.., to))| Change { page, address, from, to }).collect();
        Ok(Restore { before, changes })
    }

    /// Writes what was planned, and reads each byte back. The page register is restored afterwards.
    ///
    /// `keep` stores the old content of the memory, [`Restore::before`], before anything is written; if it fails, nothing
    /// is written. The restore ends at a byte that differs from the plan, for example because the encoder was exchanged.
    pub fn write(&mut self, restore: &Restore, keep: impl FnOnce(&Backup) -> Result<(), Fault>) -> Written {
        let mut bytes = 0;
        let end = self.read().and_then(|all| restore.before.fits(all.enid)).and_then(|()| keep(&restore.before));
        let end = end.and_then(|()| {
            self.keeping_page(|encoder| {
                restore.changes.iter().try_for_each(|change| {
                    encoder.change(*change)?;
                    bytes += 1;
                    Ok(())
                })
            })
        });
        Written { bytes, end }
    }

    fn change(&mut self, change: Change) -> Result<(), Fault> {
        let Change { page, address, from, to } = change;
        if self.link.run(EepromAccess::read(page, address, EEPROM_POLLING))? != from {
            return Err(Fault::Input("the memory no longer holds what was compared".to_owned()));
        }
        self.link.run(EepromAccess::write(page, address, to, EEPROM_POLLING)).map(|_| ())
    }

    /// Reads the bytes of a page. The procedure checks the selection before and after each byte.
    fn page(&mut self, number: u8) -> Result<PageData, Fault> {
        let missing = || Fault::Input(format!("there is no page {number}"));
        let page = Page::new(number).ok_or_else(missing)?;
        let mut data = [0; PAGE_LEN];
        for (address, byte) in (0..).zip(&mut data) {
            let read = EepromAccess::read(page, Address::truncate(address), EEPROM_POLLING);
            *byte = self.link.run(read).map_err(|fault| match fault {
                Fault::Encoder(Error::DataMismatch { got, .. }) => {
                    Fault::Input(format!("the encoder stays on page {got}: it has no page {number}"))
                }
                fault => fault,
            })?;
        }
        Ok(data)
    }

    /// Does something with the memory, and restores the page register whatever the result.
    fn keeping_page<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T, Fault>) -> Result<T, Fault> {
        let page = self.selected()?;
        let done = work(self);
        // Any cell of it: the procedure selects the page and looks at the register.
        match (self.link.run(EepromAccess::read(page, Address::truncate(0), EEPROM_POLLING)), done) {
            (Ok(_), done) => done,
            (Err(fault), done) => {
                Err(Fault::PageLeft { page: page.get(), because: Box::new(done.err().unwrap_or(fault)) })
            }
        }
    }

    /// Reads which page is selected.
    fn selected(&mut self) -> Result<Page, Fault> {
        let mut tries = 0;
        loop {
            let error = match self.link.exchange(Request::read_eeprom(Address::PAGE_REGISTER)) {
                Ok(Response::ReadEeprom(memory)) if !memory.adf.busy() => {
                    let none =
                        || Fault::Input(format!("the page register holds {:#04x}, which is not a page", memory.edf));
                    return Page::new(memory.edf).ok_or_else(none);
                }
                Ok(_) => Fault::Encoder(Error::Busy { tries }),
                Err(error @ Fault::Encoder(_)) => error,
                Err(fault) => return Err(fault),
            };
            tries += 1;
            if tries >= EEPROM_POLLING.max_tries {
                return Err(error);
            }
            thread::sleep(Duration::from_nanos(EEPROM_POLLING.interval_ns.into()));
        }
    }
}

impl<P> From<Link<P>> for Encoder<P> {
    fn from(link: Link<P>) -> Self {
        Self { link }
    }
}

/// Returns the widths that an encoder ID implies.
fn resolution(enid: u8) -> Result<Resolution, Fault> {
    let unknown = || Fault::Input(format!("encoder ID {enid:#04x} does not tell its widths: nothing was sent"));
    Resolution::from_enid(enid).map(|hint| hint.resolution).ok_or_else(unknown)
}
