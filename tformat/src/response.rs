use nrz_line::{BitOrder, Window};

use crate::frame::{faults11, framing, is_framed, load, pack, unpack};
use crate::request::{check_crc, count};
use crate::{Adf, Almc, ControlField, DataId, Error, Frame, Request, StatusField, U24};

/// Answer to ID 0, 7, 8 and C.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SingleTurn {
    /// SF.
    pub sf: StatusField,
    /// ABS0..ABS2: position in the turn; its width is the encoder's, see [`Profile`](crate::Profile).
    pub abs: U24,
}

/// Answer to ID 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct MultiTurn {
    /// SF.
    pub sf: StatusField,
    /// ABM0..ABM2: turns.
    pub abm: U24,
}

/// Answer to ID 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct EncoderId {
    /// SF.
    pub sf: StatusField,
    /// ENID.
    pub enid: u8,
}

/// Answer to ID 3: all that an encoder knows, and also what it answers to a damaged request.
///
/// ```text
///  field  0    1    2    3    4    5     6    7    8    9     10
///         CF   SF  ABS0 ABS1 ABS2 ENID  ABM0 ABM1 ABM2 ALMC  CRC      TIDM-1011, table 2-5
///         1a
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Full {
    /// SF.
    pub sf: StatusField,
    /// ABS0..ABS2: position in the turn.
    pub abs: U24,
    /// ENID.
    pub enid: u8,
    /// ABM0..ABM2: turns.
    pub abm: U24,
    /// ALMC: the error byte.
    pub almc: Almc,
}

/// Answer to ID 6 and D.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Memory {
    /// ADF: address, and whether the memory was busy.
    pub adf: Adf,
    /// EDF: the byte read, or the written one repeated. Says nothing while the memory is busy.
    pub edf: u8,
}

/// What an encoder sends, by the data ID it answers.
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Response {
    /// Single-turn data.
    Id0(SingleTurn),
    /// Multi-turn data.
    Id1(MultiTurn),
    /// Encoder ID.
    Id2(EncoderId),
    /// Everything.
    Id3(Full),
    /// Echo of an EEPROM write.
    Id6(Memory),
    /// Single-turn data, after one of ten resets of the errors.
    Id7(SingleTurn),
    /// Single-turn data, after one of ten settings of the single-turn zero.
    Id8(SingleTurn),
    /// Single-turn data, after one of ten resets of turns and errors.
    IdC(SingleTurn),
    /// An EEPROM byte.
    IdD(Memory),
}

const CF3: u8 = DataId::Id3.control_field().get();

impl Full {
    /// Fields of the response.
    pub const FIELDS: usize = 11;

    /// Decodes the answer to ID 3 from UART bytes; bytes behind it are left alone.
    ///
    /// # Errors
    /// As [`Response::parse`] for ID 3.
    #[inline]
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        match bytes.first_chunk() {
            Some(b) if is_sound(b) => Ok(Self::of(b)),
            _ => Err(refusal(DataId::Id3, bytes)),
        }
    }

    /// Decodes the answer to ID 3 from its 110 line bits, the first of them at the beginning of `line`.
    ///
    /// For a window at another bit offset see [`Response::parse_line`].
    ///
    /// # Errors
    /// As [`Response::parse_line`] for ID 3.
    #[inline(always)]
    pub fn parse_line(line: &[u8; Frame::MAX_LINE_BYTES], order: BitOrder) -> Result<Self, Error> {
        let line = load(line, order);
        let b @ [cf, ..] = unpack(line);
        if faults11(line) | u32::from(cf ^ CF3) == 0 { Ok(Self::of(&b)) } else { Err(line_refusal(line)) }
    }

    /// The fields as UART bytes.
    pub const fn emit(self) -> [u8; Self::FIELDS] {
        let ([a0, a1, a2], [m0, m1, m2]) = (self.abs.to_le_bytes(), self.abm.to_le_bytes());
        let (sf, enid, almc) = (self.sf.raw(), self.enid, self.almc.raw());
        let crc = CF3 ^ sf ^ a0 ^ a1 ^ a2 ^ enid ^ m0 ^ m1 ^ m2 ^ almc;
        [CF3, sf, a0, a1, a2, enid, m0, m1, m2, almc, crc]
    }

    /// The 110 line bits in 14 bytes; the two bits behind them are 0.
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

    const fn of(b: &[u8; Self::FIELDS]) -> Self {
        let [_, sf, a0, a1, a2, enid, m0, m1, m2, almc, _] = *b;
        Self {
            sf: StatusField::new(sf),
            abs: U24::from_le_bytes([a0, a1, a2]),
            enid,
            abm: U24::from_le_bytes([m0, m1, m2]),
            almc: Almc::new(almc),
        }
    }
}

/// Whether eleven fields are an ID 3 frame with a good check field: the whole good path in four loads.
const fn is_sound(b: &[u8; Full::FIELDS]) -> bool {
    let [b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10] = *b;
    let sum = u32::from_le_bytes([b0, b1, b2, b3])
        ^ u32::from_le_bytes([b4, b5, b6, b7])
        ^ u32::from_le_bytes([b8, b9, b10, 0]);
    let sum = sum ^ sum >> 16;
    (sum ^ sum >> 8) & 0xff == 0 && b0 == CF3
}

impl Response {
    /// Decodes the answer to `request` from UART bytes; bytes behind the answer are left alone.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`] without any field, [`Error::SinkCode`], [`Error::Parity`],
    /// [`Error::CfMismatch`], [`Error::Truncated`], [`Error::Crc`], [`Error::AddressMismatch`],
    /// [`Error::DataMismatch`]. An ID 3 frame that was not asked for has to be complete and sound, then it is
    /// [`Error::Rejected`].
    pub fn parse(request: Request, bytes: &[u8]) -> Result<Self, Error> {
        let id = request.data_id();
        if id == DataId::Id3 {
            return Full::parse(bytes).map(Self::Id3);
        }
        let response = Self::of(id, check(id, bytes)?)?;
        if let Self::Id6(memory) | Self::IdD(memory) = response {
            check_echo(request, memory)?;
        }
        Ok(response)
    }

    /// Decodes the answer to `request` from line bits on a fixed grid: field k begins at bit 10 k of `line`.
    ///
    /// # Errors
    /// [`Error::StartBit`], [`Error::Delimiter`] or [`Error::Truncated`] for the first field that is not framed,
    /// then as [`parse`](Self::parse).
    pub fn parse_line(request: Request, line: Window) -> Result<Self, Error> {
        let id = request.data_id();
        let fields = match unpack(line.bits()) {
            [cf, ..] if line.len() >= Frame::FIELD_BITS => expected_fields(id, cf),
            _ => id.response_fields(),
        };
        let frame = Frame::from_line(line, fields)?;
        Self::parse(request, frame.as_bytes())
    }

    /// The data ID that is answered.
    pub const fn data_id(self) -> DataId {
        match self {
            Self::Id0(_) => DataId::Id0,
            Self::Id1(_) => DataId::Id1,
            Self::Id2(_) => DataId::Id2,
            Self::Id3(_) => DataId::Id3,
            Self::Id6(_) => DataId::Id6,
            Self::Id7(_) => DataId::Id7,
            Self::Id8(_) => DataId::Id8,
            Self::IdC(_) => DataId::IdC,
            Self::IdD(_) => DataId::IdD,
        }
    }

    /// The fields to send.
    pub const fn emit(self) -> Frame {
        let cf = self.data_id().control_field().get();
        match self {
            Self::Id0(v) | Self::Id7(v) | Self::Id8(v) | Self::IdC(v) => Frame::of6(six_fields(cf, v.sf, v.abs)),
            Self::Id1(v) => Frame::of6(six_fields(cf, v.sf, v.abm)),
            Self::Id2(v) => Frame::of4([cf, v.sf.raw(), v.enid, cf ^ v.sf.raw() ^ v.enid]),
            Self::Id3(v) => Frame::of11(v.emit()),
            Self::Id6(v) | Self::IdD(v) => Frame::of4([cf, v.adf.raw(), v.edf, cf ^ v.adf.raw() ^ v.edf]),
        }
    }

    /// SF, which all responses but those of the EEPROM carry.
    pub const fn status(self) -> Option<StatusField> {
        match self {
            Self::Id0(v) | Self::Id7(v) | Self::Id8(v) | Self::IdC(v) => Some(v.sf),
            Self::Id1(v) => Some(v.sf),
            Self::Id2(v) => Some(v.sf),
            Self::Id3(v) => Some(v.sf),
            Self::Id6(_) | Self::IdD(_) => None,
        }
    }

    /// ABS, in the responses that carry it.
    pub const fn abs(self) -> Option<U24> {
        match self {
            Self::Id0(v) | Self::Id7(v) | Self::Id8(v) | Self::IdC(v) => Some(v.abs),
            Self::Id3(v) => Some(v.abs),
            _ => None,
        }
    }

    /// Fields that were checked, taken apart.
    fn of(id: DataId, fields: &[u8]) -> Result<Self, Error> {
        let single = |sf, d0, d1, d2| SingleTurn { sf: StatusField::new(sf), abs: U24::from_le_bytes([d0, d1, d2]) };
        Ok(match (id, fields) {
            (DataId::Id0, &[_, sf, d0, d1, d2, _]) => Self::Id0(single(sf, d0, d1, d2)),
            (DataId::Id7, &[_, sf, d0, d1, d2, _]) => Self::Id7(single(sf, d0, d1, d2)),
            (DataId::Id8, &[_, sf, d0, d1, d2, _]) => Self::Id8(single(sf, d0, d1, d2)),
            (DataId::IdC, &[_, sf, d0, d1, d2, _]) => Self::IdC(single(sf, d0, d1, d2)),
            (DataId::Id1, &[_, sf, d0, d1, d2, _]) => {
                Self::Id1(MultiTurn { sf: StatusField::new(sf), abm: U24::from_le_bytes([d0, d1, d2]) })
            }
            (DataId::Id2, &[_, sf, enid, _]) => Self::Id2(EncoderId { sf: StatusField::new(sf), enid }),
            (DataId::Id6, &[_, adf, edf, _]) => Self::Id6(Memory { adf: Adf::new(adf), edf }),
            (DataId::IdD, &[_, adf, edf, _]) => Self::IdD(Memory { adf: Adf::new(adf), edf }),
            // ID 3 was decoded before; every other slice has the length of its response.
            _ => return Err(Error::Truncated { got: count(fields), want: id.response_fields() }),
        })
    }
}

const fn six_fields(cf: u8, sf: StatusField, data: U24) -> [u8; 6] {
    let (sf, [d0, d1, d2]) = (sf.raw(), data.to_le_bytes());
    [cf, sf, d0, d1, d2, cf ^ sf ^ d0 ^ d1 ^ d2]
}

/// How many fields the answer to a request for `id` has when it begins with `cf`: an ID 3 frame that was not
/// asked for is the encoder's refusal.
pub(crate) const fn expected_fields(id: DataId, cf: u8) -> u8 {
    if cf == CF3 { DataId::Id3.response_fields() } else { id.response_fields() }
}

/// Control field, length and check field of an answer to `id`; gives its fields.
fn check(id: DataId, bytes: &[u8]) -> Result<&[u8], Error> {
    let want = id.response_fields();
    let Some(&cf) = bytes.first() else { return Err(Error::Truncated { got: 0, want }) };
    let wanted = id.control_field();
    if cf != wanted.get() {
        let got = ControlField::parse(cf)?.get();
        return Err(if got == CF3 { rejection(bytes) } else { Error::CfMismatch { got, want: wanted.get() } });
    }
    let Some(fields) = bytes.get(..usize::from(want)) else { return Err(Error::Truncated { got: count(bytes), want }) };
    check_crc(fields)?;
    Ok(fields)
}

/// What an ID 3 frame that was not asked for means.
#[cold]
fn rejection(bytes: &[u8]) -> Error {
    match Full::parse(bytes) {
        Ok(full) => Error::Rejected { sf: full.sf },
        Err(error) => error,
    }
}

/// Off the hot path: why the line bits of an answer to ID 3 are refused.
///
/// It takes the bits and not the fields, or the good path would have to write the fields down.
#[cold]
#[inline(never)]
fn line_refusal(line: u128) -> Error {
    match Window::from_bits(line, 110) {
        Some(window) if !is_framed(line, 110) => framing(window, 11),
        _ => refusal(DataId::Id3, &unpack(line)),
    }
}

/// Off the hot path: why an answer to `id` is refused.
#[cold]
#[inline(never)]
fn refusal(id: DataId, bytes: &[u8]) -> Error {
    match check(id, bytes) {
        Err(error) => error,
        // Never: the caller saw a fault.
        Ok(_) => Error::Truncated { got: count(bytes), want: id.response_fields() },
    }
}

/// Whether an EEPROM answer speaks of the address that was asked for and, after a write, of the same data.
///
/// A busy memory did not do the operation; its data byte says nothing and is not compared.
fn check_echo(request: Request, memory: Memory) -> Result<(), Error> {
    let (Request::Id6 { adf, .. } | Request::IdD { adf }) = request else { return Ok(()) };
    let (got, want) = (memory.adf.address(), adf.address());
    if got != want {
        return Err(Error::AddressMismatch { got: got.get(), want: want.get() });
    }
    match request {
        Request::Id6 { edf, .. } if edf != memory.edf && !memory.adf.busy() => {
            Err(Error::DataMismatch { got: memory.edf, want: edf })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
pub(crate) mod tests;
