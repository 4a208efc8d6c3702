//! Block size, byte order and starting offset of a log.

use crate::block::BlockSize;
use crate::inspect::strict;

/// The shape of a whole log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LogShape {
    /// The size of the blocks.
    pub size: BlockSize,
    /// How many bytes of each word are in reversed order: 1 for none, 2 or 4.
    pub word: usize,
    /// Number of bytes before the first whole block: not 0 if the log begins in the middle of one.
    pub skip: usize,
}

impl LogShape {
    /// Guesses the block size, byte order and starting offset with which most of the blocks make sense. `None` if nothing
    /// makes sense, or if fewer than four blocks follow the leading NOPs. NOPs look alike in every shape, so pass more of
    /// the log in that case.
    ///
    /// In a log of 32-byte blocks, every second piece of 16 bytes is a sub block. That of a command begins with 80h, 82h or
    /// 8Ah, which, read as a main block, would be a response of drive 0, 2 or 10.
    pub fn guess(bytes: &[u8]) -> Option<Self> {
        let shapes = || {
            let sizes = [BlockSize::Bytes16, BlockSize::Bytes32];
            [1, 2, 4].into_iter().flat_map(move |word| sizes.map(|size| Self { size, word, skip: 0 }))
        };
        // More than half.
        let aligned = Self::best(shapes(), bytes, 501);
        if aligned.is_some() {
            return aligned;
        }
        // NOPs alone do not tell the shape, and their data may look like blocks of another shape. But in their own shape all of
        // them are sound, and in the other one the counters do not advance.
        let aligned = shapes().map(|shape| shape.sound(bytes)).max();
        let explains_more = |shape: &Self| {
            let sound = Some(shape.sound(bytes));
            sound > aligned || sound == aligned && shape.counts(bytes)
        };
        let shifted = shapes().flat_map(|shape| (1..shape.size.bytes()).map(move |skip| Self { skip, ..shape }));
        Self::best(shifted.filter(explains_more), bytes, 900)
    }

    /// Returns the first of the best-scoring shapes with a score of at least `least`; a larger size wins only if it explains
    /// more.
    fn best(shapes: impl Iterator<Item = Self>, bytes: &[u8], least: usize) -> Option<Self> {
        let mut best: Option<(Self, usize)> = None;
        for shape in shapes {
            let score = shape.score(bytes).filter(|score| *score >= least);
            if let Some(score) = score.filter(|score| best.is_none_or(|(_, other)| *score > other)) {
                best = Some((shape, score));
            }
        }
        best.map(|(shape, _)| shape)
    }

    /// Share of sound blocks after the leading NOPs, in thousandths.
    fn score(self, bytes: &[u8]) -> Option<usize> {
        let (mut good, mut all) = (0_usize, 0_usize);
        let blocks = bytes.get(self.skip..)?.chunks_exact(self.size.bytes());
        for block in blocks.skip_while(|block| self.is_nop(block)).take(256) {
            all = all.saturating_add(1);
            good = good.saturating_add(usize::from(self.is_sound(block) && !self.is_nop(block)));
        }
        good.saturating_mul(1_000).checked_div(all).filter(|_| all >= 4)
    }

    /// Returns the share of sound blocks, including NOPs, in thousandths.
    fn sound(self, bytes: &[u8]) -> usize {
        let blocks = || bytes.get(self.skip..).unwrap_or_default().chunks_exact(self.size.bytes());
        let good = blocks().filter(|block| self.is_sound(block)).count();
        good.saturating_mul(1_000).checked_div(blocks().len()).unwrap_or(0)
    }

    /// Whether the counters of blocks that follow each other in a direction advance; each may be sent twice.
    fn counts(self, bytes: &[u8]) -> bool {
        let mut last = [None; 256];
        let (mut went_on, mut all) = (0_usize, 0_usize);
        for block in bytes.get(self.skip..).unwrap_or_default().chunks_exact(self.size.bytes()) {
            let [byte0, ..] = self.turned(block);
            let counter = byte0 >> 5 & 3;
            let Some(before) = last.get_mut(usize::from(byte0 & 0x9f)) else { continue };
            if let Some(before) = before.replace(counter) {
                all = all.saturating_add(1);
                went_on = went_on.saturating_add(usize::from(counter == before.wrapping_add(1) & 3));
            }
        }
        went_on >= 4 && went_on.saturating_mul(5) >= all.saturating_mul(2)
    }

    /// Returns a block with its bytes in order.
    fn turned(self, block: &[u8]) -> [u8; 32] {
        let mut turned = [0; 32];
        for (to, from) in turned.chunks_exact_mut(self.word).zip(block.chunks_exact(self.word)) {
            for (to, from) in to.iter_mut().zip(from.iter().rev()) {
                *to = *from;
            }
        }
        turned
    }

    /// Code 00h: nothing else in the block is certain to have a meaning.
    fn is_nop(self, block: &[u8]) -> bool {
        self.turned(block).get(1).is_some_and(|byte1| byte1 & 0x7f == 0)
    }

    /// Whether an encoder could have written a block of this shape.
    fn is_sound(self, block: &[u8]) -> bool {
        self.turned(block).get(..self.size.bytes()).is_some_and(|turned| strict(turned).is_ok())
    }
}
