//! The contents of the responses.

use nrz_line::{BitOrder, Window};

use crate::address::Adf;
use crate::count::{Abm, Abs};
use crate::crc::check;
use crate::data_id::{ControlField, DataId};
use crate::error::Error;
use crate::frame::{Frame, count, faults11, framing, is_framed, load, pack, unpack};
use crate::status::{Almc, StatusField};

/// The response to ID 0, 7, 8 and C.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SingleTurn {
    /// SF.
    pub sf: StatusField,
    /// ABS0..ABS2: position within the turn; its width depends on the encoder, see [`Resolution`](crate::Resolution).
    pub abs: Abs,
}

/// The response to ID 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct MultiTurn {
    /// SF.
    pub sf: StatusField,
    /// ABM0..ABM2: turns.
    pub abm: Abm,
}

/// The response to ID 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Identification {
    /// SF.
    pub sf: StatusField,
    /// ENID.
    pub enid: u8,
}

/// The response to ID 3: everything that an encoder reports, and also its answer to a damaged request.
///
/// ```text
///  field  0    1    2    3    4    5     6    7    8    9     10
///         CF   SF  ABS0 ABS1 ABS2 ENID  ABM0 ABM1 ABM2 ALMC  CRC      TIDM-1011, table 2-5
///         1a
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct AllData {
    /// SF.
    pub sf: StatusField,
    /// ABS0..ABS2: position within the turn.
    pub abs: Abs,
    /// ENID.
    pub enid: u8,
    /// ABM0..ABM2: turns.
    pub abm: Abm,
    /// ALMC: the error byte.
    pub almc: Almc,
}

/// The response to ID 6 and D.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Memory {
    /// ADF: address, and whether the memory was busy.
    pub adf: Adf,
    /// EDF: the byte that was read, or a repetition of the byte written. Meaningless while the memory is busy.
    pub edf: u8,
}

servowire_core::one_line!(SingleTurn { Self { sf, abs } => "SF [{}] ABS {}", sf, abs; });
servowire_core::one_line!(MultiTurn { Self { sf, abm } => "SF [{}] ABM {}", sf, abm; });
servowire_core::one_line!(Identification { Self { sf, enid } => "SF [{}] ENID {:02X}h", sf, enid; });
servowire_core::one_line!(AllData {
    Self { sf, abs, enid, abm, almc } => "SF [{}] ABS {} ENID {:02X}h ABM {} ALMC [{}]", sf, abs, enid, abm, almc;
});
servowire_core::one_line!(Memory { Self { adf, edf } => "ADF {} EDF {:02X}h", adf, edf; });

/// The control field of ID 3.
pub(crate) const CF3: u8 = DataId::ReadAll.control_field().get();

impl AllData {
    /// Number of fields of the response.
    pub const FIELDS: usize = 11;

    /// Decodes the response to ID 3 from the start of UART bytes; bytes after it are ignored.
    ///
    /// # Errors
    /// As [`Response::parse`](crate::Response::parse) for ID 3.
    #[inline]
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        match bytes.first_chunk() {
            Some(b) if is_sound(b) => Ok(Self::of(b)),
            _ => Err(refusal(DataId::ReadAll, bytes)),
        }
    }

    /// Decodes the response to ID 3 from its 110 line bits, the first one at the start of `line`.
    ///
    /// For a window at another bit offset see [`Response::parse_line`](crate::Response::parse_line).
    ///
    /// # Errors
    /// As [`Response::parse_line`](crate::Response::parse_line) for ID 3.
    #[inline(always)]
    pub fn parse_line(line: &[u8; Frame::MAX_LINE_BYTES], order: BitOrder) -> Result<Self, Error> {
        Self::of_line(load(line, order))
    }

    /// Decodes 110 line bits.
    #[inline(always)]
    pub(crate) fn of_line(line: u128) -> Result<Self, Error> {
        let b @ [cf, ..] = unpack(line);
        if faults11(line) | u32::from(cf ^ CF3) == 0 { Ok(Self::of(&b)) } else { Err(line_refusal(line)) }
    }

    /// Returns the fields as UART bytes.
    pub const fn emit(self) -> [u8; Self::FIELDS] {
        let ([a0, a1, a2], [m0, m1, m2]) = (self.abs.to_le_bytes(), self.abm.to_le_bytes());
        let (sf, enid, almc) = (self.sf.bits(), self.enid, self.almc.bits());
        let crc = CF3 ^ sf ^ a0 ^ a1 ^ a2 ^ enid ^ m0 ^ m1 ^ m2 ^ almc;
        [CF3, sf, a0, a1, a2, enid, m0, m1, m2, almc, crc]
    }

    /// Returns the 110 line bits in 14 bytes; the two bits after them are 0.
    pub const fn emit_line(self, order: BitOrder) -> [u8; Frame::MAX_LINE_BYTES] {
        let line = pack(&self.emit());
        let word = match order {
            BitOrder::LsbFirst => line.to_le_bytes(),
            BitOrder::MsbFirst => line.reverse_bits().to_be_bytes(),
        };
        match word.first_chunk() {
            Some(bytes) => *bytes,
            // Never: 14 of 16 bytes.
            None => [0; Frame::MAX_LINE_BYTES],
        }
    }

    pub(crate) const fn of(b: &[u8; Self::FIELDS]) -> Self {
        let [_, sf, a0, a1, a2, enid, m0, m1, m2, almc, _] = *b;
        Self {
            sf: StatusField::from_bits_retain(sf),
            abs: Abs::from_le_bytes([a0, a1, a2]),
            enid,
            abm: Abm::from_le_bytes([m0, m1, m2]),
            almc: Almc::from_bits_retain(almc),
        }
    }
}

/// Returns whether eleven fields are an ID 3 frame with a good check field: four loads are the whole good path.
pub(crate) const fn is_sound(b: &[u8; AllData::FIELDS]) -> bool {
    let [b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10] = *b;
    let sum = u32::from_le_bytes([b0, b1, b2, b3])
        ^ u32::from_le_bytes([b4, b5, b6, b7])
        ^ u32::from_le_bytes([b8, b9, b10, 0]);
    let sum = sum ^ sum >> 16;
    (sum ^ sum >> 8) & 0xff == 0 && b0 == CF3
}

/// Returns the error that an unrequested ID 3 frame means.
#[cold]
fn rejection(bytes: &[u8]) -> Error {
    match AllData::parse(bytes) {
        Ok(data) => Error::Rejected { sf: data.sf },
        Err(error) => error,
    }
}

/// Returns why the line bits of a response to ID 3 are refused; kept off the hot path.
///
/// It takes the bits rather than the fields, so that the good path need not store the fields.
#[cold]
#[inline(never)]
fn line_refusal(line: u128) -> Error {
    match Window::from_bits(line, 110) {
        Some(window) if !is_framed(line, 110) => framing(window, 11),
        _ => refusal(DataId::ReadAll, &unpack(line)),
    }
}

/// Returns why a response to `id` is refused: by its control field, length or check field, in this order. Kept off the hot
/// path.
#[cold]
#[inline(never)]
pub(crate) fn refusal(id: DataId, bytes: &[u8]) -> Error {
    let want = id.response_fields();
    let truncated = Error::Truncated { got: count(bytes), want: want.into() };
    let Some(&cf) = bytes.first() else { return truncated };
    let wanted = id.control_field();
    if cf != wanted.get() {
        return match ControlField::parse(cf).map(ControlField::get) {
            Err(error) => error,
            Ok(CF3) => rejection(bytes),
            Ok(got) => Error::CfMismatch { got, want: wanted.get() },
        };
    }
    match bytes.get(..usize::from(want)).map(check) {
        Some(Err(error)) => error,
        // A whole response without a fault never comes here: the caller saw one.
        None | Some(Ok(())) => truncated,
    }
}
