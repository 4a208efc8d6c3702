//! The interrupt half of a path: the step timers of all its axes on one clock.

use core::sync::atomic::{Ordering, fence};

use crate::queue::{JOINT, Queue, REST};
use crate::step_timer::StepTimer;
use crate::word::Word;

/// Segments between [`Axes`](crate::Axes) in the background and an [`AxesTimer`] in an interrupt: a [`Queue`] of `S` slots for each of
/// `N` axes, 1 to 16. With fewer than 65 slots a path may come to rest again and again. Where the slots do not hold 0.5 ms of it, or
/// a 16th of the reach if that is less, it is given up as [`Work::TooFewSlots`](crate::Work::TooFewSlots) says.
///
/// Put it into a `static`; [`Axes::new`](crate::Axes::new) returns both ends.
#[derive(Debug)]
pub struct AxesQueue<const N: usize, const S: usize> {
    pub(crate) axes: [Queue<S>; N],
    /// The slot at which the next block begins in all axes; [`REST`] if it follows a stop rather than a block; and from bit
    /// [`TURN`] up, a number that changes with each block. One store therefore lets all axes in.
    pub(crate) gate: Word,
}

/// The lowest bit of a gate's number, and how many such numbers there are.
pub(crate) const TURN: u32 = 16;
pub(crate) const TURNS: u32 = 1 << 11;

impl<const N: usize, const S: usize> AxesQueue<N, S> {
    /// Empty.
    pub const fn new() -> Self {
        const { assert!(N >= 1 && N <= 16, "1 to 16 axes") };
        Self { axes: [const { Queue::new() }; N], gate: Word::new(0) }
    }
}

impl<const N: usize, const S: usize> Default for AxesQueue<N, S> {
    fn default() -> Self {
        Self::new()
    }
}

/// What the caller of [`AxesTimer::fire`] has to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FiredAxes {
    steps: u16,
    reverse: u16,
    wait: u32,
}

impl FiredAxes {
    /// The axes that step now, one bit each, the first axis in bit 0. DIR of each has been valid for the time that
    /// its driver needs.
    #[inline(always)]
    pub const fn steps(self) -> u16 {
        self.steps
    }

    /// The level of DIR of each axis from now on, one bit each, 1 for backwards; it never changes together with a step of
    /// the axis.
    #[inline(always)]
    pub const fn reverse(self) -> u16 {
        self.reverse
    }

    /// Ticks from this event to the next one, at least 1: add them to the compare register. 0: there is none; stop the
    /// timer.
    #[inline(always)]
    pub const fn wait(self) -> u32 {
        self.wait
    }
}

/// The step interrupt of the axes of a path, on one timer.
///
/// [`fire`](Self::fire) is called when the compare time is reached. Each axis steps when the path reaches its step, so two
/// axes may step a tick apart: if the new compare time has already passed, call it again at once.
///
/// ```
/// # use step_motion::{Axes, AxesQueue, AxisSetup, Clock, Limits, Path, Work};
/// # static QUEUE: AxesQueue<2, 65> = AxesQueue::new();
/// # let axis = AxisSetup::new(Limits::new(20_000, 200_000)?, 80_000);
/// # let (mut axes, mut timer) = Axes::new(&QUEUE, Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20)?);
/// # axes.push([80, 40], 100_000)?;
/// # while axes.poll() == Work::More {}
/// # let (mut compare, now) = (0_u32, || 0_u32);
/// // in the handler of the timer
/// loop {
///     let fired = timer.fire();
///     // the DIR pins to fired.reverse(), and a pulse at each pin of
///     let _pins = fired.steps();
///     if fired.wait() == 0 {
///         break; // disable the interrupt until the axes say that there is more
///     }
///     compare = compare.wrapping_add(fired.wait());
///     if now().wrapping_sub(compare) > u32::MAX / 2 {
///         break; // it is still to come
///     }
/// }
/// # assert!(compare > 0);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct AxesTimer<'q, const N: usize, const S: usize> {
    queue: &'q AxesQueue<N, S>,
    axes: [(StepTimer<'q, S>, u32); N],
    reverse: u16,
    /// The wait requested by the last call.
    wait: u32,
    /// The gate passed last.
    taken: u32,
}

impl<'q, const N: usize, const S: usize> AxesTimer<'q, N, S> {
    pub(crate) fn new(queue: &'q AxesQueue<N, S>) -> Self {
        let axes = queue.axes.each_ref().map(|queue| (StepTimer::new(queue), 0));
        Self { queue, axes, reverse: 0, wait: 0, taken: 0 }
    }

    /// Creates axes for measurements: with segments of this many steps that follow each other for ever, the first steps
    /// this many ticks apart, in a queue without another user.
    #[doc(hidden)]
    pub fn endless(queue: &'q AxesQueue<N, S>, count: u16, apart: u32) -> Self {
        let mut wait = 0_u32;
        let axes = queue.axes.each_ref().map(|queue| {
            wait = wait.wrapping_add(apart);
            (StepTimer::endless(queue, count), wait.wrapping_sub(apart))
        });
        Self { queue, axes, reverse: 0, wait: 0, taken: 0 }
    }

    /// Returns the events that are due now, and the ticks until the next one. While the timer is stopped, a call starts the
    /// planned motion.
    #[inline]
    pub fn fire(&mut self) -> FiredAxes {
        let halt = self.queue.axes.first().map_or(0, |queue| queue.halt.load(Ordering::Relaxed));
        if halt != 0 {
            return self.halted(halt);
        }
        // The same for all axes that are at a joint now; it is behind what it lets in.
        let gate = self.queue.gate.load(Ordering::Acquire);
        let (open, waited) = (gate != self.taken, self.wait);
        let (mut steps, mut reverse, mut next, mut entered, mut bit) = (0, self.reverse, u32::MAX, false, 1_u16);
        for (axis, wait) in &mut self.axes {
            let mut left = wait.wrapping_sub(waited);
            if left == 0 {
                let fired = axis.event(|slot, head| {
                    if head & JOINT != 0 && open && (gate ^ head) & REST == 0 {
                        entered = true;
                        return gate & ((1 << TURN) - 1);
                    }
                    slot.next.load(Ordering::Relaxed)
                });
                steps |= if fired.is_step() { bit } else { 0 };
                reverse = if fired.direction().dir() { reverse | bit } else { reverse & !bit };
                left = fired.wait();
            }
            (*wait, next) = (left, next.min(left));
            bit <<= 1;
        }
        if entered {
            self.taken = gate;
        }
        (self.reverse, self.wait) = (reverse, next);
        FiredAxes { steps, reverse, wait: next }
    }

    /// Makes no step, whatever was planned; the next motion starts afresh.
    #[cold]
    #[inline(never)]
    fn halted(&mut self, ticket: u32) -> FiredAxes {
        for (axis, wait) in &mut self.axes {
            axis.halted(ticket);
            *wait = 0;
        }
        // What was let in before the halt is over with it, also where the background runs on another core.
        fence(Ordering::Acquire);
        (self.wait, self.taken) = (0, self.queue.gate.load(Ordering::Relaxed));
        FiredAxes { steps: 0, reverse: self.reverse, wait: 0 }
    }
}
