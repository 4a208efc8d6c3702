//! Which lines form a run.

use crate::limits::Bounds;
use crate::line::Line;
use crate::real::Real;

/// How much more acceleration or jerk a line may allow than another one of the same run.
const ALIKE: Real = Real::fixed(3, 1);
/// How much more speed it may allow.
const EQUAL: Real = Real::fixed(129, 7);

/// Consecutive lines of the queue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// Lines after the first one.
    pub(super) more: usize,
    pub(super) length: Real,
    /// The limits that hold on all of them.
    pub(super) bounds: Bounds,
}

/// Which lines may form a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    /// At most a fraction of the requested speeds; without one, all that the axes allow.
    pub(super) part: Option<Real>,
    /// The speed under way, and its acceleration and jerk: limits below these would make them jump.
    pub(super) speed: Real,
    pub(super) held: [Real; 2],
    /// Also lines that allow other accelerations.
    pub(super) any: bool,
    /// The speed that it may have on the line before, if it is still there; otherwise 0.
    pub(super) early: Real,
}

/// Returns the speed that a line allows.
pub(super) fn allowed<const N: usize>(line: &Line<N>, part: Option<Real>) -> Real {
    part.map_or(line.bounds.v, |part| line.speed(part))
}

impl Run {
    /// All bytes are zero, so an array of it is cleared rather than copied.
    pub(super) const NONE: Self = Self { more: 0, length: Real::ZERO, bounds: Bounds::NONE };

    /// Adds the next line; returns false if it has to stay outside.
    #[inline]
    pub(super) fn add<const N: usize>(&mut self, line: &Line<N>, Kind { part, speed, held, any, .. }: Kind) -> bool {
        let Run { more, length, bounds } = self;
        let fastest = if part.is_some() { bounds.v.max(speed) } else { speed };
        let (Some(jerk), Some(other), true) = (bounds.jerk, line.bounds.jerk, line.corner >= fastest) else {
            return false;
        };
        let (own, most) = (line.bounds.a, allowed(line, part));
        let alike = |a: Real, b: Real, by: Real| a == b || a <= b * by && b <= a * by;
        // What is too fast slows down at once, however many lines that takes.
        let open = most >= speed || speed > bounds.v && line.bounds.v >= speed;
        if !open || part.is_some() && !alike(most, bounds.v, EQUAL) {
            return false;
        }
        let (a, j) = (bounds.a.min(own), jerk.j.min(other.j));
        let same = any || alike(own, bounds.a, ALIKE) && alike(other.j, jerk.j, ALIKE);
        if !same || a < held[0] || j < held[1] {
            return false;
        }
        if a != bounds.a || j != jerk.j {
            *bounds = Bounds::new(bounds.v, a, Some(j));
        }
        bounds.v = bounds.v.min(most);
        (*more, *length) = (more.saturating_add(1), *length + line.length);
        true
    }
}
