//! When the line may be used again, without I/O: the rules that the blocking and the async drivers share.

use crate::Clock;
#[cfg(feature = "async")]
use crate::Timer;
#[cfg(feature = "async")]
use crate::race::race;

/// How long a driver waits for a line that does not become quiet.
const PATIENCE_NS: u64 = 2_000_000;

/// What is known of the line between two calls. It outlives a dropped future.
#[expect(clippy::struct_field_names, reason = "the unit is part of the name")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Line {
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
        Self { ready_ns: 0, leaving_ns: None, silence_ns: silence_ns as u64 }
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
pub(crate) fn wait<E>(
    line: &mut Line,
    clock: &mut impl Clock,
    mut listen: impl FnMut() -> Result<bool, E>,
) -> Result<bool, E> {
    let mut settling = line.settle(clock.now_ns());
    loop {
        let heard = listen()?;
        let now_ns = clock.now_ns();
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
pub(crate) async fn wait_asynch<E>(
    line: &mut Line,
    timer: &mut impl Timer,
    mut listen: impl AsyncFnMut() -> Result<(), E>,
) -> Result<bool, E> {
    let mut until_ns = timer.now_ns();
    let mut settling = line.settle(until_ns);
    loop {
        let heard = race(listen(), timer.wait_until(until_ns)).await.transpose()?.is_some();
        let now_ns = timer.now_ns();
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
