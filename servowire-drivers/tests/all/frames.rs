//! A-format encoders on a hostile line behind a port of frames whose time runs by the look at the clock.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::fmt::Debug;
#[cfg(feature = "async")]
use std::future::poll_fn;
use std::rc::Rc;
#[cfg(feature = "async")]
use std::task::Poll;

use nikon_aformat::bus::{Bus, Outcome};
use nikon_aformat::device::Device;
use nikon_aformat::master::Line;
use nikon_aformat::{BitRate, EncoderAddress, RequestFrame, Resolution};
#[cfg(feature = "async")]
use servowire_drivers::Timer;
use servowire_drivers::nikon::{Frame, blocking};
use servowire_drivers::{Clock, ClockError};
use servowire_world::{
    Delivery, Event, Framing, Host, Id, Kind, Message, Scenario, Speaker, Transmission, Verdict, Wire, World,
};

use crate::hostile::{Calls, Excuse, rates};
#[cfg(feature = "async")]
use crate::polls::pause;
use crate::second::nikon::Encoder;

/// 2.5 Mbit/s: a frame is 7.2 us.
pub const RATE: BitRate = BitRate::Mbit2_5;
const WIRE: Wire = Wire { bit_ps: 400_000, framing: Framing::StartStop { width: 16 }, devices: 1 };
const LOOK_NS: u64 = 100;
const FRAME_NS: u64 = 7_200;
const ANSWER_NS: u64 = 4 * FRAME_NS;

pub struct Bench {
    pub world: World,
    pub encoders: Vec<Device<1>>,
    /// Encoders of the tests' own, in their place.
    pub seconds: Vec<Encoder>,
    /// The contents of the last request, and what each encoder has heard since, with its framing.
    asked: Vec<u16>,
    heard: Vec<(u8, u16, bool)>,
    pub fifo: VecDeque<Frame>,
    /// Whether frames carry the time of their end.
    stamped: bool,
    /// Frames that the first encoder has heard; each turns the shaft on.
    turns: u32,
    /// Where the shaft was when the encoders heard the last request.
    pub asked_at: u32,
    pub request: Option<Id>,
    /// How often the host had been preempted when the last call ended.
    preempts: u64,
    /// The port is an SPI, which sends and samples by one clock. The line may delay its request all the same; nothing is asked of
    /// such a call.
    pub sampled: bool,
}

pub type Shared = Rc<RefCell<Bench>>;

impl Bench {
    pub fn new(scenario: Scenario) -> Shared {
        Self::with(scenario, 1, false)
    }

    /// So many encoders, with the addresses from 0 up.
    pub fn with(scenario: Scenario, encoders: u8, stamped: bool) -> Shared {
        let encoder = |ea| Device::new(EncoderAddress::truncate(ea), Resolution::default(), RATE);
        Rc::new(RefCell::new(Self {
            world: World::new(Wire { devices: encoders, ..WIRE }, scenario),
            encoders: (0..encoders).map(encoder).collect(),
            seconds: Vec::new(),
            asked: Vec::new(),
            heard: Vec::new(),
            fifo: VecDeque::new(),
            stamped,
            turns: 0,
            asked_at: 0,
            request: None,
            preempts: 0,
            sampled: false,
        }))
    }

    /// Whether the host was preempted in this call: it breaks the latency budget then.
    pub fn was_preempted(&self) -> bool {
        self.world.tally().of(Kind::Preempt) > self.preempts
    }

    /// A call is over and judged.
    pub fn end_call(&mut self) {
        self.preempts = self.world.tally().of(Kind::Preempt);
        let past_ns = self.world.now_ns().saturating_sub(1_000_000);
        self.world.truth_mut().forget_before(past_ns);
    }

    /// Judges a call with one encoder by the truth: it was dropped, gave the value of this turn of the shaft, or failed. A value is
    /// never older than its request, and no call fails whose request and answer came through whole, whatever has happened before.
    pub fn judge<E: Debug>(&mut self, calls: &mut Calls, outcome: Option<Result<u32, E>>, seed: u64, call: usize) {
        let Some(request) = self.request else { return };
        let truth = self.world.truth();
        let Some(sent) = truth.transmission(request) else { return };
        // A request that leaves late is answered late.
        let on_time = |answer: &Transmission| {
            answer.start_ns < sent.asked_ns + FRAME_NS + 15_000 && answer.end_ns - answer.start_ns == ANSWER_NS
        };
        let left = !self.sampled || sent.start_ns == sent.asked_ns && sent.end_ns == sent.sent_ns;
        // Who samples also sees what no receiver takes for a frame.
        let own = |t: &Transmission| t.id == request || t.answers == Some(request) || t.end_ns <= sent.start_ns;
        let alone = !self.sampled || truth.transmissions().all(own);
        let undisturbed = left && alone && !self.was_preempted() && truth.undisturbed(request);
        let whole = undisturbed && truth.intact_answers(request).any(on_time);
        self.verdict(calls, outcome, whole, request, seed, call);
        self.end_call();
    }

    /// Judges what a call said of one of several encoders: an answer that came through whole is not lost, whatever became of the
    /// others.
    pub fn judge_one<E: Debug>(&self, calls: &mut Calls, ea: u8, outcome: Result<u32, E>, seed: u64, call: usize) {
        let Some(request) = self.request else { return };
        if self.world.truth().transmission(request).is_some() {
            self.verdict(calls, Some(outcome), self.came_whole_of(ea), request, seed, call);
        }
    }

    /// Whether the answer of this encoder of several came through whole and in time.
    fn came_whole_of(&self, ea: u8) -> bool {
        let (truth, now_ns) = (self.world.truth(), self.world.now_ns());
        let Some(sent) = self.request.and_then(|request| truth.transmission(request)) else { return false };
        // A request that comes twice is answered twice.
        let sent_once = sent.start_ns == sent.asked_ns && sent.end_ns == sent.sent_ns;
        let on_time = |answer: &Transmission| {
            let own = answer.speaker == Speaker::Device(ea) && answer.delivered_ns < now_ns;
            own && answer.start_ns == answer.asked_ns && answer.end_ns - answer.start_ns == ANSWER_NS
        };
        let whole = !self.was_preempted() && sent_once && truth.intact_answers(sent.id).any(on_time);
        whole && self.has_heard_request(ea)
    }

    /// Whether this encoder has heard the request as it was asked. The three check bits of a request pass two wrong bits: what it
    /// answers to another command is no answer to this one.
    fn has_heard_request(&self, ea: u8) -> bool {
        self.asked.iter().all(|content| self.heard.contains(&(ea, *content, true)))
    }

    /// Judges what a bus said of one of its encoders, unless nobody can say what it should be.
    pub fn judge_of_bus(
        &self,
        calls: &mut Calls,
        bus: &Bus,
        ea: EncoderAddress,
        value: Result<u32, &str>,
        seed: u64,
        call: usize,
    ) {
        // Somebody repeats an old answer: which one is the encoder's is not known, so none is given.
        if value.is_err() && bus.duplicates().contains(ea) {
            return;
        }
        if value.is_err() && self.has_chance(bus) {
            calls.chances += u64::from(self.came_whole_of(ea.get()));
            return;
        }
        self.judge_one(calls, ea.get(), value, seed, call);
    }

    /// Whether the CRC-8 of one of these responses is right by chance: of two that overlap nobody can tell which one was sent.
    pub fn has_chance(&self, bus: &Bus) -> bool {
        let (truth, Some(request)) = (self.world.truth(), self.request) else { return false };
        EncoderAddress::ALL.into_iter().any(|ea| match bus.of(ea) {
            Outcome::Good(response) | Outcome::Extra(response) => {
                truth.verdict(request, shaft(response).into()) == Verdict::Unknown
            }
            _ => false,
        })
    }

    fn verdict<E: Debug>(
        &self,
        calls: &mut Calls,
        outcome: Option<Result<u32, E>>,
        whole: bool,
        request: Id,
        seed: u64,
        call: usize,
    ) {
        let truth = self.world.truth();
        let coincidence = matches!(outcome, Some(Ok(shaft)) if truth.is_coincidence(request, shaft.into()));
        let outcome = outcome.map(|result| result.map(|shaft| truth.verdict(request, shaft.into())));
        calls.count(outcome, whole, Excuse::of(self.was_preempted(), coincidence), seed, call);
    }

    pub fn pass(&mut self, until_ns: u64) {
        loop {
            match self.world.next(until_ns) {
                Event::Time { .. } => return,
                Event::Delivered(block) => {
                    let frames = block.units.iter().map(|unit| {
                        let (content, framed) = unit.bits.content();
                        Frame { content: content as u16, framed, end_ns: self.stamped.then_some(unit.end_ns) }
                    });
                    self.fifo.extend(frames);
                }
                Event::Heard { device, unit } => {
                    let (content, framed) = unit.bits.content();
                    if device == 0 {
                        self.turns += 1;
                    }
                    self.heard.push((device, content as u16, framed));
                    let Some((contents, start_ns)) = self.answer(device, content as u16, framed, unit.end_ns) else {
                        continue;
                    };
                    self.asked_at = place(self.turns);
                    let message = Message::frames(16, contents).tagged(place(self.turns).into());
                    self.world.answer(device, unit.origin.transmission, &message, start_ns);
                }
            }
        }
    }

    /// What an encoder says to a frame, and when.
    fn answer(&mut self, device: u8, content: u16, framed: bool, end_ns: u64) -> Option<(Vec<u64>, u64)> {
        if let Some(second) = self.seconds.get_mut(usize::from(device)) {
            second.single = place(self.turns);
            let answer = second.hear(content, framed, end_ns)?;
            return Some((answer.frames.into_iter().map(u64::from).collect(), answer.start_ns));
        }
        let encoder = self.encoders.get_mut(usize::from(device))?;
        encoder.set_position(place(self.turns), 3 + u32::from(device));
        if !framed {
            encoder.framing_error(end_ns);
            return None;
        }
        let answer = encoder.hear(&[Some(content)], end_ns)?;
        Some((answer.frames.contents().iter().map(|content| u64::from(*content)).collect(), answer.start_ns))
    }

    /// The encoders lose their supply for a moment.
    pub fn restart(&mut self) {
        self.seconds.iter_mut().for_each(Encoder::restart);
    }

    /// Another master asks.
    pub fn intrude(&mut self, content: u16, at_ns: u64) {
        self.world.intrude(&Message::frames(16, [u64::from(content)]), at_ns);
    }

    /// Whether what all encoders have heard first since the last request was asked is that request.
    pub fn is_heard(&self) -> bool {
        (0..self.seconds.len() as u8).all(|device| {
            let heard = self.heard.iter().filter(|(by, ..)| *by == device).take(self.asked.len());
            heard.map(|(_, content, framed)| (*content, *framed)).eq(self.asked.iter().map(|content| (*content, true)))
        })
    }

    /// Whether request and answer of the last call came through whole and in time, so that it may not fail.
    pub fn came_whole(&self) -> bool {
        let Some(request) = self.request else { return false };
        let truth = self.world.truth();
        let Some(sent) = truth.transmission(request) else { return false };
        let gapless = |t: &Transmission| t.end_ns - t.start_ns == FRAME_NS * t.units as u64;
        let in_time = |t: &Transmission| t.start_ns == t.asked_ns && gapless(t) && t.start_ns <= sent.sent_ns + 15_000;
        let left = sent.start_ns == sent.asked_ns && sent.end_ns == sent.sent_ns;
        let undisturbed = left && self.is_heard() && !self.was_preempted() && truth.undisturbed(request);
        undisturbed && truth.intact_answers(request).any(in_time)
    }

    pub fn send(&mut self, frames: &[u16], gap_bits: u32) {
        let contents = frames.iter().map(|content| u64::from(*content));
        let message = Message::frames(16, contents).with_gap_bits(gap_bits as usize);
        let now_ns = self.world.now_ns();
        (self.asked, self.heard) = (frames.to_vec(), Vec::new());
        self.request = Some(self.world.send(&message, now_ns));
    }
}

/// Port, clock and timer.
#[derive(Clone)]
pub struct Port(pub Shared);

impl blocking::FramePort for Port {
    type Error = Infallible;

    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Infallible> {
        let contents: Vec<_> = frames.iter().map(|frame| frame.content()).collect();
        self.0.borrow_mut().send(&contents, gap_bits);
        Ok(())
    }

    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        Ok(self.0.borrow_mut().fifo.pop_front())
    }
}

#[cfg(feature = "async")]
impl servowire_drivers::nikon::asynch::FramePort for Port {
    type Error = Infallible;

    async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Infallible> {
        blocking::FramePort::send(self, frames, gap_bits)
    }

    async fn take(&mut self) -> Result<Frame, Infallible> {
        poll_fn(|_| self.0.borrow_mut().fifo.pop_front().map_or(Poll::Pending, |frame| Poll::Ready(Ok(frame)))).await
    }
}

impl Clock for Port {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut bench = self.0.borrow_mut();
        let until_ns = bench.world.now_ns() + LOOK_NS;
        bench.pass(until_ns);
        Ok(bench.world.now_ns())
    }
}

#[cfg(feature = "async")]
impl Timer for Port {
    async fn wait_ns(&mut self, _: u64) {
        pause().await;
    }
}

pub fn line() -> Line {
    Line::new(RATE).with_response_timeout_ns(20_000)
}

/// How a port hands frames over: one by one, in blocks of two, or when the line is idle; a FIFO of six frames.
pub fn deliveries() -> [Delivery; 3] {
    [Delivery::Each, Delivery::Blocks { units: 2, idle_ns: 8_000 }, Delivery::Idle { idle_ns: 8_000 }]
}

pub fn host(echo: bool, delivery: Delivery) -> Host {
    Host { echo, delivery, fifo: 6, ..Host::IDEAL }
}

/// A host and its faults, for calls with this many encoders: one or two a call.
pub fn scenario(seed: u64, encoders: u32, delivery: Delivery) -> Scenario {
    let scenario = Scenario::random(seed, rates(2 + 2 * encoders));
    Scenario { host: host(scenario.host.echo, delivery), ..scenario }
}

/// Where the shaft is, 20 bits: the last ten of the count, and their complement. Where two speak at once a 0 wins, and as all places
/// have ten bits set, an answer that somebody else has cleared bits of never names another place.
pub fn place(turn: u32) -> u32 {
    let count = turn & 0x3ff;
    count | (count ^ 0x3ff) << 10
}

/// Where the shaft is by the whole position of an encoder.
pub fn shaft(response: nikon_aformat::Response) -> u32 {
    response.abs40().map_or(0, |abs| (abs.get() & 0xf_ffff) as u32)
}

#[test]
fn no_place_is_another_one_with_bits_cleared() {
    for (one, other) in (0..1024).flat_map(|one| (0..one).map(move |other| (place(one), place(other)))) {
        assert!(one & other != one && one & other != other && (one | other) < 1 << 20);
    }
}
