//! Remarks on good frames whose values are valid but implausible, and on the probable damage to bad frames.

use crate::event::{Place, Position};
use crate::time::Time;

/// Turns per second that no servo motor reaches: 30,000 rpm.
const FASTEST: f64 = 500.0;
/// Consecutive moves below that after which a move above it is mentioned. If positions jump from one frame to the next, the
/// times or the resolution are not what they seem.
const CALM: u32 = 8;

/// Follows the position of an encoder.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    last: Option<(Time, Position)>,
    calm: u32,
}

impl Motion {
    /// Takes the next position; returns what is implausible about it.
    pub(super) fn note(&mut self, place: Place, position: Position) -> Option<String> {
        let Place::Time { start: time, .. } = place else { return None };
        let same = |before: &(Time, Position)| {
            (before.1.span, before.1.per_turn) == (position.span, position.per_turn) && time > before.0
        };
        let before = self.last.replace((time, position)).filter(same)?;
        let per_turn = position.per_turn? as f64;
        let turns = position.moved_from(&before.1) as f64 / per_turn;
        let seconds = (time - before.0) as f64 / 1e12;
        if turns.abs() <= FASTEST * seconds {
            self.calm = self.calm.saturating_add(1);
            return None;
        }
        if self.calm < CALM {
            self.calm = 0;
            return None;
        }
        // The jump back from a wrong position is the second of two.
        self.calm -= CALM / 2;
        Some(format!("moved {turns:+.4} turns in {:.1} us, faster than any motor turns", seconds * 1e6))
    }
}

/// Returns whether one bit more, or one less, makes a frame of `len` bits sound; `raw` holds the bits on the line, the
/// first in bit 0.
pub(super) fn slipped_bit(raw: u128, len: u32, sound: impl Fn(u128) -> bool) -> Option<&'static str> {
    let mask = 1_u128.checked_shl(len)? - 1;
    if raw == 0 {
        return None;
    }
    (1..len).find_map(|at| {
        let low = raw & ((1 << at) - 1);
        let more = |bit: u128| (low | bit << at | raw >> at << (at + 1)) & mask;
        if sound(more(0)) || sound(more(1)) {
            return Some(LOST);
        }
        sound((low | raw >> (at + 1) << at) & mask).then_some("a bit was doubled or inserted on the line")
    })
}

/// Joins the bits of a line and those that begin at its bit `at`, the first in bit 0; undriven bits are 1.
pub(super) fn joined(bits: u128, behind: u128, at: i64) -> u128 {
    let at = u32::try_from(at).unwrap_or(u32::MAX);
    let below = 1_u128.checked_shl(at).map_or(u128::MAX, |one| one - 1);
    bits & (behind.checked_shl(at).unwrap_or(u128::MAX) | below)
}

/// The remark on an answer that is one bit short.
pub(super) const LOST: &str = "a bit was lost on the line";

/// The remark on an answer that ends early.
pub(super) const CUT: &str = "it was cut short: the encoder stopped, or the line was switched";

/// Number of high bits at the end of a whole answer that suggest an idle line rather than its check field.
pub(super) const CUT_BITS: u32 = 5;
/// This many are an idle line even if flipping, removing or adding one bit would make a frame with an eight-bit check
/// sound: that is so for a quarter of all cut frames.
pub(super) const SURELY_CUT_BITS: u32 = 9;

/// Why a request got no answer when the next one came `after` picoseconds later: no master waits that briefly.
pub(super) fn two_masters(after: i64) -> String {
    let after = after as f64 / 1e6;
    format!("another request came {after:.1} us later, before the answer was due to be over: two masters on the line?")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One turn has 1000 counts, 125 us lie between positions.
    fn notes(counts: &[i64]) -> Vec<usize> {
        let mut motion = Motion::default();
        let noted = |(k, counts): (usize, &i64)| {
            let start = Time::from_ps(k as i128 * 125_000_000);
            let position = Position { name: "ABS", counts: *counts, span: Some(1 << 16), per_turn: Some(1000) };
            motion.note(Place::Time { start, end: start + 1 }, position).map(|_| k)
        };
        counts.iter().enumerate().filter_map(noted).collect()
    }

    #[test]
    fn a_jump_out_of_a_calm_motion_is_noted_and_the_way_back() {
        let mut counts: Vec<i64> = (0..30).map(|k| 10 * k).collect();
        assert_eq!(notes(&counts), [0; 0]);
        counts[20] += 128;
        assert_eq!(notes(&counts), [20, 21]);
        // 30,000 rpm are 62.5 counts in 125 us.
        let fast: Vec<i64> = (0..30).map(|k| 62 * k).collect();
        assert_eq!(notes(&fast), [0; 0]);
    }

    #[test]
    fn where_everything_jumps_nothing_is_noted() {
        let counts: Vec<i64> = (0..40).map(|k| k * 7919 % 1000).collect();
        assert_eq!(notes(&counts), [0; 0]);
    }

    #[test]
    fn a_bit_more_or_less() {
        let good = 0b1011_0111_0010_u128;
        let sound = |bits: u128| bits == good;
        // Bit 5 is missing; a bit was inserted at 3; the frame is sound.
        assert_eq!(slipped_bit(0b101_1011_0010, 12, sound), Some("a bit was lost on the line"));
        assert_eq!(slipped_bit(0b1_0110_1110_1010, 12, sound), Some("a bit was doubled or inserted on the line"));
        assert_eq!(slipped_bit(0b1111, 12, sound), None);
        assert_eq!(slipped_bit(0, 12, sound), None);
    }
}
