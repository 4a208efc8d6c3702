//! One call per message: no choice at run time, and only the fields that exist.

use core::mem::MaybeUninit;

use tformat::{AllData, Request, Response};

use super::codec::error;
use crate::border::parsed;
use crate::result::{sw_code_t, sw_result_t};

/// ID 0.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_single_turn_t {
    /// Single-turn data, 24 bits, as received.
    pub abs: u32,
    /// Status field: sw_tformat_sf_t.
    pub sf: u8,
}

/// ID 1.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_multi_turn_t {
    /// Multi-turn data, 24 bits, as received.
    pub abm: u32,
    /// Status field: sw_tformat_sf_t.
    pub sf: u8,
}

/// ID 2.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_encoder_id_t {
    /// Status field: sw_tformat_sf_t.
    pub sf: u8,
    /// Encoder ID.
    pub enid: u8,
}

/// ID 3.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_all_t {
    /// Single-turn data, 24 bits, as received.
    pub abs: u32,
    /// Multi-turn data, 24 bits, as received.
    pub abm: u32,
    /// Status field: sw_tformat_sf_t.
    pub sf: u8,
    /// Encoder ID.
    pub enid: u8,
    /// Error byte: sw_tformat_almc_t.
    pub almc: u8,
}

/// Never: the response is of the kind that was asked for.
const OTHER_KIND: sw_result_t = sw_code_t::SW_E_ARGUMENT as sw_result_t;

/// The response to ID 0 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_single_turn(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_single_turn_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| match Response::parse(Request::ReadSingleTurn, bytes).map_err(error)? {
        Response::ReadSingleTurn(it) => Ok(sw_tformat_single_turn_t { abs: it.abs.get(), sf: it.sf.bits() }),
        _ => Err(OTHER_KIND),
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, data, parse) }
}

/// The response to ID 1 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_multi_turn(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_multi_turn_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| match Response::parse(Request::ReadMultiTurn, bytes).map_err(error)? {
        Response::ReadMultiTurn(it) => Ok(sw_tformat_multi_turn_t { abm: it.abm.get(), sf: it.sf.bits() }),
        _ => Err(OTHER_KIND),
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, data, parse) }
}

/// The response to ID 2 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_encoder_id(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_encoder_id_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| match Response::parse(Request::ReadEncoderId, bytes).map_err(error)? {
        Response::ReadEncoderId(it) => Ok(sw_tformat_encoder_id_t { sf: it.sf.bits(), enid: it.enid }),
        _ => Err(OTHER_KIND),
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, data, parse) }
}

/// The response to ID 3 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_all(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_all_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| {
        let it = AllData::parse(bytes).map_err(error)?;
        Ok(sw_tformat_all_t {
            abs: it.abs.get(),
            abm: it.abm.get(),
            sf: it.sf.bits(),
            enid: it.enid,
            almc: it.almc.bits(),
        })
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, data, parse) }
}
