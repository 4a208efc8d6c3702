//! Waits for a time, or for whichever of two futures ends earlier; the first one is polled first.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;

use servowire_core::{ClockCheck, ClockError};

use crate::Timer;

/// Number of delays that may pass on a clock that has stopped.
const MAX_DELAYS: u32 = 1_000;

/// Waits until `until_ns` on the clock, which `look` checks.
pub(crate) async fn sleep<T: Timer>(
    timer: &mut T,
    mut look: impl FnMut(&mut T) -> Result<u64, ClockError>,
    until_ns: u64,
) -> Result<(), ClockError> {
    let mut check = ClockCheck::new(MAX_DELAYS);
    loop {
        let left_ns = until_ns.saturating_sub(check.check(look(timer)?)?);
        if left_ns == 0 {
            return Ok(());
        }
        timer.wait_ns(left_ns).await;
    }
}

/// Returns the result of `first`, or `None` if the wait of `second` ends earlier. Data that has arrived is taken before the
/// clock is read.
pub(crate) async fn race<T>(
    first: impl Future<Output = T>,
    second: impl Future<Output = Result<(), ClockError>>,
) -> Result<Option<T>, ClockError> {
    let (mut first, mut second) = (pin!(first), pin!(second));
    poll_fn(|context| {
        if let Poll::Ready(value) = first.as_mut().poll(context) {
            return Poll::Ready(Ok(Some(value)));
        }
        second.as_mut().poll(context).map_ok(|()| None)
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::{ClockError, race, sleep};
    use crate::{Clock, WithDelay};
    use core::cell::Cell;
    use core::future::{pending, ready};
    use core::pin::pin;
    use core::task::{Context, Poll, Waker};

    #[test]
    fn the_first_wins_even_if_both_are_ready() {
        let mut context = Context::from_waker(Waker::noop());
        assert_eq!(pin!(race(ready(5), ready(Ok(())))).poll(&mut context), Poll::Ready(Ok(Some(5))));
        assert_eq!(pin!(race(pending::<u8>(), ready(Ok(())))).poll(&mut context), Poll::Ready(Ok(None)));
        let stopped = Err(ClockError::Stopped);
        assert_eq!(pin!(race(ready(5), ready(stopped))).poll(&mut context), Poll::Ready(Ok(Some(5))));
        assert_eq!(
            pin!(race(pending::<u8>(), ready(stopped))).poll(&mut context),
            Poll::Ready(Err(ClockError::Stopped))
        );
        assert_eq!(pin!(race(pending::<u8>(), pending())).poll(&mut context), Poll::Pending);
    }

    use core::future::Future;

    /// Passes so much time for each ns.
    struct Passes<'a>(&'a Cell<u64>, i64);

    impl embedded_hal_async::delay::DelayNs for Passes<'_> {
        async fn delay_ns(&mut self, ns: u32) {
            self.0.set(self.0.get().saturating_add_signed(i64::from(ns) * self.1));
        }
    }

    /// How a wait ends, and when.
    fn wait(per_ns: i64) -> (Poll<Result<(), ClockError>>, u64) {
        let now_ns = Cell::new(1_000_000);
        let mut timer = WithDelay { clock: || now_ns.get(), delay: Passes(&now_ns, per_ns) };
        let wait = pin!(sleep(&mut timer, Clock::now_ns, 20_000_000_000));
        let ended = wait.poll(&mut Context::from_waker(Waker::noop()));
        (ended, now_ns.get())
    }

    #[test]
    fn a_delay_is_waited_for_in_pieces_and_not_for_ever() {
        assert_eq!(wait(1), (Poll::Ready(Ok(())), 20_000_000_000));
        assert_eq!(wait(0), (Poll::Ready(Err(ClockError::Stopped)), 1_000_000));
        assert_eq!(wait(-1), (Poll::Ready(Err(ClockError::Backwards { by_ns: 1_000_000 })), 0));
    }
}
