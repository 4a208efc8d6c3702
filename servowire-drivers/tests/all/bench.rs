//! An encoder on a hostile line behind a UART whose time runs by the look at the clock.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::fmt::Debug;
use std::rc::Rc;

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use servowire_drivers::{Clock, ClockError, Worst};
use servowire_world::{
    Delivery, Event, Framing, Host, Id, Kind, Message, Scenario, Tally, Transmission, Truth, Unit, Verdict, Wire, World,
};
use tformat::device::Device;
use tformat::master::Line;
use tformat::{Abm, Abs, BitRate};

use crate::hostile::{Calls, Excuse, rates};
use crate::second::tformat::Encoder;

const WIRE: Wire = Wire { bit_ps: 400_000, framing: Framing::StartStop { width: 8 }, devices: 1 };
/// A look at the clock.
const LOOK_NS: u64 = 100;
/// This UART sends at once, and a wait is over within a look. Its clock is exact.
pub const WORST: Worst = Worst { uart_start_ns: 0, wake_ns: LOOK_NS as u32, clock_ns: 1 };

/// What a UART does with a byte whose stop bit is wrong: the three ways of the HALs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misframed {
    /// Drops it without a word.
    Dropped,
    /// Gives it as if it were good.
    Delivered,
    /// Gives an error, and loses all that it holds.
    Reported,
}

pub struct Bench {
    world: World,
    encoder: Device<6>,
    /// Encoders of the tests' own, in its place.
    pub seconds: Vec<Encoder>,
    misframed: Misframed,
    fifo: VecDeque<Option<u8>>,
    sent_until_ns: u64,
    /// The last request, and what of it the first encoder has heard.
    asked: Vec<(u64, bool)>,
    heard: Vec<(u64, bool)>,
    /// Bytes that the encoder has heard; the shaft moves with each.
    turns: u32,
    pub request: Option<Id>,
    pub driver_on: bool,
    pub on_at_ns: u64,
    pub off_at_ns: u64,
    /// How often the host had been preempted when the last call was judged.
    preempts: u64,
    /// Bytes that the UART had lost then.
    overruns: u64,
    /// The port is an SPI, which sends and samples by one clock. The line may delay its request all the same; nothing is asked of
    /// such a call.
    pub sampled: bool,
}

pub type Shared = Rc<RefCell<Bench>>;

/// What the truth says of a call.
pub struct Heard {
    /// Of its position, if it gave one.
    pub verdict: Option<Verdict>,
    /// Whether request and answer came through unhurt.
    pub whole: bool,
    pub preempted: bool,
    /// Whether an old position is one that no driver could have told from an answer.
    pub coincidence: bool,
}

impl Bench {
    pub fn new(scenario: Scenario, misframed: Misframed) -> Shared {
        Self::with(scenario, misframed, 1)
    }

    /// So many encoders with one address.
    pub fn with(scenario: Scenario, misframed: Misframed, devices: u8) -> Shared {
        Rc::new(RefCell::new(Self {
            world: World::new(Wire { devices, ..WIRE }, scenario),
            encoder: Device::new(0x17, BitRate::Mbit2_5),
            seconds: Vec::new(),
            misframed,
            fifo: VecDeque::new(),
            sent_until_ns: 0,
            asked: Vec::new(),
            heard: Vec::new(),
            turns: 0,
            request: None,
            driver_on: false,
            on_at_ns: 0,
            off_at_ns: 0,
            preempts: 0,
            overruns: 0,
            sampled: false,
        }))
    }

    /// Whether the host was preempted since the last call was judged: it breaks the latency budget then.
    pub fn was_preempted(&self) -> bool {
        self.tally().of(Kind::Preempt) > self.preempts
    }

    /// Judges a call by the truth: it was dropped, gave this position of the shaft, or failed. A value is never older than
    /// its request, and no call fails whose request and answer came through whole, whatever has happened before.
    pub fn judge<E: Debug>(&mut self, calls: &mut Calls, outcome: Option<Result<u32, E>>, seed: u64, call: usize) {
        assert!(!self.driver_on, "seed {seed}, call {call}");
        let preempted = self.was_preempted();
        self.preempts = self.tally().of(Kind::Preempt);
        let truth = self.world.truth();
        let Some(request) = self.request else { return };
        let Some(sent) = truth.transmission(request) else { return };
        let in_time = |answer: &Transmission| {
            // A request that leaves late is answered late.
            let soon =
                answer.start_ns <= sent.asked_ns + 4_000 + 9_000 && answer.delivered_ns <= answer.end_ns + HAND_OVER_NS;
            soon && answer.end_ns - answer.start_ns == ANSWER_NS
        };
        let left = !self.sampled || sent.start_ns == sent.asked_ns && sent.end_ns == sent.sent_ns;
        // Who samples also sees what no UART takes for a byte.
        let own = |t: &Transmission| t.id == request || t.answers == Some(request) || t.end_ns <= sent.start_ns;
        let alone = !self.sampled || truth.transmissions().all(own);
        let whole =
            left && alone && !preempted && truth.undisturbed(request) && truth.intact_answers(request).any(in_time);
        // Nothing in the window of an SPI is older than the request, not even if the host was busy elsewhere.
        let coincidence = matches!(outcome, Some(Ok(shaft)) if truth.is_coincidence(request, shaft.into()));
        let excuse = Excuse::of(!self.sampled && preempted, if self.sampled { !left } else { coincidence });
        let outcome = outcome.map(|result| result.map(|shaft| truth.verdict(request, shaft.into())));
        calls.count(outcome, whole, excuse, seed, call);
        let past_ns = self.now_ns().saturating_sub(1_000_000);
        self.world.truth_mut().forget_before(past_ns);
    }

    pub fn world(&mut self) -> &mut World {
        &mut self.world
    }

    pub fn truth(&self) -> &Truth {
        self.world.truth()
    }

    pub fn encoder(&mut self) -> &mut Device<6> {
        &mut self.encoder
    }

    pub fn tally(&self) -> Tally {
        *self.world.tally()
    }

    pub fn now_ns(&self) -> u64 {
        self.world.now_ns()
    }

    /// Time goes on, and what happens meanwhile happens.
    pub fn pass(&mut self, until_ns: u64) {
        loop {
            match self.world.next(until_ns) {
                Event::Time { .. } => return,
                Event::Delivered(block) => self.take(&block.bytes().collect::<Vec<_>>()),
                Event::Heard { device, unit } => {
                    self.turns += 1;
                    if device == 0 && Some(unit.origin.transmission) == self.request {
                        self.heard.push(unit.bits.content());
                    }
                    let shaft = place(self.turns);
                    if let Some((bytes, start_ns)) = self.answer(device, &unit, shaft) {
                        let message = Message::bytes(&bytes).tagged(shaft.into());
                        self.world.answer(device, unit.origin.transmission, &message, start_ns);
                    }
                }
            }
        }
    }

    /// What an encoder answers to a byte with its shaft there, and when.
    fn answer(&mut self, device: u8, unit: &Unit, shaft: u32) -> Option<(Vec<u8>, u64)> {
        let (byte, framed) = unit.bits.content();
        let now_ns = self.world.now_ns();
        if let Some(second) = self.seconds.get_mut(usize::from(device)) {
            second.abs = shaft;
            return second.hear(byte as u8, framed, now_ns).map(|answer| (answer.bytes, answer.start_ns));
        }
        self.encoder.set_position(Abs::truncate(shaft), Abm::truncate(3));
        let answer = if framed { self.encoder.hear(&[byte as u8], now_ns) } else { self.encoder.framing_error(now_ns) };
        answer.map(|answer| (answer.frame.as_bytes().to_vec(), answer.start_ns))
    }

    /// The encoders lose their supply for a moment.
    pub fn restart(&mut self) {
        let now_ns = self.now_ns();
        self.seconds.iter_mut().for_each(|encoder| encoder.restart(now_ns));
    }

    /// Another master asks.
    pub fn intrude(&mut self, bytes: &[u8], at_ns: u64) {
        self.world.intrude(&Message::bytes(bytes), at_ns);
    }

    /// The truth of the last call, which gave this position if any.
    pub fn verdict(&mut self, shaft: Option<u32>) -> Heard {
        // Bytes that a UART loses without a word are not counted back over in a block.
        let preempted = self.was_preempted() || self.tally().overrun > self.overruns;
        (self.preempts, self.overruns) = (self.tally().of(Kind::Preempt), self.tally().overrun);
        let truth = self.world.truth();
        let request = self.request.and_then(|id| truth.transmission(id));
        let given = shaft.zip(request).map(|(shaft, request)| (request.id, shaft.into()));
        let verdict = given.map(|(request, shaft)| truth.verdict(request, shaft));
        let coincidence = given.is_some_and(|(request, shaft)| truth.is_coincidence(request, shaft));
        let whole = request.is_some_and(|sent| {
            let gapless = |t: &Transmission| t.end_ns - t.start_ns == 4_000 * t.units as u64;
            let in_time = |answer: &Transmission| {
                let own = answer.start_ns == answer.asked_ns && answer.delivered_ns <= answer.end_ns + HAND_OVER_NS;
                own && gapless(answer) && answer.start_ns <= sent.sent_ns + 10_000
            };
            let left = sent.start_ns == sent.asked_ns && sent.end_ns == sent.sent_ns && gapless(sent);
            left && self.heard == self.asked && truth.undisturbed(sent.id) && truth.intact_answers(sent.id).any(in_time)
        });
        let past_ns = self.now_ns().saturating_sub(1_000_000);
        self.world.truth_mut().forget_before(past_ns);
        Heard { verdict, whole, preempted, coincidence }
    }

    fn take(&mut self, bytes: &[(u8, bool)]) {
        for (byte, framed) in bytes {
            match (framed, self.misframed) {
                (true, _) | (false, Misframed::Delivered) => self.fifo.push_back(Some(*byte)),
                (false, Misframed::Dropped) => {}
                (false, Misframed::Reported) => self.fifo.push_back(None),
            }
        }
    }
}

/// Where the shaft is, 23 bits: so far from all places before that two wrong bits, which the check field may not see, do not lead to
/// one of them.
pub fn place(turn: u32) -> u32 {
    turn.wrapping_mul(0x15_4a37) & 0x7f_ffff
}

pub struct Watch(pub Shared);

impl Clock for Watch {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut bench = self.0.borrow_mut();
        let until_ns = bench.now_ns() + LOOK_NS;
        bench.pass(until_ns);
        Ok(bench.now_ns())
    }
}

pub struct Uart(pub Shared);

impl ErrorType for Uart {
    type Error = ErrorKind;
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let mut bench = self.0.borrow_mut();
        let begin_ns = bench.sent_until_ns.max(bench.now_ns());
        let id = bench.world.send(&Message::bytes(bytes), begin_ns);
        bench.request = Some(id);
        bench.asked = bytes.iter().map(|byte| (u64::from(*byte), true)).collect();
        bench.heard.clear();
        bench.sent_until_ns = begin_ns + 4_000 * bytes.len() as u64;
        Ok(bytes.len())
    }

    /// Lies, as many do: the bytes are still going out.
    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.0.borrow().fifo.is_empty())
    }
}

impl Uart {
    /// What a read gives at once, if anything.
    pub fn try_read(&mut self, bytes: &mut [u8]) -> Option<Result<usize, ErrorKind>> {
        let fifo = &mut self.0.borrow_mut().fifo;
        let mut count = 0;
        while let (Some(place), Some(byte)) = (bytes.get_mut(count), fifo.front().copied()) {
            match byte {
                Some(byte) => *place = byte,
                None if count > 0 => break,
                None => {
                    fifo.clear();
                    return Some(Err(ErrorKind::Other));
                }
            }
            fifo.pop_front();
            count += 1;
        }
        (count > 0).then_some(Ok(count))
    }
}

impl Read for Uart {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        self.try_read(bytes).expect("the driver reads only what is there")
    }
}

pub struct Pin(pub Shared);

impl PinErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        let mut bench = self.0.borrow_mut();
        bench.driver_on = false;
        bench.off_at_ns = bench.now_ns();
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut bench = self.0.borrow_mut();
        bench.driver_on = true;
        bench.on_at_ns = bench.now_ns();
        Ok(())
    }
}

/// The same faults at a host that hears at once: for who samples the line himself.
pub fn sampled_scenario(seed: u64) -> Scenario {
    let scenario = Scenario::random(seed, rates(12));
    Scenario { host: Host { echo: scenario.host.echo, ..Host::IDEAL }, ..scenario }
}

/// A host that hears itself or not whatever the driver was told, and whose UART holds 16 bytes and hands them over one by one, up to
/// 2 us late, or in DMA blocks, or at idle: a field of silence, up to 1 us late.
pub fn scenario(seed: u64) -> Scenario {
    let scenario = Scenario::random(seed, rates(12));
    let idle_ns = 4_000;
    let (delivery, most_ns) = match seed / 3 % 3 {
        0 => (Delivery::Each, 2_000),
        1 => (Delivery::Blocks { units: 4, idle_ns }, 1_000),
        _ => (Delivery::Idle { idle_ns }, 1_000),
    };
    let latency_ns = scenario.host.latency_ns % most_ns;
    let host = Host { echo: scenario.host.echo, delivery, latency_ns, fifo: 16, ..Host::IDEAL };
    Scenario { host, ..scenario }
}

/// Eleven fields.
const ANSWER_NS: u64 = 44_000;

/// The longest time from the end of an answer to its hand-over by such a host.
pub const HAND_OVER_NS: u64 = 5_000;

/// A line at such a host: a block is handed over up to ten fields after the first of its bytes.
pub fn line() -> Line {
    Line::new(BitRate::Mbit2_5).with_hand_over_ns(50_000)
}
