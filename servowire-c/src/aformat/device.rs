//! The encoder's side, for test benches.

use core::mem::MaybeUninit;

use nikon_aformat::device::Device;
use nikon_aformat::{Alm, BitRate, EncoderAddress};

use super::bus::{LONGEST, block};
use super::codec::{resolution, sw_aformat_encoder_t};
use crate::border::{OK, border, in_range, state, there};
use crate::clock::time;
use crate::result::{sw_code_t, sw_result_t};

/// A modelled encoder with one bank of EEPROM. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_aformat_device_t {
    pub(crate) _private: [MaybeUninit<u64>; 92],
}
state!(sw_aformat_device_t, Device<1>, 0x25);

/// The response of an encoder, and when it is sent.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_answer_t {
    /// When the first start bit is on the line.
    pub start_ns: u64,
    /// When the last bit ends.
    pub end_ns: u64,
    /// The content of the frames, the first bit of the line in bit 0.
    pub contents: [u16; 6],
    /// How many.
    pub len: u8,
}

/// Switches a modelled encoder on: position 0, no alarms, with this address.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_device_start(
    device: Option<&mut MaybeUninit<sw_aformat_device_t>>,
    ea: u8,
    encoder: Option<&sw_aformat_encoder_t>,
    bits_per_second: u32,
) -> sw_result_t {
    border(|| {
        let rate = in_range(BitRate::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_per_second))?;
        let (ea, resolution) = (in_range(EncoderAddress::new(ea))?, resolution(*there(encoder)?)?);
        sw_aformat_device_t::start(device, Device::new(ea, resolution, rate))?;
        OK
    })
}

/// Turns the shaft: counts in the turn before the zero of command 12 is applied, and turns.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_device_set_position(
    device: Option<&mut sw_aformat_device_t>,
    single_turn: u32,
    turns: u32,
) -> sw_result_t {
    border(|| {
        sw_aformat_device_t::get(device)?.set_position(single_turn, turns);
        OK
    })
}

/// Sets the causes of these alarms (bits of ALM), and removes those of all others. A latched alarm stays
/// until a reset.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_device_set_alarms(device: Option<&mut sw_aformat_device_t>, alm: u16) -> sw_result_t {
    border(|| {
        let (device, alarms) = (sw_aformat_device_t::get(device)?, Alm::from_bits_retain(alm));
        device.end_alarms(alarms.complement());
        device.raise_alarms(alarms);
        OK
    })
}

/// Puts a word into the EEPROM at any address, as the manufacturer does.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_device_set_eeprom(
    device: Option<&mut sw_aformat_device_t>,
    address: u8,
    data: u16,
) -> sw_result_t {
    border(|| {
        sw_aformat_device_t::get(device)?.set_eeprom(0, address, data);
        OK
    })
}

/// Takes frames that were heard one after another, as sw_aformat_hear() does: its own requests and the
/// answers of others. SW_SEND with `answer` filled, or SW_PENDING.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_device_hear(
    device: Option<&mut sw_aformat_device_t>,
    contents: *const u16,
    framed: *const u8,
    count: usize,
    end_ns: u64,
    answer: Option<&mut MaybeUninit<sw_aformat_answer_t>>,
) -> sw_result_t {
    border(|| {
        let mut frames = [None; LONGEST];
        // SAFETY: the caller of the C function vouches for his memory.
        let block = unsafe { block(contents, framed, count, &mut frames)? };
        let (device, end_ns, answer) = (sw_aformat_device_t::get(device)?, time(end_ns)?, there(answer)?);
        let Some(transmission) = device.hear(block, end_ns) else { return Ok(sw_code_t::SW_PENDING as sw_result_t) };
        let mut contents = [0; 6];
        contents.iter_mut().zip(transmission.frames.contents()).for_each(|(to, from)| *to = *from);
        let (start_ns, end_ns, len) = (transmission.start_ns, transmission.end_ns, transmission.frames.frames());
        answer.write(sw_aformat_answer_t { start_ns, end_ns, contents, len });
        Ok(sw_code_t::SW_SEND as sw_result_t)
    })
}
