//! A path that can be held, slowed down and abandoned at any time.

mod cutting;
mod places;
mod planning;

use self::places::Behind;
use self::planning::Stop;
use crate::cutter::Stretch;
use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::line::{AxisPulse, LinePulses, Steps};
use crate::path::{AxisSetup, Path};
use crate::real::Real;
use crate::requests::Requests;

/// Runs the lines of a [`Path`] and takes requests at any tick: feed hold, feed override, lines added while it moves, and a
/// new target.
///
/// Each request is a new plan along the path, from the present place, speed and acceleration: within the limits of every
/// axis, never off the line by more than half a step, and with no step lost. A motion that cannot end on the present line
/// continues along the next ones.
///
/// [`due`](Self::due) is the tick of the next step of any axis: load it into a compare timer, take the step with
/// [`pulse`](Self::pulse) when that time has come, and load the next. Load it again after a request, because it may have
/// changed. A line is planned in the call that takes the last step of the previous one, half a step before it begins; a
/// request during that time takes effect where it begins.
///
/// ```
/// use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};
/// let axis = AxisSetup::new(Limits::new(20_000, 200_000)?, 80_000);
/// let path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20)?;
/// let mut machine = PathMover::new(path);
/// machine.push([8000, 4000], 100_000, 0)?; // to 100 mm, 50 mm at 100 mm/s
/// while let Some(pulse) = machine.pulse() {
///     if machine.commanded()[0] == 2000 {
///         machine.hold(pulse.tick); // slows down along the line
///     }
/// }
/// let now = 1_000_000;
/// assert!(machine.is_at_rest(now) && machine.commanded()[0] < 4000);
/// machine.resume(now);
/// while machine.pulse().is_some() {}
/// assert_eq!(machine.commanded(), [8000, 4000]);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PathMover<const N: usize, const M: usize> {
    /// The path; its first line is the one that is running.
    path: Path<N, M>,
    /// The first line, once it has begun.
    line: Option<LinePulses<N>>,
    /// The speed at the end of its curve and the speed asked for there, how many lines the curve covers after this one, and
    /// whether it ends with one of them.
    exit: Real,
    wish: Real,
    more: usize,
    whole: bool,
    /// The limits that its curve keeps.
    bounds: Option<Bounds>,
    /// The speed that was asked for last does not fit on the rest of the present line, or is more on the next one: it is planned
    /// there. A brake that does not fit is not, or a hold would be shorter than a stop.
    late: bool,
    /// What is left of the line before the first one.
    behind: Behind<N>,
    /// Steps of the first line that have been made.
    made: [u32; N],
    commanded: [i64; N],
    /// Position of each axis where the position in its plan is 0.
    origin: [i64; N],
    /// Earliest ticks of the next steps.
    free: [u64; N],
    /// Its steps are taken in stretches; this is the rest of each axis's stretch.
    steps: Steps,
    left: [Option<Stretch>; N],
    /// DIR changes at least this many ticks before a step, or half of the axis's pause, but not before the tick of a plan.
    lead: u32,
    /// The first line has no further steps in stretches: the next one is to begin.
    ended: bool,
    /// During a stop, the path is cut off where that ends.
    requests: Requests,
    /// The present motion slows down to rest.
    braking: bool,
}

/// By hand, because the derived `clone_from` copies much of it twice.
impl<const N: usize, const M: usize> Clone for PathMover<N, M> {
    fn clone(&self) -> Self {
        Self { path: self.path.clone(), line: self.line.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        // All fields by name, so that none is forgotten.
        let Self {
            path,
            line,
            exit,
            wish,
            more,
            whole,
            bounds,
            late,
            behind,
            made,
            commanded,
            origin,
            free,
            steps,
            left,
            lead,
            ended,
            requests,
            braking,
        } = source;
        self.path.clone_from(path);
        self.line.clone_from(line);
        (self.exit, self.wish, self.more, self.whole, self.bounds) = (*exit, *wish, *more, *whole, *bounds);
        (self.made, self.commanded, self.origin) = (*made, *commanded, *origin);
        (self.free, self.steps, self.left) = (*free, *steps, *left);
        (self.ended, self.late, self.lead) = (*ended, *late, *lead);
        (self.requests, self.braking, self.behind) = (*requests, *braking, *behind);
    }
}

impl<const N: usize, const M: usize> PathMover<N, M> {
    /// Creates a mover at rest at the present end of `path`. The lines in it begin with the first request.
    pub fn new(path: Path<N, M>) -> Self {
        let position = path.origin();
        Self {
            path,
            line: None,
            exit: Real::ZERO,
            wish: Real::ZERO,
            more: 0,
            whole: true,
            bounds: None,
            late: false,
            behind: Behind::rest(position),
            made: [0; N],
            commanded: position,
            origin: position,
            free: [0; N],
            steps: Steps::Single,
            left: [None; N],
            lead: 0,
            ended: false,
            requests: Requests::NONE,
            braking: false,
        }
    }

    /// The tick of the next step; `None` if no step is to come.
    pub fn due(&self) -> Option<u64> {
        self.line.as_ref()?.first().map(|(tick, _)| tick)
    }

    /// Takes the next step.
    #[inline]
    pub fn pulse(&mut self) -> Option<AxisPulse> {
        let line = self.line.as_mut()?;
        let first = line.first()?;
        let (tick, at) = first;
        let pulse = line.pulse(first);
        line.advance(at);
        let free = tick.saturating_add(1);
        if let Some(due) = line.due.get_mut(at) {
            *due = due.map(|due| due.max(free));
        }
        if let (Some(made), Some(own), Some(position)) =
            (self.made.get_mut(at), self.free.get_mut(at), self.commanded.get_mut(at))
        {
            (*made, *own) = (made.saturating_add(1), free);
            *position = pulse.direction.advance(*position);
        }
        self.settle(tick);
        Some(pulse)
    }

    /// Steps commanded so far of each axis, forward minus reverse. This does not say whether the motors followed.
    pub const fn commanded(&self) -> [i64; N] {
        self.commanded
    }

    /// The end of the last line, in steps; after a [`stop`](Self::stop), the place where it will end.
    pub const fn target(&self) -> [i64; N] {
        self.path.target()
    }

    /// Lines in the queue, including the one that runs.
    pub const fn len(&self) -> usize {
        self.path.len()
    }

    /// Returns whether no line runs or waits.
    pub const fn is_empty(&self) -> bool {
        self.path.is_empty()
    }

    /// Returns whether no line can be pushed.
    pub const fn is_full(&self) -> bool {
        self.path.is_full()
    }

    /// Returns whether all axes are at rest at a tick with no step pending (or on hold).
    pub fn is_at_rest(&self, now: u64) -> bool {
        let over = self.line.as_ref().map_or(self.path.start().moment, LinePulses::over);
        self.due().is_none() && self.clock().moment(now) >= over
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motors may have run on.
    pub const fn is_halted(&self) -> bool {
        self.requests.is_halted()
    }

    /// Adds a line to `target` in steps, at most at `feed` in µm/s, at least 1. A running line then slows down for its end only
    /// as much as the corner requires.
    ///
    /// # Errors
    /// Those of [`Path::push`]; [`Error::Moving`] during a [`quick_stop`](Self::quick_stop).
    pub fn push(&mut self, target: [i64; N], feed: u32, now: u64) -> Result<(), Error> {
        self.ready(self.is_at_rest(now))?;
        self.path.check(&target)?;
        self.add(target, feed, now)
    }

    /// Does the same as [`Path::set_deviation`].
    pub fn set_deviation(&mut self, deviation: u32) {
        self.path.set_deviation(deviation);
    }

    /// Sets the feed override, in percent of the speeds with which the lines were pushed. The axes' limits and the speeds
    /// at corners stay unchanged, so more than 100 is faster only if those allow it. 0 holds.
    pub fn set_override(&mut self, percent: u16, now: u64) {
        self.requests.set_override(percent);
        self.replan(now);
    }

    /// Slows down to rest along the path, and keeps the remaining path (feed hold).
    pub fn hold(&mut self, now: u64) {
        self.requests.hold();
        self.replan(now);
    }

    /// Resumes after a [`hold`](Self::hold), even while it is still slowing down.
    pub fn resume(&mut self, now: u64) {
        self.requests.resume();
        self.replan(now);
    }

    /// Slows down to rest along the path and forgets the remaining path. Lines pushed from now on begin where it comes to
    /// rest.
    pub fn stop(&mut self, now: u64) {
        let stop = self.stop_from(now);
        self.stop_as(stop.as_ref(), now);
    }

    /// Slows down to rest along the path within other limits of the axes, higher ones for a limit switch, and forgets the
    /// remaining path. Lines are refused until it is at rest. Where an axis's own limits are higher, those are used: a quick
    /// stop is never longer than a [`stop`](Self::stop), even one that is already under way.
    pub fn quick_stop(&mut self, limits: [Limits; N], now: u64) {
        let plain = self.stop_from(now);
        self.requests.quick_stop();
        let Some(plain) = plain else { return self.stay(now) };
        let (rest, lines) = (self.rest_of(&plain), self.path.hurry(&limits));
        self.path.exit(self.more, self.path.part());
        let bounds = plain.left.bounds.or(self.bounds).unwrap_or(Bounds::NONE);
        let Some(stop) = self.stop_anew(now, Some(bounds)) else { return self.stay(now) };
        // Who brakes harder before a corner comes to the line after it later, which may allow more.
        let latest = self.rest_of(&stop).saturating_sub(self.clock().moment(1));
        if rest < latest || plain.end < stop.end {
            self.path.calm(lines);
            self.leave_at(&plain, now);
        } else {
            self.leave_at(&stop, now);
        }
    }

    /// Moves to a new target: slows down to rest along the path, forgets the remaining path, and goes straight to `target`
    /// from there.
    ///
    /// # Errors
    /// [`Error::SoftLimit`] outside the soft limits of an axis; [`Error::QueueFull`] if coming to rest takes all lines of a
    /// full queue;
    /// [`Error::TooManySteps`] more than 2^31 - 1 steps from there; [`Error::Moving`] during a
    /// [`quick_stop`](Self::quick_stop). All of them leave the path as it was.
    pub fn move_to(&mut self, target: [i64; N], feed: u32, now: u64) -> Result<(), Error> {
        self.path.check(&target)?;
        self.move_freely(target, feed, now)
    }

    /// Does that wherever the soft limits are.
    pub(super) fn move_freely(&mut self, target: [i64; N], feed: u32, now: u64) -> Result<(), Error> {
        self.ready(self.is_at_rest(now))?;
        self.go_to(target, feed, now)
    }

    /// Does that if it is [ready](Self::ready).
    pub(super) fn go_to(&mut self, target: [i64; N], feed: u32, now: u64) -> Result<(), Error> {
        let stop = self.stop_from(now);
        let from = stop.map_or(self.commanded, |stop| self.path.place(&self.end_of(&stop), self.begun(), self.made));
        Path::<N, M>::steps(from, target)?;
        if stop.is_some_and(|stop| stop.end.0.saturating_add(1) >= M) || M == 0 {
            return Err(Error::QueueFull);
        }
        self.stop_as(stop.as_ref(), now);
        self.add(target, feed, now)
    }

    fn add(&mut self, target: [i64; N], feed: u32, now: u64) -> Result<(), Error> {
        if let Some(line) = self.path.line_to(target, feed)? {
            self.path.add(line, target);
        }
        self.requests.go_later();
        self.look_ahead(now);
        Ok(())
    }

    /// Makes no further step and forgets the path. The positions are those of the steps made; motors at speed run on and
    /// lose them.
    pub fn halt(&mut self, now: u64) {
        let was_moving = !self.is_at_rest(now);
        self.requests.halt();
        // Whatever the caller's clock says, it is not later than the next step.
        self.stand(self.due().map_or(now, |due| now.min(due)), was_moving);
    }

    /// Sets, at rest, the step counts of the present position, for instance 0 at a reference, and forgets the remaining path.
    ///
    /// # Errors
    /// [`Error::Moving`] before it is at rest.
    pub fn set_commanded(&mut self, steps: [i64; N], now: u64) -> Result<(), Error> {
        if !self.is_at_rest(now) {
            return Err(Error::Moving);
        }
        self.rename(steps, now);
        Ok(())
    }

    /// Does that of a mover at rest.
    pub(super) fn rename(&mut self, steps: [i64; N], now: u64) {
        self.commanded = steps;
        self.leave(self.tick(now));
        self.behind = Behind::rest(steps);
    }

    pub(super) const fn clock(&self) -> Clock {
        self.path.clock()
    }

    pub(super) const fn axes(&self) -> &[AxisSetup; N] {
        self.path.axes()
    }

    /// Refuses a target outside the soft limits.
    pub(super) fn check(&self, target: &[i64; N]) -> Result<(), Error> {
        self.path.check(target)
    }

    /// Plans again if new lines allow the present one to end at another speed.
    pub(super) fn look_ahead(&mut self, now: u64) {
        if self.line.is_none() {
            return self.replan(now);
        }
        if let Some(part) = self.requests.part().filter(|part| self.path.exit(self.more, *part) != self.wish) {
            self.plan_better(now, part);
        }
    }

    /// Refuses lines during a quick stop, which ends at rest.
    pub(super) const fn ready(&self, at_rest: bool) -> Result<(), Error> {
        self.requests.ready(at_rest)
    }

    pub(super) const fn requests(&self) -> Requests {
        self.requests
    }

    /// Comes to rest as a stop does, or stays there.
    fn stop_as(&mut self, stop: Option<&Stop<N>>, now: u64) {
        self.requests.stop();
        match stop {
            Some(stop) => self.leave_at(stop, now),
            None => self.stay(now),
        }
    }

    /// Forgets the lines, if there are any, and stays at rest or where a stop comes to rest that has no more steps.
    fn stay(&mut self, now: u64) {
        if self.path.is_empty() && self.line.is_none() {
            self.requests.stopped();
        } else {
            self.leave(self.tick(now));
        }
    }

    /// Makes no further step, because of a halt.
    fn stand(&mut self, now: u64, was_moving: bool) {
        let free = self.free.iter().copied().max().unwrap_or(0);
        self.requests.halted(was_moving);
        // Not at the end of the motion before.
        let rest = self.clock().moment(self.clock().within_reach(now).max(free));
        self.stay_behind(rest);
        self.leave_from(rest);
    }

    /// Returns the tick of a request. A moving machine is somewhere between its last step and the next one, whatever the
    /// caller's clock says.
    fn tick(&self, now: u64) -> u64 {
        let last = self.last();
        let now = self.clock().within_reach(now).max(last);
        // Of an axis whose steps are cut, it is only known that the next one comes after its own last one.
        self.due().map_or(now, |due| now.min(due.max(last)))
    }

    /// The tick of the last step.
    fn last(&self) -> u64 {
        self.free.iter().copied().max().unwrap_or(0).saturating_sub(1)
    }

    /// Where the first line begins, in steps.
    fn begun(&self) -> [i64; N] {
        let mut from = self.commanded;
        if let Some(line) = &self.line {
            for ((from, made), direction) in from.iter_mut().zip(self.made).zip(line.directions) {
                let made = i64::from(made);
                *from = from.saturating_sub(if direction.dir() { made.wrapping_neg() } else { made });
            }
        }
        from
    }

    /// Empties the queue, at rest from a tick onwards.
    fn leave(&mut self, now: u64) {
        let now = self.clock().moment(now);
        self.stay_behind(now);
        self.leave_from(now.max(self.path.start().moment));
    }

    /// Does that from a moment onwards.
    fn leave_from(&mut self, moment: u64) {
        self.requests.stopped();
        self.path.clear(self.commanded, moment);
        (self.line, self.made, self.exit, self.more) = (None, [0; N], Real::ZERO, 0);
    }
}
