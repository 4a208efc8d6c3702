use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_io::ErrorKind;
use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{BusTransaction, Cycle, Detection, Exchange, Line};
use nikon_aformat::{
    BitRate, Doubt, EncoderAddress, Evidence, Operation, Policy, Request, RequestFrame, Resolution, Response, Sample,
};
use servowire_core::{Procedure, Step};
use servowire_drivers::nikon::{Frame, blocking};
use servowire_drivers::{Clock, ClockError, Error};

use super::{Faults, KINDS, Op};
use crate::second::nikon::Encoder;

type Fault = Error<ErrorKind, Infallible, nikon_aformat::Error, Doubt>;
type Called<T> = Result<T, Fault>;

/// 2.5 Mbit/s.
const BIT_NS: u64 = 400;
const FRAME_NS: u64 = 7_200;
const LOOK_NS: u64 = 100;

struct World {
    encoders: Vec<Encoder>,
    now_ns: u64,
    /// Requests with their begins and the ends of their frames.
    sent: Vec<(u64, Vec<u16>)>,
    coming: VecDeque<Frame>,
    /// Frames of answers, counted from 0, of which the delimiter is 0.
    unframed: Option<u32>,
    answered: u32,
    faults: Faults,
    /// Whether frames carry the time of their end.
    stamped: bool,
}

#[derive(Clone)]
struct Bench(Rc<RefCell<World>>);

impl Bench {
    fn new(encoders: u8) -> Self {
        Self(Rc::new(RefCell::new(World {
            encoders: (0..encoders).map(|ea| Encoder::new(ea, BIT_NS)).collect(),
            now_ns: 1_000_000,
            sent: Vec::new(),
            coming: VecDeque::new(),
            unframed: None,
            answered: 0,
            faults: Faults::default(),
            stamped: false,
        })))
    }

    fn send(&self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), ErrorKind> {
        let mut world = self.0.borrow_mut();
        world.faults.strike(Op::Write)?;
        let contents: Vec<_> = frames.iter().map(|frame| frame.content()).collect();
        let (begin_ns, mut end_ns) = (world.now_ns, world.now_ns);
        let mut answers = Vec::new();
        for (at, content) in contents.iter().enumerate() {
            end_ns += FRAME_NS + if at > 0 { u64::from(gap_bits) * BIT_NS } else { 0 };
            answers.extend(world.encoders.iter_mut().filter_map(|encoder| encoder.hear(*content, true, end_ns)));
        }
        world.sent.push((begin_ns, contents));
        for answer in answers {
            for (content, k) in answer.frames.into_iter().zip(1..) {
                let framed = world.unframed != Some(world.answered);
                world.answered += 1;
                let end_ns = Some(answer.start_ns + k * FRAME_NS);
                world.coming.push_back(Frame { content, framed, end_ns });
            }
        }
        Ok(())
    }

    fn take(&self) -> Option<Result<Frame, ErrorKind>> {
        let mut world = self.0.borrow_mut();
        let now_ns = world.now_ns;
        let frame = world.coming.front().copied().filter(|frame| frame.end_ns.unwrap() <= now_ns)?;
        if let Err(kind) = world.faults.strike(Op::Read) {
            return Some(Err(kind));
        }
        world.coming.pop_front();
        Some(Ok(Frame { end_ns: frame.end_ns.filter(|_| world.stamped), ..frame }))
    }
}

impl Clock for Bench {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut world = self.0.borrow_mut();
        world.now_ns += LOOK_NS;
        Ok(world.now_ns)
    }
}

impl blocking::FramePort for Bench {
    type Error = ErrorKind;

    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), ErrorKind> {
        Bench::send(self, frames, gap_bits)
    }

    fn take(&mut self) -> Result<Option<Frame>, ErrorKind> {
        Bench::take(self).transpose()
    }
}

/// Every call of a driver.
trait Calls {
    fn open(bench: &Bench) -> Self;
    fn read_position(&mut self, ea: EncoderAddress, policy: Policy) -> Called<Sample>;
    fn read_evidence(&mut self, ea: EncoderAddress) -> Called<Evidence>;
    fn read_abs40(&mut self, ea: EncoderAddress) -> Called<Exchange>;
    fn read_bus(&mut self, operation: Operation, asked: Addresses) -> Called<BusTransaction>;
    fn read_cycle(&mut self, cycle: &mut Cycle, operation: Operation, asked: Addresses) -> Called<BusTransaction>;
    fn clear_status(&mut self, ea: EncoderAddress) -> Called<Response>;
    fn read_eeprom(&mut self, ea: EncoderAddress, address: u8) -> Called<u16>;
    fn run<P>(&mut self, procedure: &mut P) -> Called<P::Value>
    where
        P: Procedure<Request = Request, Response = Response, Error = nikon_aformat::Error>;
    fn transact(&mut self, request: Request) -> Called<Exchange>;
}

fn line() -> Line {
    Line::new(BitRate::Mbit2_5).with_response_timeout_ns(20_000)
}

macro_rules! calls {
    ($driver:ty, $open:expr, |$call:ident| $end:expr) => {
        impl Calls for $driver {
            fn open(bench: &Bench) -> Self {
                $open(bench)
            }
            forward!(
                $driver,
                |$call| $end,
                read_position(ea: EncoderAddress, policy: Policy) -> Sample,
                read_evidence(ea: EncoderAddress) -> Evidence,
                read_abs40(ea: EncoderAddress) -> Exchange,
                read_bus(operation: Operation, asked: Addresses) -> BusTransaction,
                read_cycle(cycle: &mut Cycle, operation: Operation, asked: Addresses) -> BusTransaction,
                clear_status(ea: EncoderAddress) -> Response,
                read_eeprom(ea: EncoderAddress, address: u8) -> u16,
                transact(request: Request) -> Exchange
            );
            fn run<P>(&mut self, procedure: &mut P) -> Called<P::Value>
            where
                P: Procedure<Request = Request, Response = Response, Error = nikon_aformat::Error>,
            {
                let $call = <$driver>::run(self, procedure);
                $end
            }
        }
    };
}

type Spinning = blocking::Driver<Bench, Bench>;

calls!(
    Spinning,
    |bench: &Bench| blocking::Driver::new(bench.clone(), bench.clone(), Resolution::default(), line()),
    |called| called
);

#[cfg(feature = "async")]
mod asynch {
    use std::future::poll_fn;
    use std::task::Poll;

    use servowire_drivers::nikon::asynch::{Driver, FramePort};

    use super::*;
    use crate::polls::{Looks, pause, run};

    impl FramePort for Bench {
        type Error = ErrorKind;

        async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), ErrorKind> {
            pause().await;
            Bench::send(self, frames, gap_bits)
        }

        async fn take(&mut self) -> Result<Frame, ErrorKind> {
            poll_fn(|_| Bench::take(self).map_or(Poll::Pending, Poll::Ready)).await
        }
    }

    pub(super) type Waiting = Driver<Bench, Looks<Bench>>;

    calls!(
        Waiting,
        |bench: &Bench| Driver::new(bench.clone(), Looks(bench.clone()), Resolution::default(), line()),
        |called| run(called, usize::MAX).unwrap()
    );
}

contract!(
    every_call_gives_what_the_encoders_have,
    every_error_of_the_port_is_told,
    a_fault_in_a_procedure_is_a_lost_answer,
    a_frame_without_delimiter_is_none,
    answers_come_as_late_as_they_may,
    pauses_are_kept,
    a_cycle_keeps_its_grid,
    the_line_is_left_alone_after_a_procedure,
    a_line_is_silent_for_two_frames,
    silence_ends
);

const ONE: EncoderAddress = EncoderAddress::truncate(1);

/// One request, after which the encoder is at work for half a millisecond.
struct Slow;

impl Procedure for Slow {
    type Request = Request;
    type Response = Response;
    type Value = ();
    type Error = nikon_aformat::Error;

    fn start(&mut self, now_ns: u64) -> Step<Request, (), nikon_aformat::Error> {
        Step::Send { request: Request::new(ONE, Operation::Abs40), not_before_ns: now_ns }
    }

    fn receive(
        &mut self,
        _: Result<Response, nikon_aformat::Error>,
        ready_ns: u64,
    ) -> Step<Request, (), nikon_aformat::Error> {
        Step::Done { value: (), ready_ns: ready_ns + 500_000 }
    }
}

mod of_all {
    use super::*;

    fn driver<D: Calls>() -> (Bench, D) {
        let bench = Bench::new(3);
        let driver = D::open(&bench);
        (bench, driver)
    }

    pub(super) fn every_call_gives_what_the_encoders_have<D: Calls>() {
        for stamped in [false, true] {
            let (bench, mut driver) = driver::<D>();
            bench.0.borrow_mut().stamped = stamped;
            let abs = driver.read_abs40(ONE).unwrap().response.abs40().unwrap().get();
            assert_eq!(abs, 3 << 20 | 0x3_4567);
            let sample = driver.read_position(ONE, Policy::new(10_000_000)).unwrap();
            assert_eq!((sample.single_turn(), sample.turns()), (0x3_4567, Some(3)));
            // Four frames.
            let old = driver.read_position(ONE, Policy::new(28_799));
            assert!(matches!(old, Err(Error::Doubt(Doubt::Old { age_ns: 28_800.. }))), "{old:?}");
            let evidence = driver.read_evidence(ONE).unwrap();
            let now_ns = bench.0.borrow().now_ns;
            assert_eq!(evidence.at(now_ns, Policy::new(10_000_000)).unwrap().single_turn(), 0x3_4567);
            bench.0.borrow_mut().encoders[1].alm = 1;
            let alarm = driver.read_position(ONE, Policy::new(10_000_000));
            assert!(matches!(alarm, Err(Error::Doubt(Doubt::Status { .. }))), "{alarm:?}");
            driver.clear_status(ONE).unwrap();
            assert_eq!((bench.0.borrow().encoders[1].alm, bench.0.borrow().encoders[1].clears), (0, 1));
            assert_eq!(driver.read_eeprom(ONE, 9), Ok(0x5a09));
            assert_eq!(driver.read_eeprom(ONE, 0x80), Ok(0x5a80));
            let found = driver.run(&mut Detection::of(ONE)).unwrap();
            assert_eq!((found.ea, found.type_word.0), (ONE, 17));
            for (k, encoder) in (0..).zip(&mut bench.0.borrow_mut().encoders) {
                encoder.single = 0x100 + k;
            }
            let asked = Addresses::first(3);
            let all = driver.read_bus(Operation::Abs40Mt, asked).unwrap();
            for ea in asked.iter() {
                let abs = all.exchange(ea).unwrap().response.abs40().unwrap().get();
                assert_eq!(abs, (3 << 20) + 0x100 + u64::from(ea.get()));
            }
        }
    }

    /// One call of one method fails: the call of the driver does, with just that error, and the next one is good.
    pub(super) fn every_error_of_the_port_is_told<D: Calls>() {
        for kind in KINDS {
            for (op, calls) in [(Op::Write, 1), (Op::Read, 4)] {
                for call in 0..calls {
                    let (bench, mut driver) = driver::<D>();
                    bench.0.borrow_mut().faults = Faults::one(op, call, kind);
                    let outcome = driver.read_abs40(ONE);
                    assert_eq!(outcome, Err(Error::Io(kind)), "{op:?} {call}");
                    assert!(driver.read_abs40(ONE).is_ok(), "after {op:?} {call}");
                }
            }
        }
    }

    pub(super) fn a_fault_in_a_procedure_is_a_lost_answer<D: Calls>() {
        for (op, calls) in [(Op::Write, 8), (Op::Read, 24)] {
            for call in 0..calls {
                let (bench, mut driver) = driver::<D>();
                bench.0.borrow_mut().encoders[1].alm = 1;
                bench.0.borrow_mut().faults = Faults::one(op, call, ErrorKind::Other);
                let outcome = driver.clear_status(ONE);
                assert!(!matches!(outcome, Err(Error::Io(_))), "{op:?} {call}: {outcome:?}");
                if outcome.is_ok() {
                    assert_eq!(bench.0.borrow().encoders[1].alm, 0, "{op:?} {call}");
                }
                assert_eq!(driver.read_eeprom(ONE, 3), Ok(0x5a03), "{op:?} {call}");
            }
        }
    }

    pub(super) fn a_frame_without_delimiter_is_none<D: Calls>() {
        for (frame, stamped) in (0..4).flat_map(|frame| [(frame, false), (frame, true)]) {
            let (bench, mut driver) = driver::<D>();
            bench.0.borrow_mut().stamped = stamped;
            bench.0.borrow_mut().unframed = Some(frame);
            let outcome = driver.read_abs40(ONE);
            assert!(matches!(outcome, Err(Error::Protocol(_))), "{frame}: {outcome:?}");
            assert!(driver.read_abs40(ONE).is_ok(), "{frame}");
        }
    }

    /// The first start bit 20 us after the request at the latest.
    pub(super) fn answers_come_as_late_as_they_may<D: Calls>() {
        for (delay_ns, is_heard) in [(1_000, true), (2_800, true), (20_000, true), (60_000, false)] {
            let (bench, mut driver) = driver::<D>();
            bench.0.borrow_mut().encoders[1].delay_ns = delay_ns;
            assert_eq!(driver.read_abs40(ONE).is_ok(), is_heard, "{delay_ns}");
            bench.0.borrow_mut().encoders[1].delay_ns = 2_800;
            assert!(driver.read_abs40(ONE).is_ok(), "after {delay_ns}");
        }
    }

    /// 10 us from an answer to the next request, in procedures and out of them; 1 us between two frames of one.
    pub(super) fn pauses_are_kept<D: Calls>() {
        let (bench, mut driver) = driver::<D>();
        driver.read_abs40(ONE).unwrap();
        driver.read_abs40(ONE).unwrap();
        driver.clear_status(ONE).unwrap();
        let sent = bench.0.borrow().sent.clone();
        assert!(sent.len() >= 10);
        for (at, pair) in sent.windows(2).enumerate() {
            let answer_ns = if at < 2 { 4 * FRAME_NS } else { 3 * FRAME_NS };
            let least_ns = FRAME_NS + 2_800 + answer_ns + 10_000;
            assert!(pair[1].0 - pair[0].0 >= least_ns, "{at}: {} of {least_ns}", pair[1].0 - pair[0].0);
        }
    }

    pub(super) fn a_cycle_keeps_its_grid<D: Calls>() {
        let (bench, mut driver) = driver::<D>();
        // Before its first request a driver waits for what nobody knows of.
        driver.read_abs40(ONE).unwrap();
        bench.0.borrow_mut().sent.clear();
        let mut cycle = Cycle::new(1_000_000, 900_000, 3_000_000).unwrap();
        for _ in 0..5 {
            driver.read_cycle(&mut cycle, Operation::Abs40Mt, Addresses::first(3)).unwrap();
        }
        let sent = bench.0.borrow().sent.clone();
        let due = (3..8).map(|k| k * 1_000_000);
        for ((begun_ns, _), due_ns) in sent.iter().zip(due) {
            assert!((due_ns..due_ns + 1_000).contains(begun_ns), "{begun_ns} {due_ns}");
        }
        assert_eq!((sent.len(), cycle.missed()), (5, 0));
    }

    /// An encoder that needs half a millisecond after what it was asked for.
    pub(super) fn the_line_is_left_alone_after_a_procedure<D: Calls>() {
        let (bench, mut driver) = driver::<D>();
        driver.run(&mut Slow).unwrap();
        driver.read_abs40(ONE).unwrap();
        let sent = bench.0.borrow().sent.clone();
        assert!(sent[1].0 - sent[0].0 >= 500_000, "{sent:?}");
    }

    /// A frame that nobody asked for is on the line until now.
    pub(super) fn a_line_is_silent_for_two_frames<D: Calls>() {
        let (bench, mut driver) = driver::<D>();
        driver.read_abs40(ONE).unwrap();
        let begun_ns = {
            let mut world = bench.0.borrow_mut();
            let now_ns = world.now_ns;
            world.coming.push_back(Frame { content: 0, framed: true, end_ns: Some(now_ns) });
            now_ns
        };
        driver.read_abs40(ONE).unwrap();
        let sent_ns = bench.0.borrow().sent.last().unwrap().0;
        assert!((begun_ns + 2 * FRAME_NS..begun_ns + 3 * FRAME_NS).contains(&sent_ns), "{sent_ns} after {begun_ns}");
    }

    pub(super) fn silence_ends<D: Calls>() {
        let (bench, mut driver) = driver::<D>();
        bench.0.borrow_mut().encoders.clear();
        let lost = Err(Error::Protocol(nikon_aformat::Error::NoResponse));
        assert_eq!(driver.read_abs40(ONE), lost);
        assert_eq!(driver.read_position(ONE, Policy::new(1)).map(drop), lost.map(drop));
        assert_eq!(driver.read_evidence(ONE).map(drop), lost.map(drop));
        assert!(driver.clear_status(ONE).is_err());
        assert!(driver.read_eeprom(ONE, 1).is_err());
        let all = driver.read_bus(Operation::Abs40Mt, Addresses::first(3)).unwrap();
        assert!(Addresses::first(3).iter().all(|ea| all.exchange(ea).is_none()));
    }
}
