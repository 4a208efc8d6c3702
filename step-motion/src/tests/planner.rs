//! Curves are possible, within the limits and the fastest that there are; the speeds at their ends are the ones that a distance allows.

use super::model::{self, Most, State, change, coasted};
use super::{bounds, float, real, spread};
use crate::planner::{Goal, Motion, SLACK, fastest_exit, greatest, plan, slowest_exit};
use crate::real::Real;
use proptest::prelude::*;

fn most() -> impl Strategy<Value = Most> {
    let jerk = prop_oneof![1 => Just(None), 4 => spread(1e-2, 1e3).prop_map(Some)];
    (spread(1e-1, 1e3), spread(1e-1, 1e2), jerk).prop_map(|(v, a, j)| Most { v, a, j })
}

/// A motion within limits from which the acceleration can go back to 0 within them, before rest.
fn motion(most: Most, part: f64, [a, kind]: [f64; 2]) -> (State, Motion) {
    let v = most.v * part;
    let up = kind < 0.4;
    let room = if up { v.min(most.v - v) } else { v };
    let a = match most.j {
        Some(j) if kind < 0.8 => most.a.min((2.0 * room * j).sqrt()) * a,
        _ => 0.0,
    };
    let start = Motion { v: real(v), a: real(a), up };
    ([float(start.v), if up { a } else { -a }], start)
}

fn near(got: f64, want: f64, by: f64) -> bool {
    (got - want).abs() <= want.abs() * by
}

/// A multiple of the distance that braking to rest takes, or a slow start; at least half a step.
fn way(state: State, most: Most, by: f64) -> f64 {
    change(state, 0.0, most).1.max(change([0.0, 0.0], most.v * 1e-3, most).1).mul_add(by, 0.5)
}

fn cases(n: u32) -> ProptestConfig {
    ProptestConfig::with_cases(if cfg!(miri) { 1 } else { n })
}

proptest! {
    #![proptest_config(cases(4000))]

    #[test]
    fn a_curve_is_possible_and_the_fastest(
        most in most(), part in 0.0..1.0, a in [0.0..1.0, 0.0..1.0], by in spread(1e-2, 1e2), exit in prop_oneof![Just(0.0), 0.0..1.0],
    ) {
        let (bounds, (state, start)) = (bounds(most), motion(most, part, a));
        let (n, exit) = (way(state, most, by), most.v * exit);
        let case = std::format!("{most:?} {state:?} {n} {exit}");
        let slack = float(SLACK) * 1.01 + n * 1e-9;
        match plan(start, Goal::At(real(n), real(exit)), &bounds) {
            Ok(curve) => {
                prop_assert!((float(curve.way()) - n).abs() <= slack, "{} beside {case}", float(curve.way()));
                if let Some(begin) = curve.at(curve.skipped.0) {
                    let off = most.v * 1e-7;
                    prop_assert!((float(begin.v) - state[0]).abs() <= off, "{begin:?} {case}");
                    if most.j.is_some() {
                        prop_assert!((float(begin.a) - state[1].abs()).abs() <= most.a * 1e-6, "{begin:?} {case}");
                    }
                }
                for piece in curve.pieces().iter().filter(|piece| piece.time >= curve.skipped.0) {
                    let within = |got: Real, most: f64| float(got) <= most * (1.0 + 1e-9);
                    prop_assert!(within(piece.v, most.v) && within(piece.a, most.a), "{piece:?} {case}");
                    prop_assert!(most.j.is_none_or(|j| within(piece.j, j)), "{piece:?} {case}");
                }
                let time = float(curve.time - curve.skipped.0);
                if let Some(best) = model::fastest(state, n, exit, most) {
                    prop_assert!(time <= best * 1.02 + 1e-9, "{time} for {best}: {case}");
                }
            }
            Err(need) => {
                let best = model::fastest(state, n - slack, exit, most);
                prop_assert!(best.is_none(), "{best:?} {case}");
                let least = change(state, exit, most).1;
                if exit == 0.0 || start.a.is_zero() {
                    prop_assert!(near(float(need), least, 1e-6), "{need:?} for {least}: {case}");
                }
            }
        }
    }

    /// To a speed, wherever that is.
    #[test]
    fn a_change_of_speed_is_the_fastest(most in most(), part in 0.0..1.0, a in [0.0..1.0, 0.0..1.0], to in 0.0..1.0) {
        let (bounds, (state, start)) = (bounds(most), motion(most, part, a));
        let to = most.v * to;
        let curve = plan(start, Goal::Speed(real(to)), &bounds).unwrap();
        let last = curve.pieces().last().unwrap();
        let (time, way) = change(state, to, most);
        let case = std::format!("{curve:?} for {most:?} {state:?} {to}");
        prop_assert!((float(last.time - curve.skipped.0) - time).abs() <= time * 1e-6 + most.v / most.a * 1e-6, "{case}");
        prop_assert!((float(last.p - curve.skipped.1) - way).abs() <= way * 1e-6 + most.v * most.v / most.a * 1e-6, "{case}");
        // And it stays there for 2^60 moments.
        prop_assert!(near(float(last.v), to, 1e-9) && near(float(curve.time - last.time), 60_f64.exp2(), 1e-9), "{case}");
    }

    #[test]
    fn the_speeds_at_the_end_of_a_distance(
        most in most(), part in 0.0..1.0, a in [0.0..1.0, 0.0..1.0], by in spread(1e-2, 1e2), exit in prop_oneof![Just(0.0), 0.0..1.0],
    ) {
        let (bounds, (state, start)) = (bounds(most), motion(most, part, a));
        let (n, coast) = (way(state, most, by), coasted(state, most));
        let case = std::format!("{most:?} {state:?} {n}");
        let there = change(state, coast, most).1;
        if n > there * 1.000_001 {
            let (got, want) = (float(fastest_exit(start, real(n), &bounds)), model::fastest_exit(state, n, most));
            prop_assert!(near(got, want, 1e-4), "fastest {got} for {want}: {case}");
            // As much as is still below the present speed.
            let exit = coast * exit;
            let got = float(slowest_exit(start, real(n), real(exit), &bounds));
            let want = model::slowest_exit(state, n, exit, most);
            let need = change(state, got, most).1;
            prop_assert!(got >= want * (1.0 - 1e-6) && need <= n * 1.000_001 && got <= coast * 1.000_001, "slowest {got} for {want}: {case}");
            prop_assert!(got <= want + most.v * 1e-6 || need >= n * (1.0 - 1e-3), "slowest {got} for {want}: {need} {case}");
        }
        let rest = [state[0], 0.0];
        let (got, want) = (float(greatest(start.v, real(n), &bounds)), model::fastest_exit(rest, n, most));
        prop_assert!(near(got, want, 1e-4), "greatest {got} for {want}: {case}");
    }
}

/// A speed at the end that is higher than the present one is not reached by slowing down, however much room there is.
#[test]
fn a_motion_does_not_slow_down_to_a_higher_speed() {
    for jerk in [None, Some(50.0)] {
        let bounds = bounds(Most { v: 100.0, a: 10.0, j: jerk });
        for n in [1.0, 1000.0] {
            let to = |exit: f64| slowest_exit(Motion::steady(real(5.0)), real(n), real(exit), &bounds);
            assert!(to(7.0) == real(5.0) && to(5.0) == real(5.0) && to(4.99) < real(5.0), "{jerk:?} {n}");
        }
    }
}

/// A brake under way with a little more room than it takes: that is not crawled over.
#[test]
fn a_little_more_than_the_least_distance_takes_little_more_time() {
    let most = Most { v: 9.838_214_906, a: 52.917_417_449, j: Some(146.561_859_067) };
    let state = [5.424_925_473, -28.774_183_749];
    let (time, way) = change(state, 0.0, most);
    let start = Motion { v: real(state[0]), a: real(-state[1]), up: false };
    for more in [1e-7, 1e-6, 1e-5, 2e-5, 3.08e-5, 5e-5, 1e-4, 1e-3] {
        let curve = plan(start, Goal::At(real(way + more), Real::ZERO), &bounds(most)).unwrap();
        let took = float(curve.time - curve.skipped.0);
        let best = model::fastest(state, way + more, 0.0, most).unwrap();
        assert!(took <= best * 1.02, "{took} for {best}, from {time}: {more}");
    }
}

/// Of the speeds at the end of a distance, the first one from the present speed downwards: with the greatest acceleration or without it, also
/// where the distance is near its maximum, at 2/3 of the speed.
#[test]
fn the_slowest_exit_is_the_first_that_takes_the_distance() {
    for v in [0.3, 1.0, 1.9, 40.0] {
        for knee in [0.1, 0.3, 0.6, 0.7, 0.8, 1.2, 3.0].map(|part| part * v) {
            let most = Most { v: 2.0 * v, a: knee, j: Some(knee) };
            let longest = (0..1000).map(|k| change([v, 0.0], v * f64::from(k) / 1000.0, most).1).fold(0.0, f64::max);
            for (part, exit) in
                [0.01, 0.1, 0.3, 0.6, 0.9, 0.99, 1.01].into_iter().flat_map(|n| [0.0, 0.3, 0.8].map(|to| (n, to * v)))
            {
                let n = longest * part;
                let got = float(slowest_exit(Motion::steady(real(v)), real(n), real(exit), &bounds(most)));
                let (want, need) = (model::slowest_exit([v, 0.0], n, exit, most), change([v, 0.0], got, most).1);
                let case = std::format!("{got} for {want}: {most:?} {part} {exit}");
                assert!(got >= want - v * 1e-6 && (got <= want + v * 1e-6 || need >= n * (1.0 - 2e-6)), "{case}");
            }
        }
    }
}
