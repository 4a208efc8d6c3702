//! What is told once, what is told apart, and what must not be told.

use hdsl::device::{Device, Fault};
use hdsl::master::{Master, RestartReason, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress};
use hdsl::registers::{Event, EventS, Online1, Online2, OnlineD};
use hdsl::sync::{Es, Synchroniser};
use hdsl::{Channel2Findings, Channel2Monitor, Dialect, Doubt, EncoderId, MasterSymbol, Policy, VFrame};

use crate::register_map::Desk;

const ANY_AGE: Policy = Policy::new(u64::MAX);

/// An encoder that has no position is no stale receiver, and the other way round.
#[test]
fn withheld_is_not_stale() {
    for (fault, doubt) in [(Fault::NoPosition, Doubt::Withheld), (Fault::BadCrc, Doubt::Stale)] {
        let mut desk = Desk::new(Dialect::SICK, 0x00153);
        desk.device.set_fault(fault);
        // The present V-frame and the next one.
        desk.frames(16);
        assert_eq!(desk.master.safe().at(0, ANY_AGE), Err(doubt));
        desk.device.set_fault(Fault::None);
        desk.frames(16);
        assert!(desk.master.safe().at(0, ANY_AGE).is_ok());
    }
}

/// By the manual a safe event is raised when its status arises, and not again while it lasts (p. 36-38).
#[test]
fn safe_events_are_raised_once() {
    for (fault, event) in [(Fault::NoPosition, EventS::VPOS), (Fault::BadCrc, EventS::SCE), (Fault::None, EventS::SSUM)]
    {
        let mut desk = Desk::new(Dialect::SICK, 0x00153);
        let summary = fault == Fault::None;
        desk.device.set_fault(fault);
        desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, u8::from(summary));
        // A V-frame is shown one frame after its end; three bad ones in a row would be too many for the link.
        desk.frames(9);
        assert!(desk.map.take_events().safe.contains(event), "{fault:?}");
        desk.device.set_fault(Fault::None);
        desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, 0);
        desk.frames(8);
        assert!(!desk.map.take_events().safe.contains(event), "{fault:?}");
        desk.frames(39);
        desk.device.set_fault(fault);
        desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, u8::from(summary));
        desk.frames(9);
        assert!(desk.map.take_events().safe.contains(event), "{fault:?}");
    }
}

/// A block that says "no position" is sound: it ends SCE and sets VPOS.
#[test]
fn a_mark_ends_sce() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let mut desk = Desk::new(dialect, 0x00153);
        desk.device.set_fault(Fault::BadCrc);
        desk.frames(9);
        assert!(desk.map.online_1().contains(Online1::SCE));
        desk.device.set_fault(Fault::NoPosition);
        desk.frames(17);
        assert!(desk.map.online_1().contains(Online1::VPOS) && !desk.map.online_1().contains(Online1::SCE));
    }
}

/// A message that was dropped was not answered badly.
#[test]
fn a_dropped_message_is_no_bad_answer() {
    for restart in [false, true] {
        let mut desk = Desk::new(Dialect::SICK, 0x00153);
        desk.master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
        desk.frames(3);
        let _ = desk.map.take_events();
        if restart {
            desk.master.request_restart();
        } else {
            desk.write(0x00, 0x40);
        }
        desk.frames(4);
        assert!(!desk.map.event().contains(Event::ANS) && !desk.map.online_d().contains(OnlineD::ANS));
    }
}

/// MRST tells the encoder also when nothing is under way.
#[test]
fn a_message_reset_of_nothing() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let mut desk = Desk::new(dialect, 0x00153);
        desk.write(0x35, 0x40);
        let inits = (0..8).filter(|_| {
            desk.frames(1);
            desk.master.transmission().head.byte().symbol() == Ok(MasterSymbol::Init)
        });
        assert_eq!(inits.count(), 1);
        assert!(desk.map.event().contains(Event::MIN));
    }
}

/// ACC_ERR_CNT_THRESH of the SDK has eight bits.
#[test]
fn a_threshold_above_31() {
    for threshold in [5, 31, 32, 60] {
        let mut desk = Desk::new(Dialect::TI, 0x00153);
        desk.write(0x41, threshold);
        desk.device.set_fault(Fault::NoAcceleration);
        let words = (1..=99).find(|_| desk.frame().restarted == Some(RestartReason::AccelerationErrors));
        assert_eq!(words, Some(threshold.into()));
    }
}

/// A bad word of channel 2 is one of its block: the count, the quality and SCE2 tell, and the last block stays.
#[test]
fn a_bad_word_of_channel_2() {
    let mut desk = Desk::new(Dialect::SICK, 0x00153);
    while desk.master.frame() != 3 {
        desk.frames(1);
    }
    let before = desk.map.vpos2();
    let answer = desk.device.set_position(0x8765_4321).hear(desk.master.transmission().head.bits()).unwrap();
    let report = *desk.master.hear_bits(answer.bits & !(0x3ff << 51), None, 0);
    let _ = desk.map.apply(&report);
    assert_eq!((desk.map.quality(), desk.master.counters().safe2), (15 - 8, 0));
    desk.frames(5);
    assert_eq!(desk.master.counters().safe2, 1);
    assert!(desk.map.online_2().contains(Online2::SCE2) && desk.map.vpos2() == before);
    desk.frames(8);
    assert!(!desk.map.online_2().contains(Online2::SCE2));
}

/// TOG2 is compared between sound blocks of neighbouring V-frames only; the age counts those that were not.
#[test]
fn toggles_over_a_gap() {
    let mut desk = Desk::new(Dialect::SICK, 0x00153);
    let mut next = |fault| {
        desk.device.set_fault(fault);
        (0..16).find_map(|_| desk.frame().v_frame).unwrap()
    };
    // The fault is there from the next V-frame on.
    let _ = next(Fault::None);
    let [first, second] = [next(Fault::None), next(Fault::None)];
    let mut monitor = Channel2Monitor::new();
    assert_eq!((monitor.v_frame(&first), monitor.age()), (Channel2Findings::empty(), 0));
    assert_eq!(monitor.v_frame(&first), Channel2Findings::TOG2);
    assert_eq!(monitor.v_frame(&second), Channel2Findings::empty());
    for age in 1..=3 {
        assert_eq!((monitor.v_frame(&VFrame::default()), monitor.age()), (Channel2Findings::STALE, age));
    }
    // Whether it should be this one is not known after a gap.
    assert_eq!((monitor.v_frame(&second), monitor.age()), (Channel2Findings::empty(), 0));
    assert_eq!(monitor.v_frame(&second), Channel2Findings::TOG2);
}

/// Frames that were not heard, told or not: TOG2 of V-frames that are not neighbours says nothing, and the age is that of the last
/// sound block whatever was heard since. (A stranger's bus found both: a lost RX7 made a TOG2 of nothing.)
#[test]
fn a_monitor_over_lost_frames() {
    for told in [true, false] {
        for (place, lost) in [(7, 1), (0, 8), (1, 7), (0, 16), (4, 4), (4, 12), (7, 9), (3, 2), (0, 24)] {
            // Not told, the phase of the V-frames is lost too, unless they are whole ones.
            if !told && lost % 8 != 0 {
                continue;
            }
            let mut desk = Desk::new(Dialect::SICK, 0x00153);
            let mut monitor = Channel2Monitor::new();
            let (mut number, mut sound) = (0_u32, 0);
            let mut compared = 0;
            for round in 0..120_u32 {
                if round >= 40 && round % 40 == 0 {
                    while desk.master.frame() != place {
                        let report = desk.frame();
                        number += 1;
                        if monitor.h_frame(&report) == Some(Channel2Findings::empty()) {
                            sound = number;
                        }
                    }
                    for _ in 0..lost {
                        let head = desk.master.transmission().head.bits();
                        let _ = desk.device.set_position(0x8765_4321).hear(head);
                    }
                    number += u32::from(lost);
                    desk.now_ns += u64::from(lost) * 11_520;
                    if told {
                        desk.master.skip(lost);
                    } else {
                        // The number does not tell them then.
                        number -= u32::from(lost);
                    }
                }
                let report = desk.frame();
                number += 1;
                let findings = monitor.h_frame(&report);
                assert_eq!(findings.is_some(), report.v_frame.is_some());
                match findings {
                    Some(Channel2Findings::STALE) | None => {}
                    Some(findings) => {
                        assert_eq!(findings, Channel2Findings::empty(), "{told} {place} {lost}");
                        (sound, compared) = (number, compared + 1);
                    }
                }
                assert!(sound == 0 || monitor.age() == (number - sound) / 8, "{told} {place} {lost} {round}");
            }
            assert!(compared > 6);
        }
    }
}

/// After a restart of the link the first TOG2 is compared with nothing.
#[test]
fn a_monitor_over_a_restart() {
    let mut desk = Desk::new(Dialect::SICK, 0x00153);
    let mut monitor = Channel2Monitor::new();
    for round in 0..6 {
        desk.master.request_restart();
        // One V-frame more each time, so that either TOG2 is the last one.
        for _ in 0..61 + 24 + 8 * round {
            let findings = monitor.h_frame(&desk.frame());
            assert!(findings.is_none_or(|it| it.is_empty() || it == Channel2Findings::STALE), "{findings:?}");
        }
    }
}

/// The ones of the EXTRA window count in the disparity (the firmware counts its nominal size): equalisation and the first block of
/// PARA by the table of the firmware, from frame to frame where no encoder answers.
#[test]
fn the_window_is_balanced() {
    for period in [900, 1003, 1500, 2001] {
        let mut master = Master::synchronised(Dialect::SICK, Synchroniser::new(period, Es::ONE).unwrap());
        let mut disparity = 0_i32;
        for frame in 0..18 {
            let head = master.transmission().head;
            disparity += i32::from(head.extra().unwrap().bits());
            // First line bit in bit 0.
            let (bits, after) = match disparity {
                -1..=1 => (0b0000, disparity),
                2 | 3 => (0b0100, disparity - 2),
                4.. => (0b0000, disparity - 4),
                -3 | -2 => (0b1011, disparity + 2),
                ..-3 => (0b1111, disparity + 4),
            };
            assert_eq!(head.equalisation(), bits, "{period} {frame} {disparity}");
            let ones = (head.para().get() & 0x3f).count_ones() as i32;
            let unbalanced = 2 * ones - 6;
            // More zeros where there were more ones.
            assert!(unbalanced == 0 || (unbalanced < 0) == (after >= 0), "{period} {frame}");
            disparity = after + unbalanced;
            let _ = master.hear_bits(u64::MAX, None, 0);
        }
    }
}

/// An encoder that is lost and comes back: nothing of the first link is taken for the second one.
#[test]
fn a_second_link() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let mut desk = Desk::new(dialect, 0x00153);
        desk.master.request_restart();
        desk.device = Device::new(EncoderId::new(0x000d3).unwrap());
        desk.frames(1);
        assert_eq!((desk.master.fast().at(0, ANY_AGE), desk.map.pos()), (Err(Doubt::NoLink), None));
        for _ in 0..61 + 16 {
            desk.frames(1);
            assert!(desk.master.fast().at(0, ANY_AGE).is_err() && desk.map.pos().is_none());
        }
        desk.frames(40);
        assert_eq!((desk.master.state(), desk.map.pos()), (State::Running, Some(0x65_4321)));
        let fast = desk.master.fast().at(0, ANY_AGE).map(|fast| fast.position());
        assert_eq!(fast, Ok(0x65_4321));
    }
}
