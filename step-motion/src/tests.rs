//! The planner beside a model of its own in floating point.
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "numbers of random cases, compared within a part of them"
)]

pub(crate) mod model;
pub(crate) mod path;
mod planner;
mod promises;

use crate::limits::Bounds;
use crate::real::Real;
use model::Most;
use proptest::prelude::*;

/// Numbers spread over the decades.
fn spread(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

pub(crate) fn real(x: f64) -> Real {
    let bits = if x > 0.0 { 52 - x.log2().floor() as i32 } else { 0 };
    Real::fixed((x * f64::from(bits).exp2()) as u64, bits)
}

pub(crate) fn float(x: Real) -> f64 {
    let bits = 52_i32.saturating_sub(x.exponent()).clamp(-1000, 1000);
    if x.is_zero() { 0.0 } else { x.to_fixed(bits) as f64 * f64::from(-bits).exp2() }
}

fn bounds(most: Most) -> Bounds {
    Bounds::new(real(most.v), real(most.a), most.j.map(real))
}
