//! What can be known of a link whose beginning was not recorded.

use hdsl::{Answer, QualityMonitor, QualityRule, VFrame};

/// Bits of a safe position on the line.
const BITS: u32 = 40;

/// How far safe positions reached. The width of an encoder that was not asked for it is not known: where the fast position goes
/// further than any safe one, it may as well have begun again at the other end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reach {
    /// Bits of the largest position without a sign, and of the smallest one with it.
    upwards: u32,
    downwards: u32,
}

impl Reach {
    /// Bits of a position of 40 bits, and whether it has a sign.
    fn size(position: u64) -> (u32, bool) {
        let unused = u64::BITS - BITS;
        let negative = position >> (BITS - 1) & 1 == 1;
        let magnitude = if negative { !position } else { position };
        (u64::BITS - (magnitude << unused >> unused).leading_zeros(), negative)
    }

    /// The next safe position.
    pub(super) fn note(&mut self, safe: u64) {
        let (bits, negative) = Self::size(safe);
        // The smallest negative position has no bits: the sign itself is one.
        let (most, bits) = if negative { (&mut self.downwards, bits + 1) } else { (&mut self.upwards, bits) };
        *most = bits.max(*most);
    }

    /// Whether a position lies where safe ones have been.
    pub(super) fn holds(self, position: u64) -> bool {
        let (bits, negative) = Self::size(position);
        if negative { bits < self.downwards } else { bits <= self.upwards }
    }
}

/// The quality monitor of the receiver, whose value is known from the beginning of a link on, or once it must be at its limit
/// whatever it was.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quality {
    monitor: QualityMonitor,
    known: bool,
    /// Whether this V-frame brought a penalty, and how many before it did not.
    begun: u8,
    clean: u8,
}

impl Default for Quality {
    fn default() -> Self {
        Self { monitor: QualityMonitor::new(QualityRule::Sick), known: false, begun: QualityMonitor::START, clean: 0 }
    }
}

impl Quality {
    /// Each good V-frame adds two: from the least to the most.
    const LIMIT: u8 = QualityMonitor::MAX / 2;

    pub(super) fn of_a_new_link() -> Self {
        Self { known: true, ..Self::default() }
    }

    pub(super) fn count_answer(&mut self, at: u8, answer: &Answer) {
        self.monitor.count_answer(at, answer);
    }

    /// The receiver may have heard more than the capture shows.
    pub(super) fn forget(&mut self) {
        (self.known, self.clean) = (false, 0);
    }

    /// The V-frame is over.
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

    /// QM, if it is known.
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
        // One more: 25 bits, or 0 again. One below 0: the top of 24 bits, or a sign.
        assert!(!reach.holds(0x100_0000) && !reach.holds(0xff_ffff_ffff));
        reach.note(0xff_ffff_fff0);
        assert!(reach.holds(0xff_ffff_fff8) && !reach.holds(0xff_ffff_ff00));
    }
}
