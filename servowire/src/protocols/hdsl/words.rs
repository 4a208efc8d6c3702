//! The words of an answer, each by what its channel carries.

use hdsl::symbol::{Control, Reading};
use hdsl::{Answer, Error};

use super::{Refused, refusal};

/// Why an answer is refused by its words; `at`: its place in the V-frame.
///
/// D28.y and K28.y differ in one bit of the line, so a control character where none is due is a flipped bit.
pub(super) fn wrong(answer: Answer, at: Option<u8>) -> Option<Refused> {
    if let Some(error) = answer.words().into_iter().find_map(|word| word.byte().err()) {
        return Some(refusal(error));
    }
    // The position has five bytes, and five times the same control character where there is none.
    let position = at.is_none_or(|at| (1..=5).contains(&at));
    let vertical = answer.vertical();
    let secondary = answer.secondary();
    let kinds = [
        (vertical, position && vertical.is(Control::K29_7)),
        (answer.parameter_word(), false),
        (secondary, position && secondary.is(Control::K27_7) || at.is_none_or(|at| at == 0) && is_k28(secondary)),
    ];
    let stranger = kinds.into_iter().find(|(word, due)| word.is_special() && !due);
    if let Some(byte) = stranger.and_then(|(word, _)| word.byte().ok()) {
        return Some(refusal(Error::WrongKind { byte }));
    }
    answer.delta_delta().err().or(answer.parameter().and_then(hdsl::EncoderByte::symbol).err()).map(refusal)
}

fn is_k28(word: Reading) -> bool {
    word.is_special() && word.byte().is_ok_and(|byte| byte & 31 == 28)
}
