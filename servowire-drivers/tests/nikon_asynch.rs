//! The async A-format driver: futures that are dropped at every point, and the hostile line.

#![cfg(all(feature = "nikon", feature = "async"))]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod frames;
mod polls;

use frames::{Bench, Port, RATES, Shared, deliveries, host, line};
use nikon_aformat::bus::Addresses;
use nikon_aformat::{EncoderAddress, Operation, Resolution};
use polls::{FOR_EVER, run};
use servowire_drivers::Error;
use servowire_drivers::nikon::asynch::Master;
use servowire_world::{Kind, Scenario, Tally, Transmission, Verdict};

fn driver(bench: &Shared) -> Master<Port, Port> {
    let port = Port(bench.clone());
    Master::new(port.clone(), port, Resolution::default(), line())
}

#[test]
fn a_future_may_be_dropped_at_any_point() {
    for polls in 0.. {
        let bench = Bench::new(Scenario::quiet());
        let mut encoder = driver(&bench);
        let first = run(encoder.read_abs40(EncoderAddress::ZERO), polls);
        let second = run(encoder.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().unwrap();
        let shaft = second.response.abs40().unwrap().get() & 0xf_ffff;
        let bench = bench.borrow();
        assert_eq!(bench.world.truth().verdict(bench.request.unwrap(), shaft), Verdict::Fresh, "after {polls} polls");
        assert_eq!(bench.world.truth().clashes(), 0, "after {polls} polls");
        if first.is_some() {
            assert!(polls > 100);
            return;
        }
    }
}

#[test]
fn a_bus_is_read() {
    let bench = Bench::with(Scenario::quiet(), 3, false);
    let mut bus = driver(&bench);
    let asked = Addresses::first(3);
    let answers = run(bus.read_all(Operation::Abs40Mt, asked), FOR_EVER).unwrap().unwrap();
    for ea in asked.iter() {
        let abs = answers.reading(ea).unwrap().response.abs40().unwrap().get();
        assert_eq!(abs, u64::from(bench.borrow().asked_at) | (3 + u64::from(ea.get())) << 20);
    }
    run(bus.clear_status(EncoderAddress::ZERO), FOR_EVER).unwrap().unwrap();
}

/// No value older than its request, and no good answer lost, whatever has happened before: calls that were dropped among it.
#[test]
fn hostile_events_are_survived() {
    let events = std::env::var("HOSTILE_EVENTS").ok().and_then(|events| events.parse().ok()).unwrap_or(100_000);
    let (mut sum, mut seed, mut good, mut failed, mut dropped) = (Tally::default(), 0, 0, 0, 0);
    while sum.events() < events {
        let scenario = Scenario::random(seed, RATES);
        let host = host(scenario.host.echo, deliveries()[seed as usize % 3]);
        let bench = Bench::with(Scenario { host, ..scenario }, 1, true);
        let mut encoder = driver(&bench);
        for call in 0..100_usize {
            let polls = if call % 5 == 4 { call * 5 + seed as usize % 5 } else { FOR_EVER };
            let before = bench.borrow().world.tally().of(Kind::Preempt);
            let result = run(encoder.read_abs40(EncoderAddress::ZERO), polls);
            let mut bench = bench.borrow_mut();
            let Some(request) = bench.request else { continue };
            let preempted = bench.world.tally().of(Kind::Preempt) > before;
            let truth = bench.world.truth();
            let Some(sent) = truth.transmission(request) else { continue };
            let sent_ns = sent.sent_ns;
            let on_time =
                |answer: &Transmission| answer.start_ns < sent_ns + 15_000 && answer.end_ns - answer.start_ns == 28_800;
            let whole = !preempted && truth.undisturbed(request) && truth.intact_answers(request).any(on_time);
            match result {
                None => dropped += 1,
                Some(Ok(reading)) => {
                    let shaft = reading.response.abs40().unwrap().get() & 0xf_ffff;
                    let verdict = truth.verdict(request, shaft);
                    let old = matches!(verdict, Verdict::Old { .. });
                    assert!(preempted || !old, "seed {seed}, call {call}: {verdict:?}");
                    good += 1;
                }
                Some(Err(Error::Protocol(error))) => {
                    assert!(!whole, "seed {seed}, call {call}: {error}");
                    failed += 1;
                }
                Some(Err(error)) => panic!("{error:?}"),
            }
            let past_ns = bench.world.now_ns().saturating_sub(1_000_000);
            bench.world.truth_mut().forget_before(past_ns);
        }
        sum.add(bench.borrow().world.tally());
        seed += 1;
    }
    println!("{sum}\n{good} good, {failed} failed, {dropped} dropped");
    assert!(good > failed && failed > 100 && dropped > 100);
}
