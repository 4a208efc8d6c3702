use super::bytes::{MessageBytes, checked};
use crate::error::Error;
use crate::resource::{Named, Offset, ResourceAddress, ResourceError};

servowire_core::codes! {
    /// LLEN: how many data bytes a long message carries or requests.
    #[derive(Default)]
    #[allow(missing_docs, reason = "the name says how many")]
    pub enum Length: u8 {
        #[default]
        None = 0 => "0",
        Two = 1 => "2",
        Four = 2 => "4",
        Eight = 3 => "8",
    }
}

impl Length {
    /// LLEN in bits 3:2 of the first byte of a header.
    pub(crate) const fn in_header(first: u8) -> Self {
        match first >> 2 & 3 {
            0 => Self::None,
            1 => Self::Two,
            2 => Self::Four,
            _ => Self::Eight,
        }
    }

    /// 0, 2, 4 or 8.
    pub const fn bytes(self) -> usize {
        match self {
            Self::None => 0,
            Self::Two => 2,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

/// 0, 2, 4 or 8 bytes of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "(Length, [u8; 8])", into = "(Length, [u8; 8])")
)]
pub struct Data {
    bytes: [u8; 8],
    length: Length,
}

impl Data {
    /// No data.
    pub const NONE: Self = Self { bytes: [0; 8], length: Length::None };

    /// Copies `bytes`.
    ///
    /// # Errors
    /// [`Error::DataLength`] unless there are 0, 2, 4 or 8.
    pub fn new(bytes: &[u8]) -> Result<Self, Error> {
        let length = match bytes.len() {
            0 => Length::None,
            2 => Length::Two,
            4 => Length::Four,
            8 => Length::Eight,
            other => return Err(Error::DataLength { len: u8::try_from(other).unwrap_or(u8::MAX) }),
        };
        let mut data = Self { bytes: [0; 8], length };
        for (to, from) in data.bytes.iter_mut().zip(bytes) {
            *to = *from;
        }
        Ok(data)
    }

    /// Creates data of eight bytes.
    pub const fn eight(bytes: [u8; 8]) -> Self {
        Self { bytes, length: Length::Eight }
    }

    /// All eight bytes; those after the data are 0.
    pub const fn padded(&self) -> [u8; 8] {
        self.bytes
    }

    /// LLEN.
    pub const fn length(&self) -> Length {
        self.length
    }

    /// The bytes.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.length.bytes()).unwrap_or(&self.bytes)
    }
}

impl TryFrom<(Length, [u8; 8])> for Data {
    type Error = Error;

    /// Creates data from a length and eight bytes; the bytes after the data have to be 0.
    fn try_from((length, bytes): (Length, [u8; 8])) -> Result<Self, Error> {
        let data = Self::new(bytes.get(..length.bytes()).unwrap_or(&bytes))?;
        if data.bytes == bytes { Ok(data) } else { Err(Error::DataLength { len: 8 }) }
    }
}

impl From<Data> for (Length, [u8; 8]) {
    fn from(data: Data) -> Self {
        (data.length, data.bytes)
    }
}

servowire_core::one_line!(Data {
    Self { length: Length::None, .. } => "";
    Self { length: Length::Two, bytes: [a, b, ..] } => "{:02X} {:02X}", a, b;
    Self { length: Length::Four, bytes: [a, b, c, d, ..] } => "{:02X} {:02X} {:02X} {:02X}", a, b, c, d;
    Self { bytes: [b0, b1, b2, b3, b4, b5, b6, b7], .. } =>
        "{:02X} {:02X} {:02X} {:02X} {:02X} {:02X} {:02X} {:02X}", b0, b1, b2, b3, b4, b5, b6, b7;
});

/// What a long message asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Access {
    /// Read this many bytes.
    Read(Length),
    /// Write these bytes.
    Write(Data),
}

/// A long message to the encoder: access to one of its resources.
///
/// ```text
///  ADD_H   1 | LRW | LOFF | LIND | LLEN1 LLEN0 | A9 A8      LRW 1 read, LIND 1 indirect
///  ADD_L   A7 ... A0
///  OFF_H   1 | offset 14:8                                  only with LOFF = 1
///  OFF_L   offset 7:0
///  data    only in a write
/// ```
///
/// ```
/// use hdsl::message::{Access, Length, LongRequest, ResourceAddress};
/// let request = LongRequest {
///     address: ResourceAddress::RESOLUTN,
///     indirect: false,
///     offset: None,
///     access: Access::Read(Length::Eight),
/// };
/// assert_eq!(request.emit().as_bytes(), [0xcc, 0x81, 0xc1, 0x0b]);
/// let answer = request.parse_answer(b"\xcc\x81RESOLUTN\xdb\x8c");
/// assert_eq!(answer.map(|data| data.as_bytes() == b"RESOLUTN"), Ok(true));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct LongRequest {
    /// Which resource.
    pub address: ResourceAddress,
    /// LIND: indirect access, through the resource's node.
    pub indirect: bool,
    /// Offset; an offset of 0 is not the same as none.
    pub offset: Option<Offset>,
    /// What to do.
    pub access: Access,
}

const MARK: u8 = 0x80;
const LRW: u8 = 0x40;
const LOFF: u8 = 0x20;
const LIND: u8 = 0x10;

const fn header(address: ResourceAddress, read: bool, off: bool, indirect: bool, length: Length) -> [u8; 2] {
    let [high, low] = address.get().to_be_bytes();
    let flags = if read { LRW } else { 0 } | if off { LOFF } else { 0 } | if indirect { LIND } else { 0 };
    [MARK | flags | length.code() << 2 | high, low]
}

const fn address(first: u8, second: u8) -> ResourceAddress {
    ResourceAddress::truncate(u16::from_be_bytes([first & 3, second]))
}

/// Length in bytes of a long request that begins with this byte.
pub(super) const fn request_len(first: u8) -> usize {
    let offset = if first & LOFF != 0 { 2 } else { 0 };
    let data = if first & LRW == 0 { Length::in_header(first).bytes() } else { 0 };
    4_usize.saturating_add(offset).saturating_add(data)
}

/// Length in bytes of a long answer that begins with this byte. The acknowledgement of a write has no data, whatever its LLEN.
pub(super) const fn answer_len(first: u8) -> usize {
    let has_data = first & (LRW | LOFF) != 0;
    4_usize.saturating_add(if has_data { Length::in_header(first).bytes() } else { 0 })
}

fn long_start(bytes: &[u8]) -> Result<u8, Error> {
    match bytes.first() {
        None => Err(Error::Truncated { got: 0, want: 4 }),
        Some(first) if first & MARK == 0 => Err(Error::ShortMessageStart { first: *first }),
        Some(first) => Ok(*first),
    }
}

impl LongRequest {
    /// Reads the value of a resource, from the beginning.
    pub const fn read(address: ResourceAddress, length: Length) -> Self {
        Self { address, indirect: true, offset: None, access: Access::Read(length) }
    }

    /// Reads the value of a resource, starting at `offset`.
    pub const fn read_at(address: ResourceAddress, offset: Offset, length: Length) -> Self {
        Self { address, indirect: true, offset: Some(offset), access: Access::Read(length) }
    }

    /// Reads the eight characters of a resource's name.
    pub const fn read_name(address: ResourceAddress) -> Self {
        Self { address, indirect: false, offset: None, access: Access::Read(Length::Eight) }
    }

    /// Reads an attribute of a resource, two bytes: 1 data size, 2 read level, 3 write level, 4 time-out in ms, 5 data type.
    pub const fn read_attribute(address: ResourceAddress, attribute: Offset) -> Self {
        Self { address, indirect: false, offset: Some(attribute), access: Access::Read(Length::Two) }
    }

    const fn is_read(&self) -> bool {
        matches!(self.access, Access::Read(_))
    }

    /// PC_ADD_H and PC_ADD_L of the request.
    pub(crate) const fn header(&self) -> [u8; 2] {
        let length = match &self.access {
            Access::Read(length) => *length,
            Access::Write(data) => data.length,
        };
        header(self.address, self.is_read(), self.offset.is_some(), self.indirect, length)
    }

    /// The bytes to send.
    pub fn emit(&self) -> MessageBytes {
        self.body().sealed()
    }

    /// The bytes before the CRC.
    pub(super) fn body(&self) -> MessageBytes {
        let mut bytes = MessageBytes::EMPTY;
        bytes.push(&self.header());
        if let Some(offset) = self.offset {
            bytes.push(&(offset.get() | 0x8000).to_be_bytes());
        }
        if let Access::Write(data) = &self.access {
            bytes.push(data.as_bytes());
        }
        bytes
    }

    /// Decodes received bytes as an encoder does. Bytes after the message are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::ShortMessageStart`], [`Error::Crc`], and [`Error::ShortMessageStart`] for an
    /// OFF_H without its marker bit.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let first = long_start(bytes)?;
        Self::of_covered(checked(bytes, request_len(first))?)
    }

    /// Decodes the bytes before a correct CRC.
    pub(super) fn of_covered(covered: &[u8]) -> Result<Self, Error> {
        let (Some([first, low]), Some(mut rest)) = (covered.first_chunk(), covered.get(2..)) else {
            return Err(Error::Truncated { got: 0, want: 2 });
        };
        let mut offset = None;
        if let (true, Some(([high, low], after))) = (first & LOFF != 0, rest.split_first_chunk()) {
            if high & MARK == 0 {
                return Err(Error::ShortMessageStart { first: *high });
            }
            offset = Some(Offset::truncate(u16::from_be_bytes([*high, *low])));
            rest = after;
        }
        let access =
            if first & LRW != 0 { Access::Read(Length::in_header(*first)) } else { Access::Write(Data::new(rest)?) };
        Ok(Self { address: address(*first, *low), indirect: first & LIND != 0, offset, access })
    }

    /// Returns the data in the answer to this request; none after a write.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`], [`Error::ShortMessageStart`], [`Error::Crc`], [`Error::Header`] if a sound answer is
    /// for another request or carries less or more data than requested, [`Error::Resource`] if the encoder refused.
    pub fn parse_answer(&self, bytes: &[u8]) -> Result<Data, Error> {
        let answer = LongAnswer::parse(bytes)?;
        self.check_answer(answer)?;
        answer.result.map_err(|error| Error::Resource { error })
    }

    /// Returns whether a sound answer belongs to this request.
    pub(super) fn check_answer(&self, answer: LongAnswer) -> Result<(), Error> {
        let (wanted, length) = match (&self.access, &answer.result) {
            (Access::Read(length), Ok(data)) => (*length, data.length),
            _ => (Length::None, Length::None),
        };
        let want = header(self.address, self.is_read(), false, self.indirect, wanted);
        let got = header(answer.address, answer.read, false, answer.indirect, length);
        if got != want {
            return Err(Error::Header { got: u16::from_be_bytes(got), want: u16::from_be_bytes(want) });
        }
        Ok(())
    }
}

/// The encoder's answer to a long message. LOFF = 1 marks an error, in which case a two-byte error code follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct LongAnswer {
    /// Which resource.
    pub address: ResourceAddress,
    /// Whether this is the answer to a read.
    pub read: bool,
    /// LIND.
    pub indirect: bool,
    /// The data read, nothing after a write, or the error.
    pub result: Result<Data, ResourceError>,
}

impl LongAnswer {
    /// Creates the answer to a request.
    pub const fn to(request: &LongRequest, result: Result<Data, ResourceError>) -> Self {
        Self { address: request.address, read: request.is_read(), indirect: request.indirect, result }
    }

    /// PC_ADD_H and PC_ADD_L of the answer.
    pub(crate) const fn header(&self) -> [u8; 2] {
        let (error, length) = match &self.result {
            Ok(data) if self.read => (false, data.length),
            Ok(_) => (false, Length::None),
            Err(_) => (true, Length::Two),
        };
        header(self.address, self.read, error, self.indirect, length)
    }

    /// The bytes to send. Data of an acknowledged write are not sent.
    pub fn emit(&self) -> MessageBytes {
        self.body().sealed()
    }

    /// The bytes before the CRC.
    pub(super) fn body(&self) -> MessageBytes {
        let mut bytes = MessageBytes::EMPTY;
        bytes.push(&self.header());
        match &self.result {
            Ok(data) => {
                let data = if self.read { *data } else { Data::NONE };
                bytes.push(data.as_bytes());
            }
            Err(error) => {
                bytes.push(&[error.detail(), error.class_code()]);
            }
        }
        bytes
    }

    /// Decodes an answer. Bytes after it are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::ShortMessageStart`], [`Error::Crc`]; [`Error::DataLength`] for an error answer that is not
    /// two bytes long.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let first = long_start(bytes)?;
        Self::of_covered(checked(bytes, answer_len(first))?)
    }

    /// Decodes the bytes before a correct CRC.
    pub(super) fn of_covered(covered: &[u8]) -> Result<Self, Error> {
        let (Some([first, low]), Some(rest)) = (covered.first_chunk(), covered.get(2..)) else {
            return Err(Error::Truncated { got: 0, want: 2 });
        };
        let result = match (first & LOFF != 0, rest) {
            (false, data) => Ok(Data::new(data)?),
            (true, [detail, class]) => Err(ResourceError::new(*class, *detail)),
            (true, other) => return Err(Error::DataLength { len: u8::try_from(other.len()).unwrap_or(u8::MAX) }),
        };
        Ok(Self { address: address(*first, *low), read: first & LRW != 0, indirect: first & LIND != 0, result })
    }
}

impl LongRequest {
    const fn verb(&self) -> &'static str {
        match (self.indirect, self.is_read()) {
            (true, true) => "indirect read of",
            (true, false) => "indirect write to",
            (false, true) => "direct read of",
            (false, false) => "direct write to",
        }
    }

    /// The offset, as shown in text.
    const fn shown_offset(&self) -> u16 {
        match self.offset {
            Some(offset) => offset.get(),
            None => 0,
        }
    }
}

// `indirect read of 081h RESOLUTN, 4 bytes, offset 0`
servowire_core::one_line!(LongRequest {
    request @ Self { access: Access::Read(length), address, offset: None, .. } =>
        "{} {}, {} bytes", request.verb(), Named(*address), length.bytes();
    request @ Self { access: Access::Read(length), address, .. } =>
        "{} {}, {} bytes, offset {}", request.verb(), Named(*address), length.bytes(), request.shown_offset();
    request @ Self { access: Access::Write(Data { length: Length::None, .. }), address, offset: None, .. } =>
        "{} {} without data", request.verb(), Named(*address);
    request @ Self { access: Access::Write(Data { length: Length::None, .. }), address, .. } =>
        "{} {} without data, offset {}", request.verb(), Named(*address), request.shown_offset();
    request @ Self { access: Access::Write(data), address, offset: None, .. } =>
        "{} {}: {}", request.verb(), Named(*address), data;
    request @ Self { access: Access::Write(data), address, .. } =>
        "{} {}: {}, offset {}", request.verb(), Named(*address), data, request.shown_offset();
});

// `081h RESOLUTN holds 00 80 00 00`
servowire_core::one_line!(LongAnswer {
    Self { address, result: Ok(data), read: true, .. } => "{} holds {}", Named(*address), data;
    Self { address, result: Ok(_), .. } => "{} is written", Named(*address);
    Self { address, result: Err(error), .. } => "{} refused: {}", Named(*address), error;
});

#[cfg(feature = "arbitrary")]
#[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
impl<'a> arbitrary::Arbitrary<'a> for Data {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        let length = Length::arbitrary(from)?;
        let mut bytes = [0; 8];
        for byte in bytes.iter_mut().take(length.bytes()) {
            *byte = u8::arbitrary(from)?;
        }
        Ok(Self { bytes, length })
    }
}

#[cfg(test)]
pub(crate) mod tests;
