//! The A-format driver on the hostile line.

#![cfg(feature = "nikon")]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod frames;

use frames::{Bench, Port, RATES, Shared, deliveries, host, line};
use nikon_aformat::bus::Addresses;
use nikon_aformat::master::Cycle;
use nikon_aformat::{EncoderAddress, Operation, Policy, Resolution};
use servowire_drivers::Error;
use servowire_drivers::nikon::blocking::Master;
use servowire_world::{Fault, Kind, Planned, Scenario, Script, Tally, Transmission, Verdict};

fn driver(bench: &Shared) -> Master<Port, Port> {
    let port = Port(bench.clone());
    Master::new(port.clone(), port, Resolution::default(), line())
}

#[test]
fn positions_come() {
    let bench = Bench::new(Scenario::quiet());
    let mut encoder = driver(&bench);
    for turn in 1..=10_u64 {
        let abs = encoder.read_abs40(EncoderAddress::ZERO).unwrap().response.abs40().unwrap().get();
        assert_eq!(abs, turn | 3 << 20);
    }
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}

/// Each fault alone, in the first exchange: the second one is good. (Noise makes the encoder deaf for the next request, which
/// is not the driver's to mend.)
#[test]
fn any_fault_is_over_with_the_next_call() {
    let faults = [
        Fault::Drop,
        Fault::Flip { bit: 4 },
        Fault::Flip { bit: 17 },
        Fault::Idle { bits: 20 },
        Fault::Cut,
        Fault::Delay { ns: 12_000 },
        Fault::Preempt { ns: 300_000 },
    ];
    for fault in faults {
        for (transmission, units) in [(0, 1), (1, 4)] {
            for unit in 0..units {
                let script = Script::planned(vec![Planned { transmission, unit, fault }]);
                let bench = Bench::new(Scenario { script, ..Scenario::quiet() });
                let mut encoder = driver(&bench);
                let first = encoder.read_abs40(EncoderAddress::ZERO);
                let second = encoder.read_abs40(EncoderAddress::ZERO);
                assert!(second.is_ok(), "{fault:?} in unit {unit} of {transmission}: {first:?}, {second:?}");
            }
        }
    }
}

/// No value older than its request, and no good answer lost, whatever has happened before.
#[test]
fn hostile_events_are_survived() {
    let events = std::env::var("HOSTILE_EVENTS").ok().and_then(|events| events.parse().ok()).unwrap_or(100_000);
    let (mut sum, mut seed, mut good, mut failed) = (Tally::default(), 0, 0, 0);
    while sum.events() < events {
        let scenario = Scenario::random(seed, RATES);
        let delivery = deliveries()[seed as usize % 3];
        let host = host(scenario.host.echo, delivery);
        let bench = Bench::with(Scenario { host, ..scenario }, 1, true);
        let mut encoder = driver(&bench);
        for call in 0..100 {
            let before = bench.borrow().world.tally().of(Kind::Preempt);
            let result = encoder.read_abs40(EncoderAddress::ZERO);
            let mut bench = bench.borrow_mut();
            let Some(request) = bench.request else { continue };
            let preempted = bench.world.tally().of(Kind::Preempt) > before;
            let truth = bench.world.truth();
            let sent_ns = truth.transmission(request).unwrap().sent_ns;
            let on_time =
                |answer: &Transmission| answer.start_ns < sent_ns + 15_000 && answer.end_ns - answer.start_ns == 28_800;
            let whole = !preempted && truth.undisturbed(request) && truth.intact_answers(request).any(on_time);
            match result {
                Ok(reading) => {
                    let shaft = reading.response.abs40().unwrap().get() & 0xf_ffff;
                    let verdict = truth.verdict(request, shaft);
                    assert!(
                        preempted || !matches!(verdict, Verdict::Old { .. }),
                        "seed {seed}, call {call}: {verdict:?}"
                    );
                    good += 1;
                }
                Err(Error::Protocol(error)) => {
                    assert!(!whole, "seed {seed}, call {call}: {error}");
                    failed += 1;
                }
                Err(error) => panic!("{error:?}"),
            }
            let past_ns = bench.world.now_ns().saturating_sub(1_000_000);
            bench.world.truth_mut().forget_before(past_ns);
        }
        sum.add(bench.borrow().world.tally());
        seed += 1;
    }
    println!("{sum}\n{good} good, {failed} failed");
    assert!(good > failed && failed > 100);
}

/// Bytes one by one, in DMA blocks, at idle: the values are the same.
#[test]
fn frames_may_come_in_blocks() {
    for delivery in deliveries() {
        let bench = Bench::with(Scenario { host: host(false, delivery), ..Scenario::quiet() }, 1, true);
        let mut encoder = driver(&bench);
        for turn in 1..=5_u32 {
            let position = encoder.read_position(EncoderAddress::ZERO, Policy::STRICT).unwrap();
            assert_eq!((position.single_turn, position.turns), (turn, 3), "{delivery:?}");
        }
        assert_eq!(bench.borrow().world.truth().clashes(), 0);
    }
}

/// Five encoders on a line, read in a cycle: each gives its own value of the same instant, and one that is hurt costs no other one.
#[test]
fn a_bus_is_read_in_its_cycle() {
    let asked = Addresses::first(5);
    let lost = Planned { transmission: 3, unit: 1, fault: Fault::Drop };
    let bench = Bench::with(Scenario { script: Script::planned(vec![lost]), ..Scenario::quiet() }, 5, false);
    let mut bus = driver(&bench);
    let mut cycle = Cycle::new(1_000_000, 900_000, 50_000).unwrap();
    for turn in 1..=4 {
        let answers = bus.read_cycle(&mut cycle, Operation::Abs40Mt, asked).unwrap();
        let good: Vec<_> = asked.iter().filter_map(|ea| answers.reading(ea).map(|reading| (ea, reading))).collect();
        let shaft = bench.borrow().asked_at;
        for (ea, reading) in &good {
            let abs = reading.response.abs40().unwrap().get();
            assert_eq!(abs, u64::from(shaft) | (3 + u64::from(ea.get())) << 20);
        }
        assert_eq!(good.len(), if turn == 1 { 4 } else { 5 });
    }
    let now_ns = bench.borrow().world.now_ns();
    assert!((3_050_000..3_700_000).contains(&now_ns), "{now_ns}: the fourth of a grid of 1 ms");
    assert_eq!(cycle.missed(), 0);
    assert_eq!(bus.read_abs40(EncoderAddress::truncate(4)).unwrap().response.ea.get(), 4);
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}

#[test]
fn procedures_run_over_it() {
    let bench = Bench::new(Scenario::quiet());
    let mut encoder = driver(&bench);
    encoder.clear_status(EncoderAddress::ZERO).unwrap();
    let type_word = encoder.read_eeprom(EncoderAddress::ZERO, 0).unwrap();
    assert_eq!(encoder.read_eeprom(EncoderAddress::ZERO, 0), Ok(type_word));
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}
