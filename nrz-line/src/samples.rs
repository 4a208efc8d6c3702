/// Up to 64 consecutive samples of a line, the oldest in bit 0: the unit in which a
/// [`Receiver`](crate::Receiver) takes a packed capture.
///
/// The receiver takes samples away from the front until a field is complete, so the same value is
/// offered again until it is [empty](Self::is_empty).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Samples {
    bits: u64,
    len: u32,
}

impl Samples {
    /// 64 samples, the oldest in bit 0.
    pub const fn new(word: u64) -> Self {
        Self { bits: word, len: 64 }
    }

    /// The oldest `len` samples of `word`; all 64 where `len` is larger.
    pub const fn partial(word: u64, len: u32) -> Self {
        Self { bits: word, len: if len > 64 { 64 } else { len } }
    }

    /// Samples that are left.
    pub const fn len(self) -> u32 {
        self.len
    }

    /// Whether all samples were taken.
    pub const fn is_empty(self) -> bool {
        self.len == 0
    }

    /// The level of the oldest sample and how many samples it lasts here, at most `len`.
    pub(crate) const fn front_run(self) -> (bool, u32) {
        let level = self.bits & 1 == 1;
        let changed = if level { !self.bits } else { self.bits };
        let run = changed.trailing_zeros();
        (level, if run < self.len { run } else { self.len })
    }

    /// Takes `count` samples off the front.
    pub(crate) const fn skip(&mut self, count: u32) {
        self.bits = match self.bits.checked_shr(count) {
            Some(rest) => rest,
            None => 0,
        };
        self.len = self.len.saturating_sub(count);
    }
}
