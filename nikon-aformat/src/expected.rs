use crate::command::Command;
use crate::contents::Contents;
use crate::error::{EchoField, Error};
use crate::frame::truncated;
use crate::layout::{FRAME_BITS, Layout};
use crate::number::{EncoderAddress, EncoderId, U19};
use crate::operation::Operation;
use crate::raw_response::{Crc, RawResponse};

/// Value of the sync code that begins a response.
pub(crate) const SYNC_CODE: u8 = 4;

/// What is known about a response before it arrives: its layout, the command, the address, the arguments that it repeats.
///
/// [`Request::expected`](crate::Request::expected) creates it from a request; [`Expected::new`] is for captures whose
/// request is not available.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Expected {
    layout: Layout,
    command: Command,
    ea: Option<EncoderAddress>,
    echo: Echo,
    /// The bits of the first frame that are known, and their values.
    mask: u16,
    value: u16,
}

/// The arguments of a request that its response repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Echo {
    /// No arguments, or they are not compared.
    #[default]
    None,
    /// EEPROM access: checked in the order address, bank, data.
    Eeprom {
        /// Address.
        address: u8,
        /// Bank, in version 3.0.
        bank: Option<u8>,
        /// Data of a write.
        data: Option<u16>,
    },
    /// Identification code, written or used to choose an encoder.
    Id(EncoderId),
    /// Velocity coefficient, written.
    Coefficient(U19),
}

impl Echo {
    /// Returns what the response to `operation` repeats.
    pub const fn of(operation: Operation) -> Self {
        match operation {
            Operation::EepromRead { address } => Self::Eeprom { address, bank: None, data: None },
            Operation::EepromWrite { address, data } => {
                Self::Eeprom { address: address.get(), bank: None, data: Some(data) }
            }
            Operation::EepromReadBank { bank, address } => Self::Eeprom { address, bank: Some(bank), data: None },
            Operation::EepromWriteBank { bank, address, data } => {
                Self::Eeprom { address, bank: Some(bank), data: Some(data) }
            }
            Operation::IdWrite1 { id } | Operation::IdWrite2 { id } | Operation::SetAddress2 { id } => Self::Id(id),
            Operation::CoefficientWrite { coefficient } => Self::Coefficient(coefficient),
            _ => Self::None,
        }
    }
}

const SYNC: u16 = 0b111;
const EA: u16 = 0b111 << 3;
const CC: u16 = 0b1_1111 << 6;
const FIXED: u16 = 1 << 11;

impl Expected {
    /// Expects a response of this layout to this command, from any address.
    pub const fn new(layout: Layout, command: Command) -> Self {
        let sync = SYNC_CODE as u16;
        let (mask, value) = match layout {
            Layout::Abs17 => (SYNC, sync),
            _ => (SYNC | CC | FIXED, sync | (command.code() as u16) << 6),
        };
        Self { layout, command, ea: None, echo: Echo::None, mask, value }
    }

    /// Expects the same, but only from this address.
    pub const fn from_address(self, ea: EncoderAddress) -> Self {
        Self { ea: Some(ea), mask: self.mask | EA, value: self.value & !EA | (ea.get() as u16) << 3, ..self }
    }

    /// Expects the same, but from any address.
    pub const fn any_address(self) -> Self {
        Self { ea: None, mask: self.mask & !EA, value: self.value & !EA, ..self }
    }

    /// Expects the same, with these arguments repeated.
    pub const fn echoing(self, echo: Echo) -> Self {
        Self { echo, ..self }
    }

    /// The layout.
    pub const fn layout(&self) -> Layout {
        self.layout
    }

    /// The command.
    pub const fn command(&self) -> Command {
        self.command
    }

    /// The address, if it is checked.
    pub const fn ea(&self) -> Option<EncoderAddress> {
        self.ea
    }

    /// Number of frames of the response.
    #[inline(always)]
    pub(crate) const fn frames(&self) -> u8 {
        self.layout.frames()
    }

    /// Returns those known bits of the first frame that are wrong.
    #[inline(always)]
    pub(crate) const fn differs(&self, [first, ..]: Contents) -> u32 {
        first & self.mask as u32 ^ self.value as u32
    }

    /// Returns the content bits, if the CRC-8 leaves no remainder and the known bits of the first frame are right; both are
    /// tested in one branch.
    #[inline(always)]
    pub(crate) const fn fitting(&self, contents: Contents, crc: u32) -> Option<Contents> {
        if crc | self.differs(contents) == 0 { Some(contents) } else { None }
    }

    /// Does the same for the first frame alone.
    #[inline(always)]
    pub(crate) const fn differs_first(&self, content: u16) -> u16 {
        content & self.mask ^ self.value
    }

    /// Returns whether length and first frame are right.
    pub(crate) fn fits(&self, raw: &RawResponse) -> bool {
        raw.frames() == self.layout.frames()
            && raw.contents().first().is_some_and(|first| self.differs_first(*first) == 0)
    }

    /// Returns why a response is refused that is not sound or does not fit; kept off the hot path.
    #[cold]
    pub(crate) fn refusal(&self, raw: &RawResponse) -> Error {
        let want = self.layout.line_bits();
        if raw.frames() != self.layout.frames() {
            return truncated(u32::from(raw.frames()).wrapping_mul(FRAME_BITS), want);
        }
        let Crc { got, want } = raw.crc();
        if got != want {
            return Error::Crc { got, want };
        }
        let first = raw.contents().first().copied().unwrap_or(0);
        let sync = (first & SYNC) as u8;
        if sync != SYNC_CODE {
            return Error::SyncCode { got: sync };
        }
        if first & FIXED & self.mask != 0 {
            return Error::FixedBit;
        }
        let ea = (first >> 3 & 7) as u8;
        match self.ea {
            Some(want) if want.get() != ea => Error::AddressMismatch { got: ea, want: want.get() },
            _ => Error::CommandMismatch { got: (first >> 6 & 31) as u8, want: self.command.code() },
        }
    }

    /// Checks that an EEPROM response repeats what was sent, in the order address, bank, data. If a response to a request with a
    /// bank has none, there is nothing to compare.
    #[inline(always)]
    pub(crate) fn check_eeprom(&self, data: u16, bank: Option<u8>, address: u8) -> Result<(), Error> {
        let Echo::Eeprom { address: want, bank: bank_want, data: data_want } = self.echo else { return Ok(()) };
        same(EchoField::Address, address, want)?;
        if let (Some(got), Some(want)) = (bank, bank_want) {
            same(EchoField::Bank, got, want)?;
        }
        data_want.map_or(Ok(()), |want| same(EchoField::Data, data, want))
    }

    /// Checks that an identification code is the one that was sent.
    #[inline(always)]
    pub(crate) fn check_id(&self, id: EncoderId) -> Result<(), Error> {
        if let Echo::Id(want) = self.echo { same(EchoField::Id, id, want) } else { Ok(()) }
    }

    /// Checks that a velocity coefficient is the one that was sent.
    #[inline(always)]
    pub(crate) fn check_coefficient(&self, coefficient: U19) -> Result<(), Error> {
        if let Echo::Coefficient(want) = self.echo { same(EchoField::Coefficient, coefficient, want) } else { Ok(()) }
    }
}

fn same<T: Into<u32>>(field: EchoField, got: T, want: T) -> Result<(), Error> {
    let (got, want) = (got.into(), want.into());
    if got == want { Ok(()) } else { Err(Error::EchoMismatch { field, got, want }) }
}
