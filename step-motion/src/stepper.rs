//! From curves to the ticks of steps.

use crate::curve::Curve;
use crate::cutter::{Cutter, Demand, Roots, Slice, Stretch};
use crate::phases::Frame;
use crate::real::Real;

/// Makes the steps of an axis on a curve.
///
/// Step k falls into the tick nearest to the time at which the position passes k - 1/2. The times come from segments that
/// are exact to a fraction of a tick. This determines the tick of most steps; the few others are found exactly.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Stepper {
    pub(super) cutter: Cutter,
    batch: Batch,
}

/// The steps of a segment, or those beside a rest.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Batch {
    /// Steps left in the segment, those left beside a rest, and how far off their times may be.
    left: u32,
    roots: Roots,
    blur: u32,
    /// The tick of the first step, the time of the last one made since the start of that tick, and the differences to the next
    /// one.
    /// A compiler adds neighbours in one instruction, whose load then waits for the store of the one before: so the
    /// differences are not neighbours.
    interval: i64,
    first: u64,
    add: i64,
    since: u64,
    bend: i64,
}

/// Half a tick in units of time.
const HALF: i128 = 1 << 31;
/// How far off a time may be; at constant speed, and near a rest, where only rounding makes a difference.
const BLUR: u32 = 1 << 25;
const FINE: u32 = 1 << 17;

impl Stepper {
    pub(super) const fn new() -> Self {
        Self { cutter: Cutter::new(), batch: Batch::NONE }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        self.cutter.count().wrapping_sub(self.batch.left())
    }

    /// Returns the tick of the next step; `None` after the last one.
    #[inline]
    pub(super) fn next(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        match self.step(curve, frame) {
            None => self.step_after(curve, frame),
            tick => tick,
        }
    }

    /// Makes the next of the steps that are left.
    #[inline(always)]
    fn step(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        let since = self.batch.next()?;
        Some(self.due(curve, frame, since, self.batch.left()))
    }

    /// Makes the first step of the next batch.
    #[inline(never)]
    fn step_after(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        if self.begin(curve, frame) { self.step(curve, frame) } else { None }
    }

    /// Passes the ticks of all steps that are left to `f`, together with its last result.
    #[inline]
    pub(super) fn fold<B>(mut self, (curve, frame): (&Curve, &Frame), first: B, mut f: impl FnMut(B, u64) -> B) -> B {
        let mut all = first;
        loop {
            let batch = self.batch;
            all = batch.fold(all, |all, since, left| f(all, self.due(curve, frame, since, left)));
            if !self.begin(curve, frame) {
                return all;
            }
        }
    }

    /// Returns the tick of a step of the batch, from its time and the number of steps after it.
    #[inline(always)]
    fn due(&self, curve: &Curve, frame: &Frame, since: u64, left: u32) -> u64 {
        match self.batch.tick(since) {
            Some(tick) => tick,
            None => self.exact(curve, frame, since, left),
        }
    }

    /// Begins with the steps beside a rest, or with the next segment; returns false after the last one.
    #[inline(never)]
    fn begin(&mut self, curve: &Curve, frame: &Frame) -> bool {
        // Half of the tolerance is left for rounding.
        let demand = Demand { off: Real::fixed(1 << frame.shift, 8), coarse: None, time: u64::MAX, searches: 2 };
        loop {
            if let Some((begin, roots)) = self.cutter.roots() {
                self.batch = Batch::beside(begin, roots);
                return true;
            }
            match self.cutter.slice(curve, frame, &demand) {
                Slice::More => {}
                Slice::Steps(stretch) => {
                    self.batch = Batch::of(&stretch, if self.cutter.is_even() { FINE } else { BLUR });
                    return true;
                }
                Slice::End => {
                    self.batch = Batch::NONE;
                    return false;
                }
            }
        }
    }

    /// Returns the same if the time is too near to the edge of a tick to tell.
    #[cold]
    #[inline(never)]
    fn exact(&self, curve: &Curve, frame: &Frame, since: u64, left: u32) -> u64 {
        let about = (i128::from(self.batch.first) << 32).saturating_add(since.into()).saturating_sub(HALF);
        let count = self.cutter.count().wrapping_sub(left).wrapping_sub(1);
        tick(self.cutter.exact(curve, frame, (count, about)))
    }
}

impl Batch {
    const NONE: Self = Self { left: 0, roots: Roots::NONE, blur: 0, interval: 0, first: 0, add: 0, since: 0, bend: 0 };

    /// From a time, with what follows from a rest.
    fn beside(begin: i128, mut roots: Roots) -> Self {
        let (first, part) = split(begin);
        roots.base = roots.base.wrapping_add(part);
        Self { roots, blur: FINE, first, ..Self::NONE }
    }

    fn of(stretch: &Stretch, blur: u32) -> Self {
        let Stretch { count, first, differences: [interval, add, bend] } = *stretch;
        // As one step earlier.
        let add = add.wrapping_sub(bend);
        let interval = interval.wrapping_sub(add);
        let (first, part) = split(first);
        let since = part.wrapping_add_signed(interval.wrapping_neg());
        Self { left: count.into(), roots: Roots::NONE, blur, interval, first, add, since, bend }
    }

    /// How many are left.
    const fn left(&self) -> u32 {
        self.left.wrapping_add(self.roots.left())
    }

    /// Returns the time of the next step.
    #[inline(always)]
    fn next(&mut self) -> Option<u64> {
        if self.left > 0 {
            self.left = self.left.wrapping_sub(1);
            self.since = self.since.wrapping_add_signed(self.interval);
            self.interval = self.interval.wrapping_add(self.add);
            self.add = self.add.wrapping_add(self.bend);
            Some(self.since)
        } else {
            self.roots.next()
        }
    }

    /// Passes all times to `f`, each with the number of those after it.
    #[inline(always)]
    fn fold<B>(self, first: B, mut f: impl FnMut(B, u64, u32) -> B) -> B {
        let Self { left, mut roots, mut since, mut interval, mut add, bend, .. } = self;
        let mut all = first;
        for left in (0..left).rev() {
            since = since.wrapping_add_signed(interval);
            interval = interval.wrapping_add(add);
            add = add.wrapping_add(bend);
            all = f(all, since, left);
        }
        while let Some(since) = roots.next() {
            all = f(all, since, roots.left());
        }
        all
    }

    /// Returns the tick of a time; `None` if it is in doubt.
    #[inline(always)]
    const fn tick(&self, since: u64) -> Option<u64> {
        #[expect(clippy::cast_possible_truncation, reason = "the part of a tick")]
        let part = since as u32;
        if part.wrapping_add(self.blur) < self.blur << 1 { None } else { Some(self.first.wrapping_add(since >> 32)) }
    }
}

/// Returns the tick of a time, and the time since the start of that tick.
fn split(time: i128) -> (u64, u64) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the part of a tick")]
    let since = time.wrapping_add(HALF).max(0) as u32;
    (tick(time), since.into())
}

/// Returns the tick into which a time in 2^-32 ticks falls; the first or the last one of all for a time outside them.
pub(super) fn tick(time: i128) -> u64 {
    u64::try_from(time.wrapping_add(HALF) >> 32).unwrap_or(if time < 0 { 0 } else { u64::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest one, up to the half of the way to the next; and the first or the last one of all.
    #[test]
    fn the_tick_of_a_time() {
        let last = i128::from(u64::MAX);
        let times =
            [(0, 0), (HALF - 1, 0), (HALF, 1), (7 << 32, 7), (-HALF, 0), (-HALF - 1, 0), (-9 << 32, 0), (i128::MIN, 0)];
        assert_eq!(times.map(|(time, _)| tick(time)), times.map(|(_, want)| want));
        let late = [last << 32, (last << 32) + HALF, (last + 5) << 32];
        assert_eq!(late.map(tick), [u64::MAX; 3]);
    }
}
