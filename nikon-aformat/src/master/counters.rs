use crate::{Error, ErrorClass};

/// How many transactions went well, and how many failed in which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    good: u32,
    errors: [u32; ErrorClass::ALL.len()],
}

impl Counters {
    /// All at 0.
    pub const fn new() -> Self {
        Self { good: 0, errors: [0; ErrorClass::ALL.len()] }
    }

    /// Counts the outcome of a transaction; counters stop at their maximum.
    pub fn record<T>(&mut self, outcome: &Result<T, Error>) {
        let counter = match outcome {
            Ok(_) => Some(&mut self.good),
            Err(error) => self.errors.get_mut(error.class() as usize),
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
    pub fn of(&self, class: ErrorClass) -> u32 {
        self.errors.get(class as usize).copied().unwrap_or(0)
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
    pub fn record<T>(&mut self, outcome: &Result<T, Error>) -> bool {
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

    const BAD: Result<(), Error> = Err(Error::NoResponse);

    #[test]
    fn every_class_has_its_counter() {
        let mut counters = Counters::new();
        assert_eq!(counters.errors_per_million(), 0);
        for _ in 0..3 {
            counters.record(&Ok(()));
        }
        counters.record::<()>(&Err(Error::FixedBit));
        for (k, class) in ErrorClass::ALL.into_iter().enumerate() {
            assert_eq!(class as usize, k);
            assert_eq!(counters.of(class), u32::from(class == ErrorClass::FixedBit));
        }
        assert_eq!((counters.good(), counters.errors(), counters.errors_per_million()), (3, 1, 250_000));
    }

    #[test]
    fn the_bucket_leaks() {
        let mut rate = ErrorRate::new(100, 250);
        assert!(!rate.record(&BAD) && !rate.record(&BAD));
        for _ in 0..60 {
            rate.record(&Ok(()));
        }
        assert!(!rate.record(&BAD));
        assert_eq!(rate.level(), 240);
        assert!(rate.record(&BAD));
        for _ in 0..400 {
            rate.record(&Ok(()));
        }
        assert_eq!((rate.level(), rate.is_exceeded()), (0, false));
    }
}
