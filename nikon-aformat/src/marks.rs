//! The reasons against using a position, as bits of one word, so that one mask says which are tolerated.
//!
//! ```text
//!  30      29 ... 24  23     22          21      20        19 ... 16  15 ... 0
//!  SUMMED  st_bits    NEVER  UPPER_BITS  ABSENT  NO_TURNS  ES         ALM
//! ```

use crate::status::{Alm, EncoderStatus};

/// The response carries fewer bits of the turns than the encoder counts.
pub(crate) const NO_TURNS: u32 = 1 << 20;
/// The response carries less than a whole turn.
pub(crate) const ABSENT: u32 = 1 << 21;
/// Bits are set above the widths. The width of the single turn.
pub(crate) const UPPER_BITS: u32 = 1 << 22;
/// There was no response.
pub(crate) const NEVER: u32 = 1 << 23;
/// A single bit stands for all status bits.
pub(crate) const SUMMED: u32 = 1 << 30;

/// The reasons against using a position.
pub(crate) const OBJECTIONS: u32 = 0x00ff_ffff;

pub(crate) const fn of_status(status: EncoderStatus) -> u32 {
    (status.bits() as u32 & 0xf) << 16
}

pub(crate) const fn of_alarms(alarms: Alm) -> u32 {
    alarms.bits() as u32
}

pub(crate) const fn of_bits(st_bits: u8) -> u32 {
    (st_bits as u32) << 24
}

pub(crate) const fn status(marks: u32) -> EncoderStatus {
    EncoderStatus::from_bits_truncate(marks.to_le_bytes()[2])
}

pub(crate) const fn alarms(marks: u32) -> Alm {
    let [low, high, ..] = marks.to_le_bytes();
    Alm::from_bits_retain(u16::from_le_bytes([low, high]))
}

pub(crate) const fn single_turn_bits(marks: u32) -> u8 {
    marks.to_le_bytes()[3] & 0x3f
}
