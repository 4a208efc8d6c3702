use core::fmt;

use servowire_core::OutOfRange;

use crate::command::Version;
use crate::error::Error;
use crate::number::U40;
use crate::response::Response;

/// What the line does not say about an encoder: its widths, its version and its factory settings.
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

/// Where the shaft is, in the units of a [`Resolution`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Position {
    /// Counts in the turn.
    pub single_turn: u32,
    /// Turns, from 0 up, as far as the response shows them.
    pub turns: u32,
    /// How many bits of the turns the response shows: all, fewer in 24 bits, none in 17.
    pub turns_bits: u8,
}

impl Default for Resolution {
    /// 20 + 16 bits, version 3.0, responses as in version 2.1.
    fn default() -> Self {
        Self { st_bits: 20, mt_bits: 16, version: Version::V3_0, low_with_velocity: false, resets_with_position: false }
    }
}

impl Resolution {
    /// Widths of the single turn (encoders have 17, 20, 22 or 24 bits) and of the turns (16, or 0 without a counter), for
    /// an encoder of version 2.1.
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

    /// Takes the position of a response apart, whatever its status says; for control there is [`read`](Self::read).
    ///
    /// # Errors
    /// [`Error::NotCarried`] if the response shows no position from bit 0 up or less than a whole turn, as 17 bits do of a
    /// 20-bit encoder; [`Error::UpperBits`] if bits are set above the widths of the resolution.
    pub const fn position(self, response: &Response) -> Result<Position, Error> {
        match response.abs() {
            Some(abs) => self.part(abs, response.layout().abs_bits()),
            None => Err(Error::NotCarried),
        }
    }

    /// Takes a whole position apart.
    ///
    /// # Errors
    /// [`Error::UpperBits`] if bits are set above the widths of the resolution.
    pub const fn split(self, abs: U40) -> Result<Position, Error> {
        self.part(abs.get(), 40)
    }

    /// The turns of a position as a signed number, if the response showed all bits of them: with 16 bits -32768..=32767.
    /// Beyond, the counter wraps round and OVFLOW is raised.
    #[expect(clippy::cast_possible_wrap, reason = "the wrap is the sign")]
    pub const fn signed_turns(self, position: Position) -> Option<i32> {
        if position.turns_bits != self.mt_bits || self.mt_bits == 0 {
            return None;
        }
        let unused = 32_u32.saturating_sub(self.mt_bits as u32);
        Some((position.turns.wrapping_shl(unused) as i32).wrapping_shr(unused))
    }

    /// Of the position bits `abs` the `abs_bits` lowest are there.
    #[expect(clippy::cast_possible_truncation, reason = "both parts are masked to 32 bits at most")]
    const fn part(self, abs: u64, abs_bits: u8) -> Result<Position, Error> {
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

/// A resolution as it is written down.
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
        let resolution = if written.low_with_velocity { resolution.low_with_velocity() } else { resolution };
        Ok(if written.resets_with_position { resolution.resets_with_position() } else { resolution })
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

impl fmt::Display for Resolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} + {} bits, version {}", self.st_bits, self.mt_bits, self.version)
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.turns_bits == 0 {
            return write!(f, "{} counts", self.single_turn);
        }
        write!(f, "turn {}, {} counts", self.turns, self.single_turn)
    }
}

servowire_core::format_as_displayed!(Resolution, Position);

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
            let signed = |turns: u32| resolution.signed_turns(resolution.split(resolution.compose(0, turns)).unwrap());
            assert_eq!(signed(u32::MAX), Some(-1), "{mt_bits} bits");
            assert_eq!(signed(1 << (mt_bits - 1)), Some(-1 << (mt_bits - 1)), "{mt_bits} bits");
            assert_eq!(signed((1 << (mt_bits - 1)) - 1), i32::try_from((1_u32 << (mt_bits - 1)) - 1).ok());
        }
        let none = Resolution::new(24, 0).unwrap();
        assert_eq!(none.signed_turns(none.split(U40::truncate(5)).unwrap()), None);
    }

    #[test]
    fn what_a_response_shows() {
        let resolution = Resolution::new(20, 16).unwrap();
        let abs = resolution.compose(0xabcde, 0x8001);
        let at = |bits: u8| resolution.part(abs.get() & ((1 << bits) - 1), bits);
        assert_eq!(at(40), Ok(Position { single_turn: 0xabcde, turns: 0x8001, turns_bits: 16 }));
        assert_eq!(resolution.signed_turns(at(40).unwrap()), Some(-32_767));
        assert_eq!(at(24), Ok(Position { single_turn: 0xabcde, turns: 1, turns_bits: 4 }));
        assert_eq!(resolution.signed_turns(at(24).unwrap()), None);
        assert_eq!(at(17), Err(Error::NotCarried));
        assert_eq!(resolution.split(U40::truncate(1 << 36)), Err(Error::UpperBits { width: 36 }));
    }

    proptest! {
        #[test]
        fn position_is_the_inverse_of_compose(st in 1..=24_u8, mt in 0..=16_u8, single: u32, turns: u32) {
            let resolution = Resolution::new(st, mt).unwrap();
            let (single, turns) = (single & ((1 << st) - 1), turns & ((1 << mt) - 1));
            let abs = resolution.compose(single, turns);
            prop_assert_eq!(resolution.split(abs), Ok(Position { single_turn: single, turns, turns_bits: mt }));
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
