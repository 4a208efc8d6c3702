//! Limits of an axis in the user's units, and in whole steps.

use step_motion::Limits;

/// What a few products may be off: 4.35 times 100 is a little less than 435.
pub(super) const LAST_BITS: f64 = 4.0 * f64::EPSILON;

/// A limit of an axis.
pub(super) struct Limit {
    key: &'static str,
    /// The unit of the user, how many seconds its time has, and the unit in steps.
    unit: &'static str,
    seconds: f64,
    steps: &'static str,
    /// The greatest, in steps.
    most: f64,
}

/// Half of the clock of a part program, whose ticks are ns.
pub(super) const SPEED: Limit = Limit { key: "speed", unit: "mm/min", seconds: 60.0, steps: "step/s", most: 5e8 };

pub(super) const ACCELERATION: Limit =
    Limit {
        key: "acceleration", unit: "mm/s²", seconds: 1.0, steps: "step/s²", most: Limits::MAX_ACCELERATION as f64
    };

pub(super) const JERK: Limit =
    Limit { key: "jerk", unit: "mm/s³", seconds: 1.0, steps: "step/s³", most: Limits::MAX_JERK as f64 };

impl Limit {
    /// The same with another greatest, in steps.
    pub(super) const fn up_to(self, most: f64) -> Self {
        Self { most, ..self }
    }

    /// Returns what was said of an axis in whole steps, none of which is beyond it.
    pub(super) fn steps(&self, axis: &str, said: Option<f64>, per_mm: f64) -> Result<Option<f64>, String> {
        let Some(said) = said else { return Ok(None) };
        let Self { key, unit, seconds, steps, most } = self;
        let whole = down(said * per_mm / seconds);
        let name = format!("{axis}:{key}={}", short(said));
        if whole < 1.0 {
            return Err(format!("{name} is below 1 {steps}, the least for an axis"));
        }
        if whole > *most {
            // Rounded down, so that it is accepted.
            let most = (most * seconds / per_mm * 1000.0).floor() / 1000.0;
            return Err(format!("{name} is above {most} {unit}, the greatest at {per_mm} steps/mm"));
        }
        Ok(Some(whole))
    }
}

/// Rounds down what is not negative.
pub(super) fn down(value: f64) -> f64 {
    (value * (1.0 + LAST_BITS)).floor()
}

/// A number as short as people write it.
fn short(number: f64) -> String {
    if number < 1e15 { number.to_string() } else { format!("{number:e}") }
}
