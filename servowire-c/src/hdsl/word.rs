//! 8b/10b words and the checks.

use core::mem::MaybeUninit;

use hdsl::DeltaDelta;
use hdsl::symbol::{Character, DisparityCheck, DisparityStatus, Reading, RunningDisparity, Word};

use super::error;
use super::names::{rule as rule_of, sw_hdsl_disparity_t};
use crate::border::{OK, Refused, border, in_range, read, there};
use crate::result::sw_result_t;

/// A character of 8b/10b.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_character_t {
    /// Its value.
    pub byte: u8,
    /// 1 for a special character (K), 0 for data (D).
    pub special: u8,
}

/// A 10-bit word as a receiver reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_reading_t {
    /// Its value; of a bad word what the rule makes of it.
    pub byte: u8,
    /// 1 for a special character.
    pub special: u8,
    /// 1: the word stands in neither column of the tables.
    pub byte_error: u8,
}

impl sw_hdsl_reading_t {
    pub(super) fn of(reading: Reading) -> Self {
        Self { byte: reading.raw(), special: reading.is_special().into(), byte_error: reading.is_byte_error().into() }
    }
}

pub(super) fn character(it: sw_hdsl_character_t) -> Result<Character, Refused> {
    in_range((it.special < 2).then_some((it.byte, it.special == 1)).and_then(|it| Character::try_from(it).ok()))
}

pub(super) fn disparity(rd: i8) -> Result<RunningDisparity, Refused> {
    in_range(match rd {
        -1 => Some(RunningDisparity::Minus),
        1 => Some(RunningDisparity::Plus),
        _ => None,
    })
}

pub(super) const fn sign(rd: RunningDisparity) -> i8 {
    match rd {
        RunningDisparity::Minus => -1,
        RunningDisparity::Plus => 1,
    }
}

fn word(raw: u16) -> Result<Word, Refused> {
    in_range(Word::new(raw))
}

/// The word of a character at a running disparity, -1 or 1, which becomes that after it. The first bit of the line is bit 0.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_build_word(
    it: Option<&sw_hdsl_character_t>,
    rd: Option<&mut i8>,
    out: Option<&mut MaybeUninit<u16>>,
) -> sw_result_t {
    border(|| {
        let (it, rd, out) = (character(*there(it)?)?, there(rd)?, there(out)?);
        let coded = it.encode(disparity(*rd)?);
        out.write(coded.word.get());
        *rd = sign(coded.disparity);
        OK
    })
}

/// How a dialect (sw_hdsl_dialect_t) reads a word.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_read_word(
    raw: u16,
    dialect: u8,
    reading: Option<&mut MaybeUninit<sw_hdsl_reading_t>>,
) -> sw_result_t {
    border(|| {
        let (word, rule, out) = (word(raw)?, rule_of(dialect)?, there(reading)?);
        out.write(sw_hdsl_reading_t::of(word.read(rule)));
        OK
    })
}

/// Ones minus zeros of the ten bits of a word.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_disparity(raw: u16) -> i8 {
    Word::truncate(raw & 0x3ff).disparity()
}

/// Whether a word stands in the column of the running disparity `rd` (sw_hdsl_disparity_t), which becomes that after it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_check_disparity(raw: u16, rd: Option<&mut i8>) -> sw_result_t {
    border(|| {
        let (word, rd) = (word(raw)?, there(rd)?);
        let mut check = DisparityCheck::new(disparity(*rd)?);
        let status = match check.step(word) {
            DisparityStatus::Ok => sw_hdsl_disparity_t::SW_HDSL_DISPARITY_OK,
            DisparityStatus::Disparity => sw_hdsl_disparity_t::SW_HDSL_DISPARITY_WRONG,
            DisparityStatus::Invalid => sw_hdsl_disparity_t::SW_HDSL_DISPARITY_INVALID,
        };
        *rd = sign(check.disparity());
        Ok(status as sw_result_t)
    })
}

/// The CRC-16 of safe positions and messages; its high byte is sent first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_crc16(
    bytes: *const u8,
    len: usize,
    crc: Option<&mut MaybeUninit<u16>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, crc) = (unsafe { read(bytes, len)? }, there(crc)?);
        crc.write(hdsl::crc16(bytes));
        OK
    })
}

/// The change of speed in an acceleration word, -1024..1023 steps. SW_E_HDSL_ACCELERATION_CRC.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_parse_acceleration(raw: u16, delta_delta: Option<&mut MaybeUninit<i16>>) -> sw_result_t {
    border(|| {
        there(delta_delta)?.write(DeltaDelta::from_word(raw).map_err(error)?.get());
        OK
    })
}

/// The acceleration word of a change of speed, -1024..1023 steps, with its CRC-5.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_build_acceleration(delta_delta: i16, out: Option<&mut MaybeUninit<u16>>) -> sw_result_t {
    border(|| {
        let out = there(out)?;
        out.write(in_range(DeltaDelta::new(delta_delta))?.to_word());
        OK
    })
}
