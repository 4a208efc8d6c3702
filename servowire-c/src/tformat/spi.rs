//! T-Format over an SPI that samples the line.

use core::mem::MaybeUninit;

use tformat::spi::{parse_spi10, parse_spi16, spi10_words, spi16_words};

use super::codec::{answer, request, sw_tformat_request_t, sw_tformat_response_t};
use crate::border::{OK, Refused, border, fill, room, there};
use crate::result::sw_result_t;

/// Room for the words of a transaction: a request of four fields and a response of eleven are 150 bits.
const WORDS: usize = 16;

fn give(
    words: impl Iterator<Item = u16>,
    to: &mut [MaybeUninit<u16>],
    count: Option<&mut MaybeUninit<usize>>,
) -> Result<sw_result_t, Refused> {
    let count = there(count)?;
    let (mut all, mut written) = ([0; WORDS], 0_usize);
    for (to, word) in all.iter_mut().zip(words) {
        *to = word;
        written = written.saturating_add(1);
    }
    // All of them or none.
    fill(to, all.get(..written).unwrap_or_default())?;
    count.write(written);
    OK
}

/// The request in 10-bit SPI words, sent most significant bit first, one per field, at most 4. The idle
/// word 0x3ff follows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_build_spi10(
    asked: Option<&sw_tformat_request_t>,
    words: *mut u16,
    size: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let words = unsafe { room(words, size)? };
        give(spi10_words(&request(*there(asked)?)?.emit()), words, count)
    })
}

/// The response from 10-bit SPI words, without the idle words received during the request.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_spi10(
    asked: Option<&sw_tformat_request_t>,
    words: *const u16,
    count: usize,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { answer(asked, words, count, response, parse_spi10) }
}

/// The words that a 16-bit SPI sends in a whole transaction, idle while the response comes; at most 10
/// words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_build_spi16(
    asked: Option<&sw_tformat_request_t>,
    words: *mut u16,
    size: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let words = unsafe { room(words, size)? };
        give(spi16_words(request(*there(asked)?)?), words, count)
    })
}

/// The response from the 16-bit SPI words received over a whole transaction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_parse_spi16(
    asked: Option<&sw_tformat_request_t>,
    words: *const u16,
    count: usize,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { answer(asked, words, count, response, parse_spi16) }
}
