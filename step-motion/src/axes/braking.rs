//! The stop after each block.

use super::{Axes, Stage};
use crate::axis::{COARSEST, Work, coarser};
use crate::cutter::{Cut, Demand};
use crate::path_mover::PathMover;
use crate::queue::{Joint, Queue};

impl<const N: usize, const M: usize, const S: usize> Axes<'_, N, M, S> {
    /// Begins the stop from the end of the block.
    pub(super) fn brake(&mut self) -> Work {
        if let Some(stop) = self.stops.get_mut(self.block) {
            stop.clone_from(&self.work);
        }
        self.stage = Stage::Hold;
        Work::More
    }

    /// Plans it.
    pub(super) fn hold_stop(&mut self) -> Work {
        if let Some(stop) = self.stops.get_mut(self.block) {
            stop.hold(self.until);
        }
        self.writers = self.joint;
        (self.stage, self.axis, self.quiet) = (Stage::Stop, 0, 0);
        Work::More
    }

    /// Cuts a segment of the stop after the block.
    pub(super) fn cut_stop(&mut self) -> Work {
        let (Some(writer), Some(queue), Some(stop)) =
            (self.writers.get_mut(self.axis), self.queue.axes.get(self.axis), self.stops.get_mut(self.block))
        else {
            return Work::Later;
        };
        let demand = Demand { off: self.off, coarse: Some(self.coarse), time: u64::MAX, searches: 2 };
        match stop.cut(self.axis, &demand, u64::MAX) {
            Cut::Steps(stretch, direction) => {
                writer.put_steps((queue, self.block), &stretch, direction);
                self.quiet = 0;
            }
            Cut::More => return Work::More,
            Cut::Later | Cut::Rest => return if self.is_through() { self.end_stop() } else { Work::More },
        }
        if self.fits() { Work::More } else { self.take_fewer_slots() }
    }

    /// Ends the block where all axes are at rest, and hands it out.
    fn end_stop(&mut self) -> Work {
        let over = self.stops.get(self.block).map_or(0, PathMover::over);
        let end = self.put_joint(over, Joint::Rest);
        if !self.fits() {
            return self.take_fewer_slots();
        }
        self.publish(end);
        Work::More
    }

    /// Cuts the stop once more with fewer segments, if that is allowed.
    fn take_fewer_slots(&mut self) -> Work {
        if self.coarse <= COARSEST {
            return self.give_up();
        }
        (self.coarse, self.stage) = (coarser(self.coarse), Stage::Brake);
        Work::More
    }

    fn fits(&self) -> bool {
        self.writers.iter().all(|writer| writer.len <= Queue::<S>::BLOCK)
    }

    /// The block cannot be run: the path is abandoned, and the machine comes to rest where the interrupt stops.
    pub(super) fn give_up(&mut self) -> Work {
        self.begin_anew();
        self.shorter = 0;
        if self.standing {
            self.path.halt_at(self.commanded(), self.end, false);
        } else {
            self.stop();
            self.lost = true;
        }
        Work::TooFewSlots
    }
}
