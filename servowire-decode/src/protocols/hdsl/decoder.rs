//! Decodes bits of the link to frames, answers and messages.

mod answer;
mod heads;
mod known;
mod messages;

use std::io;

use hdsl::frame::{ANSWER_BITS, Head};
use hdsl::inspect::{Beginnings, Chain, Expected, HeadRules, PERFECT, find_head, inspect, score};
use hdsl::sampling::Delay;
use hdsl::{Answer, DeltaDelta, EncoderByte, EncoderId, Error, FastPosition, MasterSymbol, Rule, VFrame, Window};

use known::{Quality, Reach};
use messages::Messages;

use super::bits::{Again, Bits, RESET};
use super::refused::{event, refusal};
use super::said::Said;
use crate::event::{Direction, Field, NO_RESPONSE, Place};
use crate::sink::Sink;
use crate::time::Time;

/// Bits that must be available before a frame is looked for: longest head, direction switch, delay, answer.
const NEED: u64 = 36 + 1 + 12 + ANSWER_BITS as u64;
/// Bits that are taken together if there are enough.
const MANY: u64 = 16 * NEED;
/// Bits that are kept to report what came instead of a frame.
const KEPT: u64 = 4096;
/// Number of frames for which a line counts as shaky after a second look has helped.
const SHAKY: u8 = 32;

/// Minimum number of good words and checks for an answer to be where it was looked for.
const GOOD: usize = 10;
/// Number of answers from which the delay is learned, and of bits that contain them.
const LEARNED: usize = 8;
const LESSON: u64 = 1300;
/// After this many answers that are valid in another place, the delay has changed.
const MOVED: u8 = 3;
/// Assumed for an encoder whose identifier was not seen: 11 bits of acceleration, 40 of position.
const WIDEST: EncoderId = EncoderId::truncate(0x001d3);

/// Two answers between which the running disparity is not continuous.
#[derive(Debug, Clone, Copy)]
struct Break {
    /// Numbers of their events.
    ends: u64,
    begins: u64,
    /// Whether all suspect words of each are covered by a check: in the first by the one of the secondary channel or the
    /// acceleration, in the second by the one of the vertical channel.
    tail_is_checked: bool,
    front_is_checked: bool,
    /// Whether the V-frame of the first has a bad check in channel 2, if the second belongs to another V-frame.
    first_failed: Option<bool>,
}

/// Where an answer is: the delay of the link and its own delay in bits, how valid it is there, and whether one is valid in
/// a place where none has been so far.
#[derive(Debug, Clone, Copy)]
struct Placed {
    usual: u32,
    delay: u32,
    score: usize,
    elsewhere: bool,
}

/// An answer to compare with the next: the running disparity of its words, the number of its event, and whether it is good
/// by itself.
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    chain: Chain,
    number: u64,
    sound: bool,
}

/// What is known about the link so far.
pub(super) struct Decoder {
    /// The bit at which to go on.
    next: u64,
    /// The last head, its number of bits, and its distance from the previous one.
    head: Option<u64>,
    head_len: u64,
    apart: Option<u64>,
    /// The head before it, the end of the answer in that frame, and the head whose frame was examined again.
    before: Option<u64>,
    after: u64,
    again: Option<u64>,
    /// Up to here all edges lie on the grid of that head, even those of later answers, which have their own grids.
    laid: u64,
    /// Number of frames still to be examined again even if they do not fail, because that has recently helped.
    shaky: u8,
    delay: Option<u32>,
    /// Time from the end of a head to its answer, in picoseconds.
    lag: Option<i64>,
    /// Number of consecutive answers that were valid in another place.
    elsewhere: u8,
    /// `None` only for an encoder that it cannot follow.
    fast: Option<FastPosition>,
    /// The identifier, and the range of the safe positions as long as it is unknown.
    id: Option<EncoderId>,
    reach: Reach,
    quality: Quality,
    frame: VFrame,
    /// Place in the V-frame, once VSYNC was seen.
    at: Option<u8>,
    messages: Messages,
    heads: HeadRules,
    /// Whether the last frame carried a nibble; and the number of its head's event, if the frame before did not.
    talks: bool,
    lone: Option<u64>,
    /// Frames since the last head without a nibble.
    since_quiet: u8,
    beginnings: Beginnings,
    /// The previous answer, if there is no frame in between.
    chain: Option<Neighbour>,
    breaks: Vec<Break>,
    /// Whether a check failed in each channel of the last V-frame; `None` while it is incomplete.
    failed: Option<[bool; 2]>,
    /// The first event of this V-frame.
    begun: Option<u64>,
    /// Unexpected or missing VSYNCs.
    strays: u8,
    said: Said,
}

impl Decoder {
    pub(super) fn new() -> Self {
        Self {
            next: 0,
            head: None,
            head_len: Head::BITS.into(),
            apart: None,
            before: None,
            after: 0,
            again: None,
            laid: 0,
            shaky: 0,
            delay: None,
            lag: None,
            elsewhere: 0,
            fast: FastPosition::new(WIDEST).ok(),
            id: None,
            reach: Reach::default(),
            quality: Quality::default(),
            frame: VFrame::default(),
            at: None,
            messages: Messages::new(),
            heads: HeadRules::default(),
            talks: false,
            lone: None,
            since_quiet: 0,
            beginnings: Beginnings::default(),
            chain: None,
            breaks: Vec::new(),
            failed: None,
            begun: None,
            strays: 0,
            said: Said::default(),
        }
    }

    /// Returns the number of the first event that later frames may still affect.
    fn settled(&self) -> u64 {
        let open =
            [self.begun, self.lone, self.chain.map(|chain| chain.number), self.breaks.first().map(|first| first.ends)];
        open.into_iter().flatten().min().unwrap_or(u64::MAX)
    }

    /// Returns the number of bits from which frames are looked for.
    pub(super) fn enough(&self) -> u64 {
        self.next + if self.delay.is_none() { LESSON } else { MANY }
    }

    /// Returns whether the place of the answers is known.
    pub(super) fn is_running(&self) -> bool {
        self.delay.is_some()
    }

    /// Takes the frames whose bits are all available.
    pub(super) fn take(&mut self, bits: &mut Bits, out: &mut dyn Sink) -> io::Result<()> {
        self.take_from(bits, NEED, out)
    }

    /// Takes what is left.
    pub(super) fn finish(&mut self, bits: &mut Bits, out: &mut dyn Sink) -> io::Result<()> {
        self.take_from(bits, u64::from(Head::BITS), out)?;
        // No later head shows that one is missing, so the last edges are examined again for it.
        while self.looks_behind_the_last(bits) {
            self.take_from(bits, u64::from(Head::BITS), out)?;
        }
        self.settle(None);
        self.said.give(u64::MAX, out)
    }

    /// Takes all available frames; fewer than `need` bits are kept for the next call.
    fn take_from(&mut self, bits: &mut Bits, need: u64, out: &mut dyn Sink) -> io::Result<()> {
        while self.next + need <= bits.end() {
            let at = self.next;
            let Some(found) = find_head(bits.window(at)) else {
                self.next += 1;
                continue;
            };
            if self.head.is_none() {
                if need == NEED && at + LESSON > bits.end() {
                    break;
                }
                let first = heads_from(bits, at, u64::from(found.len));
                heads::learn(bits, &first);
                self.heads.learn(&heads::parsed(bits, &first));
            }
            let (mut heads, due) = (self.heads, self.at);
            let mut broken = heads.check(found.head, bits.window(at), due);
            if self.looks_again(bits, at, broken.is_some()) {
                continue;
            }
            if broken.is_some() && self.is_stray(bits, at) {
                self.next += 1;
                continue;
            }
            bits.heard_head(at);
            self.missed(bits, at);
            if self.at != due {
                // It is not the frame that it appeared to be.
                heads = self.heads;
                broken = heads.check(found.head, bits.window(at), self.at);
            }
            self.heads = heads;
            let symbol = found.head.byte.symbol();
            let len = u64::from(found.len);
            let running = self.head(found, broken, bits, at..at + len);
            self.head_len = len;
            self.next = at + len;
            if symbol.is_ok_and(MasterSymbol::is_answered) || running {
                let whole = self.next + 1 + u64::from(ANSWER_BITS) <= bits.end();
                if !whole {
                    break;
                }
                // In a running link no frame asks for a pattern or the identifier.
                let start_up = symbol.ok().filter(|symbol| symbol.is_start_up() && !found.head.byte.first());
                self.next = self.answer(start_up, bits, at, len, running);
                self.after = self.next;
            } else {
                self.after = self.next;
                self.chain = None;
            }
            self.said.give(self.settled(), out)?;
        }
        bits.forget(self.next.saturating_sub(KEPT));
        Ok(())
    }

    fn step(&mut self, value: Option<DeltaDelta>) {
        if let Some(fast) = &mut self.fast {
            fast.step(value);
        }
    }

    /// Accounts for frames that were not heard: the fast position and the V-frame continue without them.
    fn lose(&mut self, frames: u8) {
        for _ in 0..frames {
            self.step(None);
            self.since_quiet = self.since_quiet.saturating_add(1);
        }
        self.chain = None;
        self.lose_v_frame();
    }

    /// Forgets the place of the next frame in its V-frame.
    fn lose_v_frame(&mut self) {
        (self.at, self.failed, self.begun, self.strays) = (None, None, None, 0);
        if let Some(fast) = &mut self.fast {
            fast.interrupt();
        }
        self.settle(None);
    }

    /// Returns where the answer after bit `from` is.
    fn place_of_answer(&self, start_up: bool, bits: &Bits, from: u64) -> Placed {
        let line = |delay: u32| bits.window(from + u64::from(delay));
        let usual = match self.delay {
            Some(delay) => delay,
            None => usual_delay(bits, from),
        };
        // The delay of a cable does not change, but it need not be whole bits. A perfect answer is certainly in its place;
        // some or all words of a damaged answer may be valid one bit beside it by chance, so the time decides there.
        let since = |delay: u32| bits.time_by_next(from + u64::from(delay)) - released(bits, from);
        let off = |delay: u32| self.lag.map_or(0, |lag| (since(delay) - lag).abs());
        let running = self.lag.is_some_and(|_| off(usual) < bits.half()) && !start_up;
        let is_far = |delay: u32| !start_up && !bits.is_jittery() && 2 * off(delay) > 3 * bits.half();
        let holds = |(delay, score): (u32, usize)| score >= PERFECT && (self.elsewhere >= MOVED || !is_far(delay));
        let rank = |it: (u32, usize)| (holds(it), -off(it.0), it.1);
        let mut best = (usual, score(line(usual)));
        let mut elsewhere = best.1 >= PERFECT && is_far(usual);
        if !running || best.1 < PERFECT {
            for delay in [usual + 1, usual.saturating_sub(1)] {
                let next = (delay, score(line(delay)));
                elsewhere |= next.1 >= PERFECT && is_far(delay);
                best = if rank(next) > rank(best) { next } else { best };
            }
        }
        Placed { usual, delay: best.0, score: best.1, elsewhere }
    }

    /// Takes the answer to the head of `len` bits at bit `at`, which may be damaged; returns where to continue.
    fn answer(
        &mut self,
        start_up: Option<MasterSymbol>,
        bits: &mut Bits,
        at: u64,
        len: u64,
        is_head_damaged: bool,
    ) -> u64 {
        let mut from = at + len + 1;
        let mut placed = self.place_of_answer(start_up.is_some(), bits, from);
        self.shaky = self.shaky.saturating_sub(1);
        let before = placed.score;
        if before < PERFECT || self.shaky > 0 || at < self.laid || bits.is_jittery() {
            let beat = bits.beat(at, len, self.before(at));
            bits.lay(at, beat, Again::Answer);
            from = at + find_head(bits.window(at)).map_or(len, |found| found.len.into()) + 1;
            placed = self.place_of_answer(start_up.is_some(), bits, from);
            if before < PERFECT && placed.score >= PERFECT {
                self.shaky = SHAKY;
            }
        }
        let Placed { usual, delay, score, elsewhere } = placed;
        self.elsewhere = if elsewhere { self.elsewhere.saturating_add(1) } else { 0 };
        if is_head_damaged && score < PERFECT {
            // The receiver knew where to look for it.
            self.quality.forget();
        }
        let bits = &*bits;
        let line = |delay: u32| bits.window(from + u64::from(delay));
        if score >= GOOD {
            let now = bits.time_by_next(from + u64::from(delay)) - released(bits, from);
            self.lag = Some(self.lag.map_or(now, |lag| lag + (now - lag) / 8));
        }
        let place = bits.place(from + u64::from(delay)..from + u64::from(delay + ANSWER_BITS));
        let silent = line(0).bits().trailing_ones() > 56;
        if score < 4 || silent {
            let why = if silent { "no answer" } else { "hardly any word of the answer is valid" };
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
                head_len: self.head_len,
                apart: self.apart,
                fast: Some(fast),
                id: id.ok(),
                quality: Quality::of_a_new_link(),
                ..Self::new()
            };
        }
    }

    /// Takes a symbol of the master, which may end a message.
    fn message_out(&mut self, symbol: Result<MasterSymbol, Error>, place: Place) {
        if let Some(field) = symbol.ok().and_then(|symbol| self.messages.asked(symbol)) {
            self.said.push(event(place, Direction::Request, "message", vec![field], Ok(())));
        }
    }

    /// Takes a byte of the encoder, or an unreadable one, which may end a message.
    fn message_in(&mut self, byte: Option<EncoderByte>, place: Place) {
        let symbol = byte.and_then(|byte| byte.symbol().ok());
        let Some(result) = self.messages.answered(symbol) else { return };
        let fields = result.iter().cloned().collect();
        self.said.push(event(place, Direction::Answer, "message", fields, result.map(|_| ()).map_err(refusal)));
    }
}

/// Returns when the line is released after the direction switch, the bit before bit `from`, by the clock of the head.
fn released(bits: &Bits, from: u64) -> Time {
    bits.time(from.saturating_sub(RESET + 1)) + ((RESET + 1) as f64 * bits.mean()) as i64
}

/// Returns the delay at which most answers to the heads of `LEARNED` frames are valid; the first of these heads ends before
/// bit `from`.
fn usual_delay(bits: &Bits, from: u64) -> u32 {
    let delays = 0..=u32::from(Delay::MAX.get()) + 1;
    let mut sums = vec![0; delays.clone().count()];
    let answers = std::iter::successors(Some(from), |at| {
        let (at, len) = next_head(bits, at + u64::from(ANSWER_BITS))?;
        Some(at + len + 1)
    });
    for at in answers.take(LEARNED).take_while(|at| at + u64::from(ANSWER_BITS) < bits.end()) {
        for (delay, sum) in delays.clone().zip(&mut sums) {
            *sum += score(bits.window(at + u64::from(delay)));
        }
    }
    let best = delays.zip(sums).reduce(|best, next| if next.1 > best.1 { next } else { best });
    best.map_or(0, |(delay, _)| delay)
}

/// Returns the heads in the first bits of a link, starting with the one of `len` bits at bit `at`.
fn heads_from(bits: &Bits, at: u64, len: u64) -> Vec<(u64, u64)> {
    let next = |(at, len): &(u64, u64)| next_head(bits, at + len);
    std::iter::successors(Some((at, len)), next).take_while(|(head, _)| head - at <= LESSON).collect()
}

/// Returns where the next head begins, at bit `from` or later, and its number of bits.
fn next_head(bits: &Bits, from: u64) -> Option<(u64, u64)> {
    (from..(bits.end() + 1).saturating_sub(Head::BITS.into()))
        .find_map(|at| find_head(bits.window(at)).map(|found| (at, u64::from(found.len))))
}
