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

mod access;
mod file;
mod limits;
mod long;
mod requester;
mod resource;
mod responder;
mod short;

pub use access::AccessLevel;
pub use file::{FileName, FileStatus};
pub use limits::Limits;
pub use long::{Access, Data, Length, LongAnswer, LongRequest};
pub use requester::{Finished, Requester};
pub use resource::{Offset, ResourceAddress, ResourceError, ResourceErrorClass};
pub use responder::{Request, Responder};
pub use short::{RemoteRegister, ShortAnswer, ShortRequest};

use crate::crc::{RunningCrc16, crc16};
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

    const EMPTY: Self = Self { bytes: [0; Self::MAX], len: 0 };

    fn push(&mut self, more: &[u8]) {
        for byte in more {
            if let Some(place) = self.bytes.get_mut(usize::from(self.len)) {
                *place = *byte;
                self.len = self.len.saturating_add(1);
            }
        }
    }

    /// The message with its CRC.
    fn sealed(mut self) -> Self {
        let crc = crc16(self.as_bytes());
        self.push(&crc.to_be_bytes());
        self
    }

    /// The bytes in the order sent.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&self.bytes)
    }

    /// Nibble `at` in the order sent; `None` after the end.
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

/// A message on its way out: one nibble an H-frame, its CRC grows along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Sender {
    body: MessageBytes,
    crc: RunningCrc16,
    at: u8,
}

impl Sender {
    const fn new(body: MessageBytes) -> Self {
        Self { body, crc: RunningCrc16::new(), at: 0 }
    }

    /// The next nibble; `None` after the last one of the CRC.
    fn next(&mut self) -> Option<Nibble> {
        let at = self.at / 2;
        let [high, low] = self.crc.finish().to_be_bytes();
        let byte = match self.body.as_bytes().get(usize::from(at)) {
            Some(byte) => *byte,
            None if at == self.body.len => high,
            None if at == self.body.len.saturating_add(1) => low,
            None => return None,
        };
        let second = self.at % 2 == 1;
        if second && at < self.body.len {
            self.crc.update(byte);
        }
        self.at = self.at.saturating_add(1);
        Some(Nibble::truncate(if second { byte } else { byte >> 4 }))
    }
}

/// A message that is complete.
struct Gathered {
    bytes: MessageBytes,
    sound: bool,
}

impl Gathered {
    /// The bytes before the CRC if it is right.
    fn covered(&self) -> Option<&[u8]> {
        let (covered, _) = self.bytes.as_bytes().split_last_chunk::<2>()?;
        self.sound.then_some(covered)
    }

    fn is_long(&self) -> bool {
        self.bytes.as_bytes().first().is_some_and(|first| first & 0x80 != 0)
    }
}

/// Gathers the nibbles of one message; the length follows from the first byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Collector {
    bytes: MessageBytes,
    crc: RunningCrc16,
    high: Option<Nibble>,
    /// An IDLE was seen since the last message.
    ready: bool,
}

impl Collector {
    const fn new() -> Self {
        Self { bytes: MessageBytes::EMPTY, crc: RunningCrc16::new(), high: None, ready: true }
    }

    /// Something that is no nibble ends what was being gathered.
    #[inline]
    const fn idle(&mut self) {
        if !self.ready || self.high.is_some() || self.bytes.len != 0 {
            *self = Self::new();
        }
    }

    /// The message is complete; the next one begins after an IDLE.
    const fn finish(&mut self) -> Gathered {
        let gathered = Gathered { bytes: self.bytes, sound: self.crc.is_residue() };
        *self = Self { ready: false, ..Self::new() };
        gathered
    }

    /// Takes a nibble. Gives the message when `length`, told the first byte, says that it is complete.
    fn nibble(&mut self, nibble: Nibble, length: impl Fn(u8) -> usize) -> Option<Gathered> {
        if !self.ready {
            return None;
        }
        match self.high.take() {
            None => self.high = Some(nibble),
            Some(high) => {
                let byte = high.get() << 4 | nibble.get();
                self.crc.update(byte);
                self.bytes.push(&[byte]);
            }
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
