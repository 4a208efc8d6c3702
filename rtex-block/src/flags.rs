//! How every flag set of the crate is declared.

/// A struct over a number with named bits: `bitflags` and the traits that each set has. Serde takes named bits only.
macro_rules! flag_set {
    ($(#[$meta:meta])* pub struct $name:ident($bits:ty) { $($(#[$($doc:tt)*])* $constant:ident = $value:expr;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
        pub struct $name($bits);

        bitflags::bitflags! {
            impl $name: $bits {
                $($(#[$($doc)*])* const $constant = $value;)*
            }
        }

        impl core::fmt::Display for $name {
            /// The names of the bits that are set, with a blank between them.
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                servowire_core::write_names(f, self.iter_names().map(|(name, _)| name))
            }
        }

        impl core::fmt::Debug for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                write!(f, concat!(stringify!($name), "({})"), self)
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $name {
            fn format(&self, f: defmt::Formatter<'_>) {
                for (at, (name, _)) in self.iter_names().enumerate() {
                    defmt::write!(f, "{=str}{=str}", if at == 0 { "" } else { " " }, name);
                }
            }
        }

        #[cfg(feature = "serde")]
        #[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serde::Serialize::serialize(&self.bits(), serializer)
            }
        }

        #[cfg(feature = "serde")]
        #[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let bits = <$bits as serde::Deserialize>::deserialize(deserializer)?;
                Self::from_bits(bits).ok_or_else(|| serde::de::Error::custom("a bit without a name is set"))
            }
        }

        #[cfg(feature = "arbitrary")]
        #[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
        impl<'a> arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
                from.arbitrary().map(Self::from_bits_truncate)
            }
        }
    };
}

pub(crate) use flag_set;
