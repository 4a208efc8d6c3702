//! The stop behind each block.

use super::{Axes, Stage};
use crate::axis::{COARSEST, Work, coarser};
use crate::cutter::Demand;
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

    /// Cuts a segment of the stop behind the block.
    pub(super) fn cut_stop(&mut self) -> Work {
        let (Some(writer), Some(queue), Some(stop)) =
            (self.writers.get_mut(self.axis), self.queue.axes.get(self.axis), self.stops.get_mut(self.block))
        else {
            return Work::Later;
        };
        let demand = Demand { off: self.off, coarse: Some(self.coarse), time: u64::MAX };
        if let Some((stretch, direction)) = stop.cut(self.axis, &demand, u64::MAX) {
            writer.put_steps((queue, self.block), &stretch, direction);
            self.quiet = 0;
        } else if self.is_through() {
            let over = self.stops.get(self.block).map_or(0, PathMover::over);
            let end = self.put_joint(over, Joint::Rest);
            if self.fits() {
                self.publish(end);
                return Work::More;
            }
        }
        if self.fits() {
            return Work::More;
        }
        if self.coarse > COARSEST {
            // Once more with fewer segments.
            (self.coarse, self.stage) = (coarser(self.coarse), Stage::Brake);
            return Work::More;
        }
        self.give_up()
    }

    pub(super) fn fits(&self) -> bool {
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
