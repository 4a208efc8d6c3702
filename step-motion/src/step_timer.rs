//! The interrupt half of a motion: it only adds.

use core::sync::atomic::{Ordering, fence};

use servowire_core::Direction;

use crate::queue::{COUNT, DELTA, DIR, IDLE, JOINT, Joint, Kind, Queue, REST, Segment, Slot, TICKET, dir, dir_before};

/// What the caller of [`StepTimer::fire`] has to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fired {
    head: u32,
    wait: u32,
}

impl Fired {
    /// Returns whether to make a step now. DIR has been valid for the time that the driver needs.
    #[inline(always)]
    pub const fn is_step(self) -> bool {
        self.head >> DELTA != 0
    }

    /// The level of DIR from now on; it never changes together with a step.
    #[inline(always)]
    pub const fn direction(self) -> Direction {
        dir(self.head)
    }

    /// Ticks from this event to the next one, at least 1: add them to the compare register. 0: no event follows; stop the
    /// timer.
    #[inline(always)]
    pub const fn wait(self) -> u32 {
        self.wait
    }
}

/// The head of a stopped timer: an event that does nothing, after which motion may follow.
const STANDING: u32 = JOINT | REST | 1;
/// The slot of a queue that has none.
static NOWHERE: Slot = Slot::new();

/// The step interrupt of an axis.
///
/// [`fire`](Self::fire) is called when the compare time is reached, at any clock: it takes at most 40 instructions on a Cortex-M4
/// and 60 on a Cortex-M0+, and every call executes the same instructions, including a change to the next segment.
///
/// ```
/// # use step_motion::{Axis, Clock, Limits, Queue};
/// # static QUEUE: Queue<65> = Queue::new();
/// # let (mut axis, mut timer) = Axis::new(&QUEUE, Clock::MICROSECONDS, Limits::new(20_000, 100_000)?)?;
/// # axis.move_to(3, )?;
/// # while axis.poll() == step_motion::Work::More {}
/// # let mut compare = 0_u32;
/// // in the handler of the timer
/// let fired = timer.fire();
/// // DIR to fired.direction(), and a pulse if
/// if fired.is_step() {}
/// match fired.wait() {
///     0 => {} // disable the interrupt until the axis says that there is more
///     wait => compare = compare.wrapping_add(wait),
/// }
/// # assert!(compare > 0);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct StepTimer<'q, const N: usize> {
    queue: &'q Queue<N>,
    /// The present segment, or the one after which the timer has stopped.
    slot: &'q Slot,
    /// The kind of this event, and how many are left in the segment, including this one.
    head: u32,
    /// How much later than its tick the next event is, in 2^-32 ticks.
    fraction: u32,
    interval: u64,
    add: u64,
}

impl<'q, const N: usize> StepTimer<'q, N> {
    pub(crate) fn new(queue: &'q Queue<N>) -> Self {
        let slot = queue.slots.first().unwrap_or(&NOWHERE);
        Self { queue, slot, head: STANDING, fraction: 0, interval: 0, add: 0 }
    }

    /// Creates a timer for measurements: segments of this many steps follow each other without end, in a queue with no
    /// other user.
    #[doc(hidden)]
    pub fn endless(queue: &'q Queue<N>, count: u16) -> Self {
        let kind = Kind { step: true, reverse: false, edge: false, joint: Joint::No };
        let segment = Segment { count, kind, first: 5 << 32, interval: 5 << 32, add: 1, bend: 1 };
        for (slot, after) in [(1, 0), (2, 1)] {
            queue.put(slot, &segment, Some(after));
        }
        queue.link(2, 1);
        Self::new(queue)
    }

    /// Returns the event that is due now, and the ticks until the next one. While the timer is stopped, a call starts the
    /// planned motion.
    #[inline]
    pub fn fire(&mut self) -> Fired {
        let queue = self.queue;
        let halt = queue.halt.load(Ordering::Relaxed);
        if halt != 0 {
            return self.halted(halt);
        }
        self.event(|slot, _| slot.next.load(Ordering::Relaxed))
    }

    /// Makes the event that is due; `next` gets the head of the slot that has ended and says which slot follows.
    #[inline(always)]
    pub(crate) fn event(&mut self, next: impl FnOnce(&Slot, u32) -> u32) -> Fired {
        let queue = self.queue;
        let head = self.head;
        // Nothing else writes there.
        #[expect(clippy::cast_possible_wrap, clippy::cast_sign_loss, reason = "-1, 0 or 1 in the top bits")]
        let made = queue.made.load(Ordering::Relaxed).wrapping_add((head as i32 >> DELTA) as u32);
        queue.made.store(made, Ordering::Relaxed);
        let left = head.wrapping_sub(1);
        let interval = if left & COUNT == 0 {
            let next = next(self.slot, head);
            // The slot was written before it was linked, and the previous one is read before its block is freed.
            fence(Ordering::AcqRel);
            let Some(slot) = queue.slots.get(next as usize) else { return self.idle(head) };
            queue.current.store(next, Ordering::Relaxed);
            self.slot = slot;
            self.head = slot.head.load(Ordering::Relaxed);
            (self.interval, self.add) = (slot.interval(), slot.add());
            slot.first()
        } else {
            self.head = left;
            self.interval = self.interval.wrapping_add(self.add);
            self.add = self.add.wrapping_add(self.slot.bend());
            self.interval
        };
        #[expect(clippy::cast_possible_truncation, reason = "halves of a wider number")]
        let (whole, part) = ((interval >> 32) as u32, interval as u32);
        let (fraction, carry) = self.fraction.overflowing_add(part);
        self.fraction = fraction;
        Fired { head, wait: whole.wrapping_add(u32::from(carry)) }
    }

    /// Stops the timer after the last event.
    #[cold]
    #[inline(never)]
    fn idle(&mut self, head: u32) -> Fired {
        self.head = head & DIR | STANDING;
        let current = &self.queue.current;
        current.store(current.load(Ordering::Relaxed) | IDLE, Ordering::Release);
        Fired { head, wait: 0 }
    }

    /// Makes no step, whatever was planned, and leaves DIR as it is; the next motion starts afresh.
    #[cold]
    #[inline(never)]
    pub(crate) fn halted(&mut self, ticket: u32) -> Fired {
        if let Some(slot) = self.queue.slots.first() {
            self.slot = slot;
        }
        // The next event, which is not made, may have been a change of DIR.
        let dir = dir_before(self.head);
        (self.head, self.fraction) = (dir | STANDING, 0);
        self.queue.current.store(IDLE | ticket << TICKET | dir, Ordering::Release);
        Fired { head: self.head, wait: 0 }
    }
}
