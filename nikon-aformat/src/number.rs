use nrz_line::{TooWide, Unsigned};

use crate::Error;

/// The 10 bits of a temperature.
pub type U10 = Unsigned<10>;
/// The 17 bits of ABS17.
pub type U17 = Unsigned<17>;
/// The 19 bits of the velocity coefficient.
pub type U19 = Unsigned<19>;
/// The 24 bits of a position part or of an identification code.
pub type U24 = Unsigned<24>;

/// The 40 bits of ABS40: single turn below, turns above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u64", into = "u64"))]
pub struct U40(u64);

impl U40 {
    /// The largest value, 2^40 - 1.
    pub const MAX: Self = Self(0xff_ffff_ffff);

    /// `None` above 2^40 - 1.
    pub const fn new(value: u64) -> Option<Self> {
        if value > Self::MAX.0 { None } else { Some(Self(value)) }
    }

    /// The low 40 bits of `value`.
    pub const fn truncate(value: u64) -> Self {
        Self(value & Self::MAX.0)
    }

    /// The value.
    pub const fn get(self) -> u64 {
        self.0
    }

    /// From five bytes, the lowest first.
    pub(crate) const fn from_bytes([a, b, c, d, e]: [u8; 5]) -> Self {
        Self(u64::from_le_bytes([a, b, c, d, e, 0, 0, 0]))
    }

    /// Bits 0..=23, what ABS24 replies carry.
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
    pub const fn low24(self) -> U24 {
        U24::truncate(self.0 as u32)
    }

    /// Bits 16..=39, what the upper ABS24 replies carry.
    #[expect(clippy::cast_possible_truncation, reason = "24 bits are left")]
    pub const fn high24(self) -> U24 {
        U24::truncate((self.0 >> 16) as u32)
    }

    /// Bits 0..=16, what ABS17 replies carry.
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
    pub const fn low17(self) -> U17 {
        U17::truncate(self.0 as u32)
    }

    /// Puts the two 24-bit halves together again, if their common bits 16..=23 agree.
    ///
    /// The halves come from two replies; at speed the position moved in between, and the common bits may differ.
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
        Some(Self((high.get() as u64) << 16 | (low.get() & 0xffff) as u64))
    }
}

impl TryFrom<u64> for U40 {
    type Error = TooWide;

    fn try_from(value: u64) -> Result<Self, TooWide> {
        Self::new(value).ok_or(TooWide { got: value, bits: 40 })
    }
}

impl From<U40> for u64 {
    fn from(value: U40) -> Self {
        value.get()
    }
}

/// EA, the address of an encoder on the bus, 0..=7. Vendor tools call them ENC1 to ENC8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u32", into = "u32"))]
pub struct EncoderAddress(u8);

impl EncoderAddress {
    /// All eight.
    pub const ALL: [Self; 8] = [Self(0), Self(1), Self(2), Self(3), Self(4), Self(5), Self(6), Self(7)];

    /// Address 0, that of a single encoder as delivered.
    pub const ZERO: Self = Self(0);

    /// The highest address.
    pub const MAX: Self = Self(7);

    /// `None` above 7.
    pub const fn new(address: u8) -> Option<Self> {
        if address > 7 { None } else { Some(Self(address)) }
    }

    /// The three low bits of `address`.
    pub const fn truncate(address: u8) -> Self {
        Self(address & 7)
    }

    /// The number, 0..=7.
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl TryFrom<u32> for EncoderAddress {
    type Error = Error;

    fn try_from(address: u32) -> Result<Self, Error> {
        u8::try_from(address).ok().and_then(Self::new).ok_or(Error::AddressRange { got: address })
    }
}

impl From<EncoderAddress> for u32 {
    fn from(address: EncoderAddress) -> Self {
        Self::from(address.0)
    }
}

impl core::fmt::Display for EncoderAddress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// An EEPROM address that a request without bank may write, 0x00..=0xef.
///
/// All 256 can be read. The last sixteen hold the maker's data, among them the
/// [type word](crate::TypeWord) and the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u32", into = "u32"))]
pub struct UserAddress(u8);

impl UserAddress {
    /// The highest address that can be written.
    pub const MAX: Self = Self(0xef);

    /// `None` above 0xef.
    pub const fn new(address: u8) -> Option<Self> {
        if address > Self::MAX.0 { None } else { Some(Self(address)) }
    }

    /// The number, 0x00..=0xef.
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl TryFrom<u32> for UserAddress {
    type Error = Error;

    fn try_from(address: u32) -> Result<Self, Error> {
        u8::try_from(address).ok().and_then(Self::new).ok_or(Error::AddressRange { got: address })
    }
}

impl From<UserAddress> for u32 {
    fn from(address: UserAddress) -> Self {
        Self::from(address.0)
    }
}

#[cfg(feature = "arbitrary")]
mod arbitrary_impls {
    use super::{EncoderAddress, U40, UserAddress};
    use arbitrary::{Arbitrary, Result, Unstructured};

    impl<'a> Arbitrary<'a> for U40 {
        fn arbitrary(from: &mut Unstructured<'a>) -> Result<Self> {
            Ok(Self::truncate(from.arbitrary()?))
        }
    }

    impl<'a> Arbitrary<'a> for EncoderAddress {
        fn arbitrary(from: &mut Unstructured<'a>) -> Result<Self> {
            Ok(Self::truncate(from.arbitrary()?))
        }
    }

    impl<'a> Arbitrary<'a> for UserAddress {
        fn arbitrary(from: &mut Unstructured<'a>) -> Result<Self> {
            Ok(Self(from.int_in_range(0..=Self::MAX.0)?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn limits() {
        assert_eq!((U10::MAX.get(), U17::MAX.get(), U19::MAX.get()), (1023, 131_071, 524_287));
        assert_eq!(U24::new(0xff_ffff), Some(U24::MAX));
        assert_eq!(U24::try_from(0x100_0000), Err(TooWide { got: 0x100_0000, bits: 24 }));
        assert_eq!(EncoderAddress::try_from(8), Err(Error::AddressRange { got: 8 }));
        assert_eq!(UserAddress::try_from(0xf0), Err(Error::AddressRange { got: 0xf0 }));
        assert_eq!(UserAddress::new(0xef), Some(UserAddress::MAX));
        assert_eq!(U40::try_from(1 << 40), Err(TooWide { got: 1 << 40, bits: 40 }));
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
