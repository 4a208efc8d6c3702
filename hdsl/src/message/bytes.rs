//! The bytes of a message.

use crate::crc::crc16;
use crate::error::Error;
use crate::parameter::Nibble;

/// The bytes of a message with its CRC, at most 14.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MessageBytes {
    bytes: [u8; Self::MAX],
    len: u8,
}

impl MessageBytes {
    /// Bytes of the longest message: a long write of 8 bytes with an offset.
    pub const MAX: usize = 14;

    pub(super) const EMPTY: Self = Self { bytes: [0; Self::MAX], len: 0 };

    pub(super) fn push(&mut self, more: &[u8]) {
        for byte in more {
            if let Some(place) = self.bytes.get_mut(usize::from(self.len)) {
                *place = *byte;
                self.len = self.len.saturating_add(1);
            }
        }
    }

    pub(super) const fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends the CRC to the message.
    pub(super) fn sealed(mut self) -> Self {
        let crc = crc16(self.as_bytes());
        self.push(&crc.to_be_bytes());
        self
    }

    pub(super) const fn len(&self) -> u8 {
        self.len
    }

    /// The bytes in the order sent.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&self.bytes)
    }

    /// Returns nibble `at` in the order sent; `None` after the end.
    pub fn nibble(&self, at: u8) -> Option<Nibble> {
        let byte = self.as_bytes().get(usize::from(at / 2))?;
        Some(Nibble::truncate(if at % 2 == 0 { byte >> 4 } else { *byte }))
    }
}

/// Returns the bytes before the CRC of a message of `len` bytes at the start of `bytes`.
pub(super) fn checked(bytes: &[u8], len: usize) -> Result<&[u8], Error> {
    let short = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
    let Some((covered, [high, low])) = bytes.get(..len).and_then(<[u8]>::split_last_chunk) else {
        return Err(Error::Truncated { got: short(bytes.len()), want: short(len) });
    };
    let (got, want) = (u16::from_be_bytes([*high, *low]), crc16(covered));
    if got == want { Ok(covered) } else { Err(Error::Crc { got, want }) }
}
