//! From curves to segments: stretches of steps whose times are a cubic of their number, near enough.
//!
//! With r = 1 / v, w = a r² and y = j r³ at a place of a piece of constant jerk, the time at which the position is u steps further is
//!
//! ```text
//!  t(u) = t + r (u - w/2 u² + (3w² - y)/6 u³ - (15w³ - 10wy)/24 u⁴ + (105w⁴ - 105w²y + 10y²)/120 u⁵ - ...)
//! ```
//!
//! A segment takes the first three terms, at a place near its middle. The next two, doubled for all that follow, say how far off
//! it may be at its ends, and so how many steps it may have. Where that is less than two, near rest, a step's time is searched
//! by Newton's method, and the step is a segment of its own.

use crate::curve::{Bend, Curve, Piece};
use crate::phases::{Frame, P};
use crate::real::{Real, THIRD};

/// Steps of an axis on a curve as segments, one after the other.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Cutter {
    /// Steps made, counted from the origin of the positions.
    count: u32,
    /// The piece under way.
    piece: u8,
    /// The time of the curve at the last step; 0 at first.
    time: Real,
    /// How many steps the next segment may well have.
    hint: u32,
}

/// How a segment is to be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// How far off a step may be, in moments.
    pub(crate) off: Real,
    /// For a stop that nobody is to need: it may be off by an interval times 2 to this, too.
    pub(crate) coarse: Option<i32>,
    /// Time that its steps may take, in moments; one step may take longer.
    pub(crate) time: Real,
}

/// A stretch of steps. Times are in 2^-32 ticks, of the clock for the first step, differences after it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    pub(crate) count: u16,
    /// When its first step is made.
    pub(crate) first: i128,
    /// The second step after the first one, and the differences of that.
    pub(crate) differences: [i64; 3],
}

const QUARTER: Real = Real::fixed(1, 2);

/// Fraction bits of a tick, and of the number of a step.
const TICK: i32 = 32;
const STEP: u32 = 24;
const STEP_BITS: i32 = 24;

impl Stretch {
    /// When its last step is made, each interval added as the interrupt does.
    pub(crate) fn last(&self) -> i128 {
        let [interval, add, bend] = self.differences.map(i128::from);
        let n = u64::from(self.count).saturating_sub(1);
        // n, n (n - 1) / 2, n (n - 1) (n - 2) / 6 times: 2^48 at most.
        let pairs = n.wrapping_mul(n.saturating_sub(1)) >> 1;
        let triples = pairs.wrapping_mul(n.saturating_sub(2)).checked_div(3).unwrap_or(0);
        let [n, pairs, triples] = [n, pairs, triples].map(i128::from);
        let more =
            interval.wrapping_mul(n).wrapping_add(add.wrapping_mul(pairs)).wrapping_add(bend.wrapping_mul(triples));
        self.first.saturating_add(more)
    }
}

impl Cutter {
    pub(crate) const fn new() -> Self {
        Self { count: 0, piece: 0, time: Real::ZERO, hint: 2 }
    }

    /// Steps made, counted from the origin of the positions.
    pub(crate) const fn count(&self) -> u32 {
        self.count
    }

    /// The next steps; `None` after the last one.
    pub(crate) fn next(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> Option<Stretch> {
        let (piece, end, until) = loop {
            let (piece, end, until) = frame.piece(curve, self.piece)?;
            if until > self.count {
                break (piece, end, until);
            }
            self.piece = self.piece.saturating_add(1);
        };
        let from = self.time.max(piece.time).max(curve.skipped.0);
        let on = On { piece, frame, curve, end };
        let left = until.saturating_sub(self.count);
        let (count, stretch, last) =
            self.many(&on, from, left, demand).unwrap_or_else(|| on.single(self.count, from, demand));
        (self.count, self.time) = (self.count.saturating_add(count.into()), last);
        Some(stretch)
    }

    /// Two steps or more from a place near their middle.
    fn many(&mut self, on: &On<'_>, from: Real, left: u32, demand: &Demand) -> Option<(u16, Stretch, Real)> {
        let here = on.state(from);
        let even = here.a.is_zero() && here.j.is_zero();
        let mut count = if even { left } else { left.min(self.hint) };
        let pace = Real::ONE / here.v;
        let room = (demand.time / pace).to_fixed(0).min(match demand.coarse {
            _ if even => 0xffff,
            None => 1024,
            Some(_) => 2048,
        });
        count = count.min(u32::try_from(room).unwrap_or(u32::MAX));
        while count >= 2 {
            let middle = (from + pace * Real::fixed(count.into(), 1)).min(on.end).max(from);
            let state = on.state(middle);
            let series = Series::new(&state, on.behind(self.count, &state));
            let most = demand.coarse.map_or(demand.off, |by| demand.off.max(series.r.scaled(by)));
            match series.off(count) {
                Ok(off) if off <= most => {
                    if !even {
                        // Twice as many steps are 16 times as far off.
                        let room = most.exponent().saturating_sub(off.exponent()).clamp(0, 16);
                        let quarter = if room > 1 { count >> 2 } else { 0 };
                        self.hint = (count << (room >> 2)).saturating_add(quarter);
                    }
                    let count = u16::try_from(count).ok()?;
                    let (stretch, last) = series.cut(on, middle, count)?;
                    return Some((count, stretch, last));
                }
                Ok(off) => {
                    let much = off.exponent().saturating_sub(most.exponent()).clamp(4, 64);
                    count = count.checked_shr(much.unsigned_abs() >> 2).unwrap_or(0);
                }
                Err(doublings) => count = count.checked_shr(doublings).unwrap_or(0),
            }
        }
        self.hint = 2;
        None
    }
}

/// A piece of a curve on an axis.
struct On<'c> {
    piece: &'c Piece,
    frame: &'c Frame,
    curve: &'c Curve,
    end: Real,
}

impl On<'_> {
    /// The state at a time of the curve, in steps of the axis.
    fn state(&self, time: Real) -> Piece {
        let piece = self.piece.after(time - self.piece.time);
        let scale = self.frame.scale;
        Piece { v: piece.v * scale, a: piece.a * scale, j: piece.j * scale, ..piece }
    }

    /// The steps from a state to the place at which step `count` (from 0) is made: ahead, and behind.
    fn behind(&self, count: u32, state: &Piece) -> (Real, Real) {
        let (want, over) = self.target(count);
        let made = self.frame.made(self.curve, state.p) + over;
        (want - made, made - want)
    }

    /// How far step `count` is from where the curve begins: ahead, and behind, for it may have been due when a request came.
    fn target(&self, count: u32) -> (Real, Real) {
        let at = (i64::from(count) << P).saturating_add(1 << 31);
        let away = at.saturating_sub(self.frame.from);
        let size = Real::fixed(away.unsigned_abs(), P);
        if away < 0 { (Real::ZERO, size) } else { (size, Real::ZERO) }
    }

    /// A time of the curve on the clock, in 2^-32 ticks.
    fn tick(&self, time: Real) -> i128 {
        let bits = TICK.saturating_sub(i32::try_from(self.frame.shift).unwrap_or(0));
        let since = self.frame.since(self.curve, time).to_wide(bits);
        (i128::from(self.frame.begin) << bits.unsigned_abs()).saturating_add(since)
    }

    /// The next step alone, from a time that is not after it.
    fn single(&self, count: u32, from: Real, demand: &Demand) -> (u16, Stretch, Real) {
        let time = self.search(count, from, demand);
        (1, Stretch { count: 1, first: self.tick(time), differences: [0; 3] }, time)
    }

    /// The time of a step: Newton's method between the times that are known to be too early and late enough; if it takes long,
    /// halving.
    fn search(&self, count: u32, from: Real, demand: &Demand) -> Real {
        let here = self.state(from);
        let (way, _) = self.behind(count, &here);
        let (mut low, mut high) = (from, self.end.max(from));
        let mut time = (from + guess(way, &here)).min(high);
        let enough = demand.off.scaled(-4);
        for round in 0..48_u8 {
            let state = self.state(time);
            let (ahead, past) = self.behind(count, &state);
            if ahead.is_zero() {
                high = time;
            } else {
                low = time;
            }
            let by = ahead.max(past) / state.v;
            let near = demand.coarse.map_or(enough, |by| enough.max((time - from).scaled(by)));
            if by < near || (high - low) < near {
                break;
            }
            let next = time.along(by, past.is_zero());
            time = if round % 8 < 7 && next > low && next < high { next } else { (low + high).half() };
        }
        time
    }
}

/// About the time for a way, at least as much as it takes without the greatest of the three; the power of 2 above a root.
fn guess(way: Real, here: &Piece) -> Real {
    let mut time = way / here.v;
    if here.up || here.bend == Bend::Growing {
        let root = |x: Real, n: i32| {
            let exponent = x.exponent().saturating_add(1);
            Real::ONE.scaled(exponent.div_euclid(n).saturating_add(i32::from(exponent.rem_euclid(n) > 0)))
        };
        if here.up && !here.a.is_zero() {
            time = time.min((way.scaled(1) / here.a).sqrt());
        }
        if here.up && here.bend == Bend::Growing && !here.j.is_zero() {
            let cube = way * Real::new(6) / here.j;
            time = time.min(root(cube, 3));
        }
    }
    time
}

/// The terms of the time at a place, and the place of a segment's first step from there.
struct Series {
    r: Real,
    w: Real,
    y: Real,
    /// The speed grows, and the acceleration with the sign of its effect on the time: 3w² - y or 3w² + y.
    up: bool,
    faster: bool,
    /// The first step: ahead, or behind.
    first: (Real, Real),
}

impl Series {
    fn new(state: &Piece, first: (Real, Real)) -> Self {
        let r = Real::ONE / state.v;
        let squared = r.squared();
        let faster = state.up == (state.bend != Bend::Fading);
        Self { r, w: state.a * squared, y: state.j * squared * r, up: state.up, faster, first }
    }

    /// How far off the steps are at most, in moments; or how often their number is to be halved for the series to end soon enough.
    fn off(&self, count: u32) -> Result<Real, u32> {
        let Self { r, w, y, first: (ahead, behind), .. } = *self;
        if w.is_zero() && y.is_zero() {
            return Ok(Real::ZERO);
        }
        let length = Real::new(count.saturating_sub(1).into());
        let h = if ahead.is_zero() { behind.max(length - behind) } else { ahead + length };
        let (wh, yh) = (w * h, y * h.squared());
        let most = wh.exponent().max(yh.exponent().saturating_add(1) >> 1).saturating_add(3);
        if wh > QUARTER || yh > QUARTER {
            return Err(most.max(1).unsigned_abs());
        }
        let square = wh.squared();
        let fourth = (square * wh * Real::new(15) + wh * yh * Real::new(10)) / Real::new(12);
        let fifth = (square.squared() * Real::new(105) + square * yh * Real::new(105) + yh.squared() * Real::new(10))
            / Real::new(60);
        Ok(r * h * (fourth + fifth))
    }

    /// The segment, and the time of the curve at its last step.
    fn cut(&self, on: &On<'_>, middle: Real, count: u16) -> Option<(Stretch, Real)> {
        let Self { r, w, y, up, faster, first: (ahead, behind) } = *self;
        let bits = TICK.saturating_sub(i32::try_from(on.frame.shift).unwrap_or(0));
        let signed = |x: Real, plus: bool, bits: i32| {
            let size = x.to_wide(bits.saturating_add(1)).saturating_add(1) >> 1;
            if plus { size } else { size.saturating_neg() }
        };
        let (square, third) = ((w.squared() * Real::new(3)), y);
        let (c3, plus) = match faster {
            true if square < third => (third - square, false),
            true => (square - third, true),
            false => (square + third, true),
        };
        // Of 2^-32 ticks, the second with 24 bits more, the third with 8.
        let c1 = r.to_wide(bits);
        let c2 = signed((r * w).half(), !up, bits.saturating_add(24));
        let c3 = signed(r * c3 * THIRD.half(), plus, bits.saturating_add(24));
        let place = |x: Real, plus| signed(x, plus, STEP_BITS);
        let u = if ahead.is_zero() { place(behind, false) } else { place(ahead, true) };
        // No sum or product comes near 2^127, as the third term is less than the second, and that less than the first.
        let down = |x: i128, by: u32| x >> by;
        // c1 u + c2 u² + c3 u³
        let at = |u: i128| {
            let inner = c2.wrapping_add(down(c3.wrapping_mul(u), STEP));
            let inner = c1.wrapping_add(down(down(inner, 12).wrapping_mul(u), STEP.wrapping_add(12)));
            down(inner.wrapping_mul(u), STEP)
        };
        let one = 1_i128 << STEP;
        let double = u.wrapping_mul(2).wrapping_add(one);
        let cubic = u.wrapping_mul(u.wrapping_add(one)).wrapping_mul(3);
        let cubic = down(cubic, STEP).wrapping_add(one);
        let narrow = |x: i128| i64::try_from(x).ok();
        let interval = c1.wrapping_add(down(
            down(c2, 12).wrapping_mul(double).wrapping_add(down(c3, 12).wrapping_mul(cubic)),
            STEP.wrapping_add(12),
        ));
        let add = down(c2, 23)
            .wrapping_add(down(down(c3, 8).wrapping_mul(u.wrapping_add(one)).wrapping_mul(6), STEP.wrapping_add(16)));
        let bend = down(c3.wrapping_mul(6), 24);
        let differences = [narrow(interval)?, narrow(add)?, narrow(bend)?];
        let last = u.wrapping_add(i128::from(count.saturating_sub(1)) << STEP);
        // Where the segment ends, for the next one to look from: the fraction of a tick does not matter.
        let size = u64::try_from(at(last).unsigned_abs()).ok()?;
        let time = middle.along(Real::fixed(size, bits), last >= 0).max(on.piece.time);
        Some((Stretch { count, first: on.tick(middle).saturating_add(at(u)), differences }, time))
    }
}
