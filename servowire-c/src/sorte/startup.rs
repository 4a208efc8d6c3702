//! Frames of the start-up: DISCOVERY, PARAM, DELAY_REQ, SYNC, and the preamble before a frame.

use core::mem::MaybeUninit;

use sorte_proto::{
    CrcMode, DelayReq, DeviceAddress, DiscoveryView, LongFrame, Param, ParamView, Parameters, Place, Status, Sync,
    crc8_update, strip_preamble,
};

use super::error;
use crate::border::{OK, block, border, cleared, filled, in_range, read, there};
use crate::result::{sw_code_t, sw_result_t};

/// Bytes of a DISCOVERY frame, from its destination to its check sequence.
pub const SW_SORTE_DISCOVERY: usize = 1030;
const _: () = assert!(SW_SORTE_DISCOVERY == sorte_proto::Discovery::LEN);

/// Types of the frames with a long header.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_sorte_type_t {
    /// DISCOVERY.
    SW_SORTE_DISCOVERY_FRAME = 1,
    /// PARAM.
    SW_SORTE_PARAM_FRAME = 2,
    /// DELAY_REQ.
    SW_SORTE_DELAY_REQ_FRAME = 3,
    /// DELAY_RESP.
    SW_SORTE_DELAY_RESP_FRAME = 4,
    /// SYNC.
    SW_SORTE_SYNC_FRAME = 5,
}

/// The header of a frame of the start-up; its payload begins at byte 4.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_header_t {
    /// SA.
    pub source: u8,
    /// sw_sorte_type_t.
    pub frame_type: u8,
    /// STATUS.
    pub status: u8,
    /// Bytes of the payload.
    pub payload_len: u16,
}

/// The content of a PARAM frame, for all devices.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_param_t {
    /// Cycle time, ns.
    pub cycle_time_ns: u32,
    /// SYNC_CYCLE.
    pub sync_cycle: u32,
    /// DELAY_FWD_TIME, ns.
    pub delay_fwd_time_ns: u32,
    /// IPG, 5 ns.
    pub ipg_5ns: u32,
    /// T_IN, ns.
    pub t_in_ns: u32,
    /// T_OUT, ns.
    pub t_out_ns: u32,
    /// DELAY_PERIOD, ms.
    pub delay_period_ms: u16,
    /// DELAY_BURST.
    pub delay_burst: u8,
    /// DELAY_GAP, ms.
    pub delay_gap_ms: u8,
    /// TOPOLOGY.
    pub topology: u8,
    /// DIAGNOSTICS.
    pub diagnostics: u8,
    /// ALARM.
    pub alarm: u8,
    /// CRC_MODE: low nibble output, high nibble input.
    pub crc_mode: u8,
    /// SA, of the frame.
    pub source: u8,
    /// STATUS, of the frame.
    pub status: u8,
}

/// A SYNC frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_sync_t {
    /// Master time at which its start is expected at the receiver, ns.
    pub time_stamp_ns: u32,
    /// Delay from the master to the receiver, ns.
    pub delay_ns: u16,
    /// SA.
    pub source: u8,
    /// STATUS.
    pub status: u8,
}

/// A DISCOVERY frame, without its table.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_discovery_t {
    /// Devices that have passed it on.
    pub count: u16,
    /// Bytes from all devices.
    pub input_total: u16,
    /// Bytes to all devices.
    pub output_total: u16,
    /// SA.
    pub source: u8,
    /// STATUS.
    pub status: u8,
}

/// Continues the CRC-8 of the IO exchange over more bytes, after those that gave `crc`; it starts from 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_crc8(bytes: *const u8, len: usize, crc: Option<&mut u8>) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, crc) = (unsafe { read(bytes, len)? }, there(crc)?);
        *crc = crc8_update(*crc, bytes);
        OK
    })
}

/// Where the frame begins after its preamble, which ends with D5h.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_strip_preamble(
    bytes: *const u8,
    len: usize,
    at: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, at) = (unsafe { read(bytes, len)? }, there(at)?);
        at.write(bytes.len().saturating_sub(strip_preamble(bytes).map_err(error)?.len()));
        OK
    })
}

/// A frame of the start-up, with all checks: destination, type, length, check sequence.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_header(
    bytes: *const u8,
    len: usize,
    header: Option<&mut MaybeUninit<sw_sorte_header_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, len)? }, there(header)?);
        let frame = LongFrame::parse(bytes).map_err(error)?;
        out.write(sw_sorte_header_t {
            source: frame.source(),
            frame_type: frame.frame_type().code(),
            status: frame.status().bits(),
            payload_len: u16::try_from(frame.payload().len()).unwrap_or(u16::MAX),
        });
        OK
    })
}

/// A PARAM frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_param(
    bytes: *const u8,
    len: usize,
    param: Option<&mut MaybeUninit<sw_sorte_param_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, len)? }, there(param)?);
        let view = ParamView::parse(bytes).map_err(error)?;
        let it = view.parameters();
        out.write(sw_sorte_param_t {
            cycle_time_ns: it.cycle_time_ns,
            sync_cycle: it.sync_cycle,
            delay_fwd_time_ns: it.delay_fwd_time_ns,
            ipg_5ns: it.ipg_5ns,
            t_in_ns: it.t_in_ns,
            t_out_ns: it.t_out_ns,
            delay_period_ms: it.delay_period_ms,
            delay_burst: it.delay_burst,
            delay_gap_ms: it.delay_gap_ms,
            topology: it.topology,
            diagnostics: it.diagnostics,
            alarm: it.alarm,
            crc_mode: it.crc_mode.byte(),
            source: view.source(),
            status: view.status().bits(),
        });
        OK
    })
}

/// The bytes of a PARAM frame, 40.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_param(
    param: Option<&sw_sorte_param_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (it, bytes) = (there(param)?, unsafe { block(bytes, size)? });
        let parameters = Parameters {
            cycle_time_ns: it.cycle_time_ns,
            sync_cycle: it.sync_cycle,
            delay_period_ms: it.delay_period_ms,
            delay_burst: it.delay_burst,
            delay_gap_ms: it.delay_gap_ms,
            delay_fwd_time_ns: it.delay_fwd_time_ns,
            ipg_5ns: it.ipg_5ns,
            t_in_ns: it.t_in_ns,
            t_out_ns: it.t_out_ns,
            topology: it.topology,
            diagnostics: it.diagnostics,
            alarm: it.alarm,
            crc_mode: CrcMode::from_byte(it.crc_mode),
        };
        let frame = Param { source: it.source, status: Status::from_bits_retain(it.status), parameters };
        bytes.write(frame.emit());
        OK
    })
}

/// A DELAY_REQ frame has nothing but its header: this makes its 8 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_delay_req(source: u8, status: u8, bytes: *mut u8, size: usize) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { filled(bytes, size, || Ok(DelayReq { source, status: Status::from_bits_retain(status) }.emit())) }
}

/// A SYNC frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_sync(
    bytes: *const u8,
    len: usize,
    sync: Option<&mut MaybeUninit<sw_sorte_sync_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, len)? }, there(sync)?);
        let it = Sync::parse(bytes).map_err(error)?;
        out.write(sw_sorte_sync_t {
            time_stamp_ns: it.time_stamp_ns,
            delay_ns: it.delay_ns,
            source: it.source,
            status: it.status.bits(),
        });
        OK
    })
}

/// The bytes of a SYNC frame, 14.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_sync(
    sync: Option<&sw_sorte_sync_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (it, bytes) = (there(sync)?, unsafe { block(bytes, size)? });
        let frame = Sync {
            source: it.source,
            status: Status::from_bits_retain(it.status),
            time_stamp_ns: it.time_stamp_ns,
            delay_ns: it.delay_ns,
        };
        bytes.write(frame.emit());
        OK
    })
}

/// Reads a DISCOVERY frame; sw_sorte_discovered() reads its table.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_discovery(
    bytes: *const u8,
    len: usize,
    discovery: Option<&mut MaybeUninit<sw_sorte_discovery_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, out) = (unsafe { read(bytes, len)? }, there(discovery)?);
        let view = DiscoveryView::parse(bytes).map_err(error)?;
        out.write(sw_sorte_discovery_t {
            count: view.count(),
            input_total: view.input_total(),
            output_total: view.output_total(),
            source: view.source(),
            status: view.status().bits(),
        });
        OK
    })
}

/// The bytes from and to the device at an address, in a DISCOVERY frame. SW_E_NO_VALUE if it has no entry.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_discovered(
    bytes: *const u8,
    len: usize,
    address: u8,
    input: Option<&mut MaybeUninit<u16>>,
    output: Option<&mut MaybeUninit<u16>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (bytes, input, output) = (unsafe { read(bytes, len)? }, there(input)?, there(output)?);
        let address = in_range(DeviceAddress::try_from(address).ok())?;
        let view = DiscoveryView::parse(bytes).map_err(error)?;
        let entry = view.entry(address).ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?;
        input.write(entry.input);
        output.write(entry.output);
        OK
    })
}

/// The DISCOVERY frame that a master sends, SW_SORTE_DISCOVERY bytes; `last` true for the last one of its
/// phase, which takes the devices to the next phase.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_discovery(last: bool, bytes: *mut u8, size: usize) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory; only what the frame takes is touched.
        let bytes = unsafe { cleared(bytes, size, SW_SORTE_DISCOVERY)? };
        let place = if last { Place::Last } else { Place::Inner };
        let _ = sorte_proto::Discovery::emit_request_into(place, bytes).map_err(error)?;
        OK
    })
}
