//! HIPERFACE DSL: H-frames, answers, V-frames and messages of a recorded pair.
//!
//! Every run of equal levels is rounded to whole bits, so that the grid follows the edges of whoever drives. A frame is
//! found by the head of the master; the answer behind it at the delay where its words hold.

mod bits;
mod score;

use std::io;

use hdsl::frame::{ANSWER_BITS, BIT_RATE, H_FRAME_BITS, Head, Received};
use hdsl::message::{LongAnswer, Request, Responder};
use hdsl::sampling::{Delay, TEST_PATTERN};
use hdsl::{
    Answer, EncoderByte, EncoderId, EncoderSymbol, Error, MasterSymbol, Phase, PositionBits, PositionTracker,
    QualityMonitor, QualityRule, Rule, VFrame, Window,
};

use crate::capture::samples::Samples;
use crate::event::{Direction, Event, Field, NO_RESPONSE, Place, Position, Refusal, Verdict};
use crate::line::{LineDecoder, Rates};
use crate::output::Sink;
use bits::Bits;
use score::{PERFECT, disparity_holds, score};

/// The names of all fields.
pub const FIELDS: &[&str] = &[
    "SYMBOL", "FIRST", "MSYNC", "EXTRA", "delay", "VERT", "VSYNC", "PIPE", "DD", "SEC", "POS", "VEL", "SUMMARY",
    "VPOS", "STATUS2", "VPOS2", "QM", "ENC_ID", "message",
];

/// Nominal bit rates.
pub const RATES: &[u32] = &[BIT_RATE];

/// Bits that have to be there before a frame is looked for: longest head, direction switch, delay, answer.
const NEED: u64 = 36 + 1 + 12 + ANSWER_BITS as u64;
/// Bits that are kept to say what there was instead of a frame.
const KEPT: u64 = 4096;
/// Bits that are taken together where there are so many.
const MANY: u64 = 16 * NEED;
/// Bits between the heads of two frames at most: the longest frame with its stuffing.
const LONGEST: u64 = 273 + 4;

/// Decodes the link on one line.
pub struct DslLine {
    bits: Bits,
    decoder: Decoder,
    bit: f64,
    /// The sample at which the line changed last, where it comes in samples.
    since: Option<u64>,
}

impl DslLine {
    /// `bit`: nominal length in picoseconds.
    pub fn new(bit: f64) -> Self {
        Self { bits: Bits::new(bit), decoder: Decoder::new(), bit, since: None }
    }
}

impl LineDecoder for DslLine {
    fn change(&mut self, time: i64, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        self.bits.change(time, level);
        if self.bits.end() > self.enough() { self.decoder.take(&mut self.bits, NEED, out) } else { Ok(()) }
    }

    fn samples(&mut self, samples: Samples<'_>, out: &mut dyn Sink) -> io::Result<()> {
        let may_be_on_grid = self.bits.may_be_on_grid(&samples);
        let (mut at, mut level) = (samples.first(), samples.before());
        loop {
            if let Some(since) = self.since.filter(|_| may_be_on_grid) {
                if let Some(taken) = self.bits.on_grid(&samples, since, at, self.enough()) {
                    (at, level, self.since) = (taken.next, taken.level, Some(taken.since));
                }
            }
            let Some(next) = samples.change(at, level) else { return Ok(()) };
            level = !level;
            self.change(samples.clock().time(next), level, out)?;
            (self.since, at) = (Some(next), next + 1);
        }
    }

    fn reach(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()> {
        self.bits.reach(time);
        if self.decoder.delay.is_some() { self.decoder.take(&mut self.bits, NEED, out) } else { Ok(()) }
    }

    fn gap(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()> {
        self.finish(time, out)?;
        *self = Self::new(self.bit);
        Ok(())
    }

    fn finish(&mut self, time: i64, out: &mut dyn Sink) -> io::Result<()> {
        self.bits.finish(time, 2.0);
        self.decoder.take(&mut self.bits, u64::from(Head::BITS), out)
    }

    fn rates(&self) -> Rates {
        self.bits.rates()
    }
}

impl DslLine {
    /// Bits from which on frames are looked for.
    fn enough(&self) -> u64 {
        self.decoder.next + if self.decoder.delay.is_none() { LESSON } else { MANY }
    }
}

/// A head at bit `at`; the partly high last bit of an EXTRA window can have been rounded to one bit more in all.
fn head(bits: &Bits, at: u64) -> Option<(Received, u64)> {
    let raw = bits.load(at);
    // SYNC and the ones of SAMPLE.
    if raw & 0xff != HEAD {
        return None;
    }
    let line = bits.window(at);
    if let Ok(head) = Head::parse(line) {
        return Some((head, head.len.into()));
    }
    let ones = (raw >> 8).trailing_ones();
    if !(3..=10).contains(&ones) || (raw >> (8 + ones)).trailing_zeros() != 2 {
        return None;
    }
    let low = raw & ((1 << (8 + ones)) - 1);
    let shorter = Window::from_bits(low | raw >> (9 + ones) << (8 + ones), line.len().checked_sub(1)?)?;
    Head::parse(shorter).ok().map(|head| (head, u64::from(head.len) + 1))
}

/// SYNC and the two ones of SAMPLE, the first bit in bit 0.
const HEAD: u128 = 0b1111_0100;
/// Good words and checks from which an answer is where it was looked for.
const GOOD: usize = 10;
/// Answers from which the delay is learned, and bits in which they are.
const LEARNED: usize = 8;
const LESSON: u64 = 1300;
const DISPARITY: &str = "all words are in the tables, but not one behind the other: bits of at least one were flipped";
const PAUSED: &str = "the line rests here, though frames follow each other for ever";

/// Whether a frame is answered by the test pattern or the identifier.
fn is_start_up(symbol: MasterSymbol) -> bool {
    matches!(symbol, MasterSymbol::Start | MasterSymbol::Learn | MasterSymbol::Check | MasterSymbol::IdReq)
}

/// What there is where the head of a frame was due, within three bits.
fn damage(line: u128) -> (&'static str, String) {
    // 0 0 1 0 1 1, 1 1 0, 1 1 0
    const PATTERN: u128 = 0b0110_1111_0100;
    let near = (0..=6).map(|at| ((line >> at & 0xfff) ^ PATTERN).count_ones()).min().unwrap_or(12);
    match near {
        0 => ("invalid_word", "the parameter word of the head is in no table".to_owned()),
        1..=2 => ("head", format!("the head of the frame is damaged in {near} bit(s)")),
        _ => ("missing", "a frame is missing".to_owned()),
    }
}

/// What is known of the link so far.
struct Decoder {
    /// The bit at which to go on.
    next: u64,
    /// The last head, and how far it was from the one before.
    head: Option<u64>,
    apart: Option<u64>,
    delay: Option<u32>,
    /// Time from the end of a head to its answer, in picoseconds.
    lag: Option<i64>,
    tracker: PositionTracker,
    quality: QualityMonitor,
    frame: VFrame,
    /// Place in the V-frame, once VSYNC was seen.
    at: Option<u8>,
    requests: Responder,
    request: Option<Request>,
    nibbles: Vec<u8>,
}

impl Decoder {
    fn new() -> Self {
        Self {
            next: 0,
            head: None,
            apart: None,
            delay: None,
            lag: None,
            tracker: PositionTracker::new(PositionBits::MAX),
            quality: QualityMonitor::new(QualityRule::Sick),
            frame: VFrame::default(),
            at: None,
            requests: Responder::new(),
            request: None,
            nibbles: Vec::new(),
        }
    }

    /// Takes all frames that are there; fewer than `need` bits are kept for the next time.
    fn take(&mut self, bits: &mut Bits, need: u64, out: &mut dyn Sink) -> io::Result<()> {
        while self.next + need <= bits.end() {
            let at = self.next;
            let Some((found, len)) = head(bits, at) else {
                self.next += 1;
                continue;
            };
            self.missed(bits, at, out)?;
            let symbol = found.byte.symbol();
            let place = bits.place(at..at + len);
            out.event(&master(found, symbol, place))?;
            self.message_out(symbol, place, out)?;
            self.next = at + len;
            if symbol.is_ok_and(MasterSymbol::is_answered) {
                let whole = self.next + 1 + u64::from(ANSWER_BITS) <= bits.end();
                if !whole {
                    break;
                }
                self.next = self.answer(symbol, bits, at + len + 1, out)?;
            }
        }
        bits.forget(self.next.saturating_sub(KEPT));
        Ok(())
    }

    /// Frames follow each other for ever: says where one should have been before the head at `at`.
    fn missed(&mut self, bits: &mut Bits, at: u64, out: &mut dyn Sink) -> io::Result<()> {
        let Some(last) = self.head.replace(at) else {
            bits.paused = None;
            return Ok(());
        };
        let (apart, usual) = (at - last, self.apart.unwrap_or(u64::from(H_FRAME_BITS)));
        if bits.paused.take_if(|paused| *paused <= at).is_some() {
            let place = bits.place(last..at);
            self.lose(1);
            out.event(&event(place, Direction::Request, "H-frame", Vec::new(), Err(("gap", PAUSED.to_owned()))))?;
        } else if apart > LONGEST || apart + 8 >= 2 * usual {
            let missing = ((apart as f64 / usual as f64).round() as u64).saturating_sub(1).max(1);
            for k in 1..=missing {
                let due = last + k * apart / (missing + 1);
                self.lose(1);
                let (class, what) = damage(bits.load(due.saturating_sub(3)));
                let place = bits.place(due..due + u64::from(Head::BITS));
                out.event(&event(place, Direction::Request, "H-frame", Vec::new(), Err((class, what))))?;
            }
        } else {
            self.apart = Some(apart);
        }
        Ok(())
    }

    /// Frames that were not heard: the fast position and the V-frame go on without them.
    fn lose(&mut self, frames: u8) {
        for _ in 0..frames {
            self.tracker.step(None);
            self.at = None;
        }
    }

    /// The answer that begins at `from` or some bits later; where to go on.
    fn answer(
        &mut self,
        symbol: Result<MasterSymbol, Error>,
        bits: &Bits,
        from: u64,
        out: &mut dyn Sink,
    ) -> io::Result<u64> {
        let line = |delay: u32| bits.window(from + u64::from(delay));
        let usual = match self.delay {
            Some(delay) => delay,
            None => usual_delay(bits, from),
        };
        // The delay of a cable does not change, but it need not be whole bits; between equals the time decides.
        let begin = bits.time(from);
        let since = |delay: u32| bits.time(from + u64::from(delay)) - begin;
        let off = |delay: u32| self.lag.map_or(0, |lag| (since(delay) - lag).abs());
        let better = |a: &(u32, usize), b: &(u32, usize)| a.1 > b.1 || a.1 == b.1 && off(a.0) < off(b.0);
        let mut best = (usual, score(line(usual)));
        let running = self.lag.is_some_and(|_| off(usual) < bits.half()) && !symbol.is_ok_and(is_start_up);
        if !running || best.1 < PERFECT {
            for delay in [usual + 1, usual.saturating_sub(1)] {
                let next = (delay, score(line(delay)));
                best = if better(&next, &best) { next } else { best };
            }
        }
        let (delay, score) = best;
        if score >= GOOD {
            let now = since(delay);
            self.lag = Some(self.lag.map_or(now, |lag| lag + (now - lag) / 8));
        }
        let place = bits.place(from + u64::from(delay)..from + u64::from(delay + ANSWER_BITS));
        let silent = line(0).bits().trailing_ones() > 56;
        if score < 4 || silent {
            let why = if silent { "no answer" } else { "hardly a word of the answer holds" };
            let class = if silent { NO_RESPONSE } else { "invalid_word" };
            let verdict = Err((class, why.to_owned()));
            self.tracker.step(None);
            out.event(&event(place, Direction::Answer, "answer", Vec::new(), verdict))?;
            self.at = self.at.map(|at| (at + 1) % 8);
            return Ok(from);
        }
        self.delay = Some(usual);
        let window = line(delay);
        let end = from + u64::from(delay + ANSWER_BITS);
        match symbol {
            Ok(MasterSymbol::Start | MasterSymbol::Learn | MasterSymbol::Check) => {
                let good = window.bits() as u64 & ((1 << ANSWER_BITS) - 1) == TEST_PATTERN;
                let verdict = if good { Ok(()) } else { Err(("pattern", "the test pattern is damaged".into())) };
                let mut event = event(
                    place,
                    Direction::Answer,
                    "test pattern",
                    vec![Field::measured("delay", delay, "bit")],
                    verdict,
                );
                event.delay = None;
                out.event(&event)?;
            }
            Ok(MasterSymbol::IdReq) => self.identifier(window, place, out)?,
            _ => self.normal(window, place, out)?,
        }
        Ok(end)
    }

    fn identifier(&mut self, window: Window, place: Place, out: &mut dyn Sink) -> io::Result<()> {
        let id = Answer::parse(Rule::Strict, window).and_then(EncoderId::from_answer);
        let fields = id.map_or_else(|_| Vec::new(), |id| vec![Field::hex("ENC_ID", id.get(), 5)]);
        if let Ok(bits) = id.and_then(EncoderId::check) {
            *self = Self {
                delay: self.delay,
                lag: self.lag,
                next: self.next,
                head: self.head,
                apart: self.apart,
                tracker: PositionTracker::new(bits),
                ..Self::new()
            };
        }
        out.event(&event(place, Direction::Answer, "identifier", fields, id.map(|_| ()).map_err(refusal)))?;
        Ok(())
    }

    fn normal(&mut self, window: Window, place: Place, out: &mut dyn Sink) -> io::Result<()> {
        let Ok(answer) = Answer::parse(Rule::Strict, window) else { return Ok(()) };
        let dd = answer.delta_delta();
        self.tracker.step(dd.ok());
        let parameter = answer.parameter();
        let byte = |name, word: hdsl::symbol::Reading| word.byte().ok().map(|byte| Field::hex(name, byte, 2));
        let mut fields = Vec::with_capacity(10);
        fields.push(Field::measured("delay", self.delay.unwrap_or(0), "bit"));
        fields.extend(byte("VERT", answer.vertical()));
        if let Ok(parameter) = parameter {
            fields.push(encoder_symbol(parameter));
            fields.push(Field::number("VSYNC", parameter.vsync()));
        }
        fields.extend(byte("PIPE", answer.pipe()));
        fields.extend(dd.ok().map(|dd| Field::number("DD", dd.get())));
        fields.extend(byte("SEC", answer.secondary()));
        fields.push(Field::measured("VEL", self.tracker.velocity(), "/frame"));
        let first = answer.words().into_iter().find_map(|word| word.byte().err()).or(dd.err()).map(refusal);
        let verdict = match first {
            Some(refused) => Err(refused),
            None if !disparity_holds(window) => Err(("disparity", DISPARITY.to_owned())),
            None => Ok(()),
        };
        let mut event = event(place, Direction::Answer, "answer", fields, verdict);
        if self.tracker.phase() == Phase::Check && !self.tracker.is_unreliable() {
            event.fields.push(Field::hex("POS", self.tracker.position(), 10));
            event.position = Some(position(self.tracker.position()));
        }
        out.event(&event)?;
        self.message_in(parameter.ok(), place, out)?;
        self.v_frame(answer, parameter.is_ok_and(EncoderByte::vsync), place, out)
    }

    fn v_frame(&mut self, answer: Answer, vsync: bool, place: Place, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(at) = self.at {
            self.frame.put(Rule::Strict, at, answer);
            self.quality.count_answer(at, &answer);
            if at == 7 {
                self.end_v_frame(place, out)?;
            }
            self.at = Some((at + 1) % 8);
        }
        if vsync {
            self.at = Some(0);
        }
        Ok(())
    }

    fn end_v_frame(&mut self, place: Place, out: &mut dyn Sink) -> io::Result<()> {
        let VFrame { safe1, safe2 } = self.frame;
        let safe = safe1.position();
        self.quality.count_v_frame(&self.frame);
        match safe {
            Ok(position) => self.tracker.align(position),
            Err(_) => self.tracker.no_safe_position(),
        }
        let mut fields = vec![Field::hex("SUMMARY", safe1.status(), 2)];
        fields.extend(safe.ok().map(|position| Field::hex("VPOS", position, 10)));
        fields.push(Field::hex("STATUS2", safe2.status(), 2));
        fields.extend(safe2.position().ok().map(|position| Field::hex("VPOS2", position, 10)));
        fields.push(Field::number("QM", self.quality.value()));
        let error = safe.err().or(safe2.position().err());
        let mut event = event(place, Direction::Answer, "V-frame", fields, error.map_or(Ok(()), |e| Err(refusal(e))));
        event.position = safe.ok().map(position);
        out.event(&event)?;
        Ok(())
    }

    /// Requests, symbol by symbol.
    fn message_out(&mut self, symbol: Result<MasterSymbol, Error>, place: Place, out: &mut dyn Sink) -> io::Result<()> {
        let Ok(symbol) = symbol else { return Ok(()) };
        if let Some(request) = self.requests.receive(symbol) {
            self.request = Some(request);
            out.event(&event(place, Direction::Request, "message", vec![Field::text("message", request)], Ok(())))?;
        }
        Ok(())
    }

    /// Answers: what was gathered until the next IDLE.
    fn message_in(&mut self, byte: Option<EncoderByte>, place: Place, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(Ok(EncoderSymbol::Data(nibble))) = byte.map(EncoderByte::symbol) {
            self.nibbles.push(nibble.get());
            return Ok(());
        }
        let nibbles = std::mem::take(&mut self.nibbles);
        let (Some(request), false) = (self.request, nibbles.is_empty()) else { return Ok(()) };
        let bytes: Vec<u8> =
            nibbles.chunks(2).map(|pair| pair.iter().fold(0, |byte, nibble| byte << 4 | nibble)).collect();
        let result = match request {
            Request::Short(request) => request.parse_answer(&bytes).map(|answer| Field::text("message", answer)),
            Request::Long(_) => LongAnswer::parse(&bytes).map(|answer| Field::text("message", answer)),
        };
        let fields = result.iter().cloned().collect();
        out.event(&event(place, Direction::Answer, "message", fields, result.map(|_| ()).map_err(refusal)))?;
        Ok(())
    }
}

/// The delay at which most of the answers behind the next heads hold.
fn usual_delay(bits: &Bits, from: u64) -> u32 {
    let delays = 0..=u32::from(Delay::MAX.get()) + 1;
    let mut sums = vec![0; delays.clone().count()];
    let (mut at, mut heard) = (from, 0);
    while heard < LEARNED && at + u64::from(ANSWER_BITS) < bits.end() {
        for (delay, sum) in delays.clone().zip(&mut sums) {
            *sum += score(bits.window(at + u64::from(delay)));
        }
        heard += 1;
        at += u64::from(ANSWER_BITS);
        // The answer behind the next head.
        loop {
            if at + u64::from(Head::BITS) > bits.end() {
                at = bits.end();
                break;
            }
            if let Some((_, len)) = head(bits, at) {
                at += len + 1;
                break;
            }
            at += 1;
        }
    }
    let best = delays.zip(sums).reduce(|best, next| if next.1 > best.1 { next } else { best });
    best.map_or(0, |(delay, _)| delay)
}

fn master(head: Received, symbol: Result<MasterSymbol, Error>, place: Place) -> Event {
    let mut fields = Vec::with_capacity(4);
    fields.extend(symbol.ok().map(|symbol| Field::text("SYMBOL", symbol)));
    fields.push(Field::number("FIRST", head.byte.first()));
    fields.push(Field::number("MSYNC", head.byte.msync()));
    if head.extra_bits > 0 {
        fields.push(Field::measured("EXTRA", head.extra_bits, "bit"));
    }
    event(place, Direction::Request, "H-frame", fields, symbol.map(|_| ()).map_err(refusal))
}

/// The symbol, or the five bits of one without a meaning.
fn encoder_symbol(byte: EncoderByte) -> Field {
    match byte.symbol() {
        Ok(symbol) => Field::text("SYMBOL", symbol),
        Err(_) => Field::text("SYMBOL", format_args!("{:02X}h", byte.raw() & 31)),
    }
}

type Refused = (&'static str, String);

fn refusal(error: Error) -> Refused {
    (error.class().name(), error.to_string())
}

fn event(
    place: Place,
    direction: Direction,
    kind: &'static str,
    fields: Vec<Field>,
    verdict: Result<(), Refused>,
) -> Event {
    let verdict = match verdict {
        Ok(()) => Verdict::Ok,
        Err((class, reason)) => Refusal::new(class, reason).into(),
    };
    Event::new(place, Some(direction), kind, fields, verdict)
}

fn position(counts: u64) -> Position {
    Position { counts: i64::try_from(counts).unwrap_or(i64::MAX), span: Some(1 << 40), per_turn: None }
}
