//! Straight lines in several axes, one after the other.

use super::curve::Curve;
use super::limits::{Bounds, Clock, Limits};
use super::phases::Frame;
use super::plan::checked;
use super::planner::{Goal, Motion, greatest, plan};
use super::real::Real;
use super::stepper::Stepper;
use crate::axis::Direction;
use crate::error::Error;

/// An axis of a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisSetup {
    /// What it can take.
    pub limits: Limits,
    /// Steps a metre, at least 1: 80 steps/mm are 80000.
    pub steps_per_m: u32,
}

/// A line that waits.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Line<const N: usize> {
    steps: [i32; N],
    /// Length in units: steps of the finest axis.
    length: Real,
    /// Along the line, in units.
    bounds: Bounds,
    /// Greatest speed at its begin, for the corner.
    corner: Real,
}

/// A queue of up to `M` straight lines in `N` axes.
///
/// Each line has one speed profile, along it; every axis follows the line within its own limits and takes its steps where
/// the line passes k - 1/2 of them, so that no axis is ever more than half a step off. At a corner the machine keeps as
/// much speed as if it rounded it with the given deviation; there the speed of an axis jumps by design, within the
/// deviation. [`next_line`](Self::next_line) looks ahead over all lines that are in the queue: it never runs faster than lets it stop
/// at the end of the last one.
///
/// ```
/// use step_profile::motion::{AxisSetup, Clock, Limits, Path};
/// let axis = AxisSetup { limits: Limits::new(20_000, 200_000)?, steps_per_m: 80_000 };
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
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Path<const N: usize, const M: usize> {
    clock: Clock,
    axes: [AxisSetup; N],
    /// Units a metre: the steps of the finest axis.
    unit: Real,
    /// In units.
    deviation: Real,
    lines: [Option<Line<N>>; M],
    /// Number of the first line, and how many there are.
    first: usize,
    len: usize,
    /// Direction and length of the line before the next one pushed, in units.
    before: Option<([i32; N], Real)>,
    /// Where the last line ends.
    target: [i64; N],
    /// Speed at which the next line begins, in units a moment.
    speed: Real,
    moment: u64,
    /// What it begins later than that, less than half a tick.
    offset: Real,
}

impl<const N: usize, const M: usize> Path<N, M> {
    /// At rest at position 0 of all axes. `deviation` at corners in µm; 0 stops at each corner.
    ///
    /// # Errors
    /// [`Error::SpeedAboveClock`] above half the clock, [`Error::NoScale`] for an axis with 0 steps a metre.
    pub fn new(clock: Clock, axes: [AxisSetup; N], deviation: u32) -> Result<Self, Error> {
        for axis in &axes {
            checked(clock, axis.limits)?;
            if axis.steps_per_m == 0 {
                return Err(Error::NoScale);
            }
        }
        let finest = axes.iter().map(|axis| axis.steps_per_m).max().unwrap_or(1);
        let unit = Real::new(finest.into());
        Ok(Self {
            clock,
            axes,
            unit,
            deviation: unit * Real::new(deviation.into()) / Real::new(1_000_000),
            lines: [None; M],
            first: 0,
            len: 0,
            before: None,
            target: [0; N],
            speed: Real::ZERO,
            moment: 0,
            offset: Real::ZERO,
        })
    }

    /// Lines in the queue.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether the queue is empty.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether no line can be pushed.
    pub const fn is_full(&self) -> bool {
        self.len >= M
    }

    /// Where the last line ends, in steps.
    pub const fn target(&self) -> [i64; N] {
        self.target
    }

    /// Adds a line to `target` in steps, at most at `feed` in µm/s, at least 1. A line of no length adds nothing.
    ///
    /// # Errors
    /// [`Error::QueueFull`]; [`Error::TooManySteps`] for a line of more than 2^31 - 1 steps.
    pub fn push(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        if self.is_full() {
            return Err(Error::QueueFull);
        }
        let mut steps = [0; N];
        for ((to, from), step) in target.iter().zip(&self.target).zip(&mut steps) {
            let away = to.checked_sub(*from).and_then(|away| i32::try_from(away).ok()).filter(|away| *away > i32::MIN);
            *step = away.ok_or(Error::TooManySteps { steps: u32::MAX, limit: u32::MAX / 2 })?;
        }
        let length = self.length(&steps);
        if length.is_zero() {
            return Ok(());
        }
        let bounds = self.bounds(&steps, length, feed.max(1));
        let corner = match self.before {
            Some((before, long)) => self.corner((&before, long), (&steps, length), &bounds),
            None => Real::ZERO,
        };
        let place = self.first.wrapping_add(self.len).checked_rem(M).and_then(|at| self.lines.get_mut(at));
        if let Some(place) = place {
            *place = Some(Line { steps, length, bounds, corner });
            self.len = self.len.saturating_add(1);
            self.before = Some((steps, length));
            self.target = target;
        }
        Ok(())
    }

    /// Plans the first line of the queue and takes it out. It begins where and when the one before it ends; after a rest no
    /// earlier than [`not_before`](Self::not_before).
    pub fn next_line(&mut self) -> Option<LinePulses<N>> {
        let line = self.line(0)?;
        let exit = self.exit().min(greatest(self.speed, line.length, &line.bounds));
        let goal = Goal::At(line.length, exit);
        let curve = plan(Motion::steady(self.speed), goal, &line.bounds).unwrap_or_else(|_| stop(&line, self.speed));
        let pulses = LinePulses::new(self.clock, &curve, &line, (self.moment, self.offset));
        // Between lines in motion the time goes on exactly; after a rest with half a tick.
        let grid = u64::from(self.clock.grid());
        let time = self.offset + curve.time;
        let whole = time.to_fixed(0) & grid.wrapping_neg();
        self.moment = self.moment.saturating_add(whole);
        self.offset = time - Real::new(whole);
        if exit.is_zero() && !self.offset.is_zero() {
            (self.moment, self.offset) = (self.moment.saturating_add(grid), Real::ZERO);
        }
        self.speed = exit;
        if let Some(place) = self.lines.get_mut(self.first) {
            *place = None;
        }
        self.first = self.first.wrapping_add(1).checked_rem(M).unwrap_or(0);
        self.len = self.len.saturating_sub(1);
        if self.len == 0 {
            self.before = None;
        }
        Some(pulses)
    }

    /// After a rest, the next line begins no earlier than this tick.
    pub fn not_before(&mut self, tick: u64) {
        if self.speed.is_zero() {
            self.moment = self.moment.max(self.clock.moment(tick));
        }
    }

    /// Line `at` of the queue.
    fn line(&self, at: usize) -> Option<Line<N>> {
        if at >= self.len {
            return None;
        }
        let place = self.first.wrapping_add(at).checked_rem(M)?;
        self.lines.get(place).copied().flatten()
    }

    /// The speed at which the first line may end so that all that follow can slow down in time: from the last one back.
    fn exit(&self) -> Real {
        let mut speed = Real::ZERO;
        for at in (1..self.len).rev() {
            if let (Some(before), Some(line)) = (self.line(at.wrapping_sub(1)), self.line(at)) {
                let most = line.corner.min(before.bounds.v).min(line.bounds.v);
                speed = greatest(speed, line.length, &line.bounds).min(most);
            }
        }
        speed
    }

    /// How far an axis moves, in units.
    fn way(&self, axis: usize, steps: i32) -> Real {
        let scale = self.axes.get(axis).map_or(1, |axis| axis.steps_per_m);
        Real::new(steps.unsigned_abs().into()) * self.unit / Real::new(scale.into())
    }

    fn length(&self, steps: &[i32; N]) -> Real {
        let squares = steps.iter().enumerate().map(|(axis, &steps)| self.way(axis, steps).squared());
        squares.fold(Real::ZERO, |sum, square| sum + square).sqrt()
    }

    /// Along the line, what every axis can take.
    fn bounds(&self, steps: &[i32; N], length: Real, feed: u32) -> Bounds {
        let second = Real::new(self.clock.moments().into());
        let feed = self.unit * Real::new(feed.into()) / (Real::new(1_000_000) * second);
        let (mut v, mut a, mut j) = (feed, Real::HUGE, None);
        for (axis, &steps) in self.axes.iter().zip(steps).filter(|(_, steps)| **steps != 0) {
            let own = axis.limits.bounds(self.clock);
            let part = length / Real::new(steps.unsigned_abs().into());
            (v, a) = (v.min(own.v * part), a.min(own.a * part));
            if let Some(jerk) = own.jerk {
                let most = jerk.j * part;
                j = Some(j.map_or(most, |j: Real| j.min(most)));
            }
        }
        Bounds::new(v, a, j)
    }

    /// The speed at a corner: v² = a δ s / (1 - s), with s the sine of half the angle between the lines; straight on it is
    /// 1. 1 - s as (1 - s²) / (1 + s), which keeps its digits.
    fn corner(&self, (from, long): (&[i32; N], Real), (to, length): (&[i32; N], Real), bounds: &Bounds) -> Real {
        let (mut along, mut against) = (Real::ZERO, Real::ZERO);
        for (axis, (&a, &b)) in from.iter().zip(to).enumerate() {
            let product = (self.way(axis, a) / long) * (self.way(axis, b) / length);
            if (a < 0) == (b < 0) {
                along = along + product;
            } else {
                against = against + product;
            }
        }
        // Twice s², and twice 1 - s².
        let one = Real::new(1);
        let (open, shut) = ((one + along) - against, (one + against) - along);
        let straight = Real::fixed(1, 20);
        if shut < straight {
            return Real::HUGE;
        }
        if open < straight {
            return Real::ZERO;
        }
        let s = open.half().sqrt();
        (bounds.a * self.deviation * s * (one + s) / shut.half()).sqrt()
    }
}

/// What is left if rounding says that a line is too short: the whole of it at its entry speed.
fn stop<const N: usize>(line: &Line<N>, speed: Real) -> Curve {
    let mut curve = Curve::new();
    curve.cruise(speed, line.length);
    curve
}

/// A step of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisPulse {
    /// Which axis, from 0.
    pub axis: u8,
    /// Tick of the clock.
    pub tick: u64,
    /// DIR.
    pub direction: Direction,
}

/// The steps of a line, of all axes in the order of time.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinePulses<const N: usize> {
    clock: Clock,
    curve: Curve,
    axes: [(Frame, Stepper); N],
    due: [Option<u64>; N],
    directions: [Direction; N],
    end: u64,
}

impl<const N: usize> LinePulses<N> {
    fn new(clock: Clock, curve: &Curve, line: &Line<N>, (begin, offset): (u64, Real)) -> Self {
        let axes = line.steps.map(|steps| {
            let steps = steps.unsigned_abs();
            let (scale, to) = (Real::new(steps.into()) / line.length, Some(i64::from(steps) << 32));
            (Frame { to, offset, scale, ..Frame::rest(clock.shift(), begin, 0) }, Stepper::new())
        });
        let end = axes.first().map_or(begin, |(frame, _)| frame.end(curve));
        let directions = line.steps.map(|steps| Direction::from_dir(steps < 0));
        let mut new = Self { clock, curve: *curve, axes, due: [None; N], directions, end };
        for ((frame, stepper), due) in new.axes.iter_mut().zip(&mut new.due) {
            *due = stepper.next(&new.curve, frame);
        }
        new
    }

    /// Tick at which the line ends.
    pub const fn end(&self) -> u64 {
        self.clock.tick(self.end)
    }
}

impl<const N: usize> Iterator for LinePulses<N> {
    type Item = AxisPulse;

    fn next(&mut self) -> Option<AxisPulse> {
        let first = self.due.iter().enumerate().filter_map(|(axis, due)| due.map(|due| (due, axis))).min();
        let (tick, at) = first?;
        let axis = u8::try_from(at).unwrap_or(u8::MAX);
        let direction = self.directions.get(at).copied().unwrap_or_default();
        if let (Some((frame, stepper)), Some(due)) = (self.axes.get_mut(at), self.due.get_mut(at)) {
            *due = stepper.next(&self.curve, frame);
        }
        Some(AxisPulse { axis, tick, direction })
    }
}
