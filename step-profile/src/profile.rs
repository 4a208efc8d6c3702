use crate::arithmetic::Arithmetic;
use crate::error::Error;
use crate::frequency::Speed;
use crate::interval::{CYCLE_NS, step_time_ns};
use crate::pru_exact;
use crate::ramp::RampTable;
use crate::runs::Runs;

/// The parameters of a speed profile.
///
/// ```
/// use step_profile::{Parameters, Profile, Speed};
/// let profile = Profile::new(Parameters::at(Speed::KHZ_100).with_steps_per_entry(16))?;
/// assert_eq!(profile.steps(51_200).count(), 51_200);
/// # Ok::<_, step_profile::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Parameters<'t> {
    /// Full speed.
    pub speed: Speed,
    /// Steps that one ramp entry lasts (K), 1..=134217727.
    pub steps_per_entry: u32,
    /// sync_time before the first step, 0..=3999 ns.
    pub init_sync: u32,
    /// The ramp, for acceleration and deceleration alike.
    pub table: &'t RampTable,
    /// The arithmetic of the steps.
    pub arithmetic: Arithmetic,
}

impl Parameters<'static> {
    /// Default initial sync_time in ns: a pulse of 2 µs stays inside the cycle, and the time is a whole number of
    /// 5 ns ticks. 0 would be the worst choice; see the crate's front page.
    pub const INIT_SYNC: u32 = 1000;

    /// Creates the defaults at this speed: one step per ramp entry, initial sync_time 1000 ns, the sin² ramp, corrected
    /// arithmetic.
    pub const fn at(speed: Speed) -> Self {
        Self {
            speed,
            steps_per_entry: 1,
            init_sync: Self::INIT_SYNC,
            table: RampTable::SIN2,
            arithmetic: Arithmetic::Corrected,
        }
    }
}

impl<'t> Parameters<'t> {
    servowire_core::builder! {
        with_steps_per_entry: steps_per_entry, u32;
        with_init_sync: init_sync, u32;
        with_arithmetic: arithmetic, Arithmetic;
    }

    /// Chooses the shortest ramp whose acceleration stays within `acceleration` in steps/s² by setting the steps per ramp
    /// entry.
    ///
    /// The acceleration is that from the middle of a ramp entry to the middle of the next. Within this limit the speed
    /// jumps from entry to entry, and the mean acceleration over the ramp is far below it; the crate `step-motion` makes
    /// full use of an acceleration. Call it after [`with_table`](Self::with_table). An acceleration of 0, or one that needs
    /// longer entries than there are, is refused by [`Profile::new`].
    #[must_use]
    pub fn with_acceleration(self, acceleration: u32) -> Self {
        // Hz · R = 65536·10^6. Speed at an entry s: 1000 f / s, time of it: K s / 1000 f.
        let hz_squared = 65_536_000_000_u128.pow(2);
        let constant = u128::from(self.speed.raw()).saturating_mul(self.speed.raw().into());
        let needed = self.table.entries().windows(2).map(|pair| match *pair {
            [slow, fast] => {
                let (slow, fast) = (u128::from(slow), u128::from(fast));
                let gain = slow.saturating_sub(fast).saturating_mul(2_000_000).saturating_mul(hz_squared);
                let over = slow.saturating_mul(fast).saturating_mul(slow.saturating_add(fast)).saturating_mul(constant);
                let steps = gain.checked_div(over.max(1)).unwrap_or(0).saturating_add(1);
                steps.div_ceil(u128::from(acceleration).max(1))
            }
            _ => 0,
        });
        let steps = needed.max().and_then(|steps| u32::try_from(steps).ok()).unwrap_or(u32::MAX);
        self.with_steps_per_entry(if acceleration == 0 { u32::MAX } else { steps.max(1) })
    }

    /// Sets your own ramp.
    #[must_use]
    pub const fn with_table<'a>(self, table: &'a RampTable) -> Parameters<'a>
    where
        't: 'a,
    {
        Parameters { table, ..self }
    }
}

/// How many steps of a move accelerate, keep the speed, and decelerate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shape {
    /// Steps of the ramp up.
    pub accelerating: u32,
    /// Steps at full speed between the ramps.
    pub constant: u32,
    /// Steps of the ramp down.
    pub decelerating: u32,
}

/// Parameters that passed all checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Profile<'t>(Parameters<'t>);

impl<'t> Profile<'t> {
    /// Longest ramp entry in steps: 2^27 - 1, so that 32 entries fit 32 bits.
    pub const MAX_STEPS_PER_ENTRY: u32 = (1 << 27) - 1;

    /// The largest speed constant whose default ramp lies wholly in the domain in which the PRU arithmetic is proved
    /// exact: 963131, or 68.045 kHz.
    pub const MAX_PROVED_SPEED: Speed = Speed::from_raw(963_131);

    /// Checks the parameters.
    ///
    /// # Errors
    /// In this order: [`Error::ZeroSegmentLength`], [`Error::SegmentTooLong`], [`Error::StepRateTooHigh`],
    /// [`Error::StepTimeOverflow`], [`Error::SyncTimeOutOfRange`].
    pub const fn new(parameters: Parameters<'t>) -> Result<Self, Error> {
        let Parameters { speed, steps_per_entry, init_sync, table, .. } = parameters;
        if steps_per_entry == 0 {
            return Err(Error::ZeroSegmentLength);
        }
        if steps_per_entry > Self::MAX_STEPS_PER_ENTRY {
            return Err(Error::SegmentTooLong { steps_per_entry, limit: Self::MAX_STEPS_PER_ENTRY });
        }
        if speed.raw() < Speed::KHZ_250.raw() {
            return Err(Error::StepRateTooHigh { speed: speed.raw(), limit: Speed::KHZ_250.raw() });
        }
        if let Err(limit) = fits(table.first(), speed.raw()) {
            return Err(Error::StepTimeOverflow { speed: speed.raw(), limit });
        }
        if init_sync >= CYCLE_NS {
            return Err(Error::SyncTimeOutOfRange { sync_time: init_sync, limit: 3999 });
        }
        Ok(Self(parameters))
    }

    /// The parameters.
    pub const fn parameters(self) -> Parameters<'t> {
        self.0
    }

    /// Returns whether no step of this profile leaves the domain in which the PRU arithmetic is proved exact, so that
    /// [`Arithmetic::PruExact`] and [`Arithmetic::Corrected`] give the same pulses.
    ///
    /// With the default ramp: up to speed constant 963131, at 68.045 kHz and above.
    pub const fn pru_is_exact(self) -> bool {
        step_time_ns(self.0.table.first(), self.0.speed.raw()) < pru_exact::EXACT_BELOW
    }

    /// Returns the time of a step at ramp entry `entry` (0..=31) in ns.
    pub fn step_time_ns(self, entry: u8) -> u32 {
        step_time_ns(self.0.table.entry(entry), self.0.speed.raw())
    }

    /// Returns how a move of `steps` steps is divided.
    pub const fn shape(self, steps: u32) -> Shape {
        let ramp = self.0.steps_per_entry.saturating_mul(32);
        let lower = steps / 2;
        let upper = steps.saturating_sub(lower);
        let accelerating = if ramp < upper { ramp } else { upper };
        let decelerating = if ramp < lower { ramp } else { lower };
        let constant = steps.saturating_sub(accelerating).saturating_sub(decelerating);
        Shape { accelerating, constant, decelerating }
    }

    /// Returns the time from the start of a move of `steps` steps to its last pulse, in ns.
    ///
    /// For [`Arithmetic::PruExact`] this is correct only while that arithmetic is exact.
    pub fn duration_ns(self, steps: u32) -> u64 {
        let (mut ns, mut fractions) = (0_u64, 0_u64);
        for run in Runs::new(steps, self.0.steps_per_entry) {
            let time = self.0.arithmetic.interval(self.0.table.entry(run.entry), self.0.speed.raw());
            ns = ns.saturating_add(u64::from(run.len).saturating_mul(u64::from(self.step_time_ns(run.entry))));
            fractions = fractions.saturating_add(u64::from(run.len).saturating_mul(u64::from(time.fraction)));
        }
        ns.saturating_add(fractions >> 16)
    }
}

/// Whether the first step time, bits 47..16 of `entry * speed`, keeps all its bits; the largest speed that does.
#[expect(clippy::cast_possible_truncation, reason = "2^48 / 1000 and less is compared, then cut to 32 bits")]
const fn fits(entry: u32, speed: u32) -> Result<(), u32> {
    if (entry as u64).saturating_mul(speed as u64) < 1 << 48 {
        return Ok(());
    }
    match ((1_u64 << 48).saturating_sub(1)).checked_div(entry as u64) {
        Some(limit) if limit < u32::MAX as u64 => Err(limit as u32),
        _ => Err(u32::MAX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn with(speed: u32, k: u32, init_sync: u32) -> Result<Profile<'static>, Error> {
        let speed = Speed::from_raw(speed);
        Profile::new(Parameters { steps_per_entry: k, init_sync, ..Parameters::at(speed) })
    }

    #[test]
    fn limits_and_their_order() {
        assert_eq!(with(0, 0, 4000), Err(Error::ZeroSegmentLength));
        assert_eq!(with(0, 1 << 27, 4000), Err(Error::SegmentTooLong { steps_per_entry: 1 << 27, limit: 134_217_727 }));
        assert_eq!(with(262_143, 1, 4000), Err(Error::StepRateTooHigh { speed: 262_143, limit: 262_144 }));
        let slow = Error::StepTimeOverflow { speed: 677_689_576, limit: 677_689_575 };
        assert_eq!(with(677_689_576, 1, 4000), Err(slow));
        assert_eq!(with(677_689_575, 1, 4000), Err(Error::SyncTimeOutOfRange { sync_time: 4000, limit: 3999 }));
        assert!(with(677_689_575, (1 << 27) - 1, 3999).is_ok());
    }

    #[test]
    fn a_flat_table_takes_every_slow_speed_and_a_steep_one_none() {
        let flat = RampTable::new([1000; 32]).unwrap();
        let slowest = Parameters { table: &flat, ..Parameters::at(Speed::from_raw(u32::MAX)) };
        assert!(Profile::new(slowest).is_ok());
        let mut entries = [1000; 32];
        entries[0] = u32::MAX;
        let steep = RampTable::new(entries).unwrap();
        let fastest = Parameters { table: &steep, ..Parameters::at(Speed::KHZ_250) };
        assert_eq!(Profile::new(fastest), Err(Error::StepTimeOverflow { speed: 262_144, limit: 65_536 }));
    }

    /// Between the middles of neighbouring entries, the acceleration is just within the limit.
    #[test]
    fn the_shortest_ramp_within_an_acceleration() {
        let peak = |parameters: Parameters<'_>| {
            let profile = Profile::new(parameters).unwrap();
            let seconds = |entry| f64::from(profile.step_time_ns(entry)) / 1e9;
            let k = f64::from(parameters.steps_per_entry);
            let between = |entry| {
                let (slow, fast) = (seconds(entry), seconds(entry + 1));
                (1.0 / fast - 1.0 / slow) / (k * (slow + fast) / 2.0)
            };
            (0..31).map(between).fold(0.0, f64::max)
        };
        for (speed, limit) in [(Speed::KHZ_100, 1_000_000), (Speed::KHZ_250, 77_777), (Speed::KHZ_5, 50_000)] {
            let parameters = Parameters::at(speed).with_acceleration(limit);
            assert!(peak(parameters) <= f64::from(limit) * 1.000_01, "{} at {limit}", peak(parameters));
            let k = parameters.steps_per_entry;
            let one_less = parameters.with_steps_per_entry(k - 1);
            assert!(k == 1 || peak(one_less) > f64::from(limit) * 0.999, "{k}");
        }
        let never = Profile::new(Parameters::at(Speed::KHZ_250).with_acceleration(0));
        assert!(matches!(never, Err(Error::SegmentTooLong { .. })));
    }

    /// The product is cut above bit 47: 2^48 is the first that loses a bit.
    #[test]
    fn a_step_time_of_2_to_the_48_is_refused() {
        let mut entries = [1000; 32];
        entries[0] = 1 << 20;
        let table = RampTable::new(entries).unwrap();
        let at = |speed| Profile::new(Parameters::at(Speed::from_raw(speed)).with_table(&table));
        assert_eq!(at(1 << 28), Err(Error::StepTimeOverflow { speed: 1 << 28, limit: (1 << 28) - 1 }));
        assert!(at((1 << 28) - 1).is_ok());
    }

    #[test]
    fn the_proved_domain_of_the_default_ramp() {
        let last = Profile::new(Parameters::at(Profile::MAX_PROVED_SPEED)).unwrap();
        let next = Speed::from_raw(Profile::MAX_PROVED_SPEED.raw() + 1);
        assert!(last.pru_is_exact());
        assert!(!Profile::new(Parameters::at(next)).unwrap().pru_is_exact());
        assert!(Speed::from_hz(68_045).unwrap() <= Profile::MAX_PROVED_SPEED);
        assert!(Speed::from_hz(68_044).unwrap() > Profile::MAX_PROVED_SPEED);
    }

    #[test]
    fn durations_of_a_full_turn() {
        let profile = with(262_144, 1, 0).unwrap();
        assert_eq!(profile.duration_ns(51_200), 210_008_000);
        assert_eq!(profile.shape(51_200), Shape { accelerating: 32, constant: 51_136, decelerating: 32 });
        assert_eq!(profile.duration_ns(0), 0);
        assert_eq!(with(262_144, 67_108_863, 0).unwrap().shape(u32::MAX).constant, 63);
    }

    /// The ramp costs as much as 683 K steps at full speed, in place of 32 K.
    #[test]
    fn the_time_of_a_full_profile_at_whole_cycles() {
        for (k, n) in [(1, 64), (1, 51_200), (16, 512_000), (100, 51_200)] {
            let periods = u64::from(2 * 683 * k + n - 64 * k);
            assert_eq!(with(262_144, k, 0).unwrap().duration_ns(n), periods * 4000, "{n} steps, {k} an entry");
        }
    }

    proptest! {
        #[test]
        fn the_shape_is_the_whole_move(steps: u32, k in 1..=Profile::MAX_STEPS_PER_ENTRY) {
            let shape = with(262_144, k, 0).unwrap().shape(steps);
            let sum = u64::from(shape.accelerating) + u64::from(shape.constant) + u64::from(shape.decelerating);
            prop_assert_eq!(sum, u64::from(steps));
            prop_assert!(shape.accelerating - shape.decelerating <= 1);
            prop_assert!(shape.accelerating <= 32 * k);
        }
    }
}
