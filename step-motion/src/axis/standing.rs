//! Where the interrupt is, and how an axis continues from where it has stopped.

use core::sync::atomic::Ordering;

use crate::mover::cutting::News;
use crate::queue::{IDLE, Queue};
use crate::writer::{Writer, tick};

use super::{Axis, Stage, Work};

impl<const N: usize> Axis<'_, N> {
    /// Returns where the interrupt is: the block and the place in it, or `None` if it is stopped; and the slot.
    pub(super) fn current(&self) -> (Option<(usize, usize)>, usize) {
        let current = self.queue.current.load(Ordering::Acquire);
        let slot = (current & 0xffff) as usize;
        (Queue::<N>::place(slot).filter(|_| current & IDLE == 0), slot)
    }

    /// Returns whether a slot belongs to the block that was linked last.
    pub(super) fn is_in(&self, slot: usize) -> bool {
        Queue::<N>::place(slot).is_some_and(|(block, _)| block == self.block)
    }

    /// Reads where the interrupt is. Returns whether the interrupt is in a stop that was not requested.
    pub(super) fn look(&mut self) -> bool {
        let made = self.queue.made.load(Ordering::Acquire);
        #[expect(clippy::cast_possible_wrap, reason = "a difference in two's complement")]
        let since = made.wrapping_sub(self.made) as i32;
        (self.position, self.made) = (self.position.wrapping_add(since.into()), made);
        let (running, slot) = self.current();
        let Some((block, place)) = Queue::<N>::place(slot) else { return false };
        if self.stage == Stage::Linked {
            if block == self.block {
                self.go_over();
            } else if slot > self.joint {
                self.miss();
            }
        }
        if self.out.get(block).is_some_and(|out| place >= out.len) {
            if running.is_some() {
                return true;
            }
            self.recover(block, slot);
        }
        false
    }

    /// Continues from the end of a block's stop, where the interrupt has stopped. If it has made no step since it stood before, the motion
    /// goes on from the end of the block: it would otherwise begin anew after each block that is too short for a step.
    fn recover(&mut self, block: usize, slot: usize) {
        self.forget();
        let Some(out) = self.out.get_mut(block) else { return };
        // The slot at which it has stopped now counts as one before the stop.
        (out.len, self.last) = (usize::MAX, slot);
        let moved = out.position != self.mover.commanded() || self.mover.free() > self.stood.saturating_add(1);
        if moved || !self.mover.has_steps() {
            self.end = out.rest;
            self.mover.rest_at(out.position, tick(self.end.end));
        }
    }

    /// Ends a motion that has made no step since the axis stood, if it stands again.
    pub(super) fn stay(&mut self) {
        if self.stage != Stage::Linked && self.current().0.is_none() && self.mover.has_steps() {
            self.forget();
            self.mover.rest_at(self.position, tick(self.end.end));
        }
    }

    /// Returns whether a halt stops a motion, as far as the interrupt has been seen.
    pub(super) fn was_moving(&self) -> bool {
        let now = tick(self.end.end).max(self.mover.free());
        self.position != self.mover.commanded() || !self.mover.is_at_rest(now)
    }

    /// Confirms a halt once the interrupt has stopped for it.
    pub(super) fn confirm(&mut self) -> Work {
        let Some(dir) = self.halts.dir(self.queue.current.load(Ordering::Acquire)) else { return Work::Start };
        self.look();
        let now = tick(self.end.end).max(self.mover.free()).saturating_add(1);
        self.mover.halt_at(self.position, now, self.was_moving());
        (self.last, self.missed, self.news, self.told) = (0, 0, News::None, News::None);
        self.end = Writer::new(i128::from(now) << 32, dir);
        self.halts.confirmed(&self.queue.halt);
        self.lost = false;
        Work::More
    }
}
