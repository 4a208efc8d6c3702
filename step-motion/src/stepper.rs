//! From curves to the ticks of steps.

use crate::curve::Curve;
use crate::cutter::{Cutter, Demand, Slice, Stretch};
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
    /// Steps left in the segment, and how far off their times may be.
    left: u32,
    blur: u32,
    /// The tick of its first step, the time of the last one made since the start of that tick, and the differences from there.
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
const BLUR: u32 = 1 << 26;
const FINE: u32 = 1 << 17;

impl Stepper {
    pub(super) const fn new() -> Self {
        Self { cutter: Cutter::new(), left: 0, blur: BLUR, interval: 0, first: 0, add: 0, since: 0, bend: 0 }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        self.cutter.count().wrapping_sub(self.left)
    }

    /// Returns the tick of the next step; `None` after the last one.
    #[inline]
    pub(super) fn next(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        if self.left == 0 {
            return self.begin(curve, frame);
        }
        self.since = self.since.wrapping_add_signed(self.interval);
        self.interval = self.interval.wrapping_add(self.add);
        self.add = self.add.wrapping_add(self.bend);
        self.left = self.left.wrapping_sub(1);
        Some(self.tick())
    }

    /// Returns the tick of a step that is known by itself, or of the first step of the next segment.
    #[inline(never)]
    fn begin(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        let first = match self.known() {
            Some(first) => first,
            None => self.segment(curve, frame)?,
        };
        self.first = tick(first);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the part of a tick")]
        let since = first.wrapping_add(HALF).max(0) as u32;
        self.since = since.into();
        Some(self.tick())
    }

    fn known(&mut self) -> Option<i128> {
        self.blur = FINE;
        self.cutter.known()
    }

    /// Begins the next segment, unless there is a step that is known.
    #[inline(never)]
    fn segment(&mut self, curve: &Curve, frame: &Frame) -> Option<i128> {
        // Half of the tolerance is left for rounding.
        let demand = Demand { off: Real::fixed(1 << frame.shift, 7), coarse: None, time: u64::MAX };
        loop {
            match self.cutter.slice(curve, frame, &demand) {
                Slice::More => {}
                Slice::Steps(Stretch { count, first, differences }) => {
                    self.left = u32::from(count).saturating_sub(1);
                    [self.interval, self.add, self.bend] = differences;
                    self.blur = if self.cutter.is_even() { FINE } else { BLUR };
                    return Some(first);
                }
                Slice::End => return None,
            }
            if let Some(first) = self.known() {
                return Some(first);
            }
        }
    }

    /// Returns the tick of the present step.
    #[inline]
    fn tick(&self) -> u64 {
        #[expect(clippy::cast_possible_truncation, reason = "the part of a tick")]
        let part = self.since as u32;
        if part.wrapping_add(self.blur) < self.blur << 1 {
            return self.exact();
        }
        self.first.wrapping_add(self.since >> 32)
    }

    /// Returns the same if it is in doubt.
    #[cold]
    #[inline(never)]
    fn exact(&self) -> u64 {
        let about = (i128::from(self.first) << 32).saturating_add(self.since.into()).saturating_sub(HALF);
        tick(self.cutter.exact(self.count().wrapping_sub(1), Some(about)))
    }
}

/// Returns the tick into which a time in 2^-32 ticks falls.
pub(super) fn tick(time: i128) -> u64 {
    u64::try_from(time.wrapping_add(HALF) >> 32).unwrap_or(0)
}
