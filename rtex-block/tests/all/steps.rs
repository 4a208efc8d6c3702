//! What the last block says for a stop and for a change of the mode: steps of the command, and of a motor that moves by itself.

use crate::common::{Pair, limits};
use rtex_block::device::DriveConfig;
use rtex_block::master::{ActiveCode, Axis, AxisConfig, AxisState, Heard, StopCategory, StopReason};
use rtex_block::{MacId, Response};

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
        if pair.received.response().unwrap().status.contains(rtex_block::StatusFlags::SERVO_ACTIVE) {
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
