//! From phases to the moments of steps.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers, in two's complement"
)]

use super::phases::{Kind, Phase, Phases};

/// A step in the unit of residuals, 2^-57.
const STEP: i64 = 1 << 57;
/// From positions to residuals.
const WIDEN: u32 = 25;
/// Newton's steps at most; three are rare.
const ROUNDS: u8 = 64;

/// A number with a word below its last bit.
type Wide = (i64, u32);

/// Makes the steps of phases, one after the other.
///
/// Step k falls at the moment at which the position passes k - 1/2, rounded down to half a tick. What is left between the
/// position then and there is kept exactly, so that roundings do not add up.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Stepper {
    /// Moment of the last step, and the position that is left to it.
    t: u64,
    rest: i64,
    v: Wide,
    a: Wide,
    /// A sixth of the jerk.
    j6: i64,
    /// Last interval and its last change, to about a moment; only to guess the next one.
    last: u32,
    change: i32,
    /// Moments from the last half tick to the last step, for that.
    late: u32,
    /// Moments in half a tick.
    grid: u32,
    /// Steps left in this phase.
    left: u32,
    /// Steps made, counted from the origin of the positions.
    count: u32,
    mode: Mode,
    /// Number of the next phase.
    phase: u8,
    /// At constant speed: the interval, and below a moment in 2^-64 that of the last step and the interval's.
    interval: u64,
    part: u64,
    period: u64,
    /// Moment at which the phase is over.
    end: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Mode {
    Cruise,
    /// Constant acceleration.
    Slope,
    /// Constant jerk.
    Bend,
}

/// What a time adds.
struct Ahead {
    /// Position.
    dp: i64,
    /// Speed after it.
    v: Wide,
    /// A sixth of the acceleration.
    da6: Wide,
}

impl Stepper {
    /// With no step made; `grid` moments in half a tick.
    pub(super) const fn new(grid: u32) -> Self {
        Self {
            t: 0,
            rest: 0,
            v: (0, 0),
            a: (0, 0),
            j6: 0,
            last: 0,
            change: 0,
            late: 0,
            grid,
            left: 0,
            count: 0,
            mode: Mode::Cruise,
            phase: 0,
            interval: 0,
            part: 0,
            period: 0,
            end: 0,
        }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        self.count
    }

    /// The moment of the next step.
    #[inline]
    pub(super) fn next(&mut self, phases: &Phases) -> Option<u64> {
        if self.left == 0 {
            self.begin(phases)?;
        } else {
            match self.mode {
                Mode::Cruise => {
                    let (part, carry) = self.part.overflowing_add(self.period);
                    self.part = part;
                    self.t = self.t.wrapping_add(self.interval).wrapping_add(carry.into());
                }
                Mode::Slope => self.slope(),
                Mode::Bend => self.bend(),
            }
        }
        self.left = self.left.wrapping_sub(1);
        self.count = self.count.wrapping_add(1);
        Some(self.t)
    }

    /// The first step of the next phase that has one.
    #[cold]
    #[inline(never)]
    fn begin(&mut self, phases: &Phases) -> Option<()> {
        loop {
            let phase = phases.get(self.phase)?;
            let end = phases.end_of(self.phase);
            self.phase = self.phase.saturating_add(1);
            self.left = phase.until.saturating_sub(self.count);
            if self.left > 0 {
                self.enter(phase, end);
                return Some(());
            }
        }
    }

    fn enter(&mut self, phase: &Phase, end: u64) {
        let target = (i64::from(self.count) << 32).wrapping_add(1 << 31);
        let ahead = target.wrapping_sub(phase.p).clamp(0, 8 << 32);
        self.t = phase.begin;
        match phase.kind {
            Kind::Cruise { interval, part } => {
                let period = u128::from(interval) << 32 | u128::from(part >> 32);
                let wait = period.wrapping_mul(ahead.unsigned_abs().into()) >> 32;
                self.t = self.t.wrapping_add((wait >> 32) as u64);
                (self.part, self.interval, self.period) = ((wait as u64) << 32, interval, part);
                self.mode = Mode::Cruise;
            }
            Kind::Slope { a, a_low, j6 } => {
                // A step of nothing left of the one before: `rest` is what is there still to the next one.
                self.rest = (ahead << WIDEN).wrapping_sub(STEP);
                (self.v, self.a, self.j6) = ((phase.v, phase.v_low), (a, a_low), j6);
                self.mode = if j6 == 0 { Mode::Slope } else { Mode::Bend };
                self.end = end;
                let guess = self.first_guess() & self.mask();
                (self.last, self.late) = (guess, 0);
                self.newton(guess);
                self.change = 0;
            }
        }
    }

    /// From above where the speed grows, from below where it falls: Newton's steps then come nearer from one side.
    fn first_guess(&self) -> u32 {
        let bits = |x: i64| 64_u32.wrapping_sub(x.leading_zeros());
        let ahead = self.rest.wrapping_add(STEP);
        let (need, (v, _), (a, _)) = (bits(ahead), self.v, self.a);
        let mut guess = u32::MAX;
        let slowing = a < 0 || (a == 0 && self.j6 < 0);
        if v > 0 && (slowing || self.j6 < 0 || bits(v).wrapping_add(32) > need) {
            guess = u32::try_from(ahead.checked_div(v).unwrap_or(0)).unwrap_or(u32::MAX);
            if slowing {
                return guess.min(self.left_of_phase());
            }
        }
        let power = |exponent: u32| 1_u32.checked_shl(exponent).unwrap_or(u32::MAX);
        if a > 0 && self.j6 >= 0 {
            guess = guess.min(power(need.saturating_add(33).saturating_sub(bits(a)).div_ceil(2)));
        }
        if self.j6 > 0 {
            guess = guess.min(power(need.saturating_add(65).saturating_sub(bits(self.j6)).div_ceil(3)));
        }
        guess.min(self.left_of_phase())
    }

    /// Moments from the last step to the end of the phase.
    fn left_of_phase(&self) -> u32 {
        u32::try_from(self.end.saturating_sub(self.t)).unwrap_or(u32::MAX)
    }

    /// Down to a multiple of half a tick.
    const fn mask(&self) -> u32 {
        self.grid.wrapping_neg()
    }

    /// The interval changes about as it did before.
    #[inline]
    fn guess(&self) -> u32 {
        let interval = self.last.saturating_add_signed(self.change).max(self.last >> 1);
        interval.saturating_add(self.late) & self.mask()
    }

    /// The next step at constant acceleration.
    #[inline]
    fn slope(&mut self) {
        let time = self.guess();
        let ahead = self.ahead_of_slope(time);
        if !self.take(time, &ahead) {
            self.newton(time);
        }
    }

    /// The next step at constant jerk.
    #[inline]
    fn bend(&mut self) {
        let time = self.guess();
        let ahead = self.ahead_of_bend(time);
        if !self.take(time, &ahead) {
            self.newton(time);
        }
    }

    /// Takes the step after `time`, if that is the last half tick before the position is there.
    #[inline]
    fn take(&mut self, time: u32, ahead: &Ahead) -> bool {
        let rest = self.rest.wrapping_add(STEP).wrapping_sub(ahead.dp);
        let there = rest as u64 >= (ahead.v.0 as u64).wrapping_mul(self.grid.into());
        if !there {
            self.commit(time, rest, ahead);
        }
        !there
    }

    #[inline]
    fn commit(&mut self, time: u32, rest: i64, ahead: &Ahead) {
        self.t = self.t.wrapping_add(time.into());
        self.rest = rest;
        self.v = ahead.v;
        if self.mode == Mode::Bend {
            self.a = self.grown(ahead.da6, 6);
        }
        // rest / v, with the last interval for 1 / v.
        let late = (u64::from((rest >> WIDEN) as u32).wrapping_mul(time.into()) >> 32) as u32;
        let interval = time.wrapping_add(late).wrapping_sub(self.late);
        self.change = interval.wrapping_sub(self.last) as i32;
        (self.last, self.late) = (interval, late);
    }

    /// Newton's steps from a guess.
    #[cold]
    #[inline(never)]
    fn newton(&mut self, guess: u32) {
        let mut time = guess;
        let mut ahead = self.ahead(time);
        let mut rest = self.rest.wrapping_add(STEP).wrapping_sub(ahead.dp);
        for _ in 0..ROUNDS {
            let cell = ahead.v.0.wrapping_mul(self.grid.into());
            if rest >= 0 && rest < cell {
                break;
            }
            let Some(by) = quotient(rest, ahead.v.0) else { break };
            let by = by & self.mask() as i32;
            // Less than half a tick, says the quotient, and it is rounded down.
            let by = if by == 0 { self.grid as i32 } else { by };
            let next = time.saturating_add_signed(by).min(self.left_of_phase()) & self.mask();
            if next == time {
                break;
            }
            time = next;
            ahead = self.ahead(time);
            rest = self.rest.wrapping_add(STEP).wrapping_sub(ahead.dp);
        }
        self.commit(time, rest, &ahead);
    }

    #[inline]
    fn ahead(&self, time: u32) -> Ahead {
        if self.mode == Mode::Bend { self.ahead_of_bend(time) } else { self.ahead_of_slope(time) }
    }

    /// (v0 + v1) / 2 · t.
    #[inline]
    fn ahead_of_slope(&self, time: u32) -> Ahead {
        let v = sum(self.v, times(self.a, time));
        Ahead { dp: distance(sum(self.v, v), time) >> 1, v, da6: (0, 0) }
    }

    /// (v + (a + j t / 3) t / 2) · t.
    #[inline]
    fn ahead_of_bend(&self, time: u32) -> Ahead {
        let low = u64::from(self.j6 as u32).wrapping_mul(time.into());
        let da6 = ((self.j6 >> 32).wrapping_mul(time.into()).wrapping_add((low >> 32) as i64), low as u32);
        let v = sum(self.v, times(self.grown(da6, 3), time));
        let bow = sum(self.v, sum(self.v, times(self.grown(da6, 2), time)));
        Ahead { dp: distance(bow, time) >> 1, v, da6 }
    }

    /// The acceleration and `times` times a sixth of what is added to it.
    #[inline]
    fn grown(&self, (high, low): Wide, times: u32) -> Wide {
        let low = u64::from(low).wrapping_mul(times.into()).wrapping_add(self.a.1.into());
        let high = self.a.0.wrapping_add(high.wrapping_mul(times.into()));
        (high.wrapping_add((low >> 32) as i64), low as u32)
    }
}

/// `x · t` in units of 2^32.
#[inline]
fn times((high, low): Wide, t: u32) -> Wide {
    let below = u64::from(low).wrapping_mul(t.into()) >> 32;
    let middle = u64::from(high as u32).wrapping_mul(t.into()).wrapping_add(below);
    ((high >> 32).wrapping_mul(t.into()).wrapping_add((middle >> 32) as i64), middle as u32)
}

/// `x · t`, without the word below.
#[inline]
fn distance((high, low): Wide, t: u32) -> i64 {
    high.wrapping_mul(t.into()).wrapping_add((u64::from(low).wrapping_mul(t.into()) >> 32) as i64)
}

#[inline]
fn sum((a, a_low): Wide, (b, b_low): Wide) -> Wide {
    let (low, carry) = a_low.overflowing_add(b_low);
    (a.wrapping_add(b).wrapping_add(carry.into()), low)
}

/// `rest / v` to 14 bits, rounded down. `None` at a standstill.
fn quotient(rest: i64, v: i64) -> Option<i32> {
    if v <= 0 {
        return None;
    }
    let down = 49_u32.saturating_sub(v.leading_zeros());
    let divisor = (v >> down) as i32;
    let dividend = rest >> down;
    if let Ok(dividend) = i32::try_from(dividend) {
        return dividend.checked_div_euclid(divisor);
    }
    let coarse = i32::try_from(dividend >> 16).unwrap_or(if rest < 0 { i32::MIN } else { i32::MAX });
    coarse.checked_div_euclid(divisor).map(|by| by.saturating_mul(1 << 16))
}
