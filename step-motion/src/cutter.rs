//! From curves to segments: stretches of steps whose times are, closely enough, a cubic of their number.
//!
//! A segment joins two steps, and has the time and the pace of both. With r = 1 / v, w = a r² and y = j r³ at its start, the time
//! at which the position is u steps further is
//!
//! ```text
//!  t(u) = r (u - w/2 u² + (3w² - y)/6 u³ - (15w³ - 10wy)/24 u⁴ + (105w⁴ - 105w²y + 10y²)/120 u⁵ - ...)
//! ```
//!
//! The next two terms say about how many steps the segment may have. The first three say about when its last step is made, the position there says
//! exactly when. What they miss by there is 24 / 384, a sixteenth, of what the segment is off in its middle, if the fourth derivative is the
//! same everywhere. A sixth is taken.
//!
//! Within a piece all is in parts of it: times in parts of its time, positions in parts of its way, in words of 64 bits. With t from 0 to 1
//! a position is c1 t + c2 t² + c3 t³, from 0 to 1 as well, and no coefficient is above 3/2.
//!
//! A step that is a segment of its own, near rest and at the start of a piece, is searched by Newton's method. Each piece is
//! seen from
//! the end at which it is slower, backwards in time if need be: so the position is a convex function of the time, and no search goes astray.

use crate::curve::{Bend, Curve};
use crate::phases::{Frame, P};
use crate::real::{Inverse, Real, THIRD, high};

/// Steps of an axis on a curve as segments, one after another.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Cutter {
    /// Steps made, counted from the origin of the positions.
    count: u32,
    /// The piece after the one under way, and the steps made where that ends.
    next: u8,
    until: u32,
    piece: Part,
    /// Time from the slower end of the piece to the last step, and the speed then; none before the first one of the piece.
    last: Option<(u64, Inverse)>,
    /// Steps that have been counted, and are not a stretch yet.
    few: Option<Few>,
}

/// What a part of the work gives.
pub(crate) enum Slice {
    More,
    Steps(Stretch),
    /// There was the last step.
    End,
}

/// Up to four steps, which are a segment whatever the curve is.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Few {
    stretch: Stretch,
    /// The last time, and the differences there.
    time: i128,
    interval: i64,
    add: i64,
}

/// A piece from its slower end. Times are in 2^-64 of its time, ways and speeds in 2^-62 of its way and of that in its time.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Part {
    /// The speed, half the acceleration and a sixth of the jerk at the slower end, which is the end of the piece.
    speed: u64,
    half: u64,
    sixth: u64,
    /// The jerk adds to the acceleration.
    grows: bool,
    back: bool,
    /// Constant speed: there are no parts of it.
    even: bool,
    /// When and where the slower end is: in 2^-32 ticks of the clock, and 2^-64 steps from where the positions are 0.
    begin: i128,
    origin: i128,
    /// What the piece takes, and what a step takes at its mean speed, in 2^-32 ticks.
    lasts: Real,
    pace: Real,
    /// Its way, with the power of 2 of its unit, and a step of it.
    way: (Inverse, i32),
    step: u64,
    /// How far off a step may be.
    off: u64,
}

/// How a segment is to be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// How far off a step may be, in moments.
    pub(crate) off: Real,
    /// For a stop that is only a precaution: it may also be off by an interval times 2 to the power of minus this.
    pub(crate) coarse: Option<u32>,
    /// Time that its steps may take, in 2^-32 ticks; one step may take longer.
    pub(crate) time: u64,
}

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

/// As many steps are a segment whatever the curve is: each is searched.
const FEW: u16 = 4;
/// Fraction bits of a position here.
const P2: i32 = 2 * P;
/// Intervals within a segment are below 2^28 ticks, so that three of them are no overflow.
const LONGEST: u64 = 1 << 60;

impl Stretch {
    /// When its last step is made, each interval added as the interrupt does.
    pub(crate) fn last(&self) -> i128 {
        self.time(self.count.saturating_sub(1))
    }

    /// When a step is made, from 0.
    fn time(&self, n: u16) -> i128 {
        let [interval, add, bend] = self.differences.map(i128::from);
        let n = u64::from(n);
        // n, n (n - 1) / 2, n (n - 1) (n - 2) / 6 times: 2^48 at most.
        let pairs = n.wrapping_mul(n.saturating_sub(1)) >> 1;
        let triples = pairs.wrapping_mul(n.saturating_sub(2)).checked_div(3).unwrap_or(0);
        let [n, pairs, triples] = [n, pairs, triples].map(i128::from);
        let more =
            interval.wrapping_mul(n).wrapping_add(add.wrapping_mul(pairs)).wrapping_add(bend.wrapping_mul(triples));
        self.first.saturating_add(more)
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

impl Cutter {
    pub(crate) const fn new() -> Self {
        Self { count: 0, next: 0, until: 0, piece: Part::NONE, last: None, few: None }
    }

    /// Steps made, counted from the origin of the positions.
    pub(crate) const fn count(&self) -> u32 {
        self.count
    }

    /// The next steps; `None` after the last one.
    pub(crate) fn next(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> Option<Stretch> {
        loop {
            match self.slice(curve, frame, demand) {
                Slice::More => {}
                Slice::Steps(stretch) => return Some(stretch),
                Slice::End => return None,
            }
        }
    }

    /// A part of the work for the next steps.
    pub(crate) fn slice(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> Slice {
        if let Some(few) = self.few.take() {
            return self.search(few, demand);
        }
        if self.count >= self.until {
            return if self.take_piece(curve, frame, demand) { Slice::More } else { Slice::End };
        }
        let left = self.left();
        if self.piece.even {
            let stretch = self.piece.cruise(self.count, left, demand.time);
            self.count = self.count.saturating_add(stretch.count.into());
            return Slice::Steps(stretch);
        }
        if let Some((stretch, last)) = self.last.and_then(|last| self.piece.many(self.count, left, last, demand)) {
            (self.last, self.count) = (Some(last), self.count.saturating_add(stretch.count.into()));
            return Slice::Steps(stretch);
        }
        self.search(Few::NONE, demand)
    }

    /// Steps left of the piece.
    const fn left(&self) -> u32 {
        self.until.saturating_sub(self.count)
    }

    /// The next piece with steps; false after the last one.
    fn take_piece(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> bool {
        while self.count >= self.until {
            let Some((piece, end, until)) = frame.piece(curve, self.next) else { return false };
            self.next = self.next.saturating_add(1);
            if until > self.count {
                self.piece = Part::new(curve, frame, (piece, end), demand.off);
                (self.until, self.last) = (until, None);
            }
        }
        true
    }

    /// The next two steps of some that are searched one by one.
    fn search(&mut self, mut few: Few, demand: &Demand) -> Slice {
        for _ in 0..self.left().min(2) {
            let coarse = demand.coarse.zip(self.last).map_or(0, |(by, (_, v))| v.of(self.piece.step) >> by);
            let near = self.piece.off.max(coarse) >> 4;
            let (time, speed) = self.piece.search(self.count, self.last, near);
            if !few.add(self.piece.tick(time), demand.time.min(LONGEST)) {
                return Slice::Steps(few.stretch);
            }
            // A step that was due before the piece began is made there, and has not its place: no segment begins at it.
            let since = if self.piece.back { !time } else { time };
            (self.last, self.count) = ((since > near).then_some((time, speed)), self.count.saturating_add(1));
            if self.last.is_none() {
                return Slice::Steps(few.stretch);
            }
        }
        if self.left() > 0 && few.stretch.count < FEW {
            self.few = Some(few);
            return Slice::More;
        }
        Slice::Steps(few.stretch)
    }

    /// When a step of the piece under way is made, as exactly as there are digits.
    pub(crate) fn exact(&self, count: u32) -> i128 {
        if self.piece.even {
            return self.piece.cruise(count, 1, 0).first;
        }
        let (time, _) = self.piece.search(count, None, 0);
        self.piece.tick(time)
    }
}

impl Few {
    const NONE: Self =
        Self { stretch: Stretch { count: 0, first: 0, differences: [0; 3] }, time: 0, interval: 0, add: 0 };

    /// Adds a step at a time, if that is within `longest` of the first one.
    fn add(&mut self, time: i128, longest: u64) -> bool {
        let Stretch { count, first, differences } = &mut self.stretch;
        if *count == 0 {
            *first = time;
        } else {
            if time.saturating_sub(*first) > i128::from(longest) {
                return false;
            }
            let interval = i64::try_from(time.saturating_sub(self.time)).unwrap_or(0);
            let add = interval.wrapping_sub(self.interval);
            match *count {
                1 => differences[0] = interval,
                2 => differences[1] = add,
                _ => differences[2] = add.wrapping_sub(self.add),
            }
            (self.interval, self.add) = (interval, add);
        }
        (*count, self.time) = (count.saturating_add(1), time);
        true
    }
}

/// A position, the speed and half the acceleration there.
struct Place {
    p: u64,
    v: u64,
    half: u64,
}

impl Part {
    const NONE: Self = Self {
        speed: 0,
        half: 0,
        sixth: 0,
        grows: false,
        back: false,
        even: true,
        begin: 0,
        origin: 0,
        lasts: Real::ZERO,
        pace: Real::ZERO,
        way: (Inverse::ONE, 0),
        step: 0,
        off: 0,
    };

    /// Of a piece with its end, or of what is left of it where the curve was joined.
    fn new(curve: &Curve, frame: &Frame, (piece, end): (&crate::curve::Piece, Real), off: Real) -> Self {
        let begin = piece.time.max(curve.skipped.0);
        let first = piece.after(begin - piece.time);
        let even = piece.a.is_zero() && piece.j.is_zero();
        let back = !piece.up && !even;
        let time = end - begin;
        let slow = if back { first.after(time) } else { first };
        let scale = frame.scale;
        let bits = 32_i32.saturating_sub(i32::try_from(frame.shift).unwrap_or(0));
        let ticks = |time: Real| time.scaled(bits);
        let since = frame.since(curve, slow.time).to_wide(bits);
        let steps = |p: Real| (p * scale).to_wide(P2);
        let own = Self {
            even,
            back,
            grows: (piece.bend != Bend::Fading) != back,
            begin: (i128::from(frame.begin) << bits.unsigned_abs()).saturating_add(since),
            origin: (i128::from(frame.from) << P).saturating_add(steps(slow.p)).saturating_sub(steps(curve.skipped.1)),
            ..Self::NONE
        };
        if even {
            return Self { pace: ticks(Real::ONE / (piece.v * scale)), ..own };
        }
        let (v, a, j) =
            (slow.v * time, slow.a * time.squared().half(), slow.j * (time.squared() * time) * (THIRD.half()));
        let all = (v + a).along(j, own.grows);
        let per = Real::ONE / all;
        let part = |x: Real| (x * per).to_fixed(62);
        let way = all * scale;
        Self {
            speed: part(v),
            half: part(a),
            sixth: part(j),
            lasts: ticks(time),
            pace: ticks(time) / way,
            way: way.inverse(),
            step: (Real::ONE / way).to_fixed(62),
            off: (off / time).to_fixed(64),
            ..own
        }
    }

    /// 2^-64 steps from the slower end to where step `count` (from 0) is made; below 0 or beyond the other end if it was due when a
    /// request came.
    fn away(&self, count: u32) -> i128 {
        let at = (i128::from(count) << P2).saturating_add(1 << (P2 - 1)).saturating_sub(self.origin);
        if self.back { at.saturating_neg() } else { at }
    }

    /// The same as a part of the way.
    fn target(&self, count: u32) -> u64 {
        let (way, unit) = self.way;
        let away = self.away(count).max(0);
        let down = unit.saturating_add(P2);
        let away = if down < 0 { away << down.unsigned_abs().min(63) } else { away >> down.unsigned_abs().min(127) };
        way.of(u64::try_from(away).unwrap_or(u64::MAX)) >> 2
    }

    /// A time on the clock, in 2^-32 ticks.
    fn tick(&self, time: u64) -> i128 {
        let since = self.lasts.times(time, -64);
        if self.back { self.begin.saturating_sub(since) } else { self.begin.saturating_add(since) }
    }

    /// Up to `left` steps at constant speed.
    fn cruise(&self, count: u32, left: u32, time: u64) -> Stretch {
        let interval = self.pace.to_fixed(0);
        let away = self.away(count);
        let (far, wide) = (away.max(0).unsigned_abs(), 64_u32.saturating_sub(away.max(0).leading_zeros()));
        let far = u64::try_from(far >> wide).unwrap_or(u64::MAX);
        let first = self.begin.saturating_add(self.pace.times(far, P2.saturating_neg().saturating_add_unsigned(wide)));
        let room =
            if away < 0 || interval >= LONGEST { 0 } else { time.checked_div(interval).unwrap_or(0).min(0xffff) };
        let count = u64::from(left).min(room.max(1));
        let interval = i64::try_from(interval).unwrap_or(0);
        Stretch { count: u16::try_from(count).unwrap_or(1), first, differences: [interval, 0, 0] }
    }

    fn at(&self, time: u64) -> Place {
        let bent = high(self.sixth, time);
        let bow = high(along(self.half, bent, self.grows), time);
        let thrice = bent.wrapping_mul(3);
        Place {
            p: high(self.speed.wrapping_add(bow), time),
            v: self.speed.wrapping_add(high(along(self.half << 1, thrice, self.grows), time)),
            half: along(self.half, thrice, self.grows),
        }
    }

    /// Two steps or more from the last one on: what the last of them leaves, too.
    fn many(
        &self,
        count: u32,
        left: u32,
        (time, v): (u64, Inverse),
        demand: &Demand,
    ) -> Option<(Stretch, (u64, Inverse))> {
        let pace = self.pace.over(v);
        if pace >= LONGEST {
            return None;
        }
        let step = v.of(self.step);
        // Of one step: w / 2. Five steps are not to be more than half of the way to rest.
        let half = self.at(time).half;
        let w = v.of(high(half, step));
        if left >= FEW.into() && w > u64::MAX / 20 {
            return None;
        }
        let y = v.of(high(high(self.sixth, step), step));
        // How far the first three terms may miss.
        let most = demand.coarse.map_or(self.off, |by| self.off.max(step >> by)).saturating_mul(6);
        let long = if demand.coarse.is_some() { 2048 } else { 512 };
        let mut n = about(step, w, y, most).min(left).min(long);
        if pace.saturating_mul(n.into()) > demand.time {
            n = u32::try_from(demand.time.checked_div(pace).unwrap_or(0)).unwrap_or(n);
        }
        let least = left.clamp(2, u32::from(FEW).saturating_add(1));
        while n >= least {
            let x = step.saturating_mul(n.into());
            let (w, y) = (w.saturating_mul(n.into()), y.saturating_mul(u64::from(n).wrapping_mul(n.into())));
            // Half of the way to rest, or as far again as from there, by the greater speed at either end: beyond it the derivative is too far from the same everywhere.
            if w.saturating_add(y.saturating_mul(3)) > u64::MAX >> if self.back { 3 } else { 2 } {
                n = n.saturating_sub((n >> 2).max(1));
                continue;
            }
            let ahead = along(x, high(x, w), self.back).saturating_add(high(x, high(w, w)) << 1);
            let ahead = along(ahead, high(x, y), !self.grows);
            let there = along(time, ahead, !self.back);
            // The end of the piece is as far as a place can be; where they lead beyond it, that is missed, too.
            let beyond = ahead.saturating_sub(if self.back { time } else { !time });
            let Place { p, v, half } = self.at(there);
            let way = self.target(count.saturating_add(n).saturating_sub(1));
            let miss = Inverse::new(v).of(p.abs_diff(way));
            if miss.saturating_add(beyond) <= most {
                let there = along(there, miss, p < way);
                let v_there = Inverse::new(along(v, high(half, miss) << 1, p < way));
                let mean = self.lasts.times(time.abs_diff(there), -64);
                let stretch =
                    self.join(n, time, [pace, u64::try_from(mean).unwrap_or(u64::MAX), self.pace.over(v_there)])?;
                return Some((stretch, (there, v_there)));
            }
            n = n.saturating_sub((n >> 2).max(1));
        }
        None
    }

    /// The segment between two steps from the paces at both, and the time between.
    fn join(&self, count: u32, time: u64, [first, all, last]: [u64; 3]) -> Option<Stretch> {
        if first.max(last) >= LONGEST || all == u64::MAX {
            return None;
        }
        let per = part(count);
        let [first, mean, last] = [first, high(all, per), last].map(|pace| i64::try_from(pace).unwrap_or(0));
        let n = i64::from(count);
        // first u + b u² + c u³; what rounding takes from c is given to b, so that the end is met.
        let bow = first.wrapping_add(last).wrapping_sub(mean << 1);
        let c6 = times(times(bow.wrapping_mul(6), per), per);
        let sixth = |x: i64| times(x, SIXTH);
        let slant = mean.wrapping_sub(first).wrapping_sub(sixth(c6.wrapping_mul(n).wrapping_mul(n)));
        let (b2, c) = (times(slant << 1, per), sixth(c6));
        let start = first.wrapping_add(b2 >> 1).wrapping_add(c);
        Some(Stretch {
            count: u16::try_from(count).ok()?,
            first: self.tick(time).saturating_add(start.into()),
            differences: [start.wrapping_add(b2).wrapping_add(c6), b2.wrapping_add(c6 << 1), c6],
        })
    }

    /// The time from the slower end to a step, and the speed then, by Newton's method.
    fn search(&self, count: u32, last: Option<(u64, Inverse)>, near: u64) -> (u64, Inverse) {
        let way = self.target(count);
        let mut time = last.map_or(0, |(last, v)| {
            // By the speed, and the change of it.
            let step = v.of(self.step);
            let w = v.of(high(self.at(last).half, step));
            along(last, along(step, high(step, w), self.back), !self.back)
        });
        if time == 0 || time == u64::MAX {
            time = self.guess(way);
        }
        for _ in 0..32 {
            let Place { p, v, half } = self.at(time);
            let by = Inverse::new(v).of(p.abs_diff(way));
            let next = along(time, by, p < way);
            if by <= near.max(2) || next == time {
                return (next, Inverse::new(along(v, high(half, by) << 1, p < way)));
            }
            time = next;
        }
        (time, Inverse::new(self.at(time).v))
    }

    /// At least the time for a way.
    fn guess(&self, way: u64) -> u64 {
        // While the acceleration fades to 0 it makes two thirds at least of what it would make.
        let more = if self.grows { way } else { way.saturating_add(way >> 1) };
        let square = Inverse::new(self.half).of(more).isqrt().saturating_add(1).saturating_mul(1 << 32);
        let mut time = Inverse::new(self.speed).of(way).min(square);
        if self.grows {
            // The third of a power of 2 above a cube.
            let zeros = Inverse::new(self.sixth).of(way).leading_zeros();
            let third = u64::MAX >> zeros.div_euclid(3);
            let third = match zeros.rem_euclid(3) {
                0 => third,
                1 => high(third, 0xcb5 << 52),
                _ => high(third, 0xa15 << 52),
            };
            time = time.min(third);
        }
        time
    }
}

/// 2^64 / 6.
const SIXTH: u64 = u64::MAX / 6 + 1;

/// A number times a part.
fn times(x: i64, part: u64) -> i64 {
    let size = i64::try_from(high(x.unsigned_abs(), part)).unwrap_or(0);
    if x < 0 { size.wrapping_neg() } else { size }
}

/// 2^64 / n of up to 16 bits, in divisions that a 32-bit core has.
fn part(n: u32) -> u64 {
    let digit = |left: u32| (left.checked_div(n).unwrap_or(0), left.checked_rem(n).unwrap_or(0) << 16 | 0xffff);
    let (first, left) = digit(u32::MAX);
    let (second, left) = digit(left);
    let (third, _) = digit(left);
    u64::from(first) << 32 | u64::from(second) << 16 | u64::from(third)
}

/// A sum that ends at the greatest number, or a difference that ends at 0.
fn along(x: u64, by: u64, up: bool) -> u64 {
    if up { x.saturating_add(by) } else { x.saturating_sub(by) }
}

/// About as many steps as the two terms left out allow to be off by `most`, from those of one step.
fn about(step: u64, w: u64, y: u64, most: u64) -> u32 {
    // Of 16 steps, lest they are too small; of one where those are too large.
    let many = if step >> 60 | w >> 58 | y >> 52 == 0 { 4 } else { 0 };
    let (x, w, y) = (step << many, w << many, y << (many << 1));
    let square = high(w, w);
    // In the middle a segment is off by a sixteenth of the one and by 5/32 of the other: half of the one counts, and twice the other.
    let fourth = high(high(x, w), square.saturating_mul(5).saturating_add(y.saturating_mul(15) >> 1)) >> 1;
    let both = square.saturating_mul(4).saturating_add(y.saturating_mul(3));
    let fifth = high(x, high(both, both)).saturating_mul(2);
    let root = |term: u64, degree: u32| {
        // From 2^-60 of those steps on.
        let octaves = term.leading_zeros().saturating_add(60).saturating_sub(most.leading_zeros());
        let (whole, part) = (octaves.checked_div(degree).unwrap_or(0), octaves.checked_rem(degree).unwrap_or(0));
        let steps = u64::from(degree.saturating_add(part)) << whole.min(40);
        let down = 60_u32.checked_div(degree).unwrap_or(0).saturating_sub(many);
        u32::try_from((steps >> down).checked_div(degree.into()).unwrap_or(0)).unwrap_or(u32::MAX)
    };
    root(fourth, 4).min(root(fifth, 5))
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, clippy::cast_sign_loss, reason = "numbers for random cases, and compared with 1")]
mod tests {
    use super::*;
    use crate::limits::{Clock, Limits};
    use crate::planner::{Goal, Motion, plan};
    use proptest::prelude::*;

    /// How far the steps of the segments are off at most, in parts of what they may be, and how many steps a segment has.
    fn worst(curve: &Curve, frame: &Frame, off: Real) -> (f64, f64) {
        let (mut cutter, mut worst, mut segments) = (Cutter::new(), 0.0, 0.0);
        let most = off.scaled(48).to_wide(32 - i32::try_from(frame.shift).unwrap()) as f64 / 2_f64.powi(48);
        while let Some(stretch) = cutter.next(curve, frame, &Demand { off, coarse: None, time: u64::MAX }) {
            let (mut time, [mut interval, mut add, bend]) = (stretch.first, stretch.differences);
            for k in 0..u32::from(stretch.count) {
                let exact = cutter.exact(cutter.count() - u32::from(stretch.count) + k);
                worst = f64::max(worst, (time - exact).unsigned_abs() as f64 / most);
                (time, interval, add) = (time + i128::from(interval), interval + add, add + bend);
            }
            segments += 1.0;
        }
        (worst, f64::from(cutter.count()) / segments)
    }

    fn spread(low: f64, high: f64) -> impl Strategy<Value = f64> {
        (low.ln()..high.ln()).prop_map(f64::exp)
    }

    /// How far off the steps of a move are at most, in parts of what they may be; `None` if there is no such move.
    fn off_by(
        hz: u32,
        [v, a, j]: [u64; 3],
        (n, ends): (u32, [f64; 2]),
        off: impl FnOnce(Clock) -> Real,
    ) -> Option<f64> {
        let clock = Clock::new(hz).unwrap();
        let limits = Limits::new((v as u32).min(hz / 2), a as u32).unwrap();
        let limits = if j == 0 { limits } else { limits.with_jerk(j).unwrap() };
        let bounds = limits.bounds(clock);
        let [entry, exit] = ends.map(|part| bounds.v * Real::new((part * 1e6) as u64) / Real::new(1_000_000));
        let curve = plan(Motion::steady(entry), Goal::At(Real::new(n.into()), exit), &bounds).ok()?;
        let frame = Frame { to: Some(i64::from(n) << 32), ..Frame::rest(clock.shift(), 0, 0) };
        Some(worst(&curve, &frame, off(clock)).0)
    }

    /// The last step of a piece lies at its end, beyond which the three terms lead; terms of one of few steps in a piece are
    /// large; and a slope that begins has more of the fifth derivative than of the fourth.
    #[test]
    fn segments_where_two_terms_do_not_say_it() {
        for (hz, limits, n) in [
            (200_000_000, [285_392, 3_187_009, 1_099_701_122], 13),
            (72_000_000, [108_080, 9_851_652, 15_353_617_130], 23),
            (1_000_000, [65_000, 589_365_535, 15_251_647_998], 9),
            (200_000_000, [43_714, 23_822_135, 194_861_935_563], 15),
            (200_000_000, [230_797, 3_185_880, 11_771_609_240], 21),
            (25_000, [12_500, 52_146_833, 2_587_872], 224),
        ] {
            for part in 0..40 {
                let off = |clock: Clock| clock.blur() * Real::new(100 - part) / Real::new(100);
                let worst = off_by(hz, limits, (n, [0.0; 2]), off).unwrap();
                assert!(worst <= 1.0, "{worst} of {n} steps at {hz} Hz, {part}");
            }
        }
    }

    /// Of a test that takes more of them where there is time.
    fn cases() -> u32 {
        extern crate std;
        std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(2000)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

        #[test]
        #[cfg_attr(miri, ignore = "too long for an interpreter")]
        fn a_segment_is_as_exact_as_is_asked(
            hz in prop_oneof![Just(25_000_u32), Just(1_000_000), Just(72_000_000), Just(168_000_000), Just(200_000_000)],
            v in spread(1.0, 1e6), a in spread(1.0, 1e9), j in prop_oneof![Just(0.0), spread(1.0, 1e12)],
            n in prop_oneof![1..60_u32, 1..300_u32, 1..20_000_u32],
            ends in prop_oneof![Just([0.0; 2]), [0.0..1.0, 0.0..1.0]],
            part in prop_oneof![Just(0.0), spread(1.0 / 64.0, 1.0)],
        ) {
            // What an axis asks for, or a part of a tick.
            let off = |clock: Clock| if part == 0.0 {
                clock.blur()
            } else {
                Real::new(clock.moment(1)) * Real::fixed((part * 65536.0) as u64, 16)
            };
            if let Some(worst) = off_by(hz, [v as u64, a as u64, j as u64], (n, ends), off) {
                prop_assert!(worst <= 1.0, "{worst} of {:?}", off(Clock::new(hz).unwrap()));
            }
        }
    }

    /// 64 steps, ramps of 250 and of 2500: how many steps a segment has, at a third of a tick of 1 us and at 20 ns.
    #[test]
    fn steps_of_a_segment() {
        let cut = |steps: u32, speed, jerk, off| {
            let bounds = Limits::new(speed, 100_000).unwrap().with_jerk(jerk).unwrap().bounds(Clock::MICROSECONDS);
            let curve =
                plan(Motion::steady(Real::ZERO), Goal::At(Real::new(steps.into()), Real::ZERO), &bounds).unwrap();
            let frame = Frame { to: Some(i64::from(steps) << 32), ..Frame::rest(Clock::MICROSECONDS.shift(), 0, 0) };
            worst(&curve, &frame, Real::new(Clock::MICROSECONDS.moment(1)) * off).1
        };
        let third = Real::ONE / Real::new(3);
        let fine = Real::fixed(20, 0) / Real::new(1000);
        for (steps, speed, jerk, wants) in [
            (64, 20_000, 5_000_000, [1.9, 1.2]),
            (500, 20_000, 5_000_000, [7.9, 4.0]),
            (5000, 50_000, 1_000_000, [30.0, 15.0]),
        ] {
            for (off, want) in [third, fine].into_iter().zip(wants) {
                let got = cut(steps, speed, jerk, off);
                assert!(got >= want, "{got} steps a segment of {steps}, {want} are wanted");
            }
        }
    }
}
