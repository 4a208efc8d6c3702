//! Small numbers whose range is not a power of two.

/// Declares a `u8` from `MIN` to `MAX`, with the same constructors and conversions as `servowire_core::number!`.
macro_rules! ranged {
    ($(#[$meta:meta])* pub struct $name:ident($min:literal..=$max:literal);) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
        pub struct $name(u8);

        impl $name {
            /// The smallest value.
            pub const MIN: Self = Self($min);

            /// The largest value.
            pub const MAX: Self = Self($max);

            /// Creates the number; `None` outside [`MIN`](Self::MIN) and [`MAX`](Self::MAX).
            #[inline]
            pub const fn new(value: u8) -> Option<Self> {
                if matches!(value, $min..=$max) { Some(Self(value)) } else { None }
            }

            /// The value.
            #[inline]
            pub const fn get(self) -> u8 {
                self.0
            }
        }

        impl TryFrom<u8> for $name {
            type Error = servowire_core::OutOfRange;

            fn try_from(value: u8) -> Result<Self, Self::Error> {
                let max = if value > Self::MAX.0 { Self::MAX } else { Self::MIN };
                Self::new(value).ok_or(servowire_core::OutOfRange { got: value.into(), max: max.0.into() })
            }
        }

        impl From<$name> for u8 {
            fn from(value: $name) -> Self {
                value.0
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Display::fmt(&self.0, f)
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $name {
            fn format(&self, f: defmt::Formatter<'_>) {
                defmt::Format::format(&self.0, f);
            }
        }

        #[cfg(feature = "arbitrary")]
        #[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
        impl<'a> arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
                from.int_in_range($min..=$max).map(Self)
            }
        }
    };
}

pub(crate) use ranged;
