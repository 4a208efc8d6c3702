//! Results, as numbers that never change, and their texts.

use core::ffi::{CStr, c_char};

use crate::rtex::names::sw_rtex_error_t;

/// The result of a call: 0 and above is good, below 0 is refused. The names are in `sw_code_t` and in the
/// `sw_..._error_t` of the protocols; `sw_text()` has a text for each.
///
/// A refusal of a protocol is `-(256 * protocol + number)`. The numbers never change.
pub type sw_result_t = i32;

/// Results that all protocols share.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_code_t {
    /// Done.
    SW_OK = 0,
    /// Not finished: wait, hear, poll.
    SW_PENDING = 1,
    /// Something has to be sent: see the transmission.
    SW_SEND = 2,
    /// A pointer is NULL.
    SW_E_NULL = -1,
    /// An argument is out of its range.
    SW_E_ARGUMENT = -2,
    /// The state was not started, or it is of another kind.
    SW_E_STATE = -3,
    /// The buffer of the caller is too short; nothing was written.
    SW_E_SHORT_BUFFER = -4,
    /// The clock went back or was not read in time, or `SW_NO_TIME` was passed on.
    SW_E_CLOCK = -5,
    /// There is no such value now: nothing was exchanged yet, or the exchange was of another kind.
    SW_E_NO_VALUE = -6,
    /// An exchange is pending, or the line is not free yet at this time: nothing was begun.
    SW_E_NOT_FREE = -7,
}

/// Which protocol refuses: the high byte of a result.
#[repr(u8)]
#[derive(Clone, Copy)]
pub(crate) enum Protocol {
    Tformat = 1,
    Aformat = 2,
    Hdsl = 3,
    Rtex = 4,
    Sorte = 5,
    Motion = 6,
    Step = 7,
}

/// The result for a class of a protocol.
#[inline(always)]
pub(crate) const fn refused(protocol: Protocol, number: u8) -> sw_result_t {
    ((protocol as i32) << 8 | number as i32).wrapping_neg()
}

const COMMON: [(sw_result_t, &CStr); 17] = [
    (sw_code_t::SW_OK as sw_result_t, c"ok"),
    (sw_code_t::SW_PENDING as sw_result_t, c"pending"),
    (sw_code_t::SW_SEND as sw_result_t, c"send"),
    (sw_code_t::SW_E_NULL as sw_result_t, c"null_pointer"),
    (sw_code_t::SW_E_ARGUMENT as sw_result_t, c"argument"),
    (sw_code_t::SW_E_STATE as sw_result_t, c"not_started"),
    (sw_code_t::SW_E_SHORT_BUFFER as sw_result_t, c"short_buffer"),
    (sw_code_t::SW_E_CLOCK as sw_result_t, c"clock"),
    (sw_code_t::SW_E_NO_VALUE as sw_result_t, c"no_value"),
    (sw_code_t::SW_E_NOT_FREE as sw_result_t, c"not_free"),
    (sw_rtex_error_t::SW_E_RTEX_NOT_NOW as sw_result_t, c"not_now"),
    (sw_rtex_error_t::SW_E_RTEX_TOO_FAR as sw_result_t, c"too_far"),
    (sw_rtex_error_t::SW_E_RTEX_EXECUTION as sw_result_t, c"execution"),
    (sw_rtex_error_t::SW_E_RTEX_COMMAND_ERROR as sw_result_t, c"command_error"),
    (sw_rtex_error_t::SW_E_RTEX_TIMED_OUT as sw_result_t, c"timed_out"),
    (sw_rtex_error_t::SW_E_RTEX_NOT_STARTED as sw_result_t, c"motion_not_started"),
    (sw_rtex_error_t::SW_E_RTEX_BROKEN_OFF as sw_result_t, c"broken_off"),
];

/// The names of a crate's classes, each with a NUL after it, in the order of their numbers from 1; a number that is not given
/// is an empty one. Made when the library is compiled.
macro_rules! names {
    ($class:ty) => {{
        const fn end_of(number: u8) -> Option<&'static [u8]> {
            match <$class>::from_number(number) {
                Some(class) => Some(class.name().as_bytes()),
                None => None,
            }
        }
        const LEN: usize = {
            let (mut len, mut number) = (0, 1_u8);
            while number < 64 {
                len += match end_of(number) {
                    Some(name) => name.len() + 1,
                    None => 1,
                };
                number += 1;
            }
            len
        };
        #[expect(clippy::indexing_slicing, reason = "evaluated when it is compiled")]
        const NAMES: [u8; LEN] = {
            let (mut names, mut to, mut number) = ([0; LEN], 0, 1_u8);
            while number < 64 {
                if let Some(name) = end_of(number) {
                    let mut from = 0;
                    while from < name.len() {
                        names[to] = name[from];
                        to += 1;
                        from += 1;
                    }
                }
                to += 1;
                number += 1;
            }
            names
        };
        static PLACED: [u8; LEN] = NAMES;
        &PLACED
    }};
}

/// The class of this number in a list of names.
fn nth(names: &'static [u8], number: u8) -> Option<&'static CStr> {
    let mut rest = names;
    for _ in 1..number {
        let end = rest.iter().position(|byte| *byte == 0)?;
        rest = rest.get(end.checked_add(1)?..)?;
    }
    CStr::from_bytes_until_nul(rest).ok().filter(|name| !name.is_empty())
}

fn text(code: sw_result_t) -> Option<&'static CStr> {
    if let Some((_, text)) = COMMON.iter().find(|(common, _)| *common == code) {
        return Some(text);
    }
    let [number, protocol, 0, 0] = code.checked_neg()?.to_le_bytes() else { return None };
    let names: &'static [u8] = match protocol {
        1 => names!(tformat::ErrorClass),
        2 => names!(nikon_aformat::ErrorClass),
        3 => names!(hdsl::ErrorClass),
        4 => names!(rtex_block::ErrorClass),
        5 => names!(sorte_proto::ErrorClass),
        6 => names!(step_motion::ErrorClass),
        7 => names!(step_profile::ErrorClass),
        _ => return None,
    };
    if number == 0 { None } else { nth(names, number) }
}

/// Returns the name of a result in `snake_case`, as the logs and test vectors of servowire spell it; "unknown" for a number that is
/// not a result. It is never NULL and stays valid.
#[unsafe(no_mangle)]
pub extern "C" fn sw_text(result: sw_result_t) -> *const c_char {
    text(result).unwrap_or(c"unknown").as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_class_has_its_text_and_nothing_else_has() {
        for class in tformat::ErrorClass::ALL {
            let code = refused(Protocol::Tformat, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        for class in rtex_block::ErrorClass::ALL {
            let code = refused(Protocol::Rtex, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        for class in step_motion::ErrorClass::ALL {
            let code = refused(Protocol::Motion, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        for class in sorte_proto::ErrorClass::ALL {
            let code = refused(Protocol::Sorte, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        for class in step_profile::ErrorClass::ALL {
            let code = refused(Protocol::Step, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        for class in hdsl::ErrorClass::ALL {
            let code = refused(Protocol::Hdsl, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        for class in nikon_aformat::ErrorClass::ALL {
            let code = refused(Protocol::Aformat, class.number());
            assert_eq!(text(code).and_then(|text| text.to_str().ok()), Some(class.name()));
        }
        assert_eq!(text(-0x101).map(CStr::to_bytes), Some(b"start_bit".as_slice()));
        assert_eq!(text(-0x10d).map(CStr::to_bytes), Some(b"no_response".as_slice()));
        assert_eq!(text(-3).map(CStr::to_bytes), Some(b"not_started".as_slice()));
        for none in [3, -8, -0x100, -0x1ff, -0x140, -0x1_0101, i32::MIN, i32::MAX] {
            assert_eq!(text(none), None, "{none:#x}");
        }
    }
}
