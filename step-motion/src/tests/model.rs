//! Motions in floating point, which share nothing with the crate.

/// Limits of speed, acceleration and jerk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Most {
    pub(crate) v: f64,
    pub(crate) a: f64,
    pub(crate) j: Option<f64>,
}

/// Speed and acceleration, below 0 to slow down.
pub(crate) type State = [f64; 2];

/// Time and distance from a state to a speed at acceleration 0, as fast as the limits allow.
pub(crate) fn change([v, a]: State, to: f64, most: Most) -> (f64, f64) {
    let Some(j) = most.j else {
        let time = (to - v).abs() / most.a;
        return (time, f64::midpoint(v, to) * time);
    };
    // The speed if the acceleration goes back to 0 at once.
    let sign = if to >= v + a * a.abs() / (2.0 * j) { 1.0 } else { -1.0 };
    let (begin, dv) = (sign * a, sign * (to - v));
    let peak = (j * dv + begin * begin / 2.0).max(0.0).sqrt().min(most.a).max(begin);
    let rest = dv - (2.0 * peak * peak - begin * begin) / (2.0 * j);
    let flat = if peak > 0.0 { (rest / peak).max(0.0) } else { 0.0 };
    let (mut time, mut way, mut v, mut a) = (0.0, 0.0, v, a);
    for (t, jerk) in [((peak - begin) / j, sign * j), (flat, 0.0), (peak / j, -sign * j)] {
        way += v * t + a * t * t / 2.0 + jerk * t * t * t / 6.0;
        v += a * t + jerk * t * t / 2.0;
        a += jerk * t;
        time += t;
    }
    (time, way)
}

/// Time and distance over a speed between.
fn over(state: State, top: f64, exit: f64, most: Most) -> (f64, f64) {
    let (there, on) = (change(state, top, most), change([top, 0.0], exit, most));
    (there.0 + on.0, there.1 + on.1)
}

/// Into how many parts the speeds are divided to look for one.
const PARTS: i32 = 300;

/// The last of the speeds that lead from one to another for which a condition holds, before the first one for which it does not.
fn last(from: f64, to: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let at = |k: i32| from + (to - from) * f64::from(k) / f64::from(PARTS);
    let Some(first) = (1..=PARTS).find(|k| !holds(at(*k))) else { return to };
    let (mut good, mut bad) = (at(first - 1), at(first));
    for _ in 0..60 {
        let middle = f64::midpoint(good, bad);
        if holds(middle) { good = middle } else { bad = middle }
    }
    good
}

/// The time over a distance to a speed at its end, by way of the greatest speed that fits; `None` if none does.
pub(crate) fn fastest(state: State, n: f64, exit: f64, most: Most) -> Option<f64> {
    let fits = |top: f64| over(state, top, exit, most).1 <= n;
    if fits(most.v) {
        let (time, way) = over(state, most.v, exit, most);
        return Some(time + (n - way) / most.v);
    }
    // The present acceleration may go back to 0 at once: at the speed to which that leads, a little distance may be enough.
    let coast = coasted(state, most);
    let low = if coast > exit && fits(coast) { coast } else { exit };
    let top = last(most.v, low, |top| !fits(top));
    // One that fits is a little lower.
    let top = (top - most.v * 1e-12).max(low);
    fits(top).then(|| over(state, top, exit, most).0)
}

/// The greatest speed at the end of a distance.
pub(crate) fn fastest_exit(state: State, n: f64, most: Most) -> f64 {
    last(coasted(state, most), most.v, |exit| change(state, exit, most).1 <= n)
}

/// The lowest speed at the end of a distance: the one that is asked for, or the one down to which all from the present one can be had.
pub(crate) fn slowest_exit(state: State, n: f64, exit: f64, most: Most) -> f64 {
    if change(state, exit, most).1 <= n {
        return exit;
    }
    last(coasted(state, most).max(exit), exit, |exit| change(state, exit, most).1 <= n)
}

/// The speed when the acceleration is back at 0.
pub(crate) fn coasted([v, a]: State, most: Most) -> f64 {
    v + most.j.map_or(0.0, |j| a * a.abs() / (2.0 * j))
}

/// The way that is left of a stop where it has slowed down to a speed; all of it and more if it never is faster.
pub(crate) fn braking_way([v, a]: State, to: f64, most: Most) -> f64 {
    let j = most.j.unwrap();
    // As from a steady motion, part of which has passed if it slows down already.
    let from = v + a * a / (2.0 * j);
    if to >= from {
        return f64::INFINITY;
    }
    let peak = most.a.min((j * from).sqrt());
    let bend = peak * peak / (2.0 * j);
    let fading = |v: f64| j * (2.0 * v / j).sqrt().powi(3) / 6.0;
    let flat = |v: f64| fading(bend) + (v * v - bend * bend) / (2.0 * peak);
    if to <= bend {
        fading(to)
    } else if to <= from - bend {
        flat(to)
    } else {
        let begun = |v: f64| {
            let time = (2.0 * (from - v) / j).sqrt();
            from * time - j * time.powi(3) / 6.0
        };
        flat(from - bend) + begun(from - bend) - begun(to)
    }
}
