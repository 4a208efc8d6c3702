//! The next step from the last ones, where the intervals change too fast for a [`Row`](crate::run::Row).
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers"
)]

use crate::cubic::Cubic;
use crate::run::Row;

/// Makes a step at a time: foresees it, and looks at the exact position whether that was right.
///
/// A step is foreseen at its way times its pace. The way is how far ahead of the last tick the step is, in 2^37 units of the
/// [`Cubic`]; a step is less than 2^22 of them. The pace is the time that each of them takes, in 2^-32 ticks. Paces of one step
/// after the other are foreseen by their differences, and the differences of those.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Guess {
    /// The position at the last step, and its tick.
    pub(super) cubic: Cubic<i64>,
    pub(super) tick: u64,
    /// The pace that is foreseen for the next step.
    pace: i32,
    /// How much that is above the last one.
    change: i32,
    /// How much the last difference was above the one before.
    turn: i32,
    /// 2^32 over the units of a step.
    rate: i32,
    /// Steps until it is worth while to look whether the intervals change slowly.
    wait: u32,
}

/// A step that was foreseen wrongly: its way, and the ticks for that.
#[derive(Clone, Copy)]
struct Wrong {
    way: i32,
    by: u32,
}

impl Guess {
    /// Below so many ticks the way of a step, from tick to tick, can be more than an eighth off a whole step.
    const SHORT: u32 = 8;

    /// From the speed alone, after a step; for so many steps at least.
    pub(super) fn new(cubic: Cubic<i64>, tick: u64, wait: u32) -> Self {
        let ticks = cubic.interval().min(1 << 19);
        let interval = ticks << 11;
        let change = i64::from(cubic.growth(ticks)).wrapping_mul(interval as i64) >> 15;
        Self { wait, ..Self::with([interval as i64, change], cubic, tick) }
    }

    /// After the last step of a row that cannot go on.
    pub(super) fn after(row: &Row) -> Self {
        let (cubic, tick) = row.place();
        let own = Self::with(row.intervals().map(|x| x >> 21), cubic, tick);
        Self { wait: own.patience().max(Row::LEAST), ..own }
    }

    /// With the interval at a step, and what the next one is longer than the last one, in 2^-11 ticks.
    fn with([interval, change]: [i64; 2], cubic: Cubic<i64>, tick: u64) -> Self {
        // Of 22 bits.
        let step = (cubic.step >> 37) as u32;
        let rate = u32::MAX.checked_div(step).unwrap_or(0) as i32;
        let pace = |x: i64| (x.wrapping_mul(rate.into()) >> 11) as i32;
        let [interval, change] = [interval, change].map(pace);
        Self { cubic, tick, pace: interval.wrapping_add(change >> 1), change, turn: 0, rate, wait: 0 }
    }

    /// About as many steps until the intervals change so slowly that sixteen can be foreseen at once.
    ///
    /// With i the interval and c its change the bend over them is 40,960 c³ / i² in a trapezoid, i / 2c steps from rest, and less in an
    /// S-curve. It should be below 0.15 ticks, and becomes less with the power of 3.5 of the steps from rest.
    fn patience(&self) -> u32 {
        // In 2^-11 ticks.
        let step = (self.cubic.step >> 37) as u64;
        let ticks = |pace: u32| (u64::from(pace).wrapping_mul(step) >> 21) as u32;
        let (interval, change) = (ticks(self.pace as u32), ticks(self.change.unsigned_abs()));
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
        let end = if self.change > 0 { steps >> 1 } else { 0 };
        wait.max(end).max(8)
    }

    /// The last step was made `over` 2^-32 ticks earlier than foreseen.
    #[inline(always)]
    fn learn(&mut self, over: i64) {
        let more = (over.wrapping_mul(self.rate.into()) >> 32).wrapping_neg() as i32;
        // A way is about a step. The second difference stays.
        self.turn = self.turn.wrapping_add(more);
        self.change = self.change.wrapping_add(self.turn).wrapping_add(more);
        self.pace = self.pace.wrapping_add(more).wrapping_add(self.change).max(0);
    }

    /// The time for a way at the pace that is foreseen, in 2^-32 ticks.
    #[inline(always)]
    fn time(&self, way: i32) -> u64 {
        u64::from(way as u32).wrapping_mul(u64::from(self.pace as u32))
    }

    /// Goes on to where the next step is foreseen, and says whether it is there. `after` gives the position so many ticks on.
    #[inline(always)]
    fn foresee(&mut self, after: impl Fn(&Cubic<i64>, u64) -> Cubic<i64>) -> Result<u64, Wrong> {
        let way = self.cubic.ahead();
        let by = ((self.time(way) >> 32) as u32).wrapping_add(1);
        // In place: a copy of what was before would be too much for the registers of a small core.
        self.cubic = after(&self.cubic, by.into());
        self.tick = self.tick.wrapping_add(by.into());
        if !self.cubic.is_surely_there() {
            return Err(Wrong { way, by });
        }
        // Less than a tick; more than half of one is taken wrongly, and mended at the next step.
        let over = self.time(way.wrapping_add(self.cubic.past())) as i32;
        self.learn(over.into());
        Ok(self.tick)
    }

    /// By one step of Newton's to the next step, from where it was foreseen; if it is not there either, back to the last one.
    #[inline(always)]
    fn mend(&mut self, wrong: Wrong) -> Option<u64> {
        let Wrong { way, by } = wrong;
        let better = self.cubic.nearer(by).unwrap_or(by);
        self.go(better.wrapping_sub(by) as i32, 0);
        if !self.cubic.is_surely_there() {
            self.go((better as i32).wrapping_neg(), 1);
            return None;
        }
        let way = way.wrapping_add(self.cubic.past());
        if better < Self::SHORT {
            self.restart(way, better);
        } else {
            self.learn(self.time(way).wrapping_sub(u64::from(better) << 32) as i64);
        }
        Some(self.tick)
    }

    /// So many ticks on or, below 0, back, where a step is made that comes `steps` before.
    #[inline(always)]
    fn go(&mut self, ticks: i32, steps: u32) {
        let by = i64::from(ticks);
        (self.cubic, self.tick) = (self.cubic.back(by, steps), self.tick.wrapping_add_signed(by));
    }

    /// Foresees from the pace of a step that took `by` ticks for its way, and what it differs from the one before.
    fn restart(&mut self, way: i32, by: u32) {
        let up = by.leading_zeros();
        let pace = u64::from(by.wrapping_shl(up).checked_div(way as u32 >> 11).unwrap_or(0)) << 21 >> up;
        let pace = pace.min(1 << 29) as i32;
        let change = pace.wrapping_sub(self.pace.wrapping_sub(self.change));
        // The next one is within half an interval of this one.
        let change = change.clamp((pace >> 1).wrapping_neg(), pace >> 1);
        (self.pace, self.change, self.turn) = (pace.wrapping_add(change), change, 0);
    }

    /// The tick of the next step, unless it is worth while to look for more; no tick after `last` is looked at.
    #[inline(always)]
    pub(super) fn next(&mut self, last: u64) -> Option<u64> {
        self.wait = self.wait.checked_sub(1)?;
        Some(match self.foresee(Cubic::bent) {
            Ok(tick) => tick,
            Err(wrong) => self.apart(|own| own.look(wrong, last)),
        })
    }

    /// How many of `left` steps are looked for one by one.
    pub(super) fn singles(&self, left: u32) -> u32 {
        left.min(self.wait)
    }

    /// The tick of the next step of `left`, unless several may be foreseen at once.
    pub(super) fn single(&mut self, left: u32, last: u64) -> Option<u64> {
        if self.wait == 0 {
            self.wait = if left < 8 * Row::LEAST { left } else { self.patience() };
        }
        self.wait = self.wait.checked_sub(1)?;
        Some(self.step(last))
    }

    /// The tick of the next step.
    pub(super) fn step(&mut self, last: u64) -> u64 {
        match self.foresee(Cubic::bent) {
            Ok(tick) => tick,
            Err(wrong) => self.look(wrong, last),
        }
    }

    /// The tick of the next step, which was foreseen wrongly.
    #[cold]
    #[inline(never)]
    fn look(&mut self, wrong: Wrong, last: u64) -> u64 {
        self.mend(wrong).unwrap_or_else(|| self.search(last))
    }

    /// Calls with a copy, lest all that is known has to be in memory.
    #[inline(always)]
    fn apart(&mut self, call: impl FnOnce(&mut Self) -> u64) -> u64 {
        let mut copy = *self;
        let tick = call(&mut copy);
        *self = copy;
        tick
    }

    /// The tick of the next step, from the last one.
    #[cold]
    #[inline(never)]
    pub(super) fn search(&mut self, last: u64) -> u64 {
        let way = self.cubic.ahead();
        let guess = (self.time(way) >> 32).wrapping_add(1);
        let (by, there) = self.cubic.solve(guess, last.saturating_sub(self.tick));
        self.restart(way.wrapping_add(there.past()), by as u32);
        (self.cubic, self.tick) = (there, self.tick.saturating_add(by));
        self.tick
    }

    /// Up to `left` steps, as long as it is not worth while to look for more; what is left then.
    #[inline(always)]
    pub(super) fn fold<B>(&mut self, left: u32, last: u64, sum: B, take: &mut impl FnMut(B, u64) -> B) -> (u32, B) {
        let count = self.singles(left);
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
        let (mut own, mut left) = (*self, count);
        while left > 0 {
            // What is foreseen rightly in a loop of its own, which has room in the registers.
            let wrong = loop {
                match own.foresee(&after) {
                    Ok(tick) => sum = take(sum, tick),
                    Err(wrong) => break Some(wrong),
                }
                left = left.wrapping_sub(1);
                if left == 0 {
                    break None;
                }
            };
            if let Some(wrong) = wrong {
                let tick = own.mend(wrong);
                sum = take(sum, if let Some(tick) = tick { tick } else { own.apart(|own| own.search(last)) });
                left = left.wrapping_sub(1);
            }
        }
        *self = own;
        sum
    }
}

#[cfg(test)]
impl Guess {
    /// The next step is foreseen rightly.
    pub(super) fn is_right(&self) -> bool {
        let mut own = *self;
        own.foresee(Cubic::bent).is_ok()
    }
}
