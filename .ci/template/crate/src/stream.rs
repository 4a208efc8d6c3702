//! `nom` streaming parsers for logs in which frames follow each other.

use nom::IResult;
use nom::error::{FromExternalError, ParseError};
use servowire_core::stream::unit;

use crate::error::Error;
use crate::frame::{Frame, LEN};

/// A frame.
pub fn frame<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Frame, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    unit(input, LEN, Frame::parse)
}
