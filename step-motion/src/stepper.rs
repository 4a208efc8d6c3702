//! From curves to the ticks of steps.
#![expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "words of wider numbers")]

use crate::batch::Batch;
use crate::cubic::Cubic;
use crate::curve::{Bend, Curve, Piece};
use crate::guess::Guess;
use crate::phases::Frame;
use crate::real::{Real, THIRD};
use crate::run::{Row, Run};

/// Makes the steps of an axis on a curve, one after the other.
///
/// Step k falls into the tick nearest to the time at which the position passes k - 1/2.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Stepper {
    batch: Batch,
    run: Run,
    rest: Rest,
    /// Where the end of the piece was looked for.
    corner: Corner,
}

/// What comes after the run.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Rest {
    /// Steps left in this piece.
    left: u32,
    /// Steps made at its end, counted from the origin of the positions.
    until: u32,
    /// The last tick of the piece.
    end: u64,
    mode: Mode,
    /// Number of the next piece.
    piece: u8,
}

/// A time of the curve, the first tick whose middle is not before it, and the moments until then.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Corner {
    time: Real,
    tick: u64,
    wait: Real,
}

impl Corner {
    /// Where a piece begins; most often that is the end of the one before.
    fn at(self, curve: &Curve, frame: &Frame, time: Real) -> Self {
        if self.time == time {
            return self;
        }
        let (tick, wait) = frame.sample(curve, time);
        Corner { time, tick, wait }
    }
}

/// How the steps of a piece are made; the state is that of the last step of the run.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Mode {
    /// Constant speed: from step to step, and the time, in 2^-64 ticks.
    Cruise {
        interval: u128,
        time: u128,
    },
    /// Constant jerk or acceleration: several steps at once, where the intervals change slowly, and step by step.
    Slow(Row),
    Fast(Guess),
    /// The same, if it lasts too long for 64 bits; with the last two intervals.
    Long {
        cubic: Cubic<i128>,
        tick: u64,
        interval: u64,
        before: u64,
    },
}

impl Stepper {
    /// With no step made.
    pub(super) const fn new() -> Self {
        let mode = Mode::Cruise { interval: 0, time: 0 };
        let corner = Corner { time: Real::HUGE, tick: 0, wait: Real::ZERO };
        Self { batch: Batch::NONE, run: Run::NONE, rest: Rest { left: 0, until: 0, end: 0, mode, piece: 0 }, corner }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        self.rest.until.saturating_sub(self.rest.left).saturating_sub(self.run.count).saturating_sub(self.batch.left)
    }

    /// The tick of the next step.
    #[inline(always)]
    pub(super) fn next(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        if self.run.count == 0 {
            let single = if Batch::SIZE == 0 { self.rest.single() } else { self.batch.next() };
            if let Some(tick) = single {
                return Some(tick);
            }
            self.apart(|own| own.more(curve, frame))?;
        }
        let (tick, is_certain) = self.run.step();
        Some(if is_certain { tick } else { self.apart(|own| own.rest.exact(tick, own.run.count)) })
    }

    /// Calls with a copy where registers are many: what a reference is taken of has to be in memory, and the run with it.
    #[inline(always)]
    fn apart<T>(&mut self, call: impl FnOnce(&mut Self) -> T) -> T {
        if cfg!(target_pointer_width = "64") {
            let mut copy = self.clone();
            let done = call(&mut copy);
            *self = copy;
            done
        } else {
            call(self)
        }
    }

    /// The next steps, one at least.
    #[cold]
    #[inline(never)]
    fn more(&mut self, curve: &Curve, frame: &Frame) -> Option<()> {
        let Self { batch, run, rest, corner } = self;
        *run = rest.run(curve, frame, corner)?;
        if let (1.., Mode::Fast(guess)) = (Batch::SIZE, &mut rest.mode) {
            rest.left = batch.fill(guess, rest.left, rest.end);
        }
        Some(())
    }

    /// All steps that are left, in order.
    pub(super) fn fold<B>(self, curve: &Curve, frame: &Frame, init: B, mut take: impl FnMut(B, u64) -> B) -> B {
        let Self { mut batch, run, mut rest, mut corner } = self;
        let (mut sum, mut next) = (init, Some(run));
        while let Some(mut run) = next {
            if let Mode::Cruise { interval, time } = rest.mode {
                // The first step of a piece may be late: not where its time says.
                if run.count == 1 {
                    let (tick, is_certain) = run.step();
                    sum = take(sum, if is_certain { tick } else { rest.exact(tick, 0) });
                }
                let mut time = time.wrapping_sub(interval.wrapping_mul(run.count.into()));
                for _ in 0..run.count.wrapping_add(rest.left) {
                    time = time.wrapping_add(interval);
                    sum = take(sum, (time >> 64) as u64);
                }
                (run.count, rest.left) = (0, 0);
            }
            while run.count > 0 {
                let (tick, is_certain) = run.step();
                sum = take(sum, if is_certain { tick } else { rest.exact(tick, run.count) });
            }
            while let Some(tick) = batch.next() {
                sum = take(sum, tick);
            }
            if let Mode::Fast(guess) = &mut rest.mode {
                (rest.left, sum) = guess.fold(rest.left, rest.end, sum, &mut take);
            }
            next = rest.run(curve, frame, &mut corner);
        }
        sum
    }
}

impl Rest {
    /// Doublings of the steps at constant speed that are foreseen at once: what their interval is rounded by does not add up
    /// to 2^-16 ticks.
    const EVEN: u32 = 15;

    /// The next step, if steps are made one by one.
    #[inline(always)]
    fn single(&mut self) -> Option<u64> {
        let Mode::Fast(guess) = &mut self.mode else { return None };
        let left = self.left.checked_sub(1)?;
        let tick = guess.next(self.end)?;
        self.left = left;
        Some(tick)
    }

    /// The next steps, one at least.
    #[cold]
    #[inline(never)]
    fn run(&mut self, curve: &Curve, frame: &Frame, corner: &mut Corner) -> Option<Run> {
        if self.left == 0 {
            return self.begin(curve, frame, corner);
        }
        let mut run = Run::NONE;
        match &mut self.mode {
            Mode::Cruise { interval, time } => {
                // As many as there is room for; an interval beyond that has none.
                let room = (*interval >> 32).leading_zeros().saturating_sub(65).min(Self::EVEN);
                let count = self.left.min(1 << room);
                run = Run::even(count, (*time >> 64) as u64, (*time >> 32) as u32, (*interval >> 32) as u64);
                *time = time.wrapping_add(interval.wrapping_mul(count.into()));
                if count == 1 {
                    run = Run::at((*time >> 64) as u64);
                }
            }
            Mode::Fast(guess) => match guess.single(self.left, self.end) {
                Some(tick) => run = Run::at(tick),
                None => self.row(&mut run),
            },
            Mode::Slow(_) => self.row(&mut run),
            Mode::Long { cubic, tick, interval, before } => {
                let guess = interval.saturating_mul(2).saturating_sub(*before).max(*interval >> 1);
                let last = self.end.saturating_sub(*tick);
                let (by, there) = cubic.solve(guess.min(interval.saturating_mul(2)), last);
                (*cubic, *tick, *interval, *before) = (there, tick.saturating_add(by), by, *interval);
                run = Run::at(*tick);
            }
        }
        self.left = self.left.saturating_sub(run.count);
        Some(run)
    }

    /// Several steps, if that can be; else one.
    fn row(&mut self, run: &mut Run) {
        if let Mode::Fast(guess) = &self.mode {
            self.mode = Mode::Slow(Row::new(guess.cubic, guess.tick));
        }
        if let Mode::Slow(row) = &mut self.mode {
            row.run(self.left, run);
            if run.count > 0 {
                return;
            }
            self.mode = Mode::Fast(Guess::after(row));
        }
        if let Mode::Fast(guess) = &mut self.mode {
            *run = Run::at(guess.step(self.end));
        }
    }

    /// The tick of a step of the run, which is `tick` or the one after it; `left` is what is left of the run.
    #[cold]
    #[inline(never)]
    fn exact(&self, tick: u64, left: u32) -> u64 {
        match &self.mode {
            Mode::Cruise { interval, time } => (time.wrapping_sub(interval.wrapping_mul(left.into())) >> 64) as u64,
            Mode::Slow(row) => row.exact(tick, left),
            Mode::Fast(_) | Mode::Long { .. } => tick,
        }
    }

    /// The first step of the next piece that has one.
    fn begin(&mut self, curve: &Curve, frame: &Frame, corner: &mut Corner) -> Option<Run> {
        loop {
            let count = self.until;
            let (piece, end, until) = frame.piece(curve, self.piece)?;
            self.piece = self.piece.saturating_add(1);
            if until > count {
                (self.until, self.left) = (until, until.wrapping_sub(count).wrapping_sub(1));
                let joined;
                let piece = if piece.time < curve.skipped.0 {
                    joined = piece.after(curve.skipped.0 - piece.time);
                    &joined
                } else {
                    piece
                };
                return Some(Run::at(self.enter(count, curve, frame, (piece, end), corner)));
            }
        }
    }

    fn enter(
        &mut self,
        count: u32,
        curve: &Curve,
        frame: &Frame,
        (piece, end): (&Piece, Real),
        corner: &mut Corner,
    ) -> u64 {
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
        let Corner { tick, wait, .. } = corner.at(curve, frame, piece.time);
        *corner = corner.at(curve, frame, end);
        let ahead = |p: Real| {
            let made = frame.made(curve, p) + over;
            (want - made, made - want)
        };
        let straight = piece.bend == Bend::Flat;
        let inverse = Real::ONE / if straight { scale(piece.a.half(), 2) } else { scale(piece.j.half() * THIRD, 3) };
        self.end = corner.tick.max(tick);
        let last = self.end.wrapping_sub(tick);
        // A step is 2^58 units at least, if the unit then is neither too large nor a step too short to be foreseen.
        let bits = 58_i32.saturating_sub(inverse.exponent());
        if (10..=50).contains(&bits) {
            let (by, cubic) = Cubic::new(piece, wait, (inverse, bits, frame.shift as i32), scale, ahead).first(last);
            let tick = tick.saturating_add(by);
            self.mode = Mode::Fast(Guess::new(cubic, tick, 3));
            return tick;
        }
        let bits = 117_i32.saturating_sub(inverse.exponent()).clamp(0, 50);
        let (by, cubic) = Cubic::new(piece, wait, (inverse, bits, frame.shift as i32), scale, ahead).first(last);
        let tick = tick.saturating_add(by);
        let interval = cubic.interval();
        self.mode = Mode::Long { cubic, tick, interval, before: interval };
        tick
    }
}

#[cfg(test)]
#[expect(clippy::cast_sign_loss, reason = "numbers from 0 upwards")]
mod tests {
    use super::*;
    use crate::limits::{Clock, Limits};
    use crate::planner::{Goal, Motion, plan};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// The ticks with every step looked for at the exact position, none foreseen.
    fn one_by_one(curve: &Curve, frame: &Frame) -> Vec<u64> {
        let Stepper { mut rest, mut corner, .. } = Stepper::new();
        let mut ticks = Vec::new();
        loop {
            match &mut rest.mode {
                Mode::Fast(guess) if rest.left > 0 => {
                    ticks.push(guess.search(rest.end));
                    rest.left -= 1;
                }
                _ => match rest.run(curve, frame, &mut corner) {
                    Some(mut run) => {
                        while run.count > 0 {
                            let (tick, is_certain) = run.step();
                            ticks.push(if is_certain { tick } else { rest.exact(tick, run.count) });
                        }
                    }
                    None => return ticks,
                },
            }
        }
    }

    /// How far the foreseen times are from the exact ones at most.
    fn error(curve: &Curve, frame: &Frame) -> f64 {
        let Stepper { mut rest, mut corner, .. } = Stepper::new();
        let mut worst = 0.0;
        while let Some(run) = rest.run(curve, frame, &mut corner) {
            if let (Mode::Slow(row), 2..) = (&rest.mode, run.count) {
                worst = f64::max(worst, row.error(run));
            }
        }
        worst
    }

    /// Logarithmically spread.
    fn spread(low: f64, high: f64) -> impl Strategy<Value = f64> {
        (low.ln()..high.ln()).prop_map(f64::exp)
    }

    /// A ramp of 2500 steps up and down: nearly all of them are foreseen, 40 at a time.
    #[test]
    fn a_long_ramp_takes_few_looks() {
        for jerk in [None, Some(1_000_000)] {
            let limits = Limits::new(50_000, 100_000).unwrap();
            let limits = jerk.map_or(limits, |jerk| limits.with_jerk(jerk).unwrap());
            let bounds = limits.bounds(Clock::MICROSECONDS);
            let goal = Goal::At(Real::new(5000), Real::ZERO);
            let curve = plan(Motion::steady(Real::ZERO), goal, &bounds).unwrap();
            let frame = Frame { to: Some(5000 << 32), ..Frame::rest(Clock::MICROSECONDS.shift(), 0, 0) };
            let Stepper { mut rest, mut corner, .. } = Stepper::new();
            let (mut looks, mut foreseen) = (0, 0);
            while let Some(run) = rest.run(&curve, &frame, &mut corner) {
                if run.count > 1 {
                    (looks, foreseen) = (looks + 1, foreseen + run.count);
                }
            }
            assert!(foreseen > 4400 && looks < 120, "{looks} looks for {foreseen} steps");
        }
    }

    /// A ramp of 250 steps up and down: most of them are foreseen rightly from the last three, but near rest.
    #[test]
    fn a_short_ramp_is_foreseen_rightly() {
        for (jerk, most) in [(None, 45), (Some(5_000_000), 46)] {
            let limits = Limits::new(20_000, 100_000).unwrap();
            let limits = jerk.map_or(limits, |jerk| limits.with_jerk(jerk).unwrap());
            let bounds = limits.bounds(Clock::MICROSECONDS);
            let curve = plan(Motion::steady(Real::ZERO), Goal::At(Real::new(500), Real::ZERO), &bounds).unwrap();
            let frame = Frame { to: Some(500 << 32), ..Frame::rest(Clock::MICROSECONDS.shift(), 0, 0) };
            let Stepper { mut rest, mut corner, .. } = Stepper::new();
            let (mut wrong, mut single) = (0, 0);
            loop {
                if let Mode::Fast(guess) = &rest.mode {
                    wrong += u32::from(rest.left > 0 && !guess.is_right());
                }
                let Some(run) = rest.run(&curve, &frame, &mut corner) else { break };
                single += u32::from(run.count == 1);
            }
            assert!(single > 350 && wrong < most, "{wrong} of {single} foreseen wrongly");
        }
    }

    /// A step that was due before the piece began is made when it begins, and the next one where it is due.
    #[test]
    fn a_late_step_is_the_same_in_a_loop() {
        let bounds = Limits::new(20_000, 100_000).unwrap().bounds(Clock::MICROSECONDS);
        let curve = plan(Motion::steady(bounds.v), Goal::At(Real::new(20), bounds.v), &bounds).unwrap();
        let from = (1 << 31) + (1 << 30);
        let frame = Frame { from, to: Some(20 << 32), ..Frame::rest(Clock::MICROSECONDS.shift(), 0, 0) };
        let mut stepper = Stepper::new();
        let ticks: Vec<u64> = core::iter::from_fn(|| stepper.next(&curve, &frame)).collect();
        assert_eq!(ticks[..3], [0, 38, 88]);
        let mut folded = Vec::new();
        Stepper::new().fold(&curve, &frame, (), |(), tick| folded.push(tick));
        assert_eq!(folded, ticks);
    }

    proptest! {
        #[test]
        fn what_is_foreseen_is_where_the_position_is(
            hz in spread(1e3, 1e9),
            v in spread(1.0, 1e6),
            a in spread(1.0, 1e9),
            j in prop_oneof![Just(0.0), spread(1.0, 1e10)],
            n in prop_oneof![1..300_u32, 1..30_000_u32],
            ends in prop_oneof![Just([0.0; 2]), [0.0..1.0, 0.0..1.0]],
        ) {
            let n = if cfg!(miri) { n % 100 } else { n };
            let clock = Clock::new((hz as u32).max(Clock::MIN_HZ)).unwrap();
            let v = (v as u32).min(clock.hz() / 2);
            let limits = Limits::new(v, a as u32).unwrap();
            let limits = if j == 0.0 { limits } else { limits.with_jerk(j as u64).unwrap() };
            let bounds = limits.bounds(clock);
            let [entry, exit] = ends.map(|part| bounds.v * Real::new((part * 1e6) as u64) / Real::new(1_000_000));
            let Ok(curve) = plan(Motion::steady(entry), Goal::At(Real::new(n.into()), exit), &bounds) else {
                return Ok(());
            };
            let frame = Frame { to: Some(i64::from(n) << 32), ..Frame::rest(clock.shift(), 0, 0) };
            let ticks = one_by_one(&curve, &frame);
            let (mut stepper, mut got) = (Stepper::new(), Vec::new());
            while let Some(tick) = stepper.next(&curve, &frame) {
                got.push(tick);
                prop_assert_eq!(stepper.count() as usize, got.len());
            }
            prop_assert_eq!(&got, &ticks);
            got.clear();
            Stepper::new().fold(&curve, &frame, (), |(), tick| got.push(tick));
            prop_assert_eq!(got, ticks);
            // Of 1/32. A third is kept in hand.
            let error = error(&curve, &frame);
            prop_assert!(error < 0.021, "{error}");
        }
    }
}
