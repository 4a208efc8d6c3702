//! Dead places, ports that fail, frames that do not come.

use servowire_drivers::rtex::Exchanged;

use super::*;

/// The port fails at any one of its calls: the next exchange is good, and nothing stops.
#[test]
fn a_fault_of_the_port_is_over_with_the_next_exchange() {
    for external in [false, true] {
        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        for at in 0..2 * AXES as u32 * 8 {
            ring.borrow_mut().fail_in = Some(at);
            update(&ring, &mut driver).unwrap();
            update(&ring, &mut driver).unwrap();
            assert!((0..AXES).all(|place| position(&ring, &driver, place).is_some()), "{at}");
            assert_eq!(driver.master().ring().failure(), None, "{at}");
        }
    }
}

/// The port fails twice at a block in a reading that is torn too: the next reading is good, so the exchange is.
#[test]
fn a_fault_in_a_torn_reading_is_over_with_the_next_reading() {
    for external in [false, true] {
        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        for at in 2..AXES as u32 * 8 {
            {
                let mut ring = ring.borrow_mut();
                (ring.fail_in, ring.fail_again) = (Some(0), true);
                ring.stall_in = Some((at, if external { 29_000 } else { 499_000 }));
            }
            let exchanged = update(&ring, &mut driver);
            heal(&ring);
            assert!(matches!(exchanged, Ok(Exchanged { torn: false, .. })), "{external} {at}: {exchanged:?}");
            let [first, ..] = driver.master().ring().axes();
            assert_ne!(first.arrival(), Arrival::Missing, "{external} {at}");
            (0..3).for_each(|_| _ = update(&ring, &mut driver).unwrap());
        }
    }
}

/// The port fails at the first transmit data: all of them are written in the next turn of the main loop, and the ring starts.
#[test]
fn the_first_transmit_data_are_written_again_after_a_fault() {
    for at in 0..AXES as u32 * 8 {
        let ring = Ring::new(false, false);
        let mut driver = driver::<u16>(&ring);
        let mut failed = 0;
        for _ in 0..100 {
            if driver.master().phase() == ControlPhase::Waiting {
                // After the state and the table of slaves.
                let mut ring = ring.borrow_mut();
                (ring.fail_in, ring.fail_again) = (Some(2 + at), true);
            }
            match driver.control() {
                Ok(ControlPhase::Running) => break,
                Ok(_) => {}
                Err(error) => {
                    assert_eq!(error, Error::Io(()));
                    failed += 1;
                    ring.borrow_mut().written = 0;
                }
            }
        }
        assert_eq!((failed, driver.master().phase()), (1, ControlPhase::Running), "{at}");
        assert_eq!(ring.borrow().written, AXES as u32, "{at}");
    }
}

/// A place that cannot be written: every other drive is written all the same, so a stop reaches it in the period after, and so does
/// the servo-off after the communication has failed. A place that cannot be read is one axis without a block, and no other.
#[test]
fn a_dead_place_is_one_place() {
    for external in [false, true] {
        for dead in 0..AXES {
            let ring = Ring::new(external, false);
            let mut driver = on::<u16>(&ring);
            ring.borrow_mut().dead = Some(dead);
            driver.ring_mut().stop(StopCategory::Zero);
            for _ in 0..3 {
                assert_eq!(update(&ring, &mut driver), Err(Error::Io(())));
            }
            for place in 0..AXES {
                assert_eq!(ring.borrow().drives[place].is_active(), place == dead, "{external} {dead} {place}");
            }

            let ring = Ring::new(external, true);
            let mut driver = on::<u32>(&ring);
            ring.borrow_mut().deaf = Some(dead);
            for _ in 0..2 {
                assert_eq!(update(&ring, &mut driver), Err(Error::Io(())));
                assert!((0..AXES).all(|place| place == dead || position(&ring, &driver, place).is_some()));
            }
            (0..LIMIT).for_each(|_| _ = update(&ring, &mut driver));
            let failure = Some(RingFailure { place: dead as u8, reason: StopReason::EchoTimeout });
            assert_eq!(driver.master().ring().failure(), failure);
            (0..3).for_each(|_| _ = update(&ring, &mut driver));
            assert!(!ring.borrow().drives.iter().any(Drive::is_active));
        }
    }
}

/// A place that cannot be written for a while: its drive stands at the block before, so the next step begins there, and none is larger
/// than the drive allows (Err27.4).
#[test]
fn a_step_that_was_not_written_is_not_added_to_the_next() {
    for (dead, periods) in (0..AXES).flat_map(|dead| (1..4).map(move |periods| (dead, periods))) {
        let ring = Ring::new(false, false);
        let mut driver = on::<u16>(&ring);
        let mut refused = 0;
        let mut step = |driver: &mut Rtex<u16>| {
            for axis in driver.ring_mut().axes_mut() {
                // 400 M pulses a second are 200,000 in half a millisecond.
                refused += usize::from(axis.set_position(axis.setpoint().wrapping_add(150_000)).is_err());
            }
        };
        for _ in 0..10 {
            step(&mut driver);
            update(&ring, &mut driver).unwrap();
        }
        ring.borrow_mut().dead = Some(dead);
        for _ in 0..periods {
            step(&mut driver);
            assert_eq!(update(&ring, &mut driver), Err(Error::Io(())));
        }
        ring.borrow_mut().dead = None;
        for _ in 0..10 {
            step(&mut driver);
            update(&ring, &mut driver).unwrap();
        }
        assert_eq!(ring.borrow().drives.each_ref().map(Drive::alarm), [None; AXES], "{dead} {periods}");
        assert_eq!((refused, driver.master().ring().failure()), (periods, None), "{dead} {periods}");
    }
}

/// Frames that do not come: no position is given, and every servo is off within the limit.
#[test]
fn silence_switches_every_servo_off() {
    for external in [false, true] {
        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        ring.borrow_mut().lose_frames = u32::MAX;
        for period in 0..u32::from(LIMIT) + 2 {
            update(&ring, &mut driver).unwrap();
            assert!(period < 2 || (0..AXES).all(|place| position(&ring, &driver, place).is_none()));
        }
        let RingFailure { reason, .. } = driver.master().ring().failure().unwrap();
        assert!(matches!(reason, StopReason::EchoTimeout | StopReason::ReceiveTimeout), "{reason}");
        assert_eq!(driver.control(), Err(Error::Protocol(ControlError::Timeout)));
        // The ring is back: all are switched on again.
        ring.borrow_mut().lose_frames = 0;
        for drive in &mut ring.borrow_mut().drives {
            drive.clear_alarm();
        }
        driver.clear();
        for _ in 0..100 {
            update(&ring, &mut driver).unwrap();
            driver.ring_mut().switch_on().ok();
        }
        assert!(
            driver.master().ring().all_are(AxisState::On),
            "{:?} {:?}",
            driver.master().ring().failure(),
            ring.borrow().drives.map(|d| d.alarm())
        );
    }
}

/// XINTRX no longer comes, though the blocks are there and on time: the receive watchdog stops the ring after its limit.
#[test]
fn the_receive_watchdog_trips() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    for period in 1..=LIMIT {
        let began_ns = {
            let mut ring = ring.borrow_mut();
            // An interrupt of a lower priority waits while this one runs; here it waits for ever.
            ring.in_exchange = true;
            let begins_ns = ring.next_frame_ns();
            ring.pass(begins_ns);
            begins_ns
        };
        assert!(period >= LIMIT - 1 || driver.master().ring().failure().is_none(), "{period}");
        driver.exchange(began_ns).unwrap();
        assert!(driver.master().ring().axes().iter().all(|axis| axis.arrival() == Arrival::OnTime), "{period}");
    }
    let failure = Some(RingFailure { place: 0, reason: StopReason::ReceiveTimeout });
    assert_eq!(driver.master().ring().failure(), failure);
}

/// Faults that the driver has to survive; the environment may want more.
pub(super) const FAULTS: u64 = 100_000;

/// Faults of the port, lost frames and stalls.
pub(super) const KINDS: usize = 3;

pub(super) fn hurt(ring: &Shared, draw: &mut Draw, kind: usize) {
    let mut ring = ring.borrow_mut();
    match kind {
        0 => ring.fail_in = Some(draw.below(24) as u32),
        1 => ring.lose_frames = 1 + draw.below(2) as u32,
        _ => ring.stall_in = Some((draw.below(24) as u32, draw.below(700_000))),
    }
}

/// Faults of the port, lost frames and stalls, 100,000 of them, on buses of all widths. The exchange after one is good; what it reads was
/// asked for before the fault, so the one after that gives every position again, and they are those of the last frames.
#[test]
fn hostile_events_are_over_with_the_next_call() {
    let mut draw = Draw::default();
    let mut kinds = [0_u64; KINDS];
    while kinds.iter().sum::<u64>() < wanted_events(FAULTS).max(FAULTS) {
        match draw.below(3) {
            0 => hostile::<u8>(&mut draw, &mut kinds),
            1 => hostile::<u16>(&mut draw, &mut kinds),
            _ => hostile::<u32>(&mut draw, &mut kinds),
        }
    }
    println!("{kinds:?}");
    let count: u64 = kinds.iter().sum();
    assert!(kinds.iter().all(|kind| *kind > count / 4));
}

fn hostile<W: Drawn>(draw: &mut Draw, kinds: &mut [u64; KINDS]) {
    let external = draw.below(2) == 1;
    let ring = Ring::new(external, draw.below(2) == 1);
    let mut driver = on::<W>(&ring);
    for count in 0..2_000 {
        let kind = draw.below(KINDS as u64) as usize;
        kinds[kind] += 1;
        hurt(&ring, draw, kind);
        move_on(&mut driver);
        let late = update(&ring, &mut driver).map_or(0, |exchanged| exchanged.frames_late);
        heal(&ring);
        // A late exchange has missed the next interrupt, so the same commands went out twice.
        for _ in 0..2 + late {
            update(&ring, &mut driver).unwrap();
        }
        is_well(&ring, &driver, &(count, kind, external, size_of::<W>()));
    }
}
