//! Master and encoder on the hostile line, and who judges the master.

use core::convert::Infallible;
use core::fmt;
use std::collections::BTreeSet;

use servowire_core::{Ended, Procedure};
use servowire_world::{
    Block, Delivery, Draw, Event, Framing, Id, Message, Scenario, Speaker, Stamp, Tally, Transmission, Truth, Verdict,
    Wire, World,
};
use tformat::device::{Behaviour, Device};
use tformat::master::{Detection, Line, Progress, Step, Transaction};
use tformat::{
    Abm, Abs, Address, AllData, BitRate, Doubt, Error, Evidence, Policy, Request, Resolution, Response, Sample,
    Tolerated,
};

/// What was seen in a run besides the line's own tally.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    pub done: u64,
    pub failed: u64,
    /// Good answers that had to be taken, and were.
    pub owed: u64,
    /// Values that no master can tell from an answer: foreign speakers, answers after `ready_ns`.
    pub forged: u64,
    /// Damage that the XOR does not see.
    pub undetected: u64,
    /// Exchanges of which the latency was beyond the budget.
    pub beyond_budget: u64,
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { done, failed, owed, forged, undetected, beyond_budget } = self;
        write!(f, "{done} done ({owed} owed), {failed} failed, {forged} forged, {undetected} undetected, ")?;
        write!(f, "{beyond_budget} beyond the budget")
    }
}

/// Field and bit by the documents: 4 us and 400 ns, or half of it.
const fn field_ns(rate: BitRate) -> u64 {
    match rate {
        BitRate::Mbit2_5 => 4_000,
        BitRate::Mbit5 => 2_000,
    }
}

/// A host with a master, and an encoder with six pages.
pub struct Bench {
    pub world: World,
    pub device: Device<6>,
    pub line: Line,
    pub ready_ns: u64,
    pub seen: Seen,
    /// Resets that the encoder heard, and writes that it answered, which the host did not send like that: damage that it cannot
    /// see, or another speaker.
    pub forged_requests: u32,
    /// Reads of the memory like that.
    pub forged_reads: u32,
    /// The four fields that the encoder heard last: of which request of the host, and where in it; `None` for any other.
    fields: [Option<(Id, u16)>; 4],
    /// Bytes that the encoder heard and that the host did not send like that or not then: its count of resets may have begun
    /// again.
    pub misheard: u32,
    /// Readings of position or turns that no master can tell from true ones, or whose damage the XOR does not see. What rests
    /// on them may be wrong.
    pub misread: u32,
    /// Whether the shaft moves with every request, so that each response has a value of its own.
    pub moves: bool,
    /// Whether the shaft stands on the boundary of a turn and goes over it and back with every request.
    pub trembles: bool,
    turn: u32,
    budget_ns: u64,
    response_ns: u64,
    behaviour: Behaviour,
    /// The host has other things to ask and mixes outcomes up: now and then a procedure is given that of another request,
    /// which was sent in place of its own.
    pub astray: Option<Draw>,
    /// The supply of the encoder fails: now and then it restarts before a request. It keeps its memory, its position and the
    /// turns; the page register and the count of resets start over.
    pub restarts: Option<Draw>,
    /// Effects before the last restart.
    effects: u32,
}

impl Bench {
    pub fn new(scenario: Scenario, rate: BitRate, behaviour: Behaviour, hint: bool) -> Self {
        let bit_ps = field_ns(rate) * 100;
        let host = scenario.host;
        let wire = Wire { bit_ps, framing: Framing::StartStop { width: 8 }, devices: 1 };
        let line = Line::new(rate);
        // What the user has to know of the hardware: how late bytes are handed over.
        let block_ns = 16 * field_ns(rate) as u32 + 20_000;
        let hand_over_ns = host.latency_ns
            + match host.delivery {
                Delivery::Each => 0,
                Delivery::Blocks { idle_ns, .. } | Delivery::Idle { idle_ns } => block_ns + idle_ns,
            };
        let line = line.with_hand_over_ns(line.hand_over_ns.max(hand_over_ns));
        let mut device = Device::new(0x17, rate);
        device.set_behaviour(behaviour);
        Self {
            world: World::new(wire, scenario),
            device,
            line: if hint { line.with_echo() } else { line },
            ready_ns: 100_000,
            seen: Seen::default(),
            forged_requests: 0,
            forged_reads: 0,
            fields: [None; 4],
            misheard: 0,
            misread: 0,
            moves: true,
            trembles: false,
            turn: 0,
            // Four bits of turn-around and a field.
            budget_ns: field_ns(rate) * 14 / 10,
            response_ns: 11 * field_ns(rate),
            behaviour,
            astray: None,
            restarts: None,
            effects: 0,
        }
    }

    /// Effects of resets, over all restarts.
    pub fn effects(&self) -> u32 {
        self.effects + self.device.effects()
    }

    fn restart(&mut self) {
        let (abs, abm, memory) = (self.device.abs(), self.device.abm(), *self.device.eeprom_mut());
        self.effects = self.effects();
        self.device = Device::new(0x17, self.line.rate);
        self.device.set_behaviour(self.behaviour);
        self.device.set_position(abs, abm);
        *self.device.eeprom_mut() = memory;
    }

    /// With a host that mixes outcomes up.
    pub fn mixing_up(mut self, seed: u64) -> Self {
        let mut draw = Draw::default();
        for _ in 0..seed % 64 {
            let _ = draw.below(2);
        }
        self.astray = Some(draw);
        self
    }

    /// What is sent where a procedure wants `request`, another one once in twelve times. One reset alone does nothing.
    fn sent_for(&mut self, request: Request) -> Request {
        let Some(draw) = &mut self.astray else { return request };
        if draw.below(12) > 0 {
            return request;
        }
        let all = [
            Request::ReadAll,
            Request::ReadMultiTurn,
            Request::ResetErrors,
            Request::SetSingleTurnZero,
            Request::ResetTurnsAndErrors,
            Request::read_eeprom(Address::truncate(0x33)),
        ];
        all[draw.below(6) as usize]
    }

    /// One request, judged by the laws of time.
    pub fn exchange(&mut self, request: Request, not_before_ns: u64) -> Ended<Response, Error> {
        if self.restarts.as_mut().is_some_and(|draw| draw.below(12) == 0) {
            self.restart();
        }
        if self.moves {
            self.turn += 1;
            let (abs, abm) = self.shaft();
            self.device.set_position(Abs::truncate(abs), Abm::truncate(abm));
        }
        if self.trembles {
            // 0x7f_ffff and 0 are neighbours.
            let (over, turns) = (self.device.abs().get() == 0, self.device.abm().get());
            let (abs, turns) = if over { (0x7f_ffff, turns.wrapping_sub(1)) } else { (0, turns + 1) };
            self.device.set_position(Abs::truncate(abs), Abm::truncate(turns & 0xffff));
        }
        let start_ns = not_before_ns.max(self.world.now_ns());
        let mut transaction = Transaction::start(request, self.line, start_ns);
        let id = self.world.send(&Message::bytes(transaction.transmission().frame.as_bytes()), start_ns);
        let late = self.world.truth().transmission(id).is_none_or(|sent| sent.start_ns > sent.asked_ns);
        self.misheard += u32::from(late);
        let mut late_ns = 0;
        while let Progress::Pending { until_ns } = transaction.progress() {
            self.event(&mut transaction, until_ns + 1, &mut late_ns);
        }
        let (outcome, ready_ns) = match transaction.progress() {
            Progress::Done { value, ready_ns } => (Ok(value.response), ready_ns),
            Progress::Failed { error, ready_ns } => (Err(error), ready_ns),
            Progress::Pending { .. } => panic!("it has ended"),
        };
        let before = self.seen.forged + self.seen.undetected;
        self.judge(request, id, outcome, ready_ns, late_ns);
        let reset = matches!(request.emit().as_bytes(), [0xba | 0xc2 | 0x62]);
        self.misread += u32::from(!reset && self.seen.forged + self.seen.undetected > before);
        // The machine drains until the line is free.
        let ended = transaction.progress();
        while self.world.now_ns() < ready_ns {
            self.event(&mut transaction, ready_ns, &mut late_ns);
        }
        assert_eq!(transaction.progress(), ended, "what has ended has changed");
        self.line_is_free(id, outcome, start_ns, ready_ns);
        self.ready_ns = ready_ns.max(self.world.now_ns());
        let old_ns = self.world.now_ns().saturating_sub(2_000_000);
        self.world.truth_mut().forget_before(old_ns);
        Ended { outcome, ready_ns: self.ready_ns }
    }

    /// A place of the shaft that is another one every time, in 23 bits; the turns use all 24 bits of ABM.
    const fn shaft(&self) -> (u32, u32) {
        (self.turn & 0x7f_ffff, self.turn.wrapping_mul(0x9e_3779) & 0xff_ffff)
    }

    /// The numbers of a fresh response are where the shaft is.
    fn is_where_the_shaft_is(&self, response: Response) {
        let (abs, abm) = self.shaft();
        let resolution = Resolution::new(23, 24).expect("widths of the fields");
        // The upper half of a counter in two's complement is below 0.
        let turns = i64::from(abm) - if abm >= 1 << 23 { 1 << 24 } else { 0 };
        let sample = |tolerated| Evidence::of(response, resolution, 0).at(0, Policy::new(0).tolerating(tolerated));
        match response {
            // An encoder that finds the request damaged says so, and its position is a doubt.
            _ if matches!(sample(Tolerated::NOTHING), Err(Doubt::RequestDamaged { .. })) => {}
            Response::ReadSingleTurn(_) => {
                assert_eq!(sample(Tolerated::SINGLE_TURN).map(Sample::single_turn), Ok(abs));
            }
            Response::ReadMultiTurn(multi) => assert_eq!(multi.abm.get(), abm),
            Response::ReadAll(_) => {
                let position = sample(Tolerated::NOTHING).map(|at| (at.single_turn(), at.turns().map(i64::from)));
                assert_eq!(position, Ok((abs, Some(turns))));
            }
            _ => {}
        }
    }

    /// Nothing is sent until `until_ns`.
    pub fn wait(&mut self, until_ns: u64) {
        let mut idle = Transaction::start(Request::ReadAll, self.line, u64::MAX / 2);
        while self.world.now_ns() < until_ns {
            self.event(&mut idle, until_ns, &mut 0);
        }
    }

    /// Runs a procedure to its end.
    pub fn run<P: Procedure<Request = Request, Response = Response, Error = Error>>(
        &mut self,
        procedure: &mut P,
    ) -> Result<P::Value, Error> {
        let mut requests = 0;
        let Ok(ended) = servowire_core::run(procedure, self.ready_ns, |request, not_before_ns| {
            requests += 1;
            assert!(requests < 1_000, "the procedure does not end");
            self.wait(not_before_ns);
            let request = self.sent_for(request);
            Ok::<_, Infallible>(self.exchange(request, not_before_ns))
        });
        self.wait(ended.ready_ns);
        ended.outcome
    }

    /// Runs a search to its end. At the other rate the encoder understands nothing; it may take a request for some byte.
    pub fn detect(&mut self, detection: &mut Detection, draw: &mut Draw) -> Result<AllData, Error> {
        let mut step = detection.start(self.ready_ns);
        for _ in 0..=6 {
            let (request, not_before_ns) = match step {
                Step::Send { request, not_before_ns } => (request, not_before_ns),
                Step::Done { value, ready_ns } => {
                    self.wait(ready_ns);
                    assert_eq!(detection.line(), self.line, "found at the rate at which it does not answer");
                    return Ok(value);
                }
                Step::Failed { error, ready_ns } => {
                    self.wait(ready_ns);
                    return Err(error);
                }
            };
            assert_eq!(request.emit().as_bytes(), [0x1a], "a search sends nothing but ID 3");
            self.wait(not_before_ns);
            let Ended { outcome, ready_ns } = if detection.line() == self.line {
                self.exchange(request, not_before_ns)
            } else {
                if draw.below(2) == 0 {
                    let _ = self.world.intrude(&Message::bytes(&[draw.below(256) as u8]), not_before_ns);
                }
                self.wait(not_before_ns + 60_000);
                Ended { outcome: Err(Error::NoResponse { echo: false }), ready_ns: not_before_ns + 60_000 }
            };
            step = detection.receive(outcome, ready_ns);
            assert_eq!(outcome.is_ok(), matches!(step, Step::Done { .. }), "a sound response ends the search");
        }
        panic!("a search does not end");
    }

    fn event(&mut self, transaction: &mut Transaction, until_ns: u64, late_ns: &mut u64) {
        match self.world.next(until_ns) {
            Event::Heard { unit, .. } => {
                let (content, framed) = unit.bits.content();
                let byte = content as u8;
                let (effects, abs) = (self.device.effects(), self.device.abs().get());
                let sent = if framed {
                    self.device.hear(&[byte], unit.end_ns)
                } else {
                    self.device.framing_error(unit.end_ns)
                };
                if let Some(sent) = sent.filter(|_| byte == 0xc2 && self.device.effects() > effects) {
                    let want = if self.behaviour.tenth_shows_effect { 0 } else { abs };
                    assert_eq!(sent.frame.as_bytes()[2..5], want.to_le_bytes()[..3], "what the tenth response shows");
                }
                // Its own answers are not heard by itself.
                let foreign = !matches!(unit.origin.speaker, Speaker::Host | Speaker::Device(_));
                self.misheard += u32::from(unit.damaged || foreign);
                let own = !unit.damaged && unit.origin.speaker == Speaker::Host;
                self.forged_requests += u32::from(framed && !own && [0xba, 0xc2, 0x62].contains(&byte));
                self.fields.rotate_left(1);
                self.fields[3] = own.then_some((unit.origin.transmission, unit.origin.index));
                // Two wrong bits in one column make a request for another cell or of another byte, and fields that came twice one of
                // other fields: 32 32 7F 7F of 32 7F.
                match sent.as_ref().map(|sent| sent.frame.as_bytes()) {
                    Some([0x32, ..]) => self.forged_requests += u32::from(!is_one_request(&self.fields)),
                    Some([0xea, ..]) => self.forged_reads += u32::from(!is_one_request(&self.fields[1..])),
                    _ => {}
                }
                if let Some(sent) = sent {
                    let message = Message::bytes(sent.frame.as_bytes()).tagged(tag(sent.frame.as_bytes()));
                    let _ = self.world.answer(0, unit.origin.transmission, &message, sent.start_ns);
                }
            }
            Event::Delivered(block) => {
                *late_ns = block.late_ns().max(*late_ns);
                feed(transaction, &block, field_ns(self.line.rate));
            }
            Event::Time { now_ns } => _ = transaction.poll(now_ns),
        }
    }

    fn judge(&mut self, request: Request, id: Id, outcome: Result<Response, Error>, ready_ns: u64, late_ns: u64) {
        let truth = self.world.truth();
        let sent = truth.transmission(id).expect("the request is remembered").clone();
        // A request that left late, or with pauses, is lateness too.
        let late_ns =
            late_ns + sent.end_ns.saturating_sub(sent.asked_ns + sent.units as u64 * field_ns(self.line.rate));
        let within = late_ns < self.budget_ns;
        self.seen.beyond_budget += u64::from(!within);
        let response = match outcome {
            Ok(response) => response,
            Err(error) => {
                self.seen.failed += 1;
                let foreign = truth.handed_since(id).any(|handed| handed.origin.speaker == Speaker::Foreign);
                let disturbed = foreign || !truth.undisturbed(id);
                let owed = !disturbed && within && truth.intact_answers(id).any(|t| self.is_owed(request, &sent, t));
                // A refusal was received whole, too.
                assert!(
                    !owed || matches!(error, Error::Rejected { .. }),
                    "a good response is lost: {error}, {request} {sent:?}, answers {:?}, line {:?}, handed {:?}",
                    truth.answers(id).collect::<Vec<_>>(),
                    self.line,
                    truth.handed_since(id).collect::<Vec<_>>()
                );
                return;
            }
        };
        self.seen.done += 1;
        self.seen.owed += u64::from(truth.intact_answers(id).next().is_some());
        assert!(ready_ns >= sent.asked_ns);
        // The host was given nothing but its own request and answers to it, whole or not at all.
        let whole = |t: &Transmission| t.delivered == 0 || t.intact;
        let foreign = truth.handed_since(id).any(|handed| handed.origin.speaker == Speaker::Foreign);
        let undisturbed = truth.undisturbed(id) && !foreign && whole(&sent) && truth.answers(id).all(whole);
        match truth.verdict(id, tag(response.emit().as_bytes())) {
            Verdict::Fresh if self.moves && !self.trembles => self.is_where_the_shaft_is(response),
            Verdict::Fresh => {}
            Verdict::Forged { .. } => self.seen.forged += 1,
            // Of a block that is handed over too late nothing tells when it began: an echo may look like the answer.
            Verdict::Unknown if undisturbed && !within => self.seen.forged += 1,
            Verdict::Unknown => {
                assert!(!undisturbed, "the response {response} was never sent, nor was anything damaged: {sent:?}");
                self.seen.undetected += 1;
            }
            // Damage that happens to make an old value: that answer was not handed over since, or not as a whole.
            Verdict::Old { of } if !is_whole(truth, id, of) => {
                assert!(!undisturbed || !within, "invented: {response} for {sent:?}");
                self.seen.undetected += 1;
            }
            Verdict::Old { of } => {
                let of = truth.transmission(of);
                // Where the request is on the line twice, the encoder answers the first.
                let own = of.is_some_and(|of| of.answers == Some(id));
                // Where its first field came twice, and the second time after the request, all that was taken began after it.
                let late = of.is_some_and(|of| of.again_ns >= sent.end_ns);
                // Of what is handed over at once the times follow from its end: one that was held up in itself seems to have begun by
                // that much later than it has.
                let at_once = truth.handed_since(id).filter(|h| Some(h.origin.transmission) == of.map(|of| of.id));
                let at_once = at_once.map(|h| h.at_ns).collect::<BTreeSet<_>>().len() == 1;
                let left_ns = sent.asked_ns + sent.units as u64 * field_ns(self.line.rate);
                let held_up = of.is_some_and(|of| {
                    at_once && of.end_ns.saturating_sub(of.units as u64 * field_ns(self.line.rate)) >= left_ns
                });
                let late = late || held_up;
                self.seen.undetected += u64::from(late);
                let handed = truth.handed_since(id).collect::<Vec<_>>();
                assert!(
                    !within || own || late,
                    "the response {response} is older than its request {sent:?}: {of:?}, {late_ns} ns late, handed {handed:?}, {:?}",
                    self.line
                );
            }
        }
    }

    /// Whether the master has to take this answer: it began in time and was sent without long pauses.
    fn is_owed(&self, asked: Request, request: &Transmission, answer: &Transmission) -> bool {
        // An encoder that heard another request, by damage or from another speaker, answers that; of the memory, another cell.
        let frame = asked.emit();
        let differs = |(at, (byte, mask)): (usize, (&u8, u64))| {
            (answer.tag.unwrap_or(0) >> (8 * at) ^ u64::from(*byte)) & mask != 0
        };
        if answer.tag.is_none() || frame.as_bytes().iter().zip([0xff, 0x7f]).enumerate().any(differs) {
            return false;
        }
        let field_ns = field_ns(self.line.rate);
        let pause_ns = (answer.end_ns - answer.start_ns).saturating_sub(answer.units as u64 * field_ns);
        answer.start_ns <= request.end_ns + 10_000 && pause_ns <= field_ns / 2
    }

    /// Law 4, for answers of legal length that began in time.
    fn line_is_free(&self, id: Id, outcome: Result<Response, Error>, start_ns: u64, ready_ns: u64) {
        let truth = self.world.truth();
        let Some(sent) = truth.transmission(id) else { return };
        let nominal_ns = start_ns + sent.units as u64 * field_ns(self.line.rate);
        if outcome.is_ok() || sent.end_ns > nominal_ns {
            return;
        }
        let legal = |t: &&Transmission| {
            t.answers == Some(id)
                && matches!(t.speaker, Speaker::Device(_))
                && t.start_ns <= sent.end_ns + 10_000
                && t.end_ns - t.start_ns <= self.response_ns
        };
        let talking: Vec<_> = truth.speaking_from(ready_ns).filter(legal).collect();
        assert!(talking.is_empty(), "ready at {ready_ns} after {outcome:?}, but {talking:?}");
    }

    pub fn tally(&self) -> Tally {
        *self.world.tally()
    }

    pub fn is_exact(&self) -> bool {
        self.world.host().stamp == Stamp::Line
    }
}

/// What a UART's driver makes of a block: runs of good bytes and framing errors, each with the end that follows from the
/// end of the block.
fn feed(transaction: &mut Transaction, block: &Block, field_ns: u64) {
    let units: Vec<_> = block.bytes().collect();
    let mut good = Vec::new();
    for (k, (byte, framed)) in units.iter().enumerate() {
        let after = (units.len() - 1 - k) as u64;
        let end_ns = block.end_ns.saturating_sub(after * field_ns);
        if *framed {
            good.push(*byte);
            continue;
        }
        let _ = transaction.hear(&good, end_ns.saturating_sub(field_ns));
        good.clear();
        let _ = transaction.framing_error(end_ns);
    }
    let _ = transaction.hear(&good, block.end_ns);
}

/// The value that marks a response: its first two bytes, and a sum of all.
fn tag(frame: &[u8]) -> u64 {
    let sum = frame
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    frame.iter().take(2).rev().fold(sum, |tag, byte| tag << 8 | u64::from(*byte))
}

/// Whether these fields are a request of the host, whole and in order.
fn is_one_request(fields: &[Option<(Id, u16)>]) -> bool {
    let first = fields[0].map(|(id, _)| id);
    (0..).zip(fields).all(|(at, field)| *field == first.map(|id| (id, at)))
}

/// Whether the host was given every field of a transmission since this request.
fn is_whole(truth: &Truth, since: Id, of: Id) -> bool {
    let given = |index| truth.handed_since(since).any(|h| (h.origin.transmission, h.origin.index) == (of, index));
    truth.transmission(of).is_some_and(|of| (0..of.units as u16).all(given))
}
