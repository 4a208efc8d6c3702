use nrz_line::{BitOrder, Window};

use crate::crc::mirrored;
use crate::frame::{FRAME_BITS, MAX_FRAMES, contents, pack, truncated};
use crate::{Error, Layout};

/// The frames of one reply, 2 to 6: their content bits, framing checked and removed, nothing else judged.
///
/// ```text
///  line, time →   0 | 16 content bits | 1 | 0 | 16 content bits | 1 | ...
///  line bit       0   1            16  17  18   19           34  35        frame k begins at bit 18 k
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reply {
    contents: [u16; MAX_FRAMES as usize],
    frames: u8,
}

impl Reply {
    /// Most frames of a reply.
    pub const MAX_FRAMES: usize = MAX_FRAMES as usize;

    /// `contents` are 0 behind the frames of the layout.
    pub(crate) const fn of(contents: [u16; MAX_FRAMES as usize], layout: Layout) -> Self {
        Self { contents, frames: layout.frames() }
    }

    /// The reply at the beginning of a piece of line, its frames back to back; bits behind it are left alone.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::StartBit`], [`Error::Delimiter`].
    pub fn from_line(line: Window, layout: Layout) -> Result<Self, Error> {
        contents(line, u32::from(layout.frames())).map(|contents| Self::of(contents, layout))
    }

    /// A reply from the content bits of its frames, one word each; words behind it are left alone.
    ///
    /// # Errors
    /// [`Error::Truncated`].
    pub fn from_words(words: &[u16], order: BitOrder, layout: Layout) -> Result<Self, Error> {
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

    /// The content bits of the frames, the first of the line in bit 0.
    pub fn contents(&self) -> &[u16] {
        self.contents.get(..usize::from(self.frames)).unwrap_or(&self.contents)
    }

    /// The content bits as words.
    pub fn words(&self, order: BitOrder) -> impl Iterator<Item = u16> {
        self.contents().iter().map(move |content| match order {
            BitOrder::LsbFirst => *content,
            BitOrder::MsbFirst => content.reverse_bits(),
        })
    }

    /// The line bits, 18 a frame, back to back.
    pub const fn line(&self) -> Window {
        match Window::from_bits(pack(self.contents), (self.frames as u32).wrapping_mul(FRAME_BITS)) {
            Some(line) => line,
            // Never: six frames are 108 bits.
            None => Window::EMPTY,
        }
    }

    /// The received CRC-8 and the one computed over the content bits before it.
    pub fn crc(&self) -> (u8, u8) {
        let bytes = bytes(self.contents);
        let len = usize::from(self.frames).wrapping_mul(2);
        let got = bytes.get(len.wrapping_sub(1)).copied().unwrap_or(0);
        let covered = bytes.get(..len.wrapping_sub(1)).unwrap_or(&bytes);
        (got.reverse_bits(), mirrored(covered).reverse_bits())
    }

    /// The same with the CRC-8 that its other bits demand.
    pub(crate) fn sealed(mut self) -> Self {
        let (_, crc) = self.crc();
        if let Some(last) = self.contents.get_mut(usize::from(self.frames).wrapping_sub(1)) {
            *last = *last & 0xff | u16::from(crc.reverse_bits()) << 8;
        }
        self
    }

    /// Whether the CRC-8 is right.
    pub(crate) fn is_sound(&self) -> bool {
        let bytes = bytes(self.contents);
        mirrored(bytes.get(..usize::from(self.frames).wrapping_mul(2)).unwrap_or(&bytes)) == 0
    }

    /// All content bits as one number, the first of the line in bit 0.
    pub(crate) fn payload(&self) -> u128 {
        let [c0, c1, c2, c3, c4, c5] = self.contents;
        let wide = |content, at: u32| u128::from(content) << at;
        wide(c0, 0) | wide(c1, 16) | wide(c2, 32) | wide(c3, 48) | wide(c4, 64) | wide(c5, 80)
    }
}

/// The content bits as bytes, the first of the line in bit 0 of the first.
const fn bytes(contents: [u16; MAX_FRAMES as usize]) -> [u8; 2 * MAX_FRAMES as usize] {
    let [c0, c1, c2, c3, c4, c5] = contents;
    let ([a, b], [c, d], [e, f]) = (c0.to_le_bytes(), c1.to_le_bytes(), c2.to_le_bytes());
    let ([g, h], [i, j], [k, l]) = (c3.to_le_bytes(), c4.to_le_bytes(), c5.to_le_bytes());
    [a, b, c, d, e, f, g, h, i, j, k, l]
}
