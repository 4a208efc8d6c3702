//! Which lines form a run.

use crate::limits::Bounds;
use crate::line::Line;
use crate::real::Real;

/// How much more acceleration or jerk a line may allow than another one of the same run.
const ALIKE: Real = Real::fixed(3, 1);
/// How much more speed it may allow.
const EQUAL: Real = Real::fixed(129, 7);
/// How much more speed a corner in a run may allow than the slowest one.
const BENT: Real = Real::fixed(9, 3);

/// Consecutive lines of the queue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// Lines after the first one.
    pub(super) more: usize,
    pub(super) length: Real,
    /// The limits that hold on all of them, and on the corners between them.
    pub(super) bounds: Bounds,
    /// The speed that the lines allow, and the length of the longest one.
    pub(super) allowed: Real,
    pub(super) longest: Real,
}

/// Which lines may form a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    /// At most a fraction of the requested speeds; without one, all that the axes allow.
    pub(super) part: Option<Real>,
    /// The speed under way, and its acceleration and jerk: limits below these would make them jump.
    pub(super) speed: Real,
    pub(super) held: [Real; 2],
    /// The least speed that the next corner has to allow: mostly that under way.
    pub(super) corner: Real,
    /// Also lines that allow other accelerations; or that are requested at other speeds.
    pub(super) any: bool,
    pub(super) feeds: bool,
    /// The speed that it may have on the line before, if it is still there; otherwise 0.
    pub(super) early: Real,
}

/// Returns the speed that a line allows.
pub(super) fn allowed<const N: usize>(line: &Line<N>, part: Option<Real>) -> Real {
    part.map_or(line.bounds.v, |part| line.speed(part))
}

impl Run {
    /// All bytes are zero, so an array of it is cleared rather than copied.
    pub(super) const NONE: Self =
        Self { more: 0, length: Real::ZERO, bounds: Bounds::NONE, allowed: Real::ZERO, longest: Real::ZERO };

    /// A run of one line.
    pub(super) const fn of(length: Real, bounds: Bounds) -> Self {
        Self { more: 0, length, bounds, allowed: bounds.v, longest: length }
    }

    /// Adds the next line; returns false if it has to stay outside.
    #[inline]
    pub(super) fn add<const N: usize>(&mut self, line: &Line<N>, kind: Kind) -> bool {
        let Kind { part, speed, corner, held, any, feeds, .. } = kind;
        let Run { more, length, bounds, allowed: lines, longest } = self;
        let (Some(jerk), Some(other), true) = (bounds.jerk, line.bounds.jerk, line.corner >= corner) else {
            return false;
        };
        let (own, most) = (line.bounds.a, allowed(line, part));
        let alike = |a: Real, b: Real, by: Real| a == b || a <= b * by && b <= a * by;
        // What is too fast slows down at once, however many lines that takes.
        if !(most >= speed || (feeds || speed > bounds.v) && line.bounds.v >= speed) {
            return false;
        }
        let (a, j) = (bounds.a.min(own), jerk.j.min(other.j));
        let same = any || alike(own, bounds.a, ALIKE) && alike(other.j, jerk.j, ALIKE);
        if !same || a < held[0] || j < held[1] {
            return false;
        }
        let (v, long) = ((*lines).min(most), (*longest).max(line.length));
        // A stop needs no speed at a corner but its own.
        let slowest = if part.is_some() { bounds.v.min(v).min(line.corner) } else { v };
        if part.is_some() && !feeds {
            let before = if *more > 0 { bounds.v } else { slowest };
            let corners = [slowest, before, line.corner.min(v)];
            let one =
                if slowest < v { bends(corners, (*length + line.length, long), j) } else { alike(most, *lines, EQUAL) };
            if !one {
                return false;
            }
        }
        if a != bounds.a || j != jerk.j {
            *bounds = Bounds::new(bounds.v, a, Some(j));
        }
        (bounds.v, *lines, *longest) = (slowest, v, long);
        (*more, *length) = (more.saturating_add(1), *length + line.length);
        true
    }
}

/// Returns whether lines with corners between them, which allow less speed than the lines, are a bend of the path to be passed at the speed
/// of the slowest corner. No line is so long that it would be faster by more than a 32nd between its corners; and either the corners allow
/// about the same speed, or the bend is so short that the speed cannot change by more than an eighth along it: by j t²/4 in the time t.
#[cold]
fn bends([slowest, so_far, next]: [Real; 3], (length, longest): (Real, Real), jerk: Real) -> bool {
    let cube = slowest.squared() * slowest;
    let change = |length: Real| jerk * length.squared();
    let alike = so_far <= slowest * BENT && next <= slowest * BENT;
    change(longest) <= cube.scaled(-3) && (alike || change(length) <= cube.scaled(-1))
}
