//! What nobody can tell of a damaged link, however well he looks.

use std::ops::RangeInclusive;

use super::super::Said;

/// Bits of an answer that the check of the vertical and of the secondary channel covers.
const FIRST: RangeInclusive<u64> = 0..=9;
const LAST: RangeInclusive<u64> = 51..=60;

/// An answer of a running link as it went over the line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    /// Which of all that was said.
    pub(super) said: usize,
    /// Number of its V-frame, and its place there.
    pub(super) v_frame: usize,
    pub(super) at: usize,
    /// The bit that was flipped.
    pub(super) flip: Option<u64>,
}

/// Where the running disparity does not go on from one answer to the next, a bit was flipped at the end of the one or at the front
/// of the other. Only the check of the V-frame that holds the sound one can say that it is sound: there is none where that
/// V-frame is not there as a whole, or another bit was flipped that the same check covers. Then both may be refused.
pub(super) fn mark(said: &mut [Said], sent: &[Sent]) {
    let is_known = |v_frame: usize| sent.iter().any(|it| it.v_frame < v_frame && it.at == 7 && it.flip.is_none());
    let fails = |v_frame: usize, bits: RangeInclusive<u64>| {
        let of_it = || sent.iter().filter(|it| it.v_frame == v_frame);
        of_it().count() < 8 || !is_known(v_frame) || of_it().any(|it| it.flip.is_some_and(|at| bits.contains(&at)))
    };
    for pair in sent.windows(2) {
        let [one, next] = *pair else { continue };
        match (one.flip, next.flip) {
            (None, Some(at)) if FIRST.contains(&at) => said[one.said].damaged |= fails(one.v_frame, LAST),
            (Some(at), None) if LAST.contains(&at) => said[next.said].damaged |= fails(next.v_frame, FIRST),
            _ => {}
        }
    }
}
