//! Procedures on the hostile line: what cannot be undone, and what is read back.

use core::convert::Infallible;
use std::collections::BTreeMap;

use nikon_aformat::device::{Device, Encoders};
use nikon_aformat::master::{
    Detection, EepromRead, GuardedReset, Line, Progress, Reset, Step, Transaction, VerifiedWrite, Write,
};
use nikon_aformat::{Alm, EncoderAddress, EncoderId, Error, Operation, Request, Resolution, Response, UserAddress};
use servowire_core::{Ended, Procedure};
use servowire_world::{Draw, Id, Kind, Tally};

use super::exchanges::Setup;
use super::line::{Bench, host_within};
use super::switches::{Mix, Switches};

/// Encoders on one line, and how procedures ended.
pub struct Run<const N: usize> {
    pub bench: Bench<N>,
    line: Line,
    at_ns: u64,
    seed: u64,
    pub switches: Switches,
    /// Requests that were given up, and from when on the line was said to be free.
    given_up: Vec<(Id, u64)>,
    /// The host has other things to ask and mixes outcomes up: now and then a procedure is given that of another request,
    /// which was sent in place of its own.
    astray: Option<Draw>,
    pub mixed_up: u64,
}

/// How often what happened.
#[derive(Debug, Default)]
pub struct Shown {
    pub ends: BTreeMap<String, u64>,
    pub mix: Mix,
    pub tally: Tally,
}

impl<const N: usize> Run<N> {
    /// Without the faults that no master can know of.
    pub fn new(setup: &Setup, addresses: [u8; N], without: &[Kind]) -> Self {
        let Setup { seed, rate, switches, .. } = *setup;
        let mut scenario = setup.scenario.clone();
        scenario.script.rates = without.iter().fold(scenario.script.rates, |rates, kind| rates.with(*kind, 0));
        scenario.script.planned.retain(|planned| !without.contains(&planned.fault.kind()));
        let line = Line::new(rate).with_response_timeout_ns(20_000);
        let scenario = host_within(scenario, line.latency_budget_ns());
        let mut index = 0;
        let all = addresses.map(|ea| {
            let mut device = Device::<2>::new(EncoderAddress::truncate(ea), Resolution::default(), rate);
            device.set_behaviour(switches.behaviour(ea, index));
            device.set_id(EncoderId::truncate(0x10_0000 + u32::from(ea)));
            index += 1;
            device
        });
        let bench = Bench::new(Encoders { all }, rate, scenario);
        let mut draw = Draw::default();
        for _ in 0..seed % 64 {
            let _ = draw.below(2);
        }
        let astray = matches!(seed % 8, 1 | 2 | 7).then_some(draw);
        Self { bench, line, at_ns: 1_000, seed, switches, given_up: Vec::new(), astray, mixed_up: 0 }
    }

    /// What is sent where a procedure wants `request`, another one once in `odds`.
    fn sent_for(&mut self, request: Request, odds: u64) -> Request {
        let Some(draw) = &mut self.astray else { return request };
        if draw.below(odds) > 0 {
            return request;
        }
        let all = &self.bench.encoders.all;
        let (first, last) = (all[0].ea(), all[N - 1].ea());
        let other = match draw.below(5) {
            0 => Request::new(first, Operation::EepromRead { address: 0x33 }),
            1 => Request::new(first, Operation::ClearStatus),
            2 | 3 => Request::new(last, Operation::Status),
            _ => Request::new(first, Operation::Abs40),
        };
        self.mixed_up += u64::from(other != request);
        other
    }

    /// The data of the first encoder while they are not determined, as drawn.
    pub fn undetermined(&mut self, before: u16) {
        let behaviour = self.switches.behaviour(self.bench.encoders.all[0].ea().get(), 0);
        let word = self.switches.undetermined().1.unwrap_or(before);
        self.bench.encoders.all[0].set_behaviour(behaviour.with_undetermined(word));
    }

    pub fn transact(&mut self, request: Request, not_before_ns: u64) -> (Result<Response, Error>, u64) {
        self.at_ns = self.bench.world.now_ns().max(self.at_ns).max(not_before_ns);
        // Nothing happens on the line meanwhile.
        while self.bench.next(self.at_ns).is_ok() {}
        let mut transaction = Transaction::start(request, Resolution::default(), self.line, self.at_ns);
        let id = self.bench.send(transaction.transmission().frames, self.at_ns);
        loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => match self.bench.next(until_ns) {
                    Ok(block) => drop(transaction.hear_since(&block.frames, block.since_ns, block.end_ns)),
                    Err(now_ns) => drop(transaction.poll(now_ns)),
                },
                Progress::Done { value, ready_ns } => {
                    self.at_ns = ready_ns;
                    return (Ok(value.response), self.bench.world.now_ns());
                }
                Progress::Failed { error, ready_ns } => {
                    self.at_ns = ready_ns;
                    self.given_up.push((id, ready_ns));
                    return (Err(error), self.bench.world.now_ns());
                }
            }
        }
    }

    /// Whether an answer came after the `ready_ns` of its request: outside of the laws, because it may be taken for the answer
    /// to another request of the same kind.
    pub fn answered_late(&self) -> bool {
        let truth = self.bench.world.truth();
        let late = |(id, ready_ns): &(Id, u64)| truth.answers(*id).any(|answer| answer.end_ns > *ready_ns);
        self.given_up.iter().any(late)
    }

    pub fn drive<P>(&mut self, procedure: &mut P, now_ns: u64) -> Result<P::Value, Error>
    where
        P: Procedure<Request = Request, Response = Response, Error = Error>,
    {
        let mut sent = 0;
        let Ok(Ended { outcome, ready_ns }) = servowire_core::run(procedure, now_ns, |request, not_before_ns| {
            assert!(sent < 200, "seed {}: a procedure without end", self.seed);
            // What guards a procedure stands at its start.
            let request = self.sent_for(request, if sent == 0 { 2 } else { 12 });
            sent += 1;
            let (outcome, ready_ns) = self.transact(request, not_before_ns);
            Ok::<_, Infallible>(Ended { outcome, ready_ns })
        });
        self.at_ns = self.at_ns.max(ready_ns);
        outcome
    }

    pub fn now_ns(&self) -> u64 {
        self.bench.world.now_ns().max(self.at_ns)
    }

    /// What encoders did because of requests sent since `since_ns`; a request that the line delayed may belong to a procedure
    /// before.
    pub fn acts(&self, what: &str, since_ns: u64) -> usize {
        let truth = self.bench.world.truth();
        let own = |id| truth.transmission(id).is_some_and(|sent| sent.asked_ns >= since_ns);
        truth.acts.iter().filter(|act| act.what == what && own(act.request)).count()
    }

    /// The response to the last of a reset's requests shows its effect, or does not, as the encoder is.
    pub fn shows_the_effect_when_it_should(&mut self) {
        let want = self.switches.reset_shows_in_the_eighth().1;
        for shown in self.bench.shown_at_once.drain(..) {
            assert_eq!(shown, want, "seed {}: the effect of a reset in the eighth response", self.seed);
        }
    }

    /// A new procedure begins: what went before is over.
    pub fn forget(&mut self) {
        while self.bench.next(self.now_ns()).is_ok() {}
        self.given_up.retain(|(id, _)| self.bench.world.truth().transmission(*id).is_some());
        let truth = self.bench.world.truth_mut();
        truth.acts.clear();
        truth.forget_before(self.at_ns.saturating_sub(1_000_000));
    }
}

impl Shown {
    pub fn take<const N: usize>(&mut self, run: &Run<N>) {
        run.switches.note(&mut self.mix);
        self.tally.add(run.bench.world.tally());
        *self.ends.entry("outcome of another request".to_owned()).or_default() += run.mixed_up;
    }

    pub fn ended<T>(&mut self, what: &str, end: Result<T, Error>) {
        let end = end.err().map_or("done", |error| error.class().name());
        *self.ends.entry(format!("{what}: {end}")).or_default() += 1;
    }
}

/// What no master can know of where requests are counted.
const UNKNOWABLE: [Kind; 4] = [Kind::Repeat, Kind::Foreign, Kind::Noise, Kind::Delay];

/// The address of the first encoder.
pub const EA: EncoderAddress = EncoderAddress::truncate(3);

/// Eight requests are one act: done means once, not done means not, unknown means at most once.
///
/// Done means at most once only where this happened: the encoder heard what no master had sent, which changes its count, or an
/// answer came after the `ready_ns` of its request and could be taken for that of another of the eight. A request that the
/// line repeats is two, and one of an earlier attempt that it holds back is one of the eight.
pub fn zero_presets(setup: &Setup, noisy: bool, turns: u32, shown: &mut Shown) {
    let without: &[Kind] = if noisy { &[Kind::Repeat] } else { &UNKNOWABLE };
    let mut run = Run::new(setup, [3, 4], without);
    let mut reset = GuardedReset::new(Reset::set_single_turn_zero_and_shift_commutation_angle(EA));
    for turn in 0..turns {
        run.forget();
        // Somebody was broken off one short of eight.
        if !noisy && turn % 2 == 1 {
            for _ in 0..7 {
                let _ = run.transact(Request::new(EA, Operation::ZeroPreset), 0);
            }
        }
        let (since_ns, misheard) = (run.now_ns(), run.bench.misheard);
        let end = run.drive(&mut reset, since_ns);
        let acts = run.acts("zero", since_ns);
        let unknowable = run.bench.misheard > misheard || run.answered_late();
        if end.is_ok() && acts == 0 {
            *shown.ends.entry("zero preset: done, and it is not".to_owned()).or_default() += 1;
        }
        let right = match end {
            Ok(_) => acts == 1 || noisy && unknowable && acts == 0,
            Err(Error::EffectUnknown) => acts <= 1,
            // With one of the attempt before, which the line held back until the count had begun anew, seven are eight.
            Err(_) => acts == 0 || noisy && run.answered_late(),
        };
        assert!(right, "seed {} turn {turn}: {end:?}, and {acts} zero presets", setup.seed);
        run.shows_the_effect_when_it_should();
        if let Ok(status) = end {
            // Command 3 of encoder 3, and by then nothing is stored any more.
            let first = status.emit().contents()[0];
            assert_eq!((first >> 6 & 0x1f, first >> 3 & 7), (3, 3), "seed {} turn {turn}: no status", setup.seed);
        }
        if end == Err(Error::EffectUnknown) {
            // It says how long the encoder may be busy.
            let now_ns = run.now_ns();
            let alm = run.bench.encoders.all[0].alm(now_ns);
            assert!(!alm.contains(Alm::MEMBUSY), "seed {} turn {turn}: busy at ready_ns", setup.seed);
        }
        shown.ended(if noisy { "noisy zero preset" } else { "zero preset" }, end);
    }
    shown.take(&run);
}

/// The only encoder gets another address by command 11, whichever address its responses show.
pub fn addresses_by_wire(setup: &Setup, turns: u8, shown: &mut Shown) {
    let mut run = Run::new(setup, [3], &UNKNOWABLE);
    for turn in 0..turns {
        run.forget();
        let (since_ns, before) = (run.now_ns(), run.bench.kept()[0].ea);
        let new = (before + 1 + turn) % 8;
        let mut reset = GuardedReset::new(Reset::set_address_of_the_only_encoder(EncoderAddress::truncate(new)));
        let end = run.drive(&mut reset, since_ns);
        let (acts, after) = (run.acts("address", since_ns), run.bench.kept()[0].ea);
        let right = match end {
            // It may have been there already.
            Ok(_) => acts == usize::from(new != before) && after == new,
            Err(Error::EffectUnknown) => acts <= 1,
            Err(_) => acts == 0 && after == before,
        };
        let seed = setup.seed;
        assert!(right, "seed {seed} turn {turn}: {end:?}, {acts} changes, from {before} to {after}, not {new}");
        run.shows_the_effect_when_it_should();
        shown.ended("address by wire", end);
    }
    shown.take(&run);
}

/// One of two encoders gets another address by its identification code (command 20).
pub fn addresses_by_id(setup: &Setup, turns: u8, shown: &mut Shown) {
    let mut run = Run::new(setup, [1, 2], &UNKNOWABLE);
    for turn in 0..turns {
        run.forget();
        let since_ns = run.now_ns();
        let new = 3 + turn.wrapping_add(setup.seed as u8) % 5;
        let (which, before) = (usize::from(turn % 2), run.bench.kept());
        // Two encoders of one address are outside of what a master can keep apart.
        if before.iter().any(|kept| kept.ea == new) {
            continue;
        }
        let id = EncoderId::truncate(before[which].id);
        let mut write = VerifiedWrite::new(Write::address(id, EncoderAddress::truncate(new)));
        let end = run.drive(&mut write, since_ns);
        let (acts, after) = (run.acts("address", since_ns), run.bench.kept());
        let right = match end {
            Ok(()) => acts == 1 && after[which].ea == new,
            Err(Error::EffectUnknown) => acts <= 1,
            Err(_) => acts == 0 && after == before,
        };
        let seed = setup.seed;
        assert!(right, "seed {seed} turn {turn}: {end:?}, {acts} changes, {before:?} became {after:?}, not {new}");
        shown.ended("address by ID", end);
    }
    shown.take(&run);
}

/// The encoder that is found is the one that is there, with its own type word, whatever EA means to it.
pub fn detections(setup: &Setup, turns: u16, shown: &mut Shown) {
    let ea = (setup.seed / 7) as u8 % 8;
    let mut run = Run::new(setup, [ea], &[Kind::Foreign]);
    for turn in 0..turns {
        // 20, 22 or 24 bits, 16 bits of optical turns.
        let (word, before) = (0b10_001 + turn % 3, 0b10_001 + (turn + 2) % 3);
        run.bench.encoders.all[0].set_eeprom(0, 0xf6, word);
        run.undetermined(before);
        let mut detection = match turn % 2 {
            0 => Detection::search(),
            _ => Detection::of(EncoderAddress::truncate(ea)),
        };
        let now_ns = run.now_ns();
        let end = run.drive(&mut detection, now_ns);
        if let Ok(found) = end {
            assert_eq!((found.ea.get(), found.type_word.0), (ea, word), "seed {} turn {turn}", setup.seed);
            let widths = found.resolution.map(|resolution| (resolution.st_bits(), resolution.mt_bits()));
            assert_eq!(widths, Some(([20, 22, 24][usize::from(turn % 3)], 16)));
        }
        shown.ended("detection", end);
        run.forget();
    }
    shown.take(&run);
}

/// A word that is read is the word that is stored, whatever the encoder shows before it is determined.
pub fn eeprom_reads(setup: &Setup, turns: u16, shown: &mut Shown) {
    let mut run = Run::new(setup, [3, 4], &[Kind::Foreign]);
    let mut reads = [0x10, 0x22].map(|address| EepromRead::new(EA, address));
    let words = |turn: u16| [turn.wrapping_mul(0x111), turn.wrapping_mul(0x321).wrapping_add(7)];
    for turn in 0..turns {
        let which = usize::from(turn % 2);
        run.bench.encoders.all[0].set_eeprom(0, 0x10, words(turn)[0]);
        run.bench.encoders.all[0].set_eeprom(0, 0x22, words(turn)[1]);
        run.undetermined(words(turn.wrapping_sub(1))[which]);
        let read = &mut reads[which];
        let now_ns = run.now_ns();
        let end = run.drive(read, now_ns);
        let stored = words(turn)[which];
        let seed = setup.seed;
        assert!(end.is_err() || end == Ok(stored), "seed {seed} turn {turn}: {end:x?} instead of {stored:x}");
        shown.ended("read", end);
        run.forget();
    }
    shown.take(&run);
}

/// A write is sent once, and its end says what is stored.
pub fn writes(setup: &Setup, turns: u16, shown: &mut Shown) {
    let seed = setup.seed;
    let mut run = Run::new(setup, [3, 4], &[Kind::Repeat, Kind::Foreign]);
    run.bench.watch(0, 0x42);
    for turn in 0..turns {
        run.forget();
        let data = turn * 0x1001 + 1;
        let before = run.bench.kept()[0].word;
        run.undetermined(if turn % 3 == 0 { data } else { before.unwrap_or(0) });
        // Sometimes a read has just begun, and the memory is busy.
        if turn % 2 == 1 {
            let mut read = EepromRead::new(EA, 0x50);
            if let Step::Send { request, not_before_ns } = read.start(run.now_ns()) {
                let _ = run.transact(request, not_before_ns);
            }
        }
        let mut write = VerifiedWrite::new(Write::eeprom(EA, UserAddress::new(0x42).unwrap(), data));
        let since_ns = run.now_ns();
        let end = run.drive(&mut write, since_ns);
        let (acts, word) = (run.acts("word", since_ns), run.bench.kept()[0].word);
        let right = match end {
            Ok(()) => word == Some(data) && acts == 1,
            Err(Error::EffectUnknown) => acts <= 1,
            // The CRC-3 of a damaged request may be right by chance: the encoder has stored what nobody asked for.
            Err(Error::NotDone) if acts == 1 => word != Some(data) && word != before,
            Err(_) => word == before && acts == 0,
        };
        assert!(right, "seed {seed} turn {turn}: {end:?}, {acts} writes, {word:x?}");
        // The encoder said that it is busy, or would have said so.
        assert!(run.bench.hasty == 0 || run.answered_late(), "seed {seed} turn {turn}: a write to a busy encoder");
        shown.ended("write", end);
    }
    run.forget();
    let (since_ns, before) = (run.now_ns(), run.bench.kept()[0].id);
    let id = EncoderId::truncate(seed as u32 % 0x10_0000);
    let mut write = VerifiedWrite::new(Write::id(EA, id));
    let end = run.drive(&mut write, since_ns);
    let (acts, after) = (run.acts("id", since_ns), run.bench.kept()[0].id);
    let right = match end {
        Ok(()) => after == id.get() && acts == 1,
        Err(Error::EffectUnknown) => acts <= 1,
        Err(Error::NotDone) if acts == 1 => after != id.get() && after != before,
        Err(_) => after == before && acts == 0,
    };
    assert!(right, "seed {seed}: {end:?}, {acts} changes of the identification code, {after:x}");
    shown.ended("id", end);
    shown.take(&run);
}
