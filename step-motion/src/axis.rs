//! The background half of a motion: it plans, and hands segments to the interrupt.

mod drafting;
mod standing;

use core::sync::atomic::Ordering;

use servowire_core::Direction;

use self::drafting::UNSEEN;
use crate::cutter::Demand;
use crate::error::Error;
use crate::halts::Halts;
use crate::limits::{Clock, Limits};
use crate::mover::cutting::News;
use crate::mover::planning::Planning;
use crate::mover::runner::{Runner, Wish};
use crate::queue::{NONE, Queue};
use crate::real::Real;
use crate::requests::Requests;
use crate::step_timer::StepTimer;
use crate::writer::{LONGEST, Writer, tick};

/// The work left after a call to [`Axis::poll`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Work {
    /// Call it again.
    More,
    /// Fire the interrupt now: it is stopped, and motion is ready for it.
    Start,
    /// Nothing to do until the interrupt has progressed.
    Later,
    /// The axis is at rest at its target.
    Rest,
    /// The stop after the queued motion needs more slots than the [`Queue`] has. An axis comes to rest, and goes on at half of its
    /// greatest speed from then on, until it gets [other limits](Axis::set_limits); if that is less than a step a second, it forgets its
    /// target. A path comes to rest, and forgets its lines.
    TooFewSlots,
}

/// An axis whose steps are made in an interrupt.
///
/// It takes the requests of a [`Mover`](crate::Mover) and cuts the plan into segments, ahead of the [`StepTimer`] that runs them. A
/// request takes effect between two segments already handed out: after at most twice the [reach](Self::with_reach). Only
/// [`halt`](Self::halt) takes effect at once: no step follows it. Each step is made within 3/4 of a tick of its exact time,
/// or within 25 ns if that is more. All segments handed out are followed by a stop, unless they end at rest: if
/// [`poll`](Self::poll) is not called in time, the axis stops after at most eight times the reach, or comes to rest by
/// itself within four more, and continues from there at the next call. Each step of the stop is exact to a sixteenth of an
/// interval, or as exact as all others [on request](Self::with_exact_stops).
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
    /// How far off a step may be, in moments.
    off: Real,
    /// Ticks within which half of the reaction to a request takes place.
    reach: u32,
    /// What the interrupt last reported when a slice had nothing to do, and the result of that slice.
    seen: u32,
    waits: Work,
    /// What the interrupt reported when it was last read.
    looked: u32,
    /// The position when the interrupt had counted `made` steps.
    position: i64,
    made: u32,
    /// All requests, on the plan of the block that the interrupt is in; the end of that block's steps, and the last slot of
    /// them. Each block has a single plan.
    mover: Runner,
    end: Writer,
    last: usize,
    /// The tick at which the interrupt last stood.
    stood: u64,
    news: News,
    /// The block being made, or linked, to follow: the slot that it is joined to, its plan, and the request in it.
    stage: Stage,
    block: usize,
    joint: usize,
    work: Runner,
    writer: Writer,
    until: u64,
    told: News,
    /// The plan of the block or of its stop, while it is being made.
    planning: Planning,
    /// The stop after it, while it is being cut.
    stop: Option<Tail>,
    /// Slots for the steps of a block and the exactness of its stop, adapted to the room that the previous block had; and
    /// the best exactness allowed.
    room: usize,
    coarse: u32,
    finest: u32,
    /// How many times in a row the interrupt had passed the joint before the block was ready.
    missed: u32,
    /// What was handed out in both blocks, and the ends of their slots.
    out: [Out; 2],
    marks: [Mark; N],
    /// The plan cannot be run; nothing is made until the interrupt is stopped.
    lost: bool,
    halts: Halts,
    /// The limits of the last quick stop.
    hard: Limits,
}

/// The present work of the background.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Idle,
    /// It is known where a block begins.
    Plan,
    Block,
    Stop,
    /// The block waits for the interrupt to come near.
    Ready,
    /// The interrupt will reach the block, unless it has already passed the joint.
    Linked,
}

/// What has been made of a block so far.
#[derive(Debug, Clone, Copy)]
struct Out {
    /// The start of its time, and the tick after the last step before that.
    begin: i128,
    free: u64,
    /// Slots before the stop, and the steps in them.
    len: usize,
    steps: u32,
    /// Where the stop ends, and whether there is one.
    position: i64,
    rest: Writer,
    brakes: bool,
}

impl Out {
    const NONE: Self = Self {
        begin: 0,
        free: 0,
        len: 0,
        steps: 0,
        position: 0,
        rest: Writer::new(0, Direction::Forward),
        brakes: false,
    };
}

/// Where the events of a slot end, counted from the start of its block: in 2^-32 ticks, and in steps. Time 0: nothing may
/// be joined there.
#[derive(Debug, Clone, Copy, Default)]
struct Mark {
    end: u64,
    steps: u32,
}

/// A stop while it is being cut.
#[derive(Debug)]
struct Tail {
    mover: Runner,
    /// The mover still has the motion that is to be stopped.
    moves: bool,
    demand: Demand,
    writer: Writer,
    /// Steps of the block before the stop.
    steps: u32,
}

/// How exact a stop is that runs only if the background is late: to 1/16 of an interval, or 1/4 if slots are scarce; or as
/// exact as all other steps.
pub(crate) const COARSE: u32 = 4;
pub(crate) const COARSEST: u32 = 2;
pub(crate) const EXACT: u32 = 63;

/// Returns the next coarser one.
pub(crate) const fn coarser(than: u32) -> u32 {
    if than > COARSE { COARSE } else { than.saturating_sub(1) }
}
/// The least reach, in ticks.
const LEAST: u32 = 16;

impl<'q, const N: usize> Axis<'q, N> {
    /// Creates an axis at rest at position 0, and the other end of the queue for the interrupt. A queue serves one axis.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock.
    pub fn new(queue: &'q Queue<N>, clock: Clock, limits: Limits) -> Result<(Self, StepTimer<'q, N>), Error> {
        let mover = Runner::new(clock, limits)?.cutting();
        let (work, timer) = (mover.clone(), StepTimer::new(queue));
        let axis = Self {
            queue,
            off: clock.blur(),
            reach: 0,
            seen: UNSEEN,
            waits: Work::More,
            looked: UNSEEN,
            position: 0,
            made: 0,
            mover,
            end: Writer::new(0, Direction::Forward),
            last: 0,
            stood: 0,
            news: News::None,
            stage: Stage::Idle,
            block: 0,
            joint: 0,
            work,
            writer: Writer::new(0, Direction::Forward),
            until: 0,
            told: News::None,
            planning: Planning::OVER,
            stop: None,
            room: Self::ROOM,
            coarse: COARSE,
            finest: COARSE,
            missed: 0,
            out: [Out::NONE; 2],
            marks: [Mark::default(); N],
            lost: false,
            halts: Halts::NONE,
            hard: limits,
        };
        Ok((axis.with_reach(clock.hz() / 100), timer))
    }

    /// Sets the reach in ticks, at least 16: a request takes effect after at most twice the reach. 10 ms by default.
    pub fn with_reach(self, ticks: u32) -> Self {
        Self { reach: ticks.clamp(LEAST, LONGEST >> 3), ..self }
    }

    /// Makes the stop after everything queued as exact as all other steps, if the [`Queue`] has slots for it. This takes
    /// about three times as many slots and instructions.
    pub fn with_exact_stops(self) -> Self {
        Self { coarse: EXACT, finest: EXACT, ..self }
    }

    /// Does the same as [`Mover::with_reversal_pause`](crate::Mover::with_reversal_pause). DIR changes at least half of the pause after a
    /// step, and at least half of it before the next one.
    pub fn with_reversal_pause(mut self, ticks: u32) -> Self {
        self.mover = self.mover.with_reversal_pause(ticks);
        self
    }

    /// Does the same as [`Mover::with_soft_limits`](crate::Mover::with_soft_limits).
    pub fn with_soft_limits(mut self, low: i64, high: i64) -> Self {
        self.mover = self.mover.with_soft_limits(low, high);
        self
    }

    /// Steps made so far, forward minus reverse.
    pub fn commanded(&self) -> i64 {
        #[expect(clippy::cast_possible_wrap, reason = "a difference in two's complement")]
        let since = self.queue.made.load(Ordering::Acquire).wrapping_sub(self.made) as i32;
        self.position.wrapping_add(since.into())
    }

    /// Returns whether the timer is stopped and no step is pending (or steps are on hold).
    pub fn is_at_rest(&self) -> bool {
        let (running, slot) = self.current();
        let (mover, end) = match self.stage {
            Stage::Idle => (&self.mover, &self.end),
            Stage::Linked if self.is_in(slot) => (&self.work, &self.writer),
            _ => return false,
        };
        let new = self.halts.is_pending() || self.news != News::None;
        // After a stop that nobody has asked for, the way on may still have to be planned.
        !new && running.is_none() && !mover.has_more() && mover.is_at_rest(tick(end.end))
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motor may have run on.
    pub const fn is_halted(&self) -> bool {
        self.mover.is_halted()
    }

    /// Does the same as [`Mover::move_to`](crate::Mover::move_to).
    ///
    /// # Errors
    /// The same, and [`Error::Moving`] before [`poll`](Self::poll) has seen the interrupt confirm a [`halt`](Self::halt).
    pub fn move_to(&mut self, target: i64) -> Result<(), Error> {
        self.mover.check(target)?;
        self.move_freely(target)
    }

    /// Does the same as [`Mover::run`](crate::Mover::run).
    ///
    /// # Errors
    /// The same, and [`Error::Moving`] before [`poll`](Self::poll) has seen the interrupt confirm a [`halt`](Self::halt).
    pub fn run(&mut self, direction: Direction, speed: u32) -> Result<(), Error> {
        self.run_to(direction, speed, self.mover.soft_end(direction))
    }

    /// Does the same as [`Mover::set_override`](crate::Mover::set_override).
    pub fn set_override(&mut self, percent: u16) {
        self.change(|mover| mover.ask_override(percent));
    }

    /// Does the same as [`Mover::hold`](crate::Mover::hold).
    pub fn hold(&mut self) {
        self.change(Runner::ask_hold);
    }

    /// Does the same as [`Mover::resume`](crate::Mover::resume).
    pub fn resume(&mut self) {
        self.change(Runner::ask_resume);
    }

    /// Does the same as [`Mover::stop`](crate::Mover::stop).
    pub fn stop(&mut self) {
        self.change(Runner::ask_stop);
    }

    /// Does the same as [`Mover::quick_stop`](crate::Mover::quick_stop).
    pub fn quick_stop(&mut self, limits: Limits) {
        let again = self.requests().is_quick() && limits == self.hard;
        if !again {
            self.hard = limits;
            self.mover.ask_quick_stop(limits);
            self.asked(News::Quick);
        }
    }

    /// Makes no further step from now on: the interrupt sees this without the queue. Moves are refused until the interrupt
    /// has been called once more, which [`poll`](Self::poll) asks for, and `poll` has seen it; other requests count from then on.
    pub fn halt(&mut self) {
        self.look();
        if let Some(slot) = self.queue.slots.first() {
            slot.next.store(NONE, Ordering::Relaxed);
        }
        self.halts.ask(&self.queue.halt);
        (self.stop, self.stage, self.news) = (None, Stage::Idle, News::None);
        self.stay();
        self.mover.ask_halt(self.was_moving());
        self.seen = UNSEEN;
    }

    /// Does the same as [`Mover::set_commanded`](crate::Mover::set_commanded).
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest.
    pub fn set_commanded(&mut self, steps: i64) -> Result<(), Error> {
        self.look();
        if !self.is_at_rest() {
            return Err(Error::Moving);
        }
        self.position = steps;
        self.mover.set_commanded(steps, tick(self.end.end))
    }

    /// Does the same as [`Mover::set_limits`](crate::Mover::set_limits).
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest, [`Error::SpeedAboveClock`] above half the clock.
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), Error> {
        self.look();
        if !self.is_at_rest() {
            return Err(Error::Moving);
        }
        self.mover.set_limits(limits, tick(self.end.end))
    }

    /// Moves to a target that may be outside the soft limits.
    pub(super) fn move_freely(&mut self, target: i64) -> Result<(), Error> {
        self.ready()?;
        let before = self.mover.wish();
        self.mover.ask_move(target, self.commanded())?;
        self.go_another_way(before);
        Ok(())
    }

    /// Runs to a position, if there is one.
    pub(super) fn run_to(&mut self, direction: Direction, speed: u32, end: Option<i64>) -> Result<(), Error> {
        self.ready()?;
        let before = self.mover.wish();
        self.mover.ask_run(direction, speed, end);
        self.go_another_way(before);
        Ok(())
    }

    /// Takes a new aim, unless it is the present one.
    fn go_another_way(&mut self, before: Wish) {
        if !self.mover.wish().is_as(before) {
            self.asked(News::Aim);
        }
    }

    /// Takes a request, unless it is for what is so already.
    fn change(&mut self, ask: impl FnOnce(&mut Runner)) {
        let before = self.mover.wish();
        ask(&mut self.mover);
        if !self.mover.wish().is_as(before) {
            self.asked(News::Change);
        }
    }

    pub(super) const fn requests(&self) -> Requests {
        self.mover.requests()
    }

    /// Refuses moves until a halt has been seen, and during a quick stop.
    fn ready(&mut self) -> Result<(), Error> {
        self.halts.ready()?;
        self.look();
        self.mover.ready(self.is_at_rest())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_gets_coarser_by_a_factor_of_two() {
        assert_eq!([63, 4, 3].map(coarser), [4, 3, 2]);
    }
}
