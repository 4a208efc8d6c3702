//! From curves to segments: stretches of steps whose times are, closely enough, a cubic of their number.
//!
//! A segment leads from one time to another. It takes the time and the pace at both ends from the curve; its maximum error
//! also follows from these (`segment`). Near rest, where a segment would hold few steps, up to four steps are found one by
//! one and make a segment: by a table if the rest is at a step, whatever the piece is (`near_rest`), or by a search (`part`).
//!
//! Within a piece everything is scaled to it: times are fractions of its duration, positions fractions of its length, in
//! 64-bit words. With t from 0 to 1
//! a position is c1 t + c2 t² + c3 t³, from 0 to 1 as well, and no coefficient is above 3/2. Each piece is seen from its
//! slower end, backwards in time if need be: the position is then a convex function of the time, so every search converges.

mod near_rest;
mod part;
mod segment;
mod stretch;

use near_rest::FromRest;
pub(crate) use near_rest::Roots;
use part::{LONGEST, Part, Slower, Spot};
pub(crate) use stretch::{Cut, Demand, Stretch};

use crate::curve::Curve;
use crate::phases::Frame;
use crate::real::Real;

/// Cuts the steps of an axis on a curve into segments, one after another.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Cutter {
    /// Steps made, counted from the origin of the positions.
    count: u32,
    /// The piece after the present one, and the steps made where the present one ends.
    next: u8,
    until: u32,
    /// The steps of the present piece beside a rest; and the piece itself, once it is needed.
    rest: Option<FromRest>,
    piece: Option<Part>,
    /// Where the next segment may begin.
    last: Last,
    /// Steps that have been counted but do not form a stretch yet.
    few: Option<Few>,
}

/// Where the cutter is: at the last step, or between two steps.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Last {
    /// At the start of the piece.
    Entry,
    /// The time from the slower end of the piece.
    At(u64),
    /// The time on the clock, in 2^-32 ticks.
    Tick(i128),
    /// Where the next segment begins, and about how long it may take.
    There(Spot, u64),
}

/// The result of a slice of the work.
pub(crate) enum Slice {
    More,
    Steps(Stretch),
    /// There are no further steps.
    End,
}

/// Up to four steps, which a segment can hold whatever the curve is.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Few {
    stretch: Stretch,
    /// How much later than the first step the last one is, and the differences there.
    since: u64,
    interval: i64,
    add: i64,
}

/// Up to this many steps fit into a segment whatever the curve is; each of them is found by itself.
const FEW: u16 = 4;

impl Cutter {
    pub(crate) const fn new() -> Self {
        Self { count: 0, next: 0, until: 0, rest: None, piece: None, last: Last::Entry, few: None }
    }

    /// Steps made, counted from the origin of the positions.
    pub(crate) const fn count(&self) -> u32 {
        self.count
    }

    /// Does a slice of the work for the next steps.
    pub(crate) fn slice(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> Slice {
        if let Some(few) = self.few.take() {
            return self.search(few, demand);
        }
        if self.count >= self.until {
            return if self.take_piece(curve, frame, demand) { Slice::More } else { Slice::End };
        }
        if self.rest.as_mut().is_some_and(|rest| rest.is_near(self.count, frame, demand)) {
            if let Some(stretch) = self.beside_rest(demand) {
                return Slice::Steps(stretch);
            }
        }
        let steps = (self.count, self.left());
        let Some(piece) = &self.piece else {
            self.piece = self.scaled(curve, frame, demand.off);
            return Slice::More;
        };
        if piece.even {
            let stretch = piece.cruise(steps, demand.time);
            self.count = self.count.saturating_add(stretch.count.into());
            return Slice::Steps(stretch);
        }
        let many = match &self.last {
            Last::There(spot, long) => piece.many(steps, spot, Some(*long), demand),
            last => piece.spot(last.time(piece)).and_then(|last| piece.many(steps, &last, None, demand)),
        };
        if let Some((stretch, end, long)) = many {
            (self.last, self.count) = (Last::There(end, long), self.count.saturating_add(stretch.count.into()));
            return Slice::Steps(stretch);
        }
        self.search(Few::NONE, demand)
    }

    /// Steps left in the piece.
    const fn left(&self) -> u32 {
        self.until.saturating_sub(self.count)
    }

    /// Goes on to the next piece with steps; returns false after the last one.
    fn take_piece(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> bool {
        while self.count >= self.until {
            let at = self.next;
            let Some(until) = frame.until(curve, at) else { return false };
            self.next = at.saturating_add(1);
            if until > self.count {
                let Some(piece) = curve.piece(at.into()) else { return false };
                let slower = Slower::new(curve, frame, piece);
                (self.until, self.last) = (until, Last::Entry);
                self.rest = FromRest::new(&slower, frame, self.rest.as_ref());
                self.piece = if self.rest.is_none() { Some(Part::new(&slower, frame, demand.off)) } else { None };
            }
        }
        true
    }

    /// Scales the present piece, for what its table does not say.
    fn scaled(&self, curve: &Curve, frame: &Frame, off: Real) -> Option<Part> {
        let slower = Slower::new(curve, frame, curve.piece(self.next.saturating_sub(1).into())?);
        Some(Part::new(&slower, frame, off))
    }

    /// Returns the next few steps, if they are beside a rest.
    fn beside_rest(&mut self, demand: &Demand) -> Option<Stretch> {
        let (rest, mut few) = (self.rest.as_ref()?, Few::NONE);
        for _ in 0..self.left().min(FEW.into()) {
            let Some(time) = rest.time(self.count).filter(|time| few.add(*time, demand.time.min(LONGEST))) else {
                break;
            };
            (self.last, self.count) = (Last::Tick(time), self.count.saturating_add(1));
        }
        (few.stretch.count > 0).then_some(few.stretch)
    }

    /// Finds the next of the steps that are found one by one.
    fn search(&mut self, mut few: Few, demand: &Demand) -> Slice {
        let Some(piece) = &self.piece else { return Slice::More };
        let (mut last, mut coarse) = (self.last.time(piece), 0);
        if let Some((by, spot)) = demand.coarse.and_then(|by| Some((by, piece.spot(last)?))) {
            coarse = spot.v.of(piece.step) >> by;
        }
        let near = piece.off.max(coarse) >> 4;
        for _ in 0..self.left().min(demand.searches) {
            let time = piece.search(self.count, Some(last), near);
            if !few.add(piece.tick(time), demand.time.min(LONGEST)) {
                return Slice::Steps(few.stretch);
            }
            self.count = self.count.saturating_add(1);
            // A step that was due before the piece began is made at its start, not at its own place, so no segment begins
            // at it.
            if time.abs_diff(piece.entry()) <= near {
                self.last = Last::Entry;
                return Slice::Steps(few.stretch);
            }
            last = time;
            self.last = Last::At(time);
        }
        if self.left() > 0 && few.stretch.count < FEW {
            self.few = Some(few);
            return Slice::More;
        }
        Slice::Steps(few.stretch)
    }

    /// Returns a time, and the steps that follow from a rest beside them as from there, if the next step is one. They are
    /// made.
    pub(crate) fn roots(&mut self) -> Option<(i128, Roots)> {
        if self.few.is_some() || self.count >= self.until {
            return None;
        }
        let rest = self.rest.as_ref()?;
        let (begin, roots) = rest.steps(self.count, self.left())?;
        let count = self.count.saturating_add(roots.left());
        (self.last, self.count) = (Last::Tick(rest.time(count.saturating_sub(1))?), count);
        Some((begin, roots))
    }

    /// Returns whether the present segments are exact but for rounding: the speed is constant.
    pub(crate) fn is_even(&self) -> bool {
        self.piece.as_ref().is_some_and(|piece| piece.even)
    }

    /// Returns when a step of the present piece is made, as exactly as the arithmetic allows, from a time near it.
    pub(crate) fn exact(&self, curve: &Curve, frame: &Frame, (count, about): (u32, i128)) -> i128 {
        let scaled;
        let piece = if let Some(piece) = &self.piece {
            piece
        } else {
            let Some(piece) = self.scaled(curve, frame, Real::ZERO) else { return about };
            scaled = piece;
            &scaled
        };
        if piece.even {
            return piece.cruise((count, 1), 0).first;
        }
        piece.tick(piece.search(count, Some(piece.time(about)), 0))
    }
}

impl Last {
    /// Returns the time from the slower end of the piece.
    fn time(&self, piece: &Part) -> u64 {
        match self {
            Self::Entry => piece.entry(),
            Self::At(time) => *time,
            Self::Tick(tick) => piece.time(*tick),
            Self::There(spot, _) => spot.time,
        }
    }
}

impl Few {
    const NONE: Self =
        Self { stretch: Stretch { count: 0, first: 0, differences: [0; 3] }, since: 0, interval: 0, add: 0 };

    /// Adds a step at a time, if that is within `longest` of the first one.
    fn add(&mut self, time: i128, longest: u64) -> bool {
        let Stretch { count, first, differences } = &mut self.stretch;
        if *count == 0 {
            *first = time;
        } else {
            let Some(since) = u64::try_from(time.wrapping_sub(*first)).ok().filter(|since| *since <= longest) else {
                return false;
            };
            let interval = i64::try_from(since.saturating_sub(self.since)).unwrap_or(0);
            let add = interval.wrapping_sub(self.interval);
            match *count {
                1 => differences[0] = interval,
                2 => differences[1] = add,
                _ => differences[2] = add.wrapping_sub(self.add),
            }
            (self.since, self.interval, self.add) = (since, interval, add);
        }
        *count = count.saturating_add(1);
        true
    }
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, clippy::cast_sign_loss, reason = "numbers for random cases, and compared with 1")]
mod tests {
    use super::*;
    use crate::curve::Bend;
    use crate::limits::{Clock, Limits};
    use crate::planner::{Goal, Motion, plan};
    use proptest::prelude::*;
    use std::vec::Vec;

    impl Cutter {
        /// Returns the next steps; `None` after the last one.
        pub(crate) fn next(&mut self, curve: &Curve, frame: &Frame, demand: &Demand) -> Option<Stretch> {
            loop {
                match self.slice(curve, frame, demand) {
                    Slice::More => {}
                    Slice::Steps(stretch) => return Some(stretch),
                    Slice::End => return None,
                }
            }
        }
    }

    /// Returns the largest error of the segments' steps as a share of the permitted one, and how many steps a segment has.
    fn worst(curve: &Curve, frame: &Frame, off: Real) -> (f64, f64) {
        let (mut cutter, mut worst, mut segments) = (Cutter::new(), 0.0, 0.0);
        let most = off.scaled(48).to_wide(32 - i32::try_from(frame.shift).unwrap()) as f64 / 2_f64.powi(48);
        while let Some(stretch) = cutter.next(curve, frame, &Demand { off, coarse: None, time: u64::MAX, searches: 2 })
        {
            assert!(stretch.count > 0);
            let (mut time, [mut interval, mut add, bend]) = (stretch.first, stretch.differences);
            for k in 0..u32::from(stretch.count) {
                let exact = cutter.exact(curve, frame, (cutter.count() - u32::from(stretch.count) + k, 0));
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

    /// Returns the largest error of a move's steps as a share of the permitted one; `None` if there is no such move.
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

    /// The last step of a piece lies at its end, beyond which the three terms extrapolate; in a piece of few steps the
    /// terms are large; and at the start of a slope the fifth derivative outweighs the fourth.
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

    /// Returns the number of cases for a test that runs more of them if there is time.
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
            // What an axis requires, or a fraction of a tick.
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

    proptest! {
        #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

        #[test]
        #[cfg_attr(miri, ignore = "too long for an interpreter")]
        fn a_segment_takes_no_longer_than_is_asked(
            v in spread(100.0, 1e5), a in spread(1e3, 1e6), j in prop_oneof![Just(0.0), spread(1e4, 1e8)],
            n in prop_oneof![1..300_u32, 1..20_000_u32],
            time in spread(1e2, 1e6),
        ) {
            let limits = Limits::new(v as u32, a as u32).unwrap();
            let limits = if j == 0.0 { limits } else { limits.with_jerk(j as u64).unwrap() };
            let (clock, rest) = (Clock::MICROSECONDS, Motion::steady(Real::ZERO));
            let curve = plan(rest, Goal::At(Real::new(n.into()), Real::ZERO), &limits.bounds(clock)).unwrap();
            let frame = Frame { to: Some(i64::from(n) << 32), ..Frame::rest(clock.shift(), 0, 0) };
            let (mut cutter, time) = (Cutter::new(), (time * 2_f64.powi(32)) as u64);
            let demand = Demand { off: clock.blur(), coarse: None, time, searches: 2 };
            while let Some(stretch) = cutter.next(&curve, &frame, &demand) {
                let lasts = stretch.last() - stretch.first;
                prop_assert!(lasts <= i128::from(time) + (1 << 32), "{lasts} of {time}, {} steps", stretch.count);
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
            (64, 20_000, 5_000_000, [3.5, 2.9]),
            (500, 20_000, 5_000_000, [13.0, 8.5]),
            (5000, 50_000, 1_000_000, [68.0, 42.0]),
        ] {
            for (off, want) in [third, fine].into_iter().zip(wants) {
                let got = cut(steps, speed, jerk, off);
                assert!(got >= want, "{got} steps a segment of {steps}, {want} are wanted");
            }
        }
    }

    /// From one speed to another a little above or below it: segments have as many steps as they may, but for the last two,
    /// which share what is left, and none has a step alone.
    #[test]
    fn segments_with_the_most_steps() {
        for (up, coarse, most) in [(true, None, 512), (false, None, 512), (true, Some(4), 2048), (false, Some(4), 2048)]
        {
            let (mut curve, v, steps) = (Curve::new(), Real::ONE.scaled(-20), Real::new(20_000));
            let more = v.scaled(-6);
            let lasts = steps / (v + more.half());
            let state = [if up { v } else { v + more }, more / lasts, Real::ZERO];
            curve.push((lasts, steps), state, up, Bend::Flat);
            let (frame, mut cutter) = (Frame { to: None, ..Frame::rest(10, 0, 0) }, Cutter::new());
            let demand = Demand { off: Real::new(1 << 20), coarse, time: u64::MAX, searches: 2 };
            let counts: Vec<_> =
                core::iter::from_fn(|| cutter.next(&curve, &frame, &demand).map(|some| some.count)).collect();
            assert!(counts.len() > 2 && counts.iter().all(|count| *count <= most), "{counts:?}");
            let (full, last) = counts.split_at(counts.len() - 2);
            assert!(full.iter().all(|count| (most * 31 / 32..=most).contains(count)), "{counts:?}");
            assert!(last[0].abs_diff(last[1]) * 64 < last[0] && last[0] > most / 4, "{counts:?}");
            assert_eq!(counts.into_iter().map(u32::from).sum::<u32>(), 20_000);
        }
    }

    /// A stop that is only a precaution is as exact as a part of an interval, and has longer segments.
    #[test]
    fn segments_of_a_precaution() {
        for (coarse, least) in [(None, 42.5), (Some(12), 42.0), (Some(4), 106.0), (Some(2), 102.0)] {
            let bounds =
                Limits::new(50_000, 100_000).unwrap().with_jerk(1_000_000).unwrap().bounds(Clock::MICROSECONDS);
            let goal = Goal::At(Real::new(5000), Real::ZERO);
            let curve = plan(Motion::steady(Real::ZERO), goal, &bounds).unwrap();
            let frame = Frame { to: Some(5000 << 32), ..Frame::rest(Clock::MICROSECONDS.shift(), 0, 0) };
            let off = Real::new(Clock::MICROSECONDS.moment(1)) * Real::fixed(20, 0) / Real::new(1000);
            let (mut cutter, mut segments) = (Cutter::new(), 0.0);
            while let Some(stretch) = cutter.next(&curve, &frame, &Demand { off, coarse, time: u64::MAX, searches: 2 })
            {
                let first = cutter.count() - u32::from(stretch.count);
                let (mut time, [mut interval, mut add, bend]) = (stretch.first, stretch.differences);
                for count in first..cutter.count() {
                    let most = (interval.unsigned_abs() >> coarse.unwrap_or(63)).max((1 << 32) / 50);
                    let exact = cutter.exact(&curve, &frame, (count, time));
                    let off = (time - exact).unsigned_abs();
                    assert!(off <= u128::from(most / 100 * 102), "{off} for {most}, {count} {coarse:?}");
                    (time, interval, add) = (time + i128::from(interval), interval + add, add + bend);
                }
                segments += 1.0;
            }
            let each = 5000.0 / segments;
            assert!(each >= least, "{each} steps a segment, {least} are wanted: {coarse:?}");
        }
    }

    /// Steps that take up to a time after the first one, to the last bit.
    #[test]
    fn few_steps_within_a_time() {
        let mut few = Few::NONE;
        let added = [100, 110, 130, 160, 161].map(|time| few.add(time, 60));
        assert_eq!(added, [true, true, true, true, false]);
        assert_eq!((few.stretch.count, few.stretch.first, few.stretch.differences), (4, 100, [10, 10, 0]));
        assert_eq!(few.stretch.last(), 160);
    }
}
