//! The master's part of balancing the line: EQUALISATION, and the parameter byte, whose polarity is chosen by the line disparity
//! instead of a running disparity.

use core::fmt;

use crate::parameter::ParameterByte;
use crate::symbol::{FOUR_MORE_ZEROS, NEUTRAL, Rule, SIX_MORE_ZEROS, Word};

/// The ones minus the zeros that the master has sent, as its receiver counts them.
///
/// The count follows the vendor's rule and is not exact: SYNC, SAMPLE and CYCLE RESET are taken as neutral, and so
/// is an EQUALISATION of 0000 for a disparity of -1..=1. It starts at 0 and returns to 0 with the TRAILER of every
/// answered frame; in frames without an answer it is carried on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct LineDisparity(i8);

/// The EQUALISATION bits of a head.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Equalisation {
    /// The four bits, the first line bit in bit 0.
    pub bits: u8,
    /// The disparity after these bits.
    pub disparity: LineDisparity,
}

/// The word of a parameter byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EncodedParameter {
    /// The word.
    pub word: Word,
    /// The disparity after the word.
    pub disparity: LineDisparity,
}

impl LineDisparity {
    /// Balanced.
    pub const ZERO: Self = Self(0);

    /// Creates the disparity with this count.
    pub const fn new(ones_minus_zeros: i8) -> Self {
        Self(ones_minus_zeros)
    }

    /// Ones minus zeros.
    pub const fn get(self) -> i8 {
        self.0
    }

    const fn plus(self, difference: i8) -> Self {
        Self(self.0.saturating_add(difference))
    }

    /// Returns the count after an EXTRA window with this many ones.
    pub const fn with_ones(self, ones: u8) -> Self {
        self.plus(if ones > 127 { 127 } else { i8::from_le_bytes([ones]) })
    }

    /// Returns the four EQUALISATION bits, and the disparity to continue with.
    ///
    /// ```text
    ///  disparity   bits sent   afterwards
    ///   -1..=1      0000        d
    ///    2, 3       0010        d - 2
    ///    4..        0000        d - 4
    ///   -3, -2      1101        d + 2
    ///   ..=-4       1111        d + 4
    /// ```
    ///
    /// An encoder does not interpret these bits.
    #[inline]
    pub const fn equalisation(self) -> Equalisation {
        let (bits, disparity) = match self.0 {
            -1..=1 => (0b0000, self),
            2..=3 => (0b0100, self.plus(-2)),
            4.. => (0b0000, self.plus(-4)),
            -3..=-2 => (0b1011, self.plus(2)),
            ..=-4 => (0b1111, self.plus(4)),
        };
        Equalisation { bits, disparity }
    }

    /// Returns the count after a head with this parameter byte; see [`Head::new`](crate::frame::Head::new).
    pub const fn after_head(self, byte: ParameterByte) -> Self {
        self.equalisation().disparity.encode(byte).disparity
    }

    /// Returns the word for the parameter byte, and the disparity afterwards.
    ///
    /// 1. the 6-bit block of bits 4:0 (28 yields the block of K.28): a neutral block as tabulated (7 always 000111),
    ///    otherwise the version with more zeros if d >= 0, its inverse if d < 0; its balance is added to d;
    /// 2. the 4-bit block of bits 7:5 in the same way (3 always 0011), using the new d, which it does not change.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "a byte is below 256")]
    pub const fn encode(self, byte: ParameterByte) -> EncodedParameter {
        if self.0 != 0 {
            return self.encode_unbalanced(byte);
        }
        let entry = BALANCED[byte.raw() as usize];
        let disparity = Self(if entry & MORE_ZEROS != 0 { -2 } else { 0 });
        EncodedParameter { word: Word::truncate(entry & 0x3ff), disparity }
    }

    #[expect(clippy::indexing_slicing, reason = "five bits are below 32, three below 8")]
    const fn encode_unbalanced(self, byte: ParameterByte) -> EncodedParameter {
        let raw = byte.raw();
        let (six, balance) = polarity(SIX_MORE_ZEROS[(raw & 31) as usize], 0x3f, self.0);
        let after = self.plus(balance);
        let (four, _) = polarity(FOUR_MORE_ZEROS[(raw >> 5) as usize], 0x0f, after.0);
        EncodedParameter { word: Word::truncate(six as u16 | (four as u16) << 6), disparity: after }
    }
}

/// The 6-bit block of the word has more zeros.
const MORE_ZEROS: u16 = 0x8000;

/// The words of all bytes for a balanced line, as before every answered frame of a free-running link.
#[expect(clippy::indexing_slicing, reason = "runs at compile time")]
static BALANCED: [u16; 256] = {
    let mut table = [0; 256];
    let mut raw: u8 = 0;
    loop {
        let coded = LineDisparity::ZERO.encode_unbalanced(ParameterByte::new(raw));
        table[raw as usize] = coded.word.get() | if coded.disparity.0 < 0 { MORE_ZEROS } else { 0 };
        if raw == 255 {
            break;
        }
        raw += 1;
    }
    table
};

/// Returns the block itself if it is neutral or `d` requires zeros, otherwise its inverse; and its balance. Neutral blocks
/// are marked in the tables.
const fn polarity(block: u8, mask: u8, d: i8) -> (u8, i8) {
    if block & NEUTRAL != 0 {
        (block & mask, 0)
    } else if d >= 0 {
        (block, -2)
    } else {
        (block ^ mask, 2)
    }
}

impl ParameterByte {
    /// Returns the byte that a word from [`LineDisparity::encode`] stands for, regardless of the disparity; `None` if a
    /// sub-block is in no table.
    pub const fn decode(word: Word) -> Option<Self> {
        // The sub-block look-ups disregard polarity, as an encoder has to.
        let reading = word.read(Rule::Reduced);
        let raw = reading.raw();
        // FFh also marks a failed look-up; the real FFh has x = 31 and y = 7.
        if raw == 0xff && !is_ff(word.get()) { None } else { Some(Self::new(raw)) }
    }
}

/// Returns whether the word is one of those that stand for FFh: 101011 or its inverse, then y = 7.
const fn is_ff(bits: u16) -> bool {
    let six = matches!(bits & 0x3f, 0b11_0101 | 0b00_1010);
    six && matches!(bits >> 6, 0b0111 | 0b1000 | 0b1110 | 0b0001)
}

impl fmt::Display for LineDisparity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_at_every_disparity_comes_back() {
        for raw in (0..=255).step_by(crate::thin(51)) {
            for d in i8::MIN..=i8::MAX {
                let coded = LineDisparity(d).encode(ParameterByte::new(raw));
                let (word, after) = (coded.word, coded.disparity);
                assert_eq!(ParameterByte::decode(word), Some(ParameterByte::new(raw)), "{raw:02x} {d}");
                assert!(after.0.abs_diff(d) <= 2);
            }
        }
    }

    /// An unbalanced block has more zeros on a line with d >= 0 and more ones otherwise; the 4-bit block goes by d after the other.
    /// Ones minus zeros of the 6-bit block are added to d, as the rule counts them: 2 for an unbalanced one.
    #[test]
    fn each_block_pulls_the_line_back() {
        for raw in 0..=255 {
            for d in [-9_i8, -2, -1, 0, 1, 2, 9] {
                let coded = LineDisparity::new(d).encode(ParameterByte::new(raw));
                let ones = |bits: u16, all: i32| 2 * bits.count_ones().cast_signed() - all;
                let (six, four) = (ones(coded.word.get() & 0x3f, 6), ones(coded.word.get() >> 6, 4));
                assert!(six == 0 || (six < 0) == (d >= 0), "{raw:02x} {d}");
                assert!(four == 0 || (four < 0) == (coded.disparity.get() >= 0), "{raw:02x} {d}");
                assert_eq!(i32::from(coded.disparity.get() - d), six.signum() * 2, "{raw:02x} {d}");
            }
        }
        assert_eq!([-5, 0, 7].map(|d| LineDisparity::new(d).get()), [-5, 0, 7]);
    }

    #[test]
    fn the_documented_words() {
        let bits = |text: &str| text.bytes().rev().fold(0, |b, c| b << 1 | u16::from(c == b'1'));
        for (raw, text) in [
            (0x1f, "0101001011"),
            (0x19, "1001100100"),
            (0x1a, "0101100100"),
            (0x1b, "0010011011"),
            (0x1c, "1100001011"),
            (0x1d, "0100011011"),
            (0x9e, "1000011101"),
            (0x90, "1001001101"),
            (0xd0, "1001000110"),
        ] {
            assert_eq!(LineDisparity::ZERO.encode(ParameterByte::new(raw)).word.get(), bits(text), "{raw:02x}");
        }
    }

    #[test]
    fn words_outside_the_tables_are_no_parameter_byte() {
        let good = (0..1024).filter(|w| ParameterByte::decode(Word::new(*w).unwrap()).is_some()).count();
        // 47 six-bit blocks (18 + 2 * 13 + both of 7 + both of K28, 7 counted once) times 14 four-bit blocks.
        let six = (0..64_u16).filter(|s| Word::new(s | 0b1001 << 6).unwrap().read(Rule::Reduced).raw() != 0xff).count();
        assert_eq!(good, six * 14);
        assert_eq!(LineDisparity::ZERO.with_ones(9), LineDisparity(9));
        assert_eq!(LineDisparity(127).with_ones(200), LineDisparity(127));
    }
}
