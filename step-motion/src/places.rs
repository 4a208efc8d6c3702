//! Ways between places that are not on a curve: those of an axis from where it has come to rest to a whole step.

use crate::curve::{Bend, Piece};
use crate::limits::Clock;
use crate::phases::{P, State};
use crate::plan::Setpoint;
use crate::real::Real;
use servowire_core::Direction;

/// Twice of what rounding may leave of a line, in 2^-32 steps.
const ROUNDED: u64 = 1 << 17;

/// Returns the distance between two positions in steps; none if it is one of rounding.
pub(super) fn gap(from: i64, to: i64) -> Real {
    let off = to.wrapping_sub(from).unsigned_abs();
    if off < ROUNDED { Real::ZERO } else { Real::fixed(off, P) }
}

pub(super) fn since(begin: u64, moment: u64) -> Real {
    Real::new(moment.saturating_sub(begin))
}

/// Returns the state of an axis that goes from one position to another in a motion along a way; at its end it rests.
pub(super) fn between(clock: Clock, (from, to): (i64, i64), way: Real, there: &Piece) -> Setpoint {
    let Piece { p, v, a, j, up, bend, .. } = *there;
    if p >= way {
        return Setpoint::at_rest(to);
    }
    let whole = to.wrapping_sub(from);
    let scale = Real::fixed(whole.unsigned_abs(), P) / way;
    let p = i64::try_from((p * scale).to_fixed(P)).unwrap_or(i64::MAX);
    let state = State { p, v: v * scale, a: (a * scale, up), j: (j * scale, up == (bend != Bend::Fading)) };
    let state = Setpoint::new(clock, state).on_axis(0, Direction::of(whole));
    Setpoint { position: from.wrapping_add(state.position), ..state }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2^-15 of a step are a way, and less is rounding: nothing waits for that.
    #[test]
    fn what_rounding_leaves_is_no_way() {
        for off in [0, 1, 1 << 16, (1 << 17) - 1] {
            assert!(gap(7 << 32, (7 << 32) + off).is_zero() && gap(off, 0).is_zero(), "{off}");
        }
        for off in [1_i64 << 17, 1 << 31, 5 << 32] {
            let want = Real::fixed(off.unsigned_abs(), 32);
            assert!(gap(0, off) == want && gap(-off, 0) == want, "{off}");
        }
    }
}
