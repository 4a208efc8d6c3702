//! The background's half of a motion: it plans, and hands segments to the interrupt.

use core::sync::atomic::Ordering;

use servowire_core::Direction;

use crate::cutter::Demand;
use crate::error::Error;
use crate::limits::{Clock, Limits};
use crate::mover::{Cut, Mover};
use crate::queue::{IDLE, NONE, Queue, TICKET};
use crate::real::Real;
use crate::step_timer::StepTimer;
use crate::writer::{LONGEST, TICK, Writer, tick};

/// What [`Axis::poll`] has left to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Work {
    /// Call it again.
    More,
    /// Fire the interrupt now: it stands, and there is something for it.
    Start,
    /// Nothing before the interrupt has gone on.
    Later,
    /// The axis is at rest where it is to be.
    Rest,
    /// The stop from where it was to go needs more slots than the [`Queue`] has. It comes to rest.
    TooFewSlots,
}

/// An axis whose steps are made in an interrupt.
///
/// It takes the requests of a [`Mover`] and cuts what is planned into segments, a little ahead of the [`StepTimer`] that runs them. A
/// request acts where the segments that are out end: after twice the [reach](Self::with_reach) at the latest, but for
/// [`halt`](Self::halt), after which there is no step. Each step is made within 3/4 of a tick, or 25 ns where that is more, of its exact
/// time. Behind all that is out lies a stop: if [`poll`](Self::poll) is not called
/// in time the axis comes to rest, and goes on from there when it is. Each of its steps is
/// exact to a sixteenth of an interval.
///
/// ```
/// use step_motion::{Axis, Clock, Limits, Queue, Work};
/// static QUEUE: Queue<129> = Queue::new();
/// let limits = Limits::new(20_000, 200_000)?.with_jerk(4_000_000)?;
/// let (mut axis, mut timer) = Axis::new(&QUEUE, Clock::MICROSECONDS, limits)?;
/// axis.move_to(3000)?;
/// let (mut now, mut wait) = (0_u64, 0);
/// loop {
///     match axis.poll() {
///         Work::More => continue,
///         Work::Rest => break,
///         _ => {}
///     }
///     // what the timer does
///     now += u64::from(wait);
///     wait = timer.fire().wait();
/// }
/// assert_eq!(axis.commanded(), 3000);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Axis<'q, const N: usize> {
    queue: &'q Queue<N>,
    mover: Mover,
    /// How far off a step may be, in moments.
    off: Real,
    /// Ticks of motion in a block.
    reach: u32,
    writer: Writer,
    /// Steps cut so far, as the interrupt counts them.
    made: u32,
    /// The block that is filled, and where its time ends.
    block: usize,
    until: i128,
    /// The stop from the end of the block, while it is cut.
    stop: Option<Tail>,
    /// Where the next block is linked to.
    last: usize,
    /// Of both blocks, and which of them the interrupt may still come to.
    out: [Out; 2],
    busy: [bool; 2],
    /// What has been planned cannot be run; nothing is cut before the interrupt stands.
    lost: bool,
    /// The halt that the interrupt has not confirmed.
    halt: Option<u32>,
    ticket: u32,
}

/// What has been made of a block.
#[derive(Debug, Clone, Copy, Default)]
struct Out {
    /// Slots before those of the stop.
    len: usize,
    /// Where the stop ends.
    position: i64,
    end: i128,
    dir: Option<Direction>,
}

/// A stop while it is cut.
#[derive(Debug)]
struct Tail {
    mover: Mover,
    /// It is still the motion that is to be stopped.
    moves: bool,
    demand: Demand,
    writer: Writer,
}

/// How exact a stop is that is to be run only if the background starves: by parts of 16 of an interval, or of 4 where slots are few.
pub(crate) const COARSE: u32 = 4;
pub(crate) const COARSEST: u32 = 2;

impl<'q, const N: usize> Axis<'q, N> {
    /// At rest at position 0, with the other end of the queue for the interrupt. A queue has one axis.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock.
    pub fn new(queue: &'q Queue<N>, clock: Clock, limits: Limits) -> Result<(Self, StepTimer<'q, N>), Error> {
        let mover = Mover::new(clock, limits)?.cutting();
        let timer = StepTimer::new(queue);
        let off = clock.blur();
        let reach = (clock.hz() / 100).max(4);
        let axis = Self {
            queue,
            mover,
            off,
            reach,
            writer: Writer::new(0, None),
            made: 0,
            block: 0,
            until: 0,
            stop: None,
            last: 0,
            out: [Out::default(); 2],
            busy: [false; 2],
            lost: false,
            halt: None,
            ticket: 0,
        };
        Ok((axis, timer))
    }

    /// With this many ticks of motion in each half of the queue, at least 4; 10 ms by default.
    pub fn with_reach(self, ticks: u32) -> Self {
        Self { reach: ticks.clamp(4, LONGEST), ..self }
    }

    /// As [`Mover::with_reversal_pause`].
    pub fn with_reversal_pause(mut self, ticks: u32) -> Self {
        self.mover = self.mover.with_reversal_pause(ticks);
        self
    }

    /// As [`Mover::with_soft_limits`].
    pub fn with_soft_limits(mut self, low: i64, high: i64) -> Self {
        self.mover = self.mover.with_soft_limits(low, high);
        self
    }

    /// Steps made so far, forward less reverse ones.
    pub fn commanded(&self) -> i64 {
        #[expect(clippy::cast_possible_wrap, reason = "a difference in two's complement")]
        let ahead = self.made.wrapping_sub(self.queue.made.load(Ordering::Acquire)) as i32;
        self.mover.commanded().wrapping_sub(ahead.into())
    }

    /// Returns whether the timer is stopped and no step is to come (or is held back).
    pub fn is_at_rest(&self) -> bool {
        let (current, _) = self.current();
        self.halt.is_none() && self.writer.len == 0 && current.is_none() && self.mover.is_at_rest(self.now())
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motor may have run on.
    pub const fn is_halted(&self) -> bool {
        self.mover.is_halted()
    }

    /// As [`Mover::move_to`].
    ///
    /// # Errors
    /// As there; [`Error::Moving`] before the interrupt has confirmed a [`halt`](Self::halt).
    pub fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.ready()?;
        self.mover.move_to(target, self.now())
    }

    /// As [`Mover::run`].
    ///
    /// # Errors
    /// As there; [`Error::Moving`] before the interrupt has confirmed a [`halt`](Self::halt).
    pub fn run(&mut self, direction: Direction, speed: u32) -> Result<(), Error> {
        self.ready()?;
        self.mover.run(direction, speed, self.now())
    }

    /// As [`Mover::set_override`].
    pub fn set_override(&mut self, percent: u16) {
        self.mover.set_override(percent, self.now());
    }

    /// As [`Mover::hold`].
    pub fn hold(&mut self) {
        self.mover.hold(self.now());
    }

    /// As [`Mover::resume`].
    pub fn resume(&mut self) {
        self.mover.resume(self.now());
    }

    /// As [`Mover::stop`].
    pub fn stop(&mut self) {
        self.mover.stop(self.now());
    }

    /// As [`Mover::quick_stop`].
    pub fn quick_stop(&mut self, limits: Limits) {
        self.mover.quick_stop(limits, self.now());
    }

    /// No further step, from now on: the interrupt sees it without the queue. Until it has been called once more, which
    /// [`poll`](Self::poll) asks for, moves are refused.
    pub fn halt(&mut self) {
        self.ticket = self.ticket.wrapping_add(1) & (IDLE >> TICKET).wrapping_sub(1);
        self.ticket = self.ticket.max(1);
        if let Some(slot) = self.queue.slots.first() {
            slot.next.store(NONE, Ordering::Relaxed);
        }
        self.queue.halt.store(self.ticket, Ordering::Release);
        self.halt = Some(self.ticket);
        (self.stop, self.writer.len) = (None, 0);
    }

    /// As [`Mover::set_commanded`].
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest.
    pub fn set_commanded(&mut self, steps: i64) -> Result<(), Error> {
        if !self.is_at_rest() {
            return Err(Error::Moving);
        }
        self.mover.set_commanded(steps, self.now())
    }

    /// As [`Mover::set_limits`].
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest, [`Error::SpeedAboveClock`] above half the clock.
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), Error> {
        if !self.is_at_rest() {
            return Err(Error::Moving);
        }
        self.mover.set_limits(limits, self.now())
    }

    /// A slice of the background's work: a segment, a stop that is planned, or a look at the interrupt. Call it until it says
    /// other than [`Work::More`], again after each request, and every half [reach](Self::with_reach); more often where the slots of
    /// a block hold less than that.
    pub fn poll(&mut self) -> Work {
        if let Some(ticket) = self.halt {
            return self.confirm(ticket);
        }
        let (running, slot) = self.current();
        if let Some((block, place)) = Queue::<N>::place(slot) {
            if self.out.get(block).is_some_and(|out| place >= out.len) {
                // The interrupt has found nothing but the stop.
                if running.is_some() {
                    return Work::Later;
                }
                self.recover(block, slot);
            } else if block != self.block {
                self.set_busy(self.block, false);
            }
        }
        if self.lost {
            if running.is_some() {
                return Work::Later;
            }
            let position = self.commanded();
            self.made = self.queue.made.load(Ordering::Acquire);
            self.mover.rest_at(position, self.now());
            self.lost = false;
        }
        if self.busy.get(self.block) == Some(&true) {
            return self.waiting(slot);
        }
        if self.stop.is_some() { self.cut_stop() } else { self.cut(slot) }
    }

    /// Where the interrupt is: in which place of which block, or `None` if it stands; and at which slot.
    fn current(&self) -> (Option<(usize, usize)>, usize) {
        let current = self.queue.current.load(Ordering::Acquire);
        let slot = (current & 0xffff) as usize;
        (Queue::<N>::place(slot).filter(|_| current & IDLE == 0), slot)
    }

    fn set_busy(&mut self, block: usize, to: bool) {
        if let Some(busy) = self.busy.get_mut(block) {
            *busy = to;
        }
    }

    /// Nothing to cut, or no room for it.
    fn waiting(&self, slot: usize) -> Work {
        let stands = self.queue.current.load(Ordering::Acquire) & IDLE != 0;
        let more = self.queue.slots.get(slot).is_some_and(|slot| slot.next.load(Ordering::Relaxed) != NONE);
        match (stands, more) {
            (true, true) => Work::Start,
            (true, false) if self.mover.is_at_rest(self.now()) => Work::Rest,
            _ => Work::Later,
        }
    }

    /// The tick at which a request acts.
    fn now(&self) -> u64 {
        tick(self.writer.end)
    }

    fn ready(&self) -> Result<(), Error> {
        if self.halt.is_some() { Err(Error::Moving) } else { Ok(()) }
    }

    /// The interrupt stands for a halt.
    fn confirm(&mut self, ticket: u32) -> Work {
        if self.queue.current.load(Ordering::Acquire) != IDLE | ticket << TICKET {
            return Work::Start;
        }
        let position = self.commanded();
        let was_moving = position != self.mover.commanded() || !self.mover.is_at_rest(self.now());
        self.mover.halt_at(position, self.now(), was_moving);
        self.made = self.queue.made.load(Ordering::Acquire);
        (self.last, self.busy) = (0, [false; 2]);
        self.writer = Writer::new(i128::from(self.now()) << 32, None);
        self.queue.halt.store(0, Ordering::Release);
        (self.halt, self.lost) = (None, false);
        Work::More
    }

    /// From the end of the stop of a block.
    fn recover(&mut self, block: usize, slot: usize) {
        let Some(Out { position, end, dir, .. }) = self.out.get(block).copied() else { return };
        (self.writer, self.last) = (Writer::new(end, dir), slot);
        self.made = self.queue.made.load(Ordering::Acquire);
        self.mover.rest_at(position, tick(end));
        (self.block, self.stop, self.lost) = (1_usize.wrapping_sub(block), None, false);
        self.set_busy(self.block, false);
        // It stands at a slot that counts as one before the stop from now on.
        if let Some(out) = self.out.get_mut(block) {
            out.len = usize::MAX;
        }
    }

    /// A segment of the block.
    fn cut(&mut self, slot: usize) -> Work {
        let over = self.mover.over();
        if self.writer.len == 0 {
            self.until = self.writer.end.saturating_add(i128::from(self.reach) << 32);
        }
        let (until, now) = (tick(self.until), self.now());
        let full = self.writer.len.saturating_add(4) > Queue::<N>::BLOCK / 3;
        if full || self.writer.len > 0 && now >= until {
            return self.close(COARSE);
        }
        let time = until.saturating_sub(now).saturating_mul(1 << 32);
        match self.mover.cut(&Demand { off: self.off, coarse: None, time }, until) {
            Cut::Steps(stretch, direction) => {
                let steps = u32::from(stretch.count);
                self.made = self.made.wrapping_add(if direction.dir() { steps.wrapping_neg() } else { steps });
                self.writer.put_steps((self.queue, self.block), &stretch, direction);
                Work::More
            }
            Cut::Later => {
                // A step that comes right after the wait has its tick, too.
                self.writer.put_wait((self.queue, self.block), self.until.saturating_sub(2 * TICK));
                self.until = self.writer.end;
                Work::More
            }
            Cut::Rest if over > now => {
                self.writer.put_wait((self.queue, self.block), i128::from(over.saturating_add(1)) << 32);
                Work::More
            }
            Cut::Rest if self.writer.len > 0 => self.close(COARSE),
            Cut::Rest => self.waiting(slot),
        }
    }

    /// The block is as long as it is to be: what comes behind it.
    fn close(&mut self, coarse: u32) -> Work {
        if let Some(out) = self.out.get_mut(self.block) {
            out.len = self.writer.len;
        }
        let demand = Demand { off: self.off, coarse: Some(coarse), time: u64::MAX };
        self.stop = Some(Tail { mover: self.mover.clone(), moves: true, demand, writer: self.writer });
        Work::More
    }

    /// A segment of the stop behind the block.
    fn cut_stop(&mut self) -> Work {
        let Some(tail) = &mut self.stop else { return Work::More };
        if core::mem::take(&mut tail.moves) {
            tail.mover.stop(tick(tail.writer.end));
            return Work::More;
        }
        let to = (self.queue, self.block);
        let more = match tail.mover.cut(&tail.demand, u64::MAX) {
            Cut::Steps(stretch, direction) => {
                tail.writer.put_steps(to, &stretch, direction);
                true
            }
            Cut::Later | Cut::Rest => {
                tail.writer.put_wait(to, i128::from(tail.mover.over()) << 32);
                false
            }
        };
        if tail.writer.len > Queue::<N>::BLOCK {
            // Once more with fewer segments.
            match tail.demand.coarse {
                Some(coarse) if coarse > COARSEST => return self.close(coarse.saturating_sub(1)),
                _ => return self.give_up(),
            }
        }
        if !more {
            self.publish();
        }
        Work::More
    }

    /// The block cannot be run: what was cut of it is forgotten, and the axis comes to rest where the interrupt does.
    fn give_up(&mut self) -> Work {
        (self.writer.len, self.lost, self.stop) = (0, true, None);
        self.mover.stop(self.now());
        Work::TooFewSlots
    }

    fn publish(&mut self) {
        let Some(Tail { mover, writer, .. }) = &self.stop else { return };
        let len = self.writer.len;
        if let Some(out) = self.out.get_mut(self.block) {
            *out = Out { len, position: mover.commanded(), end: writer.end, dir: writer.dir };
        }
        self.queue.link(self.last, Queue::<N>::slot(self.block, 0));
        self.last = Queue::<N>::slot(self.block, len.saturating_sub(1));
        self.set_busy(self.block, true);
        (self.block, self.writer.len, self.stop) = (1_usize.wrapping_sub(self.block), 0, None);
    }
}
