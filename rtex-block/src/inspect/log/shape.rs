//! Block size, byte order and starting offset of a log.

use crate::block::BlockSize;
use crate::code::CyclicCode;
use crate::header::Header;
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

/// Why the shape of a log is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ShapeDoubt {
    /// Too few blocks make sense in any shape. NOPs look alike in every shape, so pass more of the log.
    Unknown,
    /// Two shapes explain the log equally well.
    Either(LogShape, LogShape),
}

/// Points of a sound block whose counter follows the one before it.
const FOLLOWS: i32 = 64;
/// Points of one whose counter does not.
const STANDS: i32 = 16;
/// Points of a sound sub block.
const SUB: i32 = 32;
/// Points a block by which one of two shapes with header and code in the same places has to be better to be told.
const TELLS: i32 = 4;
/// Points that say nothing: those of a single position that moved by more bits.
const SLIGHT: i32 = 16;
/// Fewer blocks say nothing.
const LEAST: usize = 4;

impl LogShape {
    /// Guesses block size, byte order and starting offset: the shape in which blocks make sense, their counters advance, and
    /// positions change least from block to block.
    ///
    /// More than half of the blocks after the leading NOPs have to make sense, and at least four. In a log that begins in
    /// the middle of a block, nine of ten have to, and counters have to advance.
    ///
    /// A log of exchanged 16-bit words that begins one word inside a block has address, counter and code in the same places as
    /// one of turned 32-bit words, and the other way round. Commands and responses of [`CyclicCode::CyclicPosition`] tell them
    /// apart; if nothing does, a log that begins with a block is taken for one.
    pub fn guess(bytes: &[u8]) -> Result<Self, ShapeDoubt> {
        let mut first: Option<(Self, Sum)> = None;
        let mut second: Option<(Self, Sum)> = None;
        for shape in Self::all() {
            let sum = shape.sum(bytes);
            if !sum.makes_sense(shape.skip > 0) {
                continue;
            }
            let is_better = |than: &Option<(Self, Sum)>| than.as_ref().is_none_or(|(_, best)| sum.points > best.points);
            if is_better(&first) {
                (first, second) = (Some((shape, sum)), first);
            } else if is_better(&second) {
                second = Some((shape, sum));
            }
        }
        let (best, sum) = first.filter(|(_, sum)| sum.is_enough()).ok_or(ShapeDoubt::Unknown)?;
        match second {
            Some((other, _)) if best.is_twin_of(other) => best.or_twin(other, bytes),
            Some((_, other)) if best.skip > 0 && sum.is_close_to(&other) => Err(ShapeDoubt::Unknown),
            _ => Ok(best),
        }
    }

    /// Returns which of two shapes with header and code in the same places explains the blocks better.
    fn or_twin(self, other: Self, bytes: &[u8]) -> Result<Self, ShapeDoubt> {
        let (lead, blocks) = self.lead(other, bytes);
        let (best, other) = if lead < 0 { (other, self) } else { (self, other) };
        let lead = lead.saturating_abs();
        if lead >= FOLLOWS && lead >= i32::try_from(blocks).unwrap_or(i32::MAX).saturating_mul(TELLS) {
            return Ok(best);
        }
        match (best.skip, other.skip) {
            (0, _) => Ok(best),
            (_, 0) if lead <= SLIGHT => Ok(other),
            _ => Err(ShapeDoubt::Either(best, other)),
        }
    }

    /// Returns by how many points this shape explains the blocks that both see better than its twin, and the number of these blocks.
    /// What one of them sees more at the ends of a piece says nothing.
    fn lead(self, other: Self, bytes: &[u8]) -> (i32, usize) {
        let own_is_narrow = self.word < other.word;
        let (narrow, wide) = if own_is_narrow { (self, other) } else { (other, self) };
        let narrow = Self { skip: wide.skip.saturating_add(2), ..narrow }.sum(bytes);
        let wide = wide.sum(bytes.get(..bytes.len().saturating_sub(2)).unwrap_or_default());
        let (own, twin) = if own_is_narrow { (&narrow, &wide) } else { (&wide, &narrow) };
        (own.points.saturating_sub(twin.points), own.good.max(twin.good))
    }

    /// Whether header and code are in the same places: exchanged 16-bit words, and turned 32-bit words that begin two bytes before.
    fn is_twin_of(self, other: Self) -> bool {
        let (narrow, wide) = if self.word < other.word { (self, other) } else { (other, self) };
        let skip = wide.skip.saturating_add(2).checked_rem(wide.size.bytes());
        narrow.size == wide.size && (narrow.word, wide.word) == (2, 4) && skip == Some(narrow.skip)
    }

    /// Returns all shapes; first those that begin with a block.
    fn all() -> impl Iterator<Item = Self> {
        (0..32).flat_map(|skip| {
            let sizes = [BlockSize::Bytes16, BlockSize::Bytes32].into_iter().filter(move |size| skip < size.bytes());
            sizes.flat_map(move |size| [1, 2, 4].map(|word| Self { size, word, skip }))
        })
    }

    /// Returns what the bytes say for this shape.
    fn sum(self, bytes: &[u8]) -> Sum {
        let mut sum = Sum::NEW;
        for block in bytes.get(self.skip..).unwrap_or_default().chunks_exact(self.size.bytes()) {
            let turned = self.turned(block);
            let is_sound = turned.get(..self.size.bytes()).is_some_and(|turned| strict(turned).is_ok());
            sum.take(&turned, is_sound, self.size == BlockSize::Bytes32);
        }
        sum
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
}

/// What the blocks of a log say for a shape.
struct Sum {
    points: i32,
    /// Blocks since at least half of them were NOPs, and the sound ones of these that are no NOPs.
    all: usize,
    good: usize,
    /// Sound blocks of a drive and direction that had one before them, and those whose counter follows it.
    again: usize,
    followed: usize,
    /// Of a direction and drive: the counter, and whether it was the next one.
    counters: [Option<(u8, bool)>; 64],
    /// Of a direction and drive, the last position; with cyclic positions those of both directions are nearly the same.
    positions: [Option<i32>; 64],
    /// Its own last position, and the step to it.
    steps: [Option<(i32, Option<i32>)>; 64],
}

impl Sum {
    const NEW: Self = Self {
        points: 0,
        all: 0,
        good: 0,
        again: 0,
        followed: 0,
        counters: [None; 64],
        positions: [None; 64],
        steps: [None; 64],
    };

    fn take(&mut self, block: &[u8; 32], is_sound: bool, wide: bool) {
        let [byte0, code, _, _, l, ml, mh, h, ..] = *block;
        let (halves, of_sub) = if wide { (2, SUB) } else { (1, 0) };
        // In a NOP, nothing else is certain to have a meaning.
        let is_nop = code & 0x7f == 0;
        self.all = self.all.saturating_add(1);
        if is_nop && self.good.saturating_mul(2) <= self.all {
            *self = Self { counters: self.counters, positions: self.positions, steps: self.steps, ..Self::NEW };
            return;
        }
        if !is_sound {
            self.points = self.points.saturating_sub(FOLLOWS.saturating_mul(halves));
        } else if !is_nop {
            self.good = self.good.saturating_add(1);
            let cyclic = code >> 4 & 7 == CyclicCode::CyclicPosition.code();
            let weight = self.count(byte0);
            let moved = self.moved(byte0, cyclic, i32::from_le_bytes([l, ml, mh, h]));
            self.points = self.points.saturating_add(weight).saturating_add(of_sub).saturating_sub(moved);
        }
    }

    /// Takes the counter, which may be sent twice, and returns the points for it.
    fn count(&mut self, byte0: u8) -> i32 {
        let counter = Header::parse(byte0).update_counter.get();
        let Some(last) = self.counters.get_mut(place(byte0)) else { return STANDS };
        let Some((before, went_on)) = last.replace((counter, false)) else { return STANDS };
        let goes_on = counter == before.wrapping_add(1) & 3;
        *last = Some((counter, goes_on));
        self.again = self.again.saturating_add(1);
        let follows = goes_on || went_on && counter == before;
        self.followed = self.followed.saturating_add(follows.into());
        if follows { FOLLOWS } else { STANDS }
    }

    /// Returns by how many bits the position is not where it was, or where the step before leads: a motor that turns fast does not
    /// stay near. Cyclic positions of both directions are near each other.
    fn moved(&mut self, byte0: u8, cyclic: bool, position: i32) -> i32 {
        let own = place(byte0);
        let before = self.positions.get_mut(own).and_then(|last| last.replace(position));
        if let Some(other) = self.positions.get_mut(own ^ 32).filter(|_| cyclic) {
            *other = Some(position);
        }
        let near = before.map_or(0, |before| bits(before, position));
        let both = cyclic && self.steps.get(own ^ 32).is_some_and(Option::is_some);
        let Some(last) = self.steps.get_mut(own) else { return near };
        let step = last.map(|(last, _)| position.wrapping_sub(last));
        match last.replace((position, step)) {
            Some((last, Some(step))) if !both => near.min(bits(last.wrapping_add(step), position)),
            _ => near,
        }
    }

    /// Whether most of the blocks make sense, and counters advance, which NOPs in another shape do not seem to. One block fewer than
    /// are enough will do: at the end of a log another shape may see one more.
    fn makes_sense(&self, shifted: bool) -> bool {
        let of_ten = if shifted { 9 } else { 5 };
        let is_sound = self.good.saturating_mul(10) > self.all.saturating_mul(of_ten);
        let counts = self.followed.saturating_mul(5) >= self.again.saturating_mul(3);
        is_sound && counts && self.points > 0 && self.has(LEAST.saturating_sub(1), self.followed.saturating_add(1))
    }

    /// Whether these blocks are enough.
    fn is_enough(&self) -> bool {
        self.has(LEAST, self.followed)
    }

    /// Whether there are at least so many sound blocks, and the counters of half of them follow others.
    fn has(&self, least: usize, followed: usize) -> bool {
        self.good >= least && followed.saturating_mul(2) >= self.good
    }

    /// Whether two blocks more or less make the difference, as there may be at the ends of a log.
    fn is_close_to(&self, other: &Self) -> bool {
        let two_blocks = FOLLOWS.saturating_add(SUB).saturating_mul(2);
        self.points.saturating_sub(other.points) <= two_blocks
    }
}

/// Returns the number of bits of the distance between two positions.
fn bits(from: i32, to: i32) -> i32 {
    let distance = to.wrapping_sub(from).unsigned_abs();
    distance.checked_ilog2().map_or(0, |bits| i32::try_from(bits).unwrap_or(0).saturating_add(1))
}

/// Returns the place of a direction and drive.
const fn place(byte0: u8) -> usize {
    (byte0 >> 2 & 0x20 | byte0 & 0x1f) as usize
}
