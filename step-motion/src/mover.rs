//! An axis that accepts a new request at any time.

pub(super) mod cutting;
mod places;
pub(super) mod planning;
pub(super) mod runner;

use crate::error::Error;
use crate::limits::{Clock, Limits};
use crate::phases::Phases;
use crate::requests::Requests;
use servowire_core::Direction;

use self::places::Behind;
use self::planning::{Begin, Planning};
use self::runner::{Runner, Wish};

/// A step: its time and direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pulse {
    /// Tick of the clock.
    pub tick: u64,
    /// DIR; it changes only at a standstill.
    pub direction: Direction,
}

/// An axis whose target, speed and override may change at any tick.
///
/// Each request is a new plan from the present state: position, speed and, with a jerk limit, acceleration continue without
/// a jump. A target that can no longer be reached in this direction is reached by a stop and a move back; the position is
/// kept throughout.
///
/// [`due`](Self::due) is the tick of the next step: load it into a compare timer, take the step with [`pulse`](Self::pulse)
/// when that time has come, and load the next. Load it again after a request, because it may have changed.
///
/// ```
/// use step_motion::{Clock, Limits, Mover};
/// let mut x = Mover::new(Clock::MICROSECONDS, Limits::new(20_000, 100_000)?)?;
/// x.move_to(3000, 0)?;
/// while let Some(pulse) = x.pulse() {
///     if x.commanded() == 1000 {
///         x.move_to(-50, pulse.tick)?; // it stops, and comes back
///     }
/// }
/// assert_eq!(x.commanded(), -50);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mover {
    runner: Runner,
    behind: Behind,
}

impl Mover {
    /// Creates an axis at rest at position 0.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock.
    pub fn new(clock: Clock, limits: Limits) -> Result<Self, Error> {
        let runner = Runner::new(clock, limits)?;
        Ok(Self { behind: Behind::new(&runner), runner })
    }

    /// Sets a rest before each change of direction, in ticks: the time that the driver and the mechanics need between a
    /// step and DIR, and between DIR and the next step. It is kept after a [`halt`](Self::halt) too.
    pub const fn with_reversal_pause(self, ticks: u32) -> Self {
        Self { runner: self.runner.with_reversal_pause(ticks), ..self }
    }

    /// Sets a range that no target may leave, both ends included, except those of a [`Homing`](crate::Homing); [`run`](Self::run) stops at
    /// its end.
    pub const fn with_soft_limits(self, low: i64, high: i64) -> Self {
        Self { runner: self.runner.with_soft_limits(low, high), ..self }
    }

    /// The tick of the next step; `None` if no step is to come.
    pub const fn due(&self) -> Option<u64> {
        self.runner.due
    }

    /// Takes the next step.
    #[inline]
    pub fn pulse(&mut self) -> Option<Pulse> {
        let own = &mut self.runner;
        let tick = own.due?;
        let pulse = Pulse { tick, direction: own.direction };
        own.commanded = own.direction.advance(own.commanded);
        own.free = tick.saturating_add(1);
        (own.turn, own.dir) = (None, Some(own.direction));
        let Phases { curve, frame } = &own.phases;
        own.due = own.stepper.next(curve, frame).map(|due| due.max(own.free));
        own.due = own.due.filter(|due| own.clock.is_in_time(*due));
        if own.due.is_none() {
            self.follow(self.runner.go_on());
        } else if frame.endless && own.stepper.count() >= 1 << 30 {
            self.replan(self.runner.clock.moment(tick));
        }
        Some(pulse)
    }

    /// Steps commanded so far, forward minus reverse. This does not say whether the motor followed.
    pub const fn commanded(&self) -> i64 {
        self.runner.commanded
    }

    /// DIR of the next step, or of the last one at rest.
    pub const fn direction(&self) -> Direction {
        self.runner.direction
    }

    /// The tick at which DIR is to be switched to [`direction`](Self::direction): in the middle of the
    /// [pause](Self::with_reversal_pause), which ends where the motion begins, so that the driver has at least half of the pause before
    /// the edge and half after it. It is between the steps on either side without a pause too, and it is never before the request that
    /// has changed it: whatever is asked for then, the first step comes no earlier than the pause allows.
    /// `None` if DIR has not changed since the last step, and is not to change.
    pub const fn turn(&self) -> Option<u64> {
        self.runner.turn
    }

    /// Returns whether the axis is at rest at a tick with no step pending (or on hold).
    pub fn is_at_rest(&self, now: u64) -> bool {
        self.runner.is_at_rest(now)
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motor may have run on.
    pub const fn is_halted(&self) -> bool {
        self.runner.is_halted()
    }

    /// Moves to a position, from rest or from any motion.
    ///
    /// # Errors
    /// [`Error::SoftLimit`] outside the soft limits, [`Error::Moving`] during a [`quick_stop`](Self::quick_stop),
    /// [`Error::TooManySteps`] more than 2^31 - 1 steps away.
    pub fn move_to(&mut self, target: i64, now: u64) -> Result<(), Error> {
        self.runner.check(target)?;
        self.move_freely(target, now)
    }

    /// Runs at a speed in steps/s until another request or to the soft limit, or the last position that an `i64` has; the speed is at most
    /// the greatest one. 0 stops. On the way to a soft limit it comes to rest for a moment every 2^31 - 1 steps.
    ///
    /// # Errors
    /// [`Error::Moving`] during a [`quick_stop`](Self::quick_stop).
    pub fn run(&mut self, direction: Direction, speed: u32, now: u64) -> Result<(), Error> {
        self.run_to(direction, speed, self.runner.soft_end(direction), now)
    }

    /// Sets the feed override, in percent of the greatest speed (or of that of [`run`](Self::run)); values above 100 count
    /// as 100. 0 holds.
    pub fn set_override(&mut self, percent: u16, now: u64) {
        self.request(now, |runner| runner.ask_override(percent));
    }

    /// Slows down to rest and keeps the target (feed hold).
    pub fn hold(&mut self, now: u64) {
        self.request(now, Runner::ask_hold);
    }

    /// Resumes after a [`hold`](Self::hold), even while it is still slowing down.
    pub fn resume(&mut self, now: u64) {
        self.request(now, Runner::ask_resume);
    }

    /// Slows down to rest and forgets the target.
    pub fn stop(&mut self, now: u64) {
        self.request(now, Runner::ask_stop);
    }

    /// Slows down to rest within other limits, for example higher ones for a limit switch, and forgets the target. Moves
    /// are refused until it is at rest. Its own limits, or those of a quick stop in progress, are used where they are
    /// higher: a quick stop is never longer than a normal one.
    pub fn quick_stop(&mut self, limits: Limits, now: u64) {
        self.runner.ask_quick_stop(limits);
        self.follow(self.runner.stop_quickly(now));
    }

    /// Makes no further step. The position is that of the steps made; a motor at speed runs on and loses it.
    pub fn halt(&mut self, now: u64) {
        let was_moving = !self.is_at_rest(now);
        self.stay_behind(now);
        self.runner.ask_halt(was_moving);
        // Whatever the caller's clock says, it is not later than the next step.
        self.runner.stand(self.runner.due.map_or(now, |due| now.min(due)), was_moving);
    }

    /// Sets, at rest, the step count of the present position, for instance 0 at a reference, and forgets the target, on hold too.
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest.
    pub fn set_commanded(&mut self, steps: i64, now: u64) -> Result<(), Error> {
        let (behind, before) = (self.left_behind(), self.commanded());
        self.runner.set_commanded(steps, now)?;
        self.behind = behind.renumbered(steps.wrapping_sub(before));
        Ok(())
    }

    /// Sets other limits, at rest.
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest, [`Error::SpeedAboveClock`] above half the clock.
    pub fn set_limits(&mut self, limits: Limits, now: u64) -> Result<(), Error> {
        let behind = self.left_behind();
        self.runner.set_limits(limits, now)?;
        self.behind = behind;
        Ok(())
    }

    /// The limits.
    pub const fn limits(&self) -> Limits {
        self.runner.limits
    }

    pub(super) const fn requests(&self) -> Requests {
        self.runner.requests()
    }

    /// Moves to a target that may be outside the soft limits.
    pub(super) fn move_freely(&mut self, target: i64, now: u64) -> Result<(), Error> {
        self.runner.ready(self.is_at_rest(now))?;
        let before = self.runner.wish();
        self.runner.ask_move(target, self.commanded())?;
        self.go_another_way(before, now);
        Ok(())
    }

    /// Runs to a position, if there is one.
    pub(super) fn run_to(&mut self, direction: Direction, speed: u32, end: Option<i64>, now: u64) -> Result<(), Error> {
        self.runner.ready(self.is_at_rest(now))?;
        let before = self.runner.wish();
        self.runner.ask_run(direction, speed, end);
        self.go_another_way(before, now);
        Ok(())
    }

    /// Plans what has been asked for, if it is not so already.
    fn go_another_way(&mut self, before: Wish, now: u64) {
        if !self.runner.wish().is_as(before) {
            self.replan(self.runner.moment(now));
        }
    }

    /// Takes a request, unless it is for what is so already.
    fn request(&mut self, now: u64, ask: impl FnOnce(&mut Runner)) {
        let before = self.runner.wish();
        ask(&mut self.runner);
        if !self.runner.wish().is_as(before) {
            self.follow(self.runner.change(now));
        }
    }

    /// Plans from a moment to the aim.
    fn replan(&mut self, moment: u64) {
        self.follow(Some(self.runner.from(moment)));
    }

    /// Plans to the end.
    fn follow(&mut self, begin: Option<Begin>) {
        if let Some(begin) = begin {
            let mut planning = Planning::OVER;
            planning.begin(begin);
            while self.plan(&mut planning) {}
        }
    }
}
