use crate::{Error, U24};

/// The data widths of an encoder, as data: what the wire does not say.
///
/// ```text
///  ABS  |23 ... abs_bits| abs_bits-1 ... 0|      upper bits 0, position in the turn
///  ABM  |23 ... abm_bits| abm_bits-1 ... 0|      upper bits 0, turns, as two's complement if signed
/// ```
///
/// The check field does not protect against a wrong width; the upper bits do, so a set one is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Widths", into = "Widths")
)]
pub struct Profile {
    abs_bits: u8,
    abm_bits: u8,
    signed_turns: bool,
    checks_upper_bits: bool,
}

/// Widths that no encoder can have: ABS has 1 to 24 bits, ABM 0 to 24.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{abs_bits} single-turn and {abm_bits} multi-turn bits: 1 to 24 and 0 to 24 are possible")]
pub struct WidthError {
    /// Single-turn bits asked for.
    pub abs_bits: u8,
    /// Multi-turn bits asked for.
    pub abm_bits: u8,
}

/// What an encoder ID suggests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hint {
    /// The widths.
    pub profile: Profile,
    /// Whether a document or a log of a real encoder shows this ID with these widths; otherwise they follow from
    /// the rule that all known IDs obey.
    pub documented: bool,
}

/// Where the shaft is, in the units of a [`Profile`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Position {
    /// Counts in the turn, 0..2^abs_bits.
    pub abs: u32,
    /// Turns: 0..2^abm_bits, or -2^(abm_bits-1)..2^(abm_bits-1) if they are signed.
    pub turns: i32,
    /// turns * 2^abs_bits + abs, in counts; at most 48 bits wide.
    pub combined: i64,
}

impl Profile {
    /// Widths of ABS (1..=24) and ABM (0..=24); turns are signed, upper bits are checked.
    ///
    /// # Errors
    /// [`WidthError`] for other widths.
    pub const fn new(abs_bits: u8, abm_bits: u8) -> Result<Self, WidthError> {
        if abs_bits == 0 || abs_bits > 24 || abm_bits > 24 {
            return Err(WidthError { abs_bits, abm_bits });
        }
        Ok(Self { abs_bits, abm_bits, signed_turns: true, checks_upper_bits: true })
    }

    /// The same with turns counted from 0 up.
    pub const fn unsigned_turns(self) -> Self {
        Self { signed_turns: false, ..self }
    }

    /// The same for an encoder that puts something else into the upper bits: they are cut off, not checked.
    pub const fn ignoring_upper_bits(self) -> Self {
        Self { checks_upper_bits: false, ..self }
    }

    /// What ENID suggests. In all known cases it is the number of single-turn bits.
    ///
    /// | ENID | ABS | ABM | known from |
    /// |------|-----|-----|------------|
    /// | 0x0b | 11 | 13 | drive firmware |
    /// | 0x11 | 17 | 16 | drive firmware, descriptions of 17-bit types |
    /// | 0x15 | 21 | 0 | a compatible encoder |
    /// | 0x17 | 23 | 16 | drive firmware, log of a TS5700N8401 |
    /// | 0x14 | 20 | 16 | not documented: the same rule |
    /// | 0x18 | 24 | 16 | not documented: the same rule |
    ///
    /// `None` for all others. A model name says nothing: TIDM-1011 gives the TS5700N8501 24 bits, a motor
    /// controller in wide use 17.
    pub const fn from_enid(enid: u8) -> Option<Hint> {
        let (abm_bits, documented) = match enid {
            0x0b => (13, true),
            0x11 | 0x17 => (16, true),
            0x15 => (0, true),
            0x14 | 0x18 => (16, false),
            _ => return None,
        };
        match Self::new(enid, abm_bits) {
            Ok(profile) => Some(Hint { profile, documented }),
            Err(_) => None,
        }
    }

    /// Single-turn bits, 1..=24.
    pub const fn abs_bits(self) -> u8 {
        self.abs_bits
    }

    /// Multi-turn bits, 0..=24.
    pub const fn abm_bits(self) -> u8 {
        self.abm_bits
    }

    /// Whether turns are two's complement.
    pub const fn has_signed_turns(self) -> bool {
        self.signed_turns
    }

    /// Counts in a turn.
    pub const fn counts_per_turn(self) -> u32 {
        1_u32.wrapping_shl(self.abs_bits as u32)
    }

    /// The single-turn position in counts.
    ///
    /// # Errors
    /// [`Error::UpperBits`].
    pub const fn single_turn(self, abs: U24) -> Result<u32, Error> {
        self.within(abs, self.abs_bits)
    }

    /// The number of turns.
    ///
    /// # Errors
    /// [`Error::UpperBits`].
    #[expect(clippy::cast_possible_wrap, reason = "24 bits fit")]
    pub const fn turns(self, abm: U24) -> Result<i32, Error> {
        match self.within(abm, self.abm_bits) {
            Ok(turns) if self.signed_turns => Ok(sign_extend(turns, self.abm_bits)),
            Ok(turns) => Ok(turns as i32),
            Err(error) => Err(error),
        }
    }

    /// Both parts as one position.
    ///
    /// # Errors
    /// [`Error::UpperBits`] of ABS, then of ABM.
    pub const fn position(self, abs: U24, abm: U24) -> Result<Position, Error> {
        match (self.single_turn(abs), self.turns(abm)) {
            (Ok(abs), Ok(turns)) => {
                let combined = (turns as i64).wrapping_shl(self.abs_bits as u32) | abs as i64;
                Ok(Position { abs, turns, combined })
            }
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    /// The single-turn position as a fraction of a turn: 2^32 is a whole one.
    ///
    /// # Errors
    /// [`Error::UpperBits`].
    pub const fn fraction(self, abs: U24) -> Result<u32, Error> {
        match self.single_turn(abs) {
            Ok(counts) => Ok(counts.wrapping_shl(32_u32.wrapping_sub(self.abs_bits as u32))),
            Err(error) => Err(error),
        }
    }

    /// The shorter way from one single-turn position to another in counts, over the zero point if need be:
    /// -2^(abs_bits-1)..2^(abs_bits-1).
    pub const fn difference(self, from: u32, to: u32) -> i32 {
        sign_extend(to.wrapping_sub(from), self.abs_bits)
    }

    const fn within(self, field: U24, bits: u8) -> Result<u32, Error> {
        let value = field.get();
        let mask = 1_u32.wrapping_shl(bits as u32).wrapping_sub(1);
        let excess = value & !mask;
        if excess != 0 && self.checks_upper_bits {
            return Err(Error::UpperBits { value, excess });
        }
        Ok(value & mask)
    }
}

/// The low `bits` (0..=24) of `value` as two's complement.
#[expect(clippy::cast_possible_wrap, reason = "the wrap is the sign")]
const fn sign_extend(value: u32, bits: u8) -> i32 {
    if bits == 0 {
        return 0;
    }
    let unused = 32_u32.wrapping_sub(bits as u32);
    (value.wrapping_shl(unused) as i32).wrapping_shr(unused)
}

/// A profile as it is written down.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Widths {
    abs_bits: u8,
    abm_bits: u8,
    signed_turns: bool,
    checks_upper_bits: bool,
}

#[cfg(feature = "serde")]
impl TryFrom<Widths> for Profile {
    type Error = WidthError;

    fn try_from(w: Widths) -> Result<Self, WidthError> {
        Self::new(w.abs_bits, w.abm_bits).map(|profile| Self {
            signed_turns: w.signed_turns,
            checks_upper_bits: w.checks_upper_bits,
            ..profile
        })
    }
}

#[cfg(feature = "serde")]
impl From<Profile> for Widths {
    fn from(p: Profile) -> Self {
        let Profile { abs_bits, abm_bits, signed_turns, checks_upper_bits } = p;
        Self { abs_bits, abm_bits, signed_turns, checks_upper_bits }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const P17: Profile = match Profile::new(17, 16) {
        Ok(profile) => profile,
        Err(_) => panic!(),
    };

    fn u24(value: u32) -> U24 {
        U24::new(value).unwrap()
    }

    #[test]
    fn position_of_a_17_bit_encoder() {
        let position = P17.position(u24(131_071), u24(0xffff)).unwrap();
        assert_eq!(position, Position { abs: 131_071, turns: -1, combined: -1 });
        let unsigned = P17.unsigned_turns().position(u24(131_071), u24(0xffff)).unwrap();
        assert_eq!((unsigned.turns, unsigned.combined), (65_535, 8_589_934_591));
        assert_eq!(P17.fraction(u24(65_536)), Ok(1 << 31));
    }

    #[test]
    fn upper_bits_are_refused_or_cut_off() {
        assert_eq!(P17.single_turn(u24(0x2_0001)), Err(Error::UpperBits { value: 0x2_0001, excess: 0x2_0000 }));
        assert_eq!(P17.turns(u24(0x1_0000)), Err(Error::UpperBits { value: 0x1_0000, excess: 0x1_0000 }));
        assert_eq!(P17.ignoring_upper_bits().single_turn(u24(0x2_0001)), Ok(1));
        let single = Profile::new(21, 0).unwrap();
        assert_eq!(single.turns(u24(0)), Ok(0));
        assert!(single.turns(u24(1)).is_err());
    }

    #[test]
    fn every_width_is_taken_or_refused() {
        for abs_bits in 0..=255 {
            for abm_bits in 0..=255 {
                let possible = (1..=24).contains(&abs_bits) && abm_bits <= 24;
                assert_eq!(Profile::new(abs_bits, abm_bits).is_ok(), possible);
            }
        }
    }

    #[test]
    fn hints_follow_the_number_of_bits() {
        for enid in 0..=255 {
            let hint = Profile::from_enid(enid);
            assert_eq!(hint.is_some(), [11, 17, 20, 21, 23, 24].contains(&enid));
            if let Some(hint) = hint {
                assert_eq!(hint.profile.abs_bits(), enid);
                assert_eq!(hint.documented, enid != 20 && enid != 24);
            }
        }
    }

    proptest! {
        #[test]
        fn combined_is_turns_and_counts(abs_bits in 1..=24_u8, abm_bits in 0..=24_u8, abs: u32, abm: u32, signed: bool) {
            let profile = Profile::new(abs_bits, abm_bits).unwrap();
            let profile = if signed { profile } else { profile.unsigned_turns() };
            let (abs, abm) = (abs & ((1 << abs_bits) - 1), abm & ((1 << abm_bits) - 1));
            let position = profile.position(u24(abs), u24(abm)).unwrap();
            let full = 1_i64 << abm_bits;
            let turns = if signed && i64::from(abm) * 2 >= full && abm_bits > 0 { i64::from(abm) - full } else { i64::from(abm) };
            prop_assert_eq!(i64::from(position.turns), turns);
            prop_assert_eq!(position.combined, turns * (1 << abs_bits) + i64::from(abs));
        }

        #[test]
        fn difference_wraps(abs_bits in 1..=24_u8, from: u32, to: u32) {
            let profile = Profile::new(abs_bits, 0).unwrap();
            let turn = 1_i64 << abs_bits;
            let d = i64::from(profile.difference(from, to));
            prop_assert!(-turn / 2 <= d && d < (turn + 1) / 2);
            prop_assert_eq!((i64::from(to) - i64::from(from) - d).rem_euclid(turn), 0);
        }
    }
}
