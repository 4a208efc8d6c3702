use crate::{Error, U40, Version};

/// What the line does not say about an encoder: its widths, its version and its factory settings.
///
/// ```text
///  abs   |39 ... st + mt| st + mt - 1 ... st | st - 1 ... 0 |
///         unused, 0       turns                single turn
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Written", into = "Written")
)]
pub struct Profile {
    st_bits: u8,
    mt_bits: u8,
    version: Version,
    low_with_velocity: bool,
    resets_with_position: bool,
}

/// Widths that no encoder can have: 1 to 32 single-turn bits, at most 16 bits of turns, at most 40 together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error(
    "{st_bits} single-turn bits and {mt_bits} bits of turns: 1 to 32 and 0 to 32, together at most 40, are possible"
)]
pub struct WidthError {
    /// Single-turn bits asked for.
    pub st_bits: u8,
    /// Bits of turns asked for.
    pub mt_bits: u8,
}

/// Where the shaft is, in the units of a [`Profile`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Position {
    /// Counts in the turn.
    pub single_turn: u32,
    /// Turns, from 0 up, as far as the reply shows them.
    pub turns: u32,
    /// How many bits of the turns the reply shows: all, fewer in 24 bits, none in 17.
    pub turns_bits: u8,
}

impl Position {
    /// The turns as a signed number, if all 16 bits of them are there: -32768..=32767. Beyond, the counter wraps round and
    /// OVFLOW is raised.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "16 bits, and the wrap is the sign"
    )]
    pub const fn signed_turns(self) -> Option<i16> {
        if self.turns_bits == 16 { Some(self.turns as u16 as i16) } else { None }
    }
}

impl Default for Profile {
    /// 20 + 16 bits, version 3.0, replies as in version 2.1.
    fn default() -> Self {
        Self { st_bits: 20, mt_bits: 16, version: Version::V3_0, low_with_velocity: false, resets_with_position: false }
    }
}

impl Profile {
    /// Widths of the single turn (encoders have 17, 20, 22 or 24 bits) and of the turns (16, or 0 without a counter), for
    /// an encoder of version 2.1.
    ///
    /// # Errors
    /// [`WidthError`] for no or more than 32 single-turn bits, more than 32 bits of turns, or more than 40 together.
    pub const fn new(st_bits: u8, mt_bits: u8) -> Result<Self, WidthError> {
        if st_bits == 0 || st_bits > 32 || mt_bits > 32 || st_bits.saturating_add(mt_bits) > 40 {
            return Err(WidthError { st_bits, mt_bits });
        }
        Ok(Self { st_bits, mt_bits, version: Version::V2_1, low_with_velocity: false, resets_with_position: false })
    }

    /// The same of another version. Factory settings of version 3.0 are dropped in version 2.1.
    pub const fn with_version(self, version: Version) -> Self {
        match version {
            Version::V2_1 => Self { version, low_with_velocity: false, resets_with_position: false, ..self },
            Version::V3_0 => Self { version, ..self },
        }
    }

    /// The same for an encoder of version 3.0 that answers commands 1 and 5 with the whole position and velocity.
    pub const fn low_with_velocity(self) -> Self {
        Self { version: Version::V3_0, low_with_velocity: true, ..self }
    }

    /// The same for an encoder of version 3.0 that answers the resets, commands 8 to 12, with its position.
    pub const fn resets_with_position(self) -> Self {
        Self { version: Version::V3_0, resets_with_position: true, ..self }
    }

    /// Single-turn bits.
    pub const fn st_bits(self) -> u8 {
        self.st_bits
    }

    /// Bits of the turns, 0 without a counter.
    pub const fn mt_bits(self) -> u8 {
        self.mt_bits
    }

    /// Version of the protocol.
    pub const fn version(self) -> Version {
        self.version
    }

    /// Whether commands 1 and 5 are answered with the whole position and velocity.
    pub const fn has_low_with_velocity(self) -> bool {
        self.low_with_velocity
    }

    /// Whether the resets are answered with the position.
    pub const fn has_resets_with_position(self) -> bool {
        self.resets_with_position
    }

    /// Counts in a turn.
    pub const fn counts_per_turn(self) -> u64 {
        1_u64.wrapping_shl(self.st_bits as u32)
    }

    /// Takes the position of a reply apart. `abs` and `abs_bits` are what the reply shows from bit 0 up, see
    /// [`Response::abs`](crate::Response::abs) and [`Layout::abs_bits`](crate::Layout::abs_bits).
    ///
    /// # Errors
    /// [`Error::NotCarried`] if the reply shows less than a whole turn, as 17 bits do of a 20-bit encoder;
    /// [`Error::UpperBits`] if bits are set above the widths of the profile.
    #[expect(clippy::cast_possible_truncation, reason = "both parts are masked to 32 bits at most")]
    pub const fn position(self, abs: u64, abs_bits: u8) -> Result<Position, Error> {
        if abs_bits < self.st_bits {
            return Err(Error::NotCarried);
        }
        let width = self.st_bits.wrapping_add(self.mt_bits);
        if width < 64 && abs >> width != 0 {
            return Err(Error::UpperBits { width });
        }
        let room = abs_bits.saturating_sub(self.st_bits);
        let turns_bits = if room < self.mt_bits { room } else { self.mt_bits };
        let single_turn = (abs & self.counts_per_turn().wrapping_sub(1)) as u32;
        let turns = (abs >> self.st_bits & 1_u64.wrapping_shl(turns_bits as u32).wrapping_sub(1)) as u32;
        Ok(Position { single_turn, turns, turns_bits })
    }

    /// The position bits of single turn and turns together.
    pub const fn compose(self, single_turn: u32, turns: u32) -> U40 {
        let single = single_turn as u64 & self.counts_per_turn().wrapping_sub(1);
        let turns = turns as u64 & 1_u64.wrapping_shl(self.mt_bits as u32).wrapping_sub(1);
        U40::truncate(single | turns.wrapping_shl(self.st_bits as u32))
    }

    /// A single-turn position as a fraction of a turn: 2^32 is a whole one.
    #[expect(clippy::cast_possible_truncation, reason = "the low 32 bits are meant")]
    pub const fn fraction(self, single_turn: u32) -> u32 {
        (single_turn as u64).wrapping_shl(32_u32.saturating_sub(self.st_bits as u32)) as u32
    }

    /// A single-turn position in thousandths of a degree, rounded down.
    #[expect(clippy::cast_possible_truncation, reason = "below 360 000")]
    pub const fn milli_degrees(self, single_turn: u32) -> u32 {
        let scaled = (single_turn as u64).wrapping_mul(360_000);
        scaled.wrapping_shr(self.st_bits as u32) as u32
    }

    /// A single-turn position in degrees.
    #[expect(clippy::cast_precision_loss, reason = "a power of two")]
    pub fn degrees(self, single_turn: u32) -> f64 {
        f64::from(single_turn) / self.counts_per_turn() as f64 * 360.0
    }

    /// A single-turn position in degrees in the arithmetic of the AM243x Motor Control SDK, bit by bit: each operand
    /// rounded to `f32`, divided, then multiplied.
    #[expect(clippy::cast_precision_loss, reason = "the loss is what is asked for")]
    pub fn degrees_f32(self, single_turn: u32) -> f32 {
        single_turn as f32 / self.counts_per_turn() as f32 * 360.0
    }

    /// The shorter way from one single-turn position to another in counts, over the zero point if need be.
    #[expect(clippy::cast_possible_wrap, reason = "the wrap is the sign")]
    pub const fn difference(self, from: u32, to: u32) -> i32 {
        let unused = 32_u32.saturating_sub(self.st_bits as u32);
        (to.wrapping_sub(from).wrapping_shl(unused) as i32).wrapping_shr(unused)
    }
}

/// EEPROM word 0xf6: what kind of encoder it is.
///
/// ```text
///  bit  15 ... 7 | 6   5      | 4   3       | 2 1 0
///       unknown  | battery    | turns       | resolution
///                | 0 none     | 0 none      | 0  17 bits
///                | 1 separate | 1 magnetic  | 1  20 bits
///                | 2 common   | 2 optical   | 2  22 bits
///                |            |             | 3  24 bits
/// ```
///
/// Known from one drive maker's firmware alone; other codes have no known meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct TypeWord(pub u16);

/// How an encoder counts turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Multiturn {
    /// Not at all.
    None,
    /// Magnetically, 16 bits.
    Magnetic,
    /// Optically, 16 bits.
    Optical,
    /// A code without known meaning.
    Unknown(u8),
}

/// How the battery is connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Battery {
    /// There is none.
    None,
    /// By a line of its own.
    Separate,
    /// By a line that several encoders share.
    Common,
    /// A code without known meaning.
    Unknown(u8),
}

impl TypeWord {
    /// Its EEPROM address.
    pub const EEPROM_ADDRESS: u8 = 0xf6;

    /// Code of the resolution, 0..=7.
    pub const fn resolution_code(self) -> u8 {
        (self.0 & 7) as u8
    }

    /// Single-turn bits; `None` for a code without known meaning.
    pub const fn st_bits(self) -> Option<u8> {
        match self.resolution_code() {
            0 => Some(17),
            1 => Some(20),
            2 => Some(22),
            3 => Some(24),
            _ => None,
        }
    }

    /// How turns are counted.
    pub const fn multiturn(self) -> Multiturn {
        match (self.0 >> 3 & 3) as u8 {
            0 => Multiturn::None,
            1 => Multiturn::Magnetic,
            2 => Multiturn::Optical,
            code => Multiturn::Unknown(code),
        }
    }

    /// Bits of the turns; `None` for a code without known meaning.
    pub const fn mt_bits(self) -> Option<u8> {
        match self.multiturn() {
            Multiturn::None => Some(0),
            Multiturn::Magnetic | Multiturn::Optical => Some(16),
            Multiturn::Unknown(_) => None,
        }
    }

    /// How the battery is connected.
    pub const fn battery(self) -> Battery {
        match (self.0 >> 5 & 3) as u8 {
            0 => Battery::None,
            1 => Battery::Separate,
            2 => Battery::Common,
            code => Battery::Unknown(code),
        }
    }

    /// The widths as a profile of version 2.1; `None` for codes without known meaning. The word does not tell the version.
    pub const fn profile(self) -> Option<Profile> {
        match (self.st_bits(), self.mt_bits()) {
            (Some(st_bits), Some(mt_bits)) => match Profile::new(st_bits, mt_bits) {
                Ok(profile) => Some(profile),
                Err(_) => None,
            },
            _ => None,
        }
    }
}

/// A profile as it is written down.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Written {
    st_bits: u8,
    mt_bits: u8,
    version: Version,
    low_with_velocity: bool,
    resets_with_position: bool,
}

#[cfg(feature = "serde")]
impl TryFrom<Written> for Profile {
    type Error = WidthError;

    fn try_from(written: Written) -> Result<Self, WidthError> {
        let profile = Self::new(written.st_bits, written.mt_bits)?.with_version(written.version);
        let profile = if written.low_with_velocity { profile.low_with_velocity() } else { profile };
        Ok(if written.resets_with_position { profile.resets_with_position() } else { profile })
    }
}

#[cfg(feature = "serde")]
impl From<Profile> for Written {
    fn from(profile: Profile) -> Self {
        let Profile { st_bits, mt_bits, version, low_with_velocity, resets_with_position } = profile;
        Self { st_bits, mt_bits, version, low_with_velocity, resets_with_position }
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for Profile {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        let st_bits = *from.choose(&[17, 20, 22, 24])?;
        let mt_bits = *from.choose(&[0, 16])?;
        let [low_with_velocity, resets_with_position] = from.arbitrary()?;
        Ok(Self { st_bits, mt_bits, version: Version::V3_0, low_with_velocity, resets_with_position })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_width_is_taken_or_refused() {
        for st_bits in 0..=255_u8 {
            for mt_bits in 0..=255_u8 {
                let possible = (1..=32).contains(&st_bits) && mt_bits <= 32 && st_bits + mt_bits <= 40;
                assert_eq!(Profile::new(st_bits, mt_bits).is_ok(), possible);
            }
        }
    }

    #[test]
    fn what_a_reply_shows() {
        let profile = Profile::new(20, 16).unwrap();
        let abs = profile.compose(0xabcde, 0x8001);
        let at = |bits: u8| profile.position(abs.get() & ((1 << bits) - 1), bits);
        assert_eq!(at(40), Ok(Position { single_turn: 0xabcde, turns: 0x8001, turns_bits: 16 }));
        assert_eq!(at(40).unwrap().signed_turns(), Some(-32_767));
        assert_eq!(at(24), Ok(Position { single_turn: 0xabcde, turns: 1, turns_bits: 4 }));
        assert_eq!(at(24).unwrap().signed_turns(), None);
        assert_eq!(at(17), Err(Error::NotCarried));
        assert_eq!(profile.position(1 << 36, 40), Err(Error::UpperBits { width: 36 }));
    }

    #[test]
    fn all_type_words() {
        for raw in 0..=u16::MAX {
            let word = TypeWord(raw);
            let known = raw & 7 < 4 && raw >> 3 & 3 < 3;
            assert_eq!(word.profile().is_some(), known);
        }
        let word = TypeWord(0b011_0001);
        assert_eq!(word.profile(), Some(Profile::new(20, 16).unwrap()));
        assert_eq!((word.multiturn(), word.battery()), (Multiturn::Optical, Battery::Separate));
    }

    proptest! {
        #[test]
        fn position_is_the_inverse_of_compose(st in 1..=24_u8, mt in 0..=16_u8, single: u32, turns: u32) {
            let profile = Profile::new(st, mt).unwrap();
            let (single, turns) = (single & ((1 << st) - 1), turns & ((1 << mt) - 1));
            let abs = profile.compose(single, turns);
            prop_assert_eq!(profile.position(abs.get(), 40), Ok(Position { single_turn: single, turns, turns_bits: mt }));
            prop_assert!(profile.milli_degrees(single) < 360_000);
            prop_assert_eq!(profile.fraction(single) >> (32 - st), single);
            prop_assert!((profile.degrees(single) * 1000.0 - f64::from(profile.milli_degrees(single))).abs() < 1.001);
        }

        #[test]
        fn difference_wraps(st in 1..=32_u8, from: u32, to: u32) {
            let profile = Profile::new(st, 0).unwrap();
            let turn = 1_i64 << st;
            let d = i64::from(profile.difference(from, to));
            prop_assert!(-turn / 2 <= d && d < (turn + 1) / 2);
            prop_assert_eq!((i64::from(to) - i64::from(from) - d).rem_euclid(turn), 0);
        }
    }
}
