//! An executor that counts its polls, and a timer on a clock that goes on with every look.
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use servowire_drivers::{Clock, ClockError, Timer};

/// More polls than any call needs.
pub const FOR_EVER: usize = 1_000_000;

/// Polls at most `most` times, then drops the future.
pub fn run<T>(future: impl Future<Output = T>, most: usize) -> Option<T> {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    (0..most).find_map(|_| match future.as_mut().poll(&mut context) {
        Poll::Ready(value) => Some(value),
        Poll::Pending => None,
    })
}

/// Polls at most `most` times, then forgets the future, whose destructor never runs. Whether it ended.
pub fn forget(future: impl Future, most: usize) -> bool {
    let mut future = Box::pin(future);
    let mut context = Context::from_waker(Waker::noop());
    let ended = (0..most).any(|_| future.as_mut().poll(&mut context).is_ready());
    std::mem::forget(future);
    ended
}

/// Gives the processor away once.
pub async fn pause() {
    let mut asked = false;
    poll_fn(|_| if std::mem::replace(&mut asked, true) { Poll::Ready(()) } else { Poll::Pending }).await;
}

/// Every poll ends a wait: the driver looks at the clock.
pub struct Looks<C>(pub C);

impl<C: Clock> Clock for Looks<C> {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.0.now_ns()
    }
}

impl<C: Clock> Timer for Looks<C> {
    async fn wait_ns(&mut self, _: u64) {
        pause().await;
    }
}
