//! Passes words from one writer to one reader, wait-free for both, with loads and stores alone: Simpson's four slots.
//!
//! H. R. Simpson, "Four-slot fully asynchronous communication mechanism", IEE Proceedings 137 E 1 (1990). There are two
//! pairs of two slots. The writer avoids the pair that the reader has announced, and within a pair it avoids the newest
//! slot. What Simpson keeps in two variables of the writer (newest pair, newest slot of each pair) is a single word here,
//! stored once per value, so the reader never sees one without the other.
//!
//! Why this holds, in whatever order two cores see each other's stores:
//!
//! * A reading is never older than the one before it, nor older than the last complete value: both loads of a reading are of
//!   `control` alone, and the loads of one variable never go back.
//! * No slot is read while it is written. The reader in pair p at its slot i has announced p, passed `Chooses`, and seen in
//!   `control` that i is the newest of p. The writer returns to this slot only with the second value that it puts into p after
//!   that. The reader had not seen the first of them, so the reader's `Chooses` came before the writer's `Begins` of the
//!   second; the writer therefore sees p announced and takes the other pair. If it sees a later announcement instead,
//!   that one was made after `Announces`, when the slot had been read, and the writer writes after `Writes`.
//! * A slot is whole: it is written before `Publishes` and read after `Reads`.

#[cfg(all(test, loom))]
mod model;

use core::sync::atomic::Ordering;

#[cfg(not(all(test, loom)))]
use core::sync::atomic::AtomicU32;

#[cfg(all(test, loom))]
use model::{AtomicU32, Word, fence};

/// A word of a slot.
#[cfg(not(all(test, loom)))]
type Word = AtomicU32;

/// The value of `control` before the first value is stored.
const NOTHING: u32 = 0;
/// Set in `control` from the first value onwards.
const SOMETHING: u32 = 1;
/// The newest pair, in `control`. A pair is named by its first slot, 0 or 2.
const PAIR: u32 = 2;
/// Bits of `control` below the newest slot of pair 0; the newest slot of pair 2 lies two bits higher.
const NEWEST: u32 = 2;
/// Any slot.
const SLOT: u32 = 3;

/// The barriers that keep the loads and stores of one end in order as seen by the other end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Barrier {
    /// Writer: the previous value is visible to the reader before the writer looks which pair is announced.
    Begins,
    /// Writer: it looks which pair is announced before it writes into the other one.
    Writes,
    /// Writer: the slot is written before it becomes the newest.
    Publishes,
    /// Reader: the previous slot has been read before another pair is announced.
    Announces,
    /// Reader: the pair is announced before the reader looks for the newest slot in it.
    Chooses,
    /// Reader: the newest slot is known before it is read.
    Reads,
}

impl Barrier {
    const fn ordering(self) -> Ordering {
        match self {
            // A store before a load of something else: nothing weaker keeps these in order.
            Self::Begins | Self::Chooses => Ordering::SeqCst,
            Self::Publishes | Self::Announces => Ordering::Release,
            Self::Writes | Self::Reads => Ordering::Acquire,
        }
    }
}

/// A value: `W` words and `E` further words.
type Value<const W: usize, const E: usize> = ([u32; W], [u32; E]);

struct Slot<const W: usize, const E: usize>([Word; W], [Word; E]);

impl<const W: usize, const E: usize> Slot<W, E> {
    fn store(&self, words: &Value<W, E>) {
        store(&self.0, &words.0);
        store(&self.1, &words.1);
    }

    #[inline]
    fn load(&self) -> Value<W, E> {
        (load(&self.0), load(&self.1))
    }
}

fn store<const N: usize>(to: &[Word; N], words: &[u32; N]) {
    for (word, value) in to.iter().zip(words) {
        word.store(*value, Ordering::Relaxed);
    }
}

#[inline]
fn load<const N: usize>(from: &[Word; N]) -> [u32; N] {
    let mut words = [0; N];
    for (value, word) in words.iter_mut().zip(from) {
        *value = word.load(Ordering::Relaxed);
    }
    words
}

/// Four slots of `W` and `E` words. One end calls [`put`](Self::put), the other [`get`](Self::get).
pub(crate) struct FourSlots<const W: usize, const E: usize> {
    /// Stored only by the writer.
    control: AtomicU32,
    /// The pair that the reader is in; stored only by the reader.
    announced: AtomicU32,
    slots: [Slot<W, E>; 4],
}

impl<const W: usize, const E: usize> FourSlots<W, E> {
    /// Creates slots without a value.
    #[cfg(not(all(test, loom)))]
    pub(crate) const fn new() -> Self {
        let control = AtomicU32::new(NOTHING);
        Self { control, announced: AtomicU32::new(0), slots: [const { Slot::new() }; 4] }
    }

    /// Stores a value. Only one writer may call this.
    pub(crate) fn put(&self, value: &Value<W, E>) {
        let control = self.control.load(Ordering::Relaxed);
        let slot = self.free(control);
        let pair = slot & PAIR;
        if let Some(slot) = self.slots.get(slot as usize) {
            slot.store(value);
        }
        fence(Barrier::Publishes);
        let other_pair = control & !(SLOT << NEWEST).wrapping_shl(pair) & !PAIR;
        let control = other_pair | (slot << NEWEST).wrapping_shl(pair) | pair | SOMETHING;
        self.control.store(control, Ordering::Relaxed);
    }

    /// Returns the slot for the next value: in the pair that is not announced, the slot that is not the newest.
    fn free(&self, control: u32) -> u32 {
        fence(Barrier::Begins);
        let pair = !self.announced.load(Ordering::Relaxed) & PAIR;
        fence(Barrier::Writes);
        pair | (!newest(control, pair) & 1)
    }

    /// Returns the newest value; `None` before the first one. Only one reader may call this.
    #[inline]
    pub(crate) fn get(&self) -> Option<Value<W, E>> {
        let control = self.control.load(Ordering::Relaxed);
        if control == NOTHING {
            return None;
        }
        let pair = control & PAIR;
        fence(Barrier::Announces);
        self.announced.store(pair, Ordering::Relaxed);
        fence(Barrier::Chooses);
        let control = self.control.load(Ordering::Relaxed);
        fence(Barrier::Reads);
        self.slots.get(newest(control, pair) as usize).map(Slot::load)
    }
}

#[cfg(not(all(test, loom)))]
impl<const W: usize, const E: usize> Slot<W, E> {
    const fn new() -> Self {
        Self([const { Word::new(0) }; W], [const { Word::new(0) }; E])
    }
}

/// Returns the newest slot of a pair.
const fn newest(control: u32, pair: u32) -> u32 {
    (control.wrapping_shr(pair) >> NEWEST) & SLOT
}

#[cfg(not(all(test, loom)))]
#[inline(always)]
fn fence(barrier: Barrier) {
    core::sync::atomic::fence(barrier.ordering());
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    /// The writer leaves alone every slot that a reader may be in, whatever pairs it announced before: the announced pair and,
    /// in the other pair, the newest slot, which a reader enters if it announces late.
    #[test]
    fn the_writer_keeps_off_the_slot_of_the_reader() {
        for announcements in 0_u32..256 {
            let slots = FourSlots::<1, 0>::new();
            let mut newest_of = [None; 2];
            for value in 0_u32..8 {
                let announced = 2 * (announcements >> value & 1);
                slots.announced.store(announced, Ordering::Relaxed);
                let free = slots.free(slots.control.load(Ordering::Relaxed));
                let pair = 2 - announced;
                assert!(free == pair || free == pair + 1, "{announcements:08b}, {value}: {free}");
                let newest = &mut newest_of[usize::from(pair == 2)];
                assert_ne!(*newest, Some(free), "{announcements:08b}, {value}");
                *newest = Some(free);
                slots.put(&([value], []));
                assert_eq!(slots.slots[free as usize].load(), ([value], []));
                assert_eq!(slots.get(), Some(([value], [])));
            }
        }
    }
}
