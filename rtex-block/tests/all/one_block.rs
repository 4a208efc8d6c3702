//! What a single call or a single block changes, with responses that are made by hand.

use crate::common::{CODES, LIMIT, Pair, limits, monitor};
use rtex_block::device::{Behaviour, DriveConfig};
use rtex_block::master::procedure::{ClearAlarm, Clearing, Home};
use rtex_block::master::{
    ActiveCode, Arrival, AxisConfig, AxisState, Failure, Heard, MoveStage, ProfileMove, Progress, SetpointError,
    StopCategory, StopReason, SwitchOnError, Turn,
};
use rtex_block::{ErrorClass, ErrorCode, MacId, Nibble, NonCyclicCommand, Policy, Response, StatusFlags, SubCode};

/// An axis whose servo is off and could be switched on.
fn off() -> Pair {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    pair
}

/// A period whose response is changed by hand.
fn update(pair: &mut Pair, change: impl FnOnce(&mut Response)) {
    pair.update();
    let Heard::Main(response) = &mut pair.received else { panic!("{:?}", pair.received) };
    change(response);
}

fn refuse(response: &mut Response) {
    // 0021h: the cyclic code is not defined.
    (response.cmd_error, response.response_data2, response.response_data3) = (true, 0x21, 0);
}

fn is_active(response: &mut Response) {
    response.status |= StatusFlags::SERVO_ACTIVE;
}

/// Periods until the axis has stopped, with this done to each response; the axis takes it a period later.
fn periods_until_stopped(pair: &mut Pair, change: impl Fn(&mut Response)) -> (u32, StopReason) {
    for periods in 0.. {
        if let AxisState::Stopped(reason) = pair.axis.state() {
            return (periods, reason);
        }
        update(pair, &change);
    }
    unreachable!()
}

/// After a stop was cleared its cause is counted from the beginning: each time as many blocks are needed.
#[test]
fn clear_forgets_what_was_counted() {
    let mut pair = off();
    update(&mut pair, refuse);
    for _ in 0..3 {
        assert_eq!(periods_until_stopped(&mut pair, refuse), (LIMIT.into(), StopReason::CommandError(ErrorCode(0x21))));
        pair.axis.clear();
    }
    // A motor that is on while the servo is off, for more than 12 blocks.
    let mut pair = off();
    update(&mut pair, is_active);
    for _ in 0..3 {
        assert_eq!(periods_until_stopped(&mut pair, is_active), (13, StopReason::InactiveTimeout));
        pair.axis.clear();
    }
}

/// After a stop for refused blocks was cleared, silence is silence.
#[test]
fn clear_forgets_what_was_refused() {
    let mut pair = off();
    let stopped = |pair: &mut Pair, heard: Heard| {
        for _ in 0..20 {
            pair.update();
            pair.received = heard;
        }
        pair.axis.state()
    };
    let refused = Response::parse(&[0; 16]).into();
    assert_eq!(stopped(&mut pair, refused), AxisState::Stopped(StopReason::Refused(ErrorClass::Direction)));
    pair.axis.clear();
    pair.received = Heard::Nothing;
    assert_eq!(stopped(&mut pair, Heard::Nothing), AxisState::Stopped(StopReason::EchoTimeout));
}

/// A motor that was on for a block may be so again: the servo can be switched on after a turn of the counter and one more block.
#[test]
fn activity_of_one_block_begins_the_count_anew() {
    let mut pair = off();
    update(&mut pair, is_active);
    let can: Vec<_> = (0..6)
        .map(|_| {
            pair.update();
            pair.axis.can_switch_on()
        })
        .collect();
    assert_eq!(can, [&[Err(SwitchOnError::Busy); 5][..], &[Ok(())]].concat());
}

/// Invalid data: nothing is known to be on time, and the set-point is where the motor is.
#[test]
fn invalid_data_bring_a_position_and_no_time() {
    let mut pair = off();
    assert_eq!(pair.axis.arrival(), Arrival::OnTime);
    let response = Response { response_data1: 777, ..*pair.received.response().unwrap() };
    pair.axis.hear(Turn::Invalid, &Heard::Main(response), pair.now_ns());
    assert_eq!((pair.axis.arrival(), pair.axis.setpoint()), (Arrival::Missing, 777));
    // As old as can be.
    let known = [0, 1].map(|now_ns| pair.axis.evidence().at(now_ns, Policy::new(0)).is_ok());
    assert_eq!(known, [true, false]);
    assert_eq!(pair.axis.can_switch_on(), Err(SwitchOnError::OldPosition));
}

/// A new axis sends nothing but zeros, and has counted nothing: refusals and activity stop it only when there were enough of them.
#[test]
fn a_new_axis_begins_with_nothing() {
    let new = || Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    let mut axis = new().axis;
    assert_eq!(axis.setpoint(), 0);
    assert_eq!(axis.transmission(Turn::Invalid).emit(), [&[9; 1][..], &[0; 15], &[0x80], &[0; 15]].concat()[..]);
    assert_eq!(axis.transmission(Turn::Valid(new().counter.last().next())).main.command_data1, 0);
    let refused = StopReason::CommandError(ErrorCode(0x21));
    for (change, want, most) in
        [(refuse as fn(&mut Response), refused, LIMIT), (is_active, StopReason::InactiveTimeout, 13)]
    {
        let (mut pair, mut blocks) = (new(), 0);
        while pair.axis.state() == AxisState::Starting {
            update(&mut pair, change);
            blocks += u16::from(pair.axis.arrival() == Arrival::OnTime);
        }
        assert_eq!((pair.axis.state(), blocks), (AxisState::Stopped(want), most));
    }
}

/// A motion for which nothing is said of latch and monitor has neither.
#[test]
fn a_plain_motion_has_no_latch() {
    let mut axis = Pair::on(ActiveCode::ProfilePosition, Behaviour::new()).axis;
    axis.start_move(0x11, 500, 1_000).unwrap();
    let plain = ProfileMove::new(axis.config().mac_id, 0x11, 500, 1_000, axis.config().limits.answer);
    assert_eq!(plain, plain.with_latch(Nibble::ZERO, 0));
    // There is no answer yet.
    assert_eq!(plain.monitor_data(), 0);
    let mut other = Pair::on(ActiveCode::ProfilePosition, Behaviour::new()).axis;
    other.start_move_with_latch(0x11, 500, 1_000, Nibble::ZERO, 0).unwrap();
    assert_eq!(axis.profile(), other.profile());
}

/// The smaller of the limits by gear and by speed.
#[test]
fn a_fast_over_speed_is_no_limit() {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits());
    let max_step = |level| Pair::with(config.with_over_speed(level), DriveConfig::new(mac_id, CODES)).axis.max_step();
    // 400 M units a second are 200,000 in 0.5 ms.
    assert_eq!([None, Some(1_000_000_000), Some(100_000_000)].map(max_step), [200_000, 200_000, 50_000]);
}

/// The mode that there is already: set-point and feed-forward stay, also while the axis moves.
#[test]
fn the_same_mode_changes_nothing() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    pair.axis.set_position(500).unwrap();
    pair.update();
    pair.axis.set_position(1_000).unwrap();
    pair.axis.set_feed_forward(5).unwrap();
    assert_eq!(pair.axis.set_mode(ActiveCode::CyclicPosition), Ok(()));
    let command = pair.axis.transmission(Turn::Valid(pair.counter.last().next())).main;
    assert_eq!(command.command_data1, 1_000);
    assert_eq!(command.noncyclic, NonCyclicCommand::Normal { command_data2: 0, command_data3: 5 });
}

/// CP begins at the position of the period in which it is sent first, not at that of the call.
#[test]
fn positions_begin_at_the_newest_one() {
    let mut pair = Pair::on(ActiveCode::CyclicVelocity, Behaviour::new());
    update(&mut pair, |response| response.response_data1 = 100);
    update(&mut pair, |response| response.response_data1 = 140);
    pair.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
    assert_eq!(pair.axis.setpoint(), 100);
    pair.update();
    assert_eq!((pair.axis.mode(), pair.axis.setpoint()), (ActiveCode::CyclicPosition, 140));
}

/// Feed-forward of the sub block leaves that of the main block alone.
#[test]
fn feed_forwards_are_three() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    pair.axis.set_feed_forward(5).unwrap();
    pair.axis.set_sub_feed_forward(6, 7).unwrap();
    let command = pair.axis.transmission(Turn::Valid(pair.counter.last().next()));
    assert_eq!(command.main.noncyclic, NonCyclicCommand::Normal { command_data2: 0, command_data3: 5 });
    assert_eq!((command.sub.data2, command.sub.data3), (6, 7));
}

/// What needs the servo, or another mode, is refused.
#[test]
fn set_points_need_the_servo_and_their_mode() {
    for mode in [ActiveCode::CyclicPosition, ActiveCode::CyclicVelocity, ActiveCode::ProfilePosition] {
        let mut pair = Pair::new(mode, Behaviour::new());
        pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
        let not_on = Err(SetpointError::NotOn);
        assert_eq!([pair.axis.set_feed_forward(1), pair.axis.set_sub_feed_forward(1, 1)], [not_on; 2]);
        assert_eq!([pair.axis.set_position(0), pair.axis.set_rate(1)], [not_on; 2]);
        assert_eq!([pair.axis.start_move(0x11, 1, 1), pair.axis.set_move_speed(1)], [not_on; 2]);
        pair.switch_on();
        let moves = mode == ActiveCode::ProfilePosition;
        assert_eq!(pair.axis.start_move(0x11, 1, 1), if moves { Ok(()) } else { Err(SetpointError::Mode) });
    }
}

/// A motion has ended when In_Progress and Busy have been 0 for four periods, from the first block to the fifth; one that is lost between
/// them is not counted.
#[test]
fn five_blocks_end_a_motion() {
    let periods = |lost: Option<u32>| {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
        pair.axis.start_move(0x11, 100_000, 1_000_000).unwrap();
        let has = |pair: &Pair, flag| pair.received.response().unwrap().status.contains(flag);
        pair.until("moves", |pair| has(pair, StatusFlags::IN_PROGRESS));
        pair.until("at its end", |pair| !has(pair, StatusFlags::IN_PROGRESS));
        // The first of them is here.
        for period in 1.. {
            if lost == Some(period) {
                pair.received = Heard::Nothing;
            }
            pair.update();
            if pair.axis.profile().unwrap().stage() == MoveStage::Ended {
                return period;
            }
        }
        unreachable!()
    };
    assert_eq!([None, Some(2), Some(4)].map(periods), [5, 6, 6]);
}

/// A drive that is Busy with a homing for ever: for the limit of the homing and that of an answer.
#[test]
fn a_homing_is_busy_for_so_long() {
    for limit in [20, 150] {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
        let mut home = Home::new(0x42, limit);
        let mut progress = home.start(&mut pair.axis);
        let mut asked = 0;
        while progress.is_pending() {
            pair.update();
            let next = pair.axis.clone().transmission(Turn::Valid(pair.counter.last())).main;
            let homing = matches!(next.noncyclic, NonCyclicCommand::Homing { .. });
            if homing {
                asked += 1;
                let Heard::Main(response) = &mut pair.received else { panic!() };
                // Byte 8 is the type code, bit 4 of byte 9 is Busy.
                (response.cmd_error, response.response_data2, response.response_data3) = (false, 0x1042, 0);
            }
            progress = home.receive(&mut pair.axis);
        }
        assert!(matches!(progress, Progress::Failed { .. }), "{progress:?}");
        assert_eq!(asked, limit + 60, "{limit}");
    }
}

/// A drive that says ERR has failed to execute the motion, which has ended then.
#[test]
fn a_motion_fails_with_err() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move(0x11, 100_000, 1_000_000).unwrap();
    pair.until("moves", |pair| pair.axis.profile().unwrap().stage() == MoveStage::Moving);
    // Bit 7 of byte 9.
    update(&mut pair, |response| response.response_data2 |= 0x8000);
    pair.update();
    let profile = *pair.axis.profile().unwrap();
    assert_eq!(profile.stage(), MoveStage::Ended);
    assert_eq!(pair.axis.take_move(), Some(Progress::Failed { error: Failure::Execution }));
}

/// A homing has ended when its end has been seen for a turn; a block that is lost is not one in which it is seen.
#[test]
fn lost_blocks_do_not_end_a_homing() {
    let periods = |lost: &[u32]| {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
        let mut home = Home::new(CODES.homing, 500);
        let _ = home.start(&mut pair.axis);
        let has = |pair: &Pair, flag| pair.received.response().unwrap().status.contains(flag);
        while !has(&pair, StatusFlags::IN_PROGRESS) {
            pair.update();
            assert!(home.receive(&mut pair.axis).is_pending());
        }
        while has(&pair, StatusFlags::IN_PROGRESS) {
            pair.update();
            assert!(home.receive(&mut pair.axis).is_pending());
        }
        for period in 1.. {
            if lost.contains(&period) {
                pair.received = Heard::Nothing;
            }
            pair.update();
            match home.receive(&mut pair.axis) {
                Progress::Pending { .. } => {}
                Progress::Done { .. } => return period,
                Progress::Failed { error } => panic!("{error:?}"),
            }
        }
        unreachable!()
    };
    let without = periods(&[]);
    assert_eq!([periods(&[2]), periods(&[2, 4])], [without + 1, without + 2]);
}

/// Homing_Complete that is left from a homing is not the end of the next one, although both are made by the same procedure.
#[test]
fn a_second_homing_needs_an_end_of_its_own() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    let mut home = Home::new(CODES.homing, 300);
    let _ = home.start(&mut pair.axis);
    assert_eq!(pair.run(|axis| home.receive(axis)), Progress::Done { value: () });
    // The drive says that the command is executed, and nothing changes.
    let mut progress = home.start(&mut pair.axis);
    while progress.is_pending() {
        update(&mut pair, |response| {
            response.status |= StatusFlags::HOMING_COMPLETE;
            response.status &= !StatusFlags::IN_PROGRESS;
            if response.code.noncyclic_bits() == 4 {
                // Busy.
                response.response_data2 &= !0x1000;
            }
        });
        progress = home.receive(&mut pair.axis);
    }
    assert_eq!(progress, Progress::Failed { error: Failure::TimedOut });
}

/// Alarm = 0 in a block that comes again is what the drive said before.
#[test]
fn an_alarm_is_not_cleared_by_an_old_block() {
    let mut pair = off();
    let mut clear = ClearAlarm::new(CODES.alarm_clear, 50);
    let old = pair.received;
    pair.update();
    assert!(clear.start(&mut pair.axis).is_pending());
    pair.received = old;
    pair.update();
    assert_eq!(pair.axis.arrival(), Arrival::Repeated);
    assert!(clear.receive(&mut pair.axis).is_pending());
    pair.update();
    assert_eq!(clear.receive(&mut pair.axis), Progress::Done { value: Clearing::Cleared });
}

/// A request to which the drive never reacted is withdrawn: its answer may come yet, so the next one waits for a turn of the counter.
#[test]
fn after_a_request_without_an_echo_a_turn_is_waited() {
    let mut pair = off();
    pair.axis.ask(monitor(0x07)).unwrap();
    let code = pair.received.response().unwrap().code;
    assert_eq!(code.get(), 0x20);
    let without_echo = |pair: &mut Pair| {
        update(pair, |response| response.code = code);
        pair.axis.take_outcome()
    };
    let outcome = (0..100).find_map(|_| without_echo(&mut pair));
    assert_eq!(outcome, Some(Progress::Failed { error: Failure::TimedOut }));
    let can: Vec<_> = (0..5).map(|_| (pair.axis.can_ask(), without_echo(&mut pair)).0).collect();
    assert_eq!(can, [false, false, false, false, true]);
}

/// The sub half of a block that is not on time is as old as the block.
#[test]
fn a_late_block_answers_no_sub_command() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.wide = true;
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    pair.axis.ask_sub(SubCode::SystemId, 0x01, 1).unwrap();
    pair.until("answered", |pair| pair.received.sub().is_some_and(|sub| sub.code.get() == SubCode::SystemId.code()));
    let answer = pair.received;
    let Heard::Both(block) = &mut pair.received else { panic!() };
    block.main.update_counter_echo = block.main.update_counter_echo.next().next();
    pair.update();
    assert!(matches!(pair.axis.arrival(), Arrival::OffTime { .. }));
    assert_eq!(pair.axis.take_sub_outcome(), None);
    pair.update();
    let sub = *answer.sub().unwrap();
    assert_eq!(pair.axis.take_sub_outcome(), Some(Progress::Done { value: sub }));
}

/// An axis that is held needs a drive that is ready, as one that moves does.
#[test]
fn an_axis_that_is_held_is_supervised() {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits()).with_deceleration(10);
    let mut pair = Pair::with(config, DriveConfig::new(mac_id, CODES));
    pair.switch_on();
    pair.axis.stop(StopCategory::Two);
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Held(StopReason::Requested));
    update(&mut pair, |response| response.status &= !StatusFlags::SERVO_READY);
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::NotReady));
}
