//! Functions used by the `nom` parsers of all crates.

use core::num::NonZeroUsize;

use nom::error::{ErrorKind, FromExternalError, ParseError};
use nom::{Err, IResult, Needed};

/// Converts a decoder's refusal to an error of `nom`.
pub fn refused<I, E, F>(input: I, error: F) -> Err<E>
where
    E: FromExternalError<I, F>,
{
    Err::Error(E::from_external_error(input, ErrorKind::Verify, error))
}

/// Returns `Incomplete` with the number of missing bytes (or bits); 0 means that the number is unknown.
pub const fn missing<E>(count: usize) -> Err<E> {
    Err::Incomplete(match NonZeroUsize::new(count) {
        Some(count) => Needed::Size(count),
        None => Needed::Unknown,
    })
}

/// Takes a unit of `len` bytes from the start of the input and decodes it.
///
/// # Errors
/// `Incomplete` with the number of missing bytes; `Error` with what `parse` refuses.
pub fn unit<'a, T, E, F>(
    input: &'a [u8],
    len: usize,
    parse: impl FnOnce(&'a [u8]) -> Result<T, F>,
) -> IResult<&'a [u8], T, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], F>,
{
    let Some((unit, rest)) = input.split_at_checked(len) else {
        return Err(missing(len.saturating_sub(input.len())));
    };
    match parse(unit) {
        Ok(value) => Ok((rest, value)),
        Err(error) => Err(refused(input, error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nom::Parser;
    use nom::branch::alt;
    use nom::combinator::{map_res, verify};

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    enum Fault {
        Odd(u8),
        Combinator,
    }

    crate::nom_error!(Fault);

    fn even(bytes: &[u8]) -> Result<u8, Fault> {
        let first = bytes.first().copied().unwrap_or(0);
        if first & 1 == 0 { Ok(first) } else { Err(Fault::Odd(first)) }
    }

    #[test]
    fn a_unit_is_taken_awaited_or_refused() {
        assert_eq!(unit::<_, Fault, _>(&[4, 5, 6], 2, even), Ok((&[6][..], 4)));
        assert_eq!(unit::<_, Fault, _>(&[4], 3, even), Err(Err::Incomplete(Needed::new(2))));
        assert_eq!(unit::<_, Fault, _>(&[5, 5], 1, even), Err(Err::Error(Fault::Odd(5))));
        assert_eq!(missing::<Fault>(0), Err::Incomplete(Needed::Unknown));
    }

    /// What the decoder said is there after the combinators of a caller, too.
    #[test]
    fn a_combinator_keeps_the_refusal() {
        let one = |input| unit::<_, Fault, _>(input, 1, even);
        let either = |input| alt((one, one)).parse(input);
        assert_eq!(either(&[7]), Err(Err::Error(Fault::Odd(7))));
        assert_eq!(either(&[8]), Ok((&[][..], 8)));
        assert_eq!(map_res(one, |_| Result::<(), _>::Err(Fault::Odd(1))).parse(&[8]), Err(Err::Error(Fault::Odd(1))));
        assert_eq!(verify(one, |value| *value > 8).parse(&[8]), Err(Err::Error(Fault::Combinator)));
    }
}
