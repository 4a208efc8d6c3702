use nrz_line::{BitOrder, Window};

use crate::crc::next;
use crate::layout::{DELIMITER, FRAME_BITS, MAX_FRAMES, START};

/// The content bits of a response, 16 per frame and back to back, in the words of a 32-bit core: the first on the line in bit 0
/// of the first word. Everything after the last frame is 0.
pub(crate) type Contents = [u32; 3];

/// A response of `FRAMES` frames. Because the number is known at compile time, every mask and shift is a constant and there is
/// no loop, so the code is equally fast at any optimisation level.
struct Of<const FRAMES: usize>;

impl<const FRAMES: usize> Of<FRAMES> {
    #[expect(clippy::cast_possible_truncation, reason = "6 at most")]
    const LINE_BITS: u32 = (FRAMES as u32).wrapping_mul(FRAME_BITS);
    const ALL: u128 = (1_u128.wrapping_shl(Self::LINE_BITS)).wrapping_sub(1);
    const FRAMING: [u32; 4] = quarters((START | DELIMITER) & Self::ALL);
    const FRAMED: [u32; 4] = quarters(DELIMITER & Self::ALL);

    /// Extracts the content bits at the start of a piece of line, and a number that is non-zero if any start bit or delimiter is
    /// wrong; `None` if the line is too short.
    #[inline(always)]
    fn from_line(line: &Window) -> Option<(Contents, u32)> {
        if line.len() < Self::LINE_BITS { None } else { Some(Self::from_bits(line.bits())) }
    }

    #[inline(always)]
    fn from_bits(bits: u128) -> (Contents, u32) {
        let [w0, w1, w2, w3] = quarters(bits);
        let ([m0, m1, m2, m3], [f0, f1, f2, f3]) = (Self::FRAMING, Self::FRAMED);
        let wrong = (w0 & m0 ^ f0) | (w1 & m1 ^ f1) | (w2 & m2 ^ f2) | (w3 & m3 ^ f3);
        let contents =
            [pair(w0 >> 1, w0 >> 19 | w1 << 13), pair(w1 >> 5, w1 >> 23 | w2 << 9), pair(w2 >> 9, w2 >> 27 | w3 << 5)];
        (Self::cut(contents), wrong)
    }

    /// Does the same from one word for each frame.
    #[inline(always)]
    fn from_words(words: &[u16], order: BitOrder) -> Option<(Contents, u32)> {
        let words = words.first_chunk::<FRAMES>()?;
        let word = |at: usize| u32::from(words.get(at).copied().unwrap_or(0));
        let line_order = |pair: u32| match order {
            BitOrder::LsbFirst => pair,
            BitOrder::MsbFirst => pair.reverse_bits().rotate_left(16),
        };
        let both = |at: usize| line_order(word(at) | word(at.wrapping_add(1)) << 16);
        Some(([both(0), both(2), both(4)], 0))
    }

    /// The number of frames of the response.
    #[inline(always)]
    const fn cut([p0, p1, p2]: Contents) -> Contents {
        match FRAMES {
            2 => [p0, 0, 0],
            3 => [p0, p1 & 0xffff, 0],
            4 => [p0, p1, 0],
            5 => [p0, p1, p2 & 0xffff],
            _ => [p0, p1, p2],
        }
    }

    /// Computes the CRC-8 over all frames, including the check field; the result is 0 if the check field is right.
    #[inline(always)]
    fn crc([p0, p1, p2]: Contents) -> u32 {
        let two = four_bytes(0, p0);
        u32::from(match FRAMES {
            2 => two,
            3 => two_bytes(two, p1),
            4 => four_bytes(two, p1),
            5 => two_bytes(four_bytes(two, p1), p2),
            _ => four_bytes(four_bytes(two, p1), p2),
        })
    }

    #[inline(always)]
    fn checked((contents, wrong): (Contents, u32)) -> (Contents, u32) {
        (contents, wrong | Self::crc(contents))
    }
}

/// Extracts the content bits at the start of a piece of line, if it is long enough and all start bits and delimiters are right.
pub(crate) fn framed(frames: u8, line: &Window) -> Option<Contents> {
    let (contents, wrong) = match frames {
        1 => Of::<1>::from_line(line),
        2 => Of::<2>::from_line(line),
        3 => Of::<3>::from_line(line),
        4 => Of::<4>::from_line(line),
        5 => Of::<5>::from_line(line),
        _ => Of::<6>::from_line(line),
    }?;
    if wrong == 0 { Some(contents) } else { None }
}

/// Extracts the content bits at the start of a piece of line, if it is long enough, and a number that is 0 if all start bits and
/// delimiters and the CRC-8 are right.
#[inline(always)]
pub(crate) fn sound_line(frames: u8, line: &Window) -> Option<(Contents, u32)> {
    match frames {
        2 => Of::<2>::from_line(line).map(Of::<2>::checked),
        3 => Of::<3>::from_line(line).map(Of::<3>::checked),
        4 => Of::<4>::from_line(line).map(Of::<4>::checked),
        5 => Of::<5>::from_line(line).map(Of::<5>::checked),
        _ => Of::<6>::from_line(line).map(Of::<6>::checked),
    }
}

/// Does the same for four frames, from line bits of which the first is in bit 0.
#[inline(always)]
pub(crate) fn sound_four(bits: u128) -> (Contents, u32) {
    Of::<4>::checked(Of::<4>::from_bits(bits))
}

/// Does the same for four frames, from the content bits of each.
#[inline(always)]
pub(crate) fn sound_four_words(words: &[u16], order: BitOrder) -> Option<(Contents, u32)> {
    Of::<4>::from_words(words, order).map(Of::<4>::checked)
}

/// Does the same from words, each with the content bits of one frame.
#[inline(always)]
pub(crate) fn sound_words(frames: u8, words: &[u16], order: BitOrder) -> Option<(Contents, u32)> {
    match frames {
        2 => Of::<2>::from_words(words, order).map(Of::<2>::checked),
        3 => Of::<3>::from_words(words, order).map(Of::<3>::checked),
        4 => Of::<4>::from_words(words, order).map(Of::<4>::checked),
        5 => Of::<5>::from_words(words, order).map(Of::<5>::checked),
        _ => Of::<6>::from_words(words, order).map(Of::<6>::checked),
    }
}

/// Returns the content bits as one word for each frame.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the halves of a word")]
pub(crate) const fn apart([p0, p1, p2]: Contents) -> [u16; MAX_FRAMES as usize] {
    [p0 as u16, (p0 >> 16) as u16, p1 as u16, (p1 >> 16) as u16, p2 as u16, (p2 >> 16) as u16]
}

/// Joins one word for each frame to content bits.
#[inline(always)]
pub(crate) const fn together([c0, c1, c2, c3, c4, c5]: [u16; MAX_FRAMES as usize]) -> Contents {
    [pair(c0 as u32, c1 as u32), pair(c2 as u32, c3 as u32), pair(c4 as u32, c5 as u32)]
}

/// Packs the low 16 bits of both words.
#[inline(always)]
const fn pair(first: u32, second: u32) -> u32 {
    first & 0xffff | second << 16
}

/// Returns the register after four more bytes.
#[inline(always)]
fn four_bytes(register: u8, pair: u32) -> u8 {
    let [b0, b1, b2, b3] = pair.to_le_bytes();
    next(next(next(next(register ^ b0) ^ b1) ^ b2) ^ b3)
}

/// Returns the register after two more bytes.
#[inline(always)]
fn two_bytes(register: u8, pair: u32) -> u8 {
    let [b0, b1, ..] = pair.to_le_bytes();
    next(next(register ^ b0) ^ b1)
}

/// A number as words of a 32-bit core.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the number is taken apart")]
const fn quarters(bits: u128) -> [u32; 4] {
    [bits as u32, (bits >> 32) as u32, (bits >> 64) as u32, (bits >> 96) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crc::mirrored;
    use crate::frame::pack;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// A wrong start bit or delimiter is seen whatever remains of the CRC-8.
    #[test]
    fn framing_and_check_do_not_hide_each_other() {
        for (frames, at) in (2..=6_u8).flat_map(|frames| (0..18 * u32::from(frames)).map(move |at| (frames, at))) {
            let bits = u32::from(frames) * FRAME_BITS;
            for crc in (0..=255_u128).filter(|_| at % 18 == 0 || at % 18 == 17) {
                let line = pack([0x1234; 6]) ^ 1 << at ^ crc << (bits - 9);
                let (_, wrong) = sound_line(frames, &Window::from_bits(line, bits).unwrap()).unwrap();
                assert!(wrong != 0, "{frames} frames, bit {at}, {crc:#x}");
            }
        }
    }

    proptest! {
        /// Line and words of any number of frames give the same contents, nothing after the last frame counts, and what remains of
        /// the CRC-8 is what a table over all bytes gives.
        #[test]
        fn by_line_and_by_words(content: [u16; 6], frames in 2..=6_u8, more in 0..20_u32, at in 0..108_u32) {
            let bits = u32::from(frames) * FRAME_BITS;
            let line = Window::from_bits(pack(content), (bits + more).min(108)).unwrap();
            let (contents, wrong) = sound_line(frames, &line).unwrap();
            let kept: Vec<u16> = content.iter().copied().take(frames.into()).collect();
            prop_assert_eq!(&apart(contents)[..usize::from(frames)], &kept[..]);
            prop_assert!(apart(contents).iter().skip(frames.into()).all(|content| *content == 0));
            let bytes: Vec<u8> = kept.iter().flat_map(|content| content.to_le_bytes()).collect();
            prop_assert_eq!(wrong, u32::from(mirrored(&bytes)));
            prop_assert_eq!(sound_words(frames, &content, BitOrder::LsbFirst), Some((contents, wrong)));
            let mirrored = kept.iter().map(|content| content.reverse_bits()).collect::<Vec<_>>();
            prop_assert_eq!(sound_words(frames, &mirrored, BitOrder::MsbFirst), Some((contents, wrong)));
            prop_assert_eq!(sound_words(frames, &content[1..frames.into()], BitOrder::LsbFirst), None);
            prop_assert_eq!(framed(frames, &line), Some(contents));
            prop_assert_eq!(sound_line(frames, &Window::from_bits(pack(content), bits - 1).unwrap()), None);
            // A wrong start bit or delimiter is seen, one after the response is not.
            let framing = at % 18 == 0 || at % 18 == 17;
            let other = Window::from_bits(line.bits() ^ 1 << at, line.len()).unwrap();
            if framing {
                prop_assert_eq!(framed(frames, &other).is_none(), at < bits);
            }
            if frames == 4 {
                prop_assert_eq!(sound_four(line.bits()), (contents, wrong));
            }
        }
    }
}
