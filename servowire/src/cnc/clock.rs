//! A device's counter on its own crystal.

use sorte_proto::Correction;

/// Time from the decision on a new counter value until it takes effect in the published device, in ns.
const WRITE_NS: f64 = 135.0;
/// A tick of the counter in ns.
const TICK: f64 = 5.0;

/// A counter that adds 5 per tick of a slightly inaccurate crystal, and 4 or 6 while it is corrected.
///
/// Times are ns of the simulation, which are those of the master's crystal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// At time `at` the counter held `value`.
    at: f64,
    value: f64,
    /// Counter ns for each ns.
    rate: f64,
    /// A correction that adds `slew` to the rate runs until then.
    slew: f64,
    slew_until: f64,
    /// Gain of `rate` per second as the crystal warms up.
    drift: f64,
}

impl Clock {
    /// `ppm`: error of the crystal; `drift_ppm`: its change per second.
    pub(super) fn new(value: f64, ppm: f64, drift_ppm: f64) -> Self {
        Self { at: 0.0, value, rate: 1.0 + ppm * 1e-6, slew: 0.0, slew_until: 0.0, drift: drift_ppm * 1e-6 }
    }

    /// Returns the counter at a time. A correction that has begun does not show before its time.
    pub(super) fn at(&self, ns: f64) -> f64 {
        self.value + (ns - self.at) * self.rate + (ns.min(self.slew_until) - self.at).max(0.0) * self.slew
    }

    /// Returns the register's reading, in whole ticks.
    pub(super) fn read(&self, ns: f64) -> u32 {
        let value = self.at(ns);
        // Rounded down, also below 0.
        let whole = value as i64 - i64::from(value < (value as i64) as f64);
        (whole.div_euclid(5) * 5) as u32
    }

    /// Returns when the counter holds a value.
    pub(super) fn when(&self, value: f64) -> f64 {
        let slewing = (self.slew_until - self.at).max(0.0);
        let slewed = self.value + slewing * (self.rate + self.slew);
        if value < self.value {
            self.at + (value - self.value) / self.rate
        } else if value < slewed {
            self.at + (value - self.value) / (self.rate + self.slew)
        } else {
            self.at + slewing + (value - slewed) / self.rate
        }
    }

    pub(super) fn correct(&mut self, correction: Correction, ns: f64) {
        match correction {
            Correction::None => {}
            Correction::Set { counter_ns } => self.restart(ns + WRITE_NS, f64::from(counter_ns)),
            Correction::Rate { increment, ticks } => {
                self.restart(ns, self.at(ns));
                self.slew = (f64::from(increment) - TICK) / TICK;
                self.slew_until = ns + f64::from(ticks) * TICK;
            }
        }
    }

    fn restart(&mut self, at: f64, value: f64) {
        self.rate += (at - self.at) * 1e-9 * self.drift;
        (self.at, self.value, self.slew, self.slew_until) = (at, value, 0.0, at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correction_moves_the_counter_by_its_ticks_and_no_more() {
        for (increment, moved) in [(6, 30.0), (4, -30.0)] {
            let mut clock = Clock::new(1000.0, 0.0, 0.0);
            clock.correct(Correction::Rate { increment, ticks: 30 }, 500.0);
            assert!((clock.at(575.0) - (1575.0 + moved / 2.0)).abs() < 1e-6);
            for ns in [650.0, 10_000.0] {
                assert!((clock.at(ns) - (1000.0 + ns + moved)).abs() < 1e-6, "{increment} at {ns}");
            }
        }
    }

    #[test]
    fn when_is_the_inverse_of_at() {
        let mut clock = Clock::new(77.0, 43.0, 2.0);
        clock.correct(Correction::Rate { increment: 4, ticks: 100 }, 1e6);
        for ns in [1e6 - 500.0, 1e6, 1e6 + 1.0, 1e6 + 499.0, 1e6 + 501.0, 1e6 + 4000.0, 2e9] {
            assert!((clock.when(clock.at(ns)) - ns).abs() < 1e-3, "{ns}");
        }
        clock.correct(Correction::Set { counter_ns: 5 }, 3e9);
        assert!((clock.at(3e9 + 135.0) - 5.0).abs() < 1e-6);
    }

    #[test]
    fn the_register_reads_whole_ticks() {
        for (value, read) in
            [(0.0, 0), (4.99, 0), (5.0, 5), (9.999_999, 5), (-0.1, u32::MAX - 4), (4_294_967_296.0, 4_294_967_295)]
        {
            assert_eq!(Clock::new(value, 0.0, 0.0).read(0.0), read, "{value}");
        }
    }

    /// 50 ppm are 200 ns in 4 ms.
    #[test]
    fn a_crystal_runs_away_as_its_error_says() {
        let clock = Clock::new(0.0, 50.0, 0.0);
        assert!((clock.at(4e6) - 4e6 - 200.0).abs() < 1e-6);
    }
}
