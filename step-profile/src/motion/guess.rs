//! The next step from the last intervals, where they change too fast for a [`Row`](super::run::Row).
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers"
)]

use super::cubic::Cubic;

/// Bits of a part of a tick in a [`Guess`], which foresees intervals of up to 2^20 ticks with them.
const PART: u32 = 11;
/// Rounds up.
const CEIL: u32 = (1 << PART) - 1;

/// Makes a step at a time: foresees it, and looks at the exact position whether that was right. In 2^-11 ticks.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Guess {
    /// The position at the last step, and its tick.
    pub(super) cubic: Cubic<i64>,
    pub(super) tick: u64,
    /// The last interval.
    interval: u32,
    /// What it was longer than the one before.
    change: u32,
    /// How long before the middle of its tick the last step was due.
    late: u32,
    /// Ticks to the next step, rounded up.
    next: u32,
    /// Steps a unit: 2^43 over the high word of a step.
    rate: u32,
    /// Steps until it is worth while to look whether the intervals change slowly.
    wait: u32,
}

impl Guess {
    /// From the speed alone, after a step; for so many steps at least.
    pub(super) fn new(cubic: Cubic<i64>, tick: u64, wait: u32) -> Self {
        let high = (cubic.step >> 32) as u32;
        let rate = u32::MAX.checked_div(high >> PART).unwrap_or(0);
        let ticks = cubic.interval().min(1 << 19) as u32;
        let interval = ticks << PART;
        let late = (cubic.late().unwrap_or(0) >> 21) as u32;
        let next = interval.wrapping_sub(late).wrapping_add(CEIL);
        Self { cubic, tick, interval, change: 0, late, next, rate, wait }
    }

    /// Whether the intervals change so slowly that eight steps can be foreseen at once. With i the interval and c its change
    /// the fourth difference over eight steps is 7680 c³ / i² in a trapezoid; it has to be below 1/8 of a tick.
    pub(super) fn is_slow(&self) -> bool {
        if self.wait > 0 {
            return false;
        }
        let (interval, change) = (u64::from(self.interval), u64::from((self.change as i32).unsigned_abs()));
        change.wrapping_mul(change).saturating_mul(change) <= interval.wrapping_mul(interval) >> 8
    }

    /// A step came `by` ticks after the one before; `off` is what the position was past it.
    #[inline(always)]
    fn learn(&mut self, by: u32, off: i64) {
        // The part of a tick is off / speed, and the speed is about a step an interval.
        let part = (u64::from((off >> 32) as u32).wrapping_mul(self.interval.into()) >> PART) as u32;
        let late = (u64::from(part).wrapping_mul(self.rate.into()) >> 32) as u32;
        let interval = (by << PART).wrapping_add(self.late).wrapping_sub(late);
        // The change changes about as it did before.
        let change = interval.wrapping_sub(self.interval);
        let next = change.wrapping_sub(self.change).wrapping_add(change).wrapping_add(interval);
        let next = next.wrapping_sub(late).wrapping_add(CEIL);
        // None is below 0: the position there would be far away.
        self.next = next & !((next as i32 >> 31) as u32);
        (self.interval, self.change, self.late) = (interval, change, late);
    }

    /// The next step, if it is foreseen rightly or wrong by a tick; `after` gives the position so many ticks on.
    #[inline(always)]
    fn foresee(&mut self, after: impl Fn(&Cubic<i64>, u64) -> Cubic<i64>) -> Option<u64> {
        let mut by = self.next >> PART;
        let mut there = after(&self.cubic, by.into());
        if !there.is_surely_there() {
            by = if there.off < 0 { by.wrapping_add(1) } else { by.wrapping_sub(1) };
            there = after(&self.cubic, by.into());
            if !there.is_surely_there() {
                return None;
            }
        }
        self.learn(by, there.off);
        (self.cubic, self.tick) = (there, self.tick.wrapping_add(by.into()));
        Some(self.tick)
    }

    /// The tick of the next step, unless it is worth while to look for more; no tick after `last` is looked at.
    #[inline(always)]
    pub(super) fn next(&mut self, last: u64) -> Option<u64> {
        self.wait = self.wait.checked_sub(1)?;
        Some(self.foresee(Cubic::bent).unwrap_or_else(|| self.search(last)))
    }

    /// The tick of the next step, and no look for more in the next ones.
    pub(super) fn step(&mut self, last: u64) -> u64 {
        self.wait = 16;
        self.foresee(Cubic::bent).unwrap_or_else(|| self.search(last))
    }

    /// The next step, foreseen wrongly.
    #[cold]
    #[inline(never)]
    pub(super) fn search(&mut self, last: u64) -> u64 {
        let (by, there) = self.cubic.solve((self.next >> PART).into(), last.saturating_sub(self.tick));
        self.learn(by as u32, there.off.max(0));
        // After a wrong guess the next one is within half an interval of the last.
        let half = self.interval >> 1;
        self.next = self.next.max(half).min(self.interval.saturating_add(half));
        (self.cubic, self.tick) = (there, self.tick.saturating_add(by));
        self.tick
    }

    /// Up to `left` steps, as long as they are foreseen and it is not worth while to look for more; what is left then.
    #[inline(always)]
    pub(super) fn fold<B>(&mut self, left: u32, sum: B, take: &mut impl FnMut(B, u64) -> B) -> (u32, B) {
        let most = left.min(self.wait);
        let (made, sum) = if self.cubic.is_straight() {
            self.fold_with(Cubic::straight, most, sum, take)
        } else {
            self.fold_with(Cubic::bent, most, sum, take)
        };
        self.wait = self.wait.wrapping_sub(made);
        (left.wrapping_sub(made), sum)
    }

    /// The steps made, and the sum.
    #[inline(always)]
    fn fold_with<B>(
        &mut self,
        after: impl Fn(&Cubic<i64>, u64) -> Cubic<i64>,
        most: u32,
        mut sum: B,
        take: &mut impl FnMut(B, u64) -> B,
    ) -> (u32, B) {
        let (mut own, mut more) = (*self, most);
        while more > 0 {
            let Some(tick) = own.foresee(&after) else { break };
            more = more.wrapping_sub(1);
            sum = take(sum, tick);
        }
        *self = own;
        (most.wrapping_sub(more), sum)
    }
}
