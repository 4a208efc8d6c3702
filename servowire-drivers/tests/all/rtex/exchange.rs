//! From start to servo-off at both timer systems, on every bus.

use super::*;

fn turns<W: Drawn>(external: bool, wide: bool) {
    let ring = Ring::new(external, wide);
    let mut driver = on::<W>(&ring);
    for _ in 0..50 {
        move_on(&mut driver);
        let exchanged = update(&ring, &mut driver).unwrap();
        assert_eq!((exchanged.frames_late, exchanged.torn), (0, false));
        assert!((0..AXES).all(|place| position(&ring, &driver, place).is_some()));
    }
    for _ in 0..60 {
        update(&ring, &mut driver).unwrap();
    }
    for place in 0..AXES {
        assert_eq!(position(&ring, &driver, place), Some(500 * (place as i32 + 1)));
        assert_eq!(ring.borrow().drives[place].position(), 500 * (place as i32 + 1));
    }
    assert_eq!((driver.late(), driver.torn()), (0, 0));
    driver.ring_mut().switch_off();
    for _ in 0..5 {
        update(&ring, &mut driver).unwrap();
    }
    assert!(!ring.borrow().drives.iter().any(Drive::is_active));
}

#[test]
fn both_timer_systems_on_every_bus() {
    for external in [false, true] {
        for wide in [false, true] {
            turns::<u8>(external, wide);
            turns::<u16>(external, wide);
            turns::<u32>(external, wide);
        }
    }
}

#[test]
fn other_slaves_than_in_the_table_are_a_fault() {
    let ring = Ring::new(false, false);
    ring.borrow_mut().found[1].kind = 2;
    let mut driver = driver::<u16>(&ring);
    assert_eq!(driver.start(1_000_000), Err(Error::Protocol(ControlError::SlaveInfoMismatch)));
}

#[test]
fn a_ring_that_does_not_close_is_waited_for_so_long() {
    let ring = Ring::new(false, false);
    ring.borrow_mut().found = [Slave { mac_id: MacId::truncate(1), kind: 0 }; AXES];
    let mut driver = driver::<u16>(&ring);
    assert_eq!(driver.start(100), Ok(ControlPhase::Waiting));
}

/// The first transmit data are written once, in the turn after the slaves are known; the main loop, which goes on for ever, writes nothing else, so
/// the counter is that of the exchanges alone.
#[test]
fn the_main_loop_writes_the_first_transmit_data_alone() {
    for external in [false, true] {
        let ring = Ring::new(external, false);
        let mut driver = driver::<u16>(&ring);
        let mut phases = Vec::new();
        while phases.last() != Some(&(ControlPhase::Running, 0)) && phases.len() < 100 {
            let phase = driver.control().unwrap();
            let written = std::mem::take(&mut ring.borrow_mut().written);
            phases.push((phase, written));
        }
        let prepared = phases.iter().position(|(phase, _)| *phase == ControlPhase::Prepare).unwrap();
        assert!(prepared > 0, "{phases:?}");
        for (turn, (phase, written)) in phases.iter().enumerate() {
            assert_eq!(*written, if turn == prepared + 1 { AXES as u32 } else { 0 }, "{phase}: {phases:?}");
        }

        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        for _ in 0..2 * LIMIT {
            ring.borrow_mut().written = 0;
            for _ in 0..5 {
                assert_eq!(driver.control(), Ok(ControlPhase::Running));
            }
            assert_eq!(ring.borrow().written, 0);
            move_on(&mut driver);
            update(&ring, &mut driver).unwrap();
            assert!(driver.master().ring().axes().iter().all(|axis| axis.arrival() == Arrival::OnTime));
        }
    }
}

/// What `Evidence::at` refuses, of a place, of a time and of a drive, is refused of the driver's evidence.
#[test]
fn a_doubt_of_the_crate_is_one_of_the_driver() {
    let ring = Ring::new(true, false);
    assert_eq!(driver::<u16>(&ring).evidence(0).at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
    let mut driver = on::<u16>(&ring);
    update(&ring, &mut driver).unwrap();
    let now_ns = ring.borrow().now_ns;
    assert!(driver.evidence(0).at(now_ns, Policy::new(u64::MAX)).is_ok());
    let old = driver.evidence(0).at(now_ns, Policy::new(1));
    // The frame before that of the exchange brought it.
    assert!(matches!(old, Err(Doubt::Old { age_ns }) if age_ns >= COM_NS), "{old:?}");
    assert_eq!(driver.evidence(AXES).at(now_ns, Policy::new(u64::MAX)), Err(Doubt::Never));
    ring.borrow_mut().drives[1].set_fault(Fault::Alarm(Alarm::COMMAND_STEP));
    for _ in 0..4 {
        update(&ring, &mut driver).unwrap();
    }
    let now_ns = ring.borrow().now_ns;
    assert_eq!(driver.evidence(1).at(now_ns, Policy::new(u64::MAX)), Err(Doubt::Alarm));
}
