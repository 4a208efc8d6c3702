//! Decides when the line may be used again, without I/O: the rules that the blocking and the async drivers share.

use servowire_core::{ClockCheck, ClockError};

use crate::Clock;
use crate::clock::MAX_LOOKS;

/// No processor is busy elsewhere for this long within a call: a clock that shows such a gap has jumped.
const MAX_AWAY_NS: u64 = 1_000_000_000;

/// How long a driver waits for a line that does not become quiet.
const PATIENCE_NS: u64 = 2_000_000;

/// How many times a clock may be set back or jump while a request leaves.
#[cfg(feature = "tformat")]
const CLOCK_FAULTS: u32 = 3;

/// What is known about the line between two calls. It outlives a dropped future.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Line {
    check: ClockCheck,
    /// Another station may be transmitting until this time.
    ready_ns: u64,
    /// How long another station may be transmitting after a request that is being handed over, or was being handed over when
    /// its call ended.
    leaving_ns: Option<u64>,
    /// How long the line has to be silent after unexpected data.
    silence_ns: u64,
    /// The clock was set back or has jumped since the last request began.
    shifted: bool,
}

/// What to do before a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Settle {
    /// Discard what arrives, and look again no later than this time.
    Until(u64),
    /// Send.
    Quiet,
    /// Give up.
    Never,
}

/// A wait for silence.
#[expect(clippy::struct_field_names, reason = "the unit is part of the name")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Settling {
    until_ns: u64,
    limit_ns: u64,
    silence_ns: u64,
    /// The time of the last look at the line.
    looked_ns: u64,
}

impl Line {
    /// Creates the state of a line about which nothing is known yet: a request may just have been sent, and another station may
    /// be transmitting for `unknown_ns` after it.
    pub(crate) const fn new(silence_ns: u32, unknown_ns: u64) -> Self {
        let check = ClockCheck::new(MAX_LOOKS);
        Self { check, ready_ns: 0, leaving_ns: Some(unknown_ns), silence_ns: silence_ns as u64, shifted: false }
    }

    /// Sets the silence for a new bit length.
    #[cfg(feature = "tformat")]
    pub(crate) const fn set_silence_ns(&mut self, silence_ns: u32) {
        self.silence_ns = silence_ns as u64;
    }

    /// Reads the clock, not long after the last reading. Every reading goes through this or the next two functions, so that no
    /// wait lasts for ever.
    #[inline]
    pub(crate) fn now_ns(&mut self, clock: &mut impl Clock) -> Result<u64, ClockError> {
        self.look(clock, |check, now_ns| check.check_within(now_ns, MAX_AWAY_NS))
    }

    /// Reads the clock after a wait until `until_ns`.
    #[cfg(feature = "async")]
    pub(crate) fn after_ns(&mut self, clock: &mut impl Clock, until_ns: u64) -> Result<u64, ClockError> {
        let wait_ns = until_ns.saturating_sub(self.check.last_ns()).min(u64::MAX >> 2);
        self.look(clock, |check, now_ns| check.check_within(now_ns, wait_ns.saturating_add(MAX_AWAY_NS)))
    }

    /// Reads the clock for the first time in a call of a user, when it is not known how long ago the last reading was. A second
    /// reading like this in one call would mistake a jump of the clock for time that has passed.
    pub(crate) fn first_ns(&mut self, clock: &mut impl Clock) -> Result<u64, ClockError> {
        self.look(clock, ClockCheck::check)
    }

    #[inline(always)]
    fn look(
        &mut self,
        clock: &mut impl Clock,
        check: impl FnOnce(&mut ClockCheck, u64) -> Result<u64, ClockError>,
    ) -> Result<u64, ClockError> {
        let now_ns = match clock.now_ns() {
            Ok(now_ns) => now_ns,
            Err(error) => return Err(self.lost(error, self.check.last_ns())),
        };
        check(&mut self.check, now_ns).map_err(|error| {
            let last_ns = match error {
                ClockError::Backwards { by_ns } => now_ns.saturating_add(by_ns),
                ClockError::Ahead { by_ns } => now_ns.saturating_sub(by_ns),
                _ => now_ns,
            };
            self.lost(error, last_ns)
        })
    }

    /// Handles a faulty clock. If it was set back or has jumped, the time for which the line was to be left alone counts from
    /// the next reading.
    #[cold]
    #[inline(never)]
    fn lost(&mut self, error: ClockError, last_ns: u64) -> ClockError {
        if matches!(error, ClockError::Backwards { .. } | ClockError::Ahead { .. }) {
            self.shifted = true;
            let left_ns = self.ready_ns.saturating_sub(last_ns);
            self.leaving_ns = Some(self.leaving_ns.unwrap_or(0).max(left_ns));
        }
        error
    }

    /// Waits by looking at the clock.
    pub(crate) fn wait_until(&mut self, clock: &mut impl Clock, ns: u64) -> Result<(), ClockError> {
        while self.now_ns(clock)? < ns {}
        Ok(())
    }

    /// The last reading.
    #[cfg(feature = "tformat")]
    pub(crate) const fn last_ns(&self) -> u64 {
        self.check.last_ns()
    }

    /// Waits by looking at the clock until `ns`, which is at most `longest_ns` ahead. If the clock was set back or has jumped
    /// since the request began, it is not certain that any of that time has passed; if the clock has stopped, looking at it has
    /// taken longer than that.
    ///
    /// # Errors
    /// The first fault of the clock; the time has passed even so.
    #[cfg(feature = "tformat")]
    pub(crate) fn sit_out(&mut self, clock: &mut impl Clock, ns: u64, longest_ns: u64) -> Result<(), ClockError> {
        let mut told = Ok(());
        for _ in 0..CLOCK_FAULTS {
            let latest_ns = self.now_ns(clock).unwrap_or_else(|error| {
                told = told.and(Err(error));
                self.last_ns()
            });
            let latest_ns = latest_ns.saturating_add(longest_ns);
            let until_ns = if self.shifted { latest_ns } else { ns.min(latest_ns) };
            let waited = self.wait_until(clock, until_ns);
            told = told.and(waited);
            if !matches!(waited, Err(ClockError::Backwards { .. } | ClockError::Ahead { .. })) {
                break;
            }
        }
        told
    }

    /// Call before the first byte of a request; it may keep the line busy for `longest_ns` after it leaves. After a fault or a
    /// dropped future this remains in force until the next call, because the clock has not been read since.
    pub(crate) const fn begin(&mut self, longest_ns: u64) {
        self.leaving_ns = Some(longest_ns);
        self.shifted = false;
    }

    /// Returns whether a request may still be leaving whose end has not been observed.
    #[cfg(feature = "tformat")]
    pub(crate) const fn is_leaving(&self) -> bool {
        self.leaving_ns.is_some()
    }

    /// Notes that the request was handed over by `now_ns`. However long that took, the worst case is assumed until the end is
    /// known.
    pub(crate) const fn sent(&mut self, now_ns: u64) {
        if let Some(longest_ns) = self.leaving_ns.take() {
            self.ready_ns = now_ns.saturating_add(longest_ns);
        }
    }

    /// Notes that the exchange has ended and the line is free from `ready_ns`.
    pub(crate) const fn clean(&mut self, ready_ns: u64) {
        self.ready_ns = ready_ns;
    }

    /// Notes that a procedure has ended, after which the line must not be used before `ready_ns`.
    pub(crate) fn keep(&mut self, ready_ns: u64) {
        self.ready_ns = self.ready_ns.max(ready_ns);
    }

    /// Notes that the exchange failed at `now_ns`. The rest of an answer may still be arriving, even if a UART that drops
    /// damaged bytes shows nothing of it. So the worst case is still assumed, and the line also has to be silent for a while.
    pub(crate) fn failed(&mut self, ready_ns: u64, now_ns: u64) {
        self.ready_ns = self.ready_ns.max(ready_ns).max(now_ns.saturating_add(self.silence_ns));
    }

    /// Returns when the line is free.
    pub(crate) const fn free_ns(&mut self, now_ns: u64) -> u64 {
        self.sent(now_ns);
        if self.ready_ns > now_ns { self.ready_ns } else { now_ns }
    }

    pub(crate) const fn settle(&mut self, now_ns: u64) -> Settling {
        let limit_ns = self.free_ns(now_ns).saturating_add(PATIENCE_NS);
        Settling { until_ns: self.ready_ns, limit_ns, silence_ns: self.silence_ns, looked_ns: now_ns }
    }
}

impl Settling {
    /// Takes the result of discarding what had arrived by `now_ns`: `heard` says whether there was unexpected data or an error.
    pub(crate) const fn next(&mut self, heard: bool, now_ns: u64) -> Settle {
        let until_ns = now_ns.saturating_add(self.silence_ns);
        // A processor that was elsewhere for long has not listened for long.
        let looked_ns = self.looked_ns;
        self.looked_ns = now_ns;
        if heard && until_ns > self.until_ns {
            self.until_ns = until_ns;
        }
        if now_ns >= self.until_ns {
            Settle::Quiet
        } else if looked_ns >= self.limit_ns {
            Settle::Never
        } else {
            Settle::Until(self.until_ns)
        }
    }
}

/// The result of a wait, and the time after it.
pub(crate) struct Heard<T> {
    pub(crate) what: Option<T>,
    pub(crate) now_ns: u64,
}

/// Looks until something has arrived, but no later than `until_ns`. Anything that arrived while the clock was read is not late.
#[inline(always)]
pub(crate) fn spin<T>(
    line: &mut Line,
    clock: &mut impl Clock,
    until_ns: u64,
    mut look: impl FnMut() -> Option<T>,
) -> Result<Heard<T>, ClockError> {
    let mut over_ns = None;
    loop {
        let what = look();
        match (over_ns, what) {
            (_, Some(what)) => return Ok(Heard { what: Some(what), now_ns: line.now_ns(clock)? }),
            (Some(now_ns), None) => return Ok(Heard { what: None, now_ns }),
            (None, None) => {}
        }
        let now_ns = line.now_ns(clock)?;
        over_ns = (now_ns >= until_ns).then_some(now_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates the state of a line on which everything is known to have ended.
    fn clean() -> Line {
        Line { leaving_ns: None, ..Line::new(8_000, 0) }
    }

    #[test]
    fn of_a_line_nothing_is_known_at_first() {
        let mut line = Line::new(8_000, 90_000);
        assert_eq!(line.settle(700_000).next(false, 789_999), Settle::Until(790_000));
        assert_eq!(line.settle(790_000).next(false, 790_000), Settle::Quiet);
    }

    #[test]
    fn a_clean_line_is_used_at_once() {
        let mut line = clean();
        assert_eq!(line.settle(5).next(false, 5), Settle::Quiet);
    }

    #[test]
    fn a_line_in_use_is_waited_for_and_babble_is_waited_out() {
        let mut line = clean();
        line.begin(90_000);
        line.sent(10_000);
        let mut settling = line.settle(10_000);
        assert_eq!(settling.next(false, 99_999), Settle::Until(100_000));
        let _ = settling.next(true, 20_000);
        assert_eq!(settling.next(false, 99_999), Settle::Until(100_000));
        let _ = settling.next(true, 99_000);
        assert_eq!(settling.next(false, 106_999), Settle::Until(107_000));
        assert_eq!(settling.next(false, 107_000), Settle::Quiet);
        line.clean(107_000);
        assert_eq!(line.settle(107_000).next(false, 107_000), Settle::Quiet);
    }

    /// After a request of 10 us an answer may be on the line until 100 us, unless it is known better.
    #[test]
    fn a_good_answer_frees_the_line_and_a_refused_one_does_not() {
        let sent = || {
            let mut line = clean();
            line.begin(90_000);
            line.sent(10_000);
            line
        };
        assert_eq!(sent().settle(30_000).next(false, 30_000), Settle::Until(100_000));
        let mut good = sent();
        good.clean(25_000);
        assert_eq!(good.settle(24_999).next(false, 24_999), Settle::Until(25_000));
        assert_eq!(good.settle(25_000).next(false, 25_000), Settle::Quiet);
        let mut refused = sent();
        refused.failed(25_000, 20_000);
        assert_eq!(refused.settle(30_000).next(false, 99_999), Settle::Until(100_000));
        refused.failed(25_000, 99_000);
        assert_eq!(refused.settle(99_000).next(false, 99_000), Settle::Until(107_000));
    }

    /// It may have left at any time up to the next call.
    #[test]
    fn a_request_that_was_not_seen_to_leave_may_just_have_left() {
        let mut line = clean();
        line.begin(90_000);
        assert_eq!(line.settle(700_000).next(false, 789_999), Settle::Until(790_000));
        assert_eq!(line.settle(790_000).next(false, 790_000), Settle::Quiet);
        line.begin(90_000);
        assert_eq!((line.free_ns(800_000), line.free_ns(890_001)), (890_000, 890_001));
    }

    /// 60 us of 90 were left when the clock was set back, and none of them has passed for certain.
    #[test]
    fn a_line_in_use_stays_so_when_the_clock_is_set_back() {
        let mut line = clean();
        line.begin(90_000);
        assert_eq!(line.now_ns(&mut || 10_000), Ok(10_000));
        line.sent(10_000);
        assert_eq!(line.now_ns(&mut || 40_000), Ok(40_000));
        assert_eq!(line.now_ns(&mut || 500), Err(ClockError::Backwards { by_ns: 39_500 }));
        assert_eq!(line.settle(700).next(false, 60_699), Settle::Until(60_700));
        // The same for a request that was just going out.
        line.begin(90_000);
        assert_eq!(line.now_ns(&mut || 0), Err(ClockError::Backwards { by_ns: 500 }));
        assert_eq!(line.settle(100).next(false, 90_099), Settle::Until(90_100));
        assert_eq!(line.settle(90_100).next(false, 90_100), Settle::Quiet);
    }

    /// A clock that stands is not a shifted one: what is known of the line stays known.
    #[test]
    fn a_clock_that_stands_leaves_the_end_of_a_request_where_it_was() {
        let mut line = clean();
        line.begin(90_000);
        line.sent(10_000);
        assert_eq!(line.wait_until(&mut || 10_000, 20_000), Err(ClockError::Stopped));
        assert_eq!(line.settle(50_000).next(false, 99_999), Settle::Until(100_000));
    }

    #[test]
    fn a_wait_ends_with_its_time() {
        let (mut line, mut now_ns) = (clean(), 0);
        let mut clock = || {
            now_ns += 5;
            now_ns
        };
        let heard = spin::<()>(&mut line, &mut clock, 20, || None).unwrap();
        assert_eq!((heard.what, heard.now_ns), (None, 20));
    }

    /// Five seconds of a clock that jumps are no time that has passed; between two calls, or after a wait until then, they may have.
    #[test]
    fn a_clock_that_jumps_is_named_and_frees_no_line() {
        let mut line = clean();
        line.begin(90_000);
        assert_eq!(line.first_ns(&mut || 7_000_000_000), Ok(7_000_000_000));
        line.sent(7_000_000_000);
        assert_eq!(line.now_ns(&mut || 7_000_030_000), Ok(7_000_030_000));
        let jumped = Err(ClockError::Ahead { by_ns: 5_000_000_000 });
        assert_eq!(line.now_ns(&mut || 12_000_030_000), jumped);
        assert_eq!(line.settle(12_000_030_000).next(false, 12_000_089_999), Settle::Until(12_000_090_000));
        assert_eq!(line.first_ns(&mut || 17_000_030_000), Ok(17_000_030_000));
    }

    /// What is sat out is as long as was said, and with a clock that was set back meanwhile as long as it can be.
    #[cfg(feature = "tformat")]
    #[test]
    fn sitting_out_takes_as_long_as_it_has_to() {
        let sat_out_ns = |set_back_at| {
            let (mut line, mut looks) = (clean(), 0);
            let mut clock = || {
                looks += 1;
                10 * looks + if looks < set_back_at { 1_000 } else { 0 }
            };
            line.begin(90_000);
            let told = line.sit_out(&mut clock, 1_500, 10_000);
            assert_eq!(told.is_err(), set_back_at < u64::MAX);
            10 * looks
        };
        assert!((500..600).contains(&sat_out_ns(u64::MAX)), "{}", sat_out_ns(u64::MAX));
        assert!((10_000..10_500).contains(&sat_out_ns(20)), "{}", sat_out_ns(20));
    }

    #[cfg(feature = "async")]
    #[test]
    fn a_wait_is_no_jump() {
        let mut line = clean();
        assert_eq!(line.after_ns(&mut || 17_000_030_000, 16_000_030_000), Ok(17_000_030_000));
        let jumped = Err(ClockError::Ahead { by_ns: 5_000_000_001 });
        assert_eq!(line.after_ns(&mut || 22_000_030_001, 21_000_030_000), jumped);
        assert_eq!(line.after_ns(&mut || 22_000_030_000, u64::MAX), Err(ClockError::Backwards { by_ns: 1 }));
        // However far back.
        assert_eq!(line.after_ns(&mut || 30_000, u64::MAX), Err(ClockError::Backwards { by_ns: 22_000_000_000 }));
    }

    /// A procedure that had ended before, or never sent anything, does not know of the exchange before it.
    #[test]
    fn the_end_of_a_procedure_frees_no_line_that_somebody_else_may_be_using() {
        let mut line = clean();
        line.keep(90);
        assert_eq!(
            (line.settle(89).next(false, 89), line.settle(90).next(false, 90)),
            (Settle::Until(90), Settle::Quiet)
        );
        for ready_ns in [0, 50] {
            line.begin(90_000);
            line.sent(10_000);
            line.keep(ready_ns);
            assert_eq!(line.settle(60_000).next(false, 99_999), Settle::Until(100_000));
        }
    }

    /// One byte was there when the processor came back.
    #[test]
    fn nobody_is_given_up_for_the_processors_absence() {
        let mut settling = clean().settle(0);
        assert_eq!(settling.next(true, 10_000_000), Settle::Until(10_008_000));
        assert_eq!(settling.next(false, 10_008_000), Settle::Quiet);
    }

    #[test]
    fn an_endless_talker_is_given_up() {
        let mut settling = clean().settle(0);
        let mut now_ns = 0;
        while settling.next(true, now_ns) != Settle::Never {
            now_ns += 4_000;
            assert!(now_ns < 3_000_000, "for ever");
        }
        assert_eq!(now_ns, 2_004_000);
    }
}
