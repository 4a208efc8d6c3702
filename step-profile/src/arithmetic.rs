use crate::interval::{CYCLE_NS, Interval, StepTime, step_time_ns};
use crate::pru_exact;

/// The arithmetic that converts step times to cycles and sync_times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Arithmetic {
    /// Exact for every step time below 2^32 ns; equal to [`PruExact`](Self::PruExact) wherever `PruExact` is exact.
    #[default]
    Corrected,
    /// Bit for bit what the PRU computes, wrap-arounds included.
    PruExact,
    /// Like [`Corrected`](Self::Corrected), but the 16 bits below the nanosecond are carried from step to step, so that
    /// truncation errors do not add up. Not what the PRU computes.
    Carried,
}

impl Arithmetic {
    /// Returns the time of a step at ramp entry `entry` and speed constant `speed`, split into cycles and the rest.
    #[inline]
    pub const fn interval(self, entry: u32, speed: u32) -> Interval {
        let t_step = step_time_ns(entry, speed);
        match self {
            Self::Corrected => split(t_step, 0),
            Self::PruExact => pru_exact::interval(t_step),
            Self::Carried => split(t_step, entry.wrapping_mul(speed) & 0xffff),
        }
    }
}

/// Returns the pulse that comes `t_step` ns after one with sync_time `prev`, by true division.
///
/// Exact for every pair: `cnt * 4000 + sync == prev + t_step` and `sync < 4000`.
///
/// ```
/// use step_profile::{corrected, pru_exact};
/// let late = corrected(6_103_999, 0);
/// assert_eq!((late.cnt, late.sync), (1_525, 3_999));
/// // The PRU takes 1526 for the quotient, wraps below zero and never comes back.
/// assert_eq!(pru_exact::interval(6_103_999).after(0).sync, 4_294_963_295);
/// ```
#[inline]
pub const fn corrected(t_step: u32, prev: u32) -> StepTime {
    match t_step.checked_add(prev) {
        Some(sum) => StepTime { cnt: sum / CYCLE_NS, sync: sum % CYCLE_NS },
        None => corrected_wide(t_step, prev),
    }
}

/// The sum has 33 bits: 2^32 ns are 1073741 cycles and 3296 ns, wrapping leaves the rest.
#[cold]
const fn corrected_wide(t_step: u32, prev: u32) -> StepTime {
    let StepTime { cnt, sync } = split(t_step.wrapping_add(prev), 0).after(3296);
    StepTime { cnt: cnt.wrapping_add(1_073_741), sync }
}

#[inline]
const fn split(t_step: u32, fraction: u32) -> Interval {
    Interval { cnt: t_step / CYCLE_NS, rest: t_step % CYCLE_NS, fraction }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// One step time and all that is claimed about its quotient.
    fn check(t: u32) {
        let Interval { cnt, rest, .. } = pru_exact::interval(t);
        let (m, r) = (t / 4000, t % 4000);
        if t < pru_exact::EXACT_BELOW {
            assert_eq!((cnt, rest), (m, r), "{t}");
        }
        let deficit = u64::from(4000 - r);
        let too_large = u64::from(pru_exact::RECIPROCAL) * deficit <= 704 * (u64::from(m) + 1);
        assert_eq!(cnt, m + u32::from(too_large), "{t}");
        assert!(!too_large || deficit <= 703, "{t}");
    }

    #[test]
    fn the_whole_exact_domain_and_the_edges_of_every_cycle() {
        assert_eq!(u64::from(pru_exact::RECIPROCAL) * 4000, (1 << 32) + 704);
        // An interpreter takes samples.
        let stride = if cfg!(miri) { 99_991 } else { 1 };
        (0..pru_exact::EXACT_BELOW + 4000).step_by(stride).for_each(check);
        for m in (0..=u32::MAX / 4000).step_by(stride) {
            for t in (m * 4000).saturating_sub(2)..=(m * 4000).saturating_add(2) {
                check(t);
            }
        }
    }

    #[test]
    fn the_first_wrong_quotient_is_at_the_end_of_the_exact_domain() {
        assert_eq!(pru_exact::interval(pru_exact::EXACT_BELOW).cnt, 1526);
        assert_eq!(pru_exact::EXACT_BELOW, 1525 * 4000 + 3999);
    }

    /// All 2^32: five seconds.
    #[test]
    fn every_step_time() {
        let mut too_large = 0_u32;
        let mut largest_deficit = 0;
        // An interpreter takes samples, and has no sums to compare.
        for t in (0..=u32::MAX).step_by(if cfg!(miri) { 99_999_989 } else { 1 }) {
            let Interval { cnt, rest, .. } = pru_exact::interval(t);
            let truth = split(t, 0);
            if cnt == truth.cnt {
                assert_eq!(rest, truth.rest, "{t}");
            } else {
                assert_eq!(cnt, truth.cnt + 1, "{t}");
                assert!(t >= pru_exact::EXACT_BELOW, "{t}");
                let deficit = 4000 - truth.rest;
                assert_eq!(rest, 0_u32.wrapping_sub(deficit), "{t}");
                too_large += 1;
                largest_deficit = largest_deficit.max(deficit);
            }
        }
        if !cfg!(miri) {
            assert_eq!((too_large, largest_deficit), (377_419_962, 703));
        }
    }

    /// Any number, and every other time one near the end.
    fn whole_range() -> impl Strategy<Value = u32> {
        prop_oneof![any::<u32>(), u32::MAX - 8000..=u32::MAX]
    }

    proptest! {
        #[test]
        fn corrected_is_true_division(t in whole_range(), prev in whole_range()) {
            let StepTime { cnt, sync } = corrected(t, prev);
            prop_assert!(sync < 4000);
            prop_assert_eq!(u64::from(cnt) * 4000 + u64::from(sync), u64::from(prev) + u64::from(t));
        }

        #[test]
        fn an_interval_is_corrected_too(t in whole_range(), prev in 0..4000_u32) {
            prop_assert_eq!(split(t, 0).after(prev), corrected(t, prev));
        }

        #[test]
        fn both_agree_on_the_exact_domain(t in 0..pru_exact::EXACT_BELOW, prev in 0..4000_u32) {
            prop_assert_eq!(pru_exact::interval(t).after(prev), corrected(t, prev));
        }

        /// Outside the exact domain the carry may only be anticipated; then the result is still right.
        #[test]
        fn the_pru_is_right_as_long_as_it_does_not_wrap(t: u32, prev in 0..4000_u32) {
            let pru = pru_exact::interval(t);
            let wraps = pru.rest > u32::MAX / 2 && prev.checked_add(pru.rest).is_none_or(|sum| sum >= 4000)
                && prev < 0_u32.wrapping_sub(pru.rest);
            prop_assert_eq!(pru.after(prev) == corrected(t, prev), !wraps);
        }

        #[test]
        fn the_carried_fraction_is_what_the_others_drop(entry in 1000..=415_345_u32, speed in 262_144..=677_689_575_u32) {
            let carried = Arithmetic::Carried.interval(entry, speed);
            let ns = u64::from(carried.cnt) * 4000 + u64::from(carried.rest);
            prop_assert_eq!((ns << 16) + u64::from(carried.fraction), u64::from(entry) * u64::from(speed));
        }
    }
}
