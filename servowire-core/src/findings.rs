use core::fmt;
use core::marker::PhantomData;

use crate::Class;

/// A set of error classes: all that an inspection found wrong with a frame. Up to 64 classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Findings<C> {
    bits: u64,
    classes: PhantomData<C>,
}

impl<C: Class> Findings<C> {
    /// No fault.
    pub const NONE: Self = Self { bits: 0, classes: PhantomData };

    /// Whether a fault of this class was found.
    pub fn contains(self, class: C) -> bool {
        self.bits & bit(class) != 0
    }

    /// Whether no fault was found.
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

/// 0 for a class beyond the 64th, which no crate has.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
}
