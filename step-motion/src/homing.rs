//! Finding the reference switch.

mod homed;

use self::homed::{Homed, OneByOne, OneOf, PathOneByOne};
use crate::axes::Axes;
use crate::axis::Axis;
use crate::error::Error;
use crate::limits::Limits;
use crate::mover::Mover;
use crate::path_mover::PathMover;
use servowire_core::Direction;

/// How an axis looks for its switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct HomingConfig {
    /// Direction of the switch.
    pub direction: Direction,
    /// Speed of the search, in steps/s.
    pub seek: u32,
    /// Speed of the second, exact approach, in steps/s.
    pub approach: u32,
    /// How far to back off before the second approach, in steps: farther than the stop at the switch takes, or that stays closed.
    /// In two halves the axis runs on for up to twice its reach first.
    pub back_off: u32,
    /// After this many steps without a switch the search is abandoned.
    pub range: u32,
    /// Limits for the stop at the switch. Beyond the switch there must be room to come to rest: v² / 2a, or (v /
    /// 2)(v / a + a / j) with a jerk limit. If the axis may still accelerate there, its jerk limit takes up to v a / j more, or v √(2v / j) if
    /// that is less.
    pub stop: Limits,
}

impl HomingConfig {
    /// Creates a configuration that backs off by a tenth of the range and stops within the limits `stop`.
    pub const fn new(direction: Direction, seek: u32, approach: u32, range: u32, stop: Limits) -> Self {
        Self { direction, seek, approach, back_off: range / 10, range, stop }
    }

    servowire_core::builder! {
        with_back_off: back_off, u32;
    }
}

/// The reference switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Switch {
    /// The axis is not at the switch.
    Open,
    /// The axis is at the switch, or beyond it.
    Closed,
}

/// The progress of a homing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum HomingState {
    /// Looking for the switch.
    Seeking,
    /// On the switch, slowing down.
    Stopping,
    /// Backing off from the switch.
    BackingOff,
    /// Approaching the switch slowly.
    Approaching,
    /// On the switch again, slowing down.
    Settling,
    /// At rest; position 0 is the place where the switch closed.
    Done,
    /// No switch was found within the range, or it stays closed: the axis is stopped. Or somebody else has asked it for
    /// something, and it does that. Its position is not a reference.
    Failed,
}

/// Finds a reference switch: fast towards it, back, and slowly towards it again. Position 0 is the step at which it closes
/// the second time.
///
/// Call [`poll`](Self::poll) with the level of the switch often, at least once per step of the approach; take the steps
/// from the [`Mover`] as usual, or have them made by the interrupt of an [`Axis`]. The axes of a path are homed one after another;
/// the speeds of the search are rounded down to whole µm/s there, and the lines still in the queue are forgotten.
///
/// Soft limits are positions, so they do not count before there is a reference: a homing may leave them.
///
/// A hold and an override act on it as on any motion: it waits, and goes on. A move, a stop or a halt that somebody else
/// asks for ends it, and so does another position, at the latest when it goes on.
///
/// ```
/// use step_motion::{
///     Axes, AxesQueue, AxisSetup, Clock, Direction, Homing, HomingConfig, HomingState, Limits, Path, Switch, Work,
/// };
/// static QUEUE: AxesQueue<2, 129> = AxesQueue::new();
/// let limits = Limits::new(20_000, 200_000)?;
/// let axis = AxisSetup::new(limits, 80_000).with_soft_limits(0, 24_000);
/// let (mut axes, mut timer) = Axes::new(&QUEUE, Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20)?);
/// let config = HomingConfig::new(Direction::Reverse, 4000, 400, 30_000, limits).with_back_off(200);
/// let mut motors = [300, 500]; // steps from the switches
/// for at in 0..2 {
///     let mut homing = Homing::start_axes(config, &mut axes, at, Switch::Open)?;
///     while homing.state() != HomingState::Done {
///         while axes.poll() == Work::More {}
///         // what the timer does
///         let fired = timer.fire();
///         for (axis, motor) in motors.iter_mut().enumerate().filter(|(axis, _)| fired.steps() >> axis & 1 != 0) {
///             *motor += if fired.reverse() >> axis & 1 != 0 { -1 } else { 1 };
///         }
///         let switch = if motors[at] <= 0 { Switch::Closed } else { Switch::Open };
///         assert_ne!(homing.poll_axes(&mut axes, switch)?, HomingState::Failed);
///     }
/// }
/// assert_eq!(axes.commanded(), motors); // each switch closes at its position 0
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_copy_implementations, reason = "a copy would go on from a state that is over")]
pub struct Homing {
    config: HomingConfig,
    state: HomingState,
    /// Position at the start of the state, or of the switch.
    mark: i64,
    /// The number of the axis's last request, which was of this homing.
    asked: u32,
    /// Which axis of a path it is.
    axis: usize,
}

impl Homing {
    /// Starts a homing; if the switch is already closed, the axis first moves off it.
    ///
    /// # Errors
    /// [`Error::Moving`] if the axis is not at rest.
    pub fn start(config: HomingConfig, mover: &mut Mover, switch: Switch, now: u64) -> Result<Self, Error> {
        Self::begin(config, &mut OneByOne { mover, now }, switch, 0)
    }

    /// Does the same as [`start`](Self::start), of an axis in two halves.
    ///
    /// # Errors
    /// The same.
    pub fn start_axis<const N: usize>(
        config: HomingConfig,
        axis: &mut Axis<'_, N>,
        switch: Switch,
    ) -> Result<Self, Error> {
        Self::begin(config, axis, switch, 0)
    }

    /// Does the same as [`start`](Self::start), of one axis of a path (from 0).
    ///
    /// # Errors
    /// The same, and [`Error::NoAxis`].
    pub fn start_path<const N: usize, const M: usize>(
        config: HomingConfig,
        mover: &mut PathMover<N, M>,
        axis: usize,
        switch: Switch,
        now: u64,
    ) -> Result<Self, Error> {
        Self::begin(config, &mut OneOf { path: PathOneByOne { mover, now }, axis }, switch, axis)
    }

    /// Does the same as [`start`](Self::start), of one axis (from 0) of a path in two halves.
    ///
    /// # Errors
    /// The same, and [`Error::NoAxis`].
    pub fn start_axes<const N: usize, const M: usize, const S: usize>(
        config: HomingConfig,
        axes: &mut Axes<'_, N, M, S>,
        axis: usize,
        switch: Switch,
    ) -> Result<Self, Error> {
        Self::begin(config, &mut OneOf { path: axes, axis }, switch, axis)
    }

    /// The present state.
    pub const fn state(&self) -> HomingState {
        self.state
    }

    /// Checks the switch and commands the axis accordingly.
    ///
    /// # Errors
    /// Those of the requests to the axis; the homing then stays in its state.
    pub fn poll(&mut self, mover: &mut Mover, switch: Switch, now: u64) -> Result<HomingState, Error> {
        self.go_on(&mut OneByOne { mover, now }, switch)
    }

    /// Does the same as [`poll`](Self::poll), of an axis in two halves. Its steps go on for up to twice its reach after the
    /// switch has closed, and are counted.
    ///
    /// # Errors
    /// The same.
    pub fn poll_axis<const N: usize>(&mut self, axis: &mut Axis<'_, N>, switch: Switch) -> Result<HomingState, Error> {
        self.go_on(axis, switch)
    }

    /// Does the same as [`poll`](Self::poll), of the axis of a path.
    ///
    /// # Errors
    /// The same.
    pub fn poll_path<const N: usize, const M: usize>(
        &mut self,
        mover: &mut PathMover<N, M>,
        switch: Switch,
        now: u64,
    ) -> Result<HomingState, Error> {
        let axis = self.axis;
        self.go_on(&mut OneOf { path: PathOneByOne { mover, now }, axis }, switch)
    }

    /// Does the same as [`poll_axis`](Self::poll_axis), of the axis of a path.
    ///
    /// # Errors
    /// The same.
    pub fn poll_axes<const N: usize, const M: usize, const S: usize>(
        &mut self,
        axes: &mut Axes<'_, N, M, S>,
        switch: Switch,
    ) -> Result<HomingState, Error> {
        let axis = self.axis;
        self.go_on(&mut OneOf { path: axes, axis }, switch)
    }

    fn begin(config: HomingConfig, axis: &mut impl Homed, switch: Switch, at: usize) -> Result<Self, Error> {
        if !axis.is_at_rest() {
            return Err(Error::Moving);
        }
        let mut new = Self { config, state: HomingState::Seeking, mark: axis.position(), asked: 0, axis: at };
        if switch == Switch::Closed {
            new.back_off(axis)?;
        } else {
            axis.run(config.direction, config.seek)?;
        }
        new.asked = axis.requests().number();
        Ok(new)
    }

    fn go_on(&mut self, axis: &mut impl Homed, switch: Switch) -> Result<HomingState, Error> {
        let over = matches!(self.state, HomingState::Done | HomingState::Failed);
        if !over && axis.requests().number() != self.asked {
            self.state = HomingState::Failed;
        } else if !over {
            self.ask(axis, switch == Switch::Closed)?;
            self.asked = axis.requests().number();
        }
        Ok(self.state)
    }

    /// Makes the next request, if it is time for it.
    fn ask(&mut self, axis: &mut impl Homed, closed: bool) -> Result<(), Error> {
        let position = axis.position();
        let rest = axis.is_at_rest() && !axis.requests().holds();
        match self.state {
            HomingState::Seeking | HomingState::Approaching if closed => {
                axis.quick_stop(self.config.stop);
                let again = self.state == HomingState::Approaching;
                self.state = if again { HomingState::Settling } else { HomingState::Stopping };
                self.mark = position;
            }
            HomingState::Seeking | HomingState::Approaching
                if rest || position.abs_diff(self.mark) > u64::from(self.config.range) =>
            {
                axis.stop();
                self.state = HomingState::Failed;
            }
            HomingState::Stopping if rest => self.back_off(axis)?,
            HomingState::BackingOff if rest => {
                if closed {
                    self.state = HomingState::Failed;
                } else {
                    axis.run(self.config.direction, self.config.approach)?;
                    (self.state, self.mark) = (HomingState::Approaching, position);
                }
            }
            HomingState::Settling if rest => {
                axis.set_commanded(position.saturating_sub(self.mark))?;
                self.state = HomingState::Done;
            }
            _ => {}
        }
        Ok(())
    }

    fn back_off(&mut self, axis: &mut impl Homed) -> Result<(), Error> {
        let by = i64::from(self.config.back_off);
        let position = axis.position();
        let target = match self.config.direction {
            Direction::Forward => position.saturating_sub(by),
            Direction::Reverse => position.saturating_add(by),
        };
        axis.move_to(target)?;
        self.state = HomingState::BackingOff;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn switch(closed: bool) -> Switch {
        if closed { Switch::Closed } else { Switch::Open }
    }
    use crate::limits::Clock;

    const DIRECTIONS: [Direction; 2] = [Direction::Forward, Direction::Reverse];

    fn parts(direction: Direction) -> (HomingConfig, Mover) {
        let limits = Limits::new(10_000, 50_000).unwrap().with_jerk(1_000_000).unwrap();
        let hard = Limits::new(10_000, 200_000).unwrap();
        let config = HomingConfig::new(direction, 4000, 300, 5000, hard).with_back_off(200);
        (config, Mover::new(Clock::MICROSECONDS, limits).unwrap())
    }

    /// Homes with a switch that is closed `at` this many steps ahead and beyond; where the motor really is in the end, and
    /// the farthest it was.
    fn home(direction: Direction, at: i64) -> (HomingState, i64, i64, Mover) {
        let (config, mut mover) = parts(direction);
        let sign = if direction.dir() { -1 } else { 1 };
        let (mut real, mut far) = (0, 0);
        let mut homing = Homing::start(config, &mut mover, switch(at <= 0), 0).unwrap();
        for now in (0..20_000_000).step_by(20) {
            while mover.due().is_some_and(|due| due <= now) {
                let pulse = mover.pulse().unwrap();
                real += if pulse.direction.dir() { -1 } else { 1 };
                far = far.max(real * sign);
            }
            homing.poll(&mut mover, switch(real * sign >= at), now).unwrap();
        }
        (homing.state(), real, far, mover)
    }

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn the_switch_is_found_to_the_step() {
        for direction in DIRECTIONS {
            for at in [1, 700, 3000, -100] {
                let (state, real, far, mover) = home(direction, at);
                assert_eq!(state, HomingState::Done, "{direction} {at}");
                let sign = if direction.dir() { -1 } else { 1 };
                assert_eq!(real - mover.commanded(), at * sign, "{direction} {at}");
                // v² / 2a of the stop: 40 steps, and what a poll takes.
                assert!(far - at.max(0) <= 45, "{direction} {at}: {far}");
            }
        }
    }

    /// An approach that takes 40 steps to rest, 2000² / 2 / 50,000: position 0 is where the switch closed, not where it ended. With a
    /// switch that closes only once, it ends at most the range after the start of the approach, and those 40 steps and a poll.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn a_fast_approach_is_counted_and_has_its_range() {
        for (direction, breaks) in DIRECTIONS.into_iter().flat_map(|direction| [(direction, false), (direction, true)])
        {
            let (config, _) = parts(direction);
            let limits = Limits::new(10_000, 50_000).unwrap();
            let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
            let config = HomingConfig { approach: 2000, range: 1000, stop: limits, ..config }.with_back_off(600);
            let (sign, mut real, mut rest) = (if direction.dir() { -1 } else { 1 }, 0, None);
            let mut homing = Homing::start(config, &mut mover, Switch::Open, 0).unwrap();
            for now in (0..3_000_000).step_by(20) {
                while mover.due().is_some_and(|due| due <= now) {
                    real += if mover.pulse().unwrap().direction.dir() { -1 } else { 1 };
                }
                let approaches = matches!(homing.state(), HomingState::Approaching | HomingState::Settling);
                let closed = real * sign >= 700 && !(breaks && approaches);
                homing.poll(&mut mover, switch(closed), now).unwrap();
                if homing.state() == HomingState::BackingOff {
                    rest = Some(real);
                }
            }
            if breaks {
                assert_eq!(homing.state(), HomingState::Failed);
                let way = (real - rest.unwrap()) * sign;
                assert!((1001 + 40..1001 + 43).contains(&way), "{way} steps");
            } else {
                assert_eq!((homing.state(), real - mover.commanded()), (HomingState::Done, 700 * sign));
                assert!((39..42).contains(&(mover.commanded() * sign)), "{}", mover.commanded());
            }
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn no_switch_and_a_switch_that_stays_closed() {
        for direction in DIRECTIONS {
            let (state, real, _, mover) = home(direction, 6000);
            assert_eq!((state, mover.commanded()), (HomingState::Failed, real));
            // One step beyond the range, and 260 to rest: (v / 2)(v / a + a / j).
            assert_eq!(real.abs(), 5001 + 260);
            let (state, ..) = home(direction, -5000);
            assert_eq!(state, HomingState::Failed);
        }
        let (config, mut mover) = parts(Direction::Forward);
        // It is closed: away from it at once.
        let homing = Homing::start(config, &mut mover, Switch::Closed, 0).unwrap();
        assert_eq!((homing.state(), mover.direction()), (HomingState::BackingOff, Direction::Reverse));
        assert_eq!(HomingConfig::new(Direction::Forward, 4000, 300, 5000, config.stop).back_off, 500);
        let (config, mut mover) = parts(Direction::Forward);
        mover.move_to(50, 0).unwrap();
        assert_eq!(Homing::start(config, &mut mover, Switch::Open, 0).unwrap_err(), Error::Moving);
    }
}
