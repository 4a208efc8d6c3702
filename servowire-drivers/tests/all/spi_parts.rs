//! What a port made of an SPI asks of its parts, call by call: faults of each call, and somebody who talks before the request.

use embedded_hal::digital::ErrorKind as PinFault;
use embedded_hal::spi::ErrorKind;
use servowire_drivers::spi::SpiError;
use servowire_drivers::tformat::blocking::Driver;
use servowire_drivers::{Automatic, Error};
use tformat::master::Line;
use tformat::{BitRate, Request};

use crate::parts::{BYTE_NS, Bench, Call};

type Failure = Error<SpiError<ErrorKind, PinFault>, core::convert::Infallible, tformat::Error, tformat::Doubt>;
/// A call with nobody at the line, and another one after it.
type Transact = fn(&Bench) -> [Failure; 2];

fn transact(bench: &Bench) -> [Failure; 2] {
    let mut buffers = ([0; 48], [0; 160]);
    let uart = bench.uart(&mut buffers);
    let mut encoder = Driver::new(uart, Automatic, bench.clone(), Line::new(BitRate::Mbit2_5)).unwrap();
    std::array::from_fn(|_| {
        let error = encoder.transact(Request::ReadSingleTurn).unwrap_err();
        bench.over();
        error
    })
}

/// Blocking, and as futures.
const WAYS: &[Transact] = &[
    transact,
    #[cfg(feature = "async")]
    asynch::transact,
];

fn calls(bench: &Bench) -> Vec<Call> {
    bench.0.borrow().calls.iter().map(|(call, _)| *call).collect()
}

#[test]
fn the_driver_goes_off_when_the_bits_have_left() {
    for transact in WAYS {
        let bench = Bench::default();
        let _ = transact(&bench);
        let calls = calls(&bench);
        let sent: Vec<_> =
            calls.iter().enumerate().filter(|(_, call)| **call == Call::Write).map(|(at, _)| at).collect();
        assert_eq!(sent.len(), 2);
        for at in sent {
            assert_eq!(calls[at - 1..at + 4], [Call::On, Call::Write, Call::Flush, Call::Off, Call::Sample]);
        }
        assert!(!bench.0.borrow().cut && !bench.0.borrow().on);
    }
}

/// Each call fails once: the driver is off after it, the fault is told unless it belonged to a look before the request, and the next call
/// sends its request.
#[test]
fn every_fault_is_told_and_leaves_the_driver_off() {
    for transact in WAYS {
        faults_are_told(*transact);
    }
}

fn faults_are_told(transact: Transact) {
    let good = Bench::default();
    let _ = transact(&good);
    let all = calls(&good);
    let first = all.iter().position(|call| *call == Call::On).unwrap();
    // On, write, flush, off, the window and its flush.
    for (fails, call) in all.iter().copied().enumerate().take(first + 6) {
        let bench = Bench::default();
        bench.0.borrow_mut().fails = Some(fails);
        let [error, next] = transact(&bench);
        let want = match call {
            Call::On | Call::Off => SpiError::Pin(PinFault::Other),
            Call::Write => SpiError::Spi(ErrorKind::ModeFault),
            Call::Flush => SpiError::Spi(ErrorKind::Other),
            Call::Sample => SpiError::Spi(ErrorKind::Overrun),
        };
        let what = format!("call {fails}, {call:?}: {error:?}");
        if fails >= first {
            assert!(matches!(error, Error::Io(error) if error == want), "{what}");
        }
        assert!(matches!(next, Error::Protocol(tformat::Error::NoResponse { .. })), "{what}, {next:?}");
        let world = bench.0.borrow();
        assert_eq!(world.left_on, [false; 2], "{what}");
        assert!(!world.cut, "{what}");
    }
}

/// What is heard on the line before a request is waited out: two fields of silence.
#[test]
fn nobody_is_interrupted() {
    let all =
        [0, 200_000, 300_000, 307_000].into_iter().flat_map(|until_ns| WAYS.iter().map(move |way| (until_ns, way)));
    for (talks_until_ns, transact) in all {
        let bench = Bench::default();
        bench.0.borrow_mut().talks_until_ns = talks_until_ns;
        let _ = transact(&bench);
        let world = bench.0.borrow();
        let (_, sent_ns) = world.calls.iter().find(|(call, _)| *call == Call::Write).unwrap();
        // The last sample of 0 was in one of the looks of ten bytes before that time.
        assert!(*sent_ns + 10 * BYTE_NS >= talks_until_ns + 8_000, "{talks_until_ns}: {sent_ns}");
        assert!(*sent_ns < talks_until_ns.max(80_000) + 40_000, "{talks_until_ns}: {sent_ns}");
    }
}

/// A field as samples, the most significant bit of a byte first.
fn field(content: u8, stop: u8) -> impl Iterator<Item = u8> {
    let level = |bit: u8| if bit == 1 { 0xff } else { 0 };
    std::iter::once(0).chain((0..8).map(move |bit| level(content >> bit & 1))).chain([level(stop)])
}

/// Two good fields and one whose stop bit is 0.
fn damaged() -> Vec<u8> {
    [0xff; 3].into_iter().chain(field(0x1a, 1)).chain(field(0x20, 1)).chain(field(0x33, 0)).collect()
}

#[test]
fn a_wrong_stop_bit_is_told_after_the_bytes_before_it() {
    let (bench, mut buffers) = (Bench::default(), ([0; 48], [0; 160]));
    let mut uart = bench.uart(&mut buffers);
    bench.0.borrow_mut().samples = damaged();
    let mut bytes = [0; 16];
    assert_eq!(embedded_io::Write::write(&mut uart, &[0x1a]), Ok(1));
    assert_eq!(embedded_io::Read::read(&mut uart, &mut bytes), Ok(2));
    assert_eq!(bytes[..2], [0x1a, 0x20]);
    assert_eq!(embedded_io::Read::read(&mut uart, &mut bytes), Err(SpiError::Framing));
    bench.0.borrow_mut().samples = [0xff; 3].into_iter().chain(field(0x33, 0)).collect();
    assert_eq!(embedded_io::Write::write(&mut uart, &[0x1a]), Ok(1));
    assert_eq!(embedded_io::Read::read(&mut uart, &mut bytes), Err(SpiError::Framing));
}

/// The same as futures, in an executor that polls only what has asked for it.
#[cfg(feature = "async")]
mod asynch {
    use std::future::{Future, poll_fn};
    use std::pin::pin;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::task::{Context, Poll, Wake, Waker};

    use servowire_drivers::Timer;
    use servowire_drivers::tformat::asynch::Driver;

    use super::*;

    struct Woken(AtomicBool);

    impl Wake for Woken {
        fn wake(self: Arc<Self>) {
            self.0.store(true, Ordering::Relaxed);
        }
    }

    fn run<T>(future: impl Future<Output = T>) -> T {
        let woken = Arc::new(Woken(AtomicBool::new(true)));
        let (waker, mut future) = (Waker::from(woken.clone()), pin!(future));
        loop {
            assert!(woken.0.swap(false, Ordering::Relaxed), "nobody wakes it");
            if let Poll::Ready(value) = future.as_mut().poll(&mut Context::from_waker(&waker)) {
                return value;
            }
        }
    }

    /// A timer whose interrupt comes when its time is over; until then only others wake.
    impl Timer for Bench {
        async fn wait_ns(&mut self, ns: u64) {
            let until_ns = self.0.borrow().now_ns + ns;
            poll_fn(|_| if self.0.borrow().now_ns < until_ns { Poll::Pending } else { Poll::Ready(()) }).await;
        }
    }

    pub(super) fn transact(bench: &Bench) -> [Failure; 2] {
        let mut buffers = ([0; 48], [0; 160]);
        let uart = bench.uart(&mut buffers);
        let mut encoder = Driver::new(uart, Automatic, bench.clone(), Line::new(BitRate::Mbit2_5)).unwrap();
        std::array::from_fn(|_| {
            let error = run(encoder.transact(Request::ReadSingleTurn)).unwrap_err();
            bench.over();
            error
        })
    }

    #[test]
    fn a_wrong_stop_bit_is_told_after_the_bytes_before_it() {
        let (bench, mut buffers) = (Bench::default(), ([0; 48], [0; 160]));
        let mut uart = bench.uart(&mut buffers);
        bench.0.borrow_mut().samples = damaged();
        let mut bytes = [0; 16];
        assert_eq!(run(embedded_io_async::Write::write(&mut uart, &[0x1a])), Ok(1));
        assert_eq!(run(embedded_io_async::Read::read(&mut uart, &mut bytes)), Ok(2));
        assert_eq!(bytes[..2], [0x1a, 0x20]);
        assert_eq!(run(embedded_io_async::Read::read(&mut uart, &mut bytes)), Err(SpiError::Framing));
    }
}
