//! What holds for every T-Format driver.

use super::*;

fn driver<D: Calls>(port: Port) -> (Bench, D) {
    let bench = Bench::new(port);
    let driver = D::open(&bench);
    (bench, driver)
}

pub(super) fn every_call_gives_what_the_encoder_has<D: Calls>() {
    all_is_well::<D>(Port::good());
}

/// What each call gives on a good line.
fn all_is_well<D: Calls>(port: Port) {
    let what = format!("{port:?}");
    let (bench, mut driver) = driver::<D>(port);
    let all = driver.read_data().unwrap();
    assert_eq!((all.abs.get(), all.abm.get(), all.enid, all.almc), (0x12_3456, 3, 0x17, Almc::empty()), "{what}");
    let sample = driver.read_position(widths(), Policy::new(10_000_000)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (0x12_3456, Some(3)), "{what}");
    let begun_ns = bench.0.borrow().requests()[1].0;
    assert!((begun_ns + 4_000..begun_ns + 12_000).contains(&sample.sampled_ns()), "{what}");
    // The answer alone lasts 44 us.
    let old = driver.read_position(widths(), Policy::new(43_999));
    assert!(matches!(old, Err(Error::Doubt(Doubt::Old { age_ns: 44_000.. }))), "{what}: {old:?}");
    let evidence = driver.read_evidence(widths()).unwrap();
    let now_ns = bench.0.borrow().now_ns;
    assert_eq!(evidence.at(now_ns, Policy::new(10_000_000)).unwrap().single_turn(), 0x12_3456, "{what}");
    bench.0.borrow_mut().encoder.almc = 0x40;
    let alarm = driver.read_position(widths(), Policy::new(10_000_000));
    assert_eq!(alarm, Err(Error::Doubt(Doubt::Alarms { alarms: Almc::BE })), "{what}");
    assert_eq!(driver.clear_errors().unwrap().abs.get(), 0x12_3456, "{what}");
    assert_eq!((bench.0.borrow().encoder.almc, bench.0.borrow().encoder.clears), (0, 1), "{what}");
    assert_eq!(driver.read_eeprom(page(2), at(9)), Ok(2 << 5 ^ 9), "{what}");
    assert_eq!(driver.write_eeprom(page(1), at(9), 0x77), Ok(0x77), "{what}");
    assert_eq!((bench.0.borrow().encoder.memory[1][9], bench.0.borrow().encoder.writes), (0x77, 1), "{what}");
    let turns = driver.transact(Request::ReadMultiTurn).unwrap().response;
    assert!(matches!(turns, Response::ReadMultiTurn(turns) if turns.abm.get() == 3), "{what}");
    let mut zero = SingleTurnZero::set_and_shift_commutation_angle(widths(), 0);
    assert!(driver.run(&mut zero).is_ok(), "{what}");
    let world = bench.0.borrow();
    assert_eq!((world.encoder.abs, world.encoder.zeros), (0, 1), "{what}");
}

pub(super) fn pieces_of_any_size_give_the_same<D: Calls>() {
    for (write_most, read_most) in [(1, 16), (2, 16), (3, 16), (16, 1), (16, 2), (16, 5), (1, 1), (2, 3)] {
        for echo in [false, true] {
            all_is_well::<D>(Port { write_most, read_most, echo, ..Port::good() });
        }
    }
}

/// One call of one method fails: the call of the driver does, with just that error, and the next one is good.
pub(super) fn every_error_of_the_port_is_told<D: Calls>() {
    for kind in KINDS {
        for (op, calls) in [(Op::Write, 3), (Op::Flush, 1), (Op::Ready, 60), (Op::Read, 4)] {
            let mut told = 0;
            for call in 0..calls {
                let (bench, mut driver) = driver::<D>(Port { write_most: 1, read_most: 1, ..Port::good() });
                driver.read_data().unwrap();
                bench.0.borrow_mut().port.faults = Faults::one(op, call, kind);
                let outcome = driver.transact(Request::read_eeprom(at(9)));
                let what = format!("{op:?} {call} {kind:?}: {outcome:?}");
                match outcome {
                    Err(Error::Io(error)) => {
                        assert_eq!(error, kind, "{what}");
                        assert!(bench.0.borrow().port.faults.are_over(), "{what}");
                        told += 1;
                    }
                    // Before the request errors are thrown away like bytes.
                    outcome => assert!(outcome.is_ok() && op == Op::Ready, "{what}"),
                }
                assert_eq!(driver.read_data().map(|all| all.abs.get()), Ok(0x12_3456), "after {what}");
            }
            // Futures do not ask whether something is there, and before the request nothing is told.
            assert!(op == Op::Ready && !D::ASKS || told + 3 >= calls, "{op:?}: {told} of {calls} told");
        }
    }
}

pub(super) fn a_fault_in_a_procedure_is_a_lost_answer<D: Calls>() {
    for (op, calls) in [(Op::Write, 12), (Op::Flush, 12), (Op::Read, 12)] {
        for call in 0..calls {
            let (bench, mut driver) =
                driver::<D>(Port { faults: Faults::one(op, call, ErrorKind::Other), ..Port::good() });
            bench.0.borrow_mut().encoder.almc = 0x40;
            let outcome = driver.clear_errors();
            assert!(outcome.is_ok(), "{op:?} {call}: {outcome:?}");
            assert_eq!(bench.0.borrow().encoder.almc, 0, "{op:?} {call}");
            assert_eq!(driver.read_eeprom(page(3), at(1)), Ok(3 << 5 ^ 1), "{op:?} {call}");
        }
    }
}

pub(super) fn a_closed_port_is_told<D: Calls>() {
    let (bench, mut driver) = driver::<D>(Port::good());
    driver.read_data().unwrap();
    bench.0.borrow_mut().closed = true;
    assert_eq!(driver.read_data(), Err(Error::Closed));
    assert_eq!(driver.clear_errors(), Err(Error::Closed));
    assert_eq!(driver.read_eeprom(page(0), at(1)), Err(Error::Closed));
    bench.0.borrow_mut().closed = false;
    assert!(driver.read_data().is_ok());
}

/// A processor that looks every 20 us, at a UART that holds four bytes.
pub(super) fn bytes_that_got_lost_cost_one_call<D: Calls>() {
    let (bench, mut driver) = driver::<D>(Port { room: 4, look_ns: 20_000, ..Port::good() });
    assert_eq!(driver.read_data(), Err(Error::Io(ErrorKind::Other)));
    bench.0.borrow_mut().port.look_ns = 100;
    assert!(driver.read_data().is_ok());
}

pub(super) fn a_flush_may_mean_anything<D: Calls>() {
    for flush in [Flush::Nothing, Flush::End, Flush::Late(2_000), Flush::Late(40_000)] {
        all_is_well::<D>(Port { flush, ..Port::good() });
    }
}

/// The first start bit 10 us after the request at the latest, and not before four bits have passed.
pub(super) fn answers_come_as_late_as_they_may<D: Calls>() {
    for (delay_ns, is_heard) in [(1_000, false), (1_700, true), (3_000, true), (10_000, true), (40_000, false)] {
        let (bench, mut driver) = driver::<D>(Port::good());
        bench.0.borrow_mut().encoder.delay_ns = delay_ns;
        assert_eq!(driver.read_data().is_ok(), is_heard, "{delay_ns}");
        bench.0.borrow_mut().encoder.delay_ns = 3_000;
        assert!(driver.read_data().is_ok(), "after {delay_ns}");
    }
}

/// At least 40 us of idle line between the resets; a busy memory is asked every millisecond.
pub(super) fn pauses_of_the_procedures_are_kept<D: Calls>() {
    let (bench, mut driver) = driver::<D>(Port::good());
    driver.clear_errors().unwrap();
    let requests = bench.0.borrow().requests();
    assert_eq!(requests.len(), 10);
    for pair in requests.windows(2) {
        // A field, 3 us, six fields, 40 us.
        assert!((71_000..80_000).contains(&(pair[1].0 - pair[0].0)), "{requests:?}");
    }
    let before = bench.0.borrow().now_ns;
    driver.write_eeprom(page(0), at(9), 1).unwrap();
    let requests: Vec<_> = bench.0.borrow().requests().into_iter().filter(|(at_ns, _)| *at_ns > before).collect();
    let writes: Vec<_> = requests.iter().filter(|(_, fields)| fields[..2] == [0x32, 9]).collect();
    assert_eq!(writes.len(), 1, "{requests:02x?}");
    let begun_ns = writes[0].0;
    let asked = requests.iter().filter(|(at_ns, _)| (begun_ns + 1..begun_ns + 18_000_000).contains(at_ns)).count();
    assert!((1..=18).contains(&asked), "{asked} times in 18 ms");
}

pub(super) fn the_memory_has_pages<D: Calls>() {
    let (bench, mut driver) = driver::<D>(Port::good());
    for (number, cell) in [(0, 5), (3, 5), (5, 126), (1, 0), (0, 126)] {
        assert_eq!(driver.read_eeprom(page(number), at(cell)), Ok(number << 5 ^ cell));
        assert_eq!(driver.write_eeprom(page(number), at(cell), 0xa0 | number), Ok(0xa0 | number));
        assert_eq!(bench.0.borrow().encoder.memory[usize::from(number)][usize::from(cell)], 0xa0 | number);
    }
    assert_eq!(bench.0.borrow().encoder.writes, 5);
    // An encoder that has started anew is on page 0.
    assert_eq!(driver.read_eeprom(page(4), at(7)), Ok(4 << 5 ^ 7));
    let now_ns = bench.0.borrow().now_ns;
    bench.0.borrow_mut().encoder.restart(now_ns);
    assert_eq!(driver.read_eeprom(page(4), at(7)), Ok(4 << 5 ^ 7));
    assert_eq!(driver.write_eeprom(page(4), at(7), 1), Ok(1));
    assert_eq!(bench.0.borrow().encoder.memory[0][7], 7);
}

pub(super) fn an_encoder_is_found_at_either_rate<D: Calls>() {
    for (fast, field_ns) in [(true, 2_000), (false, 4_000)] {
        let (bench, mut driver) = driver::<D>(Port::good());
        bench.0.borrow_mut().encoder.fast = fast;
        let found = driver.detect(Detection::new()).unwrap();
        assert_eq!((found.enid, found.abm.get()), (0x17, 3));
        assert_eq!(bench.0.borrow().field_ns(), field_ns);
        // After 1.5 s at the earliest.
        assert!(bench.0.borrow().requests()[0].0 >= 1_500_000_000);
        // It stays at that rate.
        assert_eq!(driver.read_data().map(|all| all.abs.get()), Ok(0x12_3456));
    }
    let (bench, mut driver) = driver::<D>(Port::good());
    bench.0.borrow_mut().encoder.silent();
    assert!(matches!(driver.detect(Detection::new()), Err(Error::Protocol(_))));
    let count = bench.0.borrow().sent.len();
    assert_eq!(count, 6, "three tries at each rate");
}

/// An encoder that needs half a millisecond after what it was asked for.
pub(super) fn the_line_is_left_alone_after_a_procedure<D: Calls>() {
    for fails in [false, true] {
        let (bench, mut driver) = driver::<D>(Port::good());
        assert_eq!(driver.run(&mut Slow { fails }).is_err(), fails);
        driver.read_data().unwrap();
        let requests = bench.0.borrow().requests();
        assert!(requests[1].0 - requests[0].0 >= 500_000, "{requests:?}");
    }
}

pub(super) fn silence_ends<D: Calls>() {
    let (bench, mut driver) = driver::<D>(Port::good());
    bench.0.borrow_mut().encoder.silent();
    let lost = Error::Protocol(tformat::Error::NoResponse { echo: false });
    assert_eq!(driver.read_data(), Err(lost));
    assert_eq!(driver.read_position(widths(), Policy::new(1)), Err(lost));
    assert_eq!(driver.read_evidence(widths()), Err(lost));
    assert_eq!(driver.clear_errors(), Err(lost));
    assert_eq!(driver.transact(Request::ReadEncoderId), Err(lost));
    assert!(driver.read_eeprom(page(0), at(1)).is_err());
    assert!(driver.write_eeprom(page(0), at(1), 2).is_err());
}
