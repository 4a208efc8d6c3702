//! The blocks of an axis: where a block is joined to those handed out, what is cut for it, and when the interrupt may enter
//! it.

use core::sync::atomic::Ordering;

use crate::cutter::{Cut, Demand};
use crate::mover::cutting::News;
use crate::mover::planning::Begin;
use crate::queue::Queue;
use crate::writer::{TICK, Writer, tick};

use super::{Axis, COARSE, COARSEST, Mark, Out, Stage, Tail, Work, coarser};

/// Minimum number of slots for the steps of a block, before those of its stop.
const LEAST_ROOM: usize = 4;
/// A value that the interrupt never reports.
pub(super) const UNSEEN: u32 = u32::MAX;
/// A wait ends this many ticks before a step may come.
const BEFORE: u64 = 2;

impl<const N: usize> Axis<'_, N> {
    /// Maximum number of slots for the steps of a block, before those of its stop.
    pub(super) const ROOM: usize = if Queue::<N>::BLOCK / 2 > LEAST_ROOM { Queue::<N>::BLOCK / 2 } else { LEAST_ROOM };

    /// Does a slice of the background's work: a segment, the plan of a stop, or a check of the interrupt. Call it until it
    /// returns anything but [`Work::More`], again after each request, and every half [reach](Self::with_reach); more often
    /// if the slots of a block hold less than that.
    pub fn poll(&mut self) -> Work {
        if self.halts.is_pending() {
            return self.confirm();
        }
        let current = self.queue.current.load(Ordering::Acquire);
        if current == self.seen {
            return self.waits;
        }
        if self.stage == Stage::Block && current == self.looked {
            // The interrupt is where it was.
            return self.cut();
        }
        self.looked = current;
        let work = self.slice();
        let waits = matches!(work, Work::Start | Work::Later | Work::Rest);
        (self.seen, self.waits) = (if waits { current } else { UNSEEN }, work);
        work
    }

    fn slice(&mut self) -> Work {
        let linked = self.stage == Stage::Linked;
        if self.look() {
            return Work::Later;
        }
        if linked && self.stage != Stage::Linked {
            return Work::More;
        }
        let (running, slot) = self.current();
        let waits = if running.is_some() { Work::Later } else { Work::Rest };
        if self.lost {
            if running.is_some() {
                return Work::Later;
            }
            // It may have made steps since the first look.
            self.look();
            self.mover.rest_at(self.position, tick(self.end.end));
            self.lost = false;
        }
        match self.stage {
            Stage::Idle => {
                let more = self.news != News::None || self.mover.has_more();
                if more && self.begin() { Work::More } else { waits }
            }
            Stage::Plan => {
                if self.plan() || self.news != News::None {
                    Work::More
                } else {
                    waits
                }
            }
            Stage::Block => self.cut(),
            Stage::Stop => self.cut_stop(),
            Stage::Ready => self.link(running, slot),
            Stage::Linked if running.is_some() => Work::Later,
            Stage::Linked => Work::Start,
        }
    }

    /// Takes a new request, which the next slices plan; one that leaves an axis at rest there is done.
    pub(super) fn asked(&mut self, news: News) {
        self.seen = UNSEEN;
        self.look();
        if !self.mover.has_work() {
            self.stay();
        }
        if self.is_at_rest() {
            return;
        }
        self.news = self.news.max(news);
        if self.stage != Stage::Linked && !self.comes_first() {
            // In place of the block being made.
            self.forget();
        }
    }

    /// Returns whether the block being made has to be run before a new request is planned: one for the request before it, or requests
    /// that follow each other would never be carried out. A stop comes before a motion that has been asked for, but not before a stop.
    fn comes_first(&self) -> bool {
        self.told != News::None && (self.work.requests().brakes() || !self.requests().brakes())
    }

    /// Takes over the linked block: the interrupt has entered it.
    pub(super) fn go_over(&mut self) {
        self.work.wish_as(&self.mover);
        self.mover.clone_from(&self.work);
        let len = self.out.get(self.block).map_or(0, |out| out.len);
        (self.end, self.last) = (self.writer, Queue::<N>::slot(self.block, len.saturating_sub(1)));
        self.block = 1_usize.wrapping_sub(self.block);
        (self.stage, self.told, self.missed) = (Stage::Idle, News::None, 0);
    }

    /// Discards a block that the interrupt has missed, to be made again further ahead.
    pub(super) fn miss(&mut self) {
        self.missed = self.missed.saturating_add(1);
        self.forget();
    }

    /// Discards the block; its requests still have to be carried out.
    pub(super) fn forget(&mut self) {
        self.news = self.news.max(self.told);
        (self.stage, self.told, self.stop) = (Stage::Idle, News::None, None);
    }

    /// Longest duration of a segment. A block is joined at least half of that ahead of the interrupt.
    ///
    /// A request waits for the interrupt to enter a linked block: at most the distance to it at that time, one segment, and
    /// the time until this is noticed.
    /// It then takes effect after two and a half segments. In total this is within twice the reach: 0.6 + 0.25 + 0.5 + 0.625.
    const fn part(&self) -> u64 {
        self.reach as u64 >> 2
    }

    /// A block without a new request is linked when the interrupt is this near: a little more than the time between two calls.
    fn near(&self) -> u64 {
        u64::from(self.reach).saturating_mul(3) / 5
    }

    /// Begins a block: if there is a request, after the next segment that is far enough ahead of the interrupt; otherwise
    /// after everything handed out. Returns whether there is anything to plan.
    fn begin(&mut self) -> bool {
        self.forget();
        self.told = core::mem::replace(&mut self.news, News::None);
        let (running, _) = self.current();
        if running.is_none() {
            self.stood = tick(self.end.end);
        }
        self.work.clone_from(&self.mover);
        (self.joint, self.writer) = (self.last, Writer { len: 0, ..self.end });
        if let Some((block, place)) = running.filter(|_| self.told != News::None) {
            self.join(block, place);
        }
        let blocks = if self.told == News::None || running.is_none() { 8 } else { 2 };
        let now = tick(self.writer.end);
        self.until = now.saturating_add(u64::from(self.reach).saturating_mul(blocks));
        let Some(begin) = self.work.pursue(self.told, now) else {
            self.told = News::None;
            return false;
        };
        self.planning.begin(begin);
        self.stage = Stage::Plan;
        true
    }

    /// Does a slice of the plan. Returns whether there is anything to do.
    fn plan(&mut self) -> bool {
        if self.work.plan(&mut self.planning) {
            return true;
        }
        let (running, _) = self.current();
        let brakes = self.out.get(1_usize.wrapping_sub(self.block)).is_some_and(|out| out.brakes);
        let ends_here = self.joint == self.last && (running.is_none() || !brakes);
        if ends_here && !self.work.has_steps() {
            self.stay();
            (self.stage, self.told) = (Stage::Idle, News::None);
            return false;
        }
        if let Some(out) = self.out.get_mut(self.block) {
            *out = Out { begin: self.writer.end, free: self.work.free(), ..Out::NONE };
        }
        self.stage = Stage::Block;
        true
    }

    /// Joins the block after a segment that is far enough ahead.
    fn join(&mut self, block: usize, place: usize) {
        let Some(out) = self.out.get(block).copied() else { return };
        let mark = |at| self.marks.get(Queue::<N>::slot(block, at)).copied().unwrap_or_default();
        let lead = self.part() << 31;
        let lead = lead.checked_shl(self.missed).filter(|far| far.checked_shr(self.missed) == Some(lead));
        let Some(from) = lead.and_then(|lead| lead.checked_add(self.ends(block, place))) else { return };
        let Some(at) = (place..out.len.saturating_sub(1)).find(|at| mark(*at).end >= from) else { return };
        let steps = mark(at).steps;
        let time = |mark: Mark| out.begin.saturating_add(mark.end.into());
        // The tick after the last step before it, and DIR there.
        let (free, dir) = if steps == 0 {
            (out.free, None)
        } else {
            let marks = (0..=at).rev().map(mark).filter(|mark| mark.end > 0);
            let last = marks.take_while(|mark| mark.steps == steps).last();
            (last.map_or(out.free, |last| tick(time(last)).saturating_add(1)), Some(self.end.dir))
        };
        self.joint = Queue::<N>::slot(block, at);
        let last = i128::from(free.saturating_sub(1)) << 32;
        let level = self.queue.dir(self.joint).unwrap_or(self.end.dir);
        self.writer = Writer { last, ..Writer::new(time(mark(at)), level) };
        self.work.back_to(out.steps.saturating_sub(steps), tick(self.writer.end), (free, dir));
    }

    /// Returns when the segment at a place ends at the latest, counted from the start of its block.
    fn ends(&self, block: usize, place: usize) -> u64 {
        let len = self.out.get(block).map_or(0, |out| out.len);
        let mut slots = (place..len).filter_map(|at| self.marks.get(Queue::<N>::slot(block, at)));
        slots.find(|mark| mark.end > 0).map_or(u64::MAX, |mark| mark.end)
    }

    /// Cuts a segment of the block.
    fn cut(&mut self) -> Work {
        let (now, before) = (tick(self.writer.end), self.writer.len);
        if self.work.has_steps() && self.is_long_enough(now) {
            return Work::More;
        }
        let until = now.saturating_add(self.part());
        let (to, wait) = ((self.queue, self.block), i128::from(until.saturating_sub(BEFORE)) << 32);
        // Before the motion begins: once it has, another request may make the first step earlier.
        let direction = self.work.direction();
        if self.writer.dir != direction && self.work.has_steps() {
            self.writer.put_turn(to, i128::from(self.work.begin()) << 32, direction, wait);
        }
        match self.work.cut(&Demand { off: self.off, coarse: None, time: self.part() << 32, searches: 1 }, until) {
            Cut::Steps(stretch, direction) => {
                self.writer.put_steps(to, &stretch, direction);
                if let Some(out) = self.out.get_mut(self.block) {
                    out.steps = out.steps.saturating_add(stretch.count.into());
                }
            }
            Cut::More => {}
            Cut::Later => self.writer.put_wait(to, wait),
            Cut::Rest => {
                let over = i128::from(self.work.over().saturating_add(1)) << 32;
                // A block has at least one event.
                self.writer.put_wait(to, over.max(self.writer.end.saturating_add(TICK)));
                self.mark(before);
                return self.complete(None);
            }
        }
        self.mark(before);
        Work::More
    }

    /// Returns whether the block gets no more steps: it is long enough, and its motion does not come to rest soon after,
    /// within the slots that a stop would take.
    fn is_long_enough(&mut self, now: u64) -> bool {
        let len = self.writer.len.saturating_add(3);
        let Some(Tail { mover, writer, steps, .. }) = &self.stop else {
            if len <= self.room && now < self.until {
                return false;
            }
            self.close();
            if self.runs_out(now) {
                self.stage = Stage::Block;
            }
            return true;
        };
        if len <= Queue::<N>::BLOCK {
            return false;
        }
        // It has not come to rest: go back to where the stop may begin.
        self.work.clone_from(mover);
        self.writer = *writer;
        if let Some(out) = self.out.get_mut(self.block) {
            out.steps = *steps;
        }
        self.close();
        true
    }

    /// Returns whether the plan is likely to come to rest within the slots that are left, and soon.
    fn runs_out(&self, now: u64) -> bool {
        let left = self.work.over().saturating_sub(now);
        let begin = self.out.get(self.block).map_or(0, |out| tick(out.begin));
        let len = u64::try_from(self.writer.len).unwrap_or(u64::MAX);
        let room = u64::try_from(Queue::<N>::BLOCK).unwrap_or(0).saturating_sub(len);
        // Assumes as many segments per time as before, and adds those of the last steps.
        let slots = left.saturating_mul(len).checked_div(now.saturating_sub(begin)).unwrap_or(u64::MAX);
        left <= u64::from(self.reach) << 2 && slots.saturating_add(8) <= room
    }

    /// Records where the events of the last slot end.
    fn mark(&mut self, before: usize) {
        let Some(out) = self.out.get(self.block) else { return };
        let end = u64::try_from(self.writer.end.saturating_sub(out.begin)).unwrap_or(0);
        for at in before..self.writer.len {
            let is_last = at.saturating_add(1) == self.writer.len;
            if let Some(mark) = self.marks.get_mut(Queue::<N>::slot(self.block, at)) {
                *mark = if is_last { Mark { end, steps: out.steps } } else { Mark::default() };
            }
        }
    }

    /// Closes a block that is long enough: its stop comes next.
    fn close(&mut self) {
        let demand = Demand { off: self.off, coarse: Some(self.coarse), time: u64::MAX, searches: 1 };
        let steps = self.out.get(self.block).map_or(0, |out| out.steps);
        self.stop = Some(Tail { mover: self.work.clone(), moves: true, demand, writer: self.writer, steps });
        self.stage = Stage::Stop;
    }

    /// Cuts a segment of the stop after the block.
    fn cut_stop(&mut self) -> Work {
        let Some(tail) = &mut self.stop else { return self.complete(None) };
        if core::mem::take(&mut tail.moves) {
            tail.mover.ask_stop();
            let begin = tail.mover.pursue(News::Change, tick(tail.writer.end));
            self.planning.begin(begin.unwrap_or(Begin::OVER));
            return Work::More;
        }
        if !self.planning.is_over() {
            tail.mover.plan(&mut self.planning);
            return Work::More;
        }
        let to = (self.queue, self.block);
        let more = match tail.mover.cut(&tail.demand, u64::MAX) {
            Cut::Steps(stretch, direction) => {
                tail.writer.put_steps(to, &stretch, direction);
                true
            }
            Cut::More => true,
            Cut::Later | Cut::Rest => {
                let over = i128::from(tail.mover.over()) << 32;
                // The interrupt has to be seen in the stop, however short that is.
                let least =
                    if tail.writer.len == self.writer.len { tail.writer.end.saturating_add(TICK) } else { over };
                tail.writer.put_wait(to, over.max(least));
                false
            }
        };
        if tail.writer.len > Queue::<N>::BLOCK {
            return self.stop_shorter();
        }
        if more {
            return Work::More;
        }
        let rest = (tail.mover.commanded(), tail.writer);
        // Stops that follow each other have about as many segments.
        let slots = rest.1.len.saturating_sub(self.writer.len);
        self.room = Queue::<N>::BLOCK.saturating_sub(slots.saturating_add(slots >> 3)).clamp(LEAST_ROOM, Self::ROOM);
        if rest.1.len < Queue::<N>::BLOCK / 2 && self.coarse < COARSE {
            self.coarse = self.coarse.saturating_add(1);
        } else if rest.1.len < Queue::<N>::BLOCK / 8 {
            self.coarse = self.finest;
        }
        self.complete(Some(rest))
    }

    /// Starts again because the stop has too few slots: with fewer segments in it, or with fewer before it.
    fn stop_shorter(&mut self) -> Work {
        if self.coarse > COARSEST {
            self.coarse = coarser(self.coarse);
            self.close();
            return Work::More;
        }
        if self.room > LEAST_ROOM {
            self.room = (self.room / 2).max(LEAST_ROOM);
            self.forget();
            return Work::More;
        }
        self.give_up()
    }

    /// Discards a block that cannot be run: the axis comes to rest where the interrupt stops, and goes on more slowly.
    fn give_up(&mut self) -> Work {
        self.forget();
        if !self.mover.slow_down() {
            self.mover.ask_stop();
            self.news = News::None;
        }
        self.lost = true;
        Work::TooFewSlots
    }

    /// Completes the block; takes the end of its stop, if it has one.
    fn complete(&mut self, stop: Option<(i64, Writer)>) -> Work {
        let len = self.writer.len;
        if len > Queue::<N>::BLOCK {
            return self.give_up();
        }
        let (position, rest) = stop.unwrap_or((self.work.commanded(), self.writer));
        if let Some(out) = self.out.get_mut(self.block) {
            (out.len, out.position, out.rest, out.brakes) = (len, position, rest, stop.is_some());
        }
        (self.stage, self.stop) = (Stage::Ready, None);
        Work::More
    }

    /// Lets the interrupt into the block. A mere continuation waits until the interrupt is near, so that a request made
    /// meanwhile still finds room.
    fn link(&mut self, running: Option<(usize, usize)>, slot: usize) -> Work {
        if let Some((block, place)) = running {
            if slot > self.joint {
                self.miss();
                return Work::More;
            }
            let begin = self.out.get(block).map_or(0, |out| out.begin);
            let near = i128::from(self.ends(block, place)).saturating_add(begin);
            let near = near.saturating_add(i128::from(self.near()) << 32);
            if self.told == News::None && near < self.end.end {
                return Work::Later;
            }
        }
        self.queue.link(self.joint, Queue::<N>::slot(self.block, 0));
        self.stage = Stage::Linked;
        Work::More
    }
}
