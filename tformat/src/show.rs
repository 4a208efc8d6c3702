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

pub(crate) use one_line;
