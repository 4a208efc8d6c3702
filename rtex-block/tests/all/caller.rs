//! Whatever a caller does to an axis, at any time.

use crate::common::Pair;
use proptest::prelude::*;
use rtex_block::device::{Behaviour, Fault};
use rtex_block::master::{ActiveCode, AxisState, Heard, StopCategory};
use rtex_block::{
    Alarm, CommandBlock, ControlBits, Nibble, NonCyclicCode, NonCyclicCommand, Response, SubCode, TypeCode,
};

/// What a caller can do to an axis.
#[derive(Debug, Clone, Copy)]
enum Action {
    Nothing,
    SwitchOn,
    SwitchOff,
    Clear,
    Stop,
    Control(u16),
    FeedForward(i32),
    SubFeedForward(i32, i32),
    Attributes(u16),
    Position(i32),
    Rate(i32),
    Move(u8, i32, i32, u8),
    MoveSpeed(i32),
    Ask(NonCyclicCode, [u8; 8]),
    Sub(u8),
    Mode(u8),
    Take,
    Alarm,
    ClearAlarm,
    Power(bool),
    Drop,
    Lose,
    Spoil(u8),
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        8 => Just(Action::Nothing),
        4 => Just(Action::SwitchOn),
        1 => Just(Action::SwitchOff),
        2 => Just(Action::Clear),
        1 => Just(Action::Stop),
        2 => any::<u16>().prop_map(Action::Control),
        1 => any::<i32>().prop_map(Action::FeedForward),
        1 => any::<(i32, i32)>().prop_map(|(two, three)| Action::SubFeedForward(two, three)),
        1 => any::<u16>().prop_map(Action::Attributes),
        2 => (-300_000..300_000).prop_map(Action::Position),
        2 => any::<i32>().prop_map(Action::Rate),
        2 => any::<(u8, i32, i32, u8)>().prop_map(|(code, to, at, sel)| Action::Move(code % 4 + 0x10, to, at, sel)),
        1 => any::<i32>().prop_map(Action::MoveSpeed),
        3 => (proptest::sample::select(&NonCyclicCode::ALL[..]), any::<[u8; 8]>()).prop_map(|(c, b)| Action::Ask(c, b)),
        1 => any::<u8>().prop_map(Action::Sub),
        2 => (0..4_u8).prop_map(Action::Mode),
        2 => Just(Action::Take),
        1 => Just(Action::Alarm),
        2 => Just(Action::ClearAlarm),
        1 => any::<bool>().prop_map(Action::Power),
        1 => Just(Action::Drop),
        1 => Just(Action::Lose),
        1 => (0..128_u8).prop_map(Action::Spoil),
    ]
}

fn act(pair: &mut Pair, action: Action) {
    let modes =
        [ActiveCode::CyclicPosition, ActiveCode::ProfilePosition, ActiveCode::CyclicVelocity, ActiveCode::CyclicTorque];
    let Pair { axis, drive, .. } = pair;
    match action {
        Action::Nothing => {}
        Action::SwitchOn => _ = axis.switch_on().ok(),
        Action::SwitchOff => axis.switch_off(),
        Action::Clear => axis.clear(),
        Action::Stop => axis.stop(StopCategory::Zero),
        Action::Control(bits) => axis.set_control(ControlBits::from_bits_retain(bits)),
        Action::FeedForward(value) => _ = axis.set_feed_forward(value),
        Action::SubFeedForward(two, three) => _ = axis.set_sub_feed_forward(two, three),
        Action::Attributes(code) => _ = axis.ask_alarm_attributes(TypeCode::truncate(code)),
        Action::Position(by) => _ = axis.set_position(axis.setpoint().wrapping_add(by)),
        Action::Rate(rate) => _ = axis.set_rate(rate),
        Action::Move(code, to, at, sel) => {
            _ = axis.start_move_with_latch(code, to, at, Nibble::truncate(sel), sel);
        }
        Action::MoveSpeed(at) => _ = axis.set_move_speed(at),
        Action::Ask(code, bytes) => _ = axis.ask(NonCyclicCommand::parse(code, bytes)),
        Action::Sub(type_code) => _ = axis.ask_sub(SubCode::Monitor, type_code, 0),
        Action::Mode(k) => _ = axis.set_mode(modes[usize::from(k)]),
        Action::Take => {
            let _ = (axis.take_outcome(), axis.take_move(), axis.take_sub_outcome());
        }
        Action::Alarm => drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
        Action::ClearAlarm => drive.clear_alarm(),
        Action::Power(on) => drive.set_fault(if on { Fault::None } else { Fault::NoMainPower }),
        Action::Drop => drive.set_fault(Fault::ServoDrop),
        Action::Lose => pair.received = Heard::Nothing,
        Action::Spoil(bit) => {
            if let Heard::Main(response) = pair.received {
                let mut block = response.emit();
                block[usize::from(bit / 8)] ^= 1 << (bit % 8);
                pair.received = Response::parse(&block).into();
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(debug_assertions) { 200 } else { 600 }))]

    /// Whatever the caller does, outside On, SwitchingOn and Stopping the block is a servo-off. `update` asserts it, in
    /// each period and both ways round; and a refused set-point changes nothing.
    #[test]
    fn no_caller_gets_around_the_servo_off(actions in proptest::collection::vec(action(), 0..300), polite: bool) {
        let behaviour = if polite { Behaviour::new() } else { Behaviour::new().with_servo_off_late(5).with_echo_lag(2) };
        let mut pair = Pair::new(ActiveCode::CyclicPosition, behaviour);
        pair.until("off", |pair| pair.axis.state() == AxisState::Off);
        for action in actions {
            act(&mut pair, action);
            // The axis between two updates, before anything is received.
            let block = pair.axis.clone().transmission(pair.counter.next()).main.emit();
            let off = CommandBlock::of(&block).unwrap().is_servo_off();
            prop_assert_eq!(off, !pair.axis.state().is_servo_on());
            pair.update();
        }
    }
}
