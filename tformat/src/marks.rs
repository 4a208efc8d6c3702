//! The reasons against using a position, as bits of one word, so that one mask says which are tolerated.
//!
//! ```text
//!  31 ... 27  26 ... 22  21 20  19 18  17 ... 14  13     12          11             10      9           8         7 ... 0
//!  abm_bits   abs_bits   EA     CA     dd         NEVER  UPPER_BITS  OTHER_ENCODER  ABSENT  WIDE_TURNS  NO_TURNS  ALMC
//! ```

use crate::status::{Almc, StatusField};

/// The response carries no turns, and the encoder has them.
pub(crate) const NO_TURNS: u32 = 1 << 8;
/// ABM has bits above its width. The turns carry the raw field.
pub(crate) const WIDE_TURNS: u32 = 1 << 9;
/// There is no ABS.
pub(crate) const ABSENT: u32 = 1 << 10;
/// ENID contradicts the resolution. The single turn carries ENID.
pub(crate) const OTHER_ENCODER: u32 = 1 << 11;
/// ABS has bits above its width. The single turn carries the raw field.
pub(crate) const UPPER_BITS: u32 = 1 << 12;
/// There was no response.
pub(crate) const NEVER: u32 = 1 << 13;

/// The reasons against using a position. EA0 and EA1 are judged by the alarms that they may stand for.
pub(crate) const OBJECTIONS: u32 = 0x000f_ffff;

pub(crate) const fn of_widths(abs_bits: u8, abm_bits: u8) -> u32 {
    (abs_bits as u32) << 22 | (abm_bits as u32) << 27
}

pub(crate) const fn of_status(sf: StatusField) -> u32 {
    let sf = sf.bits() as u32;
    (sf & 0x0f) << 14 | (sf & 0xc0) << 12 | (sf & 0x30) << 16
}

pub(crate) const fn status(marks: u32) -> StatusField {
    let sf = marks >> 14 & 0x0f | marks >> 12 & 0xc0 | marks >> 16 & 0x30;
    StatusField::from_bits_retain(sf.to_le_bytes()[0])
}

pub(crate) const fn alarms(marks: u32) -> Almc {
    Almc::from_bits_retain(marks.to_le_bytes()[0])
}

pub(crate) const fn single_turn_bits(marks: u32) -> u8 {
    (marks >> 22 & 0x1f).to_le_bytes()[0]
}

pub(crate) const fn abm_bits(marks: u32) -> u32 {
    marks >> 27
}
