//! The laws of time on a hostile line: single transactions and buses.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test hostile -- --nocapture` prints the mix.
#![allow(missing_docs, clippy::arithmetic_side_effects, clippy::cast_possible_truncation, clippy::indexing_slicing)]
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::line::{Bench, events, frame_ns, host_within, idle_ns, rates};
use nikon_aformat::bus::Addresses;
use nikon_aformat::device::{Device, Encoders};
use nikon_aformat::master::{BusTransaction, Line, Progress, Transaction};
use nikon_aformat::{BitRate, EncoderAddress, Operation, Request, Resolution};
use servowire_world::{Id, Kind, Scenario, Speaker, Tally, Transmission, Verdict};

fn encoders<const N: usize>(rate: BitRate, addresses: [u8; N]) -> Encoders<N, 2> {
    Encoders { all: addresses.map(|ea| Device::new(EncoderAddress::truncate(ea), Resolution::default(), rate)) }
}

/// What a run has shown.
#[derive(Debug, Default)]
struct Shown {
    runs: u64,
    good: u64,
    failed: u64,
    /// Not seen by the CRC-8, or a foreign speaker's.
    unknown: u64,
    forged: u64,
    tally: Tally,
}

/// Whether the request left when the master believed, so that it can know the age of an answer.
fn on_time<const N: usize>(bench: &Bench<N>, id: Id, at_ns: u64) -> bool {
    bench
        .world
        .truth()
        .transmission(id)
        .is_some_and(|sent| (sent.start_ns, sent.end_ns) == (at_ns, at_ns + frame_ns(bench.rate)))
}

fn judge<const N: usize>(bench: &Bench<N>, id: Id, value: u64, shown: &mut Shown, seed: u64) {
    match bench.world.truth().verdict(id, value) {
        Verdict::Fresh => {}
        Verdict::Unknown => shown.unknown += 1,
        Verdict::Forged { .. } => shown.forged += 1,
        Verdict::Old { of } => panic!("seed {seed}: {value:#x} of {of:?} is older than {id:?}"),
    }
}

/// Law 4: no encoder that began in time speaks at `ready_ns` or later.
fn line_is_free<const N: usize>(bench: &Bench<N>, id: Id, ready_ns: u64, seed: u64) {
    let truth = bench.world.truth();
    let asked_ns = truth.transmission(id).map_or(0, |sent| sent.end_ns);
    let longest_ns = |units: u64| units * frame_ns(bench.rate) + (units - 1) * idle_ns(bench.rate);
    let in_time = |t: &&Transmission| {
        t.answers == Some(id)
            && t.start_ns <= asked_ns + TIMEOUT_NS
            && t.end_ns - t.start_ns <= longest_ns(t.units as u64)
            && matches!(t.speaker, Speaker::Device(_))
    };
    let late = truth.speaking_from(ready_ns).find(in_time);
    assert!(late.is_none(), "seed {seed}: ready at {ready_ns}, but {late:?}");
}

/// How long the masters of these tests wait for a response.
const TIMEOUT_NS: u64 = 20_000;

fn line(rate: BitRate) -> Line {
    Line::new(rate).with_response_timeout_ns(TIMEOUT_NS as u32)
}

fn single(seed: u64, shown: &mut Shown) {
    let rate = BitRate::ALL[seed as usize % 5];
    let line = line(rate);
    let scenario = host_within(Scenario::random(seed, rates(seed)), line.latency_ns);
    let mut bench = Bench::new(encoders(rate, [0, 3, 6]), rate, scenario);
    let mut at_ns = 1_000;
    let failed = shown.failed;
    for turn in 0..60_u64 {
        let ea = EncoderAddress::truncate([0, 3, 6][(turn % 3) as usize]);
        let request = Request::new(ea, Operation::Abs40);
        let mut transaction = Transaction::start(request, Resolution::default(), line, at_ns);
        let id = bench.send(transaction.frames(), at_ns);
        let end = loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => match bench.next(until_ns) {
                    Ok(block) => drop(transaction.block(&block.frames, block.since_ns, block.end_ns)),
                    Err(now_ns) => drop(transaction.poll(now_ns)),
                },
                end => break end,
            }
        };
        let known = on_time(&bench, id, at_ns);
        let ready_ns = match end {
            Progress::Done { value, ready_ns } => {
                shown.good += 1;
                if known {
                    judge(&bench, id, value.response.abs40().unwrap().get(), shown, seed);
                    let sent_ns = bench.world.truth().transmission(id).unwrap().end_ns;
                    assert!(value.sampled.earliest_ns.abs_diff(sent_ns) <= 1 && value.sampled.latest_ns >= sent_ns);
                }
                ready_ns
            }
            Progress::Failed { error, ready_ns } => {
                shown.failed += 1;
                let mut intact = bench.world.truth().intact_answers(id);
                let lost = intact.find(|t| {
                    t.units == 4
                        && t.speaker == Speaker::Device((turn % 3) as u8)
                        && t.delivered_ns < bench.world.now_ns()
                });
                assert!(
                    !known || lost.is_none_or(|t| bench.is_excused(t)),
                    "seed {seed} turn {turn}: {error}, but {lost:?}"
                );
                ready_ns
            }
            Progress::Pending { .. } => unreachable!(),
        };
        if known {
            line_is_free(&bench, id, ready_ns, seed);
        }
        at_ns = bench.world.now_ns().max(ready_ns) + turn % 7 * 100;
        bench.world.truth_mut().forget_before(at_ns.saturating_sub(2_000_000));
    }
    if seed % 4 == 0 && bench.world.host().fifo == 0 {
        assert_eq!(failed, shown.failed, "seed {seed}: on a quiet line nothing is lost, {:?}", bench.world.host());
    }
    shown.runs += 1;
    shown.tally.add(bench.world.tally());
}

#[test]
fn hostile_transactions() {
    let mut shown = Shown::default();
    let from = std::env::var("SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    for seed in from.. {
        single(seed, &mut shown);
        if shown.tally.events() > events() {
            break;
        }
    }
    println!("{shown:?}");
}

fn bus(seed: u64, shown: &mut Shown) {
    let rate = BitRate::ALL[seed as usize % 5];
    let line = line(rate);
    let scenario = host_within(Scenario::random(seed, rates(seed)), line.latency_ns);
    let mut bench = Bench::new(encoders(rate, [0, 1, 2, 3, 4, 5, 6, 7]), rate, scenario);
    let mut at_ns = 1_000;
    for turn in 0..30_u64 {
        let asked = Addresses::from_bits((seed.wrapping_mul(0x9e37_79b9) >> (turn % 24)) as u8 | 1 << (turn % 8));
        let request = Request::new(asked.highest().unwrap(), Operation::Abs40Mt);
        let mut transaction = BusTransaction::start(request, Resolution::default(), asked, line, at_ns);
        let id = bench.send(transaction.frames(), at_ns);
        let ready_ns = loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => match bench.next(until_ns) {
                    Ok(block) => drop(transaction.block(&block.frames, block.since_ns, block.end_ns)),
                    Err(now_ns) => drop(transaction.poll(now_ns)),
                },
                Progress::Done { ready_ns, .. } => break ready_ns,
                Progress::Failed { error, .. } => panic!("seed {seed}: {error}"),
            }
        };
        if on_time(&bench, id, at_ns) {
            for ea in asked.iter() {
                if let Some(reading) = transaction.reading(ea) {
                    shown.good += 1;
                    judge(&bench, id, reading.response.abs40().unwrap().get(), shown, seed);
                    continue;
                }
                shown.failed += 1;
                let mut intact = bench.world.truth().intact_answers(id);
                let lost = intact.find(|t| {
                    t.units == 4 && t.speaker == Speaker::Device(ea.get()) && t.delivered_ns < bench.world.now_ns()
                });
                let doubled = transaction.bus().duplicates().has(ea);
                assert!(
                    doubled || lost.is_none_or(|t| bench.is_excused(t)),
                    "seed {seed} turn {turn}: {ea} lost, {lost:?}"
                );
            }
            line_is_free(&bench, id, ready_ns, seed);
        }
        at_ns = bench.world.now_ns().max(ready_ns);
        bench.world.truth_mut().forget_before(at_ns.saturating_sub(2_000_000));
    }
    shown.runs += 1;
    shown.tally.add(bench.world.tally());
}

#[test]
fn hostile_buses() {
    let mut shown = Shown::default();
    let from = std::env::var("SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    for seed in from.. {
        bus(seed, &mut shown);
        if shown.tally.events() > events() {
            break;
        }
    }
    assert!(shown.tally.of(Kind::Flip) > 0);
    println!("{shown:?}");
}
