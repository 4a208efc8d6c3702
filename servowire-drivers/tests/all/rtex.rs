//! The RTEX driver at a simulated ASIC: both timer systems, all widths of the bus, and faults.

use std::marker::PhantomData;
use std::num::NonZeroU16;

use crate::asic::{AXES, Bus, COM_NS, Drawn, Ring, SWITCHES, Shared, Watch};
use rtex_block::device::{Drive, Fault};
use rtex_block::master::{
    ActiveCode, Arrival, Axis, AxisConfig, AxisState, ControlError, ControlPhase, Limits, Master, MasterConfig,
    RingFailure, Slave, StopCategory, StopReason,
};
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{Alarm, BlockSize, Doubt, MacId, Policy};
use servowire_drivers::Error;
use servowire_drivers::rtex::Driver;
use servowire_world::{Draw, wanted_events};

const LIMIT: u16 = 6;

type Rtex<W> = Driver<'static, Bus<W>, Watch, AXES>;

fn driver<W: Drawn>(ring: &Shared) -> Rtex<W> {
    let (external, wide, reception) = (ring.borrow().external, ring.borrow().wide, ring.borrow().reception());
    let (periods, timer) = if external {
        (Periods::from_a6n(-1, 2, Some(COM_NS as i64)).unwrap(), TimerSystem::External)
    } else {
        (Periods::from_a6n(-1, 1, Some(COM_NS as i64)).unwrap(), TimerSystem::Internal)
    };
    let limit = NonZeroU16::new(LIMIT).unwrap();
    let size = if wide { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
    let config = MasterConfig::new(size, periods, timer).with_watchdog(Some(limit));
    let ids = SWITCHES.map(|switches| MacId::new(switches).unwrap());
    let limits = Limits::new(limit, 60).with_ready(Some(200));
    let axes = ids.map(|id| Axis::new(AxisConfig::new(id, ActiveCode::CyclicPosition, periods.update_ns, limits)));
    let master = Master::new(config, ids.map(|mac_id| Slave { mac_id, kind: 1 }), axes).unwrap();
    Driver::new(Bus(ring.clone(), PhantomData), Watch(ring.clone()), master, reception)
}

/// The NC interrupt of the next update period, and what the exchange gave.
fn update<W: Drawn>(
    ring: &Shared,
    driver: &mut Rtex<W>,
) -> Result<
    servowire_drivers::rtex::Exchanged,
    Error<(), std::convert::Infallible, ControlError, std::convert::Infallible>,
> {
    let began_ns = {
        let mut ring = ring.borrow_mut();
        let periods = if ring.external { 2 } else { 1 };
        for _ in 0..periods {
            let begins_ns = ring.next_frame_ns();
            ring.pass(begins_ns);
        }
        ring.in_exchange = true;
        ring.read_of.clear();
        ring.now_ns
    };
    let result = driver.exchange(began_ns);
    let mut ring = ring.borrow_mut();
    ring.in_exchange = false;
    ring.let_in();
    result
}

/// The actual position, if it is no older than an update period and the frame that brought it, and a little for a late executor.
fn position<W: Drawn, C: servowire_drivers::Clock>(
    ring: &Shared,
    driver: &Driver<'static, Bus<W>, C, AXES>,
    place: usize,
) -> Option<i32> {
    let update_ns = u64::from(driver.master().config().periods.update_ns);
    let policy = Policy::new(COM_NS + update_ns + 100_000);
    driver.evidence(place).at(ring.borrow().now_ns, policy).ok().map(|sample| sample.position())
}

fn on<W: Drawn>(ring: &Shared) -> Rtex<W> {
    let mut driver = driver::<W>(ring);
    assert_eq!(driver.start(1_000_000), Ok(ControlPhase::Running));
    for _ in 0..400 {
        if driver.ring_mut().switch_on().is_ok() {
            break;
        }
        update(ring, &mut driver).unwrap();
    }
    for _ in 0..60 {
        if driver.master().ring().all_are(AxisState::On) {
            return driver;
        }
        update(ring, &mut driver).unwrap();
    }
    panic!("{:?}", driver.master().ring().failure());
}

fn move_on<W: Drawn, C: servowire_drivers::Clock>(driver: &mut Driver<'static, Bus<W>, C, AXES>) {
    for (k, axis) in driver.ring_mut().axes_mut().iter_mut().enumerate() {
        if axis.state() == AxisState::On {
            let to = axis.setpoint().wrapping_add(10 * (k as i32 + 1));
            axis.set_position(to).unwrap();
        }
    }
}

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

/// The bank is switched in the middle of the exchange, after any access, by the receive interrupt or by XSYNC because the exchange is
/// late: the blocks of two frames are never taken as one.
#[test]
fn a_switch_of_the_bank_never_tears_an_exchange() {
    for external in [true, false] {
        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        // A block is read again at the end.
        let words = (AXES + 1) * 8;
        let mut twice = 0;
        for at in 0..words {
            // The exchange begins with a frame, which is back 29.6 us later; the next one begins after 500 us.
            ring.borrow_mut().stall_in = Some((at as u32, if external { 29_000 } else { 499_000 }));
            let exchanged = update(&ring, &mut driver).unwrap();
            ring.borrow_mut().stall_in = None;
            let read = std::mem::take(&mut ring.borrow_mut().read_of);
            let taken = &read[read.len() - words..][..AXES * 8];
            assert!(taken.iter().all(|frame| *frame == taken[0]), "{external} {at}: {read:?}");
            assert!(!exchanged.torn);
            assert_eq!(driver.master().ring().failure(), None);
            twice += usize::from(read.len() > words);
            for _ in 0..2 {
                update(&ring, &mut driver).unwrap();
            }
        }
        assert!(twice > words / 2);
    }
    let ring = Ring::new(true, false);
    let mut driver = on::<u16>(&ring);
    // A bus so slow that a frame comes in every reading: none is taken, and the axes stop before anything worse happens.
    for _ in 0..LIMIT {
        ring.borrow_mut().stall_in = None;
        let mut slow = || {
            ring.borrow_mut().stall_in = Some((3, 2 * COM_NS));
            let began_ns = ring.borrow().now_ns;
            driver.exchange(began_ns).unwrap()
        };
        let exchanged = slow();
        assert!(exchanged.frames_late > 0);
    }
    assert!(driver.late() >= u32::from(LIMIT));
}

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

/// The interrupt is noticed 60 us late and the exchange goes over the next edge, so the clock sees nothing: what an axis takes is of
/// the frame that is due, whichever access the bank was switched at.
#[test]
fn a_late_interrupt_mixes_no_frames() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    // A block is read again at the end: the bank may have been switched in the middle of the last one.
    let words = (AXES + 1) * 8;
    let mut mixed = 0;
    for at in 0..200 {
        let began_ns = {
            let mut ring = ring.borrow_mut();
            let begins_ns = ring.next_frame_ns();
            ring.pass(begins_ns + 60_000);
            ring.in_exchange = true;
            ring.read_of.clear();
            ring.stall_in = Some((at % words as u32, 441_000));
            ring.now_ns
        };
        let exchanged = driver.exchange(began_ns).unwrap();
        let read = {
            let mut ring = ring.borrow_mut();
            ring.in_exchange = false;
            ring.stall_in = None;
            ring.let_in();
            std::mem::take(&mut ring.read_of)
        };
        // The frame that was there when the interrupt came.
        let due = read[0];
        let taken = &read[read.len() - words..][..AXES * 8];
        mixed += usize::from(read.iter().any(|frame| *frame != due));
        for (place, axis) in driver.master().ring().axes().iter().enumerate() {
            let own = &taken[8 * place..8 * place + 8];
            if axis.arrival() == Arrival::OnTime {
                assert!(own.iter().all(|frame| *frame == due), "{at}: place {place} of {read:?}");
            }
        }
        assert_eq!((exchanged.torn, driver.master().ring().failure()), (false, None), "{at}");
        for _ in 0..6 {
            update(&ring, &mut driver).unwrap();
        }
        assert!((0..AXES).all(|place| position(&ring, &driver, place).is_some()), "{at}");
    }
    assert!(mixed > 150, "{mixed}");
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

/// Faults that the driver has to survive; the environment may want more.
const FAULTS: u64 = 100_000;

/// Faults of the port, lost frames and stalls.
const KINDS: usize = 3;

fn hurt(ring: &Shared, draw: &mut Draw, kind: usize) {
    let mut ring = ring.borrow_mut();
    match kind {
        0 => ring.fail_in = Some(draw.below(24) as u32),
        1 => ring.lose_frames = 1 + draw.below(2) as u32,
        _ => ring.stall_in = Some((draw.below(24) as u32, draw.below(700_000))),
    }
}

fn heal(ring: &Shared) {
    let mut ring = ring.borrow_mut();
    (ring.fail_in, ring.lose_frames, ring.stall_in) = (None, 0, None);
}

/// Every position is there, and it is that of the last frames; nothing has stopped.
fn is_well<C: servowire_drivers::Clock>(
    ring: &Shared,
    driver: &Driver<'static, Bus<u32>, C, AXES>,
    what: &dyn std::fmt::Debug,
) {
    assert_eq!(driver.master().ring().failure(), None, "{what:?}");
    for place in 0..AXES {
        let said = position(ring, driver, place).unwrap_or_else(|| panic!("{what:?}: no position of {place}"));
        let is = ring.borrow().drives[place].position();
        let per_update = 10 * (place as i32 + 1);
        assert!(is.wrapping_sub(said).unsigned_abs() <= 3 * per_update as u32, "{what:?}: {said}, and it is at {is}");
    }
}

/// Faults of the port, lost frames and stalls, 100,000 of them. The exchange after one is good; what it reads was asked for before the
/// fault, so the one after that gives every position again, and they are those of the last frames.
#[test]
fn hostile_events_are_over_with_the_next_call() {
    let mut draw = Draw::default();
    let (mut count, mut kinds) = (0, [0_u64; KINDS]);
    while count < wanted_events(FAULTS).max(FAULTS) {
        let external = draw.below(2) == 1;
        let ring = Ring::new(external, draw.below(2) == 1);
        let mut driver = on::<u32>(&ring);
        for _ in 0..2_000 {
            let kind = draw.below(KINDS as u64) as usize;
            kinds[kind] += 1;
            count += 1;
            hurt(&ring, &mut draw, kind);
            move_on(&mut driver);
            let late = update(&ring, &mut driver).map_or(0, |exchanged| exchanged.frames_late);
            heal(&ring);
            // A late exchange has missed the next interrupt, so the same commands went out twice.
            for _ in 0..2 + late {
                update(&ring, &mut driver).unwrap();
            }
            is_well(&ring, &driver, &(count, kind, external));
        }
    }
    println!("{kinds:?}");
    assert!(count >= FAULTS && kinds.iter().all(|kind| *kind > count / 4));
}

/// The pin of XSYNC: an edge at each frame, but for those that are lost.
#[cfg(feature = "async")]
mod asynch {
    use std::future::poll_fn;
    use std::task::Poll;

    use servowire_drivers::rtex::Released;
    use servowire_drivers::rtex::asynch::{Began, Period};

    use servowire_drivers::{Clock, ClockError, Timer};

    use super::*;
    use crate::polls::{FOR_EVER, Looks, run};

    /// The driver after the start, with a clock that can be waited for.
    fn waiting<W: Drawn, T: Timer>(ring: &Shared, timer: impl Fn(Watch) -> T) -> Driver<'static, Bus<W>, T, AXES> {
        let Released { port, clock, master } = on::<W>(ring).release();
        Driver::new(port, timer(clock), master, ring.borrow().reception())
    }

    struct Pin {
        ring: Shared,
        lost: bool,
        /// From the edge to the poll that sees it.
        late_ns: u64,
    }

    impl embedded_hal::digital::ErrorType for Pin {
        type Error = std::convert::Infallible;
    }

    impl embedded_hal_async::digital::Wait for Pin {
        async fn wait_for_high(&mut self) -> Result<(), Self::Error> {
            unreachable!()
        }

        async fn wait_for_low(&mut self) -> Result<(), Self::Error> {
            unreachable!()
        }

        async fn wait_for_rising_edge(&mut self) -> Result<(), Self::Error> {
            unreachable!()
        }

        async fn wait_for_falling_edge(&mut self) -> Result<(), Self::Error> {
            let edge_ns = self.ring.borrow().next_frame_ns() + self.late_ns;
            poll_fn(|_| {
                let past = self.ring.borrow().now_ns >= edge_ns;
                if past && !self.lost { Poll::Ready(Ok(())) } else { Poll::Pending }
            })
            .await
        }

        async fn wait_for_any_edge(&mut self) -> Result<(), Self::Error> {
            unreachable!()
        }
    }

    #[test]
    fn a_lost_edge_is_healed_by_the_clock() {
        let ring = Ring::new(false, false);
        let mut driver = waiting::<u16, _>(&ring, Looks);
        let mut pin = Pin { ring: ring.clone(), lost: false, late_ns: 0 };
        for k in 0..20 {
            pin.lost = k % 5 == 4;
            ring.borrow_mut().let_in();
            let Period { began, exchanged } = run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
            assert_eq!(began, if k % 5 == 4 { Began::Clock } else { Began::Edge });
            assert_eq!((exchanged.frames_late, exchanged.torn), (0, false));
            assert_eq!(driver.master().ring().failure(), None);
        }
    }

    /// The executor wakes late, and the bank is switched when the period is over all the same: after any access, the blocks of two frames
    /// are not taken as one, and the late exchange is counted. So with an edge that was lost.
    #[test]
    fn an_edge_that_is_noticed_late_tears_no_exchange() {
        for lost in [false, true] {
            let ring = Ring::new(false, false);
            let mut driver = waiting::<u16, _>(&ring, Looks);
            let mut pin = Pin { ring: ring.clone(), lost: false, late_ns: 0 };
            run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
            let words = (AXES + 1) * 8;
            for at in 0..words {
                // Half a period later the clock takes the place of a lost edge.
                let late_ns = if lost { 250_000 } else { 19_000 };
                (pin.lost, pin.late_ns) = (lost, late_ns);
                ring.borrow_mut().read_of.clear();
                ring.borrow_mut().stall_in = Some((at as u32, COM_NS - late_ns + 3_000));
                let Period { exchanged, .. } = run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
                ring.borrow_mut().stall_in = None;
                let read = std::mem::take(&mut ring.borrow_mut().read_of);
                let taken = &read[read.len() - words..][..AXES * 8];
                assert!(taken.iter().all(|frame| *frame == taken[0]), "{lost} {at}: {read:?}");
                assert_eq!((exchanged.frames_late, exchanged.torn), (1, false), "{lost} {at}: {read:?}");
                (pin.lost, pin.late_ns) = (false, 0);
                // What follows is in time, and is said to be.
                for _ in 0..3 {
                    let Period { began, exchanged } = run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
                    assert_eq!((began, exchanged.frames_late), (Began::Edge, 0), "{lost} {at}");
                }
                assert_eq!(driver.late() as usize, at + 1, "{lost}");
                assert_eq!(driver.master().ring().failure(), None);
            }
        }
    }

    /// Dropped after each number of polls: the next call waits for the next edge, its exchange is whole, and every position is new.
    #[test]
    fn a_future_may_be_dropped_at_any_point() {
        let ring = Ring::new(false, false);
        let mut driver = waiting::<u32, _>(&ring, Looks);
        let mut pin = Pin { ring: ring.clone(), lost: false, late_ns: 0 };
        for polls in 0.. {
            move_on(&mut driver);
            let first = run(driver.next(&mut pin), polls);
            let Period { began, exchanged } = run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
            assert_eq!((began, exchanged.frames_late, exchanged.torn), (Began::Edge, 0, false), "after {polls} polls");
            is_well(&ring, &driver, &polls);
            if first.is_some() {
                assert!(polls > 1_000);
                return;
            }
        }
    }

    /// A clock that steps on by 20 us with every poll that waits for it.
    struct Steps(Watch);

    impl Clock for Steps {
        fn now_ns(&mut self) -> Result<u64, ClockError> {
            self.0.now_ns()
        }
    }

    impl Timer for Steps {
        async fn wait_ns(&mut self, ns: u64) {
            let ns = self.0.0.borrow().now_ns + ns;
            poll_fn(|_| {
                let mut ring = self.0.0.borrow_mut();
                let until_ns = ns.min(ring.now_ns + 20_000);
                ring.pass(until_ns);
                if ring.now_ns >= ns { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
        }
    }

    /// The faults of the blocking test, edges that are lost, and futures that are dropped: 100,000 of them, and after each all is well
    /// again.
    #[test]
    fn hostile_events_are_over_with_the_next_call() {
        let mut draw = Draw::default();
        let (mut count, mut kinds) = (0, [0_u64; KINDS + 2]);
        while count < wanted_events(FAULTS).max(FAULTS) {
            let ring = Ring::new(false, draw.below(2) == 1);
            let mut driver = waiting::<u32, _>(&ring, Steps);
            let mut pin = Pin { ring: ring.clone(), lost: false, late_ns: 0 };
            for _ in 0..2_000 {
                let kind = draw.below(kinds.len() as u64) as usize;
                kinds[kind] += 1;
                count += 1;
                move_on(&mut driver);
                let polls = if kind == KINDS { draw.below(30) as usize } else { FOR_EVER };
                pin.lost = kind == KINDS + 1;
                if kind < KINDS {
                    hurt(&ring, &mut draw, kind);
                }
                let outcome = run(driver.next(&mut pin), polls);
                // An edge that came while nobody waited has the same consequence as a late exchange.
                let missed = outcome.map_or(1, |result| result.map_or(0, |period| period.exchanged.frames_late));
                pin.lost = false;
                heal(&ring);
                for _ in 0..2 + missed {
                    run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
                }
                is_well(&ring, &driver, &(count, kind));
            }
        }
        println!("{kinds:?}");
        assert!(count >= FAULTS && kinds.iter().all(|kind| *kind > count / 6));
    }
}
