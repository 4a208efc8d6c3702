//! A-format: reception, bus, master, encoder, inspection.

use nikon_aformat::bus::{Addresses, Bus};
use nikon_aformat::device::{Device, Transmission};
use nikon_aformat::inspect::{Report, inspect};
use nikon_aformat::master::{
    BusTransaction, Counters, Cycle, Detected, Detection, EepromRead, ErrorRate, Exchange, Line, Progress, Reset, Step,
    Transaction, Write,
};
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{
    Alm, BitRate, EncoderAddress, EncoderId, Error, ErrorClass, Operation, RawResponse, Request, Resolution, Response,
    Window,
};
use nrz_line::Samples;

use super::kernels;
use crate::self_test::nikon::{FLIPS, Flip, WHOLE, Whole};

const LINE: Line = Line::new(BitRate::Mbit16);

const REQUESTS: [Request; 4] = [
    Request::new(EncoderAddress::ZERO, Operation::Abs40),
    Request::new(EncoderAddress::ZERO, Operation::EepromRead { address: 0xf6 }),
    Request::new(EncoderAddress::ZERO, Operation::IdWrite1 { id: EncoderId::truncate(0x12_3456) }),
    Request::new(EncoderAddress::MAX, Operation::Abs40Mt),
];

fn contents(line: Window) -> impl Iterator<Item = u16> {
    (0..line.len() / 18).map(move |frame| (line.bits() >> (18 * frame + 1)) as u16)
}

fn answer(request: Request) -> Option<Transmission> {
    let mut encoder = Device::<1>::new(EncoderAddress::ZERO, Resolution::default(), BitRate::Mbit16);
    encoder.set_position(77, 3);
    encoder.raise_alarms(Alm::BATT);
    let mut now_ns = 0;
    request.emit().as_slice().iter().fold(None, |answer, frame| {
        now_ns += 2_000;
        encoder.hear(&[Some(frame.content())], now_ns).or(answer)
    })
}

kernels! {
    /// A reply from packed samples, one a bit, on a bus.
    fn nikon_receive(row: &Flip) -> Option<Result<RawResponse, Error>> {
        let mut receiver = LineReceiver::bits(row.expected.layout());
        let bits = row.line.bits();
        let mut low = Samples::new(bits as u64);
        let mut high = Samples::partial((bits >> 64) as u64 | u64::MAX << (row.line.len() - 64), 64);
        receiver.feed(&mut low).or_else(|| receiver.feed(&mut high)).or_else(|| receiver.finish().map(Err))
    } over LONG;

    /// A transaction from its start to the last frame of the reply, or to its time-out.
    fn nikon_transaction(row: &Whole) -> Progress<Exchange> {
        let mut transaction = Transaction::start(REQUESTS[0], Resolution::default(), LINE, 0);
        let mut now_ns = 3_000;
        let line = Window::read(&row.lsb_first, 0, 72, nikon_aformat::BitOrder::LsbFirst).unwrap_or(Window::EMPTY);
        for content in contents(line) {
            now_ns += 1_125;
            let _ = transaction.hear(&[Some(content)], now_ns);
        }
        let _ = transaction.framing_error(now_ns);
        transaction.poll(1_000_000)
    } over WHOLE;

    /// A transaction with eight encoders of which one answers.
    fn nikon_bus_transaction(row: &Whole) -> (u8, Addresses) {
        let mut transaction = BusTransaction::start(REQUESTS[3], Resolution::default(), Addresses::ALL, LINE, 0);
        let line = Window::read(&row.msb_first, 0, 72, nikon_aformat::BitOrder::MsbFirst).unwrap_or(Window::EMPTY);
        let mut now_ns = 3_000;
        for content in contents(line) {
            now_ns += 1_125;
            let _ = transaction.hear(&[Some(content)], now_ns);
        }
        let _ = (transaction.framing_error(now_ns + 5_000), transaction.poll(10_000_000));
        let bus: &Bus = transaction.bus();
        (bus.arrived(), bus.missing().without(bus.extra()))
    } over WHOLE;

    /// A reset, from its start to the step after one reply.
    fn nikon_reset(request: &Request) -> Step<Response> {
        let mut reset = Reset::clear_status(request.ea);
        match reset.start(0) {
            Step::Send { .. } => reset.receive(Err(Error::NoResponse), 100_000),
            end => end,
        }
    } over REQUESTS;

    /// EEPROM read, write and detection, from their start to the step after one reply.
    fn nikon_procedures(request: &Request) -> (Step<u16>, Step<Response>, Step<Detected>) {
        let mut read = EepromRead::new(request.ea, 0xf6);
        let mut write = Write::id(request.ea, EncoderId::truncate(5));
        let mut detection = Detection::search();
        let outcome = answer(*request).ok_or(Error::NoResponse);
        let resolution = Resolution::default();
        let outcome = outcome.and_then(|answer| Response::parse(&request.expected(resolution), &answer.frames));
        let _ = (read.start(0), write.start(0), detection.start(0));
        (read.receive(outcome, 1), write.receive(outcome, 1), detection.receive(outcome, 1))
    } over REQUESTS;

    /// A start of a cycle.
    fn nikon_cycle(now_ns: &u64) -> Option<(bool, u64)> {
        let min_ns = LINE.min_cycle_ns(REQUESTS[3], &REQUESTS[3].expected(Resolution::default()));
        let mut cycle = Cycle::new(1_000_000, min_ns, 0).ok()?;
        Some((cycle.is_due(*now_ns), cycle.next_ns()))
    } over [0_u64, 3_500_000];

    /// An outcome counted, and what that makes of the line.
    fn nikon_counters(row: &Flip) -> (u64, u32, bool) {
        let mut counters = Counters::new();
        let mut rate = ErrorRate::new(100, 250);
        let outcome = Response::parse_line(&row.expected, row.line);
        counters.record(&outcome);
        let exceeded = rate.record(&outcome);
        (counters.of(ErrorClass::Crc), counters.errors_per_million(), exceeded)
    } over FLIPS;

    /// A new encoder receives a request frame by frame and answers.
    fn nikon_device(request: &Request) -> Option<Transmission> {
        answer(*request)
    } over REQUESTS;

    /// What is wrong with line bits.
    fn nikon_inspect(row: &Flip) -> Report {
        inspect(REQUESTS[0], Resolution::default(), row.line)
    } over FLIPS;
}

/// A reply of more than 64 bits with a wrong one.
const LONG: [Flip; 1] = [crate::self_test::nikon::LONG];
