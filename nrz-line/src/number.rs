/// A number of `BITS` bits, 1 to 32: a field that is not whole machine words wide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u32", into = "u32"))]
pub struct Unsigned<const BITS: u32>(u32);

/// A number that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{got} does not fit {bits} bits")]
pub struct TooWide {
    /// The number.
    pub got: u64,
    /// Bits there are.
    pub bits: u32,
}

impl<const BITS: u32> Unsigned<BITS> {
    /// The largest value, 2^BITS - 1.
    pub const MAX: Self = Self(u32::MAX >> (32_u32.saturating_sub(BITS)));

    /// `None` if `value` needs more than `BITS` bits.
    pub const fn new(value: u32) -> Option<Self> {
        if value > Self::MAX.0 { None } else { Some(Self(value)) }
    }

    /// The low `BITS` bits of `value`.
    pub const fn truncate(value: u32) -> Self {
        Self(value & Self::MAX.0)
    }

    /// The value.
    pub const fn get(self) -> u32 {
        self.0
    }
}

impl Unsigned<24> {
    /// From three bytes, the low one first.
    pub const fn from_le_bytes([low, middle, high]: [u8; 3]) -> Self {
        Self(u32::from_le_bytes([low, middle, high, 0]))
    }

    /// As three bytes, the low one first.
    pub const fn to_le_bytes(self) -> [u8; 3] {
        let [low, middle, high, _] = self.0.to_le_bytes();
        [low, middle, high]
    }
}

impl<const BITS: u32> TryFrom<u32> for Unsigned<BITS> {
    type Error = TooWide;

    fn try_from(value: u32) -> Result<Self, TooWide> {
        Self::new(value).ok_or(TooWide { got: value.into(), bits: BITS })
    }
}

impl<const BITS: u32> From<Unsigned<BITS>> for u32 {
    fn from(value: Unsigned<BITS>) -> Self {
        value.get()
    }
}

#[cfg(feature = "arbitrary")]
impl<'a, const BITS: u32> arbitrary::Arbitrary<'a> for Unsigned<BITS> {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self::truncate(from.arbitrary()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_width_has_its_edge() {
        assert_eq!(
            (Unsigned::<1>::MAX.get(), Unsigned::<24>::MAX.get(), Unsigned::<32>::MAX.get()),
            (1, 0xff_ffff, u32::MAX)
        );
        assert_eq!(Unsigned::<10>::new(1023).map(Unsigned::get), Some(1023));
        assert_eq!(Unsigned::<10>::try_from(1024), Err(TooWide { got: 1024, bits: 10 }));
        assert_eq!(Unsigned::<10>::truncate(1025).get(), 1);
    }

    #[test]
    fn three_bytes() {
        let value = Unsigned::<24>::truncate(0x12_3456);
        assert_eq!(value.to_le_bytes(), [0x56, 0x34, 0x12]);
        assert_eq!(Unsigned::<24>::from_le_bytes(value.to_le_bytes()), value);
    }
}
