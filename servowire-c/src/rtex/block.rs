//! Blocks of the 16-byte mode to and from C structs.

use core::mem::MaybeUninit;

use rtex_block::{
    Command, ControlBits, CyclicCode, Error, MacId, NonCyclicCode, NonCyclicCommand, Response, UpdateCounter,
};

use crate::border::{OK, Refused, border, filled, in_range, read, there};
use crate::result::{Protocol, refused, sw_result_t};

/// A command of a controller.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_command_t {
    /// Command_Data1.
    pub command_data1: i32,
    /// Control bits: sw_rtex_control_t; byte 2 is the low one.
    pub control: u16,
    /// Bytes 8 to 15, as the non-cyclic command lays them out.
    pub data: [u8; 8],
    /// Mac-ID, 0..31.
    pub mac_id: u8,
    /// Update_Counter, 0..3.
    pub update_counter: u8,
    /// TMG_CNT, 0 or 1.
    pub tmg_cnt: u8,
    /// Cyclic code: sw_rtex_mode_t, 0 for NOP.
    pub cyclic: u8,
    /// Non-cyclic code.
    pub noncyclic: u8,
}

/// What a drive sends: as received, not yet a valid position.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_response_t {
    /// Response_Data1.
    pub response_data1: i32,
    /// Status flags: sw_rtex_status_t; byte 2 is the low one.
    pub status: u16,
    /// Bytes 8 to 15, as the non-cyclic response lays them out.
    pub data: [u8; 8],
    /// Actual_MAC-ID.
    pub mac_id: u8,
    /// Update_Counter_Echo.
    pub update_counter_echo: u8,
    /// CMD_Error, 0 or 1.
    pub cmd_error: u8,
    /// Cyclic code, 0..15.
    pub cyclic: u8,
    /// Non-cyclic code, 0..7.
    pub noncyclic: u8,
}

#[inline(always)]
pub(super) fn error(error: Error) -> sw_result_t {
    refused(Protocol::Rtex, error.class().number())
}

pub(super) fn written_response(it: &Response) -> sw_rtex_response_t {
    let mut data = [0; 8];
    let words = [it.response_data2.to_le_bytes(), it.response_data3.to_le_bytes()];
    for (to, from) in data.iter_mut().zip(words.as_flattened()) {
        *to = *from;
    }
    sw_rtex_response_t {
        response_data1: it.response_data1,
        status: u16::from_le_bytes(it.status.to_bytes()),
        data,
        mac_id: it.mac_id.get(),
        update_counter_echo: it.update_counter_echo.get(),
        cmd_error: it.cmd_error.into(),
        cyclic: it.code.cyclic_bits(),
        noncyclic: it.code.noncyclic_bits(),
    }
}

pub(super) fn written_command(it: &Command) -> sw_rtex_command_t {
    sw_rtex_command_t {
        command_data1: it.command_data1,
        control: u16::from_le_bytes(it.control.to_bytes()),
        data: it.noncyclic.emit(),
        mac_id: it.mac_id.get(),
        update_counter: it.update_counter.get(),
        tmg_cnt: it.tmg_cnt.into(),
        cyclic: it.cyclic as u8,
        noncyclic: it.noncyclic.code() as u8,
    }
}

/// The response in a block of 16 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_parse_response(
    bytes: *const u8,
    len: usize,
    response: Option<&mut MaybeUninit<sw_rtex_response_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let response = there(response)?;
        response.write(written_response(&Response::parse(bytes).map_err(error)?));
        OK
    })
}

/// The command in a block of 16 bytes, as a drive receives it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_parse_command(
    bytes: *const u8,
    len: usize,
    command: Option<&mut MaybeUninit<sw_rtex_command_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let command = there(command)?;
        command.write(written_command(&Command::parse(bytes).map_err(error)?));
        OK
    })
}

pub(super) fn command(it: &sw_rtex_command_t) -> Result<Command, Refused> {
    let noncyclic = in_range(NonCyclicCode::from_code(it.noncyclic))?;
    Ok(Command {
        mac_id: in_range(MacId::new(it.mac_id))?,
        update_counter: in_range(UpdateCounter::new(it.update_counter))?,
        tmg_cnt: in_range((it.tmg_cnt < 2).then_some(it.tmg_cnt == 1))?,
        cyclic: in_range(CyclicCode::from_code(it.cyclic))?,
        control: ControlBits::from_bytes(it.control.to_le_bytes()),
        command_data1: it.command_data1,
        noncyclic: NonCyclicCommand::parse(noncyclic, it.data),
    })
}

/// The block of a command, 16 bytes. Reserved bits are sent as 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_build_command(
    it: Option<&sw_rtex_command_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { filled(bytes, size, || Ok(command(there(it)?)?.emit())) }
}
