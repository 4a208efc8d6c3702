//! Messages over the parameters channel: one nibble an H-frame in each direction.
//!
//! ```text
//!  first byte   bit 7   0 short, 1 long       bit 6   1 read, 0 write
//!
//!  short read   40h|reg              CRC CRC    ->   40h|reg  data      CRC CRC
//!  short write  reg      data        CRC CRC    ->   reg                CRC CRC
//!  long         ADD_H ADD_L [OFF_H OFF_L] [data] CRC CRC
//!                                               ->   ADD_H ADD_L [data] CRC CRC
//! ```
//!
//! Each byte goes high nibble first, and at least one IDLE is between two messages. How long an encoder takes for an
//! answer is not limited.

mod long;
mod requester;
mod responder;
mod short;

pub use long::{Access, Data, Length, LongAnswer, LongRequest, Offset, ResourceAddress, ResourceError};
pub use requester::{Finished, Limits, Requester};
pub use responder::{Request, Responder};
pub use short::{RemoteRegister, ShortAnswer, ShortRequest};

use crate::{Error, Nibble, crc16};

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

    const EMPTY: Self = Self { bytes: [0; Self::MAX], len: 0 };

    fn push(&mut self, more: &[u8]) {
        for byte in more {
            if let Some(place) = self.bytes.get_mut(usize::from(self.len)) {
                *place = *byte;
                self.len = self.len.saturating_add(1);
            }
        }
    }

    /// The same with its CRC behind it.
    fn sealed(mut self) -> Self {
        let crc = crc16(self.as_bytes());
        self.push(&crc.to_be_bytes());
        self
    }

    /// The bytes in the order sent.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&self.bytes)
    }

    /// Nibble `at` in the order sent; `None` behind the end.
    pub fn nibble(&self, at: u8) -> Option<Nibble> {
        let byte = self.as_bytes().get(usize::from(at / 2))?;
        Some(Nibble::truncate(if at % 2 == 0 { byte >> 4 } else { *byte }))
    }
}

/// The bytes before the CRC of a message of `len` bytes at the beginning of `bytes`.
fn checked(bytes: &[u8], len: usize) -> Result<&[u8], Error> {
    let short = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
    let Some((covered, [high, low])) = bytes.get(..len).and_then(<[u8]>::split_last_chunk) else {
        return Err(Error::Truncated { got: short(bytes.len()), want: short(len) });
    };
    let (got, want) = (u16::from_be_bytes([*high, *low]), crc16(covered));
    if got == want { Ok(covered) } else { Err(Error::Crc { got, want }) }
}

/// Gathers the nibbles of one message; the length follows from the first byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Collector {
    bytes: MessageBytes,
    high: Option<Nibble>,
    /// An IDLE was seen since the last message.
    ready: bool,
}

impl Collector {
    const fn new() -> Self {
        Self { bytes: MessageBytes::EMPTY, high: None, ready: true }
    }

    /// Something that is no nibble ends what was being gathered.
    const fn idle(&mut self) {
        *self = Self::new();
    }

    /// The message is complete; the next one begins after an IDLE.
    const fn finish(&mut self) -> MessageBytes {
        let bytes = self.bytes;
        *self = Self { bytes: MessageBytes::EMPTY, high: None, ready: false };
        bytes
    }

    /// Takes a nibble. Gives the message when `length`, told the first byte, says that it is complete.
    fn nibble(&mut self, nibble: Nibble, length: impl Fn(u8) -> usize) -> Option<MessageBytes> {
        if !self.ready {
            return None;
        }
        match self.high.take() {
            None => self.high = Some(nibble),
            Some(high) => self.bytes.push(&[high.get() << 4 | nibble.get()]),
        }
        let first = self.bytes.as_bytes().first()?;
        let complete = self.high.is_none() && usize::from(self.bytes.len) >= length(*first).min(MessageBytes::MAX);
        complete.then(|| self.finish())
    }
}

/// Bytes of an answer that begins with this byte, CRC included.
const fn answer_len(first: u8) -> usize {
    match (first & 0x80 != 0, first & 0x40 != 0) {
        (false, true) => 4,
        (false, false) => 3,
        (true, _) => long::answer_len(first),
    }
}

/// Bytes of a request that begins with this byte, CRC included.
const fn request_len(first: u8) -> usize {
    match (first & 0x80 != 0, first & 0x40 != 0) {
        (false, true) => 3,
        (false, false) => 4,
        (true, _) => long::request_len(first),
    }
}
