use servowire_core::OutOfRange;

use crate::command::Version;
use crate::number::U40;

/// The properties of an encoder that are not transmitted: its widths, its version and its factory settings.
///
/// ```text
///  abs   |39 ... st + mt| st + mt - 1 ... st | st - 1 ... 0 |
///         unused, 0       turns                single turn
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Written", into = "Written")
)]
pub struct Resolution {
    st_bits: u8,
    mt_bits: u8,
    version: Version,
    low_with_velocity: bool,
    resets_with_position: bool,
}

impl Default for Resolution {
    /// The resolution of 20 + 16 bits, version 3.0, with responses as in version 2.1.
    fn default() -> Self {
        Self { st_bits: 20, mt_bits: 16, version: Version::V3_0, ..Self::NARROWEST }
    }
}

impl Resolution {
    const NARROWEST: Self =
        Self { st_bits: 1, mt_bits: 0, version: Version::V2_1, low_with_velocity: false, resets_with_position: false };

    /// Describes an encoder of version 2.1 by the widths of its single turn (encoders have 17, 20, 22 or 24 bits) and of its
    /// turns (16, or 0 without a counter).
    ///
    /// # Errors
    /// [`OutOfRange`] for no or more than 32 single-turn bits, more than 32 bits of turns, or more than 40 together.
    pub const fn new(st_bits: u8, mt_bits: u8) -> Result<Self, OutOfRange> {
        let (st, mt) = (st_bits as u64, mt_bits as u64);
        if st == 0 {
            return Err(OutOfRange { got: 0, max: 1 });
        }
        if st > 32 {
            return Err(OutOfRange::above(st, 32));
        }
        if mt > 32 {
            return Err(OutOfRange::above(mt, 32));
        }
        if st.saturating_add(mt) > 40 {
            return Err(OutOfRange::above(st.saturating_add(mt), 40));
        }
        Ok(Self { st_bits, mt_bits, ..Self::NARROWEST })
    }

    /// Sets another version. Factory settings of version 3.0 are dropped in version 2.1.
    pub const fn with_version(self, version: Version) -> Self {
        match version {
            Version::V2_1 => Self { version, low_with_velocity: false, resets_with_position: false, ..self },
            Version::V3_0 => Self { version, ..self },
        }
    }

    /// Sets version 3.0, with the factory setting by which commands 1 and 5 are answered with the whole position and velocity.
    pub const fn with_velocity_in_low(self) -> Self {
        Self { version: Version::V3_0, low_with_velocity: true, ..self }
    }

    /// Sets version 3.0, with the factory setting by which the resets, commands 8 to 12, are answered with the position.
    pub const fn with_position_in_resets(self) -> Self {
        Self { version: Version::V3_0, resets_with_position: true, ..self }
    }

    /// Single-turn bits.
    pub const fn st_bits(self) -> u8 {
        self.st_bits
    }

    /// Number of bits of the turns, 0 without a counter.
    pub const fn mt_bits(self) -> u8 {
        self.mt_bits
    }

    /// Version of the protocol.
    pub const fn version(self) -> Version {
        self.version
    }

    /// Returns whether commands 1 and 5 are answered with the whole position and velocity.
    pub const fn has_velocity_in_low(self) -> bool {
        self.low_with_velocity
    }

    /// Returns whether the resets are answered with the position.
    pub(crate) const fn has_position_in_resets(self) -> bool {
        self.resets_with_position
    }

    /// Counts per turn.
    pub const fn counts_per_turn(self) -> u64 {
        1_u64.wrapping_shl(self.st_bits as u32)
    }

    /// Returns the counts within the turn from position bits.
    #[expect(clippy::cast_possible_truncation, reason = "masked to 32 bits at most")]
    pub(crate) const fn single_turn(self, abs: u64) -> u32 {
        (abs & self.counts_per_turn().wrapping_sub(1)) as u32
    }

    /// Returns the turns of a whole position; their highest bit is the sign.
    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "the wrap is the sign")]
    pub(crate) const fn turns(self, abs: u64) -> i32 {
        let turns = abs.wrapping_shr(self.st_bits as u32) as u32;
        match 32_u32.checked_sub(self.mt_bits as u32) {
            None | Some(32) => 0,
            Some(unused) => (turns.wrapping_shl(unused) as i32).wrapping_shr(unused),
        }
    }

    /// Joins single turn and turns to position bits.
    pub const fn compose(self, single_turn: u32, turns: u32) -> U40 {
        let single = single_turn as u64 & self.counts_per_turn().wrapping_sub(1);
        let turns = turns as u64 & 1_u64.wrapping_shl(self.mt_bits as u32).wrapping_sub(1);
        U40::truncate(single | turns.wrapping_shl(self.st_bits as u32))
    }

    /// Converts a single-turn position to a fraction of a turn: 2^32 is a whole turn.
    #[expect(clippy::cast_possible_truncation, reason = "the low 32 bits are meant")]
    pub const fn fraction(self, single_turn: u32) -> u32 {
        (single_turn as u64).wrapping_shl(32_u32.saturating_sub(self.st_bits as u32)) as u32
    }

    /// Converts a single-turn position to thousandths of a degree, rounded down.
    #[expect(clippy::cast_possible_truncation, reason = "below 360 000")]
    pub const fn milli_degrees(self, single_turn: u32) -> u32 {
        let scaled = (single_turn as u64).wrapping_mul(360_000);
        scaled.wrapping_shr(self.st_bits as u32) as u32
    }

    /// Converts a single-turn position to degrees.
    #[expect(clippy::cast_precision_loss, reason = "a power of two")]
    pub fn degrees(self, single_turn: u32) -> f64 {
        f64::from(single_turn) / self.counts_per_turn() as f64 * 360.0
    }

    /// Converts a single-turn position to degrees with the arithmetic of the AM243x Motor Control SDK, bit for bit: each operand
    /// rounded to `f32`, divided, then multiplied.
    #[expect(clippy::cast_precision_loss, reason = "the loss is what is asked for")]
    pub fn degrees_f32(self, single_turn: u32) -> f32 {
        single_turn as f32 / self.counts_per_turn() as f32 * 360.0
    }

    /// Returns the shorter path from one single-turn position to another in counts, across the zero point if necessary.
    #[expect(clippy::cast_possible_wrap, reason = "the wrap is the sign")]
    pub const fn difference(self, from: u32, to: u32) -> i32 {
        let unused = 32_u32.saturating_sub(self.st_bits as u32);
        (to.wrapping_sub(from).wrapping_shl(unused) as i32).wrapping_shr(unused)
    }
}

/// The serialised form of a resolution.
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
impl TryFrom<Written> for Resolution {
    type Error = OutOfRange;

    fn try_from(written: Written) -> Result<Self, OutOfRange> {
        let resolution = Self::new(written.st_bits, written.mt_bits)?.with_version(written.version);
        let resolution = if written.low_with_velocity { resolution.with_velocity_in_low() } else { resolution };
        Ok(if written.resets_with_position { resolution.with_position_in_resets() } else { resolution })
    }
}

#[cfg(feature = "serde")]
impl From<Resolution> for Written {
    fn from(resolution: Resolution) -> Self {
        let Resolution { st_bits, mt_bits, version, low_with_velocity, resets_with_position } = resolution;
        Self { st_bits, mt_bits, version, low_with_velocity, resets_with_position }
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for Resolution {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        let st_bits = *from.choose(&[17, 20, 22, 24])?;
        let mt_bits = *from.choose(&[0, 16])?;
        let [low_with_velocity, resets_with_position] = from.arbitrary()?;
        Ok(Self { st_bits, mt_bits, version: Version::V3_0, low_with_velocity, resets_with_position })
    }
}

servowire_core::one_line!(Resolution {
    Self { st_bits, mt_bits, version, .. } => "{} + {} bits, version {}", st_bits, mt_bits, version;
});

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_width_is_taken_or_refused() {
        for st_bits in (0..=255_u8).step_by(crate::STRIDE) {
            for mt_bits in 0..=255_u8 {
                let possible = (1..=32).contains(&st_bits) && mt_bits <= 32 && st_bits + mt_bits <= 40;
                assert_eq!(Resolution::new(st_bits, mt_bits).is_ok(), possible);
            }
        }
    }

    #[test]
    fn turns_of_any_width_have_a_sign() {
        for mt_bits in 1..=32_u8 {
            let resolution = Resolution::new(8, mt_bits).unwrap();
            let signed = |turns: u32| resolution.turns(resolution.compose(0, turns).get());
            assert_eq!(signed(u32::MAX), -1, "{mt_bits} bits");
            assert_eq!(signed(1 << (mt_bits - 1)), -1 << (mt_bits - 1), "{mt_bits} bits");
            assert_eq!(u32::try_from(signed((1 << (mt_bits - 1)) - 1)), Ok((1 << (mt_bits - 1)) - 1));
        }
        assert_eq!(Resolution::new(24, 0).unwrap().turns(5), 0);
    }

    proptest! {
        #[test]
        fn position_is_the_inverse_of_compose(st in 1..=24_u8, mt in 0..=16_u8, single: u32, turns: u32) {
            let resolution = Resolution::new(st, mt).unwrap();
            let (single, turns) = (single & ((1 << st) - 1), turns & ((1 << mt) - 1));
            let abs = resolution.compose(single, turns).get();
            let turns_mod = i64::from(resolution.turns(abs)).rem_euclid(1 << mt);
            prop_assert_eq!((resolution.single_turn(abs), turns_mod), (single, i64::from(turns)));
            prop_assert!(resolution.milli_degrees(single) < 360_000);
            prop_assert_eq!(resolution.fraction(single) >> (32 - st), single);
            prop_assert!((resolution.degrees(single) * 1000.0 - f64::from(resolution.milli_degrees(single))).abs() < 1.001);
        }

        #[test]
        fn difference_wraps(st in 1..=32_u8, from: u32, to: u32) {
            let resolution = Resolution::new(st, 0).unwrap();
            let turn = 1_i64 << st;
            let d = i64::from(resolution.difference(from, to));
            prop_assert!(-turn / 2 <= d && d < (turn + 1) / 2);
            prop_assert_eq!((i64::from(to) - i64::from(from) - d).rem_euclid(turn), 0);
        }
    }
}
