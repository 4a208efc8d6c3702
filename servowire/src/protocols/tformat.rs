//! Tamagawa T-Format: fields of a half-duplex line into requests and answers.
//!
//! Requests and answers look alike on the line: both begin with the control field. They are told apart by their
//! place. After a request comes its answer; any other frame is a request if it has the length of one, and else an
//! answer whose request was not recorded.

mod describe;

use std::io;

use tformat::inspect::{Cause, inspect, inspect_bytes};
use tformat::{BitRate, ControlField, DataId, Error, Full, Request, Response, Window};

use crate::capture::hexlog::Burst;
use crate::event::{Event, Place, Verdict};
use crate::line::{LineField, StartStop};
use crate::output::Sink;
use describe::Encoder;

pub use describe::FIELDS;

/// What the frames do not tell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Settings {
    /// Bits of a turn; otherwise by the encoder ID.
    pub single_turn_bits: Option<u8>,
    /// Bits that count turns; otherwise by the encoder ID.
    pub multi_turn_bits: Option<u8>,
}

/// A pause inside a frame that ends it, in bits: one and a half fields.
const FIELD_TIMEOUT_BITS: i64 = 15;

/// The shortest pause for the change of direction, in bits. Fields of one frame follow closer.
const TURN_ROUND_BITS: i64 = 4;

/// An answer begins within this time, nominally 3 us, in picoseconds.
const ANSWER_TIMEOUT: i64 = 20_000_000;

/// Twice the nominal time: what begins later and looks like a request is one, in picoseconds.
const LATE_ANSWER: i64 = 6_000_000;

/// The longest answer, with some pauses in it, in bits.
const LONGEST_BITS: i64 = 150;

/// More fields without a pause are no frame.
const MOST_FIELDS: usize = 16;

/// Finds the frames among the fields of a line.
pub struct Decoder {
    bit: i64,
    encoder: Encoder,
    /// Begin of the capture, until the first frame has been seen.
    begin: Option<i64>,
    /// Until when the rest of a frame is passed over in which the capture began.
    skip: Option<i64>,
    /// The end of what was passed over.
    skipped: i64,
    open: Frame,
    pending: Option<Pending>,
}

/// Fields that followed each other.
#[derive(Debug, Clone, Copy, Default)]
struct Frame {
    bytes: [u8; MOST_FIELDS],
    starts: [i64; MOST_FIELDS],
    fields: usize,
    end: i64,
    /// The first field whose delimiter read 0.
    broken: Option<u8>,
    spikes: u32,
    /// The line of a log without times.
    line: Option<u64>,
}

impl Frame {
    fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.fields).unwrap_or_default()
    }

    fn start(&self) -> i64 {
        self.starts.first().copied().unwrap_or_default()
    }

    fn push(&mut self, field: &LineField) {
        let k = self.fields.min(MOST_FIELDS - 1);
        if let (Some(byte), Some(start)) = (self.bytes.get_mut(k), self.starts.get_mut(k)) {
            *byte = (field.content & 0xff) as u8;
            *start = field.start;
        }
        if !field.delimiter && self.broken.is_none() {
            self.broken = u8::try_from(k).ok();
        }
        self.spikes = self.spikes.saturating_add(field.spikes);
        self.end = field.end;
        self.fields = k + 1;
    }

    /// The data ID that the first field asks for or answers.
    fn data_id(&self) -> Result<DataId, Error> {
        ControlField::parse(self.first())?.data_id()
    }

    /// The first field, 0 where there is none.
    fn first(&self) -> u8 {
        self.bytes.first().copied().unwrap_or_default()
    }

    /// The bits of the line from the first start bit on, as far as the fields tell: idle line between them.
    fn line(&self, bit: i64) -> Option<Window> {
        let mut bits = u128::MAX;
        for (byte, start) in self.bytes().iter().zip(&self.starts) {
            let at = (start - self.start() + bit / 2) / bit.max(1);
            let ten = 1 << 9 | u128::from(*byte) << 1;
            let clear = u32::try_from(at).ok().and_then(|at| 0x3ff_u128.checked_shl(at));
            if let (Some(clear), Ok(at)) = (clear, u32::try_from(at)) {
                bits = bits & !clear | ten << at;
            }
        }
        if let Some(at) = self.broken.and_then(|field| self.starts.get(usize::from(field))) {
            let at = (at - self.start() + bit / 2) / bit.max(1) + 9;
            bits &= !u32::try_from(at).ok().and_then(|at| 1_u128.checked_shl(at)).unwrap_or(0);
        }
        let len = ((self.end - self.start()) / bit.max(1)).clamp(0, 128);
        Window::from_bits(bits, u32::try_from(len).ok()?)
    }

    fn place(&self) -> Place {
        match self.line {
            Some(line) => Place::Line(line),
            None => Place::Time { start: self.start(), end: self.end },
        }
    }
}

/// A request that waits for its answer.
#[derive(Debug, Clone, Copy)]
struct Pending {
    /// None where the request was damaged.
    request: Option<Request>,
    place: Place,
}

impl Pending {
    /// When it ended; none in a log without times.
    fn end(&self) -> Option<i64> {
        match self.place {
            Place::Time { end, .. } => Some(end),
            Place::Line(_) => None,
        }
    }

    /// Whether a frame is not the answer but the next request: it is one, and later than an answer begins.
    fn is_asked_again(&self, frame: &Frame) -> bool {
        let late = self.end().is_some_and(|end| frame.start() - end > LATE_ANSWER);
        late && frame.broken.is_none()
            && frame.fields < self.answer_fields(frame.first())
            && frame.data_id().is_ok_and(|id| frame.fields == usize::from(id.request_fields()))
    }

    /// Fields of the answer that begins with `cf`: as that says, or where it is damaged, as was asked.
    fn answer_fields(&self, cf: u8) -> usize {
        let said = ControlField::parse(cf).and_then(ControlField::data_id).ok();
        let id = said.or(self.request.map(Request::data_id)).unwrap_or(DataId::Id3);
        usize::from(id.response_fields())
    }
}

impl Decoder {
    /// `bit`: its length in picoseconds.
    pub fn new(bit: i64, settings: Settings) -> Self {
        Self {
            bit,
            encoder: Encoder::new(settings),
            begin: None,
            skip: None,
            skipped: 0,
            open: Frame::default(),
            pending: None,
        }
    }

    /// Whether the open frame is over before a field that begins at `start`.
    fn is_over(&self, start: i64) -> bool {
        let pause = start - self.open.end;
        if pause > FIELD_TIMEOUT_BITS * self.bit {
            return true;
        }
        if pause < TURN_ROUND_BITS * self.bit {
            return false;
        }
        match self.pending {
            // A request is over when its answer may follow.
            None => {
                let request_fields = |id: DataId| usize::from(id.request_fields());
                self.open.broken.is_some() || self.open.fields >= self.open.data_id().map_or(1, request_fields)
            }
            // Behind a low delimiter the receiver may have skipped fields: the answer lasts as long as a whole one.
            Some(pending) => {
                let whole = 10 * pending.answer_fields(self.open.first()) as i64 - FIELD_TIMEOUT_BITS;
                self.open.broken.is_some() && start - self.open.start() > whole * self.bit
            }
        }
    }

    /// The open frame is over.
    fn close(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let frame = std::mem::take(&mut self.open);
        let begin = self.begin.take();
        if self.pending.is_some_and(|pending| pending.is_asked_again(&frame)) {
            self.give_up(frame.start(), out)?;
        }
        if let Some(pending) = self.pending.take() {
            let event = self.answer(&frame, pending);
            return out.event(&event);
        }
        let event = self.unasked(&frame);
        // With no idle line before it, a bad first frame is only the end of one.
        let at_once = begin.is_some_and(|begin| frame.start() - begin < FIELD_TIMEOUT_BITS * self.bit);
        if at_once && !event.verdict.is_ok() {
            self.pending = None;
            self.skipped = frame.end;
            self.skip = begin.map(|begin| begin + LONGEST_BITS * self.bit);
            return out.event(&describe::cut(frame.place(), "the capture begins inside a frame"));
        }
        out.event(&event)
    }

    /// A frame that follows a request.
    fn answer(&mut self, frame: &Frame, pending: Pending) -> Event {
        let result = match (frame.broken, pending.request) {
            (Some(field), _) => Err(Error::Delimiter { field }),
            (None, Some(request)) => Response::parse(request, frame.bytes()),
            // The encoder refuses a damaged request with an ID 3 frame.
            (None, None) => Full::parse(frame.bytes()).and_then(|full| Err(Error::Rejected { sf: full.sf })),
        };
        let delay = pending.end().map(|end| frame.start() - end);
        let asked = pending.request.map(Request::data_id);
        let mut event = self.encoder.answer(frame, asked, result, delay);
        if let (Verdict::Refused(refusal), Some(request)) = (&mut event.verdict, pending.request) {
            refusal.cause = self.cause(request, frame).map(|cause| cause.to_string());
        }
        event
    }

    /// What probably spoilt the answer to a request.
    fn cause(&self, request: Request, frame: &Frame) -> Option<Cause> {
        let report = match frame.broken {
            None => inspect_bytes(request, frame.bytes()),
            Some(_) => inspect(request, frame.line(self.bit)?),
        };
        // That is what its verdict says already.
        report.cause.filter(|cause| *cause != Cause::RequestRefused)
    }

    /// A frame without a request before it: a request, or an answer alone.
    fn unasked(&mut self, frame: &Frame) -> Event {
        let asked = frame.data_id().ok();
        let longer = |id: DataId| frame.fields > usize::from(id.request_fields());
        // More fields than any request has are an answer whatever they hold.
        if asked.map_or(frame.fields > 4, longer) {
            let result = match (frame.broken, alone(frame)) {
                (Some(field), _) => Err(Error::Delimiter { field }),
                (None, Ok(request)) => Response::parse(request, frame.bytes()),
                (None, Err(error)) => Err(error),
            };
            return self.encoder.answer(frame, asked, result, None);
        }
        let result = match frame.broken {
            Some(field) => Err(Error::Delimiter { field }),
            None => Request::parse(frame.bytes()),
        };
        self.pending = Some(Pending { request: result.ok(), place: frame.place() });
        describe::request(frame, asked, result)
    }

    /// The answer did not come until `now`.
    fn give_up(&mut self, now: i64, out: &mut dyn Sink) -> io::Result<()> {
        match self.pending.take() {
            // Nobody owes an answer to a damaged request.
            Some(Pending { request: Some(request), place }) => out.event(&describe::silence(request, place, now)),
            _ => Ok(()),
        }
    }

    /// Takes the first `fields` of a burst as a frame.
    fn take(&mut self, burst: &Burst, from: usize, fields: usize, out: &mut dyn Sink) -> io::Result<()> {
        let mut frame = Frame { line: Some(burst.line), ..Frame::default() };
        for &byte in burst.bytes.iter().skip(from).take(fields) {
            frame.push(&LineField { content: byte.into(), delimiter: true, start: 0, end: 0, spikes: 0 });
        }
        let event = match self.pending.take() {
            Some(pending) => self.answer(&frame, pending),
            None => self.unasked(&frame),
        };
        out.event(&event)
    }
}

impl StartStop for Decoder {
    const NAME: &'static str = "T-Format";
    const RATES: &'static [u32] = &[BitRate::Mbit2_5.bits_per_second(), BitRate::Mbit5.bits_per_second()];
    const CONTENT_BITS: u32 = 8;

    fn begin(&mut self, start: i64) {
        self.begin = Some(start);
    }

    fn field(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()> {
        if self.open.fields > 0 && self.is_over(field.start) {
            self.close(out)?;
        }
        if let Some(until) = self.skip {
            let pause = field.start - self.skipped;
            self.skipped = field.end;
            if field.start < until && pause <= FIELD_TIMEOUT_BITS * self.bit {
                return Ok(());
            }
            self.skip = None;
        }
        if self.open.fields == 0 {
            let due = self.pending.and_then(|pending| pending.end()).map(|end| end.saturating_add(ANSWER_TIMEOUT));
            if due.is_some_and(|due| field.start > due) {
                self.give_up(field.start, out)?;
            }
        }
        self.open.push(field);
        let whole = self.pending.is_some_and(|pending| {
            self.open.broken.is_none() && self.open.fields == pending.answer_fields(self.open.first())
        });
        if whole || self.open.fields == MOST_FIELDS { self.close(out) } else { Ok(()) }
    }

    /// A line of a log: a request, its answer, or both.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        let bytes = burst.bytes.len();
        let cf = burst.bytes.first().copied().unwrap_or_default();
        let id = ControlField::parse(cf).and_then(ControlField::data_id);
        let request = id.map_or(bytes.min(1), |id| usize::from(id.request_fields()));
        if let Some(pending) = self.pending {
            if bytes == request && bytes < pending.answer_fields(cf) {
                self.give_up(0, out)?;
            } else {
                // A receiver that is always on hears the own request first.
                let echo = pending.request.map(Request::emit);
                let heard = echo.and_then(|echo| burst.bytes.strip_prefix(echo.as_bytes()));
                let answer =
                    heard.filter(|rest| rest.first().is_some_and(|cf| rest.len() == pending.answer_fields(*cf)));
                let from = answer.map_or(0, |answer| bytes - answer.len());
                return self.take(burst, from, bytes - from, out);
            }
        }
        if id.is_ok_and(|id| bytes == usize::from(id.response_fields()) && bytes > request) {
            return self.take(burst, 0, bytes, out);
        }
        self.take(burst, 0, request.min(bytes), out)?;
        if bytes > request {
            self.take(burst, request, bytes - request, out)?;
        }
        Ok(())
    }

    fn finish(&mut self, end: Option<i64>, out: &mut dyn Sink) -> io::Result<()> {
        let Some(end) = end else { return self.give_up(0, out) };
        if self.open.fields > 0 {
            let recent = end - self.open.end <= FIELD_TIMEOUT_BITS * self.bit;
            let request = self.pending.is_none()
                && self.open.data_id().is_ok_and(|id| self.open.fields == usize::from(id.request_fields()));
            if recent && !request {
                return out.event(&describe::cut(self.open.place(), "the capture ends inside a frame"));
            }
            self.close(out)?;
        }
        match self.pending.and_then(|pending| pending.end()) {
            Some(asked) if end > asked.saturating_add(ANSWER_TIMEOUT) => self.give_up(end, out),
            _ => Ok(()),
        }
    }
}

/// The request that a frame would answer, from the frame itself.
fn alone(frame: &Frame) -> Result<Request, Error> {
    let field = |k: usize| frame.bytes().get(k).copied().unwrap_or_default();
    let address = tformat::Adf::new(field(1) & 0x7f);
    Ok(match frame.data_id()? {
        DataId::Id0 => Request::Id0,
        DataId::Id1 => Request::Id1,
        DataId::Id2 => Request::Id2,
        DataId::Id3 => Request::Id3,
        DataId::Id6 => Request::Id6 { adf: address, edf: field(2) },
        DataId::Id7 => Request::Id7,
        DataId::Id8 => Request::Id8,
        DataId::IdC => Request::IdC,
        DataId::IdD => Request::IdD { adf: address },
    })
}
