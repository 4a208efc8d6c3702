use nrz_line::{BitOrder, Window};

use crate::contents::{Contents, sound_four, sound_four_words};
use crate::error::Error;
use crate::expected::{Expected, SYNC_CODE};
use crate::layout::Layout;
use crate::number::{EncoderAddress, U40};
use crate::raw_response::RawResponse;
use crate::response::refusal;
use crate::status::EncoderStatus;

/// The response with the whole position, decoded from its line bits in the fewest instructions, for use in the interrupt of a
/// drive.
///
/// ```text
///  line bits  0 ........ 17 | 18 ....... 35 | 36 ....... 53 | 54 ....... 71
///             IF             | abs 0..=15    | abs 16..=31   | abs 32..=39, CRC-8
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Abs40 {
    /// EA: the encoder that answers.
    pub ea: EncoderAddress,
    /// ES.
    pub es: EncoderStatus,
    /// The position.
    pub abs: U40,
}

impl Abs40 {
    /// Bytes that hold the line bits of the response.
    pub const LINE_BYTES: usize = 9;

    /// Decodes the response from its 72 line bits, the first one at the start of `line`. `expected` is of layout
    /// [`Layout::Abs40`]; its address and command are checked.
    ///
    /// For a window at another bit offset see [`Response::parse_line`](crate::Response::parse_line), which returns the same.
    ///
    /// # Errors
    /// As [`Response::parse_line`](crate::Response::parse_line).
    #[inline(always)]
    pub fn parse_line(expected: &Expected, line: &[u8; Self::LINE_BYTES], order: BitOrder) -> Result<Self, Error> {
        match Self::of_line(expected, load(line, order)) {
            Some(value) => Ok(value),
            None => Err(line_refusal(expected, line, order)),
        }
    }

    /// Decodes the response from its four frames, the 16 content bits of each in a word; words after them are ignored.
    /// `expected` is of layout [`Layout::Abs40`]; its address and command are checked.
    ///
    /// # Errors
    /// As [`Response::parse_words`](crate::Response::parse_words).
    pub fn parse_words(expected: &Expected, words: &[u16], order: BitOrder) -> Result<Self, Error> {
        match sound_four_words(words, order) {
            Some((contents, wrong)) if wrong | expected.differs(contents) == 0 => Ok(Self::of_contents(contents)),
            _ => Err(refusal(expected, RawResponse::from_words(Layout::Abs40, words, order))),
        }
    }

    /// Decodes four words of line bits, the first bit in bit 0 of the first word; `None` if any check fails.
    #[inline(always)]
    fn of_line(expected: &Expected, line: u128) -> Option<Self> {
        let (contents, wrong) = sound_four(line);
        // All checks at once: a branch for each would cost more than it saves.
        if wrong | expected.differs(contents) != 0 {
            return None;
        }
        Some(Self::of_contents(contents))
    }

    #[inline(always)]
    const fn of_contents([p0, p1, _]: Contents) -> Self {
        let [_, b1, b2, b3] = p0.to_le_bytes();
        let [b4, b5, b6, _] = p1.to_le_bytes();
        let (ea, es) = (EncoderAddress::truncate(low_byte(p0 >> 3)), EncoderStatus::from_bits_truncate(b1 >> 4));
        Self { ea, es, abs: U40::from_le_bytes([b2, b3, b4, b5, b6]) }
    }

    /// Takes the 72 line bits of the response to the command in `expected`.
    ///
    /// ```
    /// use nikon_aformat::{Abs40, BitOrder, Command, EncoderAddress, EncoderStatus, Expected, Layout, U40};
    /// let expected = Expected::new(Layout::Abs40, Command::Abs40);
    /// let abs = U40::truncate(0x12_3456_789a);
    /// let sent = Abs40 { ea: EncoderAddress::ZERO, es: EncoderStatus::empty(), abs };
    /// let line = sent.emit_line(BitOrder::MsbFirst, &expected);
    /// assert_eq!(Abs40::parse_line(&expected, &line, BitOrder::MsbFirst), Ok(sent));
    /// ```
    pub fn emit_line(self, order: BitOrder, expected: &Expected) -> [u8; Self::LINE_BYTES] {
        let head = u128::from(SYNC_CODE) | u128::from(self.ea.get()) << 3 | u128::from(expected.command().code()) << 6;
        let payload = head | u128::from(self.es.bits() & 0xf) << 12 | u128::from(self.abs.get()) << 16;
        match RawResponse::of_payload(payload, Layout::Abs40).line().to_bytes(order).first_chunk() {
            Some(bytes) => *bytes,
            // Never: 9 of 16 bytes.
            None => [0; Self::LINE_BYTES],
        }
    }
}

/// The line bits, the first in bit 0.
#[inline(always)]
fn load(line: &[u8; Abs40::LINE_BYTES], order: BitOrder) -> u128 {
    let mut word = [0; 16];
    if let Some(head) = word.first_chunk_mut() {
        *head = *line;
    }
    match order {
        BitOrder::LsbFirst => u128::from_le_bytes(word),
        BitOrder::MsbFirst => u128::from_be_bytes(word).reverse_bits(),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the low eight bits are meant")]
const fn low_byte(word: u32) -> u8 {
    word as u8
}

/// Returns why a response is refused; kept off the hot path.
#[cold]
#[inline(never)]
fn line_refusal(expected: &Expected, line: &[u8; Abs40::LINE_BYTES], order: BitOrder) -> Error {
    let line = Window::read(line, 0, Layout::Abs40.line_bits(), order).unwrap_or(Window::EMPTY);
    refusal(expected, RawResponse::from_line(Layout::Abs40, line))
}

servowire_core::one_line!(Abs40 { Self { ea, es, abs } => "from {}: ES {} ABS {:#012x}", ea, es, abs.get(); });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::{Addresses, Bus};
    use crate::command::Command;
    use crate::response::Response;
    use proptest::prelude::*;

    /// A wrong head and a wrong check field do not hide each other: of all values of the first eight content bits and of the CRC-8, one
    /// pair is taken.
    #[test]
    fn two_faults_are_not_none() {
        let expected = Expected::new(Layout::Abs40, Command::Abs40).from_address(EncoderAddress::ZERO);
        let abs = U40::truncate(0x12_3456_789a);
        let sent = Abs40 { ea: EncoderAddress::ZERO, es: EncoderStatus::empty(), abs };
        let line = Window::read(&sent.emit_line(BitOrder::LsbFirst, &expected), 0, 72, BitOrder::LsbFirst).unwrap();
        let mut taken = std::vec::Vec::new();
        for (head, crc) in (0..=255_u8).flat_map(|head| (0..=255_u8).map(move |crc| (head, crc))) {
            let other = Window::from_bits(line.bits() ^ u128::from(head) << 1 ^ u128::from(crc) << 63, 72).unwrap();
            let words: [u16; 4] = core::array::from_fn(|at| (other.bits() >> (18 * at + 1)) as u16);
            let bytes = *other.to_bytes(BitOrder::LsbFirst).first_chunk().unwrap();
            let by_line = Abs40::parse_line(&expected, &bytes, BitOrder::LsbFirst);
            assert_eq!(by_line, Abs40::parse_words(&expected, &words, BitOrder::LsbFirst), "{head} {crc}");
            taken.extend(by_line.map(|response| (head, crc, response)));
        }
        assert_eq!(taken, [(0, 0, sent)]);
    }

    proptest! {
        /// It gives what the decoder for all layouts gives, of good lines and of any other.
        #[test]
        fn the_same_as_response(line: [u8; 9], value: u64, ea in 0..8_u8, es: u8, damage in 0..90_u32, msb: bool) {
            let order = if msb { BitOrder::MsbFirst } else { BitOrder::LsbFirst };
            let expected = Expected::new(Layout::Abs40, Command::Abs40).from_address(EncoderAddress::truncate(ea));
            let same = |line: [u8; 9]| {
                let window = Window::read(&line, 0, 72, order).unwrap();
                let whole = Response::parse_line(&expected, window).map(|response| Abs40 {
                    ea: response.ea,
                    es: response.es().unwrap(),
                    abs: response.abs40().unwrap(),
                });
                prop_assert_eq!(Abs40::parse_line(&expected, &line, order), whole);
                let words: [u16; 4] = core::array::from_fn(|at| (window.bits() >> (18 * at + 1)) as u16);
                let words = words.map(|word| if msb { word.reverse_bits() } else { word });
                let short = usize::from(value & 3 > 0) * 4 + usize::from(value & 3 > 2) * 3;
                let (words, mut bus) = (words.get(..short).unwrap_or(&words), Bus::new(expected, Addresses::ALL));
                let whole = Response::parse_words(&expected, words, order);
                let both = Abs40::parse_words(&expected, words, order);
                prop_assert_eq!(both.map(|it| (it.ea, it.abs)), whole.map(|it| (it.ea, it.abs40().unwrap())));
                prop_assert_eq!(bus.push_abs40(words, order), Bus::new(expected, Addresses::ALL).push_words(words, order));
                Ok(())
            };
            same(line)?;
            let raw = Abs40 { ea: EncoderAddress::truncate(ea), es: EncoderStatus::from_bits_truncate(es), abs: U40::truncate(value) };
            let mut good = raw.emit_line(order, &expected);
            prop_assert_eq!(Abs40::parse_line(&expected, &good, order), Ok(raw));
            if let Some(byte) = good.get_mut(damage as usize / 8) {
                *byte ^= 1 << (damage % 8);
            }
            same(good)?;
            let other = Abs40 { ea: EncoderAddress::truncate(ea + 1), ..raw };
            same(other.emit_line(order, &expected))?;
            let several = Expected::new(Layout::Abs40, Command::Abs40Mt);
            let line = raw.emit_line(order, &several);
            prop_assert_eq!(Abs40::parse_line(&several, &line, order), Ok(raw));
            same(line)?;
        }
    }
}
