//! Texts, parameters, homing, latch and sub-commands, against a drive that shares no number with the master.

use crate::common::{CODES, Pair, actual, limits, monitor, set_position};
use rtex_block::device::{Behaviour, DriveConfig, Quirks};
use rtex_block::master::procedure::{Backup, Caught, Home, Latch, ParameterValue, ReadText, Restore, SetPosition};
use rtex_block::master::{ActiveCode, AskError, Axis, AxisConfig, AxisState, Failure, Heard, Progress};
use rtex_block::{
    Arguments, ErrorCode, LatchFlags, MacId, Nibble, NonCyclicCommand, NonCyclicResponse, Pr, ProfileFlags, Response,
    Response32, StatusFlags, SubCode, TypeCode,
};

/// Homing in the drive: Homing_Complete of an earlier homing is not the end of this one.
#[test]
fn homing_ends_when_this_homing_ends() {
    for behaviour in [Behaviour::new(), Behaviour::new().with_quirks(Quirks::HOMED_AT_START).with_echo_lag(3)] {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
        let mut home = Home::new(0xc8, 1_000);
        let mut reached = Vec::new();
        assert_eq!(
            pair.run(|axis| {
                reached.push(actual(axis));
                home.receive(axis)
            }),
            Progress::Done { value: () }
        );
        assert!(reached.iter().any(|at| *at < -2_500), "{reached:?}");
        pair.until("at the origin", |pair| pair.drive.position() == 0);
        assert_eq!(pair.axis.state(), AxisState::On);
    }
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    let mut home = Home::new(0xc8, 5);
    assert_eq!(pair.run(|axis| home.receive(axis)), Progress::Failed { error: Failure::TimedOut });
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let mut home = Home::new(0xc8, 5);
    assert_eq!(pair.run(|axis| home.receive(axis)), Progress::Failed { error: Failure::Mode });
}

/// A drive that homes where it is and is done when it answers: that is believed after a turn of the counter and a block more.
#[test]
fn homing_without_a_motion_takes_five_blocks() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    let mut home = Home::new(0xc8, 1_000);
    let (mut answered, mut blocks) = (false, 0);
    let mut response = *pair.received.response().unwrap();
    for _ in 0..100 {
        pair.update();
        blocks += u32::from(answered);
        answered |= response.code.get() == 0x14;
        response = *pair.received.response().unwrap();
        response.status.set(StatusFlags::IN_PROGRESS, false);
        response.status.set(StatusFlags::HOMING_COMPLETE, answered || response.code.get() == 0x14);
        pair.received = Response::parse(&response.emit()).into();
        if !home.receive(&mut pair.axis).is_pending() {
            break;
        }
    }
    assert_eq!((home.receive(&mut pair.axis), blocks), (Progress::Done { value: () }, 5));
}

/// Type 21h sets the actual position, 22h the command position; both are sent once and read back.
#[test]
fn positions_are_set_once_and_read_back() {
    for (mut set, want) in [(SetPosition::actual(-4_000), -4_000), (SetPosition::command(77), 77)] {
        let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new().with_stale_answers(2));
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        assert_eq!(pair.run(|axis| set.receive(axis)), Progress::Done { value: want });
        assert_eq!(pair.drive.position(), want);
    }
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let refused = Progress::Failed { error: Failure::NotSent(AskError::ServoOn) };
    let mut set = SetPosition::actual(5);
    assert_eq!(pair.run(|axis| set.receive(axis)), refused);
    // The answer never comes, but the drive has done it: the position that is read back says so. Where it says otherwise
    // the effect is not known. In neither case is the command sent again.
    for (answers, reads, want) in
        [(false, true, Progress::Done { value: 900 }), (false, false, Progress::Failed { error: Failure::TimedOut })]
    {
        let config = AxisConfig::new(MacId::new(9).unwrap(), ActiveCode::CyclicPosition, 500_000, limits());
        let mut pair = Pair::with(config, DriveConfig::new(MacId::new(9).unwrap(), CODES));
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        let mut set = SetPosition::actual(900);
        let (mut blocks, mut last, mut read) = (0, 0, 0);
        let ended = loop {
            pair.update();
            let response = *pair.received.response().unwrap();
            blocks += u32::from(response.code.get() == 0x24 && last != 0x24);
            last = response.code.get();
            read = if last == 0x2a { response.emit()[8] } else { read };
            if last == 0x24 && !answers {
                // The homing answer is spoilt: it looks like one to another type.
                let mut block = response.emit();
                block[8] ^= 1;
                pair.received = Response::parse(&block).into();
            }
            if last == 0x2a && !reads {
                let mut block = response.emit();
                block[12] ^= 1;
                pair.received = Response::parse(&block).into();
            }
            let progress = set.receive(&mut pair.axis);
            if !progress.is_pending() {
                break progress;
            }
        };
        // APOS.
        assert_eq!((ended, blocks, read), (want, 1, 0x07));
    }
}

/// A caller that goes on to call after the end: it stays as it was, and the command is not sent again, though the axis is free
/// for it. The answers to it never come; a position that was set is read back.
#[test]
fn what_has_ended_sends_nothing_more() {
    fn runs<T: PartialEq + Copy + core::fmt::Debug>(
        mode: ActiveCode,
        on: bool,
        (code, commands): (u8, u32),
        mut receive: impl FnMut(&mut Axis) -> Progress<T>,
    ) {
        let config = AxisConfig::new(MacId::new(9).unwrap(), mode, 500_000, limits());
        let mut pair = Pair::with(config, DriveConfig::new(MacId::new(9).unwrap(), CODES));
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        if on {
            pair.axis.switch_on().unwrap();
            pair.until("on", |pair| pair.axis.state() == AxisState::On);
        }
        let (mut sent, mut last, mut end) = (0, 0, None);
        for _ in 0..2_000 {
            pair.update();
            let response = *pair.received.response().unwrap();
            sent += u32::from(response.code.get() == code && last != code);
            last = response.code.get();
            if last == code {
                let mut block = response.emit();
                block[8] ^= 1;
                pair.received = Response::parse(&block).into();
            }
            let progress = receive(&mut pair.axis);
            end = end.or(Some(progress).filter(|progress| !progress.is_pending()));
            assert_eq!(end.unwrap_or(progress), progress);
        }
        assert!(end.is_some() && sent == commands, "{code:#x}: {end:?} after {sent} commands");
    }
    let mut home = Home::new(0xc8, 5);
    runs(ActiveCode::ProfilePosition, true, (0x14, 1), |axis| home.receive(axis));
    let mut set = SetPosition::actual(77_777);
    runs(ActiveCode::CyclicPosition, false, (0x24, 1), |axis| set.receive(axis));
    // The write, and the reading back.
    let list = [ParameterValue::new(Pr { class: 7, number: 25 }, 1)];
    let mut restore = Restore::new(CODES.parameter_read, &list);
    runs(ActiveCode::CyclicPosition, false, (0x26, 2), |axis| restore.receive(axis));
}

/// The latch counts once it is complete; what was caught before it was armed does not.
#[test]
fn latch_positions() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new().with_stale_answers(1));
    pair.drive.trigger(1);
    let mut latch = Latch::first(0xc7, Nibble::new(5).unwrap(), 300);
    for _ in 0..100 {
        pair.update();
        assert!(latch.receive(&mut pair.axis).is_pending());
    }
    for k in 1..=10 {
        pair.axis.set_position(k * 100).unwrap();
        pair.update();
        let _ = latch.receive(&mut pair.axis);
    }
    pair.until("at the position", |pair| pair.drive.position() == 1_000);
    pair.drive.trigger(1);
    pair.axis.set_position(2_000).unwrap();
    let first = Caught { latch1: Some(1_000), latch2: None };
    assert_eq!(pair.run(|axis| latch.receive(axis)), Progress::Done { value: first });
    let mut latch = Latch::first(0xc7, Nibble::new(5).unwrap(), 30);
    assert_eq!(pair.run(|axis| latch.receive(axis)), Progress::Failed { error: Failure::TimedOut });
    assert_eq!(latch.caught(), Caught::default());
    // An answer with another selection is an older one.
    pair.until("free", |pair| pair.axis.can_ask());
    pair.axis.ask(set_position(0x50, 0)).unwrap();
    for _ in 0..20 {
        pair.update();
        let response = *pair.received.response().unwrap();
        if let NonCyclicResponse::Homing {
            execution, type_code, latch, latch_sel2, monitor_sel, monitor_data, ..
        } = response.noncyclic()
        {
            let latch_sel1 = Nibble::new(7).unwrap();
            let other = NonCyclicResponse::Homing {
                execution,
                type_code,
                latch,
                latch_sel1,
                latch_sel2,
                monitor_sel,
                monitor_data,
            };
            pair.received = Heard::Main(response.with_noncyclic(&other));
        }
        assert_eq!(pair.axis.take_outcome(), None);
    }
    pair.update();
    assert!(matches!(pair.outcome(), Progress::Done { .. }));
}

/// Latch 2 alone, and both: each position comes with its own Latch_Comp, out of one Monitor_Sel.
#[test]
fn two_latches() {
    let nibble = |value| Nibble::new(value).unwrap();
    for late in [0, 4, 15] {
        let behaviour = Behaviour::new().with_latch_late(late).with_echo_lag(1);
        let mut pair = Pair::on(ActiveCode::CyclicPosition, behaviour);
        let mut both = Latch::both(0xc7, [nibble(3), nibble(12)], 600);
        let mut selections = Vec::new();
        for k in 0..400 {
            // Latch 2 catches first.
            match k {
                100 => pair.drive.trigger(2),
                200 => pair.drive.trigger(1),
                _ => {}
            }
            pair.axis.set_position(k * 10).unwrap();
            pair.update();
            if let Some(NonCyclicResponse::Homing { latch_sel1, latch_sel2, monitor_sel, .. }) =
                pair.received.response().map(Response::noncyclic)
            {
                selections.push((latch_sel1.get(), latch_sel2.get(), monitor_sel));
            }
            let at = |k: i32| pair.drive.position() / 10 >= k;
            match both.receive(&mut pair.axis) {
                Progress::Done { value: Caught { latch1: Some(one), latch2: Some(two) } } => {
                    assert!(at(200) && (1_900..2_000).contains(&one) && (900..1_000).contains(&two), "{one} {two}");
                    break;
                }
                Progress::Done { .. } | Progress::Failed { .. } => panic!("at {k}: {:?}", both.caught()),
                Progress::Pending { .. } => assert!(k < 300),
            }
        }
        assert!(selections.contains(&(3, 12, 0x09)) && selections.contains(&(3, 12, 0x0a)));
        // Both are complete now: nothing of that is taken for the next latch, however late the drive forgets it.
        let mut second = Latch::second(0xc7, nibble(7), 200);
        for _ in 0..100 {
            pair.update();
            assert!(second.receive(&mut pair.axis).is_pending());
        }
        pair.until("at rest", |pair| pair.drive.position() == pair.axis.setpoint());
        pair.drive.trigger(2);
        let caught = Caught { latch1: None, latch2: Some(pair.drive.position()) };
        assert_eq!(pair.run(|axis| second.receive(axis)), Progress::Done { value: caught });
    }
}

/// A drive that refuses to tell the state before it is armed.
#[test]
fn a_latch_without_a_state_before() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let mut latch = Latch::first(0xc7, Nibble::new(1).unwrap(), 300);
    let mut refuse = true;
    let mut triggered = false;
    for _ in 0..300 {
        pair.update();
        let response = *pair.received.response().unwrap();
        if let NonCyclicResponse::Homing { type_code, .. } = response.noncyclic() {
            if type_code == 0x50 && refuse {
                let refused = NonCyclicResponse::CommandError(ErrorCode(0x0031));
                pair.received = Heard::Main(response.with_noncyclic(&refused));
            }
            refuse &= type_code == 0x50;
        }
        // Not before the state was seen to be empty: a trigger at once could not be told from an old one.
        if !refuse && !triggered {
            (0..20).for_each(|_| {
                pair.update();
                let _ = latch.receive(&mut pair.axis);
            });
            pair.drive.trigger(1);
            triggered = true;
        }
        let progress = latch.receive(&mut pair.axis);
        if let Progress::Done { value } = progress {
            assert_eq!(value, Caught { latch1: Some(0), latch2: None });
            return;
        }
        assert!(progress.is_pending(), "{progress:?}");
    }
    panic!("not latched");
}

/// The answer to arming is about what was there before, even if it says that a position was caught.
#[test]
fn arming_catches_nothing() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let mut latch = Latch::first(0xc7, Nibble::new(1).unwrap(), 60);
    let mut armed = 0;
    loop {
        pair.update();
        let response = *pair.received.response().unwrap();
        if let NonCyclicResponse::Homing { execution, type_code: 0xc7, latch_sel1, latch_sel2, monitor_sel, .. } =
            response.noncyclic()
        {
            let (type_code, latch, monitor_data) = (0xc7, LatchFlags::LATCH_COMP1, 12_345);
            let caught = NonCyclicResponse::Homing {
                execution,
                type_code,
                latch,
                latch_sel1,
                latch_sel2,
                monitor_sel,
                monitor_data,
            };
            pair.received = Heard::Main(response.with_noncyclic(&caught));
            armed += 1;
        }
        let progress = latch.receive(&mut pair.axis);
        if !progress.is_pending() {
            assert_eq!(progress, Progress::Failed { error: Failure::TimedOut });
            break;
        }
    }
    assert!(armed > 0);
    assert_eq!(latch.caught(), Caught::default());
}

#[test]
fn a_motion_with_a_latch_shows_it() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    let _ = pair.ask(set_position(0xc7, 0));
    pair.until("free", |pair| pair.axis.can_ask());
    let selection = Nibble::new(3).unwrap();
    pair.axis.start_move_with_latch(0x11, 50_000, 4_000_000, selection, 0x09).unwrap();
    pair.until("half way", |pair| pair.drive.position() > 20_000);
    assert!(!pair.axis.profile().unwrap().flags().contains(ProfileFlags::LATCH_COMP1));
    pair.drive.trigger(1);
    let caught = pair.drive.position();
    pair.until("latched", |pair| pair.axis.profile().unwrap().flags().contains(ProfileFlags::LATCH_COMP1));
    assert_eq!(pair.axis.profile().unwrap().monitor_data(), caught);
    assert!(matches!(pair.end_of_move(), Progress::Done { .. }));
    assert_eq!(LatchFlags::LATCH_COMP1.bits(), 1);
}

#[test]
fn texts_and_parameters() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new().with_stale_answers(2).with_echo_lag(1));
    for (type_code, want) in [(0x01, &b"Panasonic"[..]), (0x05, b"1"), (0x12, b"DRIVE MODEL"), (0x13, b"00000000")] {
        let mut text = ReadText::new(TypeCode::short(type_code));
        let Progress::Done { value } = pair.run(|axis| text.receive(axis)) else { panic!() };
        assert_eq!(value.as_bytes(), want);
    }
    let pr = |class, number| Pr { class, number };
    let mut list = [pr(7, 25), pr(8, 1), pr(8, 4)].map(|pr| ParameterValue::new(pr, 0));
    let mut backup = Backup::new(CODES.parameter_read, &mut list);
    assert_eq!(pair.run(|axis| backup.receive(axis)), Progress::Done { value: () });
    assert_eq!(list.map(|parameter| parameter.value), [1, 1_000, 1_000]);
    list[1].value = 77;
    let mut restore = Restore::new(CODES.parameter_read, &list);
    assert_eq!(restore.place(), 0);
    assert_eq!(pair.run(|axis| restore.receive(axis)), Progress::Done { value: () });
    let mut again = list.map(|parameter| ParameterValue { value: -1, ..parameter });
    let mut backup = Backup::new(CODES.parameter_read, &mut again);
    assert_eq!(pair.run(|axis| backup.receive(axis)), Progress::Done { value: () });
    assert_eq!(again, list);
    // Read with the code for initial values it differs from what was written.
    let mut restore = Restore::new(CODES.parameter_initial, &list);
    let differs = Progress::Failed { error: Failure::Differs(pr(8, 1)) };
    assert_eq!(pair.run(|axis| restore.receive(axis)), differs);
    assert_eq!(restore.place(), 1);
    // Ten of class 7 (25, 29 to 37), two of class 8, none of class 9.
    for (class, want) in [(7, Some(10)), (8, Some(2)), (9, None)] {
        let index = pr(class, 0).index();
        let count = NonCyclicCommand::Parameter(Arguments { type_code: CODES.parameter_count, index, data: 0 });
        let counted = match pair.ask(count) {
            Progress::Done { value } => value.data(),
            _ => None,
        };
        assert_eq!(counted, want);
    }
    // A parameter that does not exist.
    let list = [ParameterValue::new(pr(99, 0), 0)];
    let mut restore = Restore::new(CODES.parameter_read, &list);
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x0032)) };
    assert_eq!(pair.run(|axis| restore.receive(axis)), refused);
}

/// A drive whose parameters count only after a reset.
#[test]
fn speed_in_r_min_after_a_reset() {
    let mut pair = Pair::new(ActiveCode::CyclicVelocity, Behaviour::new().with_quirks(Quirks::PARAMETERS_AFTER_RESET));
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    let write = Arguments { type_code: TypeCode::short(0x11), index: 0x0719, data: 0 };
    assert!(matches!(pair.ask(NonCyclicCommand::Parameter(write)), Progress::Done { .. }));
    let speed = |pair: &mut Pair| {
        pair.switch_on();
        pair.axis.set_rate(60_000).unwrap();
        (0..5).for_each(|_| pair.update());
        let from = pair.drive.position();
        pair.update();
        let by = pair.drive.position().wrapping_sub(from);
        let Some(NonCyclicResponse::Normal { response_data2, .. }) = pair.received.response().map(Response::noncyclic)
        else {
            panic!()
        };
        pair.axis.switch_off();
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        (by, response_data2)
    };
    // 60 000 command units a second are 30 in half a millisecond.
    assert_eq!(speed(&mut pair), (30, 60_000));
    let reset = NonCyclicCommand::Reset(Arguments { type_code: TypeCode::short(0x11), index: 0, data: 0 });
    assert!(matches!(pair.ask(reset), Progress::Done { .. }));
    // 60 000 r/min are 1 000 revolutions of 2^20 units a second: 524 288 in half a millisecond.
    assert_eq!(speed(&mut pair), (524_288, 60_000));
}

/// Response_Data2 and 3, and those of the sub block: Pr7.30 to 7.34 each select one of them, and no other.
#[test]
fn selected_response_data() {
    for place in 0..5 {
        let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
        pair.wide = true;
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        assert!(matches!(pair.ask(set_position(0x21, 4_321)), Progress::Done { .. }));
        let index = [0x071e, 0x071f, 0x0720, 0x0721, 0x0722][place];
        let write = Arguments { type_code: TypeCode::short(0x11), index, data: 0x07 };
        assert!(matches!(pair.ask(NonCyclicCommand::Parameter(write)), Progress::Done { .. }));
        (0..4).for_each(|_| pair.update());
        let Heard::Both(Response32 { main, sub }) = pair.received else { panic!() };
        let mut want = [0; 5];
        want[place] = 4_321;
        assert_eq!([main.response_data2, main.response_data3, sub.data1, sub.data2, sub.data3], want);
        assert_eq!(main.response_data1, 4_321);
    }
}

/// In the 32-byte mode sub-commands run beside requests of the main block.
#[test]
fn sub_commands() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.wide = true;
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.axis.ask(monitor(0x07)).unwrap();
    pair.axis.ask_sub(SubCode::SystemId, 0x01, 1).unwrap();
    assert_eq!(pair.axis.ask_sub(SubCode::Monitor, 0x07, 0), Err(AskError::Busy));
    let outcome = |pair: &mut Pair| {
        (0..80).find_map(|_| {
            pair.update();
            pair.axis.take_sub_outcome()
        })
    };
    let Some(Progress::Done { value }) = outcome(&mut pair) else { panic!() };
    assert_eq!((value.data1.to_le_bytes(), value.index), (*b"soni", 1));
    assert!(matches!(pair.outcome(), Progress::Done { .. }));
    (0..5).for_each(|_| pair.update());
    assert_eq!(pair.axis.ask_sub(SubCode::Normal, 0, 0), Err(AskError::NotARequest));
    pair.axis.ask_sub(SubCode::Monitor, 0xee, 0).unwrap();
    assert_eq!(outcome(&mut pair), Some(Progress::Failed { error: Failure::CommandError(ErrorCode(0x0031)) }));
    // A drive in the 16-byte mode never answers.
    (0..5).for_each(|_| pair.update());
    pair.wide = false;
    pair.axis.ask_sub(SubCode::Monitor, 0x07, 0).unwrap();
    assert_eq!(outcome(&mut pair), Some(Progress::Failed { error: Failure::TimedOut }));
}

/// Sub_Command_Data2 and 3 go out while the servo is on; the drive holds them by Pr7.36 and Pr7.37.
#[test]
fn feed_forward_of_the_sub_block() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.wide = true;
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    for (index, held) in [(0x0725, [0, -71]), (0x0724, [70, -71])] {
        let select = Arguments { type_code: TypeCode::short(0x11), index, data: 1 };
        assert!(matches!(pair.ask(NonCyclicCommand::Parameter(select)), Progress::Done { .. }));
        assert!(pair.axis.set_sub_feed_forward(1, 2).is_err());
        pair.switch_on();
        pair.axis.set_sub_feed_forward(70, -71).unwrap();
        // With a sub-command and without one.
        for _ in 0..2 {
            (0..9).for_each(|_| pair.update());
            assert_eq!(pair.drive.sub_feed_forward(), held);
            let _ = pair.axis.ask_sub(SubCode::Monitor, 0x07, 0);
        }
        pair.axis.switch_off();
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        assert_eq!(pair.drive.sub_feed_forward(), [0, 0]);
        pair.until("free", |pair| pair.axis.can_ask());
    }
}

/// A feed-forward is meant for the mode in which it was set.
#[test]
fn a_change_of_mode_ends_the_feed_forward() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    (0..9).for_each(|_| pair.update());
    let mut plain = pair.axis;
    pair.axis.set_feed_forward(7).unwrap();
    pair.axis.set_sub_feed_forward(70, -71).unwrap();
    assert_ne!(pair.axis.transmission(pair.sent), plain.transmission(pair.sent));
    for axis in [&mut pair.axis, &mut plain] {
        axis.set_mode(ActiveCode::CyclicVelocity).unwrap();
    }
    assert_eq!(pair.axis.transmission(pair.sent), plain.transmission(pair.sent));
}
