//! How long it takes to a new target in the middle of a motion, beside the time-optimal way there, which is reckoned here in floating
//! point and shares nothing with the crate.

use step_motion::{Clock, Limits, Mover};

/// Limits of speed, acceleration and jerk.
#[derive(Clone, Copy)]
struct Most {
    v: f64,
    a: f64,
    j: f64,
}

/// Time and distance from a speed and an acceleration to a speed at acceleration 0, as fast as the limits allow.
fn change([v, a]: [f64; 2], to: f64, most: Most) -> (f64, f64) {
    // The speed if the acceleration goes back to 0 at once.
    let coast = v + a * a.abs() / (2.0 * most.j);
    let sign = if to >= coast { 1.0 } else { -1.0 };
    let (begin, dv) = (sign * a, sign * (to - v));
    let peak = (most.j * dv + begin * begin / 2.0).max(0.0).sqrt().min(most.a);
    let flat =
        if peak > 0.0 { ((dv - (2.0 * peak * peak - begin * begin) / (2.0 * most.j)) / peak).max(0.0) } else { 0.0 };
    let (mut time, mut way, mut v, mut a) = (0.0, 0.0, v, a);
    for (lasts, jerk) in [((peak - begin) / most.j, sign * most.j), (flat, 0.0), (peak / most.j, -sign * most.j)] {
        let t: f64 = lasts;
        way += v * t + a * t * t / 2.0 + jerk * t * t * t / 6.0;
        v += a * t + jerk * t * t / 2.0;
        a += jerk * t;
        time += t;
    }
    (time, way)
}

/// The least time to rest after a distance: over the greatest speed that leaves room to brake. `None` if there is none.
fn optimum(state: [f64; 2], n: f64, most: Most) -> Option<f64> {
    let over = |top: f64| {
        let (up, down) = (change(state, top, most), change([top, 0.0], 0.0, most));
        (up.0 + down.0, up.1 + down.1)
    };
    let (time, way) = over(most.v);
    if way <= n {
        return Some(time + (n - way) / most.v);
    }
    // From the top: the first speed that fits, and from there as near as halving leads.
    let parts = 4000;
    let at = |k: u32| most.v * f64::from(k) / f64::from(parts);
    let fits = (0..parts).rev().find(|k| over(at(*k)).1 <= n)?;
    let (mut low, mut high) = (at(fits), at(fits + 1));
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if over(middle).1 <= n { low = middle } else { high = middle }
    }
    Some(over(low).0)
}

/// Numbers from 0 to below 1, always the same.
fn draws() -> impl FnMut() -> f64 {
    let mut state = 28_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// Ticks from a request to rest, and whether it went straight there.
fn rest(mut mover: Mover, target: i64) -> (u64, bool) {
    let (mut last, mut straight) = (0, true);
    while let Some(pulse) = mover.pulse() {
        straight &= !pulse.direction.dir();
        last = pulse.tick;
    }
    assert_eq!(mover.commanded(), target);
    let (mut low, mut high) = (last, last + 4_000_000);
    while low < high {
        let middle = low.midpoint(high);
        if mover.is_at_rest(middle) { high = middle } else { low = middle + 1 }
    }
    (low, straight)
}

#[test]
fn a_new_target_is_reached_as_fast_as_possible() {
    let (mut draw, mut straight, mut slow) = (draws(), 0, Vec::new());
    let mut spread = |low: f64, high: f64| (low.ln() + (high / low).ln() * draw()).exp();
    let mut case = 0;
    while straight < 3060 {
        case += 1;
        let (v, a, j) = (spread(500.0, 20_000.0) as u32, spread(5e3, 4e5) as u32, spread(1e5, 2e7) as u64);
        let limits = Limits::new(v, a).unwrap().with_jerk(j).unwrap();
        let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
        let first = spread(50.0, 2000.0) as i64;
        mover.move_to(first, 0).unwrap();
        let (end, _) = rest(mover.clone(), first);
        let now = (spread(0.02, 0.98) * end as f64) as u64;
        while mover.due().is_some_and(|due| due <= now) {
            mover.pulse();
        }
        let state = mover.at(now);
        let [p, v0, a0] = [(state.position, 32), (state.speed, 16), (state.acceleration, 16)]
            .map(|(value, bits)| value as f64 / f64::from(bits).exp2());
        let target = mover.commanded() + spread(1.0, 1500.0) as i64;
        mover.move_to(target, now).unwrap();
        let (end, ahead) = rest(mover, target);
        let best = optimum([v0, a0], target as f64 - p, Most { v: v.into(), a: a.into(), j: j as f64 });
        let Some(best) = best.filter(|_| ahead) else { continue };
        straight += 1;
        let time = (end - now) as f64 / 1e6;
        // Two ticks, and what a thousandth of a step takes right before rest.
        if time > best * 1.002 + 2e-6 + (6e-3 / j as f64).cbrt() {
            slow.push(format!("{case}: {time} for {best} s, from {v0} {a0} over {}, {v} {a} {j}", target as f64 - p));
        }
    }
    assert!(slow.is_empty(), "{} of {straight}: {slow:#?}", slow.len());
}
