//! Keeps track of who has answered, for ports that deliver one response after another and keep the time
//! themselves.

use core::mem::MaybeUninit;

use nikon_aformat::bus::{Addresses, Bus, Verdict};
use nikon_aformat::{Abs40, Command, Expected, Layout, U40};

use super::codec::{
    error, expected, flat, of_words, request, resolution, sw_aformat_encoder_t, sw_aformat_request_t,
    sw_aformat_response_t,
};
use super::names::sw_aformat_error_t;
use crate::border::{OK, Refused, border, in_range, state, there};
use crate::result::sw_result_t;

/// The responses to one request, without times. For control use sw_aformat_t, which knows how old a response is. Its content is
/// private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_aformat_bus_t {
    pub(crate) _private: [MaybeUninit<u64>; 36],
}
state!(sw_aformat_bus_t, Bus, 0x23);

/// The response with the whole position.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_abs40_t {
    /// Position bits as received, 40: the single turn in the low ones.
    pub abs: u64,
    /// EA: the address of the encoder that answers.
    pub ea: u8,
    /// ES: sw_aformat_es_t.
    pub es: u8,
}

/// Reads the response of layout ABS40 to command 0 or 4 from its four frames, one 16-bit word each, with
/// all checks; `ea` 255 is any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_parse_abs40(
    command: u8,
    ea: u8,
    words: *const u16,
    count: usize,
    order: u8,
    data: Option<&mut MaybeUninit<sw_aformat_abs40_t>>,
) -> sw_result_t {
    let parse = |words: &_, order| {
        let data = there(data)?;
        in_range(matches!(command, 0 | 4).then_some(()))?;
        let Abs40 { ea, es, abs } = Abs40::parse_words(&expected(command, 0, ea)?, words, order).map_err(error)?;
        data.write(sw_aformat_abs40_t { abs: abs.get(), ea: ea.get(), es: es.bits() });
        OK
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { of_words(words, count, order, parse) }
}

/// Begins, with the request sent, the widths of the encoders, and the addresses asked: a bit each in
/// `asked` (bit 0 is EA 0).
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_start(
    bus: Option<&mut MaybeUninit<sw_aformat_bus_t>>,
    asked: Option<&sw_aformat_request_t>,
    encoder: Option<&sw_aformat_encoder_t>,
    addresses: u8,
) -> sw_result_t {
    border(|| {
        let expected = request(there(asked)?)?.expected(resolution(*there(encoder)?)?).any_address();
        let addresses = Addresses::from_bits(addresses);
        in_range((!addresses.is_empty()).then_some(()))?;
        sw_aformat_bus_t::start(bus, Bus::new(expected, addresses))?;
        OK
    })
}

/// Does the same for the whole position of all encoders asked: command 4 to the highest address, for
/// sw_aformat_bus_push_abs40().
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_start_abs40(
    bus: Option<&mut MaybeUninit<sw_aformat_bus_t>>,
    addresses: u8,
) -> sw_result_t {
    border(|| {
        in_range((addresses != 0).then_some(()))?;
        let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
        sw_aformat_bus_t::start(bus, Bus::new(expected, Addresses::from_bits(addresses)))?;
        OK
    })
}

/// Takes one response of four frames, one 16-bit word each. The results are those of sw_aformat_bus_push(),
/// for less flash: it knows only positions. SW_E_ARGUMENT for a bus that was started for another
/// layout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_bus_push_abs40(
    bus: Option<&mut sw_aformat_bus_t>,
    words: *const u16,
    count: usize,
    order: u8,
    data: Option<&mut MaybeUninit<sw_aformat_abs40_t>>,
) -> sw_result_t {
    let push = |words: &_, order| {
        let (bus, data) = (sw_aformat_bus_t::get(bus)?, there(data)?);
        in_range((bus.expected().layout() == Layout::Abs40).then_some(()))?;
        let verdict = bus.push_abs40(words, order);
        let response = verdict.outcome.map_err(error)?;
        let (abs, es) = (response.abs40().map_or(0, U40::get), response.es().map_or(0, |es| es.bits()));
        data.write(sw_aformat_abs40_t { abs, ea: response.ea.get(), es });
        judged(verdict)
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { of_words(words, count, order, push) }
}

pub(super) fn judged(verdict: Verdict) -> Result<sw_result_t, Refused> {
    match verdict {
        Verdict { duplicate: true, .. } => Err(sw_aformat_error_t::SW_E_AFORMAT_TWO_RESPONSES as sw_result_t),
        Verdict { extra: true, .. } => Err(sw_aformat_error_t::SW_E_AFORMAT_ADDRESS_MISMATCH as sw_result_t),
        _ => OK,
    }
}

/// Takes one response, a 16-bit word for each frame. SW_OK with the response, or why it is refused. A second
/// good one from the same address is SW_E_AFORMAT_TWO_RESPONSES: two encoders have it; one from an address that was not asked is
/// SW_E_AFORMAT_ADDRESS_MISMATCH. Both are filled in for inspection.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_bus_push(
    bus: Option<&mut sw_aformat_bus_t>,
    words: *const u16,
    count: usize,
    order: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    let push = |words: &_, order| {
        let (bus, response) = (sw_aformat_bus_t::get(bus)?, there(response)?);
        let verdict = bus.push_words(words, order);
        response.write(flat(&verdict.outcome.map_err(error)?));
        judged(verdict)
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { of_words(words, count, order, push) }
}

/// The encoders that were asked and have not given a good response, one bit each; 0xff for a state that was
/// not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_missing(bus: Option<&sw_aformat_bus_t>) -> u8 {
    sw_aformat_bus_t::look(bus).map_or(0xff, |bus| bus.missing().bits())
}
