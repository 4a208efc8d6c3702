/// Numbers without a pattern, the same in every run (xorshift): for tests that choose among more than faults of a line.
#[derive(Debug, Clone, Copy)]
pub struct Draw(u64);

impl Default for Draw {
    fn default() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }
}

impl Draw {
    /// Another stream for each seed; that of 0 is the usual one.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        // SplitMix64: neighbouring seeds give states that have nothing in common.
        let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        let Self(usual) = Self::default();
        // A state of zeros would stay so.
        Self(Some(usual ^ z ^ z >> 31).filter(|state| *state != 0).unwrap_or(usual))
    }

    /// A number from 0 to less than `limit`.
    pub fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) % limit
    }
}
