/// How many times and for how long the requester tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Limits {
    /// How many times a short message is sent; 0 counts as 1.
    pub short_tries: u8,
    /// Number of H-frames without an answer after which a short message is sent again.
    pub short_frames: u32,
    /// Number of H-frames without an answer after which a long message fails.
    pub long_frames: u32,
}

impl Limits {
    /// Three tries of 64 H-frames for a short message; 32000 H-frames for a long one, 369 ms free running and more
    /// than the 254 ms that a resource can state as its time-out.
    pub const DEFAULT: Self = Self { short_tries: 3, short_frames: 64, long_frames: 32_000 };

    servowire_core::builder! {
        with_short_tries: short_tries, u8;
        with_short_frames: short_frames, u32;
        with_long_frames: long_frames, u32;
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
