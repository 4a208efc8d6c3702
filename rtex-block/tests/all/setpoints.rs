//! Set-points: their limits, what they do from mode to mode and while the servo goes on, and feed-forward.

use crate::common::{CODES, Pair, limits, monitor, set_position};
use rtex_block::device::{Behaviour, DriveConfig};
use rtex_block::master::{ActiveCode, AxisConfig, AxisState, Heard, Progress, SetpointError, StopReason, Turn};
use rtex_block::position::Gear;
use rtex_block::{Alarm, Arguments, ErrorCode, MacId, NonCyclicCommand, TypeCode};

/// Feed-forward goes out while the servo is on, with every command that does not need bytes 12-15 itself, and no longer.
#[test]
fn feed_forward_lives_with_the_servo() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    let select = Arguments { type_code: TypeCode::short(0x11), index: 0x0723, data: 2 };
    let _ = pair.ask(NonCyclicCommand::Parameter(select));
    assert_eq!(pair.axis.set_feed_forward(500), Err(SetpointError::NotOn));
    pair.switch_on();
    pair.axis.set_feed_forward(500).unwrap();
    (0..3).for_each(|_| pair.update());
    assert_eq!(pair.drive.feed_forward(), 500);
    // A monitor command carries it along; a parameter write leaves the drive with the last one.
    for request in [monitor(7), NonCyclicCommand::Parameter(select)] {
        assert!(matches!(pair.ask(request), Progress::Done { .. }));
        assert_eq!(pair.drive.feed_forward(), 500, "{request}");
    }
    // Out of range: the drive keeps the old one and says so, which stops the axis at the limit.
    pair.axis.set_feed_forward(3_001).unwrap();
    for _ in 0..4 {
        pair.update();
        assert_eq!(pair.drive.feed_forward(), 500);
    }
    pair.until("stopped", |pair| pair.axis.state() != AxisState::On);
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::CommandError(ErrorCode(0x0034))));
    (0..3).for_each(|_| pair.update());
    assert_eq!(pair.drive.feed_forward(), 0);
    pair.axis.clear();
    pair.switch_on();
    (0..3).for_each(|_| pair.update());
    assert_eq!(pair.drive.feed_forward(), 0);
}

/// A motor that turns while the servo is being switched on: the command position follows it until Servo_Active is 1. From then
/// on the drive holds the position that it was sent last.
#[test]
fn the_set_point_follows_while_switching_on() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    pair.axis.switch_on().unwrap();
    for turned in (1_000..).step_by(1_000) {
        pair.update();
        if let Heard::Main(response) = &mut pair.received {
            response.response_data1 = turned;
        }
        let mut next = pair.axis;
        next.hear(pair.sent, &pair.received, pair.now_ns());
        let block = next.transmission(Turn::Valid(pair.counter.last().next())).main.emit();
        let is_on = next.state() == AxisState::On;
        let want = if is_on { turned - 1_000 } else { turned };
        assert_eq!((block[2] & 0x80, i32::from_le_bytes(block[4..8].try_into().unwrap())), (0x80, want));
        if is_on {
            break;
        }
        assert!(next.state() == AxisState::SwitchingOn && turned < 30_000);
    }
}

/// The limits of set-points, with gears other than 1/1.
#[test]
fn limits_of_set_points() {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits());
    // 400 M pulse/s in 0.5 ms are 200 000 pulses: 66 666 units at 3/1, 266 666 at 3/4, and 5 000 by 10 M units/s.
    for (numerator, denominator, over_speed, largest) in
        [(1, 1, None, 200_000), (3, 1, None, 66_666), (3, 4, None, 266_666), (1, 1, Some(10_000_000), 5_000)]
    {
        let gear = Gear::new(numerator, denominator).unwrap();
        let config = config.with_gear(gear).with_over_speed(over_speed);
        let drive = DriveConfig::new(mac_id, CODES).with_gear(gear);
        let mut pair = Pair::with(config, drive);
        pair.switch_on();
        assert_eq!(i32::try_from(pair.axis.max_step()), Ok(largest));
        for sign in [1, -1] {
            let step = sign * (largest + 1);
            assert_eq!(pair.axis.set_position(step), Err(SetpointError::Step { step }));
        }
        // The step counts from what was sent last: two calls in an update period do not add up.
        pair.axis.set_position(largest).unwrap();
        assert!(pair.axis.set_position(2 * largest).is_err());
        (0..30).for_each(|_| pair.update());
        assert_eq!(pair.drive.alarm(), None);
        if over_speed.is_none() {
            // The drive has the same limit, by its own reckoning.
            let mut block = pair.axis.transmission(Turn::Valid(pair.counter.last().next())).main;
            block.command_data1 = largest * 2 + 1;
            pair.drive.hear(&block.emit()).unwrap();
            assert_eq!(pair.drive.alarm(), Some(Alarm { main: 27, sub: 4 }));
        }
    }
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicVelocity, 500_000, limits())
        .with_max_speed(Some(3_000))
        .with_max_torque(Some(999));
    let mut pair = Pair::with(config, DriveConfig::new(mac_id, CODES));
    pair.switch_on();
    assert_eq!(pair.axis.set_rate(-3_001), Err(SetpointError::Rate { rate: -3_001 }));
    pair.axis.set_rate(-3_000).unwrap();
    pair.axis.set_mode(ActiveCode::CyclicTorque).unwrap();
    assert_eq!((pair.axis.setpoint(), pair.axis.set_rate(1_000).is_err()), (0, true));
    pair.axis.set_rate(999).unwrap();
    pair.axis.set_mode(ActiveCode::ProfilePosition).unwrap();
    assert_eq!(pair.axis.start_move(0x11, 5, 3_001), Err(SetpointError::Rate { rate: 3_001 }));
    assert_eq!(pair.axis.set_move_speed(3_001), Err(SetpointError::Rate { rate: 3_001 }));
}

/// From mode to mode with the servo on: no jump, and no motion of its own.
#[test]
fn every_change_of_mode() {
    use ActiveCode::{CyclicPosition, CyclicTorque, CyclicVelocity, ProfilePosition};
    let modes = [CyclicPosition, ProfilePosition, CyclicVelocity, CyclicTorque];
    for from in modes {
        for to in modes {
            let mut pair = Pair::new(CyclicPosition, Behaviour::new().with_echo_lag(2));
            pair.until("off", |pair| pair.axis.state() == AxisState::Off);
            let _ = pair.ask(set_position(0x21, 700_000));
            pair.switch_on();
            pair.axis.set_mode(from).unwrap();
            (0..20).for_each(|_| pair.update());
            pair.axis.set_mode(to).unwrap();
            (0..20).for_each(|_| pair.update());
            assert_eq!((pair.axis.mode(), pair.axis.state()), (to, AxisState::On));
            assert_eq!((pair.drive.position(), pair.drive.alarm()), (700_000, None), "{from:?} {to:?}");
        }
    }
    let mut pair = Pair::on(ProfilePosition, Behaviour::new());
    pair.axis.start_move(0x11, 100_000, 1_000_000).unwrap();
    assert_eq!(pair.axis.set_mode(CyclicPosition), Err(SetpointError::Busy));
    pair.axis.switch_off();
    assert_eq!(pair.axis.set_mode(CyclicPosition), Err(SetpointError::NotOn));
}
