//! The decoders as `nom` streaming parsers, for frames that arrive as a stream of bytes.
//!
//! Missing bytes return `Incomplete` with the number of bytes needed; every other fault is an `Error`. With
//! [`tformat::Error`](crate::Error) as the error type, the reason is kept; any other type that implements
//! `FromExternalError` works too.

use nom::error::{FromExternalError, ParseError};
use nom::{IResult, Parser};
use servowire_core::stream::{missing, refused};

use crate::error::Error;
use crate::request::Request;
use crate::response::Response;

/// Takes one request from the start of the input, as an encoder receives it.
///
/// ```
/// use tformat::{Error, Request, stream};
/// // a request for ID 3, then the first byte of an EEPROM access
/// let (rest, first) = stream::request::<Error>(&[0x1a, 0x32]).unwrap();
/// assert_eq!((rest, first), (&[0x32][..], Request::ReadAll));
/// assert!(stream::request::<Error>(rest).unwrap_err().is_incomplete());
/// ```
///
/// # Errors
/// As [`Request::parse`], with `Incomplete` in place of [`Error::Truncated`].
pub fn request<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Request, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    finish(input, Request::parse(input), |request| request.data_id().request_fields())
}

/// Takes the response to `request` from the start of the input.
///
/// ```
/// use nom::Parser;
/// use tformat::{Error, Request, stream};
/// // two answers to ID 0, one after the other
/// let bytes = [0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37, 0x02, 0x20, 0x50, 0xa9, 0x78, 0xa3];
/// let mut two = (stream::response::<Error>(Request::ReadSingleTurn), stream::response(Request::ReadSingleTurn));
/// let (rest, (_, second)) = two.parse(&bytes[..]).unwrap();
/// assert!(rest.is_empty());
/// assert_eq!(second.abs().unwrap().get(), 7_907_664);
/// ```
///
/// # Errors
/// As [`Response::parse`], with `Incomplete` in place of [`Error::Truncated`].
pub fn response<'a, E>(request: Request) -> impl Parser<&'a [u8], Output = Response, Error = E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    move |input: &'a [u8]| {
        finish(input, Response::parse(request, input), |response| response.data_id().response_fields())
    }
}

/// Returns the rest of the input after a frame of `len` fields, or the fault as a `nom` error.
fn finish<'a, T, E>(input: &'a [u8], frame: Result<T, Error>, len: impl Fn(&T) -> u8) -> IResult<&'a [u8], T, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    match frame {
        Ok(value) => Ok((input.get(usize::from(len(&value))..).unwrap_or(&[]), value)),
        Err(Error::Truncated { got, want }) => Err(missing(want.saturating_sub(got).into())),
        Err(error) => Err(refused(input, error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::tests::exchanges;
    use nom::{Err, Needed};
    use proptest::prelude::*;

    proptest! {
        /// However the bytes are split, the response comes when its last byte is there, and not before.
        #[test]
        fn any_split((asked, answer) in exchanges(), cut in 0..12usize) {
            let frame = answer.emit();
            let bytes = frame.as_bytes();
            let cut = cut.min(bytes.len() - 1);
            match response::<Error>(asked).parse(&bytes[..cut]) {
                Err(Err::Incomplete(Needed::Size(more))) => prop_assert_eq!(more.get(), bytes.len() - cut),
                other => prop_assert!(false, "{:?}", other),
            }
            let sent = asked.emit();
            prop_assert_eq!(request::<Error>(sent.as_bytes()), Ok((&[][..], asked)));
        }

        #[test]
        fn the_reason_is_kept((asked, answer) in exchanges(), bit in 0..8u32) {
            let mut bytes = answer.emit().as_bytes().to_vec();
            *bytes.last_mut().unwrap() ^= 1 << bit;
            let got = response::<Error>(asked).parse(&bytes);
            prop_assert_eq!(got.map(|_| ()), Response::parse(asked, &bytes).map(|_| ()).map_err(Err::Error));
        }
    }
}
