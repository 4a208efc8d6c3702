//! For tools: looks at an answer or a head that was refused, lists everything that is wrong with it and guesses the cause.
//!
//! A receiver judges channel by channel and continues; a person at a bench wants to know what happened to the whole answer. Here
//! all words are checked, as is the running disparity between them, and the usual mistakes (swapped wires, some bits early or
//! late, half the rate) are undone one by one: the mistake without which the answer is sound is the cause.
//!
//! ```
//! use hdsl::Window;
//! use hdsl::inspect::{Cause, Expected, LineCause, inspect};
//!
//! let wire = "1001100101010110010000111110000110011001101101010100010100101";
//! let bits = wire.bytes().rev().fold(0, |line, bit| line << 1 | u128::from(bit & 1));
//! let line = Window::from_bits(bits, 61).ok_or("61 bits")?;
//! let report = inspect(Expected::Normal { at: None }, line);
//! assert_eq!((report.error(), report.cause()), (None, None));
//!
//! // A and B exchanged: every level is inverted.
//! let report = inspect(Expected::Normal { at: None }, line.inverted());
//! assert_eq!(report.cause(), Some(Cause::Line(LineCause::LineInverted)));
//! // As it would be without that.
//! assert_eq!(report.answer().map(|answer| answer.vertical().byte()), Some(Ok(0x59)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod disparity;
mod head;
mod rules;

use nrz_line::{Search, Window};

use crate::answer::Answer;
use crate::encoder_id::EncoderId;
use crate::error::{Error, ErrorClass};
use crate::frame::ANSWER_BITS;
use crate::parameter::EncoderByte;
use crate::sampling::TEST_PATTERN;
use crate::symbol::{Control, Reading, Rule};

pub use disparity::Chain;
pub use head::{
    FRONT_BITS, FoundHead, HeadDamage, HeadFault, ends_with_stuffing, ends_with_trailer, find_head, head_damage,
};
pub use nrz_line::Cause as LineCause;
pub use rules::{Beginnings, BrokenRule, HeadRules};

/// The kind of answer to a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Expected {
    /// The test pattern: START, LEARN and CHECK.
    TestPattern,
    /// The encoder identifier: IDREQ.
    Identifier,
    /// An answer of a running link.
    Normal {
        /// Its place in the V-frame, 0..=7, if that is known.
        at: Option<u8>,
    },
}

/// What most likely went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// The line itself was damaged, or is connected or read in the wrong way.
    Line(LineCause),
    /// The test pattern, although something else was requested.
    TestPattern,
}

servowire_core::one_line!(Cause {
    Self::Line(cause) => "{}", cause;
    Self::TestPattern => "this is the test pattern: the encoder has not heard what it was asked for";
});

/// The result of an inspection of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report {
    error: Option<Error>,
    findings: Findings,
    cause: Option<Cause>,
    disparity: Chain,
    answer: Option<Answer>,
}

servowire_core::report! {
    Self { disparity, .. } if !disparity.holds() => "all words are valid, but cannot follow one another";
    _ => "sound";
}

impl Report {
    /// What the words say about the running disparity. If there is no other fault but the disparity is violated, bits of at
    /// least one word were flipped.
    pub const fn disparity(&self) -> Chain {
        self.disparity
    }

    /// The answer as received if nothing is wrong, otherwise as it would be with the cause removed. It is for display only.
    pub const fn answer(&self) -> Option<Answer> {
        self.answer
    }
}

/// Inspects line bits that should begin with such an answer; with more than its 61 bits, a late answer can be found.
pub fn inspect(expected: Expected, line: Window) -> Report {
    let answer = Answer::parse(Rule::Strict, line);
    let error = answer.map_or_else(Some, |answer| wrong(expected, answer));
    let (cause, undone) = if error.is_some() { diagnose(expected, line) } else { (None, None) };
    let sound = answer.ok().filter(|_| error.is_none());
    Report {
        error,
        findings: answer.map_or_else(of_one, |answer| findings(expected, answer)),
        cause,
        disparity: Chain::of(low(line)),
        answer: undone.or(sound),
    }
}

/// Every word, the switch bit, the check of the acceleration and the disparity are good: the best [`score`] except that of the
/// test pattern.
pub const PERFECT: usize = 12;

/// Returns how well an answer fits at the start of this line: a point for each good word, more for its checks, and most for the
/// test pattern. A perfect answer is where it should be; with a damaged one, some words may happen to fit one bit away.
pub fn score(line: Window) -> usize {
    let Ok(answer) = Answer::parse(Rule::Strict, line) else { return 0 };
    if answer.bits() == TEST_PATTERN {
        return 20;
    }
    let words = answer.words().iter().filter(|word| !word.is_byte_error()).count();
    let disparity = if Chain::of(answer.bits()).holds() { 3 } else { 0 };
    let checks = usize::from(answer.switch_ok()).wrapping_add(if answer.delta_delta().is_ok() { 2 } else { 0 });
    words.wrapping_add(checks).wrapping_add(disparity)
}

fn low(line: Window) -> u64 {
    let [a, b, c, d, e, f, g, h, ..] = line.bits().to_le_bytes();
    u64::from_le_bytes([a, b, c, d, e, f, g, h])
}

/// Returns why an answer is refused.
fn wrong(expected: Expected, answer: Answer) -> Option<Error> {
    match expected {
        Expected::TestPattern => (answer.bits() != TEST_PATTERN).then_some(Error::Pattern),
        Expected::Identifier => EncoderId::from_answer(answer).err(),
        Expected::Normal { at } => faults(answer, at).into_iter().flatten().next(),
    }
}

fn findings(expected: Expected, answer: Answer) -> Findings {
    match expected {
        Expected::Normal { at } => {
            let mut found = Findings::NONE;
            faults(answer, at).into_iter().flatten().for_each(|error| found.insert(error.class()));
            found
        }
        _ => wrong(expected, answer).map_or(Findings::NONE, of_one),
    }
}

fn of_one(error: Error) -> Findings {
    let mut found = Findings::NONE;
    found.insert(error.class());
    found
}

/// Returns what is wrong with an answer of a running link, in the order in which it is reported.
///
/// D28.y and K28.y differ in one bit of the line, so an unexpected special character is a flipped bit.
fn faults(answer: Answer, at: Option<u8>) -> [Option<Error>; 4] {
    let bad_word = answer.words().into_iter().find_map(|word| word.byte().err());
    // The position has five bytes, and five times the same special character where there is none.
    let position = at.is_none_or(|at| (1..=5).contains(&at));
    let (vertical, secondary) = (answer.vertical(), answer.secondary());
    let status = at.is_none_or(|at| at == 0) && is_k28(secondary);
    let kinds = [
        (vertical, position && vertical.is(Control::K29_7)),
        (answer.parameter_word(), false),
        (secondary, position && secondary.is(Control::K27_7) || status),
    ];
    let stranger = kinds.into_iter().find(|(word, due)| word.is_special() && !due);
    let wrong_kind = stranger.and_then(|(word, _)| word.byte().ok()).map(|byte| Error::WrongKind { byte });
    let symbol = answer.parameter().and_then(EncoderByte::symbol).err();
    [bad_word, wrong_kind, answer.delta_delta().err(), symbol]
}

fn is_k28(word: Reading) -> bool {
    word.is_special() && word.byte().is_ok_and(|byte| byte & 31 == 28)
}

/// Returns the answer, if nothing is wrong with it.
fn sound(expected: Expected, line: Window) -> Option<Answer> {
    let answer = Answer::parse(Rule::Strict, line).ok()?;
    let whole = wrong(expected, answer).is_none();
    let holds = expected == Expected::TestPattern || answer.switch_ok() && Chain::of(answer.bits()).holds();
    (whole && holds).then_some(answer)
}

/// Looks for the usual mistakes; returns the one found, and the answer without it.
fn diagnose(expected: Expected, line: Window) -> (Option<Cause>, Option<Answer>) {
    let begin = Window::from_bits(line.bits(), line.len().min(ANSWER_BITS)).unwrap_or(line);
    if let Some(stuck) = LineCause::stuck(begin) {
        return (Some(stuck.into()), None);
    }
    if sound(Expected::TestPattern, line).is_some() {
        return (Some(Cause::TestPattern), None);
    }
    let search = Search::new().with_late_bits(12).with_early_bits(3);
    if let Some(found) = search.find(line, |line| sound(expected, line)) {
        return (Some(found.cause.into()), found.message);
    }
    let damaged = score(line) >= PERFECT / 2;
    (damaged.then_some(LineCause::Disturbed.into()), None)
}

#[cfg(test)]
mod tests;
