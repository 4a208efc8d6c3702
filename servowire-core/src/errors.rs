/// Declares the error enum of a crate and the enum of its classes.
///
/// Given the variants with their messages (`thiserror`) and documentation, it declares
///
/// * `Error`, `Copy`, `#[non_exhaustive]`, at most 16 bytes, with `defmt::Format` and serde behind the calling crate's features
///   of these names, and `class()`;
/// * `ErrorClass` with a variant of the same name for each, [`Class`](crate::Class) and [`Classified`](crate::Classified),
///   `ALL` in the order of declaration, `name()` in `snake_case`, and `number()`, which is written beside the variant and never
///   changes, because logs and programs in other languages store it. 0 is reserved for "no error".
///
/// ```
/// servowire_core::errors! {
///     /// Why a frame was refused.
///     pub enum Error {
///         /// The frame ends too early.
///         #[error("{got} of {want} bytes are there")]
///         Truncated = 1 {
///             /// Bytes that were there.
///             got: u16,
///             /// Bytes of a frame.
///             want: u16,
///         },
///         /// The check byte is wrong.
///         #[error("the check byte is wrong")]
///         BadCrc8 = 2,
///     }
/// }
///
/// let error = Error::Truncated { got: 3, want: 4 };
/// assert_eq!(error.to_string(), "3 of 4 bytes are there");
/// assert_eq!((error.class(), error.class().name()), (ErrorClass::Truncated, "truncated"));
/// assert_eq!(ErrorClass::ALL.iter().map(|class| class.name()).collect::<Vec<_>>(), ["truncated", "bad_crc8"]);
/// assert_eq!(ErrorClass::ALL.iter().map(|class| class.number()).collect::<Vec<_>>(), [1, 2]);
/// ```
///
/// An error that is too large does not compile, and neither does a class with the number 0:
///
/// ```compile_fail,E0080
/// servowire_core::errors! {
///     /// 24 bytes.
///     pub enum Error {
///         /// Three words.
///         #[error("{a} {b} {c}")]
///         Long = 1 { a: u64, b: u64, c: u64 },
///     }
/// }
/// ```
///
/// ```compile_fail,E0080
/// servowire_core::errors! {
///     /// With the number of no error.
///     pub enum Error {
///         /// The first.
///         #[error("first")]
///         First = 0,
///     }
/// }
/// ```
///
/// A crate with `nom` parsers adds [`nom_error!`](crate::nom_error).
#[macro_export]
macro_rules! errors {
    (
        $(#[$meta:meta])*
        pub enum Error {
            $(
                $(#[$variant_meta:meta])*
                $variant:ident = $number:literal $({ $($fields:tt)* })?
            ),* $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub enum Error {
            $(
                $(#[$variant_meta])*
                $variant $({ $($fields)* })?
            ),*
        }

        /// The kind of an [`Error`], for counters and statistics.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum ErrorClass {
            $(
                #[doc = concat!("[`Error::", stringify!($variant), "`]")]
                $variant = $number
            ),*
        }

        impl ErrorClass {
            /// All classes, in the order in which [`Error`] declares them.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The name in `snake_case`, as used in logs and test vectors.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => {
                        const NAME: $crate::private::Snake = $crate::private::snake_case(stringify!($variant));
                        NAME.as_str()
                    })*
                }
            }

            /// The number of this class in logs and in other languages: 1 or more, and never changed.
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// Returns the class with this number.
            pub const fn from_number(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }

        impl Error {
            /// The kind of this error.
            pub const fn class(self) -> ErrorClass {
                match self {
                    $(Self::$variant { .. } => ErrorClass::$variant),*
                }
            }
        }

        impl core::fmt::Display for ErrorClass {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.pad(self.name())
            }
        }

        impl $crate::Class for ErrorClass {
            const ALL: &'static [Self] = Self::ALL;

            fn index(self) -> usize {
                enum Place {
                    $($variant),*
                }
                match self {
                    $(Self::$variant => Place::$variant as usize),*
                }
            }

            fn name(self) -> &'static str {
                self.name()
            }

            fn number(self) -> u8 {
                self.number()
            }
        }

        impl $crate::Classified for Error {
            type Class = ErrorClass;

            fn class(self) -> ErrorClass {
                self.class()
            }
        }

        const _: () = assert!(size_of::<Error>() <= 16, "an error has at most 16 bytes");
        const _: () = assert!(ErrorClass::from_number(0).is_none(), "0 stands for no error");
    };
}

/// Makes an error usable as the error type of `nom` parsers. The error needs a variant `Combinator` without fields, which is
/// returned when a combinator of the caller refuses the input.
///
/// ```
/// servowire_core::errors! {
///     /// Why a frame was refused.
///     pub enum Error {
///         /// A `nom` combinator of the caller refused the input.
///         #[error("a parser combinator refused the input")]
///         Combinator = 1,
///     }
/// }
/// servowire_core::nom_error!(Error);
///
/// use nom::{Parser, bytes::streaming::tag};
/// assert_eq!(tag("a").parse("b"), Err(nom::Err::Error(Error::Combinator)));
/// ```
#[macro_export]
macro_rules! nom_error {
    ($error:ty) => {
        impl<I> $crate::private::nom::error::ParseError<I> for $error {
            fn from_error_kind(_: I, _: $crate::private::nom::error::ErrorKind) -> Self {
                Self::Combinator
            }

            fn append(_: I, _: $crate::private::nom::error::ErrorKind, other: Self) -> Self {
                other
            }
        }

        impl<I> $crate::private::nom::error::FromExternalError<I, Self> for $error {
            fn from_external_error(_: I, _: $crate::private::nom::error::ErrorKind, error: Self) -> Self {
                error
            }
        }
    };
}

/// Converts a name to `snake_case` at compile time.
#[derive(Debug, Clone, Copy)]
pub struct Snake {
    bytes: [u8; 48],
    len: usize,
}

impl Snake {
    /// The name.
    pub const fn as_str(&self) -> &str {
        let (name, _) = self.bytes.split_at(self.len);
        match core::str::from_utf8(name) {
            Ok(name) => name,
            // Never: only ASCII letters, digits and underscores are written.
            Err(_) => "",
        }
    }
}

/// `CamelCase` to `snake_case`: an underscore before each capital letter but the first.
#[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "evaluated when a crate is compiled")]
pub const fn snake_case(name: &str) -> Snake {
    let from = name.as_bytes();
    let mut to = Snake { bytes: [0; 48], len: 0 };
    let mut at = 0;
    while at < from.len() {
        if at > 0 && from[at].is_ascii_uppercase() {
            to.bytes[to.len] = b'_';
            to.len += 1;
        }
        to.bytes[to.len] = from[at].to_ascii_lowercase();
        to.len += 1;
        at += 1;
    }
    to
}

#[cfg(test)]
mod tests {
    use super::snake_case;
    use crate::{Class, Classified, Counters};

    #[allow(dead_code, unreachable_pub, reason = "declared as a crate would, not all of it used")]
    mod declared {
        crate::errors! {
            /// Numbers that tell nothing of the order.
            pub enum Error {
                /// Checked first.
                #[error("first")]
                First = 9,
                /// Checked second, as long as an error may be.
                #[error("second, {value}")]
                Second = 2 {
                    /// Eight of sixteen bytes.
                    value: u64,
                },
                /// Checked last.
                #[error("last")]
                Last = 255,
            }
        }
    }
    use declared::{Error, ErrorClass};

    #[test]
    fn places_follow_the_order_and_numbers_are_those_declared() {
        let errors = [Error::First, Error::Second { value: 1 }, Error::Last];
        assert_eq!(errors.map(|error| Class::index(error.class())), [0, 1, 2]);
        assert_eq!(errors.map(|error| Class::number(Classified::class(error))), [9, 2, 255]);
        assert_eq!(errors.map(|error| Class::name(error.class())), ["first", "second", "last"]);
        assert_eq!(<ErrorClass as Class>::ALL, [ErrorClass::First, ErrorClass::Second, ErrorClass::Last]);
        let known = (0..=u8::MAX).filter_map(|number| ErrorClass::from_number(number).map(|class| (number, class)));
        assert!(known.eq([(2, ErrorClass::Second), (9, ErrorClass::First), (255, ErrorClass::Last)]));
        let mut counters = Counters::<3>::new();
        counters.record::<(), _>(&Err(Error::Last));
        assert_eq!(
            [ErrorClass::First, ErrorClass::Second, ErrorClass::Last].map(|class| counters.of(class)),
            [0, 0, 1]
        );
    }

    #[test]
    fn names_in_snake_case() {
        for (camel, snake) in
            [("Crc", "crc"), ("UnknownDataId", "unknown_data_id"), ("BadCrc8", "bad_crc8"), ("Rx2Late", "rx2_late")]
        {
            assert_eq!(snake_case(camel).as_str(), snake);
        }
    }
}
