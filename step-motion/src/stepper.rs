//! From curves to the ticks of steps.

use crate::curve::Curve;
use crate::cutter::{Cutter, Demand, Stretch};
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
    /// Steps left in the segment, the time of the last one made, and the differences from there.
    left: u32,
    time: i128,
    differences: [i64; 3],
}

/// A tick in units of time, and how far off a time may be.
const TICK: i128 = 1 << 32;
const BLUR: u32 = 1 << 26;

impl Stepper {
    pub(super) const fn new() -> Self {
        Self { cutter: Cutter::new(), left: 0, time: 0, differences: [0; 3] }
    }

    /// Steps made, counted from the origin of the positions.
    pub(super) const fn count(&self) -> u32 {
        self.cutter.count().wrapping_sub(self.left)
    }

    /// Returns the tick of the next step; `None` after the last one.
    #[inline]
    pub(super) fn next(&mut self, curve: &Curve, frame: &Frame) -> Option<u64> {
        if self.left == 0 {
            // Half of the tolerance is left for rounding.
            let tick = Real::fixed(1 << frame.shift, 7);
            let Stretch { count, first, differences } =
                self.cutter.next(curve, frame, &Demand { off: tick, coarse: None, time: u64::MAX })?;
            (self.left, self.time, self.differences) = (count.into(), first, differences);
        } else {
            let [interval, add, bend] = self.differences;
            self.time = self.time.wrapping_add(interval.into());
            self.differences = [interval.wrapping_add(add), add.wrapping_add(bend), bend];
        }
        self.left = self.left.wrapping_sub(1);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the part of a tick")]
        let part = self.time.wrapping_add(TICK / 2) as u32;
        if part.wrapping_add(BLUR) < 2 * BLUR {
            return Some(tick(self.cutter.exact(self.count().wrapping_sub(1))));
        }
        Some(tick(self.time))
    }
}

/// Returns the tick into which a time in 2^-32 ticks falls.
pub(super) fn tick(time: i128) -> u64 {
    u64::try_from(time.wrapping_add(TICK / 2) >> 32).unwrap_or(0)
}
