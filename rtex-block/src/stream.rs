//! `nom` streaming parsers for logs in which blocks follow each other without anything between them.
//!
//! Each takes one block from the front of the input and leaves the rest; `Incomplete` says how many bytes are missing. They
//! decode leniently, like the `parse` functions they call.

use nom::error::{FromExternalError, ParseError};
use nom::{IResult, Parser};
use servowire_core::stream::unit;

use crate::block::{LEN, LEN32};
use crate::command::Command;
use crate::error::Error;
use crate::response::Response;
use crate::sub::{Command32, Response32};

/// Reads a 16-byte command block.
pub fn command<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Command, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    unit(input, LEN, Command::parse)
}

/// Reads a 16-byte response block.
pub fn response<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Response, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    unit(input, LEN, Response::parse)
}

/// Reads a 32-byte command block.
pub fn command32<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Command32, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    unit(input, LEN32, Command32::parse)
}

/// Reads a 32-byte response block.
///
/// ```
/// use rtex_block::stream;
/// let mut log = [0; 70];
/// for block in log.chunks_exact_mut(32) {
///     (block[0], block[1], block[16]) = (0x85, 0x20, 0x0a);
/// }
/// let (rest, first) = stream::response32::<nom::error::Error<&[u8]>>(&log).unwrap();
/// assert_eq!((rest.len(), first.sub.code.get()), (38, 0x0a));
/// ```
pub fn response32<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Response32, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    unit(input, LEN32, Response32::parse)
}

/// What a log contains for one exchange with one drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pair {
    /// The command.
    pub command: Command,
    /// The response that came with it.
    pub response: Response,
}

servowire_core::one_line!(Pair { Self { command, response } => "{}; {}", command, response; });

/// Reads the command and response of one exchange with one drive, in this order.
pub fn pair<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], Pair, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    (command, response).map(|(command, response)| Pair { command, response }).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MacId, UpdateCounter};
    use nom::multi::many0_count;
    use nom::{Err, Needed};

    #[test]
    fn blocks_chain_and_wait_for_the_rest() {
        let command_block = Command::idle(MacId::new(3).unwrap(), UpdateCounter::ZERO).emit();
        let mut log = [0; 40];
        for (at, byte) in log.iter_mut().enumerate() {
            *byte = command_block[at % 16];
        }
        let (rest, first) = command::<Error>(&log).unwrap();
        assert_eq!((rest.len(), first.mac_id.get()), (24, 3));
        let (_, _) = command::<Error>(rest).unwrap();
        assert_eq!(command::<Error>(&rest[16..]), Err(Err::Incomplete(Needed::new(8))));
        log[16] |= 0x80;
        assert_eq!(command::<Error>(&log[16..]), Err(Err::Error(Error::Direction { byte0: 0x83 })));
        assert_eq!(many0_count(command::<Error>).parse(&log[..32]).unwrap().1, 1);
        log[16 + 1] = 0x20;
        let (rest, Pair { command: sent, response: received }) = pair::<Error>(&log).unwrap();
        assert_eq!((rest.len(), sent.code(), received.code), (8, received.code, sent.code()));
    }
}
