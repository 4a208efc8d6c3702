use core::fmt;
use core::marker::PhantomData;

use crate::Class;

/// A set of error classes: everything that an inspection has found wrong with a frame. Up to 64 classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Findings<C> {
    bits: u64,
    classes: PhantomData<C>,
}

impl<C: Class> Findings<C> {
    /// No fault.
    pub const NONE: Self = Self { bits: 0, classes: PhantomData };

    /// Returns whether a fault of this class was found.
    pub fn contains(self, class: C) -> bool {
        self.bits & bit(class) != 0
    }

    /// Returns whether no fault was found.
    pub const fn is_empty(self) -> bool {
        self.bits == 0
    }

    /// Adds a class.
    pub fn insert(&mut self, class: C) {
        self.bits |= bit(class);
    }

    /// The classes found, in the order of [`Class::ALL`].
    pub fn iter(self) -> impl Iterator<Item = C> {
        C::ALL.iter().copied().filter(move |class| self.contains(*class))
    }
}

/// Returns the bit of a class; 0 for a class beyond the 64th, which no crate has.
fn bit<C: Class>(class: C) -> u64 {
    u32::try_from(class.index()).ok().and_then(|at| 1_u64.checked_shl(at)).unwrap_or(0)
}

impl<C: Class> Default for Findings<C> {
    fn default() -> Self {
        Self::NONE
    }
}

impl<C: Class> fmt::Display for Findings<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        crate::write_names(f, self.iter().map(Class::name))
    }
}

#[cfg(feature = "defmt")]
#[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
impl<C: Class> defmt::Format for Findings<C> {
    fn format(&self, f: defmt::Formatter<'_>) {
        for class in self.iter() {
            defmt::write!(f, "{=str} ", class.name());
        }
    }
}

/// Serialised as a sequence of the classes.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl<C: Class + serde::Serialize> serde::Serialize for Findings<C> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl<'de, C: Class + serde::Deserialize<'de>> serde::Deserialize<'de> for Findings<C> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Classes<C>(PhantomData<C>);

        impl<'de, C: Class + serde::Deserialize<'de>> serde::de::Visitor<'de> for Classes<C> {
            type Value = Findings<C>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a sequence of error classes")
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut classes: A) -> Result<Findings<C>, A::Error> {
                let mut found = Findings::NONE;
                while let Some(class) = classes.next_element()? {
                    found.insert(class);
                }
                Ok(found)
            }
        }

        deserializer.deserialize_seq(Classes(PhantomData))
    }
}

/// Declares what all inspections of a serial line have in common: `Findings`, a `Cause` that may lie in the line, and, for a
/// `Report` with the fields `error`, `findings` and `cause`, the getters and the text for a reader. The arms passed to it come
/// after those for a fault.
///
/// `servowire_core::report! { Self { response: Some(response), .. } => "sound: {}", response; }`
#[macro_export]
macro_rules! report {
    ($($sound:tt)+) => {
        impl From<LineCause> for Cause {
            fn from(cause: LineCause) -> Self {
                Self::Line(cause)
            }
        }

        /// The kinds of fault found, as a set.
        pub type Findings = $crate::Findings<ErrorClass>;

        $crate::one_line!(Report {
            Self { error: Some(error), cause: Some(cause), .. } => "{}; likely cause: {}", error, cause;
            Self { error: Some(error), .. } => "{}", error;
            $($sound)+
        });

        impl Report {
            /// The first fault, as a decoder reports it.
            pub const fn error(&self) -> Option<Error> {
                self.error
            }

            /// Every kind of fault in the input.
            pub const fn findings(&self) -> Findings {
                self.findings
            }

            /// The most likely cause of the fault.
            pub const fn cause(&self) -> Option<Cause> {
                self.cause
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    enum Kind {
        First,
        Second,
        Third,
    }

    impl Class for Kind {
        const ALL: &'static [Self] = &[Self::First, Self::Second, Self::Third];

        fn index(self) -> usize {
            self as usize
        }

        fn name(self) -> &'static str {
            ["first", "second", "third"][self as usize]
        }

        fn number(self) -> u8 {
            self as u8 + 1
        }
    }

    #[test]
    fn a_set_of_classes() {
        let mut found = Findings::default();
        assert!(found.is_empty());
        assert_eq!(found.to_string(), "-");
        found.insert(Kind::Third);
        found.insert(Kind::First);
        assert!(found.contains(Kind::First) && !found.contains(Kind::Second) && !found.is_empty());
        assert_eq!(found.iter().collect::<Vec<_>>(), [Kind::First, Kind::Third]);
        assert_eq!(found.to_string(), "first third");
    }

    /// A class by its place, of more than a set holds.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Place(usize);

    impl Class for Place {
        const ALL: &'static [Self] = &[Self(0), Self(31), Self(32), Self(63), Self(64)];

        fn index(self) -> usize {
            self.0
        }

        fn name(self) -> &'static str {
            "place"
        }

        fn number(self) -> u8 {
            self.0 as u8 + 1
        }
    }

    #[test]
    fn up_to_64_classes_are_told_apart() {
        for place in [0, 31, 32, 63] {
            let mut found = Findings::NONE;
            found.insert(Place(place));
            assert_eq!(found.iter().collect::<Vec<_>>(), [Place(place)]);
        }
        let mut found = Findings::NONE;
        found.insert(Place(64));
        assert!(found.is_empty() && !found.contains(Place(64)));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn written_as_the_classes() {
        let mut found = Findings::default();
        assert_eq!(serde_json::to_string(&found).unwrap(), "[]");
        found.insert(Kind::Third);
        found.insert(Kind::First);
        let text = serde_json::to_string(&found).unwrap();
        assert_eq!(text, r#"["First","Third"]"#);
        assert_eq!(serde_json::from_str::<Findings<Kind>>(&text).unwrap(), found);
    }
}
