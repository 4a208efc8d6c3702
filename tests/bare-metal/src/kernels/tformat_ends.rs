//! T-Format: master, encoder, inspection and the receive logic of the CLB design.

use tformat::clb::{Inputs, Outputs, SerialCrc, Tile};
use tformat::device::{Device, Fault, Transmission};
use tformat::inspect::{Report, inspect, inspect_bytes};
use tformat::master::{
    Counters, Detection, EEPROM_POLLING, EepromAccess, ErrorRate, Line, MultiTurnZero, Progress, Reset, SingleTurnZero,
    Step, Transaction, parse_echoed,
};
use tformat::{
    Abm, Abs, Address, Almc, BitRate, Error, ErrorClass, Page, Request, Resolution, Response, SingleTurn, Window,
};

use super::kernels;
use crate::self_test::tformat::{ANSWERS, Answer, FLIPS, Flip};

const LINE: Line = Line::new(BitRate::Mbit2_5);

/// Request bytes as an encoder receives them: read everything, read the EEPROM, write it.
type Sent = &'static [u8];
const SENT: [Sent; 3] = [&[0x1a], &[0xea, 0x35, 0xdf], &[0x32, 0x7f, 0x01, 0x4c]];

/// Requests and whether they come back on the line.
type Echoed = (Request, bool, &'static [u8]);
const ECHOED: [Echoed; 2] = [
    (Request::ReadSingleTurn, false, &[0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37]),
    (Request::ReadSingleTurn, true, &[0x02, 0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37]),
];

const WIDTHS: Resolution = match Resolution::new(17, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};

/// The time that a step names.
fn when<T: Copy>(step: Step<T>) -> u64 {
    match step {
        Step::Send { not_before_ns, .. } => not_before_ns,
        Step::Done { ready_ns, .. } | Step::Failed { ready_ns, .. } => ready_ns,
    }
}

kernels! {
    /// A transaction from its start to the last byte of the answer.
    fn tformat_transaction((request, echo, bytes): &Echoed) -> Progress {
        let line = if *echo { LINE.with_echo() } else { LINE };
        let mut transaction = Transaction::start(*request, line, 0);
        let mut now_ns = 4_000;
        for byte in *bytes {
            now_ns += 4_000;
            let _ = transaction.hear(&[*byte], now_ns);
        }
        transaction.progress()
    } over ECHOED;

    /// A transaction whose whole answer comes in one block.
    fn tformat_transaction_block((request, _, bytes): &Echoed) -> Progress {
        Transaction::start(*request, LINE, 0).hear(bytes, 31_000)
    } over ECHOED;

    /// A transaction that ends with a framing error or a time-out.
    fn tformat_transaction_fails((request, echo, bytes): &Echoed) -> Progress {
        let mut transaction = Transaction::start(*request, LINE, 0);
        for byte in *bytes {
            let _ = transaction.hear(&[*byte], 40_000);
        }
        if *echo { transaction.framing_error(8_000) } else { transaction.poll(1_000_000) }
    } over ECHOED;

    /// What a UART received since the request began.
    fn tformat_parse_echoed((request, _, bytes): &Echoed) -> Result<Response, Error> {
        parse_echoed(*request, bytes)
    } over ECHOED;

    /// A reset, from its start to the step after one answer.
    fn tformat_reset(row: &Answer) -> Step<SingleTurn> {
        let mut reset = Reset::clear_errors();
        let first = reset.start(0);
        match first {
            Step::Send { .. } => reset.receive(Ok(row.want), 100_000),
            end => end,
        }
    } over ANSWERS;

    /// Both zeros and the detection of the rate, from their starts to the step after one answer.
    fn tformat_zeros(row: &Answer) -> (u64, u64, u64) {
        let resolution = Resolution::from_enid(row.bytes.len() as u8).map_or(WIDTHS, |hint| hint.resolution);
        let mut single = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
        let mut multi = MultiTurnZero::set_and_lose_multi_turn_reference(resolution, 1);
        let mut detection = Detection::new();
        let _ = (single.start(0), multi.start(0), detection.start(0));
        (
            when(single.receive(Ok(row.want), 100_000)),
            when(multi.receive(Ok(row.want), 100_000)),
            when(detection.receive(Ok(row.want), 100_000)),
        )
    } over ANSWERS;

    /// EEPROM access, from its start to the step after one answer.
    fn tformat_eeprom(row: &Answer) -> Step<u8> {
        let (page, address) = Page::locate(300, Page::COUNT).unwrap_or((Page::MAX, Address::PAGE_REGISTER));
        let mut access = EepromAccess::write(page, address, row.bytes.len() as u8, EEPROM_POLLING);
        match access.start(0) {
            Step::Send { .. } => access.receive(Ok(row.want), 100_000),
            end => end,
        }
    } over ANSWERS;

    /// An outcome counted, and what that makes of the line.
    fn tformat_counters(row: &Flip) -> (u64, u32, bool) {
        let mut counters = Counters::new();
        let mut rate = ErrorRate::new(100, 250);
        let outcome = Response::parse_line(row.request, row.line);
        counters.record(&outcome);
        let exceeded = rate.record(&outcome);
        (counters.of(ErrorClass::Crc), counters.errors_per_million(), exceeded)
    } over FLIPS;

    /// A new encoder with an alarm receives a request byte by byte and answers.
    fn tformat_device_byte(sent: &Sent) -> Option<Transmission> {
        let mut encoder = Device::<1>::new(0x17, BitRate::Mbit2_5);
        encoder.set_position(Abs::truncate(0x12_3456), Abm::truncate(7));
        encoder.raise_alarms(Almc::CE);
        encoder.set_fault(Fault::FlipBit { at: sent.len() as u8 });
        let (mut reply, mut now_ns) = (None, 0);
        for byte in &**sent {
            now_ns += 4_000;
            if let Some(sent) = encoder.hear(&[*byte], now_ns) {
                reply = Some(sent);
            }
        }
        reply
    } over SENT;

    /// A new encoder receives a request bit by bit and answers.
    fn tformat_device_bit(row: &Flip) -> Option<Transmission> {
        let mut encoder = Device::<1>::new(0x17, BitRate::Mbit2_5);
        let (mut reply, mut now_ns) = (None, 0);
        // Not by `fold`, which copies what it has so far for every bit.
        for level in (0..row.line.len()).filter_map(|at| row.line.get(at)) {
            now_ns += 400;
            if let Some(sent) = encoder.hear_bit(level, now_ns) {
                reply = Some(sent);
            }
        }
        reply
    } over FLIPS;

    /// What is wrong with line bits.
    fn tformat_inspect(row: &Flip) -> Report {
        inspect(row.request, row.line)
    } over FLIPS;

    /// What is wrong with UART bytes, and which kinds of faults that are.
    fn tformat_inspect_bytes((request, _, bytes): &Echoed) -> (Report, usize) {
        let report = inspect_bytes(*request, bytes);
        (report, report.findings().iter().count() + report.fields().len())
    } over ECHOED;

    /// A cycle of the tile.
    fn tformat_clb_cycle((tile, inputs): &(Tile, Inputs)) -> (Outputs, Tile) {
        let mut tile = *tile;
        (tile.cycle(*inputs), tile)
    } over [
        (Tile::new(20, 11, 110), Inputs { start: true, response: true }),
        (Tile::new(24, 11, 60), Inputs { start: false, response: false }),
    ];

    /// The check register over the fields of an answer.
    fn tformat_clb_crc(row: &Answer) -> u8 {
        let mut crc = SerialCrc::new();
        row.bytes.iter().for_each(|byte| crc.field(*byte));
        crc.register()
    } over ANSWERS;

    /// A line taken apart and put together again.
    fn tformat_line_inverted(row: &Flip) -> Option<Window> {
        row.line.inverted().skip(10)
    } over FLIPS;
}
