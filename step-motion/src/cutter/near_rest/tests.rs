//! Steps beside a rest, beside the formulas that they follow from.

use super::super::{Cutter, Slice};
use super::*;
use crate::curve::{Bend, Curve};
use crate::stepper::Stepper;

/// The compiler computes the tables: each of the roots is exact to 2^-56, and whole ones are exact.
#[test]
fn roots_of_odd_numbers() {
    for (at, (square, cube)) in SQUARE.into_iter().zip(CUBE).enumerate() {
        let n = (2 * at as u128 + 1) << 120;
        let [square, cube] = [square, cube].map(u128::from);
        assert!((square * square).abs_diff(n) < 32 * square, "root {at}: {square}");
        let twice = (cube * cube) >> 60;
        assert!((twice * cube).abs_diff(n) < (48 * twice) << 60, "cube root {at}: {cube}");
    }
    for root in [1, 3, 5] {
        assert_eq!(SQUARE[root * root / 2], (root as u64) << 60);
        assert_eq!(CUBE[root * root * root / 2], (root as u64) << 60);
    }
}

/// A tick has this many moments, as a power of 2; and where a rest is.
const SHIFT: u32 = 10;
const REST: i64 = 1001;

/// A piece beside a rest, of constant acceleration or jerk.
#[derive(Debug, Clone, Copy)]
struct Case {
    cubic: bool,
    back: bool,
    /// Time of the first step from the rest, in moments; the time of the piece in such times, and its steps.
    first: u64,
    lasts: u64,
    steps: u64,
    /// How much of it is cut off at its start, in the same unit, in 16ths.
    cut: u64,
    /// How far the rest is from its step, in 2^-32 steps.
    off: i64,
}

impl Case {
    fn curve(self) -> (Curve, Frame) {
        let Self { cubic, back, first, lasts, steps, cut, off } = self;
        let (mut curve, unit) = (Curve::new(), Real::new(first));
        let time = unit * Real::new(lasts);
        // A unit of the curve is a quarter of a step, or four steps.
        let units = if steps == 500 { -2 } else { 2 };
        let way = Real::new(steps).scaled(units);
        let (a, j) = (Real::ONE / unit.squared(), Real::new(3) / (unit.squared() * unit));
        let (a, j) = (a.scaled(units), j.scaled(units));
        let (speed, most) = if cubic { (j * time.squared().half(), j * time) } else { (a * time, a) };
        let state = [
            if back { speed } else { Real::ZERO },
            if cubic && !back { Real::ZERO } else { most },
            if cubic { j } else { Real::ZERO },
        ];
        let bend = match (cubic, back) {
            (false, _) => Bend::Flat,
            (true, false) => Bend::Growing,
            (true, true) => Bend::Fading,
        };
        curve.push((time, way), state, !back, bend);
        let joined = (unit * Real::new(cut)).scaled(-4);
        curve.skipped = (joined, curve.pieces()[0].way(joined).0);
        let scale = Real::ONE.scaled(-units);
        let left = ((way - curve.skipped.1) * scale).to_wide(32) as i64;
        let from = (REST << 32) + off - if back { left } else { 0 };
        let frame = Frame { to: None, scale, offset: Real::ONE.half(), ..Frame::rest(SHIFT, 77 << SHIFT, from) };
        (curve, frame)
    }

    /// When a step is made, in ticks; `None` if that is not within the piece.
    fn time(self, count: i64) -> Option<f64> {
        let Self { cubic, back, first, lasts, cut, off, .. } = self;
        let far = (count - REST) as f64 + 0.5 - off as f64 / 2_f64.powi(32);
        let far = if back { -far } else { far };
        let units = if cubic { (2.0 * far).cbrt() } else { (2.0 * far).sqrt() };
        let all = lasts as f64 - cut as f64 / 16.0;
        let within = far > 0.0 && units <= all;
        let since = if back { all - units } else { units };
        within.then(|| 77.0 + (0.5 + since * first as f64) / f64::from(1 << SHIFT))
    }

    fn rest(self) -> Option<FromRest> {
        let (curve, frame) = self.curve();
        FromRest::new(&Slower::new(&curve, &frame, curve.piece(0).unwrap()), &frame, None)
    }
}

/// Pieces with fewer steps than a table and with more, whole or cut at a time.
fn cases() -> impl Iterator<Item = Case> {
    let sizes = [(false, 8, 32), (true, 4, 32), (false, 20, 200), (true, 10, 500)];
    sizes.into_iter().flat_map(|(cubic, lasts, steps)| {
        [(false, 0), (true, 0), (true, 15), (true, 37)].into_iter().flat_map(move |(back, cut)| {
            [3000, 41_000, 7_654_321]
                .map(|first| Case { cubic, back, first, lasts, steps, cut, off: 0 })
                .into_iter()
                .flat_map(|case| {
                    [-4095, -1, 0, 1, 4095].map(|off| Case { off, ..case }).into_iter().filter(Case::is_near)
                })
        })
    })
}

impl Case {
    /// The rest is nearer to a step than 2^-20 of one, and makes the first one early or late by less than 2^-17 ticks.
    fn is_near(&self) -> bool {
        let off = self.off.unsigned_abs() as f64 / 2_f64.powi(32);
        off < 2_f64.powi(-20) && off * self.first as f64 / f64::from(1 << SHIFT) < 2_f64.powi(-17)
    }
}

/// In 2^-32 ticks.
fn wide(ticks: f64) -> i128 {
    (ticks * 2_f64.powi(32)) as i128
}

#[test]
fn steps_beside_a_rest_are_where_the_formula_says() {
    for case in cases() {
        let rest = case.rest().unwrap_or_else(|| panic!("{case:?}"));
        for count in REST - 70..REST + 70 {
            let near = if case.back { (REST - 64..REST).contains(&count) } else { (REST..REST + 64).contains(&count) };
            let want = case.time(count).filter(|_| near).map(wide);
            let got = rest.time(count as u32);
            assert_eq!(got.is_some(), want.is_some(), "step {count} of {case:?}");
            if let Some((got, want)) = got.zip(want) {
                assert!(got.abs_diff(want) < 1 << 17, "{got} for {want}, step {count} of {case:?}");
            }
        }
    }
}

/// One that is farther from a step, a speed at the slower end, or an acceleration where the jerk ends, is none of these.
#[test]
fn a_rest_is_at_a_step() {
    for (first, off, near) in [
        (3000, 4096, false),
        (3000, -4097, false),
        (3000, 1 << 31, false),
        (3000, 4095, true),
        (3000, -4095, true),
        (1 << 20, 31, true),
        (1 << 20, 33, false),
        ((1 << 20) + 1, 32, false),
        (1 << 20, -31, true),
        (1 << 20, -33, false),
    ] {
        for (cubic, lasts, steps) in [(false, 20, 200), (true, 10, 500)] {
            for (back, cut) in [(false, 0), (true, 0), (true, 21)] {
                let case = Case { cubic, back, first, lasts, steps, cut, off };
                assert_eq!(case.rest().is_some(), near, "{case:?}");
            }
        }
    }
    for cubic in [false, true] {
        // What is left of a start does not begin at rest.
        let (lasts, steps) = if cubic { (10, 500) } else { (20, 200) };
        let case = Case { cubic, back: false, first: 41_000, lasts, steps, cut: 1, off: 0 };
        assert!(case.rest().is_none(), "{case:?}");
        // Rounding leaves less than 2^-56 of the greatest value.
        let (curve, frame) = Case { cut: 0, ..case }.curve();
        let slower = |v: i32, a: i32| {
            let mut slower = Slower::new(&curve, &frame, curve.piece(0).unwrap());
            let most = if cubic { slower.j * slower.lasts } else { slower.a };
            slower.v = (most * slower.lasts).scaled(v);
            slower.a = if cubic { most.scaled(a) } else { slower.a };
            FromRest::new(&slower, &frame, None).is_some()
        };
        assert!(slower(-57, -57) && !slower(-56, -57));
        assert!(slower(-57, -56) != cubic);
    }
}

/// Only one of the same acceleration, or the same jerk, has the same first step.
#[test]
fn what_is_known_of_an_earlier_piece() {
    let square = Case { cubic: false, back: false, first: 41_000, lasts: 20, steps: 200, cut: 0, off: 0 };
    let cubic = Case { cubic: true, lasts: 10, steps: 500, ..square };
    let slower = |case: Case| {
        let (curve, frame) = case.curve();
        (Slower::new(&curve, &frame, curve.piece(0).unwrap()), frame)
    };
    for case in [square, cubic] {
        let (own, frame) = slower(case);
        let first = |before: Option<&FromRest>| FromRest::new(&own, &frame, before).unwrap().first;
        let longer = Case { first: 3000, back: true, ..case }.rest().unwrap();
        // The other of the two, with the same number.
        let (mut other, frame) = slower(if case.cubic { square } else { cubic });
        if case.cubic {
            other.a = own.j;
        } else {
            other.j = own.a;
        }
        let other = FromRest::new(&other, &frame, None).unwrap();
        let same = Case { back: true, ..case }.rest();
        assert_eq!([Some(&longer), Some(&other), same.as_ref()].map(first), [first(None); 3]);
        assert!(longer.first != first(None) && other.first != first(None) && other.per == same.unwrap().per);
    }
}

/// Of any length below 2^63 of the unit of time, which is 2^-22 moments here.
#[test]
fn the_longest_piece_beside_a_rest() {
    let case = Case { cubic: false, back: false, first: 41_000, lasts: 20, steps: 200, cut: 0, off: 0 };
    let (curve, frame) = case.curve();
    let is_some = |lasts| {
        let mut slower = Slower::new(&curve, &frame, curve.piece(0).unwrap());
        slower.lasts = lasts;
        FromRest::new(&slower, &frame, None).is_some()
    };
    let most = Real::new((1 << 63) - 1).scaled(-22);
    assert!(is_some(most) && !is_some(most + Real::ONE.scaled(-22)) && !is_some(most.scaled(9)));
}

/// As far as `few` says, on its side; and no farther than the piece is long, to the last bit.
#[test]
fn what_is_near_a_rest() {
    for case in cases() {
        let ((_, frame), mut rest) = (case.curve(), case.rest().unwrap());
        let demand = Demand { off: Real::new(case.first).scaled(-20), coarse: Some(13), time: u64::MAX, searches: 2 };
        let few = few(rest.first.get(), demand.off.to_fixed(bits(&frame)), demand.coarse);
        assert!((5..60).contains(&few), "{few} of {case:?}");
        for far in 0..70 {
            let [count, beyond] = [far, -1 - far].map(|far| REST + far);
            let [count, beyond] = if case.back { [beyond, count] } else { [count, beyond] };
            let near = [count, beyond].map(|count| rest.is_near(count as u32, &frame, &demand));
            assert_eq!(near, [far < few.into(), false], "{far} from the rest of {case:?}");
        }
        for far in [0, 1, 9] {
            let since = rest.since(far).unwrap();
            rest.lasts = since;
            assert_eq!(rest.since(far), Some(since));
            rest.lasts = since - 1;
            assert_eq!(rest.since(far), None);
            rest.lasts = u64::MAX >> 1;
        }
    }
    // Below 2^63.
    assert_eq!([3, 4].map(|by| shifted(u64::MAX >> by)), [None, Some(u64::MAX - 15)]);
}

/// The same times in runs, from each step on, and up to a number.
#[test]
fn runs_of_steps_beside_a_rest() {
    for case in cases() {
        let rest = case.rest().unwrap();
        for count in (REST - 70) as u32..(REST + 70) as u32 {
            for left in [1, 2, 9, 64, 1000] {
                let run = rest.steps(count, left);
                let to = if case.back { REST } else { REST + 64 } as u32;
                let end = to.min(count + left);
                // After a rest all of a run have to be within the piece.
                let ends = case.back || end <= count || rest.time(end - 1).is_some();
                assert_eq!(run.is_some(), rest.time(count).is_some() && ends, "{left} from {count} of {case:?}");
                let Some((begin, mut roots)) = run else { continue };
                assert_eq!(roots.left(), end - count, "{left} from {count} of {case:?}");
                for step in count..end {
                    let time = begin + i128::from(roots.next().unwrap());
                    assert_eq!(Some(time), rest.time(step), "{step} from {count} of {case:?}");
                    assert_eq!(roots.left(), end - step - 1);
                }
                assert!(roots.next().is_none());
            }
        }
    }
}

/// Each step of a piece is in the tick nearest to its time, whether it is in a run, in a segment, or in doubt.
#[test]
fn ticks_beside_a_rest() {
    for case in cases() {
        let (curve, frame) = case.curve();
        let mut stepper = Stepper::new();
        let begin = if case.back { crate::phases::steps(frame.from) } else { REST as u32 };
        stepper.cutter.count = begin;
        let end = if case.back { REST as u32 } else { REST as u32 + case.steps as u32 };
        for count in begin..end {
            assert_eq!(stepper.count(), count, "{case:?}");
            let got = stepper.next(&curve, &frame).unwrap_or_else(|| panic!("{count} of {case:?}"));
            let want = case.time(count.into()).unwrap_or(77.0);
            assert!((got as f64 - want).abs() <= 0.500_001, "{got} for {want}, step {count} of {case:?}");
        }
        assert_eq!((stepper.count(), stepper.next(&curve, &frame)), (end, None), "{case:?}");
    }
}

/// The step next to a rest is at 40 1/2 ticks from it, half a tick and 7.5e-6 of one early or late because of where the rest is. A root
/// says that it is at the edge of the tick.
#[test]
fn a_step_beside_a_rest_at_the_edge_of_a_tick() {
    let after = Case { cubic: false, back: false, first: 41_472, lasts: 8, steps: 32, cut: 0, off: 0 };
    for (back, edge) in [(false, 77 + 40), (true, 77 + 7 * 40 + 3)] {
        for (off, want) in [(-800, edge + 1), (800, edge)] {
            let case = Case { back, off, ..after };
            let (curve, frame) = case.curve();
            let frame = Frame { offset: Real::ZERO, ..frame };
            let mut stepper = Stepper::new();
            stepper.cutter.count = if back { REST as u32 - 1 } else { REST as u32 };
            assert_eq!(stepper.next(&curve, &frame), Some(want), "{case:?}");
        }
    }
}

/// Segments of a piece begin with few steps, for which nothing is scaled, and have all of its steps.
#[test]
fn segments_beside_a_rest() {
    for case in cases().filter(|case| case.first > 3000) {
        let ((curve, frame), mut cutter) = (case.curve(), Cutter::new());
        let begin = if case.back { crate::phases::steps(frame.from) } else { REST as u32 };
        let end = if case.back { REST as u32 } else { REST as u32 + case.steps as u32 };
        cutter.count = begin;
        let (off, mut near) = (Real::new(4), 0);
        let few = few(case.rest().unwrap().first.get(), off.to_fixed(22), None).min(64);
        let demand = Demand { off, coarse: None, time: u64::MAX, searches: 2 };
        let mut next = begin;
        while cutter.count() < end {
            let Slice::Steps(stretch) = cutter.slice(&curve, &frame, &demand) else { continue };
            let count = next;
            next = cutter.count();
            assert!(stretch.count > 0 && next == count + u32::from(stretch.count), "{case:?}");
            let far = if case.back { end - 1 - count } else { count - begin };
            if far < few && case.time(count.into()).is_some() {
                near += 1;
                assert!(stretch.count <= 4 && (cutter.piece.is_none() || case.back), "{case:?}");
                assert!(u32::from(stretch.count) == 4.min(end - count), "{case:?}");
            }
            for (count, first) in [(count, stretch.first), (next - 1, stretch.last())] {
                let want = wide(case.time(count.into()).unwrap_or(77.0));
                assert!(first.abs_diff(want) <= (5 << 22), "{first} for {want}, {count} of {case:?}");
            }
        }
        assert!(near > 0 && cutter.next(&curve, &frame, &demand).is_none(), "{near} {few} of {case:?}");
    }
}

/// A cutter makes at once all steps beside a rest that are near it.
#[test]
fn a_run_is_as_long_as_the_table() {
    for case in cases() {
        let (curve, frame) = case.curve();
        let mut cutter = Cutter::new();
        assert!(cutter.roots().is_none());
        cutter.count = if case.back { REST as u32 - 20 } else { REST as u32 };
        let demand = Demand { off: Real::new(4), coarse: None, time: u64::MAX, searches: 2 };
        cutter.slice(&curve, &frame, &demand);
        let want = if case.back { 20 } else { case.steps.min(64) as u32 };
        let within = case.time(cutter.count().into()).is_some();
        let run = cutter.roots();
        assert_eq!(run.map(|(_, roots)| roots.left()), within.then_some(want), "{case:?}");
    }
}

/// A segment of five that begins with step k is off by 2.1 k^-3.5 of the first one's time, half of it to either side; an
/// interval there is 0.7 k^-0.5 of that time. As exact as all others, twice as many steps are found one by one. The numbers are powers of 2, of which the logarithms are exact.
#[test]
fn few_are_as_many_as_the_formula_says() {
    for (first, off) in [(50, 8), (50, 15), (50, 22), (60, 4), (40, 33), (40, 39), (40, 50), (45, 28)] {
        let fine = (1.05 * 2_f64.powi(first - off)).powf(2.0 / 7.0).max(1.0) * 2.0;
        let got = |coarse| f64::from(few(1 << first, 1 << off, coarse));
        let near = |got: f64, want: f64| got <= want * 1.065 && got >= (want * 0.99).floor();
        assert!(near(got(None), fine), "{} for {fine}, {first} {off}", got(None));
        for by in [0, 3, 5, 8, 12, 20, 30, 200] {
            let coarse = (3.0 * f64::from(by).exp2()).cbrt();
            let want = fine.min(coarse);
            assert!(near(got(Some(by)), want), "{} for {want}, {first} {off} {by}", got(Some(by)));
        }
    }
    assert_eq!(few(1 << 40, 1 << 33, Some(u32::MAX)), few(1 << 40, 1 << 33, None));
}
