//! The async A-format driver: futures that are dropped at every point, and the hostile line.

use crate::frames::{Bench, Port, Shared, deliveries, line, place, scenario, shaft};
use crate::hostile::live_through;
use crate::late::{Late, World};
use crate::polls::{FOR_EVER, Looks, pause, run};
use crate::refusals::nikon::{STRICT, rows, widths};
use embedded_io::ErrorKind;
use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{Detection, Line};
use nikon_aformat::{BitRate, Doubt, EncoderAddress, Operation, Policy, Request, RequestFrame, Resolution};
use servowire_drivers::Error;
use servowire_drivers::nikon::Frame;
use servowire_drivers::nikon::asynch::{Driver, FramePort};
use servowire_world::{Delivery, Scenario, Verdict};

fn driver(bench: &Shared) -> Driver<Port, Port> {
    let port = Port(bench.clone());
    Driver::new(port.clone(), port, Resolution::default(), line())
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
    let answers = run(bus.read_bus(Operation::Abs40Mt, asked), FOR_EVER).unwrap().unwrap();
    for ea in asked.iter() {
        let abs = answers.exchange(ea).unwrap().response.abs40().unwrap().get();
        assert_eq!(abs, u64::from(bench.borrow().asked_at) | (3 + u64::from(ea.get())) << 20);
    }
    run(bus.clear_status(EncoderAddress::ZERO), FOR_EVER).unwrap().unwrap();
}

/// What `Evidence::at` refuses the driver refuses too, and what it takes is the same sample.
#[test]
fn a_doubt_of_the_crate_is_one_of_the_driver() {
    for row in rows() {
        let bench = Bench::new(Scenario::quiet());
        bench.borrow_mut().encoders[0].raise_alarms(row.alarms);
        let port = Port(bench.clone());
        let mut encoder = Driver::new(port.clone(), port, row.resolution, line());
        let refused = run(encoder.read_position(EncoderAddress::ZERO, row.policy), FOR_EVER).unwrap();
        assert!(matches!(refused, Err(Error::Doubt(doubt)) if (row.is)(doubt)), "{}: {refused:?}", row.what);
        let evidence = run(encoder.read_evidence(EncoderAddress::ZERO), FOR_EVER).unwrap().unwrap();
        let refused = evidence.at(bench.borrow().world.now_ns(), row.policy);
        assert!(refused.is_err_and(row.is), "{}: {refused:?}", row.what);
    }
    let bench = Bench::new(Scenario::quiet());
    let port = Port(bench.clone());
    let mut encoder = Driver::new(port.clone(), port, widths(20, 16), line());
    let evidence = run(encoder.read_evidence(EncoderAddress::ZERO), FOR_EVER).unwrap().unwrap();
    let sample = evidence.at(bench.borrow().world.now_ns(), Policy::new(60_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(1), Some(3)));
    let sample = run(encoder.read_position(EncoderAddress::ZERO, Policy::new(60_000)), FOR_EVER).unwrap().unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(2), Some(3)));
    // The lower 24 bits say less of the turns than the encoder counts.
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs24Low);
    let evidence = run(encoder.transact(request), FOR_EVER).unwrap().unwrap().evidence(widths(20, 16));
    assert_eq!(evidence.at(bench.borrow().world.now_ns(), STRICT), Err(Doubt::Absent));
}

#[test]
fn procedures_run_over_it() {
    let bench = Bench::new(Scenario::quiet());
    let mut encoder = driver(&bench);
    assert!(run(encoder.clear_status(EncoderAddress::ZERO), FOR_EVER).unwrap().is_ok());
    let found = run(encoder.run(&mut Detection::of(EncoderAddress::ZERO)), FOR_EVER).unwrap().unwrap();
    assert_eq!((found.ea, found.type_word.0), (EncoderAddress::ZERO, 17));
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}

/// The same for several encoders at once.
#[test]
fn a_future_of_a_bus_may_be_dropped_at_any_point() {
    let asked = Addresses::first(3);
    for polls in 0.. {
        let bench = Bench::with(Scenario::quiet(), 3, false);
        let mut bus = driver(&bench);
        let first = run(bus.read_bus(Operation::Abs40Mt, asked), polls);
        let second = run(bus.read_bus(Operation::Abs40Mt, asked), FOR_EVER).unwrap().unwrap();
        let bench = bench.borrow();
        for ea in asked.iter() {
            let shaft = shaft(second.exchange(ea).unwrap().response);
            let verdict = bench.world.truth().verdict(bench.request.unwrap(), shaft.into());
            assert_eq!(verdict, Verdict::Fresh, "{ea} after {polls} polls");
        }
        assert_eq!(bench.world.truth().clashes(), 0, "after {polls} polls");
        if first.is_some() {
            assert!(polls > 100);
            return;
        }
    }
}

/// No value older than its request, and no good answer lost, whatever has happened before: calls that were dropped among it.
#[test]
fn hostile_events_are_survived() {
    let calls = live_through(|calls, seed| {
        let bench = Bench::with(scenario(seed, 1, deliveries()[seed as usize % 3]), 1, true);
        let mut encoder = driver(&bench);
        for call in 0..100_usize {
            let polls = if call % 5 == 4 { call * 5 + seed as usize % 5 } else { FOR_EVER };
            let outcome = run(encoder.read_abs40(EncoderAddress::ZERO), polls);
            let outcome = outcome.map(|result| result.map(|exchange| shaft(exchange.response)));
            assert!(!matches!(outcome, Some(Err(Error::Closed | Error::NeverQuiet))), "seed {seed}, call {call}");
            bench.borrow_mut().judge(calls, outcome, seed, call);
        }
        *bench.borrow().world.tally()
    });
    assert!(calls.dropped > 1_000);
}

/// The same for three encoders at once: what comes whole of one is not lost, whatever becomes of the others.
#[test]
fn hostile_events_on_a_bus_are_survived() {
    let asked = Addresses::first(3);
    let calls = live_through(|calls, seed| {
        let bench = Bench::with(scenario(seed, 3, Delivery::Each), 3, true);
        let mut bus = driver(&bench);
        for call in 0..100_usize {
            let polls = if call % 5 == 4 { call * 12 + seed as usize % 12 } else { FOR_EVER };
            let answers = run(bus.read_bus(Operation::Abs40Mt, asked), polls);
            calls.dropped += u64::from(answers.is_none());
            for (ea, answers) in asked.iter().filter_map(|ea| answers.map(|answers| (ea, answers.unwrap()))) {
                let value = answers.exchange(ea).map(|exchange| shaft(exchange.response)).ok_or("missing");
                bench.borrow().judge_of_bus(calls, answers.bus(), ea, value, seed, call);
            }
            bench.borrow_mut().end_call();
        }
        *bench.borrow().world.tally()
    });
    assert!(calls.dropped > 1_000);
}

/// Another task has the processor while the request is handed over; the answer is damaged.
struct Sharing(Late);

impl FramePort for Sharing {
    type Error = ErrorKind;

    async fn send(&mut self, _: &[RequestFrame], _: u32) -> Result<(), ErrorKind> {
        pause().await;
        self.0.take(&[0])?;
        pause().await;
        if self.0.0.borrow().refuses { Err(ErrorKind::Other) } else { Ok(()) }
    }

    async fn take(&mut self) -> Result<Frame, ErrorKind> {
        Err(self.0.damage().await)
    }
}

/// However late the request left, wherever its future was dropped, and if the port failed after it had left: the next one does not go
/// out into its answer, which begins within 1000 bits and needs 72 more.
#[test]
fn what_was_held_up_is_not_talked_into() {
    for (held_up, refuses) in [(false, false), (true, false), (true, true)] {
        for polls in (0..200).chain([FOR_EVER]) {
            let late = Late::default();
            *late.0.borrow_mut() = World { held_up, refuses, ..World::default() };
            let line = Line::new(BitRate::Mbit4);
            let mut encoder = Driver::new(Sharing(late.clone()), Looks(late.clone()), Resolution::default(), line);
            for (call, polls) in [(1, polls), (2, FOR_EVER)] {
                late.0.borrow_mut().call = call;
                assert!(!matches!(run(encoder.read_abs40(EncoderAddress::ZERO), polls), Some(Ok(_))));
            }
            if let Some((last, next)) = late.0.borrow().between() {
                assert!(next - last >= 268_000, "{held_up} {refuses} {polls}: {last} {next}");
            }
        }
    }
}
