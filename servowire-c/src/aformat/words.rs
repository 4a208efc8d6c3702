//! Who has answered, for ports that deliver one response after the other and keep the time themselves.

use core::mem::MaybeUninit;

use nikon_aformat::bus::{Addresses, Bus, Verdict};

use super::codec::{
    bit_order, error, flat, request, resolution, sw_aformat_encoder_t, sw_aformat_request_t, sw_aformat_response_t,
};
use super::names::sw_aformat_error_t;
use crate::border::{OK, border, in_range, read, state, there};
use crate::result::sw_result_t;

/// The responses to one request, without times. For control use sw_aformat_t, which knows how old a response is. Its content is
/// private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_aformat_bus_t {
    pub(crate) _private: [MaybeUninit<u64>; 36],
}
state!(sw_aformat_bus_t, Bus, b"SWab");

/// Begins: what was sent, what the encoders are, and whose bit in `asked` (bit 0 is EA 0) is set.
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

/// One response came, a 16-bit word each frame. SW_OK with the response, or why it is none. A second
/// good one from the same address is SW_E_AFORMAT_TWO_RESPONSES: two encoders have it; one from an address that was not asked is
/// SW_E_AFORMAT_ADDRESS_MISMATCH. Both are filled in for a look.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_bus_push(
    bus: Option<&mut sw_aformat_bus_t>,
    words: *const u16,
    count: usize,
    order: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let words = unsafe { read(words, count)? };
        let (bus, response) = (sw_aformat_bus_t::get(bus)?, there(response)?);
        let verdict = bus.push_words(words, bit_order(order)?);
        response.write(flat(&verdict.outcome.map_err(error)?));
        match verdict {
            Verdict { duplicate: true, .. } => Err(sw_aformat_error_t::SW_E_AFORMAT_TWO_RESPONSES as sw_result_t),
            Verdict { extra: true, .. } => Err(sw_aformat_error_t::SW_E_AFORMAT_ADDRESS_MISMATCH as sw_result_t),
            _ => OK,
        }
    })
}

/// Who was asked and has not given a good response, a bit each; 0xff for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_bus_missing(bus: Option<&sw_aformat_bus_t>) -> u8 {
    sw_aformat_bus_t::look(bus).map_or(0xff, |bus| bus.missing().bits())
}
