//! What a master takes for an answer, and what it leaves alone.

use core::num::NonZeroU16;

use crate::common::{CODES, Pair, limits, monitor};
use rtex_block::device::{Behaviour, DriveConfig, Fault};
use rtex_block::master::procedure::{Home, Latch, ReadText};
use rtex_block::master::{
    ActiveCode, AskError, Axis, AxisConfig, AxisState, Failure, Handshake, Heard, Limits, MoveStage, ProfileMove,
    Progress, Ring, ServoOff, StopCategory, StopReason, SubHandshake, Turn,
};
use rtex_block::{
    Alarm, Command, CommandBlock, ControlBits, CyclicCode, ErrorCode, MacId, Nibble, NonCyclicCommand, Response,
    Response32, StatusFlags, SubCode, TypeCode,
};

fn mac_id() -> MacId {
    MacId::new(9).unwrap()
}

/// A block of drive 9 with these bytes 1, 2, 8 and 9.
fn answer(code: u8, status: u8, eight: u8, nine: u8) -> Response {
    let mut block = [0; 16];
    (block[0], block[1], block[2], block[8], block[9]) = (0x89, code, status, eight, nine);
    Response::parse(&block).unwrap()
}

fn with_first_byte(response: Response, byte: u8) -> Response {
    let mut block = response.emit();
    block[0] = byte;
    Response::parse(&block).unwrap()
}

#[test]
fn a_handshake_takes_its_own_answer_only() {
    let new = || Handshake::new(mac_id(), CyclicCode::CyclicPosition, monitor(0x07), 2).unwrap();
    let mut handshake = new();
    for stranger in
        [with_first_byte(answer(0x2a, 0, 0x07, 0), 0x88), answer(0x1a, 0, 0x07, 0), answer(0xa6, 0, 0x32, 0)]
    {
        let mut handshake = new();
        assert_eq!(handshake.receive(Some(&stranger)), Progress::Pending { left: 1 }, "{stranger}");
    }
    // Busy before ERR: a command that has failed has failed.
    assert_eq!(handshake.receive(Some(&answer(0x2a, 0, 0x07, 0x10))), Progress::Pending { left: 1 });
    let failed = Progress::Failed { error: Failure::Execution };
    assert_eq!(handshake.receive(Some(&answer(0x2a, 0, 0x07, 0x90))), failed);
    let mut handshake = new();
    assert_eq!(handshake.left(), 2);
    assert_eq!(handshake.receive(None), Progress::Pending { left: 1 });
    assert_eq!(handshake.left(), 1);
    assert_eq!(handshake.receive(None), Progress::Pending { left: 0 });
    assert_eq!(handshake.receive(None), Progress::Failed { error: Failure::TimedOut });
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x31)) };
    assert_eq!(new().receive(Some(&answer(0xaa, 0, 0x31, 0))), refused);
    for type_code in [0x07, 0x0107_u16] {
        let [low, high] = type_code.to_le_bytes();
        let done = matches!(new().receive(Some(&answer(0x2a, 0, low, high))), Progress::Done { .. });
        assert_eq!(done, high == 0);
    }
}

/// Each request is answered with its own bytes 8, 10 and 11 alone; of another one the answer is older.
#[test]
fn every_echo_of_a_request_counts() {
    // Reset, system ID, homing (latch), alarm, parameter, monitor.
    for code in [0x21, 0x22, 0x24, 0x25, 0x26, 0x2a] {
        let mut block = [0; 16];
        (block[0], block[1], block[8], block[10], block[11]) = (0x09, code, 0x50, 0x21, 0x09);
        let request = Command::parse(&block).unwrap().noncyclic;
        let ask = |response: [u8; 16]| {
            let mut handshake = Handshake::new(mac_id(), CyclicCode::CyclicPosition, request, 5).unwrap();
            handshake.receive(Some(&Response::parse(&response).unwrap()))
        };
        block[0] = 0x89;
        assert!(matches!(ask(block), Progress::Done { .. }), "{code:x}");
        // Byte 10 has Latch_Sel1 and 2, or the low half of the index; byte 11 Monitor_Sel, or its high half.
        for (byte, bit) in
            [(8, 0x01), (8, 0x80), (10, 0x01), (10, 0x08), (10, 0x10), (10, 0x80), (11, 0x01), (11, 0x80)]
        {
            let mut other = block;
            other[byte] ^= bit;
            assert_eq!(ask(other), Progress::Pending { left: 4 }, "{code:x}: byte {byte} {bit:x}");
        }
    }
}

/// Servo_Active = 0 has to be seen in time: a drive of which nothing is heard is not taken to be off.
#[test]
fn switching_off_without_a_response() {
    let limits = Limits::new(NonZeroU16::new(20).unwrap(), 60).with_inactive(5);
    let config = AxisConfig::new(mac_id(), ActiveCode::CyclicPosition, 500_000, limits);
    let mut pair = Pair::with(config, DriveConfig::new(mac_id(), CODES));
    pair.switch_on();
    pair.axis.switch_off();
    for _ in 0..5 {
        pair.received = Heard::Nothing;
        pair.update();
        assert_eq!(pair.axis.state(), AxisState::SwitchingOff);
    }
    pair.received = Heard::Nothing;
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::InactiveTimeout));
}

#[test]
fn a_sub_handshake_takes_its_own_answer_only() {
    let new = || SubHandshake::new(SubCode::Monitor, 0x07, 3, 5).unwrap();
    let answer = |sub: [u8; 4]| {
        let mut block = [0; 32];
        (block[0], block[1]) = (0x89, 0x20);
        block[16..20].copy_from_slice(&sub);
        Response32::parse(&block).unwrap().sub
    };
    let pending = Progress::Pending { left: 4 };
    for other in
        [[0x02, 7, 3, 0], [0x0a, 8, 3, 0], [0x0a, 7, 4, 0], [0x0a, 8, 4, 0], [0x1a, 7, 3, 0], [0x82, 0, 0x31, 0]]
    {
        assert_eq!(new().receive(Some(&answer(other))), pending, "{other:?}");
    }
    assert!(matches!(new().receive(Some(&answer([0x0a, 7, 3, 0]))), Progress::Done { .. }));
    assert!(matches!(new().receive(Some(&answer([0x2a, 7, 3, 0]))), Progress::Done { .. }));
    let failed = Progress::Failed { error: Failure::Execution };
    assert_eq!(new().receive(Some(&answer([0x4a, 7, 3, 0]))), failed);
    assert_eq!(new().receive(Some(&answer([0x5a, 7, 3, 0]))), failed);
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x31)) };
    assert_eq!(new().receive(Some(&answer([0x8a, 0, 0x31, 0]))), refused);
}

#[test]
fn a_motion_takes_its_own_answers_only() {
    let moving = || {
        let mut profile = ProfileMove::new(mac_id(), 0x11, 50, 10, 3);
        assert!(profile.receive(Some(&answer(0x10, 0, 0, 0))).is_pending());
        assert_eq!(profile.stage(), MoveStage::Starting);
        profile
    };
    // In_Progress or Busy, each is enough.
    for (status, nine) in [(0x02, 0), (0, 0x10), (0x02, 0x10)] {
        let mut profile = moving();
        assert!(profile.receive(Some(&answer(0x17, status, 0x11, nine))).is_pending());
        assert_eq!(profile.stage(), MoveStage::Moving, "{status:x} {nine:x}");
        // The end has to come with 17h, of this drive, for this type.
        for other in [
            answer(0x10, 0, 0x11, 0),
            answer(0x1a, 0, 0x11, 0),
            answer(0x17, 0, 0x10, 0),
            // Latch_Sel1 and Monitor_Sel of another motion.
            Response { response_data2: 0x0001_0011, ..answer(0x17, 0, 0x11, 0) },
            Response { response_data2: 0x0100_0011, ..answer(0x17, 0, 0x11, 0) },
            // A single command of the motion was damaged.
            answer(0x97, 0, 0x31, 0),
            with_first_byte(answer(0x17, 0, 0x11, 0), 0x8a),
        ] {
            assert!(profile.receive(Some(&other)).is_pending(), "{other}");
        }
        assert!(profile.receive(None).is_pending());
        assert!(matches!(profile.receive(Some(&answer(0x17, 0, 0x11, 0))), Progress::Done { .. }));
    }
    // Without either it has not started; refused it is by the answer to 17h alone.
    let mut profile = moving();
    assert!(profile.receive(Some(&answer(0x17, 0, 0x11, 0))).is_pending());
    assert!(profile.receive(Some(&answer(0x90, 0, 0x32, 0))).is_pending());
    assert_eq!(profile.stage(), MoveStage::Starting);
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x31)) };
    assert_eq!(profile.receive(Some(&answer(0x97, 0, 0x31, 0))), refused);
    // 10h has to be echoed without CMD_Error and with In_Progress = 0.
    for not_yet in [answer(0x90, 0, 0x32, 0), answer(0x10, 0x02, 0, 0), answer(0x20, 0, 0, 0)] {
        let mut profile = ProfileMove::new(mac_id(), 0x11, 50, 10, 3);
        let _ = profile.receive(Some(&not_yet));
        assert_eq!(profile.stage(), MoveStage::Preparing, "{not_yet}");
    }
}

/// After an answer the normal command goes out until it has come back for a turn of the counter, four blocks; until then nothing
/// else can be asked.
#[test]
fn requests_are_released_by_the_echo() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new().with_echo_lag(3));
    pair.wide = true;
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.axis.ask(monitor(0x07)).unwrap();
    pair.axis.ask_sub(SubCode::Monitor, 0x07, 0).unwrap();
    let mut answered = [false; 2];
    let mut echoed = [0; 2];
    for _ in 0..40 {
        // What the axis is about to receive.
        if let Heard::Both(response) = pair.received {
            echoed[0] += u32::from(answered[0] && response.main.code.get() == 0x20);
            echoed[1] += u32::from(answered[1] && response.sub.code.get() == 0x00);
        }
        pair.update();
        answered[0] |= pair.axis.take_outcome().is_some();
        answered[1] |= pair.axis.take_sub_outcome().is_some();
        assert_eq!(pair.axis.can_ask(), echoed[0] >= 4);
        let mut again = pair.axis;
        assert_eq!(again.ask_sub(SubCode::Monitor, 0x05, 0).is_ok(), echoed[1] >= 4);
    }
    assert_eq!(answered, [true; 2]);
    // The normal code never comes back: the axis stays busy, and a procedure ends at the limit of an answer.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    pair.axis.ask(monitor(0x07)).unwrap();
    let mut text = ReadText::new(TypeCode::short(0x01));
    let (mut from, mut ended) = (None, None);
    for _ in 0..200 {
        pair.update();
        if let Heard::Main(response) = &mut pair.received {
            response.code = rtex_block::Code::truncate(0x2a);
        }
        if pair.axis.take_outcome().is_some() {
            from = Some(pair.now);
            assert!(text.start(&mut pair.axis).is_pending());
        } else if from.is_some() {
            let progress = text.receive(&mut pair.axis);
            ended = ended.or((!progress.is_pending()).then_some((progress, pair.now)));
        }
        assert!(from.is_none() || pair.axis.ask(monitor(0x05)).is_err());
    }
    let (progress, at) = ended.unwrap();
    assert_eq!(progress, Progress::Failed { error: Failure::NotSent(AskError::Busy) });
    assert_eq!(at - from.unwrap(), 60);
}

/// CMD_Error that answers a request, or the start of a motion, is the caller's; any other one counts.
#[test]
fn which_refusals_count() {
    let one = NonZeroU16::MIN;
    let limits = limits().with_command_errors(one);
    let on = |mode| {
        let config = AxisConfig::new(mac_id(), mode, 500_000, limits);
        let mut pair = Pair::with(config, DriveConfig::new(mac_id(), CODES));
        pair.switch_on();
        pair
    };
    let mut pair = on(ActiveCode::CyclicPosition);
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x31)) };
    assert_eq!(pair.ask(monitor(0xee)), refused);
    let mut pair = on(ActiveCode::ProfilePosition);
    pair.axis.start_move(0xee, 5, 5).unwrap();
    assert_eq!(pair.end_of_move(), Progress::Failed { error: Failure::CommandError(ErrorCode(0x31)) });
    assert_eq!(pair.axis.state(), AxisState::On);
    // The normal command is refused while a request is out: that is no answer to it.
    let mut pair = on(ActiveCode::CyclicPosition);
    pair.axis.ask(monitor(0x07)).unwrap();
    pair.update();
    pair.received = Heard::Main(with_first_byte(answer(0xa0, 0xc1, 0x34, 0), 0x89 | pair.counter.last().get() << 5));
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::CommandError(ErrorCode(0x34))));
    // A code that was not asked for is refused.
    let mut pair = on(ActiveCode::CyclicPosition);
    pair.update();
    pair.received = Heard::Main(with_first_byte(answer(0xaa, 0xc1, 0x31, 0), 0x89 | pair.counter.last().get() << 5));
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::CommandError(ErrorCode(0x31))));
}

/// A motion that has ended and was not taken yet leaves the set-point alone.
#[test]
fn a_motion_that_is_over_is_over() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move(0x11, 30_000, 2_000_000).unwrap();
    pair.until("ended", |pair| pair.axis.profile().unwrap().stage() == MoveStage::Ended);
    pair.until("at the target", |pair| pair.drive.position() == 30_000);
    (0..4).for_each(|_| pair.update());
    pair.axis.start_move(0x11, -10_000, 2_000_000).unwrap();
    pair.until("ended", |pair| pair.axis.profile().unwrap().stage() == MoveStage::Ended);
    pair.until("at the target", |pair| pair.drive.position() == 20_000);
    (0..4).for_each(|_| pair.update());
    pair.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
    let block = pair.axis.transmission(Turn::Valid(pair.counter.last().next())).main.emit();
    assert_eq!(i32::from_le_bytes(block[4..8].try_into().unwrap()), 20_000);
    (0..50).for_each(|_| pair.update());
    assert_eq!((pair.drive.position(), pair.axis.state()), (20_000, AxisState::On));
}

/// The time that a procedure has left is that of its present request.
#[test]
fn what_is_left_of_a_limit() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new().with_echo_lag(2));
    pair.until("off", |pair| pair.axis.state() == AxisState::Off);
    let mut text = ReadText::new(TypeCode::short(0x01));
    let left: Vec<_> = (0..6)
        .map(|_| {
            pair.update();
            match text.receive(&mut pair.axis) {
                Progress::Pending { left } => left,
                other => panic!("{other:?}"),
            }
        })
        .collect();
    // Asked at the first call, answered five update periods later; the next group has the whole limit again.
    assert_eq!(left, [60, 59, 58, 57, 56, 60]);
}

/// What a motion with a latch sends: code 17h with type, Latch_Sel1, Monitor_Sel and speed, which may change.
#[test]
fn what_a_motion_sends() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
    pair.axis.start_move_with_latch(0x11, 3_000_000, 1_000, Nibble::new(3).unwrap(), 0x09).unwrap();
    pair.until("moving", |pair| pair.axis.profile().unwrap().stage() == MoveStage::Moving);
    let block = |pair: &Pair| pair.axis.clone().transmission(Turn::Valid(pair.counter.last().next())).main.emit();
    assert_eq!(block(&pair)[1..4], [0x17, 0x80, 0]);
    assert_eq!(block(&pair)[4..8], 3_000_000_i32.to_le_bytes());
    assert_eq!(block(&pair)[8..], [0x11, 0, 3, 0x09, 0xe8, 0x03, 0, 0]);
    pair.axis.set_move_speed(-2).unwrap();
    assert_eq!(block(&pair)[12..], [0xfe, 0xff, 0xff, 0xff]);
}

/// Axis 1 of two that slows down, by the policy; the first has an alarm.
struct Two {
    ring: Ring<2>,
    alarm: Heard,
    echo: u8,
}

impl Two {
    fn new(mode: ActiveCode, per_update: u32) -> Self {
        let limits = Limits::new(NonZeroU16::new(9).unwrap(), 30);
        let axis = |number, mode| AxisConfig::new(MacId::new(number).unwrap(), mode, 500_000, limits);
        let second = axis(9, mode).with_stop(Some(StopCategory::One)).with_deceleration(per_update);
        let ring = Ring::new([axis(8, ActiveCode::CyclicPosition), second].map(Axis::new), 0).unwrap();
        let mut two = Self { ring, alarm: Heard::Nothing, echo: 0 };
        two.update(0x41);
        two.update(0x41);
        two.ring.switch_on().unwrap();
        two.update(0xc1);
        two.update(0xc1);
        assert!(two.ring.all_are(AxisState::On));
        two
    }

    /// Responses with this byte 2 from axis 1; gives its control bytes and its Command_Data1.
    fn update(&mut self, status: u8) -> ([u8; 2], i32) {
        let code = 0x20;
        let first = with_first_byte(answer(code, status, 0, 0), 0x88 | self.echo << 5);
        let first = if self.alarm == Heard::Nothing { Heard::Main(first) } else { self.alarm };
        let second = Heard::Main(with_first_byte(answer(code, status, 0, 0), 0x89 | self.echo << 5));
        let [_, command] = self.ring.update(&[first, second], 0);
        self.echo = command.main.update_counter.get();
        let block = command.main.emit();
        ([block[2], block[3]], i32::from_le_bytes(block[4..8].try_into().unwrap()))
    }

    fn axis(&mut self) -> &mut Axis {
        &mut self.ring.axes_mut()[1]
    }

    fn fail(&mut self) -> ([u8; 2], i32) {
        self.alarm = Heard::Main(with_first_byte(answer(0x20, 0x61, 0, 0), 0x88 | self.echo << 5));
        self.update(0xc1)
    }
}

#[test]
fn negative_speeds_slow_down_towards_zero() {
    let mut two = Two::new(ActiveCode::CyclicVelocity, 40);
    two.axis().set_rate(-100).unwrap();
    assert_eq!(two.update(0xc1).1, -100);
    // The speed that was asked for in the period of the failure was never sent: it plays no part.
    two.axis().set_rate(-500).unwrap();
    let speeds = [two.fail().1, two.update(0xc1).1];
    assert_eq!(speeds, [-60, -20]);
    assert_eq!(two.update(0xc1), ([0, 0], 0));
    let mut two = Two::new(ActiveCode::CyclicPosition, 40);
    two.axis().set_position(-100).unwrap();
    two.update(0xc1);
    two.axis().set_position(-200).unwrap();
    // Nor does this set-point.
    assert_eq!([two.fail().1, two.update(0xc1).1], [-160, -180]);
    // A torque has no speed to be taken away: off at once.
    let mut two = Two::new(ActiveCode::CyclicTorque, 40);
    two.axis().set_rate(50).unwrap();
    assert_eq!(two.fail(), ([0, 0], 0));
}

/// Switched off by the caller while it slows down, the axis is off at once, for the first reason.
#[test]
fn switching_off_ends_the_deceleration() {
    let mut two = Two::new(ActiveCode::CyclicVelocity, 1);
    two.axis().set_rate(1_000).unwrap();
    two.update(0xc1);
    two.fail();
    assert_eq!(two.axis().state(), AxisState::Stopping(StopReason::OtherAxis { place: 0 }));
    two.ring.switch_off();
    assert_eq!(two.axis().state(), AxisState::Stopped(StopReason::OtherAxis { place: 0 }));
    assert_eq!(two.update(0xc1).0, [0, 0]);
}

/// Smooth_Stop goes out in PP while the axis slows down, whatever the caller had set before.
#[test]
fn smooth_stop_beside_the_bits_of_the_caller() {
    for control in [ControlBits::empty(), ControlBits::SMOOTH_STOP, ControlBits::EX_OUT1] {
        let mut two = Two::new(ActiveCode::ProfilePosition, 1);
        two.axis().set_control(control);
        // In_Progress: there is a motion to be ended.
        two.update(0xc3);
        two.alarm = Heard::Main(with_first_byte(answer(0x20, 0x61, 0, 0), 0x88 | two.echo << 5));
        let ([two_, three], _) = two.update(0xc3);
        assert_eq!((two_, three & 0x40), (0x80, 0x40), "{control}");
        assert_eq!(three & 0x01, u8::from(control == ControlBits::EX_OUT1));
    }
}

/// Homing ends with its own flags: the fall of Homing_Complete, or In_Progress that was 1. What stays as it was is no end.
#[test]
fn which_flags_end_a_homing() {
    type Spoil = fn(&mut StatusFlags);
    let keep: Spoil = |_| {};
    let complete: Spoil = |status| status.insert(StatusFlags::HOMING_COMPLETE);
    let still: Spoil = |status| status.remove(StatusFlags::IN_PROGRESS);
    let neither: Spoil = |status| {
        status.insert(StatusFlags::HOMING_COMPLETE);
        status.remove(StatusFlags::IN_PROGRESS);
    };
    for (spoil, ends) in [(keep, true), (complete, true), (still, true), (neither, false)] {
        let mut pair = Pair::on(ActiveCode::ProfilePosition, Behaviour::new());
        let mut home = Home::new(0xc8, 1_000);
        let mut ended = Progress::Pending { left: 0 };
        for _ in 0..2_000 {
            pair.update();
            if let Heard::Main(response) = &mut pair.received {
                spoil(&mut response.status);
            }
            ended = home.receive(&mut pair.axis);
            if !ended.is_pending() {
                break;
            }
        }
        let want = if ends { Progress::Done { value: () } } else { Progress::Failed { error: Failure::TimedOut } };
        assert_eq!(ended, want);
        // The new coordinates are there: the origin is 0, and the motor close to it.
        assert!(pair.drive.position().abs() < 2_000, "{}", pair.drive.position());
    }
}

/// Arming that is refused fails at once.
#[test]
fn a_latch_that_cannot_be_armed() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let mut latch = Latch::first(0xee, Nibble::ZERO, 300);
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x31)) };
    assert_eq!(pair.run(|axis| latch.receive(axis)), refused);
    assert!(pair.now < 100);
}

/// The servo-off after a command: counter one on, Servo_On cleared, all else kept; none after a block at which a drive does
/// not look, or that it refuses.
#[test]
fn servo_off_after_a_command() {
    let after = |hex: [u8; 4]| {
        let mut block = [7; 16];
        block[..4].copy_from_slice(&hex);
        block[9] = 0;
        ServoOff::after(&Command::parse(&block).unwrap())
            .map(|off| (off.emit()[..4].to_vec(), off.emit()[4..] == block[4..]))
    };
    assert_eq!(after([0x69, 0x20, 0x90, 0x03]), Some((vec![0x09, 0x20, 0x10, 0x03], true)));
    assert_eq!(after([0x09, 0x2a, 0x80, 0x00]), Some((vec![0x29, 0x2a, 0x00, 0x00], true)));
    assert_eq!(after([0x29, 0x17, 0x00, 0x00]), Some((vec![0x49, 0x17, 0x00, 0x00], true)));
    for none in [[0x09, 0x00, 0x80, 0], [0x09, 0x0a, 0x80, 0], [0x09, 0x27, 0x80, 0]] {
        assert_eq!(after(none), None, "{none:x?}");
    }
}

/// A servo-off at any time is a servo-off: the block of an axis that an alarm has stopped.
#[test]
fn an_alarm_is_answered_with_servo_off() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    pair.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
    (0..3).for_each(|_| pair.update());
    let block = pair.axis.transmission(Turn::Valid(pair.counter.last().next())).main.emit();
    assert!(CommandBlock::of(&block).unwrap().is_servo_off());
    assert!(pair.axis.ask(NonCyclicCommand::IDLE).is_err());
}
