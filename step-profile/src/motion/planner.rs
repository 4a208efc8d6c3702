//! The fastest curve from a state to a speed, over a distance or without end.
//!
//! All curves are made of slopes between speeds at acceleration 0. A state with an acceleration lies on a slope that began
//! earlier, at its *virtual start*, so a curve may begin in the middle of a slope. Only where the acceleration has to change
//! its sign it is brought to 0 first.

use super::curve::{Bend, Curve};
use super::limits::{Bounds, Jerk};
use super::real::{Real, THIRD};
use super::slope::{Slope, distance};

/// Speed and acceleration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub(super) v: Real,
    /// Size of the acceleration.
    pub(super) a: Real,
    /// The acceleration speeds up.
    pub(super) up: bool,
}

impl Motion {
    pub(super) const fn steady(v: Real) -> Self {
        Self { v, a: Real::ZERO, up: true }
    }
}

/// Where a curve leads.
#[derive(Debug, Clone, Copy)]
pub(super) enum Goal {
    /// This far, with this speed at the end.
    At(Real, Real),
    /// To this speed, wherever that is.
    Speed(Real),
}

/// Distances may be this much too short, in steps: what rounding leaves.
pub(super) const SLACK: Real = Real::fixed(1, 16);

/// The speed at which an endless curve ends is cruised for this many moments.
pub(super) const ENDLESS: Real = Real::fixed(1, -60);

/// The curve; or the least distance that is needed, if there is not as much.
pub(super) fn plan(start: Motion, goal: Goal, bounds: &Bounds) -> Result<Curve, Real> {
    let mut curve = Curve::new();
    match plan_into(&mut curve, start, goal, bounds) {
        Ok(()) => Ok(curve),
        Err(need) => Err(need),
    }
}

/// The same in its place, an empty curve: it is large.
pub(super) fn plan_into(curve: &mut Curve, start: Motion, goal: Goal, bounds: &Bounds) -> Result<(), Real> {
    match bounds.jerk {
        Some(jerk) if !start.a.is_zero() => {
            let bend = Bent::new(start, jerk);
            if start.up {
                rising(curve, start, &bend, goal, bounds)
            } else {
                falling(curve, start, &bend, goal, bounds)
            }
        }
        _ => steady(curve, start.v, goal, bounds),
    }
}

/// What an acceleration under way means.
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

    /// The curve has begun at the virtual start.
    const fn on_the_slope(&self, curve: &mut Curve) {
        curve.skipped = (self.edge, self.base.1);
    }
}

/// Further up the slope if the goal asks for it, else back to acceleration 0 and on from there.
fn rising(curve: &mut Curve, start: Motion, bent: &Bent, goal: Goal, bounds: &Bounds) -> Result<(), Real> {
    let from_base = match goal {
        Goal::At(n, exit) => Goal::At(n + bent.base.1, exit),
        speed @ Goal::Speed(_) => speed,
    };
    if let Ok(top) = top(bent.base.0, from_base, bounds) {
        if top >= bent.coast.0 {
            bent.on_the_slope(curve);
            return steady(curve, bent.base.0, from_base, bounds);
        }
    }
    coast(curve, start, bent, goal, bounds)
}

/// The acceleration is brought to 0 first.
fn coast(curve: &mut Curve, start: Motion, bent: &Bent, goal: Goal, bounds: &Bounds) -> Result<(), Real> {
    let rest = match goal {
        Goal::At(n, _) if n + SLACK < bent.coast.1 => {
            return Err(bent.coast.1 + distance(bent.coast.0, Real::ZERO, bounds));
        }
        Goal::At(n, exit) => Goal::At(n - bent.coast.1, exit),
        speed @ Goal::Speed(_) => speed,
    };
    curve.push((bent.edge, bent.coast.1), [start.v, start.a, bent.jerk.j], start.up, Bend::Fading);
    steady(curve, bent.coast.0, rest, bounds).map_err(|need| need + bent.coast.1)
}

/// Off the slope if the goal leaves room for it, else further down it: at least to the speed that the brake has reached,
/// and as little below as the distance allows.
fn falling(curve: &mut Curve, start: Motion, bent: &Bent, goal: Goal, bounds: &Bounds) -> Result<(), Real> {
    let ((base, back), (low, _)) = (bent.base, bent.coast);
    let (target, exit) = match goal {
        Goal::Speed(v) if v < low => {
            bent.on_the_slope(curve);
            return steady(curve, base, goal, bounds);
        }
        Goal::At(n, exit) => (n + back, exit),
        Goal::Speed(_) => return coast(curve, start, bent, goal, bounds),
    };
    if bounds.v >= low {
        if coast(curve, start, bent, goal, bounds).is_ok() {
            return Ok(());
        }
        curve.clear();
    }
    let least = distance(base, exit, bounds);
    // Above the speed that is left when the acceleration is back at 0 the slope does not lead there.
    if least > target + SLACK || exit > low {
        return Err(least - back);
    }
    let need = |v| distance(base, v, bounds) + distance(v, exit, bounds);
    let high = low.min(bounds.v).max(exit);
    let v = crossing(exit, high, target, need);
    bent.on_the_slope(curve);
    finish(curve, [base, v, exit], target, bounds);
    Ok(())
}

/// Slope, cruise, slope.
fn finish(curve: &mut Curve, [from, top, exit]: [Real; 3], n: Real, bounds: &Bounds) {
    let (up, down) = (Slope::new(from, top, bounds), Slope::new(top, exit, bounds));
    curve.slope(&up);
    curve.cruise(top, n - (up.distance + down.distance));
    curve.slope(&down);
}

/// From a speed at acceleration 0.
fn steady(curve: &mut Curve, from: Real, goal: Goal, bounds: &Bounds) -> Result<(), Real> {
    match goal {
        Goal::At(n, exit) => {
            let top = top(from, goal, bounds)?;
            finish(curve, [from, top, exit], n, bounds);
        }
        Goal::Speed(v) => {
            curve.slope(&Slope::new(from, v, bounds));
            curve.cruise(v, v * ENDLESS);
        }
    }
    Ok(())
}

/// The speed between the two slopes.
fn top(from: Real, goal: Goal, bounds: &Bounds) -> Result<Real, Real> {
    let (n, exit) = match goal {
        Goal::At(n, exit) => (n, exit),
        Goal::Speed(v) => return Ok(v),
    };
    let least = distance(from, exit, bounds);
    if least > n + SLACK {
        return Err(least);
    }
    let need = |v| distance(from, v, bounds) + distance(v, exit, bounds);
    if need(bounds.v) <= n {
        return Ok(bounds.v);
    }
    let low = from.max(exit);
    if low >= bounds.v {
        return Ok(low);
    }
    // Without a jerk limit: v² = a n + (v0² + v1²) / 2. With one it is less.
    let sum = bounds.a * n + (from.squared() + exit.squared()).half();
    let Some(jerk) = bounds.jerk else { return Ok(sum.sqrt().min(bounds.v).max(low)) };
    // Both slopes reach the greatest acceleration: v² + (a²/j) v = sum - (v0 + v1) a²/2j.
    let knee = jerk.knee.half();
    let rest = sum - (from + exit) * knee;
    let v = rest / (knee + (knee.squared() + rest).sqrt());
    if v >= low + jerk.knee {
        return Ok(v);
    }
    // Each slope takes at least dv sqrt(dv / j), both together just n if they begin and end at rest and only jerk.
    let steep = (n.squared() * jerk.j).scaled(-2).cbrt();
    let high = (low + steep).min(sum.sqrt()).min(bounds.v);
    Ok(climb(low, high, n, |v| {
        let (up, down) = (Slope::new(from, v, bounds), Slope::new(v, exit, bounds));
        (up.distance + down.distance, up.growth(bounds) + down.growth(bounds))
    }))
}

/// The greatest speed from which `to` can be reached within `n`, or the greatest that can be reached from it.
pub(super) fn greatest(to: Real, n: Real, bounds: &Bounds) -> Real {
    let most = (to.squared() + (bounds.a * n).scaled(1)).sqrt().min(bounds.v).max(to);
    match bounds.jerk {
        None => most,
        Some(_) => climb(to, most, n, |v| {
            let slope = Slope::new(v, to, bounds);
            (slope.distance, slope.growth(bounds))
        }),
    }
}

/// As [`crossing`], for a need that grows with the speed, with how fast it does: Newton's steps from `high` down, over the
/// root of the speed above `low`, where the need bends upwards. Each of them ends above the speed that is looked for, so the
/// last one is made a little longer.
fn climb(low: Real, high: Real, n: Real, need: impl Fn(Real) -> (Real, Real)) -> Real {
    let mut root = (high - low).sqrt();
    for round in 0..12_u8 {
        let speed = low + root.squared();
        let (got, growth) = need(speed);
        if got <= n {
            if round > 0 && (n - got).scaled(14) > n {
                break;
            }
            return speed;
        }
        let over = got - n;
        let step = over / (root * growth).scaled(1);
        let more = if over.scaled(7) <= n { step.scaled(-7) } else { Real::ZERO };
        root = root - (step + more);
        if root.is_zero() {
            break;
        }
    }
    crossing(low, high, n, |v| need(v).0)
}

/// The greatest speed at which a motion may end after `n`.
pub(super) fn fastest_exit(start: Motion, n: Real, bounds: &Bounds) -> Real {
    match bounds.jerk.filter(|_| !start.a.is_zero()).map(|jerk| Bent::new(start, jerk)) {
        None => greatest(start.v, n, bounds),
        Some(Bent { base, .. }) if start.up => greatest(base.0, n + base.1, bounds),
        Some(Bent { coast, .. }) => greatest(coast.0, n - coast.1, bounds),
    }
}

/// The speed nearest to `exit` from above at which a motion that brakes at once may end after `n`.
///
/// A jerk-limited brake to a lower speed may be shorter than one to a higher speed, for it has more of its way at the
/// greatest acceleration. What is found is the end of the speeds that the way lasts for, from the present one down.
pub(super) fn slowest_exit(start: Motion, n: Real, exit: Real, bounds: &Bounds) -> Real {
    let (from, least, n) = match bounds.jerk.filter(|_| !start.a.is_zero()).map(|jerk| Bent::new(start, jerk)) {
        None => (start.v, Real::ZERO, n),
        Some(Bent { coast, .. }) if start.up => (coast.0, Real::ZERO, n - coast.1),
        Some(Bent { base, coast, .. }) => (base.0, base.0 - coast.0, n + base.1),
    };
    if from <= exit {
        return from;
    }
    match bounds.jerk {
        None => (from.squared() - (bounds.a * n).scaled(1)).sqrt().max(exit),
        Some(_) => from - crossing(least, (from - exit).max(least), n, |by| distance(from, from - by, bounds)),
    }
}

/// The largest speed between `low` and `high`, as near as it matters, from and to which `need` is not above `n`. It is not
/// `low`.
///
/// Near `low` the need grows with the root of the speed above it, and that root is what is searched: false position, with
/// the end that stays weighed less (Illinois), and halving if that takes long.
fn crossing(low: Real, high: Real, n: Real, need: impl Fn(Real) -> Real) -> Real {
    let top = need(high);
    if top <= n {
        return high;
    }
    let (base, mut best) = (low, low);
    let (mut low, mut high) = (Real::ZERO, (high - low).sqrt());
    let mut left = n - need(base);
    let (mut below, mut above, mut rose) = (left, top - n, None);
    for round in 0..40_u8 {
        let width = high - low;
        if left.scaled(14) <= n || width.scaled(40) <= high {
            break;
        }
        let part = if round % 16 > 8 { width.half() } else { width * (below / (below + above)) };
        let middle = low + part;
        let speed = base + middle.squared();
        let got = need(speed);
        if got <= n {
            left = n - got;
            (low, best, below) = (middle, speed, left);
            if rose == Some(true) {
                above = above.half();
            }
        } else {
            (high, above) = (middle, got - n);
            if rose == Some(false) {
                below = below.half();
            }
        }
        rose = Some(got <= n);
    }
    best
}
