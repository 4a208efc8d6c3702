//! A modelled encoder.

use core::mem::MaybeUninit;

use hdsl::device::Device;
use hdsl::{EncoderId, Window};

use super::receiver::sw_hdsl_transmission_t;
use crate::border::{OK, border, in_range, state, there};
use crate::result::sw_result_t;

/// A modelled encoder. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_device_t {
    pub(crate) _private: [MaybeUninit<u64>; 54],
}
state!(sw_hdsl_device_t, Device, 0x32);

/// Switches a modelled encoder on, with an encoder identifier.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_device_start(
    device: Option<&mut MaybeUninit<sw_hdsl_device_t>>,
    encoder_id: u32,
) -> sw_result_t {
    border(|| {
        let id = in_range(EncoderId::try_from(encoder_id).ok())?;
        sw_hdsl_device_t::start(device, Device::new(id))?;
        OK
    })
}

/// Turns its shaft.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_device_set_position(device: Option<&mut sw_hdsl_device_t>, position: u64) -> sw_result_t {
    border(|| {
        sw_hdsl_device_t::get(device)?.set_position(position);
        OK
    })
}

/// Returns its answer to the head of an H-frame: the 61 bits for sw_hdsl_hear_bits(), all ones if it is
/// silent.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_device_hear(
    device: Option<&mut sw_hdsl_device_t>,
    heard: Option<&sw_hdsl_transmission_t>,
    bits: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| {
        let (device, heard, bits) = (sw_hdsl_device_t::get(device)?, there(heard)?, there(bits)?);
        let head = in_range(Window::from_bits(u128::from_le_bytes(heard.head), heard.head_bits.into()))?;
        bits.write(device.hear(head).map_or(u64::MAX, |answer| answer.bits));
        OK
    })
}
