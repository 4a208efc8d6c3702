//! The receive watchdog: receive interrupts that do not come any more.

use super::*;

/// The ASIC switches the bank by itself, so every block goes on coming on time, and the watchdog alone notices that the receive
/// interrupt does not come: the axes stop for that reason at the end of the limit, not before, and every servo goes off.
#[test]
fn a_receive_interrupt_that_stays_away_stops_the_ring() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    ring.borrow_mut().masked = true;
    // The last exchange has reported the last frame, and is the first of the limit itself.
    for _ in 1..LIMIT {
        assert_eq!((driver.master().ring().failure(), driver.control()), (None, Ok(ControlPhase::Running)));
        update(&ring, &mut driver).unwrap();
        assert!(driver.master().ring().axes().iter().all(|axis| axis.arrival() == Arrival::OnTime));
    }
    let failure = RingFailure { place: 0, reason: StopReason::ReceiveTimeout };
    assert_eq!(driver.master().ring().failure(), Some(failure));
    assert_eq!(driver.control(), Err(Error::Protocol(ControlError::Timeout)));
    (0..2).for_each(|_| _ = update(&ring, &mut driver).unwrap());
    assert!(!ring.borrow().drives.iter().any(Drive::is_active));

    // Cleared, it trips again as long as the interrupt stays away, and no more once it comes.
    driver.clear();
    (0..LIMIT).for_each(|_| _ = update(&ring, &mut driver).unwrap());
    assert_eq!(driver.master().ring().failure(), Some(failure));
    ring.borrow_mut().masked = false;
    driver.clear();
    for _ in 0..100 {
        update(&ring, &mut driver).unwrap();
        driver.ring_mut().switch_on().ok();
    }
    assert!(driver.master().ring().all_are(AxisState::On), "{:?}", driver.master().ring().failure());
}

/// One receive interrupt shortly before the end of the limit starts it again.
#[test]
fn one_receive_interrupt_is_enough() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    for period in 0..10 * LIMIT {
        ring.borrow_mut().masked = period % (LIMIT - 1) != 0;
        update(&ring, &mut driver).unwrap();
        assert_eq!(driver.master().ring().failure(), None, "{period}");
    }
}

/// In the external-timer system the handler of the interrupt also switches the bank, so without it no new block is read either.
#[test]
fn the_reason_is_the_interrupt_in_the_external_timer_system_too() {
    let ring = Ring::new(true, false);
    let mut driver = on::<u16>(&ring);
    ring.borrow_mut().masked = true;
    for _ in 1..LIMIT {
        assert_eq!(driver.master().ring().failure(), None);
        update(&ring, &mut driver).unwrap();
    }
    let failure = RingFailure { place: 0, reason: StopReason::ReceiveTimeout };
    assert_eq!(driver.master().ring().failure(), Some(failure));
    (0..2).for_each(|_| _ = update(&ring, &mut driver).unwrap());
    assert!(!ring.borrow().drives.iter().any(Drive::is_active));
}
