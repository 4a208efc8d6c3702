use crate::crc::crc8;
use crate::error::Error;

/// Bytes of a frame.
pub const LEN: usize = 3;

/// The first byte of a frame.
pub const HEADER: u8 = 0x5a;

/// A frame.
///
/// ```text
/// byte 0     1       2
///      5Ah   value   CRC-8 over bytes 0 and 1
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Frame {
    /// What it carries, 0..=255.
    pub value: u8,
}

impl Frame {
    /// Decodes a frame.
    ///
    /// # Errors
    /// All of [`Error`] but [`Error::Combinator`], in their order.
    #[expect(clippy::cast_possible_truncation, reason = "compared before")]
    pub const fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let &[header, value, check] = bytes else {
            let got = if bytes.len() > u16::MAX as usize { u16::MAX } else { bytes.len() as u16 };
            let want = LEN as u16;
            return Err(if got < want { Error::Truncated { got, want } } else { Error::TooLong { got, want } });
        };
        if header != HEADER {
            return Err(Error::Header { got: header });
        }
        let want = crc8(&[header, value]);
        if check == want { Ok(Self { value }) } else { Err(Error::Crc { got: check, want }) }
    }

    /// The bytes of the frame.
    pub const fn emit(self) -> [u8; LEN] {
        [HEADER, self.value, crc8(&[HEADER, self.value])]
    }
}

servowire_core::one_line!(Frame { Self { value } => "{}", value; });
