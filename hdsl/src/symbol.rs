//! 8b/10b words, as which every byte of the link is sent.
//!
//! The word is sent in the order `a b c d e i f g h j`; `a` corresponds to bit 0 of the byte (HDSL Protocol Design).
//! A [`Word`] holds it with `a` in bit 0, so that nothing is ever reversed.
//!
//! ```text
//!  byte   7 6 5   4 3 2 1 0            word   9 8 7 6   5 4 3 2 1 0
//!         H G F   E D C B A                   j h g f   i e d c b a   ← first on the line
//!           y         x                       4-bit     6-bit block
//! ```
//!
//! Two rules of decoding are offered, see [`Rule`]. The running disparity is a diagnostic only: whether an encoder
//! carries it from one frame to the next is not documented.

mod table;

use table::{CONTROL, CONTROLS, DATA, DECODE, INVALID, MINUS, PLUS, REDUCED, SPECIAL, Table};
pub(crate) use table::{FOUR_MORE_ZEROS, NEUTRAL, SIX_MORE_ZEROS};

use crate::error::Error;

servowire_core::number! {
    /// Ten bits of the line, the first one (`a`) in bit 0.
    pub struct Word(u16, 10);
}

impl Word {
    /// Ones minus zeros, -10..=10.
    pub const fn disparity(self) -> i8 {
        let [ones, ..] = self.get().count_ones().to_le_bytes();
        i8::from_le_bytes([ones]).wrapping_mul(2).wrapping_sub(10)
    }

    /// Returns what the word stands for by the tables of the code; `None` if it is in neither column.
    ///
    /// ```
    /// use hdsl::symbol::{Character, Control, Word};
    /// let word = Word::new(0b01_0111_1100); // 001111 1010 on the line
    /// assert_eq!(word.and_then(Word::decode), Some(Character::control(Control::K28_5)));
    /// ```
    pub const fn decode(self) -> Option<Character> {
        let entry = self.entry();
        if entry & INVALID != 0 { None } else { Some(Character(entry & 0x1ff)) }
    }

    /// Returns whether the word is K28.1, K28.2, K28.5 or K28.6 in column RD+.
    const fn is_crossed_k28(self) -> bool {
        let k28_plus = self.get() & 63 == 0b00_0011;
        // fghj = 0110, 1010, 0101, 1001: balanced and not two pairs; symmetric to line order.
        k28_plus && matches!(self.get() >> 6, 0b0110 | 0b1010 | 0b0101 | 0b1001)
    }

    /// Returns whether the word is in the column for this running disparity.
    pub const fn is_in(self, column: RunningDisparity) -> bool {
        self.entry() & column.flag() != 0
    }

    /// Returns how a receiver reads the word by `rule`.
    #[inline]
    pub const fn read(self, rule: Rule) -> Reading {
        Reading::new(rule.table().entry(self), self)
    }

    #[inline]
    const fn entry(self) -> u16 {
        DECODE.entry(self).0
    }
}

/// The sign of the running disparity: which column of the tables the next block is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum RunningDisparity {
    /// RD-: more zeros than ones so far.
    Minus,
    /// RD+: more ones than zeros so far.
    Plus,
}

impl RunningDisparity {
    const fn flag(self) -> u16 {
        match self {
            Self::Minus => MINUS,
            Self::Plus => PLUS,
        }
    }

    /// Returns the opposite sign.
    pub const fn other(self) -> Self {
        match self {
            Self::Minus => Self::Plus,
            Self::Plus => Self::Minus,
        }
    }

    pub(crate) const fn after(self, word: Word) -> Self {
        if word.disparity() == 0 { self } else { self.other() }
    }
}

/// A character as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Encoded {
    /// The word.
    pub word: Word,
    /// The running disparity after it.
    pub disparity: RunningDisparity,
}

servowire_core::codes! {
    /// The twelve special characters of the code.
    #[allow(non_camel_case_types, reason = "the names of the code")]
    #[allow(missing_docs, reason = "the name says which")]
    pub enum Control: u8 {
        K28_0 = 0x1c => "K28.0",
        K28_1 = 0x3c => "K28.1",
        K28_2 = 0x5c => "K28.2",
        K28_3 = 0x7c => "K28.3",
        K28_4 = 0x9c => "K28.4",
        K28_5 = 0xbc => "K28.5",
        K28_6 = 0xdc => "K28.6",
        K28_7 = 0xfc => "K28.7",
        K23_7 = 0xf7 => "K23.7",
        /// Safe channel 2 has no position (SICK manual, safe position 2).
        K27_7 = 0xfb => "K27.7",
        /// The encoder has no value: acceleration and safe channel 1 (SICK manual).
        K29_7 = 0xfd => "K29.7",
        /// The pipe channel has no data in this frame (SICK manual, PIPE_D).
        K30_7 = 0xfe => "K30.7",
    }
}

/// A data byte or a special character.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "(u8, bool)", into = "(u8, bool)")
)]
pub struct Character(u16);

impl Character {
    /// Creates the data character D.x.y of a byte.
    pub const fn data(byte: u8) -> Self {
        Self(byte as u16)
    }

    /// Creates a special character.
    pub const fn control(control: Control) -> Self {
        Self(control as u16 | SPECIAL)
    }

    /// Creates a character from byte and kind; `None` if `k` is set and there is no such special character.
    pub(crate) fn new(byte: u8, k: bool) -> Option<Self> {
        match (k, CONTROLS.contains(&byte)) {
            (false, _) => Some(Self::data(byte)),
            (true, true) => Some(Self(u16::from(byte) | SPECIAL)),
            (true, false) => None,
        }
    }

    /// The value.
    pub const fn byte(self) -> u8 {
        self.0.to_le_bytes()[0]
    }

    /// Returns whether it is a special character.
    pub const fn is_control(self) -> bool {
        self.0 & SPECIAL != 0
    }

    /// Returns the word in the column of `rd`.
    ///
    /// ```
    /// use hdsl::symbol::{Character, RunningDisparity};
    /// let coded = Character::data(0x00).encode(RunningDisparity::Minus);
    /// let (word, after) = (coded.word, coded.disparity);
    /// assert_eq!(word.get(), 0b00_1011_1001); // 100111 0100 on the line
    /// assert_eq!(after, RunningDisparity::Minus);
    /// ```
    #[expect(clippy::indexing_slicing, reason = "a byte is below 256, a column below 2")]
    pub fn encode(self, rd: RunningDisparity) -> Encoded {
        let column = usize::from(rd == RunningDisparity::Plus);
        let bits = if self.is_control() {
            let place = CONTROLS.iter().position(|c| *c == self.byte()).unwrap_or(0);
            CONTROL[column].get(place).copied().unwrap_or(0)
        } else {
            DATA[column][usize::from(self.byte())]
        };
        let word = Word::truncate(bits);
        Encoded { word, disparity: rd.after(word) }
    }
}

impl TryFrom<(u8, bool)> for Character {
    type Error = Error;

    fn try_from((byte, k): (u8, bool)) -> Result<Self, Error> {
        Self::new(byte, k).ok_or(Error::WrongKind { byte })
    }
}

impl From<Character> for (u8, bool) {
    fn from(character: Character) -> Self {
        (character.byte(), character.is_control())
    }
}

// `D28.5`, `K28.5`.
servowire_core::one_line!(Character {
    character => "{}{}.{}", if character.is_control() { 'K' } else { 'D' }, character.byte() & 31, character.byte() >> 5;
});

/// How a receiver judges a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Rule {
    /// By the tables: 464 of the 1024 words are good, and each stands for one character.
    #[default]
    Strict,
    /// As in the receiver firmware of the AM243x Motor Control SDK, which checks only for runs of equal bits.
    ///
    /// * byte error: a = b = c = d, or e = i = f = g = h;
    /// * special: c = d = e = i, or e, i, g, h, j = 0, 1, 1, 1, 1 or 1, 0, 0, 0, 0;
    /// * value: both sub-blocks looked up without regard to disparity, FFh if either is in no table.
    ///
    /// Words that are in no table can pass, and some good words are read as special.
    Reduced,
}

impl Rule {
    /// The meaning of the words.
    #[inline]
    pub(crate) const fn table(self) -> &'static Table {
        match self {
            Self::Strict => &DECODE,
            Self::Reduced => &REDUCED,
        }
    }
}

/// How a receiver reads a word: value in bits 7:0, flags above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Entry(u16);

impl Entry {
    /// The value from the look-ups.
    #[inline]
    pub(crate) const fn raw(self) -> u8 {
        self.0.to_le_bytes()[0]
    }

    /// Returns the flags of both, for a test of several words at once.
    #[inline]
    pub(crate) const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Neither a byte error nor a special character.
    #[inline]
    pub(crate) const fn is_data(self) -> bool {
        self.0 & (INVALID | SPECIAL) == 0
    }

    #[inline]
    pub(crate) const fn is_byte_error(self) -> bool {
        self.0 & INVALID != 0
    }

    /// Returns the same word as read in the secondary channel, where the reduced rule corrects K28.1, K28.2, K28.5 and K28.6
    /// of column RD+. With the strict rule nothing needs correcting.
    #[inline]
    pub(crate) const fn in_secondary(self, rule: Rule, word: Word) -> Self {
        if matches!(rule, Rule::Reduced) && word.is_crossed_k28() { Self(self.0 ^ 0b1110_0000) } else { self }
    }
}

/// How a receiver has read a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Reading {
    entry: Entry,
    word: Word,
}

impl Reading {
    #[inline]
    pub(crate) const fn new(entry: Entry, word: Word) -> Self {
        Self { entry, word }
    }

    /// The word.
    pub const fn word(self) -> Word {
        self.word
    }

    /// Returns whether the word is bad by the rule it was read with.
    #[inline]
    pub const fn is_byte_error(self) -> bool {
        self.entry.is_byte_error()
    }

    /// Returns whether the rule takes the word for a special character.
    #[inline]
    pub const fn is_special(self) -> bool {
        self.entry.0 & SPECIAL != 0
    }

    /// The value from the look-ups, even for a bad word: FFh if a sub-block is in no table.
    ///
    /// Registers of the receiver take this value; for anything else see [`byte`](Self::byte).
    #[inline]
    pub const fn raw(self) -> u8 {
        self.entry.raw()
    }

    /// The character.
    ///
    /// # Errors
    /// [`Error::InvalidWord`].
    pub const fn character(self) -> Result<Character, Error> {
        if self.is_byte_error() {
            Err(Error::InvalidWord { word: self.word.get() })
        } else {
            Ok(Character(self.entry.0 & 0x1ff))
        }
    }

    /// The value.
    ///
    /// # Errors
    /// [`Error::InvalidWord`].
    pub const fn byte(self) -> Result<u8, Error> {
        if self.is_byte_error() { Err(Error::InvalidWord { word: self.word.get() }) } else { Ok(self.raw()) }
    }

    /// Returns whether the word is this special character.
    pub const fn is(self, control: Control) -> bool {
        self.entry.0 & (0xff | SPECIAL | INVALID) == control as u16 | SPECIAL
    }
}

/// As its word.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl serde::Serialize for Reading {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.word.serialize(serializer)
    }
}

// `D28.5`, `K28.5`; a word that is no good with its ten line bits, the first one first: `?1111111111`.
servowire_core::one_line!(Reading {
    reading if reading.is_byte_error() => "?{:010b}", reading.word.get().reverse_bits() >> 6;
    reading => "{}", Character(reading.entry.0 & 0x1ff);
});

/// How a [`DisparityCheck`] judges a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DisparityStatus {
    /// In the column of the present running disparity.
    Ok,
    /// Only in the other column.
    Disparity,
    /// In no column.
    Invalid,
}

/// Follows the running disparity through a stream of words, for diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DisparityCheck {
    rd: RunningDisparity,
}

impl DisparityCheck {
    /// Starts with this running disparity.
    pub const fn new(rd: RunningDisparity) -> Self {
        Self { rd }
    }

    /// The running disparity after the words so far.
    pub const fn disparity(self) -> RunningDisparity {
        self.rd
    }

    /// Judges the next word. After a word of the other column it continues with that column's result; after a word of neither
    /// column, with the sign of the word's own disparity, if that is not 0.
    pub fn step(&mut self, word: Word) -> DisparityStatus {
        let other = self.rd.other();
        if word.is_in(self.rd) {
            self.rd = self.rd.after(word);
            DisparityStatus::Ok
        } else if word.is_in(other) {
            self.rd = other.after(word);
            DisparityStatus::Disparity
        } else {
            self.rd = match word.disparity() {
                0 => self.rd,
                ..0 => RunningDisparity::Minus,
                1.. => RunningDisparity::Plus,
            };
            DisparityStatus::Invalid
        }
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for Character {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        if bool::arbitrary(from)? {
            return Ok(Self::data(u8::arbitrary(from)?));
        }
        Control::arbitrary(from).map(Self::control)
    }
}

#[cfg(test)]
mod tests;
