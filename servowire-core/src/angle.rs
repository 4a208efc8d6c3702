use core::num::NonZeroU16;

/// A fraction of a turn, mechanical or electrical, in units of 2^-32 turn; it wraps at the full turn.
///
/// ```
/// use servowire_core::Angle;
/// let quarter = Angle::from_counts(1 << 21, 1 << 23);
/// assert_eq!(quarter.millidegrees(), 90_000);
/// assert_eq!(quarter.wrapping_sub(Angle::HALF).millidegrees(), 270_000);
/// assert_eq!(quarter.difference(Angle::HALF), -(1 << 30)); // a quarter of a turn behind
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Angle(u32);

impl Angle {
    /// No turn.
    pub const ZERO: Self = Self(0);
    /// Half a turn.
    pub const HALF: Self = Self(1 << 31);

    /// Creates an angle from units of 2^-32 turn.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The angle in units of 2^-32 turn.
    pub const fn to_bits(self) -> u32 {
        self.0
    }

    /// Creates an angle from the count of an encoder and its counts per turn, rounded down to 2^-32 turn. If the counts per
    /// turn are a power of two, the result is exact and needs no division. Whole turns are dropped. With 0 counts per turn
    /// the angle is 0.
    pub const fn from_counts(counts: u32, counts_per_turn: u32) -> Self {
        if counts_per_turn.is_power_of_two() {
            // A shift by 32, of one count per turn, leaves nothing: every count is whole turns.
            return Self(low((counts as u64).wrapping_shl(32_u32.wrapping_sub(counts_per_turn.trailing_zeros()))));
        }
        match ((counts as u64) << 32).checked_div(counts_per_turn as u64) {
            Some(bits) => Self(low(bits)),
            None => Self::ZERO,
        }
    }

    /// Creates an angle from thousandths of a degree, rounded down; whole turns are dropped.
    pub const fn from_millidegrees(millidegrees: u32) -> Self {
        Self::from_counts(millidegrees, 360_000)
    }

    /// The angle in thousandths of a degree, rounded to the nearest: 0 to 359,999.
    pub const fn millidegrees(self) -> u32 {
        let rounded = (self.0 as u64).wrapping_mul(360_000).wrapping_add(1 << 31) >> 32;
        if rounded < 360_000 { low(rounded) } else { 0 }
    }

    /// Adds another angle; whole turns are dropped.
    pub const fn wrapping_add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }

    /// Subtracts another angle.
    pub const fn wrapping_sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }

    /// Returns the shorter path to this angle from another one, in units of 2^-32 turn: positive if this one is ahead. Half
    /// a turn is `i32::MIN`.
    pub const fn difference(self, from: Self) -> i32 {
        0_i32.wrapping_add_unsigned(self.0.wrapping_sub(from.0))
    }
}

/// Returns the lower half of the number.
#[expect(clippy::cast_possible_truncation, reason = "what is above is whole turns")]
const fn low(bits: u64) -> u32 {
    bits as u32
}

/// Which way the encoder counts while the field of the motor turns forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sense {
    /// Up.
    Up,
    /// The count goes down: the encoder is mounted the other way round, or two phases are swapped.
    Down,
}

/// How an encoder sits on its motor: converts the mechanical angle to the electrical one.
///
/// ```
/// use servowire_core::{Angle, Commutation, Sense};
/// // four pole pairs; with the encoder at 0 the field stands at 30 degrees
/// let commutation = Commutation::new(4, Angle::from_millidegrees(30_000), Sense::Up).unwrap();
/// let shaft = Angle::from_millidegrees(100_000);
/// assert_eq!(commutation.pole_pairs(), 4);
/// assert_eq!(commutation.electrical(shaft).millidegrees(), 70_000); // 430 degrees
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Commutation {
    pole_pairs: NonZeroU16,
    offset: Angle,
    sense: Sense,
}

impl Commutation {
    /// Describes a motor with `pole_pairs` by the electrical angle at which the encoder reads 0 and the direction in which the
    /// encoder counts. `None` for 0 pole pairs.
    pub const fn new(pole_pairs: u16, offset: Angle, sense: Sense) -> Option<Self> {
        match NonZeroU16::new(pole_pairs) {
            Some(pole_pairs) => Some(Self { pole_pairs, offset, sense }),
            None => None,
        }
    }

    /// Pole pairs of the motor.
    pub const fn pole_pairs(&self) -> u16 {
        self.pole_pairs.get()
    }

    /// The electrical angle at which the encoder reads 0.
    pub const fn offset(&self) -> Angle {
        self.offset
    }

    /// Which way the encoder counts.
    pub const fn sense(&self) -> Sense {
        self.sense
    }

    /// Returns the electrical angle for a mechanical one: the mechanical angle times the pole pairs, forward or backward from
    /// the offset.
    pub const fn electrical(&self, mechanical: Angle) -> Angle {
        let turned = mechanical.0.wrapping_mul(self.pole_pairs.get() as u32);
        match self.sense {
            Sense::Up => Angle(self.offset.0.wrapping_add(turned)),
            Sense::Down => Angle(self.offset.0.wrapping_sub(turned)),
        }
    }

    /// Returns the error of the electrical angle that follows from an error of the mechanical angle: this error times the pole
    /// pairs, at most half a turn.
    pub const fn bound(&self, mechanical: Angle) -> Angle {
        let bound = mechanical.0.saturating_mul(self.pole_pairs.get() as u32);
        if bound < Angle::HALF.0 { Angle(bound) } else { Angle::HALF }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_fractions_of_a_turn() {
        for (counts, per_turn, bits) in [
            (0, 1 << 23, 0),
            (1, 1 << 23, 512),
            (0x7f_ffff, 1 << 23, 0xffff_fe00),
            (0x80_0000, 1 << 23, 0),
            (1, 1 << 31, 2),
            (u32::MAX, 1 << 31, 0xffff_fffe),
            (7, 1, 0),
            (1, 2, 0x8000_0000),
            (1, 3, 0x5555_5555),
            (4, 3, 0x5555_5555),
            (9_999, 10_000, 0xfff9_7247),
            (u32::MAX, u32::MAX - 1, 1),
            (5, 0, 0),
        ] {
            assert_eq!(Angle::from_counts(counts, per_turn).to_bits(), bits, "{counts} of {per_turn}");
        }
    }

    #[test]
    fn degrees_are_rounded_and_wrap() {
        for (bits, millidegrees) in [
            (0, 0),
            (0x4000_0000, 90_000),
            (0x8000_0000, 180_000),
            (0xffff_ffff, 0),
            (0xffff_e000, 359_999),
            (11_930, 1),
        ] {
            assert_eq!(Angle::from_bits(bits).millidegrees(), millidegrees, "{bits:#x}");
        }
        for millidegrees in [0, 1, 30_000, 359_999] {
            assert_eq!(Angle::from_millidegrees(millidegrees).millidegrees(), millidegrees);
        }
        assert_eq!(Angle::from_millidegrees(450_000).to_bits(), 0x4000_0000);
    }

    #[test]
    fn sums_wrap_and_differences_go_the_shorter_way() {
        let [near, far] = [0x1000_0000, 0xf000_0000].map(Angle::from_bits);
        let sums = [near.wrapping_add(far), far.wrapping_add(far), near.wrapping_sub(far)];
        assert_eq!(sums.map(Angle::to_bits), [0, 0xe000_0000, 0x2000_0000]);
        assert_eq!((near.difference(far), far.difference(near)), (0x2000_0000, -0x2000_0000));
        assert_eq!(Angle::HALF.difference(Angle::ZERO), i32::MIN);
    }

    #[test]
    fn the_electrical_angle_goes_round_once_a_pole_pair() {
        let offset = Angle::from_bits(0x0800_0000);
        let up = Commutation::new(5, offset, Sense::Up).unwrap();
        let down = Commutation::new(5, offset, Sense::Down).unwrap();
        for (mechanical, forward, backward) in [
            (0, 0x0800_0000, 0x0800_0000),
            (0x1000_0000, 0x5800_0000, 0xb800_0000),
            (0x3333_3333, 0x07ff_ffff, 0x0800_0001),
            (0xffff_ffff, 0x07ff_fffb, 0x0800_0005),
        ] {
            let mechanical = Angle::from_bits(mechanical);
            let electrical = [up, down].map(|commutation| commutation.electrical(mechanical).to_bits());
            assert_eq!(electrical, [forward, backward], "{mechanical:?}");
        }
        assert_eq!((down.pole_pairs(), down.offset(), down.sense(), up.sense()), (5, offset, Sense::Down, Sense::Up));
        assert_eq!(Commutation::new(0, offset, Sense::Up), None);
    }

    #[test]
    fn an_error_grows_with_the_pole_pairs() {
        let commutation = Commutation::new(1_000, Angle::ZERO, Sense::Down).unwrap();
        for (mechanical, electrical) in
            [(0, 0), (7, 7_000), (2_147_483, 2_147_483_000), (2_147_484, 1 << 31), (1 << 31, 1 << 31)]
        {
            assert_eq!(commutation.bound(Angle::from_bits(mechanical)).to_bits(), electrical, "{mechanical}");
        }
    }
}
