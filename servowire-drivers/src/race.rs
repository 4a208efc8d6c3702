//! Two futures, of which the first is asked first.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;

/// What `first` gives, or `None` if `second` ends before. What is there is taken before the clock is asked.
pub(crate) async fn race<T>(first: impl Future<Output = T>, second: impl Future<Output = ()>) -> Option<T> {
    let (mut first, mut second) = (pin!(first), pin!(second));
    poll_fn(|context| {
        if let Poll::Ready(value) = first.as_mut().poll(context) {
            return Poll::Ready(Some(value));
        }
        second.as_mut().poll(context).map(|()| None)
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::race;
    use core::future::{pending, ready};
    use core::pin::pin;
    use core::task::{Context, Poll, Waker};

    #[test]
    fn the_first_wins_even_if_both_are_ready() {
        let mut context = Context::from_waker(Waker::noop());
        assert_eq!(pin!(race(ready(5), ready(()))).poll(&mut context), Poll::Ready(Some(5)));
        assert_eq!(pin!(race(pending::<u8>(), ready(()))).poll(&mut context), Poll::Ready(None));
        assert_eq!(pin!(race(pending::<u8>(), pending())).poll(&mut context), Poll::Pending);
    }

    use core::future::Future;
}
