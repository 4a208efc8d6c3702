//! Frames of requests one by one, check values, and responses from a line of bits or samples.

use core::mem::MaybeUninit;

use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{Crc3, Crc8, EncoderAddress, FrameCode, RawResponse, RequestFrame, Window};

use super::codec::sw_aformat_response_t;
use super::codec::{
    bit_order, error, flat, layout_of, request, resolution, sw_aformat_encoder_t, sw_aformat_request_t,
};
use super::words::{judged, sw_aformat_bus_t};
use crate::border::{OK, Refused, border, fill, in_range, read, room, state, there};
use crate::result::{sw_code_t, sw_result_t};

/// A frame of a request, with a command or with a byte of memory: only its place in the request tells which.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_frame_t {
    /// Frame code.
    pub fc: u8,
    /// 1: `byte` is sent, a byte of memory; 0: `ea` and `command` are.
    pub memory: u8,
    /// EA, of a command.
    pub ea: u8,
    /// CC, of a command.
    pub command: u8,
    /// The byte, of a memory frame. In a frame that was heard, all fields are filled in.
    pub byte: u8,
}

/// A receiver of consecutive responses from a line. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_aformat_receiver_t {
    pub(crate) _private: [MaybeUninit<u64>; 16],
}
state!(sw_aformat_receiver_t, LineReceiver, 0x24);

fn frame(it: sw_aformat_frame_t) -> Result<RequestFrame, Refused> {
    let code = in_range(FrameCode::from_code(it.fc))?;
    if in_range((it.memory < 2).then_some(it.memory == 1))? {
        return Ok(RequestFrame::mdf(code, it.byte));
    }
    in_range((it.command < 32).then_some(()))?;
    Ok(RequestFrame::cdf(code, in_range(EncoderAddress::new(it.ea))?, it.command))
}

/// A frame on the line: 18 bits with start bit and delimiter, the first of the line in bit 0.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_build_frame(
    it: Option<&sw_aformat_frame_t>,
    bits: Option<&mut MaybeUninit<u32>>,
) -> sw_result_t {
    border(|| {
        let (it, bits) = (frame(*there(it)?)?, there(bits)?);
        let [a, b, c, d, ..] = it.line().bits().to_le_bytes();
        bits.write(u32::from_le_bytes([a, b, c, d]));
        OK
    })
}

/// The word of 32 bits that TI's example shifts out: the frame after idle line.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_build_word32(
    it: Option<&sw_aformat_frame_t>,
    word: Option<&mut MaybeUninit<u32>>,
) -> sw_result_t {
    border(|| {
        let (it, word) = (frame(*there(it)?)?, there(word)?);
        word.write(it.transmit_word());
        OK
    })
}

/// A frame as an encoder hears it: `len` bits of the line, the first in bit 0.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_parse_frame(
    bits: u32,
    len: u32,
    it: Option<&mut MaybeUninit<sw_aformat_frame_t>>,
) -> sw_result_t {
    border(|| {
        let out = there(it)?;
        let line = in_range((len <= 32).then_some(()).and_then(|()| Window::from_bits(bits.into(), len)))?;
        let frame = RequestFrame::from_line(line).map_err(error)?;
        out.write(sw_aformat_frame_t {
            fc: frame.frame_code().code(),
            memory: 0,
            ea: frame.ea().get(),
            command: frame.code(),
            byte: frame.byte(),
        });
        OK
    })
}

/// Whether an encoder accepts a request, by its version (sw_aformat_option_t) and all arguments.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_check(
    asked: Option<&sw_aformat_request_t>,
    encoder: Option<&sw_aformat_encoder_t>,
) -> sw_result_t {
    border(|| {
        let _ = request(there(asked)?)?.check(resolution(*there(encoder)?)?).map_err(error)?;
        OK
    })
}

/// The bits of a block, the first of the line in bit 0 of byte 0 (SW_LSB_FIRST) or in bit 7.
fn bits_of(bytes: &[u8], count: usize, order: u8) -> Result<impl Iterator<Item = bool>, Refused> {
    let msb_first = bit_order(order)? == nikon_aformat::BitOrder::MsbFirst;
    in_range((count <= bytes.len().saturating_mul(8)).then_some(()))?;
    let bit = move |byte: u8, at: u8| byte >> if msb_first { 7_u8.saturating_sub(at) } else { at } & 1 == 1;
    Ok(bytes.iter().flat_map(move |byte| (0..8).map(move |at| bit(*byte, at))).take(count))
}

/// The CRC-8 of responses over `count` bits, which are in (count + 7) / 8 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_crc8(
    bytes: *const u8,
    count: usize,
    order: u8,
    crc: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, count.div_ceil(8))? }, there(crc)?);
        out.write(bits_of(bytes, count, order)?.fold(Crc8::new(), Crc8::bit).get());
        OK
    })
}

/// The CRC-3 of requests over `count` bits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_crc3(
    bytes: *const u8,
    count: usize,
    order: u8,
    crc: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, count.div_ceil(8))? }, there(crc)?);
        out.write(bits_of(bytes, count, order)?.fold(Crc3::new(), Crc3::bit).get());
        OK
    })
}

/// Prepares a receiver of responses of this layout (sw_aformat_layout_t); samples per bit, 1 for a line of
/// bits. `idle` 1: frames of a response may have idle line between them.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_receiver_start(
    receiver: Option<&mut MaybeUninit<sw_aformat_receiver_t>>,
    layout: u8,
    samples_per_bit: u32,
    idle: bool,
) -> sw_result_t {
    border(|| {
        let layout = layout_of(layout)?;
        let it = match samples_per_bit {
            1 => LineReceiver::bits(layout),
            _ => in_range(LineReceiver::oversampled(samples_per_bit, layout).ok())?,
        };
        let it = if idle { it.allowing_idle_between_frames() } else { it };
        sw_aformat_receiver_t::start(receiver, it)?;
        OK
    })
}

fn whole(raw: &RawResponse, words: &mut [MaybeUninit<u16>], count: &mut MaybeUninit<usize>) -> Result<(), Refused> {
    let contents = raw.contents();
    let mut all = [0_u16; 8];
    for (to, from) in all.iter_mut().zip(contents) {
        *to = from.reverse_bits();
    }
    fill(words, all.get(..contents.len()).unwrap_or(&all))?;
    count.write(contents.len());
    Ok(())
}

/// Takes one sample of the line, 0 or 1. SW_OK with the frames of a response as words, the first bit of the
/// line in bit 15 (SW_MSB_FIRST), at most SW_AFORMAT_FRAMES; SW_PENDING if there is none yet; or why there
/// was none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_receiver_push(
    receiver: Option<&mut sw_aformat_receiver_t>,
    level: u8,
    words: *mut u16,
    size: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let words = unsafe { room(words, size)? };
        let (it, count) = (sw_aformat_receiver_t::get(receiver)?, there(count)?);
        let level = in_range((level < 2).then_some(level == 1))?;
        // A response that cannot be written down is not received.
        if words.len() < SW_AFORMAT_FRAMES {
            return Err(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t);
        }
        let Some(heard) = it.push(level) else { return Ok(sw_code_t::SW_PENDING as sw_result_t) };
        whole(&heard.map_err(error)?, words, count)?;
        OK
    })
}

/// Takes one sample of a line on which several encoders answer: as sw_aformat_receiver_push(), with the
/// result of sw_aformat_bus_push() for the response.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_sample(
    bus: Option<&mut sw_aformat_bus_t>,
    receiver: Option<&mut sw_aformat_receiver_t>,
    level: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    border(|| {
        let (bus, it, response) =
            (sw_aformat_bus_t::get(bus)?, sw_aformat_receiver_t::get(receiver)?, there(response)?);
        let level = in_range((level < 2).then_some(level == 1))?;
        let Some(heard) = it.push(level) else { return Ok(sw_code_t::SW_PENDING as sw_result_t) };
        let verdict = bus.push(heard);
        response.write(flat(&verdict.outcome.map_err(error)?));
        judged(verdict)
    })
}

/// Ends the line: SW_OK, or why a response that had begun is incomplete.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_line_ends(
    bus: Option<&mut sw_aformat_bus_t>,
    receiver: Option<&mut sw_aformat_receiver_t>,
) -> sw_result_t {
    border(|| {
        let (bus, it) = (sw_aformat_bus_t::get(bus)?, sw_aformat_receiver_t::get(receiver)?);
        let Some(refusal) = it.finish() else { return OK };
        let _ = bus.push(Err(refusal));
        Err(error(refusal))
    })
}

/// The number of encoders that were asked and have not even begun to answer, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_not_started(bus: Option<&sw_aformat_bus_t>) -> sw_result_t {
    border(|| Ok(sw_aformat_bus_t::look(bus)?.not_started().into()))
}

/// Maximum number of frames in a response.
pub const SW_AFORMAT_FRAMES: usize = 6;

const _: () = assert!(SW_AFORMAT_FRAMES == RawResponse::MAX_FRAMES);
