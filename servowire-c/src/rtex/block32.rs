//! The 32-byte mode: a sub block after the main one. And responses as a drive makes them.

use core::mem::MaybeUninit;

use rtex_block::{
    Code, Command, Command32, ControlBits, Execution, MacId, Nibble, Response, Response32, StatusFlags, SubCode,
    SubCommand, SubResponse, UpdateCounter,
};

use super::block::{command, error, sw_rtex_command_t, sw_rtex_response_t, written_command, written_response};
use crate::border::{OK, Refused, border, filled, in_range, parsed, read, there};
use crate::result::sw_result_t;

/// The sub block of a command, bytes 16 to 31.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_sub_command_t {
    /// Sub_Command_Data1.
    pub data1: i32,
    /// Sub_Command_Data2.
    pub data2: i32,
    /// Sub_Command_Data3.
    pub data3: i32,
    /// Sub_Index.
    pub index: u16,
    /// Sub-command code: 0 normal, 2 system ID, 10 monitor.
    pub code: u8,
    /// Sub_Type_Code.
    pub type_code: u8,
}

/// The sub block of a response, bytes 16 to 31.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_sub_response_t {
    /// Sub_Response_Data1.
    pub data1: i32,
    /// Sub_Response_Data2.
    pub data2: i32,
    /// Sub_Response_Data3.
    pub data3: i32,
    /// Sub_Index_Echo, or Sub_Error_Code with Sub_CMD_Error.
    pub index: u16,
    /// Sub-command code, 0..15.
    pub code: u8,
    /// Sub_Type_Code_Echo.
    pub type_code: u8,
    /// Sub_CMD_Error, 0 or 1.
    pub cmd_error: u8,
    /// sw_rtex_execution_t, added.
    pub execution: u8,
}

fn sub_command(it: &sw_rtex_sub_command_t) -> Result<SubCommand, Refused> {
    Ok(SubCommand {
        code: in_range(SubCode::from_code(it.code))?,
        type_code: it.type_code,
        index: it.index,
        data1: it.data1,
        data2: it.data2,
        data3: it.data3,
    })
}

pub(super) fn written_sub(it: &SubResponse) -> sw_rtex_sub_response_t {
    sw_rtex_sub_response_t {
        data1: it.data1,
        data2: it.data2,
        data3: it.data3,
        index: it.index,
        code: it.code.get(),
        type_code: it.type_code,
        cmd_error: it.cmd_error.into(),
        execution: it.execution.bits(),
    }
}

fn sub_response(it: &sw_rtex_sub_response_t) -> Result<SubResponse, Refused> {
    Ok(SubResponse {
        cmd_error: in_range((it.cmd_error < 2).then_some(it.cmd_error == 1))?,
        execution: in_range(Execution::from_bits(it.execution))?,
        code: in_range(Nibble::new(it.code))?,
        type_code: it.type_code,
        index: it.index,
        data1: it.data1,
        data2: it.data2,
        data3: it.data3,
    })
}

fn response(it: &sw_rtex_response_t) -> Result<Response, Refused> {
    let code = in_range(it.cyclic.checked_mul(16).and_then(|high| high.checked_add(it.noncyclic)))?;
    in_range((it.noncyclic < 16).then_some(()))?;
    let (low, high) = it.data.split_at(4);
    let word = |bytes: &[u8]| bytes.try_into().map_or(0, i32::from_le_bytes);
    Ok(Response {
        mac_id: in_range(MacId::new(it.mac_id))?,
        update_counter_echo: in_range(UpdateCounter::new(it.update_counter_echo))?,
        cmd_error: in_range((it.cmd_error < 2).then_some(it.cmd_error == 1))?,
        code: in_range(Code::new(code))?,
        status: StatusFlags::from_bytes(it.status.to_le_bytes()),
        response_data1: it.response_data1,
        response_data2: word(low),
        response_data3: word(high),
    })
}

/// The command in a block of 16 bytes whose reserved bits have to be 0: SW_E_RTEX_RESERVED, SW_E_RTEX_CODE_PAIR.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_parse_command_strict(
    bytes: *const u8,
    len: usize,
    command: Option<&mut MaybeUninit<sw_rtex_command_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| Ok(written_command(&Command::parse_strict(bytes).map_err(error)?));
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, command, parse) }
}

/// The command in a block of 32 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_parse_command32(
    bytes: *const u8,
    len: usize,
    command: Option<&mut MaybeUninit<sw_rtex_command_t>>,
    sub: Option<&mut MaybeUninit<sw_rtex_sub_command_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, command, sub) = (unsafe { read(bytes, len)? }, there(command)?, there(sub)?);
        let it = Command32::parse(bytes).map_err(error)?;
        command.write(written_command(&it.main));
        sub.write(sw_rtex_sub_command_t {
            data1: it.sub.data1,
            data2: it.sub.data2,
            data3: it.sub.data3,
            index: it.sub.index,
            code: it.sub.code as u8,
            type_code: it.sub.type_code,
        });
        OK
    })
}

/// The block of a command of the 32-byte mode.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_build_command32(
    it: Option<&sw_rtex_command_t>,
    sub: Option<&sw_rtex_sub_command_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    let make = || Ok(Command32 { main: command(there(it)?)?, sub: sub_command(there(sub)?)? }.emit());
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { filled(bytes, size, make) }
}

/// The response in a block of 32 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_parse_response32(
    bytes: *const u8,
    len: usize,
    response: Option<&mut MaybeUninit<sw_rtex_response_t>>,
    sub: Option<&mut MaybeUninit<sw_rtex_sub_response_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, response, sub) = (unsafe { read(bytes, len)? }, there(response)?, there(sub)?);
        let it = Response32::parse(bytes).map_err(error)?;
        response.write(written_response(&it.main));
        sub.write(written_sub(&it.sub));
        OK
    })
}

/// The block of a response, 16 bytes, as a drive sends it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_build_response(
    it: Option<&sw_rtex_response_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { filled(bytes, size, || Ok(response(there(it)?)?.emit())) }
}

/// The block of a response of the 32-byte mode, as a drive sends it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_build_response32(
    it: Option<&sw_rtex_response_t>,
    sub: Option<&sw_rtex_sub_response_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    let make = || Ok(Response32 { main: response(there(it)?)?, sub: sub_response(there(sub)?)? }.emit());
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { filled(bytes, size, make) }
}

/// The control bits that a drive knows, of bytes 2 and 3 (byte 2 is the low one); the others are reserved.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_known_control(control: u16) -> u16 {
    ControlBits::from_bytes(control.to_le_bytes()).bits()
}
