/// A 24-bit data field: ABS (single-turn) or ABM (multi-turn) as it comes, low byte first on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u32", into = "u32"))]
pub struct U24(u32);

/// A number above 2^24 - 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} does not fit 24 bits")]
pub struct TooWide(pub u32);

impl U24 {
    /// The largest value, 2^24 - 1.
    pub const MAX: Self = Self(0xff_ffff);

    /// `None` above 2^24 - 1.
    pub const fn new(value: u32) -> Option<Self> {
        if value > Self::MAX.0 { None } else { Some(Self(value)) }
    }

    /// The low 24 bits of `value`.
    pub const fn truncate(value: u32) -> Self {
        Self(value & Self::MAX.0)
    }

    /// The value, 0..=2^24 - 1.
    pub const fn get(self) -> u32 {
        self.0
    }

    /// From the three fields in line order.
    pub const fn from_fields(low: u8, middle: u8, high: u8) -> Self {
        Self(u32::from_le_bytes([low, middle, high, 0]))
    }

    /// The three fields in line order.
    pub const fn fields(self) -> [u8; 3] {
        let [low, middle, high, _] = self.0.to_le_bytes();
        [low, middle, high]
    }
}

impl TryFrom<u32> for U24 {
    type Error = TooWide;

    fn try_from(value: u32) -> Result<Self, TooWide> {
        Self::new(value).ok_or(TooWide(value))
    }
}

impl From<U24> for u32 {
    fn from(value: U24) -> Self {
        value.get()
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for U24 {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self::truncate(from.arbitrary()?))
    }
}
