//! Conversions that every newtype over a small integer has.

use crate::{Code, MacId, Nibble, TypeCode, UpdateCounter};

/// The number does not fit the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{value} does not fit the field, {max} is its largest value")]
pub struct OutOfRange {
    /// What was given.
    pub value: u16,
    /// Largest value of the field.
    pub max: u16,
}

macro_rules! narrow {
    ($name:ident, $inner:ty, $max:expr) => {
        impl TryFrom<$inner> for $name {
            type Error = $crate::OutOfRange;

            fn try_from(value: $inner) -> Result<Self, Self::Error> {
                Self::new(value).ok_or($crate::OutOfRange { value: value.into(), max: $max })
            }
        }

        impl From<$name> for $inner {
            fn from(value: $name) -> Self {
                value.get()
            }
        }

        #[cfg(feature = "arbitrary")]
        #[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
        impl<'a> arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
                let value: $inner = from.int_in_range(0..=$max)?;
                Self::new(value).ok_or(arbitrary::Error::IncorrectFormat)
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                self.get().fmt(f)
            }
        }
    };
}

narrow!(MacId, u8, 31);
narrow!(UpdateCounter, u8, 3);
narrow!(Code, u8, 0x7f);
narrow!(TypeCode, u16, 0xfff);
narrow!(Nibble, u8, 15);
