//! The loop that takes a procedure through its exchanges, in a blocking and an async form.

use crate::{Procedure, Step};

/// How an exchange ended, as it is passed to a procedure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ended<T, E> {
    /// The answer or the value, or the reason why there is none.
    pub outcome: Result<T, E>,
    /// When the line is free, in ns.
    pub ready_ns: u64,
}

/// Takes a procedure through its exchanges.
///
/// `exchange` receives a request and the time in ns before which the request must not leave. It performs the exchange and
/// returns how it ended, refused answers included. An error of `exchange` itself ends the procedure at once; it is meant for
/// faults that the procedure cannot handle, such as a port that is gone.
///
/// ```
/// use servowire_core::{Ended, Procedure, Step, run};
///
/// /// Asks until the answer is even.
/// struct Even;
///
/// impl Procedure for Even {
///     type Request = &'static str;
///     type Response = u8;
///     type Value = u8;
///     type Error = ();
///
///     fn start(&mut self, now_ns: u64) -> Step<&'static str, u8, ()> {
///         Step::Send { request: "a number", not_before_ns: now_ns }
///     }
///
///     fn receive(&mut self, outcome: Result<u8, ()>, ready_ns: u64) -> Step<&'static str, u8, ()> {
///         match outcome {
///             Ok(value) if value % 2 == 0 => Step::Done { value, ready_ns },
///             _ => self.start(ready_ns + 100),
///         }
///     }
/// }
///
/// let mut answers = [Ok(3), Err(()), Ok(8)].into_iter();
/// let mut times = Vec::new();
/// let ended = run(&mut Even, 7, |_, not_before_ns| {
///     times.push(not_before_ns);
///     answers.next().map(|outcome| Ended { outcome, ready_ns: not_before_ns + 10 }).ok_or("the port is gone")
/// });
/// assert_eq!(ended, Ok(Ended { outcome: Ok(8), ready_ns: 237 }));
/// assert_eq!(times, [7, 117, 227]);
/// ```
///
/// # Errors
/// The error of `exchange`. Whether the last request took effect is then unknown.
pub fn run<P: Procedure, F>(
    procedure: &mut P,
    now_ns: u64,
    mut exchange: impl FnMut(P::Request, u64) -> Result<Ended<P::Response, P::Error>, F>,
) -> Result<Ended<P::Value, P::Error>, F> {
    // Not by `run_async`: a future can be polled once too often, which is a panic.
    let mut step = procedure.start(now_ns);
    loop {
        match step {
            Step::Send { request, not_before_ns } => {
                let Ended { outcome, ready_ns } = exchange(request, not_before_ns)?;
                step = procedure.receive(outcome, ready_ns);
            }
            Step::Done { value, ready_ns } => return Ok(Ended { outcome: Ok(value), ready_ns }),
            Step::Failed { error, ready_ns } => return Ok(Ended { outcome: Err(error), ready_ns }),
        }
    }
}

/// Like [`run`], but awaits each exchange.
///
/// # Errors
/// The error of `exchange`.
pub async fn run_async<P: Procedure, F>(
    procedure: &mut P,
    now_ns: u64,
    mut exchange: impl AsyncFnMut(P::Request, u64) -> Result<Ended<P::Response, P::Error>, F>,
) -> Result<Ended<P::Value, P::Error>, F> {
    let mut step = procedure.start(now_ns);
    loop {
        match step {
            Step::Send { request, not_before_ns } => {
                let Ended { outcome, ready_ns } = exchange(request, not_before_ns).await?;
                step = procedure.receive(outcome, ready_ns);
            }
            Step::Done { value, ready_ns } => return Ok(Ended { outcome: Ok(value), ready_ns }),
            Step::Failed { error, ready_ns } => return Ok(Ended { outcome: Err(error), ready_ns }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::pin::pin;
    use core::task::{Context, Poll, Waker};
    use std::vec::Vec;

    /// Sends 1, 2, 3 ... and is done with the third answer; fails with the first refusal.
    #[derive(Default)]
    struct Three {
        sent: u8,
    }

    impl Procedure for Three {
        type Request = u8;
        type Response = u8;
        type Value = u8;
        type Error = char;

        fn start(&mut self, now_ns: u64) -> Step<u8, u8, char> {
            self.sent = 1;
            Step::Send { request: 1, not_before_ns: now_ns }
        }

        fn receive(&mut self, outcome: Result<u8, char>, ready_ns: u64) -> Step<u8, u8, char> {
            match outcome {
                Err(error) => Step::Failed { error, ready_ns },
                Ok(value) if self.sent == 3 => Step::Done { value, ready_ns },
                Ok(_) => {
                    self.sent += 1;
                    Step::Send { request: self.sent, not_before_ns: ready_ns + 5 }
                }
            }
        }
    }

    type Played = (Vec<(u8, u64)>, Result<Ended<u8, char>, &'static str>);

    /// By both loops, which make the same of it.
    fn play(answers: &[Result<Result<u8, char>, &'static str>]) -> Played {
        let (mut seen, mut rest) = (Vec::new(), answers.iter());
        let ended = run(&mut Three::default(), 100, |request, not_before_ns| {
            seen.push((request, not_before_ns));
            rest.next().unwrap().map(|outcome| Ended { outcome, ready_ns: not_before_ns + 20 })
        });
        let (mut awaited, mut rest, mut three) = (Vec::new(), answers.iter(), Three::default());
        let exchange = async |request, not_before_ns| {
            awaited.push((request, not_before_ns));
            rest.next().unwrap().map(|outcome| Ended { outcome, ready_ns: not_before_ns + 20 })
        };
        let ready = pin!(run_async(&mut three, 100, exchange)).poll(&mut Context::from_waker(Waker::noop()));
        assert_eq!((ready, awaited), (Poll::Ready(ended), seen.clone()));
        (seen, ended)
    }

    #[test]
    fn each_request_once_and_not_before_its_time() {
        let (seen, ended) = play(&[Ok(Ok(7)), Ok(Ok(8)), Ok(Ok(9))]);
        assert_eq!(seen, [(1, 100), (2, 125), (3, 150)]);
        assert_eq!(ended, Ok(Ended { outcome: Ok(9), ready_ns: 170 }));
    }

    #[test]
    fn a_refusal_is_the_procedures_a_lost_port_is_not() {
        let (seen, ended) = play(&[Ok(Ok(7)), Ok(Err('x'))]);
        assert_eq!((seen.len(), ended), (2, Ok(Ended { outcome: Err('x'), ready_ns: 145 })));
        let (seen, ended) = play(&[Ok(Ok(7)), Err("gone")]);
        assert_eq!((seen.len(), ended), (2, Err("gone")));
    }

    /// The awaited loop is the same one: an exchange that has to be woken twice.
    #[test]
    fn an_exchange_may_wait() {
        let mut looks = 0;
        let mut three = Three::default();
        let mut future = pin!(run_async(&mut three, 0, async |request, not_before_ns| {
            let mut waits = 2;
            core::future::poll_fn(|_| {
                waits -= 1;
                if waits == 0 { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
            Ok::<_, ()>(Ended { outcome: Ok(request), ready_ns: not_before_ns })
        }));
        loop {
            looks += 1;
            if let Poll::Ready(ended) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
                assert_eq!((looks, ended), (4, Ok(Ended { outcome: Ok(3), ready_ns: 10 })));
                break;
            }
        }
    }
}
