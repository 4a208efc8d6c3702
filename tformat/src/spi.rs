//! T-Format over an SPI peripheral, as in TI's C2000 designs: a clock generator aligns the SPI to the line.
//!
//! Two word lengths are in use. Both hold line bits most significant bit first, so a byte appears bit-reversed.

use nrz_line::{BitOrder, Window};

use crate::error::Error;
use crate::frame::Frame;
use crate::request::Request;
use crate::response::Response;

/// The word that keeps the transmitter idle while a response is received: ten idle bits.
pub const SPI10_IDLE: u16 = 0x3ff;

/// The largest number of 16-bit words that a transaction needs: a refused EEPROM write, with 48 bits and an 11-field response.
pub const SPI16_MAX_WORDS: usize = 10;

/// Returns the fields of a frame as 10-bit SPI words.
///
/// ```text
///  bit   9                       8       7  ...  0
///        delimiter of the field  start   data bits, first on the line
///        before, or idle: 1      0       in bit 7
/// ```
///
/// The delimiter of the last field is the first bit of the [`SPI10_IDLE`] word that follows; a transmission takes
/// 1 + 10 * fields clocks.
pub fn spi10_words(frame: &Frame) -> impl Iterator<Item = u16> {
    frame.as_bytes().iter().map(|byte| 0x200 | u16::from(byte.reverse_bits()))
}

/// Decodes the response to `request` from 10-bit SPI words, without the idle words received during the request.
///
/// # Errors
/// [`Error::StartBit`] and [`Error::Delimiter`] by bits 8 and 9 of the words (the delimiter of the last field is not
/// in them), then as [`Response::parse`].
pub fn parse_spi10(request: Request, words: &[u16]) -> Result<Response, Error> {
    let mut bytes = [0; Frame::MAX_FIELDS];
    let mut fields = 0_usize;
    for (field, (byte, word)) in (0_u8..).zip(bytes.iter_mut().zip(words)) {
        if field > 0 && word & 0x200 == 0 {
            return Err(Error::Delimiter { field: field.wrapping_sub(1) });
        }
        if word & 0x100 != 0 {
            // After the expected fields there is only idle line.
            if field >= request.data_id().response_fields() {
                break;
            }
            return Err(Error::StartBit { field });
        }
        let [low, _] = word.to_le_bytes();
        *byte = low.reverse_bits();
        fields = fields.wrapping_add(1);
    }
    Response::parse(request, bytes.get(..fields).unwrap_or(&bytes))
}

/// Returns the transmitted bit stream of a whole transaction in 16-bit words.
///
/// ```text
///  1 idle bit | request, 10 bits a field | 7 idle bits | idle while the response comes ...
/// ```
///
/// It has as many words as the request and its response need, filled with idle bits.
pub fn spi16_words(request: Request) -> impl Iterator<Item = u16> {
    let line = request.emit().line();
    let idle = u128::MAX << line.len();
    let stream = (line.bits() | idle) << 1 | 1;
    let words = response_start(request).saturating_add(response_bits(request)).div_ceil(16);
    let bytes = stream.reverse_bits().to_be_bytes();
    (0..SPI16_MAX_WORDS)
        .map(move |k| {
            let at = k.saturating_mul(2);
            match bytes.get(at..).and_then(<[u8]>::first_chunk) {
                Some(word) => u16::from_be_bytes(*word),
                None => u16::MAX,
            }
        })
        .take(words as usize)
}

/// Decodes the response to `request` from the 16-bit words received over a whole transaction.
///
/// The response begins at stream bit 18 (one-field request), 38 (ID D) or 48 (ID 6); bits after it are ignored.
///
/// # Errors
/// As [`Response::parse_line`].
pub fn parse_spi16(request: Request, words: &[u16]) -> Result<Response, Error> {
    // Eight words hold the longest response to a one-field request, to the bit: 18 + 110 = 128.
    let line = match (request, words.first_chunk()) {
        (Request::WriteEeprom { .. } | Request::ReadEeprom { .. }, _) | (_, None) => spi16_line(request, words),
        (_, Some(words)) => Window::from_bits(stream(words) >> 18, MAX_RESPONSE_BITS).unwrap_or(Window::EMPTY),
    };
    Response::parse_line(request, line)
}

/// Returns the first 128 bits of the stream, the first on the line in bit 0.
#[inline(always)]
fn stream([a, b, c, d, e, f, g, h]: &[u16; 8]) -> u128 {
    let pair = |first: u16, second: u16| u128::from((u32::from(first) << 16 | u32::from(second)).reverse_bits());
    pair(*a, *b) | pair(*c, *d) << 32 | pair(*e, *f) << 64 | pair(*g, *h) << 96
}

/// Returns the line from the first bit of the response onwards, from any number of words.
#[inline(never)]
fn spi16_line(request: Request, words: &[u16]) -> Window {
    let mut bytes = [0; 2 * SPI16_MAX_WORDS];
    for (pair, word) in bytes.chunks_exact_mut(2).zip(words) {
        pair.copy_from_slice(&word.to_be_bytes());
    }
    let start = response_start(request);
    let there = u32::try_from(words.len().min(SPI16_MAX_WORDS)).unwrap_or(0).saturating_mul(16);
    let len = there.saturating_sub(start).min(MAX_RESPONSE_BITS);
    Window::read(&bytes, start as usize, len, BitOrder::MsbFirst).unwrap_or(Window::EMPTY)
}

const MAX_RESPONSE_BITS: u32 = 110;

/// Returns the bit of the 16-bit stream at which the response begins.
const fn response_start(request: Request) -> u32 {
    (request.data_id().request_fields() as u32).saturating_mul(10).saturating_add(8)
}

const fn response_bits(request: Request) -> u32 {
    (request.data_id().response_fields() as u32).saturating_mul(10)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::tests::requests;
    use crate::response::tests::exchanges;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// First words of the vendor's 16-bit transmit stream: 0x903f | (ID bits and parity) << 6.
    #[test]
    fn first_word_of_a_readout() {
        for (request, code) in [
            (Request::ReadSingleTurn, 0x00),
            (Request::ReadMultiTurn, 0x11),
            (Request::ReadEncoderId, 0x09),
            (Request::ReadAll, 0x18),
        ] {
            assert_eq!(spi16_words(request).next(), Some(0x903f | code << 6));
        }
        assert_eq!(spi16_words(Request::ReadAll).count(), 8);
    }

    /// A response begins at stream bit 18, 38 (ID D) or 48 (ID 6); a refused EEPROM write is 48 and 110 bits long.
    #[test]
    fn a_refusal_fits_the_longest_stream() {
        let adf = crate::Adf::from_bits(5);
        let refused =
            crate::AllData::parse(&[0x1a, 0x40, 0xeb, 0x3b, 0x1c, 0x17, 0x04, 0x27, 0x00, 0x00, 0xa2]).unwrap();
        let requests = [Request::ReadSingleTurn, Request::ReadEeprom { adf }, Request::WriteEeprom { adf, edf: 1 }];
        for (request, start) in requests.into_iter().zip([18, 38, 48]) {
            let mut bytes = [0xff; 2 * SPI16_MAX_WORDS];
            Response::ReadAll(refused).emit().line().write(&mut bytes, start, BitOrder::MsbFirst).unwrap();
            let words: Vec<u16> = bytes.chunks(2).map(|w| u16::from_be_bytes([w[0], w[1]])).collect();
            assert_eq!(parse_spi16(request, &words), Err(Error::Rejected { sf: refused.sf }));
            let needed = (start + 110).div_ceil(16);
            assert_eq!(parse_spi16(request, &words[..needed]), Err(Error::Rejected { sf: refused.sf }));
            let short = parse_spi16(request, &words[..needed - 1]);
            assert!(matches!(short, Err(Error::Truncated { want: 11, .. })), "{short:?}");
        }
        assert_eq!(SPI16_MAX_WORDS, 10);
    }

    /// After a response of ID D that is shorter than the words there is idle line, which is left alone.
    #[test]
    fn idle_words_after_a_short_response() {
        let adf = crate::Adf::from_bits(1);
        let mut words: Vec<u16> = spi10_words(&Frame::new(&[0xea, 1, 0x5a, 0xb1]).unwrap()).collect();
        words.extend([SPI10_IDLE; 4]);
        let memory = crate::Memory { adf, edf: 0x5a };
        assert_eq!(parse_spi10(Request::ReadEeprom { adf }, &words), Ok(Response::ReadEeprom(memory)));
        // A line that idles before the response is whole is a start bit that reads 1.
        words[3] = SPI10_IDLE;
        assert_eq!(parse_spi10(Request::ReadEeprom { adf }, &words), Err(Error::StartBit { field: 3 }));
    }

    proptest! {
        #[test]
        fn ten_bit_words((request, response) in exchanges()) {
            let words: Vec<u16> = spi10_words(&response.emit()).collect();
            prop_assert_eq!(parse_spi10(request, &words), Ok(response));
            for field in 0..words.len() {
                let mut bad = words.clone();
                bad[field] |= 0x100;
                prop_assert_eq!(parse_spi10(request, &bad), Err(Error::StartBit { field: field as u8 }));
                if field == 0 {
                    // What is before the first field is no delimiter.
                    bad[field] = words[field] & !0x200;
                    prop_assert_eq!(parse_spi10(request, &bad), Ok(response));
                } else {
                    bad[field] = words[field] & !0x200;
                    prop_assert_eq!(parse_spi10(request, &bad), Err(Error::Delimiter { field: field as u8 - 1 }));
                }
            }
        }

        #[test]
        fn sixteen_bit_stream((request, response) in exchanges()) {
            let line = response.emit().line();
            let mut bytes = [0xff; 2 * SPI16_MAX_WORDS];
            line.write(&mut bytes, response_start(request) as usize, BitOrder::MsbFirst).unwrap();
            let words: Vec<u16> = bytes.chunks(2).map(|w| u16::from_be_bytes([w[0], w[1]])).collect();
            prop_assert_eq!(parse_spi16(request, &words), Ok(response));
            let needed = spi16_words(request).count();
            prop_assert_eq!(parse_spi16(request, &words[..needed]), Ok(response));
            let truncated = matches!(parse_spi16(request, &words[..needed - 1]), Err(Error::Truncated { .. }));
            prop_assert!(truncated);
        }

        #[test]
        fn the_stream_carries_the_request(request in requests()) {
            let words: Vec<u8> = spi16_words(request).flat_map(u16::to_be_bytes).collect();
            let line = request.emit().line();
            prop_assert_eq!(Window::read(&words, 1, line.len(), BitOrder::MsbFirst), Ok(line));
            prop_assert_eq!(words[0] >> 7, 1);
        }
    }
}
