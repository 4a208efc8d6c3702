/// Up to 64 consecutive samples of a line, the oldest in bit 0: the unit in which a
/// [`Receiver`](crate::Receiver) takes a packed capture.
///
/// The receiver takes samples from the front until a field is complete, so offer the same value again until it is
/// [empty](Self::is_empty).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Samples {
    /// The oldest sample in bit 0, with copies of the newest one above it.
    low: u32,
    high: u32,
    len: u32,
}

impl Samples {
    /// Creates a group of 64 samples, the oldest in bit 0.
    pub const fn new(word: u64) -> Self {
        Self::partial(word, 64)
    }

    /// Creates a group of the oldest `len` samples of `word`; all 64 if `len` is larger.
    #[expect(clippy::cast_possible_wrap, clippy::cast_sign_loss, reason = "copies of the top bit come in")]
    pub const fn partial(word: u64, len: u32) -> Self {
        let len = if len > 64 { 64 } else { len };
        // Up to the top and down again.
        let above = 64_u32.wrapping_sub(len);
        let word = (word.wrapping_shl(above) as i64).wrapping_shr(above) as u64;
        Self { low: (word & 0xffff_ffff) as u32, high: (word >> 32) as u32, len }
    }

    /// Number of samples that remain.
    pub const fn len(self) -> u32 {
        self.len
    }

    /// Returns whether all samples have been taken.
    pub const fn is_empty(self) -> bool {
        self.len == 0
    }

    /// Returns the oldest samples, starting at bit 0, and how many there are, at most 32.
    #[inline]
    pub(crate) const fn front(self) -> (u32, u32) {
        (self.low, if self.len < 32 { self.len } else { 32 })
    }

    /// Removes `count` samples from the front, 1 to 32.
    #[expect(clippy::cast_possible_wrap, clippy::cast_sign_loss, reason = "copies of the top bit come in")]
    #[inline]
    pub(crate) const fn skip(&mut self, count: u32) {
        self.len = self.len.wrapping_sub(count);
        if count == 32 {
            self.low = self.high;
            self.high = (self.high as i32 >> 31) as u32;
        } else {
            self.low = self.low.wrapping_shr(count) | self.high.wrapping_shl(32_u32.wrapping_sub(count));
            self.high = (self.high as i32).wrapping_shr(count) as u32;
        }
    }
}
