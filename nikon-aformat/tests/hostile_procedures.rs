//! The laws of time on a hostile line: what cannot be undone, and what is read back.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test hostile_procedures -- --nocapture` prints the mix.
#![allow(missing_docs, clippy::arithmetic_side_effects, clippy::cast_possible_truncation, clippy::indexing_slicing)]
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::collections::BTreeMap;

use common::line::{Bench, events, host_within, rates};
use nikon_aformat::device::{Behaviour, Device, Encoders};
use nikon_aformat::master::{EepromRead, GuardedReset, Line, Progress, Reset, Step, Transaction, VerifiedWrite, Write};
use nikon_aformat::{BitRate, EncoderAddress, EncoderId, Error, Request, Resolution, Response, UserAddress};
use servowire_world::{Kind, Scenario, Tally};

/// Four of the open points, by the bits of a number.
fn behaviour(seed: u64) -> Behaviour {
    let behaviour = Behaviour::new().with_turn_around_ns([2_800, 900, 5_000, 15_000][(seed >> 3) as usize % 4]);
    let behaviour = if seed & 1 == 0 { behaviour } else { behaviour.not_busy_in_first_read() };
    let behaviour = if seed & 2 == 0 { behaviour } else { behaviour.showing_in_the_eighth() };
    if seed & 4 == 0 { behaviour } else { behaviour.showing_the_old_address() }
}

/// Two encoders on one line, and how procedures ended.
struct Run {
    bench: Bench<2>,
    line: Line,
    at_ns: u64,
    seed: u64,
}

/// How often what happened.
#[derive(Debug, Default)]
struct Shown {
    ends: BTreeMap<String, u64>,
    tally: Tally,
}

impl Run {
    fn new(seed: u64, hurt: impl Fn(Scenario) -> Scenario) -> Self {
        let rate = BitRate::ALL[seed as usize % 5];
        let line = Line::new(rate).with_response_timeout_ns(20_000);
        let scenario = hurt(host_within(Scenario::random(seed, rates(seed)), line.latency_ns));
        let device = |ea| {
            let mut device = Device::<2>::new(EncoderAddress::truncate(ea), Resolution::default(), rate);
            device.set_behaviour(behaviour(seed / 5));
            device
        };
        Self { bench: Bench::new(Encoders { all: [device(3), device(4)] }, rate, scenario), line, at_ns: 1_000, seed }
    }

    fn transact(&mut self, request: Request, not_before_ns: u64) -> (Result<Response, Error>, u64) {
        self.at_ns = self.bench.world.now_ns().max(self.at_ns).max(not_before_ns);
        // Nothing happens on the line meanwhile.
        while self.bench.next(self.at_ns).is_ok() {}
        let mut transaction = Transaction::start(request, Resolution::default(), self.line, self.at_ns);
        self.bench.send(transaction.frames(), self.at_ns);
        loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => match self.bench.next(until_ns) {
                    Ok(block) => drop(transaction.block(&block.frames, block.since_ns, block.end_ns)),
                    Err(now_ns) => drop(transaction.poll(now_ns)),
                },
                Progress::Done { value, ready_ns } => {
                    self.at_ns = ready_ns;
                    return (Ok(value.response), self.bench.world.now_ns());
                }
                Progress::Failed { error, ready_ns } => {
                    self.at_ns = ready_ns;
                    return (Err(error), self.bench.world.now_ns());
                }
            }
        }
    }

    fn drive<T: Copy>(
        &mut self,
        first: Step<T>,
        mut receive: impl FnMut(Result<Response, Error>, u64) -> Step<T>,
    ) -> Result<T, Error> {
        let mut step = first;
        for _ in 0..200 {
            match step {
                Step::Send { request, not_before_ns } => {
                    let (outcome, now_ns) = self.transact(request, not_before_ns);
                    step = receive(outcome, now_ns);
                }
                Step::Done { value, ready_ns } => {
                    self.at_ns = self.at_ns.max(ready_ns);
                    return Ok(value);
                }
                Step::Failed { error, ready_ns } => {
                    self.at_ns = self.at_ns.max(ready_ns);
                    return Err(error);
                }
            }
        }
        panic!("seed {}: a procedure without end", self.seed)
    }

    fn now_ns(&self) -> u64 {
        self.bench.world.now_ns().max(self.at_ns)
    }

    /// What encoders did because of requests sent since `since_ns`; a request that the line delayed may belong to a procedure
    /// before.
    fn acts(&self, what: &str, since_ns: u64) -> usize {
        let truth = self.bench.world.truth();
        let own = |id| truth.transmission(id).is_some_and(|sent| sent.asked_ns >= since_ns);
        truth.acts.iter().filter(|act| act.what == what && own(act.request)).count()
    }

    fn forget(&mut self) {
        let truth = self.bench.world.truth_mut();
        truth.acts.clear();
        truth.forget_before(self.at_ns.saturating_sub(1_000_000));
    }
}

impl Shown {
    fn ended<T>(&mut self, what: &str, end: Result<T, Error>) {
        let end = end.err().map_or("done", |error| error.class().name());
        *self.ends.entry(format!("{what}: {end}")).or_default() += 1;
    }
}

/// Runs seeds until enough has happened.
fn seeds(mut run: impl FnMut(u64, &mut Shown)) -> Shown {
    let mut shown = Shown::default();
    let from = std::env::var("SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    for seed in from.. {
        run(seed, &mut shown);
        if shown.tally.events() > events() {
            break;
        }
    }
    println!("{:?}\n{}", shown.ends, shown.tally);
    shown
}

const EA: EncoderAddress = EncoderAddress::truncate(3);

/// The eight requests are one act: done means once, not done means not, unknown means at most once.
#[test]
fn hostile_resets() {
    let shown = seeds(|seed, shown| {
        // What the encoder hears and no master has sent changes its count, and no master can know it.
        let mut run = Run::new(seed, |mut scenario| {
            let rates = scenario.script.rates.with(Kind::Repeat, 0);
            scenario.script.rates = rates.with(Kind::Foreign, 0).with(Kind::Noise, 0);
            scenario
        });
        let mut reset = GuardedReset::new(Reset::set_single_turn_zero_and_shift_commutation_angle(EA));
        for turn in 0..6 {
            run.forget();
            let since_ns = run.now_ns();
            let first = reset.start(since_ns);
            let end = run.drive(first, |outcome, now_ns| reset.receive(outcome, now_ns));
            let acts = run.acts("zero", since_ns);
            let right = match end {
                Ok(_) => acts == 1,
                Err(Error::EffectUnknown) => acts <= 1,
                Err(_) => acts == 0,
            };
            assert!(right, "seed {seed} turn {turn}: {end:?}, and {acts} zero presets");
            if end == Err(Error::EffectUnknown) {
                // It says how long the encoder may be busy.
                let now_ns = run.now_ns();
                let alm = run.bench.encoders.all[0].alm(now_ns);
                assert!(!alm.contains(nikon_aformat::Alm::MEMBUSY), "seed {seed} turn {turn}: busy at ready_ns");
            }
            shown.ended("zero preset", end);
        }
        shown.tally.add(run.bench.world.tally());
    });
    for end in ["done", "interrupted", "effect_unknown"] {
        assert!(shown.ends.contains_key(&format!("zero preset: {end}")), "{end} never happened");
    }
}

/// A word that is read is the word that is stored, whatever the encoder shows before it is determined.
#[test]
fn hostile_eeprom_reads() {
    seeds(|seed, shown| {
        let mut run = Run::new(seed, |mut scenario| {
            scenario.script.rates = scenario.script.rates.with(Kind::Foreign, 0);
            scenario
        });
        let mut reads = [0x10, 0x22].map(|address| EepromRead::new(EA, address));
        for turn in 0..10_u16 {
            run.bench.encoders.all[0].set_eeprom(0, 0x10, turn * 0x111);
            run.bench.encoders.all[0].set_eeprom(0, 0x22, turn * 0x321 + 7);
            let read = &mut reads[usize::from(turn % 2)];
            let first = read.start(run.now_ns());
            let end = run.drive(first, |outcome, now_ns| read.receive(outcome, now_ns));
            let stored = [turn * 0x111, turn * 0x321 + 7][usize::from(turn % 2)];
            assert!(end.is_err() || end == Ok(stored), "seed {seed} turn {turn}: {end:x?} instead of {stored:x}");
            shown.ended("read", end);
            run.forget();
        }
        shown.tally.add(run.bench.world.tally());
    });
}

/// A write is sent once, and its end says what is stored.
#[test]
fn hostile_writes() {
    let shown = seeds(|seed, shown| {
        let mut run = Run::new(seed, |mut scenario| {
            scenario.script.rates = scenario.script.rates.with(Kind::Repeat, 0).with(Kind::Foreign, 0);
            scenario
        });
        run.bench.watch(0, 0x42);
        for turn in 0..6_u16 {
            run.forget();
            let data = turn * 0x1001 + 1;
            let before = run.bench.words()[0];
            // Sometimes a read has just begun, and the memory is busy.
            if turn % 2 == 1 {
                let mut read = EepromRead::new(EA, 0x50);
                if let Step::Send { request, not_before_ns } = read.start(run.now_ns()) {
                    let _ = run.transact(request, not_before_ns);
                }
            }
            let mut write = VerifiedWrite::new(Write::eeprom(EA, UserAddress::new(0x42).unwrap(), data));
            let since_ns = run.now_ns();
            let first = write.start(since_ns);
            let end = run.drive(first, |outcome, now_ns| write.receive(outcome, now_ns));
            let (acts, word) = (run.acts("word", since_ns), run.bench.words()[0]);
            let right = match end {
                Ok(()) => word == Some(data) && acts == 1,
                Err(Error::EffectUnknown) => acts <= 1,
                Err(_) => word == before && acts == 0,
            };
            assert!(right, "seed {seed} turn {turn}: {end:?}, {acts} writes, {word:x?}");
            shown.ended("write", end);
        }
        let id = EncoderId::truncate(seed as u32);
        let mut write = VerifiedWrite::new(Write::id(EA, id));
        let first = write.start(run.now_ns());
        let end = run.drive(first, |outcome, now_ns| write.receive(outcome, now_ns));
        shown.ended("id", end);
        shown.tally.add(run.bench.world.tally());
    });
    for end in ["done", "not_done", "effect_unknown"] {
        assert!(shown.ends.contains_key(&format!("write: {end}")), "{end} never happened");
    }
}
