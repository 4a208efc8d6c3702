use crate::answer::{Answer, EncodedAnswer, emit};
use crate::error::Error;
use crate::ranged::ranged;
use crate::symbol::{Character, RunningDisparity};

servowire_core::number! {
/// The encoder identifier ENC_ID, 20 bits (SICK manual, p. 44).
///
/// ```text
///  bit  19         18:16      15:12        11         10       9:4                      3:0
///       continue | reserved | user index | reserved | sign  | position bits - acc bits | acc bits - 8
/// ```
///
/// The sign bit is 1 for a signed position; the register list of the Motor Control SDK prints the opposite.
pub struct EncoderId(u32, 20);
}

impl EncoderId {
    /// Width of the acceleration value, 8..=23 bits.
    const fn acceleration_bits(self) -> u8 {
        (self.byte(0) & 15).wrapping_add(8)
    }

    /// Width of the position, 8..=86 bits as coded; see [`PositionBits`] for what is supported.
    pub const fn position_bits(self) -> u8 {
        let [low, high, ..] = self.get().to_le_bytes();
        let more = low >> 4 | (high & 3) << 4;
        self.acceleration_bits().wrapping_add(more)
    }

    /// Returns a position of this encoder as a number: without the unused high bits of `raw`, and sign-extended if the
    /// positions are signed.
    pub const fn position(self, raw: u64) -> i64 {
        let unused = 64_u8.saturating_sub(self.position_bits()) as u32;
        let shifted = raw.wrapping_shl(unused);
        let signed = i64::from_le_bytes(shifted.to_le_bytes()).wrapping_shr(unused);
        if self.is_signed() { signed } else { i64::from_le_bytes(shifted.wrapping_shr(unused).to_le_bytes()) }
    }

    /// Returns whether the position is signed.
    pub const fn is_signed(self) -> bool {
        self.get() >> 10 & 1 == 1
    }

    /// The user-defined index, 0..=15.
    pub const fn user_index(self) -> u8 {
        self.byte(1) >> 4
    }

    /// Returns whether the identifier is longer than 20 bits.
    const fn continues(self) -> bool {
        self.get() >> 19 & 1 == 1
    }

    const fn byte(self, at: usize) -> u8 {
        let [low, middle, high, _] = self.get().to_le_bytes();
        match at {
            0 => low,
            1 => middle,
            _ => high,
        }
    }

    /// Returns the width of the position, if this receiver supports the encoder: acceleration of 11 bits, position of 11..=40
    /// bits (an identifier says how many more than the acceleration has), no continuation.
    ///
    /// # Errors
    /// [`Error::UnsupportedEncoder`].
    pub const fn check(self) -> Result<PositionBits, Error> {
        let refuse = Error::UnsupportedEncoder { id: self.get() };
        if self.acceleration_bits() != 11 || self.continues() {
            return Err(refuse);
        }
        match PositionBits::new(self.position_bits()) {
            Some(bits) => Ok(bits),
            None => Err(refuse),
        }
    }

    /// Extracts the identifier from the answer to IDREQ, which carries it twice.
    ///
    /// ```text
    ///  vertical   parameter   pipe                  acc high   acc low
    ///  ID 7:0     ID 15:8     ID 19:16, ID 19:16    ID 15:8    ID 7:0
    /// ```
    ///
    /// There are no check bits. A line that is inverted for this one frame yields a different identifier with both copies equal,
    /// so an application that knows its encoder should compare it.
    ///
    /// # Errors
    /// [`Error::InvalidWord`] if one of these five words is in no table, by [`Rule::Strict`](crate::Rule::Strict) only;
    /// [`Error::EncoderIdMismatch`] if the two copies differ.
    pub fn from_answer(answer: Answer) -> Result<Self, Error> {
        if answer.is_strict() {
            for word in answer.words().into_iter().take(5) {
                word.byte()?;
            }
        }
        let [vertical, parameter, pipe, high, low, _] = answer.words().map(|word| u32::from(word.raw()));
        let first = vertical | parameter << 8 | pipe >> 4 << 16;
        let second = low | high << 8 | (pipe & 15) << 16;
        if first != second {
            return Err(Error::EncoderIdMismatch { first, second });
        }
        Ok(Self::truncate(second))
    }

    /// Creates the answer to IDREQ. The secondary word is not used; the caller may fill it.
    ///
    /// ```
    /// use hdsl::symbol::{Character, RunningDisparity};
    /// use hdsl::{Answer, EncoderId, Rule};
    /// let id = EncoderId::try_from(0x00153)?;
    /// let bits = id.to_answer(Character::data(0), RunningDisparity::Minus).bits;
    /// assert_eq!(EncoderId::from_answer(Answer::from_bits(Rule::Strict, bits)), Ok(id));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_answer(self, secondary: Character, rd: RunningDisparity) -> EncodedAnswer {
        let [low, middle, high, _] = self.get().to_le_bytes().map(Character::data);
        let pipe = Character::data(high.byte() << 4 | high.byte());
        emit([low, middle, pipe, middle, low, secondary], rd)
    }
}

ranged! {
    /// Width of the position, 8..=40 bits.
    pub struct PositionBits(8..=40);
}

impl PositionBits {
    /// A mask of this width.
    pub const fn mask(self) -> u64 {
        match 1_u64.checked_shl(self.0 as u32) {
            Some(one) => one.wrapping_sub(1),
            None => u64::MAX,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbol::Rule;

    #[test]
    fn the_documented_widths() {
        for (id, bits) in [(0x00153, 32), (0x00133, 30), (0x000d3, 24)] {
            let id = EncoderId::new(id).unwrap();
            assert_eq!((id.acceleration_bits(), id.check()), (11, Ok(PositionBits::new(bits).unwrap())));
        }
        for low in 0..16 {
            assert_eq!(EncoderId::new(low).unwrap().acceleration_bits(), 8 + low as u8);
        }
        let indexed = EncoderId::new(0x0b153).unwrap();
        assert_eq!((indexed.user_index(), indexed.check()), (11, Ok(PositionBits::new(32).unwrap())));
        for refused in [0x00150, 0x80153, 0x001e3] {
            assert_eq!(EncoderId::new(refused).unwrap().check(), Err(Error::UnsupportedEncoder { id: refused }));
        }
        assert_eq!((PositionBits::new(40).unwrap().mask(), PositionBits::MIN.mask()), (0xff_ffff_ffff, 0xff));
    }

    /// Every identifier comes back; a flip of a line bit is seen unless it is in the pipe word, the only one that
    /// carries both copies.
    #[test]
    fn answers() {
        for raw in (0..1 << 20).step_by(97 * crate::thin(397)) {
            let id = EncoderId::new(raw).unwrap();
            let bits = id.to_answer(Character::data(0), RunningDisparity::Plus).bits;
            let read = |bits| EncoderId::from_answer(Answer::from_bits(Rule::Strict, bits));
            assert_eq!(read(bits), Ok(id));
            for at in 0..50 {
                if let Ok(other) = read(bits ^ 1 << at) {
                    assert!(other == id || matches!(at, 20..30) && (other.get() ^ raw) & 0xffff == 0);
                }
            }
        }
    }
}
