//! Many steps from one look at the position: where the intervals change smoothly.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers"
)]

use crate::cubic::Cubic;
use crate::real::Real;

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

    /// Sets it to 2^`doublings` steps from one that was due `late` before a tick, on the way of a [`Row`]; false if they change too
    /// fast.
    #[inline(always)]
    fn along(&mut self, way: Way, doublings: u32, tick: u64, late: i64) -> bool {
        // The same polynomial of steps: f i + s i² + t i³.
        let (first, second) = (way.first >> doublings, way.second >> doublings.wrapping_mul(2));
        let third = way.third >> doublings.wrapping_mul(3);
        let Ok(sixth) = i32::try_from(third.wrapping_mul(6)) else { return false };
        // From the first moment on at which a step may be made, and the tick after it.
        let time = late.wrapping_add(Self::BLUR).wrapping_neg();
        self.count = 1_u32.wrapping_shl(doublings);
        self.tick = tick.wrapping_add_signed((time >> 32).wrapping_add(1));
        self.part = time as u32;
        self.first = first.wrapping_sub(second).wrapping_add(third) as u64;
        self.second = (second << 1).wrapping_sub(sixth.into());
        self.third = sixth;
        true
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

/// Times of steps from one of them on: s spacings later it is `first` s + `second` s² + `third` s³ later, in 2^-32 ticks.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Way {
    first: i64,
    second: i64,
    third: i64,
}

impl Way {
    /// With half the spacing.
    const fn half(self) -> Self {
        Self { first: self.first >> 1, second: self.second >> 2, third: self.third >> 3 }
    }

    /// With twice the spacing.
    const fn twice(self) -> Self {
        Self { first: self.first << 1, second: self.second << 2, third: self.third << 3 }
    }

    /// The time at 1, and how fast it grows there.
    #[inline]
    const fn end(self) -> (i64, i64) {
        let Self { first, second, third } = self;
        let sum = first.wrapping_add(second).wrapping_add(third);
        (sum, sum.wrapping_add(second).wrapping_add(third << 1))
    }

    /// The one that is `end` at 1 and grows by `fast` there, and the same from there on.
    #[inline]
    const fn between(first: i64, end: i64, fast: i64) -> (Self, Self) {
        let third = first.wrapping_add(fast).wrapping_sub(end << 1);
        let second = end.wrapping_sub(first).wrapping_sub(third);
        let then = second.wrapping_add(third << 1).wrapping_add(third);
        (Self { first, second, third }, Self { first: fast, second: then, third })
    }

    /// How much it bends, as [`Row`] says, in 2^-10 ticks and not too little; and 2^16 times `second` over `first`. `interval` is
    /// that of the steps, `first` over 2^`doublings`.
    #[inline(always)]
    fn bend(&self, interval: i64, doublings: u32) -> (u32, i32) {
        let size = self.second.unsigned_abs();
        let (above, below) = (((size >> doublings) >> 15).wrapping_add(1), (interval >> 31) as u32);
        let part = u32::try_from(above).unwrap_or(u32::MAX).checked_div(below).unwrap_or(u32::MAX).min(1 << 16);
        let (second, third) = ((size >> 22) as u32, (self.third >> 22) as i32);
        let square = (u64::from(second).wrapping_mul(part.into()) >> 16) as u32;
        let other = (square << 1).wrapping_sub(third as u32) as i32;
        let sum = square.saturating_add(other.unsigned_abs()).saturating_add(1);
        let bend = u64::from(sum).wrapping_mul(part.wrapping_mul(5).into()) >> 16;
        let turn = part as i32;
        (u32::try_from(bend).unwrap_or(u32::MAX), if self.second < 0 { turn.wrapping_neg() } else { turn })
    }
}

/// The exact position at a step, and how the times of the steps after it go on.
///
/// The time of the step a spacing later is foreseen; the position there says when it is, and the speed how fast the times grow.
/// In between they are those of the polynomial of third degree that agrees with times and growth at both ends.
///
/// How wrong is it? With p the position, the fourth derivative of the time by it is f = (10 p' p'' p''' - 15 p''³) / p'⁷, and the
/// polynomial is wrong by f h⁴ s² (1 - s)² / 24, with f somewhere between, h the spacing and s from 0 to 1: by f h⁴ / 384 at most.
/// The jerk p''' is constant, so the size of p'' is greatest at an end. There f, with its two terms taken as if they had the same
/// sign, is greatest but for p', which changes by a sixteenth at most: (17/16)⁸ = 1.6 times. In the coefficients of the times,
/// with a = |second| / first, f h⁴ / 24 so taken is the bend 5 a (a² + |2 a² - third / first|) first. So a tenth of the greater
/// bend is the error. The coefficients at the end are known from the polynomial: `third` is wrong by twice 1.6 of the true bend,
/// which makes the bend too small by 16 a of it at most. So bend + 16 a · 0.2 ticks is to be below 0.2 ticks, and the error of the
/// polynomial is 0.02 ticks at most. To that comes what the growth at the ends is wrong by, 4/27 of it: Newton's step leaves the
/// square of what was foreseen wrongly, 12 times 1.6 of the bend, over `first`. That is 0.005 where `first` is 440 ticks, as it
/// has to be for such a bend where p''' is small; no bound is shown for all others. In 33,000 random curves the whole error was
/// 0.0123 ticks at most, and 1/32 is what is taken for it.
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
    /// The times from here on.
    way: Way,
    /// Its bend, in 2^-10 ticks; and 2^16 times `second` over `first`.
    bend: u32,
    turn: i32,
    /// Steps a unit: 2^43 over the high word of a step.
    rate: u32,
    /// Steps of the last run that are not made, for the piece ends before them.
    beyond: u32,
}

impl Row {
    /// Steps of the least spacing.
    pub(super) const LEAST: u32 = 1 << Self::FEW;
    /// Doublings of the spacing, at least and at most.
    const FEW: u32 = 4;
    const MANY: u32 = 7;
    /// The greatest bend, 0.2 ticks.
    const SMOOTH: u32 = 205;
    /// Intervals are below 2^20 ticks.
    const LONG: u64 = 1 << 52;

    /// From the position at the tick of a step. With d the interval at the speed there and p = v x + h x² + j x³, a = h d / v
    /// and b = j d² / v, the times are d (s - a s² + (2 a² - b) s³).
    pub(super) fn new(cubic: Cubic<i64>, tick: u64) -> Self {
        let rate = u32::MAX.checked_div((cubic.step >> 43) as u32).unwrap_or(0);
        let [step, v, h, j] = cubic.sizes();
        let first = (step / v).scaled(Self::FEW as i32);
        let per_v = first / v;
        let (a, b) = (h * per_v, j * (per_v * first));
        let (up, grows) = cubic.signs();
        let fixed = |x: Real| x.to_fixed(32).min(1 << 60) as i64;
        let signed = |x: Real, up: bool| if up { fixed(x) } else { fixed(x).wrapping_neg() };
        let way = Way {
            first: fixed(first),
            second: signed(a * first, !up),
            third: fixed(a.squared().scaled(1) * first).wrapping_sub(signed(b * first, grows)),
        };
        let (bend, turn) = way.bend(way.first >> Self::FEW, Self::FEW);
        let late = cubic.late().unwrap_or(0);
        Self { cubic, tick, late, doublings: Self::FEW, way, bend, turn, rate, beyond: 0 }
    }

    /// The position at the last step, and its tick.
    pub(super) const fn place(&self) -> (Cubic<i64>, u64) {
        (self.cubic, self.tick)
    }

    /// The interval of the steps, and what the next one is longer than the last one, in 2^-32 ticks.
    pub(super) const fn intervals(&self) -> [i64; 2] {
        let change = self.way.second >> self.doublings.wrapping_mul(2).wrapping_sub(1);
        [self.way.first >> self.doublings, change]
    }

    /// The next steps, up to `left` of them; none if they change too fast.
    #[inline(never)]
    pub(super) fn run(&mut self, left: u32, run: &mut Run) {
        loop {
            if self.look(run) {
                self.beyond = run.count.saturating_sub(left);
                run.count = run.count.min(left);
                return;
            }
            if self.doublings == Self::FEW {
                return;
            }
            self.halve();
        }
    }

    /// The steps of a spacing, and on to the last of them; false if they change too fast.
    #[inline(always)]
    fn look(&mut self, run: &mut Run) -> bool {
        let (doublings, rate) = (self.doublings, i64::from(self.rate));
        let (end, fast) = self.way.end();
        let by = (end.wrapping_sub(self.late).wrapping_add(1 << 31) >> 32) as u64;
        let cubic = self.cubic.onward(by, doublings);
        let (faster, size) = cubic.change(&self.cubic);
        let interval = fast >> doublings;
        if faster > size >> 4 || !cubic.is_near() || interval as u64 >= Self::LONG {
            return false;
        }
        // Newton's step to the interval at that speed.
        let rough = interval.wrapping_add(1 << 24) >> 25;
        let more = (cubic.rest(rough).wrapping_mul(rough) >> 16).wrapping_mul(rate) >> 9;
        let interval = (rough << 25).wrapping_add(more);
        let late = cubic.part(interval >> 20).wrapping_mul(rate) >> 7;
        // At the time of the step, not at the tick.
        let fast = (interval << doublings).wrapping_sub(late.wrapping_mul(self.turn.into()) >> 15);
        let end = ((by << 32) as i64).wrapping_add(self.late).wrapping_sub(late);
        let (passed, way) = Way::between(self.way.first, end, fast);
        let (bend, turn) = way.bend(interval, doublings);
        let doubt = turn.unsigned_abs().wrapping_mul(Self::SMOOTH) >> 12;
        if bend.max(self.bend).saturating_add(doubt) > Self::SMOOTH
            || !run.along(passed, doublings, self.tick, self.late)
        {
            return false;
        }
        self.cubic = cubic;
        (self.tick, self.late) = (self.tick.wrapping_add(by), late);
        (self.way, self.bend, self.turn) = (way, bend, turn);
        if bend <= Self::SMOOTH >> 4 && faster <= size >> 5 && doublings < Self::MANY {
            self.double();
        }
        true
    }

    /// The tick of a step of the last run that is made at `tick` or just after that; `left` is what is left of the run.
    #[inline]
    pub(super) fn exact(&self, tick: u64, left: u32) -> u64 {
        let early = self.cubic.is_early(tick.wrapping_sub(self.tick), left.wrapping_add(self.beyond));
        tick.wrapping_add(early.into())
    }

    /// Half the spacing.
    const fn halve(&mut self) {
        (self.way, self.bend, self.turn) = (self.way.half(), self.bend >> 4, self.turn >> 1);
        self.doublings = self.doublings.wrapping_sub(1);
    }

    /// Twice the spacing.
    const fn double(&mut self) {
        (self.way, self.bend, self.turn) = (self.way.twice(), self.bend << 4, self.turn << 1);
        self.doublings = self.doublings.wrapping_add(1);
    }
}

#[cfg(test)]
impl Row {
    /// How far the times of its last run are from the exact ones at most, in ticks.
    #[expect(clippy::cast_precision_loss, reason = "compared within 2^-10")]
    pub(super) fn error(&self, mut run: Run) -> f64 {
        let mut worst = 0.0;
        while run.count > 0 {
            let (tick, _) = run.step();
            let back = run.count + self.beyond;
            let there = self.cubic.back(tick.wrapping_sub(self.tick) as i64, back);
            let late = there.late().expect("within a tick") as f64 / 4_294_967_296.0;
            let part = (f64::from(run.part) + Run::BLUR as f64) / 4_294_967_296.0 - 1.0;
            worst = f64::max(worst, (part + late).abs());
        }
        worst
    }
}
