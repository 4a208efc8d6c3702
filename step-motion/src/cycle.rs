//! Motion in the 4 µs cycle of TIDEP0061, and in the reloads of a timer.

use crate::error::Error;
use crate::limits::{Clock, Limits};
use crate::mover::Mover;
use servowire_core::Command;

/// Length of the cycle in ns.
const CYCLE_NS: u64 = 4000;

/// A [`Mover`] that is called once in each cycle of 4 µs and returns the content of a PTO word.
///
/// ```
/// use step_motion::{Command, Limits, PtoMover};
/// let mut x = PtoMover::new(Limits::new(100_000, 2_000_000)?.with_jerk(400_000_000)?)?;
/// x.mover().move_to(64, 0)?;
/// let pulses = (0..5000).filter(|_| matches!(x.tick(), Command::Pulse { .. })).count();
/// assert_eq!(pulses, 64); // within 20 ms
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PtoMover {
    mover: Mover,
    /// Begin of the next cycle in ns.
    now: u64,
}

impl PtoMover {
    /// The greatest speed: one step per cycle.
    pub const MAX_SPEED: u32 = 250_000;

    /// Creates an axis at rest at position 0.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above 250 kHz.
    pub fn new(limits: Limits) -> Result<Self, Error> {
        if limits.speed() > Self::MAX_SPEED {
            return Err(Error::SpeedAboveClock { speed: limits.speed(), limit: Self::MAX_SPEED });
        }
        Ok(Self { mover: Mover::new(Clock::NANOSECONDS, limits)?, now: 0 })
    }

    /// Returns the axis, for commands; its ticks are nanoseconds.
    pub const fn mover(&mut self) -> &mut Mover {
        &mut self.mover
    }

    /// Start of the next cycle, in ns: the time for a request.
    pub const fn now(&self) -> u64 {
        self.now
    }

    /// Advances to the next cycle; returns at most one pulse.
    #[inline]
    pub fn tick(&mut self) -> Command {
        let begin = self.now;
        self.now = begin.wrapping_add(CYCLE_NS);
        match self.mover.due() {
            Some(due) if due < self.now => {
                let direction = self.mover.direction();
                self.mover.pulse();
                let sync_time = u32::try_from(due.saturating_sub(begin)).unwrap_or(0);
                Command::Pulse { direction, sync_time }
            }
            _ => Command::Hold { direction: self.mover.direction() },
        }
    }
}

/// The next value to load into a timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reload {
    /// Ticks until it runs out, from 1 to its maximum. Many timers need one less in their register.
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
    /// The step after `last`, if its interval has begun.
    next: Option<u64>,
}

impl<I: Iterator<Item = u64>> Reloads<I> {
    /// Creates the reloads from the ticks of steps, counted from the start; `longest` is the maximum of the timer, 65535
    /// for 16 bits (0 counts as 1).
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
        let wait = next.saturating_sub(self.last);
        match u32::try_from(wait) {
            Ok(ticks) if ticks <= self.longest => {
                self.last = next;
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
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn a_cycle_has_one_step_at_most_and_the_time_is_kept() {
        let limits = Limits::new(250_000, 20_000_000).unwrap();
        assert!(PtoMover::new(limits.with_speed(250_001).unwrap()).is_err());
        let mut axis = PtoMover::new(limits).unwrap();
        axis.mover().move_to(-5000, 0).unwrap();
        let mut times = Vec::new();
        for cycle in 0..20_000_u64 {
            if let Command::Pulse { direction, sync_time } = axis.tick() {
                assert!(direction.dir() && sync_time < 4000);
                times.push(cycle * 4000 + u64::from(sync_time));
            }
        }
        let plan = Plan::new(Clock::NANOSECONDS, limits, 5000).unwrap();
        assert_eq!(times, plan.pulses().collect::<Vec<_>>());
        assert_eq!((axis.now(), axis.mover().commanded()), (80_000_000, -5000));
    }
}
