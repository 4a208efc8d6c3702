//! The search for a curve, in steps, and how it is drawn.

use super::crossing::Crossing;
use super::{Bent, ENDLESS, Goal, Motion, SLACK, top};
use crate::curve::{Bend, Curve};
use crate::limits::Bounds;
use crate::real::Real;
use crate::slope::{Slope, distance};

/// The search for the speeds of a curve, in steps that take about the same time. The limits are the same in all of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search {
    start: Motion,
    goal: Goal,
    bent: Option<Bent>,
    stage: Stage,
}

/// What a search tries next.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// There is no acceleration; or it continues up the slope if the goal requires it, and otherwise goes back to 0.
    Rising,
    /// The acceleration is brought to 0 first.
    Coast,
    /// It leaves the slope down if the goal leaves room for that, otherwise it continues: at least to the speed that braking has
    /// reached, and as little below that as the distance allows.
    Falling,
    Slope,
    Crossing(Crossing),
}

/// The speeds of a curve that has been found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    lead: Lead,
    from: Real,
    to: To,
}

/// How the curve begins.
#[derive(Debug, Clone, Copy)]
enum Lead {
    Steady,
    /// It begins at the virtual start.
    Slope,
    /// Back to acceleration 0.
    Coast,
}

#[derive(Debug, Clone, Copy)]
enum To {
    /// A slope, a cruise over the rest of a distance if there is one, and a slope.
    Speeds(Real, Real, Option<Real>),
    /// A slope to the last speed.
    Speed(Real),
}

impl Search {
    pub(crate) const NONE: Self =
        Self { start: Motion::steady(Real::ZERO), goal: Goal::Speed(Real::ZERO), bent: None, stage: Stage::Rising };

    pub(crate) fn new(start: Motion, goal: Goal, bounds: &Bounds) -> Self {
        let bent = bounds.jerk.filter(|_| !start.a.is_zero()).map(|jerk| Bent::new(start, jerk));
        let stage = match bent {
            Some(_) if !start.up => Stage::Falling,
            _ => Stage::Rising,
        };
        Self { start, goal, bent, stage }
    }

    /// Goes a step further; returns what has been found, or the smallest sufficient distance if there is too little.
    pub(crate) fn step(&mut self, bounds: &Bounds) -> Option<Result<Found, Real>> {
        let Some(bent) = &self.bent else { return Some(steady(Lead::Steady, self.start.v, self.goal, bounds)) };
        let (found, next) = match &mut self.stage {
            Stage::Rising => (rising(bent, self.goal, bounds), Stage::Coast),
            Stage::Coast => match coast(bent, self.goal, bounds) {
                Err(_) if !self.start.up => (None, Stage::Slope),
                found => (Some(found), Stage::Coast),
            },
            Stage::Falling => match self.goal {
                Goal::Speed(v) if v < bent.coast.0 => {
                    (Some(steady(Lead::Slope, bent.base.0, self.goal, bounds)), Stage::Falling)
                }
                Goal::At(..) if bounds.v < bent.coast.0 => (None, Stage::Slope),
                _ => (None, Stage::Coast),
            },
            Stage::Slope => match slope(bent, self.goal, bounds) {
                Err(need) => (Some(Err(need)), Stage::Slope),
                Ok(crossing) => (None, Stage::Crossing(crossing)),
            },
            Stage::Crossing(crossing) => {
                if !crossing.is_over() {
                    crossing.step(|v| needs(bent, v, self.goal, bounds));
                    return None;
                }
                // What is left is cruised at this speed, but it may be low: rounding is not crawled over.
                let rest = Some(crossing.n).filter(|_| crossing.left > SLACK);
                let to = To::Speeds(crossing.best, self.goal.exit(), rest);
                return Some(Ok(Found { lead: Lead::Slope, from: bent.base.0, to }));
            }
        };
        self.stage = next;
        found
    }

    /// Draws what has been found into an empty curve.
    pub(crate) fn draw(&self, curve: &mut Curve, found: &Found, bounds: &Bounds) {
        if let Some(bent) = &self.bent {
            match found.lead {
                Lead::Steady => {}
                Lead::Slope => curve.skipped = (bent.edge, bent.base.1),
                Lead::Coast => {
                    let state = [self.start.v, self.start.a, bent.jerk.j];
                    curve.push((bent.edge, bent.coast.1), state, self.start.up, Bend::Fading);
                }
            }
        }
        match found.to {
            To::Speeds(top, exit, n) => {
                let up = Slope::new(found.from, top, bounds);
                let down = if found.from == exit { up.reversed() } else { Slope::new(top, exit, bounds) };
                curve.slope(&up);
                if let Some(n) = n {
                    curve.cruise(top, n - (up.distance + down.distance));
                }
                curve.slope(&down);
            }
            To::Speed(v) => {
                curve.slope(&Slope::new(found.from, v, bounds));
                curve.cruise(v, v * ENDLESS);
            }
        }
    }
}

impl Found {
    pub(crate) const NONE: Self = Self { lead: Lead::Steady, from: Real::ZERO, to: To::Speed(Real::ZERO) };
}

impl Goal {
    /// The speed at the end.
    const fn exit(self) -> Real {
        match self {
            Self::At(_, exit) => exit,
            Self::Speed(v) => v,
        }
    }
}

/// Continues up the slope, if that leads to a speed above the one that is reached without.
fn rising(bent: &Bent, goal: Goal, bounds: &Bounds) -> Option<Result<Found, Real>> {
    let from_base = match goal {
        Goal::At(n, exit) => Goal::At(n + bent.base.1, exit),
        speed @ Goal::Speed(_) => speed,
    };
    let top = top(bent.base.0, from_base, bounds).ok().filter(|top| *top >= bent.coast.0)?;
    Some(Ok(along(Lead::Slope, bent.base.0, top, from_base, bounds)))
}

/// Brings the acceleration to 0 first.
fn coast(bent: &Bent, goal: Goal, bounds: &Bounds) -> Result<Found, Real> {
    let rest = match goal {
        Goal::At(n, _) if n + SLACK < bent.coast.1 => {
            return Err(bent.coast.1 + distance(bent.coast.0, Real::ZERO, bounds));
        }
        Goal::At(n, exit) => Goal::At(n - bent.coast.1, exit),
        speed @ Goal::Speed(_) => speed,
    };
    steady(Lead::Coast, bent.coast.0, rest, bounds).map_err(|need| need + bent.coast.1)
}

/// Continues down the slope, with a search for the speed between its two ends.
fn slope(bent: &Bent, goal: Goal, bounds: &Bounds) -> Result<Crossing, Real> {
    let Goal::At(n, exit) = goal else { return Err(Real::ZERO) };
    let ((base, back), (low, _)) = (bent.base, bent.coast);
    let (target, least) = (n + back, distance(base, exit, bounds));
    // The slope cannot lead to a speed above the one that is left when the acceleration is back at 0.
    if least > target + SLACK || exit > low {
        return Err(least - back);
    }
    let ends = (exit, low.min(bounds.v).max(exit));
    let enough = SLACK.max((target - least).scaled(-10));
    Ok(Crossing::new(ends, target, enough, |v| needs(bent, v, goal, bounds)))
}

/// Returns the distance from the virtual start to a speed, and on to the goal's.
fn needs(bent: &Bent, v: Real, goal: Goal, bounds: &Bounds) -> Real {
    distance(bent.base.0, v, bounds) + distance(v, goal.exit(), bounds)
}

/// Plans from a speed at acceleration 0.
fn steady(lead: Lead, from: Real, goal: Goal, bounds: &Bounds) -> Result<Found, Real> {
    Ok(along(lead, from, top(from, goal, bounds)?, goal, bounds))
}

/// Returns the curve with a speed between the two slopes. If that is below the greatest speed, the slopes take all of the
/// distance.
fn along(lead: Lead, from: Real, top: Real, goal: Goal, bounds: &Bounds) -> Found {
    let to = match goal {
        Goal::At(n, exit) => To::Speeds(top, exit, Some(n).filter(|_| top >= bounds.v)),
        Goal::Speed(v) => To::Speed(v),
    };
    Found { lead, from, to }
}
