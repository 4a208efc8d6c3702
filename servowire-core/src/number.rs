/// Declares a type for numbers of `BITS` bits, based on `arbitrary_int::UInt`.
///
/// Each type has the same three constructors (`try_from`, which checks and names the reason; `new`, which checks in const
/// context; `truncate`, which cuts to the width), and `get` returns the number. An illegal value can neither be constructed nor
/// deserialised.
///
/// ```
/// servowire_core::number! {
///     /// MAC-ID of a drive, 0..=31.
///     pub struct MacId(u8, 5);
/// }
///
/// assert_eq!(MacId::new(31), Some(MacId::MAX));
/// assert_eq!(MacId::new(32), None);
/// assert_eq!(MacId::try_from(32).unwrap_err().to_string(), "32 is out of range, the limit is 31");
/// assert_eq!(MacId::truncate(33).get(), 1);
/// assert_eq!(MacId::MAX.to_string(), "31");
/// ```
///
/// The calling crate must have the features `defmt`, `serde` and `arbitrary`, which add the traits of those crates.
#[macro_export]
macro_rules! number {
    ($(#[$meta:meta])* pub struct $name:ident($inner:ty, $bits:literal);) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
        pub struct $name($crate::private::UInt<$inner, $bits>);

        impl $name {
            /// Width in bits.
            pub const BITS: u32 = $bits;

            /// The largest value.
            pub const MAX: Self = Self(<$crate::private::UInt<$inner, $bits> as $crate::private::Integer>::MAX);

            /// Creates the number; `None` above [`MAX`](Self::MAX).
            #[inline]
            pub const fn new(value: $inner) -> Option<Self> {
                match $crate::private::UInt::<$inner, $bits>::try_new(value) {
                    Ok(value) => Some(Self(value)),
                    Err(_) => None,
                }
            }

            /// Keeps the low bits of `value`.
            #[inline]
            pub const fn truncate(value: $inner) -> Self {
                match Self::new(value & Self::MAX.get()) {
                    Some(value) => value,
                    // Never: the mask is the largest value.
                    None => Self::MAX,
                }
            }

            /// The value.
            #[inline]
            pub const fn get(self) -> $inner {
                self.0.value()
            }
        }

        impl TryFrom<$inner> for $name {
            type Error = $crate::OutOfRange;

            #[inline]
            fn try_from(value: $inner) -> Result<Self, $crate::OutOfRange> {
                Self::new(value).ok_or_else(|| $crate::OutOfRange::above(value.into(), Self::MAX.get().into()))
            }
        }

        impl From<$name> for $inner {
            #[inline]
            fn from(value: $name) -> Self {
                value.get()
            }
        }

        impl core::fmt::Debug for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_tuple(stringify!($name)).field(&self.get()).finish()
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Display::fmt(&self.get(), f)
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $name {
            fn format(&self, f: defmt::Formatter<'_>) {
                defmt::Format::format(&self.get(), f);
            }
        }

        #[cfg(feature = "serde")]
        #[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serde::Serialize::serialize(&self.get(), serializer)
            }
        }

        #[cfg(feature = "serde")]
        #[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let value = <$inner as serde::Deserialize>::deserialize(deserializer)?;
                Self::try_from(value).map_err(serde::de::Error::custom)
            }
        }

        #[cfg(feature = "arbitrary")]
        #[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
        impl<'a> arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
                from.arbitrary().map(Self::truncate)
            }
        }
    };
}

number! {
    /// A field of 24 bits: a single-turn position, turns, an identification code.
    pub struct U24(u32, 24);
}

impl U24 {
    /// Creates the number from three bytes, the low one first.
    #[inline]
    pub const fn from_le_bytes([low, middle, high]: [u8; 3]) -> Self {
        Self::truncate(u32::from_le_bytes([low, middle, high, 0]))
    }

    /// Returns the number as three bytes, the low one first.
    #[inline]
    pub const fn to_le_bytes(self) -> [u8; 3] {
        let [low, middle, high, _] = self.get().to_le_bytes();
        [low, middle, high]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OutOfRange;
    use std::string::ToString;

    #[allow(dead_code, unreachable_pub, reason = "declared as a crate would, not all of it used")]
    mod widths {
        number! {
            /// The narrowest.
            pub struct One(u8, 1);
        }
        number! {
            /// A whole word but one bit.
            pub struct Most(u32, 31);
        }
        number! {
            /// Wider than 32 bits.
            pub struct Wide(u64, 40);
        }
    }
    use widths::{Most, One, Wide};

    #[test]
    fn every_width_has_its_edge() {
        assert_eq!((One::MAX.get(), One::new(1).map(One::get), One::new(2)), (1, Some(1), None));
        assert_eq!((Most::MAX.get(), Most::new(1 << 31)), ((1 << 31) - 1, None));
        assert_eq!(Wide::try_from(1 << 40), Err(OutOfRange { got: 1 << 40, max: (1 << 40) - 1 }));
        assert_eq!((Wide::truncate(u64::MAX), Wide::truncate(1 << 40).get()), (Wide::MAX, 0));
        assert_eq!((U24::BITS, U24::MAX.get(), U24::default().get()), (24, 0xff_ffff, 0));
    }

    #[test]
    fn three_bytes() {
        let value = U24::truncate(0x12_3456);
        assert_eq!(value.to_le_bytes(), [0x56, 0x34, 0x12]);
        assert_eq!(U24::from_le_bytes([0x56, 0x34, 0x12]), value);
        assert_eq!((value.to_string(), std::format!("{value:?}")), ("1193046".into(), "U24(1193046)".into()));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn an_illegal_number_cannot_be_deserialised() {
        assert_eq!(serde_json::from_str::<U24>("16777215").ok(), Some(U24::MAX));
        assert!(serde_json::from_str::<U24>("16777216").unwrap_err().to_string().contains("out of range"));
    }
}
