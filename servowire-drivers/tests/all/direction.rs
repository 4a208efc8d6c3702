//! The pin of the line driver is off whenever somebody listens; `whole.rs` sees to the rest.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::digital::{ErrorKind as PinFault, ErrorType as PinErrorType, OutputPin};
use embedded_hal::spi::{ErrorType as SpiErrorType, SpiBus};
use embedded_io::{ErrorKind, ErrorType};
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiUart};
use servowire_drivers::tformat::blocking;
use servowire_drivers::{Automatic, Clock, ClockError, DirectionPin, Error, Worst};
use tformat::master::Line;
use tformat::{BitRate, Request};

/// A UART that sends at once, and looks at a clock of 50 ns.
const WORST: Worst = Worst { uart_start_ns: 0, wake_ns: 50, clock_ns: 50 };

/// A line without an encoder.
#[derive(Default)]
struct World {
    now_ns: u64,
    on: bool,
    /// How often the pin refuses to go low.
    refuses: u32,
    /// Somebody has listened with the driver on.
    deaf: bool,
}

#[derive(Clone)]
struct Bench(Rc<RefCell<World>>);

impl Bench {
    fn new() -> Self {
        Self(Rc::default())
    }

    fn listen(&self) {
        let mut world = self.0.borrow_mut();
        world.deaf |= world.on;
    }
}

impl Clock for Bench {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut world = self.0.borrow_mut();
        world.now_ns += 50;
        Ok(world.now_ns)
    }
}

impl PinErrorType for Bench {
    type Error = PinFault;
}

impl OutputPin for Bench {
    fn set_low(&mut self) -> Result<(), PinFault> {
        let mut world = self.0.borrow_mut();
        if let Some(left) = world.refuses.checked_sub(1) {
            world.refuses = left;
            return Err(PinFault::Other);
        }
        world.on = false;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), PinFault> {
        self.0.borrow_mut().on = true;
        Ok(())
    }
}

impl ErrorType for Bench {
    type Error = ErrorKind;
}

impl embedded_io::Write for Bench {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

impl embedded_io::ReadReady for Bench {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        self.listen();
        Ok(false)
    }
}

impl embedded_io::Read for Bench {
    fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
        Err(ErrorKind::Other)
    }
}

impl SpiErrorType for Bench {
    type Error = embedded_hal::spi::ErrorKind;
}

/// Nobody is at the line. Transfers in place are windows.
impl SpiBus for Bench {
    fn read(&mut self, _: &mut [u8]) -> Result<(), Self::Error> {
        Ok(())
    }

    fn write(&mut self, _: &[u8]) -> Result<(), Self::Error> {
        Ok(())
    }

    fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), Self::Error> {
        Ok(())
    }

    fn transfer_in_place(&mut self, _: &mut [u8]) -> Result<(), Self::Error> {
        self.listen();
        self.0.borrow_mut().now_ns += 50_000;
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

fn encoder(bench: &Bench) -> blocking::Driver<Bench, DirectionPin<Bench>, Bench> {
    let line = Line::new(BitRate::Mbit2_5);
    blocking::Driver::new(bench.clone(), DirectionPin::new(bench.clone(), WORST), bench.clone(), line).unwrap()
}

/// A pin that refuses once is tried again at once, and one that refuses longer before anybody listens.
#[test]
fn nobody_listens_with_the_driver_on() {
    for refuses in 0..6 {
        let bench = Bench::new();
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
    let bench = Bench::new();
    bench.0.borrow_mut().on = true;
    let _ = encoder(&bench).transact(Request::ReadAll);
    assert!(!bench.0.borrow().deaf);
}

#[test]
fn an_spi_does_not_listen_with_the_driver_on_either() {
    for (refuses, high) in [(0, false), (0, true), (1, false), (2, false), (3, true), (5, true)] {
        let bench = Bench::new();
        (bench.0.borrow_mut().on, bench.0.borrow_mut().refuses) = (high, refuses);
        let (mut tx, mut rx) = ([0; 48], [0; 160]);
        let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
        let uart = SpiUart::new(bench.clone(), DirectionPin::new(bench.clone(), WORST), sampling, &mut tx, &mut rx);
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
    use crate::polls::{FOR_EVER, Looks, forget, pause, run};

    impl embedded_io_async::Write for Bench {
        async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            Ok(bytes.len())
        }

        async fn flush(&mut self) -> Result<(), ErrorKind> {
            Ok(())
        }
    }

    impl embedded_io_async::Read for Bench {
        async fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
            self.listen();
            std::future::pending().await
        }
    }

    impl embedded_hal_async::spi::SpiBus for Bench {
        async fn read(&mut self, _: &mut [u8]) -> Result<(), Self::Error> {
            Ok(())
        }

        async fn write(&mut self, _: &[u8]) -> Result<(), Self::Error> {
            pause().await;
            Ok(())
        }

        async fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), Self::Error> {
            Ok(())
        }

        async fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Self::Error> {
            SpiBus::transfer_in_place(self, words)
        }

        async fn flush(&mut self) -> Result<(), Self::Error> {
            Ok(())
        }
    }

    fn encoder(bench: &Bench) -> Driver<Bench, DirectionPin<Bench>, Looks<Bench>> {
        Driver::new(
            bench.clone(),
            DirectionPin::new(bench.clone(), WORST),
            Looks(bench.clone()),
            Line::new(BitRate::Mbit2_5),
        )
        .unwrap()
    }

    #[test]
    fn a_future_that_was_forgotten_leaves_nobody_deaf() {
        let mut on = 0;
        // Before its first request a driver waits for what nobody knows of.
        for polls in (0..2_000).step_by(3) {
            let bench = Bench::new();
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
            let bench = Bench::new();
            (bench.0.borrow_mut().on, bench.0.borrow_mut().refuses) = (high, refuses);
            let (mut tx, mut rx) = ([0; 48], [0; 160]);
            let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
            let uart = SpiUart::new(bench.clone(), DirectionPin::new(bench.clone(), WORST), sampling, &mut tx, &mut rx);
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
            let bench = Bench::new();
            let (mut tx, mut rx) = ([0; 48], [0; 160]);
            let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
            let uart = SpiUart::new(bench.clone(), DirectionPin::new(bench.clone(), WORST), sampling, &mut tx, &mut rx);
            let line = Line::new(BitRate::Mbit2_5);
            let mut encoder = Driver::new(uart, Automatic, Looks(bench.clone()), line).unwrap();
            forget(encoder.transact(Request::ReadAll), polls);
            assert!(!bench.0.borrow().on, "{polls}");
            let _ = run(encoder.transact(Request::ReadAll), FOR_EVER);
            assert!(!bench.0.borrow().deaf && !bench.0.borrow().on, "{polls}");
        }
    }
}
