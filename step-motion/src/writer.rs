//! Writes segments into the slots of a block.

use servowire_core::Direction;

use crate::cutter::Stretch;
use crate::queue::{Joint, Kind, Queue, Segment};

/// A tick in units of time.
pub(crate) const TICK: i128 = 1 << 32;
/// The longest wait in an event, in ticks.
pub(crate) const LONGEST: u32 = 1 << 30;

/// Where the next segment is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Writer {
    /// The end of what has been cut, in 2^-32 ticks as the interrupt adds them up; and DIR there.
    pub(crate) end: i128,
    pub(crate) dir: Direction,
    /// The last step; or, if there is none in the block, what is known to be no earlier.
    pub(crate) last: i128,
    /// Slots of the block that are filled.
    pub(crate) len: usize,
}

impl Writer {
    /// Creates a writer at the start of a block.
    pub(crate) const fn new(end: i128, dir: Direction) -> Self {
        Self { end, dir, last: end, len: 0 }
    }

    /// Appends steps; before them a change of DIR, if there is one, and a wait if it is too long for one event.
    pub(crate) fn put_steps<const N: usize>(
        &mut self,
        to: (&Queue<N>, usize),
        stretch: &Stretch,
        direction: Direction,
    ) {
        let first = stretch.first.wrapping_add(TICK / 2).max(self.end.wrapping_add(TICK));
        self.put_turn(to, first, direction, i128::MAX);
        let first = first.max(self.end.wrapping_add(TICK));
        self.put_long_wait(to, first);
        let kind = Kind { step: true, ..self.rest(Joint::No) };
        let late = first.wrapping_sub(stretch.first);
        self.put(to, (stretch.count, kind), first, stretch.differences);
        self.end = stretch.last().wrapping_add(late);
        self.last = self.end;
    }

    /// Appends a change of DIR, if there is one and it is before a time: in the middle between the last step and `next`, which is not
    /// after the next one.
    pub(crate) fn put_turn<const N: usize>(
        &mut self,
        to: (&Queue<N>, usize),
        next: i128,
        direction: Direction,
        before: i128,
    ) {
        let middle = (self.last.saturating_add(next) / 2).max(self.end.saturating_add(TICK));
        if self.dir != direction && middle < before {
            self.put_long_wait(to, middle);
            self.dir = direction;
            self.put(to, (1, Kind { edge: true, ..self.rest(Joint::No) }), middle, [0; 3]);
            self.end = middle;
        }
    }

    /// Appends a wait until a time.
    pub(crate) fn put_wait<const N: usize>(&mut self, to: (&Queue<N>, usize), until: i128) {
        let kind = self.rest(Joint::No);
        let mut left = until.saturating_sub(self.end);
        let longest = i128::from(LONGEST) << 32;
        if left > longest {
            let times = left.checked_div(longest).unwrap_or(0).min(0xffff);
            let count = u16::try_from(times).unwrap_or(u16::MAX);
            let end = self.end.saturating_add(longest);
            self.put(to, (count, kind), end, [i64::from(LONGEST) << 32, 0, 0]);
            self.end = self.end.saturating_add(longest.wrapping_mul(times));
            left = until.saturating_sub(self.end);
        }
        if left >= TICK {
            self.put(to, (1, kind), until, [0; 3]);
            self.end = until;
        }
    }

    /// Appends an event that all axes of a path share; it must come after the last event of this axis.
    pub(crate) fn put_joint<const N: usize>(&mut self, to: (&Queue<N>, usize), at: i128, joint: Joint) {
        self.put_long_wait(to, at);
        self.put(to, (1, self.rest(joint)), at, [0; 3]);
        self.end = at;
    }

    /// Appends a wait up to the tick before an event, if that is too far ahead to be reached in one.
    fn put_long_wait<const N: usize>(&mut self, to: (&Queue<N>, usize), at: i128) {
        if at.saturating_sub(self.end) > i128::from(LONGEST) << 32 {
            self.put_wait(to, at.saturating_sub(TICK));
        }
    }

    /// Returns the kind of an event without a step.
    const fn rest(&self, joint: Joint) -> Kind {
        Kind { step: false, reverse: self.dir.dir(), edge: false, joint }
    }

    /// Appends events: the time of the first one, and the differences from it. Restarting the differences takes them one
    /// step back.
    fn put<const N: usize>(
        &mut self,
        (queue, block): (&Queue<N>, usize),
        (count, kind): (u16, Kind),
        first: i128,
        [interval, add, bend]: [i64; 3],
    ) {
        let first = i64::try_from(first.wrapping_sub(self.end)).unwrap_or(0);
        let add = add.wrapping_sub(bend);
        let interval = interval.wrapping_sub(add);
        let segment = Segment { count, kind, first, interval, add, bend };
        let place = self.len;
        self.len = place.saturating_add(1);
        if place < Queue::<N>::BLOCK {
            let slot = |at| Queue::<N>::slot(block, at);
            queue.put(slot(place), &segment, place.checked_sub(1).map(slot));
        }
    }
}

/// Returns the tick of a time as the interrupt counts it, half a tick later.
pub(crate) fn tick(time: i128) -> u64 {
    u64::try_from(time >> 32).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step_timer::StepTimer;
    use std::boxed::Box;
    use std::vec::Vec;

    const SLOTS: usize = 17;
    const MOST: i128 = LONGEST as i128;

    /// The events of block 0 as the interrupt makes them: when, whether it is a step, and which way.
    fn events(write: impl FnOnce(&mut Writer, (&Queue<SLOTS>, usize))) -> Vec<(u64, bool, bool)> {
        let queue: &'static Queue<SLOTS> = Box::leak(Box::default());
        let mut writer = Writer::new(0, Direction::Forward);
        write(&mut writer, (queue, 0));
        queue.link(0, Queue::<SLOTS>::slot(0, 0));
        let mut timer = StepTimer::new(queue);
        let (mut now, mut made) = (0, Vec::new());
        loop {
            let fired = timer.fire();
            made.push((now, fired.is_step(), fired.direction().dir()));
            assert!(fired.wait() <= LONGEST, "{} ticks", fired.wait());
            if fired.wait() == 0 {
                // The first one only lets it begin.
                made.remove(0);
                return made;
            }
            now += u64::from(fired.wait());
        }
    }

    fn waits(ticks: i128) -> Vec<u64> {
        events(|writer, to| writer.put_wait(to, ticks * TICK)).into_iter().map(|(at, ..)| at).collect()
    }

    #[test]
    fn a_wait_is_as_many_events_as_it_takes() {
        let most = u64::from(LONGEST);
        assert_eq!(events(|writer, to| writer.put_wait(to, TICK - 1)), []);
        for ticks in [1, 2, 1000, most - 1, most] {
            assert_eq!(waits(ticks.into()), [ticks]);
        }
        assert_eq!(waits(MOST + 1), [most, most + 1]);
        assert_eq!(waits(3 * MOST + 5), [most, 2 * most, 3 * most, 3 * most + 5]);
        assert_eq!(waits(2 * MOST), [most, 2 * most]);
    }

    #[test]
    fn a_step_waits_for_dir_and_for_its_time() {
        let most = u64::from(LONGEST);
        let stretch = |first: i128| Stretch { count: 2, first: first * TICK - TICK / 2, differences: [7 << 32, 0, 0] };
        let steps = |direction, first| events(|writer, to| writer.put_steps(to, &stretch(first), direction));
        assert_eq!(steps(Direction::Forward, 10), [(10, true, false), (17, true, false)]);
        assert_eq!(steps(Direction::Reverse, 10), [(5, false, true), (10, true, true), (17, true, true)]);
        assert_eq!(steps(Direction::Reverse, 1), [(1, false, true), (2, true, true), (9, true, true)]);
        assert_eq!(steps(Direction::Forward, MOST), [(most, true, false), (most + 7, true, false)]);
        let far = [(most, false, false), (most + 1, true, false), (most + 8, true, false)];
        assert_eq!(steps(Direction::Forward, MOST + 1), far);
        let turn = [(most, false, false), (most + 4, false, false), (most + 5, false, true)];
        let wait = [(2 * most + 5, false, true), (2 * most + 9, false, true)];
        let back = [(2 * most + 10, true, true), (2 * most + 17, true, true)];
        assert_eq!(steps(Direction::Reverse, 2 * MOST + 10), [&turn[..], &wait, &back].concat());
    }

    #[test]
    fn a_joint_is_one_event_that_may_be_far_ahead() {
        let most = u64::from(LONGEST);
        let joint = |ticks: i128| events(|writer, to| writer.put_joint(to, ticks * TICK, Joint::Rest));
        for ticks in [1, 1000, most] {
            assert_eq!(joint(ticks.into()), [(ticks, false, false)]);
        }
        assert_eq!(joint(MOST + 9), [(most, false, false), (most + 8, false, false), (most + 9, false, false)]);
    }

    #[test]
    fn what_does_not_fit_is_counted_and_not_written() {
        let queue = Queue::<SLOTS>::new();
        let mut writer = Writer::new(0, Direction::Forward);
        for tick in 1..=20 {
            writer.put_joint((&queue, 0), tick * TICK, Joint::No);
        }
        assert_eq!(writer.len, 20);
        let next = Queue::<SLOTS>::slot(1, 0);
        assert_eq!(queue.slots[next].first(), 0, "the other block is the interrupt's");
        assert_eq!(queue.slots[next - 1].first(), 1 << 32);
    }
}
