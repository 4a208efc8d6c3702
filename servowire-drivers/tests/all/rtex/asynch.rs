//! The pin of XSYNC: an edge at each frame, but for those that are lost.

use std::future::poll_fn;
use std::task::Poll;

use servowire_drivers::rtex::Released;
use servowire_drivers::rtex::asynch::{Began, Period};

use servowire_drivers::{Clock, ClockError, Timer};

use super::faults::{FAULTS, KINDS, hurt};
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
    /// It reports a fault at once.
    broken: bool,
    /// From the edge to the poll that sees it.
    late_ns: u64,
}

impl Pin {
    fn of(ring: &Shared) -> Self {
        Self { ring: ring.clone(), lost: false, broken: false, late_ns: 0 }
    }
}

impl embedded_hal::digital::ErrorType for Pin {
    type Error = embedded_hal::digital::ErrorKind;
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
        if self.broken {
            return Err(Self::Error::Other);
        }
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
    let mut pin = Pin::of(&ring);
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
        let mut pin = Pin::of(&ring);
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
    let mut pin = Pin::of(&ring);
    for polls in 0.. {
        move_on(&mut driver);
        let edge_ns = ring.borrow().next_frame_ns();
        let first = run(driver.next(&mut pin), polls);
        let mut due_ns = edge_ns + COM_NS * u64::from(first.is_some());
        let mut left = 1;
        while left > 0 {
            let Period { began, exchanged } = run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
            assert_eq!((began, exchanged.frames_late, exchanged.torn), (Began::Edge, 0, false), "after {polls} polls");
            // An edge that came between the two was missed: the same commands went out once more, and came back once more.
            let is_missed = ring.borrow().next_frame_ns() > due_ns + COM_NS;
            left = if is_missed { 2 } else { left - 1 };
            due_ns = ring.borrow().next_frame_ns();
        }
        is_well(&ring, &driver, &polls);
        if first.is_some() {
            assert!(polls > 1_000);
            return;
        }
    }
}

/// A pin that fails is a lost edge: the exchange comes one and a half periods later, and not at once.
#[test]
fn a_pin_that_fails_is_a_lost_edge() {
    let ring = Ring::new(false, false);
    let mut driver = waiting::<u16, _>(&ring, Steps);
    let mut pin = Pin { broken: true, ..Pin::of(&ring) };
    for _ in 0..4 {
        ring.borrow_mut().let_in();
        let from_ns = ring.borrow().now_ns;
        let Period { began, .. } = run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
        assert_eq!(began, Began::Clock);
        assert!(ring.borrow().now_ns - from_ns >= COM_NS * 3 / 2);
    }
    assert_eq!(driver.master().ring().failure(), None);
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

/// The faults of the blocking test, edges that are lost, and futures that are dropped: 100,000 of them, on buses of all widths, and
/// after each all is well again.
#[test]
fn hostile_events_are_over_with_the_next_call() {
    let mut draw = Draw::default();
    let mut kinds = [0_u64; KINDS + 2];
    while kinds.iter().sum::<u64>() < wanted_events(FAULTS).max(FAULTS) {
        match draw.below(3) {
            0 => hostile::<u8>(&mut draw, &mut kinds),
            1 => hostile::<u16>(&mut draw, &mut kinds),
            _ => hostile::<u32>(&mut draw, &mut kinds),
        }
    }
    println!("{kinds:?}");
    let count: u64 = kinds.iter().sum();
    assert!(kinds.iter().all(|kind| *kind > count / 6));
}

fn hostile<W: Drawn>(draw: &mut Draw, kinds: &mut [u64; KINDS + 2]) {
    let ring = Ring::new(false, draw.below(2) == 1);
    let mut driver = waiting::<W, _>(&ring, Steps);
    let mut pin = Pin::of(&ring);
    for count in 0..2_000 {
        let kind = draw.below(kinds.len() as u64) as usize;
        kinds[kind] += 1;
        move_on(&mut driver);
        let polls = if kind == KINDS { draw.below(30) as usize } else { FOR_EVER };
        pin.lost = kind == KINDS + 1;
        if kind < KINDS {
            hurt(&ring, draw, kind);
        }
        let outcome = run(driver.next(&mut pin), polls);
        // An edge that came while nobody waited has the same consequence as a late exchange.
        let missed = outcome.map_or(1, |result| result.map_or(0, |period| period.exchanged.frames_late));
        pin.lost = false;
        heal(&ring);
        // After a stall the first block may be of any of the frames that passed, and is taken for the oldest of them.
        let stalled = u32::from(kind == KINDS - 1);
        for _ in 0..2 + missed + stalled {
            run(driver.next(&mut pin), FOR_EVER).unwrap().unwrap();
        }
        is_well(&ring, &driver, &(count, kind, size_of::<W>()));
    }
}

/// What has to stop the ring, with the driver as a future; among it are edges that do not come and futures that are dropped.
#[test]
fn hostile_stops_release_every_motor() {
    let (mut draw, mut kinds) = (Draw::seeded(servowire_world::first_seed()), [0; stops::KINDS]);
    while kinds.iter().sum::<u64>() < wanted_events(stops::EVENTS) {
        match draw.below(3) {
            0 => hostile_stops::<u8>(&mut draw, &mut kinds),
            1 => hostile_stops::<u16>(&mut draw, &mut kinds),
            _ => hostile_stops::<u32>(&mut draw, &mut kinds),
        }
    }
    println!("{kinds:?}");
    assert!(kinds.iter().all(|kind| *kind > 0), "{kinds:?}");
}

fn hostile_stops<W: Drawn>(draw: &mut Draw, kinds: &mut [u64; stops::KINDS]) {
    let ring = Ring::new(false, draw.below(2) == 1);
    let mut driver = waiting::<W, _>(&ring, Steps);
    let mut pin = Pin::of(&ring);
    let mut of_the_pin = Draw::seeded(draw.below(1 << 31));
    // The steps of the clock.
    stops::hostile(&ring, &mut driver, draw, kinds, 20_000, |driver| {
        ring.borrow_mut().let_in();
        pin.lost = of_the_pin.below(20) == 0;
        if of_the_pin.below(20) == 0 {
            let _dropped = run(driver.next(&mut pin), of_the_pin.below(10) as usize);
        }
        let _ = run(driver.next(&mut pin), FOR_EVER).unwrap();
    });
}
