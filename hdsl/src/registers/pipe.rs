//! The FIFO of the pipe (SensorHub) channel.

use crate::symbol::{Control, Reading};

/// One word of the pipe channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Entry {
    byte: u8,
    /// PERR and PSCI.
    flags: u8,
}

/// The FIFO of eight bytes that PIPE_S and PIPE_D read (SICK manual, p. 52-53).
///
/// K30.7 means "no data" and is not stored. If the FIFO is full, the oldest entry is dropped and POVR is set.
///
/// ```text
///  PIPE_S   bit 3 POVR   entries were dropped since the last reading
///           bit 2 PEMP   the FIFO was empty
///           bit 1 PERR   this entry was no code word
///           bit 0 PSCI   this entry is a special character
/// ```
///
/// ```
/// use hdsl::registers::{PipeFifo, PipeReading};
/// use hdsl::symbol::{Character, Control, Rule, RunningDisparity};
///
/// let mut fifo = PipeFifo::new();
/// for character in [Character::data(0xfe), Character::control(Control::K30_7)] {
///     let word = character.encode(RunningDisparity::Plus).word;
///     fifo.put(word.read(Rule::Strict));
/// }
/// assert_eq!(fifo.take(), PipeReading { status: 0x00, data: 0xfe });
/// assert_eq!(fifo.take(), PipeReading { status: PipeFifo::PEMP, data: 0x00 });
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PipeFifo {
    entries: [Entry; 8],
    /// Index of the oldest entry.
    first: u8,
    len: u8,
    dropped: bool,
}

/// The result of reading the FIFO.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PipeReading {
    /// PIPE_S.
    pub status: u8,
    /// PIPE_D.
    pub data: u8,
}

impl PipeFifo {
    /// Entries have been dropped since the last reading.
    pub const POVR: u8 = 8;
    /// The FIFO was empty.
    pub const PEMP: u8 = 4;
    /// The entry was not a code word; its value is meaningless.
    pub const PERR: u8 = 2;
    /// The entry is a special character.
    pub const PSCI: u8 = 1;
    const SIZE: u8 = 8;

    /// Creates an empty FIFO.
    pub const fn new() -> Self {
        Self { entries: [Entry { byte: 0, flags: 0 }; 8], first: 0, len: 0, dropped: false }
    }

    /// Takes the word of an H-frame.
    pub fn put(&mut self, word: Reading) {
        if word.is(Control::K30_7) {
            return;
        }
        let flags = match (word.is_byte_error(), word.is_special()) {
            (true, _) => Self::PERR,
            (false, true) => Self::PSCI,
            (false, false) => 0,
        };
        let end = self.first.wrapping_add(self.len) % Self::SIZE;
        if let Some(entry) = self.entries.get_mut(usize::from(end)) {
            *entry = Entry { byte: word.raw(), flags };
        }
        if self.len == Self::SIZE {
            self.dropped = true;
            self.first = self.first.wrapping_add(1) % Self::SIZE;
        } else {
            self.len = self.len.saturating_add(1);
        }
    }

    /// Takes the oldest entry out.
    pub fn take(&mut self) -> PipeReading {
        if self.len == 0 {
            return PipeReading { status: Self::PEMP, data: 0 };
        }
        let overflow = if core::mem::take(&mut self.dropped) { Self::POVR } else { 0 };
        let entry = self.entries.get(usize::from(self.first)).copied().unwrap_or_default();
        self.first = self.first.wrapping_add(1) % Self::SIZE;
        self.len = self.len.saturating_sub(1);
        PipeReading { status: overflow | entry.flags, data: entry.byte }
    }

    /// Number of entries waiting.
    pub const fn len(&self) -> u8 {
        self.len
    }

    /// Returns whether no entry waits.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }
}
