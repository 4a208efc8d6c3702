//! Answers and V-frames.

use core::mem::MaybeUninit;

use hdsl::{Answer, Content, DeltaDelta, EncoderByte, SafeBlock, VFrame, Window};

use super::error;
use super::names::rule as rule_of;
use super::word::{character, disparity, sign, sw_hdsl_character_t, sw_hdsl_reading_t};
use crate::border::{OK, border, in_range, read, there};
use crate::result::{sw_code_t, sw_result_t};

/// Bits of an answer.
pub const SW_HDSL_ANSWER_BITS: u32 = 61;
/// H-frames of a V-frame.
pub const SW_HDSL_V_FRAME: usize = 8;

/// An answer: its six words, and their content.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_answer_t {
    /// Vertical, parameter, pipe, two of the acceleration, secondary.
    pub words: [sw_hdsl_reading_t; 6],
    /// SW_OK, or why the acceleration must not be used.
    pub acceleration: sw_result_t,
    /// The parameter byte, 0..255, with VSYNC in bit 7, or why it cannot be read.
    pub parameter: sw_result_t,
    /// Change of speed, steps; 0 unless `acceleration` is SW_OK.
    pub delta_delta: i16,
    /// The switch bit is right.
    pub switch_ok: u8,
}

/// The parts of an answer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_content_t {
    /// Change of speed, -1024..1023 steps.
    pub delta_delta: i16,
    /// 1: the encoder has a value for this frame; 0: K29.7 K29.7 are sent in its place.
    pub accelerated: u8,
    /// Data byte of the vertical channel.
    pub vertical: u8,
    /// Parameter byte.
    pub parameter: u8,
    /// Pipe channel.
    pub pipe: sw_hdsl_character_t,
    /// Secondary channel.
    pub secondary: sw_hdsl_character_t,
}

/// A safe position with what came around it: as received, not yet a valid position.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_safe_t {
    /// Position, 40 bits.
    pub vpos: u64,
    /// SW_OK, or why the block must not be used.
    pub result: sw_result_t,
    /// CRC as received.
    pub crc: u16,
    /// Status byte.
    pub status: u8,
}

/// The two safe positions of a V-frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_v_frame_t {
    /// Safe channel 1, from the vertical words.
    pub safe1: sw_hdsl_safe_t,
    /// Safe channel 2, from the secondary words.
    pub safe2: sw_hdsl_safe_t,
}

/// Reads an answer by the rules of a dialect (sw_hdsl_dialect_t): `len` bits of the line, the first in bit
/// 0. Its channels are judged one by one; only bits that are no answer at all are refused,
/// SW_E_HDSL_TRUNCATED.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_parse_answer(
    bits: u64,
    len: u32,
    dialect: u8,
    answer: Option<&mut MaybeUninit<sw_hdsl_answer_t>>,
) -> sw_result_t {
    border(|| {
        let (rule, out) = (rule_of(dialect)?, there(answer)?);
        let line = in_range((len <= 64).then_some(()).and_then(|()| Window::from_bits(bits.into(), len)))?;
        let answer = Answer::parse(rule, line).map_err(error)?;
        let delta_delta = answer.delta_delta();
        out.write(sw_hdsl_answer_t {
            words: answer.words().map(sw_hdsl_reading_t::of),
            acceleration: delta_delta.map_or_else(error, |_| sw_code_t::SW_OK as sw_result_t),
            parameter: answer.parameter().map_or_else(error, |byte| byte.raw().into()),
            delta_delta: delta_delta.map_or(0, DeltaDelta::get),
            switch_ok: answer.switch_ok().into(),
        });
        OK
    })
}

/// The bits of an answer, the first of the line in bit 0, at a running disparity, -1 or 1, which becomes
/// the one after it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_build_answer(
    content: Option<&sw_hdsl_content_t>,
    rd: Option<&mut i8>,
    bits: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| {
        let (it, rd, bits) = (there(content)?, there(rd)?, there(bits)?);
        let accelerated = in_range((it.accelerated < 2).then_some(it.accelerated == 1))?;
        let content = Content {
            vertical: character(sw_hdsl_character_t { byte: it.vertical, special: 0 })?,
            parameter: EncoderByte::new(it.parameter),
            pipe: character(it.pipe)?,
            acceleration: if accelerated { Some(in_range(DeltaDelta::new(it.delta_delta))?) } else { None },
            secondary: character(it.secondary)?,
        };
        let coded = content.emit(disparity(*rd)?);
        bits.write(coded.bits);
        *rd = sign(coded.disparity);
        OK
    })
}

fn safe(block: &SafeBlock) -> sw_hdsl_safe_t {
    sw_hdsl_safe_t {
        vpos: block.raw_vpos(),
        result: block.vpos().map_or_else(error, |_| sw_code_t::SW_OK as sw_result_t),
        crc: block.raw_crc(),
        status: block.status(),
    }
}

/// The safe positions in the eight answers of a V-frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_parse_v_frame(
    bits: *const u64,
    len: usize,
    dialect: u8,
    v_frame: Option<&mut MaybeUninit<sw_hdsl_v_frame_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bits, rule, out) = (unsafe { read(bits, len)? }, rule_of(dialect)?, there(v_frame)?);
        let bits: &[u64; SW_HDSL_V_FRAME] = in_range(bits.try_into().ok())?;
        let frame = VFrame::of(rule, &bits.map(|bits| Answer::from_bits(rule, bits)));
        out.write(sw_hdsl_v_frame_t { safe1: safe(&frame.safe1), safe2: safe(&frame.safe2) });
        OK
    })
}

const _: () = assert!(SW_HDSL_ANSWER_BITS == hdsl::frame::ANSWER_BITS);
const _: () = assert!(SW_HDSL_V_FRAME == hdsl::frame::V_FRAME as usize);
