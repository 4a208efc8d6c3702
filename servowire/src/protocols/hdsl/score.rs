//! How well an answer stands where it was looked for.

use hdsl::frame::ANSWER_BITS;
use hdsl::sampling::TEST_PATTERN;
use hdsl::{Answer, Rule, Window};

use super::disparity::Chain;

/// Every word, the switch bit, the check of the acceleration and the disparity hold.
pub(super) const PERFECT: usize = 12;

/// How well an answer stands here: good words, switch bit, check of the acceleration; most for the test pattern.
pub(super) fn score(line: Window) -> usize {
    let Ok(answer) = Answer::parse(Rule::Strict, line) else { return 0 };
    if line.bits() as u64 & ((1 << ANSWER_BITS) - 1) == TEST_PATTERN {
        return 20;
    }
    let words = answer.words().iter().filter(|word| !word.is_byte_error()).count();
    let disparity = if Chain::of(line).holds { 3 } else { 0 };
    words + usize::from(answer.switch_ok()) + if answer.delta_delta().is_ok() { 2 } else { 0 } + disparity
}
