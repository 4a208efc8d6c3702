//! The blocks of a path: what is cut for each, and how the interrupt is let in.

use core::sync::atomic::Ordering;

use super::{Axes, PUT_OFF, Stage};
use crate::axes_timer::{TURN, TURNS};
use crate::axis::Work;
use crate::cutter::{Cut, Demand};
use crate::queue::{Joint, Queue, REST};
use crate::writer::{Writer, tick};

/// A block is at least this part of a second, or a 16th of the reach: no background makes it any faster.
const SHORTEST: u32 = 2000;

impl<const N: usize, const M: usize, const S: usize> Axes<'_, N, M, S> {
    /// Begins a block where the blocks already handed out end.
    pub(super) fn begin(&mut self) -> Work {
        let reach = self.reach.checked_shr(self.shorter).unwrap_or(0);
        let shortest = (self.path.clock().hz() / SHORTEST).min(self.reach / 16).max(4);
        if reach < shortest {
            return self.give_up();
        }
        self.path.set_lead(self.reach / 4);
        if !core::mem::take(&mut self.same) {
            self.work.clone_from(&self.path);
        }
        let end = i128::from(self.end) << 32;
        for ((writer, dir), last) in self.writers.iter_mut().zip(self.dirs).zip(self.path.last_steps()) {
            *writer = Writer { last: i128::from(last) << 32, ..Writer::new(end, dir) };
        }
        (self.until, self.put_off) = (self.end.saturating_add(reach.into()), 0);
        (self.stage, self.axis, self.quiet, self.coarse) = (Stage::LookAhead, 0, 0, self.finest);
        self.told |= self.asked;
        Work::More
    }

    /// Plans the block after a request, or along the lines that were added; or finds out, from the last line back, how fast it may be.
    pub(super) fn look_ahead(&mut self) -> Work {
        if self.work.has_to_find(self.asked.then_some(self.end)) {
            return Work::More;
        }
        self.stage = Stage::Block;
        if self.asked {
            self.work.replan(self.end);
            if self.work.due().is_none() && self.runs_on() {
                self.until = self.end;
            } else if self.work.due().is_none() {
                // It leads to no step.
                self.go_along();
                self.stage = Stage::Idle;
            }
        } else {
            self.work.look_ahead(self.end);
        }
        Work::More
    }

    /// Returns whether the stop after the last block that was handed out has steps.
    pub(super) fn runs_on(&self) -> bool {
        let stop = self.stops.get(1_usize.wrapping_sub(self.block));
        (self.pending || !self.standing) && stop.is_some_and(|stop| stop.commanded() != self.path.commanded())
    }

    /// Goes on to the next axis, or back to the first one; returns whether no axis has had anything to cut.
    pub(super) fn is_through(&mut self) -> bool {
        self.quiet = self.quiet.saturating_add(1);
        self.axis = self.axis.saturating_add(1).checked_rem(N).unwrap_or(0);
        self.quiet >= N
    }

    /// Cuts a segment of the block.
    pub(super) fn cut_block(&mut self) -> Work {
        let (Some(writer), Some(queue)) = (self.writers.get_mut(self.axis), self.queue.axes.get(self.axis)) else {
            return Work::Later;
        };
        let time = self.until.saturating_sub(tick(writer.end)).saturating_mul(1 << 32);
        let demand = Demand { off: self.off, coarse: None, time, searches: 2 };
        match self.work.cut(self.axis, &demand, self.until) {
            Cut::Steps(stretch, direction) => {
                writer.put_steps((queue, self.block), &stretch, direction);
                self.quiet = 0;
                if writer.len.saturating_add(4) > Queue::<S>::BLOCK / 3 {
                    self.shorter = self.shorter.saturating_add(1);
                    self.stage = Stage::Idle;
                }
            }
            Cut::More => {}
            Cut::Later | Cut::Rest => {
                if self.is_through() && !self.waits_for_a_step() {
                    self.join();
                }
            }
        }
        Work::More
    }

    /// Returns whether a step falls into the tick in which the block is to end, or into the next one.
    pub(super) fn waits_for_a_step(&mut self) -> bool {
        let next = self.work.due().filter(|due| *due <= self.until.saturating_add(1));
        if let Some(due) = next.filter(|_| self.put_off < PUT_OFF) {
            (self.until, self.quiet) = (due.saturating_add(1), 0);
            self.put_off = self.put_off.saturating_add(1);
        }
        self.quiet == 0
    }

    /// Ends the block at the same tick for all axes.
    pub(super) fn join(&mut self) {
        self.put_turns();
        self.until = self.put_joint(self.until, Joint::Block);
        self.joint = self.writers;
        self.stage = Stage::Brake;
        if let (Some(out), Some(first)) = (self.outs.get_mut(self.block), self.writers.first()) {
            out.len = first.len;
        }
    }

    /// Changes DIR of the axes that are to turn: a request may make the next step as soon as the block and the pause are over. Without a
    /// pause the steps are as far apart as at the greatest speed.
    fn put_turns(&mut self) {
        let (before, hz) = (i128::from(self.until) << 32, self.work.clock().hz());
        let own = self.writers.iter_mut().zip(&self.queue.axes).zip(self.work.axes());
        for (at, ((writer, queue), axis)) in own.enumerate() {
            if let Some(direction) = self.work.direction(at) {
                let apart = axis.reversal_pause.max(hz.checked_div(axis.limits.speed()).unwrap_or(0));
                let next = writer.last.saturating_add(i128::from(apart) << 32).max(before);
                writer.put_turn((queue, self.block), next, direction, before);
            }
        }
    }

    /// Puts an event of all axes at one tick, not before a given one; returns that tick.
    pub(super) fn put_joint(&mut self, at: u64, joint: Joint) -> u64 {
        let last = self.writers.iter().map(|writer| tick(writer.end).saturating_add(1)).max().unwrap_or(at);
        let at = at.max(last);
        for (writer, queue) in self.writers.iter_mut().zip(&self.queue.axes) {
            writer.put_joint((queue, self.block), i128::from(at) << 32, joint);
        }
        at
    }

    /// Has the path go where the block leads; a request that came meanwhile is still to be planned.
    fn go_along(&mut self) {
        if self.later {
            self.work.hold_as(self.path.requests());
        }
        self.path.clone_from(&self.work);
        (self.asked, self.told, self.later) = (self.later, false, false);
    }

    /// Lets the interrupt into the block, after the previous block or from rest.
    pub(super) fn publish(&mut self, end: u64) {
        let dirs = |writers: [Writer; N]| writers.map(|writer| writer.dir);
        if let Some(out) = self.outs.get_mut(self.block) {
            (out.valid, out.end, out.dirs) = (true, end, dirs(self.writers));
        }
        for ((made, after), before) in self.made.iter_mut().zip(self.work.commanded()).zip(self.path.commanded()) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "modulo 2^32")]
            let steps = after.wrapping_sub(before) as u32;
            *made = made.wrapping_add(steps);
        }
        self.go_along();
        self.same = true;
        (self.end, self.dirs) = (self.until, dirs(self.joint));
        self.turn = self.turn.wrapping_add(1) & TURNS.wrapping_sub(1);
        let from = if self.standing { REST } else { 0 };
        let slot = u32::try_from(Queue::<S>::slot(self.block, 0)).unwrap_or(0);
        self.queue.gate.store(self.turn << TURN | from | slot, Ordering::Release);
        if self.joint.iter().all(|writer| writer.len < Queue::<S>::BLOCK / 8) {
            self.shorter = self.shorter.saturating_sub(1);
        }
        (self.pending, self.block, self.stage) = (true, 1_usize.wrapping_sub(self.block), Stage::Idle);
    }
}
