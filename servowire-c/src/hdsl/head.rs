//! The head of an H-frame: parameter byte, line disparity, EXTRA window.

use core::mem::MaybeUninit;

use hdsl::frame::{Extra, Head, Stuffing};
use hdsl::symbol::Word;
use hdsl::sync::ExtraWindow;
use hdsl::{LineDisparity, ParameterByte, Window};

use super::error;
use crate::border::{OK, Refused, border, fill, in_range, room, there};
use crate::result::{sw_code_t, sw_result_t};

/// SYNC to PARA.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_head_t {
    /// The first bit of the line in bit 0 of byte 0.
    pub bits: [u8; 16],
    /// PARA: the parameter byte, coded.
    pub para: u16,
    /// Bits of the head.
    pub len: u8,
    /// The four bits that level the line.
    pub equalisation: u8,
    /// Ones minus zeros of the line after it, without an answer.
    pub disparity: i8,
}

/// The window and the stuffing of a synchronised frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_extra_t {
    /// TIME_EXTRA_WINDOW in eighths of a bit.
    pub window: i16,
    /// Where the sampling edge stands in the window, 24..72 eighths.
    pub edge: u8,
    /// NUM_STUFFING: blocks of six bits after the previous frame, 0..26.
    pub stuffing: u8,
    /// EXTRA_EDGE, the register: ones as the edge has them.
    pub edge_register: u8,
}

fn extra(edge: u8) -> Result<Option<Extra>, Refused> {
    if edge == 0 { Ok(None) } else { Ok(Some(in_range(Extra::new(edge))?)) }
}

/// A head with a parameter byte, after a line of this disparity. `edge` is where the sampling edge stands in the EXTRA window, in eighths of
/// a bit, 24..72; 0 for a free-running frame.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_build_head(
    parameter: u8,
    edge: u8,
    before: i8,
    head: Option<&mut MaybeUninit<sw_hdsl_head_t>>,
) -> sw_result_t {
    border(|| {
        let (extra, out) = (extra(edge)?, there(head)?);
        let (byte, before) = (ParameterByte::new(parameter), LineDisparity::new(before));
        let before = extra.map_or(before, |extra| before.with_ones(extra.bits()));
        let head = Head::new(byte, extra, before);
        out.write(sw_hdsl_head_t {
            bits: head.bits().bits().to_le_bytes(),
            para: head.para().get(),
            len: u8::try_from(head.bits().len()).unwrap_or(u8::MAX),
            equalisation: head.equalisation(),
            disparity: before.after_head(byte).get(),
        });
        OK
    })
}

/// The same as samples, eight a bit, a byte each: SW_E_SHORT_BUFFER below `head.len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_head_samples(
    parameter: u8,
    edge: u8,
    before: i8,
    samples: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (samples, len) = (unsafe { room::<u8>(samples, size)? }, there(len)?);
        let (extra, before) = (extra(edge)?, LineDisparity::new(before));
        let before = extra.map_or(before, |extra| before.with_ones(extra.bits()));
        let head = Head::new(ParameterByte::new(parameter), extra, before);
        let (mut made, mut want) = ([0_u8; 64], 0_usize);
        for (to, from) in made.iter_mut().zip(head.samples()) {
            *to = from;
            want = want.saturating_add(1);
        }
        fill(samples, made.get(..want).unwrap_or(&made))?;
        len.write(want);
        OK
    })
}

/// The parameter byte in a head as an encoder hears it, and the bits of its EXTRA window beyond a free-running one.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_parse_head(
    head: Option<&sw_hdsl_head_t>,
    parameter: Option<&mut MaybeUninit<u8>>,
    extra_bits: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        let (it, parameter, extra_bits) = (there(head)?, there(parameter)?, there(extra_bits)?);
        let line = in_range(Window::from_bits(u128::from_le_bytes(it.bits), it.len.into()))?;
        let head = Head::parse(line).map_err(error)?;
        parameter.write(head.byte.raw());
        extra_bits.write(u8::try_from(head.extra_bits).unwrap_or(u8::MAX));
        OK
    })
}

/// The bits that level a line of this disparity, which becomes the one after them.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_equalisation(disparity: Option<&mut i8>, bits: Option<&mut MaybeUninit<u8>>) -> sw_result_t {
    border(|| {
        let (disparity, bits) = (there(disparity)?, there(bits)?);
        let it = LineDisparity::new(*disparity).equalisation();
        bits.write(it.bits);
        *disparity = it.disparity.get();
        OK
    })
}

/// The word of a parameter byte on a line of this disparity, which becomes the one after it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_build_parameter(
    parameter: u8,
    disparity: Option<&mut i8>,
    word: Option<&mut MaybeUninit<u16>>,
) -> sw_result_t {
    border(|| {
        let (disparity, word) = (there(disparity)?, there(word)?);
        let it = LineDisparity::new(*disparity).encode(ParameterByte::new(parameter));
        word.write(it.word.get());
        *disparity = it.disparity.get();
        OK
    })
}

/// The parameter byte of a word. SW_E_NO_VALUE if the word is not a parameter word.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_parse_parameter(word: u16, parameter: Option<&mut MaybeUninit<u8>>) -> sw_result_t {
    border(|| {
        let out = there(parameter)?;
        let word = in_range(Word::new(word))?;
        out.write(ParameterByte::decode(word).ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?.raw());
        OK
    })
}

/// The window and the stuffing of the next frame, whose edge comes `adjust` eighths later than without. `edge_register` is only written.
/// SW_E_HDSL_EXTRA_OUT_OF_RANGE: it cannot, and stays as it was.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_extra_step(state: Option<&mut sw_hdsl_extra_t>, adjust: i16) -> sw_result_t {
    border(|| {
        let it = there(state)?;
        let (edge, stuffing) = (in_range(Extra::new(it.edge))?, in_range(Stuffing::new(it.stuffing))?);
        let mut next = ExtraWindow::new(edge, stuffing, it.window);
        next.step(adjust).map_err(error)?;
        *it = sw_hdsl_extra_t {
            window: next.window(),
            edge: next.extra().get(),
            stuffing: next.stuffing().get(),
            edge_register: next.extra().edge_register(),
        };
        OK
    })
}

/// EXTRA_EDGE for a sampling edge at 24..72 eighths of a bit: the samples of the last bit. 0 for another edge.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_edge_register(edge: u8) -> u8 {
    Extra::new(edge).map_or(0, Extra::edge_register)
}
