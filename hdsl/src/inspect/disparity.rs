//! The running disparity, from word to word of an answer and from answer to answer.

use crate::symbol::{RunningDisparity, Word};

/// What the words of an answer say of the running disparity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Chain {
    before: Option<RunningDisparity>,
    after: Option<RunningDisparity>,
    holds: bool,
}

impl Chain {
    /// Of the 61 bits of an answer, the first in bit 0.
    pub fn of(line: u64) -> Self {
        let words = [0, 10, 20, 30, 40, 51].map(|at| {
            let [low, high, ..] = (line >> at).to_le_bytes();
            Word::truncate(u16::from_le_bytes([low, high]))
        });
        let end = |before: RunningDisparity| {
            words.into_iter().try_fold(before, |rd, word| word.is_in(rd).then(|| rd.after(word)))
        };
        let (minus, plus) = (end(RunningDisparity::Minus), end(RunningDisparity::Plus));
        let before = match (minus, plus) {
            (Some(_), None) => Some(RunningDisparity::Minus),
            (None, Some(_)) => Some(RunningDisparity::Plus),
            _ => None,
        };
        Self { before, after: before.and(minus.or(plus)), holds: minus.or(plus).is_some() }
    }

    /// Whether each word stands in the column that the words before it leave.
    pub const fn holds(self) -> bool {
        self.holds
    }

    /// Before the first word, where the words tell.
    pub const fn before(self) -> Option<RunningDisparity> {
        self.before
    }

    /// After the last word, where the words tell.
    pub const fn after(self) -> Option<RunningDisparity> {
        self.after
    }

    /// Whether `next` begins where this ends; `None` where one of the two does not tell.
    pub fn goes_on_in(self, next: Self) -> Option<bool> {
        Some(self.after? == next.before?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use RunningDisparity::{Minus, Plus};

    /// Words in the order of the line, abcdei fghj; the switch bit after the fifth.
    fn chain(words: [&str; 6]) -> Chain {
        let mut text = words[..5].concat();
        text.push(if text.ends_with('1') { '0' } else { '1' });
        text.push_str(words[5]);
        Chain::of(text.bytes().rev().fold(0, |bits, bit| bits << 1 | u64::from(bit == b'1')))
    }

    /// D21.5 is the same in both columns, D16.0 (IDLE) has a word in each, and none of them changes the disparity.
    const NEUTRAL: &str = "1010101010";
    const IDLE_MINUS: &str = "0110110100";
    const IDLE_PLUS: &str = "1001001011";
    /// D3.0 in column -, which leaves +, and in column +, which leaves -.
    const UP: &str = "1100011011";
    const DOWN: &str = "1100010100";

    #[test]
    fn the_column_of_a_word_tells_both_ends() {
        let neutral = chain([NEUTRAL; 6]);
        assert_eq!((neutral.before(), neutral.after(), neutral.holds()), (None, None, true));
        let idle = chain([NEUTRAL, IDLE_MINUS, NEUTRAL, NEUTRAL, NEUTRAL, NEUTRAL]);
        assert_eq!((idle.before(), idle.after(), idle.holds()), (Some(Minus), Some(Minus), true));
        let up = chain([NEUTRAL, IDLE_MINUS, NEUTRAL, UP, NEUTRAL, NEUTRAL]);
        assert_eq!((up.before(), up.after(), up.holds()), (Some(Minus), Some(Plus), true));
        let next = chain([NEUTRAL, IDLE_PLUS, DOWN, NEUTRAL, NEUTRAL, NEUTRAL]);
        assert_eq!((next.before(), next.after(), next.holds()), (Some(Plus), Some(Minus), true));
        assert_eq!((up.goes_on_in(next), next.goes_on_in(next)), (Some(true), Some(false)));
        assert_eq!((up.goes_on_in(neutral), neutral.goes_on_in(up)), (None, None));
    }

    #[test]
    fn two_words_of_one_sign_do_not_follow_each_other() {
        let wrong = chain([NEUTRAL, UP, NEUTRAL, UP, NEUTRAL, NEUTRAL]);
        assert_eq!((wrong.before(), wrong.after(), wrong.holds()), (None, None, false));
        assert!(chain([NEUTRAL, UP, NEUTRAL, DOWN, NEUTRAL, NEUTRAL]).holds());
    }
}
