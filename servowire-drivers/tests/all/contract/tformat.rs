mod of_all;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_io::{ErrorKind, ErrorType};
use servowire_core::{Procedure, Step};
use servowire_drivers::tformat::blocking;
use servowire_drivers::{Automatic, Clock, ClockError, DirectionPin, Error, PinTooSlow, Worst};
use tformat::master::{Detection, Exchange, Line, SingleTurnZero};
use tformat::{
    Address, AllData, Almc, BitRate, Doubt, Evidence, Page, Policy, Request, Resolution, Response, Sample, SingleTurn,
};

use super::{Faults, KINDS, Op};
use crate::second::tformat::Encoder;

type Fault = Error<ErrorKind, Infallible, tformat::Error, Doubt>;
type Called<T> = Result<T, Fault>;

/// What `flush` waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flush {
    Nothing,
    End,
    /// Another task has the processor meanwhile.
    Late(u64),
}

/// How a port and its processor behave.
#[derive(Debug, Clone)]
struct Port {
    write_most: usize,
    read_most: usize,
    flush: Flush,
    /// Bytes that the receiver holds.
    room: usize,
    look_ns: u64,
    /// Whether it hears itself.
    echo: bool,
    faults: Faults,
}

impl Port {
    fn good() -> Self {
        let faults = Faults::default();
        Self { write_most: 16, read_most: 16, flush: Flush::Nothing, room: 16, look_ns: 100, echo: false, faults }
    }
}

struct World {
    port: Port,
    encoder: Encoder,
    now_ns: u64,
    rate: BitRate,
    /// Fields that left, with their begins.
    sent: Vec<(u64, u8)>,
    /// Bytes on the line, with their ends.
    coming: VecDeque<(u64, u8)>,
    received: VecDeque<u8>,
    overrun: bool,
    /// The port gives or takes nothing any more.
    closed: bool,
}

impl World {
    fn field_ns(&self) -> u64 {
        if self.rate == BitRate::Mbit5 { 2_000 } else { 4_000 }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.port.faults.strike(Op::Write)?;
        if self.closed {
            return Ok(0);
        }
        let count = bytes.len().min(self.port.write_most);
        for byte in bytes.iter().take(count) {
            let free_ns = self.sent.last().map_or(0, |(begin_ns, _)| begin_ns + self.field_ns());
            let begin_ns = free_ns.max(self.now_ns);
            self.sent.push((begin_ns, *byte));
            let end_ns = begin_ns + self.field_ns();
            if self.port.echo {
                self.coming.push_back((end_ns, *byte));
            }
            let heard = self.field_ns() == self.encoder.field_ns();
            if let Some(answer) = heard.then(|| self.encoder.hear(*byte, true, end_ns)).flatten() {
                let field_ns = self.field_ns();
                let ends = (1..).map(|k| answer.start_ns + k * field_ns);
                self.coming.extend(ends.zip(answer.bytes));
            }
        }
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        self.port.faults.strike(Op::Flush)?;
        let end_ns = self.sent.last().map_or(0, |(begin_ns, _)| begin_ns + self.field_ns());
        match self.port.flush {
            Flush::Nothing => {}
            Flush::End => self.now_ns = self.now_ns.max(end_ns),
            Flush::Late(ns) => self.now_ns = self.now_ns.max(end_ns) + ns,
        }
        Ok(())
    }

    fn arrive(&mut self) {
        while let Some((_, byte)) = self.coming.front().copied().filter(|(end_ns, _)| *end_ns <= self.now_ns) {
            self.coming.pop_front();
            if self.received.len() < self.port.room {
                self.received.push_back(byte);
            } else {
                self.overrun = true;
            }
        }
    }

    fn is_ready(&mut self) -> Result<bool, ErrorKind> {
        self.port.faults.strike(Op::Ready)?;
        self.arrive();
        Ok(self.overrun || self.closed || !self.received.is_empty())
    }

    /// What is there: at least a byte, or an error.
    fn read(&mut self, bytes: &mut [u8]) -> Option<Result<usize, ErrorKind>> {
        self.arrive();
        if self.closed {
            return Some(Ok(0));
        }
        if !self.overrun && self.received.is_empty() {
            return None;
        }
        if let Err(kind) = self.port.faults.strike(Op::Read) {
            return Some(Err(kind));
        }
        if std::mem::take(&mut self.overrun) {
            return Some(Err(ErrorKind::Other));
        }
        let count = bytes.len().min(self.port.read_most).min(self.received.len());
        for (place, byte) in bytes.iter_mut().zip(self.received.drain(..count)) {
            *place = byte;
        }
        Some(Ok(count))
    }

    /// Requests that left: when they began, and their fields.
    fn requests(&self) -> Vec<(u64, Vec<u8>)> {
        let mut requests: Vec<(u64, Vec<u8>)> = Vec::new();
        let mut end_ns = 0;
        for (begin_ns, byte) in &self.sent {
            match requests.last_mut() {
                Some((_, fields)) if *begin_ns < end_ns + 2_000 => fields.push(*byte),
                _ => requests.push((*begin_ns, vec![*byte])),
            }
            end_ns = begin_ns + self.field_ns();
        }
        requests
    }
}

#[derive(Clone)]
struct Bench(Rc<RefCell<World>>);

impl Bench {
    fn new(port: Port) -> Self {
        Self(Rc::new(RefCell::new(World {
            port,
            encoder: Encoder::new(),
            now_ns: 1_000_000,
            rate: BitRate::Mbit2_5,
            sent: Vec::new(),
            coming: VecDeque::new(),
            received: VecDeque::new(),
            overrun: false,
            closed: false,
        })))
    }
}

impl Clock for Bench {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut world = self.0.borrow_mut();
        world.now_ns += world.port.look_ns;
        Ok(world.now_ns)
    }
}

impl ErrorType for Bench {
    type Error = ErrorKind;
}

impl embedded_io::Write for Bench {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        self.0.borrow_mut().flush()
    }
}

impl embedded_io::ReadReady for Bench {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        self.0.borrow_mut().is_ready()
    }
}

impl embedded_io::Read for Bench {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        self.0.borrow_mut().read(bytes).expect("only what is there is read")
    }
}

/// Every call of a driver.
trait Calls {
    /// Whether it asks the port if something is there.
    const ASKS: bool;
    fn open(bench: &Bench) -> Self;
    fn read_position(&mut self, resolution: Resolution, policy: Policy) -> Called<Sample>;
    fn read_evidence(&mut self, resolution: Resolution) -> Called<Evidence>;
    fn read_data(&mut self) -> Called<AllData>;
    fn clear_errors(&mut self) -> Called<SingleTurn>;
    fn read_eeprom(&mut self, page: Page, address: Address) -> Called<u8>;
    fn write_eeprom(&mut self, page: Page, address: Address, data: u8) -> Called<u8>;
    fn detect(&mut self, detection: Detection) -> Called<AllData>;
    fn run<P>(&mut self, procedure: &mut P) -> Called<P::Value>
    where
        P: Procedure<Request = Request, Response = Response, Error = tformat::Error>;
    fn transact(&mut self, request: Request) -> Called<Exchange>;
}

#[expect(clippy::unnecessary_wraps, reason = "the driver wants it so")]
fn set_rate(bench: &mut Bench, rate: BitRate) -> Result<(), ErrorKind> {
    bench.0.borrow_mut().rate = rate;
    Ok(())
}

const LINE: Line = Line::new(BitRate::Mbit2_5);

macro_rules! calls {
    ($driver:ty, $asks:expr, $open:expr, |$call:ident| $end:expr) => {
        impl Calls for $driver {
            const ASKS: bool = $asks;
            fn open(bench: &Bench) -> Self {
                $open(bench)
            }
            forward!(
                $driver,
                |$call| $end,
                read_position(resolution: Resolution, policy: Policy) -> Sample,
                read_evidence(resolution: Resolution) -> Evidence,
                read_data() -> AllData,
                clear_errors() -> SingleTurn,
                read_eeprom(page: Page, address: Address) -> u8,
                write_eeprom(page: Page, address: Address, data: u8) -> u8,
                transact(request: Request) -> Exchange
            );
            fn detect(&mut self, detection: Detection) -> Called<AllData> {
                let $call = <$driver>::detect(self, detection, set_rate);
                $end
            }
            fn run<P>(&mut self, procedure: &mut P) -> Called<P::Value>
            where
                P: Procedure<Request = Request, Response = Response, Error = tformat::Error>,
            {
                let $call = <$driver>::run(self, procedure);
                $end
            }
        }
    };
}

type Spinning = blocking::Driver<Bench, Automatic, Bench>;

calls!(
    Spinning,
    true,
    |bench: &Bench| blocking::Driver::new(bench.clone(), Automatic, bench.clone(), LINE).unwrap(),
    |called| called
);

#[cfg(feature = "async")]
mod asynch {
    use std::future::poll_fn;
    use std::task::Poll;

    use servowire_drivers::tformat::asynch::Driver;

    use super::*;
    use crate::polls::{Looks, pause, run};

    impl embedded_io_async::Write for Bench {
        async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            pause().await;
            self.0.borrow_mut().write(bytes)
        }

        async fn flush(&mut self) -> Result<(), ErrorKind> {
            self.0.borrow_mut().flush()
        }
    }

    impl embedded_io_async::Read for Bench {
        async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
            poll_fn(|_| self.0.borrow_mut().read(bytes).map_or(Poll::Pending, Poll::Ready)).await
        }
    }

    pub(super) type Waiting = Driver<Bench, Automatic, Looks<Bench>>;

    calls!(
        Waiting,
        false,
        |bench: &Bench| Driver::new(bench.clone(), Automatic, Looks(bench.clone()), LINE).unwrap(),
        |called| run(called, usize::MAX).unwrap()
    );
}

contract!(
    every_call_gives_what_the_encoder_has,
    pieces_of_any_size_give_the_same,
    every_error_of_the_port_is_told,
    a_fault_in_a_procedure_is_a_lost_answer,
    a_closed_port_is_told,
    bytes_that_got_lost_cost_one_call,
    a_flush_may_mean_anything,
    answers_come_as_late_as_they_may,
    pauses_of_the_procedures_are_kept,
    the_memory_has_pages,
    an_encoder_is_found_at_either_rate,
    the_line_is_left_alone_after_a_procedure,
    silence_ends
);

fn at(address: u8) -> Address {
    Address::new(address).unwrap()
}

fn page(number: u8) -> Page {
    Page::new(number).unwrap()
}

fn widths() -> Resolution {
    Resolution::new(23, 16).unwrap()
}

/// One request, after which the encoder is at work for half a millisecond.
struct Slow {
    fails: bool,
}

impl Procedure for Slow {
    type Request = Request;
    type Response = Response;
    type Value = ();
    type Error = tformat::Error;

    fn start(&mut self, now_ns: u64) -> Step<Request, (), tformat::Error> {
        Step::Send { request: Request::ReadAll, not_before_ns: now_ns }
    }

    fn receive(&mut self, _: Result<Response, tformat::Error>, ready_ns: u64) -> Step<Request, (), tformat::Error> {
        let ready_ns = ready_ns + 500_000;
        if self.fails {
            Step::Failed { error: tformat::Error::NoResponse { echo: false }, ready_ns }
        } else {
            Step::Done { value: (), ready_ns }
        }
    }
}

/// The bits are longer at the rate that was found, and so is the silence that the line has to keep.
#[test]
fn a_line_is_silent_for_two_fields_of_the_rate_that_was_found() {
    let bench = Bench::new(Port::good());
    bench.0.borrow_mut().rate = BitRate::Mbit5;
    let line = Line::new(BitRate::Mbit5);
    let mut driver = blocking::Driver::new(bench.clone(), Automatic, bench.clone(), line).unwrap();
    driver.detect(Detection::new(), set_rate).unwrap();
    let begun_ns = {
        let mut world = bench.0.borrow_mut();
        world.received.push_back(0x55);
        world.now_ns
    };
    driver.read_data().unwrap();
    assert!(bench.0.borrow().requests().last().unwrap().0 >= begun_ns + 8_000);
}

/// A pin that keeps the window at 2.5 Mbit/s and not at 5.
#[test]
fn a_pin_that_is_too_slow_for_a_rate_ends_the_search() {
    let bench = Bench::new(Port::good());
    let pin = DirectionPin::new(Pin, Worst { uart_start_ns: 400, wake_ns: 500, clock_ns: 100 });
    let mut driver = blocking::Driver::new(bench.clone(), pin, bench.clone(), LINE).unwrap();
    let too_slow = PinTooSlow { missing_ns: 300, window_ns: 800 };
    assert_eq!(driver.detect(Detection::new(), set_rate), Err(Error::PinTooSlow(too_slow)));
    assert!(bench.0.borrow().sent.is_empty());
    assert!(driver.detect(Detection::on([LINE, LINE]), set_rate).is_ok());
}

struct Pin;

impl PinErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
