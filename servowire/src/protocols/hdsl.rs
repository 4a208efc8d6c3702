//! HIPERFACE DSL: H-frames, answers, V-frames and messages of a recorded pair.
//!
//! Every run of equal levels is rounded to whole bits, so that the grid follows the edges of whoever drives. A frame is
//! found by the head of the master; the answer behind it at the delay where its words hold.

use std::ops::Range;

use hdsl::frame::{ANSWER_BITS, BIT_RATE, Head, Received};
use hdsl::message::{LongAnswer, Request, Responder, ShortRequest};
use hdsl::sampling::{Delay, TEST_PATTERN};
use hdsl::{
    Answer, EncoderByte, EncoderId, EncoderSymbol, Error, MasterSymbol, Phase, PositionBits, PositionTracker,
    QualityEvent, QualityMonitor, QualityRule, Rule, VFrame, Window,
};

use crate::capture::{Capture, Change, Line, time};
use crate::event::{Direction, Event, Field, Place, Position, Refusal, Value, Verdict};
use crate::fault::{At, Fault};
use crate::line::{self, Stop};
use crate::output::{Output, Sink};

/// The names of all fields.
pub const FIELDS: &[&str] = &[
    "SYMBOL", "FIRST", "MSYNC", "EXTRA", "delay", "VERT", "VSYNC", "PIPE", "DD", "SEC", "POS", "VEL", "SUMMARY",
    "VPOS", "STATUS2", "VPOS2", "QM", "ENC_ID", "message",
];

/// A bit in picoseconds.
const BIT: i64 = time::SECOND / BIT_RATE as i64;
/// Bits that have to be there before a frame is looked for: longest head, direction switch, delay, answer.
const NEED: usize = 36 + 1 + 12 + ANSWER_BITS as usize;
/// Longest run that is taken bit by bit; a longer one is a pause.
const PAUSE: i64 = 200;

/// Decodes a capture to its end.
pub(super) fn decode(file: &str, capture: Capture, options: &line::Options, out: &mut Output<'_>) -> Result<(), Stop> {
    match capture {
        Capture::Edges(mut line) => run(file, line.as_mut(), options, out),
        Capture::Samples(mut raw) => {
            let rate = raw.clock().rate();
            if rate < 4 * u64::from(BIT_RATE) {
                let what = format!("{rate} samples a second are too few for 9.375 Mbit/s: 37.5 MHz or faster");
                return Err(Fault::new(file, At::File, what).into());
            }
            run(file, &mut raw, options, out)
        }
        Capture::Bytes(_) | Capture::Packets(_) => {
            Err(Fault::new(file, At::File, "HIPERFACE DSL is decoded from edges or samples of the line").into())
        }
    }
}

fn run(file: &str, line: &mut dyn Line, options: &line::Options, out: &mut Output<'_>) -> Result<(), Stop> {
    let mut changes = Vec::new();
    let mut more = line.read(&mut changes)?;
    let channel = channel(file, line.channels(), options, &changes)?;
    out.channels(line.channels(), channel)?;
    let mut bits = Bits { inverted: options.inverted.unwrap_or(false), ..Bits::default() };
    let mut decoder = Decoder::new();
    loop {
        for change in &changes {
            if out.wants_changes() {
                out.change(change)?;
            }
            if change.channel == channel {
                bits.change(change.time, change.level);
            }
        }
        decoder.take(&mut bits, NEED, out)?;
        out.tick();
        if !more {
            break;
        }
        changes.clear();
        more = line.read(&mut changes)?;
    }
    bits.change(line.reached(), false);
    decoder.take(&mut bits, Head::BITS as usize, out)
}

/// The channel asked for by name or number, or the one with the most changes at first.
fn channel(file: &str, names: &[String], options: &line::Options, changes: &[Change]) -> Result<u16, Fault> {
    let all = 0..u16::try_from(names.len()).unwrap_or(u16::MAX);
    if let Some(wanted) = &options.channel {
        let named = all.clone().zip(names).find(|(_, name)| *name == wanted).map(|(channel, _)| channel);
        let numbered = || wanted.parse().ok().filter(|number| all.contains(number));
        return named
            .or_else(numbered)
            .ok_or_else(|| Fault::new(file, At::File, format!("there is no channel {wanted:?}")));
    }
    let busy = |channel: &u16| changes.iter().filter(|change| change.channel == *channel).count();
    all.max_by_key(busy).ok_or_else(|| Fault::new(file, At::File, "there is no channel"))
}

/// Line bits with their times.
#[derive(Default)]
struct Bits {
    inverted: bool,
    last: Option<(i64, bool)>,
    levels: Vec<bool>,
    times: Vec<i64>,
}

impl Bits {
    fn change(&mut self, time: i64, level: bool) {
        if let Some((since, high)) = self.last {
            let count = ((time - since + BIT / 2) / BIT).min(PAUSE);
            for bit in 0..count {
                self.levels.push(high);
                self.times.push(since + bit * BIT);
            }
        }
        self.last = Some((time, level != self.inverted));
    }

    /// Up to 128 bits from `at` on.
    fn window(&self, at: usize) -> Window {
        let levels = self.levels.get(at..).unwrap_or_default();
        let len = levels.len().min(128);
        let bits = levels.iter().take(len).rev().fold(0, |bits, level| bits << 1 | u128::from(*level));
        Window::from_bits(bits, len as u32).unwrap_or(Window::EMPTY)
    }

    fn place(&self, bits: Range<usize>) -> Place {
        let time = |at: usize| self.times.get(at).copied().unwrap_or(0);
        Place::Time { start: time(bits.start), end: time(bits.end.saturating_sub(1)) + BIT }
    }
}

/// A head; the partly high last bit of an EXTRA window can have been rounded to one bit more in all.
fn head(line: Window) -> Option<(Received, usize)> {
    if let Ok(head) = Head::parse(line) {
        return Some((head, head.len as usize));
    }
    let ones = (line.bits() >> 8).trailing_ones();
    if !(3..=10).contains(&ones) || (line.bits() >> (8 + ones)).trailing_zeros() != 2 {
        return None;
    }
    let low = line.bits() & ((1 << (8 + ones)) - 1);
    let shorter = Window::from_bits(low | line.bits() >> (9 + ones) << (8 + ones), line.len() - 1)?;
    Head::parse(shorter).ok().map(|head| (head, head.len as usize + 1))
}

/// What is known of the link so far.
struct Decoder {
    delay: Option<u32>,
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
            delay: None,
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
    fn take(&mut self, bits: &mut Bits, need: usize, out: &mut Output<'_>) -> Result<(), Stop> {
        let mut at = 0;
        while at + need <= bits.levels.len() {
            let Some((found, len)) = head(bits.window(at)) else {
                at += 1;
                continue;
            };
            let symbol = found.byte.symbol();
            out.event(&master(found, symbol, bits.place(at..at + len)))?;
            self.message_out(symbol, bits.place(at..at + len), out)?;
            at += len;
            if symbol.is_ok_and(MasterSymbol::is_answered) {
                at = self.answer(symbol, bits, at + 1, out)?;
            }
        }
        bits.levels.drain(..at.min(bits.levels.len()));
        bits.times.drain(..at.min(bits.times.len()));
        Ok(())
    }

    /// The answer that begins at `from` or some bits later; where to go on.
    fn answer(
        &mut self,
        symbol: Result<MasterSymbol, Error>,
        bits: &Bits,
        from: usize,
        out: &mut Output<'_>,
    ) -> Result<usize, Stop> {
        let line = |delay: u32| bits.window(from + delay as usize);
        let delays = self.delay.into_iter().chain(0..=u32::from(Delay::MAX.get()) + 1);
        let Some((delay, score)) = delays.map(|d| (d, score(line(d)))).rev().max_by_key(|(_, score)| *score) else {
            return Ok(from);
        };
        let place = bits.place(from + delay as usize..from + (delay + ANSWER_BITS) as usize);
        let silent = line(0).bits().trailing_ones() > 64;
        if score < 4 || silent {
            out.event(&event(
                place,
                Direction::Answer,
                "answer",
                Vec::new(),
                Err(("no_response", "no answer".into())),
            ))?;
            return Ok(from);
        }
        self.delay = Some(delay);
        let window = line(delay);
        let end = from + (delay + ANSWER_BITS) as usize;
        match symbol {
            Ok(MasterSymbol::Start | MasterSymbol::Learn | MasterSymbol::Check) => {
                let good = window.bits() as u64 & ((1 << ANSWER_BITS) - 1) == TEST_PATTERN;
                let verdict = if good { Ok(()) } else { Err(("pattern", "the test pattern is damaged".into())) };
                out.event(&event(
                    place,
                    Direction::Answer,
                    "test pattern",
                    vec![number("delay", delay.into(), "bit")],
                    verdict,
                ))?;
            }
            Ok(MasterSymbol::IdReq) => self.identifier(window, place, out)?,
            _ => self.normal(window, place, out)?,
        }
        Ok(end)
    }

    fn identifier(&mut self, window: Window, place: Place, out: &mut Output<'_>) -> Result<(), Stop> {
        let id = Answer::parse(Rule::Strict, window).and_then(EncoderId::from_answer);
        let fields = id.map_or_else(|_| Vec::new(), |id| vec![hex("ENC_ID", id.get().into(), 5)]);
        if let Ok(bits) = id.and_then(EncoderId::check) {
            *self = Self { delay: self.delay, tracker: PositionTracker::new(bits), ..Self::new() };
        }
        out.event(&event(place, Direction::Answer, "identifier", fields, id.map(|_| ()).map_err(refusal)))?;
        Ok(())
    }

    fn normal(&mut self, window: Window, place: Place, out: &mut Output<'_>) -> Result<(), Stop> {
        let Ok(answer) = Answer::parse(Rule::Strict, window) else { return Ok(()) };
        let dd = answer.delta_delta();
        self.tracker.step(dd.ok());
        let parameter = answer.parameter();
        let byte = |name, word: hdsl::symbol::Reading| word.byte().ok().map(|byte| hex(name, byte.into(), 2));
        let mut fields = vec![number("delay", self.delay.unwrap_or(0).into(), "bit")];
        fields.extend(byte("VERT", answer.vertical()));
        if let Ok(parameter) = parameter {
            fields.push(text("SYMBOL", encoder_symbol(parameter)));
            fields.push(number("VSYNC", parameter.vsync().into(), ""));
        }
        fields.extend(byte("PIPE", answer.pipe()));
        fields.extend(dd.ok().map(|dd| number("DD", dd.get().into(), "")));
        fields.extend(byte("SEC", answer.secondary()));
        fields.push(number("VEL", self.tracker.velocity().into(), "steps/frame"));
        let first = answer.words().into_iter().find_map(|word| word.byte().err()).or(dd.err());
        let mut event = event(place, Direction::Answer, "answer", fields, first.map_or(Ok(()), |e| Err(refusal(e))));
        if self.tracker.phase() == Phase::Check && !self.tracker.is_unreliable() {
            event.fields.push(hex("POS", self.tracker.position(), 10));
            event.position = Some(position(self.tracker.position()));
        }
        out.event(&event)?;
        self.message_in(parameter.ok(), place, out)?;
        self.v_frame(answer, parameter.is_ok_and(EncoderByte::vsync), place, out)
    }

    fn v_frame(&mut self, answer: Answer, vsync: bool, place: Place, out: &mut Output<'_>) -> Result<(), Stop> {
        if let Some(at) = self.at {
            self.frame.put(Rule::Strict, at, answer);
            if at == 7 {
                self.quality.count(if vsync { QualityEvent::VsyncOk } else { QualityEvent::VsyncMissing });
                self.end_v_frame(place, out)?;
            }
            self.at = Some((at + 1) % 8);
        }
        if vsync {
            self.at = Some(0);
        }
        Ok(())
    }

    fn end_v_frame(&mut self, place: Place, out: &mut Output<'_>) -> Result<(), Stop> {
        let VFrame { safe1, safe2 } = self.frame;
        let safe = safe1.position();
        self.quality.count(if safe.is_ok() { QualityEvent::Safe1Ok } else { QualityEvent::Safe1Error });
        match safe {
            Ok(position) => self.tracker.align(position),
            Err(_) => self.tracker.no_safe_position(),
        }
        let mut fields = vec![hex("SUMMARY", safe1.status().into(), 2)];
        fields.extend(safe.ok().map(|position| hex("VPOS", position, 10)));
        fields.push(hex("STATUS2", safe2.status().into(), 2));
        fields.extend(safe2.position().ok().map(|position| hex("VPOS2", position, 10)));
        fields.push(number("QM", self.quality.value().into(), ""));
        let error = safe.err().or(safe2.position().err());
        let mut event = event(place, Direction::Answer, "V-frame", fields, error.map_or(Ok(()), |e| Err(refusal(e))));
        event.position = safe.ok().map(position);
        out.event(&event)?;
        Ok(())
    }

    /// Requests, symbol by symbol.
    fn message_out(
        &mut self,
        symbol: Result<MasterSymbol, Error>,
        place: Place,
        out: &mut Output<'_>,
    ) -> Result<(), Stop> {
        let Ok(symbol) = symbol else { return Ok(()) };
        if let Some(request) = self.requests.receive(symbol) {
            let what = match request {
                Request::Short(ShortRequest::Read(register)) => format!("read register {:02X}h", register.address()),
                Request::Short(ShortRequest::Write(register, value)) => {
                    format!("write register {:02X}h = {value:02X}h", register.address())
                }
                Request::Long(request) => format!("resource {:03X}h: {:?}", request.address.get(), request.access),
            };
            self.request = Some(request);
            out.event(&event(place, Direction::Request, "message", vec![text("message", what)], Ok(())))?;
        }
        Ok(())
    }

    /// Answers: what was gathered until the next IDLE.
    fn message_in(&mut self, byte: Option<EncoderByte>, place: Place, out: &mut Output<'_>) -> Result<(), Stop> {
        if let Some(Ok(EncoderSymbol::Data(nibble))) = byte.map(EncoderByte::symbol) {
            self.nibbles.push(nibble.get());
            return Ok(());
        }
        let nibbles = std::mem::take(&mut self.nibbles);
        let (Some(request), false) = (self.request, nibbles.is_empty()) else { return Ok(()) };
        let bytes: Vec<u8> =
            nibbles.chunks(2).map(|pair| pair.iter().fold(0, |byte, nibble| byte << 4 | nibble)).collect();
        let result = match request {
            Request::Short(request) => request.parse_answer(&bytes).map(|answer| match answer.data {
                Some(data) => format!("register {:02X}h holds {data:02X}h", answer.register.address()),
                None => format!("register {:02X}h is written", answer.register.address()),
            }),
            Request::Long(_) => LongAnswer::parse(&bytes).map(|answer| match answer.result {
                Ok(data) => format!("resource {:03X}h: {:02X?}", answer.address.get(), data.as_bytes()),
                Err(error) => format!("refused, class {:02X}h, detail {:02X}h", error.class_code(), error.detail()),
            }),
        };
        let fields = result.as_ref().map_or_else(|_| Vec::new(), |what| vec![text("message", what.clone())]);
        out.event(&event(place, Direction::Answer, "message", fields, result.map(|_| ()).map_err(refusal)))?;
        Ok(())
    }
}

/// How well an answer stands here: good words, switch bit, check of the acceleration; most for the test pattern.
fn score(line: Window) -> usize {
    let Ok(answer) = Answer::parse(Rule::Strict, line) else { return 0 };
    if line.bits() as u64 & ((1 << ANSWER_BITS) - 1) == TEST_PATTERN {
        return 20;
    }
    let words = answer.words().iter().filter(|word| !word.is_byte_error()).count();
    words + usize::from(answer.switch_ok()) + if answer.delta_delta().is_ok() { 2 } else { 0 }
}

fn master(head: Received, symbol: Result<MasterSymbol, Error>, place: Place) -> Event {
    let mut fields = Vec::new();
    fields.extend(symbol.ok().map(|symbol| text("SYMBOL", master_symbol(symbol))));
    fields.push(number("FIRST", head.byte.first().into(), ""));
    fields.push(number("MSYNC", head.byte.msync().into(), ""));
    if head.extra_bits > 0 {
        fields.push(number("EXTRA", head.extra_bits.into(), "bit"));
    }
    event(place, Direction::Request, "H-frame", fields, symbol.map(|_| ()).map_err(refusal))
}

fn master_symbol(symbol: MasterSymbol) -> String {
    match symbol {
        MasterSymbol::Data(nibble) => format!("{:X}", nibble.get()),
        other => format!("{other:?}").to_uppercase(),
    }
}

fn encoder_symbol(byte: EncoderByte) -> String {
    match byte.symbol() {
        Ok(EncoderSymbol::Data(nibble)) => format!("{:X}", nibble.get()),
        Ok(other) => format!("{other:?}").to_uppercase(),
        Err(_) => format!("{:02X}h", byte.raw() & 31),
    }
}

type Refused = (&'static str, String);

fn refusal(error: Error) -> Refused {
    let class = match error {
        Error::InvalidWord { .. } => "invalid_word",
        Error::AccelerationCrc { .. } => "acceleration_crc",
        Error::EncoderError => "encoder_error",
        Error::Crc { .. } => "crc",
        Error::PositionInvalid { .. } => "position_invalid",
        Error::EncoderIdMismatch { .. } => "encoder_id",
        Error::UndefinedSymbol { .. } => "undefined_symbol",
        _ => "message",
    };
    (class, error.to_string())
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
        Err((class, reason)) => {
            Verdict::Refused(Box::new(Refusal { class, reason, field: None, bit: None, time: None, cause: None }))
        }
    };
    Event { place, direction: Some(direction), kind: kind.into(), fields, position: None, delay: None, verdict }
}

fn position(counts: u64) -> Position {
    Position { counts: i64::try_from(counts).unwrap_or(i64::MAX), span: Some(1 << 40), per_turn: None }
}

fn number(name: &'static str, value: i64, unit: &'static str) -> Field {
    Field { name, value: Value::Number { value, unit } }
}

fn hex(name: &'static str, value: u64, digits: usize) -> Field {
    Field { name, value: Value::Hex { value, digits } }
}

fn text(name: &'static str, value: String) -> Field {
    Field { name, value: Value::Text(value) }
}
