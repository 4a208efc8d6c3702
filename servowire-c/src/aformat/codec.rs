//! Frames of A-format to and from C structs.

use core::mem::MaybeUninit;

use nikon_aformat::{
    BitOrder, Body, Command, Data, EncoderAddress, EncoderId, Error, Expected, Layout, Operation, Request, Resolution,
    Response, U19, UserAddress, Version, Window,
};

use super::names::sw_aformat_option_t;
use crate::border::{OK, Refused, border, in_range, read, room, there};
use crate::result::{Protocol, refused, sw_code_t, sw_result_t};

/// A request of a master. Fields that the command does not take are ignored.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_request_t {
    /// Data of a write: a word (command 14), an identification code (18, 19, 20), a coefficient (18 with frame code 3).
    pub data: u32,
    /// CC, 0..30.
    pub command: u8,
    /// EA, 0..7.
    pub ea: u8,
    /// Frame code: 3 for banks (13, 14) and the velocity coefficient (16, 18) of version 3.0, else 0.
    pub fc: u8,
    /// Address of commands 13 and 14.
    pub address: u8,
    /// Bank of commands 13 and 14 with frame code 3.
    pub bank: u8,
}

/// Widths of an encoder, and its factory settings.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_encoder_t {
    /// Bits of the single turn.
    pub st_bits: u8,
    /// Bits of the turns; at most 40 together with those of the single turn.
    pub mt_bits: u8,
    /// sw_aformat_option_t, added.
    pub options: u8,
}

/// A response of an encoder. Fields that the layout does not have are 0.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct sw_aformat_response_t {
    /// Position bits as received, from bit 0 upwards; for ABS24H from bit 16 upwards.
    pub abs: u64,
    /// Velocity.
    pub velocity: i32,
    /// EEPROM word, identification code or velocity coefficient.
    pub data: u32,
    /// ALM.
    pub alm: u16,
    /// Acceleration.
    pub acceleration: i16,
    /// Temperature, 10 bits.
    pub temperature: u16,
    /// sw_aformat_layout_t.
    pub layout: u8,
    /// CC; 0 in ABS17, which does not have it.
    pub command: u8,
    /// EA.
    pub ea: u8,
    /// ES: sw_aformat_es_t. ABS17 has one bit for all of them: all or none are set.
    pub es: u8,
    /// PM-ALM.
    pub pm_alm: u8,
    /// EEPROM address.
    pub address: u8,
    /// EEPROM bank.
    pub bank: u8,
}

#[inline(always)]
pub(super) fn error(error: Error) -> sw_result_t {
    refused(Protocol::Aformat, error.class().number())
}

pub(super) fn request(it: &sw_aformat_request_t) -> Result<Request, Refused> {
    let command = in_range(Command::from_code(it.command))?;
    let ea = in_range(EncoderAddress::new(it.ea))?;
    let id = || in_range(EncoderId::new(it.data));
    let word = || in_range(u16::try_from(it.data).ok());
    let operation = match (it.fc, command) {
        (3, Command::EepromRead) => Operation::EepromReadBank { bank: it.bank, address: it.address },
        (3, Command::EepromWrite) => Operation::EepromWriteBank { bank: it.bank, address: it.address, data: word()? },
        (3, Command::IdRead1) => Operation::CoefficientRead,
        (3, Command::IdWrite1) => Operation::CoefficientWrite { coefficient: in_range(U19::new(it.data))? },
        (0, Command::EepromRead) => Operation::EepromRead { address: it.address },
        (0, Command::EepromWrite) => {
            Operation::EepromWrite { address: in_range(UserAddress::try_from(it.address).ok())?, data: word()? }
        }
        (0, Command::IdWrite1) => Operation::IdWrite1 { id: id()? },
        (0, Command::IdWrite2) => Operation::IdWrite2 { id: id()? },
        (0, Command::SetAddress2) => Operation::SetAddress2 { id: id()? },
        (0, command) => in_range(Operation::without_arguments(command))?,
        _ => return Err(sw_code_t::SW_E_ARGUMENT as sw_result_t),
    };
    Ok(Request::new(ea, operation))
}

pub(super) fn resolution(it: sw_aformat_encoder_t) -> Result<Resolution, Refused> {
    let has = |option: sw_aformat_option_t| it.options & option as u8 != 0;
    in_range((it.options < 8).then_some(()))?;
    let mut resolution = in_range(Resolution::new(it.st_bits, it.mt_bits).ok())?;
    if has(sw_aformat_option_t::SW_AFORMAT_VERSION_3_0) {
        resolution = resolution.with_version(Version::V3_0);
    }
    if has(sw_aformat_option_t::SW_AFORMAT_VELOCITY_IN_LOW) {
        resolution = resolution.with_velocity_in_low();
    }
    if has(sw_aformat_option_t::SW_AFORMAT_POSITION_IN_RESETS) {
        resolution = resolution.with_position_in_resets();
    }
    Ok(resolution)
}

fn number(layout: Layout) -> u8 {
    (0..).zip(Layout::ALL).find(|(_, other)| *other == layout).map_or(255, |(number, _)| number)
}

pub(super) fn flat(response: &Response) -> sw_aformat_response_t {
    let mut flat = sw_aformat_response_t {
        layout: number(response.layout()),
        ea: response.ea.get(),
        abs: response.abs().unwrap_or(0),
        alm: response.alm().map_or(0, |alm| alm.bits()),
        velocity: response.velocity().unwrap_or(0),
        temperature: response.temperature().map_or(0, nikon_aformat::Temperature::raw),
        ..Default::default()
    };
    match response.body {
        Body::Abs17 { es_any, .. } => flat.es = if es_any { 0xf } else { 0 },
        Body::Full { command, es, data } => {
            flat.command = command.code();
            flat.es = es.bits();
            match data {
                Data::Abs24High { abs } => flat.abs = abs.get().into(),
                Data::Status { pm_alm, .. } => flat.pm_alm = pm_alm.bits(),
                Data::Eeprom { data, address } => (flat.data, flat.address) = (data.into(), address),
                Data::EepromBank { data, bank, address, .. } => {
                    (flat.data, flat.bank, flat.address) = (data.into(), bank, address);
                }
                Data::Id { id } => flat.data = id.get(),
                Data::Coefficient { coefficient } => flat.data = coefficient.get(),
                Data::Abs24VelAcc { acceleration, .. } => flat.acceleration = acceleration,
                _ => {}
            }
        }
    }
    flat
}

pub(super) fn bit_order(order: u8) -> Result<BitOrder, Refused> {
    in_range(match order {
        0 => Some(BitOrder::LsbFirst),
        1 => Some(BitOrder::MsbFirst),
        _ => None,
    })
}

fn written(
    outcome: Result<Response, Error>,
    out: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> Result<sw_result_t, Refused> {
    let out = there(out)?;
    out.write(flat(&outcome.map_err(error)?));
    OK
}

/// What is made of the caller's words.
///
/// # Safety As for [`read`].
#[inline(always)]
pub(super) unsafe fn of_words(
    words: *const u16,
    count: usize,
    order: u8,
    act: impl FnOnce(&[u16], BitOrder) -> Result<sw_result_t, Refused>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        act(unsafe { read(words, count)? }, bit_order(order)?)
    })
}

/// The frames of a request as 16-bit words, the first bit of the line in bit 0 or in bit 15
/// (sw_bit_order_t), at most 4: the port adds start bit and delimiter.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_build(
    asked: Option<&sw_aformat_request_t>,
    order: u8,
    words: *mut u16,
    size: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let words = unsafe { room(words, size)? };
        let (frames, order, count) = (request(there(asked)?)?.emit(), bit_order(order)?, there(count)?);
        let sent = frames.as_slice();
        let room = words.get_mut(..sent.len()).ok_or(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t)?;
        for (to, frame) in room.iter_mut().zip(sent) {
            to.write(frame.word(order));
        }
        count.write(sent.len());
        OK
    })
}

/// The layout with which an encoder answers a request, sw_aformat_layout_t, and its number of frames.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_layout(
    asked: Option<&sw_aformat_request_t>,
    encoder: Option<&sw_aformat_encoder_t>,
    layout: Option<&mut MaybeUninit<u8>>,
    frames: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        let found = request(there(asked)?)?.layout(resolution(*there(encoder)?)?);
        let (layout, frames) = (there(layout)?, there(frames)?);
        layout.write(number(found));
        frames.write(found.frames());
        OK
    })
}

/// Reads the response to a request from 16-bit words, one frame each, with all checks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_parse(
    asked: Option<&sw_aformat_request_t>,
    encoder: Option<&sw_aformat_encoder_t>,
    words: *const u16,
    count: usize,
    order: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    let parse = |words: &_, order| {
        let expected = request(there(asked)?)?.expected(resolution(*there(encoder)?)?);
        written(Response::parse_words(&expected, words, order), response)
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { of_words(words, count, order, parse) }
}

/// A layout by its number, sw_aformat_layout_t.
pub(super) fn layout_of(number: u8) -> Result<Layout, Refused> {
    Ok(*in_range(Layout::ALL.get(usize::from(number)))?)
}

pub(super) fn expected(command: u8, layout: u8, ea: u8) -> Result<Expected, Refused> {
    let expected = Expected::new(layout_of(layout)?, in_range(Command::from_code(command))?);
    Ok(if ea == 255 { expected } else { expected.from_address(in_range(EncoderAddress::new(ea))?) })
}

/// Reads a response of this layout to this command, without its request; `ea` 255 is any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_parse_as(
    command: u8,
    layout: u8,
    ea: u8,
    words: *const u16,
    count: usize,
    order: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    let parse =
        |words: &_, order| written(Response::parse_words(&expected(command, layout, ea)?, words, order), response);
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { of_words(words, count, order, parse) }
}

/// Does the same from line bits, start bits and delimiters included: `bits` of them in `bytes`. Bits after
/// the 128th are ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_parse_line(
    command: u8,
    layout: u8,
    ea: u8,
    bytes: *const u8,
    bits: usize,
    order: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, bits.div_ceil(8))? };
        let line = Window::read(bytes, 0, u32::try_from(bits).unwrap_or(128).min(128), bit_order(order)?);
        written(Response::parse_line(&expected(command, layout, ea)?, in_range(line.ok())?), response)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The enumerators of C are in the order of the crate's table.
    #[test]
    fn layouts_have_the_numbers_of_the_header() {
        use super::super::names::sw_aformat_layout_t as Name;
        assert_eq!(number(Layout::Abs40), Name::SW_AFORMAT_ABS40 as u8);
        assert_eq!(number(Layout::Abs17), Name::SW_AFORMAT_ABS17 as u8);
        assert_eq!(number(Layout::Temperature), Name::SW_AFORMAT_TEMP as u8);
        assert_eq!(number(Layout::Abs40Vel), Name::SW_AFORMAT_ABS40_VEL as u8);
        let names = ["ABS40", "ABS24", "ABS24H", "ABS17", "STATUS", "EEPROM", "EEPROM_BANK", "TEMP", "ID", "VELCOEF"];
        assert!(Layout::ALL.iter().map(|layout| layout.name()).take(10).eq(names));
    }
}
