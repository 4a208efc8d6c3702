//! Plans the fastest curve from a state to a speed, over a distance or without end.
//!
//! All curves are made of slopes between speeds at acceleration 0. A state with non-zero acceleration lies on a slope that
//! began earlier, at its *virtual start*, so a curve may begin in the middle of a slope. Only if the acceleration has to
//! change its sign is it brought to 0 first.

mod crossing;
mod search;

use crossing::Crossing;
pub(crate) use search::{Found, Search};

use crate::curve::Curve;
use crate::limits::{Bounds, Jerk};
use crate::peak::Peak;
use crate::real::{Real, THIRD};
use crate::slope::{distance, most_distance};

/// Speed and acceleration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub(super) v: Real,
    /// Size of the acceleration.
    pub(super) a: Real,
    /// The acceleration increases the speed.
    pub(super) up: bool,
}

impl Motion {
    pub(super) const fn steady(v: Real) -> Self {
        Self { v, a: Real::ZERO, up: true }
    }
}

/// The goal of a curve.
#[derive(Debug, Clone, Copy)]
pub(super) enum Goal {
    /// Over this distance, with this speed at the end.
    At(Real, Real),
    /// To this speed, wherever that is.
    Speed(Real),
}

/// Distances may be too short by this much, in steps, because of rounding. The interval over a joint of two curves may be short by as
/// much: 15 millionths of a step.
pub(super) const SLACK: Real = Real::fixed(1, 16);

/// An endless curve cruises at its end speed for this many moments.
pub(super) const ENDLESS: Real = Real::fixed(1, -60);

/// Returns the curve, or the smallest sufficient distance if there is too little.
pub(super) fn plan(start: Motion, goal: Goal, bounds: &Bounds) -> Result<Curve, Real> {
    let mut curve = Curve::new();
    match plan_into(&mut curve, start, goal, bounds) {
        Ok(()) => Ok(curve),
        Err(need) => Err(need),
    }
}

/// Does the same into an empty curve, to avoid copying the large value.
pub(super) fn plan_into(curve: &mut Curve, start: Motion, goal: Goal, bounds: &Bounds) -> Result<(), Real> {
    let mut search = Search::new(start, goal, bounds);
    loop {
        if let Some(found) = search.step(bounds) {
            search.draw(curve, &found?, bounds);
            return Ok(());
        }
    }
}

/// The slope to which the present acceleration belongs.
#[derive(Debug, Clone, Copy)]
struct Bent {
    jerk: Jerk,
    /// Time since the virtual start, and time until the acceleration is back at 0.
    edge: Real,
    /// Speed and distance back to the virtual start.
    base: (Real, Real),
    /// Speed and distance ahead when the acceleration is back at 0.
    coast: (Real, Real),
}

impl Bent {
    fn new(Motion { v, a, up }: Motion, jerk: Jerk) -> Self {
        let edge = a * jerk.per_j;
        let dv = (a * edge).half();
        let bow = a * edge.squared() * THIRD;
        let (base, coast) = (v.along(dv, !up), v.along(dv, up));
        Self {
            jerk,
            edge,
            base: (base, (base * edge).along(bow.half(), up)),
            coast: (coast, (v * edge).along(bow, up)),
        }
    }
}

/// Returns the speed between the two slopes.
fn top(from: Real, goal: Goal, bounds: &Bounds) -> Result<Real, Real> {
    let (n, exit) = match goal {
        Goal::At(n, exit) => (n, exit),
        Goal::Speed(v) => return Ok(v),
    };
    if from != exit && most_distance(from, exit, bounds) > n {
        let least = distance(from, exit, bounds);
        if least > n + SLACK {
            return Err(least);
        }
    }
    let (low, high) = if from > exit { (exit, from) } else { (from, exit) };
    if high >= bounds.v {
        let fits = distance(from, bounds.v, bounds) + distance(bounds.v, exit, bounds) <= n;
        return Ok(if fits { bounds.v } else { high });
    }
    let peak = match &bounds.jerk {
        None => (bounds.a * n + (from.squared() + exit.squared()).half()).sqrt(),
        Some(jerk) => Peak { low, high, n }.speed(bounds, jerk),
    };
    Ok(peak.min(bounds.v).max(high))
}

/// Returns the greatest speed from which `to` can be reached within `n`, which is also the greatest that can be reached
/// from `to`.
pub(super) fn greatest(to: Real, n: Real, bounds: &Bounds) -> Real {
    let way = n.scaled(1);
    let speed = match &bounds.jerk {
        None => (to.squared() + bounds.a * way).sqrt(),
        // There and back.
        Some(jerk) => Peak { low: to, high: to, n: way }.speed(bounds, jerk),
    };
    speed.min(bounds.v).max(to)
}

/// Returns the greatest speed at which a motion may end after `n`.
pub(super) fn fastest_exit(start: Motion, n: Real, bounds: &Bounds) -> Real {
    match bounds.jerk.filter(|_| !start.a.is_zero()).map(|jerk| Bent::new(start, jerk)) {
        None => greatest(start.v, n, bounds),
        Some(Bent { base, .. }) if start.up => greatest(base.0, n + base.1, bounds),
        Some(Bent { coast, .. }) => greatest(coast.0, n - coast.1, bounds),
    }
}

/// Returns the lowest speed not below `exit` at which a motion that brakes at once may end after `n`.
///
/// Jerk-limited braking to a lower speed may take less distance than to a higher one, because more of it is at the greatest
/// acceleration. The result is the lower end of the range of speeds, from the present one downwards, for which the distance
/// is enough.
pub(super) fn slowest_exit(start: Motion, n: Real, exit: Real, bounds: &Bounds) -> Real {
    let (from, least, n) = slope_down(start, n, bounds);
    // Within rounding of the end there is no time to slow down.
    if from <= exit || n <= SLACK {
        return from;
    }
    let most = (from - exit).max(least);
    match &bounds.jerk {
        None => (from.squared() - (bounds.a * n).scaled(1)).sqrt().max(exit),
        Some(_) if distance(from, from - most, bounds) <= n => from - most,
        Some(jerk) => from - least_change(from, n, bounds, jerk).max(least).min(most),
    }
}

/// Returns the greatest exit speed below one for which a distance does not suffice: with a limit of jerk slowing down to a third of
/// the speed takes the greatest distance, and to less than that takes less. `None` if it does not suffice for a rest either.
pub(super) fn slower_exit(start: Motion, n: Real, exit: Real, bounds: &Bounds) -> Option<Real> {
    bounds.jerk?;
    let (from, least, n) = slope_down(start, n, bounds);
    let high = exit.min(from - least);
    let need = |v| distance(from, v, bounds);
    (need(Real::ZERO) <= n + SLACK).then(|| Crossing::new((Real::ZERO, high), n, SLACK, need).find(need))
}

/// Returns the speed from which a motion slows down, the least change of it, and the distance for that.
fn slope_down(start: Motion, n: Real, bounds: &Bounds) -> (Real, Real, Real) {
    match bounds.jerk.filter(|_| !start.a.is_zero()).map(|jerk| Bent::new(start, jerk)) {
        None => (start.v, Real::ZERO, n),
        Some(Bent { coast, .. }) if start.up => (coast.0, Real::ZERO, n - coast.1),
        Some(Bent { base, coast, .. }) => (base.0, base.0 - coast.0, n + base.1),
    }
}

/// Returns the least change of speed, downwards, that takes a distance. There has to be one.
///
/// The distance grows with the change of speed dv up to a maximum, at 2/3 of the speed if the greatest acceleration is not
/// reached. It is (2 v - j x²) x in the time x of either jerk or, from the knee on, (v - dv / 2) (dv / a + a / j).
fn least_change(v: Real, n: Real, bounds: &Bounds, jerk: &Jerk) -> Real {
    let (twice, knee) = (v.scaled(1), jerk.knee);
    if knee * Real::new(3) < twice && (twice - knee) * jerk.edge < n {
        let (b, c) = (v - knee.half(), (bounds.a * (n - v * jerk.edge)).scaled(1));
        return c / (b + (b.squared() - c).sqrt());
    }
    // By Newton's method from below, where it never goes too far.
    let (mut x, mut dv) = (n / twice, Real::ZERO);
    for _ in 0..16 {
        dv = jerk.j * x.squared();
        let left = n - (twice - dv) * x;
        let slope = twice - dv * Real::new(3);
        if left <= n.scaled(-20) || slope.is_zero() {
            break;
        }
        x = x + left / slope;
    }
    dv
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// From any speed, even above the greatest one, and any acceleration under way: a curve covers its whole distance, ends
    /// at the requested speed, and has no jump between pieces.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn a_curve_makes_its_distance() {
        let thousandths = |n: u64| Real::new(n) / Real::new(1000);
        let speeds = (1..3000_u64, 0..3000_u64, 0..3000_u64);
        let all = (speeds, 0..=1000_u64, any::<bool>(), 0..20_000_u64, prop::option::of(1..10_000_u64));
        proptest!(ProptestConfig::with_cases(20_000), |(((most, from, exit), part, up, n, jerk) in all)| {
            let bounds = Bounds::new(thousandths(most), Real::ONE, jerk.map(thousandths));
            let mut start = Motion::steady(thousandths(from));
            if let Some(jerk) = bounds.jerk {
                // Neither the speed at which the acceleration began nor the one at which it ends is below 0.
                let least = (start.v * jerk.j).scaled(1).sqrt().min(Real::ONE);
                start = Motion { a: least * thousandths(part), up, ..start };
            }
            let (n, exit) = (thousandths(n), thousandths(exit.min(most)));
            if let Ok(curve) = plan(start, Goal::At(n, exit), &bounds) {
                let slack = SLACK + n.scaled(-40);
                prop_assert!(curve.way().distance(n) <= slack, "{:?} of {n:?}: {curve:?}", curve.way());
                let near = |a: Real, b: Real| a.distance(b) <= Real::fixed(1, 20);
                for pair in curve.pieces().windows(2) {
                    let end = pair[0].after(pair[1].time - pair[0].time);
                    prop_assert!(near(end.p, pair[1].p) && near(end.v, pair[1].v), "{end:?} {curve:?}");
                }
                if let Some(last) = curve.pieces().last() {
                    let end = last.after(curve.time - last.time);
                    prop_assert!(near(end.p, curve.p) && near(end.v, exit), "{end:?} {exit:?} {curve:?}");
                }
            }
        });
    }

    /// To the greatest speed below the hump a plan is just possible; to a little more it is not, and to a rest it is.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn a_slower_exit_than_one_that_takes_too_long() {
        let thousandths = |n: u64| Real::new(n) / Real::new(1000);
        let all = ((1..3000_u64, 1..400_u64), 0..=1000_u64, any::<bool>(), 0..1000_u64, 1..10_000_u64);
        let found = core::cell::Cell::new(0);
        proptest!(ProptestConfig::with_cases(20_000), |(((from, exit), part, up, more, jerk) in all)| {
            let bounds = Bounds::new(Real::HUGE, Real::ONE, Some(thousandths(jerk)));
            let mut start = Motion::steady(thousandths(from));
            let least = (start.v * thousandths(jerk)).scaled(1).sqrt().min(Real::ONE);
            start = Motion { a: least * thousandths(part), up, ..start };
            let exit = start.v * thousandths(exit);
            // Between what a rest takes and what that speed takes.
            let fits = |n, exit| plan(start, Goal::At(n, exit), &bounds).is_ok();
            let Ok(curve) = plan(start, Goal::Speed(Real::ZERO), &bounds) else { return Ok(()) };
            prop_assume!(curve.way() > SLACK.scaled(10));
            let n = curve.way() + curve.way() * thousandths(more).scaled(-2);
            if exit <= fastest_exit(start, n, &bounds) && !fits(n, exit) {
                let slower = slower_exit(start, n, exit, &bounds).unwrap();
                prop_assert!(slower < exit && fits(n, slower), "{slower:?} of {exit:?}");
                let most = slower + exit.scaled(-4);
                prop_assert!(most >= exit || !fits(n - SLACK.scaled(2), most), "{slower:?} of {exit:?}");
                prop_assert!(slower_exit(start, curve.way() - SLACK.scaled(2), exit, &bounds).is_none());
                found.set(found.get() + 1);
            }
        });
        assert!(found.get() > 300, "{found:?}");
        assert!(
            slower_exit(Motion::steady(Real::new(2)), Real::ONE, Real::ONE, &Bounds::new(Real::HUGE, Real::ONE, None))
                .is_none()
        );
    }

    /// From no speed does slowing down to more than 0.618 of it take more distance than coming to rest.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn which_speeds_take_more_distance_than_a_rest() {
        let thousandths = |n: u64| Real::new(n) / Real::new(1000);
        let all = (1..100_000_u64, 0..1000_u64, 1..10_000_u64, prop::option::of(1..10_000_u64));
        let beyond = core::cell::Cell::new(0);
        proptest!(ProptestConfig::with_cases(20_000), |((v, part, a, jerk) in all)| {
            let bounds = Bounds::new(Real::HUGE, thousandths(a), jerk.map(thousandths));
            let (v, part) = (thousandths(v), thousandths(part));
            let [to, rest] = [v * part, Real::ZERO].map(|to| distance(v, to, &bounds));
            prop_assert!(to <= rest + rest.scaled(-40) || part < Real::new(618_034) / Real::new(1_000_000));
            beyond.set(beyond.get() + u32::from(to > rest));
        });
        assert!(beyond.get() > 1000, "{beyond:?}");
    }
}
