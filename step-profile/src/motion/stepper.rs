//! From curves to the ticks of steps.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "words of wider numbers"
)]

use super::cubic::Cubic;
use super::curve::{Bend, Curve, Piece};
use super::phases::Frame;
use super::real::{Real, THIRD};

/// Makes the steps of an axis on a curve, one after the other.
///
/// Step k falls into the tick nearest to the time at which the position passes k - 1/2. On a piece with an acceleration the
/// next tick is foreseen from the last two intervals, and the exact position at it says whether that was right.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Stepper {
    /// Tick of the last step, if the speed is not constant.
    t: u64,
    /// Steps left in this piece.
    left: u32,
    /// Steps made at its end, counted from the origin of the positions.
    until: u32,
    /// The last tick of the piece.
    end: u64,
    guess: Guess,
    mode: Mode,
    /// Number of the next piece.
    piece: u8,
}

#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Mode {
    /// Constant speed: from step to step, and the time of the last one, in 2^-64 ticks.
    Cruise { interval: u128, time: u128 },
    /// Constant acceleration.
    Slope(Cubic<i64>),
    /// Constant jerk.
    Bend(Cubic<i64>),
    /// Either, if it lasts too long for 64 bits; with the last two intervals.
    Long(Cubic<i128>, u64, u64),
}

/// Bits of a part of a tick in a [`Guess`], which foresees intervals of up to 2^20 ticks with them.
const PART: u32 = 11;
/// Rounds up.
const CEIL: u32 = (1 << PART) - 1;

/// Foresees intervals, in 2^-11 ticks.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Guess {
    /// The last one.
    interval: u32,
    /// What it was longer than the one before.
    change: u32,
    /// How long before the middle of its tick the last step was due.
    late: u32,
    /// Ticks to the next step, rounded up.
    next: u32,
    /// Steps a unit: 2^43 over the high word of a step.
    rate: u32,
}

impl Guess {
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
        self.next = next.wrapping_sub(late).wrapping_add(CEIL);
        (self.interval, self.change, self.late) = (interval, change, late);
    }

    /// From the speed alone.
    fn start(&mut self, cubic: &Cubic<i64>) {
        let high = (cubic.step >> 32) as u32;
        self.rate = u32::MAX.checked_div(high >> PART).unwrap_or(0);
        let ticks = cubic.interval().min(1 << 19);
        let (interval, off) = ((ticks as u32) << PART, cubic.off.max(0));
        (self.interval, self.change, self.late) = (interval, 0, 0);
        self.learn(ticks as u32, off);
        self.next = interval.wrapping_sub(self.late).wrapping_add(CEIL);
        (self.interval, self.change) = (interval, 0);
    }

    /// After a wrong guess the next one is within half an interval of the last.
    fn bound(&mut self) {
        let half = self.interval >> 1;
        self.next = self.next.max(half).min(self.interval.saturating_add(half));
    }

    #[inline]
    const fn ticks(&self) -> u32 {
        self.next >> PART
    }
}

impl Stepper {
    /// With no step made.
    pub(super) const fn new() -> Self {
        Self {
            t: 0,
            left: 0,
            until: 0,
            end: 0,
            guess: Guess { interval: 0, change: 0, late: 0, next: 0, rate: 0 },
            mode: Mode::Cruise { interval: 0, time: 0 },
            piece: 0,
        }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        self.until.saturating_sub(self.left)
    }

    /// The tick of the next step.
    #[inline(always)]
    pub(super) fn next(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        let Some(left) = self.left.checked_sub(1) else { return self.begin(curve, frame) };
        self.left = left;
        let by = self.guess.ticks();
        let there = match &mut self.mode {
            Mode::Cruise { interval, time } => {
                *time = time.wrapping_add(*interval);
                return Some((*time >> 64) as u64);
            }
            Mode::Slope(cubic) => {
                let there = cubic.straight(by.into());
                there.is_surely_there().then(|| {
                    *cubic = there;
                    there.off
                })
            }
            Mode::Bend(cubic) => {
                let there = cubic.bent(by.into());
                there.is_surely_there().then(|| {
                    *cubic = there;
                    there.off
                })
            }
            Mode::Long(..) => None,
        };
        match there {
            Some(off) => {
                self.guess.learn(by, off);
                self.t = self.t.wrapping_add(by.into());
            }
            None => self.correct(),
        }
        Some(self.t)
    }

    /// All steps that are left, in order.
    pub(super) fn fold<B>(mut self, curve: &Curve, frame: &Frame, init: B, mut take: impl FnMut(B, u64) -> B) -> B {
        let mut sum = init;
        while let Some(tick) = self.next(curve, frame) {
            sum = take(sum, tick);
            sum = match self.mode {
                Mode::Cruise { interval, mut time } => {
                    for _ in 0..self.left {
                        time = time.wrapping_add(interval);
                        sum = take(sum, (time >> 64) as u64);
                    }
                    self.left = 0;
                    sum
                }
                Mode::Slope(cubic) => self.foreseen(cubic, Cubic::straight, sum, &mut take),
                Mode::Bend(cubic) => self.foreseen(cubic, Cubic::bent, sum, &mut take),
                Mode::Long(..) => sum,
            };
        }
        sum
    }

    /// The steps of a piece up to its end, or to one that is foreseen wrongly.
    #[inline(always)]
    fn foreseen<B>(
        &mut self,
        mut cubic: Cubic<i64>,
        after: impl Fn(&Cubic<i64>, u64) -> Cubic<i64>,
        mut sum: B,
        take: &mut impl FnMut(B, u64) -> B,
    ) -> B {
        let Self { t, left, guess, mode, .. } = self;
        let (mut tick, mut more, mut own) = (*t, *left, *guess);
        while more > 0 {
            let mut by = own.ticks();
            let mut there = after(&cubic, by.into());
            if !there.is_surely_there() {
                // Most often wrong by one tick.
                by = if there.off < 0 { by.wrapping_add(1) } else { by.wrapping_sub(1) };
                there = after(&cubic, by.into());
                if !there.is_surely_there() {
                    break;
                }
            }
            own.learn(by, there.off);
            (cubic, more, tick) = (there, more.wrapping_sub(1), tick.wrapping_add(by.into()));
            sum = take(sum, tick);
        }
        (*t, *left, *guess) = (tick, more, own);
        if let Mode::Slope(place) | Mode::Bend(place) = mode {
            *place = cubic;
        }
        sum
    }

    /// The next step, foreseen wrongly.
    #[cold]
    #[inline(never)]
    fn correct(&mut self) {
        let last = self.end.saturating_sub(self.t);
        let by = match &mut self.mode {
            Mode::Cruise { .. } => 0,
            Mode::Slope(cubic) | Mode::Bend(cubic) => {
                let (by, there) = cubic.beside(self.guess.ticks().into(), last);
                *cubic = there;
                self.guess.learn(by as u32, there.off.max(0));
                self.guess.bound();
                by
            }
            Mode::Long(cubic, interval, before) => {
                let guess = interval.saturating_mul(2).saturating_sub(*before).max(*interval >> 1);
                let (by, there) = cubic.solve(guess.min(interval.saturating_mul(2)), last);
                (*cubic, *interval, *before) = (there, by, *interval);
                by
            }
        };
        self.t = self.t.saturating_add(by);
    }

    /// The first step of the next piece that has one.
    #[cold]
    #[inline(never)]
    fn begin(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        loop {
            let count = self.count();
            let (piece, end, until) = frame.piece(curve, self.piece)?;
            self.piece = self.piece.saturating_add(1);
            if until > count {
                (self.until, self.left) = (until, until.wrapping_sub(count).wrapping_sub(1));
                return Some(self.enter(count, curve, frame, &piece, end));
            }
        }
    }

    fn enter(&mut self, count: u32, curve: &Curve, frame: &Frame, piece: &Piece, end: Real) -> u64 {
        let scale = |x: Real, power: i32| (x * frame.scale).scaled((frame.shift as i32).wrapping_mul(power));
        let target = (i64::from(count) << 32).wrapping_add(1 << 31);
        // Where the step is made from the begin of the curve on: behind it, if it was due when a request came.
        let want = Real::fixed(target.saturating_sub(frame.from).max(0).unsigned_abs(), 32);
        let over = Real::fixed(frame.from.saturating_sub(target).max(0).unsigned_abs(), 32);
        if piece.a.is_zero() && piece.j.is_zero() {
            let made = frame.made(curve, piece.p);
            let late = made + over > want;
            let way = if late { (want + Real::ONE) - (made + over) } else { want - made };
            let begin = frame.since(curve, piece.time);
            let (t, past) = frame.middle(begin + way / (piece.v * frame.scale));
            let interval = Real::ONE / scale(piece.v, 1);
            let wide = |whole: u64, part: Real| u128::from(whole) << 64 | u128::from(part.to_fixed(64));
            let interval = wide(interval.to_fixed(0), interval.fraction());
            let time = wide(t, past.scaled((frame.shift as i32).wrapping_neg()));
            // The time of a late step is an interval before that of the next one.
            self.mode = Mode::Cruise { interval, time: if late { time.wrapping_sub(interval) } else { time } };
            return if late { frame.middle(begin).0 } else { t };
        }
        let (tick, wait) = frame.sample(curve, piece.time);
        let (until, _) = frame.sample(curve, end);
        let ahead = |p: Real| {
            let made = frame.made(curve, p) + over;
            (want - made, made - want)
        };
        let straight = piece.bend == Bend::Flat;
        let inverse = Real::ONE / if straight { scale(piece.a.half(), 2) } else { scale(piece.j.half() * THIRD, 3) };
        // A step is 2^58 units at least, if the unit then is neither too large nor a step too short to be foreseen.
        let bits = 58_i32.saturating_sub(inverse.exponent());
        (self.t, self.end) = (tick, until.max(tick));
        let last = self.end.wrapping_sub(tick);
        let by = if (10..=50).contains(&bits) {
            let (by, cubic) = Cubic::new(piece, wait, (inverse, bits, frame.shift as i32), scale, ahead).first(last);
            self.guess.start(&cubic);
            self.mode = if straight { Mode::Slope(cubic) } else { Mode::Bend(cubic) };
            by
        } else {
            let bits = 117_i32.saturating_sub(inverse.exponent()).clamp(0, 50);
            let (by, cubic) = Cubic::new(piece, wait, (inverse, bits, frame.shift as i32), scale, ahead).first(last);
            let interval = cubic.interval();
            self.mode = Mode::Long(cubic, interval, interval);
            by
        };
        self.t = tick.saturating_add(by);
        self.t
    }
}
