//! Commands to a stepper driver: STEP and DIR, one per cycle of the PTO word.

use core::fmt;

crate::codes! {
    /// The DIR signal of a stepper driver; the code is its level, bit 15 of the PTO word (TIDEP0061, section 2.4.2).
    #[derive(Default)]
    pub enum Direction: u8 {
        /// DIR = 0; steps count upwards.
        #[default]
        Forward = 0 => "forward",
        /// DIR = 1; steps count downwards.
        Reverse = 1 => "reverse",
    }
}

impl Direction {
    /// Returns whether DIR is high.
    pub const fn dir(self) -> bool {
        matches!(self, Self::Reverse)
    }

    /// Returns the direction of this many steps; forward for 0.
    pub const fn of(steps: i64) -> Self {
        if steps < 0 { Self::Reverse } else { Self::Forward }
    }

    /// Returns `steps` plus one step in this direction.
    pub const fn advance(self, steps: i64) -> i64 {
        match self {
            Self::Forward => steps.wrapping_add(1),
            Self::Reverse => steps.wrapping_sub(1),
        }
    }
}

/// The command to a motor for one cycle, with everything that a PTO word says.
///
/// | command | PTO word (TIDEP0061, section 2.4.2) |
/// |---|---|
/// | `Disable` | 0x7FFF |
/// | `Hold` | 0x0000, with DIR in bit 15 |
/// | `Pulse` | start time 1..=3990 ns, with DIR in bit 15 |
///
/// The word itself is encoded by the crate of the wire protocol. That crate has to send sync_time 0 as 1 and 3991..=3999 as
/// 3990: 0 would be read as "no pulse", which loses a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Command {
    /// Switch the motor current off.
    Disable,
    /// No pulse in this cycle; DIR is held.
    Hold {
        /// DIR.
        direction: Direction,
    },
    /// A pulse in this cycle.
    Pulse {
        /// DIR.
        direction: Direction,
        /// Start of the pulse in its cycle in ns, 0..=3999.
        sync_time: u32,
    },
}

/// Displayed as `pulse forward at 1000 ns`.
impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disable => f.pad("current off"),
            Self::Hold { direction } => write!(f, "hold {direction}"),
            Self::Pulse { direction, sync_time } => write!(f, "pulse {direction} at {sync_time} ns"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Direction::{Forward, Reverse};
    use super::*;

    #[test]
    fn the_direction_of_steps_and_a_step_on() {
        for (steps, direction) in [(i64::MIN, Reverse), (-1, Reverse), (0, Forward), (1, Forward), (i64::MAX, Forward)]
        {
            assert_eq!(Direction::of(steps), direction, "{steps}");
        }
        assert_eq!(
            [Forward, Reverse].map(|way| (way.dir(), way.code(), way.advance(-7))),
            [(false, 0, -6), (true, 1, -8)]
        );
        assert_eq!(
            (Direction::default(), Forward.advance(i64::MAX), Reverse.advance(i64::MIN)),
            (Forward, i64::MIN, i64::MAX)
        );
    }
}
