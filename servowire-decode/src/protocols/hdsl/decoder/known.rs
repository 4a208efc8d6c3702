//! What can be known about a link whose beginning was not recorded.

use hdsl::{Answer, QualityMonitor, QualityRule, VFrame};

/// Bits of a safe position on the line.
const BITS: u32 = 40;

/// The range of the safe positions so far. If the width of an encoder has not been read on the line, it is unknown: a fast
/// position beyond all safe ones may just as well have wrapped to the other end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reach {
    /// Bits of the largest non-negative position, and of the lowest negative one.
    upwards: u32,
    downwards: u32,
}

impl Reach {
    /// Returns how many bits a 40-bit position needs, and whether it is negative.
    fn size(position: u64) -> (u32, bool) {
        let unused = u64::BITS - BITS;
        let negative = position >> (BITS - 1) & 1 == 1;
        let magnitude = if negative { !position } else { position };
        (u64::BITS - (magnitude << unused >> unused).leading_zeros(), negative)
    }

    /// Takes the next safe position.
    pub(super) fn note(&mut self, safe: u64) {
        let (bits, negative) = Self::size(safe);
        // The smallest negative position has no bits: the sign itself is one.
        let (most, bits) = if negative { (&mut self.downwards, bits + 1) } else { (&mut self.upwards, bits) };
        *most = bits.max(*most);
    }

    /// Returns whether a position lies in the range of the safe ones.
    pub(super) fn holds(self, position: u64) -> bool {
        let (bits, negative) = Self::size(position);
        if negative { bits < self.downwards } else { bits <= self.upwards }
    }
}

/// The quality monitor of the receiver. Its value is known from the beginning of a link, or once it must be at its limit
/// whatever it was before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quality {
    monitor: QualityMonitor,
    known: bool,
    /// Whether this V-frame brought a penalty, and how many earlier ones did not.
    begun: u8,
    clean: u8,
}

impl Default for Quality {
    fn default() -> Self {
        Self { monitor: QualityMonitor::new(QualityRule::Sick), known: false, begun: QualityMonitor::START, clean: 0 }
    }
}

impl Quality {
    /// Each good V-frame adds two: this many lead from the minimum to the maximum.
    const LIMIT: u8 = QualityMonitor::MAX / 2;

    pub(super) fn of_a_new_link() -> Self {
        Self { known: true, ..Self::default() }
    }

    pub(super) fn count_answer(&mut self, at: u8, answer: &Answer) {
        self.monitor.count_answer(at, answer);
    }

    /// Forgets the value: the receiver may have heard more than the capture shows.
    pub(super) fn forget(&mut self) {
        (self.known, self.clean) = (false, 0);
    }

    /// Counts a completed V-frame.
    pub(super) fn count_v_frame(&mut self, frame: &VFrame) {
        self.monitor.count_v_frame(frame);
        let due = self.begun.saturating_add(2).min(QualityMonitor::MAX);
        self.clean = if self.monitor.value() == due { self.clean.saturating_add(1) } else { 0 };
        self.known |= self.clean >= Self::LIMIT;
        if self.monitor.is_lost() && !self.known {
            *self = Self::default();
        }
        self.begun = self.monitor.value();
    }

    /// Returns QM, if it is known.
    pub(super) fn value(self) -> Option<u8> {
        self.known.then(|| self.monitor.value())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_lie_where_safe_ones_have_been() {
        let mut reach = Reach::default();
        reach.note(0xff_fffe);
        assert!(reach.holds(0xff_ffff) && reach.holds(0));
        // One above: 25 bits, or a wrap to 0. One below 0: the maximum of 24 bits, or a negative position.
        assert!(!reach.holds(0x100_0000) && !reach.holds(0xff_ffff_ffff));
        reach.note(0xff_ffff_fff0);
        assert!(reach.holds(0xff_ffff_fff8) && !reach.holds(0xff_ffff_ff00));
    }
}
