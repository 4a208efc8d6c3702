//! Bits of the link into frames, answers and messages.

mod answer;

use std::io;
use std::ops::Range;

use hdsl::frame::{ANSWER_BITS, H_FRAME_BITS, Head, ParsedHead};
use hdsl::inspect::{
    CarriedDisparity, Chain, Expected, FRONT_BITS, FoundHead, HeadRules, PERFECT, find_head, head_damage, inspect,
    score,
};
use hdsl::message::{LongAnswer, Request, Responder};
use hdsl::sampling::Delay;
use hdsl::{
    Answer, DeltaDelta, EncoderByte, EncoderId, EncoderSymbol, Error, FastPosition, MasterSymbol, QualityMonitor,
    QualityRule, Rule, VFrame, Window,
};

use super::bits::Bits;
use super::refused::{event, refusal};
use super::said::Said;
use crate::event::{Direction, Field, NO_RESPONSE, Place, Span};
use crate::sink::Sink;

/// Bits that have to be there before a frame is looked for: longest head, direction switch, delay, answer.
const NEED: u64 = 36 + 1 + 12 + ANSWER_BITS as u64;
/// Bits that are taken together where there are enough.
const MANY: u64 = 16 * NEED;
/// Bits that are kept to say what there was instead of a frame.
const KEPT: u64 = 4096;
/// Bits between the heads of two frames at most: the longest frame with its stuffing.
const LONGEST: u64 = 273 + 4;

/// Good words and checks from which an answer is where it was looked for.
const GOOD: usize = 10;
/// Answers from which the delay is learned, and bits in which they are.
const LEARNED: usize = 8;
const LESSON: u64 = 1300;
/// Of an encoder whose identifier was not seen: 11 bits of acceleration, 40 of position.
const WIDEST: EncoderId = EncoderId::truncate(0x001d3);
const LONE: &str = "a lone nibble between two frames without one is no message: a bit was flipped";
const TRAILER: &str = "the TRAILER or the stuffing in front of it is damaged";
const PAUSED: &str = "the line rests here, though frames follow each other for ever";

/// Two answers between which the running disparity does not go on.
#[derive(Debug, Clone, Copy)]
struct Break {
    /// Their numbers.
    ends: u64,
    begins: u64,
    /// Whether the V-frame of the first has a bad check in channel 2, if it was another one.
    first_failed: Option<bool>,
}

/// What is known of the link so far.
pub(super) struct Decoder {
    /// The bit at which to go on.
    next: u64,
    /// The last head, and how far it was from the one before.
    head: Option<u64>,
    apart: Option<u64>,
    delay: Option<u32>,
    /// Time from the end of a head to its answer, in picoseconds.
    lag: Option<i64>,
    /// `None` only if there were encoders that it cannot follow.
    fast: Option<FastPosition>,
    quality: QualityMonitor,
    frame: VFrame,
    /// Place in the V-frame, once VSYNC was seen.
    at: Option<u8>,
    requests: Responder,
    request: Option<Request>,
    nibbles: Vec<u8>,
    heads: HeadRules,
    /// The last frame carried a nibble; the number of its head, if the one before did not.
    talks: bool,
    lone: Option<u64>,
    carried: CarriedDisparity,
    /// The answer before, if it is good and no frame lies between: its number too.
    chain: Option<(Chain, u64)>,
    breaks: Vec<Break>,
    /// Whether a check of the last V-frame failed, of each channel; none while one is not complete.
    failed: Option<[bool; 2]>,
    /// VSYNC where it was not due, or not where it was.
    strays: u8,
    said: Said,
}

impl Decoder {
    pub(super) fn new() -> Self {
        Self {
            next: 0,
            head: None,
            apart: None,
            delay: None,
            lag: None,
            fast: FastPosition::new(WIDEST).ok(),
            quality: QualityMonitor::new(QualityRule::Sick),
            frame: VFrame::default(),
            at: None,
            requests: Responder::new(),
            request: None,
            nibbles: Vec::new(),
            heads: HeadRules::default(),
            talks: false,
            lone: None,
            carried: CarriedDisparity::default(),
            chain: None,
            breaks: Vec::new(),
            failed: None,
            strays: 0,
            said: Said::default(),
        }
    }

    /// Number of the first event of which later frames may still tell.
    fn settled(&self) -> u64 {
        let open = [self.lone, self.chain.map(|chain| chain.1), self.breaks.first().map(|first| first.ends)];
        open.into_iter().flatten().min().unwrap_or(u64::MAX)
    }

    /// Bits from which on frames are looked for.
    pub(super) fn enough(&self) -> u64 {
        self.next + if self.delay.is_none() { LESSON } else { MANY }
    }

    /// Whether it is known where answers are.
    pub(super) fn is_running(&self) -> bool {
        self.delay.is_some()
    }

    /// Takes the frames of which all bits are there.
    pub(super) fn take(&mut self, bits: &mut Bits, out: &mut dyn Sink) -> io::Result<()> {
        self.take_from(bits, NEED, out)
    }

    /// Takes what is left.
    pub(super) fn finish(&mut self, bits: &mut Bits, out: &mut dyn Sink) -> io::Result<()> {
        self.take_from(bits, u64::from(Head::BITS), out)?;
        self.said.give(u64::MAX, out)
    }

    /// Takes all frames that are there; fewer than `need` bits are kept for the next time.
    fn take_from(&mut self, bits: &mut Bits, need: u64, out: &mut dyn Sink) -> io::Result<()> {
        while self.next + need <= bits.end() {
            let at = self.next;
            let Some(found) = find_head(bits.window(at)) else {
                self.next += 1;
                continue;
            };
            self.missed(bits, at);
            let symbol = found.head.byte.symbol();
            let len = u64::from(found.len);
            let running = self.head(found, bits, at..at + len);
            self.next = at + len;
            if symbol.is_ok_and(MasterSymbol::is_answered) || running {
                let whole = self.next + 1 + u64::from(ANSWER_BITS) <= bits.end();
                if !whole {
                    break;
                }
                // In a link that runs, no frame asks for a pattern or the identifier.
                let start_up = symbol.ok().filter(|symbol| symbol.is_start_up() && !found.head.byte.first());
                self.next = self.answer(start_up, bits, at + len + 1);
            } else {
                self.chain = None;
            }
            self.said.give(self.settled(), out)?;
        }
        bits.forget(self.next.saturating_sub(KEPT));
        Ok(())
    }

    /// A head with its request; whether it is one of a running link that was damaged.
    fn head(&mut self, found: FoundHead, bits: &Bits, at: Range<u64>) -> bool {
        let symbol = found.head.byte.symbol();
        let wrong = self.heads.check(found.head, bits.window(at.start), self.at);
        let from = at.start.saturating_sub(FRONT_BITS.into());
        let front = Window::from_bits(bits.load(from), (at.start - from) as u32).unwrap_or(Window::EMPTY);
        let trailer = self.head.is_some() && self.heads.is_end_damaged(front);
        let place = bits.place(at);
        let damaged = wrong.is_some() && self.delay.is_some();
        let talks = matches!(symbol, Ok(MasterSymbol::Data(_)));
        if let Some(number) = self.lone.take().filter(|_| !talks) {
            self.said.refuse(number, ("lone", LONE.to_owned()));
        }
        self.lone = (talks && !self.talks).then(|| self.said.next());
        self.talks = talks;
        let wrong = wrong.map_or(Ok(()), |rule| Err((rule.name(), rule.to_string())));
        let event = event(place, Direction::Request, "H-frame", master(found.head, symbol), wrong);
        // All of it is in the last word, PARA.
        let mut event = event.locate(|name| {
            let coded = matches!(name, "SYMBOL" | "FIRST" | "MSYNC") && found.len >= 10;
            coded.then(|| Span::even(place, found.len, found.len - 10, found.len - 1))
        });
        event.fields.extend(trailer.then(|| Field::text("note", TRAILER)));
        self.said.push(event);
        self.message_out(symbol, place);
        damaged
    }

    /// Frames follow each other for ever: says where one should have been before the head at `at`.
    fn missed(&mut self, bits: &mut Bits, at: u64) {
        let Some(last) = self.head.replace(at) else {
            bits.paused = None;
            return;
        };
        let (apart, usual) = (at - last, self.apart.unwrap_or(u64::from(H_FRAME_BITS)));
        if bits.paused.take_if(|paused| *paused <= at).is_some() {
            let place = bits.place(last..at);
            self.lose(1);
            let refused = Err(("gap", PAUSED.to_owned()));
            self.said.push(event(place, Direction::Request, "H-frame", Vec::new(), refused));
        } else if apart > LONGEST || apart + 8 >= 2 * usual {
            let missing = ((apart as f64 / usual as f64).round() as u64).saturating_sub(1).max(1);
            for k in 1..=missing {
                let due = last + k * apart / (missing + 1);
                self.lose(1);
                let damage = head_damage(bits.window(due.saturating_sub(3)));
                let place = bits.place(due..due + u64::from(Head::BITS));
                self.said.push(event(
                    place,
                    Direction::Request,
                    "H-frame",
                    Vec::new(),
                    Err((damage.name(), damage.to_string())),
                ));
            }
        } else {
            self.apart = Some(apart);
        }
    }

    fn step(&mut self, value: Option<DeltaDelta>) {
        if let Some(fast) = &mut self.fast {
            fast.step(value);
        }
    }

    /// Frames that were not heard: the fast position and the V-frame go on without them.
    fn lose(&mut self, frames: u8) {
        for _ in 0..frames {
            self.step(None);
        }
        (self.lone, self.chain) = (None, None);
        self.lose_v_frame();
    }

    /// Nobody knows where in a V-frame the next frame is.
    fn lose_v_frame(&mut self) {
        (self.at, self.failed, self.strays) = (None, None, 0);
        if let Some(fast) = &mut self.fast {
            fast.interrupt();
        }
        self.settle(None);
    }

    /// The answer that begins at `from` or some bits later; where to go on.
    fn answer(&mut self, start_up: Option<MasterSymbol>, bits: &Bits, from: u64) -> u64 {
        let line = |delay: u32| bits.window(from + u64::from(delay));
        let usual = match self.delay {
            Some(delay) => delay,
            None => usual_delay(bits, from),
        };
        // The delay of a cable does not change, but it need not be whole bits. What is perfect is where it is; of a
        // damaged answer some words may hold a bit beside it by chance, so there the time decides.
        let since = |delay: u32| bits.time(from + u64::from(delay)) - bits.time(from);
        let off = |delay: u32| self.lag.map_or(0, |lag| (since(delay) - lag).abs());
        let rank = |(delay, score): (u32, usize)| (score >= PERFECT, -off(delay), score);
        let mut best = (usual, score(line(usual)));
        let running = self.lag.is_some_and(|_| off(usual) < bits.half()) && start_up.is_none();
        if !running || best.1 < PERFECT {
            for delay in [usual + 1, usual.saturating_sub(1)] {
                let next = (delay, score(line(delay)));
                best = if rank(next) > rank(best) { next } else { best };
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
            self.step(None);
            self.chain = None;
            self.said.push(event(place, Direction::Answer, "answer", Vec::new(), verdict));
            if self.at == Some(7) {
                self.failed = None;
                self.settle(None);
            }
            self.at = self.at.map(|at| (at + 1) % 8);
            return from;
        }
        self.delay = Some(usual);
        let window = line(delay);
        let end = from + u64::from(delay + ANSWER_BITS);
        match start_up {
            None => self.normal(window, place),
            Some(MasterSymbol::IdReq) => self.identifier(window, place),
            Some(_) => {
                let good = inspect(Expected::TestPattern, window).error().is_none();
                let verdict = if good { Ok(()) } else { Err(("pattern", "the test pattern is damaged".into())) };
                let fields = vec![Field::measured("delay", delay, "bit")];
                self.chain = None;
                self.said.push(event(place, Direction::Answer, "test pattern", fields, verdict));
            }
        }
        end
    }

    fn identifier(&mut self, window: Window, place: Place) {
        self.chain = None;
        let id = Answer::parse(Rule::Strict, window).and_then(EncoderId::from_answer);
        let fields = id.map_or_else(|_| Vec::new(), |id| vec![Field::hex("ENC_ID", id.get(), 5)]);
        self.said.push(event(place, Direction::Answer, "identifier", fields, id.map(|_| ()).map_err(refusal)));
        if let Ok(fast) = id.and_then(FastPosition::new) {
            *self = Self {
                said: std::mem::take(&mut self.said),
                heads: self.heads,
                delay: self.delay,
                lag: self.lag,
                next: self.next,
                head: self.head,
                apart: self.apart,
                fast: Some(fast),
                ..Self::new()
            };
        }
    }

    /// Requests, symbol by symbol.
    fn message_out(&mut self, symbol: Result<MasterSymbol, Error>, place: Place) {
        let Ok(symbol) = symbol else { return };
        if let Some(request) = self.requests.receive(symbol) {
            self.request = Some(request);
            let fields = vec![Field::text("message", request)];
            self.said.push(event(place, Direction::Request, "message", fields, Ok(())));
        }
    }

    /// Answers: what was gathered until the next IDLE.
    fn message_in(&mut self, byte: Option<EncoderByte>, place: Place) {
        if let Some(Ok(EncoderSymbol::Data(nibble))) = byte.map(EncoderByte::symbol) {
            self.nibbles.push(nibble.get());
            return;
        }
        let nibbles = std::mem::take(&mut self.nibbles);
        let (Some(request), false) = (self.request, nibbles.is_empty()) else { return };
        let bytes: Vec<u8> =
            nibbles.chunks(2).map(|pair| pair.iter().fold(0, |byte, nibble| byte << 4 | nibble)).collect();
        let result = match request {
            Request::Short(request) => request.parse_answer(&bytes).map(|answer| Field::text("message", answer)),
            Request::Long(_) => LongAnswer::parse(&bytes).map(|answer| Field::text("message", answer)),
        };
        let fields = result.iter().cloned().collect();
        self.said.push(event(place, Direction::Answer, "message", fields, result.map(|_| ()).map_err(refusal)));
    }
}

/// The delay at which most of the answers after the next heads hold.
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
        // The answer after the next head.
        loop {
            if at + u64::from(Head::BITS) > bits.end() {
                at = bits.end();
                break;
            }
            if let Some(found) = find_head(bits.window(at)) {
                at += u64::from(found.len) + 1;
                break;
            }
            at += 1;
        }
    }
    let best = delays.zip(sums).reduce(|best, next| if next.1 > best.1 { next } else { best });
    best.map_or(0, |(delay, _)| delay)
}

fn master(head: ParsedHead, symbol: Result<MasterSymbol, Error>) -> Vec<Field> {
    let mut fields = Vec::with_capacity(4);
    fields.extend(symbol.ok().map(|symbol| Field::text("SYMBOL", symbol)));
    fields.push(Field::number("FIRST", head.byte.first()));
    fields.push(Field::number("MSYNC", head.byte.msync()));
    if head.extra_bits > 0 {
        fields.push(Field::measured("EXTRA", head.extra_bits, "bit"));
    }
    fields
}
