use core::fmt;
use core::iter::FusedIterator;

use crate::interval::{Interval, StepTime};
use crate::profile::Profile;
use crate::runs::{Run, Runs};

/// What a move is doing.
///
/// The states of TIDEP0061, section 2.3.3. In TI's `sorte_master_cfg.inc` the ramp up has three states (initialise, wait
/// initialise, wait); here they are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MoveState {
    /// No move.
    Idle,
    /// Accelerating.
    RampUp,
    /// At full speed.
    Constant,
    /// Decelerating.
    RampDown,
}

impl fmt::Display for MoveState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Idle => "idle",
            Self::RampUp => "ramp-up",
            Self::Constant => "constant",
            Self::RampDown => "ramp-down",
        })
    }
}

/// One step of a move. The interval `t_step` precedes its pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RampStep {
    /// Number of the step in its move, from 0.
    pub index: u32,
    /// Ramp entry, 0..=31.
    pub entry: u8,
    /// Ramp up, constant speed or ramp down.
    pub state: MoveState,
    /// Time since the previous pulse in ns; for the first step, time since the start of the move.
    pub t_step: u32,
    /// 4us_cnt: cycles since the cycle of the previous pulse; at least 1.
    pub cnt: u32,
    /// Cycle of the pulse. Cycle 0 is the one in which the move is started.
    pub cycle: u64,
    /// Start of the pulse in its cycle, in ns.
    ///
    /// 0..=3999, but for [`PruExact`](crate::Arithmetic::PruExact) outside its exact domain. The wire cannot carry 0 and
    /// 3991..=3999; these values are kept here and shifted by a few nanoseconds only in the PTO word, so that the errors do
    /// not add up.
    pub sync_time: u32,
}

/// `step 0 ramp-up: cycle 415 at 2380 ns`.
impl fmt::Display for RampStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { index, state, cycle, sync_time, .. } = self;
        write!(f, "step {index} {state}: cycle {cycle} at {sync_time} ns")
    }
}

/// The steps of a move, one after another.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RampSteps<'t> {
    profile: Profile<'t>,
    runs: Runs,
    entry: u8,
    t_step: u32,
    interval: Interval,
    /// Remaining steps at this ramp entry.
    left: u32,
    /// Number of the next step.
    index: u32,
    /// First step at constant speed and first step of the ramp down.
    constant_from: u32,
    down_from: u32,
    cycle: u64,
    sync: u32,
    /// Carried part of a nanosecond, in 2^-16.
    fraction: u32,
}

impl<'t> Profile<'t> {
    /// Returns the steps of a move of `steps` steps, from standstill to standstill.
    pub const fn steps(self, steps: u32) -> RampSteps<'t> {
        RampSteps::new(self, steps)
    }
}

impl<'t> RampSteps<'t> {
    pub(crate) const fn new(profile: Profile<'t>, steps: u32) -> Self {
        let shape = profile.shape(steps);
        Self {
            profile,
            runs: Runs::new(steps, profile.parameters().steps_per_entry),
            entry: 0,
            t_step: 0,
            interval: Interval { cnt: 0, rest: 0, fraction: 0 },
            left: 0,
            index: 0,
            constant_from: shape.accelerating,
            down_from: steps.saturating_sub(shape.decelerating),
            cycle: 0,
            sync: profile.parameters().init_sync,
            fraction: 0,
        }
    }

    /// Steps still to come.
    const fn remaining(&self) -> u32 {
        self.runs.steps().saturating_sub(self.index)
    }

    /// Aborts the rest of the move: the last step taken stays, followed by the shortest ramp down.
    ///
    /// The remaining steps are those between the last one and the standstill: none after the first step of a move, 32 K - 1
    /// from full speed, and on the way down the steps that remained anyway.
    pub fn abort(&mut self) {
        let per_entry = self.profile.parameters().steps_per_entry;
        let ahead = self.remaining();
        let top = per_entry.saturating_mul(32).saturating_sub(1);
        let depth = self.index.saturating_sub(1).min(ahead).min(top);
        self.runs = Runs::stop(self.index, depth, per_entry);
        self.left = 0;
        self.constant_from = self.constant_from.min(self.index);
        self.down_from = self.down_from.min(self.index);
    }

    /// Steps taken.
    pub(crate) const fn taken(&self) -> u32 {
        self.index
    }

    /// sync_time of the last step taken.
    pub(crate) const fn sync_time(&self) -> u32 {
        self.sync
    }

    /// State of the last step taken.
    pub(crate) const fn state(&self) -> MoveState {
        self.state_of(self.index.saturating_sub(1))
    }

    /// Takes a step. Only [`Iterator::next`] counts the cycle; an axis knows it anyway.
    #[inline]
    pub(crate) fn advance(&mut self) -> Option<StepTime> {
        if self.left == 0 {
            let run = self.runs.next()?;
            self.begin(run);
        }
        let fraction = self.fraction.wrapping_add(self.interval.fraction);
        self.fraction = fraction & 0xffff;
        let time = self.interval.after(self.sync.wrapping_add(fraction >> 16));
        self.sync = time.sync;
        self.left = self.left.saturating_sub(1);
        self.index = self.index.saturating_add(1);
        Some(time)
    }

    fn begin(&mut self, run: Run) {
        let parameters = self.profile.parameters();
        self.entry = run.entry;
        self.left = run.len;
        self.t_step = self.profile.step_time_ns(run.entry);
        self.interval = parameters.arithmetic.interval(parameters.table.entry(run.entry), parameters.speed.raw());
    }

    const fn state_of(&self, index: u32) -> MoveState {
        if index < self.constant_from {
            MoveState::RampUp
        } else if index < self.down_from {
            MoveState::Constant
        } else {
            MoveState::RampDown
        }
    }
}

impl Iterator for RampSteps<'_> {
    type Item = RampStep;

    #[inline]
    fn next(&mut self) -> Option<RampStep> {
        let index = self.index;
        let StepTime { cnt, sync } = self.advance()?;
        self.cycle = self.cycle.wrapping_add(u64::from(cnt));
        Some(RampStep {
            index,
            entry: self.entry,
            state: self.state_of(index),
            t_step: self.t_step,
            cnt,
            cycle: self.cycle,
            sync_time: sync,
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let exact = usize::try_from(self.remaining()).ok();
        (exact.unwrap_or(usize::MAX), exact)
    }
}

impl FusedIterator for RampSteps<'_> {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::{Arithmetic, corrected};
    use crate::frequency::Speed;
    use crate::profile::Parameters;
    use crate::pru_exact;
    use crate::ramp::RampTable;
    use proptest::prelude::*;
    use std::string::ToString;
    use std::vec::Vec;

    fn parameters() -> impl Strategy<Value = (u32, u32, u32)> {
        (262_144..=677_689_575_u32, 1..=9_u32, 0..4000_u32)
    }

    fn profile(arithmetic: Arithmetic, (speed, steps_per_entry, init_sync): (u32, u32, u32)) -> Profile<'static> {
        let at = Parameters::at(Speed::from_raw(speed));
        Profile::new(Parameters { steps_per_entry, init_sync, arithmetic, ..at }).unwrap()
    }

    /// The rule for a step by itself: entry, then the core.
    fn by_the_rule(profile: Profile<'_>, n: u32) -> Vec<(u8, u32, u64, u32)> {
        let p = profile.parameters();
        let (mut cycle, mut sync) = (0_u64, p.init_sync);
        let step = |j: u32| {
            let entry = j.min(n - 1 - j).min(32 * p.steps_per_entry - 1) / p.steps_per_entry;
            let value = p.table.entries()[entry as usize];
            let t_step = crate::step_time_ns(value, p.speed.raw());
            let next = match p.arithmetic {
                Arithmetic::PruExact => pru_exact::step(value, p.speed.raw(), sync),
                _ => corrected(t_step, sync),
            };
            cycle += u64::from(next.cnt);
            sync = next.sync;
            (entry as u8, t_step, cycle, sync)
        };
        (0..n).map(step).collect()
    }

    proptest! {
        #[test]
        fn steps_follow_the_rule(given in parameters(), n in 0..700_u32, exact: bool) {
            let arithmetic = if exact { Arithmetic::PruExact } else { Arithmetic::Corrected };
            let profile = profile(arithmetic, given);
            let got: Vec<_> = profile.steps(n).map(|s| (s.entry, s.t_step, s.cycle, s.sync_time)).collect();
            prop_assert_eq!(got, by_the_rule(profile, n));
        }

        /// The truncation of each step is the only error of the corrected steps, and the carried ones have none.
        #[test]
        fn error_bounds(given in parameters(), n in 1..700_u32) {
            let (speed, k, init_sync) = given;
            let mut exact = u64::from(init_sync) << 16;
            let steps = profile(Arithmetic::Corrected, given).steps(n).zip(profile(Arithmetic::Carried, given).steps(n));
            for (corrected, carried) in steps {
                exact += u64::from(RampTable::SIN2.entry(corrected.entry)) * u64::from(speed);
                let time = |s: RampStep| s.cycle * 4000 + u64::from(s.sync_time);
                prop_assert_eq!(time(carried), exact >> 16);
                prop_assert!(time(corrected) <= exact >> 16);
                prop_assert!(exact >> 16 < time(corrected) + u64::from(corrected.index) + 2);
                prop_assert!(corrected.cnt >= 1 && corrected.sync_time < 4000 && carried.sync_time < 4000);
            }
            for arithmetic in [Arithmetic::Corrected, Arithmetic::Carried] {
                let profile = profile(arithmetic, (speed, k, init_sync));
                let last = profile.steps(n).last().unwrap();
                prop_assert_eq!(profile.duration_ns(n) + u64::from(init_sync), last.cycle * 4000 + u64::from(last.sync_time));
            }
        }

        #[test]
        fn states_are_those_of_the_shape(given in parameters(), n in 0..700_u32) {
            let profile = profile(Arithmetic::Corrected, given);
            let shape = profile.shape(n);
            let count = |state| profile.steps(n).filter(|s| s.state == state).count() as u32;
            prop_assert_eq!(count(MoveState::RampUp), shape.accelerating);
            prop_assert_eq!(count(MoveState::Constant), shape.constant);
            prop_assert_eq!(count(MoveState::RampDown), shape.decelerating);
        }

        /// An abort slows down by the entries it came up, and is never slower than the move itself.
        #[test]
        fn abort_anywhere(given in parameters(), n in 1..700_u32, after in 0..700_u32) {
            let after = after.min(n);
            let profile = profile(Arithmetic::Corrected, given);
            let mut steps = profile.steps(n);
            let done: Vec<RampStep> = steps.by_ref().take(after as usize).collect();
            steps.abort();
            let depth = after.saturating_sub(1).min(n - after).min(32 * given.1 - 1);
            prop_assert_eq!(steps.remaining(), depth);
            prop_assert_eq!(steps.size_hint(), (depth as usize, Some(depth as usize)));
            let rest: Vec<RampStep> = steps.collect();
            prop_assert_eq!(rest.len() as u32, depth);
            let mut before = done.last().copied();
            for step in rest {
                prop_assert_eq!(step.state, MoveState::RampDown);
                let last = before.unwrap();
                prop_assert!(step.entry <= last.entry && last.entry - step.entry <= 1);
                prop_assert_eq!((step.index, step.cycle), (last.index + 1, last.cycle + u64::from(step.cnt)));
                before = Some(step);
            }
            if depth > 0 {
                prop_assert_eq!(before.unwrap().entry, 0);
            }
        }
    }

    #[test]
    fn a_second_abort_changes_nothing() {
        let mut steps = profile(Arithmetic::Corrected, (262_144, 2, 0)).steps(500);
        assert_eq!(steps.by_ref().take(100).count(), 100);
        steps.abort();
        assert_eq!(steps.remaining(), 63);
        let once: Vec<RampStep> = steps.clone().collect();
        assert_eq!(steps.next(), Some(once[0]));
        steps.abort();
        assert_eq!(steps.collect::<Vec<_>>(), once[1..]);
    }

    /// From phase 0 and with K = 1 the PRU leaves the right path at 90 of all whole frequencies below its proved domain,
    /// and at none of TI's named speeds.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn where_the_pru_goes_wrong_on_the_ramp() {
        let wrong = |speed: Speed| {
            let given = (speed.raw(), 1, 0);
            let ramp = |arithmetic| profile(arithmetic, given).steps(64).take(32);
            !ramp(Arithmetic::PruExact).eq(ramp(Arithmetic::Corrected))
        };
        let frequencies: Vec<u32> = (100..68_100).filter(|&hz| wrong(Speed::from_hz(hz).unwrap())).collect();
        assert_eq!(frequencies.len(), 90);
        for hz in [59_848, 56_959, 47_006, 31_456, 29_924, 23_503, 23_044, 21_135, 20_880] {
            assert!(frequencies.contains(&hz), "{hz}");
        }
        assert!(Speed::NAMED.iter().all(|named| !wrong(named.speed)));
    }

    #[test]
    fn a_step_is_printed_in_a_line() {
        let step = profile(Arithmetic::Corrected, (262_144, 1, 1000)).steps(5).next().unwrap();
        assert_eq!(step.to_string(), "step 0 ramp-up: cycle 415 at 2380 ns");
    }

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn the_trap_of_phase_0() {
        let silent = |init| {
            profile(Arithmetic::Corrected, (262_144, 1, init)).steps(51_200).filter(|s| s.sync_time == 0).count()
        };
        assert_eq!((silent(0), silent(1000)), (51_140, 0));
    }
}
