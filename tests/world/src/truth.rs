use std::collections::VecDeque;

use crate::Bits;

/// Who speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Speaker {
    /// The master's computer.
    Host,
    /// A device, by its number.
    Device(u8),
    /// Somebody whom nobody asked.
    Foreign,
    /// Nobody.
    Noise,
}

/// Names a transmission; they are counted in the order in which they were given to the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub(crate) u64);

/// Where a unit comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Origin {
    /// Who sent it.
    pub speaker: Speaker,
    /// In which transmission.
    pub transmission: Id,
    /// Its number in it, from 0.
    pub index: u16,
    /// The request that the transmission answers.
    pub answers: Option<Id>,
}

/// What somebody sent, and what became of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transmission {
    /// Its name.
    pub id: Id,
    /// Who sent it.
    pub speaker: Speaker,
    /// The request that it answers.
    pub answers: Option<Id>,
    /// The value that it carries.
    pub tag: Option<u64>,
    /// When it was to begin.
    pub asked_ns: u64,
    /// Its first bit on the line.
    pub start_ns: u64,
    /// The first bit of the last copy of its first unit, where [`Fault::Repeat`](crate::Fault::Repeat) has copied that: a receiver
    /// that has not heard the first copy takes this for the beginning.
    pub again_ns: u64,
    /// The end of its last bit.
    pub end_ns: u64,
    /// The end of its last bit, copies by [`Fault::Repeat`](crate::Fault::Repeat) not counted: from here on a device may
    /// answer.
    pub sent_ns: u64,
    /// How many units the speaker meant to send.
    pub units: usize,
    /// How many units of it the host was given.
    pub delivered: usize,
    /// When the host was given the last of them.
    pub delivered_ns: u64,
    /// Whether all units came to the host as they were sent, in order, once each and with nothing between them.
    pub intact: bool,
    /// What was on the line from `start_ns` on, faults included.
    pub(crate) image: Bits,
    pub(crate) image_ns: u64,
    pub(crate) last_order: u64,
    pub(crate) broken: bool,
    /// Which of its first 64 units the host was given, the first in bit 0.
    pub(crate) heard: u64,
}

impl Transmission {
    /// Whether the host was given each of its units at least once. Two copies of one and none of another are not the whole.
    fn came_whole(&self) -> bool {
        self.heard.count_ones() as usize >= self.units.min(64)
    }

    /// The longest idle time between two units of `len` bits, start and stop bit included, in bits; for a transmission without
    /// damage.
    pub fn longest_idle(&self, len: usize) -> usize {
        let (mut at, mut longest) = (0, 0);
        while at < self.image.len() {
            let idle = (at..self.image.len()).take_while(|k| self.image.get(*k)).count();
            longest = longest.max(if at > 0 && at + idle < self.image.len() { idle } else { 0 });
            at += idle + len;
        }
        longest
    }
}

/// A unit that the host was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Handed {
    /// When.
    pub at_ns: u64,
    /// Where it came from.
    pub origin: Origin,
    /// Whether it was not what was sent in its place.
    pub damaged: bool,
}

/// Something a device did that cannot be undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Act {
    /// Which device.
    pub device: u8,
    /// What: a name of the test's own.
    pub what: &'static str,
    /// When.
    pub at_ns: u64,
    /// The request that made it do so.
    pub request: Id,
}

/// What a value that a master gave is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It comes from an answer to this request.
    Fresh,
    /// Everything that carried it began before the request had left the line: a broken law.
    Old {
        /// The transmission.
        of: Id,
    },
    /// It began after the request had left the line, but is no answer to it: an older answer that came too late, or a
    /// foreign speaker. Without a mark of the request in the answer no master can tell; count these, and see that the
    /// master had waited until its own `ready_ns`.
    Forged {
        /// The transmission.
        of: Id,
    },
    /// Nobody sent it: damaged in a way that the code does not detect, or invented.
    Unknown,
}

/// What has really happened, to judge a master by.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Truth {
    pub(crate) log: VecDeque<Transmission>,
    pub(crate) next: u64,
    /// Number of units the host was given.
    pub(crate) order: u64,
    pub(crate) handed: VecDeque<Handed>,
    /// Acts that cannot be undone, in their order.
    pub acts: Vec<Act>,
    /// Two speakers at once: when, and which, the earlier first.
    pub collisions: Vec<(u64, Speaker, Speaker)>,
}

impl Truth {
    /// A transmission, unless it was [forgotten](Self::forget_before).
    pub fn transmission(&self, id: Id) -> Option<&Transmission> {
        let first = self.log.front()?.id.0;
        self.log.get(usize::try_from(id.0.checked_sub(first)?).ok()?)
    }

    pub(crate) fn transmission_mut(&mut self, id: Id) -> Option<&mut Transmission> {
        let first = self.log.front()?.id.0;
        self.log.get_mut(usize::try_from(id.0.checked_sub(first)?).ok()?)
    }

    /// All that are remembered, in the order in which they were given to the world.
    pub fn transmissions(&self) -> impl DoubleEndedIterator<Item = &Transmission> {
        self.log.iter()
    }

    /// The answers of devices to a request.
    pub fn answers(&self, request: Id) -> impl Iterator<Item = &Transmission> {
        self.log.iter().filter(move |t| t.answers == Some(request) && matches!(t.speaker, Speaker::Device(_)))
    }

    /// Law 1: what the value `tag`, given as the answer to `request`, is worth.
    pub fn verdict(&self, request: Id, tag: u64) -> Verdict {
        let sent_ns = self.transmission(request).map_or(u64::MAX, |request| request.sent_ns);
        let mut verdict = Verdict::Unknown;
        for carrier in self.log.iter().filter(|t| t.tag == Some(tag) && t.speaker != Speaker::Host) {
            let of = carrier.id;
            match (carrier.start_ns >= sent_ns, carrier.answers == Some(request), carrier.speaker) {
                (true, true, Speaker::Device(_)) => return Verdict::Fresh,
                (true, ..) => verdict = Verdict::Forged { of },
                (false, ..) if verdict == Verdict::Unknown => verdict = Verdict::Old { of },
                _ => {}
            }
        }
        verdict
    }

    /// Whether a master can have taken the old value `tag` for an answer to `request` without a fault of its own: the line held the
    /// request up, and somebody else than the host began to give that value meanwhile; or it never came whole, and what came in place of
    /// the rest happened to fit; or its first unit came once more, after the request had left, so that all that was taken began
    /// after it.
    pub fn is_coincidence(&self, request: Id, tag: u64) -> bool {
        let carriers = || self.log.iter().filter(|t| t.tag == Some(tag) && t.speaker != Speaker::Host);
        let held_up = |sent: &Transmission| {
            sent.start_ns > sent.asked_ns && carriers().any(|carrier| carrier.again_ns >= sent.asked_ns)
        };
        let again = |sent: &Transmission| carriers().any(|carrier| carrier.again_ns >= sent.sent_ns);
        let sent = self.transmission(request);
        sent.is_some_and(|sent| held_up(sent) || again(sent)) || carriers().all(|carrier| !carrier.came_whole())
    }

    /// Laws 2 and 3: the answers to `request` that came to the host whole, which a master may therefore not lose.
    pub fn intact_answers(&self, request: Id) -> impl Iterator<Item = &Transmission> {
        self.answers(request).filter(|t| t.intact)
    }

    /// What the host was given since `request` was to begin.
    pub fn handed_since(&self, request: Id) -> impl Iterator<Item = &Handed> {
        let since_ns = self.transmission(request).map_or(u64::MAX, |request| request.asked_ns);
        self.handed.iter().filter(move |handed| handed.at_ns >= since_ns)
    }

    /// Whether the host was given nothing since `request` but undamaged units of the request's echo and of its answers.
    pub fn undisturbed(&self, request: Id) -> bool {
        let own = |origin: Origin| origin.transmission == request || origin.answers == Some(request);
        self.handed_since(request).all(|handed| own(handed.origin) && !handed.damaged)
    }

    /// Law 4: who of devices, foreigners and noise is on the line at `ns` or will be later, as far as that is decided by
    /// now. A master that says `ready_ns` promises that there is nobody.
    pub fn speaking_from(&self, ns: u64) -> impl Iterator<Item = &Transmission> {
        self.log.iter().filter(move |t| t.speaker != Speaker::Host && t.end_ns > ns)
    }

    /// Law 5: how often this was done.
    pub fn count(&self, what: &str) -> usize {
        self.acts.iter().filter(|act| act.what == what).count()
    }

    /// How often the host spoke while a device spoke.
    pub fn clashes(&self) -> usize {
        let clash = |a, b| matches!((a, b), (Speaker::Host, Speaker::Device(_)) | (Speaker::Device(_), Speaker::Host));
        self.collisions.iter().filter(|(_, a, b)| clash(*a, *b)).count()
    }

    /// Samples of the line as a logic analyser takes them, first sample in bit 0 of byte 0: idle is 1, and where two speak
    /// at once a 0 wins.
    pub fn sampled(&self, from_ns: u64, count: usize, period_ps: u64, bit_ps: u64) -> Vec<u8> {
        let mut samples = Bits::new();
        let (from_ps, to_ps) = (from_ns * 1000, from_ns * 1000 + count as u64 * period_ps);
        let end_ps = |t: &Transmission| t.image_ns * 1000 + t.image.len() as u64 * bit_ps;
        let near: Vec<_> = self.log.iter().filter(|t| t.image_ns * 1000 < to_ps && end_ps(t) > from_ps).collect();
        for k in 0..count as u64 {
            let ps = from_ps + k * period_ps;
            let level =
                |t: &&Transmission| ps < t.image_ns * 1000 || t.image.get(((ps - t.image_ns * 1000) / bit_ps) as usize);
            samples.push(near.iter().all(level));
        }
        samples.block().to_vec()
    }

    /// Forgets all that ended before `ns`, so that long runs stay small.
    pub fn forget_before(&mut self, ns: u64) {
        while self.log.front().is_some_and(|t| t.end_ns < ns && t.delivered_ns < ns) {
            self.log.pop_front();
        }
        while self.handed.front().is_some_and(|handed| handed.at_ns < ns) {
            self.handed.pop_front();
        }
        self.acts.retain(|act| act.at_ns >= ns);
        self.collisions.retain(|(at_ns, ..)| *at_ns >= ns);
    }

    /// The host is given a unit.
    pub(crate) fn handed(&mut self, origin: Origin, damaged: bool, now_ns: u64) {
        self.order += 1;
        let order = self.order;
        self.handed.push_back(Handed { at_ns: now_ns, origin, damaged });
        let Some(t) = self.transmission_mut(origin.transmission) else { return };
        let follows = t.delivered == 0 || t.last_order + 1 == order;
        t.heard |= 1_u64.checked_shl(origin.index.into()).unwrap_or(0);
        t.broken |= damaged || usize::from(origin.index) != t.delivered || !follows;
        t.delivered += 1;
        t.last_order = order;
        t.intact = !t.broken && t.delivered == t.units;
        t.delivered_ns = now_ns;
    }
}
