//! The encoder's answer: 61 bits, six words and the switch bit.

use nrz_line::Window;

use crate::acceleration::DeltaDelta;
use crate::error::Error;
use crate::frame::ANSWER_BITS;
use crate::parameter::EncoderByte;
use crate::symbol::{Character, Control, Entry, Reading, Rule, RunningDisparity, Word};

/// An answer as received. Each channel is judged separately; a bad word in one does not affect the others.
///
/// ```text
///  bit   0         10          20      30              50  51        61
///        vertical | parameter | pipe | acc hi | acc lo | s | secondary
///                                                       inverse of bit 49
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Answer {
    line: u64,
    vertical: Entry,
    parameter: Entry,
    pipe: Entry,
    acceleration: [Entry; 2],
    secondary: Entry,
    rule: Rule,
}

impl Answer {
    /// Reads the 61 low bits of `line`, with the first line bit in bit 0.
    #[inline]
    pub const fn from_bits(rule: Rule, line: u64) -> Self {
        let line = line & (u64::MAX >> 3);
        let table = rule.table();
        Self {
            line,
            vertical: table.entry(word(line)),
            parameter: table.entry(word(line >> 10)),
            pipe: table.entry(word(line >> 20)),
            acceleration: [table.entry(word(line >> 30)), table.entry(word(line >> 40))],
            secondary: table.entry(word(line >> 51)).in_secondary(rule, word(line >> 51)),
            rule,
        }
    }

    /// Reads an answer from the start of `line`; bits after it are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`].
    #[expect(clippy::cast_possible_truncation, reason = "61 of the bits are taken")]
    pub const fn parse(rule: Rule, line: Window) -> Result<Self, Error> {
        if line.len() < ANSWER_BITS {
            return Err(Error::Truncated { got: line.len() as u16, want: ANSWER_BITS as u16 });
        }
        Ok(Self::from_bits(rule, line.bits() as u64))
    }

    /// The 61 line bits, the first in bit 0.
    pub const fn bits(self) -> u64 {
        self.line
    }

    /// Returns whether it was read by the tables ([`Rule::Strict`]).
    pub(crate) const fn is_strict(self) -> bool {
        matches!(self.rule, Rule::Strict)
    }

    /// The byte of the V-frame.
    #[inline]
    pub const fn vertical(self) -> Reading {
        Reading::new(self.vertical, word(self.line))
    }

    /// The word of the parameters channel.
    #[inline]
    pub(crate) const fn parameter_word(self) -> Reading {
        Reading::new(self.parameter, word(self.line >> 10))
    }

    /// The parameter byte.
    ///
    /// # Errors
    /// [`Error::InvalidWord`]. A special character is taken by its value, as by the vendor's receiver.
    #[inline]
    pub const fn parameter(self) -> Result<EncoderByte, Error> {
        match self.parameter_word().byte() {
            Ok(byte) => Ok(EncoderByte::new(byte)),
            Err(e) => Err(e),
        }
    }

    /// The word of the pipe (SensorHub) channel.
    #[inline]
    pub const fn pipe(self) -> Reading {
        Reading::new(self.pipe, word(self.line >> 20))
    }

    /// The two words of the acceleration channel, high byte first.
    #[inline]
    pub const fn acceleration_words(self) -> [Reading; 2] {
        let [high, low] = self.acceleration;
        [Reading::new(high, word(self.line >> 30)), Reading::new(low, word(self.line >> 40))]
    }

    /// The word of safe channel 2.
    #[inline]
    pub const fn secondary(self) -> Reading {
        Reading::new(self.secondary, word(self.line >> 51))
    }

    /// Returns whether the switch bit is the inverse of the bit before it. A wrong switch bit is only noted.
    #[inline]
    pub const fn switch_ok(self) -> bool {
        (self.line >> 49 ^ self.line >> 50) & 1 == 1
    }

    /// All six words in line order.
    pub const fn words(self) -> [Reading; 6] {
        let [high, low] = self.acceleration_words();
        [self.vertical(), self.parameter_word(), self.pipe(), high, low, self.secondary()]
    }

    /// Returns whether all words are good, and only those of the pipe and the secondary channel are special characters, if any.
    #[inline]
    pub(crate) const fn is_plain(&self) -> bool {
        let [high, low] = self.acceleration;
        let plain = self.vertical.or(self.parameter).or(high).or(low);
        plain.is_data() && !self.pipe.or(self.secondary).is_byte_error()
    }

    /// Returns whether the other words cannot be read either, as with an encoder that did not hear the head and is silent.
    pub(crate) const fn is_silence(&self) -> bool {
        self.parameter.is_byte_error()
            && self.secondary.is_byte_error()
            && self.vertical.is_byte_error()
            && self.pipe.is_byte_error()
    }

    /// Returns what is wrong with the words of an answer that is not [plain](Self::is_plain).
    #[inline]
    pub(crate) const fn bad_words(&self) -> BadWords {
        let [high, low] = self.acceleration;
        let mark = Some(Control::K29_7);
        BadWords::NONE
            .with(VERTICAL, self.vertical, mark)
            .with(PARAMETER, self.parameter, None)
            .with(PIPE, self.pipe, None)
            .with(1 << 3, high, mark)
            .with(1 << 4, low, mark)
            .with(SECONDARY, self.secondary, None)
    }

    /// The second difference of the position.
    ///
    /// # Errors
    /// In this order: [`Error::InvalidWord`] for either word, [`Error::EncoderError`] for K29.7 K29.7,
    /// [`Error::WrongKind`] for any other special character (by [`Rule::Strict`] only), [`Error::AccelerationCrc`].
    ///
    /// D28.y and K28.y differ in one line bit and have the same value. Accepting only data characters lets no single wrong line
    /// bit through.
    #[inline]
    pub const fn delta_delta(self) -> Result<DeltaDelta, Error> {
        let [high, low] = self.acceleration;
        if high.or(low).is_data() {
            return DeltaDelta::from_bytes([high.raw(), low.raw()]);
        }
        self.special_delta_delta()
    }

    /// Does the same for words that are not both data characters.
    #[cold]
    const fn special_delta_delta(self) -> Result<DeltaDelta, Error> {
        let [high, low] = self.acceleration_words();
        let (high_byte, low_byte) = match (high.byte(), low.byte()) {
            (Ok(high), Ok(low)) => (high, low),
            (Err(e), _) | (_, Err(e)) => return Err(e),
        };
        if high.is(Control::K29_7) && low.is(Control::K29_7) {
            return Err(Error::EncoderError);
        }
        if self.is_strict() && (high.is_special() || low.is_special()) {
            return Err(Error::WrongKind { byte: if high.is_special() { high_byte } else { low_byte } });
        }
        DeltaDelta::from_bytes([high_byte, low_byte])
    }
}

/// Returns the answer as its words in line order.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl serde::Serialize for Answer {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

// The six words in line order: `D1.2 D6.0 K30.7 D0.0 D0.0 D16.5`.
servowire_core::one_line!(Answer {
    answer => "{} {} {} {} {} {}",
        answer.vertical(), answer.parameter_word(), answer.pipe(),
        answer.acceleration_words()[0], answer.acceleration_words()[1], answer.secondary();
});

/// Returns the words of an answer as bits, in line order.
pub(crate) const VERTICAL: u8 = 1;
pub(crate) const PARAMETER: u8 = 1 << 1;
pub(crate) const PIPE: u8 = 1 << 2;
pub(crate) const ACCELERATION: u8 = 1 << 3 | 1 << 4;
pub(crate) const SECONDARY: u8 = 1 << 5;

/// The words that are bad, and the other words that are special characters without a meaning in their channel. (In the pipe and
/// secondary channels all special characters have one.)
pub(crate) struct BadWords {
    pub(crate) bad: u8,
    pub(crate) special: u8,
}

impl BadWords {
    const NONE: Self = Self { bad: 0, special: 0 };

    const fn with(mut self, word: u8, entry: Entry, known: Option<Control>) -> Self {
        if entry.is_byte_error() {
            self.bad |= word;
        } else if !entry.is_data() {
            let known = match known {
                Some(known) => entry.raw() == known as u8,
                None => false,
            };
            if !known {
                self.special |= word;
            }
        }
        self
    }
}

/// The contents that an encoder puts into an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Content {
    /// Byte of the V-frame.
    pub vertical: Character,
    /// Parameter byte.
    pub parameter: EncoderByte,
    /// SensorHub data; K30.7 means that there are none.
    pub pipe: Character,
    /// The acceleration word, high byte first; `None` is sent as K29.7 K29.7.
    pub acceleration: Option<DeltaDelta>,
    /// Byte of safe channel 2.
    pub secondary: Character,
}

/// An answer as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EncodedAnswer {
    /// The 61 line bits, the first in bit 0.
    pub bits: u64,
    /// The running disparity after the answer.
    pub disparity: RunningDisparity,
}

impl Content {
    /// Encodes the answer as it is sent. The switch bit is not counted in the running disparity.
    ///
    /// ```
    /// use hdsl::symbol::{Character, Control, Rule, RunningDisparity};
    /// use hdsl::{Answer, Content, DeltaDelta, EncoderByte, EncoderSymbol};
    ///
    /// let content = Content {
    ///     vertical: Character::data(0x42),
    ///     parameter: EncoderByte::of(EncoderSymbol::Idle),
    ///     pipe: Character::control(Control::K30_7),
    ///     acceleration: DeltaDelta::new(-3),
    ///     secondary: Character::data(0x17),
    /// };
    /// let bits = content.emit(RunningDisparity::Minus).bits;
    /// let answer = Answer::from_bits(Rule::Strict, bits);
    /// assert_eq!(answer.vertical().byte(), Ok(0x42));
    /// assert_eq!(answer.delta_delta(), Ok(DeltaDelta::new(-3).unwrap()));
    /// ```
    pub fn emit(self, rd: RunningDisparity) -> EncodedAnswer {
        let acceleration = match self.acceleration {
            Some(value) => value.to_word().to_be_bytes().map(Character::data),
            None => [Character::control(Control::K29_7); 2],
        };
        let parameter = Character::data(self.parameter.raw());
        emit([self.vertical, parameter, self.pipe, acceleration[0], acceleration[1], self.secondary], rd)
    }
}

/// Returns ten bits of the line, starting with the lowest.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "ten bits are taken")]
const fn word(line: u64) -> Word {
    Word::truncate(line as u16 & 0x3ff)
}

/// Encodes six characters as an answer.
pub(crate) fn emit(characters: [Character; 6], rd: RunningDisparity) -> EncodedAnswer {
    let (mut bits, mut rd) = (0_u64, rd);
    for (k, character) in (0_u32..).zip(characters) {
        let coded = character.encode(rd);
        let at = k.wrapping_mul(Word::BITS).wrapping_add(u32::from(k == 5));
        bits |= u64::from(coded.word.get()) << at;
        rd = coded.disparity;
    }
    EncodedAnswer { bits: bits | (!bits >> 49 & 1) << 50, disparity: rd }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::parameter::EncoderSymbol;
    use proptest::prelude::*;
    use std::string::ToString;

    pub(crate) fn characters() -> impl Strategy<Value = Character> {
        prop_oneof![
            4 => any::<u8>().prop_map(Character::data),
            1 => (0..12usize).prop_map(|k| Character::control(Control::ALL[k])),
        ]
    }

    pub(crate) fn contents() -> impl Strategy<Value = Content> {
        (characters(), any::<u8>(), characters(), prop::option::of(-1024..=1023_i16), characters()).prop_map(
            |(vertical, parameter, pipe, dd, secondary)| Content {
                vertical,
                parameter: EncoderByte::new(parameter),
                pipe,
                acceleration: dd.map(|dd| DeltaDelta::new(dd).unwrap()),
                secondary,
            },
        )
    }

    fn column(plus: bool) -> RunningDisparity {
        if plus { RunningDisparity::Plus } else { RunningDisparity::Minus }
    }

    /// D0.0 is 100111 0100 or 011000 1011, K30.7 is 011110 1000 or 100001 0111; no character is ten ones.
    #[test]
    fn an_answer_is_printed_word_by_word() {
        let bits = |text: &str| text.bytes().rev().fold(0_u64, |bits, c| bits << 1 | u64::from(c == b'1'));
        let line =
            bits("1001110100 0110001011 0111101000 1001110100 1111111111 0 1000010111".replace(' ', "").as_str());
        let answer = Answer::from_bits(Rule::Strict, line);
        assert_eq!(answer.to_string(), "D0.0 D0.0 K30.7 D0.0 ?1111111111 K30.7");
    }

    proptest! {
        #[test]
        fn answers_come_back(content in contents(), plus: bool) {
            let bits = content.emit(column(plus)).bits;
            let answer = Answer::from_bits(Rule::Strict, bits);
            let is = |r: Reading, c: Character| r.word().decode() == Some(c) && r.byte() == Ok(c.byte());
            prop_assert!(is(answer.vertical(), content.vertical) && is(answer.pipe(), content.pipe));
            prop_assert!(is(answer.secondary(), content.secondary) && answer.switch_ok());
            prop_assert_eq!(answer.parameter(), Ok(content.parameter));
            prop_assert_eq!(answer.delta_delta(), content.acceleration.ok_or(Error::EncoderError));
            // The reduced rule gives the same values, control characters of column RD+ outside the secondary aside.
            let reduced = Answer::from_bits(Rule::Reduced, bits);
            prop_assert_eq!(reduced.secondary().raw(), content.secondary.byte());
            prop_assert_eq!(reduced.parameter(), Ok(content.parameter));
        }

        /// Compares the fast code with one that takes the answer apart bit by bit.
        #[test]
        fn any_bits_against_a_slow_reader(bits: u64) {
            let answer = Answer::from_bits(Rule::Strict, bits);
            for (k, reading) in answer.words().into_iter().enumerate() {
                let from = if k == 5 { 51 } else { 10 * k };
                let word = (0..10).fold(0, |w, i| w | ((bits >> (from + i) & 1) as u16) << i);
                prop_assert_eq!(reading, Word::new(word).unwrap().read(Rule::Strict));
            }
            prop_assert_eq!(answer.switch_ok(), bits >> 49 & 1 != bits >> 50 & 1);
        }

        /// One flipped bit makes its own word bad and no other, or turns that word into another good word.
        #[test]
        fn a_flip_stays_in_its_word(content in contents(), plus: bool, at in 0..61_u32) {
            let bits = content.emit(column(plus)).bits;
            let (good, bad) = (Answer::from_bits(Rule::Strict, bits), Answer::from_bits(Rule::Strict, bits ^ 1 << at));
            let differ = good.words().iter().zip(bad.words()).filter(|(a, b)| *a != b).count();
            prop_assert_eq!(differ, usize::from(at != 50));
            prop_assert_eq!(bad.switch_ok(), !matches!(at, 49 | 50));
            if matches!(at, 30..50) && content.acceleration.is_some() {
                prop_assert!(bad.delta_delta().is_err());
            }
        }
    }

    /// An answer is silent if none of its words can be read. The mark is two K29.7; a single one is a special character like
    /// any other.
    #[test]
    fn silence_and_marks() {
        let content = Content {
            vertical: Character::data(0x42),
            parameter: EncoderByte::of(EncoderSymbol::Idle),
            pipe: Character::control(Control::K30_7),
            acceleration: None,
            secondary: Character::data(0x17),
        };
        let bits = content.emit(RunningDisparity::Minus).bits;
        assert!(Answer::from_bits(Rule::Strict, u64::MAX).is_silence());
        for word in [0, 10, 20, 51] {
            // Ten ones are no word; all others are there, or all others are missing.
            let one = Answer::from_bits(Rule::Strict, bits | 0x3ff << word);
            let others = Answer::from_bits(Rule::Strict, bits & 0x3ff << word | !(0x3ff << word));
            assert!(!one.is_silence() && !others.is_silence(), "{word}");
        }
        let characters = |high, low| {
            let words = [Character::data(0), Character::data(0x10), Character::data(0), high, low, Character::data(0)];
            emit(words, RunningDisparity::Minus).bits
        };
        let [mark, k28] = [Control::K29_7, Control::K28_0].map(Character::control);
        for (high, low, strict) in [
            (mark, mark, Error::EncoderError),
            (mark, Character::data(3), Error::WrongKind { byte: 0xfd }),
            (Character::data(3), mark, Error::WrongKind { byte: 0xfd }),
            (k28, Character::data(3), Error::WrongKind { byte: 0x1c }),
            (k28, k28, Error::WrongKind { byte: 0x1c }),
        ] {
            let bits = characters(high, low);
            assert_eq!(Answer::from_bits(Rule::Strict, bits).delta_delta(), Err(strict));
            // By value in the firmware, whatever kind they are: the check bits are wrong here.
            let reduced = Answer::from_bits(Rule::Reduced, bits).delta_delta();
            let told = matches!(reduced, Err(Error::AccelerationCrc { .. }));
            assert!(told || strict == Error::EncoderError && reduced == Err(Error::EncoderError), "{reduced:?}");
        }
    }

    /// All second differences in both columns, with every single line bit flipped: if only data characters are accepted, every
    /// flip is detected; if words are taken by their values, 240 pass, 64 of them with a wrong value.
    #[test]
    fn single_flips_of_the_acceleration() {
        let (mut by_value, mut wrong) = (0, 0);
        for dd in (-1024..=1023).step_by(crate::thin(397)) {
            for rd in [RunningDisparity::Minus, RunningDisparity::Plus] {
                let content = Content {
                    vertical: Character::data(0),
                    parameter: EncoderByte::of(EncoderSymbol::Idle),
                    pipe: Character::control(Control::K30_7),
                    acceleration: DeltaDelta::new(dd),
                    secondary: Character::data(0),
                };
                let bits = content.emit(rd).bits;
                for at in 30..50 {
                    let answer = Answer::from_bits(Rule::Strict, bits ^ 1 << at);
                    assert!(answer.delta_delta().is_err());
                    let [high, low] = answer.acceleration_words();
                    let value = DeltaDelta::from_word(u16::from_be_bytes([high.raw(), low.raw()]));
                    if !high.is_byte_error() && !low.is_byte_error() && value.is_ok() {
                        by_value += 1;
                        wrong += u32::from(value != Ok(DeltaDelta::new(dd).unwrap()));
                    }
                }
            }
        }
        if !cfg!(miri) {
            assert_eq!((by_value, wrong), (240, 64));
        }
    }

    #[test]
    fn truncations() {
        for len in 0..61 {
            let line = Window::from_bits(u128::MAX, len).unwrap();
            assert_eq!(Answer::parse(Rule::Strict, line), Err(Error::Truncated { got: len as u16, want: 61 }));
        }
        let line = Window::from_bits(u128::MAX, 61).unwrap();
        assert!(Answer::parse(Rule::Strict, line).unwrap().vertical().is_byte_error());
        assert_eq!(EncoderSymbol::Idle.code(), 0x10);
    }
}
