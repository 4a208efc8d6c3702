//! From curves to the ticks of steps.

use crate::curve::Curve;
use crate::cutter::{Cutter, Demand, Roots, Slice, Stretch};
use crate::phases::Frame;
use crate::real::Real;

/// Makes the steps of an axis on a curve, one at a time.
///
/// Step k falls into the tick nearest to the time at which the position passes k - 1/2. The times come from segments that
/// are exact to a fraction of a tick. This determines the tick of most steps; the few others are found exactly.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Stepper {
    pub(super) cutter: Cutter,
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
        let (cutter, roots) = (Cutter::new(), Roots::NONE);
        Self { cutter, left: 0, roots, blur: BLUR, interval: 0, first: 0, add: 0, since: 0, bend: 0 }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        #[expect(clippy::cast_possible_truncation, reason = "as many as in a table")]
        let roots = self.roots.left() as u32;
        self.cutter.count().wrapping_sub(self.left).wrapping_sub(roots)
    }

    /// Returns the tick of the next step; `None` after the last one.
    #[inline]
    pub(super) fn next(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        match self.step(curve, frame) {
            None => self.begin(curve, frame),
            tick => tick,
        }
    }

    /// Makes the next of the steps that are left.
    #[inline(always)]
    fn step(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        if self.left > 0 {
            self.left = self.left.wrapping_sub(1);
            self.since = self.since.wrapping_add_signed(self.interval);
            self.interval = self.interval.wrapping_add(self.add);
            self.add = self.add.wrapping_add(self.bend);
        } else {
            self.since = self.roots.next()?;
        }
        #[expect(clippy::cast_possible_truncation, reason = "the part of a tick")]
        let part = self.since as u32;
        if part.wrapping_add(self.blur) < self.blur << 1 {
            return Some(self.exact(curve, frame));
        }
        Some(self.first.wrapping_add(self.since >> 32))
    }

    /// Begins with the steps beside a rest, or with the next segment, and makes the first step of them.
    #[inline(never)]
    fn begin(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        // Half of the tolerance is left for rounding.
        let demand = Demand { off: Real::fixed(1 << frame.shift, 8), coarse: None, time: u64::MAX };
        loop {
            if let Some((begin, roots)) = self.cutter.roots() {
                (self.blur, self.roots) = (FINE, roots);
                self.roots.base = self.roots.base.wrapping_add(self.begin_at(begin));
                return self.step(curve, frame);
            }
            match self.cutter.slice(curve, frame, &demand) {
                Slice::More => {}
                Slice::Steps(Stretch { count, first, differences }) => {
                    self.left = count.into();
                    // As one step earlier.
                    let [interval, add, bend] = differences;
                    (self.add, self.bend) = (add.wrapping_sub(bend), bend);
                    self.interval = interval.wrapping_sub(self.add);
                    self.blur = if self.cutter.is_even() { FINE } else { BLUR };
                    self.since = self.begin_at(first).wrapping_add_signed(self.interval.wrapping_neg());
                    return self.step(curve, frame);
                }
                Slice::End => return None,
            }
        }
    }

    /// Counts from the tick of a time; returns the time since the start of that tick.
    fn begin_at(&mut self, first: i128) -> u64 {
        self.first = tick(first);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the part of a tick")]
        let since = first.wrapping_add(HALF).max(0) as u32;
        since.into()
    }

    /// Returns the tick of the present step if it is in doubt.
    #[cold]
    #[inline(never)]
    fn exact(&self, curve: &Curve, frame: &Frame) -> u64 {
        let about = (i128::from(self.first) << 32).saturating_add(self.since.into()).saturating_sub(HALF);
        let count = self.count().wrapping_sub(1);
        tick(self.cutter.exact(curve, frame, (count, about)))
    }
}

/// Returns the tick into which a time in 2^-32 ticks falls.
pub(super) fn tick(time: i128) -> u64 {
    u64::try_from(time.wrapping_add(HALF) >> 32).unwrap_or(0)
}
