//! All that can speak against a position, in one word, so that one mask says what is tolerated of it.
//!
//! ```text
//!  31 ... 27  26 ... 22  21     20          19             18      17          16        15 ... 8  7 ... 0
//!  abm_bits   abs_bits   NEVER  UPPER_BITS  OTHER_ENCODER  ABSENT  WIDE_TURNS  NO_TURNS  SF        ALMC
//! ```

use crate::status::{Almc, StatusField};

/// The response carries no turns, and the encoder has them.
pub(crate) const NO_TURNS: u32 = 1 << 16;
/// ABM has bits above its width. The turns are the field.
pub(crate) const WIDE_TURNS: u32 = 1 << 17;
/// There is no ABS.
pub(crate) const ABSENT: u32 = 1 << 18;
/// ENID contradicts the resolution. The single turn is ENID.
pub(crate) const OTHER_ENCODER: u32 = 1 << 19;
/// ABS has bits above its width. The single turn is the field.
pub(crate) const UPPER_BITS: u32 = 1 << 20;
/// There was no response.
pub(crate) const NEVER: u32 = 1 << 21;

/// All that speaks against a position. EA0 and EA1 do by the alarms that they may stand for.
pub(crate) const OBJECTIONS: u32 = 0x003f_cfff;

pub(crate) const fn of_widths(abs_bits: u8, abm_bits: u8) -> u32 {
    (abs_bits as u32) << 22 | (abm_bits as u32) << 27
}

pub(crate) const fn of_status(sf: StatusField) -> u32 {
    (sf.bits() as u32) << 8
}

pub(crate) const fn status(marks: u32) -> StatusField {
    StatusField::from_bits_retain(marks.to_le_bytes()[1])
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
