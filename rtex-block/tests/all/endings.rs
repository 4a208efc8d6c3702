//! Every motion and every request has one true end. Each procedure is cut at every period by every cause, on a drive model that
//! decides the open points both ways.

use crate::common::{CODES, Pair};
use rtex_block::device::{Behaviour, DriveConfig, Fault, Quirks};
use rtex_block::master::procedure::{
    AlarmAttributes, AlarmHistory, Backup, ClearAlarm, Home, Latch, ParameterValue, Procedure, ReadText,
    RebaseWithServoOn, Restore, SetPosition,
};
use rtex_block::master::{
    ActiveCode, Arrival, AskError, Axis, AxisConfig, AxisState, Failure, Heard, Progress, StopCategory, StopReason,
};
use rtex_block::{Alarm, ErrorCode, MacId, Nibble, NonCyclicResponse, Pr, TypeCode};

/// What cuts a procedure.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cause {
    Alarm,
    Power,
    EmergencyStop,
    Drop,
    Silence,
    Refusal,
    Stop(StopCategory),
    SwitchOff,
}

const CAUSES: [Cause; 10] = [
    Cause::Alarm,
    Cause::Power,
    Cause::EmergencyStop,
    Cause::Drop,
    Cause::Silence,
    Cause::Refusal,
    Cause::Stop(StopCategory::Zero),
    Cause::Stop(StopCategory::One),
    Cause::Stop(StopCategory::Two),
    Cause::SwitchOff,
];

/// Homing_Complete in all its ways, with the flags that end a motion late or not.
fn behaviours() -> impl Iterator<Item = Behaviour> {
    (0..32_u8).map(|bits| {
        let each = [
            Quirks::HOMED_AT_START,
            Quirks::HOMED_THROUGH_HOMING,
            Quirks::UNHOMED_BY_SERVO_OFF,
            Quirks::UNHOMED_BY_ALARM,
            Quirks::BUSY_WHILE_HOMING,
        ];
        let quirks = each.into_iter().enumerate().filter(|(k, _)| bits >> k & 1 != 0).map(|(_, quirk)| quirk).collect();
        Behaviour::new()
            .with_quirks(quirks)
            .with_echo_lag(bits % 3)
            // Alarm, Servo_Ready and Servo_Active are shown up to two exchanges after the end of In_Progress.
            .with_status_late([0, 0, 0, 0, 0, bits % 3, bits % 2, bits / 8 % 2])
    })
}

/// An axis on in PP, standing at 100,000.
fn pair(behaviour: Behaviour) -> Pair {
    pair_at(behaviour, -1_000)
}

/// The same, so far from the origin.
fn pair_at(behaviour: Behaviour, distance: i32) -> Pair {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::ProfilePosition, 500_000, crate::common::limits());
    let drive = DriveConfig::new(mac_id, CODES).with_homing_distance(distance);
    let mut pair = Pair::with(config.with_deceleration(50), drive);
    pair.drive.set_behaviour(behaviour);
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    let homed_before = behaviour.quirks.contains(Quirks::HOMED_AT_START);
    if homed_before {
        let mut set = SetPosition::actual(100_000);
        assert!(matches!(pair.run(|axis| set.receive(axis)), Progress::Done { .. }));
    }
    pair.switch_on();
    pair
}

/// The cause, once, before an update period; refusals go on for eight of them.
fn cut(pair: &mut Pair, cause: Cause, since: u32) {
    match (cause, since) {
        (Cause::Alarm, 0) => pair.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
        (Cause::Power, 0) => pair.drive.set_fault(Fault::NoMainPower),
        (Cause::EmergencyStop, 0) => pair.drive.set_fault(Fault::EmergencyStop),
        (Cause::Drop, 0) => pair.drive.set_fault(Fault::ServoDrop),
        (Cause::Silence, 0) => pair.drive.set_fault(Fault::Silent),
        (Cause::Stop(category), 0) => pair.axis.stop(category),
        (Cause::SwitchOff, 0) => pair.axis.switch_off(),
        (Cause::Refusal, 0..8) => {
            if let Heard::Main(response) = &mut pair.received {
                let refused = NonCyclicResponse::CommandError(ErrorCode(0x0021));
                *response = response.with_noncyclic(&refused);
            }
        }
        _ => {}
    }
}

/// How it ended, cut in this period, and how many periods that took after the cut.
fn ends<T: core::fmt::Debug>(
    pair: &mut Pair,
    cause: Cause,
    at: u32,
    mut receive: impl FnMut(&mut Axis) -> Progress<T>,
) -> (Progress<T>, u32) {
    for period in 0.. {
        if period >= at {
            cut(pair, cause, period - at);
        }
        pair.update();
        let progress = receive(&mut pair.axis);
        if !progress.is_pending() {
            return (progress, period.saturating_sub(at));
        }
        assert!(period < at + 2_000, "{cause:?} at {at}: no end");
    }
    unreachable!()
}

/// The reason of the axis, if it has stopped or is about to.
fn reason(axis: &Axis) -> Option<StopReason> {
    match axis.state() {
        AxisState::Stopped(reason) | AxisState::Stopping(reason) | AxisState::Held(reason) => Some(reason),
        _ => None,
    }
}

/// A failure is the axis's own reason.
fn judge(pair: &Pair, error: Failure, what: &str) {
    match error {
        Failure::Stopped(said) => assert_eq!(Some(said), reason(&pair.axis), "{what}"),
        Failure::ServoOff => assert!(!pair.axis.state().is_servo_on(), "{what}: {}", pair.axis.state()),
        // The answer to the command, or to the start, is what was cut.
        Failure::CommandError(_) | Failure::Execution | Failure::TimedOut | Failure::NotStarted => {}
        other => panic!("{what}: {other}"),
    }
}

/// The drive goes where its motor can go by itself, and says where it is.
fn settle(pair: &mut Pair) -> i32 {
    pair.drive.set_fault(Fault::None);
    (0..60).for_each(|_| pair.update());
    pair.drive.position()
}

#[test]
fn a_profile_motion_cut_at_every_period() {
    let mut done = 0;
    for behaviour in behaviours() {
        for cause in CAUSES {
            for at in 0..90 {
                let mut pair = pair(behaviour);
                let from = pair.drive.position();
                pair.axis.start_move(0x11, 2_000, 2_000_000).unwrap();
                let (progress, took) = ends(&mut pair, cause, at, |axis| axis.take_move().unwrap());
                let what = format!("{cause:?} at {at} with {behaviour:?}: {progress:?}");
                // Eight periods to notice silence and refusals, sixty for a start that does not come, and the end of a smooth stop.
                assert!(took <= 160, "{what} after {took}");
                match progress {
                    Progress::Done { .. } => {
                        done += 1;
                        let by = settle(&mut pair) - from;
                        assert!((by - 2_000).abs() < 60, "{what}: it moved by {by}");
                    }
                    Progress::Failed { error } => judge(&pair, error, &what),
                    Progress::Pending { .. } => unreachable!(),
                }
            }
        }
    }
    assert!(done > 100, "{done}");
}

#[test]
fn a_homing_cut_at_every_period() {
    let mut done = 0;
    for behaviour in behaviours() {
        for cause in CAUSES {
            for at in 0..80 {
                let mut pair = pair(behaviour);
                let (far, mut farthest) = (pair.drive.position(), 0);
                let mut home = Home::new(0xc8, 200);
                let (progress, took) = ends(&mut pair, cause, at, |axis| {
                    farthest = farthest.min(crate::common::actual(axis));
                    home.receive(axis)
                });
                let what = format!("{cause:?} at {at} with {behaviour:?}: {progress:?}");
                assert!(took <= 210, "{what} after {took}");
                match progress {
                    Progress::Done { value: () } => {
                        done += 1;
                        // The origin is there, 1,000 units from where it began, and is 0 from then on.
                        let now = settle(&mut pair);
                        assert!(now.abs() < 60, "{what}: at {now} from {far}");
                        assert!(far != 0 || farthest < -500, "{what}: it went to {farthest}");
                    }
                    Progress::Failed { error } => judge(&pair, error, &what),
                    Progress::Pending { .. } => unreachable!(),
                }
            }
        }
    }
    assert!(done > 100, "{done}");
}

/// A homing that does not end in time does not go on behind the caller's back: the axis stops, and says why.
#[test]
fn a_homing_out_of_time_is_stopped() {
    for limit in 0..16 {
        let mut pair = pair(Behaviour::new());
        let mut home = Home::new(0xc8, limit);
        let ended = pair.run(|axis| home.receive(axis));
        if limit < 3 {
            // Not even begun: four blocks without a motion come first.
            let busy = Progress::Failed { error: Failure::NotSent(AskError::Busy) };
            assert_eq!((ended, reason(&pair.axis)), (busy, None), "{limit}");
            continue;
        }
        assert_eq!(ended, Progress::Failed { error: Failure::TimedOut }, "{limit}");
        assert_eq!(reason(&pair.axis), Some(StopReason::HomingTimeout), "{limit}");
        let stops = (0..60).find(|_| {
            pair.update();
            !pair.drive.is_active()
        });
        assert!(stops.is_some(), "{limit}: the drive goes on");
    }
}

/// A drive may be Busy until it has homed, and that takes longer than the answer to a request; an answer that does not come at all is
/// missed as soon as that of any request.
#[test]
fn a_homing_may_be_busy_all_the_time() {
    for quirks in [Quirks::BUSY_WHILE_HOMING, Quirks::BUSY_WHILE_HOMING.union(Quirks::HOMED_THROUGH_HOMING)] {
        let behaviour = Behaviour::new().with_quirks(quirks);
        let home = |behaviour, limit| {
            let (mut pair, mut home) = (pair_at(behaviour, -40_000), Home::new(0xc8, limit));
            let from = pair.now;
            let ended = pair.run(|axis| home.receive(axis));
            (ended, pair.now - from, pair)
        };
        let (ended, took, mut pair) = home(behaviour, 2_000);
        assert_eq!(ended, Progress::Done { value: () });
        assert!(took > 200 && settle(&mut pair).abs() < 60, "{took}");
        let out_of_time = Progress::Failed { error: Failure::TimedOut };
        for limit in [10, 100, took / 2] {
            let (ended, after, pair) = home(behaviour, limit);
            assert_eq!((ended, reason(&pair.axis)), (out_of_time, Some(StopReason::HomingTimeout)), "{limit}");
            assert!((limit..limit + 80).contains(&after), "{limit}: {after}");
        }
        let (ended, after, pair) = home(behaviour.with_stale_answers(u16::MAX), 2_000);
        assert_eq!((ended, reason(&pair.axis)), (out_of_time, Some(StopReason::HomingTimeout)));
        assert!(after < 80, "{after}");
    }
}

/// A drive that is Busy with a homing when the axis stops, or is switched off: the command is not sent any more, so it cannot begin
/// again when the servo is switched on.
#[test]
fn a_homing_that_was_stopped_is_not_asked_for() {
    let stops = [
        |axis: &mut Axis| axis.stop(StopCategory::Zero),
        |axis: &mut Axis| axis.stop(StopCategory::One),
        |axis: &mut Axis| axis.stop(StopCategory::Two),
        Axis::switch_off,
    ];
    for (which, stop) in stops.into_iter().enumerate() {
        let behaviour = Behaviour::new().with_quirks(Quirks::BUSY_WHILE_HOMING);
        let (mut pair, mut home) = (pair_at(behaviour, -40_000), Home::new(0xc8, 2_000));
        for _ in 0..30 {
            pair.update();
            assert!(home.receive(&mut pair.axis).is_pending());
        }
        stop(&mut pair.axis);
        let ended = pair.axis.take_outcome();
        let why = reason(&pair.axis).map_or(Failure::ServoOff, Failure::Stopped);
        assert_eq!(ended, Some(Progress::Failed { error: why }), "{which}");
        for _ in 0..200 {
            // Homing commands are 4h.
            assert_eq!(pair.axis.transmission(pair.sent).main.noncyclic.code().code(), 0, "{which}");
            pair.update();
        }
        assert!(pair.axis.can_ask(), "{which}");
    }
}

/// A homing under way that is broken off is at an end at once, and not after the time of a homing.
#[test]
fn a_homing_broken_off_ends_at_once() {
    for cause in [Cause::Alarm, Cause::Power, Cause::EmergencyStop, Cause::Drop] {
        let mut pair = pair(Behaviour::new());
        let mut home = Home::new(0xc8, 4_000);
        for _ in 0..9 {
            pair.update();
            assert!(home.receive(&mut pair.axis).is_pending());
        }
        let (progress, took) = ends(&mut pair, cause, 0, |axis| home.receive(axis));
        assert!(matches!(progress, Progress::Failed { error: Failure::Stopped(_) }), "{cause:?}: {progress:?}");
        assert!(took <= 3, "{cause:?}: {took}");
    }
}

/// Requests of several steps: each is done with what the drive really has, or failed, and never without an end.
#[test]
fn every_procedure_cut_at_every_period() {
    let unit = Pr { class: 7, number: 25 };
    let ramp = Pr { class: 8, number: 1 };
    let list = [ParameterValue::new(unit, 1), ParameterValue::new(ramp, 77)];
    for behaviour in behaviours().step_by(3) {
        for cause in CAUSES {
            for at in (0..48).step_by(3) {
                let what = format!("{cause:?} at {at} with {behaviour:?}");
                let mut values = list.map(|parameter| ParameterValue { value: -1, ..parameter });
                let mut entries = [Alarm { main: 1, sub: 1 }; 2];
                let text = run(behaviour, cause, at, ReadText::new(TypeCode::short(0x01)), &what);
                assert!(text.is_none_or(|(_, text)| text.as_bytes() == b"Panasonic"), "{what}");
                if run(behaviour, cause, at, Backup::new(CODES.parameter_read, &mut values), &what).is_some() {
                    assert_eq!(values.map(|parameter| parameter.value), [1, 1_000], "{what}");
                }
                if let Some((pair, ())) = run(behaviour, cause, at, Restore::new(CODES.parameter_read, &list), &what) {
                    assert_eq!(read(pair, ramp), Some(77), "{what}");
                }
                let _ = run(behaviour, cause, at, AlarmHistory::new(CODES.alarm_history, &mut entries), &what);
                let _ = run(behaviour, cause, at, AlarmAttributes::new(CODES.alarm_attributes), &what);
                let _ = run(behaviour, cause, at, ClearAlarm::new(CODES.alarm_clear, 30), &what);
                let latch = Latch::first(0xc7, Nibble::new(5).unwrap(), 120);
                let caught = run(behaviour, cause, at, latch, &what);
                // Nothing triggers it.
                assert!(caught.is_none(), "{what}");
                let set = run(behaviour, cause, at, SetPosition::actual(5), &what);
                assert!(set.is_none(), "{what}: set with the servo on");
            }
        }
    }
}

/// In period `at` of a procedure that begins with the axis on; what it gave if it was done.
fn run<P: Procedure>(
    behaviour: Behaviour,
    cause: Cause,
    at: u32,
    mut procedure: P,
    what: &str,
) -> Option<(Pair, P::Value)> {
    let mut pair = pair(behaviour);
    let mut progress = procedure.start(&mut pair.axis);
    for period in 0..1_500 {
        match progress {
            Progress::Done { value } => return Some((pair, value)),
            Progress::Failed { error } => {
                let known = !matches!(error, Failure::Mode | Failure::NotStarted);
                assert!(known, "{what}: {error}");
                return None;
            }
            Progress::Pending { .. } => {}
        }
        if period >= at {
            cut(&mut pair, cause, period - at);
        }
        pair.update();
        progress = procedure.receive(&mut pair.axis);
    }
    panic!("{what}: no end");
}

/// What a parameter is, on a line that works again.
fn read(mut pair: Pair, pr: Pr) -> Option<i32> {
    pair.drive.set_fault(Fault::None);
    pair.drive.clear_alarm();
    pair.axis.clear();
    let read = rtex_block::Arguments { type_code: CODES.parameter_read, index: pr.index(), data: 0 };
    match pair.ask(rtex_block::NonCyclicCommand::Parameter(read)) {
        Progress::Done { value } => value.data(),
        _ => None,
    }
}

/// A write of which no answer comes is read back: what the drive has taken is done, what it has not taken is not.
#[test]
fn a_write_without_an_answer_is_read_back() {
    let pr = Pr { class: 8, number: 1 };
    for taken in [true, false] {
        let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
        pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
        let list = [ParameterValue::new(pr, if taken { 77 } else { 78 })];
        let mut restore = Restore::new(CODES.parameter_read, &list);
        let mut progress = restore.start(&mut pair.axis);
        let mut writes = 0;
        while progress.is_pending() {
            pair.update();
            if let Heard::Main(response) = &mut pair.received {
                // No answer to the write comes through; of the reading back one says 77, as does the drive.
                if response.code.get() == 0x26 {
                    let mut block = response.emit();
                    writes += u32::from(block[8] == 0x11);
                    block[8] = if block[8] == 0x11 { 0x99 } else { block[8] };
                    if block[8] == 0xc0 {
                        block[12] = 77;
                    }
                    *response = rtex_block::Response::parse(&block).unwrap();
                }
            }
            progress = restore.receive(&mut pair.axis);
        }
        let want = if taken { Progress::Done { value: () } } else { Progress::Failed { error: Failure::TimedOut } };
        assert_eq!((progress, writes > 0), (want, true));
    }
}

/// New coordinates with the servo on: no block with a command position in the old ones goes out once the drive has taken them up,
/// and nothing moves. A drive that refuses leaves all as it was.
#[test]
fn coordinates_change_with_the_servo_on() {
    for (quirks, takes) in [(Quirks::SETS_POSITION_WHILE_ON, true), (Quirks::empty(), false)] {
        for lag in 0..=3 {
            let mut pair =
                Pair::on(ActiveCode::CyclicPosition, Behaviour::new().with_quirks(quirks).with_echo_lag(lag));
            (1..=20).for_each(|k| {
                pair.axis.set_position(k * 100).unwrap();
                pair.update();
            });
            (0..60).for_each(|_| pair.update());
            let mut rebase = RebaseWithServoOn::new(-700_000, 60);
            let mut progress = rebase.start(&mut pair.axis);
            let mut sent = Vec::new();
            while progress.is_pending() {
                let before = pair.drive.position();
                pair.update();
                sent.push((pair.axis.mode(), pair.axis.setpoint()));
                let by = pair.drive.position() - before;
                assert!(by.abs() <= 2 || by == -702_000, "a jump of {by}");
                progress = rebase.receive(&mut pair.axis);
                assert!(sent.len() < 300);
            }
            let want =
                if takes { Progress::Done { value: -700_000 } } else { Progress::Failed { error: Failure::Execution } };
            assert_eq!(progress, want, "{lag}");
            (0..60).for_each(|_| pair.update());
            let at = if takes { -700_000 } else { 2_000 };
            assert_eq!(
                (pair.drive.position(), pair.drive.alarm(), pair.axis.mode()),
                (at, None, ActiveCode::CyclicPosition)
            );
            assert_eq!((pair.axis.state(), pair.axis.arrival()), (AxisState::On, Arrival::OnTime));
        }
    }
    // On its way it does not begin, nor in another mode or with the servo off.
    let mut moving = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let mut rebase = RebaseWithServoOn::new(5, 10);
    for k in 1..=20 {
        moving.axis.set_position(k * 100).unwrap();
        moving.update();
        if k < 2 {
            continue;
        }
        let progress = if k == 2 { rebase.start(&mut moving.axis) } else { rebase.receive(&mut moving.axis) };
        let refused = Progress::Failed { error: Failure::Mode };
        assert!(k < 12 && progress.is_pending() || k >= 12 && progress == refused, "{k}: {progress:?}");
        assert_eq!(moving.axis.mode(), ActiveCode::CyclicPosition);
    }
    for mode in [ActiveCode::ProfilePosition, ActiveCode::CyclicTorque] {
        let mut pair = Pair::on(mode, Behaviour::new());
        let mut rebase = RebaseWithServoOn::new(5, 10);
        assert_eq!(rebase.start(&mut pair.axis), Progress::Failed { error: Failure::Mode });
    }
    let mut off = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    assert_eq!(RebaseWithServoOn::new(5, 10).start(&mut off.axis), Progress::Failed { error: Failure::ServoOff });
}
