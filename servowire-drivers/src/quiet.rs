//! When the line may be used again, without I/O: the rules that the blocking and the async drivers share.

use servowire_core::{ClockCheck, ClockError};

use crate::Clock;
#[cfg(feature = "async")]
use crate::Timer;
use crate::clock::MAX_LOOKS;
#[cfg(feature = "async")]
use crate::race::race;

/// How long a driver waits for a line that does not become quiet.
const PATIENCE_NS: u64 = 2_000_000;

/// What is known of the line between two calls. It outlives a dropped future.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Line {
    check: ClockCheck,
    /// Somebody may be talking until then.
    ready_ns: u64,
    /// How long somebody may be talking after a request that is being handed over, or was when its call ended.
    leaving_ns: Option<u64>,
    /// How long the line has to be silent after something unasked came.
    silence_ns: u64,
}

/// What to do before a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Settle {
    /// Throw away what comes, and look again at the latest then.
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
}

impl Line {
    pub(crate) const fn new(silence_ns: u32) -> Self {
        Self { check: ClockCheck::new(MAX_LOOKS), ready_ns: 0, leaving_ns: None, silence_ns: silence_ns as u64 }
    }

    /// A look at the clock: every one goes through here, so that no wait is for ever.
    #[inline]
    pub(crate) fn now_ns(&mut self, clock: &mut impl Clock) -> Result<u64, ClockError> {
        let last_ns = self.check.last_ns();
        match clock.now_ns().and_then(|now_ns| self.check.check(now_ns)) {
            Ok(now_ns) => Ok(now_ns),
            Err(error) => Err(self.lost(error, last_ns)),
        }
    }

    /// The clock is wrong. If it was set back, what the line was to be left alone for is waited for from the next look on.
    #[cold]
    #[inline(never)]
    fn lost(&mut self, error: ClockError, last_ns: u64) -> ClockError {
        if matches!(error, ClockError::Backwards { .. }) {
            let left_ns = self.ready_ns.saturating_sub(last_ns);
            self.leaving_ns = Some(self.leaving_ns.unwrap_or(0).max(left_ns));
            self.ready_ns = 0;
        }
        error
    }

    /// Waits by looking at the clock.
    pub(crate) fn wait_until(&mut self, clock: &mut impl Clock, ns: u64) -> Result<(), ClockError> {
        while self.now_ns(clock)? < ns {}
        Ok(())
    }

    /// Waits for so long.
    #[cfg(feature = "tformat")]
    pub(crate) fn pause(&mut self, clock: &mut impl Clock, ns: u64) -> Result<(), ClockError> {
        let now_ns = self.now_ns(clock)?;
        self.wait_until(clock, now_ns.saturating_add(ns))
    }

    #[cfg(all(feature = "tformat", feature = "async"))]
    pub(crate) async fn pause_asynch(&mut self, timer: &mut impl Timer, ns: u64) -> Result<(), ClockError> {
        let now_ns = self.now_ns(timer)?;
        timer.wait_until(now_ns.saturating_add(ns)).await
    }

    /// A request begins to go out that can keep the line busy for so long, from whenever it leaves: to be called before its
    /// first byte. A fault or a dropped future leaves it so until the next call, for nobody has read the clock.
    pub(crate) const fn begin(&mut self, longest_ns: u64) {
        self.leaving_ns = Some(longest_ns);
    }

    /// The request was handed over by `now_ns`. However long that took, the worst is assumed until the end is known.
    pub(crate) const fn sent(&mut self, now_ns: u64) {
        if let Some(longest_ns) = self.leaving_ns.take() {
            self.ready_ns = now_ns.saturating_add(longest_ns);
        }
    }

    /// The exchange has ended, and the line is free from `ready_ns` on.
    pub(crate) const fn clean(&mut self, ready_ns: u64) {
        self.ready_ns = ready_ns;
    }

    /// A procedure has ended, after which the line is not to be used before `ready_ns`.
    pub(crate) fn keep(&mut self, ready_ns: u64) {
        self.ready_ns = self.ready_ns.max(ready_ns);
    }

    /// The exchange has failed at `now_ns`. The rest of an answer may still be coming, even if a UART that drops damaged bytes
    /// shows nothing of it: so the worst stays assumed, and besides the line has to be silent for a while.
    pub(crate) fn failed(&mut self, ready_ns: u64, now_ns: u64) {
        self.ready_ns = self.ready_ns.max(ready_ns).max(now_ns.saturating_add(self.silence_ns));
    }

    /// From when on the line is free.
    pub(crate) const fn free_ns(&mut self, now_ns: u64) -> u64 {
        self.sent(now_ns);
        if self.ready_ns > now_ns { self.ready_ns } else { now_ns }
    }

    pub(crate) const fn settle(&mut self, now_ns: u64) -> Settling {
        let limit_ns = self.free_ns(now_ns).saturating_add(PATIENCE_NS);
        Settling { until_ns: self.ready_ns, limit_ns, silence_ns: self.silence_ns }
    }
}

impl Settling {
    /// Something came that nobody has asked for, or the UART complained.
    pub(crate) const fn heard(&mut self, now_ns: u64) {
        let until_ns = now_ns.saturating_add(self.silence_ns);
        if until_ns > self.until_ns {
            self.until_ns = until_ns;
        }
    }

    /// What had come by `now_ns` has been thrown away.
    pub(crate) const fn poll(&self, now_ns: u64) -> Settle {
        if now_ns >= self.until_ns {
            Settle::Quiet
        } else if now_ns >= self.limit_ns {
            Settle::Never
        } else {
            Settle::Until(self.until_ns)
        }
    }
}

/// Throws away what comes until the line is free; `listen` tells whether something came. Whether it became free.
pub(crate) fn wait<E: From<ClockError>>(
    line: &mut Line,
    clock: &mut impl Clock,
    mut listen: impl FnMut() -> Result<bool, E>,
) -> Result<bool, E> {
    let now_ns = line.now_ns(clock)?;
    let mut settling = line.settle(now_ns);
    loop {
        let heard = listen()?;
        let now_ns = line.now_ns(clock)?;
        if heard {
            settling.heard(now_ns);
        }
        match settling.poll(now_ns) {
            Settle::Quiet => return Ok(true),
            Settle::Never => return Ok(false),
            Settle::Until(_) => {}
        }
    }
}

/// The same with a `listen` that ends when something came, and may be dropped before.
#[cfg(feature = "async")]
pub(crate) async fn wait_asynch<E: From<ClockError>>(
    line: &mut Line,
    timer: &mut impl Timer,
    mut listen: impl AsyncFnMut() -> Result<(), E>,
) -> Result<bool, E> {
    let mut until_ns = line.now_ns(timer)?;
    let mut settling = line.settle(until_ns);
    loop {
        let heard = race(listen(), timer.wait_until(until_ns)).await?.transpose()?.is_some();
        let now_ns = line.now_ns(timer)?;
        if heard {
            settling.heard(now_ns);
        }
        match settling.poll(now_ns) {
            Settle::Quiet => return Ok(true),
            Settle::Never => return Ok(false),
            Settle::Until(ns) => until_ns = ns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clean_line_is_used_at_once() {
        let mut line = Line::new(8_000);
        assert_eq!(line.settle(5).poll(5), Settle::Quiet);
    }

    #[test]
    fn a_line_in_use_is_waited_for_and_babble_is_waited_out() {
        let mut line = Line::new(8_000);
        line.begin(90_000);
        line.sent(10_000);
        let mut settling = line.settle(10_000);
        assert_eq!(settling.poll(99_999), Settle::Until(100_000));
        settling.heard(20_000);
        assert_eq!(settling.poll(99_999), Settle::Until(100_000));
        settling.heard(99_000);
        assert_eq!(settling.poll(106_999), Settle::Until(107_000));
        assert_eq!(settling.poll(107_000), Settle::Quiet);
        line.clean(107_000);
        assert_eq!(line.settle(107_000).poll(107_000), Settle::Quiet);
    }

    /// It may have left at any time up to the next call.
    #[test]
    fn a_request_that_was_not_seen_to_leave_may_just_have_left() {
        let mut line = Line::new(8_000);
        line.begin(90_000);
        assert_eq!(line.settle(700_000).poll(789_999), Settle::Until(790_000));
        assert_eq!(line.settle(790_000).poll(790_000), Settle::Quiet);
        line.begin(90_000);
        assert_eq!((line.free_ns(800_000), line.free_ns(890_001)), (890_000, 890_001));
    }

    /// 60 us of 90 were left when the clock was set back, and none of them has passed for certain.
    #[test]
    fn a_line_in_use_stays_so_when_the_clock_is_set_back() {
        let mut line = Line::new(8_000);
        line.begin(90_000);
        assert_eq!(line.now_ns(&mut || 10_000), Ok(10_000));
        line.sent(10_000);
        assert_eq!(line.now_ns(&mut || 40_000), Ok(40_000));
        assert_eq!(line.now_ns(&mut || 500), Err(ClockError::Backwards { by_ns: 39_500 }));
        assert_eq!(line.settle(700).poll(60_699), Settle::Until(60_700));
        // The same for a request that was just going out.
        line.begin(90_000);
        assert_eq!(line.now_ns(&mut || 0), Err(ClockError::Backwards { by_ns: 500 }));
        assert_eq!(line.settle(100).poll(90_099), Settle::Until(90_100));
        assert_eq!(line.settle(90_100).poll(90_100), Settle::Quiet);
    }

    /// A procedure that had ended before, or never sent anything, does not know of the exchange before it.
    #[test]
    fn the_end_of_a_procedure_frees_no_line_that_somebody_else_may_be_using() {
        let mut line = Line::new(8_000);
        line.keep(90);
        assert_eq!((line.settle(89).poll(89), line.settle(90).poll(90)), (Settle::Until(90), Settle::Quiet));
        for ready_ns in [0, 50] {
            line.begin(90_000);
            line.sent(10_000);
            line.keep(ready_ns);
            assert_eq!(line.settle(60_000).poll(99_999), Settle::Until(100_000));
        }
    }

    #[test]
    fn an_endless_talker_is_given_up() {
        let mut settling = Line::new(8_000).settle(0);
        let mut now_ns = 0;
        while settling.poll(now_ns) != Settle::Never {
            now_ns += 4_000;
            settling.heard(now_ns);
            assert!(now_ns < 3_000_000, "for ever");
        }
        assert_eq!(now_ns, 2_000_000);
    }
}
