//! The pin of the line driver: on for the whole of the request, off before the answer, and off whenever somebody listens.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::digital::{ErrorKind as PinFault, ErrorType as PinErrorType, OutputPin};
use embedded_hal::spi::{ErrorType as SpiErrorType, SpiBus};
use embedded_io::{ErrorKind, ErrorType};
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiUart};
use servowire_drivers::tformat::blocking;
use servowire_drivers::{Automatic, Clock, ClockError, DriverEnable, Error};
use tformat::master::Line;
use tformat::{Address, BitRate, Request};

/// A field at 2.5 Mbit/s, and the time after which an encoder answers.
const FIELD_NS: u64 = 4_000;
const ANSWER_NS: u64 = 3_000;

/// What a UART waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waits {
    /// Nothing: the bytes are in its FIFO.
    Never,
    /// `write` for room in a register, `flush` until the bytes have left.
    Flush,
    /// `write` for room in a register and `flush` for nothing.
    Register,
    /// `write` until the bytes have left.
    Write,
}

/// A line without an encoder.
struct World {
    now_ns: u64,
    waits: Waits,
    /// From the look at the clock to the start bit, in software.
    slow_ns: u64,
    /// What was handed over has left then, and began to.
    sent_ns: u64,
    began_ns: Option<u64>,
    on: bool,
    on_ns: u64,
    off_ns: u64,
    /// How often the pin refuses to go low.
    refuses: u32,
    /// Somebody has listened with the driver on.
    deaf: bool,
}

#[derive(Clone)]
struct Bench(Rc<RefCell<World>>);

impl Bench {
    fn new(waits: Waits, slow_ns: u64) -> Self {
        Self(Rc::new(RefCell::new(World {
            now_ns: 0,
            waits,
            slow_ns,
            sent_ns: 0,
            began_ns: None,
            on: false,
            on_ns: 0,
            off_ns: 0,
            refuses: 0,
            deaf: false,
        })))
    }

    fn listen(&self) {
        let mut world = self.0.borrow_mut();
        world.deaf |= world.on;
    }

    fn send(&self, bytes: &[u8]) -> usize {
        let mut world = self.0.borrow_mut();
        world.now_ns += world.slow_ns;
        let room = match world.waits {
            Waits::Never => 16,
            Waits::Flush | Waits::Register => 1,
            Waits::Write => 0,
        };
        for _ in bytes {
            world.now_ns = world.now_ns.max(world.sent_ns.saturating_sub(FIELD_NS * room));
            let begin_ns = world.now_ns.max(world.sent_ns);
            world.began_ns.get_or_insert(begin_ns);
            world.sent_ns = begin_ns + FIELD_NS;
        }
        if world.waits == Waits::Write {
            world.now_ns = world.sent_ns;
        }
        bytes.len()
    }

    fn flush(&self) {
        let mut world = self.0.borrow_mut();
        if world.waits == Waits::Flush {
            world.now_ns = world.now_ns.max(world.sent_ns);
        }
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
        world.off_ns = world.now_ns;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), PinFault> {
        let mut world = self.0.borrow_mut();
        world.on = true;
        world.on_ns = world.now_ns;
        Ok(())
    }
}

impl ErrorType for Bench {
    type Error = ErrorKind;
}

impl embedded_io::Write for Bench {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        Ok(self.send(bytes))
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Bench::flush(self);
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

fn encoder(bench: &Bench) -> blocking::Driver<Bench, DriverEnable<Bench>, Bench> {
    let line = Line::new(BitRate::Mbit2_5);
    blocking::Driver::new(bench.clone(), DriverEnable(bench.clone()), bench.clone(), line)
}

/// What is between the look at the clock and the start bit takes time, more on a small processor. A request of which the end is cut
/// off may be another one: ID 0 without its last two bits is ID 8, which sets the zero.
fn requests() -> [(Request, u64); 3] {
    let address = Address::new(5).unwrap();
    [(Request::ReadSingleTurn, 1), (Request::read_eeprom(address), 3), (Request::write_eeprom(address, 0x5a), 4)]
}

fn uarts() -> impl Iterator<Item = (Waits, u64)> {
    let slow = [0, 300, 900, 1_600, 2_400, 3_900];
    let exact = [Waits::Never, Waits::Flush].into_iter().flat_map(move |waits| slow.map(|slow_ns| (waits, slow_ns)));
    exact.chain([(Waits::Register, 0), (Waits::Write, 0), (Waits::Write, 900)])
}

fn check(bench: &Bench, fields: u64, what: &str) {
    let world = bench.0.borrow();
    assert!(!world.on && !world.deaf, "{what}");
    assert_eq!(world.sent_ns, world.began_ns.unwrap() + fields * FIELD_NS);
    assert!(world.on_ns + 1_000 <= world.began_ns.unwrap(), "{what}");
    let late_ns = world.off_ns.checked_sub(world.sent_ns);
    assert!(late_ns.is_some_and(|ns| ns < ANSWER_NS), "{what}: sent {} off {}", world.sent_ns, world.off_ns);
}

#[test]
fn no_end_of_a_request_is_cut_off() {
    for (waits, slow_ns) in uarts() {
        for (request, fields) in requests() {
            let bench = Bench::new(waits, slow_ns);
            assert!(matches!(encoder(&bench).transact(request), Err(Error::Protocol(_))));
            check(&bench, fields, &format!("{waits:?}, {slow_ns} ns, {fields} fields"));
        }
    }
}

/// A pin that refuses once is tried again at once, and one that refuses longer before anybody listens.
#[test]
fn nobody_listens_with_the_driver_on() {
    for refuses in 0..6 {
        let bench = Bench::new(Waits::Never, 0);
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
    let bench = Bench::new(Waits::Never, 0);
    bench.0.borrow_mut().on = true;
    let _ = encoder(&bench).transact(Request::ReadAll);
    assert!(!bench.0.borrow().deaf);
}

#[test]
fn an_spi_does_not_listen_with_the_driver_on_either() {
    for (refuses, high) in [(0, false), (0, true), (1, false), (2, false), (3, true), (5, true)] {
        let bench = Bench::new(Waits::Never, 0);
        (bench.0.borrow_mut().on, bench.0.borrow_mut().refuses) = (high, refuses);
        let (mut tx, mut rx) = ([0; 48], [0; 160]);
        let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
        let uart = SpiUart::new(bench.clone(), DriverEnable(bench.clone()), sampling, &mut tx, &mut rx);
        let mut encoder = blocking::Driver::new(uart, Automatic, bench.clone(), Line::new(BitRate::Mbit2_5));
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
            Ok(self.send(bytes))
        }

        async fn flush(&mut self) -> Result<(), ErrorKind> {
            Bench::flush(self);
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

    fn encoder(bench: &Bench) -> Driver<Bench, DriverEnable<Bench>, Looks<Bench>> {
        Driver::new(bench.clone(), DriverEnable(bench.clone()), Looks(bench.clone()), Line::new(BitRate::Mbit2_5))
    }

    #[test]
    fn no_end_of_a_request_is_cut_off() {
        for (waits, slow_ns) in uarts() {
            for (request, fields) in requests() {
                let bench = Bench::new(waits, slow_ns);
                let outcome = run(encoder(&bench).transact(request), FOR_EVER);
                assert!(matches!(outcome, Some(Err(Error::Protocol(_)))));
                check(&bench, fields, &format!("{waits:?}, {slow_ns} ns, {fields} fields"));
            }
        }
    }

    #[test]
    fn a_future_that_was_forgotten_leaves_nobody_deaf() {
        let mut on = 0;
        for polls in 0..120 {
            let bench = Bench::new(Waits::Never, 0);
            let mut encoder = encoder(&bench);
            forget(encoder.transact(Request::ReadAll), polls);
            on += u32::from(bench.0.borrow().on);
            let _ = run(encoder.transact(Request::ReadAll), FOR_EVER);
            assert!(!bench.0.borrow().deaf && !bench.0.borrow().on, "{polls}");
        }
        assert!(on > 20, "forgotten with the driver on: {on}");
    }

    #[test]
    fn nor_at_an_spi() {
        let mut on = 0;
        for polls in 0..60 {
            let bench = Bench::new(Waits::Never, 0);
            let (mut tx, mut rx) = ([0; 48], [0; 160]);
            let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
            let uart = SpiUart::new(bench.clone(), DriverEnable(bench.clone()), sampling, &mut tx, &mut rx);
            let line = Line::new(BitRate::Mbit2_5);
            let mut encoder = Driver::new(uart, Automatic, Looks(bench.clone()), line);
            forget(encoder.transact(Request::ReadAll), polls);
            on += u32::from(bench.0.borrow().on);
            let _ = run(encoder.transact(Request::ReadAll), FOR_EVER);
            assert!(!bench.0.borrow().deaf && !bench.0.borrow().on, "{polls}");
        }
        assert!(on > 0);
    }
}
