//! One call a message: no choice at run time, and only the fields that are there.

use core::mem::MaybeUninit;

use tformat::{AllData, Request, Response};

use super::codec::error;
use crate::border::{OK, border, read, there};
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
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let data = there(data)?;
        match Response::parse(Request::ReadSingleTurn, bytes) {
            Ok(Response::ReadSingleTurn(it)) => {
                data.write(sw_tformat_single_turn_t { abs: it.abs.get(), sf: it.sf.bits() });
                OK
            }
            Ok(_) => Err(OTHER_KIND),
            Err(refusal) => Err(error(refusal)),
        }
    })
}

/// The response to ID 1 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_multi_turn(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_multi_turn_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let data = there(data)?;
        match Response::parse(Request::ReadMultiTurn, bytes) {
            Ok(Response::ReadMultiTurn(it)) => {
                data.write(sw_tformat_multi_turn_t { abm: it.abm.get(), sf: it.sf.bits() });
                OK
            }
            Ok(_) => Err(OTHER_KIND),
            Err(refusal) => Err(error(refusal)),
        }
    })
}

/// The response to ID 2 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_encoder_id(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_encoder_id_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let data = there(data)?;
        match Response::parse(Request::ReadEncoderId, bytes) {
            Ok(Response::ReadEncoderId(it)) => {
                data.write(sw_tformat_encoder_id_t { sf: it.sf.bits(), enid: it.enid });
                OK
            }
            Ok(_) => Err(OTHER_KIND),
            Err(refusal) => Err(error(refusal)),
        }
    })
}

/// The response to ID 3 from UART bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_all(
    bytes: *const u8,
    len: usize,
    data: Option<&mut MaybeUninit<sw_tformat_all_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let data = there(data)?;
        match AllData::parse(bytes) {
            Ok(it) => {
                data.write(sw_tformat_all_t {
                    abs: it.abs.get(),
                    abm: it.abm.get(),
                    sf: it.sf.bits(),
                    enid: it.enid,
                    almc: it.almc.bits(),
                });
                OK
            }
            Err(refusal) => Err(error(refusal)),
        }
    })
}
