use servowire_core::OutOfRange;

use super::bytes::{MessageBytes, checked};
use crate::error::Error;

/// A register of the encoder, 40h..=7Fh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
pub struct RemoteRegister(u8);

impl RemoteRegister {
    /// ENC_ST0, the first of eight status registers; writing clears it.
    pub const ENC_ST0: Self = Self(0x40);
    /// SRSSI, signal strength at the encoder, 0..=7; returns to 7 when read.
    pub const SRSSI: Self = Self(0x7c);
    /// MAIL, write only.
    pub const MAIL: Self = Self(0x7e);
    /// PING, keeps the value written to it; holds the hardware version after power-up.
    pub const PING: Self = Self(0x7f);

    /// Creates the address of a register; `None` outside 40h..=7Fh.
    pub const fn new(address: u8) -> Option<Self> {
        if address >> 6 == 1 { Some(Self(address)) } else { None }
    }

    /// Returns the register with this 6-bit index.
    pub const fn of_index(index: u8) -> Self {
        Self(index & 0x3f | 0x40)
    }

    /// The address, 40h..=7Fh.
    pub const fn address(self) -> u8 {
        self.0
    }

    /// The six bits that are transmitted, 0..=63.
    pub const fn index(self) -> u8 {
        self.0 & 0x3f
    }
}

impl TryFrom<u8> for RemoteRegister {
    type Error = OutOfRange;

    fn try_from(address: u8) -> Result<Self, OutOfRange> {
        let max = if address < 0x40 { 0x40 } else { 0x7f };
        Self::new(address).ok_or(OutOfRange { got: address.into(), max })
    }
}

impl From<RemoteRegister> for u8 {
    fn from(register: RemoteRegister) -> Self {
        register.0
    }
}

/// A short message to the encoder: access to one of its registers.
///
/// ```
/// use hdsl::message::{RemoteRegister, ShortRequest};
/// let read = ShortRequest::Read(RemoteRegister::SRSSI);
/// assert_eq!(read.emit().as_bytes(), [0x7c, 0xab, 0xf6]);
/// assert_eq!(read.parse_answer(&[0x7c, 0x07, 0x53, 0x3f]).map(|answer| answer.data), Ok(Some(7)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum ShortRequest {
    /// Read a register.
    Read(RemoteRegister),
    /// Write a register.
    Write(RemoteRegister, u8),
}

impl ShortRequest {
    /// The register.
    pub const fn register(self) -> RemoteRegister {
        match self {
            Self::Read(register) | Self::Write(register, _) => register,
        }
    }

    const fn first(self) -> u8 {
        match self {
            Self::Read(register) => 0x40 | register.index(),
            Self::Write(register, _) => register.index(),
        }
    }

    /// The bytes to send.
    pub fn emit(self) -> MessageBytes {
        self.body().sealed()
    }

    /// The bytes before the CRC.
    pub(super) fn body(self) -> MessageBytes {
        let mut bytes = MessageBytes::EMPTY;
        bytes.push(&[self.first()]);
        if let Self::Write(_, value) = self {
            bytes.push(&[value]);
        }
        bytes
    }

    /// Decodes received bytes as an encoder does. Bytes after the message are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::LongMessageStart`], [`Error::Crc`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let first = short_start(bytes)?;
        Self::of_covered(checked(bytes, super::nibbles::request_len(first))?)
    }

    /// Decodes the bytes before a correct CRC.
    pub(super) const fn of_covered(covered: &[u8]) -> Result<Self, Error> {
        match covered {
            [first] => Ok(Self::Read(RemoteRegister::of_index(*first))),
            [first, value] => Ok(Self::Write(RemoteRegister::of_index(*first), *value)),
            // Never: a short message has one or two bytes before its CRC.
            _ => Err(Error::Truncated { got: 0, want: 1 }),
        }
    }

    /// Decodes the answer to this request.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`], [`Error::LongMessageStart`], [`Error::Crc`], and [`Error::Header`] if a
    /// sound answer is for another register or the other direction. The length follows from the request, so a changed direction
    /// shows up as a wrong CRC.
    pub fn parse_answer(self, bytes: &[u8]) -> Result<ShortAnswer, Error> {
        short_start(bytes)?;
        self.answer_of_covered(checked(bytes, super::nibbles::answer_len(self.first()))?)
    }

    /// Decodes the bytes before a correct CRC.
    pub(super) fn answer_of_covered(self, covered: &[u8]) -> Result<ShortAnswer, Error> {
        let got = covered.first().copied().unwrap_or(0);
        if got != self.first() {
            return Err(Error::Header { got: u16::from(got), want: u16::from(self.first()) });
        }
        Ok(ShortAnswer { register: self.register(), data: covered.get(1).copied() })
    }
}

fn short_start(bytes: &[u8]) -> Result<u8, Error> {
    match bytes.first() {
        None => Err(Error::Truncated { got: 0, want: 3 }),
        Some(first) if first & 0x80 != 0 => Err(Error::LongMessageStart { first: *first }),
        Some(first) => Ok(*first),
    }
}

/// The encoder's answer to a short message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct ShortAnswer {
    /// The register.
    pub register: RemoteRegister,
    /// Its contents after a read; `None` after a write.
    pub data: Option<u8>,
}

impl ShortAnswer {
    /// The bytes to send.
    pub fn emit(self) -> MessageBytes {
        self.body().sealed()
    }

    /// The bytes before the CRC.
    pub(super) fn body(self) -> MessageBytes {
        let mut bytes = MessageBytes::EMPTY;
        match self.data {
            Some(data) => bytes.push(&[0x40 | self.register.index(), data]),
            None => bytes.push(&[self.register.index()]),
        }
        bytes
    }
}

servowire_core::one_line!(RemoteRegister {
    Self(address) => "{:02X}h", address;
});

servowire_core::one_line!(ShortRequest {
    Self::Read(register) => "read register {}", register;
    Self::Write(register, value) => "write register {} = {:02X}h", register, value;
});

servowire_core::one_line!(ShortAnswer {
    Self { register, data: Some(data) } => "register {} holds {:02X}h", register, data;
    Self { register, data: None } => "register {} is written", register;
});

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for RemoteRegister {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self::of_index(u8::arbitrary(from)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn all() -> impl Iterator<Item = ShortRequest> {
        (0..64).flat_map(|index| {
            let register = RemoteRegister::of_index(index);
            let writes = (0..=255).map(move |value| ShortRequest::Write(register, value));
            core::iter::once(ShortRequest::Read(register)).chain(writes)
        })
    }

    fn answer(request: ShortRequest, value: u8) -> ShortAnswer {
        let data = matches!(request, ShortRequest::Read(_)).then_some(value);
        ShortAnswer { register: request.register(), data }
    }

    #[test]
    fn as_a_log_shows_them() {
        use std::string::ToString;
        let write = ShortRequest::Write(RemoteRegister::PING, 0xa5);
        assert_eq!(write.to_string(), "write register 7Fh = A5h");
        assert_eq!(answer(write, 0).to_string(), "register 7Fh is written");
        assert_eq!(answer(ShortRequest::Read(RemoteRegister::SRSSI), 7).to_string(), "register 7Ch holds 07h");
        assert_eq!(RemoteRegister::try_from(0x80), Err(OutOfRange { got: 0x80, max: 0x7f }));
        assert_eq!(RemoteRegister::try_from(0x3f), Err(OutOfRange { got: 0x3f, max: 0x40 }));
    }

    #[test]
    fn every_request_and_answer_comes_back() {
        for request in all() {
            assert_eq!(ShortRequest::parse(request.emit().as_bytes()), Ok(request));
            for value in [0, 0x5a, 0xff] {
                let answer = answer(request, value);
                assert_eq!(request.parse_answer(answer.emit().as_bytes()), Ok(answer));
            }
        }
    }

    #[test]
    fn flips_and_truncations_are_refused_by_the_right_check() {
        for request in [ShortRequest::Read(RemoteRegister::PING), ShortRequest::Write(RemoteRegister::PING, 0xa5)] {
            let good: Vec<u8> = answer(request, 0x33).emit().as_bytes().to_vec();
            for bit in 0..good.len() * 8 {
                let mut bad = good.clone();
                bad[bit / 8] ^= 0x80 >> (bit % 8);
                match request.parse_answer(&bad).unwrap_err() {
                    Error::LongMessageStart { first } => assert_eq!((bit, first), (0, bad[0])),
                    error => assert!(bit > 0 && matches!(error, Error::Crc { .. })),
                }
            }
            for len in 0..good.len() {
                assert!(matches!(request.parse_answer(&good[..len]), Err(Error::Truncated { .. })));
                assert!(ShortRequest::parse(&request.emit().as_bytes()[..len.min(2)]).is_err());
            }
        }
        let other = ShortAnswer { register: RemoteRegister::MAIL, data: Some(1) }.emit();
        let want = Error::Header { got: 0x7e, want: 0x7f };
        assert_eq!(ShortRequest::Read(RemoteRegister::PING).parse_answer(other.as_bytes()), Err(want));
        assert_eq!((RemoteRegister::new(0x3f), RemoteRegister::new(0x80)), (None, None));
    }
}
