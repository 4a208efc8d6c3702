//! The queue from the background to the step interrupt: segments in linked slots, with one writer and one reader that use
//! only loads and stores of words.
//!
//! Two blocks of slots take turns. A block is a chain of segments to run, followed by the chain of a stop from their end.
//! The last segment is linked to that stop at first; when the next block is ready, one store links it to that block
//! instead. Whichever chain the reader finds there is therefore complete: more motion, or a stop. A block is rewritten only
//! after the
//! reader has entered the other one.

use core::sync::atomic::{AtomicU32, Ordering};

use servowire_core::Direction;

use crate::word::Word;

/// Some steps whose intervals change by the second and third differences of their times. Times are in 2^-32 ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Segment {
    /// Events, 1 to 65535.
    pub(crate) count: u16,
    /// The kind of each event.
    pub(crate) kind: Kind,
    /// Interval from the previous event to the first one.
    pub(crate) first: i64,
    /// At each event after the first, `interval` grows by `add`, and `add` by `bend`.
    pub(crate) interval: i64,
    pub(crate) add: i64,
    pub(crate) bend: i64,
}

/// What happens at an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Kind {
    /// A step, or merely DIR and a wait.
    pub(crate) step: bool,
    /// DIR is high from it on: backwards.
    pub(crate) reverse: bool,
    /// DIR changes here: the only event of its segment.
    pub(crate) edge: bool,
    /// The axes of a path end a block, or a stop, here.
    pub(crate) joint: Joint,
}

/// A point where all axes of a path have an event at the same tick and continue together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Joint {
    /// Nowhere.
    No,
    /// The end of a block: continues with the next one, or with the stop.
    Block,
    /// The end of a stop: at rest.
    Rest,
}

/// The upper half of a segment's head: a step forward or backwards as the number +1 or -1 in the top two bits, then DIR.
pub(crate) const DELTA: u32 = 30;
pub(crate) const DIR: u32 = 1 << 29;
pub(crate) const COUNT: u32 = 0xffff;
/// The bit of a [`Joint`], and the bit of one at rest.
pub(crate) const JOINT: u32 = 1 << 28;
pub(crate) const REST: u32 = 1 << 27;
/// The bit of a change of DIR, so many bits below that of DIR.
pub(crate) const EDGE: u32 = DIR >> BELOW;
const BELOW: u32 = 3;

/// Returns the bit of DIR before the event of a head.
#[inline(always)]
pub(crate) const fn dir_before(head: u32) -> u32 {
    (head ^ head << BELOW) & DIR
}

/// Returns DIR of a head, or of the report of a halt.
pub(crate) const fn dir(word: u32) -> Direction {
    if word & DIR == 0 { Direction::Forward } else { Direction::Reverse }
}

impl Segment {
    pub(crate) const fn head(&self) -> u32 {
        let delta = match self.kind {
            Kind { step: false, .. } => 0,
            Kind { reverse: false, .. } => 1 << DELTA,
            Kind { reverse: true, .. } => 3 << DELTA,
        };
        let joint = match self.kind.joint {
            Joint::No => 0,
            Joint::Block => JOINT,
            Joint::Rest => JOINT | REST,
        };
        let dir = if self.kind.reverse { DIR } else { 0 } | if self.kind.edge { EDGE } else { 0 };
        delta | dir | joint | self.count as u32
    }
}

/// No slot follows.
pub(crate) const NONE: u32 = u32::MAX;
/// In the reader's report: it has stopped at the end of that slot.
pub(crate) const IDLE: u32 = 1 << 31;
/// From this bit up to [`DIR`]: the ticket of the halt that put the reader there; then DIR as the halt has left it.
pub(crate) const TICKET: u32 = 16;

/// A segment in words.
#[derive(Debug)]
pub(crate) struct Slot {
    pub(crate) head: AtomicU32,
    pub(crate) next: Word,
    first: [AtomicU32; 2],
    interval: [AtomicU32; 2],
    add: [AtomicU32; 2],
    bend: [AtomicU32; 2],
}

impl Slot {
    pub(crate) const fn new() -> Self {
        const fn word(n: u32) -> AtomicU32 {
            AtomicU32::new(n)
        }
        const fn pair() -> [AtomicU32; 2] {
            [word(0), word(0)]
        }
        Self { head: word(1), next: Word::new(NONE), first: pair(), interval: pair(), add: pair(), bend: pair() }
    }

    #[inline(always)]
    fn wide([low, high]: &[AtomicU32; 2]) -> u64 {
        u64::from(low.load(Ordering::Relaxed)) | u64::from(high.load(Ordering::Relaxed)) << 32
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "halves of a wider number")]
    fn set([low, high]: &[AtomicU32; 2], value: i64) {
        low.store(value as u32, Ordering::Relaxed);
        high.store((value >> 32) as u32, Ordering::Relaxed);
    }

    #[inline(always)]
    pub(crate) fn first(&self) -> u64 {
        Self::wide(&self.first)
    }

    #[inline(always)]
    pub(crate) fn interval(&self) -> u64 {
        Self::wide(&self.interval)
    }

    #[inline(always)]
    pub(crate) fn add(&self) -> u64 {
        Self::wide(&self.add)
    }

    #[inline(always)]
    pub(crate) fn bend(&self) -> u64 {
        Self::wide(&self.bend)
    }

    /// Writes a segment that nothing follows yet; the reader must not be in this slot.
    fn put(&self, segment: &Segment) {
        self.head.store(segment.head(), Ordering::Relaxed);
        self.next.store(NONE, Ordering::Relaxed);
        Self::set(&self.first, segment.first);
        Self::set(&self.interval, segment.interval);
        Self::set(&self.add, segment.add);
        Self::set(&self.bend, segment.bend);
    }
}

/// Segments between an [`Axis`](crate::Axis) in the background and a [`StepTimer`](crate::StepTimer) in an interrupt: `N` slots
/// of 40 bytes, at least 9. Half of them form a block; two thirds of a block are for the stop that follows it.
///
/// Put it into a `static`; [`Axis::new`](crate::Axis::new) returns both ends.
#[derive(Debug)]
pub struct Queue<const N: usize> {
    pub(crate) slots: [Slot; N],
    /// Where the reader is.
    pub(crate) current: Word,
    /// Steps made, forward minus reverse, modulo 2^32.
    pub(crate) made: Word,
    /// The ticket of a halt if not 0: no further step.
    pub(crate) halt: Word,
}

impl<const N: usize> Queue<N> {
    /// Slots of a block; slot 0 belongs to no block, the reader is parked there.
    pub(crate) const BLOCK: usize = N.saturating_sub(1) / 2;

    /// Creates an empty queue.
    pub const fn new() -> Self {
        const { assert!(N >= 9 && N < 1 << 16, "9 to 65535 slots") };
        Self { slots: [const { Slot::new() }; N], current: Word::new(IDLE), made: Word::new(0), halt: Word::new(0) }
    }

    /// Returns the slot at a place of a block.
    pub(crate) const fn slot(block: usize, at: usize) -> usize {
        1_usize.saturating_add(block.saturating_mul(Self::BLOCK)).saturating_add(at)
    }

    /// Returns the block of a slot, and its place in it.
    pub(crate) fn place(slot: usize) -> Option<(usize, usize)> {
        let at = slot.checked_sub(1)?;
        Some((at.checked_div(Self::BLOCK)?, at.checked_rem(Self::BLOCK)?))
    }

    /// Writes a segment into a slot, and links it to the one before it if that is in the same block.
    pub(crate) fn put(&self, slot: usize, segment: &Segment, after: Option<usize>) {
        if let Some(place) = self.slots.get(slot) {
            place.put(segment);
        }
        if let Some(after) = after {
            self.link(after, slot);
        }
    }

    /// Returns DIR at the end of a slot.
    pub(crate) fn dir(&self, slot: usize) -> Option<Direction> {
        self.slots.get(slot).map(|slot| dir(slot.head.load(Ordering::Relaxed)))
    }

    /// Makes `slot` follow `after` from now on.
    pub(crate) fn link(&self, after: usize, slot: usize) {
        if let (Some(place), Ok(slot)) = (self.slots.get(after), u32::try_from(slot)) {
            place.next.store(slot, Ordering::Release);
        }
    }
}

impl<const N: usize> Default for Queue<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_in_words() {
        let head = |step, reverse, joint| {
            let kind = Kind { step, reverse, edge: false, joint };
            Segment { count: 0x1234, kind, first: 0, interval: 0, add: 0, bend: 0 }.head()
        };
        assert_eq!(head(true, false, Joint::No), 0x4000_1234);
        assert_eq!(head(true, true, Joint::No), 0xe000_1234);
        assert_eq!(head(false, false, Joint::Block), 0x1000_1234);
        assert_eq!(head(false, true, Joint::Rest), 0x3800_1234);
        let turn = |reverse| {
            let kind = Kind { step: false, reverse, edge: true, joint: Joint::No };
            Segment { count: 1, kind, first: 0, interval: 0, add: 0, bend: 0 }.head()
        };
        assert_eq!([turn(false), turn(true)], [0x0400_0001, 0x2400_0001]);
        for (level, heads) in [
            (0, [head(true, false, Joint::No), head(false, false, Joint::Rest), turn(true)]),
            (0x2000_0000, [head(true, true, Joint::No), head(false, true, Joint::Block), turn(false)]),
        ] {
            assert_eq!(heads.map(dir_before), [level; 3]);
        }
    }
}
