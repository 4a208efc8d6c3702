//! `nom` streaming parsers for logs in which blocks follow each other without anything between them.
//!
//! Each takes one block from the front and leaves the rest; `Incomplete` tells how many bytes are missing. They
//! decode leniently, like the `parse` functions they call.

use nom::bytes::streaming::take;
use nom::{Err, IResult, Parser};

use crate::{Command, Command32, Error, LEN, LEN32, Response, Response32};

/// A 16-byte command block.
pub fn command(input: &[u8]) -> IResult<&[u8], Command, Error> {
    block(input, LEN, Command::parse)
}

/// A 16-byte response block.
pub fn response(input: &[u8]) -> IResult<&[u8], Response, Error> {
    block(input, LEN, Response::parse)
}

/// A 32-byte command block.
pub fn command32(input: &[u8]) -> IResult<&[u8], Command32, Error> {
    block(input, LEN32, Command32::parse)
}

/// A 32-byte response block.
pub fn response32(input: &[u8]) -> IResult<&[u8], Response32, Error> {
    block(input, LEN32, Response32::parse)
}

/// The command and response of one exchange with one drive, in this order.
pub fn exchange(input: &[u8]) -> IResult<&[u8], (Command, Response), Error> {
    (command, response).parse(input)
}

fn block<T>(input: &[u8], size: usize, parse: fn(&[u8]) -> Result<T, Error>) -> IResult<&[u8], T, Error> {
    let (rest, bytes) = take(size)(input)?;
    match parse(bytes) {
        Ok(value) => Ok((rest, value)),
        Err(e) => Err(Err::Error(e)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MacId, UpdateCounter};
    use nom::Needed;
    use nom::multi::many0_count;

    #[test]
    fn blocks_chain_and_wait_for_the_rest() {
        let command_block = Command::idle(MacId::new(3).unwrap(), UpdateCounter::ZERO).emit();
        let mut log = [0; 40];
        for (at, byte) in log.iter_mut().enumerate() {
            *byte = command_block[at % 16];
        }
        let (rest, first) = command(&log).unwrap();
        assert_eq!((rest.len(), first.mac_id.get()), (24, 3));
        let (_, _) = command(rest).unwrap();
        assert_eq!(command(&rest[16..]), Err(Err::Incomplete(Needed::new(8))));
        log[16] |= 0x80;
        assert_eq!(command(&log[16..]), Err(Err::Error(Error::Direction { byte0: 0x83 })));
        assert_eq!(many0_count(command).parse(&log[..32]).unwrap().1, 1);
        log[16 + 1] = 0x20;
        let (rest, (sent, received)) = exchange(&log).unwrap();
        assert_eq!((rest.len(), sent.code(), received.code), (8, received.code, sent.code()));
    }
}
