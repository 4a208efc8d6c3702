//! What the last block says for a stop and for a change of the mode: steps of the command, and of a motor that moves by itself.

use crate::common::{Pair, limits};
use rtex_block::device::DriveConfig;
use rtex_block::master::procedure::{RebaseWithServoOn, Request};
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, Failure, Fellows, Heard, Progress, StopCategory, StopReason,
};
use rtex_block::{MacId, Response, StatusFlags};

fn config(mode: ActiveCode) -> AxisConfig {
    AxisConfig::new(MacId::new(9).unwrap(), mode, 500_000, limits()).with_deceleration(10)
}

fn on(mode: ActiveCode) -> Pair {
    let mut pair = Pair::with(config(mode), DriveConfig::new(MacId::new(9).unwrap(), crate::common::CODES));
    pair.switch_on();
    pair
}

/// The response with the motor somewhere else.
fn at(heard: &Heard, position: i32) -> Heard {
    let response = *heard.response().unwrap();
    Ok(Response { response_data1: position, ..response }).into()
}

/// The motor is turned by hand until the servo holds it: its command has not moved yet, so there is nothing to slow down.
#[test]
fn a_motor_turned_by_hand_has_no_speed_of_its_command() {
    let mut pair =
        Pair::with(config(ActiveCode::CyclicPosition), DriveConfig::new(MacId::new(9).unwrap(), crate::common::CODES));
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    pair.axis.switch_on().unwrap();
    for turned in 1..100 {
        pair.received = at(&pair.received, turned * 500);
        if pair.received.response().unwrap().status.contains(StatusFlags::SERVO_ACTIVE) {
            break;
        }
        pair.update();
    }
    pair.axis.hear(pair.sent, &pair.received, pair.now_ns() + 500_000);
    assert_eq!(pair.axis.state(), AxisState::On);
    pair.axis.stop(StopCategory::One);
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::Requested));
}

/// From CV at speed 0 to CP while the motor still creeps: the first command position is where it is, and no step.
#[test]
fn the_first_block_of_a_mode_has_no_step() {
    let mut pair = on(ActiveCode::CyclicVelocity);
    (0..10).for_each(|_| pair.update());
    for turn in 1..4 {
        pair.received = at(&pair.received, turn * 100);
        pair.update();
    }
    pair.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
    pair.axis.transmission(pair.sent);
    pair.axis.stop(StopCategory::Two);
    assert_eq!(pair.axis.state(), AxisState::Held(StopReason::Requested));
}

/// A motor that moves up to a quarter of the largest step a period may change to CP, a faster one not.
#[test]
fn how_far_a_motor_may_creep_at_a_change_to_positions() {
    for (over, ok) in [(0, true), (1, false)] {
        let mut pair = on(ActiveCode::CyclicTorque);
        (0..10).for_each(|_| pair.update());
        let quarter = pair.axis.max_step() as i32 / 4 + over;
        for turn in 1..4 {
            pair.received = at(&pair.received, turn * quarter);
            pair.update();
        }
        assert_eq!(pair.axis.set_mode(ActiveCode::CyclicPosition).is_ok(), ok, "{over}");
    }
}

/// With the servo off any mode can be set, heard or not.
#[test]
fn an_axis_that_is_off_takes_any_mode() {
    for from in ActiveCode::ALL {
        let mut axis = Axis::new(config(from));
        for to in ActiveCode::ALL {
            assert_eq!((axis.set_mode(to), axis.mode()), (Ok(()), to));
        }
    }
}

/// A mode that was asked for and not yet sent, then a stop: what the last block said in the old mode is no speed of the new one.
#[test]
fn a_stop_right_after_a_change_of_mode() {
    for from in ActiveCode::ALL {
        for to in ActiveCode::ALL.into_iter().filter(|to| *to != from) {
            for category in [StopCategory::One, StopCategory::Two] {
                let mut pair = on(from);
                (0..20).for_each(|_| pair.update());
                if from == ActiveCode::CyclicPosition {
                    let at = pair.axis.setpoint();
                    for step in 1..10 {
                        pair.axis.set_position(at + 5_000 * step).unwrap();
                        pair.update();
                    }
                }
                (0..20).for_each(|_| pair.update());
                pair.axis.set_mode(to).unwrap();
                pair.axis.stop(category);
                for _ in 0..30 {
                    let value = pair.axis.setpoint();
                    let rest = if pair.axis.mode() == ActiveCode::CyclicPosition { pair.actual() } else { 0 };
                    assert_eq!(value, rest, "{from} {to} {category:?} {}", pair.axis.state());
                    pair.update();
                }
            }
        }
    }
}

/// New coordinates with the servo on are sent at speed 0 and at no other, and a stop on the way ends them for its reason.
#[test]
fn coordinates_change_at_speed_0_only() {
    for (speed, sent) in [(0, true), (100, false)] {
        let mut pair = on(ActiveCode::CyclicVelocity);
        pair.axis.set_rate(speed).unwrap();
        (0..10).for_each(|_| pair.update());
        let mut rebase = RebaseWithServoOn::new(1_000, 50);
        let mut progress = rebase.start(&mut pair.axis);
        let mut out = false;
        while progress.is_pending() {
            pair.update();
            out |= pair.axis.clone().transmission(pair.sent).main.emit()[1] == 0x34;
            progress = rebase.receive(&mut pair.axis);
        }
        assert_eq!(out, sent, "at {speed}");
        // The modelled drive does not take it with the servo on; at speed the axis could not go back to CP either.
        let error = if sent { Failure::Execution } else { Failure::Mode };
        assert_eq!(progress, Progress::Failed { error });
        // The same with a speed that was asked for and is not sent yet.
        let mut pair = on(ActiveCode::CyclicVelocity);
        (0..10).for_each(|_| pair.update());
        pair.axis.set_rate(speed).unwrap();
        let _progress = rebase.start(&mut pair.axis);
        assert_eq!(pair.axis.transmission(pair.sent).main.emit()[1] == 0x34, sent, "asked for {speed}");
    }
    for category in [StopCategory::Zero, StopCategory::One, StopCategory::Two] {
        let mut pair = on(ActiveCode::CyclicPosition);
        let mut rebase = RebaseWithServoOn::new(1_000, 50);
        assert!(rebase.start(&mut pair.axis).is_pending());
        (0..3).for_each(|_| pair.update());
        pair.axis.stop(category);
        let stopped = Progress::Failed { error: Failure::Stopped(StopReason::Requested) };
        assert_eq!(rebase.receive(&mut pair.axis), stopped);
    }
}

/// A profile motion that was asked for may begin in the drive yet: category 2 waits for it with the servo on, category 1 does not.
#[test]
fn a_stop_before_a_motion_has_begun() {
    for (category, want) in [
        (StopCategory::One, AxisState::Stopped(StopReason::Requested)),
        (StopCategory::Two, AxisState::Stopping(StopReason::Requested)),
    ] {
        let mut pair = on(ActiveCode::ProfilePosition);
        (0..10).for_each(|_| pair.update());
        pair.axis.start_move(0x11, 50_000, 100_000).unwrap();
        pair.axis.stop(category);
        assert_eq!(pair.axis.state(), want);
    }
}

/// A request behind a motion waits for its end, however long that takes.
#[test]
fn a_request_waits_for_a_motion() {
    let mut pair = on(ActiveCode::ProfilePosition);
    (0..10).for_each(|_| pair.update());
    pair.axis.start_move(0x11, 500_000, 400_000).unwrap();
    let mut request = Request::new(crate::common::monitor(0x07));
    let (mut progress, mut periods) = (request.start(&mut pair.axis), 0);
    while progress.is_pending() {
        pair.update();
        let _end = pair.axis.take_move();
        progress = request.receive(&mut pair.axis);
        periods += 1;
    }
    assert!(matches!(progress, Progress::Done { .. }), "{progress:?}");
    assert!(periods > 500, "the motion is over after {periods}");
}

/// While the drive slows down, the end of a motion is awaited; one that has ended well stays so, whatever comes after.
#[test]
fn the_end_of_a_motion_is_that_of_the_drive() {
    let moving = || {
        let mut pair = on(ActiveCode::ProfilePosition);
        (0..10).for_each(|_| pair.update());
        pair.axis.start_move(0x11, 100_000, 1_000_000).unwrap();
        pair
    };
    let in_progress = |pair: &Pair| pair.axis.status().contains(StatusFlags::IN_PROGRESS);
    let mut pair = moving();
    pair.until("moving", in_progress);
    (0..50).for_each(|_| pair.update());
    pair.axis.stop(StopCategory::Two);
    let mut waited = 0;
    while in_progress(&pair) {
        assert!(pair.axis.take_move().unwrap().is_pending());
        pair.update();
        waited += 1;
    }
    assert!(waited > 3, "it slows down in {waited}");
    let broken = Progress::Failed { error: Failure::Stopped(StopReason::Requested) };
    assert_eq!(pair.end_of_move(), broken);

    let mut pair = moving();
    pair.until("moving", in_progress);
    pair.until("over", |pair| !in_progress(pair));
    (0..20).for_each(|_| pair.update());
    pair.axis.stop(StopCategory::Zero);
    assert!(matches!(pair.axis.take_move(), Some(Progress::Done { .. })));
}

/// Two axes have lost their drives: the third does not slow down by its policy, it is off.
#[test]
fn lost_drives_do_not_make_up_for_each_other() {
    for lost in 0..3 {
        let mut fellows = Fellows::new();
        fellows.begin();
        for place in 0..2 {
            let mut pair = on(ActiveCode::CyclicPosition);
            let silent = place < lost;
            if silent {
                for period in 1..=u64::from(crate::common::LIMIT) {
                    pair.axis.hear(pair.sent, &Heard::Nothing, pair.now_ns() + period * 500_000);
                }
            } else {
                pair.axis.stop(StopCategory::Zero);
            }
            fellows.look(place, &pair.axis);
        }
        let policy = config(ActiveCode::CyclicPosition).with_stop(Some(StopCategory::One));
        let mut pair = Pair::with(policy, DriveConfig::new(MacId::new(9).unwrap(), crate::common::CODES));
        pair.switch_on();
        let at = pair.axis.setpoint();
        for step in 1..10 {
            pair.axis.set_position(at + 1_000 * step).unwrap();
            pair.update();
        }
        fellows.tell(&mut pair.axis);
        let reason = StopReason::OtherAxis { place: 0 };
        let want = if lost == 0 { AxisState::Stopping(reason) } else { AxisState::Stopped(reason) };
        assert_eq!(pair.axis.state(), want, "{lost} lost");
    }
}

/// A stop of category 2 beside a change from CT to CP whose block is lost: the axis goes back to CT, in which nothing holds it, so its
/// servo is switched off. It was held with the torque of before.
#[test]
fn a_torque_is_not_held() {
    let mut pair = on(ActiveCode::CyclicTorque);
    pair.axis.set_rate(-5).unwrap();
    (0..3).for_each(|_| pair.update());
    pair.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
    pair.axis.stop(StopCategory::Two);
    pair.received = Heard::Nothing;
    for _ in 0..3 {
        pair.update();
        assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::Requested));
        assert_eq!((pair.axis.mode(), pair.axis.setpoint()), (ActiveCode::CyclicTorque, 0));
    }
}
