use nrz_line::{BitOrder, Window};

use crate::crc::mirrored8;
use crate::frame::{DELIMITER, START};
use crate::{Data, EncoderAddress, EncoderStatus, Error, Expected, Layout, Reply, Response, U40};

/// The reply with the whole position, decoded from its line bits in the fewest instructions: for the interrupt of a drive.
///
/// ```text
///  line bits  0 ........ 17 | 18 ....... 35 | 36 ....... 53 | 54 ....... 71
///             IF             | abs 0..=15    | abs 16..=31   | abs 32..=39, CRC-8
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Abs40 {
    /// EA: who answers.
    pub ea: EncoderAddress,
    /// ES.
    pub es: EncoderStatus,
    /// The position.
    pub abs: U40,
}

/// The start bits and delimiters of four frames, and what they have to be, in the three words of a 32-bit core.
const FRAMING: [u32; 3] = words((START | DELIMITER) & ALL);
const FRAMED: [u32; 3] = words(DELIMITER & ALL);
const ALL: u128 = (1 << 72) - 1;

#[expect(clippy::cast_possible_truncation, reason = "the number is taken apart")]
const fn words(bits: u128) -> [u32; 3] {
    [bits as u32, (bits >> 32) as u32, (bits >> 64) as u32]
}

impl Abs40 {
    /// Bytes that hold the line bits of the reply.
    pub const LINE_BYTES: usize = 9;

    /// Decodes the reply from its 72 line bits, the first of them at the beginning of `line`. `expected` is of layout
    /// [`Layout::Abs40`]; its address and command are checked.
    ///
    /// For a window at another bit offset see [`Response::parse_line`], which gives the same.
    ///
    /// # Errors
    /// As [`Response::parse_line`].
    #[inline(always)]
    pub fn parse_line(line: &[u8; Self::LINE_BYTES], order: BitOrder, expected: &Expected) -> Result<Self, Error> {
        let [w0, w1, w2] = load(line, order);
        let ([m0, m1, m2], [f0, f1, f2]) = (FRAMING, FRAMED);
        let framing = (w0 & m0 ^ f0) | (w1 & m1 ^ f1) | (w2 & m2 ^ f2);
        let b = [
            byte(w0 >> 1),
            byte(w0 >> 9),
            byte(w0 >> 19),
            byte(w0 >> 27 | w1 << 5),
            byte(w1 >> 5),
            byte(w1 >> 13),
            byte(w1 >> 23),
            byte(w1 >> 31 | w2 << 1),
        ];
        let [b0, b1, b2, b3, b4, b5, b6, _] = b;
        // All checks at once: a branch for each would cost more than it saves.
        let first = expected.differs_first(u16::from_le_bytes([b0, b1]));
        if framing | u32::from(mirrored8(b)) | u32::from(first) != 0 {
            return Err(refusal(line, order, expected));
        }
        let (ea, es) = (EncoderAddress::truncate(b0 >> 3), EncoderStatus::new(b1 >> 4));
        Ok(Self { ea, es, abs: U40::from_bytes([b2, b3, b4, b5, b6]) })
    }

    /// The 72 line bits of the reply to the command that `expected` names.
    pub fn emit_line(self, order: BitOrder, expected: &Expected) -> [u8; Self::LINE_BYTES] {
        let response = Response::new(self.ea, expected.command(), self.es, Data::Abs40 { abs: self.abs });
        match response.emit().line().to_bytes(order).first_chunk() {
            Some(bytes) => *bytes,
            // Never: 9 of 16 bytes.
            None => [0; Self::LINE_BYTES],
        }
    }
}

/// The line bits as three words, the first bit in bit 0 of the first.
#[inline(always)]
fn load(line: &[u8; Abs40::LINE_BYTES], order: BitOrder) -> [u32; 3] {
    let mut word = [0; 16];
    if let Some(head) = word.first_chunk_mut() {
        *head = *line;
    }
    words(match order {
        BitOrder::LsbFirst => u128::from_le_bytes(word),
        BitOrder::MsbFirst => u128::from_be_bytes(word).reverse_bits(),
    })
}

#[expect(clippy::cast_possible_truncation, reason = "the low eight bits are meant")]
const fn byte(word: u32) -> u8 {
    word as u8
}

/// Off the hot path: why a reply is refused.
#[cold]
#[inline(never)]
fn refusal(line: &[u8; Abs40::LINE_BYTES], order: BitOrder, expected: &Expected) -> Error {
    let line = Window::read(line, 0, Layout::Abs40.line_bits(), order).unwrap_or(Window::EMPTY);
    match Reply::from_line(line, Layout::Abs40) {
        Ok(reply) => expected.refusal(&reply),
        Err(error) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Command;
    use proptest::prelude::*;

    proptest! {
        /// It gives what the decoder for all layouts gives, of good lines and of any other.
        #[test]
        fn the_same_as_response(line: [u8; 9], value: u64, ea in 0..8_u8, es: u8, damage in 0..90_u32, msb: bool) {
            let order = if msb { BitOrder::MsbFirst } else { BitOrder::LsbFirst };
            let expected = Expected::new(Layout::Abs40, Command::Abs40).from_address(EncoderAddress::truncate(ea));
            let same = |line: [u8; 9]| {
                let window = Window::read(&line, 0, 72, order).unwrap();
                let whole = Response::parse_line(window, &expected).map(|response| Abs40 {
                    ea: response.ea,
                    es: response.es().unwrap(),
                    abs: response.abs40().unwrap(),
                });
                prop_assert_eq!(Abs40::parse_line(&line, order, &expected), whole);
                Ok(())
            };
            same(line)?;
            let reply = Abs40 { ea: EncoderAddress::truncate(ea), es: EncoderStatus::new(es), abs: U40::truncate(value) };
            let mut good = reply.emit_line(order, &expected);
            prop_assert_eq!(Abs40::parse_line(&good, order, &expected), Ok(reply));
            if let Some(byte) = good.get_mut(damage as usize / 8) {
                *byte ^= 1 << (damage % 8);
            }
            same(good)?;
            let other = Abs40 { ea: EncoderAddress::truncate(ea + 1), ..reply };
            same(other.emit_line(order, &expected))?;
            same(reply.emit_line(order, &Expected::new(Layout::Abs40, Command::Abs40Mt)))?;
        }
    }
}
