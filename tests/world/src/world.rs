use std::collections::{BTreeMap, VecDeque};

use crate::bits::Bits;
use crate::layout::Layout;
use crate::{
    Act, Delivery, Fault, Framing, Host, Id, Message, Origin, Scenario, Script, Speaker, Stamp, Tally, Transmission,
    Truth,
};

/// The line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wire {
    /// One bit in ps.
    pub bit_ps: u64,
    /// How receivers find units.
    pub framing: Framing,
    /// How many devices listen.
    pub devices: u8,
}

/// Some bits as a receiver took them from the line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unit {
    /// The bits, start and stop bit included.
    pub bits: Bits,
    /// Its first bit.
    pub start_ns: u64,
    /// The end of its last bit.
    pub end_ns: u64,
    /// Where it comes from. For the oracle; a master must not see it.
    pub origin: Origin,
    /// Whether it is not what was sent in its place.
    pub damaged: bool,
}

/// Units that the host is given at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// The units in the order of their arrival, at least one.
    pub units: Vec<Unit>,
    /// The end of the last unit as the host believes, see [`Stamp`].
    pub end_ns: u64,
}

impl Block {
    /// What a UART makes of the units: byte, and whether the stop bit was right.
    pub fn bytes(&self) -> impl Iterator<Item = (u8, bool)> {
        self.units.iter().map(|unit| {
            let (content, framed) = unit.bits.content();
            (content as u8, framed)
        })
    }

    /// How much later than its last bit the host believes it to have ended.
    pub fn late_ns(&self) -> u64 {
        self.end_ns.saturating_sub(self.units.last().map_or(0, |unit| unit.end_ns))
    }
}

/// What happens next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// A device has received a unit; [`World::now_ns`] is its end.
    Heard {
        /// Which.
        device: u8,
        /// What.
        unit: Unit,
    },
    /// The host is given what it has received.
    Delivered(Block),
    /// The time asked for has come, or a later one if the host was busy elsewhere. All that was to be delivered by then has
    /// been.
    Time {
        /// What its clock shows.
        now_ns: u64,
    },
}

/// A unit on its way.
#[derive(Debug)]
struct Flying {
    unit: Unit,
    for_host: bool,
    missed_by: Option<Speaker>,
    swallowed: bool,
    split: bool,
    preempt_ns: u32,
}

/// When the host's receiver wants to hand over: caused at, by how much idle time, and whether idleness is the cause.
#[derive(Debug, Clone, Copy)]
struct Due {
    last_ns: u64,
    idle_ns: u64,
}

/// A host, devices, and the line between them.
#[derive(Debug)]
pub struct World {
    wire: Wire,
    host: Host,
    script: Script,
    now_ns: u64,
    flying: BTreeMap<(u64, u64), Flying>,
    serial: u64,
    fifo: Vec<Unit>,
    due: Option<Due>,
    away_until_ns: u64,
    ready: VecDeque<Event>,
    last_answer: Option<(Message, Option<Id>)>,
    truth: Truth,
    tally: Tally,
}

impl World {
    /// A line that is idle at time 0.
    pub fn new(wire: Wire, scenario: Scenario) -> Self {
        Self {
            wire,
            host: scenario.host,
            script: scenario.script,
            now_ns: 0,
            flying: BTreeMap::new(),
            serial: 0,
            fifo: Vec::new(),
            due: None,
            away_until_ns: 0,
            ready: VecDeque::new(),
            last_answer: None,
            truth: Truth::default(),
            tally: Tally::default(),
        }
    }

    /// The time.
    pub const fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// How the host hears.
    pub const fn host(&self) -> Host {
        self.host
    }

    /// What has really happened.
    pub const fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The same, to let it forget.
    pub const fn truth_mut(&mut self) -> &mut Truth {
        &mut self.truth
    }

    /// What was counted.
    pub const fn tally(&self) -> &Tally {
        &self.tally
    }

    /// The host sends, from `at_ns` on, or from now if that is past.
    pub fn send(&mut self, message: &Message, at_ns: u64) -> Id {
        self.transmit(Speaker::Host, None, message, at_ns)
    }

    /// A device sends in answer to `request`, the transmission whose unit made it do so.
    pub fn answer(&mut self, device: u8, request: Id, message: &Message, at_ns: u64) -> Id {
        self.last_answer = Some((message.clone(), Some(request)));
        self.transmit(Speaker::Device(device), Some(request), message, at_ns)
    }

    /// Somebody whom nobody asked sends, from `at_ns` on: a second master, for example.
    pub fn intrude(&mut self, message: &Message, at_ns: u64) -> Id {
        self.transmit(Speaker::Foreign, None, message, at_ns)
    }

    /// A device did something that cannot be undone.
    pub fn act(&mut self, device: u8, what: &'static str, request: Id) {
        self.truth.acts.push(Act { device, what, at_ns: self.now_ns, request });
    }

    /// Goes on to the next event, at most until `until_ns`. Call it in a loop; what a device or the master does about
    /// an event is given back by [`Self::answer`] and [`Self::send`].
    pub fn next(&mut self, until_ns: u64) -> Event {
        loop {
            if let Some(event) = self.ready.pop_front() {
                return event;
            }
            let horizon = until_ns.max(self.away_until_ns).max(self.now_ns);
            let unit_ns = self.flying.first_key_value().map_or(u64::MAX, |((end_ns, _), _)| *end_ns);
            let hand_ns = self.due.map_or(u64::MAX, |due| self.hand_over_ns(due));
            if unit_ns.min(hand_ns) > horizon {
                self.now_ns = horizon;
                return Event::Time { now_ns: horizon };
            }
            self.now_ns = unit_ns.min(hand_ns).max(self.now_ns);
            if unit_ns <= hand_ns {
                self.unit_ends();
            } else {
                self.hand_over();
            }
        }
    }

    fn hand_over_ns(&self, due: Due) -> u64 {
        (due.last_ns + due.idle_ns + u64::from(self.host.latency_ns)).max(self.away_until_ns)
    }

    // --- sending -----------------------------------------------------------------------------------------------------

    fn transmit(&mut self, speaker: Speaker, answers: Option<Id>, message: &Message, at_ns: u64) -> Id {
        let asked_ns = at_ns.max(self.now_ns);
        let strikes = matches!(speaker, Speaker::Host | Speaker::Device(_));
        let faults = if strikes { self.script.strike(self.tally.sent, message.units.len()) } else { Vec::new() };
        *(if strikes { &mut self.tally.sent } else { &mut self.tally.spurious }) += 1;

        let delay_ns: u64 =
            faults.iter().map(|(_, f)| if let Fault::Delay { ns } = f { u64::from(*ns) } else { 0 }).sum();
        let begin_ns = asked_ns + delay_ns;
        let layout = Layout::of(message, &faults);
        let id = Id(self.truth.next);
        let times =
            self.launch(&layout, message, &faults, Origin { speaker, transmission: id, index: 0, answers }, begin_ns);
        self.truth.next += 1;
        self.truth.log.push_back(Transmission {
            id,
            speaker,
            answers,
            tag: message.tag,
            asked_ns,
            start_ns: times.0,
            again_ns: begin_ns + layout.again() as u64 * self.wire.bit_ps / 1000,
            end_ns: times.1,
            sent_ns: times.2,
            units: message.units.len(),
            delivered: 0,
            heard: 0,
            delivered_ns: 0,
            intact: false,
            image: layout.image,
            image_ns: begin_ns,
            last_order: 0,
            broken: false,
        });
        for (_, fault) in faults {
            self.tally.faults[fault.kind() as usize] += 1;
            match fault {
                Fault::Noise { after_ns } => {
                    let unit = self.random_unit();
                    self.transmit(Speaker::Noise, None, &Message::new(vec![unit]), times.1 + u64::from(after_ns));
                }
                Fault::Foreign { after_ns, units, replay } => {
                    self.foreign(times.0 + u64::from(after_ns), units, replay);
                }
                _ => {}
            }
        }
        id
    }

    fn foreign(&mut self, at_ns: u64, units: u8, replay: bool) {
        let (message, answers) = match self.last_answer.clone().filter(|_| replay) {
            Some(answer) => answer,
            None => (Message::new((0..units).map(|_| self.random_unit()).collect()), None),
        };
        self.transmit(Speaker::Foreign, answers, &message, at_ns);
    }

    fn random_unit(&mut self) -> Bits {
        match self.wire.framing {
            Framing::StartStop { width } => Bits::start_stop(self.script.noise(), width),
            Framing::Block => Bits::of_block(&self.script.noise().to_le_bytes()),
        }
    }

    /// Puts the units of a transmission on the line. Its first and last instant there.
    fn launch(
        &mut self,
        layout: &Layout,
        sent: &Message,
        faults: &[(usize, Fault)],
        origin: Origin,
        begin_ns: u64,
    ) -> (u64, u64, u64) {
        let ns = |bits: usize| begin_ns + (bits as u64 * self.wire.bit_ps).div_ceil(1000);
        let swap = faults.iter().any(|(_, fault)| *fault == Fault::EchoSwap);
        let receivers = u16::from(self.wire.devices) + 1;
        let mut flights = Vec::new();
        for (at, len) in layout.units(self.wire.framing) {
            let index = layout.index(at);
            let bits = layout.image.slice(at, len);
            let damaged = sent.units.get(index).is_none_or(|unit| *unit != bits);
            let unit = Unit {
                bits,
                start_ns: ns(at),
                end_ns: ns(at + len),
                origin: Origin { index: index as u16, ..origin },
                damaged,
            };
            let for_host = origin.speaker != Speaker::Host || self.host.echo != swap;
            let mut flying = Flying { unit, for_host, missed_by: None, swallowed: false, split: false, preempt_ns: 0 };
            for (_, fault) in faults.iter().filter(|(unit, _)| *unit == index) {
                match fault {
                    Fault::Miss { receiver } => {
                        let receiver = u16::from(*receiver) % receivers;
                        let device = u8::try_from(receiver.saturating_sub(1)).unwrap_or(0);
                        flying.missed_by = Some(if receiver == 0 { Speaker::Host } else { Speaker::Device(device) });
                    }
                    Fault::Split => flying.split = true,
                    Fault::Preempt { ns } => flying.preempt_ns = *ns,
                    _ => {}
                }
            }
            flights.push(flying);
        }
        let times = layout.ends();
        let times = (ns(times.0), ns(times.1), ns(times.2));
        for flying in flights {
            self.take_off(flying);
        }
        times
    }

    /// Where two speak at once, the unit that began first is damaged and the other one is lost in it.
    fn take_off(&mut self, mut new: Flying) {
        for other in self.flying.values_mut() {
            let apart = other.unit.end_ns <= new.unit.start_ns || new.unit.end_ns <= other.unit.start_ns;
            if apart || other.unit.origin.transmission == new.unit.origin.transmission {
                continue;
            }
            let (first, second) =
                if other.unit.start_ns <= new.unit.start_ns { (other, &mut new) } else { (&mut new, other) };
            let bits = &mut first.unit.bits;
            let inside = bits.len().saturating_sub(2).max(1) as u64;
            let noise = self.script.noise();
            let (one, two) = (1 + noise % inside, 1 + (noise >> 32) % inside);
            bits.flip(one as usize);
            if one != two {
                bits.flip(two as usize);
            }
            first.unit.damaged = true;
            second.swallowed = true;
            self.tally.collisions += 1;
            let collision = (second.unit.start_ns, first.unit.origin.speaker, second.unit.origin.speaker);
            self.truth.collisions.push(collision);
        }
        self.serial += 1;
        self.flying.insert((new.unit.end_ns, self.serial), new);
    }

    // --- receiving ---------------------------------------------------------------------------------------------------

    fn unit_ends(&mut self) {
        let Some((_, flying)) = self.flying.pop_first() else { return };
        let end_ns = flying.unit.end_ns;
        self.away_until_ns = self.away_until_ns.max(match flying.preempt_ns {
            0 => 0,
            ns => end_ns + u64::from(ns),
        });
        if flying.for_host {
            self.host_hears(&flying);
        }
        if flying.swallowed {
            return;
        }
        for device in 0..self.wire.devices {
            let who = Speaker::Device(device);
            if flying.unit.origin.speaker != who && flying.missed_by != Some(who) {
                self.tally.heard += 1;
                self.ready.push_back(Event::Heard { device, unit: flying.unit.clone() });
            }
        }
    }

    fn host_hears(&mut self, flying: &Flying) {
        self.tally.for_host += 1;
        let full = self.host.fifo > 0 && self.fifo.len() >= usize::from(self.host.fifo);
        if flying.missed_by == Some(Speaker::Host) {
            self.tally.missed += 1;
        } else if flying.swallowed {
            self.tally.swallowed += 1;
        } else if full {
            self.tally.overrun += 1;
        } else {
            self.fifo.push(flying.unit.clone());
        }
        if self.fifo.is_empty() {
            return;
        }
        let last_ns = flying.unit.end_ns;
        let now = Due { last_ns, idle_ns: 0 };
        let asked = self.due.filter(|due| due.idle_ns == 0);
        let due = match self.host.delivery {
            _ if asked.is_some() => asked,
            _ if flying.split => Some(now),
            Delivery::Each => Some(now),
            Delivery::Blocks { units, .. } if self.fifo.len() >= usize::from(units.max(1)) => Some(now),
            Delivery::Blocks { idle_ns, .. } | Delivery::Idle { idle_ns } => {
                Some(Due { last_ns, idle_ns: u64::from(idle_ns.max(1)) })
            }
        };
        self.due = due;
    }

    fn hand_over(&mut self) {
        let Some(due) = self.due.take() else { return };
        // The line was not idle long enough; the end of the unit that broke the silence asks again.
        let silent_ns = due.last_ns + due.idle_ns;
        let broken = |flying: &Flying| flying.for_host && flying.unit.start_ns < silent_ns;
        if due.idle_ns > 0 && self.flying.values().any(broken) {
            return;
        }
        let units = std::mem::take(&mut self.fifo);
        let Some(last) = units.last() else { return };
        let end_ns = match self.host.stamp {
            Stamp::Line => last.end_ns,
            Stamp::Handler => self.now_ns - due.idle_ns,
        };
        self.tally.blocks += 1;
        self.tally.delivered += units.len() as u64;
        for unit in &units {
            self.truth.handed(unit.origin, unit.damaged, self.now_ns);
        }
        self.ready.push_back(Event::Delivered(Block { units, end_ns }));
    }
}
