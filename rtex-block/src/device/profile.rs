/// Command generator of profile motion: a trapezoid of speed over time, in whole numbers.
///
/// Speeds are in thousandths of a command unit per second, positions in command units with 10^-9 of one as the
/// fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Generator {
    /// Remaining command units, signed.
    to_go: i64,
    speed_milli: i64,
    fraction_nano: i64,
}

/// Accelerations, command units per second squared.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    pub(super) up: i64,
    pub(super) down: i64,
}

const MILLI: i64 = 1_000;
const NANO: i64 = 1_000_000_000;

impl Generator {
    pub(super) const fn new(distance: i32) -> Self {
        Self { to_go: distance as i64, speed_milli: 0, fraction_nano: 0 }
    }

    pub(super) const fn distance_to_go(&self) -> i64 {
        self.to_go
    }

    /// Runs one update period towards the target with at most `speed` units per second; returns the step of the command
    /// position, and whether the target is reached. Speed 0 brings the axis to rest and keeps it there.
    pub(super) fn step(&mut self, speed: i64, ramp: Ramp, update_ns: u32) -> (i32, bool) {
        if self.to_go == 0 {
            return (0, true);
        }
        let ns = i64::from(update_ns);
        let change = |acceleration: i64| acceleration.saturating_mul(ns) / (NANO / MILLI);
        let distance = self.to_go.saturating_abs();
        // From any faster than this the axis could not stop on its target: speeds v, v - step, v - 2 step... over the distance.
        let half = change(ramp.down) / (2 * MILLI);
        let squared = ramp.down.saturating_mul(2).saturating_mul(distance).saturating_add(half.saturating_mul(half));
        let stops = i64::try_from(squared.unsigned_abs().isqrt()).unwrap_or(i64::MAX).saturating_sub(half).max(1);
        let limit = stops.min(speed).saturating_mul(MILLI);
        let slowest = self.speed_milli.saturating_sub(change(ramp.down));
        let fastest = self.speed_milli.saturating_add(change(ramp.up));
        self.speed_milli = limit.max(slowest).min(fastest);
        self.fraction_nano = self.fraction_nano.saturating_add(self.speed_milli.saturating_mul(ns) / MILLI);
        let whole = (self.fraction_nano / NANO).min(distance);
        self.fraction_nano %= NANO;
        let step = whole.saturating_mul(self.to_go.signum());
        self.to_go = self.to_go.saturating_sub(step);
        (i32::try_from(step).unwrap_or(i32::MAX), self.to_go == 0)
    }

    /// Runs one update period of slowing down; returns the step, and whether the axis is at rest.
    pub(super) fn brake(&mut self, ramp: Ramp, update_ns: u32) -> (i32, bool) {
        let (step, reached) = self.step(0, ramp, update_ns);
        (step, reached || self.speed_milli == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Every move ends on its target, never passes it, and keeps the speed.
        #[test]
        fn moves_arrive(distance in -3_000_000i32..3_000_000, speed in 1_000i64..5_000_000, acc in 100i64..20_000) {
            let ramp = Ramp { up: acc * 10_000, down: acc * 10_000 };
            let mut generator = Generator::new(distance);
            let (mut at, mut periods) = (0i32, 0);
            let fastest = speed / 2_000 + 1;
            loop {
                let (step, done) = generator.step(speed, ramp, 500_000);
                at += step;
                periods += 1;
                prop_assert!(i64::from(step).abs() <= fastest);
                prop_assert!(at.abs() <= distance.abs());
                if done { break }
                prop_assert!(periods < 10_000_000 / 500 * 1_000, "stuck at {} of {}", at, distance);
            }
            prop_assert_eq!(at, distance);
        }
    }

    /// 35, 30, 25 ... 5 thousand units a second, 0.5 ms each, are 70 units.
    #[test]
    fn the_speed_from_which_the_target_can_be_reached() {
        let ramp = Ramp { up: 1_000_000_000, down: 10_000_000 };
        let mut generator = Generator::new(70);
        let steps: [(i32, bool); 8] = core::array::from_fn(|_| generator.step(1_000_000, ramp, 500_000));
        assert_eq!(steps[0], (17, false));
        assert!(steps[7].1);
        assert!(steps.windows(2).all(|pair| pair[1].0 <= pair[0].0), "{steps:?}");
        assert_eq!(steps.iter().map(|step| step.0).sum::<i32>(), 70);
    }

    #[test]
    fn braking_ends() {
        let ramp = Ramp { up: 10_000_000, down: 10_000_000 };
        let mut generator = Generator::new(1_000_000);
        for _ in 0..100 {
            generator.step(1_000_000, ramp, 500_000);
        }
        let stands = (0..10_000).position(|_| generator.brake(ramp, 500_000).1).unwrap();
        assert!(generator.distance_to_go() > 0 && stands > 10);
        assert_eq!(generator.step(0, ramp, 500_000), (0, false));
    }
}
