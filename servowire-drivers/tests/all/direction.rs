//! The pin of the line driver is off whenever somebody listens; `whole.rs` sees to the rest.

use servowire_drivers::tformat::blocking;
use servowire_drivers::{Automatic, DirectionPin, Error};
use tformat::master::Line;
use tformat::{BitRate, Request};

use crate::parts::Bench;

fn encoder(bench: &Bench) -> blocking::Driver<Bench, DirectionPin<Bench>, Bench> {
    let line = Line::new(BitRate::Mbit2_5);
    blocking::Driver::new(bench.clone(), bench.pin(), bench.clone(), line).unwrap()
}

/// A pin that refuses once is tried again at once, and one that refuses longer before anybody listens.
#[test]
fn nobody_listens_with_the_driver_on() {
    for refuses in 0..6 {
        let bench = Bench::default();
        let mut encoder = encoder(&bench);
        let _ = encoder.transact(Request::ReadAll);
        bench.0.borrow_mut().refuses = refuses;
        let first = encoder.transact(Request::ReadAll);
        assert_eq!(matches!(first, Err(Error::Pin(_))), refuses > 0);
        assert_eq!(bench.0.borrow().on, refuses > 1);
        for _ in 0..6 {
            let _ = encoder.transact(Request::ReadAll);
        }
        let world = bench.0.borrow();
        assert!(!world.on && !world.deaf && world.refuses == 0, "{refuses}");
    }
}

#[test]
fn a_pin_that_is_high_at_first_is_switched_off_before_anybody_listens() {
    let bench = Bench::default();
    bench.0.borrow_mut().on = true;
    let _ = encoder(&bench).transact(Request::ReadAll);
    assert!(!bench.0.borrow().deaf);
}

#[test]
fn an_spi_does_not_listen_with_the_driver_on_either() {
    for (refuses, high) in [(0, false), (0, true), (1, false), (2, false), (3, true), (5, true)] {
        let bench = Bench::default();
        (bench.0.borrow_mut().on, bench.0.borrow_mut().refuses) = (high, refuses);
        let mut buffers = ([0; 48], [0; 160]);
        let uart = bench.uart(&mut buffers);
        let mut encoder = blocking::Driver::new(uart, Automatic, bench.clone(), Line::new(BitRate::Mbit2_5)).unwrap();
        for _ in 0..6 {
            let _ = encoder.transact(Request::ReadAll);
        }
        assert!(!bench.0.borrow().deaf && !bench.0.borrow().on, "{refuses} {high}");
    }
}

#[cfg(feature = "async")]
mod asynch {
    use servowire_drivers::tformat::asynch::Driver;

    use super::*;
    use crate::polls::{FOR_EVER, Looks, forget, run};

    fn encoder(bench: &Bench) -> Driver<Bench, DirectionPin<Bench>, Looks<Bench>> {
        Driver::new(bench.clone(), bench.pin(), Looks(bench.clone()), Line::new(BitRate::Mbit2_5)).unwrap()
    }

    #[test]
    fn a_future_that_was_forgotten_leaves_nobody_deaf() {
        let mut on = 0;
        // Before its first request a driver waits for what nobody knows of.
        for polls in (0..2_000).step_by(3) {
            let bench = Bench::default();
            let mut encoder = encoder(&bench);
            forget(encoder.transact(Request::ReadAll), polls);
            on += u32::from(bench.0.borrow().on);
            let _ = run(encoder.transact(Request::ReadAll), FOR_EVER);
            assert!(!bench.0.borrow().deaf && !bench.0.borrow().on, "{polls}");
        }
        assert!(on > 20, "forgotten with the driver on: {on}");
    }

    #[test]
    fn an_spi_does_not_listen_with_the_driver_on() {
        for (refuses, high) in [(0, true), (1, false), (2, false), (3, true), (5, true)] {
            let bench = Bench::default();
            (bench.0.borrow_mut().on, bench.0.borrow_mut().refuses) = (high, refuses);
            let mut buffers = ([0; 48], [0; 160]);
            let uart = bench.uart(&mut buffers);
            let line = Line::new(BitRate::Mbit2_5);
            let mut encoder = Driver::new(uart, Automatic, Looks(bench.clone()), line).unwrap();
            for _ in 0..6 {
                let _ = run(encoder.transact(Request::ReadAll), FOR_EVER);
                assert!(!bench.0.borrow().deaf, "{refuses} {high}");
            }
            assert!(!bench.0.borrow().on, "{refuses} {high}");
        }
    }

    /// An SPI sends without giving the time back, so nobody can forget it with the driver on.
    #[test]
    fn nor_at_an_spi() {
        for polls in 0..400 {
            let bench = Bench::default();
            let mut buffers = ([0; 48], [0; 160]);
            let uart = bench.uart(&mut buffers);
            let line = Line::new(BitRate::Mbit2_5);
            let mut encoder = Driver::new(uart, Automatic, Looks(bench.clone()), line).unwrap();
            forget(encoder.transact(Request::ReadAll), polls);
            assert!(!bench.0.borrow().on, "{polls}");
            let _ = run(encoder.transact(Request::ReadAll), FOR_EVER);
            assert!(!bench.0.borrow().deaf && !bench.0.borrow().on, "{polls}");
        }
    }
}
