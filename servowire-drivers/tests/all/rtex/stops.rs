//! What has to stop the ring: every motor that can be reached is released in time, for the reason that there is, whatever the width of
//! the bus, the size of the blocks and the timer system; and the ring is switched on again.

use servowire_drivers::Clock;
use servowire_world::first_seed;

use super::*;

pub(super) const KINDS: usize = 9;
/// The environment may want more.
pub(super) const EVENTS: u64 = 4_000;

/// Update periods from the cause to the last motor: the limit of the echo watch and of the watchdog, one for the command to get there, one
/// in which it is obeyed, and two that a dropped future or a lost edge may cost.
const OFF_WITHIN: u32 = LIMIT as u32 + 4;

/// Puts a cause at a place.
fn put(ring: &Shared, kind: usize, place: usize) {
    let mut ring = ring.borrow_mut();
    match kind {
        0 => ring.lose_frames = u32::MAX,
        1 => ring.dead = Some(place),
        2 => ring.deaf = Some(place),
        3 => ring.drives[place].set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
        4 => ring.drives[place].set_fault(Fault::EmergencyStop),
        5 => ring.drives[place].set_fault(Fault::NoMainPower),
        6 => ring.drives[place].set_fault(Fault::ServoDrop),
        7 => ring.drives[place].set_fault(Fault::WrongMacId(MacId::new(17).unwrap())),
        _ => ring.drives[place].set_fault(Fault::StaleEcho),
    }
}

fn is_reason(reason: StopReason, kind: usize) -> bool {
    match kind {
        0 => matches!(reason, StopReason::EchoTimeout | StopReason::ReceiveTimeout),
        1 => reason == StopReason::Requested,
        2 | 8 => reason == StopReason::EchoTimeout,
        3 => reason == StopReason::Alarm,
        4 | 5 => reason == StopReason::NotReady,
        6 => reason == StopReason::NotActive,
        _ => reason == StopReason::WrongMacId(MacId::new(17).unwrap()),
    }
}

/// Whether an exchange that reads everything three times, and a block of each of two readings again, is over before the frame is back
/// (29.6 us, an access takes 110 ns). Otherwise a drive that stands still costs the others their blocks, and the first of all is named.
fn reads_in_time<W: Drawn>(ring: &Shared, noticed_ns: u64) -> bool {
    let bytes = if ring.borrow().wide { 32 } else { 16 };
    noticed_ns + (3 * AXES + 2) as u64 * (bytes / size_of::<W>()) as u64 * 110 < 29_000
}

/// `update` makes an update period, and notices its beginning as late as `noticed_ns`.
pub(super) fn hostile<W: Drawn, C: Clock>(
    ring: &Shared,
    driver: &mut Driver<'static, Bus<W>, C, AXES>,
    draw: &mut Draw,
    kinds: &mut [u64; KINDS],
    noticed_ns: u64,
    mut update: impl FnMut(&mut Driver<'static, Bus<W>, C, AXES>),
) {
    for _ in 0..40 {
        for _ in 0..5 + draw.below(20) {
            move_on(driver);
            update(driver);
        }
        let (kind, place) = (draw.below(KINDS as u64) as usize, draw.below(AXES as u64) as usize);
        kinds[kind] += 1;
        assert_eq!(driver.master().ring().failure(), None, "before {kind} at {place}");
        put(ring, kind, place);
        if kind == 1 {
            driver.ring_mut().stop(StopCategory::Zero);
        }
        (0..OFF_WITHIN).for_each(|_| update(driver));
        // A drive that gets no commands, or has stopped, obeys nobody: it is for the others that the ring stops.
        let obeys = |at: usize| at != place || !matches!(kind, 1 | 8);
        let what = (kind, place, size_of::<W>(), ring.borrow().wide, ring.borrow().external);
        for at in (0..AXES).filter(|at| obeys(*at)) {
            assert!(!ring.borrow().drives[at].is_active(), "{what:?}: {at} is on");
        }
        let failure = driver.master().ring().failure();
        let named = kind >= 2 && (kind != 8 || reads_in_time::<W>(ring, noticed_ns));
        let is_so = failure.is_some_and(|it| is_reason(it.reason, kind) && (!named || it.place == place as u8));
        assert!(is_so, "{what:?}: {failure:?}");
        recover(ring, driver, &mut update);
    }
}

/// Everything is repaired, and all axes are on again.
fn recover<W: Drawn, C: Clock>(
    ring: &Shared,
    driver: &mut Driver<'static, Bus<W>, C, AXES>,
    update: &mut impl FnMut(&mut Driver<'static, Bus<W>, C, AXES>),
) {
    heal(ring);
    {
        let mut ring = ring.borrow_mut();
        (ring.dead, ring.deaf) = (None, None);
        ring.drives.iter_mut().for_each(|drive| drive.set_fault(Fault::None));
    }
    for _ in 0..3 {
        (0..6).for_each(|_| update(driver));
        ring.borrow_mut().drives.iter_mut().for_each(Drive::clear_alarm);
        driver.clear();
        for _ in 0..100 {
            update(driver);
            driver.ring_mut().switch_on().ok();
            if driver.master().ring().all_are(AxisState::On) {
                return;
            }
        }
    }
    panic!("{:?}", driver.master().ring().failure());
}

#[test]
fn hostile_stops_release_every_motor() {
    let (mut draw, mut kinds) = (Draw::seeded(first_seed()), [0; KINDS]);
    while kinds.iter().sum::<u64>() < wanted_events(EVENTS) {
        match draw.below(3) {
            0 => on_a_bus::<u8>(&mut draw, &mut kinds),
            1 => on_a_bus::<u16>(&mut draw, &mut kinds),
            _ => on_a_bus::<u32>(&mut draw, &mut kinds),
        }
    }
    println!("{kinds:?}");
    assert!(kinds.iter().all(|kind| *kind > 0), "{kinds:?}");
}

fn on_a_bus<W: Drawn>(draw: &mut Draw, kinds: &mut [u64; KINDS]) {
    let ring = Ring::new(draw.below(2) == 1, draw.below(2) == 1);
    let mut driver = on::<W>(&ring);
    hostile(&ring, &mut driver, draw, kinds, 0, |driver| _ = update(&ring, driver));
}
