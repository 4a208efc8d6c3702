//! The running disparity from answer to answer.

/// Whether an encoder carries the disparity from one answer to the next, which no document says: the line tells.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Carried {
    kept: u32,
    broken: u32,
}

impl Carried {
    /// Answers that have to go on from each other before it is taken for a rule.
    const LEAST: u32 = 8;
    /// Of so many one may not.
    const OF: u32 = 8;

    /// Two answers followed each other.
    pub(super) fn note(&mut self, goes_on: bool) {
        let count = if goes_on { &mut self.kept } else { &mut self.broken };
        *count += 1;
        if self.kept + self.broken > 4096 {
            (self.kept, self.broken) = (self.kept / 2, self.broken / 2);
        }
    }

    pub(super) fn is_rule(self) -> bool {
        self.kept >= Self::LEAST && self.kept >= Self::OF * self.broken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_what_most_answers_keep() {
        let mut carried = Carried::default();
        (0..7).for_each(|_| carried.note(true));
        assert!(!carried.is_rule());
        carried.note(true);
        assert!(carried.is_rule());
        carried.note(false);
        assert!(carried.is_rule());
        carried.note(false);
        assert!(!carried.is_rule());
        // An encoder that begins anew with each answer is right by chance half of the time.
        let mut anew = Carried::default();
        (0..10_000).for_each(|k| anew.note(k % 2 == 0));
        assert!(!anew.is_rule());
    }
}
