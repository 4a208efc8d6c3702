//! A modelled drive.

use core::mem::MaybeUninit;

use rtex_block::device::{Drive, DriveConfig, OpenCodes};
use rtex_block::{LEN, LEN32, MacId};

use crate::border::{OK, border, fill, in_range, read, room, state, there};
use crate::result::{sw_code_t, sw_result_t};

/// A modelled drive that obeys commands and moves a simple axis. Its content is private; it may be copied. Type codes that no public document
/// gives are invented.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_drive_t {
    pub(crate) _private: [MaybeUninit<u64>; 84],
}
state!(sw_rtex_drive_t, Drive, 0x42);

/// Switches a drive on: update period 0.5 ms, one communication per update, gear 1/1.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_drive_start(drive: Option<&mut MaybeUninit<sw_rtex_drive_t>>, mac_id: u8) -> sw_result_t {
    border(|| {
        let config = DriveConfig::new(in_range(MacId::new(mac_id))?, OpenCodes::INVENTED);
        sw_rtex_drive_t::start(drive, Drive::new(config))?;
        OK
    })
}

/// Makes an exchange: takes a command of 16 or 32 bytes, and returns a response of the same length.
/// SW_E_NO_VALUE if the drive is silent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_drive_hear(
    drive: Option<&mut sw_rtex_drive_t>,
    bytes: *const u8,
    len: usize,
    response: *mut u8,
    size: usize,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, room) = unsafe { (read(bytes, len)?, room(response, size)?) };
        let drive = sw_rtex_drive_t::get(drive)?;
        in_range((len == LEN || len == LEN32).then_some(()))?;
        // An exchange that cannot be written down does not take place.
        if room.len() < len {
            return Err(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t);
        }
        let silent = sw_code_t::SW_E_NO_VALUE as sw_result_t;
        if let Ok(block) = <&[u8; LEN]>::try_from(bytes) {
            fill(room, &drive.hear(block).ok_or(silent)?)?;
        } else if let Ok(block) = <&[u8; LEN32]>::try_from(bytes) {
            fill(room, &drive.hear(block).ok_or(silent)?)?;
        }
        OK
    })
}

/// The position of its motor, in command units.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_drive_position(
    drive: Option<&sw_rtex_drive_t>,
    position: Option<&mut MaybeUninit<i32>>,
) -> sw_result_t {
    border(|| {
        let (it, position) = (sw_rtex_drive_t::look(drive)?, there(position)?);
        position.write(it.position());
        OK
    })
}
