use crate::{Class, Classified};

/// How many transactions succeeded, and how many failed in each of `N` ways.
///
/// Each crate declares its own: `type Counters = servowire_core::Counters<{ ErrorClass::ALL.len() }>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters<const N: usize> {
    good: u64,
    errors: [u64; N],
}

impl<const N: usize> Counters<N> {
    /// Creates counters that are all 0.
    pub const fn new() -> Self {
        Self { good: 0, errors: [0; N] }
    }

    /// Counts the outcome of a transaction; counters stop at their maximum.
    pub fn record<T, E: Classified>(&mut self, outcome: &Result<T, E>) {
        let counter = match outcome {
            Ok(_) => Some(&mut self.good),
            Err(error) => self.errors.get_mut(error.class().index()),
        };
        if let Some(counter) = counter {
            *counter = counter.saturating_add(1);
        }
    }

    /// Number of transactions with a valid answer.
    pub const fn good(&self) -> u64 {
        self.good
    }

    /// Number of transactions that failed in this way.
    pub fn of(&self, class: impl Class) -> u64 {
        self.errors.get(class.index()).copied().unwrap_or(0)
    }

    /// Number of transactions that failed.
    pub fn errors(&self) -> u64 {
        self.errors.iter().fold(0, |sum, n| sum.saturating_add(*n))
    }

    /// Number of failed transactions per million; 0 before the first transaction.
    pub fn errors_per_million(&self) -> u32 {
        let errors = self.errors();
        let all = errors.saturating_add(self.good);
        // A million has 20 bits: numbers that leave no room for it lose their low bits, which the rate does not show.
        let excess = 20_u32.saturating_sub(all.leading_zeros());
        let rate = (errors >> excess).saturating_mul(1_000_000).checked_div(all >> excess).unwrap_or(0);
        u32::try_from(rate).unwrap_or(u32::MAX)
    }
}

impl<const N: usize> core::fmt::Display for Counters<N> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} good, {} failed", self.good, self.errors())
    }
}

/// Returns the counts as a list: the good transactions, then the failures in the order of the classes.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl<const N: usize> serde::Serialize for Counters<N> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(core::iter::once(&self.good).chain(&self.errors))
    }
}

#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl<'de, const N: usize> serde::Deserialize<'de> for Counters<N> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(List)
    }
}

/// Reads the list of [`Counters`].
#[cfg(feature = "serde")]
struct List<const N: usize>;

#[cfg(feature = "serde")]
impl<'de, const N: usize> serde::de::Visitor<'de> for List<N> {
    type Value = Counters<N>;

    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "a number of good transactions and {N} numbers of failed ones")
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut list: A) -> Result<Counters<N>, A::Error> {
        let mut counters = Counters::new();
        for (at, counter) in core::iter::once(&mut counters.good).chain(&mut counters.errors).enumerate() {
            *counter = list.next_element()?.ok_or_else(|| serde::de::Error::invalid_length(at, &Self))?;
        }
        match list.next_element::<u64>()? {
            None => Ok(counters),
            Some(_) => Err(serde::de::Error::custom("there are more counters than classes")),
        }
    }
}

impl<const N: usize> Default for Counters<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Kind(usize);

    impl Class for Kind {
        const ALL: &'static [Self] = &[Self(0), Self(1), Self(2), Self(3)];

        fn index(self) -> usize {
            self.0
        }

        fn name(self) -> &'static str {
            "kind"
        }

        fn number(self) -> u8 {
            self.0 as u8 + 1
        }
    }

    #[test]
    fn every_class_has_its_counter() {
        let mut counters = Counters::<4>::new();
        assert_eq!(counters, Counters::default());
        assert_eq!(counters.errors_per_million(), 0);
        for _ in 0..3 {
            counters.record::<_, Kind>(&Ok(()));
        }
        counters.record::<(), _>(&Err(Kind(2)));
        // A class that has no place is not counted as another one.
        counters.record::<(), _>(&Err(Kind(4)));
        assert_eq!([0, 1, 2, 3, 4].map(|k| counters.of(Kind(k))), [0, 0, 1, 0, 0]);
        assert_eq!((counters.good(), counters.errors(), counters.errors_per_million()), (3, 1, 250_000));
        assert_eq!(std::format!("{counters}"), "3 good, 1 failed");
    }

    #[cfg(feature = "serde")]
    #[test]
    fn counters_are_stored_as_a_list() {
        let counters = Counters::<2> { good: 7, errors: [1, u64::MAX] };
        let text = serde_json::to_string(&counters).unwrap();
        assert_eq!(text, "[7,1,18446744073709551615]");
        assert_eq!(serde_json::from_str::<Counters<2>>(&text).ok(), Some(counters));
        for bad in ["[7,1]", "[7,1,2,3]", "[]", "7", "[7,-1,2]"] {
            assert!(serde_json::from_str::<Counters<2>>(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_rate_is_right_after_years() {
        // Nearly 2^43 transactions, the last count that needs no shift, and the first ones that do.
        for (good, errors, rate) in [
            (6 << 40, 2 << 40, 250_000),
            ((3 << 41) + 7, 1 << 41, 249_999),
            (3 << 42, 1 << 42, 250_000),
            (3 << 60, 1 << 60, 250_000),
            // All of them failed: nothing is left of the room for the million.
            (0, (1 << 44) - 1, 1_000_000),
            (0, (1 << 45) - 1, 1_000_000),
            (0, u64::MAX, 1_000_000),
        ] {
            assert_eq!(Counters::<4> { good, errors: [0, errors, 0, 0] }.errors_per_million(), rate, "{good} {errors}");
        }
        // More failures in all than a counter holds.
        assert_eq!(Counters::<4> { good: 7, errors: [5, u64::MAX, 0, 5] }.errors(), u64::MAX);
        let mut counters = Counters::<4> { good: u64::MAX - 1, errors: [0, 0, 3, 0] };
        assert_eq!(counters.errors_per_million(), 0);
        for _ in 0..3 {
            counters.record::<_, Kind>(&Ok(()));
        }
        assert_eq!(counters.good(), u64::MAX);
    }
}
