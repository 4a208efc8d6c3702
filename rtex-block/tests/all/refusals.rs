//! What must not happen beside something else: faults that were put in by hand and that no other test saw.

use crate::common::{CODES, LIMIT, Pair, limits, monitor, set_position};
use rtex_block::device::{Behaviour, Drive, DriveConfig, Quirks};
use rtex_block::master::{
    ActiveCode, AskError, Axis, AxisConfig, AxisState, Heard, MoveStage, Ring, RingSwitchOnError, SetpointError,
    StopReason, SwitchOnError, Turn,
};
use rtex_block::{MacId, Response};

/// Byte 1 and bytes 12-15 of the block that goes out next.
fn block(pair: &Pair) -> (u8, i32) {
    let block = pair.axis.clone().transmission(Turn::Valid(pair.counter.last().next())).main.emit();
    (block[1], i32::from_le_bytes(block[12..].try_into().unwrap()))
}

/// A request during a profile motion would take 17h away from the drive: it is refused, and 17h stays.
#[test]
fn a_motion_keeps_its_code() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move(0x11, 100_000, 1_000_000).unwrap();
    let mut moving = 0;
    while pair.axis.take_move().is_some_and(|progress| progress.is_pending()) {
        assert_eq!(pair.axis.ask(monitor(7)), Err(AskError::Busy));
        if pair.axis.profile().unwrap().stage() == MoveStage::Moving {
            moving += 1;
            assert_eq!(block(&pair).0, 0x17);
        }
        pair.update();
    }
    assert!(moving > 50);
}

/// A request holds the mode, and a motion is not begun beside it.
#[test]
fn a_request_keeps_the_mode() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new().with_quirks(Quirks::ALWAYS_BUSY));
    pair.axis.ask(monitor(7)).unwrap();
    for _ in 0..3 {
        assert_eq!(pair.axis.set_mode(ActiveCode::CyclicPosition), Err(SetpointError::Busy));
        assert_eq!(pair.axis.start_move(0x11, 5, 5), Err(SetpointError::Busy));
        assert_eq!(block(&pair).0, 0x1a);
        pair.update();
    }
}

/// The position to be set stands where the feed-forward does otherwise: that does not overwrite it.
#[test]
fn feed_forward_leaves_the_position_to_be_set_alone() {
    for type_code in [0x21, 0x22] {
        let mut pair = Pair::on(ActiveCode::CyclicVelocity, Behaviour::new());
        pair.axis.set_feed_forward(77).unwrap();
        assert_eq!(block(&pair), (0x30, 77));
        let mut command = pair.axis.clone().transmission(Turn::Valid(pair.counter.last().next())).main;
        command.noncyclic = set_position(type_code, -123_456).with_feed_forward(77);
        assert_eq!(command.emit()[12..], (-123_456_i32).to_le_bytes());
        command.noncyclic = monitor(7).with_feed_forward(77);
        assert_eq!(command.emit()[12..], 77_i32.to_le_bytes());
    }
}

/// All axes are switched on, or none: one that cannot be holds the others.
#[test]
fn a_ring_is_switched_on_as_a_whole() {
    let number = |n| MacId::new(n).unwrap();
    let axis = |n| Axis::new(AxisConfig::new(number(n), ActiveCode::CyclicPosition, 500_000, limits()));
    let mut ring = Ring::new([axis(1), axis(2), axis(3)], 0).unwrap();
    let mut drives =
        [1, 2, 3].map(|n| Drive::new(DriveConfig::new(number(n), CODES).with_sync_exchanges(10 * u16::from(n))));
    let mut heard = [Heard::Nothing; 3];
    let mut refused = 0;
    for period in 0..40 {
        let commands = ring.update(&heard, period * 500_000);
        for (place, command) in commands.iter().enumerate() {
            heard[place] = Response::parse(&drives[place].hear(&command.main.emit()).unwrap()).into();
        }
        if let Err(RingSwitchOnError { place, error }) = ring.switch_on() {
            refused += 1;
            assert!(ring.axes().iter().all(|axis| !axis.state().is_servo_on()), "{place}: {error}");
            let starting = SwitchOnError::State(AxisState::Starting);
            assert!(period < 2 || place == 2 || error == starting);
        } else {
            assert!(ring.all_are(AxisState::SwitchingOn));
            break;
        }
    }
    assert!(refused >= 28, "{refused}");
}

/// Servo_Active that was 1 for a while with the servo off and went to 0 is counted from anew: the limit is for one stretch.
#[test]
fn activity_is_counted_in_one_stretch() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    let active = |pair: &mut Pair, periods: u32| {
        for _ in 0..periods {
            if let Heard::Main(response) = &mut pair.received {
                response.status.insert(rtex_block::StatusFlags::SERVO_ACTIVE);
            }
            pair.update();
        }
    };
    // The limit of these tests is twelve.
    for _ in 0..3 {
        active(&mut pair, 12);
        assert!(!pair.axis.disobeys());
        pair.update();
    }
    active(&mut pair, 13);
    assert_eq!((pair.axis.disobeys(), pair.axis.state()), (true, AxisState::Stopped(StopReason::InactiveTimeout)));
}

/// A position comes from the drive in its place and no other, and another one's blocks are silence.
#[test]
fn another_drive_gives_no_position() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let before = pair.axis.evidence();
    for _ in 0..LIMIT {
        if let Heard::Main(response) = &mut pair.received {
            (response.mac_id, response.response_data1) = (MacId::new(3).unwrap(), 55_555);
        }
        pair.update();
        let policy = rtex_block::Policy::new(u64::MAX);
        assert_eq!(pair.axis.evidence().at(u64::MAX, policy), before.at(u64::MAX, policy));
    }
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::WrongMacId(MacId::new(3).unwrap())));
}
