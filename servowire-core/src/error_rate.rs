/// A leaky bucket: errors fill it, good transactions drain it, and while it is above its limit the line must not be used.
///
/// One error in a hundred thousand transactions is normal for a drive; three in a row mean a broken cable. With a
/// `weight` of 100 and a `limit` of 250 the third error in a row is too many, and so is any rate above one in 101.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ErrorRate {
    level: u32,
    weight: u32,
    limit: u32,
}

impl ErrorRate {
    /// Creates an empty bucket. An error adds `weight`, a good transaction takes 1 away.
    pub const fn new(weight: u32, limit: u32) -> Self {
        Self { level: 0, weight, limit }
    }

    /// Counts the outcome of a transaction. Returns whether the limit is now exceeded.
    pub fn record<T, E>(&mut self, outcome: &Result<T, E>) -> bool {
        self.level = match outcome {
            Ok(_) => self.level.saturating_sub(1),
            Err(_) => self.level.saturating_add(self.weight),
        };
        self.is_exceeded()
    }

    /// The present level of the bucket.
    pub const fn level(&self) -> u32 {
        self.level
    }

    /// Returns whether the limit is exceeded.
    const fn is_exceeded(&self) -> bool {
        self.level > self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BAD: Result<(), ()> = Err(());
    const GOOD: Result<(), ()> = Ok(());

    #[test]
    fn the_bucket_leaks() {
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

    #[test]
    fn a_full_bucket_stays_full() {
        let mut rate = ErrorRate::new(u32::MAX - 1, u32::MAX - 2);
        assert!(rate.record(&BAD) && rate.record(&BAD) && rate.record(&BAD));
        assert_eq!(rate.level(), u32::MAX);
        assert!(rate.record(&GOOD) && !rate.record(&GOOD));
    }

    #[test]
    fn the_limit_itself_is_not_exceeded() {
        let mut rate = ErrorRate::new(100, 200);
        assert!(!rate.record(&BAD) && !rate.record(&BAD));
        assert_eq!(rate.level(), 200);
        assert!(!rate.record(&GOOD) && rate.record(&BAD));
    }
}
