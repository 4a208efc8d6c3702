use core::num::NonZeroU16;

use crate::header::UpdateCounter;

/// Number of values of the counter. A block that is this many periods old has the echo of a new one, so anything that must not
/// come from an old block waits for this many new ones.
pub(super) const TURN: u8 = 4;

/// Whether a block came on time, by its counter echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Arrival {
    /// The block has the expected echo, which is as far behind the last counter sent as in every exchange of this system.
    OnTime,
    /// The block has the echo of the previous one: no frame came, or the drive has stopped. Also the first block after four
    /// periods without one, or after an exchange without one that came too late: it may be as old as that.
    Repeated,
    /// The block has the echo of another period: the answer is late or belongs to the next frame, or the wrong bank was read.
    OffTime {
        /// Difference from the echoed counter to the last one sent, modulo 4.
        lag: u8,
    },
    /// No block came, or it was refused.
    Missing,
}

servowire_core::one_line!(Arrival {
    Self::OnTime => "on time";
    Self::Repeated => "the echo of the block before";
    Self::OffTime { lag } => "the echo of another period, {} counters behind", lag;
    Self::Missing => "no block";
});

/// The echoes that a block may have which has been in the memory all the time: a bit for each. The high half counts the samples
/// without a block since the last one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Seen(u8);

impl Seen {
    const NONE: Self = Self(0);
    const ANY: u8 = 0x0f;

    /// After a block with this echo.
    const fn new(echo: UpdateCounter) -> Self {
        Self(1 << echo.get())
    }

    const fn contains(self, echo: UpdateCounter) -> bool {
        self.0 >> echo.get() & 1 != 0
    }

    /// After a sample without a block. Any echo may have been there for a while after a turn of the counter, and after periods
    /// without an exchange, in which the same echo came again.
    #[cold]
    #[inline(never)]
    const fn and_nothing(self, missed: u8) -> Self {
        let unseen = (self.0 >> 4).saturating_add(1);
        if unseen < TURN && missed == 0 { Self(unseen << 4 | self.0 & Self::ANY) } else { Self(Self::ANY) }
    }
}

/// Judges every block by its counter echo, and notices if no block comes on time.
///
/// The lag from the counter sent to the echo read is the same in every exchange of a system; it is learned from the first
/// block, and learned again from a whole turn of the counter as long as the servo is off. A block with a different lag comes
/// from a different frame. The first block may itself be late if there were periods without a block before it; its lag is
/// then not relied on until it has been the same for a whole turn.
///
/// `limit` consecutive samples without a block on time trip the watch, and it stays tripped; then command servo-off to
/// **all** axes ([`ServoOff`](super::ServoOff)). The vendor does not state the time, so the caller sets the limit. System
/// Design Guide for Master, "Time-out by the counter echo".
///
/// There are two traps: if two communication periods make an update period, sampling in every communication period yields every
/// value twice (the limit must then be 2 or more), and sampling in every fourth update period always yields the same value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EchoWatch {
    limit: NonZeroU16,
    /// Number of samples since the last one on time.
    updates: u16,
    seen_last: Seen,
    lag: Option<u8>,
    /// A different lag that was seen, and how many times in a row.
    other: u8,
    seen: u8,
    /// Number of blocks that confirmed the lag.
    sure: u8,
}

impl EchoWatch {
    /// Creates a watch that trips after `limit` samples without a new echo.
    pub const fn new(limit: NonZeroU16) -> Self {
        Self { limit, updates: 0, seen_last: Seen::NONE, lag: None, other: 0, seen: 0, sure: 0 }
    }

    /// Takes a sample without knowing the counter sent; `None` if the update period brought no block from the drive, which
    /// counts as unchanged. Returns whether the watch has tripped.
    pub fn sample(&mut self, echo: Option<UpdateCounter>) -> bool {
        let is_new = echo.is_some_and(|echo| !self.seen_last.contains(echo));
        self.seen_last = echo.map_or(self.seen_last, Seen::new);
        self.count(is_new);
        self.is_tripped()
    }

    /// Takes the echo that came after `sent`; `missed` is the number of update periods without an exchange before it; `learns`
    /// is set if the servo is off.
    pub(super) fn judge(
        &mut self,
        sent: UpdateCounter,
        echo: Option<UpdateCounter>,
        missed: u8,
        learns: bool,
    ) -> Arrival {
        let arrival = match echo {
            None => {
                self.seen_last = self.seen_last.and_nothing(missed);
                Arrival::Missing
            }
            Some(echo) if self.seen_last.contains(echo) => {
                self.seen_last = Seen::new(echo);
                Arrival::Repeated
            }
            Some(echo) => {
                self.seen_last = Seen::new(echo);
                self.place(sent.get().wrapping_sub(echo.get()) & 3, missed, learns)
            }
        };
        self.count(arrival == Arrival::OnTime);
        arrival
    }

    /// Takes a new echo with this lag.
    #[inline]
    fn place(&mut self, lag: u8, missed: u8, learns: bool) -> Arrival {
        // In a period that was missed no counter was sent, or it went out a frame later.
        let due = self.lag.unwrap_or_else(|| {
            // What is echoed as soon as it was sent is not late.
            self.sure = if lag == 0 || self.updates == 0 { TURN } else { 0 };
            lag
        });
        self.lag = Some(due);
        if lag == due || lag < due && due <= lag.saturating_add(missed) {
            self.seen = 0;
            self.sure = self.sure.saturating_add(1);
            return Arrival::OnTime;
        }
        self.seen = if self.other == lag { self.seen.saturating_add(1) } else { 1 };
        self.other = lag;
        if learns && self.seen >= TURN {
            (self.lag, self.sure) = (Some(lag), TURN);
            return Arrival::OnTime;
        }
        Arrival::OffTime { lag }
    }

    /// Whether the lag is that of the system, not that of a late first block.
    pub(super) const fn is_sure(&self) -> bool {
        self.sure >= TURN
    }

    const fn count(&mut self, on_time: bool) {
        if !self.is_tripped() {
            self.updates = if on_time { 0 } else { self.updates.saturating_add(1) };
        }
    }

    /// Returns whether the limit was reached.
    pub(super) const fn is_tripped(&self) -> bool {
        self.updates >= self.limit.get()
    }

    /// Takes an echo while invalid data are sent: the next one must be different.
    pub(super) const fn note(&mut self, echo: UpdateCounter) {
        self.seen_last = Seen::new(echo);
    }

    /// Restarts the limit. A block that was already in the memory does not become new by this, and the lag of the system is
    /// kept.
    pub const fn reset(&mut self) {
        self.updates = 0;
    }
}

/// Notices if receptions stop, for systems that use the receive interrupt (XINTRX).
///
/// Its handler calls [`frame_received`](Self::frame_received), the NC interrupt [`tick`](Self::tick). In the internal-timer system the
/// receive interrupt must have the lower priority of the two, in the external-timer system the higher. System Design
/// Guide for Master, chapters 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct ReceiveWatchdog {
    limit: NonZeroU16,
    ticks: u16,
}

impl ReceiveWatchdog {
    /// Creates a watchdog that trips at the `limit`-th tick without a reception.
    pub(super) const fn new(limit: NonZeroU16) -> Self {
        Self { limit, ticks: 0 }
    }

    /// Reports that a frame was received. A watchdog that has tripped stays tripped.
    pub(super) const fn frame_received(&mut self) {
        if !self.is_tripped() {
            self.ticks = 0;
        }
    }

    /// Reports that an update period has passed; returns whether the watchdog has tripped.
    pub(super) const fn tick(&mut self) -> bool {
        self.ticks = self.ticks.saturating_add(1);
        self.is_tripped()
    }

    /// Whether the limit was reached.
    pub(super) const fn is_tripped(self) -> bool {
        self.ticks >= self.limit.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn receptions_hold_the_watchdog_off_until_it_trips() {
        let mut watchdog = ReceiveWatchdog::new(NonZeroU16::new(2).unwrap());
        for _ in 0..5 {
            assert!(!watchdog.tick());
            watchdog.frame_received();
        }
        assert!(!watchdog.tick());
        assert!(watchdog.tick());
        watchdog.frame_received();
        assert!(watchdog.is_tripped() && watchdog.tick());
    }

    #[test]
    fn a_drive_that_never_answers_trips_too() {
        let mut watch = EchoWatch::new(NonZeroU16::new(3).unwrap());
        assert_eq!([None; 4].map(|echo| watch.sample(echo)), [false, false, true, true]);
        // An echo that comes too late changes nothing.
        assert!(watch.sample(UpdateCounter::new(3)));
        watch.reset();
        assert!(!watch.sample(UpdateCounter::new(1)));
        assert!(!watch.sample(None));
        assert!(!watch.sample(None));
        assert!(!watch.sample(UpdateCounter::new(2)));
        // None after one that was there is no new one.
        assert_eq!([None; 3].map(|echo| watch.sample(echo)), [false, false, true]);
        // Nor is one that stays.
        watch.reset();
        assert_eq!([UpdateCounter::new(3); 4].map(|echo| watch.sample(echo)), [false, false, false, true]);
        // Each time the limit is a whole one.
        watch.reset();
        assert_eq!([None; 3].map(|echo| watch.sample(echo)), [false, false, true]);
    }

    /// After a period without a block the first one may be late: the lag is that of the system if it stays for a turn of the counter.
    #[test]
    fn a_late_first_block_is_sure_after_a_turn() {
        let counter = |n: u8| UpdateCounter::new(n & 3).unwrap();
        let mut watch = EchoWatch::new(NonZeroU16::new(9).unwrap());
        assert_eq!(watch.judge(counter(0), None, 0, true), Arrival::Missing);
        let sure = [1, 2, 3, 4, 5].map(|sent: u8| {
            assert_eq!(watch.judge(counter(sent), Some(counter(sent - 1)), 0, true), Arrival::OnTime);
            watch.is_sure()
        });
        assert_eq!(sure, [false, false, false, true, true]);
    }

    /// By hand: the counter sent goes on by one, and the echo is as many behind.
    #[test]
    fn each_block_has_its_place_in_time() {
        let counter = |n: u8| UpdateCounter::new(n & 3).unwrap();
        let mut watch = EchoWatch::new(NonZeroU16::new(9).unwrap());
        let mut at = |sent: u8, echo: u8| watch.judge(counter(sent), Some(counter(echo)), 0, false);
        // One behind is what this system has.
        assert_eq!([at(1, 0), at(2, 1), at(3, 2)], [Arrival::OnTime; 3]);
        assert_eq!(at(4, 2), Arrival::Repeated);
        // The frame was late, or the bank was not switched: two behind; then that of the next frame: none behind.
        assert_eq!([at(5, 3), at(6, 6)], [Arrival::OffTime { lag: 2 }, Arrival::OffTime { lag: 0 }]);
        assert_eq!([at(7, 4), at(8, 7)], [Arrival::OffTime { lag: 3 }, Arrival::OnTime]);
        assert_eq!(watch.judge(counter(9), None, 0, false), Arrival::Missing);
        // With the servo off another lag is learned from a whole turn, with the servo on never.
        for (learns, last) in [(false, Arrival::OffTime { lag: 3 }), (true, Arrival::OnTime)] {
            let mut watch = watch;
            let seen =
                [11, 12, 13, 14, 15].map(|sent: u8| watch.judge(counter(sent), Some(counter(sent - 3)), 0, learns));
            assert_eq!(seen[..3], [Arrival::OffTime { lag: 3 }; 3]);
            assert_eq!(seen[3..], [last; 2]);
        }
    }

    /// A line on which every block is off time, each by something else, has no lag that could be learned.
    #[test]
    fn no_lag_is_learned_from_different_ones() {
        let counter = |n: u8| UpdateCounter::new(n & 3).unwrap();
        let mut watch = EchoWatch::new(NonZeroU16::new(99).unwrap());
        let mut at = |sent: u8, echo: u8| watch.judge(counter(sent), Some(counter(echo)), 0, true);
        assert_eq!(at(4, 3), Arrival::OnTime);
        for sent in (6..20).step_by(2) {
            assert_eq!(at(sent, sent - 2), Arrival::OffTime { lag: 2 });
            assert_eq!(at(sent + 1, sent + 1), Arrival::OffTime { lag: 0 });
        }
    }

    /// An exchange that did not take place has sent no counter, and the frame after it carries the one before again.
    #[test]
    fn a_missed_exchange_is_no_early_answer() {
        let counter = |n: u8| UpdateCounter::new(n & 3).unwrap();
        for (missed, lags) in [(0, 2..=2), (1, 1..=2), (2, 0..=2), (3, 0..=2)] {
            for found in 0..4 {
                let mut watch = EchoWatch::new(NonZeroU16::new(9).unwrap());
                watch.judge(counter(8), Some(counter(6)), 0, false);
                watch.judge(counter(9), Some(counter(7)), 0, false);
                let arrival = watch.judge(counter(10), Some(counter(10 - found)), missed, false);
                assert_eq!(arrival == Arrival::OnTime, lags.contains(&found), "{missed} {found}: {arrival}");
            }
        }
    }

    /// By hand: a block that stands in the memory since echo 2 has the echo of a new one again after four periods in which it could not be
    /// read, and after eight. After less than four its echo says that it is new.
    #[test]
    fn the_first_block_after_a_turn_without_one_proves_nothing() {
        let counter = |n: u8| UpdateCounter::new(n & 3).unwrap();
        for unread in 1..12 {
            let mut watch = EchoWatch::new(NonZeroU16::new(99).unwrap());
            let mut at = |sent: u8, echo: Option<u8>| watch.judge(counter(sent), echo.map(counter), 0, false);
            assert_eq!([0, 1, 2].map(|n: u8| at(n + 1, Some(n))), [Arrival::OnTime; 3]);
            for n in 3..3 + unread {
                assert_eq!(at(n + 1, None), Arrival::Missing);
            }
            let n = 3 + unread;
            let first = if unread < 3 { Arrival::OnTime } else { Arrival::Repeated };
            assert_eq!(at(n + 1, Some(n)), first, "{unread}");
            assert_eq!(at(n + 2, Some(n + 1)), Arrival::OnTime, "{unread}");
        }
    }

    /// Late by a period again and again is no better than none.
    #[test]
    fn what_is_never_on_time_trips() {
        let counter = |n: u8| UpdateCounter::new(n & 3).unwrap();
        let mut watch = EchoWatch::new(NonZeroU16::new(4).unwrap());
        watch.judge(counter(0), Some(counter(0)), 0, false);
        let tripped = [2, 3, 4, 5, 6].map(|sent: u8| {
            watch.judge(counter(sent), Some(counter(sent - 1)), 0, false);
            watch.is_tripped()
        });
        assert_eq!(tripped, [false, false, false, true, true]);
    }
}
