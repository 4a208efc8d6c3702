//! The axis that is homed: one by one, or in two halves.

use crate::axis::Axis;
use crate::error::Error;
use crate::limits::Limits;
use crate::mover::Mover;
use crate::requests::Requests;
use servowire_core::Direction;

pub(super) trait Homed {
    fn position(&self) -> i64;
    fn is_at_rest(&self) -> bool;
    fn requests(&self) -> Requests;
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
        self.mover.run(direction, speed, self.now)
    }

    fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.mover.move_to(target, self.now)
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
        self.run(direction, speed)
    }

    fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.move_to(target)
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
