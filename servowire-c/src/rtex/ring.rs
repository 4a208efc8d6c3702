//! The axes of a ring in step, and the parts of a master for programs that have their own.

use core::mem::MaybeUninit;
use core::num::NonZeroU16;

use rtex_block::master::{Acknowledgement, CommandCounter, EchoWatch, Expected, Fellows, Heard, ServoOff, Turn};
use rtex_block::{BlockSize, Code, Command, CommandBlock, MacId, UpdateCounter, device};

use super::axis::sw_rtex_axis_t;
use super::block::error;
use super::names::sw_rtex_acknowledgement_t;
use crate::border::{OK, Refused, border, fill, in_range, read, room, state, there};
use crate::clock::time;
use crate::result::{sw_code_t, sw_result_t};

/// Maximum number of axes in a ring.
pub const SW_RTEX_AXES: usize = 32;
const _: () = assert!(SW_RTEX_AXES == MacId::COUNT);

/// The common state of the axes of a ring. Its content is private; it may be copied. Only one context at a
/// time may use it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_ring_t {
    pub(crate) _private: [MaybeUninit<u64>; 5],
}
state!(sw_rtex_ring_t, Ring, 0x43);

#[derive(Clone, Copy)]
pub(crate) struct Ring {
    counter: CommandCounter,
    sent: Turn,
    size: BlockSize,
    fellows: Fellows,
}

/// An echo watch. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_echo_t {
    pub(crate) _private: [MaybeUninit<u64>; 4],
}
state!(sw_rtex_echo_t, EchoWatch, 0x44);

/// The counter of the commands. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_counter_t {
    pub(crate) _private: [MaybeUninit<u64>; 2],
}
state!(sw_rtex_counter_t, CommandCounter, 0x45);

/// The faults that a drive finds in a command.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_verdict_t {
    /// Error code of the main half, 0 for none.
    pub error: u16,
    /// Error code of the sub half, 0 for none.
    pub sub_error: u16,
    /// Main number of the alarm that repetitions raise, 0 for none.
    pub alarm_main: u8,
    /// Its sub number.
    pub alarm_sub: u8,
}

fn size_of_blocks(bytes: u8) -> Result<BlockSize, Refused> {
    in_range(match bytes {
        16 => Some(BlockSize::Bytes16),
        32 => Some(BlockSize::Bytes32),
        _ => None,
    })
}

/// Prepares a ring that sends `invalid` update periods of invalid data before its first commands, in blocks
/// of 16 or 32 bytes.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_ring_start(
    ring: Option<&mut MaybeUninit<sw_rtex_ring_t>>,
    block_bytes: u8,
    invalid: u32,
) -> sw_result_t {
    border(|| {
        let size = size_of_blocks(block_bytes)?;
        let it = Ring { counter: CommandCounter::new(invalid), sent: Turn::Invalid, size, fellows: Fellows::new() };
        sw_rtex_ring_t::start(ring, it)?;
        OK
    })
}

/// Makes an update period of all axes, which were started and are in the order of the ring: takes the
/// blocks received, one after another, heard until `end_ns`, and writes those of the next period. As soon
/// as one axis fails the others stop in the same call. `rx` NULL: no frame came. SW_E_STATE if one of the
/// axes was not started, SW_E_ARGUMENT if two have the same MAC-ID or the memory has another size: nothing
/// was done.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_ring_update(
    ring: Option<&mut sw_rtex_ring_t>,
    axes: *mut sw_rtex_axis_t,
    count: usize,
    rx: *const u8,
    rx_len: usize,
    tx: *mut u8,
    tx_size: usize,
    end_ns: u64,
) -> sw_result_t {
    border(|| {
        let it = sw_rtex_ring_t::get(ring)?;
        in_range((count > 0 && count <= SW_RTEX_AXES).then_some(()))?;
        let (bytes, end_ns) = (it.size.bytes(), time(end_ns)?);
        let all = count.saturating_mul(bytes);
        // SAFETY: the caller of the C function vouches for his memory.
        let tx = unsafe { room(tx, tx_size)? };
        let rx = if rx.is_null() {
            None
        } else {
            // SAFETY: as above.
            let rx = unsafe { read(rx, rx_len)? };
            Some(in_range((rx.len() == all).then_some(rx))?)
        };
        let tx = tx.get_mut(..all).ok_or(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t)?;
        // SAFETY: as above: they were zeroed or started, so they are there, and nobody else uses them.
        let axes = unsafe { room(axes, count)? };
        // SAFETY: as above.
        let axes = unsafe { core::slice::from_raw_parts_mut(axes.as_mut_ptr().cast::<sw_rtex_axis_t>(), axes.len()) };
        let mut seen = 0_u32;
        for axis in &*axes {
            let bit = 1_u32.wrapping_shl(sw_rtex_axis_t::look(Some(axis))?.axis.config().mac_id.get().into());
            in_range((seen & bit == 0).then_some(()))?;
            seen |= bit;
        }
        for (place, axis) in axes.iter_mut().enumerate() {
            let block = rx.and_then(|rx| rx.chunks_exact(bytes).nth(place));
            let heard = block.map_or(Heard::Nothing, |block| Heard::parse(it.size, block));
            sw_rtex_axis_t::get(Some(axis))?.axis.hear(it.sent, &heard, end_ns);
        }
        share(it, axes)?;
        it.sent = it.counter.next();
        for (axis, place) in axes.iter_mut().zip(tx.chunks_exact_mut(bytes)) {
            let axis = sw_rtex_axis_t::get(Some(axis))?;
            axis.turn = it.sent;
            fill(place, axis.send(it.sent).emit().get(..bytes).unwrap_or_default())?;
        }
        OK
    })
}

/// Tells the others why one axis has failed.
fn share(it: &mut Ring, axes: &mut [sw_rtex_axis_t]) -> Result<(), Refused> {
    it.fellows.begin();
    for (place, axis) in (0..).zip(&*axes) {
        it.fellows.look(place, &sw_rtex_axis_t::look(Some(axis))?.axis);
    }
    for axis in axes {
        it.fellows.tell(&mut sw_rtex_axis_t::get(Some(axis))?.axis);
    }
    Ok(())
}

/// The place of the axis that stopped the ring; SW_E_NO_VALUE if none has.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_ring_failed(ring: Option<&sw_rtex_ring_t>) -> sw_result_t {
    border(|| {
        let place = sw_rtex_ring_t::look(ring)?.fellows.failed();
        Ok(place.ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?.into())
    })
}

/// Forgets the failure; then clear each axis with sw_rtex_axis_clear().
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_ring_clear(ring: Option<&mut sw_rtex_ring_t>) -> sw_result_t {
    border(|| {
        sw_rtex_ring_t::get(ring)?.fellows = Fellows::new();
        OK
    })
}

/// Compares a block with what was sent: sw_rtex_acknowledgement_t, or a refusal. `code` is cyclic * 16 + non-cyclic.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_check_response(
    block_bytes: u8,
    mac_id: u8,
    update_counter: u8,
    code: u8,
    bytes: *const u8,
    len: usize,
) -> sw_result_t {
    border(|| {
        let expected = Expected {
            size: size_of_blocks(block_bytes)?,
            mac_id: in_range(MacId::new(mac_id))?,
            update_counter: in_range(UpdateCounter::new(update_counter))?,
            code: in_range(Code::new(code))?,
        };
        // SAFETY: the caller of the C function vouches for his memory.
        let checked = expected.check(unsafe { read(bytes, len)? }).map_err(error)?;
        Ok(match checked.acknowledgement {
            Acknowledgement::Accepted => sw_rtex_acknowledgement_t::SW_RTEX_ACCEPTED,
            Acknowledgement::CounterNotEchoed => sw_rtex_acknowledgement_t::SW_RTEX_COUNTER_NOT_ECHOED,
            Acknowledgement::CodeNotYetEchoed => sw_rtex_acknowledgement_t::SW_RTEX_CODE_NOT_YET_ECHOED,
            Acknowledgement::CommandError(_) => sw_rtex_acknowledgement_t::SW_RTEX_NOT_ACCEPTED,
        } as sw_result_t)
    })
}

/// Finds the faults that a drive with this MAC-ID reports for a command.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_check_command(
    block_bytes: u8,
    mac_id: u8,
    bytes: *const u8,
    len: usize,
    verdict: Option<&mut MaybeUninit<sw_rtex_verdict_t>>,
) -> sw_result_t {
    border(|| {
        let (size, mac_id) = (size_of_blocks(block_bytes)?, in_range(MacId::new(mac_id))?);
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, len)? }, there(verdict)?);
        let found = device::check(bytes, size, mac_id);
        out.write(sw_rtex_verdict_t {
            error: found.error.map_or(0, |code| code.0),
            sub_error: found.sub_error.map_or(0, |code| code.0),
            alarm_main: found.alarm.map_or(0, |alarm| alarm.main),
            alarm_sub: found.alarm.map_or(0, |alarm| alarm.sub),
        });
        OK
    })
}

/// Watches the Update_Counter_Echo: it trips after `limit` responses without a new one, 1 or more.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_echo_start(echo: Option<&mut MaybeUninit<sw_rtex_echo_t>>, limit: u16) -> sw_result_t {
    border(|| {
        sw_rtex_echo_t::start(echo, EchoWatch::new(in_range(NonZeroU16::new(limit))?))?;
        OK
    })
}

/// Takes the echo of a response, 0..3, or 255 for none; returns 1 if the watch has tripped, 0 if not.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_echo_sample(echo: Option<&mut sw_rtex_echo_t>, update_counter: u8) -> sw_result_t {
    border(|| {
        let it = sw_rtex_echo_t::get(echo)?;
        let heard = if update_counter == 255 { None } else { Some(in_range(UpdateCounter::new(update_counter))?) };
        Ok(it.sample(heard).into())
    })
}

/// Prepares a counter that begins after `invalid` update periods of invalid data.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_counter_start(
    counter: Option<&mut MaybeUninit<sw_rtex_counter_t>>,
    invalid: u32,
) -> sw_result_t {
    border(|| {
        sw_rtex_counter_t::start(counter, CommandCounter::new(invalid))?;
        OK
    })
}

/// The Update_Counter of the next command, 0..3; SW_PENDING * 256 (100h) while data are invalid: NOP and counter 0 are sent then.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_counter_next(counter: Option<&mut sw_rtex_counter_t>) -> sw_result_t {
    border(|| {
        Ok(match sw_rtex_counter_t::get(counter)?.next() {
            Turn::Invalid => 0x100,
            Turn::Valid(counter) => counter.get().into(),
        })
    })
}

/// The block that switches the servo off after a command, 16 bytes: counter advanced by one, Servo_On
/// cleared, everything else kept. SW_E_NO_VALUE if a drive would not evaluate Servo_On in it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_servo_off_after(
    before: *const u8,
    len: usize,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (before, bytes) = unsafe { (read(before, len)?, room(bytes, size)?) };
        let command = Command::parse(before).map_err(error)?;
        let off = ServoOff::after(&command).ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?;
        fill(bytes, &off.emit())?;
        OK
    })
}

/// Whether a block certainly switches the servo off: 1 or 0, or a refusal.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_is_servo_off(bytes: *const u8, len: usize) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        Ok(CommandBlock::new(bytes).map_err(error)?.is_servo_off().into())
    })
}
