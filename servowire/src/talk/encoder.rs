//! An encoder at a serial port, as values: what it says, what its memory holds, what became of a reset.

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

/// What an encoder said by ID 3 before a reset and after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Changed {
    /// Before.
    pub before: AllData,
    /// After.
    pub after: AllData,
}

/// A byte of the memory that is to be another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// Its page.
    pub page: Page,
    /// Its address in the page, below that of the page register.
    pub address: Address,
    /// What the memory holds.
    pub from: u8,
    /// What it is to hold.
    pub to: u8,
}

/// What has to be written so that a memory holds what a backup holds, and what it held before.
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

/// How far the writing of a [`Restore`] came.
#[derive(Debug)]
pub struct Written {
    /// Bytes that were written and read back.
    pub bytes: usize,
    /// Whether that was all. After [`Error::EffectUnknown`] one more byte may be written.
    pub end: Result<(), Fault>,
}

impl<P: Port> Encoder<P> {
    /// The encoder at the other end of an open port.
    ///
    /// # Errors
    /// [`Fault`] if no encoder answers within `timeout`.
    pub fn open(port: P, timeout: Duration) -> Result<Self, Fault> {
        Ok(Self { link: Link::open(port, timeout)? })
    }

    /// Whether the adapter hears itself.
    pub const fn echo(&self) -> bool {
        self.link.echo()
    }

    /// Position, turns, encoder ID and alarms, by ID 3.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn read(&mut self) -> Result<AllData, Fault> {
        match self.link.exchange(Request::ReadAll)? {
            Response::ReadAll(all) => Ok(all),
            _ => Err(Fault::Input("the answer is to another request".to_owned())),
        }
    }

    /// Clears latched alarms; position and turns stay. Which of them went is in the values.
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
    /// [`Fault`]; [`Error::NotDone`] or [`Error::EffectUnknown`] in it say what became of the turns.
    pub fn zero_turns_and_lose_multi_turn_reference(&mut self, tolerance: u32) -> Result<Changed, Fault> {
        let before = self.read()?;
        let resolution = resolution(before.enid)?;
        self.after(before, MultiTurnZero::set_and_lose_multi_turn_reference(resolution, tolerance))
    }

    /// Makes the present position the zero of the turn and reads it back. **This shifts the commutation angle of the motor.** The
    /// shaft has to stand still.
    ///
    /// `tolerance`: how far from 0, in counts, the shaft may seem to be afterwards; see [`SingleTurnZero`].
    ///
    /// # Errors
    /// [`Fault`]; [`Error::NotDone`] or [`Error::EffectUnknown`] in it say what became of the zero.
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

    /// The first `pages` pages of the memory, with what the encoder is. The page register holds afterwards what it held before,
    /// also if it fails.
    ///
    /// # Errors
    /// [`Fault`]; [`Fault::PageLeft`] if the page register could not be put back.
    pub fn backup(&mut self, pages: u8) -> Result<Backup, Fault> {
        let enid = self.read()?.enid;
        let pages = self.keeping_page(|encoder| (0..pages).map(|number| encoder.page(number)).collect())?;
        Ok(Backup::new(SystemTime::now(), enid, pages))
    }

    /// Compares the memory with a backup. Nothing is written, but the page register, which is put back.
    ///
    /// # Errors
    /// [`Fault::Input`] if the backup is of an encoder of another kind; all others.
    pub fn plan(&mut self, want: &Backup) -> Result<Restore, Fault> {
        want.fits(self.read()?.enid)?;
        let before = self.backup(want.pages().len().try_into().unwrap_or(u8::MAX))?;
        let cells = before.cells().zip(want.cells());
        let changes = cells.filter(|(have, want)| have.2 != want.2);
        let changes = changes.map(|((page, address, from), (.., to))| Change { page, address, from, to }).collect();
        Ok(Restore { before, changes })
    }

    /// Writes what was planned, and reads each byte back. The page register holds afterwards what it held before.
    ///
    /// `keep` stores what the memory held, [`Restore::before`], before anything is written; if it fails nothing is. A byte that
    /// is not what was planned for, because it is another encoder by now, ends it.
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

    /// The bytes of a page. The procedure looks at the selection before and after each.
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

    /// Does something with the memory, and puts the page register back whatever becomes of it.
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

    /// The page that is selected.
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

/// The widths that an encoder ID tells.
fn resolution(enid: u8) -> Result<Resolution, Fault> {
    let unknown = || Fault::Input(format!("encoder ID {enid:#04x} does not tell its widths: nothing was sent"));
    Resolution::from_enid(enid).map(|hint| hint.resolution).ok_or_else(unknown)
}
