use servowire_core::{OutOfRange, U24, number};

number! {
    /// The 10 bits of a temperature.
    pub struct U10(u16, 10);
}

number! {
    /// The 17 bits of ABS17.
    pub struct U17(u32, 17);
}

number! {
    /// The 19 bits of the velocity coefficient.
    pub struct U19(u32, 19);
}

number! {
    /// The 40 bits of ABS40: the single-turn position in the low bits, the turns above it.
    // Aligned as the other fields of a response, which is a quarter smaller by that.
    #[repr(Rust, packed(4))]
    pub struct U40(u64, 40);
}

number! {
    /// EA, the address of an encoder on the bus, 0..=7. Vendor tools call these ENC1 to ENC8.
    pub struct EncoderAddress(u8, 3);
}

number! {
    /// The identification code of an encoder, 24 bits, which commands 16 to 20 read, write or use to choose an encoder.
    pub struct EncoderId(u32, 24);
}

impl U40 {
    /// Creates the number from five bytes, the lowest first.
    #[inline(always)]
    pub(crate) const fn from_le_bytes([a, b, c, d, e]: [u8; 5]) -> Self {
        Self::truncate(u64::from_le_bytes([a, b, c, d, e, 0, 0, 0]))
    }

    /// Bits 0..=23, which ABS24 responses carry.
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
    pub const fn low24(self) -> U24 {
        U24::truncate(self.get() as u32)
    }

    /// Bits 16..=39, which the upper ABS24 responses carry.
    #[expect(clippy::cast_possible_truncation, reason = "24 bits are left")]
    pub const fn high24(self) -> U24 {
        U24::truncate((self.get() >> 16) as u32)
    }

    /// Bits 0..=16, which ABS17 responses carry.
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
    pub const fn low17(self) -> U17 {
        U17::truncate(self.get() as u32)
    }

    /// Joins the two 24-bit halves, if their common bits 16..=23 agree.
    ///
    /// The halves come from two responses; at speed the position moves in between, and the common bits may differ.
    ///
    /// ```
    /// use nikon_aformat::U40;
    /// let abs = U40::truncate(0x38_2448_0000);
    /// assert_eq!(U40::from_halves(abs.low24(), abs.high24()), Some(abs));
    /// ```
    pub const fn from_halves(low: U24, high: U24) -> Option<Self> {
        if low.get() >> 16 != high.get() & 0xff {
            return None;
        }
        Some(Self::truncate((high.get() as u64) << 16 | (low.get() & 0xffff) as u64))
    }
}

impl EncoderAddress {
    /// All eight.
    pub const ALL: [Self; 8] = [
        Self::truncate(0),
        Self::truncate(1),
        Self::truncate(2),
        Self::truncate(3),
        Self::truncate(4),
        Self::truncate(5),
        Self::truncate(6),
        Self::truncate(7),
    ];

    /// Address 0, the factory setting of a single encoder.
    pub const ZERO: Self = Self::truncate(0);
}

/// An EEPROM address that a request without a bank may write, 0x00..=0xef.
///
/// All 256 can be read. The last sixteen hold the maker's data, among them the
/// [type word](crate::TypeWord) and the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
pub struct UserAddress(u8);

impl UserAddress {
    /// The highest address that can be written.
    pub const MAX: Self = Self(0xef);

    /// Creates the address; `None` above 0xef.
    pub const fn new(address: u8) -> Option<Self> {
        if address > Self::MAX.0 { None } else { Some(Self(address)) }
    }

    /// The number, 0x00..=0xef.
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl TryFrom<u8> for UserAddress {
    type Error = OutOfRange;

    fn try_from(address: u8) -> Result<Self, OutOfRange> {
        Self::new(address).ok_or(OutOfRange::above(address.into(), Self::MAX.0.into()))
    }
}

impl From<UserAddress> for u8 {
    fn from(address: UserAddress) -> Self {
        address.0
    }
}

impl core::fmt::Display for UserAddress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:#04x}", self.0)
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for UserAddress {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(from.int_in_range(0..=Self::MAX.0)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn limits() {
        assert_eq!((U10::MAX.get(), U17::MAX.get(), U19::MAX.get()), (1023, 131_071, 524_287));
        assert_eq!((EncoderAddress::MAX.get(), EncoderId::MAX.get(), U40::MAX.get()), (7, 0xff_ffff, 0xff_ffff_ffff));
        assert_eq!(EncoderAddress::try_from(8), Err(OutOfRange { got: 8, max: 7 }));
        assert_eq!(UserAddress::try_from(0xf0), Err(OutOfRange { got: 0xf0, max: 0xef }));
        assert_eq!(UserAddress::new(0xef), Some(UserAddress::MAX));
        assert_eq!(U40::try_from(1 << 40), Err(OutOfRange { got: 1 << 40, max: (1 << 40) - 1 }));
    }

    proptest! {
        #[test]
        fn halves_overlap_in_eight_bits(value: u64, other: u64) {
            let (abs, moved) = (U40::truncate(value), U40::truncate(other));
            prop_assert_eq!(U40::from_halves(abs.low24(), abs.high24()), Some(abs));
            let agree = abs.get() >> 16 & 0xff == moved.get() >> 16 & 0xff;
            prop_assert_eq!(U40::from_halves(abs.low24(), moved.high24()).is_some(), agree);
        }
    }
}
