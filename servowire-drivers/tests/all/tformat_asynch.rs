//! The async driver on the hostile line: the same as the blocking one, and futures that are dropped at every point.

use std::future::poll_fn;
use std::task::Poll;

use crate::bench::{Bench, Misframed, Pin, Shared, Uart, WORST, Watch, line, place, scenario};
use crate::hostile::live_through;
use crate::late::{Late, World};
use crate::polls::{FOR_EVER, Looks, forget, pause, run};
use crate::refusals::tformat::{rows, widths};
use embedded_io::{ErrorKind, ErrorType};
use servowire_drivers::tformat::{asynch, blocking};
use servowire_drivers::{DirectionPin, Error};
use servowire_world::{Scenario, Verdict};
use tformat::master::{Line, Reset};
use tformat::{Address, Almc, BitRate, Page, Policy, Request};

/// The UART as futures that can be dropped.
struct AsyncUart(Uart);

impl ErrorType for AsyncUart {
    type Error = ErrorKind;
}

impl embedded_io_async::Read for AsyncUart {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        poll_fn(|_| self.0.try_read(bytes).map_or(Poll::Pending, Poll::Ready)).await
    }
}

impl embedded_io_async::Write for AsyncUart {
    /// A byte at a time, with a pause before each.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        pause().await;
        embedded_io::Write::write(&mut self.0, &bytes[..1])
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        pause().await;
        Ok(())
    }
}

/// Time goes on with every look, and every look may be the last.
type Driver = asynch::Driver<AsyncUart, DirectionPin<Pin>, Looks<Watch>>;

fn driver(bench: &Shared) -> Driver {
    driver_at(bench, Line::new(BitRate::Mbit2_5))
}

fn driver_at(bench: &Shared, line: Line) -> Driver {
    let pin = DirectionPin::new(Pin(bench.clone()), WORST);
    Driver::new(AsyncUart(Uart(bench.clone())), pin, Looks(Watch(bench.clone())), line).unwrap()
}

/// Dropped after each number of polls: the driver is off at once, and the next call is good.
#[test]
fn a_future_may_be_dropped_at_any_point() {
    for polls in 0.. {
        let bench = Bench::new(Scenario::quiet(), Misframed::Reported);
        let mut encoder = driver(&bench);
        let first = run(encoder.read_data(), polls);
        assert!(!bench.borrow().driver_on, "after {polls} polls");
        let second = run(encoder.read_data(), FOR_EVER).unwrap();
        let fresh = bench.borrow().truth().verdict(bench.borrow().request.unwrap(), second.unwrap().abs.get().into());
        assert_eq!(fresh, Verdict::Fresh, "after {polls} polls");
        assert_eq!(bench.borrow().truth().clashes(), 0, "after {polls} polls");
        if first.is_some() {
            assert!(polls > 100);
            return;
        }
    }
}

/// A future that is forgotten runs no destructor: the pin stays on until the next call, which waits all the same.
#[test]
fn a_future_may_be_forgotten() {
    for polls in 0..400 {
        let bench = Bench::new(Scenario::quiet(), Misframed::Reported);
        let mut encoder = driver(&bench);
        let ended = forget(encoder.read_data(), polls);
        let second = run(encoder.read_data(), FOR_EVER).unwrap();
        assert!(second.is_ok(), "after {polls} polls, ended {ended}: {second:?}");
        assert!(!bench.borrow().driver_on);
    }
}

/// What `Evidence::at` refuses the driver refuses too, and what it takes is the same sample.
#[test]
fn a_doubt_of_the_crate_is_one_of_the_driver() {
    for row in rows() {
        let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
        bench.borrow_mut().encoder().raise_alarms(row.alarms);
        let mut encoder = driver(&bench);
        let refused = run(encoder.read_position(row.resolution, row.policy), FOR_EVER).unwrap();
        assert!(matches!(refused, Err(Error::Doubt(doubt)) if (row.is)(doubt)), "{}: {refused:?}", row.what);
        let evidence = run(encoder.read_evidence(row.resolution), FOR_EVER).unwrap().unwrap();
        let refused = evidence.at(bench.borrow().now_ns(), row.policy);
        assert!(refused.is_err_and(row.is), "{}: {refused:?}", row.what);
    }
    let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
    let mut encoder = driver(&bench);
    let evidence = run(encoder.read_evidence(widths(23, 16)), FOR_EVER).unwrap().unwrap();
    let sample = evidence.at(bench.borrow().now_ns(), Policy::new(60_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(1), Some(3)));
    let sample = run(encoder.read_position(widths(23, 16), Policy::new(60_000)), FOR_EVER).unwrap().unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(2), Some(3)));
}

#[test]
fn procedures_run_over_it() {
    let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
    let mut encoder = driver(&bench);
    let address = Address::new(5).unwrap();
    assert_eq!(run(encoder.write_eeprom(Page::truncate(0), address, 0x5a), FOR_EVER), Some(Ok(0x5a)));
    assert_eq!(bench.borrow_mut().encoder().eeprom_mut()[0][5], 0x5a);
    bench.borrow_mut().encoder().raise_alarms(Almc::BE);
    bench.borrow_mut().encoder().end_alarms(Almc::BE);
    assert_eq!(run(encoder.read_data(), FOR_EVER).unwrap().map(|data| data.almc), Ok(Almc::BE));
    assert!(run(encoder.run(&mut Reset::clear_errors()), FOR_EVER).unwrap().is_ok());
    assert_eq!(run(encoder.read_data(), FOR_EVER).unwrap().map(|data| data.almc), Ok(Almc::empty()));
}

/// The blocking and the async driver say the same on the same line.
#[test]
fn both_drivers_agree() {
    for seed in 0..20 {
        let bench = |seed| Bench::new(scenario(seed), Misframed::Delivered);
        let (one, other) = (bench(seed), bench(seed));
        let pin = DirectionPin::new(Pin(one.clone()), WORST);
        let mut spinning =
            blocking::Driver::new(Uart(one.clone()), pin, Watch(one.clone()), Line::new(BitRate::Mbit2_5)).unwrap();
        let mut waiting = driver(&other);
        let calls = (0..30).filter(|_| {
            let [one, other] = [spinning.read_data().is_ok(), run(waiting.read_data(), FOR_EVER).unwrap().is_ok()];
            one == other
        });
        // Their looks at the clock differ, so a fault at the edge of a time-out may be judged differently.
        assert!(calls.count() >= 28, "seed {seed}");
    }
}

/// A call whose request and answer come through whole is good, whatever has happened before; every fourth call may be dropped.
#[test]
fn hostile_events_never_cost_a_good_answer() {
    let calls = live_through(|calls, seed| {
        let misframed = [Misframed::Dropped, Misframed::Delivered, Misframed::Reported][seed as usize % 3];
        let bench = Bench::new(scenario(seed), misframed);
        let mut encoder = driver_at(&bench, line());
        for call in 0..100_usize {
            let polls = if call % 4 == 3 { call * 7 + seed as usize % 7 } else { FOR_EVER };
            let outcome = run(encoder.read_data(), polls).map(|result| result.map(|all| all.abs.get()));
            bench.borrow_mut().judge(calls, outcome, seed, call);
        }
        bench.borrow().tally()
    });
    assert!(calls.dropped > 1_000);
}

/// Another task has the processor while the request is handed over, a piece at a time.
#[derive(Clone)]
struct Sharing(Late);

impl ErrorType for Sharing {
    type Error = ErrorKind;
}

impl embedded_io_async::Read for Sharing {
    async fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
        Err(self.0.damage().await)
    }
}

impl embedded_io_async::Write for Sharing {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        pause().await;
        self.0.take(bytes)
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        pause().await;
        Ok(())
    }
}

/// However late the request left, wherever its future was dropped, and if a part of it was taken only: the next one does not go out
/// into its answer, which needs the rest of the request, 3 us and four fields.
#[test]
fn what_was_held_up_is_not_talked_into() {
    for (held_up, refuses) in [(false, false), (true, false), (true, true)] {
        for polls in (0..200).chain([FOR_EVER]) {
            let late = Late::default();
            *late.0.borrow_mut() = World { held_up, refuses, pieces: 2, ..World::default() };
            let line = Line::new(BitRate::Mbit2_5);
            let mut encoder =
                asynch::Driver::new(Sharing(late.clone()), servowire_drivers::Automatic, Looks(late.clone()), line)
                    .unwrap();
            for (call, polls) in [(1, polls), (2, FOR_EVER)] {
                late.0.borrow_mut().call = call;
                let outcome = run(encoder.transact(Request::read_eeprom(Address::new(5).unwrap())), polls);
                assert!(!matches!(outcome, Some(Ok(_))));
            }
            if let Some((last, next)) = late.0.borrow().between() {
                assert!(next - last >= 8_000 + 3_000 + 16_000, "{held_up} {refuses} {polls}: {last} {next}");
            }
        }
    }
}
