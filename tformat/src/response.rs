use nrz_line::Window;

use crate::address::Adf;
use crate::count::{Abm, Abs};
use crate::data_id::DataId;
use crate::error::Error;
use crate::frame::{Frame, faults4, faults6, unpack};
use crate::message::{AllData, CF3, Identification, Memory, MultiTurn, SingleTurn, is_sound, refusal};
use crate::request::Request;
use crate::status::StatusField;

/// What an encoder sends, by the data ID that it answers.
///
/// ```text
///  ID 0, 7, 8, C   CF  SF  ABS0 ABS1 ABS2  CRC                                       TIDM-1011,
///  ID 1            CF  SF  ABM0 ABM1 ABM2  CRC                                       tables 2-5, 2-7
///  ID 2            CF  SF  ENID  CRC
///  ID 3            CF  SF  ABS0 ABS1 ABS2  ENID  ABM0 ABM1 ABM2  ALMC  CRC
///  ID 6, D         CF  ADF  EDF  CRC
/// ```
///
/// ABS and ABM come low byte first. The control field repeats that of the request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Response {
    /// ID 0: single-turn data.
    ReadSingleTurn(SingleTurn),
    /// ID 1: multi-turn data.
    ReadMultiTurn(MultiTurn),
    /// ID 2: encoder ID.
    ReadEncoderId(Identification),
    /// ID 3: everything.
    ReadAll(AllData),
    /// ID 6: echo of an EEPROM write.
    WriteEeprom(Memory),
    /// ID 7: single-turn data, after one of ten resets of the errors.
    ResetErrors(SingleTurn),
    /// ID 8: single-turn data, after one of ten settings of the single-turn zero.
    SetSingleTurnZero(SingleTurn),
    /// ID C: single-turn data, after one of ten resets of turns and errors.
    ResetTurnsAndErrors(SingleTurn),
    /// ID D: an EEPROM byte.
    ReadEeprom(Memory),
}

servowire_core::one_line!(Response {
    Self::ReadAll(data) => "{} {}", DataId::ReadAll, data;
    Self::ReadMultiTurn(data) => "{} {}", DataId::ReadMultiTurn, data;
    Self::ReadEncoderId(data) => "{} {}", DataId::ReadEncoderId, data;
    Self::WriteEeprom(data) => "{} {}", DataId::WriteEeprom, data;
    Self::ReadEeprom(data) => "{} {}", DataId::ReadEeprom, data;
    Self::ReadSingleTurn(data) => "{} {}", DataId::ReadSingleTurn, data;
    Self::ResetErrors(data) => "{} {}", DataId::ResetErrors, data;
    Self::SetSingleTurnZero(data) => "{} {}", DataId::SetSingleTurnZero, data;
    Self::ResetTurnsAndErrors(data) => "{} {}", DataId::ResetTurnsAndErrors, data;
});

impl Response {
    /// Decodes the response to `request` from the start of UART bytes; bytes after it are ignored.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`] without any field, [`Error::SinkCode`], [`Error::Parity`],
    /// [`Error::CfMismatch`], [`Error::Truncated`], [`Error::Crc`], [`Error::AddressMismatch`],
    /// [`Error::DataMismatch`]. An ID 3 frame that was not requested is [`Error::Rejected`] if it is complete and sound.
    pub fn parse(request: Request, bytes: &[u8]) -> Result<Self, Error> {
        let id = request.data_id();
        let cf = id.control_field().get();
        match id {
            DataId::ReadAll => match bytes.first_chunk() {
                Some(b) if is_sound(b) => Ok(Self::ReadAll(AllData::of(b))),
                _ => Err(refusal(id, bytes)),
            },
            DataId::ReadEncoderId | DataId::WriteEeprom | DataId::ReadEeprom => match bytes.first_chunk() {
                Some(&b @ [b0, b1, b2, b3]) if b0 == cf && b0 ^ b1 ^ b2 ^ b3 == 0 => Self::of4(request, b),
                _ => Err(refusal(id, bytes)),
            },
            _ => match bytes.first_chunk() {
                Some(&b @ [b0, b1, b2, b3, b4, b5]) if b0 == cf && b0 ^ b1 ^ b2 ^ b3 ^ b4 ^ b5 == 0 => {
                    Ok(Self::of6(id, b))
                }
                _ => Err(refusal(id, bytes)),
            },
        }
    }

    /// Decodes the response to `request` from the start of line bits on a fixed grid: field k begins at bit 10 k of
    /// `line`. Bits after the response are ignored.
    ///
    /// # Errors
    /// [`Error::StartBit`], [`Error::Delimiter`] or [`Error::Truncated`] for the first badly framed field, then as
    /// [`parse`](Self::parse).
    pub fn parse_line(request: Request, line: Window) -> Result<Self, Error> {
        let (id, len, bits) = (request.data_id(), line.len(), line.bits());
        if id == DataId::ReadAll && len >= 110 {
            return AllData::of_line(bits).map(Self::ReadAll);
        }
        let [cf, b1, b2, b3, b4, b5, ..] = unpack(bits);
        let wrong_cf = u32::from(cf ^ id.control_field().get());
        match id {
            DataId::ReadEncoderId | DataId::WriteEeprom | DataId::ReadEeprom => {
                if len >= 40 && faults4(bits) | wrong_cf == 0 {
                    return Self::of4(request, [cf, b1, b2, b3]);
                }
            }
            DataId::ReadAll => {}
            _ => {
                if len >= 60 && faults6(bits) | wrong_cf == 0 {
                    return Ok(Self::of6(id, [cf, b1, b2, b3, b4, b5]));
                }
            }
        }
        line_refusal(request, line)
    }

    /// The data ID that is answered.
    pub const fn data_id(self) -> DataId {
        match self {
            Self::ReadSingleTurn(_) => DataId::ReadSingleTurn,
            Self::ReadMultiTurn(_) => DataId::ReadMultiTurn,
            Self::ReadEncoderId(_) => DataId::ReadEncoderId,
            Self::ReadAll(_) => DataId::ReadAll,
            Self::WriteEeprom(_) => DataId::WriteEeprom,
            Self::ResetErrors(_) => DataId::ResetErrors,
            Self::SetSingleTurnZero(_) => DataId::SetSingleTurnZero,
            Self::ResetTurnsAndErrors(_) => DataId::ResetTurnsAndErrors,
            Self::ReadEeprom(_) => DataId::ReadEeprom,
        }
    }

    /// Returns the fields to send.
    pub const fn emit(self) -> Frame {
        let cf = self.data_id().control_field().get();
        match self {
            Self::ReadSingleTurn(v)
            | Self::ResetErrors(v)
            | Self::SetSingleTurnZero(v)
            | Self::ResetTurnsAndErrors(v) => Frame::of6(six_fields(cf, v.sf, v.abs.to_le_bytes())),
            Self::ReadMultiTurn(v) => Frame::of6(six_fields(cf, v.sf, v.abm.to_le_bytes())),
            Self::ReadEncoderId(v) => Frame::of4([cf, v.sf.bits(), v.enid, cf ^ v.sf.bits() ^ v.enid]),
            Self::ReadAll(v) => Frame::of11(v.emit()),
            Self::WriteEeprom(v) | Self::ReadEeprom(v) => {
                Frame::of4([cf, v.adf.bits(), v.edf, cf ^ v.adf.bits() ^ v.edf])
            }
        }
    }

    /// SF, which all responses except those of the EEPROM carry.
    pub const fn status(self) -> Option<StatusField> {
        match self {
            Self::ReadMultiTurn(v) => Some(v.sf),
            Self::ReadEncoderId(v) => Some(v.sf),
            Self::ReadAll(v) => Some(v.sf),
            Self::WriteEeprom(_) | Self::ReadEeprom(_) => None,
            Self::ReadSingleTurn(v)
            | Self::ResetErrors(v)
            | Self::SetSingleTurnZero(v)
            | Self::ResetTurnsAndErrors(v) => Some(v.sf),
        }
    }

    /// ABS, in the responses that carry it.
    pub const fn abs(self) -> Option<Abs> {
        match self {
            Self::ReadAll(v) => Some(v.abs),
            Self::ReadMultiTurn(_) | Self::ReadEncoderId(_) | Self::WriteEeprom(_) | Self::ReadEeprom(_) => None,
            Self::ReadSingleTurn(v)
            | Self::ResetErrors(v)
            | Self::SetSingleTurnZero(v)
            | Self::ResetTurnsAndErrors(v) => Some(v.abs),
        }
    }

    /// Creates a response from four checked fields; whether it matches an EEPROM request is not checked yet.
    #[inline]
    fn of4(request: Request, [_, first, second, _]: [u8; 4]) -> Result<Self, Error> {
        let memory = Memory { adf: Adf::from_bits(first), edf: second };
        match request {
            Request::WriteEeprom { adf, edf } => {
                check_address(memory, adf)?;
                // A busy memory did not write; its data byte says nothing.
                if memory.edf != edf && !memory.adf.busy() {
                    return Err(Error::DataMismatch { got: memory.edf, want: edf });
                }
                Ok(Self::WriteEeprom(memory))
            }
            Request::ReadEeprom { adf } => {
                check_address(memory, adf)?;
                Ok(Self::ReadEeprom(memory))
            }
            _ => Ok(Self::ReadEncoderId(Identification { sf: StatusField::from_bits_retain(first), enid: second })),
        }
    }

    /// Creates a response from six checked fields.
    #[inline]
    const fn of6(id: DataId, [_, sf, d0, d1, d2, _]: [u8; 6]) -> Self {
        let (sf, data) = (StatusField::from_bits_retain(sf), [d0, d1, d2]);
        let single = SingleTurn { sf, abs: Abs::from_le_bytes(data) };
        match id {
            DataId::ReadMultiTurn => Self::ReadMultiTurn(MultiTurn { sf, abm: Abm::from_le_bytes(data) }),
            DataId::ResetErrors => Self::ResetErrors(single),
            DataId::SetSingleTurnZero => Self::SetSingleTurnZero(single),
            DataId::ResetTurnsAndErrors => Self::ResetTurnsAndErrors(single),
            _ => Self::ReadSingleTurn(single),
        }
    }
}

const fn six_fields(cf: u8, sf: StatusField, [d0, d1, d2]: [u8; 3]) -> [u8; 6] {
    let sf = sf.bits();
    [cf, sf, d0, d1, d2, cf ^ sf ^ d0 ^ d1 ^ d2]
}

/// Returns how many fields the response to a request for `id` has if it begins with `cf`; an ID 3 frame that was not requested
/// is the encoder's refusal.
const fn expected_fields(id: DataId, cf: u8) -> u8 {
    if cf == CF3 { DataId::ReadAll.response_fields() } else { id.response_fields() }
}

/// Returns why line bits are refused; kept off the hot path. If the line bits turn out to be sound, the response is returned.
#[cold]
#[inline(never)]
fn line_refusal(request: Request, line: Window) -> Result<Response, Error> {
    let id = request.data_id();
    let fields = match unpack(line.bits()) {
        [cf, ..] if line.len() >= Frame::FIELD_BITS => expected_fields(id, cf),
        _ => id.response_fields(),
    };
    Response::parse(request, Frame::from_line(line, fields)?.as_bytes())
}

/// Checks that an EEPROM response is for the requested address.
fn check_address(memory: Memory, adf: Adf) -> Result<(), Error> {
    let (got, want) = (memory.adf.address(), adf.address());
    if got == want { Ok(()) } else { Err(Error::AddressMismatch { got: got.get(), want: want.get() }) }
}

#[cfg(test)]
pub(crate) mod tests;
