//! Non-cyclic commands and profile motion, response by response: what to send, and the result. Time is
//! counted in update periods.

use core::mem::MaybeUninit;

use rtex_block::master::{Failure, Handshake, ProfileMove, Progress, SubHandshake};
use rtex_block::{
    CyclicCode, ErrorCode, Execution, LEN, MacId, Nibble, NonCyclicCode, NonCyclicCommand, NonCyclicResponse, Response,
    SubCode, SubResponse,
};

use super::names::sw_rtex_error_t;
use crate::border::{OK, Refused, border, in_range, read, state, there};
use crate::result::{sw_code_t, sw_result_t};

/// A non-cyclic command in progress. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_handshake_t {
    pub(crate) _private: [MaybeUninit<u64>; 6],
}
state!(sw_rtex_handshake_t, Handshake, 0x47);

/// A sub-command in progress. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_sub_handshake_t {
    pub(crate) _private: [MaybeUninit<u64>; 4],
}
state!(sw_rtex_sub_handshake_t, SubHandshake, 0x48);

/// A profile motion in progress. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_move_t {
    pub(crate) _private: [MaybeUninit<u64>; 10],
}
state!(sw_rtex_move_t, ProfileMove, 0x49);

/// How a procedure ended.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_done_t {
    /// The value read: Monitor_Data, Response_Data3 or Sub_Response_Data1; 0 for none.
    pub data: i32,
    /// Index_Echo, of a profile motion 0. With SW_E_RTEX_COMMAND_ERROR the error code of the drive.
    pub index: u16,
    /// 1: done, with a restriction (WNG).
    pub warning: u8,
    /// 1: a profile motion ended in position.
    pub in_position: u8,
}

const NOTHING: sw_rtex_done_t = sw_rtex_done_t { data: 0, index: 0, warning: 0, in_position: 0 };

fn ended<T>(
    progress: &Progress<T>,
    out: &mut MaybeUninit<sw_rtex_done_t>,
    done: impl FnOnce(&T) -> sw_rtex_done_t,
) -> Result<sw_result_t, Refused> {
    match progress {
        Progress::Pending { .. } => Ok(sw_code_t::SW_PENDING as sw_result_t),
        Progress::Done { value } => {
            out.write(done(value));
            OK
        }
        Progress::Failed { error } => {
            let (refusal, index) = match error {
                Failure::Execution => (sw_rtex_error_t::SW_E_RTEX_EXECUTION, 0),
                Failure::CommandError(ErrorCode(code)) => (sw_rtex_error_t::SW_E_RTEX_COMMAND_ERROR, *code),
                Failure::TimedOut => (sw_rtex_error_t::SW_E_RTEX_TIMED_OUT, 0),
                Failure::NotStarted => (sw_rtex_error_t::SW_E_RTEX_NOT_STARTED, 0),
                _ => (sw_rtex_error_t::SW_E_RTEX_BROKEN_OFF, 0),
            };
            out.write(sw_rtex_done_t { index, ..NOTHING });
            Err(refusal as sw_result_t)
        }
    }
}

fn executed(value: &NonCyclicResponse) -> sw_rtex_done_t {
    let index = match value {
        NonCyclicResponse::Reset(it)
        | NonCyclicResponse::SystemId(it)
        | NonCyclicResponse::Alarm(it)
        | NonCyclicResponse::Parameter(it)
        | NonCyclicResponse::Monitor(it) => it.index,
        _ => 0,
    };
    let warning = value.execution().is_some_and(|it| it.contains(Execution::WNG)).into();
    sw_rtex_done_t { data: value.data().unwrap_or(0), index, warning, in_position: 0 }
}

/// Gives a procedure the block of an update period, `None` for a NULL and for a block that is refused: the period passes without an
/// answer.
///
/// # Safety As for [`read`].
unsafe fn hear<T>(
    bytes: *const u8,
    len: usize,
    receive: impl FnOnce(Option<&Response>) -> Result<Progress<T>, Refused>,
    out: Option<&mut MaybeUninit<sw_rtex_done_t>>,
    done: impl FnOnce(&T) -> sw_rtex_done_t,
) -> sw_result_t {
    border(|| {
        let out = there(out)?;
        // SAFETY: the caller vouches for it.
        let heard = if bytes.is_null() { None } else { Response::parse(unsafe { read(bytes, len)? }).ok() };
        ended(&receive(heard.as_ref())?, out, done)
    })
}

/// Begins a non-cyclic command (sw_rtex_noncyclic_t) whose bytes 8 to 15 are `data`; an answer must come
/// within `limit` update periods. `attributes` 1: SW_RTEX_ALARM_COMMAND reads the attributes of the present
/// alarm. Normal and profile commands are not handshakes: SW_E_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_handshake_start(
    handshake: Option<&mut MaybeUninit<sw_rtex_handshake_t>>,
    mac_id: u8,
    cyclic: u8,
    noncyclic: u8,
    data: *const u8,
    len: usize,
    limit: u32,
    attributes: u8,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let data: [u8; 8] = in_range(unsafe { read(data, len)? }.try_into().ok())?;
        let (mac_id, cyclic) = (in_range(MacId::new(mac_id))?, in_range(CyclicCode::from_code(cyclic))?);
        let request = NonCyclicCommand::parse(in_range(NonCyclicCode::from_code(noncyclic))?, data);
        let it = match (attributes, request) {
            (0, request) => in_range(Handshake::new(mac_id, cyclic, request, limit))?,
            (1, NonCyclicCommand::Alarm(it)) => Handshake::alarm_attributes(mac_id, cyclic, it.type_code, limit),
            _ => in_range(None)?,
        };
        sw_rtex_handshake_t::start(handshake, it)?;
        OK
    })
}

/// Bytes 8 to 15 of the command to send while it is pending.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_handshake_data(
    handshake: Option<&sw_rtex_handshake_t>,
    data: Option<&mut MaybeUninit<[u8; 8]>>,
) -> sw_result_t {
    border(|| {
        let (it, data) = (sw_rtex_handshake_t::look(handshake)?, there(data)?);
        data.write(it.request().emit());
        OK
    })
}

/// Takes the block of an update period, NULL if there was none; a refused block counts as none.
/// SW_PENDING; SW_OK with `done`; or SW_E_RTEX_EXECUTION, ..COMMAND_ERROR, ..TIMED_OUT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_handshake_hear(
    handshake: Option<&mut sw_rtex_handshake_t>,
    bytes: *const u8,
    len: usize,
    done: Option<&mut MaybeUninit<sw_rtex_done_t>>,
) -> sw_result_t {
    let receive = |heard: Option<&Response>| Ok(sw_rtex_handshake_t::get(handshake)?.receive(heard));
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { hear(bytes, len, receive, done, executed) }
}

/// Begins a sub-command of the 32-byte mode: 2 system ID, 10 monitor.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_sub_start(
    handshake: Option<&mut MaybeUninit<sw_rtex_sub_handshake_t>>,
    code: u8,
    type_code: u8,
    index: u16,
    limit: u32,
) -> sw_result_t {
    border(|| {
        let code = in_range(SubCode::from_code(code))?;
        sw_rtex_sub_handshake_t::start(handshake, in_range(SubHandshake::new(code, type_code, index, limit))?)?;
        OK
    })
}

/// Takes the sub block of an update period, 16 bytes, NULL if there was none; as sw_rtex_handshake_hear().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_sub_hear(
    handshake: Option<&mut sw_rtex_sub_handshake_t>,
    bytes: *const u8,
    len: usize,
    done: Option<&mut MaybeUninit<sw_rtex_done_t>>,
) -> sw_result_t {
    border(|| {
        let heard = if bytes.is_null() {
            None
        } else {
            // SAFETY: the caller of the C function vouches for his memory.
            let block: &[u8; LEN] = in_range(unsafe { read(bytes, len)? }.try_into().ok())?;
            Some(SubResponse::parse(block))
        };
        let (it, done) = (sw_rtex_sub_handshake_t::get(handshake)?, there(done)?);
        ended(&it.receive(heard.as_ref()), done, |value| sw_rtex_done_t {
            data: value.data1,
            index: value.index,
            warning: value.execution.contains(Execution::WNG).into(),
            in_position: 0,
        })
    })
}

/// Begins a profile motion: Type_Code as the drive's manual gives it, target and speed in command units, limit in update periods.
/// `latch_sel1` (0..15) and `monitor_sel` are sent with it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_move_start(
    motion: Option<&mut MaybeUninit<sw_rtex_move_t>>,
    mac_id: u8,
    type_code: u8,
    target: i32,
    speed: i32,
    limit: u32,
    latch_sel1: u8,
    monitor_sel: u8,
) -> sw_result_t {
    border(|| {
        let (mac_id, latch) = (in_range(MacId::new(mac_id))?, in_range(Nibble::new(latch_sel1))?);
        let it = ProfileMove::new(mac_id, type_code, target, speed, limit).with_latch(latch, monitor_sel);
        sw_rtex_move_t::start(motion, it)?;
        OK
    })
}

/// The non-cyclic code (sw_rtex_noncyclic_t) and bytes 8 to 15 of the next command.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_move_data(
    motion: Option<&sw_rtex_move_t>,
    noncyclic: Option<&mut MaybeUninit<u8>>,
    data: Option<&mut MaybeUninit<[u8; 8]>>,
) -> sw_result_t {
    border(|| {
        let (it, noncyclic, data) = (sw_rtex_move_t::look(motion)?, there(noncyclic)?, there(data)?);
        let request = it.request();
        noncyclic.write(request.code() as u8);
        data.write(request.emit());
        OK
    })
}

/// Takes the block of an update period, NULL if there was none; as sw_rtex_handshake_hear(), and
/// SW_E_RTEX_NOT_STARTED.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_move_hear(
    motion: Option<&mut sw_rtex_move_t>,
    bytes: *const u8,
    len: usize,
    done: Option<&mut MaybeUninit<sw_rtex_done_t>>,
) -> sw_result_t {
    let receive = |heard: Option<&Response>| Ok(sw_rtex_move_t::get(motion)?.receive(heard));
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe {
        hear(bytes, len, receive, done, |value| sw_rtex_done_t {
            warning: value.warning.into(),
            in_position: value.in_position.into(),
            ..NOTHING
        })
    }
}
