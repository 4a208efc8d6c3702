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

mod of_all {
    use super::*;

    fn driver<D: Calls>(port: Port) -> (Bench, D) {
        let bench = Bench::new(port);
        let driver = D::open(&bench);
        (bench, driver)
    }

    pub(super) fn every_call_gives_what_the_encoder_has<D: Calls>() {
        all_is_well::<D>(Port::good());
    }

    /// What each call gives on a good line.
    fn all_is_well<D: Calls>(port: Port) {
        let what = format!("{port:?}");
        let (bench, mut driver) = driver::<D>(port);
        let all = driver.read_data().unwrap();
        assert_eq!((all.abs.get(), all.abm.get(), all.enid, all.almc), (0x12_3456, 3, 0x17, Almc::empty()), "{what}");
        let sample = driver.read_position(widths(), Policy::new(10_000_000)).unwrap();
        assert_eq!((sample.single_turn(), sample.turns()), (0x12_3456, Some(3)), "{what}");
        let begun_ns = bench.0.borrow().requests()[1].0;
        assert!((begun_ns + 4_000..begun_ns + 12_000).contains(&sample.sampled_ns()), "{what}");
        // The answer alone lasts 44 us.
        let old = driver.read_position(widths(), Policy::new(43_999));
        assert!(matches!(old, Err(Error::Doubt(Doubt::Old { age_ns: 44_000.. }))), "{what}: {old:?}");
        let evidence = driver.read_evidence(widths()).unwrap();
        let now_ns = bench.0.borrow().now_ns;
        assert_eq!(evidence.at(now_ns, Policy::new(10_000_000)).unwrap().single_turn(), 0x12_3456, "{what}");
        bench.0.borrow_mut().encoder.almc = 0x40;
        let alarm = driver.read_position(widths(), Policy::new(10_000_000));
        assert_eq!(alarm, Err(Error::Doubt(Doubt::Alarms { alarms: Almc::BE })), "{what}");
        assert_eq!(driver.clear_errors().unwrap().abs.get(), 0x12_3456, "{what}");
        assert_eq!((bench.0.borrow().encoder.almc, bench.0.borrow().encoder.clears), (0, 1), "{what}");
        assert_eq!(driver.read_eeprom(page(2), at(9)), Ok(2 << 5 ^ 9), "{what}");
        assert_eq!(driver.write_eeprom(page(1), at(9), 0x77), Ok(0x77), "{what}");
        assert_eq!((bench.0.borrow().encoder.memory[1][9], bench.0.borrow().encoder.writes), (0x77, 1), "{what}");
        let turns = driver.transact(Request::ReadMultiTurn).unwrap().response;
        assert!(matches!(turns, Response::ReadMultiTurn(turns) if turns.abm.get() == 3), "{what}");
        let mut zero = SingleTurnZero::set_and_shift_commutation_angle(widths(), 0);
        assert!(driver.run(&mut zero).is_ok(), "{what}");
        let world = bench.0.borrow();
        assert_eq!((world.encoder.abs, world.encoder.zeros), (0, 1), "{what}");
    }

    pub(super) fn pieces_of_any_size_give_the_same<D: Calls>() {
        for (write_most, read_most) in [(1, 16), (2, 16), (3, 16), (16, 1), (16, 2), (16, 5), (1, 1), (2, 3)] {
            for echo in [false, true] {
                all_is_well::<D>(Port { write_most, read_most, echo, ..Port::good() });
            }
        }
    }

    /// One call of one method fails: the call of the driver does, with just that error, and the next one is good.
    pub(super) fn every_error_of_the_port_is_told<D: Calls>() {
        for kind in KINDS {
            for (op, calls) in [(Op::Write, 3), (Op::Flush, 1), (Op::Ready, 60), (Op::Read, 4)] {
                let mut told = 0;
                for call in 0..calls {
                    let faults = Faults::one(op, call, kind);
                    let (bench, mut driver) = driver::<D>(Port { write_most: 1, read_most: 1, faults, ..Port::good() });
                    let outcome = driver.transact(Request::read_eeprom(at(9)));
                    let what = format!("{op:?} {call} {kind:?}: {outcome:?}");
                    match outcome {
                        Err(Error::Io(error)) => {
                            assert_eq!(error, kind, "{what}");
                            assert!(bench.0.borrow().port.faults.are_over(), "{what}");
                            told += 1;
                        }
                        // Before the request errors are thrown away like bytes.
                        outcome => assert!(outcome.is_ok() && op == Op::Ready, "{what}"),
                    }
                    assert_eq!(driver.read_data().map(|all| all.abs.get()), Ok(0x12_3456), "after {what}");
                }
                // Futures do not ask whether something is there, and before the request nothing is told.
                assert!(op == Op::Ready && !D::ASKS || told + 3 >= calls, "{op:?}: {told} of {calls} told");
            }
        }
    }

    pub(super) fn a_fault_in_a_procedure_is_a_lost_answer<D: Calls>() {
        for (op, calls) in [(Op::Write, 12), (Op::Flush, 12), (Op::Read, 12)] {
            for call in 0..calls {
                let (bench, mut driver) =
                    driver::<D>(Port { faults: Faults::one(op, call, ErrorKind::Other), ..Port::good() });
                bench.0.borrow_mut().encoder.almc = 0x40;
                let outcome = driver.clear_errors();
                assert!(outcome.is_ok(), "{op:?} {call}: {outcome:?}");
                assert_eq!(bench.0.borrow().encoder.almc, 0, "{op:?} {call}");
                assert_eq!(driver.read_eeprom(page(3), at(1)), Ok(3 << 5 ^ 1), "{op:?} {call}");
            }
        }
    }

    pub(super) fn a_closed_port_is_told<D: Calls>() {
        let (bench, mut driver) = driver::<D>(Port::good());
        driver.read_data().unwrap();
        bench.0.borrow_mut().closed = true;
        assert_eq!(driver.read_data(), Err(Error::Closed));
        assert_eq!(driver.clear_errors(), Err(Error::Closed));
        assert_eq!(driver.read_eeprom(page(0), at(1)), Err(Error::Closed));
        bench.0.borrow_mut().closed = false;
        assert!(driver.read_data().is_ok());
    }

    /// A processor that looks every 20 us, at a UART that holds four bytes.
    pub(super) fn bytes_that_got_lost_cost_one_call<D: Calls>() {
        let (bench, mut driver) = driver::<D>(Port { room: 4, look_ns: 20_000, ..Port::good() });
        assert_eq!(driver.read_data(), Err(Error::Io(ErrorKind::Other)));
        bench.0.borrow_mut().port.look_ns = 100;
        assert!(driver.read_data().is_ok());
    }

    pub(super) fn a_flush_may_mean_anything<D: Calls>() {
        for flush in [Flush::Nothing, Flush::End, Flush::Late(2_000), Flush::Late(40_000)] {
            all_is_well::<D>(Port { flush, ..Port::good() });
        }
    }

    /// The first start bit 10 us after the request at the latest, and not before four bits have passed.
    pub(super) fn answers_come_as_late_as_they_may<D: Calls>() {
        for (delay_ns, is_heard) in [(1_000, false), (1_700, true), (3_000, true), (10_000, true), (40_000, false)] {
            let (bench, mut driver) = driver::<D>(Port::good());
            bench.0.borrow_mut().encoder.delay_ns = delay_ns;
            assert_eq!(driver.read_data().is_ok(), is_heard, "{delay_ns}");
            bench.0.borrow_mut().encoder.delay_ns = 3_000;
            assert!(driver.read_data().is_ok(), "after {delay_ns}");
        }
    }

    /// At least 40 us of idle line between the resets; a busy memory is asked every millisecond.
    pub(super) fn pauses_of_the_procedures_are_kept<D: Calls>() {
        let (bench, mut driver) = driver::<D>(Port::good());
        driver.clear_errors().unwrap();
        let requests = bench.0.borrow().requests();
        assert_eq!(requests.len(), 10);
        for pair in requests.windows(2) {
            // A field, 3 us, six fields, 40 us.
            assert!((71_000..80_000).contains(&(pair[1].0 - pair[0].0)), "{requests:?}");
        }
        let before = bench.0.borrow().now_ns;
        driver.write_eeprom(page(0), at(9), 1).unwrap();
        let requests: Vec<_> = bench.0.borrow().requests().into_iter().filter(|(at_ns, _)| *at_ns > before).collect();
        let writes: Vec<_> = requests.iter().filter(|(_, fields)| fields[..2] == [0x32, 9]).collect();
        assert_eq!(writes.len(), 1, "{requests:02x?}");
        let begun_ns = writes[0].0;
        let asked = requests.iter().filter(|(at_ns, _)| (begun_ns + 1..begun_ns + 18_000_000).contains(at_ns)).count();
        assert!((1..=18).contains(&asked), "{asked} times in 18 ms");
    }

    pub(super) fn the_memory_has_pages<D: Calls>() {
        let (bench, mut driver) = driver::<D>(Port::good());
        for (number, cell) in [(0, 5), (3, 5), (5, 126), (1, 0), (0, 126)] {
            assert_eq!(driver.read_eeprom(page(number), at(cell)), Ok(number << 5 ^ cell));
            assert_eq!(driver.write_eeprom(page(number), at(cell), 0xa0 | number), Ok(0xa0 | number));
            assert_eq!(bench.0.borrow().encoder.memory[usize::from(number)][usize::from(cell)], 0xa0 | number);
        }
        assert_eq!(bench.0.borrow().encoder.writes, 5);
        // An encoder that has started anew is on page 0.
        assert_eq!(driver.read_eeprom(page(4), at(7)), Ok(4 << 5 ^ 7));
        let now_ns = bench.0.borrow().now_ns;
        bench.0.borrow_mut().encoder.restart(now_ns);
        assert_eq!(driver.read_eeprom(page(4), at(7)), Ok(4 << 5 ^ 7));
        assert_eq!(driver.write_eeprom(page(4), at(7), 1), Ok(1));
        assert_eq!(bench.0.borrow().encoder.memory[0][7], 7);
    }

    pub(super) fn an_encoder_is_found_at_either_rate<D: Calls>() {
        for (fast, field_ns) in [(true, 2_000), (false, 4_000)] {
            let (bench, mut driver) = driver::<D>(Port::good());
            bench.0.borrow_mut().encoder.fast = fast;
            let found = driver.detect(Detection::new()).unwrap();
            assert_eq!((found.enid, found.abm.get()), (0x17, 3));
            assert_eq!(bench.0.borrow().field_ns(), field_ns);
            // After 1.5 s at the earliest.
            assert!(bench.0.borrow().requests()[0].0 >= 1_500_000_000);
            // It stays at that rate.
            assert_eq!(driver.read_data().map(|all| all.abs.get()), Ok(0x12_3456));
        }
        let (bench, mut driver) = driver::<D>(Port::good());
        bench.0.borrow_mut().encoder.silent();
        assert!(matches!(driver.detect(Detection::new()), Err(Error::Protocol(_))));
        let count = bench.0.borrow().sent.len();
        assert_eq!(count, 6, "three tries at each rate");
    }

    /// An encoder that needs half a millisecond after what it was asked for.
    pub(super) fn the_line_is_left_alone_after_a_procedure<D: Calls>() {
        for fails in [false, true] {
            let (bench, mut driver) = driver::<D>(Port::good());
            assert_eq!(driver.run(&mut Slow { fails }).is_err(), fails);
            driver.read_data().unwrap();
            let requests = bench.0.borrow().requests();
            assert!(requests[1].0 - requests[0].0 >= 500_000, "{requests:?}");
        }
    }

    pub(super) fn silence_ends<D: Calls>() {
        let (bench, mut driver) = driver::<D>(Port::good());
        bench.0.borrow_mut().encoder.silent();
        let lost = Error::Protocol(tformat::Error::NoResponse { echo: false });
        assert_eq!(driver.read_data(), Err(lost));
        assert_eq!(driver.read_position(widths(), Policy::new(1)), Err(lost));
        assert_eq!(driver.read_evidence(widths()), Err(lost));
        assert_eq!(driver.clear_errors(), Err(lost));
        assert_eq!(driver.transact(Request::ReadEncoderId), Err(lost));
        assert!(driver.read_eeprom(page(0), at(1)).is_err());
        assert!(driver.write_eeprom(page(0), at(1), 2).is_err());
    }
}
