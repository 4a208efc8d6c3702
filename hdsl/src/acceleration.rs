use servowire_core::OutOfRange;

use crate::crc::{crc5, is_crc5_right};
use crate::error::Error;

/// The second difference of the position between sampling instants, 11 bits in two's complement: -1024..=1023 steps.
///
/// ```text
///  acceleration word   15 ............. 5   4 ... 0
///                        ΔΔ, 11 bits         CRC-5
/// ```
///
/// The line carries the two bytes as 8b/10b words, high byte first. It is a difference of positions between H-frames. In sync
/// mode these have different lengths, so the value is not proportional to any physical acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "i16", into = "i16"))]
pub struct DeltaDelta(i16);

impl DeltaDelta {
    /// 1023.
    pub const MAX: Self = Self(1023);
    /// -1024.
    pub const MIN: Self = Self(-1024);
    /// The acceleration 0: no change of speed.
    pub const ZERO: Self = Self(0);

    /// Creates an acceleration; `None` outside -1024..=1023.
    pub const fn new(value: i16) -> Option<Self> {
        if value < Self::MIN.0 || value > Self::MAX.0 { None } else { Some(Self(value)) }
    }

    /// Returns the nearest value in range.
    #[expect(clippy::cast_possible_truncation, reason = "within 11 bits after the comparison")]
    pub const fn clamp(value: i64) -> Self {
        if value < Self::MIN.0 as i64 {
            Self::MIN
        } else if value > Self::MAX.0 as i64 {
            Self::MAX
        } else {
            Self(value as i16)
        }
    }

    /// The value.
    pub const fn get(self) -> i16 {
        self.0
    }

    /// The 16-bit word with its CRC.
    ///
    /// ```
    /// use hdsl::DeltaDelta;
    /// assert_eq!(DeltaDelta::new(-5).map(DeltaDelta::to_word), Some(0xff61));
    /// ```
    pub const fn to_word(self) -> u16 {
        let value = u16::from_le_bytes(self.0.to_le_bytes()) & 0x7ff;
        value << 5 | crc5(value) as u16
    }

    /// Extracts the value from a word.
    ///
    /// # Errors
    /// [`Error::AccelerationCrc`].
    #[inline]
    pub const fn from_word(word: u16) -> Result<Self, Error> {
        Self::from_bytes(word.to_be_bytes())
    }

    /// Extracts the value from the two bytes, the high one first.
    #[inline]
    pub(crate) const fn from_bytes(bytes: [u8; 2]) -> Result<Self, Error> {
        if is_crc5_right(bytes) {
            return Ok(Self(i16::from_be_bytes(bytes) >> 5));
        }
        Err(wrong_check(u16::from_be_bytes(bytes)))
    }
}

#[cold]
const fn wrong_check(word: u16) -> Error {
    let [low, _] = word.to_le_bytes();
    Error::AccelerationCrc { got: low & 0x1f, want: crc5(word >> 5) }
}

impl TryFrom<i16> for DeltaDelta {
    type Error = OutOfRange;

    fn try_from(value: i16) -> Result<Self, OutOfRange> {
        let max = if value < 0 { Self::MIN } else { Self::MAX };
        Self::new(value).ok_or(OutOfRange { got: value.into(), max: max.0.into() })
    }
}

servowire_core::one_line!(DeltaDelta {
    Self(value) => "{}", value;
});

impl From<DeltaDelta> for i16 {
    fn from(value: DeltaDelta) -> Self {
        value.0
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for DeltaDelta {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(i16::arbitrary(from)? >> 5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_comes_back_and_every_word_is_canonical() {
        let mut good = 0;
        for word in (0..=u16::MAX).step_by(crate::thin(31)) {
            if let Ok(value) = DeltaDelta::from_word(word) {
                assert_eq!(value.to_word(), word);
                good += 1;
            }
        }
        assert!(cfg!(miri) || good == 2048);
        for (value, word) in [(0, 0x001f), (1, 0x003a), (-1, 0xfff5), (-5, 0xff61), (1023, 0x7fea), (-1024, 0x8000)] {
            assert_eq!(DeltaDelta::new(value).unwrap().to_word(), word);
        }
        assert_eq!((DeltaDelta::new(1024), DeltaDelta::new(-1025)), (None, None));
        assert_eq!((DeltaDelta::clamp(5000), DeltaDelta::clamp(-5000)), (DeltaDelta::MAX, DeltaDelta::MIN));
        assert_eq!(DeltaDelta::try_from(1024), Err(OutOfRange { got: 1024, max: 1023 }));
        assert_eq!(DeltaDelta::try_from(-1025), Err(OutOfRange { got: -1025, max: -1024 }));
        // FF61h is -5.
        assert_eq!(DeltaDelta::from_word(0xff66), Err(Error::AccelerationCrc { got: 0x06, want: 0x01 }));
    }

    /// One and two wrong bits are always seen; 19 of the 560 triples are not.
    #[test]
    fn what_the_check_bits_see() {
        let good = DeltaDelta::ZERO.to_word();
        let mut passed = 0;
        for a in 0..16 {
            for b in a..16 {
                for c in b..16 {
                    let flip = 1_u16 << a | 1 << b | 1 << c;
                    let ok = DeltaDelta::from_word(good ^ flip).is_ok();
                    assert!(!ok || flip.count_ones() == 3);
                    passed += u32::from(ok);
                }
            }
        }
        assert_eq!(passed, 19);
        assert!(DeltaDelta::from_word(0xfdfd).is_err());
    }
}
