//! Procedures that are started again: the second time is as the first, after their end and in the middle.

use crate::common::{CODES, Pair, limits, monitor};
use rtex_block::device::{Behaviour, DriveConfig, Fault, Quirks};
use rtex_block::master::procedure::{
    AlarmAttributes, AlarmHistory, Backup, ClearAlarm, Home, Latch, ParameterValue, Procedure, RebaseWithServoOn,
    Request, Restore, SetPosition,
};
use rtex_block::master::{ActiveCode, AxisConfig, AxisState, Progress};
use rtex_block::{Alarm, MacId, Nibble, Pr, TypeCode};

const ALARM: Alarm = Alarm { main: 38, sub: 1 };

fn pair(mode: ActiveCode, on: bool) -> Pair {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, mode, 500_000, limits());
    let mut pair = Pair::with(config, DriveConfig::new(mac_id, CODES).with_alarm_attributes(5));
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    if on {
        pair.switch_on();
    }
    pair
}

/// How it ended, how often a command other than the normal one went out, and after how many update periods.
fn end<P: Procedure>(pair: &mut Pair, procedure: &mut P) -> (Progress<P::Value>, u32, u32) {
    let (mut commands, mut last, from) = (0, 0, pair.now);
    let mut progress = procedure.start(&mut pair.axis);
    while progress.is_pending() {
        pair.update();
        let code = pair.axis.clone().transmission(pair.sent).main.emit()[1] & 0x0f;
        commands += u32::from(code != 0 && last != code);
        last = code;
        progress = procedure.receive(&mut pair.axis);
        assert!(pair.now - from < 2_000, "it does not end");
    }
    (progress, commands, pair.now - from)
}

/// `before` is done before each time.
fn the_same_again<P: Procedure>(mut pair: Pair, mut procedure: P, before: impl Fn(&mut Pair))
where
    P::Value: PartialEq + core::fmt::Debug,
{
    let once = |pair: &mut Pair, procedure: &mut P| {
        (0..20).for_each(|_| pair.update());
        before(pair);
        end(pair, procedure)
    };
    let first = once(&mut pair, &mut procedure);
    assert!(first.1 > 0, "it sends nothing: {first:?}");
    for _ in 0..2 {
        assert_eq!(once(&mut pair, &mut procedure), first);
    }
    before(&mut pair);
    let first_alarm = pair.drive.alarm().is_some();
    // Left in the middle, at every period.
    for periods in 0..first.2 {
        (0..20).for_each(|_| pair.update());
        before(&mut pair);
        let _progress = procedure.start(&mut pair.axis);
        for _ in 0..periods {
            pair.update();
            let _progress = procedure.receive(&mut pair.axis);
        }
        // What was left may have done it: there is no alarm any more.
        let idle = first_alarm && pair.drive.alarm().is_none();
        let (progress, commands, _) = end(&mut pair, &mut procedure);
        assert_eq!(progress, first.0, "left after {periods}");
        assert!(commands > 0 || idle, "left after {periods}: nothing was sent");
    }
}

#[test]
fn every_procedure_can_be_started_again() {
    let nothing = |_: &mut Pair| {};
    let alarm = |pair: &mut Pair| {
        pair.drive.set_fault(Fault::Alarm(ALARM));
        (0..8).for_each(|_| pair.update());
    };
    let cyclic = ActiveCode::CyclicPosition;
    the_same_again(pair(cyclic, false), Request::new(monitor(0x07)), nothing);
    the_same_again(pair(cyclic, false), SetPosition::actual(700), nothing);
    the_same_again(pair(cyclic, true), RebaseWithServoOn::new(1_000, 50), nothing);
    let place = |number| Pr { class: 7, number };
    let list = [ParameterValue::new(place(25), 1), ParameterValue::new(place(26), 0)];
    the_same_again(pair(cyclic, false), Restore::new(CODES.parameter_read, &list), nothing);
    // The initial value, 1,000, is another: it fails, and the next time it writes again.
    let differs = [ParameterValue::new(Pr { class: 8, number: 1 }, 77)];
    the_same_again(pair(cyclic, false), Restore::new(CODES.parameter_initial, &differs), nothing);
    let mut list = list;
    the_same_again(pair(cyclic, false), Backup::new(CODES.parameter_read, &mut list), nothing);
    let mut entries = [ALARM; 3];
    the_same_again(pair(cyclic, false), AlarmHistory::new(CODES.alarm_history, &mut entries), nothing);
    the_same_again(pair(cyclic, false), AlarmAttributes::new(CODES.alarm_attributes), alarm);
    let clear = TypeCode::short(CODES.alarm_clear.get() as u8);
    the_same_again(pair(cyclic, false), ClearAlarm::new(clear, 50), alarm);
    // Nothing is caught: it waits for its limit each time.
    let latch = Latch::first(CODES.latch_arm, Nibble::new(1).unwrap(), 40);
    the_same_again(pair(cyclic, false), latch, nothing);
}

/// A homing that is started again while it is under way is one homing more, and ends as one.
#[test]
fn homing_again() {
    let mut pair = pair(ActiveCode::ProfilePosition, true);
    let mut home = Home::new(0xc8, 1_000);
    for _ in 0..2 {
        let (progress, commands, _) = end(&mut pair, &mut home);
        assert_eq!((progress, commands), (Progress::Done { value: () }, 1));
        assert_eq!(pair.axis.state(), AxisState::On);
        (0..20).for_each(|_| pair.update());
    }
    pair.drive.set_behaviour(Behaviour::new());
}

/// Each change of the mode has the whole limit: one that had to wait for the axis to stand leaves it to the other.
#[test]
fn each_change_of_the_mode_has_its_limit() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new().with_quirks(Quirks::SETS_POSITION_WHILE_ON));
    let mut rebase = RebaseWithServoOn::new(1_000, 8);
    let from = pair.axis.setpoint();
    let mut progress = Progress::Pending { left: 0 };
    for k in 1..=6 {
        pair.axis.set_position(from + 10 * k).unwrap();
        pair.update();
        progress = if k == 1 { rebase.start(&mut pair.axis) } else { rebase.receive(&mut pair.axis) };
        assert!(progress.is_pending());
    }
    while progress.is_pending() {
        pair.update();
        progress = rebase.receive(&mut pair.axis);
    }
    assert!(matches!(progress, Progress::Done { value: 990..=1_010 }), "{progress:?}");
}
