//! What a cutter gives: a stretch of steps.

/// A stretch of steps. Times are in 2^-32 ticks, of the clock for the first step, differences after it.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Stretch {
    pub(crate) count: u16,
    /// When its first step is made.
    pub(crate) first: i128,
    /// The second step after the first one, and the differences of that.
    pub(crate) differences: [i64; 3],
}

/// What is divided by 3 without a rest is multiplied by this, modulo 2^64.
const THIRD: u64 = 0xaaaa_aaaa_aaaa_aaab;

impl Stretch {
    /// When its last step is made, each interval added as the interrupt does.
    pub(crate) fn last(&self) -> i128 {
        self.time(self.count.saturating_sub(1))
    }

    /// When a step is made, from 0. All of it takes less than 2^63, however great the parts of the sum are.
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

    /// The steps before a time, of which the first one is one, and those that are left.
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
