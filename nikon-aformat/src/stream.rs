//! The decoders as `nom` streaming parsers.
//!
//! [`response`] and [`request`] read words of two bytes, as a shift register with hardware framing delivers them.
//! [`line_response`] reads a packed line bit by bit, from any offset, in the `(bytes, bit offset)` form of `nom`.
//! Missing input returns `Incomplete`; every other fault is an `Error`. With [`nikon_aformat::Error`](crate::Error) as the error
//! type, the reason is kept.

use core::num::NonZeroUsize;

use nom::error::{ErrorKind, FromExternalError, ParseError};
use nom::{Err, Needed, Parser};
use nrz_line::{BitOrder, Window};

use crate::error::Error;
use crate::expected::Expected;
use crate::frame::RequestFrame;
use crate::layout::FRAME_BITS;
use crate::raw_response::RawResponse;
use crate::request::{Frames, Request};
use crate::response::Response;

/// Takes one request from the start of the input, as an encoder receives it: two bytes per frame.
///
/// # Errors
/// As [`RequestFrame::from_word`] and [`Request::parse`], with `Incomplete` for missing bytes.
pub fn request<'a, E>(order: BitOrder) -> impl Parser<&'a [u8], Output = Request, Error = E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    move |input: &'a [u8]| {
        let first = RequestFrame::from_word(word(input, order)?, order)
            .and_then(|cdf| Ok((cdf, Request::expected_frames(cdf)?)));
        let (cdf, count) = first.map_err(|error| refuse(input, error))?;
        let mut frames = [cdf; Frames::MAX];
        let mut rest = input;
        for frame in frames.iter_mut().take(usize::from(count)) {
            *frame = RequestFrame::from_word(word(rest, order)?, order).map_err(|error| refuse(input, error))?;
            rest = rest.get(2..).unwrap_or(&[]);
        }
        let frames = frames.get(..usize::from(count)).unwrap_or(&frames);
        Request::parse(frames).map(|request| (rest, request)).map_err(|error| refuse(input, error))
    }
}

/// Takes an expected response from the start of the input: two bytes per frame, 16 content bits in the given order.
///
/// ```
/// use nikon_aformat::{BitOrder, Command, Error, Expected, Layout, stream};
/// use nom::Parser;
/// let expected = Expected::new(Layout::Abs24, Command::Abs24Low);
/// let bytes = [0x3e, 0x03, 0x00, 0xef, 0xdf, 0x35, 0x99];
/// let (rest, response) = stream::response::<Error>(expected, BitOrder::MsbFirst).parse(&bytes[..]).unwrap();
/// assert_eq!((rest, response.abs()), (&[0x99][..], Some(0xfb_f700)));
/// ```
///
/// # Errors
/// As [`Response::parse`], with `Incomplete` for missing bytes.
pub fn response<'a, E>(expected: Expected, order: BitOrder) -> impl Parser<&'a [u8], Output = Response, Error = E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    move |input: &'a [u8]| {
        let want = usize::from(expected.layout().frames()).saturating_mul(2);
        if let Some(more) = NonZeroUsize::new(want.saturating_sub(input.len())) {
            return Err(Err::Incomplete(Needed::Size(more)));
        }
        let mut words = [0; RawResponse::MAX_FRAMES];
        let mut rest = input;
        for to in words.iter_mut().take(want / 2) {
            *to = word(rest, order)?;
            rest = rest.get(2..).unwrap_or(&[]);
        }
        let parsed = Response::parse_words(&expected, &words, order);
        parsed.map(|response| (rest, response)).map_err(|error| refuse(input, error))
    }
}

/// A packed line and the bit at which to begin.
pub type Bits<'a> = (&'a [u8], usize);

/// Skips idle bits and takes an expected response from the start of a packed line; `Incomplete` counts bits.
///
/// ```
/// use nikon_aformat::{BitOrder, Command, Error, Expected, Layout, RawResponse, stream};
/// use nom::Parser;
/// // five idle bits, then the response to command 1 that a vendor's manual shows
/// let raw = RawResponse::from_words(Layout::Abs24, &[0x3e03, 0x00ef, 0xdf35], BitOrder::MsbFirst)?;
/// let mut bytes = [0xff; 8];
/// raw.line().write(&mut bytes, 5, BitOrder::LsbFirst)?;
/// let expected = Expected::new(Layout::Abs24, Command::Abs24Low);
/// let (rest, response) = stream::line_response::<Error>(expected, BitOrder::LsbFirst).parse((&bytes, 0)).unwrap();
/// assert_eq!((rest, response.abs()), ((&bytes[7..], 3), Some(0xfb_f700)));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
///
/// # Errors
/// As [`Response::parse_line`], with `Incomplete` for a line that ends within or before the response.
pub fn line_response<'a, E>(expected: Expected, order: BitOrder) -> impl Parser<Bits<'a>, Output = Response, Error = E>
where
    E: ParseError<Bits<'a>> + FromExternalError<Bits<'a>, Error>,
{
    move |(bytes, offset): Bits<'a>| {
        let start = start_bit(bytes, offset, order).ok_or(Err::Incomplete(Needed::Unknown))?;
        let bits = expected.layout().line_bits();
        let line = match Window::read(bytes, start, bits, order) {
            Ok(line) => line,
            Err(short) => {
                let more = NonZeroUsize::new((bits as usize).saturating_sub(short.available));
                return Err(Err::Incomplete(more.map_or(Needed::Unknown, Needed::Size)));
            }
        };
        let end = start.saturating_add(bits as usize);
        let rest = (bytes.get(end / 8..).unwrap_or(&[]), end % 8);
        match Response::parse_line(&expected, line) {
            Ok(response) => Ok((rest, response)),
            Err(error) => Err(Err::Error(E::from_external_error((bytes, offset), ErrorKind::MapRes, error))),
        }
    }
}

/// Returns the first bit at or after `offset` that is 0.
fn start_bit(bytes: &[u8], offset: usize, order: BitOrder) -> Option<usize> {
    let mut at = offset;
    loop {
        let left = bytes.len().saturating_mul(8).saturating_sub(at);
        let len = u32::try_from(left).unwrap_or(u32::MAX).min(FRAME_BITS);
        let window = Window::read(bytes, at, len, order).ok().filter(|window| !window.is_empty())?;
        let ones = window.bits().trailing_ones();
        if ones < len {
            return Some(at.saturating_add(ones as usize));
        }
        at = at.saturating_add(len as usize);
    }
}

fn word<E>(input: &[u8], order: BitOrder) -> Result<u16, Err<E>> {
    match (input.first_chunk(), order) {
        (Some(bytes), BitOrder::MsbFirst) => Ok(u16::from_be_bytes(*bytes)),
        (Some(bytes), BitOrder::LsbFirst) => Ok(u16::from_le_bytes(*bytes)),
        (None, _) => {
            let more = NonZeroUsize::new(2_usize.saturating_sub(input.len()));
            Err(Err::Incomplete(more.map_or(Needed::Unknown, Needed::Size)))
        }
    }
}

fn refuse<'a, E: FromExternalError<&'a [u8], Error>>(input: &'a [u8], error: Error) -> Err<E> {
    Err::Error(E::from_external_error(input, ErrorKind::MapRes, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::tests::exchanges;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn bytes_of(words: impl Iterator<Item = u16>, order: BitOrder) -> Vec<u8> {
        words
            .flat_map(|word| match order {
                BitOrder::MsbFirst => word.to_be_bytes(),
                BitOrder::LsbFirst => word.to_le_bytes(),
            })
            .collect()
    }

    proptest! {
        /// However the bytes are split, the response comes when its last byte is there, and not before.
        #[test]
        fn any_split((asked, expected, answer) in exchanges(), cut in 0..12_usize, lsb: bool) {
            let order = if lsb { BitOrder::LsbFirst } else { BitOrder::MsbFirst };
            let bytes = bytes_of(answer.emit().words(order), order);
            let cut = cut.min(bytes.len() - 1);
            match response::<Error>(expected, order).parse(&bytes[..cut]) {
                Err(Err::Incomplete(Needed::Size(more))) => prop_assert_eq!(more.get(), bytes.len() - cut),
                other => prop_assert!(false, "{:?}", other),
            }
            prop_assert_eq!(response::<Error>(expected, order).parse(&bytes[..]), Ok((&[][..], answer)));
            let sent = asked.emit();
            let bytes = bytes_of(sent.as_slice().iter().map(|frame| frame.word(order)), order);
            prop_assert_eq!(request::<Error>(order).parse(&bytes[..]), Ok((&[][..], asked)));
            for cut in 0..bytes.len() {
                let incomplete = matches!(request::<Error>(order).parse(&bytes[..cut]), Err(Err::Incomplete(_)));
                prop_assert!(incomplete);
            }
        }

        /// Two responses on one packed line, after any number of idle bits.
        #[test]
        fn a_packed_line((_, expected, answer) in exchanges(), idle in 0..70_usize, gap in 0..30_usize, lsb: bool) {
            let order = if lsb { BitOrder::LsbFirst } else { BitOrder::MsbFirst };
            let line = answer.emit().line();
            let second = idle + line.len() as usize + gap;
            let mut bytes = std::vec![0xff; (second + line.len() as usize).div_ceil(8)];
            line.write(&mut bytes, idle, order).unwrap();
            line.write(&mut bytes, second, order).unwrap();
            let (rest, first) = line_response::<E>(expected, order).parse((&bytes[..], 0)).unwrap();
            let (rest, again) = line_response::<E>(expected, order).parse(rest).unwrap();
            prop_assert_eq!((first, again), (answer, answer));
            let ended = matches!(line_response::<E>(expected, order).parse(rest), Err(Err::Incomplete(Needed::Unknown)));
            prop_assert!(ended);
            let cut = (second + line.len() as usize) / 8 - 1;
            let (rest, _) = line_response::<E>(expected, order).parse((&bytes[..], 0)).unwrap();
            let rest = (&rest.0[..rest.0.len().saturating_sub(bytes.len() - cut)], rest.1);
            let short = matches!(line_response::<E>(expected, order).parse(rest), Err(Err::Incomplete(_)));
            prop_assert!(short);
        }
    }

    type E = Error;
}
