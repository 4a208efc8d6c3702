//! The A-format driver on the hostile line.

use crate::frames::{Bench, Port, Shared, deliveries, host, line, place, scenario, shaft};
use crate::hostile::{Calls, live_through};
use crate::late::{Late, World};
use crate::refusals::nikon::{STRICT, rows, widths};
use embedded_io::ErrorKind;
use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{Cycle, Detection, Line};
use nikon_aformat::{BitRate, Doubt, EncoderAddress, Operation, Policy, Request, RequestFrame, Resolution};
use servowire_drivers::Error;
use servowire_drivers::nikon::Frame;
use servowire_drivers::nikon::blocking::{Driver, FramePort};
use servowire_world::{Delivery, Fault, Planned, Scenario, Script, Tally};

fn driver(bench: &Shared) -> Driver<Port, Port> {
    let port = Port(bench.clone());
    Driver::new(port.clone(), port, Resolution::default(), line())
}

#[test]
fn positions_come() {
    let bench = Bench::new(Scenario::quiet());
    let mut encoder = driver(&bench);
    for turn in 1..=10 {
        let abs = encoder.read_abs40(EncoderAddress::ZERO).unwrap().response.abs40().unwrap().get();
        assert_eq!(abs, u64::from(place(turn)) | 3 << 20);
    }
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}

/// What `Evidence::at` refuses the driver refuses too, and what it takes is the same sample.
#[test]
fn a_doubt_of_the_crate_is_one_of_the_driver() {
    for row in rows() {
        let bench = Bench::new(Scenario::quiet());
        bench.borrow_mut().encoders[0].raise_alarms(row.alarms);
        let port = Port(bench.clone());
        let mut encoder = Driver::new(port.clone(), port, row.resolution, line());
        let refused = encoder.read_position(EncoderAddress::ZERO, row.policy);
        assert!(matches!(refused, Err(Error::Doubt(doubt)) if (row.is)(doubt)), "{}: {refused:?}", row.what);
        let evidence = encoder.read_evidence(EncoderAddress::ZERO).unwrap();
        let refused = evidence.at(bench.borrow().world.now_ns(), row.policy);
        assert!(refused.is_err_and(row.is), "{}: {refused:?}", row.what);
    }
    let bench = Bench::new(Scenario::quiet());
    let port = Port(bench.clone());
    let mut encoder = Driver::new(port.clone(), port, widths(20, 16), line());
    let evidence = encoder.read_evidence(EncoderAddress::ZERO).unwrap();
    let sample = evidence.at(bench.borrow().world.now_ns(), Policy::new(60_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(1), Some(3)));
    let sample = encoder.read_position(EncoderAddress::ZERO, Policy::new(60_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(2), Some(3)));
    // The lower 24 bits say less of the turns than the encoder counts.
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs24Low);
    let evidence = encoder.transact(request).unwrap().evidence(widths(20, 16));
    assert_eq!(evidence.at(bench.borrow().world.now_ns(), STRICT), Err(Doubt::Absent));
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
    live_through(|calls, seed| {
        let bench = Bench::with(scenario(seed, 1, deliveries()[seed as usize % 3]), 1, true);
        let mut encoder = driver(&bench);
        for call in 0..100 {
            let result = encoder.read_abs40(EncoderAddress::ZERO).map(|exchange| shaft(exchange.response));
            assert!(!matches!(result, Err(Error::Closed | Error::NeverQuiet)), "seed {seed}, call {call}: {result:?}");
            bench.borrow_mut().judge(calls, Some(result), seed, call);
        }
        *bench.borrow().world.tally()
    });
}

/// A hundred calls with three encoders at once: what comes whole of one is not lost, whatever becomes of the others.
fn live_with_a_bus(calls: &mut Calls, seed: u64) -> Tally {
    let asked = Addresses::first(3);
    let bench = Bench::with(scenario(seed, 3, Delivery::Each), 3, true);
    let mut bus = driver(&bench);
    for call in 0..100 {
        let answers = bus.read_bus(Operation::Abs40Mt, asked).unwrap();
        for ea in asked.iter() {
            let value = answers.exchange(ea).map(|exchange| shaft(exchange.response)).ok_or("missing");
            bench.borrow().judge_of_bus(calls, answers.bus(), ea, value, seed, call);
        }
        bench.borrow_mut().end_call();
    }
    *bench.borrow().world.tally()
}

#[test]
fn hostile_events_on_a_bus_are_survived() {
    live_through(live_with_a_bus);
}

/// Two bits of the request are hurt, and the encoders answer to another command: those answers are refused.
#[test]
fn answers_to_another_command_are_not_lost_ones() {
    live_with_a_bus(&mut Calls::default(), 16_908);
}

/// The answer to a request that was heard must not be lost.
#[test]
#[should_panic(expected = "lost")]
fn an_answer_that_is_lost_is_noticed() {
    let bench = Bench::with(Scenario::quiet(), 3, true);
    let answers = driver(&bench).read_bus(Operation::Abs40Mt, Addresses::first(3)).unwrap();
    let ea = EncoderAddress::truncate(2);
    bench.borrow().judge_of_bus(&mut Calls::default(), answers.bus(), ea, Err("lost"), 0, 0);
}

/// Bytes one by one, in DMA blocks, at idle: the values are the same.
#[test]
fn frames_may_come_in_blocks() {
    for delivery in deliveries() {
        let bench = Bench::with(Scenario { host: host(false, delivery), ..Scenario::quiet() }, 1, true);
        let mut encoder = driver(&bench);
        for turn in 1..=5_u32 {
            let position = encoder.read_position(EncoderAddress::ZERO, Policy::new(100_000)).unwrap();
            assert_eq!((position.single_turn(), position.turns()), (place(turn), Some(3)), "{delivery:?}");
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
        let good: Vec<_> = asked.iter().filter_map(|ea| answers.exchange(ea).map(|exchange| (ea, exchange))).collect();
        let shaft = bench.borrow().asked_at;
        for (ea, exchange) in &good {
            let abs = exchange.response.abs40().unwrap().get();
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
    assert_eq!(encoder.run(&mut Detection::of(EncoderAddress::ZERO)).map(|found| found.ea), Ok(EncoderAddress::ZERO));
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}

/// A port that is held up for 10 ms before its request leaves, by which time the answer is overdue.
struct HeldUp<'a> {
    now_ns: &'a std::cell::Cell<u64>,
    left_ns: Vec<u64>,
}

impl servowire_drivers::nikon::blocking::FramePort for &mut HeldUp<'_> {
    type Error = ();

    fn send(&mut self, _: &[nikon_aformat::RequestFrame], _: u32) -> Result<(), ()> {
        if self.left_ns.is_empty() {
            self.now_ns.set(self.now_ns.get() + 10_000_000);
        }
        self.left_ns.push(self.now_ns.get());
        Ok(())
    }

    fn take(&mut self) -> Result<Option<servowire_drivers::nikon::Frame>, ()> {
        Ok(None)
    }
}

/// At 2.5 Mbit/s: 18 bits of request, some 4 us, and three frames of 18 bits.
#[test]
fn a_request_that_was_held_up_is_not_followed_into_its_answer() {
    let now_ns = std::cell::Cell::new(0);
    let mut port = HeldUp { now_ns: &now_ns, left_ns: Vec::new() };
    let clock = || {
        now_ns.set(now_ns.get() + 100);
        now_ns.get()
    };
    let mut encoder = Driver::new(&mut port, clock, Resolution::default(), line());
    assert!(encoder.read_abs40(EncoderAddress::ZERO).is_err());
    assert!(encoder.read_abs40(EncoderAddress::ZERO).is_err());
    let left = port.left_ns;
    assert!(left[1] - left[0] >= 7_200 + 4_000 + 21_600, "{left:?}");
}

/// A port that is kept from its work while a request is handed over, and hears a damaged answer.
struct Sharing(Late);

impl FramePort for Sharing {
    type Error = ErrorKind;

    fn send(&mut self, _: &[RequestFrame], _: u32) -> Result<(), ErrorKind> {
        self.0.take(&[0])?;
        if self.0.0.borrow().refuses { Err(ErrorKind::Other) } else { Ok(()) }
    }

    fn take(&mut self) -> Result<Option<Frame>, ErrorKind> {
        if self.0.complains() { Err(ErrorKind::Other) } else { Ok(None) }
    }
}

/// However late the request left, and if the port failed after it had left: the next one does not go out into its answer, which begins
/// within 1000 bits and needs 72 more.
#[test]
fn what_was_held_up_is_not_talked_into() {
    for stalls_in in 0..60 {
        for (held_up, refuses) in [(false, false), (true, false), (true, true)] {
            let late = Late::default();
            *late.0.borrow_mut() = World { stalls_in: Some(stalls_in), held_up, refuses, ..World::default() };
            let line = Line::new(BitRate::Mbit4);
            let mut encoder = Driver::new(Sharing(late.clone()), late.clone(), Resolution::default(), line);
            for call in 1..=2 {
                late.0.borrow_mut().call = call;
                assert!(encoder.read_abs40(EncoderAddress::ZERO).is_err());
            }
            let (last, next) = late.0.borrow().between().unwrap();
            assert!(next - last >= 268_000, "{stalls_in} {held_up} {refuses}: {last} {next}");
        }
    }
}
