//! The encoder's side, for test benches.

use core::mem::MaybeUninit;

use tformat::device::{Device, Transmission};
use tformat::{Abm, Abs, Almc, BitRate};

use super::codec::{flat, request, sw_tformat_request_t, sw_tformat_response_t};
use crate::border::{OK, border, in_range, read, state, there};
use crate::clock::time;
use crate::result::{sw_code_t, sw_result_t};

/// A modelled encoder with six pages of EEPROM. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_tformat_device_t {
    pub(crate) _private: [MaybeUninit<u64>; 128],
}
state!(sw_tformat_device_t, Device<6>, 0x13);

/// The response of an encoder, and when it is sent.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_answer_t {
    /// When the first start bit is on the line.
    pub start_ns: u64,
    /// When the last bit ends.
    pub end_ns: u64,
    /// The fields, one byte each.
    pub bytes: [u8; 11],
    /// How many.
    pub len: u8,
}

/// Switches a modelled encoder on: position 0, no alarms. `bits_per_second` is 2500000 or 5000000.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_device_start(
    device: Option<&mut MaybeUninit<sw_tformat_device_t>>,
    enid: u8,
    bits_per_second: u32,
) -> sw_result_t {
    border(|| {
        let rate = in_range(BitRate::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_per_second))?;
        sw_tformat_device_t::start(device, Device::new(enid, rate))?;
        OK
    })
}

/// Turns the shaft: ABS before the zero of ID 8 is applied, and ABM, 24 bits each.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_device_set_position(
    device: Option<&mut sw_tformat_device_t>,
    abs: u32,
    abm: u32,
) -> sw_result_t {
    border(|| {
        let (abs, abm) = (in_range(Abs::new(abs))?, in_range(Abm::new(abm))?);
        sw_tformat_device_t::get(device)?.set_position(abs, abm);
        OK
    })
}

/// Sets the causes of these alarms (sw_tformat_almc_t, added), and removes those of all others. A latched
/// alarm stays until ID 7 or C.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_device_set_alarms(device: Option<&mut sw_tformat_device_t>, almc: u8) -> sw_result_t {
    border(|| {
        let (device, alarms) = (sw_tformat_device_t::get(device)?, Almc::from_bits_retain(almc));
        device.end_alarms(alarms.complement());
        device.raise_alarms(alarms);
        OK
    })
}

/// The EEPROM page that is selected, 0..5; 255 for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_device_page(device: Option<&sw_tformat_device_t>) -> u8 {
    sw_tformat_device_t::look(device).map_or(255, Device::page)
}

/// Takes a sound request that ended at `now_ns`: carries it out, and returns its response. SW_E_NO_VALUE if
/// the encoder is silent.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_device_answer(
    device: Option<&mut sw_tformat_device_t>,
    asked: Option<&sw_tformat_request_t>,
    now_ns: u64,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    border(|| {
        let (device, response) = (sw_tformat_device_t::get(device)?, there(response)?);
        let answer = device.answer(request(*there(asked)?)?, time(now_ns)?);
        response.write(flat(&answer.ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?));
        OK
    })
}

/// Takes bytes received without a framing error; the last one ended at `end_ns`. SW_SEND with `answer`
/// filled, or SW_PENDING.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_device_hear(
    device: Option<&mut sw_tformat_device_t>,
    bytes: *const u8,
    len: usize,
    end_ns: u64,
    answer: Option<&mut MaybeUninit<sw_tformat_answer_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let (device, answer) = (sw_tformat_device_t::get(device)?, there(answer)?);
        Ok(sent(device.hear(bytes, time(end_ns)?), answer))
    })
}

/// Reports a byte that ended at `end_ns` and was received with a framing error.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_device_framing_error(
    device: Option<&mut sw_tformat_device_t>,
    end_ns: u64,
    answer: Option<&mut MaybeUninit<sw_tformat_answer_t>>,
) -> sw_result_t {
    border(|| {
        let (device, answer) = (sw_tformat_device_t::get(device)?, there(answer)?);
        Ok(sent(device.framing_error(time(end_ns)?), answer))
    })
}

fn sent(transmission: Option<Transmission>, answer: &mut MaybeUninit<sw_tformat_answer_t>) -> sw_result_t {
    let Some(transmission) = transmission else { return sw_code_t::SW_PENDING as sw_result_t };
    let mut bytes = [0; 11];
    for (to, from) in bytes.iter_mut().zip(transmission.frame.as_bytes()) {
        *to = *from;
    }
    let (start_ns, end_ns) = (transmission.start_ns, transmission.end_ns);
    answer.write(sw_tformat_answer_t { start_ns, end_ns, bytes, len: transmission.frame.fields() });
    sw_code_t::SW_SEND as sw_result_t
}
