//! The axis that is homed: by itself or of a path, one by one or in two halves.

use crate::axes::Axes;
use crate::axis::Axis;
use crate::error::Error;
use crate::limits::Limits;
use crate::mover::Mover;
use crate::path::AxisSetup;
use crate::path_mover::PathMover;
use crate::requests::Requests;
use servowire_core::Direction;

pub(super) trait Homed {
    fn position(&self) -> i64;
    fn is_at_rest(&self) -> bool;
    fn requests(&self) -> Requests;
    /// Where the soft limits are does not count before there is a reference.
    fn run(&mut self, direction: Direction, speed: u32) -> Result<(), Error>;
    fn move_to(&mut self, target: i64) -> Result<(), Error>;
    fn stop(&mut self);
    fn quick_stop(&mut self, limits: Limits);
    fn set_commanded(&mut self, steps: i64) -> Result<(), Error>;
}

/// A mover at a tick.
pub(super) struct OneByOne<'a> {
    pub(super) mover: &'a mut Mover,
    pub(super) now: u64,
}

impl Homed for OneByOne<'_> {
    fn position(&self) -> i64 {
        self.mover.commanded()
    }

    fn is_at_rest(&self) -> bool {
        self.mover.is_at_rest(self.now)
    }

    fn requests(&self) -> Requests {
        self.mover.requests()
    }

    fn run(&mut self, direction: Direction, speed: u32) -> Result<(), Error> {
        self.mover.run_to(direction, speed, None, self.now)
    }

    fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.mover.move_freely(target, self.now)
    }

    fn stop(&mut self) {
        self.mover.stop(self.now);
    }

    fn quick_stop(&mut self, limits: Limits) {
        self.mover.quick_stop(limits, self.now);
    }

    fn set_commanded(&mut self, steps: i64) -> Result<(), Error> {
        self.mover.set_commanded(steps, self.now)
    }
}

impl<const N: usize> Homed for Axis<'_, N> {
    fn position(&self) -> i64 {
        self.commanded()
    }

    fn is_at_rest(&self) -> bool {
        self.is_at_rest()
    }

    fn requests(&self) -> Requests {
        self.requests()
    }

    fn run(&mut self, direction: Direction, speed: u32) -> Result<(), Error> {
        self.run_to(direction, speed, None)
    }

    fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.move_freely(target)
    }

    fn stop(&mut self) {
        self.stop();
    }

    fn quick_stop(&mut self, limits: Limits) {
        self.quick_stop(limits);
    }

    fn set_commanded(&mut self, steps: i64) -> Result<(), Error> {
        self.set_commanded(steps)
    }
}

/// The axes of a path: one by one, or in two halves.
pub(super) trait PathAxes<const N: usize> {
    fn setup(&self) -> &[AxisSetup; N];
    fn commanded(&self) -> [i64; N];
    fn is_at_rest(&self) -> bool;
    fn requests(&self) -> Requests;
    fn move_to(&mut self, target: [i64; N], feed: u32) -> Result<(), Error>;
    fn stop(&mut self);
    fn quick_stop(&mut self, limits: [Limits; N]);
    fn set_commanded(&mut self, steps: [i64; N]) -> Result<(), Error>;
}

/// One of the axes of a path; the others stay where they are.
pub(super) struct OneOf<P, const N: usize> {
    pub(super) path: P,
    pub(super) axis: usize,
}

impl<P: PathAxes<N>, const N: usize> OneOf<P, N> {
    fn setup(&self) -> Result<AxisSetup, Error> {
        let [axis, axes] = [self.axis, N].map(|number| u32::try_from(number).unwrap_or(u32::MAX));
        self.path.setup().get(self.axis).copied().ok_or(Error::NoAxis { axis, axes })
    }

    /// The positions of all axes, with another one of this axis.
    fn with(&self, position: i64) -> [i64; N] {
        let mut all = self.path.commanded();
        if let Some(own) = all.get_mut(self.axis) {
            *own = position;
        }
        all
    }
}

impl<P: PathAxes<N>, const N: usize> Homed for OneOf<P, N> {
    fn position(&self) -> i64 {
        self.path.commanded().get(self.axis).copied().unwrap_or(0)
    }

    fn is_at_rest(&self) -> bool {
        self.path.is_at_rest()
    }

    fn requests(&self) -> Requests {
        self.path.requests()
    }

    /// A line of 2^31 - 1 steps. After a longer range the axis comes to rest there, and the homing has failed.
    fn run(&mut self, direction: Direction, speed: u32) -> Result<(), Error> {
        let setup = self.setup()?;
        if speed == 0 {
            self.path.stop();
            return Ok(());
        }
        let feed = (u64::from(speed) * 1_000_000).checked_div(setup.steps_per_m.into()).unwrap_or(0);
        let far = i64::from(i32::MAX);
        let target = match direction {
            Direction::Forward => self.position().saturating_add(far),
            Direction::Reverse => self.position().saturating_sub(far),
        };
        self.path.move_to(self.with(target), u32::try_from(feed).unwrap_or(u32::MAX))
    }

    fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.setup()?;
        self.path.move_to(self.with(target), u32::MAX)
    }

    fn stop(&mut self) {
        self.path.stop();
    }

    fn quick_stop(&mut self, limits: Limits) {
        let mut all = self.path.setup().map(|setup| setup.limits);
        if let Some(own) = all.get_mut(self.axis) {
            *own = limits;
        }
        self.path.quick_stop(all);
    }

    fn set_commanded(&mut self, steps: i64) -> Result<(), Error> {
        self.path.set_commanded(self.with(steps))
    }
}

/// A path mover at a tick.
pub(super) struct PathOneByOne<'a, const N: usize, const M: usize> {
    pub(super) mover: &'a mut PathMover<N, M>,
    pub(super) now: u64,
}

impl<const N: usize, const M: usize> PathAxes<N> for PathOneByOne<'_, N, M> {
    fn setup(&self) -> &[AxisSetup; N] {
        self.mover.axes()
    }

    fn commanded(&self) -> [i64; N] {
        self.mover.commanded()
    }

    fn is_at_rest(&self) -> bool {
        self.mover.is_at_rest(self.now)
    }

    fn requests(&self) -> Requests {
        self.mover.requests()
    }

    fn move_to(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        self.mover.move_freely(target, feed, self.now)
    }

    fn stop(&mut self) {
        self.mover.stop(self.now);
    }

    fn quick_stop(&mut self, limits: [Limits; N]) {
        self.mover.quick_stop(limits, self.now);
    }

    fn set_commanded(&mut self, steps: [i64; N]) -> Result<(), Error> {
        self.mover.set_commanded(steps, self.now)
    }
}

impl<const N: usize, const M: usize, const S: usize> PathAxes<N> for &mut Axes<'_, N, M, S> {
    fn setup(&self) -> &[AxisSetup; N] {
        Axes::setup(self)
    }

    fn commanded(&self) -> [i64; N] {
        Axes::commanded(self)
    }

    fn is_at_rest(&self) -> bool {
        Axes::is_at_rest(self)
    }

    fn requests(&self) -> Requests {
        Axes::requests(self)
    }

    fn move_to(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        self.move_freely(target, feed)
    }

    fn stop(&mut self) {
        Axes::stop(self);
    }

    fn quick_stop(&mut self, limits: [Limits; N]) {
        Axes::quick_stop(self, limits);
    }

    fn set_commanded(&mut self, steps: [i64; N]) -> Result<(), Error> {
        Axes::set_commanded(self, steps)
    }
}
