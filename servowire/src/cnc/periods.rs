//! Generators with a memory of periods: what happens in a period of 4 us depends only on the state at its start and on the
//! word, and most periods of a move are alike.

use std::hash::{BuildHasher, Hasher};

use sorte_proto::Pto;
use sorte_proto::iep::{Activity, Channel, Edge};
use sorte_proto::pins::Levels;

/// Period of the generator.
pub(super) const PERIOD: u64 = 4000;
/// Number of periods that are remembered; a newer one replaces an older one.
const PLACES: usize = 4096;
/// Maximum number of changes in a remembered period.
const CHANGES: usize = 8;

/// What can be seen of a generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    /// The expected word is in the buffer.
    Word,
    Step(bool),
    Pins(Levels),
}

/// A period that some generator has completed.
#[derive(Debug, Clone, Copy)]
struct Period {
    before: Channel,
    after: Channel,
    /// When the word in the buffer was first read.
    read: u64,
    changes: [(u16, Change); CHANGES],
    count: usize,
    /// A number that no other period ever has.
    serial: u64,
    /// The period that followed it last time, and the word of that one.
    next: Option<(Pto, Link)>,
}

/// Where a period is stored, until another one replaces it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Link {
    place: usize,
    serial: u64,
}

impl Period {
    /// Runs the generator's next period; `None` if more happens in it than can be remembered.
    fn new(before: Channel, serial: u64) -> Option<Self> {
        let (mut after, mut read, mut count) = (before, u64::MAX, 0);
        let mut changes = [(0, Change::Word); CHANGES];
        while let Some(happening) = after.next(PERIOD) {
            if let Activity::Served(served) = happening {
                read = if served.events.cmp7 { read.min(served.ns) } else { read };
            }
            if let Some((ns, change)) = change(happening) {
                *changes.get_mut(count)? = (ns as u16, change);
                count += 1;
            }
        }
        Some(Self { before, after: after.rebased(1), read, changes, count, serial, next: None })
    }

    fn changes(&self) -> &[(u16, Change)] {
        self.changes.get(..self.count).unwrap_or_default()
    }
}

fn change(happening: Activity) -> Option<(u64, Change)> {
    match happening {
        Activity::Edge(Edge { ns, high }) => Some((ns, Change::Step(high))),
        Activity::Served(served) => served.levels.map(|levels| (served.ns, Change::Pins(levels))),
    }
}

/// The remembered periods, shared by all generators.
pub(super) struct Periods {
    places: Vec<Option<Period>>,
    serial: u64,
}

impl Periods {
    pub(super) fn new() -> Self {
        Self { places: vec![None; PLACES], serial: 0 }
    }

    fn at(&self, link: Link) -> Option<&Period> {
        self.places.get(link.place)?.as_ref().filter(|period| period.serial == link.serial)
    }

    /// Returns the next period of `channel`. `last`: the period before it, which may make the search unnecessary.
    fn of(&mut self, last: Option<Link>, channel: &Channel) -> Option<Link> {
        let known = last.and_then(|last| self.at(last)).and_then(|last| last.next);
        if let Some((_, next)) = known.filter(|(word, next)| *word == channel.word() && self.at(*next).is_some()) {
            return Some(next);
        }
        let place = Mix(0).hash_one(channel) as usize % PLACES;
        let period = self.places.get_mut(place)?;
        if period.as_ref().is_none_or(|period| period.before != *channel) {
            self.serial += 1;
            *period = Period::new(*channel, self.serial);
        }
        let next = Link { place, serial: period.as_ref()?.serial };
        if let Some(last) = last.filter(|last| self.at(*last).is_some()) {
            if let Some(Some(period)) = self.places.get_mut(last.place) {
                period.next = Some((channel.word(), next));
            }
        }
        Some(next)
    }
}

/// A quick hash: nobody chooses these numbers with bad intent.
#[derive(Debug, Clone, Copy)]
struct Mix(u64);

impl BuildHasher for Mix {
    type Hasher = Self;

    fn build_hasher(&self) -> Self {
        *self
    }
}

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64((*byte).into());
        }
    }

    fn write_u8(&mut self, value: u8) {
        self.write_u64(value.into());
    }

    fn write_u16(&mut self, value: u16) {
        self.write_u64(value.into());
    }

    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(5) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_isize(&mut self, value: isize) {
        self.write_u64(value as u64);
    }
}

/// A timer with its handler, and how far it has run.
#[derive(Debug, Clone)]
pub(super) struct Generator {
    /// Its time begins with the present period.
    channel: Channel,
    /// In ns since the start.
    now: u64,
    /// The period that has just ended, if the channel is unchanged since, except for the word.
    last: Option<Link>,
}

impl Generator {
    pub(super) fn new(channel: Channel) -> Self {
        Self { channel, now: 0, last: None }
    }

    /// How far it has run, in ns since the start.
    pub(super) fn now(&self) -> u64 {
        self.now
    }

    /// Whether the word in the buffer has been taken.
    pub(super) fn rest(&mut self) {
        self.channel.set_start(None);
    }

    /// Continues until `until` ns, and reports what happens. `word`: a word that is in the buffer from some time onwards,
    /// at most `until`.
    pub(super) fn run(
        &mut self,
        until: u64,
        mut word: Option<(u64, Pto)>,
        periods: &mut Periods,
        mut tell: impl FnMut(u64, Change),
    ) {
        while self.now < until {
            let begin = self.now - self.now % PERIOD;
            let end = begin + PERIOD;
            if self.now == begin && end <= until && self.whole(begin, &mut word, periods, &mut tell) {
                continue;
            }
            let pause = self.take(&mut word, &mut tell).unwrap_or(u64::MAX);
            self.now = end.min(until).min(pause);
            self.last = None;
            while let Some(happening) = self.channel.next(self.now - begin) {
                if let Some((ns, change)) = change(happening) {
                    tell(begin + ns, change);
                }
            }
            if self.now == end {
                self.channel = self.channel.rebased(1);
            }
        }
        self.take(&mut word, &mut tell);
    }

    /// Puts the word into the buffer if it is time; otherwise returns when.
    fn take(&mut self, word: &mut Option<(u64, Pto)>, tell: &mut impl FnMut(u64, Change)) -> Option<u64> {
        let (at, pto) = (*word)?;
        if at > self.now {
            return Some(at);
        }
        *word = None;
        self.channel.set_word(pto);
        tell(at, Change::Word);
        None
    }

    /// Replays a whole remembered period, if that gives the same result as running it.
    fn whole(
        &mut self,
        begin: u64,
        word: &mut Option<(u64, Pto)>,
        periods: &mut Periods,
        tell: &mut impl FnMut(u64, Change),
    ) -> bool {
        let mut coming = word.filter(|(at, _)| *at < begin + PERIOD);
        let held = self.channel.word();
        if let Some((_, pto)) = coming {
            self.channel.set_word(pto);
        }
        // A word that comes before anybody looks might as well have been there from the start.
        let fits = |period: &&Period| coming.is_none_or(|(at, _)| begin.saturating_add(period.read) >= at);
        let link = periods.of(self.last, &self.channel);
        let Some(period) = link.and_then(|link| periods.at(link)).filter(fits) else {
            self.channel.set_word(held);
            return false;
        };
        if coming.is_some() {
            *word = None;
        }
        for (ns, change) in period.changes() {
            let at = begin + u64::from(*ns);
            if let Some((came, _)) = coming.take_if(|(came, _)| *came <= at) {
                tell(came, Change::Word);
            }
            tell(at, *change);
        }
        if let Some((came, _)) = coming {
            tell(came, Change::Word);
        }
        (self.channel, self.now, self.last) = (period.after, begin + PERIOD, link);
        true
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sorte_proto::sync0::Variant;
    use sorte_proto::{Direction, StartTime};

    use super::*;

    fn words() -> impl Strategy<Value = Pto> {
        let direction = || prop_oneof![Just(Direction::Low), Just(Direction::High)];
        let start = prop_oneof![1..=3990u16, Just(1), Just(600), Just(1390), Just(3990)];
        prop_oneof![
            6 => (start, direction()).prop_map(|(ns, direction)| Pto::Pulse { start: StartTime::truncate(ns), direction }),
            2 => direction().prop_map(|direction| Pto::NoPulse { direction }),
            1 => Just(Pto::DriverOff),
        ]
    }

    proptest! {
        /// The same changes at the same times as the timer that goes through every event, in the same order with the words.
        #[test]
        fn what_is_remembered_is_what_happens(
            published: bool,
            latency in prop_oneof![0..2000u16, Just(0), Just(300)],
            write_ns in prop_oneof![0..200u16, Just(0), Just(20)],
            // Few words, so that periods come again.
            words in prop::collection::vec(words(), 1..4),
            script in prop::collection::vec((0..4usize, 0..9000u64, 0..3u64, any::<bool>()), 1..200),
        ) {
            let variant = if published { Variant::Published } else { Variant::Lossless };
            let mut plain = Channel::new(variant, 2000, latency).with_write_time(write_ns);
            let (mut generator, mut periods) = (Generator::new(plain), Periods::new());
            let mut start = 0;
            for (word, at, idle, partly) in script {
                let word = words.get(word).copied();
                // Half of the words come when they come in a line of four devices.
                let at = start + if partly { at } else { at % 500 };
                let end = start + PERIOD * (idle + 1) + if partly { at % 2777 } else { 0 };
                let (mut want, mut got) = (Vec::new(), Vec::new());
                if let Some(word) = word {
                    want.extend(core::iter::from_fn(|| plain.next(at)).filter_map(change));
                    plain.set_word(word);
                    want.push((at, Change::Word));
                }
                let end = end.max(at);
                want.extend(core::iter::from_fn(|| plain.next(end)).filter_map(change));
                generator.run(end, word.map(|word| (at, word)), &mut periods, |ns, change| got.push((ns, change)));
                prop_assert_eq!(got, want);
                if idle == 2 {
                    plain.set_start(None);
                    generator.rest();
                }
                start = end;
            }
            prop_assert_eq!(generator.channel.rebased(0), plain.rebased(start / PERIOD));
        }
    }

    /// A move at one speed is remembered after its first steps.
    #[test]
    fn a_steady_move_needs_a_place_or_two() {
        let mut periods = Periods::new();
        let mut generator = Generator::new(Channel::new(Variant::Lossless, 2000, 300).with_write_time(20));
        let word = Pto::Pulse { start: StartTime::MIN, direction: Direction::High };
        let mut steps = 0;
        for cycle in 0..1000 {
            generator.run((cycle + 1) * PERIOD, Some((cycle * PERIOD, word)), &mut periods, |_, change| {
                steps += u64::from(change == Change::Step(true));
            });
        }
        // The first period, and all others.
        assert_eq!((steps, periods.places.iter().flatten().count()), (1000, 2));
    }
}
