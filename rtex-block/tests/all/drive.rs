//! One axis and one drive: requests, profile motion, modes, supervision, and the pipeline of the echoes.

use core::num::NonZeroU16;

use rtex_block::device::{Drive, DriveConfig, Fault, OpenCodes};
use rtex_block::master::{
    ActiveCode, AskError, Axis, AxisConfig, AxisState, CommandCounter, Failure, Heard, Limits, MoveStage, Progress,
    SetpointError, StopReason,
};
use rtex_block::type_code::{homing, monitor, parameter, profile, system_id};
use rtex_block::{
    Alarm, Arguments, Command, Command32, ControlBits, CyclicCode, ErrorCode, Execution, MacId, Nibble,
    NonCyclicCommand, NonCyclicResponse, Pr, ProfileFlags, Response, Response32, Results, StatusFlags, SubCode,
    SubCommand, TypeCode, UpdateCounter,
};

const CODES: OpenCodes = OpenCodes {
    profile_absolute: 0x70,
    parameter_read: TypeCode::short(0x71),
    parameter_store: TypeCode::short(0x72),
    alarm_active: TypeCode::short(0x73),
    alarm_history: TypeCode::short(0x74),
    alarm_clear: TypeCode::short(0x75),
    alarm_attributes: TypeCode::short(0x76),
    parameter_initial: TypeCode::short(0x77),
    parameter_count: TypeCode::short(0x7a),
    latch_arm: 0x78,
    homing: 0x79,
    communication_lost: Alarm { main: 80, sub: 0 },
};

fn mac_id() -> MacId {
    MacId::new(9).unwrap()
}

struct Pair {
    axis: Axis,
    drive: Drive,
    counter: CommandCounter,
    sent: rtex_block::master::Turn,
    response: Option<Response>,
}

impl Pair {
    fn new(mode: ActiveCode) -> Self {
        let some = NonZeroU16::new(6).unwrap();
        let limits = Limits::new(some, 40).with_ready(Some(100));
        let config = AxisConfig::new(mac_id(), mode, 500_000, limits);
        Self {
            axis: Axis::new(config),
            drive: Drive::new(DriveConfig::new(mac_id(), CODES)),
            counter: CommandCounter::new(3),
            sent: rtex_block::master::Turn::Invalid,
            response: None,
        }
    }

    fn on(mode: ActiveCode) -> Self {
        let mut pair = Self::new(mode);
        pair.until(|pair| pair.axis.state() == AxisState::Off);
        pair.axis.switch_on().unwrap();
        pair.until(|pair| pair.axis.state() == AxisState::On);
        pair
    }

    fn update(&mut self) {
        let received = self.response.map_or(Heard::Nothing, Heard::Main);
        self.axis.hear(self.sent, &received, 0);
        self.sent = self.counter.next();
        let block = self.drive.hear(&self.axis.transmission(self.sent).main.emit()).unwrap();
        self.response = Some(Response::parse_strict(&block).unwrap());
    }

    fn until(&mut self, done: impl Fn(&Self) -> bool) {
        for _ in 0..20_000 {
            if done(self) {
                return;
            }
            self.update();
        }
        panic!("{:?}, {:?}", self.axis.state(), self.drive.alarm());
    }

    fn ask(&mut self, request: NonCyclicCommand) -> Progress<NonCyclicResponse> {
        while self.axis.ask(request).is_err() {
            self.update();
        }
        for _ in 0..100 {
            self.update();
            if let Some(progress) = self.axis.take_outcome() {
                return progress;
            }
        }
        panic!("no outcome");
    }

    fn value(&mut self, request: NonCyclicCommand) -> i32 {
        match self.ask(request) {
            Progress::Done { value } if value.execution() == Some(Execution::empty()) => value.data().unwrap(),
            other => panic!("{other:?}"),
        }
    }
}

fn about(type_code: TypeCode, index: u16, data: i32) -> Arguments {
    Arguments { type_code, index, data }
}

#[test]
fn requests_of_every_kind() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition);
    pair.until(|pair| pair.axis.state() == AxisState::Off);

    let mut name = Vec::new();
    for group in 0.. {
        let four = pair.value(NonCyclicCommand::SystemId(about(system_id::VENDOR_NAME, group, 0))).to_le_bytes();
        name.extend_from_slice(system_id::text(&four));
        if four[3] == 0 {
            break;
        }
    }
    assert_eq!(name, b"Panasonic");

    let speed_unit = Pr { class: 7, number: 25 }.index();
    assert_eq!(pair.value(NonCyclicCommand::Parameter(about(CODES.parameter_read, speed_unit, 0))), 1);
    assert_eq!(pair.value(NonCyclicCommand::Parameter(about(parameter::WRITE, speed_unit, 0))), 0);
    assert_eq!(pair.value(NonCyclicCommand::Parameter(about(CODES.parameter_read, speed_unit, 0))), 0);
    pair.value(NonCyclicCommand::Parameter(about(CODES.parameter_store, speed_unit, 0)));

    let set = |position| NonCyclicCommand::Homing {
        type_code: homing::SET_ACTUAL_POSITION,
        latch_sel1: Nibble::ZERO,
        latch_sel2: Nibble::ZERO,
        monitor_sel: 0,
        setting_data: position,
    };
    pair.value(set(-77_000));
    assert_eq!(pair.value(NonCyclicCommand::Monitor(about(monitor::APOS, 0, 0))), -77_000);
    pair.update();
    assert_eq!((pair.axis.setpoint(), pair.axis.status().contains(StatusFlags::HOMING_COMPLETE)), (-77_000, true));

    let rejected = |pair: &mut Pair, request| pair.ask(request);
    let unknown = TypeCode::short(0xee);
    for (request, code) in [
        (NonCyclicCommand::Monitor(about(unknown, 0, 0)), ErrorCode::TYPE_CODE),
        (NonCyclicCommand::Monitor(about(monitor::APOS, 1, 0)), ErrorCode::ARGUMENT),
        (NonCyclicCommand::Monitor(about(monitor::APOS, 0, 5)), ErrorCode::ARGUMENT),
        (NonCyclicCommand::Parameter(about(parameter::WRITE, 0xffff, 0)), ErrorCode::ARGUMENT),
        (NonCyclicCommand::SystemId(about(system_id::MODEL, 99, 0)), ErrorCode::ARGUMENT),
        (NonCyclicCommand::Reset(about(rtex_block::type_code::reset::SOFTWARE, 1, 0)), ErrorCode::ARGUMENT),
    ] {
        assert_eq!(
            rejected(&mut pair, request),
            Progress::Failed { error: Failure::CommandError(code) },
            "{request:?}"
        );
    }
    assert_eq!(pair.axis.state(), AxisState::Off);
    // With the servo on the set-point would stay in the old coordinates, so the master does not send it.
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    assert_eq!(pair.axis.ask(set(0)), Err(AskError::ServoOn));
    assert_eq!(pair.axis.state(), AxisState::On);
}

#[test]
fn alarms_stop_the_axis_and_can_be_read_and_cleared() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    pair.drive.set_warning(0xa0);
    pair.drive.set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
    pair.until(|pair| matches!(pair.axis.state(), AxisState::Stopped(_)));
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::Alarm));
    assert_eq!(pair.axis.set_position(0), Err(SetpointError::NotOn));
    // Requests work while the axis is stopped.
    let data = pair.value(NonCyclicCommand::Alarm(about(CODES.alarm_active, 0, 0)));
    assert_eq!(data, Results::alarm_data(Alarm { main: 38, sub: 1 }, 0xa0));
    let history = pair.value(NonCyclicCommand::Alarm(about(CODES.alarm_history, 1, 0)));
    assert_eq!(history, Results::alarm_data(Alarm { main: 38, sub: 1 }, 0));
    pair.value(NonCyclicCommand::Alarm(about(CODES.alarm_clear, 0, 0)));
    assert_eq!(pair.drive.alarm(), None);
    assert!(pair.axis.switch_on().is_err());
    pair.axis.clear();
    pair.until(|pair| pair.axis.state() == AxisState::Off);
    pair.axis.switch_on().unwrap();
}

/// Code 10h, then 17h; the motion ends on its target and the next one can start.
#[test]
fn profile_motion() {
    let mut pair = Pair::on(ActiveCode::ProfilePosition);
    for (type_code, target, want) in
        [(profile::RELATIVE, 30_000, 30_000), (profile::RELATIVE, -10_000, 20_000), (CODES.profile_absolute, -5, -5)]
    {
        pair.axis.start_move(type_code, target, 400_000).unwrap();
        assert_eq!(pair.axis.start_move(type_code, target, 1), Err(SetpointError::Busy));
        let mut seen = Vec::new();
        loop {
            pair.update();
            seen.push(
                pair.axis.profile().map(|profile| (profile.stage(), profile.flags().contains(ProfileFlags::NEAR))),
            );
            if let Progress::Done { .. } = pair.axis.take_move().unwrap() {
                break;
            }
            assert!(seen.len() < 10_000);
        }
        assert!(seen.contains(&Some((MoveStage::Starting, false))) && seen.contains(&Some((MoveStage::Moving, true))));
        pair.until(|pair| pair.axis.status().contains(StatusFlags::IN_POSITION));
        assert!((pair.drive.position() - want).abs() <= 20, "{}", pair.drive.position());
    }
    // An unknown type is rejected, and the axis goes on.
    pair.axis.start_move(0xee, 5, 5).unwrap();
    let rejected = Some(Progress::Failed { error: Failure::CommandError(ErrorCode::TYPE_CODE) });
    pair.until(|pair| pair.axis.clone().take_move() == rejected);
    assert_eq!(pair.axis.take_move(), rejected);
    assert_eq!(pair.axis.take_move(), None);
    assert_eq!(pair.axis.state(), AxisState::On);
}

/// Pause and speed 0 keep In_Progress at 1; Smooth_Stop and Hard_Stop end the motion.
#[test]
fn profile_motion_paused_and_stopped() {
    for (bit, ends) in [(ControlBits::PAUSE, false), (ControlBits::SMOOTH_STOP, true), (ControlBits::HARD_STOP, true)] {
        let mut pair = Pair::on(ActiveCode::ProfilePosition);
        pair.axis.start_move(profile::RELATIVE, 3_000_000, 400_000).unwrap();
        (0..200).for_each(|_| pair.update());
        assert!(pair.axis.status().contains(StatusFlags::IN_PROGRESS));
        pair.axis.set_control(bit);
        (0..400).for_each(|_| pair.update());
        let stands = pair.drive.position();
        (0..20).for_each(|_| pair.update());
        assert_eq!(pair.drive.position(), stands);
        assert_eq!(pair.axis.status().contains(StatusFlags::IN_PROGRESS), !ends, "{bit:?}");
        // Ended before its target, and by the caller.
        let broken = Some(Progress::Failed { error: Failure::Stopped(StopReason::Requested) });
        assert_eq!(pair.axis.take_move() == broken, ends, "{bit:?}");
        assert_eq!(pair.axis.state(), AxisState::On);
    }
    let mut pair = Pair::on(ActiveCode::ProfilePosition);
    pair.axis.start_move(profile::RELATIVE, 100_000, 400_000).unwrap();
    (0..100).for_each(|_| pair.update());
    pair.axis.set_move_speed(0).unwrap();
    (0..400).for_each(|_| pair.update());
    assert!(pair.axis.status().contains(StatusFlags::IN_PROGRESS));
    pair.axis.set_move_speed(800_000).unwrap();
    pair.until(|pair| matches!(pair.axis.clone().take_move(), Some(Progress::Done { .. })));
}

#[test]
fn velocity_and_torque() {
    for mode in [ActiveCode::CyclicVelocity, ActiveCode::CyclicTorque] {
        let mut pair = Pair::on(mode);
        assert_eq!(pair.axis.set_position(1), Err(SetpointError::Mode));
        let from = pair.drive.position();
        pair.axis.set_rate(100_000).unwrap();
        (0..50).for_each(|_| pair.update());
        assert!(pair.drive.position() > from + 1_000);
        pair.axis.switch_off();
        pair.until(|pair| pair.axis.state() == AxisState::Off);
        assert!(!pair.drive.is_active());
    }
}

#[test]
fn a_step_that_is_too_large_is_refused_and_changes_nothing() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    let before = pair.axis;
    assert_eq!(pair.axis.set_position(200_001), Err(SetpointError::Step { step: 200_001 }));
    assert_eq!(pair.axis, before);
    pair.axis.set_position(200_000).unwrap();
    (0..5).for_each(|_| pair.update());
    assert_eq!(pair.drive.alarm(), None);
}

/// Positions are numbers that wrap: from 7FFFFFFFh one step on is 80000000h.
#[test]
fn a_move_across_the_wrap() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition);
    pair.until(|pair| pair.axis.state() == AxisState::Off);
    pair.value(NonCyclicCommand::Homing {
        type_code: homing::SET_ACTUAL_POSITION,
        latch_sel1: Nibble::ZERO,
        latch_sel2: Nibble::ZERO,
        monitor_sel: 0,
        setting_data: i32::MAX - 5,
    });
    pair.until(|pair| pair.axis.can_switch_on().is_ok());
    pair.axis.switch_on().unwrap();
    pair.until(|pair| pair.axis.state() == AxisState::On);
    pair.axis.set_position(i32::MIN + 100).unwrap();
    pair.until(|pair| pair.drive.position() == i32::MIN + 100);
    assert_eq!(pair.drive.alarm(), None);
}

/// The counter of command N comes with the code of command N - 1; with two communications an update the second
/// response has both.
#[test]
fn pipeline_of_the_echoes() {
    let command = |counter, noncyclic| Command { noncyclic, ..Command::idle(mac_id(), counter) };
    let ask = NonCyclicCommand::Monitor(about(monitor::APOS, 0, 0));
    let mut drive = Drive::new(DriveConfig::new(mac_id(), CODES).with_communications(2));
    let mut counter = UpdateCounter::ZERO;
    let mut last_code = 0x00;
    for k in 0..40 {
        counter = counter.next();
        let sent = command(counter, if k % 3 == 0 { ask } else { NonCyclicCommand::IDLE });
        let code = sent.code().get();
        let first = Response::parse(&drive.hear(&sent.emit()).unwrap()).unwrap();
        let second = Response::parse(&drive.hear(&sent.emit()).unwrap()).unwrap();
        assert_eq!((first.code.get(), first.update_counter_echo), (last_code, counter));
        assert_eq!((second.code.get(), second.update_counter_echo), (code, counter));
        last_code = code;
    }
    assert_eq!(drive.alarm(), None);
}

/// A NOP and a block of zeros leave the servo as it is; the same with code 20h switches it off.
#[test]
fn zeros_do_not_switch_off() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    let mut zeros = [0; 16];
    zeros[0] = mac_id().get();
    for _ in 0..20 {
        pair.drive.hear(&zeros).unwrap();
    }
    assert!(pair.drive.is_active());
    let off = pair.axis.transmission(pair.sent).main;
    pair.drive.hear(&Command { control: ControlBits::empty(), ..off }.emit()).unwrap();
    assert!(!pair.drive.is_active());
}

/// Faulty blocks are thrown away; if they last the drive raises the alarm of the fault and releases the motor.
#[test]
fn lasting_faults_raise_alarms() {
    type Spoil = fn(&mut [u8; 16]);
    let cases: [(Spoil, ErrorCode, Alarm); 3] = [
        (|b| b[0] ^= 1, ErrorCode::MAC_ID, Alarm::CYCLIC_DATA),
        (|b| b[0] |= 0x80, ErrorCode::DIRECTION, Alarm::CYCLIC_DATA),
        (|b| b[1] = 0x70, ErrorCode::CYCLIC_CODE, Alarm::CYCLIC_CODE),
    ];
    for (spoil, error, alarm) in cases {
        let mut pair = Pair::on(ActiveCode::CyclicPosition);
        let mut block = pair.axis.transmission(pair.sent).main.emit();
        spoil(&mut block);
        let limit = pair.drive.config().fault_limit;
        for k in 1..=limit {
            assert!(pair.drive.is_active());
            let response = Response::parse(&pair.drive.hear(&block).unwrap()).unwrap();
            if k > 1 {
                assert_eq!(response.noncyclic(), NonCyclicResponse::CommandError(error));
                assert_eq!(response.code.get(), block[1] & 0x7f);
            }
        }
        assert_eq!((pair.drive.is_active(), pair.drive.alarm()), (false, Some(alarm)));
    }
    // An undefined non-cyclic code is only answered: no alarm, and the cyclic half goes on.
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    let mut counter = pair.counter.last();
    for _ in 0..50 {
        counter = counter.next();
        let control = ControlBits::SERVO_ON;
        let mut block = Command { control, ..Command::idle(mac_id(), counter) }.emit();
        block[1] = 0x23;
        pair.drive.hear(&block).unwrap();
    }
    let response = Response::parse(&pair.drive.hear(&[9; 16]).unwrap()).unwrap();
    assert_eq!(
        (response.code.get(), response.noncyclic()),
        (0x23, NonCyclicResponse::CommandError(ErrorCode::NON_CYCLIC_CODE))
    );
    assert!(pair.drive.is_active());
}

#[test]
fn a_counter_that_stands_still_raises_err86_2() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    let block = pair.axis.transmission(pair.sent).main.emit();
    let limit = pair.drive.config().counter_limit;
    for _ in 0..limit {
        assert_eq!(pair.drive.alarm(), None);
        pair.drive.hear(&block).unwrap();
    }
    assert_eq!(pair.drive.alarm(), Some(Alarm::UPDATE_COUNTER));
}

#[test]
fn sub_blocks() {
    let mut drive = Drive::new(DriveConfig::new(mac_id(), CODES));
    let mut counter = UpdateCounter::ZERO;
    let mut exchange = |sub: SubCommand, spoil: u8| {
        let mut seen = None;
        for _ in 0..2 {
            counter = counter.next();
            let mut block = Command32 { main: Command::idle(mac_id(), counter), sub }.emit();
            block[16] ^= spoil;
            seen = Some(Response32::parse(&drive.hear(&block).unwrap()).unwrap());
        }
        seen.unwrap()
    };
    let ask = |code, type_code, index| SubCommand { code, type_code, index, ..SubCommand::IDLE };
    let model = exchange(ask(SubCode::SystemId, 0x01, 1), 0);
    assert_eq!((model.sub.data1.to_le_bytes(), model.sub.index, model.sub.error_code()), (*b"soni", 1, None));
    assert_eq!(exchange(ask(SubCode::Monitor, 0xee, 0), 0).sub.error_code(), Some(ErrorCode::TYPE_CODE));
    let undefined = exchange(ask(SubCode::Monitor, 7, 0), 0x0f);
    assert_eq!((undefined.sub.error_code(), undefined.sub.code.get()), (Some(ErrorCode::NON_CYCLIC_CODE), 5));
    assert_eq!(exchange(ask(SubCode::Normal, 0, 0), 0x80).sub.error_code(), Some(ErrorCode::DIRECTION));
    assert_eq!(exchange(ask(SubCode::Normal, 0, 0), 0).sub.error_code(), None);
}

#[test]
fn a_pair_of_codes_that_does_not_go_together() {
    let mut drive = Drive::new(DriveConfig::new(mac_id(), CODES));
    let mut block = Command::idle(mac_id(), UpdateCounter::ZERO.next()).emit();
    block[1] = 0x27;
    drive.hear(&block).unwrap();
    let response = Response::parse(&drive.hear(&block).unwrap()).unwrap();
    assert_eq!(response.noncyclic(), NonCyclicResponse::CommandError(ErrorCode::CYCLIC_MODE));
    assert_eq!(response.code.cyclic(), Some(CyclicCode::CyclicPosition));
}

#[test]
fn inputs_and_power_show_in_the_status() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    pair.drive.set_inputs(0b0001_0010);
    (0..3).for_each(|_| pair.update());
    assert!(
        pair.axis.status().contains(StatusFlags::POT)
            && pair.axis.status().contains(StatusFlags::SI_MON2)
            && !pair.axis.status().contains(StatusFlags::ALARM)
    );
    pair.drive.set_fault(Fault::NoMainPower);
    pair.until(|pair| pair.axis.state() != AxisState::On);
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::NotReady));
}

#[test]
fn limits_of_the_states() {
    // Servo_Ready never comes.
    let mut pair = Pair::new(ActiveCode::CyclicPosition);
    pair.drive.set_fault(Fault::NoMainPower);
    pair.until(|pair| pair.axis.state() != AxisState::Starting);
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::ReadyTimeout));
    // Servo_Active never comes.
    let mut pair = Pair::new(ActiveCode::CyclicPosition);
    pair.drive = Drive::new(pair.drive.config().with_servo_on_updates(u16::MAX));
    pair.until(|pair| pair.axis.state() == AxisState::Off);
    pair.axis.switch_on().unwrap();
    pair.until(|pair| pair.axis.state() != AxisState::SwitchingOn);
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::ActiveTimeout));
    // A request is never answered.
    let mut pair = Pair::new(ActiveCode::CyclicPosition);
    pair.until(|pair| pair.axis.state() == AxisState::Off);
    pair.drive = Drive::new(pair.drive.config().with_busy_exchanges(u16::MAX));
    let read = NonCyclicCommand::Parameter(about(CODES.parameter_read, 0x0719, 0));
    assert_eq!(pair.ask(read), Progress::Failed { error: Failure::TimedOut });
    // Commands are refused for the limit.
    let mut pair = Pair::on(ActiveCode::CyclicPosition);
    for _ in 0..10 {
        pair.update();
        let response = pair.response.unwrap();
        pair.response = Some(response.with_noncyclic(&NonCyclicResponse::CommandError(ErrorCode::ARGUMENT)));
    }
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::CommandError(ErrorCode::ARGUMENT)));
}
