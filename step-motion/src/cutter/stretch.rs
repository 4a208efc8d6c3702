//! Stretches of steps: what is demanded of a cutter, and what it returns.

use servowire_core::Direction;

use crate::real::Real;

/// The requirements on a segment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// How far off a step may be, in moments.
    pub(crate) off: Real,
    /// For a stop that is only a precaution: a step may also be off by 2^-this of an interval.
    pub(crate) coarse: Option<u32>,
    /// Time that its steps may take, in 2^-32 ticks; one step may take longer.
    pub(crate) time: u64,
    /// How many steps may be searched in a slice.
    pub(crate) searches: u32,
}

/// A stretch of steps. Times are in 2^-32 ticks, on the clock for the first step, and as differences after it.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Stretch {
    pub(crate) count: u16,
    /// Time of its first step.
    pub(crate) first: i128,
    /// The interval from the first step to the second, and its first and second differences.
    pub(crate) differences: [i64; 3],
}

/// The result of a slice of the work of a mover for its next steps.
#[derive(Debug)]
pub(crate) enum Cut {
    /// Steps, and their direction.
    Steps(Stretch, Direction),
    /// Only part of the work was done.
    More,
    /// The next step comes later.
    Later,
    /// No step is to come.
    Rest,
}

/// Multiplying by this, modulo 2^64, divides a multiple of 3 by 3.
const THIRD: u64 = 0xaaaa_aaaa_aaaa_aaab;

impl Stretch {
    /// Returns the time of its last step, adding each interval as the interrupt does.
    pub(crate) fn last(&self) -> i128 {
        self.time(self.count.saturating_sub(1))
    }

    /// Returns the time of a step, counted from 0. The total is less than 2^63, however large the terms of the sum are.
    #[expect(clippy::cast_possible_wrap, reason = "modulo 2^64")]
    fn time(&self, n: u16) -> i128 {
        let [interval, add, bend] = self.differences;
        let n = u64::from(n);
        // n, n (n - 1) / 2, n (n - 1) (n - 2) / 6 times: 2^48 at most.
        let pairs = n.wrapping_mul(n.saturating_sub(1)) >> 1;
        let triples = pairs.wrapping_mul(n.saturating_sub(2)).wrapping_mul(THIRD);
        let [n, pairs, triples] = [n, pairs, triples].map(|n| n as i64);
        let more =
            interval.wrapping_mul(n).wrapping_add(add.wrapping_mul(pairs)).wrapping_add(bend.wrapping_mul(triples));
        self.first.wrapping_add(more.into())
    }

    /// Splits the stretch into the steps before a time, at least the first one, and the steps that are left.
    pub(crate) fn split(self, until: i128) -> (Self, Option<Self>) {
        if self.last() < until {
            return (self, None);
        }
        let (mut before, mut after) = (1, self.count.saturating_sub(1));
        while before < after {
            let middle = before.midpoint(after);
            if self.time(middle) < until { before = middle.saturating_add(1) } else { after = middle }
        }
        let [interval, add, bend] = self.differences;
        let n = i64::from(before);
        let pairs = n.wrapping_mul(n.wrapping_sub(1)) >> 1;
        let interval = interval.wrapping_add(add.wrapping_mul(n)).wrapping_add(bend.wrapping_mul(pairs));
        let differences = [interval, add.wrapping_add(bend.wrapping_mul(n)), bend];
        let left = Self { count: self.count.saturating_sub(before), first: self.time(before), differences };
        (Self { count: before, ..self }, Some(left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The steps before a time, at least one, and then those that are left, each at its own time.
    #[test]
    fn a_stretch_is_split_at_a_time() {
        for differences in [[100, 0, 0], [100, 7, 0], [1000, -50, 2], [500, -20, 0]] {
            for count in [1, 2, 3, 9, 20] {
                let whole = Stretch { count, first: 5000, differences };
                let times = |stretch: Stretch| (0..stretch.count).map(move |k| stretch.time(k));
                for until in times(whole).flat_map(|time| [time - 1, time, time + 1]).chain([0, 1 << 90]) {
                    let (before, after) = whole.split(until);
                    let want = times(whole).filter(|time| *time < until).count().max(1);
                    assert_eq!(usize::from(before.count), want, "{whole:?} at {until}");
                    assert_eq!(after.map_or(0, |after| usize::from(after.count)), usize::from(count) - want);
                    assert!(times(before).chain(after.into_iter().flat_map(times)).eq(times(whole)), "{after:?}");
                    assert_eq!(before.last(), whole.time(before.count - 1));
                }
            }
        }
    }
}
