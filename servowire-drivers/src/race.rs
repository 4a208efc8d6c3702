//! Two futures, of which the first is asked first.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;

use servowire_core::ClockError;

/// What `first` gives, or `None` if the wait of `second` ends before. What is there is taken before the clock is asked.
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
    use super::{ClockError, race};
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
}
