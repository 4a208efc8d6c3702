//! Messages nibble by nibble, one per H-frame.

use super::bytes::MessageBytes;
use super::long;
use crate::crc::RunningCrc16;
use crate::parameter::Nibble;

/// A message being sent, one nibble per H-frame; its CRC is computed along the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Sender {
    body: MessageBytes,
    crc: RunningCrc16,
    at: u8,
}

impl Sender {
    pub(super) const fn new(body: MessageBytes) -> Self {
        Self { body, crc: RunningCrc16::new(), at: 0 }
    }

    /// Returns the next nibble; `None` after the last one of the CRC.
    pub(super) fn next(&mut self) -> Option<Nibble> {
        let at = self.at / 2;
        let [high, low] = self.crc.finish().to_be_bytes();
        let byte = match self.body.as_bytes().get(usize::from(at)) {
            Some(byte) => *byte,
            None if at == self.body.len() => high,
            None if at == self.body.len().saturating_add(1) => low,
            None => return None,
        };
        let second = self.at % 2 == 1;
        if second && at < self.body.len() {
            self.crc.update(byte);
        }
        self.at = self.at.saturating_add(1);
        Some(Nibble::truncate(if second { byte } else { byte >> 4 }))
    }
}

/// Collects the nibbles of one message; the length follows from the first byte. A complete message stays until the next IDLE.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Collector {
    bytes: MessageBytes,
    crc: RunningCrc16,
    high: Option<Nibble>,
    /// An IDLE has come since the last message.
    ready: bool,
}

impl Collector {
    pub(super) const fn new() -> Self {
        Self { bytes: MessageBytes::EMPTY, crc: RunningCrc16::new(), high: None, ready: true }
    }

    /// The bytes with the CRC.
    pub(super) fn as_bytes(&self) -> &[u8] {
        self.bytes.as_bytes()
    }

    /// The bytes before the CRC, if it is correct.
    pub(super) fn covered(&self) -> Option<&[u8]> {
        let (covered, _) = self.as_bytes().split_last_chunk::<2>()?;
        self.crc.is_residue().then_some(covered)
    }

    pub(super) fn is_long(&self) -> bool {
        self.as_bytes().first().is_some_and(|first| first & 0x80 != 0)
    }

    /// Takes a symbol that is not a nibble, which ends what was being collected.
    #[inline]
    pub(super) const fn idle(&mut self) {
        if !self.ready || self.high.is_some() || self.bytes.len() != 0 {
            self.bytes.clear();
            (self.crc, self.high, self.ready) = (RunningCrc16::new(), None, true);
        }
    }

    /// Drops what was being collected; the next message begins after an IDLE.
    pub(super) const fn drop_message(&mut self) {
        self.ready = false;
    }

    /// Takes a nibble. Returns whether the message is complete according to `length`, which is given the first byte.
    pub(super) fn nibble(&mut self, nibble: Nibble, length: impl Fn(u8) -> usize) -> bool {
        if !self.ready {
            return false;
        }
        let Some(high) = self.high.take() else {
            self.high = Some(nibble);
            return false;
        };
        let byte = high.get() << 4 | nibble.get();
        self.crc.update(byte);
        self.bytes.push(&[byte]);
        let first = self.as_bytes().first().copied().unwrap_or(byte);
        let complete = usize::from(self.bytes.len()) >= length(first).min(MessageBytes::MAX);
        self.ready = !complete;
        complete
    }
}

/// Length in bytes of an answer that begins with this byte, CRC included.
pub(super) const fn answer_len(first: u8) -> usize {
    match (first & 0x80 != 0, first & 0x40 != 0) {
        (false, true) => 4,
        (false, false) => 3,
        (true, _) => long::answer_len(first),
    }
}

/// Length in bytes of a request that begins with this byte, CRC included.
pub(super) const fn request_len(first: u8) -> usize {
    match (first & 0x80 != 0, first & 0x40 != 0) {
        (false, true) => 3,
        (false, false) => 4,
        (true, _) => long::request_len(first),
    }
}
