/// An error, or the class of one, that has a place in [`Counters`].
pub trait Classified {
    /// Index of its class, from 0.
    fn class_index(&self) -> usize;
}

/// How many transactions went well, and how many failed in which of `N` ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters<const N: usize> {
    good: u32,
    errors: [u32; N],
}

impl<const N: usize> Counters<N> {
    /// All at 0.
    pub const fn new() -> Self {
        Self { good: 0, errors: [0; N] }
    }

    /// Counts the outcome of a transaction; counters stop at their maximum.
    pub fn record<T, E: Classified>(&mut self, outcome: &Result<T, E>) {
        let counter = match outcome {
            Ok(_) => Some(&mut self.good),
            Err(error) => self.errors.get_mut(error.class_index()),
        };
        if let Some(counter) = counter {
            *counter = counter.saturating_add(1);
        }
    }

    /// Transactions with a sound answer.
    pub const fn good(&self) -> u32 {
        self.good
    }

    /// Transactions that failed in this way.
    #[expect(clippy::needless_pass_by_value, reason = "a class is a byte")]
    pub fn of(&self, class: impl Classified) -> u32 {
        self.errors.get(class.class_index()).copied().unwrap_or(0)
    }

    /// Transactions that failed.
    pub fn errors(&self) -> u32 {
        self.errors.iter().fold(0, |sum, n| sum.saturating_add(*n))
    }

    /// Failed transactions in a million; 0 before the first one.
    pub fn errors_per_million(&self) -> u32 {
        let errors = u64::from(self.errors());
        let all = errors.saturating_add(self.good.into());
        let rate = errors.saturating_mul(1_000_000).checked_div(all).unwrap_or(0);
        u32::try_from(rate).unwrap_or(u32::MAX)
    }
}

impl<const N: usize> Default for Counters<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// A leaky bucket: errors fill it, good transactions drain it, and above its limit the line is unfit for use.
///
/// One error in a hundred thousand transactions is the life of a drive, three in a row is a broken cable. With a
/// `weight` of 100 and a `limit` of 250 the third error in a row is too much, and so is any rate above one in 101.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ErrorRate {
    level: u32,
    weight: u32,
    limit: u32,
}

impl ErrorRate {
    /// An empty bucket. An error adds `weight`, a good transaction takes 1 away.
    pub const fn new(weight: u32, limit: u32) -> Self {
        Self { level: 0, weight, limit }
    }

    /// Counts the outcome of a transaction; whether the limit is passed now.
    pub fn record<T, E>(&mut self, outcome: &Result<T, E>) -> bool {
        self.level = match outcome {
            Ok(_) => self.level.saturating_sub(1),
            Err(_) => self.level.saturating_add(self.weight),
        };
        self.is_exceeded()
    }

    /// What is in the bucket.
    pub const fn level(&self) -> u32 {
        self.level
    }

    /// Whether the limit is passed.
    pub const fn is_exceeded(&self) -> bool {
        self.level > self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy)]
    struct Kind(usize);

    impl Classified for Kind {
        fn class_index(&self) -> usize {
            self.0
        }
    }

    #[test]
    fn every_class_has_its_counter() {
        let mut counters = Counters::<4>::new();
        assert_eq!(counters.errors_per_million(), 0);
        for _ in 0..3 {
            counters.record::<_, Kind>(&Ok(()));
        }
        counters.record::<(), _>(&Err(Kind(2)));
        // A class that has no place is not counted as another one.
        counters.record::<(), _>(&Err(Kind(4)));
        assert_eq!([0, 1, 2, 3, 4].map(|k| counters.of(Kind(k))), [0, 0, 1, 0, 0]);
        assert_eq!((counters.good(), counters.errors(), counters.errors_per_million()), (3, 1, 250_000));
    }

    #[test]
    fn the_bucket_leaks() {
        const BAD: Result<(), ()> = Err(());
        const GOOD: Result<(), ()> = Ok(());
        let mut rate = ErrorRate::new(100, 250);
        assert!(!rate.record(&BAD) && !rate.record(&BAD));
        for _ in 0..60 {
            rate.record(&GOOD);
        }
        assert!(!rate.record(&BAD));
        assert_eq!(rate.level(), 240);
        assert!(rate.record(&BAD));
        for _ in 0..400 {
            rate.record(&GOOD);
        }
        assert_eq!((rate.level(), rate.is_exceeded()), (0, false));
    }
}
