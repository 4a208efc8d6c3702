//! The largest speed whose need is met.

use crate::real::Real;

/// The search for the largest speed between two for which a need is not above `n`, but for what `enough` of `n` is worth.
///
/// Near the lower one the need grows with the square root of the excess speed, so the search runs over that root: by false
/// position, with less weight on the end that stays (Illinois) and at least by a sixteenth of what is left, and by halving
/// if that takes long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub(super) n: Real,
    enough: Real,
    /// The lower speed; and the best one so far, with what it leaves of `n`.
    base: Real,
    pub(super) best: Real,
    pub(super) left: Real,
    /// The ends of the search, as roots; what the need is below `n` at the lower and above it at the upper one, with their weights.
    low: Real,
    high: Real,
    below: Real,
    above: Real,
    /// Which end was moved last.
    rose: Option<bool>,
    round: u8,
}

impl Crossing {
    pub(super) fn new((low, high): (Real, Real), n: Real, enough: Real, need: impl Fn(Real) -> Real) -> Self {
        let (least, most) = (need(low), need(high));
        let fits = most <= n;
        let (best, left) = if fits { (high, n - most) } else { (low, n - least) };
        let round = if fits { Self::MOST } else { 0 };
        let (below, above) = (left, most - n);
        let (base, low, high) = (low, Real::ZERO, (high - low).sqrt());
        Self { n, enough, base, best, left, low, high, below, above, rose: None, round }
    }

    const MOST: u8 = 40;

    /// Returns that speed.
    pub(super) fn find(mut self, need: impl Fn(Real) -> Real) -> Real {
        while !self.is_over() {
            self.step(&need);
        }
        self.best
    }

    pub(super) fn is_over(&self) -> bool {
        self.round >= Self::MOST || self.left <= self.enough || (self.high - self.low).scaled(40) <= self.high
    }

    pub(super) fn step(&mut self, need: impl Fn(Real) -> Real) {
        let Self { low, high, below, above, .. } = *self;
        let width = high - low;
        let part = if self.round % 16 > 8 {
            width.half()
        } else {
            // A little less than all is enough.
            let aim = self.enough.half();
            (width * ((below - aim) / (below + above))).max(width.scaled(-4))
        };
        let middle = low + part;
        let speed = self.base + middle.squared();
        let got = need(speed);
        let rises = got <= self.n;
        if rises {
            self.left = self.n - got;
            (self.low, self.best, self.below) = (middle, speed, self.left);
            if self.rose == Some(true) {
                self.above = above.half();
            }
        } else {
            (self.high, self.above) = (middle, got - self.n);
            if self.rose == Some(false) {
                self.below = below.half();
            }
        }
        self.rose = Some(rises);
        self.round = self.round.saturating_add(1);
    }
}
