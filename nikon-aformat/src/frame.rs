use nrz_line::{BitOrder, Window};

use crate::contents::{apart, framed};
use crate::crc::crc3;
use crate::error::Error;
use crate::layout::{DELIMITER, FRAME_BITS, MAX_FRAMES};
use crate::number::EncoderAddress;

/// One frame of a request: a command data frame (CDF) or one of the memory data frames MDF0 to MDF3.
///
/// ```text
///  line, time →   0 | 0  1  0 | fc0 fc1 | ea0 ea1 ea2 | cc0 cc1 cc2 cc3 cc4 | crc2 crc1 crc0 | 1     CDF
///             start | sync    | frame   | encoder     | command code        | CRC-3          | delimiter
///                   | code 2  | code    | address     |                     |                |
///                 0 | 0  1  0 | fc0 fc1 | d0  d1  d2    d3  d4  d5  d6  d7  | crc2 crc1 crc0 | 1     MDF
///  content bit        0  1  2   3   4     5   6   7     8   9   10  11  12    13   14   15
/// ```
///
/// Frame codes: 0 CDF, 1 MDF0, 2 MDF1, 3 MDF2; in version 3.0 also 3 for a CDF that opens a bank or coefficient access, and
/// 0 for MDF3. So a frame can only be identified by its place in the request. Every field is sent least significant bit
/// first, the CRC-3 most significant bit first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u16", into = "u16"))]
pub struct RequestFrame(u16);

servowire_core::codes! {
    /// The two bits after the sync code of a request frame.
    pub enum FrameCode: u8 {
        /// CDF; MDF3 in version 3.0.
        Fc0 = 0 => "FC0",
        /// MDF0.
        Fc1 = 1 => "FC1",
        /// MDF1.
        Fc2 = 2 => "FC2",
        /// MDF2; a CDF for banks and the velocity coefficient in version 3.0.
        Fc3 = 3 => "FC3",
    }
}

impl FrameCode {
    /// The frame code of MDF0, MDF1, MDF2 and MDF3.
    pub const MDF: [Self; 4] = [Self::Fc1, Self::Fc2, Self::Fc3, Self::Fc0];

    const fn truncate(bits: u16) -> Self {
        match bits & 3 {
            0 => Self::Fc0,
            1 => Self::Fc1,
            2 => Self::Fc2,
            _ => Self::Fc3,
        }
    }
}

impl RequestFrame {
    /// Value of the sync code that begins a request frame.
    pub const SYNC_CODE: u8 = 2;

    /// Creates a command data frame. Only the five low bits of `code` are used.
    pub const fn cdf(frame_code: FrameCode, ea: EncoderAddress, code: u8) -> Self {
        Self::of(frame_code, ea.get() | code << 3)
    }

    /// Creates a memory data frame.
    pub const fn mdf(frame_code: FrameCode, byte: u8) -> Self {
        Self::of(frame_code, byte)
    }

    const fn of(frame_code: FrameCode, byte: u8) -> Self {
        let covered = frame_code as u16 | (byte as u16) << 2;
        Self(Self::SYNC_CODE as u16 | covered << 3 | (mirror3(crc3(covered)) as u16) << 13)
    }

    /// Decodes a frame from its 16 content bits, the first on the line in bit 0.
    ///
    /// # Errors
    /// [`Error::Crc3`], [`Error::SyncCode`].
    pub const fn from_content(content: u16) -> Result<Self, Error> {
        let (got, want) = (mirror3((content >> 13) as u8), crc3(content >> 3));
        if got != want {
            return Err(Error::Crc3 { got, want });
        }
        let sync = (content & 7) as u8;
        if sync != Self::SYNC_CODE {
            return Err(Error::SyncCode { got: sync });
        }
        Ok(Self(content))
    }

    /// Decodes a frame from its 16 content bits as a word.
    ///
    /// # Errors
    /// As [`from_content`](Self::from_content).
    pub const fn from_word(word: u16, order: BitOrder) -> Result<Self, Error> {
        Self::from_content(match order {
            BitOrder::LsbFirst => word,
            BitOrder::MsbFirst => word.reverse_bits(),
        })
    }

    /// Decodes the frame at the start of a piece of line; bits after it are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::StartBit`], [`Error::Delimiter`], then as [`from_content`](Self::from_content).
    pub fn from_line(line: Window) -> Result<Self, Error> {
        let [content, ..] = apart(framed(1, &line).ok_or_else(|| framing(line, 1))?);
        Self::from_content(content)
    }

    /// The content bits, the first on the line in bit 0.
    pub const fn content(self) -> u16 {
        self.0
    }

    /// The content bits as a word; vendor documents print them with the first bit of the line in bit 15
    /// ([`BitOrder::MsbFirst`]).
    pub const fn word(self, order: BitOrder) -> u16 {
        match order {
            BitOrder::LsbFirst => self.0,
            BitOrder::MsbFirst => self.0.reverse_bits(),
        }
    }

    /// The 18 line bits. [`Window::to_bytes`] packs them.
    pub const fn line(self) -> Window {
        match Window::from_bits((self.0 as u128) << 1 | 1 << 17, FRAME_BITS) {
            Some(line) => line,
            // Never: 18 bits.
            None => Window::EMPTY,
        }
    }

    /// Returns the frame as one 32-bit word for a shift register: twelve idle bits, the 18 line bits, two idle bits, the first
    /// on the line in bit 31. The idle bits provide the times t2 before and t3 after a frame.
    pub const fn transmit_word(self) -> u32 {
        0xfff0_0007 | (self.0.reverse_bits() as u32) << 3
    }

    /// The frame code.
    pub const fn frame_code(self) -> FrameCode {
        FrameCode::truncate(self.0 >> 3)
    }

    /// The eight bits after the frame code, the byte of a memory data frame.
    #[expect(clippy::cast_possible_truncation, reason = "eight bits")]
    pub const fn byte(self) -> u8 {
        (self.0 >> 5) as u8
    }

    /// EA, if the frame is a command data frame.
    pub const fn ea(self) -> EncoderAddress {
        EncoderAddress::truncate(self.byte())
    }

    /// CC, 0..=31, if the frame is a command data frame.
    pub const fn code(self) -> u8 {
        self.byte() >> 3
    }

    /// The CRC-3.
    pub const fn crc3(self) -> u8 {
        crc3(self.0 >> 3)
    }
}

impl TryFrom<u16> for RequestFrame {
    type Error = Error;

    /// Creates the frame from its content bits.
    fn try_from(content: u16) -> Result<Self, Error> {
        Self::from_content(content)
    }
}

impl From<RequestFrame> for u16 {
    fn from(frame: RequestFrame) -> Self {
        frame.content()
    }
}

const fn mirror3(bits: u8) -> u8 {
    (bits & 7).reverse_bits() >> 5
}

/// Returns the line bits of six frames.
pub(crate) const fn pack(content: [u16; MAX_FRAMES as usize]) -> u128 {
    let [c0, c1, c2, c3, c4, c5] = content;
    DELIMITER
        | (c0 as u128) << 1
        | (c1 as u128) << 19
        | (c2 as u128) << 37
        | (c3 as u128) << 55
        | (c4 as u128) << 73
        | (c5 as u128) << 91
}

/// [`Error::Truncated`] with numbers that are known to fit.
pub(crate) fn truncated(got: u32, want: u32) -> Error {
    let narrow = |bits| u16::try_from(bits).unwrap_or(u16::MAX);
    Error::Truncated { got: narrow(got), want: narrow(want) }
}

/// Returns why a line does not hold `frames` frames; kept off the hot path.
#[cold]
pub(crate) fn framing(line: Window, frames: u8) -> Error {
    let bits = u32::from(frames).wrapping_mul(FRAME_BITS);
    if line.len() < bits {
        return truncated(line.len(), bits);
    }
    for frame in 0..frames {
        let at = u32::from(frame).wrapping_mul(FRAME_BITS);
        match (line.get(at), line.get(at.wrapping_add(17))) {
            (Some(true), _) => return Error::StartBit { frame },
            (_, Some(false)) => return Error::Delimiter { frame },
            _ => {}
        }
    }
    // Never: the caller saw a fault.
    truncated(line.len(), bits)
}

servowire_core::one_line!(RequestFrame { frame => "{:04X}", frame.word(BitOrder::MsbFirst); });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contents::together;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Line bits of a request frame, field by field and bit by bit, from the drawing.
    fn slow_line(fc: u8, byte: u8) -> Vec<bool> {
        let mut covered: Vec<bool> = (0..2).map(|k| fc >> k & 1 == 1).collect();
        covered.extend((0..8).map(|k| byte >> k & 1 == 1));
        let crc = covered.iter().fold(0_u8, |rest, bit| {
            let out = (rest >> 2 & 1 == 1) != *bit;
            (rest << 1 & 7) ^ if out { 3 } else { 0 }
        });
        let mut line = std::vec![false, false, true, false];
        line.extend(covered);
        line.extend((0..3).rev().map(|k| crc >> k & 1 == 1));
        line.push(true);
        line
    }

    /// Every frame code with every byte, that is every command data frame and every memory data frame there is.
    #[test]
    fn all_1024_frames_in_every_form() {
        for fc in 0..4_u16 {
            for byte in (0..=255).step_by(crate::STRIDE) {
                let frame = RequestFrame::mdf(FrameCode::truncate(fc), byte);
                let want = slow_line(fc as u8, byte);
                let line = frame.line();
                assert!((0..18).all(|k| line.get(k) == Some(want[k as usize])) && line.len() == 18);
                assert_eq!(RequestFrame::from_line(line), Ok(frame));
                assert_eq!(frame, RequestFrame::cdf(frame.frame_code(), frame.ea(), frame.code()));
                assert_eq!((frame.frame_code().code(), frame.byte()), (fc as u8, byte));
                for order in [BitOrder::LsbFirst, BitOrder::MsbFirst] {
                    assert_eq!(RequestFrame::from_word(frame.word(order), order), Ok(frame));
                }
                let shifted = (0..32).fold(0_u32, |word, k| {
                    let bit = if (12..30).contains(&k) { want[k - 12] } else { true };
                    word << 1 | u32::from(bit)
                });
                assert_eq!(frame.transmit_word(), shifted);
            }
        }
    }

    /// Of all 65 536 contents exactly the 1024 frames are accepted; single wrong bits name the right check.
    #[test]
    fn every_content_is_judged() {
        let accepted = (0..=u16::MAX).filter_map(|c| RequestFrame::from_content(c).ok().map(|f| (c, f)));
        assert_eq!(accepted.inspect(|(c, f)| assert_eq!(f.content(), *c)).count(), 1024);
        for byte in (0..=255).step_by(crate::STRIDE) {
            let frame = RequestFrame::mdf(FrameCode::Fc2, byte);
            for at in 0..18 {
                let bad = Window::from_bits(frame.line().bits() ^ 1 << at, 18).unwrap();
                let error = RequestFrame::from_line(bad).unwrap_err();
                match at {
                    0 => assert_eq!(error, Error::StartBit { frame: 0 }),
                    1..4 => assert!(matches!(error, Error::SyncCode { .. })),
                    17 => assert_eq!(error, Error::Delimiter { frame: 0 }),
                    _ => assert!(matches!(error, Error::Crc3 { .. })),
                }
            }
            for got in 0..18 {
                let short = Window::from_bits(frame.line().bits(), got).unwrap();
                let want = Error::Truncated { got: got as u16, want: 18 };
                assert_eq!(RequestFrame::from_line(short), Err(want));
            }
        }
    }

    proptest! {
        #[test]
        fn line_and_back(content: [u16; 6]) {
            let line = Window::from_bits(pack(content), 108).unwrap();
            prop_assert_eq!(framed(6, &line), Some(together(content)));
            prop_assert_eq!(apart(together(content)), content);
            for frame in 0..6_u8 {
                for (bit, want) in [(0, Error::StartBit { frame }), (17, Error::Delimiter { frame })] {
                    let at = u32::from(frame) * 18 + bit;
                    let bad = Window::from_bits(line.bits() ^ 1 << at, 108).unwrap();
                    prop_assert_eq!(framed(6, &bad), None);
                    prop_assert_eq!(framing(bad, 6), want);
                    // Bits after it are ignored.
                    prop_assert_eq!(framing(bad.padded(120).unwrap(), 6), want);
                }
            }
        }
    }
}
