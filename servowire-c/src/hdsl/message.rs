//! Short and long messages of the parameters channel.

use core::mem::MaybeUninit;

use hdsl::Error;
use hdsl::message::{
    Access, Data, Length, LongAnswer, LongRequest, MessageBytes, Offset, RemoteRegister, ResourceAddress,
    ResourceError, ShortAnswer, ShortRequest,
};

use super::error;
use super::receiver::sw_hdsl_t;
use crate::border::{OK, Refused, border, given, in_range, parsed, read, there};
use crate::result::{sw_code_t, sw_result_t};

/// Bytes of the longest message.
pub const SW_HDSL_MESSAGE: usize = 14;
const _: () = assert!(SW_HDSL_MESSAGE == MessageBytes::MAX);
/// The offset of a long message that has none.
pub const SW_HDSL_NO_OFFSET: u16 = 0xffff;

/// A short message: a register of the encoder is read or written.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_short_t {
    /// Address, 40h..7Fh.
    pub register_address: u8,
    /// 1: write, 0: read.
    pub write: u8,
    /// The value to write.
    pub value: u8,
}

/// A long message: a resource of the encoder is read or written.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_long_t {
    /// Address of the resource, 10 bits.
    pub address: u16,
    /// Offset, 15 bits; SW_HDSL_NO_OFFSET for none.
    pub offset: u16,
    /// 1: write, 0: read.
    pub write: u8,
    /// 1: indirect addressing.
    pub indirect: u8,
    /// Bytes to be read or written: 0, 2, 4 or 8.
    pub len: u8,
    /// The value to write.
    pub data: [u8; 8],
}

/// The data of an answer. Of SW_E_HDSL_RESOURCE they are the error code of the encoder: detail, then class.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_data_t {
    /// Bytes of it.
    pub len: u8,
    /// The bytes, 0 after them.
    pub data: [u8; 8],
}

/// How the messages that ended in the last H-frame ended.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_finished_t {
    /// SW_PENDING: none ended; SW_OK, or why it failed.
    pub short_result: sw_result_t,
    /// The same for the long message.
    pub long_result: sw_result_t,
    /// The result of the long message.
    pub data: sw_hdsl_data_t,
    /// The register of the short message.
    pub register_address: u8,
    /// The value read; 0 after a write.
    pub value: u8,
}

const NOTHING: sw_hdsl_data_t = sw_hdsl_data_t { len: 0, data: [0; 8] };

fn register(address: u8) -> Result<RemoteRegister, Refused> {
    in_range(RemoteRegister::new(address))
}

fn flag(it: u8) -> Result<bool, Refused> {
    in_range((it < 2).then_some(it == 1))
}

fn short(it: sw_hdsl_short_t) -> Result<ShortRequest, Refused> {
    let register = register(it.register_address)?;
    Ok(if flag(it.write)? { ShortRequest::Write(register, it.value) } else { ShortRequest::Read(register) })
}

fn data(len: u8, data: [u8; 8]) -> Result<Data, Refused> {
    Data::new(in_range(data.get(..usize::from(len)))?).map_err(error)
}

fn length(len: u8) -> Result<Length, Refused> {
    Ok(data(len, [0; 8])?.length())
}

fn long(it: &sw_hdsl_long_t) -> Result<LongRequest, Refused> {
    let access = if flag(it.write)? { Access::Write(data(it.len, it.data)?) } else { Access::Read(length(it.len)?) };
    let offset = if it.offset == SW_HDSL_NO_OFFSET { None } else { Some(in_range(Offset::new(it.offset))?) };
    Ok(LongRequest {
        address: in_range(ResourceAddress::new(it.address))?,
        indirect: flag(it.indirect)?,
        offset,
        access,
    })
}

fn data_of(it: &Data) -> sw_hdsl_data_t {
    sw_hdsl_data_t { len: u8::try_from(it.as_bytes().len()).unwrap_or(8), data: it.padded() }
}

fn code_of(it: ResourceError) -> sw_hdsl_data_t {
    sw_hdsl_data_t { len: 2, data: [it.detail(), it.class_code(), 0, 0, 0, 0, 0, 0] }
}

/// The bytes of a short message with their CRC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_build_short(
    it: Option<&sw_hdsl_short_t>,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { given(bytes, size, len, || Ok(short(*there(it)?)?.emit()), MessageBytes::as_bytes) }
}

/// A short message as an encoder receives it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_parse_short(
    bytes: *const u8,
    len: usize,
    it: Option<&mut MaybeUninit<sw_hdsl_short_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| {
        let (register, write, value) = match ShortRequest::parse(bytes).map_err(error)? {
            ShortRequest::Read(register) => (register, 0, 0),
            ShortRequest::Write(register, value) => (register, 1, value),
        };
        Ok(sw_hdsl_short_t { register_address: register.address(), write, value })
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, it, parse) }
}

/// What the encoder answers to a short message, with the value that was read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_build_short_answer(
    it: Option<&sw_hdsl_short_t>,
    value: u8,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    let make = || {
        let it = there(it)?;
        let data = if flag(it.write)? { None } else { Some(value) };
        Ok(ShortAnswer { register: register(it.register_address)?, data }.emit())
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { given(bytes, size, len, make, MessageBytes::as_bytes) }
}

/// The answer to a short message: the value that was read, 0 after a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_parse_short_answer(
    it: Option<&sw_hdsl_short_t>,
    bytes: *const u8,
    len: usize,
    value: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| Ok(short(*there(it)?)?.parse_answer(bytes).map_err(error)?.data.unwrap_or(0));
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, value, parse) }
}

/// The bytes of a long message with their CRC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_build_long(
    it: Option<&sw_hdsl_long_t>,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { given(bytes, size, len, || Ok(long(there(it)?)?.emit()), MessageBytes::as_bytes) }
}

/// A long message as an encoder receives it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_parse_long(
    bytes: *const u8,
    len: usize,
    it: Option<&mut MaybeUninit<sw_hdsl_long_t>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| {
        let request = LongRequest::parse(bytes).map_err(error)?;
        let (write, data) = match request.access {
            Access::Read(length) => {
                (0, sw_hdsl_data_t { len: u8::try_from(length.bytes()).unwrap_or(8), data: [0; 8] })
            }
            Access::Write(data) => (1, data_of(&data)),
        };
        Ok(sw_hdsl_long_t {
            address: request.address.get(),
            offset: request.offset.map_or(SW_HDSL_NO_OFFSET, Offset::get),
            write,
            indirect: request.indirect.into(),
            len: data.len,
            data: data.data,
        })
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, it, parse) }
}

/// What the encoder answers to a long message: data, or (`refuses` is 1) its error code, detail and class.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_build_long_answer(
    it: Option<&sw_hdsl_long_t>,
    refuses: u8,
    answer: Option<&sw_hdsl_data_t>,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    let make = || {
        let (it, answer) = (there(it)?, there(answer)?);
        let [detail, class, ..] = answer.data;
        let result =
            if flag(refuses)? { Err(ResourceError::new(class, detail)) } else { Ok(data(answer.len, answer.data)?) };
        Ok(LongAnswer::to(&long(it)?, result).emit())
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { given(bytes, size, len, make, MessageBytes::as_bytes) }
}

/// The answer to a long message. Of SW_E_HDSL_RESOURCE the code of the encoder is written too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_parse_long_answer(
    it: Option<&sw_hdsl_long_t>,
    bytes: *const u8,
    len: usize,
    answer: Option<&mut MaybeUninit<sw_hdsl_data_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (it, bytes, answer) = (there(it)?, unsafe { read(bytes, len)? }, there(answer)?);
        match long(it)?.parse_answer(bytes) {
            Ok(data) => {
                answer.write(data_of(&data));
                OK
            }
            Err(refusal) => {
                if let Error::Resource { error } = refusal {
                    answer.write(code_of(error));
                }
                Err(error(refusal))
            }
        }
    })
}

/// Starts a short message on a running link; sw_hdsl_finished() reports its end. SW_E_HDSL_BUSY,
/// SW_E_HDSL_NOT_LOCKED. A failed message may be sent again up to the limit of tries.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_send_short(m: Option<&mut sw_hdsl_t>, it: Option<&sw_hdsl_short_t>) -> sw_result_t {
    border(|| {
        let (m, it) = (sw_hdsl_t::get(m)?, there(it)?);
        m.start_short(short(*it)?).map_err(error)?;
        OK
    })
}

/// Starts a long message on a running link, which is sent once.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_send_long(m: Option<&mut sw_hdsl_t>, it: Option<&sw_hdsl_long_t>) -> sw_result_t {
    border(|| {
        let (m, it) = (sw_hdsl_t::get(m)?, there(it)?);
        m.start_long(long(it)?).map_err(error)?;
        OK
    })
}

/// Drops all messages, and tells the encoder so (MRST).
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_reset_messages(m: Option<&mut sw_hdsl_t>) -> sw_result_t {
    border(|| {
        let _ = sw_hdsl_t::get(m)?.reset_messages().map_err(error)?;
        OK
    })
}

/// Returns which messages ended in the last H-frame heard.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_finished(
    m: Option<&sw_hdsl_t>,
    finished: Option<&mut MaybeUninit<sw_hdsl_finished_t>>,
) -> sw_result_t {
    border(|| {
        let (m, out) = (sw_hdsl_t::look(m)?, there(finished)?);
        let it = m.h_frame().finished;
        let (ok, pending) = (sw_code_t::SW_OK as sw_result_t, sw_code_t::SW_PENDING as sw_result_t);
        let (short_result, register_address, value) = match it.short {
            None => (pending, 0, 0),
            Some(Ok(answer)) => (ok, answer.register.address(), answer.data.unwrap_or(0)),
            Some(Err(refusal)) => (error(refusal), 0, 0),
        };
        let (long_result, data) = match it.long {
            None => (pending, NOTHING),
            Some(Ok(answer)) => match answer.result {
                Ok(data) => (ok, data_of(&data)),
                Err(code) => (error(Error::Resource { error: code }), code_of(code)),
            },
            Some(Err(refusal)) => (error(refusal), NOTHING),
        };
        out.write(sw_hdsl_finished_t { short_result, long_result, data, register_address, value });
        OK
    })
}
