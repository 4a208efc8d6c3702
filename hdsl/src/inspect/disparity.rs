//! The running disparity, from word to word of an answer and from answer to answer.

use crate::symbol::{RunningDisparity, Word};

/// What the words of an answer say about the running disparity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Chain {
    before: Option<RunningDisparity>,
    after: Option<RunningDisparity>,
    holds: bool,
    /// The first word that determines the disparity and the last one, 0..=5.
    first: u8,
    last: u8,
}

impl Chain {
    /// Evaluates the 61 bits of an answer, the first in bit 0.
    pub fn of(line: u64) -> Self {
        let words = [0, 10, 20, 30, 40, 51].map(|at| {
            let [low, high, ..] = (line >> at).to_le_bytes();
            Word::truncate(u16::from_le_bytes([low, high]))
        });
        let mut chain = Self { before: None, after: None, holds: true, first: 5, last: 0 };
        // After the last word that told; words that did, and whether one was in no table before them.
        let (mut last, mut told, mut spoilt) = (None, 0_u8, false);
        for (word, at) in words.into_iter().zip(0_u8..) {
            let column = match (word.is_in(RunningDisparity::Minus), word.is_in(RunningDisparity::Plus)) {
                (true, true) => continue,
                (true, false) => RunningDisparity::Minus,
                (false, true) => RunningDisparity::Plus,
                (false, false) => {
                    (chain.after, chain.holds, last, spoilt) = (None, false, None, true);
                    continue;
                }
            };
            let breaks = last.is_some_and(|last| last != column);
            chain.first = if told == 0 { at } else { chain.first };
            chain.last = at;
            // Where two words do not go together either may be the wrong one.
            chain.before = match told {
                0 => (!spoilt).then_some(column),
                1 if breaks => None,
                _ => chain.before,
            };
            last = Some(column.after(word));
            chain.after = last.filter(|_| !breaks);
            chain.holds &= !breaks;
            told = told.saturating_add(1);
        }
        chain
    }

    /// Returns whether each word is in the column required by the words before it.
    pub const fn holds(self) -> bool {
        self.holds
    }

    /// The running disparity before the first word, if the words determine it; this includes the words before a damaged one.
    pub const fn before(self) -> Option<RunningDisparity> {
        self.before
    }

    /// The running disparity after the last word, if the words determine it; this includes the words after a damaged one.
    pub const fn after(self) -> Option<RunningDisparity> {
        self.after
    }

    /// The first word that determines the disparity, 0..=5. If the answer does not begin with the disparity with which the one
    /// before ended, and the fault is in this answer, it is in this word or in an earlier one. If no word determines the
    /// disparity, this is the last word.
    pub const fn first_decisive(self) -> u8 {
        self.first
    }

    /// The last word that determines the disparity, 0..=5. If the next answer does not begin with the disparity with which this
    /// one ends, and the fault is in this answer, it is in this word or in a later one. If no word determines the disparity,
    /// this is the first word.
    pub const fn last_decisive(self) -> u8 {
        self.last
    }

    /// Returns whether `next` begins with the disparity with which this one ends; `None` if either is unknown.
    pub fn continues_into(self, next: Self) -> Option<bool> {
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
        assert_eq!((neutral.first_decisive(), neutral.last_decisive()), (5, 0));
        assert_eq!((idle.first_decisive(), idle.last_decisive()), (1, 1));
        assert_eq!((up.first_decisive(), up.last_decisive()), (1, 3));
        assert_eq!((up.continues_into(next), next.continues_into(next)), (Some(true), Some(false)));
        assert_eq!((up.continues_into(neutral), neutral.continues_into(up)), (None, None));
    }

    #[test]
    fn two_words_of_one_sign_do_not_follow_each_other() {
        let wrong = chain([NEUTRAL, UP, NEUTRAL, UP, NEUTRAL, NEUTRAL]);
        assert_eq!((wrong.before(), wrong.after(), wrong.holds()), (None, None, false));
        assert!(chain([NEUTRAL, UP, NEUTRAL, DOWN, NEUTRAL, NEUTRAL]).holds());
    }

    /// Two words before the fault, or after it, tell what is there.
    #[test]
    fn a_damaged_answer_tells_its_ends_where_they_are_sound() {
        const NO_WORD: &str = "1111111111";
        let ends = |words| {
            let chain = chain(words);
            assert!(!chain.holds());
            (chain.before(), chain.after())
        };
        assert_eq!(ends([UP, NO_WORD, NEUTRAL, NEUTRAL, NEUTRAL, DOWN]), (Some(Minus), Some(Minus)));
        assert_eq!(ends([NO_WORD, UP, NEUTRAL, NEUTRAL, NEUTRAL, NEUTRAL]), (None, Some(Plus)));
        assert_eq!(ends([UP, NEUTRAL, NEUTRAL, NEUTRAL, NEUTRAL, NO_WORD]), (Some(Minus), None));
        assert_eq!(ends([UP, DOWN, DOWN, NEUTRAL, NEUTRAL, NEUTRAL]), (Some(Minus), None));
        assert_eq!(ends([UP, UP, DOWN, NEUTRAL, NEUTRAL, NEUTRAL]), (None, Some(Minus)));
    }
}
