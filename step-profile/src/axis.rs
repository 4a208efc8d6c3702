use servowire_core::{Command, Direction};

use crate::error::Error;
use crate::profile::Profile;
use crate::ramp_steps::{MoveState, RampSteps};

/// One axis, driven by one call per cycle.
///
/// ```
/// use step_profile::{Axis, Command, Direction, Parameters, Profile, Speed};
/// let profile = Profile::new(Parameters::at(Speed::KHZ_250))?;
/// let mut axis = Axis::new();
/// axis.start(profile, 3, Direction::Reverse)?;
/// let pulses = (0..1000).filter(|_| matches!(axis.tick(), Command::Pulse { .. })).count();
/// assert_eq!((pulses, axis.commanded()), (3, -3));
/// # Ok::<_, step_profile::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis<'t> {
    /// The move; the last step taken from it is the one whose pulse comes next.
    steps: Option<RampSteps<'t>>,
    /// Cycles before the cycle of that pulse.
    wait: u32,
    direction: Direction,
    commanded: i64,
}

impl<'t> Axis<'t> {
    /// Creates an axis at rest, with nothing commanded yet and DIR = 0.
    pub const fn new() -> Self {
        Self { steps: None, wait: 0, direction: Direction::Forward, commanded: 0 }
    }

    /// Starts a move of `steps` steps. The next [`tick`](Self::tick) is cycle 0 of the move.
    ///
    /// A move of 0 steps does nothing, not even to DIR.
    ///
    /// # Errors
    /// [`Error::Moving`] while a move is in progress.
    pub fn start(&mut self, profile: Profile<'t>, steps: u32, direction: Direction) -> Result<(), Error> {
        if self.steps.is_some() {
            return Err(Error::Moving);
        }
        let mut steps = profile.steps(steps);
        if let Some(first) = steps.advance() {
            self.wait = first.cnt;
            self.direction = direction;
            self.steps = Some(steps);
        }
        Ok(())
    }

    /// Advances to the next cycle; returns at most one pulse.
    #[inline]
    pub fn tick(&mut self) -> Command {
        let direction = self.direction;
        let Some(steps) = &mut self.steps else { return Command::Hold { direction } };
        if let Some(wait) = self.wait.checked_sub(1) {
            self.wait = wait;
            return Command::Hold { direction };
        }
        let sync_time = steps.sync_time();
        match steps.advance() {
            // The tick that follows is one cycle on.
            Some(next) => self.wait = next.cnt.saturating_sub(1),
            None => self.steps = None,
        }
        self.commanded = direction.advance(self.commanded);
        Command::Pulse { direction, sync_time }
    }

    /// Aborts the move, with the ramp down.
    ///
    /// The step whose interval has begun keeps its time, since the motor may be anywhere in it; the steps after it
    /// slow down ([`RampSteps::abort`]). Before the first pulse nothing has moved, so the move ends at once.
    pub fn abort(&mut self) {
        match &mut self.steps {
            Some(steps) if steps.taken() > 1 => steps.abort(),
            _ => self.steps = None,
        }
    }

    /// What the axis is doing: the state of the present step.
    pub fn state(&self) -> MoveState {
        self.steps.as_ref().map_or(MoveState::Idle, RampSteps::state)
    }

    /// DIR, as held since the last move began.
    pub const fn direction(&self) -> Direction {
        self.direction
    }

    /// Steps commanded so far, forward less reverse ones. The shaft is not observed, so this does not say whether the motor
    /// followed.
    pub const fn commanded(&self) -> i64 {
        self.commanded
    }

    /// Sets the step count of the present position, for instance 0 at a reference.
    pub fn set_commanded(&mut self, steps: i64) {
        self.commanded = steps;
    }
}

/// Four independent axes, one per motor (TIDEP0061, section 2.3.2: four times the calculation of one).
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axes<'t>(pub [Axis<'t>; 4]);

impl Axes<'_> {
    /// Advances to the next cycle of all four.
    #[inline]
    pub fn tick(&mut self) -> [Command; 4] {
        let [a, b, c, d] = &mut self.0;
        [a.tick(), b.tick(), c.tick(), d.tick()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frequency::Speed;
    use crate::profile::Parameters;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn profile(speed: u32, steps_per_entry: u32, init_sync: u32) -> Profile<'static> {
        let at = Parameters::at(Speed::from_raw(speed));
        Profile::new(Parameters { steps_per_entry, init_sync, ..at }).unwrap()
    }

    /// Cycle and sync_time of all pulses in the next `cycles` cycles.
    fn pulses(axis: &mut Axis<'_>, cycles: u64) -> Vec<(u64, u32)> {
        let pulse = |cycle| match axis.tick() {
            Command::Pulse { sync_time, .. } => Some((cycle, sync_time)),
            _ => None,
        };
        (0..cycles).filter_map(pulse).collect()
    }

    proptest! {
        #[test]
        fn ticks_are_the_steps_in_time(speed in 262_144..1_000_000_u32, k in 1..4_u32, init in 0..4000_u32, n in 0..300_u32) {
            let profile = profile(speed, k, init);
            let steps: Vec<_> = profile.steps(n).map(|s| (s.cycle, s.sync_time)).collect();
            let end = steps.last().map_or(5, |last| last.0 + 5);
            let mut axis = Axis::new();
            axis.start(profile, n, Direction::Forward).unwrap();
            prop_assert_eq!(pulses(&mut axis, end), steps);
            prop_assert_eq!((axis.commanded(), axis.state()), (i64::from(n), MoveState::Idle));
        }

        /// Every move that is given up ends at standstill, within the steps it had.
        #[test]
        fn abort_in_any_cycle(n in 1..200_u32, k in 1..3_u32, at in 0..3000_u64) {
            let profile = profile(262_144, k, 1000);
            let mut axis = Axis::new();
            axis.start(profile, n, Direction::Forward).unwrap();
            let before = pulses(&mut axis, at).len();
            axis.abort();
            let after = pulses(&mut axis, 10_000).len();
            prop_assert_eq!(axis.state(), MoveState::Idle);
            prop_assert!(before + after <= n as usize);
            prop_assert!(before > 0 || after == 0);
            prop_assert_eq!(axis.commanded(), i64::try_from(before + after).unwrap());
        }
    }

    #[test]
    fn dir_is_held_and_a_refused_start_changes_nothing() {
        let profile = profile(262_144, 1, 1000);
        let mut axis = Axis::new();
        axis.set_commanded(10);
        axis.start(profile, 3, Direction::Reverse).unwrap();
        for _ in 0..500 {
            assert_eq!(axis.start(profile, 9, Direction::Forward), Err(Error::Moving));
            assert!(!matches!(axis.tick(), Command::Hold { direction: Direction::Forward }));
        }
        assert_eq!(axis.state(), MoveState::RampUp);
        assert_eq!(pulses(&mut axis, 1000).len(), 2);
        assert_eq!((axis.commanded(), axis.direction()), (7, Direction::Reverse));
        axis.start(profile, 0, Direction::Forward).unwrap();
        assert_eq!(axis.tick(), Command::Hold { direction: Direction::Reverse });
        assert_eq!(axis.direction().code(), 1);
    }

    #[test]
    fn four_axes_at_four_speeds() {
        let mut axes = Axes::default();
        for (axis, speed) in axes.0.iter_mut().zip([262_144, 300_000, 400_000, 655_360]) {
            axis.start(profile(speed, 1, 1000), 100, Direction::Forward).unwrap();
        }
        let mut counts = [0; 4];
        for _ in 0..5000 {
            for (count, command) in counts.iter_mut().zip(axes.tick()) {
                *count += i64::from(matches!(command, Command::Pulse { .. }));
            }
        }
        assert_eq!(counts, [100; 4]);
        assert!(axes.0.iter().all(|axis| axis.commanded() == 100));
    }
}
