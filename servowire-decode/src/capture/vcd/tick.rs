//! The file's unit of time.

use crate::time::Time;

/// Turns stamps into picoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tick {
    femtoseconds: u128,
    /// The unit, if it is a whole number of picoseconds.
    picoseconds: Option<u64>,
}

impl Tick {
    /// Creates it from a unit in femtoseconds.
    pub(super) fn new(femtoseconds: u128) -> Self {
        let whole = (femtoseconds % 1000 == 0).then_some(femtoseconds / 1000);
        Self { femtoseconds, picoseconds: whole.and_then(|unit| u64::try_from(unit).ok()) }
    }

    /// Converts a stamp to picoseconds; `None` if it is out of range.
    pub(super) fn time(self, stamp: u64) -> Option<Time> {
        if let Some(unit) = self.picoseconds {
            return Some(Time::from_ps((u128::from(stamp) * u128::from(unit)) as i128));
        }
        let time = u128::from(stamp).checked_mul(self.femtoseconds)?.checked_add(500)? / 1000;
        i128::try_from(time).ok().map(Time::from_ps)
    }

    /// Converts a stamp with digits after a point; also returns whether they are not all zero.
    pub(super) fn time_between(self, stamp: u64, fraction: &[u8]) -> Option<(Time, bool)> {
        let (mut part, mut unit) = (0_u128, self.femtoseconds);
        for digit in fraction {
            unit /= 10;
            part += u128::from(digit.wrapping_sub(b'0')) * unit;
        }
        let time = u128::from(stamp).checked_mul(self.femtoseconds)?.checked_add(part + 500)? / 1000;
        Some((Time::from_ps(i128::try_from(time).ok()?), part > 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_between_two_units() {
        let times = |unit, stamp, fraction: &str| {
            Tick::new(unit).time_between(stamp, fraction.as_bytes()).map(|(time, between)| (time.ps(), between))
        };
        assert_eq!(times(1_000_000_000, 20, "4"), Some((20_400_000, true)));
        assert_eq!(times(1_000_000, 3, "0"), Some((3_000, false)));
        assert_eq!(times(1_000_000, 3, "1234567890123456789012345678901234567890"), Some((3_123, true)));
        assert_eq!(times(1_000, u64::MAX, "9"), Some((18_446_744_073_709_551_616, true)));
    }

    #[test]
    fn stamps_are_rounded_and_units_are_not() {
        let times = |unit, stamp| Tick::new(unit).time(stamp).map(Time::ps);
        assert_eq!(times(1_000_000, 17), Some(17_000));
        assert_eq!(times(10_000, 3), Some(30));
        // 1 fs: 499 are no picosecond, 500 are one.
        assert_eq!([times(1, 499), times(1, 500), times(1, 1499)], [Some(0), Some(1), Some(1)]);
        // 1 s: a thousand years are 3.2e22 ps.
        let second = 1_000_000_000_000_000;
        assert_eq!(times(second, 31_557_600_000), Some(31_557_600_000_000_000_000_000));
        assert_eq!(
            [times(1_000, u64::MAX), times(1, u64::MAX)],
            [Some(18_446_744_073_709_551_615), Some(18_446_744_073_709_552)]
        );
    }
}
