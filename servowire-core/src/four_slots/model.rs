//! Checks with `loom` every interleaving of a writer and a reader, and every order in which their stores can be seen: `.ci/run
//! loom`. Also checks that the model detects faults, by leaving out each barrier once.

use core::cell::Cell;
use std::panic::catch_unwind;

use loom::cell::UnsafeCell;
use loom::model::Builder;
use loom::sync::Arc;
pub(super) use loom::sync::atomic::AtomicU32;
use loom::sync::atomic::Ordering;
use loom::thread;

use super::{Barrier, FourSlots, NOTHING, Slot};

std::thread_local! {
    static LEFT_OUT: Cell<Option<Barrier>> = const { Cell::new(None) };
    static WATCHED: Cell<bool> = const { Cell::new(true) };
}

pub(super) fn fence(barrier: Barrier) {
    if LEFT_OUT.get() != Some(barrier) {
        loom::sync::atomic::fence(barrier.ordering());
    }
}

/// A word of a slot. If the word is watched, every load has to be ordered with respect to every store, as if the word were not
/// atomic. This finds faults that the values do not reveal: on a processor a load may see a store from its future, but not in
/// the model.
pub(super) struct Word {
    value: AtomicU32,
    access: UnsafeCell<()>,
}

impl Word {
    fn new() -> Self {
        Self { value: AtomicU32::new(0), access: UnsafeCell::new(()) }
    }

    pub(super) fn load(&self, ordering: Ordering) -> u32 {
        if WATCHED.get() {
            self.access.with(|_| ());
        }
        self.value.load(ordering)
    }

    pub(super) fn store(&self, value: u32, ordering: Ordering) {
        if WATCHED.get() {
            self.access.with_mut(|_| ());
        }
        self.value.store(value, ordering);
    }
}

impl<const W: usize, const E: usize> FourSlots<W, E> {
    fn modelled() -> Self {
        let slot = |_| Slot([0; W].map(|_| Word::new()), [0; E].map(|_| Word::new()));
        Self { control: AtomicU32::new(NOTHING), announced: AtomicU32::new(0), slots: [0; 4].map(slot) }
    }
}

/// Returns value number `n`.
fn value(n: u32) -> ([u32; 1], [u32; 1]) {
    ([n], [!n])
}

/// Runs a writer of the values 1 to 4 against this number of readings, with at most four preemptions.
fn explore(gets: u32) {
    let mut builder = Builder::new();
    builder.preemption_bound = Some(4);
    builder.check(move || {
        let shared = Arc::new((FourSlots::<1, 1>::modelled(), AtomicU32::new(0)));
        let writer = Arc::clone(&shared);
        let writer = thread::spawn(move || {
            let (slots, complete) = &*writer;
            for n in 1..=4 {
                slots.put(&value(n));
                complete.store(n, Ordering::Release);
            }
        });
        let (slots, complete) = &*shared;
        let mut newest = 0;
        for _ in 0..gets {
            let complete = complete.load(Ordering::Acquire);
            let n = slots.get().map_or(0, |([n], [check])| {
                assert_eq!(n, !check, "torn");
                n
            });
            assert!(n >= newest, "{n} after {newest}");
            assert!(n >= complete, "{n} is stale: {complete} was complete");
            newest = n;
        }
        assert!(writer.join().is_ok());
        assert_eq!(slots.get(), Some(value(4)));
    });
}

#[test]
fn no_value_is_torn_stale_or_older_than_the_one_before() {
    explore(3);
}

/// Returns whether the model finds a fault without this barrier.
fn is_missed(barrier: Barrier, watched: bool) -> bool {
    LEFT_OUT.set(Some(barrier));
    WATCHED.set(watched);
    let outcome = catch_unwind(|| explore(2));
    LEFT_OUT.set(None);
    WATCHED.set(true);
    outcome.is_err()
}

#[test]
fn a_barrier_that_is_left_out_is_found() {
    use Barrier::{Announces, Begins, Chooses, Publishes, Reads, Writes};
    for barrier in [Begins, Writes, Publishes, Announces, Chooses, Reads] {
        assert!(is_missed(barrier, true), "{barrier:?}");
    }
    // By the values alone.
    for barrier in [Begins, Publishes, Chooses, Reads] {
        assert!(is_missed(barrier, false), "{barrier:?}");
    }
}
