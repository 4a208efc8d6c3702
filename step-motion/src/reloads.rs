//! Motion in the reloads of a timer.

/// A value to load into a timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reload {
    /// Ticks until the timer runs out, from 1 to its maximum. Many timers need one less in their register.
    pub ticks: u32,
    /// Whether a step is due then; if not, the timer is too short for the interval and this is only part of it.
    pub step: bool,
}

/// The reloads of a timer from the ticks of steps.
///
/// A reload is the difference of two rounded times, never a rounded interval: the rounding error of one step is made up by
/// the next, so the error never exceeds half a tick.
#[derive(Debug, Clone)]
pub struct Reloads<I> {
    ticks: I,
    longest: u32,
    last: u64,
    /// The step after `last`, once its interval has begun.
    next: Option<u64>,
}

impl<I: Iterator<Item = u64>> Reloads<I> {
    /// Creates the reloads from the ticks of steps, counted from the start; `longest` is the maximum of the timer, 65535
    /// for 16 bits (0 counts as 1). A step that is not due after the one before, or at tick 0, comes a tick later.
    pub fn new(ticks: I, longest: u32) -> Self {
        Self { ticks, longest: longest.max(1), last: 0, next: None }
    }
}

impl<I: Iterator<Item = u64>> Iterator for Reloads<I> {
    type Item = Reload;

    fn next(&mut self) -> Option<Reload> {
        let next = match self.next.take() {
            Some(next) => next,
            None => self.ticks.next()?,
        };
        let wait = next.saturating_sub(self.last).max(1);
        match u32::try_from(wait) {
            Ok(ticks) if ticks <= self.longest => {
                self.last = self.last.saturating_add(wait);
                Some(Reload { ticks, step: true })
            }
            _ => {
                self.last = self.last.saturating_add(self.longest.into());
                self.next = Some(next);
                Some(Reload { ticks: self.longest, step: false })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::{Clock, Limits};
    use crate::plan::Plan;
    use std::vec::Vec;

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn reloads_add_up_to_the_ticks() {
        let plan = Plan::new(Clock::MICROSECONDS, Limits::new(61_000, 100_000).unwrap(), 40_000).unwrap();
        let ticks: Vec<u64> = plan.pulses().collect();
        let (mut now, mut at) = (0_u64, 0);
        for reload in Reloads::new(plan.pulses(), 999) {
            assert!((1..=999).contains(&reload.ticks));
            now += u64::from(reload.ticks);
            if reload.step {
                assert_eq!(now, ticks[at]);
                at += 1;
            }
        }
        assert_eq!(at, ticks.len());
        // At 61 kHz a step lasts 16.39 ticks: 16 and 17 take turns.
        let cruise = &ticks[20_000..21_000];
        assert!((cruise[999] - cruise[0]).abs_diff(999 * 1_000_000 / 61_000) <= 1);
    }

    #[test]
    fn no_reload_is_0() {
        let reloads =
            |ticks: &[u64]| Reloads::new(ticks.iter().copied(), 10).map(|reload| reload.ticks).collect::<Vec<_>>();
        assert_eq!(reloads(&[0, 5]), [1, 4]);
        assert_eq!(reloads(&[5, 5, 3, 20]), [5, 1, 1, 10, 3]);
    }

    #[test]
    fn an_interval_as_long_as_the_timer_is_one_reload() {
        let reloads =
            |longest| Reloads::new([7_u64, 1007].into_iter(), longest).map(|reload| (reload.ticks, reload.step));
        assert_eq!(reloads(1000).collect::<Vec<_>>(), [(7, true), (1000, true)]);
        assert_eq!(reloads(999).collect::<Vec<_>>(), [(7, true), (999, false), (1, true)]);
    }
}
