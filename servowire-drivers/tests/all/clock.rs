//! No call waits for ever on a clock that stands, was set back, jumps, or wraps after 32 bits: all calls of the blocking drivers, the clock
//! failing at any of their looks, with nobody at the line.

use std::cell::Cell;
use std::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write};
use nikon_aformat::bus::Addresses;
use nikon_aformat::master::Cycle;
use nikon_aformat::{EncoderAddress, Operation, RequestFrame};
use servowire_drivers::nikon::Frame;
use servowire_drivers::nikon::blocking::{Driver as Encoders, FramePort};
use servowire_drivers::tformat::blocking::Driver as Encoder;
use servowire_drivers::{Automatic, Clock, ClockError, CounterClock, Direction, Error, TickRate, Worst};

use crate::bad_clock::{Bad, STEP_NS, holds};

/// A UART at which nobody answers, and a port.
struct Silence;

impl ErrorType for Silence {
    type Error = Infallible;
}

impl Write for Silence {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl ReadReady for Silence {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }
}

impl Read for Silence {
    fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
        Ok(0)
    }
}

impl FramePort for Silence {
    type Error = Infallible;

    fn send(&mut self, _: &[RequestFrame], _: u32) -> Result<(), Infallible> {
        Ok(())
    }

    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        Ok(None)
    }
}

/// A pin that software switches.
struct Slow;

impl Direction for Slow {
    type Error = Infallible;

    fn transmit(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn receive(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn worst(&self) -> Option<Worst> {
        Some(Worst { uart_start_ns: 0, wake_ns: 100, clock_ns: 100 })
    }
}

#[test]
fn tformat() {
    let line = tformat::master::Line::new(tformat::BitRate::Mbit2_5);
    let address = tformat::Address::truncate(5);
    macro_rules! holds {
        ($name:literal, $call:expr) => {
            holds!($name, Automatic, $call);
        };
        ($name:literal, $direction:expr, $call:expr) => {
            holds($name, |clock| {
                let mut encoder = Encoder::new(Silence, $direction, || clock.look(), line).unwrap();
                std::array::from_fn(|_| clock.call(|| $call(&mut encoder).err()))
            });
        };
    }
    let (resolution, policy) = (tformat::Resolution::new(23, 16).unwrap(), tformat::Policy::new(1_000_000));
    holds!("read_position", |e: &mut Encoder<_, _, _>| e.read_position(resolution, policy));
    holds!("read_data", |e: &mut Encoder<_, _, _>| e.read_data());
    holds!("clear_errors", |e: &mut Encoder<_, _, _>| e.clear_errors());
    holds!("read_eeprom", |e: &mut Encoder<_, _, _>| e.read_eeprom(tformat::Page::truncate(0), address));
    holds!("write_eeprom", |e: &mut Encoder<_, _, _>| e.write_eeprom(tformat::Page::truncate(0), address, 7));
    holds!("transact", |e: &mut Encoder<_, _, _>| e.transact(tformat::Request::ReadSingleTurn));
    holds!("with a pin", Slow, |e: &mut Encoder<_, _, _>| e.transact(tformat::Request::ReadSingleTurn));
}

#[test]
fn nikon() {
    let line = nikon_aformat::master::Line::new(nikon_aformat::BitRate::Mbit2_5);
    let (resolution, ea) = (nikon_aformat::Resolution::default(), EncoderAddress::ZERO);
    macro_rules! holds {
        ($name:literal, $call:expr) => {
            holds($name, |clock| {
                let mut master = Encoders::new(Silence, || clock.look(), resolution, line);
                std::array::from_fn(|_| clock.call(|| $call(&mut master, clock).err()))
            });
        };
    }
    holds!("read_position", |m: &mut Encoders<_, _>, _| m.read_position(ea, nikon_aformat::Policy::new(1_000_000)));
    holds!("read_abs40", |m: &mut Encoders<_, _>, _| m.read_abs40(ea));
    holds!("read_bus", |m: &mut Encoders<_, _>, _| m.read_bus(Operation::Abs40Mt, Addresses::first(8)));
    holds!("clear_status", |m: &mut Encoders<_, _>, _| m.clear_status(ea));
    holds!("read_eeprom", |m: &mut Encoders<_, _>, _| m.read_eeprom(ea, 3));
    // Half a millisecond after another call.
    holds!("read_cycle", |m: &mut Encoders<_, _>, clock: &Bad| {
        if let Err(Error::Clock(error)) = m.read_abs40(ea) {
            return Err(Error::Clock(error));
        }
        let begin_ns = clock.call(|| clock.look()) + 500_000;
        let mut cycle = Cycle::new(1_000_000, 900_000, begin_ns).unwrap();
        clock.call(|| m.read_cycle(&mut cycle, Operation::Abs40Mt, Addresses::first(3)))
    });
}

/// Futures wait with a delay that passes on another clock, or not at all: each wait ends, and the error names the clock.
#[cfg(feature = "async")]
mod asynch {
    use std::future::pending;

    use servowire_drivers::WithDelay;
    use servowire_drivers::nikon::asynch as nikon_asynch;
    use servowire_drivers::tformat::asynch as tformat_asynch;

    use super::*;
    use crate::polls::{pause, run};

    type Encoder<C> = tformat_asynch::Driver<Silence, Automatic, C>;
    type Master<C> = nikon_asynch::Driver<Silence, C>;

    struct Delay;

    impl embedded_hal_async::delay::DelayNs for Delay {
        async fn delay_ns(&mut self, _: u32) {
            pause().await;
        }
    }

    impl embedded_io_async::Write for Silence {
        async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
            Ok(bytes.len())
        }

        async fn flush(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }

    impl embedded_io_async::Read for Silence {
        async fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
            pending().await
        }
    }

    impl nikon_asynch::FramePort for Silence {
        type Error = Infallible;

        async fn send(&mut self, _: &[RequestFrame], _: u32) -> Result<(), Infallible> {
            Ok(())
        }

        async fn take(&mut self) -> Result<Frame, Infallible> {
            pending().await
        }
    }

    #[test]
    fn tformat() {
        let line = ::tformat::master::Line::new(::tformat::BitRate::Mbit2_5);
        let address = ::tformat::Address::truncate(5);
        macro_rules! holds {
            ($name:literal, $call:expr) => {
                holds($name, |clock| {
                    let timer = WithDelay { clock: || clock.look(), delay: Delay };
                    let mut encoder = tformat_asynch::Driver::new(Silence, Automatic, timer, line).unwrap();
                    std::array::from_fn(|_| clock.call(|| run($call(&mut encoder), usize::MAX).unwrap().err()))
                });
            };
        }
        holds!("read_data", async |e: &mut Encoder<_>| e.read_data().await);
        holds!("clear_errors", async |e: &mut Encoder<_>| e.clear_errors().await);
        holds!("read_eeprom", async |e: &mut Encoder<_>| e.read_eeprom(::tformat::Page::truncate(1), address).await);
    }

    #[test]
    fn nikon() {
        let line = nikon_aformat::master::Line::new(nikon_aformat::BitRate::Mbit2_5);
        let (resolution, ea) = (nikon_aformat::Resolution::default(), EncoderAddress::ZERO);
        macro_rules! holds {
            ($name:literal, $call:expr) => {
                holds($name, |clock| {
                    let timer = WithDelay { clock: || clock.look(), delay: Delay };
                    let mut master = nikon_asynch::Driver::new(Silence, timer, resolution, line);
                    std::array::from_fn(|_| clock.call(|| run($call(&mut master), usize::MAX).unwrap().err()))
                });
            };
        }
        holds!("read_abs40", async |m: &mut Master<_>| m.read_abs40(ea).await);
        holds!("read_bus", async |m: &mut Master<_>| m.read_bus(Operation::Abs40Mt, Addresses::first(8)).await);
        holds!("clear_status", async |m: &mut Master<_>| m.clear_status(ea).await);
    }
}

/// A pin that says when it went off, by the true time.
struct Timed<'a> {
    looks: &'a Cell<u32>,
    on: u32,
    shortest: &'a Cell<u32>,
}

impl Direction for Timed<'_> {
    type Error = Infallible;

    fn transmit(&mut self) -> Result<(), Infallible> {
        self.on = self.looks.get();
        Ok(())
    }

    fn receive(&mut self) -> Result<(), Infallible> {
        if self.on > 0 {
            self.shortest.set(self.shortest.get().min(self.looks.get() - self.on));
        }
        self.on = 0;
        Ok(())
    }

    fn worst(&self) -> Option<Worst> {
        Some(Worst { uart_start_ns: 0, wake_ns: 100, clock_ns: 100 })
    }
}

/// A request without its end may be another one: ID 0 is ID 8 then. One byte lasts 4 us, and the clock is looked at every 100 ns.
#[test]
fn no_request_is_cut_off_when_the_clock_is_set_back_or_jumps() {
    let line = tformat::master::Line::new(tformat::BitRate::Mbit2_5);
    for (at, jumps) in (0..200).flat_map(|at| [(at, false), (at, true)]) {
        let (looks, shortest) = (Cell::new(0), Cell::new(u32::MAX));
        let clock = || {
            looks.set(looks.get() + 1);
            let look = looks.get();
            match (look >= at, jumps) {
                (true, false) => 100 * u64::from(look - at),
                (true, true) => 100 * u64::from(look) + 5_000_000_000,
                (false, _) => 100 * u64::from(look + 1_000_000),
            }
        };
        let pin = Timed { looks: &looks, on: 0, shortest: &shortest };
        let mut encoder = Encoder::new(Silence, pin, clock, line).unwrap();
        let error = encoder.transact(tformat::Request::ReadSingleTurn).unwrap_err();
        // With the lead of 1 us and a tick, unless nothing had been sent yet.
        let before = matches!(error, Error::Clock(_)) && shortest.get() <= 13;
        assert!(
            before || shortest.get() >= 40,
            "shifted at look {at}, ahead: {jumps}: the pin was on for {} looks",
            shortest.get()
        );
    }
}

#[test]
fn a_counter_of_a_processor_is_a_clock() {
    // A cycle counter at 160 MHz, and a SysTick, which counts down 24 bits.
    let cycles = Cell::new(0xffff_fff0_u32);
    let rate = TickRate::of::<160_000_000>();
    let mut clock = CounterClock::<_, 32>::new(rate, || cycles.get());
    let mut systick = CounterClock::<_, 24>::new(rate, || !(0x00ff_ffff - (cycles.get() & 0x00ff_ffff)));
    for (step, ns) in [(16, 100), (0, 100), (1_600, 10_100), (8_000_000, 50_010_100)] {
        cycles.set(cycles.get().wrapping_add(step));
        assert_eq!((clock.now_ns(), systick.now_ns()), (Ok(ns), Ok(ns)));
    }
    assert_eq!((clock.read_within_ns(), systick.read_within_ns()), (13_421_772_793, 52_428_793));
    cycles.set(0);
    assert_eq!(clock.now_ns(), Err(ClockError::Backwards { by_ns: 50_010_000 }));
}

/// What is never sent has no effect that could be unknown: nothing leaves on a line that gives an answer no time, or a request that no
/// encoder of this version knows, and a procedure says just that.
#[test]
fn what_is_refused_is_not_sent() {
    use nikon_aformat::Version;
    use nikon_aformat::master::Write as NikonWrite;

    let now_ns = Cell::new(0);
    let clock = || {
        now_ns.set(now_ns.get() + STEP_NS);
        now_ns.get()
    };
    // An answer cannot begin after 3 us and before 1.
    let line = tformat::master::Line::new(tformat::BitRate::Mbit2_5);
    let line = line.with_turn_around_ns(3_000).with_response_timeout_ns(1_000);
    let mut encoder = Encoder::new(Untouched, Automatic, clock, line).unwrap();
    let refused = Error::Protocol(tformat::Error::Line);
    assert_eq!(encoder.transact(tformat::Request::SetSingleTurnZero).unwrap_err(), refused);
    let mut zero = tformat::master::Reset::set_single_turn_zero_and_shift_commutation_angle();
    assert_eq!(encoder.run(&mut zero).unwrap_err(), refused);

    let line = nikon_aformat::master::Line::new(nikon_aformat::BitRate::Mbit2_5);
    let resolution = nikon_aformat::Resolution::default().with_version(Version::V2_1);
    let ea = EncoderAddress::ZERO;
    let mut master = Encoders::new(Untouched, clock, resolution, line);
    let write = NikonWrite::eeprom_of_bank(ea, 1, 2, 3);
    let refused = master.transact(write.request()).unwrap_err();
    assert!(matches!(refused, Error::Protocol(_)), "{refused:?}");
    assert_eq!(master.run(&mut { write }).unwrap_err(), refused);
}

/// A UART and a port that must not be told to send.
struct Untouched;

impl ErrorType for Untouched {
    type Error = Infallible;
}

impl Write for Untouched {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        panic!("{bytes:02x?} are sent");
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl ReadReady for Untouched {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }
}

impl Read for Untouched {
    fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
        Ok(0)
    }
}

impl FramePort for Untouched {
    type Error = Infallible;

    fn send(&mut self, frames: &[RequestFrame], _: u32) -> Result<(), Infallible> {
        panic!("{frames:?} are sent");
    }

    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        Ok(None)
    }
}
