//! What nobody can tell of a damaged link, however well he looks.

use std::ops::RangeInclusive;

use super::super::{Said, Shown};
use super::code::{decoded, tells};
use super::symbol;

/// Bits of an answer that the check of the vertical and of the secondary channel covers.
const FIRST: RangeInclusive<u64> = 0..=9;
const LAST: RangeInclusive<u64> = 51..=60;
/// Where the six words begin.
const WORDS: [usize; 6] = [0, 10, 20, 30, 40, 51];

/// An answer of a running link as it went over the line.
#[derive(Debug, Clone)]
pub(super) struct Sent {
    /// Which of all that was said.
    pub(super) said: usize,
    /// Number of its V-frame, and its place there.
    pub(super) v_frame: usize,
    pub(super) at: usize,
    /// The bit that was flipped.
    pub(super) flip: Option<u64>,
    /// As it was sent.
    pub(super) words: [(u8, bool); 6],
    pub(super) line: Vec<bool>,
}

impl Sent {
    /// The word with the flipped bit, and what it is then, if it is in a table.
    fn other_word(&self) -> Option<(usize, (u8, bool))> {
        let flip = usize::try_from(self.flip?).ok()?;
        let word = WORDS.iter().rposition(|begin| *begin <= flip)?;
        let mut bits = self.line.get(WORDS[word]..WORDS[word] + 10)?.to_vec();
        let bit = bits.get_mut(flip - WORDS[word])?;
        *bit = !*bit;
        Some((word, decoded(&bits)?))
    }

    /// Which of the words as sent tell the running disparity.
    fn tells(&self) -> [bool; 6] {
        self.words.map(|(byte, control)| tells(byte, control))
    }
}

/// Whether the checks of a V-frame are there: it is whole, and the one before it was seen to end.
fn is_checked(sent: &[Sent], v_frame: usize) -> bool {
    sent.iter().any(|it| it.v_frame < v_frame && it.at == 7 && it.flip.is_none())
        && sent.iter().filter(|it| it.v_frame == v_frame).count() == 8
}

/// Where the running disparity does not go on from one answer to the next, a bit was flipped after the last word of the one that tells
/// it, or in that, or before the first word of the other that does, or in that. The check of the acceleration says that its two
/// words are sound, that of a V-frame that the first or the last word is; there is none where the V-frame is not there as a
/// whole, or another bit was flipped that the same check covers, and none at all for the other words. Then both may be
/// refused.
pub(super) fn mark(said: &mut [Said], sent: &[Sent]) {
    let fails = |v_frame: usize, bits: RangeInclusive<u64>| {
        let mut of_it = sent.iter().filter(|it| it.v_frame == v_frame);
        !is_checked(sent, v_frame) || of_it.any(|it| it.flip.is_some_and(|at| bits.contains(&at)))
    };
    for pair in sent.windows(2) {
        let [one, next] = pair else { continue };
        match (one.flip, next.flip) {
            (None, Some(_)) => {
                let all_checked = one.tells()[3..].contains(&true);
                said[one.said].damaged |= !all_checked || fails(one.v_frame, LAST);
            }
            (Some(_), None) => {
                let all_checked = next.tells()[0];
                said[next.said].damaged |= !all_checked || fails(next.v_frame, FIRST);
            }
            _ => {}
        }
    }
}

/// A flipped bit may make another word of the code. Where no check covers it, only the running disparity can say so, if the answers
/// beside it are sound. CRC-5 sees each in the acceleration: other words differ in up to five bits that follow each other.
pub(super) fn leave_to_chance(said: &mut [Said], sent: &[Sent]) {
    let is_sound = |at: Option<usize>| at.and_then(|at| sent.get(at)).is_some_and(|it| it.flip.is_none());
    for (at, it) in sent.iter().enumerate() {
        let Some((word, (byte, _))) = it.other_word() else { continue };
        let alone = is_sound(at.checked_sub(1)) && is_sound(Some(at + 1));
        let (name, due) = match word {
            0 if !is_checked(sent, it.v_frame) => ("VERT", Shown::Number(byte.into())),
            5 if !is_checked(sent, it.v_frame) => ("SEC", Shown::Number(byte.into())),
            1 if !alone => ("SYMBOL", Shown::Text(symbol(byte & 31))),
            2 if !alone => ("PIPE", Shown::Number(byte.into())),
            _ => continue,
        };
        for (_, shown) in said[it.said].fields.iter_mut().filter(|(field, _)| *field == name) {
            *shown = Shown::Either(Box::new([shown.clone(), due.clone()]));
        }
    }
}
