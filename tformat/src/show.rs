//! How messages print: one line, the same words on a host and in a `defmt` log.

/// Implements `Display` and `defmt::Format` by the same format strings, one for each pattern of the value.
macro_rules! one_line {
    ($type:ty { $($pattern:pat $(if $guard:expr)? => $format:literal $(, $part:expr)*;)+ }) => {
        impl core::fmt::Display for $type {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                match self {
                    $($pattern $(if $guard)? => write!(f, $format $(, $part)*),)+
                }
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                match self {
                    $($pattern $(if $guard)? => defmt::write!(f, $format $(, $part)*),)+
                }
            }
        }
    };
}

/// Implements `Display` and `defmt::Format` of a flag set: the names of the set bits, `OF BE BA`.
/// Every bit of the flag sets of this crate has a name.
macro_rules! flags {
    ($type:ty) => {
        impl core::fmt::Display for $type {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                servowire_core::write_names(f, self.iter_names().map(|(name, _)| name))
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                for (at, (name, _)) in self.iter_names().enumerate() {
                    defmt::write!(f, "{=str}{=str}", if at > 0 { " " } else { "" }, name);
                }
            }
        }
    };
}

pub(crate) use {flags, one_line};
