//! The running disparity, from word to word of an answer and from answer to answer.

use hdsl::Window;
use hdsl::symbol::{RunningDisparity, Word};

/// What the words of an answer say of the running disparity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Chain {
    /// Before the first word, where the words tell.
    before: Option<RunningDisparity>,
    /// Behind the last word, where the words tell.
    after: Option<RunningDisparity>,
    /// Whether each word stands in the column that the words before it leave.
    pub(super) holds: bool,
}

impl Chain {
    /// Of an answer, its first bit in bit 0.
    pub(super) fn of(line: Window) -> Self {
        let bits = line.bits();
        let words = [0, 10, 20, 30, 40, 51].map(|at| Word::truncate((bits >> at) as u16));
        let end = |before: RunningDisparity| {
            words.into_iter().try_fold(before, |rd, word| {
                let after = if word.disparity() == 0 { rd } else { rd.other() };
                word.is_in(rd).then_some(after)
            })
        };
        let (minus, plus) = (end(RunningDisparity::Minus), end(RunningDisparity::Plus));
        let before = match (minus, plus) {
            (Some(_), None) => Some(RunningDisparity::Minus),
            (None, Some(_)) => Some(RunningDisparity::Plus),
            _ => None,
        };
        Self { before, after: before.and(minus.or(plus)), holds: minus.or(plus).is_some() }
    }

    /// Whether `next` begins where this ends; none where one of the two does not tell.
    pub(super) fn goes_on_in(self, next: Self) -> Option<bool> {
        Some(self.after? == next.before?)
    }
}

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

    /// Words in the order of the line, abcdei fghj; the switch bit after the fifth.
    fn line(words: [&str; 6]) -> Window {
        let mut text = words[..5].concat();
        text.push(if text.ends_with('1') { '0' } else { '1' });
        text.push_str(words[5]);
        let bits = text.bytes().rev().fold(0, |bits, bit| bits << 1 | u128::from(bit == b'1'));
        Window::from_bits(bits, 61).unwrap()
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
        use RunningDisparity::{Minus, Plus};
        let neutral = Chain::of(line([NEUTRAL; 6]));
        assert_eq!(neutral, Chain { before: None, after: None, holds: true });
        let idle = Chain::of(line([NEUTRAL, IDLE_MINUS, NEUTRAL, NEUTRAL, NEUTRAL, NEUTRAL]));
        assert_eq!(idle, Chain { before: Some(Minus), after: Some(Minus), holds: true });
        let up = Chain::of(line([NEUTRAL, IDLE_MINUS, NEUTRAL, UP, NEUTRAL, NEUTRAL]));
        assert_eq!(up, Chain { before: Some(Minus), after: Some(Plus), holds: true });
        let next = Chain::of(line([NEUTRAL, IDLE_PLUS, DOWN, NEUTRAL, NEUTRAL, NEUTRAL]));
        assert_eq!(next, Chain { before: Some(Plus), after: Some(Minus), holds: true });
        assert_eq!((up.goes_on_in(next), next.goes_on_in(next)), (Some(true), Some(false)));
        assert_eq!((up.goes_on_in(neutral), neutral.goes_on_in(up)), (None, None));
    }

    #[test]
    fn two_words_of_one_sign_do_not_follow_each_other() {
        let wrong = Chain::of(line([NEUTRAL, UP, NEUTRAL, UP, NEUTRAL, NEUTRAL]));
        assert_eq!(wrong, Chain { before: None, after: None, holds: false });
        assert!(Chain::of(line([NEUTRAL, UP, NEUTRAL, DOWN, NEUTRAL, NEUTRAL])).holds);
    }

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
