use nrz_line::{BitOrder, Window};

use crate::crc::mirrored;
use crate::frame::{DELIMITER, START, unpack};
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

/// Start bits, delimiters and all bits of four frames.
const START4: u128 = START & ALL4;
const DELIMITER4: u128 = DELIMITER & ALL4;
const ALL4: u128 = (1 << 72) - 1;

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
    pub fn parse_line(line: &[u8; Self::LINE_BYTES], order: BitOrder, expected: &Expected) -> Result<Self, Error> {
        let bits = load(line, order);
        let framed = bits & (START4 | DELIMITER4) == DELIMITER4;
        let [c0, c1, c2, c3, ..] = unpack(bits);
        let ([b0, b1], [b2, b3]) = (c0.to_le_bytes(), c1.to_le_bytes());
        let ([b4, b5], [b6, b7]) = (c2.to_le_bytes(), c3.to_le_bytes());
        let sound = mirrored(&[b0, b1, b2, b3, b4, b5, b6, b7]) == 0;
        if !framed || !sound || !expected.fits_first(c0) {
            return Err(refusal(bits, expected));
        }
        let [ea, es] = [c0 >> 3, c0 >> 12].map(u16::to_le_bytes).map(|[low, _]| low);
        let abs = U40::from_bytes([b2, b3, b4, b5, b6]);
        Ok(Self { ea: EncoderAddress::truncate(ea), es: EncoderStatus::new(es), abs })
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

/// The line bits as one integer, the first in bit 0.
fn load(line: &[u8; Abs40::LINE_BYTES], order: BitOrder) -> u128 {
    let [a, b, c, d, e, f, g, h, i] = match order {
        BitOrder::LsbFirst => *line,
        BitOrder::MsbFirst => line.map(u8::reverse_bits),
    };
    let low = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
    u128::from(low) | u128::from(i) << 64
}

/// Off the hot path: why a reply is refused.
#[cold]
fn refusal(bits: u128, expected: &Expected) -> Error {
    let line = Window::from_bits(bits, Layout::Abs40.line_bits()).unwrap_or(Window::EMPTY);
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
