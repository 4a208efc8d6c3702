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

/// Makes the steps of phases, one after the other.
///
/// Step k falls at the moment at which the position passes k - 1/2. What is left between the position at the whole moment
/// and there is kept exactly, so that roundings do not add up.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Stepper {
    /// Number of the next phase.
    phase: u8,
    /// Steps left in this phase.
    left: u32,
    /// Steps made, counted from the origin of the positions.
    count: u32,
    /// Moment of the last step, and the position that is left to it.
    t: u64,
    rest: i64,
    v: i64,
    a: i64,
    j6: i64,
    /// Speed and acceleration below their last bits: 2^-89 and 2^-121, so that they are summed exactly.
    v_low: u32,
    a_low: u32,
    /// Last interval and its last change.
    interval: u64,
    change: i64,
    /// At constant speed: the moment's part of the last step, and that of the interval, in 2^-64.
    part: u64,
    period_part: u64,
    cruise: bool,
    /// Moment at which the phase is over.
    end: u64,
}

/// The position that a time adds, and the state after it.
struct Ahead {
    dp: i64,
    v: i64,
    /// A sixth of the acceleration that is added.
    da6: (i64, u32),
    /// The low word of the speed that is added.
    low: u32,
}

impl Stepper {
    /// With `count` steps made.
    pub(super) const fn new(count: u32) -> Self {
        Self {
            phase: 0,
            left: 0,
            count,
            t: 0,
            rest: 0,
            v: 0,
            a: 0,
            j6: 0,
            v_low: 0,
            a_low: 0,
            interval: 0,
            change: 0,
            part: 0,
            period_part: 0,
            cruise: false,
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
        } else if self.cruise {
            let (part, carry) = self.part.overflowing_add(self.period_part);
            self.part = part;
            self.t = self.t.wrapping_add(self.interval).wrapping_add(carry.into());
        } else {
            self.ramp();
        }
        self.left = self.left.wrapping_sub(1);
        self.count = self.count.wrapping_add(1);
        Some(self.t)
    }

    /// The first step of the next phase that has one.
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
                (self.part, self.interval, self.period_part) = ((wait as u64) << 32, interval, part);
                self.cruise = true;
            }
            Kind::Slope { a, a_low, j6 } => {
                (self.rest, self.v, self.a, self.j6) = (ahead << WIDEN, phase.v, a, j6);
                (self.v_low, self.a_low, self.change, self.cruise) = (phase.v_low, a_low, 0, false);
                self.end = end;
                let first = self.first_guess();
                self.solve(self.rest, first);
            }
        }
    }

    /// From above where the speed grows, from below where it falls: Newton's steps then come nearer from one side.
    fn first_guess(&self) -> u32 {
        let bits = |x: i64| 64_u32.wrapping_sub(x.leading_zeros());
        let need = bits(self.rest);
        let mut guess = u32::MAX;
        let slowing = self.a < 0 || (self.a == 0 && self.j6 < 0);
        if self.v > 0 && (slowing || self.j6 < 0 || bits(self.v).wrapping_add(32) > need) {
            guess = u32::try_from(self.rest.checked_div(self.v).unwrap_or(0)).unwrap_or(u32::MAX);
            if slowing {
                return guess.min(self.left_of_phase());
            }
        }
        let power = |exponent: u32| 1_u32.checked_shl(exponent).unwrap_or(u32::MAX);
        if self.a > 0 && self.j6 >= 0 {
            guess = guess.min(power(need.saturating_add(33).saturating_sub(bits(self.a)).div_ceil(2)));
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

    /// The next step within a slope. The interval changes about as it did before.
    #[inline]
    fn ramp(&mut self) {
        let last = self.interval as u32;
        let guess = last.saturating_add_signed(self.change as i32).max(last >> 1);
        self.solve(self.rest.wrapping_add(STEP), guess);
        self.change = self.interval.wrapping_sub(u64::from(last)) as i64;
    }

    /// The last whole moment at which the position is not past `ahead`: Newton's steps from a guess.
    #[inline]
    fn solve(&mut self, ahead: i64, guess: u32) {
        let mut time = guess;
        let mut there = self.ahead(time);
        let mut rest = ahead.wrapping_sub(there.dp);
        for _ in 0..64 {
            if rest >= 0 && rest < there.v {
                break;
            }
            let Some(by) = quotient(rest, there.v) else { break };
            time = time.saturating_add_signed(by).min(self.left_of_phase());
            there = self.ahead(time);
            let new = ahead.wrapping_sub(there.dp);
            if new == rest {
                break;
            }
            rest = new;
        }
        self.t = self.t.wrapping_add(u64::from(time));
        self.rest = rest;
        let (low, carry) = self.v_low.overflowing_add(there.low);
        self.v_low = low;
        self.v = there.v.wrapping_add(i64::from(carry));
        if self.j6 != 0 {
            (self.a, self.a_low) = self.grown(there.da6, 6);
        }
        self.interval = u64::from(time);
    }

    /// `(v + bow / 2) · t`, each with its low word.
    #[inline]
    fn distance(&self, (bow, low): (i64, u32), t: u32) -> i64 {
        let wide = i64::from(t);
        let bow = bow.wrapping_mul(wide).wrapping_add(high_word(low, t)) >> 1;
        self.v.wrapping_mul(wide).wrapping_add(high_word(self.v_low, t)).wrapping_add(bow)
    }

    /// The acceleration and `times` times a sixth of what is added to it.
    #[inline]
    fn grown(&self, (high, low): (i64, u32), times: u8) -> (i64, u32) {
        let low = u64::from(low).wrapping_mul(times.into()).wrapping_add(self.a_low.into());
        let high = self.a.wrapping_add(high.wrapping_mul(times.into()));
        (high.wrapping_add((low >> 32) as i64), low as u32)
    }

    #[inline]
    fn ahead(&self, time: u32) -> Ahead {
        if self.j6 == 0 {
            let dv = wide_times((self.a, self.a_low), time);
            return Ahead { dp: self.distance(dv, time), v: self.v.wrapping_add(dv.0), da6: (0, 0), low: dv.1 };
        }
        let da6 = times(self.j6, time);
        let bow = wide_times(self.grown(da6, 2), time);
        let dv = wide_times(self.grown(da6, 3), time);
        Ahead { dp: self.distance(bow, time), v: self.v.wrapping_add(dv.0), da6, low: dv.1 }
    }
}

/// `x · t` in units of 2^32, and the word below.
#[inline]
fn times(x: i64, t: u32) -> (i64, u32) {
    let low = u64::from(x as u32).wrapping_mul(u64::from(t));
    ((x >> 32).wrapping_mul(i64::from(t)).wrapping_add((low >> 32) as i64), low as u32)
}

/// The same of a number with a word more below.
#[inline]
fn wide_times((high, low): (i64, u32), t: u32) -> (i64, u32) {
    let below = u64::from(low).wrapping_mul(u64::from(t)) >> 32;
    let middle = u64::from(high as u32).wrapping_mul(u64::from(t)).wrapping_add(below);
    ((high >> 32).wrapping_mul(i64::from(t)).wrapping_add((middle >> 32) as i64), middle as u32)
}

/// The high word of a product.
#[inline]
fn high_word(a: u32, b: u32) -> i64 {
    (u64::from(a).wrapping_mul(u64::from(b)) >> 32) as i64
}

/// `rest / v` to 14 bits, at least 1 away from 0 where it is not 0; rounded down. `None` at a standstill.
#[inline]
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
