//! Straight lines in several axes, one after another.

mod ahead;
mod corner;
mod cut;
mod passed;
mod run;

use crate::curve::{Curve, Piece};
use crate::error::Error;
use crate::limits::{Bounds, Clock, Limits};
use crate::line::{Line, LinePulses, Start, Steps};
use crate::plan::{checked, clamp};
use crate::planner::Motion;
use crate::real::Real;
use servowire_core::Direction;

pub(crate) use ahead::Ahead;
use ahead::Times;
pub(crate) use cut::{End, Leaving};
use passed::Passed;

/// An axis of a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct AxisSetup {
    /// Its limits.
    pub limits: Limits,
    /// Steps per metre, at least 1: 80 steps/mm is 80000.
    pub steps_per_m: u32,
    /// The range that no line may leave, both ends included, in steps; none by default.
    pub soft_limits: Option<(i64, i64)>,
    /// Ticks between two steps in different directions, at least; 0 by default.
    pub reversal_pause: u32,
}

impl AxisSetup {
    /// Creates an axis without soft limits or a reversal pause.
    pub const fn new(limits: Limits, steps_per_m: u32) -> Self {
        Self { limits, steps_per_m, soft_limits: None, reversal_pause: 0 }
    }

    /// Sets a range that no line may leave, both ends included, in steps, except those of a [`Homing`](crate::Homing).
    pub const fn with_soft_limits(self, low: i64, high: i64) -> Self {
        Self { soft_limits: Some((low, high)), ..self }
    }

    /// Sets the minimum number of ticks between two steps in different directions: the time that the driver and the
    /// mechanics need between a step and DIR, and between DIR and the next step. At a corner where the axis reverses, the
    /// machine slows down as far as this needs, or stops.
    pub const fn with_reversal_pause(self, ticks: u32) -> Self {
        Self { reversal_pause: ticks, ..self }
    }
}

/// How the motion continues along a line and those that follow.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Course {
    pub(super) curve: Curve,
    /// The speed at its end, and the speed that the later lines asked for there.
    pub(super) exit: Real,
    pub(super) wish: Real,
    /// It ends with a line rather than at a rest before the line's end.
    pub(super) whole: bool,
    /// Number of lines that it covers after the first one.
    pub(super) more: usize,
    /// It covers lines that allow more speed than it has there.
    pub(super) slow: bool,
}

/// A queue of up to `M` straight lines in `N` axes.
///
/// Each line has one speed profile, along it; every axis follows the line within its own limits and takes its steps where
/// the line passes k - 1/2 of them, so that no axis is ever more than half a step off. At a corner the machine keeps as
/// much speed as if it rounded it with the given deviation; there the speed of an axis jumps, by design, within the
/// deviation. [`next_line`](Self::next_line) looks ahead over all lines that are in the queue: it never runs too fast to
/// stop at the end of the last one.
///
/// ```
/// use step_motion::{AxisSetup, Clock, Limits, Path};
/// let axis = AxisSetup::new(Limits::new(20_000, 200_000)?, 80_000);
/// let mut path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20)?;
/// path.push([800, 400], 100_000)?; // 10 mm and 5 mm, at 100 mm/s
/// path.push([1600, 800], 100_000)?; // straight on: no stop
/// let mut steps = [0, 0];
/// while let Some(line) = path.next_line() {
///     for pulse in line {
///         steps[usize::from(pulse.axis)] += 1;
///     }
/// }
/// assert_eq!(steps, [1600, 800]);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Path<const N: usize, const M: usize> {
    clock: Clock,
    axes: [AxisSetup; N],
    /// Units per metre: the steps of the finest axis.
    unit: Real,
    /// In units.
    deviation: Real,
    lines: [Option<Line<N>>; M],
    /// Number of the first line, and how many there are.
    first: usize,
    len: usize,
    /// Direction and length of the line before the next one pushed, in units.
    before: Option<([i32; N], Real)>,
    /// Where the last line ends, and the last direction of each axis up to there, if it is known.
    target: [i64; N],
    ways: [Option<Direction>; N],
    /// The last direction of each axis on lines that have ended, and when they ended.
    gone: [Option<Direction>; N],
    over: u64,
    /// Speed at which the next line begins, in units per moment.
    speed: Real,
    moment: u64,
    /// How much later than that it begins, less than half a tick.
    offset: Real,
    /// The curve that continues on the first line, if there is one, and where it began; and whether it takes all lines in
    /// the queue into account.
    on: Option<(Course, Start<N>, Bounds)>,
    knows_all: bool,
    /// The line that was taken out last.
    passed: Option<Passed<N>>,
    /// The fraction of the requested speeds for which something is known of the lines ahead, and since when.
    part: Real,
    times: Times,
}

/// By hand, because the derived `clone_from` copies it twice.
impl<const N: usize, const M: usize> Clone for Path<N, M> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        *self = Self { ..*source };
    }
}

impl<const N: usize, const M: usize> Path<N, M> {
    /// Creates a path at rest at position 0 of all axes. `deviation` at corners in µm, as in
    /// [`set_deviation`](Self::set_deviation).
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock, [`Error::NoScale`] for an axis with 0 steps per metre.
    pub fn new(clock: Clock, axes: [AxisSetup; N], deviation: u32) -> Result<Self, Error> {
        for axis in &axes {
            checked(clock, axis.limits)?;
            if axis.steps_per_m == 0 {
                return Err(Error::NoScale);
            }
        }
        let finest = axes.iter().map(|axis| axis.steps_per_m).max().unwrap_or(1);
        let unit = Real::new(finest.into());
        let mut new = Self {
            clock,
            axes,
            unit,
            deviation: Real::ZERO,
            lines: [None; M],
            first: 0,
            len: 0,
            before: None,
            target: [0; N],
            ways: [Some(Direction::Forward); N],
            gone: [Some(Direction::Forward); N],
            over: 0,
            speed: Real::ZERO,
            moment: 0,
            offset: Real::ZERO,
            on: None,
            knows_all: false,
            passed: None,
            part: Real::ONE,
            times: Times::FIRST,
        };
        new.set_deviation(deviation);
        Ok(new)
    }

    /// Sets the deviation at corners in µm, for the start of lines pushed from now on; 0 stops at each corner. Lines that differ by less
    /// than 1.4 mrad count as one line whose ends are rounded to steps: the deviation there is half a step, if that is more.
    pub fn set_deviation(&mut self, deviation: u32) {
        self.deviation = self.unit * Real::new(deviation.into()) / Real::new(1_000_000);
    }

    /// Lines in the queue.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether the queue is empty.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns whether no line can be pushed.
    pub const fn is_full(&self) -> bool {
        self.len >= M
    }

    /// The end of the last line, in steps.
    pub const fn target(&self) -> [i64; N] {
        self.target
    }

    /// Adds a line to `target` in steps, at most at `feed` in µm/s, at least 1. A line of zero length adds nothing.
    ///
    /// # Errors
    /// [`Error::QueueFull`]; [`Error::SoftLimit`] outside the soft limits of an axis; [`Error::TooManySteps`] for a line of more
    /// than 2^31 - 1 steps.
    pub fn push(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        self.check(&target)?;
        if let Some(line) = self.line_to(target, feed)? {
            self.add(line, target);
        }
        Ok(())
    }

    /// Returns the line that a push would add, wherever the soft limits are; `None` for one of zero length.
    pub(super) fn line_to(&self, target: [i64; N], feed: u32) -> Result<Option<Line<N>>, Error> {
        if self.is_full() {
            return Err(Error::QueueFull);
        }
        let steps = Self::steps(self.target, target)?;
        let length = self.length(&steps);
        if length.is_zero() {
            return Ok(None);
        }
        let (bounds, feed) = self.bounds(&steps, length, feed.max(1));
        let corner = match self.before {
            Some((before, long)) => {
                self.corner((&before, long), (&steps, length)).min(self.turning((&before, long), (&steps, length)))
            }
            None => Real::ZERO,
        };
        Ok(Some(Line::new(steps, length, bounds, (feed, corner))))
    }

    /// Adds a line that leads from the present target to another one.
    pub(super) fn add(&mut self, line: Line<N>, target: [i64; N]) {
        let place = self.first.wrapping_add(self.len).checked_rem(M).and_then(|at| self.lines.get_mut(at));
        if let Some(place) = place {
            *place = Some(line);
            self.len = self.len.saturating_add(1);
            self.before = Some((line.steps, line.whole));
            self.target = target;
            self.knows_all = false;
            self.times.line_added();
            gone_along(&mut self.ways, &line.steps);
        }
    }

    /// The fraction of the requested speeds that was last asked for.
    pub(super) const fn part(&self) -> Real {
        self.part
    }

    /// Forgets what was found about the lines, and what was promised.
    pub(super) const fn forget(&mut self) {
        self.times.other_lines();
    }

    /// Returns whether another path of the same axes ends in the same way, so that the same line would be added to it.
    pub(super) fn ends_as(&self, other: &Self) -> bool {
        self.target == other.target && self.before == other.before && self.ways == other.ways && !self.is_full()
    }

    /// Plans the first line of the queue and takes it out. It begins where and when the previous one ends; after a rest no
    /// earlier than [`not_before`](Self::not_before).
    pub fn next_line(&mut self) -> Option<LinePulses<N>> {
        let line = *self.line(0)?;
        let (course, start, bounds) = match self.on.take() {
            Some(on) if self.knows_all => on,
            Some(on) => self.anew(&on).unwrap_or(on),
            None => {
                self.not_before_turning();
                let (course, bounds) = self.begin(0, self.speed, Real::ONE)?;
                (course, self.start(), bounds)
            }
        };
        self.knows_all = true;
        let mut pulses = LinePulses::new(self.clock, &course.curve, &line, start, Steps::Single);
        if course.more > 0 {
            let before = start.before + line.length;
            if let (Some(Piece { time, .. }), Some((frame, _))) = (course.curve.after(before), pulses.axes.first()) {
                pulses.left = frame.begin.saturating_add(frame.since(&course.curve, time).to_fixed(0));
            }
            self.pass();
            let rest = Course { more: course.more.saturating_sub(1), ..course };
            self.on = Some((rest, Start { before, ..start }, bounds));
        } else {
            self.finish(&course.curve, start.moment, start.offset, course.exit);
        }
        Some(pulses)
    }

    /// Plans again from the motion on a curve at the start of the first line, along lines that were added since.
    fn anew(&mut self, (old, start, bounds): &(Course, Start<N>, Bounds)) -> Option<(Course, Start<N>, Bounds)> {
        let Piece { time, v, a, up, .. } = old.curve.after(start.before)?;
        let how = (Real::ONE, Some(*bounds));
        let (course, bounds) = self.better_course(0, Motion { v, a, up }, (Real::ZERO, Real::ZERO), how)?;
        let time = start.offset + (time - old.curve.skipped.0);
        let whole = self.whole(time);
        let offset = time - Real::new(whole);
        let start = Start { before: Real::ZERO, moment: start.moment.saturating_add(whole), offset, ..*start };
        Some((course, start, bounds))
    }

    /// Rounds a time to whole units of the grid.
    fn whole(&self, time: Real) -> u64 {
        time.to_fixed(0) & u64::from(self.clock.grid()).wrapping_neg()
    }

    /// Refuses a target outside the soft limits of an axis.
    pub(super) fn check(&self, target: &[i64; N]) -> Result<(), Error> {
        for (axis, &target) in self.axes.iter().zip(target) {
            if axis.soft_limits.is_some_and(|(low, high)| target < low || target > high) {
                return Err(Error::SoftLimit { target: clamp(target) });
            }
        }
        Ok(())
    }

    /// Returns the steps of each axis from one position to another.
    pub(super) fn steps(from: [i64; N], to: [i64; N]) -> Result<[i32; N], Error> {
        let mut steps = [0; N];
        for ((to, from), step) in to.iter().zip(from).zip(&mut steps) {
            let away = to.checked_sub(from).and_then(|away| i32::try_from(away).ok()).filter(|away| *away > i32::MIN);
            *step = away.ok_or(Error::TooManySteps { steps: u32::MAX, limit: u32::MAX / 2 })?;
        }
        Ok(steps)
    }

    pub(super) const fn clock(&self) -> Clock {
        self.clock
    }

    pub(super) const fn axes(&self) -> &[AxisSetup; N] {
        &self.axes
    }

    /// Speed at which the first line begins.
    pub(super) const fn speed(&self) -> Real {
        self.speed
    }

    /// Where the first line begins, in steps.
    pub(super) fn origin(&self) -> [i64; N] {
        let mut at = self.target;
        for line in (0..self.len).filter_map(|at| self.line(at)) {
            for (at, steps) in at.iter_mut().zip(line.steps) {
                *at = at.saturating_sub(steps.into());
            }
        }
        at
    }

    /// Where and when the first line begins.
    pub(super) const fn start(&self) -> Start<N> {
        let (place, before) = (Real::ZERO, Real::ZERO);
        Start { place, before, made: [0; N], moment: self.moment, offset: self.offset, whole: true }
    }

    /// Takes out the first line, whose last curve began at a moment and an offset and ends at a speed.
    pub(super) fn finish(&mut self, curve: &Curve, moment: u64, offset: Real, exit: Real) {
        // Between lines in motion the time continues exactly; after a rest it is rounded to half a tick.
        let time = offset + (curve.time - curve.skipped.0);
        let whole = self.whole(time);
        self.moment = moment.saturating_add(whole);
        self.offset = time - Real::new(whole);
        if exit.is_zero() && !self.offset.is_zero() {
            let grid = self.clock.grid();
            (self.moment, self.offset) = (self.moment.saturating_add(grid.into()), Real::ZERO);
        }
        self.speed = exit;
        self.over = self.moment;
        self.pass();
    }

    /// Takes the first line out.
    pub(super) fn pass(&mut self) {
        if let Some(place) = self.lines.get_mut(self.first) {
            if let Some(line) = place.take() {
                self.gone = line.ways_after(self.gone);
                self.passed = Some(Passed::new(&line));
            }
        }
        self.first = self.first.wrapping_add(1).checked_rem(M).unwrap_or(0);
        self.len = self.len.saturating_sub(1);
        if self.len == 0 {
            self.before = None;
        }
    }

    /// Empties the queue, at rest at a position from a moment onwards.
    pub(super) fn clear(&mut self, position: [i64; N], moment: u64) {
        (self.lines, self.len, self.before, self.target) = ([None; M], 0, None, position);
        (self.speed, self.moment, self.offset, self.on) = (Real::ZERO, self.clock.aligned(moment), Real::ZERO, None);
        (self.over, self.gone, self.ways) = (self.moment, [None; N], [None; N]);
    }

    /// Makes the next line begin no earlier than this tick, after a rest.
    pub fn not_before(&mut self, tick: u64) {
        if self.speed.is_zero() {
            self.moment = self.moment.max(self.clock.moment(self.clock.within_reach(tick)));
        }
    }

    /// Returns which axes have to turn, or may have to, for steps after the lines that have ended.
    pub(super) fn turns(&self, steps: [i32; N]) -> [bool; N] {
        let mut turns = [false; N];
        for ((turns, steps), gone) in turns.iter_mut().zip(steps).zip(self.gone) {
            *turns = steps != 0 && gone != Some(Direction::of(steps.into()));
        }
        turns
    }

    /// After a rest, the next line begins no earlier than the pause of any axis that reverses, or may have done so.
    pub(super) fn not_before_turning(&mut self) {
        let first = self.line(0).filter(|_| self.speed.is_zero());
        let Some(all) = first.map(|line| line.steps) else { return };
        for (axis, turns) in self.axes.iter().zip(self.turns(all)) {
            if turns {
                let pause = self.clock.moment(axis.reversal_pause.into());
                self.moment = self.moment.max(self.over.saturating_add(pause));
            }
        }
    }

    /// After a rest, the next line begins no earlier than half a step after the last step of each axis, at its greatest
    /// speed: the axis may have come to rest right after that step, and the line begins at it. `free`: the ticks after
    /// these steps.
    pub(super) fn not_before_steps(&mut self, free: [u64; N]) {
        if !self.speed.is_zero() {
            return;
        }
        for (axis, free) in self.axes.iter().zip(free) {
            let half = self.clock.moments().checked_div(axis.limits.speed()).unwrap_or(0).div_ceil(2);
            if let Some(last) = free.checked_sub(1) {
                let begin = self.clock.moment(last).saturating_add(half.into());
                self.moment = self.moment.max(self.clock.aligned(begin));
            }
        }
    }

    /// After a rest, the next line begins no earlier than a moment.
    pub(super) fn not_before_moment(&mut self, moment: u64) {
        if self.speed.is_zero() && moment > self.moment {
            self.moment = self.clock.aligned(moment);
        }
    }

    /// Returns line `at` of the queue.
    pub(super) fn line(&self, at: usize) -> Option<&Line<N>> {
        if at >= self.len {
            return None;
        }
        let place = self.first.wrapping_add(at);
        self.lines.get(if place < M { place } else { place.wrapping_sub(M) })?.as_ref()
    }
}

/// Updates the last direction of each axis after a line.
fn gone_along<const N: usize>(ways: &mut [Option<Direction>; N], steps: &[i32; N]) {
    for (way, &steps) in ways.iter_mut().zip(steps).filter(|(_, steps)| **steps != 0) {
        *way = Some(Direction::of(steps.into()));
    }
}
