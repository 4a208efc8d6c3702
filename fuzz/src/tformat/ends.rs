//! Both ends of the line, driven by any events at any time.

use std::convert::Infallible;

use servowire_core::{Ended, Procedure};
use tformat::device::{Device, Fault};
use tformat::inspect::{Cause, LineCause, inspect as look};
use tformat::master::{EepromAccess, Line, Polling, Progress, Reset, Transaction};
use tformat::{Abm, Abs, Address, Almc, BitRate, Error, Frame, Page, Request, Response, Window};

use super::{byte, chosen};

/// A transaction under any blocks, framing errors and pauses: it ends once and for all, in time, and what it gives was on
/// the line as a whole, after the request.
///
/// ```text
/// 0..3  request      3  echo hint (bit 0), rate (bit 1)      4..  events: 0 poll, 1 framing error, 2 a byte follows, 3 four
///                                                            bytes follow; the high bits are the time since the event before
/// ```
pub fn master(mut data: &[u8]) {
    let request = chosen(&mut data);
    let options = byte(&mut data);
    let rate = if options & 2 == 0 { BitRate::Mbit2_5 } else { BitRate::Mbit5 };
    let line = if options & 1 == 0 { Line::new(rate) } else { Line::new(rate).with_echo() };
    let mut transaction = Transaction::start(request, line, 0);
    let bit_ns = u64::from(rate.bit_ns());
    // Each byte, and when it ended: what a block holds came one right after the other.
    let (mut now, mut received) = (0, Vec::new());
    while let (Progress::Pending { until_ns }, false) = (transaction.progress(), data.is_empty()) {
        let event = byte(&mut data);
        now += u64::from(event >> 2) * bit_ns;
        match event & 3 {
            0 => assert!(now <= until_ns || !matches!(transaction.poll(now), Progress::Pending { .. })),
            1 => _ = transaction.framing_error(now),
            count => {
                let block: Vec<u8> = (0..count * count - 3).map(|_| byte(&mut data)).collect();
                let ends = (0..).map(|behind| now.saturating_sub(behind * 10 * bit_ns));
                let timed: Vec<(u8, u64)> = block.iter().rev().copied().zip(ends).collect();
                received.extend(timed.into_iter().rev());
                _ = transaction.hear(&block, now);
            }
        }
    }
    let end = match transaction.progress() {
        Progress::Pending { until_ns } => transaction.poll(until_ns + 1),
        end => end,
    };
    assert_eq!(transaction.hear(&[0x1a], now), end);
    assert_eq!(transaction.poll(u64::MAX), end);
    match end {
        Progress::Done { value, ready_ns } => {
            let response = value.response.emit();
            let fields = response.as_bytes().len();
            // Four bits of turn-around and the first field have passed since the end of the request.
            let asked = u64::from(request.data_id().request_fields()) * 10;
            let earliest_ns = (asked + 4 + 10) * bit_ns;
            let stands =
                |at: &[(u8, u64)]| at[0].1 >= earliest_ns && at.iter().map(|(byte, _)| byte).eq(response.as_bytes());
            assert!(received.windows(fields).any(stands), "{response:02x?} in {received:02x?}");
            // And the response itself.
            assert!(ready_ns >= (asked + 4 + 10 * fields as u64) * bit_ns);
        }
        Progress::Failed { ready_ns, .. } => assert!(ready_ns >= 10_000 + 120 * bit_ns),
        Progress::Pending { .. } => panic!("the time-out did not end it"),
    }
}

/// A procedure of the master against an encoder on a line that loses and damages answers: it ends after a bounded number
/// of requests, and when it says that it is done, the encoder is as it should be.
///
/// ```text
/// 0  procedure      1  address      2  data      3  page      4  tries      5..  two bytes a fault, 0: none
/// ```
pub fn device(mut data: &[u8]) {
    let (procedure, address, value) = (byte(&mut data), byte(&mut data), byte(&mut data));
    let page = Page::truncate(byte(&mut data));
    let polling = Polling { interval_ns: 1_000_000, max_tries: u16::from(byte(&mut data)) };
    let address = Address::new(address & 0x7f).expect("seven bits");
    let mut line = Simulated::new(data);
    line.encoder.set_position(Abs::truncate(u32::from(value) << 9), Abm::truncate(7));
    line.encoder.raise_alarms(Almc::CE);
    line.encoder.end_alarms(Almc::CE);
    match procedure % 5 {
        0 => {
            let done = line.reset(Reset::clear_errors());
            assert!(!done || line.encoder.almc().bits() == 0);
        }
        1 => _ = line.reset(Reset::clear_turns_and_lose_multi_turn_reference()),
        2 => _ = line.reset(Reset::set_single_turn_zero_and_shift_commutation_angle()),
        3 => {
            let written = line.access(EepromAccess::write(page, address, value, polling), polling);
            if written.is_ok() && address != Address::PAGE_REGISTER {
                // The encoder has six pages: on another nothing is written.
                assert_eq!(line.encoder.page(), page.get());
                let cells = line.encoder.eeprom_mut()[usize::from(page.get())];
                assert_eq!(cells[usize::from(address.get())], value);
            }
        }
        _ => _ = line.access(EepromAccess::read(page, address, polling), polling),
    }
}

/// An encoder, and the faults of its answers.
struct Simulated<'a> {
    encoder: Device<6>,
    faults: &'a [u8],
    now_ns: u64,
    requests: u32,
}

impl<'a> Simulated<'a> {
    fn new(faults: &'a [u8]) -> Self {
        Self { encoder: Device::new(0x17, BitRate::Mbit2_5), faults, now_ns: 1_000_000, requests: 0 }
    }

    /// Whether the reset came to its end.
    fn reset(&mut self, mut reset: Reset) -> bool {
        let limit = u32::from(Reset::MAX_REFUSED) * u32::from(Reset::REQUESTS);
        self.run(&mut reset, limit).is_ok()
    }

    /// The byte that was read or written.
    fn access(&mut self, mut access: EepromAccess, polling: Polling) -> Result<u8, Error> {
        // Page, write and read-back with tries of their own, and for each try a write, the cell twice, and the page after each.
        self.run(&mut access, 18 * u32::from(polling.max_tries.max(1)) + 18)
    }

    /// A procedure that takes no more requests than `limit`.
    fn run<P: Procedure<Request = Request, Response = Response, Error = Error>>(
        &mut self,
        procedure: &mut P,
        limit: u32,
    ) -> Result<P::Value, Error> {
        let Ok(ended) = servowire_core::run(procedure, self.now_ns, |request, not_before_ns| {
            let outcome = self.transact(request, not_before_ns);
            assert!(self.requests <= limit);
            Ok::<_, Infallible>(Ended { outcome, ready_ns: self.now_ns })
        });
        ended.outcome
    }

    /// One request over the line, bit by bit, and its answer byte by byte.
    fn transact(&mut self, request: Request, not_before_ns: u64) -> Result<Response, Error> {
        assert!(not_before_ns >= self.now_ns);
        self.now_ns = not_before_ns + 100_000;
        self.requests += 1;
        self.encoder.set_fault(match (byte(&mut self.faults), byte(&mut self.faults)) {
            (0x40..=0x5f, _) => Fault::Silent,
            (0x60..=0x8f, at) => Fault::FlipBit { at: at % 128 },
            (0x90..=0xaf, fields) => Fault::CutAfter { fields: fields % 12 },
            (0xb0..=0xdf, _) => Fault::BadCrc,
            (0xe0..=0xff, _) => Fault::RejectAll,
            _ => Fault::None,
        });
        let mut transaction = Transaction::start(request, Line::new(BitRate::Mbit2_5), self.now_ns);
        let sent = transaction.transmission().frame.line();
        let mut reply = None;
        for level in (0..sent.len()).filter_map(|at| sent.get(at)) {
            self.now_ns += 400;
            reply = reply.or(self.encoder.hear_bit(level, self.now_ns));
        }
        if let Some(reply) = reply {
            assert!(reply.start_ns > self.now_ns);
            self.now_ns = reply.start_ns;
            self.receive(&mut transaction, reply.line);
        }
        let end = loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => {
                    self.now_ns = self.now_ns.max(until_ns + 1);
                    let _ = transaction.poll(self.now_ns);
                }
                Progress::Done { value, .. } => break Ok(value.response),
                Progress::Failed { error, .. } => break Err(error),
            }
        };
        assert!(end.is_err() || end.is_ok_and(|response| response.data_id() == request.data_id()));
        end
    }

    /// What a UART makes of the line bits of an answer.
    fn receive(&mut self, transaction: &mut Transaction, line: Window) {
        for field in 0..line.len() / Frame::FIELD_BITS {
            self.now_ns += 4_000;
            let at = field * Frame::FIELD_BITS;
            let [byte, ..] = (line.bits() >> (at + 1)).to_le_bytes();
            let _ = match (line.get(at), line.get(at + 9)) {
                (Some(false), Some(true)) => transaction.hear(&[byte], self.now_ns),
                _ => transaction.framing_error(self.now_ns),
            };
        }
    }
}

/// The tool's view of any line: it agrees with the decoder, and a cause explains a refusal and nothing else.
///
/// ```text
/// 0..3  request      3  length in bits (0..=127)      4..  line bits, LSB first
/// ```
pub fn inspect(mut data: &[u8]) {
    let request = chosen(&mut data);
    let len = u32::from(byte(&mut data) & 127);
    let mut bits = [0; 16];
    bits.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let line = Window::from_bits(u128::from_le_bytes(bits), len).expect("128 bits at most");
    let report = look(request, line);
    match Response::parse_line(request, line) {
        Ok(response) => {
            assert_eq!((report.error(), report.cause(), report.response()), (None, None, Some(response)));
            assert!(report.findings().is_empty());
        }
        Err(error) => {
            assert_eq!(report.error(), Some(error));
            assert!(report.findings().contains(error.class()));
        }
    }
    assert!(report.fields().len() <= usize::from(request.data_id().response_fields()));
    if let Some(Cause::Line(LineCause::LineInverted)) = report.cause() {
        assert_eq!(Response::parse_line(request, line.inverted()).ok(), report.response());
    }
    let _ = report.cause().map(|cause| cause.to_string());
    let _ = tformat::inspect::inspect_bytes(request, data);
}
