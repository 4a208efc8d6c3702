//! The blocking driver on the hostile line.

use crate::bench::{Bench, Misframed, Pin, Shared, Uart, WORST, Watch, line, place, scenario};
use crate::hostile::live_through;
use crate::late::{Late, World};
use crate::refusals::tformat::{STRICT, rows, widths};
use servowire_drivers::tformat::blocking::Driver;
use servowire_drivers::{DirectionPin, Error};
use servowire_world::{Fault, Planned, Scenario, Script, Verdict};
use tformat::master::{Detection, Line};
use tformat::{Address, Almc, BitRate, Doubt, Page, Policy, Request, Resolution, Sample, Tolerated};

fn driver(bench: &Shared) -> Driver<Uart, DirectionPin<Pin>, Watch> {
    driver_at(bench, Line::new(BitRate::Mbit2_5))
}

fn driver_at(bench: &Shared, line: Line) -> Driver<Uart, DirectionPin<Pin>, Watch> {
    Driver::new(Uart(bench.clone()), DirectionPin::new(Pin(bench.clone()), WORST), Watch(bench.clone()), line).unwrap()
}

fn planned(faults: &[(u16, u8, Fault)]) -> Scenario {
    let planned = faults.iter().map(|&(transmission, unit, fault)| Planned { transmission, unit, fault });
    Scenario { script: Script::planned(planned.collect()), ..Scenario::quiet() }
}

#[test]
fn positions_come_and_the_pin_is_right() {
    let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
    let mut encoder = driver(&bench);
    for _ in 0..10 {
        let all = encoder.read_data().unwrap();
        let bench = bench.borrow();
        let request = bench.request.unwrap();
        let truth = bench.truth();
        assert_eq!(truth.verdict(request, all.abs.get().into()), Verdict::Fresh);
        let sent = truth.transmission(request).unwrap();
        assert!(bench.on_at_ns + 400 <= sent.start_ns, "one bit before the start bit");
        // not before the last bit has left, and not when the encoder begins 3 us later
        assert!((sent.end_ns..sent.end_ns + 1_000).contains(&bench.off_at_ns));
    }
}

#[test]
fn a_position_with_alarms_is_a_doubt() {
    let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
    let mut encoder = driver(&bench);
    let resolution = Resolution::new(23, 16).unwrap();
    let sample = encoder.read_position(resolution, STRICT).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(1), Some(3)));
    let sent = bench.borrow().truth().transmission(bench.borrow().request.unwrap()).unwrap().end_ns;
    assert!(sample.sampled_ns().abs_diff(sent) < 1_000, "within the turn-around");
    bench.borrow_mut().encoder().raise_alarms(Almc::BE);
    let doubt = Error::Doubt(Doubt::Alarms { alarms: Almc::BE });
    assert_eq!(encoder.read_position(resolution, STRICT), Err(doubt));
    assert!(encoder.read_position(resolution, STRICT.tolerating(Tolerated::SINGLE_TURN)).is_ok());
}

/// What `Evidence::at` refuses the driver refuses too, and what it takes is the same sample.
#[test]
fn a_doubt_of_the_crate_is_one_of_the_driver() {
    for row in rows() {
        let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
        bench.borrow_mut().encoder().raise_alarms(row.alarms);
        let mut encoder = driver(&bench);
        let refused = encoder.read_position(row.resolution, row.policy);
        assert!(matches!(refused, Err(Error::Doubt(doubt)) if (row.is)(doubt)), "{}: {refused:?}", row.what);
        let evidence = encoder.read_evidence(row.resolution).unwrap();
        let refused = evidence.at(bench.borrow().now_ns(), row.policy);
        assert!(refused.is_err_and(row.is), "{}: {refused:?}", row.what);
    }
    let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
    let mut encoder = driver(&bench);
    let evidence = encoder.read_evidence(widths(23, 16)).unwrap();
    let sample = evidence.at(bench.borrow().now_ns(), Policy::new(60_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(1), Some(3)));
    let sample = encoder.read_position(widths(23, 16), Policy::new(60_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (place(2), Some(3)));
}

#[test]
fn procedures_run_over_it() {
    let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
    let mut encoder = driver(&bench);
    encoder.clear_errors().unwrap();
    let address = Address::new(5).unwrap();
    assert_eq!(encoder.write_eeprom(Page::truncate(0), address, 0x5a), Ok(0x5a));
    assert_eq!(encoder.read_eeprom(Page::truncate(0), address), Ok(0x5a));
    bench.borrow_mut().encoder().eeprom_mut()[0][5] = 7;
    assert_eq!(encoder.read_eeprom(Page::truncate(0), address), Ok(7));
    let found = encoder.run(&mut Detection::new()).unwrap();
    assert_eq!((found.enid, found.abm.get()), (0x17, 3));
}

/// Each fault alone, in the answer of the first call: the call fails or not, the second one is good.
#[test]
fn any_fault_is_over_with_the_next_call() {
    let faults = [
        Fault::Drop,
        Fault::Repeat,
        Fault::Flip { bit: 4 },
        Fault::Flip { bit: 9 },
        Fault::Idle { bits: 20 },
        Fault::Cut,
        Fault::Delay { ns: 30_000 },
        Fault::Noise { after_ns: 2_000 },
        Fault::Preempt { ns: 300_000 },
    ];
    for misframed in [Misframed::Dropped, Misframed::Delivered, Misframed::Reported] {
        for fault in faults {
            for (transmission, units) in [(0, 1), (1, 11)] {
                for unit in 0..units {
                    let bench = Bench::new(planned(&[(transmission, unit, fault)]), misframed);
                    let mut encoder = driver(&bench);
                    let first = encoder.read_data();
                    assert!(!bench.borrow().driver_on);
                    // An encoder that says more than its answer may have its say.
                    let rest_ns = bench.borrow().now_ns() + 10_000;
                    bench.borrow_mut().pass(rest_ns);
                    let second = encoder.read_data();
                    assert!(
                        second.is_ok(),
                        "{fault:?} in unit {unit} of {transmission}, {misframed:?}: {first:?}, {second:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_babbling_line_is_given_up_and_used_again() {
    let bench = Bench::new(Scenario::quiet(), Misframed::Reported);
    let mut encoder = driver(&bench);
    let id = bench.borrow_mut().world().send(&servowire_world::Message::bytes(&[]), 0);
    let babble = servowire_world::Message::bytes(&[0x55; 1_000]);
    bench.borrow_mut().world().answer(0, id, &babble, 0);
    bench.borrow_mut().pass(50_000);
    assert_eq!(encoder.read_data(), Err(Error::NeverQuiet));
    assert!(!bench.borrow().driver_on);
    bench.borrow_mut().pass(5_000_000);
    assert!(encoder.read_data().is_ok());
}

/// Whatever has happened before: a call whose request and answer come through whole is good.
#[test]
fn hostile_events_never_cost_a_good_answer() {
    let resolution = Resolution::new(23, 16).unwrap();
    live_through(|calls, seed| {
        let misframed = [Misframed::Dropped, Misframed::Delivered, Misframed::Reported][seed as usize % 3];
        let bench = Bench::new(scenario(seed), misframed);
        let mut encoder = driver_at(&bench, line());
        for call in 0..100 {
            match encoder.read_position(resolution, STRICT) {
                // The request was damaged on the line, and the encoder says so.
                Err(Error::Doubt(Doubt::RequestDamaged { .. })) => calls.failed += 1,
                result => {
                    let result = result.map(Sample::single_turn);
                    bench.borrow_mut().judge(calls, Some(result), seed, call);
                }
            }
        }
        bench.borrow().tally()
    });
}

/// However late a request left, and even if the UART took a part of it only, the next one does not go out into its answer: the rest
/// of the request, 3 us and four fields.
#[test]
fn a_fault_after_a_preemption_does_not_send_the_next_request_into_the_answer() {
    for stalls_in in 0..60 {
        for (held_up, refuses) in [(false, false), (true, false), (true, true)] {
            let late = Late::default();
            *late.0.borrow_mut() =
                World { stalls_in: Some(stalls_in), held_up, refuses, pieces: 2, ..World::default() };
            let line = Line::new(BitRate::Mbit2_5);
            let mut encoder = Driver::new(late.clone(), servowire_drivers::Automatic, late.clone(), line).unwrap();
            for call in 1..=2 {
                late.0.borrow_mut().call = call;
                assert!(encoder.transact(Request::read_eeprom(Address::new(5).unwrap())).is_err());
            }
            let (last, next) = late.0.borrow().between().unwrap();
            assert!(next - last >= 8_000 + 3_000 + 16_000, "{stalls_in} {held_up} {refuses}: {last} {next}");
        }
    }
}
