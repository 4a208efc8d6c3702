use nrz_line::{BitOrder, Window};

use crate::contents::{Contents, apart, framed, together};
use crate::crc::{mirrored, next_word};
use crate::error::Error;
use crate::frame::{framing, pack, truncated};
use crate::layout::{FRAME_BITS, Layout, MAX_FRAMES};
use crate::units::Units;

/// The 2 to 6 frames of one response: their content bits, with the framing checked and removed and nothing else judged.
///
/// ```text
///  line, time →   0 | 16 content bits | 1 | 0 | 16 content bits | 1 | ...
///  line bit       0   1            16  17  18   19           34  35        frame k begins at bit 18 k
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RawResponse {
    contents: [u16; MAX_FRAMES as usize],
    frames: u8,
}

/// The CRC-8 of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Crc {
    /// As received.
    pub got: u8,
    /// The CRC-8 computed over the content bits before it.
    pub want: u8,
}

impl RawResponse {
    /// Maximum number of frames of a response.
    pub const MAX_FRAMES: usize = MAX_FRAMES as usize;

    /// Creates the response; `contents` must be 0 after the frames of the layout.
    pub(crate) const fn of(contents: [u16; MAX_FRAMES as usize], layout: Layout) -> Self {
        Self { contents, frames: layout.frames() }
    }

    /// Takes the response at the start of a piece of line, its frames back to back; bits after it are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::StartBit`], [`Error::Delimiter`].
    pub fn from_line(layout: Layout, line: Window) -> Result<Self, Error> {
        match framed(layout.frames(), &line) {
            Some(contents) => Ok(Self::of(apart(contents), layout)),
            None => Err(framing(line, layout.frames())),
        }
    }

    /// Creates a response from the content bits of its frames, one word each; words after it are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`].
    pub fn from_words(layout: Layout, words: &[u16], order: BitOrder) -> Result<Self, Error> {
        let Some(words) = words.get(..usize::from(layout.frames())) else {
            let got = u32::try_from(words.len()).unwrap_or(u32::MAX);
            return Err(truncated(got.saturating_mul(FRAME_BITS), layout.line_bits()));
        };
        let mut contents = [0; Self::MAX_FRAMES];
        for (to, from) in contents.iter_mut().zip(words) {
            *to = match order {
                BitOrder::LsbFirst => *from,
                BitOrder::MsbFirst => from.reverse_bits(),
            };
        }
        Ok(Self::of(contents, layout))
    }

    /// Number of frames.
    pub const fn frames(self) -> u8 {
        self.frames
    }

    /// The content bits of the frames, the first on the line in bit 0.
    pub fn contents(&self) -> &[u16] {
        self.contents.get(..usize::from(self.frames)).unwrap_or(&self.contents)
    }

    /// The frames as a receiver delivers them.
    pub fn units(&self) -> Units {
        self.contents().iter().map(|content| Some(*content)).collect()
    }

    /// The content bits as words.
    pub fn words(&self, order: BitOrder) -> impl Iterator<Item = u16> {
        self.contents().iter().map(move |content| match order {
            BitOrder::LsbFirst => *content,
            BitOrder::MsbFirst => content.reverse_bits(),
        })
    }

    /// The line bits, 18 per frame, back to back.
    pub const fn line(&self) -> Window {
        match Window::from_bits(pack(self.contents), (self.frames as u32).wrapping_mul(FRAME_BITS)) {
            Some(line) => line,
            // Never: six frames are 108 bits.
            None => Window::EMPTY,
        }
    }

    /// The CRC-8, received and computed.
    pub fn crc(&self) -> Crc {
        let bytes = bytes(self.contents);
        let len = usize::from(self.frames).wrapping_mul(2);
        let got = bytes.get(len.wrapping_sub(1)).copied().unwrap_or(0);
        let covered = bytes.get(..len.wrapping_sub(1)).unwrap_or(&bytes);
        Crc { got: got.reverse_bits(), want: mirrored(covered).reverse_bits() }
    }

    /// Creates the frames from all content bits except the CRC-8, the first on the line in bit 0, and adds the CRC-8.
    #[expect(clippy::cast_possible_truncation, reason = "each shift brings a frame to the low bits")]
    pub(crate) fn of_payload(payload: u128, layout: Layout) -> Self {
        let mut contents = [0; Self::MAX_FRAMES];
        for (content, at) in contents.iter_mut().zip((0_u32..).step_by(16)) {
            *content = payload.wrapping_shr(at) as u16;
        }
        Self::of(contents, layout).sealed()
    }

    /// Sets the CRC-8 that the other bits require.
    pub(crate) fn sealed(mut self) -> Self {
        let crc = self.crc().want;
        if let Some(last) = self.contents.get_mut(usize::from(self.frames).wrapping_sub(1)) {
            *last = *last & 0xff | u16::from(crc.reverse_bits()) << 8;
        }
        self
    }

    /// Returns whether the CRC-8 is right.
    pub(crate) fn is_sound(&self) -> bool {
        self.contents().iter().fold(0, |register, content| next_word(register, *content)) == 0
    }

    /// The content bits of six frames, 0 after the last.
    #[inline(always)]
    pub(crate) const fn all_contents(&self) -> Contents {
        together(self.contents)
    }
}

/// The content bits as bytes, the first on the line in bit 0 of the first byte.
const fn bytes(contents: [u16; MAX_FRAMES as usize]) -> [u8; 2 * MAX_FRAMES as usize] {
    let [c0, c1, c2, c3, c4, c5] = contents;
    let ([a, b], [c, d], [e, f]) = (c0.to_le_bytes(), c1.to_le_bytes(), c2.to_le_bytes());
    let ([g, h], [i, j], [k, l]) = (c3.to_le_bytes(), c4.to_le_bytes(), c5.to_le_bytes());
    [a, b, c, d, e, f, g, h, i, j, k, l]
}

// As vendor documents print them, the first bit of the line in bit 15.
servowire_core::listed!(RawResponse { |raw| raw.words(BitOrder::MsbFirst) => "{:04X}" });
