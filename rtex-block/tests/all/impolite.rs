//! The master against a drive that is late, forgetful and literal, in every combination of its behaviour.

use crate::common::{CODES, LIMIT, Pair, actual, limits, monitor, set_position};
use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, Quirks};
use rtex_block::master::procedure::{Caught, Home, Latch};
use rtex_block::master::{
    ActiveCode, AskError, AxisConfig, AxisState, CommandEnded, Failure, Heard, MoveStage, Progress, StopCategory,
    StopReason,
};
use rtex_block::{
    Alarm, Arguments, Code, ErrorClass, ErrorCode, MacId, Nibble, NonCyclicCommand, NonCyclicResponse, Response,
    StatusFlags, TypeCode,
};

/// Every switch on or off, and every flag late or not: 2 to the power of 13.
fn all_behaviours() -> impl Iterator<Item = Behaviour> {
    (0..1_u16 << 13).map(|bits| {
        let on = |k: u16| bits >> k & 1 == 1;
        let some = |k, n: u16| if on(k) { n } else { 0 };
        Behaviour::new()
            .with_echo_lag(if on(0) { 3 } else { 0 })
            .with_in_progress_late(some(1, 9))
            .with_servo_off_late(some(2, 7))
            .with_stale_answers(some(3, 2))
            .with_quirks(Quirks::from_bits_retain(bits >> 4 & 0x7f))
            .with_status_late(if on(11) { [5, 2, 7, 3, 4, 1, 6, 2] } else { [0; 8] })
            .with_latch_late(if on(12) { 6 } else { 0 })
    })
}

/// Servo on, a cyclic move, a latch, a monitor value, a profile motion, homing, servo off, an alarm.
fn a_day_of_work(behaviour: Behaviour) {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits().with_inactive(40));
    let mut pair = Pair::with(config, DriveConfig::new(mac_id, CODES));
    pair.drive.set_behaviour(behaviour);
    pair.switch_on();
    assert_eq!(pair.axis.setpoint(), 0, "{behaviour:?}");
    for k in 1..=20 {
        pair.axis.set_position(k * 50).unwrap();
        pair.update();
    }
    pair.until("at the position", |pair| pair.drive.position() == 1_000);

    let mut latch = Latch::second(0xc7, Nibble::new(2).unwrap(), 400);
    (0..40).for_each(|_| {
        pair.update();
        assert!(latch.receive(&mut pair.axis).is_pending(), "{behaviour:?}");
    });
    pair.drive.trigger(2);
    let caught = Caught { latch1: None, latch2: Some(1_000) };
    assert_eq!(pair.run(|axis| latch.receive(axis)), Progress::Done { value: caught }, "{behaviour:?}");

    let Progress::Done { value } = pair.ask(monitor(0x07)) else { panic!("{behaviour:?}") };
    assert_eq!(value.data(), Some(1_000), "{behaviour:?}");
    let failed = pair.ask(monitor(0xee));
    assert_eq!(failed, Progress::Failed { error: Failure::CommandError(ErrorCode(0x0031)) }, "{behaviour:?}");

    pair.until("free", |pair| pair.axis.can_ask());
    pair.axis.set_mode(ActiveCode::ProfilePosition).unwrap();
    pair.axis.start_move(0x11, 3_000, 2_000_000).unwrap();
    let ended = pair.end_of_move();
    assert!(matches!(ended, Progress::Done { .. }), "{behaviour:?}: {ended:?}");
    assert!((pair.drive.position() - 4_000).abs() < 400, "{behaviour:?}: at {}", pair.drive.position());
    pair.until("at the target", |pair| pair.drive.position() == 4_000);
    let mut home = Home::new(0xc8, 1_000);
    assert_eq!(pair.run(|axis| home.receive(axis)), Progress::Done { value: () }, "{behaviour:?}");
    pair.until("at the origin", |pair| pair.drive.position() == 0);

    pair.axis.switch_off();
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    assert!(!pair.drive.is_active());
    assert_eq!(pair.drive.alarm(), None, "{behaviour:?}");
    pair.until("free", |pair| pair.axis.can_ask());
    pair.switch_on();
    pair.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
    let from = pair.now;
    pair.until("stopped", |pair| matches!(pair.axis.state(), AxisState::Stopped(_)));
    // As late as the first of the flags that show it, and the echo lag.
    assert!(pair.now - from <= 2 + 6 + 3, "{behaviour:?}");
}

#[test]
fn every_combination_of_behaviour() {
    // An opt-level of 1 takes every fifth; release all of them.
    let step = if cfg!(debug_assertions) { 5 } else { 1 };
    all_behaviours().step_by(step).for_each(a_day_of_work);
}

/// Each flag of byte 2 late by itself, by any number of exchanges.
#[test]
fn every_flag_late_by_itself() {
    for flag in 0..8 {
        for late in 1..=15 {
            let mut status_late = [0; 8];
            status_late[flag] = late;
            let behaviour = Behaviour::new().with_status_late(status_late);
            let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
            pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
            let ended = pair.end_of_move();
            assert!(matches!(ended, Progress::Done { .. }), "{flag} {late}: {ended:?}");
            assert!((pair.drive.position() - 20_000).abs() < 400, "{flag} {late}: at {}", pair.drive.position());
            // The flag is seen exactly as much later as it is late: the drive's alarm, readiness and activity at servo-off.
            pair.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
            let from = pair.now;
            pair.until("stopped", |pair| matches!(pair.axis.state(), AxisState::Stopped(_)));
            let first = (0..3).map(|k| status_late[7 - k]).min().unwrap();
            assert_eq!(pair.now - from, 2 + u32::from(first), "{flag} {late}");
            (0..20).for_each(|_| pair.update());
            let status = pair.axis.status();
            assert!(status.contains(StatusFlags::ALARM) && !status.contains(StatusFlags::SERVO_READY));
        }
    }
}

/// A motion is not done before it has started, however late In_Progress comes, and its end is not the arrival.
#[test]
fn a_motion_that_starts_late_is_not_done_early() {
    for late in [0, 1, 5, 30] {
        let behaviour = Behaviour::new().with_in_progress_late(late).with_quirks(Quirks::ALWAYS_IN_POSITION);
        let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
        pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
        let mut started = None;
        let ended = pair.run(|axis| {
            if axis.profile().unwrap().stage() == MoveStage::Moving {
                started = Some(actual(axis));
            }
            axis.take_move().unwrap()
        });
        assert!(matches!(ended, Progress::Done { value: CommandEnded { in_position: true, warning: false } }));
        assert!(started.is_some());
        pair.until("at the target", |pair| pair.drive.position() == 20_000);
    }
    // Without the start the motion fails at its limit; one of no length may do so too.
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new().with_in_progress_late(u16::MAX));
    pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
    let from = pair.now;
    assert_eq!(pair.end_of_move(), Progress::Failed { error: Failure::NotStarted });
    assert!((60..65).contains(&(pair.now - from)), "{}", pair.now - from);
    // An unknown type is refused at the start.
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move(0xee, 20_000, 1_000_000).unwrap();
    assert_eq!(pair.end_of_move(), Progress::Failed { error: Failure::CommandError(ErrorCode(0x0031)) });
    // The drive never echoes 10h, so the motion never begins.
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
    for _ in 0..70 {
        if let Heard::Main(response) = &mut pair.received {
            response.code = Code::truncate(0x1a);
        }
        pair.update();
    }
    assert_eq!(pair.axis.take_move(), Some(Progress::Failed { error: Failure::TimedOut }));
}

/// Sets bits of byte 9 in the answer to 17h that the master hears next; returns whether there is one.
fn mark_start(pair: &mut Pair, bits: i32) -> bool {
    match &mut pair.received {
        Heard::Main(response) if response.code == Code::PROFILE_START => {
            response.response_data2 |= bits << 8;
            true
        }
        _ => false,
    }
}

/// Busy while the drive takes the command, for some answers, and In_Progress only up to a turn of the counter later: what lies between is
/// not the end of the motion.
#[test]
fn busy_that_falls_before_in_progress_rises() {
    for busy in 1..=6_u16 {
        for late in busy..=busy + 4 {
            let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new().with_in_progress_late(late));
            pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
            let (mut answers, mut ended) = (0, None);
            for _ in 0..1_000 {
                pair.update();
                ended = pair.axis.take_move().filter(|progress| !progress.is_pending());
                if ended.is_some() {
                    break;
                }
                answers += u16::from(mark_start(&mut pair, if answers < busy { 0x10 } else { 0 }));
            }
            assert!(matches!(ended, Some(Progress::Done { .. })), "{busy} {late}: {ended:?}");
            assert!((pair.drive.position() - 20_000).abs() < 400, "{busy} {late}: at {}", pair.drive.position());
        }
    }
}

/// A stop of category 2 while a motion begins: whatever the drive says to the motion that it breaks off, or if it does not begin, the
/// stop is the reason for its end.
#[test]
fn the_end_of_a_motion_that_a_stop_breaks_off() {
    let stopped = Progress::Failed { error: Failure::Stopped(StopReason::Requested) };
    for (late, marked) in [(u16::MAX, 0), (0, 0x80), (0, 0x90)] {
        let behaviour = Behaviour::new().with_in_progress_late(late);
        let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
        pair.axis.start_move(0x11, 200_000, 1_000_000).unwrap();
        pair.until("sent", |pair| pair.axis.profile().unwrap().stage() != MoveStage::Preparing);
        pair.axis.stop(StopCategory::Two);
        let mut ended = None;
        for _ in 0..200 {
            pair.update();
            ended = pair.axis.take_move().filter(|progress| !progress.is_pending());
            if ended.is_some() {
                break;
            }
            mark_start(&mut pair, marked);
        }
        assert_eq!(ended, Some(stopped), "{late} {marked:x}");
    }
}

/// ERR counts with Busy or without, and a request that is only busy goes on to its limit.
#[test]
fn err_and_busy_in_either_order() {
    for behaviour in [Behaviour::new(), Behaviour::new().with_quirks(Quirks::ALWAYS_BUSY | Quirks::ERR_WHILE_BUSY)] {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
        // Homing of an unknown kind is refused; the drive's own one fails in no state but on.
        pair.axis.switch_off();
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        assert_eq!(pair.ask(set_position(0xc8, 0)), Progress::Failed { error: Failure::Execution });
    }
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.drive = Drive::new(pair.drive.config().with_busy_exchanges(u16::MAX));
    pair.drive.set_behaviour(Behaviour::new().with_quirks(Quirks::ALWAYS_BUSY));
    pair.axis.ask(monitor(7)).unwrap();
    assert_eq!(pair.outcome(), Progress::Failed { error: Failure::TimedOut });
}

/// A position is set with the servo off only, and the servo is not switched on before the drive has answered.
#[test]
fn setting_a_position() {
    for behaviour in [Behaviour::new(), Behaviour::new().with_quirks(Quirks::SETS_POSITION_WHILE_ON)] {
        for type_code in [0x21, 0x22] {
            let mut pair = Pair::on(ActiveCode::CyclicPosition, behaviour);
            assert_eq!(pair.axis.ask(set_position(type_code, 9_000)), Err(AskError::ServoOn));
            pair.axis.switch_off();
            assert_eq!(pair.axis.ask(set_position(type_code, 9_000)), Err(AskError::ServoOn));
            pair.until("off", |pair| pair.axis.state() == AxisState::Off);
            pair.axis.ask(set_position(type_code, 9_000)).unwrap();
            assert!(pair.axis.switch_on().is_err());
            assert!(matches!(pair.outcome(), Progress::Done { .. }));
            pair.switch_on();
            assert_eq!((pair.axis.setpoint(), pair.drive.position()), (9_000, 9_000));
            (0..50).for_each(|_| pair.update());
            assert_eq!((pair.drive.alarm(), pair.drive.position()), (None, 9_000));
        }
    }
    for type_code in [0x01, 0x11] {
        let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
        let reset = NonCyclicCommand::Reset(Arguments { type_code: TypeCode::short(type_code), index: 0, data: 0 });
        assert_eq!(pair.axis.ask(reset), Err(AskError::ServoOn));
    }
}

/// A homing type whose meaning is not known may give the axis new coordinates: in CP it is not sent with the servo on, nor is
/// the servo switched on meanwhile. A latch leaves them alone.
#[test]
fn homing_types_that_are_not_known() {
    use ActiveCode::{CyclicPosition, CyclicTorque, CyclicVelocity, ProfilePosition};
    let homing = |type_code: u8| (type_code, set_position(type_code, 0));
    for mode in [CyclicPosition, ProfilePosition, CyclicVelocity, CyclicTorque] {
        let in_position = mode == CyclicPosition;
        for (type_code, request) in [homing(0x31), homing(0xc8), homing(0x50)] {
            let refused = in_position && type_code != 0x50;
            let mut pair = Pair::on(mode, Behaviour::new());
            let before = pair.axis;
            assert_eq!(pair.axis.ask(request).err(), refused.then_some(AskError::ServoOn), "{mode:?} {type_code:x}");
            assert_eq!(pair.axis == before, refused);
            pair.axis = before;
            pair.axis.ask_latch(type_code, [Nibble::ZERO; 2], 0x09).unwrap();
            let mut pair = Pair::new(mode, Behaviour::new());
            pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
            let before = pair.axis;
            pair.axis.ask(request).unwrap();
            assert_eq!(pair.axis.switch_on().is_err(), refused, "{mode:?} {type_code:x}");
            pair.axis = before;
            pair.axis.ask_latch(type_code, [Nibble::ZERO; 2], 0x09).unwrap();
            pair.axis.switch_on().unwrap();
        }
        for type_code in [0x21, 0x22] {
            let mut pair = Pair::on(mode, Behaviour::new());
            assert_eq!(pair.axis.ask_latch(type_code, [Nibble::ZERO; 2], 0), Err(AskError::ServoOn));
            assert_eq!(pair.axis.ask(set_position(type_code, 0)), Err(AskError::ServoOn));
        }
    }
}

/// Servo_Active that falls by itself, that stays after servo-off, and that comes unasked.
#[test]
fn servo_active_that_does_as_it_likes() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    pair.drive.set_fault(Fault::ServoDrop);
    pair.until("stopped", |pair| pair.axis.state() == AxisState::Stopped(StopReason::NotActive));
    assert!(!pair.axis.disobeys());
    // Late, within the limit and beyond it.
    for (late, state) in [(10, AxisState::Off), (40, AxisState::Stopped(StopReason::InactiveTimeout))] {
        let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new().with_servo_off_late(late));
        pair.axis.switch_off();
        let from = pair.now;
        pair.until("over", |pair| pair.axis.state() != AxisState::SwitchingOff);
        assert_eq!(pair.axis.state(), state);
        assert!(pair.now - from <= 14, "{}", pair.now - from);
        (0..5).for_each(|_| pair.update());
        assert_eq!(pair.axis.disobeys(), late == 40);
    }
    // Stopped for another reason, the drive stays active: that is reported beside the reason.
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new().with_servo_off_late(100));
    pair.axis.stop(StopCategory::Zero);
    (0..12).for_each(|_| pair.update());
    assert!(!pair.axis.disobeys());
    (0..4).for_each(|_| pair.update());
    assert_eq!((pair.axis.disobeys(), pair.axis.state()), (true, AxisState::Stopped(StopReason::Requested)));
    pair.axis.clear();
    assert!(!pair.axis.disobeys());
}

/// The alarm stops the axis in every state, and in `Off` it does not stay ready.
#[test]
fn an_alarm_in_every_state() {
    let alarm = Alarm { main: 16, sub: 0 };
    let stopped = AxisState::Stopped(StopReason::Alarm);
    for state in 0..4 {
        let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new().with_servo_off_late(8));
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        if state > 0 {
            pair.axis.switch_on().unwrap();
            (0..3).for_each(|_| pair.update());
            assert_eq!(pair.axis.state(), AxisState::SwitchingOn);
        }
        if state > 1 {
            pair.until("on", |pair| pair.axis.state() == AxisState::On);
        }
        if state > 2 {
            pair.axis.switch_off();
            (0..3).for_each(|_| pair.update());
            assert_eq!(pair.axis.state(), AxisState::SwitchingOff);
        }
        pair.drive.set_fault(Fault::Alarm(alarm));
        (0..3).for_each(|_| pair.update());
        assert_eq!(pair.axis.state(), stopped);
        assert!(pair.axis.switch_on().is_err());
    }
    // At start-up it is the reason why Servo_Ready did not come.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.drive.set_fault(Fault::Alarm(alarm));
    pair.until("stopped", |pair| pair.axis.state() != AxisState::Starting);
    assert_eq!(pair.axis.state(), stopped);
    // Main power that goes while the servo is off is no failure: the axis waits for it.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.drive.set_fault(Fault::NoMainPower);
    (0..3).for_each(|_| pair.update());
    assert_eq!((pair.axis.state(), pair.axis.switch_on().is_err()), (AxisState::Starting, true));
    pair.drive.set_fault(Fault::None);
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
}

/// CMD_Error counts during a motion as anywhere else; a single one does not end the motion.
#[test]
fn cmd_error_during_a_motion() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move(0x11, 1_000_000, 1_000_000).unwrap();
    pair.until("moving", |pair| pair.axis.profile().unwrap().stage() == MoveStage::Moving);
    let spoil = |pair: &mut Pair| {
        pair.update();
        let response = *pair.received.response().unwrap();
        pair.received = Heard::Main(response.with_noncyclic(&NonCyclicResponse::CommandError(ErrorCode(0x0021))));
    };
    for _ in 0..3 {
        for _ in 1..LIMIT {
            spoil(&mut pair);
        }
        pair.update();
        assert_eq!((pair.axis.state(), pair.axis.profile().unwrap().stage()), (AxisState::On, MoveStage::Moving));
        pair.update();
    }
    for _ in 0..LIMIT {
        assert_eq!(pair.axis.state(), AxisState::On);
        spoil(&mut pair);
    }
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::CommandError(ErrorCode(0x0021))));
    assert_eq!(
        pair.axis.take_move(),
        Some(Progress::Failed { error: Failure::Stopped(StopReason::CommandError(ErrorCode(0x0021))) })
    );
}

/// Blocks of another drive in this one's place are named, and so is a memory that holds no responses.
#[test]
fn why_the_echo_stands_still() {
    type Spoil = fn(&mut Heard);
    let cases: [(Spoil, StopReason); 3] = [
        (|r| *r = Heard::Nothing, StopReason::EchoTimeout),
        (
            |r| {
                if let Heard::Main(response) = r {
                    response.mac_id = MacId::new(3).unwrap();
                }
            },
            StopReason::WrongMacId(MacId::truncate(3)),
        ),
        (|r| *r = Response::parse(&[0; 16]).into(), StopReason::Refused(ErrorClass::Direction)),
    ];
    for (spoil, reason) in cases {
        let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
        for _ in 0..LIMIT {
            pair.update();
            assert_eq!(pair.axis.state(), AxisState::On);
            spoil(&mut pair.received);
        }
        pair.update();
        assert_eq!(pair.axis.state(), AxisState::Stopped(reason));
        let counters = pair.axis.counters();
        assert_eq!(counters.errors(), if reason == StopReason::EchoTimeout { 0 } else { LIMIT.into() });
        assert!(counters.good() > 20);
        // Good blocks again, and after the clearing the axis starts anew.
        pair.axis.clear();
        pair.switch_on();
    }
}
