//! Named bits over bytes 2-3 of a block.

macro_rules! bit_set {
    ($(#[$meta:meta])* $name:ident, $set:ident, $($(#[$doc:meta])* $constant:ident $getter:ident $bit:literal $text:literal;)*) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "u16", into = "u16"))]
        pub struct $name(u16);

        impl $name {
            $($(#[$doc])* pub const $constant: Self = Self(1 << $bit);)*

            /// Every named bit with its name in the vendor documents, from bit 15 down to bit 0.
            pub const NAMED: &'static [(Self, &'static str)] = &[$((Self::$constant, $text)),*];

            /// All named bits.
            const MASK: u16 = $(1 << $bit)|*;

            /// No bit set.
            pub const fn empty() -> Self {
                Self(0)
            }

            /// Byte 2 in bits 7-0, byte 3 in bits 15-8.
            pub const fn to_bytes(self) -> [u8; 2] {
                self.0.to_le_bytes()
            }

            /// Whether all bits of `other` are set.
            pub const fn contains(self, other: Self) -> bool {
                self.0 & other.0 == other.0
            }

            /// With the bits of `other` set.
            #[must_use]
            pub const fn with(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }

            /// With the bits of `other` cleared.
            #[must_use]
            pub const fn without(self, other: Self) -> Self {
                Self(self.0 & !other.0)
            }

            /// The bits that differ.
            #[must_use]
            pub const fn changed(self, other: Self) -> Self {
                Self(self.0 ^ other.0)
            }

            $(
                #[doc = concat!("Whether ", $text, " is set; see [`", stringify!($constant), "`](Self::", stringify!($constant), ").")]
                pub const fn $getter(self) -> bool {
                    self.0 & 1 << $bit != 0
                }
            )*
        }

        impl From<u16> for $name {
            /// Byte 2 in bits 7-0, byte 3 in bits 15-8; bits without a name are dropped.
            fn from(raw: u16) -> Self {
                Self(raw & Self::MASK)
            }
        }

        impl From<$name> for u16 {
            fn from(bits: $name) -> Self {
                bits.0
            }
        }

        #[cfg(feature = "arbitrary")]
        #[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
        impl<'a> arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
                from.arbitrary::<u16>().map(Self::from)
            }
        }

        impl core::fmt::Debug for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let mut set = f.debug_set();
                for (bit, name) in Self::NAMED {
                    if self.contains(*bit) {
                        set.entry(&format_args!("{name}"));
                    }
                }
                set.finish()
            }
        }
    };
}

pub(crate) use bit_set;
