use core::fmt::Debug;

/// The kind of an error, which counters count and statistics list. [`errors!`](crate::errors) declares one for each crate.
pub trait Class: Copy + Eq + Debug + 'static {
    /// All classes, in the order of the checks.
    const ALL: &'static [Self];

    /// Index in [`ALL`](Self::ALL), from 0.
    fn index(self) -> usize;

    /// The name in `snake_case`, as used in logs and test vectors.
    fn name(self) -> &'static str;

    /// The number used in logs and in other languages: 1 or more, never changed.
    fn number(self) -> u8;
}

/// An error that belongs to a [`Class`].
pub trait Classified: Copy {
    /// All classes of this error.
    type Class: Class;

    /// The class of this error.
    fn class(self) -> Self::Class;
}

impl<C: Class> Classified for C {
    type Class = C;

    fn class(self) -> C {
        self
    }
}
