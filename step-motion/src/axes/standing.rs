//! Where the interrupt is, and how the axes continue from where it has stopped.

use core::sync::atomic::Ordering;

use servowire_core::Direction;

use super::Axes;
use crate::axis::Work;
use crate::queue::{IDLE, Queue};

impl<const N: usize, const M: usize, const S: usize> Axes<'_, N, M, S> {
    /// Returns the block and the place in it where the first axis is, and whether all axes are stopped.
    pub(super) fn place(&self) -> (Option<(usize, usize)>, bool) {
        let mut places = self.queue.axes.iter().map(|queue| queue.current.load(Ordering::Acquire));
        let first = places.next().unwrap_or(IDLE);
        let idle = first & IDLE != 0 && places.all(|current| current & IDLE != 0);
        (Queue::<S>::place((first & 0xffff) as usize), idle)
    }

    /// Returns the block in whose stop a place is: the interrupt has found nothing else there.
    pub(super) fn stop_at(&self, place: Option<(usize, usize)>) -> Option<usize> {
        let (block, place) = place.filter(|_| !self.standing)?;
        self.outs.get(block).is_some_and(|out| place >= out.len).then_some(block)
    }

    /// Returns whether all axes have entered a block.
    pub(super) fn is_in(&self, block: usize) -> bool {
        self.queue.axes.iter().all(|queue| {
            let slot = (queue.current.load(Ordering::Acquire) & 0xffff) as usize;
            Queue::<S>::place(slot).is_some_and(|(own, _)| own == block)
        })
    }

    /// Confirms a halt once the interrupt has stopped for it.
    pub(super) fn confirm(&mut self) -> Work {
        let mut dirs = self.dirs;
        for (dir, queue) in dirs.iter_mut().zip(&self.queue.axes) {
            match self.halts.dir(queue.current.load(Ordering::Acquire)) {
                Some(level) => *dir = level,
                None => return Work::Start,
            }
        }
        let commanded = self.commanded();
        // Or not all of what was handed out has been made.
        self.path.halt_at(commanded, self.end, commanded != self.path.commanded());
        self.stand(dirs);
        if let Some(queue) = self.queue.axes.first() {
            self.halts.confirmed(&queue.halt);
        }
        Work::More
    }

    /// Continues from the end of a block's stop, where the interrupt has stopped. If it has made no step since it stood there before, the
    /// motion goes on from the end of the block: it would otherwise begin anew after each block that is too short for a step.
    pub(super) fn recover(&mut self, block: usize) {
        let goes_on = self.goes_on() && !self.pending;
        let (Some(stop), Some(out)) = (self.stops.get_mut(block), self.outs.get(block).copied()) else { return };
        if goes_on && stop.last_steps().into_iter().all(|last| last <= self.stood) {
            let asked = self.asked || self.later;
            self.stand(self.dirs);
            self.asked = asked;
        } else {
            stop.go_on_as(&self.path, out.end);
            self.path.clone_from(stop);
            self.end = out.end;
            self.stand(out.dirs);
        }
        self.block = 1_usize.wrapping_sub(block);
    }

    fn stand(&mut self, dirs: [Direction; N]) {
        (self.dirs, self.stood) = (dirs, self.end);
        for (made, queue) in self.made.iter_mut().zip(&self.queue.axes) {
            *made = queue.made.load(Ordering::Acquire);
        }
        for out in &mut self.outs {
            out.valid = false;
        }
        self.begin_anew();
        (self.standing, self.pending, self.asked, self.told, self.lost) = (true, false, false, false, false);
    }
}
