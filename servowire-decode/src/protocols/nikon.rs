//! Nikon A-format: combines frames of a half-duplex line into requests and replies.
//!
//! Requests and replies begin with different sync codes. A command data frame says how many memory data frames follow;
//! the frames of a reply follow each other without a pause, and their number determines the layout if the command leaves it
//! open. A multi-response request is followed by the replies of several encoders.

mod describe;
mod frames;

use std::io;

use nikon_aformat::inspect::{Cause, Kind, LineCause, inspect};
use nikon_aformat::{
    BitOrder, BitRate, Command, Echo, Error, Expected, FRAME_BITS, Layout, RawResponse, Request, Resolution, Response,
    Window,
};

use crate::bundled;
use crate::capture::hexlog::Burst;
use crate::codec::{Codec, Facts, LogDecoder};
use crate::event::{Event, Place, Verdict};
use crate::line::evidence::Weights;
use crate::line::exchanges::StartStopLine;
use crate::line::lane::LineDecoder;
use crate::line::start_stop::{LineField, StartStop};
use crate::protocols::plausible::{CUT, CUT_BITS, LOST, SURELY_CUT_BITS, slipped_bit};
use crate::settings::{Settings, Widths};
use crate::sink::Sink;
use crate::time::Time;
use describe::Encoder;
use frames::Frames;

/// The table row of A-format.
pub(super) struct Nikon;

impl Codec for Nikon {
    fn facts(&self) -> &'static Facts {
        const {
            &Facts {
                name: "nikon",
                title: "A-format",
                about: "Nikon A-format",
                needs: "A-format is decoded from edges or samples of the line, or from a log of words",
                fields: describe::FIELDS,
                rates: &[
                    BitRate::Mbit2_5.bits_per_second(),
                    BitRate::Mbit4.bits_per_second(),
                    BitRate::Mbit6_67.bits_per_second(),
                    BitRate::Mbit8.bits_per_second(),
                    BitRate::Mbit16.bits_per_second(),
                ],
                // Sync and frame code, CRC-3; sync code, fixed bit, echo and CRC-8.
                weights: Weights { request: 6, answer: 22, alone: 14 },
                captures: &bundled::NIKON,
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

/// A pause that ends a reply, in bits. Replies of two encoders are 7 bits apart or more.
const PAUSE_BITS: i64 = 4;

/// The longest reply, in bits.
const LONGEST_BITS: i64 = 6 * FRAME_BITS as i64;

/// A pause that ends a request whose memory data frames do not follow, in picoseconds: masters leave 1 to 10 us.
const MEMORY_PAUSE: i64 = 50_000_000;

/// The content, except the first bit, of a frame that is really a dip of the idle line.
const IDLE: u16 = 0xffff;

/// A reply begins within this time, in bits. The turn-around time is not documented.
const REPLY_TIMEOUT_BITS: i64 = 1_000;

/// A request that is waiting for its reply.
#[derive(Debug, Clone, Copy)]
struct Pending {
    request: Request,
    place: Place,
    /// Replies so far.
    replies: u32,
}

/// Finds requests and replies among the frames of a line.
#[derive(Debug, Clone)]
pub struct Decoder {
    bit: i64,
    encoder: Encoder,
    /// Start of the capture, until the first group has been seen.
    begin: Option<Time>,
    /// Time until which the rest of a reply may come, if the capture began inside one.
    cut_until: Option<Time>,
    open: Frames,
    pending: Option<Pending>,
}

impl Decoder {
    /// `bit`: its length in picoseconds.
    pub fn new(bit: i64, widths: Widths) -> Self {
        Self {
            bit,
            encoder: Encoder::new(widths),
            begin: None,
            cut_until: None,
            open: Frames::default(),
            pending: None,
        }
    }

    /// Returns whether the open group ends before a frame at `start`, which may be the first of the kind that it `begins`.
    fn is_over(&self, start: Time, begins: Kind) -> bool {
        let pause = start - self.open.end;
        // The frames of a reply follow each other; after anything else a new group begins.
        if begins == Kind::Response && self.open.kind() != Kind::Response && 2 * pause > 3 * self.bit {
            return true;
        }
        match self.open.kind() {
            Kind::Request => pause > MEMORY_PAUSE,
            _ if pause <= PAUSE_BITS * self.bit => false,
            // The frames of a damaged reply need not follow each other: it is given the length of a whole one.
            _ => {
                let asked = self.pending.map(|pending| pending.request);
                let whole = asked
                    .filter(|request| !request.command().is_multi_response())
                    .map_or(0, |request| i64::from(request.expected(Resolution::default()).layout().line_bits()));
                start - self.open.start() >= whole * self.bit
            }
        }
    }

    /// Returns whether the open group is a sound reply: something after it that looks like a frame of idle line is then not
    /// part of it.
    #[cold]
    fn is_whole(&self) -> bool {
        let sound = |expected: Expected| {
            let reply = RawResponse::from_words(expected.layout(), self.open.contents(), BitOrder::LsbFirst);
            reply.and_then(|reply| Response::parse(&expected, &reply)).is_ok()
        };
        let asked = self.pending.map(|pending| pending.request);
        self.open.kind() == Kind::Response && self.open.broken.is_none() && expected(&self.open, asked).is_ok_and(sound)
    }

    /// Ends the open group.
    fn close(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let group = self.open.take();
        let begin = self.begin.take();
        let event = match group.kind() {
            Kind::Request => self.request(&group, out)?,
            _ => self.reply(&group),
        };
        // Without idle line before it, a bad first group is only the end of a group.
        let after = begin.map(|begin| group.start() - begin);
        let at_once = after.is_some_and(|after| after < i64::from(FRAME_BITS) * self.bit);
        // Neither is a memory data frame whose command data frame came before the capture.
        let no_command = matches!(&event.verdict, Verdict::Refused(refusal) if refusal.class == "frame_code");
        let at_once = at_once || no_command && after.is_some_and(|after| after < MEMORY_PAUSE);
        let still = self.cut_until.take().is_some_and(|until| group.start() < until);
        if (at_once || still) && !event.verdict.is_ok() {
            self.cut_until = Some(group.start() + LONGEST_BITS * self.bit);
            return out.event(&Event::cut(group.place()));
        }
        out.event(&event)
    }

    fn request(&mut self, group: &Frames, out: &mut dyn Sink) -> io::Result<Event> {
        self.give_up(group.start(), true, out)?;
        let result = group.request();
        self.pending = result.ok().map(|request| Pending { request, place: group.place(), replies: 0 });
        Ok(describe::request(group, result))
    }

    fn reply(&mut self, group: &Frames) -> Event {
        let pending = self.pending.as_mut().map(|pending| {
            pending.replies += 1;
            *pending
        });
        let asked = pending.map(|pending| pending.request);
        if let Some(pending) = pending.filter(|pending| !pending.request.command().is_multi_response()) {
            self.pending = None;
            return self.answer(group, asked, pending.place.end());
        }
        let first = pending.filter(|pending| pending.replies == 1);
        self.answer(group, asked, first.and_then(|pending| pending.place.end()))
    }

    fn answer(&mut self, group: &Frames, asked: Option<Request>, asked_end: Option<Time>) -> Event {
        let delay = asked_end.map(|end| group.start() - end);
        let expected = expected(group, asked);
        let result = match (group.broken, expected) {
            (Some(frame), _) => Err(Error::Delimiter { frame }),
            (None, Ok(expected)) => {
                let reply = RawResponse::from_words(expected.layout(), group.contents(), BitOrder::LsbFirst);
                reply.and_then(|reply| Response::parse(&expected, &reply))
            }
            (None, Err(error)) => Err(error),
        };
        let mut event = self.encoder.answer(group, expected.ok(), asked, result, delay);
        if let (Verdict::Refused(refusal), Some(request)) = (&mut event.verdict, asked) {
            refusal.cause = cause(group, request, expected.ok()).or(refusal.cause.take());
        }
        event
    }

    /// Ends the wait for a reply at `now`; `asked`: whether that is because the next request came.
    fn give_up(&mut self, now: Time, asked: bool, out: &mut dyn Sink) -> io::Result<()> {
        match self.pending.take() {
            Some(pending) if pending.replies == 0 => {
                let timeout = REPLY_TIMEOUT_BITS * self.bit;
                out.event(&describe::silence(pending.request, pending.place, timeout, now, asked))
            }
            _ => Ok(()),
        }
    }
}

/// Returns what probably spoilt the reply to a request.
fn cause(group: &Frames, request: Request, expected: Option<Expected>) -> Option<String> {
    let layout =
        expected.map_or_else(|| request.expected(Resolution::default()).layout(), |expected| expected.layout());
    let len = layout.line_bits();
    let expected = expected.unwrap_or_else(|| request.expected(Resolution::default()));
    let line = Window::from_bits(group.raw & (1_u128.checked_shl(len)?.wrapping_sub(1)), len)?;
    let found = if group.raw == 0 { None } else { inspect(request, Resolution::default(), line).cause() };
    if let Some(cause) = found.filter(|cause| *cause != Cause::Line(LineCause::Disturbed)) {
        return Some(cause.to_string());
    }
    let due = usize::from(layout.frames());
    let sound =
        |bits: u128| Window::from_bits(bits, len).is_some_and(|line| Response::parse_line(&expected, line).is_ok());
    // If one bit is wrong, none has slipped, unless it is the last 0 before idle line: that one is also missing if the
    // reply was cut in the ones before it, or lost one of several zeros.
    let wrong = (0..len).find(|at| sound(line.bits() ^ 1 << at));
    if let Some(at) = wrong.filter(|at| (line.bits() << (128 - len)).leading_ones() >= len - at && *at > 0) {
        return Some(if line.bits() >> (at - 1) & 1 == 1 { CUT } else { LOST }.to_owned());
    }
    let flipped = wrong.is_some();
    let in_place = group.broken.is_none() && group.len() == due;
    let idle = (line.bits() << (128 - len)).leading_ones();
    if in_place && idle >= SURELY_CUT_BITS {
        return Some(CUT.to_owned());
    }
    if flipped {
        return Some(LineCause::Disturbed.to_string());
    }
    if let Some(slipped) = slipped_bit(group.raw, len, sound) {
        return Some(slipped.to_owned());
    }
    if in_place && idle >= CUT_BITS || group.broken.is_none() && group.len() < due {
        return Some(CUT.to_owned());
    }
    found.map(|cause| cause.to_string())
}

/// Returns what a reply has to be: as requested, in the layout with this many frames; without a request, as the reply
/// itself says.
fn expected(group: &Frames, asked: Option<Request>) -> Result<Expected, Error> {
    let frames = group.len();
    let fits = |layout: &Layout| usize::from(layout.frames()) == frames;
    let Some(request) = asked else {
        if frames == usize::from(Layout::Abs17.frames()) {
            return Ok(Expected::new(Layout::Abs17, Command::Abs17));
        }
        let code = group.contents().first().map_or(31, |first| first >> 6 & 31);
        let code = u8::try_from(code).unwrap_or(31);
        let command = Command::from_code(code).ok_or(Error::UnknownCommand { code })?;
        let [standard, _] = command.layouts();
        return Ok(Expected::new(command.layouts().into_iter().find(fits).unwrap_or(standard), command));
    };
    let expected = request.expected(Resolution::default());
    if fits(&expected.layout()) {
        return Ok(expected);
    }
    let command = request.command();
    let Some(layout) = command.layouts().into_iter().find(fits) else { return Ok(expected) };
    let other = Expected::new(layout, command).echoing(Echo::of(request.operation));
    Ok(if command.answers_with_own_address() { other.from_address(request.ea) } else { other })
}

impl StartStop for Decoder {
    const CONTENT_BITS: u32 = 16;
    // The sync codes 010 of a request and 001 of a reply.
    const FIRST_LOW: [u32; 2] = [2, 3];

    fn rest(&mut self, now: Time, out: &mut dyn Sink) -> io::Result<()> {
        let over = !self.open.is_empty() && self.is_over(now, Kind::Other);
        if over { self.close(out) } else { Ok(()) }
    }

    fn is_between(&self) -> bool {
        self.open.is_empty()
    }

    fn begin(&mut self, start: Time) {
        self.cut_until = None;
        self.begin = Some(start);
    }

    fn field(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()> {
        let begins = Kind::of(field.content);
        if !self.open.is_empty() && (self.is_over(field.start, begins) || field.content | 1 == IDLE && self.is_whole())
        {
            self.close(out)?;
        }
        self.open.push(field.content, field, self.bit);
        let whole = match self.open.kind() {
            Kind::Request => self.open.request_frames(),
            _ => RawResponse::MAX_FRAMES,
        };
        if self.open.len() >= whole { self.close(out) } else { Ok(()) }
    }

    fn finish(&mut self, end: Time, out: &mut dyn Sink) -> io::Result<()> {
        if !self.open.is_empty() {
            let recent = end - self.open.end <= PAUSE_BITS * self.bit;
            let short = match self.open.kind() {
                Kind::Request => self.open.len() < self.open.request_frames(),
                _ => expected(&self.open, self.pending.map(|pending| pending.request))
                    .is_ok_and(|expected| self.open.len() < usize::from(expected.layout().frames())),
            };
            if recent && short {
                let piece = self.open.take();
                self.pending = None;
                return out.event(&Event::cut_off(piece.place()));
            }
            self.close(out)?;
        }
        match self.pending.and_then(|pending| pending.place.end()) {
            // Its reply may have come later.
            Some(asked) if end - asked < REPLY_TIMEOUT_BITS * self.bit => self.pending = None,
            _ => self.give_up(end, false, out)?,
        }
        Ok(())
    }
}

impl LogDecoder for Decoder {
    /// Takes a line of a log with a request, a reply, or both: two bytes per frame, the first bit on the wire in bit 7 of
    /// the first byte.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        let words = burst.bytes.chunks(2).map(|pair| match *pair {
            [high, low] => u16::from_be_bytes([high, low]),
            [high] => u16::from_be_bytes([high, 0]),
            _ => 0,
        });
        self.open.line = Some(burst.line);
        for word in words {
            let line = Some(burst.line);
            self.open.line = line;
            let content = word.reverse_bits();
            self.field(
                &LineField { content, delimiter: true, start: Time::ZERO, end: Time::ZERO, spikes: 0, bits: 0 },
                out,
            )?;
        }
        if self.open.is_empty() {
            self.open.line = None;
            return Ok(());
        }
        self.close(out)
    }

    fn spoilt(&mut self, _: &mut dyn Sink) -> io::Result<()> {
        self.pending = None;
        Ok(())
    }

    fn end(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        self.give_up(Time::ZERO, false, out)
    }
}
