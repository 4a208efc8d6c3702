/// Declares an enum whose variants are codes of a wire or of a register.
///
/// Each has `ALL`, `code()`, `from_code()`, which returns `None` for a code without a meaning, and `name()`, the vendor's name,
/// which `Display` prints.
///
/// ```
/// servowire_core::codes! {
///     /// Control mode, bits 6-4 of byte 1.
///     pub enum Mode: u8 {
///         /// Cyclic position.
///         CyclicPosition = 2 => "CP",
///         /// Cyclic velocity.
///         CyclicVelocity = 3 => "CV",
///     }
/// }
///
/// assert_eq!(Mode::from_code(3), Some(Mode::CyclicVelocity));
/// assert_eq!(Mode::from_code(4), None);
/// assert_eq!((Mode::CyclicPosition.code(), Mode::CyclicPosition.name()), (2, "CP"));
/// assert_eq!(Mode::ALL.map(|mode| mode.to_string()), ["CP", "CV"]);
/// ```
///
/// The calling crate must have the features `defmt`, `serde` and `arbitrary`, which add the traits of those crates.
#[macro_export]
macro_rules! codes {
    (
        $(#[$meta:meta])*
        pub enum $name:ident: $code:ty {
            $(
                $(#[$variant_meta:meta])*
                $variant:ident = $value:literal => $text:literal
            ),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        #[repr($code)]
        pub enum $name {
            $(
                $(#[$variant_meta])*
                $variant = $value
            ),+
        }

        impl $name {
            /// All defined codes, in the order of declaration.
            pub const ALL: [Self; [$(Self::$variant),+].len()] = [$(Self::$variant),+];

            /// The code.
            #[inline]
            pub const fn code(self) -> $code {
                self as $code
            }

            /// Returns the value with this code; `None` for a code that is not defined.
            #[inline]
            pub const fn from_code(code: $code) -> Option<Self> {
                match code {
                    $($value => Some(Self::$variant),)+
                    _ => None,
                }
            }

            /// The name in the vendor's documents.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text),+
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.pad(self.name())
            }
        }
    };
}

#[cfg(test)]
mod tests {
    #[allow(dead_code, unreachable_pub, reason = "declared as a crate would, not all of it used")]
    mod declared {
        crate::codes! {
            /// With gaps, out of order, wider than a byte.
            pub enum Wide: u16 {
                /// The last code.
                Last = 0xffff => "last",
                /// The first code.
                First = 0 => "first",
            }
        }
    }
    use declared::Wide;

    #[test]
    fn only_what_is_declared_has_a_meaning() {
        let meanings = (0..=u16::MAX).filter_map(|code| Wide::from_code(code).map(|wide| (code, wide)));
        assert!(meanings.eq([(0, Wide::First), (0xffff, Wide::Last)]));
        assert_eq!(Wide::ALL.map(Wide::code), [0xffff, 0]);
        assert_eq!(std::format!("{:>6}", Wide::Last), "  last");
    }
}
