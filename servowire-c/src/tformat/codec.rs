//! Frames of T-Format to and from C structs.

use core::mem::MaybeUninit;

use tformat::master::parse_echoed;
use tformat::{
    Abm, Abs, Adf, AllData, Almc, BitOrder, ControlField, DataId, Error, Frame, Identification, Memory, MultiTurn,
    Request, Resolution, Response, SingleTurn, StatusField, Window,
};

use crate::border::{OK, Refused, border, fill, given, in_range, read, room, there};
use crate::result::{Protocol, refused, sw_result_t};

/// A request of a master.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_request_t {
    /// Data ID: sw_tformat_id_t.
    pub id: u8,
    /// Address field of IDs 6 and D.
    pub adf: u8,
    /// Data field of ID 6.
    pub edf: u8,
}

/// A response of an encoder. Fields that the response to this data ID does not have are 0.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct sw_tformat_response_t {
    /// Single-turn data, 24 bits, right-aligned: as received, not yet a valid position.
    pub abs: u32,
    /// Multi-turn data, 24 bits, as received.
    pub abm: u32,
    /// Data ID: sw_tformat_id_t.
    pub id: u8,
    /// Status field: sw_tformat_sf_t.
    pub sf: u8,
    /// Encoder ID.
    pub enid: u8,
    /// Error byte: sw_tformat_almc_t.
    pub almc: u8,
    /// Address field: sw_tformat_adf_t.
    pub adf: u8,
    /// Data field of the EEPROM.
    pub edf: u8,
}

/// Where a frame is wrong, and in what way.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct sw_detail_t {
    /// The value received: a byte, or a count of fields; 0 if the error has none.
    pub got: u32,
    /// The value expected, or the bits that must be 0.
    pub want: u32,
    /// The field in which the fault shows, 0 for the control field; 255 if it is not in one field.
    pub field: u8,
    /// The first wrong bit of that field: 0 is the start bit, 1 to 8 are data, 9 is the delimiter; 255 if it cannot be told.
    pub bit: u8,
}

#[inline(always)]
pub(super) fn error(error: Error) -> sw_result_t {
    refused(Protocol::Tformat, error.class().number())
}

#[inline(always)]
pub(super) fn request(request: sw_tformat_request_t) -> Result<Request, Refused> {
    let id = in_range(DataId::from_code(request.id))?;
    Ok(Request::of(id, Adf::from_bits(request.adf), request.edf))
}

#[inline(always)]
pub(super) fn flat(response: &Response) -> sw_tformat_response_t {
    let none = sw_tformat_response_t { id: response.data_id().code(), ..Default::default() };
    match *response {
        Response::ReadAll(AllData { sf, abs, enid, abm, almc }) => {
            sw_tformat_response_t { abs: abs.get(), abm: abm.get(), sf: sf.bits(), enid, almc: almc.bits(), ..none }
        }
        Response::ReadMultiTurn(MultiTurn { sf, abm }) => {
            sw_tformat_response_t { sf: sf.bits(), abm: abm.get(), ..none }
        }
        Response::ReadEncoderId(Identification { sf, enid }) => sw_tformat_response_t { sf: sf.bits(), enid, ..none },
        Response::WriteEeprom(Memory { adf, edf }) | Response::ReadEeprom(Memory { adf, edf }) => {
            sw_tformat_response_t { adf: adf.bits(), edf, ..none }
        }
        Response::ReadSingleTurn(SingleTurn { sf, abs })
        | Response::ResetErrors(SingleTurn { sf, abs })
        | Response::SetSingleTurnZero(SingleTurn { sf, abs })
        | Response::ResetTurnsAndErrors(SingleTurn { sf, abs }) => {
            sw_tformat_response_t { sf: sf.bits(), abs: abs.get(), ..none }
        }
    }
}

fn deep(response: sw_tformat_response_t) -> Result<Response, Refused> {
    let id = in_range(DataId::from_code(response.id))?;
    let (sf, enid) = (StatusField::from_bits_retain(response.sf), response.enid);
    let abs = in_range(Abs::new(response.abs))?;
    let abm = in_range(Abm::new(response.abm))?;
    let single = SingleTurn { sf, abs };
    let memory = Memory { adf: Adf::from_bits(response.adf), edf: response.edf };
    Ok(match id {
        DataId::ReadSingleTurn => Response::ReadSingleTurn(single),
        DataId::ReadMultiTurn => Response::ReadMultiTurn(MultiTurn { sf, abm }),
        DataId::ReadEncoderId => Response::ReadEncoderId(Identification { sf, enid }),
        DataId::ReadAll => {
            Response::ReadAll(AllData { sf, abs, enid, abm, almc: Almc::from_bits_retain(response.almc) })
        }
        DataId::WriteEeprom => Response::WriteEeprom(memory),
        DataId::ResetErrors => Response::ResetErrors(single),
        DataId::SetSingleTurnZero => Response::SetSingleTurnZero(single),
        DataId::ResetTurnsAndErrors => Response::ResetTurnsAndErrors(single),
        DataId::ReadEeprom => Response::ReadEeprom(memory),
    })
}

#[cold]
fn detail(error: Error) -> sw_detail_t {
    let (got, want) = match error {
        Error::Truncated { got, want } => (got.into(), want.into()),
        Error::CfMismatch { got, want }
        | Error::Crc { got, want }
        | Error::AddressMismatch { got, want }
        | Error::DataMismatch { got, want }
        | Error::EchoMismatch { got, want, .. } => (got.into(), want.into()),
        Error::SinkCode { cf } | Error::Parity { cf } => (cf.into(), 0),
        Error::UnknownDataId { code } => (code.into(), 0),
        Error::Rejected { sf } => (sf.bits().into(), 0),
        Error::UpperBits { value, excess } => (value, excess),
        _ => (0, 0),
    };
    sw_detail_t { got, want, field: error.field().unwrap_or(255), bit: error.bit().unwrap_or(255) }
}

/// A refusal by its error, a value by writing it.
#[inline(always)]
pub(super) fn written<T, U>(
    outcome: Result<T, Error>,
    out: Option<&mut MaybeUninit<U>>,
    to: impl FnOnce(&T) -> U,
) -> Result<sw_result_t, Refused> {
    let out = there(out)?;
    match outcome {
        Ok(value) => {
            out.write(to(&value));
            OK
        }
        Err(refusal) => Err(error(refusal)),
    }
}

/// What `parse` makes of the caller's bytes or words.
///
/// # Safety As for [`read`].
#[inline(always)]
pub(super) unsafe fn answer<T>(
    asked: Option<&sw_tformat_request_t>,
    data: *const T,
    len: usize,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
    parse: impl FnOnce(Request, &[T]) -> Result<Response, Error>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        let data = unsafe { read(data, len)? };
        written(parse(request(*there(asked)?)?, data), response, flat)
    })
}

/// The response to a request from UART bytes; anything after it is ignored. Typed calls for IDs 0 to 3 are
/// faster.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse(
    asked: Option<&sw_tformat_request_t>,
    bytes: *const u8,
    len: usize,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { answer(asked, bytes, len, response, Response::parse) }
}

/// The response from what a UART received since the request began, with the receiver on all the time: the
/// request itself, then the response.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_echoed(
    asked: Option<&sw_tformat_request_t>,
    bytes: *const u8,
    len: usize,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { answer(asked, bytes, len, response, parse_echoed) }
}

/// The response from line bits on a grid of ten bits a field, start bits and delimiters included: `bits` of them in `bytes`, in the
/// order of sw_bit_order_t. Anything after the response, and bits after the 128th, are ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_line(
    asked: Option<&sw_tformat_request_t>,
    bytes: *const u8,
    bits: usize,
    order: u8,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, bits.div_ceil(8))? };
        let line = Window::read(bytes, 0, u32::try_from(bits).unwrap_or(128).min(128), bit_order(order)?);
        let line = in_range(line.ok())?;
        written(Response::parse_line(request(*there(asked)?)?, line), response, flat)
    })
}

fn bit_order(order: u8) -> Result<BitOrder, Refused> {
    in_range(match order {
        0 => Some(BitOrder::LsbFirst),
        1 => Some(BitOrder::MsbFirst),
        _ => None,
    })
}

/// Reads received fields as an encoder does: the request at the front.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_request(
    bytes: *const u8,
    len: usize,
    asked: Option<&mut MaybeUninit<sw_tformat_request_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        written(Request::parse(bytes), asked, |request| {
            let (adf, edf) = match *request {
                Request::WriteEeprom { adf, edf } => (adf.bits(), edf),
                Request::ReadEeprom { adf } => (adf.bits(), 0),
                _ => (0, 0),
            };
            sw_tformat_request_t { id: request.data_id().code(), adf, edf }
        })
    })
}

/// Returns why sw_tformat_parse() refuses these bytes. The result is the same as there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_why(
    asked: Option<&sw_tformat_request_t>,
    bytes: *const u8,
    len: usize,
    why: Option<&mut MaybeUninit<sw_detail_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let why = there(why)?;
        let refusal = Response::parse(request(*there(asked)?)?, bytes).err();
        why.write(refusal.map_or(sw_detail_t { field: 255, bit: 255, ..Default::default() }, detail));
        refusal.map_or(OK, |refusal| Err(error(refusal)))
    })
}

/// The fields to send for a request, at most 4 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_build(
    asked: Option<&sw_tformat_request_t>,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { given(bytes, size, len, || Ok(request(*there(asked)?)?.emit()), Frame::as_bytes) }
}

/// The line bits of a request, start bits and delimiters included, in the order of sw_bit_order_t, at most 40 bits in 5 bytes; `bits`
/// is how many. Bits after the last are 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_build_line(
    asked: Option<&sw_tformat_request_t>,
    order: u8,
    bytes: *mut u8,
    size: usize,
    bits: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { room(bytes, size)? };
        let line = request(*there(asked)?)?.emit().line();
        let (packed, bits) = (line.to_bytes(bit_order(order)?), there(bits)?);
        let count = line.len() as usize;
        fill(bytes, packed.get(..count.div_ceil(8)).unwrap_or(&packed))?;
        bits.write(count);
        OK
    })
}

/// The fields that an encoder sends, at most 11 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_build_response(
    response: Option<&sw_tformat_response_t>,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { given(bytes, size, len, || Ok(deep(*there(response)?)?.emit()), Frame::as_bytes) }
}

/// The control field of a data ID, 0..15: sink code, ID and parity. IDs above 15 are cut.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_control_field(id: u8) -> u8 {
    ControlField::compose(id & 0xf).get()
}

/// The data ID of a control field, with its checks.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_parse_control_field(cf: u8, id: Option<&mut MaybeUninit<u8>>) -> sw_result_t {
    border(|| written(ControlField::parse(cf).and_then(ControlField::data_id), id, |id| id.code()))
}

/// The check field over these bytes, their XOR; 0 for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_crc(bytes: *const u8, len: usize) -> u8 {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { read(bytes, len) }.map_or(0, tformat::crc)
}

/// The widths that an encoder ID suggests; true if a document or a log shows them, false if they follow from a rule. Without a
/// suggestion the result is SW_E_NO_VALUE.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_widths(
    enid: u8,
    abs_bits: Option<&mut MaybeUninit<u8>>,
    abm_bits: Option<&mut MaybeUninit<u8>>,
    documented: Option<&mut MaybeUninit<bool>>,
) -> sw_result_t {
    border(|| {
        let (abs_bits, abm_bits, documented) = (there(abs_bits)?, there(abm_bits)?, there(documented)?);
        let hint = Resolution::from_enid(enid).ok_or(crate::result::sw_code_t::SW_E_NO_VALUE as sw_result_t)?;
        abs_bits.write(hint.resolution.abs_bits());
        abm_bits.write(hint.resolution.abm_bits());
        documented.write(hint.documented);
        OK
    })
}
