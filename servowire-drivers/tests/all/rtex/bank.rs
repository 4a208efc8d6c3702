//! Two frames are never taken as one, however late the exchange is.

use std::cell::Cell;
use std::convert::Infallible;

use rtex_block::master::Asic;
use servowire_drivers::rtex::{Exchanged, FrameCount, Port};

use super::*;

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

/// The echo of one drive stands still, so the blocks never look like those of one frame: they are counted as torn, and the others are
/// taken all the same.
#[test]
fn an_echo_that_stands_still_costs_the_others_nothing() {
    for external in [true, false] {
        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        ring.borrow_mut().drives[1].set_fault(Fault::StaleEcho);
        let mut torn = 0;
        for _ in 1..LIMIT {
            torn += u32::from(update(&ring, &mut driver).unwrap().torn);
            for (place, axis) in driver.master().ring().axes().iter().enumerate() {
                assert!(place == 1 || axis.arrival() == Arrival::OnTime, "{external} {place}: {}", axis.arrival());
            }
        }
        assert!(torn >= u32::from(LIMIT) - 3, "{external}: {torn}");
        assert_eq!((driver.torn(), driver.master().ring().failure()), (torn, None), "{external}");
    }
}

/// An exchange whose interrupt is noticed 60 us late and that goes over the next edge after so many words; returns also the frames that
/// the words are of.
fn noticed_late(ring: &Shared, driver: &mut Rtex<u16>, at: u32) -> (Exchanged, Vec<u32>) {
    let began_ns = {
        let mut ring = ring.borrow_mut();
        let begins_ns = ring.next_frame_ns();
        ring.pass(begins_ns + 60_000);
        ring.in_exchange = true;
        ring.read_of.clear();
        ring.stall_in = Some((at, 441_000));
        ring.now_ns
    };
    let exchanged = driver.exchange(began_ns).unwrap();
    let mut ring = ring.borrow_mut();
    ring.in_exchange = false;
    ring.stall_in = None;
    ring.let_in();
    (exchanged, std::mem::take(&mut ring.read_of))
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
        let (exchanged, read) = noticed_late(&ring, &mut driver, at % words as u32);
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

/// Two exchanges in a row are late, so two frames carry the same commands and bring the same echoes, and XSYNC switches the bank in the
/// middle of the second exchange: its clock tells what the echoes cannot.
#[test]
fn frames_with_the_same_echoes_are_not_mixed_either() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    let words = (AXES + 1) * 8;
    let mut twice = 0;
    for at in 0..words {
        ring.borrow_mut().stall_in = Some((words as u32, 499_000));
        assert_eq!(update(&ring, &mut driver).unwrap().frames_late, 1);
        // The interrupt of the frame that has begun meanwhile was waiting.
        let began_ns = {
            let mut ring = ring.borrow_mut();
            (ring.in_exchange, ring.stall_in) = (true, Some((at as u32, 499_000)));
            ring.read_of.clear();
            ring.next_frame_ns() - COM_NS
        };
        let exchanged = driver.exchange(began_ns).unwrap();
        let read = {
            let mut ring = ring.borrow_mut();
            (ring.in_exchange, ring.stall_in) = (false, None);
            ring.let_in();
            std::mem::take(&mut ring.read_of)
        };
        let taken = &read[read.len() - words..][..AXES * 8];
        assert!(taken.iter().all(|frame| *frame == taken[0]), "{at}: {read:?}");
        assert_eq!((exchanged.torn, driver.master().ring().failure()), (false, None), "{at}");
        twice += usize::from(read.len() > words);
        for _ in 0..4 {
            update(&ring, &mut driver).unwrap();
        }
    }
    assert!(twice > words / 2, "{twice}");
}

/// One drive that answers at once, at an ASIC that receives a frame in every reading, while it is `busy`: the interrupt says so, or
/// the clock.
struct Restless<'a> {
    frames: &'a FrameCount,
    now_ns: Option<&'a Cell<u64>>,
    busy: &'a Cell<bool>,
    /// How often the state was asked for, and the first words of the last command.
    asked: u32,
    command: u16,
}

impl Port for Restless<'_> {
    type Word = u16;
    type Error = Infallible;

    fn state(&mut self) -> Result<Asic, Infallible> {
        self.asked += 1;
        Ok(match self.asked {
            1 => Asic::RingConfig,
            2 => Asic::Ready,
            _ => Asic::Running,
        })
    }

    fn slaves(&mut self, found: &mut [Slave]) -> Result<Option<usize>, Infallible> {
        found[0] = Slave { mac_id: MacId::truncate(1), kind: 1 };
        Ok(Some(1))
    }

    fn read(&mut self, _: usize, words: &mut [u16]) -> Result<(), Infallible> {
        match self.now_ns {
            _ if !self.busy.get() => {}
            Some(now_ns) => now_ns.set(now_ns.get() + 500_000),
            None => self.frames.add(),
        }
        // C/R, counter, address and code as they came; Servo_Ready and In_Position; position 1000.
        words.fill(0);
        words[..3].copy_from_slice(&[self.command | 0x80, 0x41, 1_000]);
        Ok(())
    }

    fn write(&mut self, _: usize, words: &[u16]) -> Result<(), Infallible> {
        self.command = words[0];
        Ok(())
    }
}

/// A frame comes in every reading, and the blocks look like those of one frame: none is taken.
#[test]
fn blocks_that_only_look_like_one_frame_are_not_taken() {
    for by_clock in [false, true] {
        let (frames, restless, now_ns) = (FrameCount::new(), Cell::new(false), Cell::new(0));
        let clock = by_clock.then_some(&now_ns);
        let port = Restless { frames: &frames, now_ns: clock, busy: &restless, asked: 0, command: 0 };
        let mut driver = Driver::new(port, || now_ns.get(), clock::host(), &frames);
        assert_eq!(driver.start(1_000_000), Ok(ControlPhase::Running));
        let mut update = || {
            now_ns.set(now_ns.get() + 500_000);
            frames.add();
            let exchanged = driver.exchange(now_ns.get()).unwrap();
            (exchanged.torn, driver.master().ring().axes()[0].arrival() == Arrival::OnTime)
        };
        let calm: Vec<_> = (0..20).map(|_| update()).collect();
        assert!(calm[10..].iter().all(|it| *it == (false, true)), "{calm:?}");
        restless.set(true);
        for period in 0..3 {
            assert_eq!(update(), (true, false), "{by_clock} {period}");
        }
    }
}

/// The echo of a drive stands still, so no reading looks like one frame, or one that is of two does, and the bank is switched in the
/// middle of a block: a position is never put together from the halves of two.
#[test]
fn no_position_is_made_of_two_halves() {
    let mut halves = 0;
    // The receive interrupt switches the bank, or XSYNC, in time for the clock to tell or so late that the echoes alone do.
    for ((external, late), still) in [(true, false), (false, false), (false, true)]
        .into_iter()
        .flat_map(|system| (0..AXES).map(move |still| (system, still)))
    {
        let ring = Ring::new(external, false);
        let mut driver = on::<u16>(&ring);
        let period = |driver: &mut Rtex<u16>, late_at: Option<u32>| {
            // Both words of a position change in each period.
            for place in (0..AXES).filter(|place| *place != still) {
                let axis = &mut driver.ring_mut().axes_mut()[place];
                axis.set_position(axis.setpoint().wrapping_add(0x1_8001)).unwrap();
            }
            let read = if let Some(at) = late_at {
                noticed_late(&ring, driver, at).1
            } else {
                update(&ring, driver).unwrap();
                ring.borrow().read_of.clone()
            };
            for (place, axis) in driver.master().ring().axes().iter().enumerate() {
                let position = axis.evidence().at(0, Policy::new(u64::MAX)).unwrap().position();
                let ring = ring.borrow();
                let known = ring.positions.iter().map(|frame| frame[place]);
                assert!(known.clone().any(|it| it == position), "{position} of {:?}", known.collect::<Vec<_>>());
            }
            usize::from(read.windows(2).any(|two| two[0] != two[1]))
        };
        for (at, periods) in (0..100).flat_map(|at| (1..LIMIT - 1 - u16::from(late)).map(move |periods| (at, periods)))
        {
            ring.borrow_mut().drives[still].set_fault(Fault::StaleEcho);
            (0..periods).for_each(|_| _ = period(&mut driver, None));
            if !late {
                ring.borrow_mut().stall_in = Some((at, if external { 29_000 } else { 499_000 }));
            }
            halves += period(&mut driver, late.then_some(at));
            heal(&ring);
            ring.borrow_mut().drives[still].set_fault(Fault::None);
            (0..6).for_each(|_| _ = period(&mut driver, None));
            assert_eq!(driver.master().ring().failure(), None, "{external} {still} {at} {periods}");
        }
    }
    assert!(halves > 2_000, "{halves}");
}

/// The port fails in a reading that is repeated because the bank was switched: what counts is the second one.
#[test]
fn a_fault_of_a_reading_that_does_not_count_is_none() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    for at in 3..24 {
        {
            let mut ring = ring.borrow_mut();
            ring.stall_in = Some((at, 499_000));
            (ring.fail_in, ring.fail_again) = (Some(0), true);
        }
        let exchanged = update(&ring, &mut driver);
        heal(&ring);
        assert_eq!(exchanged.map(|exchanged| exchanged.torn), Ok(false), "{at}");
        assert_ne!(driver.master().ring().axes()[0].arrival(), Arrival::Missing, "{at}");
        for _ in 0..3 {
            update(&ring, &mut driver).unwrap();
        }
    }
}

/// The port fails when the first block is read again at the end, which alone tells that the bank was switched in the middle of the
/// last one.
#[test]
fn a_block_that_cannot_be_read_again_is_no_proof() {
    let ring = Ring::new(false, false);
    let mut driver = on::<u16>(&ring);
    // So late that the clock sees no edge.
    ring.borrow_mut().late_ns = 60_000;
    let words = AXES as u32 * 8;
    for at in 1..8 {
        {
            let mut ring = ring.borrow_mut();
            ring.stall_in = Some((words - 8 + at, 439_000));
            (ring.fail_in, ring.fail_again) = (Some(words), true);
        }
        let exchanged = update(&ring, &mut driver);
        let read = std::mem::take(&mut ring.borrow_mut().read_of);
        heal(&ring);
        let last = driver.master().ring().axes()[AXES - 1].arrival();
        // The first reading, and the second one if there was one.
        let halves = |reading: &[u32]| reading[2 * 8..].windows(2).any(|two| two[0] != two[1]);
        let taken = &read[if read.len() > 3 * 8 { read.len() - 4 * 8 } else { 0 }..][..3 * 8];
        assert!(halves(&read[..3 * 8]), "{at}: {read:?}");
        assert!(last != Arrival::OnTime || !halves(taken), "{at}: {exchanged:?} {read:?}");
        for _ in 0..3 {
            update(&ring, &mut driver).unwrap();
        }
    }
}
