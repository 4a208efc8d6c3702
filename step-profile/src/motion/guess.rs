//! The next step from the last intervals, where they change too fast for a [`Row`](super::run::Row).
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers"
)]

use super::cubic::Cubic;
use super::run::Row;

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
    pub(super) rate: u32,
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
        let change = (i64::from(cubic.growth(ticks.into())).wrapping_mul(interval.into()) >> 15) as i32;
        Self { cubic, tick, interval: 0, change: 0, late, next: 0, rate, wait }.between(interval, change)
    }

    /// After the last step of a row that cannot go on.
    pub(super) fn after(row: &Row) -> Self {
        let (cubic, tick) = row.place();
        let [interval, change, late] = row.intervals().map(|x| x >> 21);
        let own = Self { cubic, tick, interval: 0, change: 0, late: late as u32, next: 0, rate: row.rate(), wait: 0 };
        let own = own.between(interval as u32, change as i32);
        Self { wait: own.patience().max(Row::LEAST), ..own }
    }

    /// With the interval at the last step, and what the next one is longer than the one before.
    fn between(self, interval: u32, change: i32) -> Self {
        let half = change >> 1;
        let next = interval.wrapping_add_signed(half).wrapping_sub(self.late).wrapping_add(CEIL);
        Self { interval: interval.wrapping_add_signed(half.wrapping_neg()), change: change as u32, next, ..self }
    }

    /// About as many steps until the intervals change so slowly that sixteen can be foreseen at once.
    ///
    /// With i the interval and c its change the bend over them is 40,960 c³ / i² in a trapezoid, i / 2c steps from rest, and less in an
    /// S-curve. It should be below 0.15 ticks, and becomes less with the power of 3.5 of the steps from rest.
    fn patience(&self) -> u32 {
        let (interval, change) = (self.interval, (self.change as i32).unsigned_abs());
        let steps = interval.checked_div(change << 1).unwrap_or(u32::MAX);
        let is_steep = steps < 128;
        let wait = if is_steep {
            128_u32.wrapping_sub(steps)
        } else {
            let (interval, change) = (u64::from(interval), u64::from(change));
            let cubed = (change.wrapping_mul(change) >> 8).wrapping_mul(change);
            let limit = interval.wrapping_mul(interval) >> 15;
            if cubed <= limit {
                return 0;
            }
            let doublings = limit.leading_zeros().wrapping_sub(cubed.leading_zeros()).wrapping_add(1);
            steps.saturating_mul(doublings) >> 3
        };
        // Slower and slower: at the end of the piece at most.
        let end = if self.change as i32 > 0 { steps >> 1 } else { 0 };
        wait.max(end).max(8)
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

    /// The next step, if it is foreseen rightly or Newton's step from there finds it; `after` gives the position so many ticks on.
    #[inline(always)]
    fn foresee(&mut self, after: impl Fn(&Cubic<i64>, u64) -> Cubic<i64>) -> Option<u64> {
        let mut by = self.next >> PART;
        let mut there = after(&self.cubic, by.into());
        if !there.is_surely_there() {
            by = there.nearer(by)?;
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
        if let Some(tick) = self.foresee(Cubic::bent) {
            return Some(tick);
        }
        Some(if cfg!(target_pointer_width = "64") { self.search_apart(last) } else { self.search(last) })
    }

    /// The tick of the next step of `left`, unless several may be foreseen at once.
    pub(super) fn single(&mut self, left: u32, last: u64) -> Option<u64> {
        if self.wait == 0 {
            self.wait = if left < Row::LEAST { Row::LEAST } else { self.patience() };
        }
        self.wait = self.wait.checked_sub(1)?;
        Some(self.step(last))
    }

    /// The tick of the next step.
    pub(super) fn step(&mut self, last: u64) -> u64 {
        self.foresee(Cubic::bent).unwrap_or_else(|| self.search(last))
    }

    /// The next step, foreseen wrongly; in a copy, lest all that is known has to be in memory.
    #[inline(always)]
    fn search_apart(&mut self, last: u64) -> u64 {
        let mut copy = *self;
        let tick = copy.search(last);
        *self = copy;
        tick
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

    /// Up to `left` steps, as long as it is not worth while to look for more; what is left then.
    #[inline(always)]
    pub(super) fn fold<B>(&mut self, left: u32, last: u64, sum: B, take: &mut impl FnMut(B, u64) -> B) -> (u32, B) {
        let count = left.min(self.wait);
        let sum = if self.cubic.is_straight() {
            self.fold_with(Cubic::straight, (count, last), sum, take)
        } else {
            self.fold_with(Cubic::bent, (count, last), sum, take)
        };
        self.wait = self.wait.wrapping_sub(count);
        (left.wrapping_sub(count), sum)
    }

    #[inline(always)]
    fn fold_with<B>(
        &mut self,
        after: impl Fn(&Cubic<i64>, u64) -> Cubic<i64>,
        (count, last): (u32, u64),
        mut sum: B,
        take: &mut impl FnMut(B, u64) -> B,
    ) -> B {
        let mut own = *self;
        for _ in 0..count {
            sum = take(sum, if let Some(tick) = own.foresee(&after) { tick } else { own.search_apart(last) });
        }
        *self = own;
        sum
    }
}
