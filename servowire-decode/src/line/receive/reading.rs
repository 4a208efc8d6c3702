//! Reads edges: how they lie on a grid, and the bits of a field.

use crate::time::Time;

/// Rounds to the nearest whole number; negative numbers give 0.
#[inline]
pub(super) fn nearest(number: f64) -> u32 {
    (number + 0.5) as u32
}

/// How edges lie on a grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// Mean square distance, in bits.
    pub(super) misfit: f64,
    /// Covariance of distances and places, and variance of the places, as sums of products.
    pub(super) above: f64,
    pub(super) below: f64,
}

impl Fit {
    /// Returns the bit length that fits the edges best; `bit` is the one of the grid.
    pub(super) fn slope(self, bit: f64) -> f64 {
        self.alone(bit).unwrap_or(bit)
    }

    /// Returns the same, unless there are too few short fields to say anything.
    pub(super) fn alone(self, bit: f64) -> Option<f64> {
        (self.below >= 40.0).then(|| bit * (1.0 + self.above / self.below).clamp(0.97, 1.03))
    }
}

/// A field as read from its edges.
pub(super) struct Read {
    /// All bits from the start bit to the delimiter, the first in bit 0.
    pub(super) bits: u32,
    /// Where its grid begins.
    pub(super) start: Time,
    /// Spikes that were dropped before its edges.
    pub(super) spikes: u32,
    /// Whether all its edges are near their places on the grid, and it ends high.
    pub(super) is_even: bool,
}
