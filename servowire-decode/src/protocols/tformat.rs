//! Tamagawa T-Format: combines fields of a half-duplex line into requests and answers.
//!
//! Requests and answers look alike on the line: both begin with the control field. They are told apart by their
//! place. A request is followed by its answer; any other frame is a request if it has the length of one, otherwise an
//! answer whose request was not recorded.

mod describe;
mod frame;

use std::io;

use tformat::inspect::{Cause, LineCause, inspect, inspect_bytes};
use tformat::{AllData, BitRate, ControlField, DataId, Error, Request, Response};

use crate::bundled;
use crate::capture::hexlog::Burst;
use crate::codec::{Codec, Facts, LogDecoder};
use crate::event::{Direction, Event, Verdict};
use crate::line::evidence::Weights;
use crate::line::exchanges::StartStopLine;
use crate::line::lane::LineDecoder;
use crate::line::start_stop::{LineField, StartStop};
use crate::protocols::plausible::CUT;
use crate::settings::{Settings, Widths};
use crate::sink::Sink;
use crate::time::Time;
use describe::Encoder;
use frame::{ANSWER_TIMEOUT, Frame, LATE_ANSWER, MOST_FIELDS, Pending};

/// The table row of T-Format.
pub(super) struct Tformat;

impl Codec for Tformat {
    fn facts(&self) -> &'static Facts {
        const {
            &Facts {
                name: "tformat",
                title: "T-Format",
                about: "Tamagawa T-Format",
                needs: "T-Format is decoded from edges or samples of the line, or from a log of bytes",
                fields: describe::FIELDS,
                rates: &[BitRate::Mbit2_5.bits_per_second(), BitRate::Mbit5.bits_per_second()],
                // 9 of 256 control fields are valid; an answer adds its echo and its check field.
                weights: Weights { request: 4, answer: 24, alone: 16 },
                captures: &bundled::TFORMAT,
                ..Facts::NONE
            }
        }
    }

    fn line(&self, rate: u32, settings: &Settings) -> Option<Box<dyn LineDecoder>> {
        let bit = 1e12 / f64::from(rate.max(1));
        Some(Box::new(StartStopLine::new(bit, Decoder::new(bit as i64, settings.widths), self.facts().weights)))
    }

    fn log(&self, settings: &Settings, _: &[Burst]) -> Option<Box<dyn LogDecoder>> {
        Some(Box::new(Decoder::new(0, settings.widths)))
    }
}

/// Shortest pause that ends a frame, in bits: one and a half fields.
const FIELD_TIMEOUT_BITS: i64 = 15;

/// The ones in the field that a dip of the idle line looks like: the dip may be two bits long, and the answer may begin
/// after these ones.
const IDLE: u16 = 0x1e;

/// The shortest pause for the change of direction, in bits. The fields of one frame follow each other more closely.
const TURN_ROUND_BITS: i64 = 4;

/// The longest answer, including some pauses, in bits.
const LONGEST_BITS: i64 = 150;

/// Finds the frames among the fields of a line.
#[derive(Debug, Clone)]
pub struct Decoder {
    bit: i64,
    encoder: Encoder,
    /// Start of the capture, until the first frame has been seen.
    begin: Option<Time>,
    /// Time until which the rest of a frame is skipped, if the capture began inside one.
    skip: Option<Time>,
    /// Time until which another piece of that frame may come.
    cut_until: Option<Time>,
    /// The end of the skipped part.
    skipped: Time,
    open: Frame,
    pending: Option<Pending>,
    /// Time until which a frame may answer a request from before the capture, as long as no frame was sound.
    early: Option<Time>,
    /// A frame that may be a request or an answer to one from before the capture: the next frame decides.
    unclear: Option<Frame>,
}

impl Decoder {
    /// `bit`: its length in picoseconds.
    pub fn new(bit: i64, widths: Widths) -> Self {
        Self {
            bit,
            encoder: Encoder::new(widths),
            begin: None,
            skip: None,
            cut_until: None,
            skipped: Time::ZERO,
            open: Frame::default(),
            pending: None,
            early: None,
            unclear: None,
        }
    }

    /// Returns whether the open frame ends before a field that begins at `start`.
    fn is_over(&self, start: Time) -> bool {
        let pause = start - self.open.end;
        if pause > FIELD_TIMEOUT_BITS * self.bit {
            return true;
        }
        if pause < TURN_ROUND_BITS * self.bit {
            return false;
        }
        match self.pending {
            // A request ends when its answer may follow.
            None => {
                let request_fields = |id: DataId| usize::from(id.request_fields());
                self.open.broken.is_some() || self.open.len() >= self.open.data_id().map_or(1, request_fields)
            }
            // After a low delimiter the receiver may have skipped fields: the answer is given the length of a whole one.
            Some(pending) => {
                let whole = 10 * pending.answer_fields(self.open.first()) as i64;
                pending.is_asked_again(&self.open)
                    || self.open.broken.is_some() && start - self.open.start() > whole * self.bit
            }
        }
    }

    /// Returns whether the open frame is a sound request of several fields: something after it that looks like a field of
    /// idle line is then not part of it.
    fn is_long_request(&self) -> bool {
        self.pending.is_none()
            && self.open.len() > 1
            && self.open.broken.is_none()
            && Request::parse(self.open.contents())
                .is_ok_and(|request| self.open.len() == usize::from(request.data_id().request_fields()))
    }

    /// Returns whether the open frame is a complete answer and too long for a request.
    fn is_answer_alone(&self) -> bool {
        if self.pending.is_some() || self.open.broken.is_some() {
            return false;
        }
        let Ok(id) = self.open.data_id() else { return false };
        let (request, answer) = (usize::from(id.request_fields()), usize::from(id.response_fields()));
        self.open.len() == answer && answer > request
    }

    /// Ends the open frame.
    fn close(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let frame = self.open.take();
        let begin = self.begin.take();
        if self.pending.is_some_and(|pending| pending.is_asked_again(&frame)) {
            self.give_up(frame.start(), true, out)?;
        }
        if let Some(pending) = self.pending.take() {
            self.clear(out)?;
            let event = self.answer(&frame, pending);
            return out.event(&event);
        }
        let event = self.unasked(&frame);
        let early = self.early.take_if(|_| event.verdict.is_ok()).is_some_and(|until| frame.start() < until);
        if early && frame.data_id().is_ok_and(|id| id.request_fields() == id.response_fields()) {
            self.unclear = Some(frame);
            return Ok(());
        }
        // Without idle line before it, a bad first frame is only the end of a frame.
        let at_once = begin.is_some_and(|begin| frame.start() - begin < FIELD_TIMEOUT_BITS * self.bit);
        let still = self.cut_until.take().filter(|until| frame.start() < *until);
        if (at_once || still.is_some()) && !event.verdict.is_ok() {
            self.pending = None;
            self.skipped = frame.end;
            self.early = Some(frame.end + LATE_ANSWER);
            self.skip = begin.map(|begin| begin + LONGEST_BITS * self.bit).or(still);
            self.cut_until = self.skip;
            return out.event(&Event::cut(frame.place()));
        }
        out.event(&event)
    }

    /// Decodes a frame that follows a request.
    fn answer(&mut self, frame: &Frame, pending: Pending) -> Event {
        let result = match (frame.broken, pending.request) {
            (Some(field), _) => Err(Error::Delimiter { field }),
            (None, Some(request)) => Response::parse(request, frame.contents()),
            // The encoder refuses a damaged request with an ID 3 frame.
            (None, None) => AllData::parse(frame.contents()).and_then(|full| Err(Error::Rejected { sf: full.sf })),
        };
        let delay = pending.place.end().map(|end| frame.start() - end);
        let asked = pending.request.map(Request::data_id);
        let mut event = self.encoder.answer(frame, asked, result, delay);
        if let (Verdict::Refused(refusal), Some(request)) = (&mut event.verdict, pending.request) {
            refusal.cause = self.cause(request, frame);
        }
        event
    }

    /// Returns what probably spoilt the answer to a request.
    fn cause(&self, request: Request, frame: &Frame) -> Option<String> {
        let report = match frame.broken {
            None => inspect_bytes(request, frame.contents()),
            Some(_) => inspect(request, frame.line(self.bit)?),
        };
        // Its verdict already says that.
        let cause = report.cause().filter(|cause| *cause != Cause::RequestRefused);
        if cause.is_some_and(|cause| cause != Cause::Line(LineCause::Disturbed)) {
            return cause.map(|cause| cause.to_string());
        }
        let due = usize::from(request.data_id().response_fields());
        // If all delimiters are in place and one bit is wrong, none has slipped.
        let wrong = frame.contents().iter().fold(0, |crc, byte| crc ^ byte).count_ones();
        let flipped = frame.broken.is_none() && frame.len() == due && wrong == 1;
        if frame.broken.is_some() && frame.is_one_bit_off(request) {
            return Some(LineCause::Disturbed.to_string());
        }
        if !flipped && frame.broken.is_none() && frame.len() == due && frame.ends_idle(request) {
            return Some(CUT.to_owned());
        }
        if let Some(slipped) = if flipped { None } else { frame.slipped_bit(request) } {
            return Some(slipped.to_owned());
        }
        if frame.broken.is_none() && frame.len() < due {
            return Some(CUT.to_owned());
        }
        cause.map(|cause| cause.to_string())
    }

    /// Decodes a frame without a request before it: a request, or an answer alone.
    fn unasked(&mut self, frame: &Frame) -> Event {
        let asked = frame.data_id().ok();
        let longer = |id: DataId| frame.len() > usize::from(id.request_fields());
        // A frame with more fields than any request is an answer, whatever it holds.
        if asked.map_or(frame.len() > 4, longer) {
            let result = match (frame.broken, Request::answered_by(frame.contents())) {
                (Some(field), _) => Err(Error::Delimiter { field }),
                (None, Ok(request)) => Response::parse(request, frame.contents()),
                (None, Err(error)) => Err(error),
            };
            return self.encoder.answer(frame, asked, result, None);
        }
        let result = match frame.broken {
            Some(field) => Err(Error::Delimiter { field }),
            None => Request::parse(frame.contents()),
        };
        self.pending = Some(Pending { request: result.ok(), place: frame.place() });
        describe::request(frame, asked, result)
    }

    /// Takes the unclear frame as a request.
    fn clear(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        match self.unclear.take() {
            Some(frame) => {
                out.event(&describe::request(&frame, frame.data_id().ok(), Request::parse(frame.contents())))
            }
            None => Ok(()),
        }
    }

    /// Ends the wait for an answer at `now`; `asked`: whether that is because the next request came.
    fn give_up(&mut self, now: Time, asked: bool, out: &mut dyn Sink) -> io::Result<()> {
        match (self.unclear.take(), self.pending.take()) {
            // There is no answer to an answer.
            (Some(frame), Some(Pending { request: Some(request), .. })) => {
                let event = self.encoder.answer(
                    &frame,
                    Some(request.data_id()),
                    Response::parse(request, frame.contents()),
                    None,
                );
                out.event(&event)
            }
            // A damaged request need not be answered.
            (_, Some(Pending { request: Some(request), place })) => {
                out.event(&describe::silence(request, place, now, asked))
            }
            _ => Ok(()),
        }
    }

    /// Returns whether a field is one in the middle of a sound answer, as most are.
    #[inline]
    fn is_inside(&self, field: &LineField) -> bool {
        let Some(pending) = &self.pending else { return false };
        !self.open.is_empty()
            && self.open.broken.is_none()
            && self.skip.is_none()
            && self.open.len() + 1 < pending.answer_fields(self.open.first())
            && field.start - self.open.end < TURN_ROUND_BITS * self.bit
            && field.delimiter
    }

    /// Takes the next field of the line, whatever it is.
    #[inline(never)]
    fn next(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()> {
        if !self.open.is_empty()
            && (self.is_over(field.start) || field.content & IDLE == IDLE && self.is_long_request())
        {
            self.close(out)?;
        }
        if let Some(until) = self.skip {
            let pause = field.start - self.skipped;
            self.skipped = field.end;
            if field.start < until && pause <= TURN_ROUND_BITS * self.bit {
                return Ok(());
            }
            self.skip = None;
        }
        if self.open.is_empty() {
            let due = self.pending.and_then(|pending| pending.place.end()).map(|end| end + ANSWER_TIMEOUT);
            if due.is_some_and(|due| field.start > due) {
                self.give_up(field.start, true, out)?;
            }
        }
        self.open.push((field.content & 0xff) as u8, field, self.bit);
        let whole = self.pending.is_some_and(|pending| {
            self.open.broken.is_none() && self.open.len() == pending.answer_fields(self.open.first())
        });
        if whole || self.is_answer_alone() || self.open.len() == MOST_FIELDS { self.close(out) } else { Ok(()) }
    }

    /// Takes a frame of a log.
    fn take(&mut self, line: u64, bytes: &[u8], out: &mut dyn Sink) -> io::Result<()> {
        let frame = Frame::of_log(line, bytes);
        let event = match self.pending.take() {
            Some(pending) => self.answer(&frame, pending),
            None => self.unasked(&frame),
        };
        out.event(&event)
    }
}

impl StartStop for Decoder {
    const CONTENT_BITS: u32 = 8;
    // The sink code 010 is the first in every control field.
    const FIRST_LOW: [u32; 2] = [2, 2];

    fn rest(&mut self, now: Time, out: &mut dyn Sink) -> io::Result<()> {
        let over = !self.open.is_empty() && now - self.open.end > FIELD_TIMEOUT_BITS * self.bit;
        if over { self.close(out) } else { Ok(()) }
    }

    fn is_between(&self) -> bool {
        self.open.is_empty()
    }

    fn begin(&mut self, start: Time) {
        (self.skip, self.cut_until) = (None, None);
        self.begin = Some(start);
        self.early = Some(start + LATE_ANSWER);
    }

    fn field(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()> {
        if self.is_inside(field) {
            self.open.push((field.content & 0xff) as u8, field, self.bit);
            return Ok(());
        }
        self.next(field, out)
    }

    fn finish(&mut self, end: Time, out: &mut dyn Sink) -> io::Result<()> {
        if !self.open.is_empty() {
            let recent = end - self.open.end <= FIELD_TIMEOUT_BITS * self.bit;
            let request = self.pending.is_none()
                && self.open.data_id().is_ok_and(|id| self.open.len() == usize::from(id.request_fields()));
            if recent && !request {
                let piece = self.open.take();
                self.pending = None;
                self.clear(out)?;
                return out.event(&Event::cut_off(piece.place()));
            }
            self.close(out)?;
        }
        match self.pending.and_then(|pending| pending.place.end()) {
            Some(asked) if end > asked + ANSWER_TIMEOUT => self.give_up(end, false, out),
            // Its answer may have come later.
            _ => {
                self.pending = None;
                self.clear(out)
            }
        }
    }
}

impl LogDecoder for Decoder {
    /// Takes a line of a log: requests and answers, one after the other.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        let mut rest = burst.bytes.as_slice();
        let id = |bytes: &[u8]| ControlField::parse(bytes.first().copied().unwrap_or_default())?.data_id();
        // The line is only a request, or only an answer.
        let is_request = id(rest).is_ok_and(|id| rest.len() == usize::from(id.request_fields()));
        let is_answer = id(rest).is_ok_and(|id| rest.len() == usize::from(id.response_fields())) && !is_request;
        let asks = burst.direction == Some(Direction::Request);
        if asks || self.pending.is_some_and(|pending| is_request && rest.len() < pending.answer_fields_of(rest)) {
            self.give_up(Time::ZERO, true, out)?;
        }
        if is_answer && self.pending.is_none() {
            return self.take(burst.line, rest, out);
        }
        while !rest.is_empty() {
            let fields = match self.pending {
                Some(pending) => {
                    rest = pending.without_echo(rest);
                    pending.answer_fields_of(rest)
                }
                None => id(rest).map_or(1, |id| usize::from(id.request_fields())),
            };
            let (frame, after) = rest.split_at_checked(fields).unwrap_or((rest, &[]));
            self.take(burst.line, frame, out)?;
            rest = after;
        }
        Ok(())
    }

    fn spoilt(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        self.pending = None;
        self.clear(out)
    }

    fn end(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        self.give_up(Time::ZERO, false, out)
    }
}
