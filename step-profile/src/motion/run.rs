//! Many steps from one look at the position: where the intervals change smoothly.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers"
)]

use super::cubic::Cubic;
use super::real::Real;

/// Steps that are foreseen: their times by a polynomial of third degree, which takes three additions a step.
///
/// A time is known to 2^-5 of a tick, [`Row`] says why. So it says in which tick a step is made, but in one of 16 cases,
/// which is left to the exact position.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Run {
    /// Steps left.
    pub(super) count: u32,
    /// Of the last step: the tick, or the one before it if the part is not below [`Run::UNSURE`].
    tick: u64,
    /// In 2^-32 ticks.
    part: u32,
    /// What it has added to them, what that grows by, and what that does, all in 2^-32 ticks.
    first: u64,
    second: i64,
    third: i32,
}

impl Run {
    /// How exactly times are known, in 2^-32 ticks: 2^-5 ticks.
    const BLUR: i64 = 1 << 27;
    /// From here on the doubt of twice [`BLUR`](Self::BLUR) reaches into the next tick.
    const UNSURE: u32 = 0_u32.wrapping_sub(1 << 28);

    pub(super) const NONE: Self = Self { count: 0, tick: 0, part: 0, first: 0, second: 0, third: 0 };

    /// One step at a known tick.
    pub(super) const fn at(tick: u64) -> Self {
        Self { count: 1, tick, ..Self::NONE }
    }

    /// Steps with a constant `interval` in 2^-32 ticks, after one at `part` of them after the begin of a tick.
    pub(super) const fn even(count: u32, tick: u64, part: u32, interval: u64) -> Self {
        Self { count, tick, part, first: interval, ..Self::NONE }
    }

    /// The steps from the last one of a row to the next one, with the differences of the times there.
    #[inline]
    fn between(row: &Row, [now, more, third]: [i64; 3]) -> Self {
        // From the first moment on at which a step may be made, and the tick after it.
        let time = row.late.wrapping_add(Self::BLUR).wrapping_neg();
        let tick = row.tick.wrapping_add_signed((time >> 32).wrapping_add(1));
        let doublings = row.doublings;
        let count = 1_u32.wrapping_shl(doublings);
        let second = (more >> doublings.wrapping_mul(2)).wrapping_add(third);
        // All steps together take what is known: n f + n (n - 1) / 2 s + n (n - 1) (n - 2) / 6 t.
        let pairs = count.wrapping_mul(count.wrapping_sub(1)) >> 1;
        let triples = pairs.wrapping_mul(count.wrapping_sub(2)) / 3;
        let rest = second.wrapping_mul(pairs.into()).wrapping_add(third.wrapping_mul(triples.into()));
        let first = now.wrapping_sub(rest) >> doublings;
        // As they were a step ago.
        let second = second.wrapping_sub(third);
        let first = first.wrapping_sub(second) as u64;
        Self { count, tick, part: time as u32, first, second: second.wrapping_sub(third), third: third as i32 }
    }

    /// The next step, and whether its tick is certain; else it may be the tick after that. There has to be one.
    #[inline(always)]
    pub(super) fn step(&mut self) -> (u64, bool) {
        self.count = self.count.wrapping_sub(1);
        self.second = self.second.wrapping_add(self.third.into());
        self.first = self.first.wrapping_add_signed(self.second);
        let time = (u128::from(self.tick) << 32 | u128::from(self.part)).wrapping_add(self.first.into());
        (self.tick, self.part) = ((time >> 32) as u64, time as u32);
        (self.tick, self.part < Self::UNSURE)
    }
}

/// The exact position at a step, and the row of the times of steps in a regular spacing before it.
///
/// The time of the step after the spacing is foreseen from three differences of that row; the position there gives it with
/// 14 bits below the point of a tick. In between the times are those of the polynomial through the last four of the row. Its
/// error is f h⁴ s (s + 1) (s + 2) (1 - s) / 24, with f the fourth derivative somewhere there, h the spacing and s from 0 to
/// 1, less than f h⁴ / 24. What was foreseen wrongly is f h⁴ somewhere as near. Up to 1/8 of a tick of that is taken
/// for good, twice in succession and while the intervals change by a sixteenth from one to the next: f then grows less than
/// sixfold, and the error is below 1/32 of a tick. Otherwise the spacing is halved; it is doubled where there is room.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Row {
    cubic: Cubic<i64>,
    /// The tick at which it is.
    tick: u64,
    /// What the step was due earlier than that, in 2^-32 ticks.
    late: i64,
    /// The spacing is 2^this steps.
    doublings: u32,
    /// Differences of the times, in 2^-32 ticks.
    differences: [i64; 3],
    /// What was foreseen wrongly the last time.
    missed: u32,
    /// Steps of the last run that are not made, for the piece ends before them.
    beyond: u32,
}

/// 1/8 of a tick.
const SMOOTH: u32 = 1 << 29;
/// What a doubling makes [`SMOOTH`] of.
const SMOOTHER: u32 = SMOOTH >> 4;

impl Row {
    /// Steps of the least spacing.
    pub(super) const LEAST: u32 = 1 << Self::FEW;
    /// Doublings of the spacing, at least and at most.
    const FEW: u32 = 3;
    const MANY: u32 = 6;
    /// Differences of more than this are none that can be used.
    const WIDEST: u64 = 1 << 56;
    /// Ticks of a spacing that can be doubled.
    const LONG: u64 = 1 << 28;

    /// From the position at the tick of a step. With d the interval at the speed there and p = v x + h x² + j x³, a = h d / v
    /// and b = j d² / v, the times are d (s - a s² + (2 a² - b) s³ - 5 a (a² - b) s⁴).
    pub(super) fn new(cubic: Cubic<i64>, tick: u64) -> Self {
        let [step, v, h, j] = cubic.sizes();
        let spacing = (step / v).scaled(Self::FEW as i32);
        let per_v = spacing / v;
        let (a, b) = (h * per_v, j * (per_v * spacing));
        let (up, grows) = cubic.signs();
        let fixed = |x: Real| x.to_fixed(32).min(Self::WIDEST) as i64;
        let signed = |x: i64, up: bool| if up { x } else { x.wrapping_neg() };
        let (square, bend) = (fixed(a.squared() * spacing), signed(fixed(b * spacing), grows));
        let rest = square.wrapping_sub(bend);
        let fourth = fixed(a * Real::fixed(rest.unsigned_abs(), 32)).wrapping_mul(5);
        let fourth = signed(fourth, up != (rest >= 0));
        let (first, second) = (fixed(spacing), signed(fixed(a * spacing), !up));
        let third = rest.wrapping_add(square);
        let times = |[a, b, c, d]: [i64; 4]| {
            let low = first.wrapping_mul(a).wrapping_add(second.wrapping_mul(b));
            low.wrapping_add(third.wrapping_mul(c)).wrapping_add(fourth.wrapping_mul(d))
        };
        let differences = [times([1, -1, 1, -1]), times([0, 2, -6, 14]), times([0, 0, 6, -36])];
        let late = cubic.late().unwrap_or(0);
        Self { cubic, tick, late, doublings: Self::FEW, differences, missed: SMOOTH, beyond: 0 }
    }

    /// The position at the last step, and its tick.
    pub(super) const fn place(&self) -> (Cubic<i64>, u64) {
        (self.cubic, self.tick)
    }

    /// The next steps, up to `left` of them; `None` if they change too fast.
    #[inline(never)]
    pub(super) fn run(&mut self, left: u32) -> Option<Run> {
        loop {
            let [first, second, third] = self.differences;
            let ahead = first.wrapping_add(second).wrapping_add(third);
            let by = (ahead.wrapping_sub(self.late).wrapping_add(1 << 31) >> 32) as u64;
            let there = self.cubic.onward(by, self.doublings);
            let Some(late) = there.late() else {
                self.halve()?;
                continue;
            };
            let now = ((by << 32) as i64).wrapping_add(self.late).wrapping_sub(late);
            let more = now.wrapping_sub(first);
            let bend = more.wrapping_sub(second);
            let missed = saturated(bend.wrapping_sub(third));
            let worst = missed.max(self.missed);
            let (slope, steep) = (more.unsigned_abs(), now as u64 >> 4);
            let third = bend >> self.doublings.wrapping_mul(3);
            if worst > SMOOTH || slope > steep || third != i64::from(third as i32) {
                self.halve()?;
                continue;
            }
            let mut run = Run::between(self, [now, more, third]);
            self.beyond = run.count.saturating_sub(left);
            run.count = run.count.min(left);
            (self.cubic, self.tick, self.late) = (there, self.tick.wrapping_add(by), late);
            (self.differences, self.missed) = ([now, more, bend], missed);
            let is_short = now as u64 >> 32 < Self::LONG;
            if worst <= SMOOTHER && slope <= steep >> 1 && is_short && self.doublings < Self::MANY {
                self.double();
            }
            return Some(run);
        }
    }

    /// The tick of a step of the last run that is made at `tick` or just after that; `left` is what is left of the run.
    #[inline]
    pub(super) fn exact(&self, tick: u64, left: u32) -> u64 {
        let early = self.cubic.is_early(tick.wrapping_sub(self.tick), left.wrapping_add(self.beyond));
        tick.wrapping_add(early.into())
    }

    /// Half the spacing; `None` at the least one.
    fn halve(&mut self) -> Option<()> {
        if self.doublings == Self::FEW {
            return None;
        }
        let [first, second, third] = self.differences;
        let third = third >> 3;
        let second = (second >> 2).wrapping_add(third);
        self.differences = [first.wrapping_add(second) >> 1, second, third];
        self.missed >>= 4;
        self.doublings = self.doublings.wrapping_sub(1);
        Some(())
    }

    /// Twice the spacing.
    fn double(&mut self) {
        let [first, second, third] = self.differences;
        self.differences = [(first << 1).wrapping_sub(second), second.wrapping_sub(third) << 2, third << 3];
        self.missed <<= 4;
        self.doublings = self.doublings.wrapping_add(1);
    }
}

/// The size, in as many bits as there are.
fn saturated(size: i64) -> u32 {
    u32::try_from(size.unsigned_abs()).unwrap_or(u32::MAX)
}

#[cfg(test)]
impl Row {
    /// How far the times of its last run are from the exact ones at most, in ticks.
    #[expect(clippy::cast_precision_loss, reason = "compared within 2^-10")]
    pub(super) fn error(&self, mut run: Run) -> f64 {
        let mut worst = 0.0;
        while run.count > 0 {
            let (tick, _) = run.step();
            let back = u64::from(run.count + self.beyond);
            let there = self.cubic.back(tick.wrapping_sub(self.tick) as i64, back);
            let late = there.late().expect("within a tick") as f64 / 4_294_967_296.0;
            let part = (f64::from(run.part) + Run::BLUR as f64) / 4_294_967_296.0 - 1.0;
            worst = f64::max(worst, (part + late).abs());
        }
        worst
    }
}
