//! What a drive says may be about an older block: one that it has thrown away, a request before, a motion of something else.

use core::num::NonZeroU16;

use crate::common::{Pair, actual, limits, set_position};
use rtex_block::device::{Behaviour, Fault};
use rtex_block::master::procedure::Home;
use rtex_block::master::{
    ActiveCode, AskError, Axis, AxisConfig, AxisState, Failure, Heard, Limits, MoveStage, Progress, StopReason,
    SwitchOnError, Turn,
};
use rtex_block::{
    Alarm, Arguments, Doubt, ErrorClass, ErrorCode, MacId, NonCyclicCommand, Policy, Pr, Response, Response32,
    StatusFlags, SubCode, TypeCode, UpdateCounter,
};

fn mac_id() -> MacId {
    MacId::new(9).unwrap()
}

/// 0011h, 0012h and 0021h: the drive has thrown the block away and goes on with the one before, which asks for the same.
/// That is no answer to what is asked: it may be under way, or done.
#[test]
fn a_block_that_was_thrown_away_refuses_nothing() {
    assert!([0x11, 0x12, 0x21].into_iter().all(|code| ErrorCode(code).discards_block()));
    assert!([0x22, 0x2e, 0x31, 0x32, 0x34].into_iter().all(|code| !ErrorCode(code).discards_block()));
    // A motion of which one block is damaged at any time is made, and made once.
    for damaged in 0..15 {
        for bit in [0x01, 0x80] {
            let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
            let start = pair.actual();
            pair.axis.start_move(0x11, 5_000, 2_000_000).unwrap();
            let mut ended = None;
            for now in 0..200 {
                update_with(&mut pair, if now == damaged { bit } else { 0 });
                ended = ended.or(pair.axis.take_move().filter(|progress| !progress.is_pending()));
            }
            assert!(matches!(ended, Some(Progress::Done { .. })), "{damaged} {bit:x}: {ended:?}");
            assert_eq!(pair.actual(), start + 5_000, "{damaged} {bit:x}");
        }
    }
    // Sub_Chk = 0 in one block: the sub-command is asked for again.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.wide = true;
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    pair.axis.ask_sub(SubCode::Monitor, 0x07, 0).unwrap();
    let mut outcome = None;
    for now in 0..20 {
        pair.axis.hear(pair.sent, &pair.received, 0);
        pair.sent = pair.counter.next();
        let mut bytes = pair.axis.transmission(pair.sent).emit();
        bytes[16] ^= if now == 1 { 0x80 } else { 0 };
        pair.received = Response32::parse_strict(&pair.drive.hear(&bytes).unwrap()).into();
        outcome = outcome.or(pair.axis.take_sub_outcome());
    }
    assert!(matches!(outcome, Some(Progress::Done { .. })), "{outcome:?}");
}

/// An update period of which the command's first byte is damaged.
fn update_with(pair: &mut Pair, damage: u8) {
    pair.axis.hear(pair.sent, &pair.received, 0);
    pair.sent = pair.counter.next();
    let mut main = pair.axis.transmission(pair.sent).main.emit();
    main[0] ^= damage;
    pair.received = Response::parse_strict(&pair.drive.hear(&main).unwrap()).into();
}

/// One flip in the address of any block while the position is being set: it is set once, and said to be.
#[test]
fn a_damaged_block_does_not_spoil_a_request() {
    for damaged in 0..12 {
        for bit in [0x01, 0x80] {
            let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
            pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
            pair.axis.ask(set_position(0x21, 123_456)).unwrap();
            let mut outcome = None;
            for now in 0..40 {
                update_with(&mut pair, if now == damaged { bit } else { 0 });
                outcome = outcome.or(pair.axis.take_outcome());
            }
            assert!(matches!(outcome, Some(Progress::Done { .. })), "{damaged} {bit:x}: {outcome:?}");
            assert_eq!(pair.actual(), 123_456);
        }
    }
}

/// The echo of a request holds its index and not its data. A drive that has not echoed the normal command in between is still at
/// the request before, and a write of another value is not done by that.
#[test]
fn an_answer_that_lingers_is_not_that_of_the_next_request() {
    let limits = Limits::new(NonZeroU16::new(60).unwrap(), 4).with_ready(Some(100));
    let mut axis = Axis::new(AxisConfig::new(mac_id(), ActiveCode::CyclicPosition, 500_000, limits));
    let mut counter = UpdateCounter::ZERO;
    let mut hear = |axis: &mut Axis, code: u8| {
        counter = counter.next();
        let mut block = [0; 16];
        // Parameter write 011h of Pr5.03, or the normal command.
        let eight = if code == 0x26 { 0x11 } else { 0 };
        (block[0], block[1], block[2], block[8]) = (0x89 | counter.get() << 5, code, 0x40, eight);
        (block[10], block[11]) = if code == 0x26 { (3, 5) } else { (0, 0) };
        axis.hear(Turn::Valid(counter), &Response::parse(&block).into(), 0);
        axis.take_outcome()
    };
    let write = |data| NonCyclicCommand::Parameter(Arguments { type_code: TypeCode::short(0x11), index: 0x0503, data });
    (0..4).for_each(|_| _ = hear(&mut axis, 0x20));
    axis.ask(write(1)).unwrap();
    assert!(matches!(hear(&mut axis, 0x26), Some(Progress::Done { .. })));
    for _ in 0..6 {
        assert_eq!(hear(&mut axis, 0x26), None);
        assert_eq!(axis.ask(write(7)), Err(AskError::Busy));
    }
    // Four blocks in a row: an answer that is four periods old has the echo of a new one.
    for code in [0x20, 0x20, 0x20, 0x26, 0x20, 0x20, 0x20] {
        hear(&mut axis, code);
        assert_eq!(axis.ask(write(7)), Err(AskError::Busy));
    }
    hear(&mut axis, 0x20);
    axis.ask(write(7)).unwrap();
    assert!(matches!(hear(&mut axis, 0x26), Some(Progress::Done { .. })));
}

/// What the axis heard when that came.
fn answer(pair: &mut Pair, mut came: impl FnMut(&mut Axis) -> bool) -> Heard {
    loop {
        let received = pair.received;
        pair.update();
        if came(&mut pair.axis) {
            return received;
        }
    }
}

/// The axis hears this, and nothing of what it sends comes to the drive.
fn hears(pair: &mut Pair, received: Heard, periods: u32) {
    for _ in 0..periods {
        pair.axis.hear(pair.sent, &received, 0);
        pair.sent = pair.counter.next();
        let _ = pair.axis.transmission(pair.sent);
    }
}

/// The line fails for longer than a request is waited for, just after a write was answered: the drive has not seen the request go,
/// so to it the next one is still the same, and its old answer does not belong to the new one. Once it has seen the normal command, it
/// is asked again.
#[test]
fn an_answer_is_not_taken_twice() {
    let write = |data| {
        let index = Pr { class: 7, number: 25 }.index();
        NonCyclicCommand::Parameter(Arguments { type_code: TypeCode::short(0x11), index, data })
    };
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.axis.ask(write(1)).unwrap();
    let old = answer(&mut pair, |axis| axis.take_outcome().is_some());
    hears(&mut pair, Heard::Nothing, 100);
    assert_eq!(pair.axis.ask(write(0)), Err(AskError::Busy));
    hears(&mut pair, old, 70);
    assert_eq!((pair.axis.ask(write(0)), pair.axis.take_outcome()), (Err(AskError::Busy), None));
    pair.axis.clear();
    assert!(matches!(pair.ask(write(0)), Progress::Done { .. }));
    // A controller that starts anew meets what it has asked before.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    hears(&mut pair, old, 40);
    assert_eq!((pair.axis.ask(write(0)), pair.axis.take_outcome()), (Err(AskError::Busy), None));
}

/// The same of a sub-command.
#[test]
fn a_sub_answer_is_not_taken_twice() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.wide = true;
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.axis.ask_sub(SubCode::Monitor, 0x07, 0).unwrap();
    let old = answer(&mut pair, |axis| axis.take_sub_outcome().is_some());
    hears(&mut pair, Heard::Nothing, 100);
    hears(&mut pair, old, 80);
    assert_eq!(pair.axis.ask_sub(SubCode::Monitor, 0x07, 0), Err(AskError::Busy));
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    hears(&mut pair, old, 40);
    assert_eq!(pair.axis.ask_sub(SubCode::Monitor, 0x07, 0), Err(AskError::Busy));
    assert_eq!(pair.axis.take_sub_outcome(), None);
}

/// Homing_Complete of the last homing, and a motion of something else that ends: neither is the end of this homing.
#[test]
fn homing_begins_when_nothing_moves() {
    const COMPLETE: StatusFlags = StatusFlags::HOMING_COMPLETE;
    const MOVES: StatusFlags = StatusFlags::IN_PROGRESS;
    let config = AxisConfig::new(mac_id(), ActiveCode::ProfilePosition, 500_000, limits());
    let mut axis = Axis::new(config);
    let mut counter = UpdateCounter::ZERO;
    let mut hear = |axis: &mut Axis, code: u8, status: StatusFlags, eight: u8| {
        counter = counter.next();
        let active = if axis.state() == AxisState::On { StatusFlags::SERVO_ACTIVE } else { StatusFlags::empty() };
        let [low, high] = status.union(StatusFlags::SERVO_READY).union(active).bits().to_le_bytes();
        let mut block = [0; 16];
        (block[0], block[1], block[2], block[3], block[8]) = (0x89 | counter.get() << 5, code, low, high, eight);
        axis.hear(Turn::Valid(counter), &Response::parse(&block).into(), 0);
    };
    (0..5).for_each(|_| hear(&mut axis, 0x10, COMPLETE, 0));
    axis.switch_on().unwrap();
    hear(&mut axis, 0x10, COMPLETE.union(StatusFlags::SERVO_ACTIVE), 0);
    assert_eq!(axis.state(), AxisState::On);
    let mut home = Home::new(0xc8, 50);
    for _ in 0..5 {
        hear(&mut axis, 0x10, COMPLETE.union(MOVES), 0);
        assert!(home.receive(&mut axis).is_pending());
        assert!(axis.can_ask(), "asked while something moves");
    }
    // Four blocks without a motion: one that is four periods old could show it again.
    for _ in 0..4 {
        assert!(axis.can_ask(), "asked too early");
        hear(&mut axis, 0x10, COMPLETE, 0);
        assert!(home.receive(&mut axis).is_pending());
    }
    assert!(!axis.can_ask());
    for _ in 0..5 {
        hear(&mut axis, 0x14, COMPLETE, 0xc8);
        assert!(home.receive(&mut axis).is_pending(), "done by the flag of the homing before");
    }
    hear(&mut axis, 0x14, MOVES, 0xc8);
    assert!(home.receive(&mut axis).is_pending());
    // The end counts after a turn of the counter: an alarm may be shown later than it.
    for _ in 0..4 {
        hear(&mut axis, 0x14, COMPLETE, 0xc8);
        assert!(home.receive(&mut axis).is_pending());
    }
    hear(&mut axis, 0x14, COMPLETE, 0xc8);
    assert!(matches!(home.receive(&mut axis), Progress::Done { .. }));
}

/// A position is as old as its counter echo. What a drive sends again while its processing stands still is not new, nor is
/// what it said before its blocks were refused; and nobody switches a servo on by it.
#[test]
fn a_position_has_an_age() {
    let limits = Limits::new(NonZeroU16::new(9).unwrap(), 4).with_ready(Some(100));
    let mut axis = Axis::new(AxisConfig::new(mac_id(), ActiveCode::CyclicPosition, 500_000, limits));
    let block = |echo: u8, position: u8, status: u8| {
        let mut block = [0; 16];
        (block[0], block[1], block[2], block[4]) = (0x89 | echo << 5, 0x20, status, position);
        Heard::from(Response::parse(&block))
    };
    let mut sent = UpdateCounter::MAX;
    let mut hear = |axis: &mut Axis, heard, end_ns| {
        sent = sent.next();
        axis.hear(Turn::Valid(sent), &heard, end_ns);
    };
    let at = |axis: &Axis, now_ns, max_age_ns| {
        let sample = axis.evidence().at(now_ns, Policy::new(max_age_ns));
        sample.map(|sample| (sample.position(), sample.sampled_ns()))
    };
    assert_eq!(at(&axis, 0, u64::MAX), Err(Doubt::Never));
    hear(&mut axis, Heard::Nothing, 500);
    assert_eq!(at(&axis, 500, u64::MAX), Err(Doubt::Never));
    assert_eq!(axis.can_switch_on(), Err(SwitchOnError::State(AxisState::Starting)));
    // Servo_Ready, position 77.
    hear(&mut axis, block(1, 77, 0x40), 1_000);
    assert_eq!((at(&axis, 1_000, 0), axis.can_switch_on()), (Ok((77, 1_000)), Ok(())));
    // The clock makes it old, not the calls.
    assert_eq!(at(&axis, 1_700, 699), Err(Doubt::Old { age_ns: 700 }));
    // The same block again, none, one of another drive, and one that is no response.
    let mut other = [0; 16];
    other[0] = 0x8a;
    let unlike: [(Heard, Option<ErrorClass>); 4] = [
        (block(1, 77, 0x40), None),
        (Heard::Nothing, None),
        (Response::parse(&other).into(), Some(ErrorClass::MacId)),
        (Response::parse(&[0; 16]).into(), Some(ErrorClass::Direction)),
    ];
    for ((heard, class), age_ns) in unlike.into_iter().zip((500..).step_by(500)) {
        let now_ns = 1_000 + age_ns;
        hear(&mut axis, heard, now_ns);
        assert_eq!(at(&axis, now_ns, age_ns), Ok((77, 1_000)));
        let doubt = match class {
            Some(class) => Doubt::Refused { class, age_ns },
            None => Doubt::Old { age_ns },
        };
        assert_eq!(at(&axis, now_ns, age_ns - 1), Err(doubt));
        assert_eq!(axis.can_switch_on(), Err(SwitchOnError::OldPosition));
        assert_eq!(axis.switch_on(), Err(SwitchOnError::OldPosition));
    }
    hear(&mut axis, block(2, 78, 0x40), 3_500);
    assert_eq!((at(&axis, 3_500, 0), axis.can_switch_on()), (Ok((78, 3_500)), Ok(())));
    // An alarm.
    hear(&mut axis, block(3, 79, 0x60), 4_000);
    assert_eq!(at(&axis, 4_000, 0), Err(Doubt::Alarm));
    assert_eq!(axis.switch_on(), Err(SwitchOnError::State(AxisState::Stopped(StopReason::Alarm))));
    assert_eq!(actual(&axis), 79);
}

/// Each reason for which a servo stays off.
#[test]
fn a_servo_that_is_not_switched_on_says_why() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    assert_eq!(pair.axis.switch_on(), Err(SwitchOnError::State(AxisState::Starting)));
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    pair.axis.ask(set_position(0x21, 5)).unwrap();
    assert_eq!(pair.axis.switch_on(), Err(SwitchOnError::Busy));
    let answered = pair.outcome();
    assert!(matches!(answered, Progress::Done { .. }), "{answered:?}");
    pair.until("free", |pair| pair.axis.can_ask());
    assert_eq!(pair.axis.switch_on(), Ok(()));
    assert_eq!(pair.axis.switch_on(), Err(SwitchOnError::State(AxisState::SwitchingOn)));
}

/// Up to four blocks in a row that are each as old as a turn of the counter, while a motion begins that the drive was slow to show: they
/// look new and say that nothing moves, and are not its end.
#[test]
fn blocks_of_a_turn_ago_do_not_end_a_motion() {
    for (late, old) in [0, 1, 2, 4, 9].into_iter().flat_map(|late| (1..=4).map(move |old| (late, old))) {
        for from in 0..20 {
            let behaviour = Behaviour::new().with_in_progress_late(late);
            let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
            pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
            let (mut heard, mut ended) = (Vec::new(), None);
            for now in 0..1_000 {
                pair.update();
                ended = pair.axis.take_move().filter(|progress| !progress.is_pending());
                if ended.is_some() {
                    break;
                }
                heard.push(pair.received);
                if now >= 4 && (from..from + old).contains(&(now - 4)) {
                    pair.received = heard[now - 4];
                }
            }
            assert!(matches!(ended, Some(Progress::Done { .. })), "{late} {old} {from}: {ended:?}");
            let at = pair.drive.position();
            assert!((at - 20_000).abs() < 400, "{late} {old} {from}: at {at}");
        }
    }
}

/// The servo goes off because the power fails: the axis is off for one period with a drive that is not ready, and says that rather than
/// that it waits for the turn of the counter.
#[test]
fn a_drive_that_is_not_ready_is_not_switched_on() {
    for fault in [Fault::NoMainPower, Fault::EmergencyStop] {
        let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
        pair.axis.switch_off();
        pair.drive.set_fault(fault);
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        assert_eq!(pair.axis.switch_on(), Err(SwitchOnError::NotReady), "{fault}");
        pair.update();
        assert_eq!(pair.axis.switch_on(), Err(SwitchOnError::State(AxisState::Starting)), "{fault}");
    }
}

/// A motion is not done before the axis has stayed on for a turn of the counter after it, so an alarm in that time is its end.
#[test]
fn an_alarm_right_after_a_motion_is_its_end() {
    let ended = || {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
        pair.axis.start_move(0x11, 20_000, 1_000_000).unwrap();
        pair.until("ended", |pair| pair.axis.profile().is_some_and(|motion| motion.stage() == MoveStage::Ended));
        pair
    };
    let mut pair = ended();
    let mut waited = 0;
    while pair.axis.take_move().unwrap().is_pending() {
        waited += 1;
        pair.update();
    }
    assert!((4..=6).contains(&waited), "{waited}");
    for periods in 0..waited - 1 {
        let mut pair = ended();
        (0..periods).for_each(|_| pair.update());
        pair.drive.set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
        let failed = Progress::Failed { error: Failure::Stopped(StopReason::Alarm) };
        assert_eq!(pair.end_of_move(), failed, "{periods}");
    }
}
