//! Alarms: their attributes, their history, and whether one can be cleared.

use core::cell::Cell;

use crate::common::{CODES, Pair, alarm, limits};
use rtex_block::device::{Behaviour, DriveConfig, Fault, Quirks};
use rtex_block::master::procedure::{AlarmAttributes, AlarmHistory, Attributes, ClearAlarm, ClearableIf, Clearing};
use rtex_block::master::{ActiveCode, AxisConfig, AxisState, Failure, Heard, Progress, StopReason};
use rtex_block::{Alarm, ErrorCode, Execution, MacId, NonCyclicResponse, Response, StatusFlags, TypeCode};

const ALARM: Alarm = Alarm { main: 38, sub: 1 };
/// Update periods for Alarm to fall.
const LIMIT: u32 = 30;

/// "Can this alarm be cleared?": the answer carries the alarm as its index echo.
#[test]
fn attributes_of_the_present_alarm() {
    let mac_id = MacId::new(9).unwrap();
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits());
    let mut pair = Pair::with(config, DriveConfig::new(mac_id, CODES).with_alarm_attributes(0x0000_0101));
    pair.switch_on();
    pair.drive.set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
    pair.until("stopped", |pair| pair.axis.state() == AxisState::Stopped(StopReason::Alarm));
    pair.axis.ask_alarm_attributes(CODES.alarm_attributes).unwrap();
    let Progress::Done { value: NonCyclicResponse::Alarm(results) } = pair.outcome() else { panic!() };
    assert_eq!((results.index, results.data), (38 << 8 | 1, 0x0101));
    // Asked as any other alarm request it would wait for Index 0 and never end.
    assert_eq!(pair.ask(alarm(CODES.alarm_attributes, 0)), Progress::Failed { error: Failure::TimedOut });
    // An answer to another type is an older one.
    pair.drive.set_behaviour(Behaviour::new().with_stale_answers(3));
    pair.until("free", |pair| pair.axis.can_ask());
    pair.axis.ask_alarm_attributes(CODES.alarm_attributes).unwrap();
    let Progress::Done { value } = pair.outcome() else { panic!() };
    assert_eq!(value.data(), Some(0x0101));

    pair.until("free", |pair| pair.axis.can_ask());
    let mut attributes = AlarmAttributes::new(CODES.alarm_attributes);
    let want = Attributes { alarm: 38 << 8 | 1, bits: 0x0101 };
    assert_eq!(pair.run(|axis| attributes.receive(axis)), Progress::Done { value: want });
    // Without an alarm the modelled drive refuses.
    let mut calm = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    let mut attributes = AlarmAttributes::new(CODES.alarm_attributes);
    let refused = Progress::Failed { error: Failure::CommandError(ErrorCode(0x0032)) };
    assert_eq!(calm.run(|axis| attributes.receive(axis)), refused);

    let mut entries = [Alarm { main: 1, sub: 1 }; 3];
    let mut history = AlarmHistory::new(CODES.alarm_history, &mut entries);
    assert_eq!(pair.run(|axis| history.receive(axis)), Progress::Done { value: () });
    let none = Alarm { main: 0, sub: 0 };
    assert_eq!(entries, [Alarm { main: 38, sub: 1 }, none, none]);
}

/// The manual of a drive names the bit; without one no alarm counts as clearable.
#[test]
fn clearable_by_a_bit_of_the_attributes() {
    let attributes = |bits| Attributes { alarm: 38 << 8 | 1, bits };
    for (bits, rule, want) in [
        (0x0000_0008, ClearableIf::Set(0x08), true),
        (0xffff_fff7, ClearableIf::Set(0x08), false),
        (0x8000_0001, ClearableIf::Set(0x8000_0001), true),
        (0x8000_0000, ClearableIf::Set(0x8000_0001), false),
        (0x0000_0008, ClearableIf::Unset(0x08), false),
        (0xffff_fff7, ClearableIf::Unset(0x08), true),
        (0x0000_0001, ClearableIf::Unset(0x8000_0001), false),
        (0xffff_ffff, ClearableIf::Set(0), false),
        (0x0000_0000, ClearableIf::Unset(0), false),
    ] {
        assert_eq!(attributes(bits).is_clearable(rule), want, "{bits:x} {rule:?}");
    }
}

/// An axis that an alarm has stopped, before its procedure begins.
fn stopped(behaviour: Behaviour) -> Pair {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, behaviour);
    pair.drive.set_fault(Fault::Alarm(ALARM));
    // Where Alarm is shown late the axis is stopped by Servo_Ready.
    pair.until("stopped", |pair| {
        let is_stopped = matches!(pair.axis.state(), AxisState::Stopped(_));
        is_stopped && pair.axis.status().contains(StatusFlags::ALARM)
    });
    pair
}

/// Ends the procedure; how often the command went out, and the update periods. `spoil` changes what is received.
fn clear(pair: &mut Pair, type_code: u16, spoil: impl Fn(&mut Pair)) -> (Progress<Clearing>, u32, u32) {
    let mut procedure = ClearAlarm::new(TypeCode::new(type_code).unwrap(), LIMIT);
    let (mut commands, mut is_out, from) = (0, false, pair.now);
    for _ in 0..500 {
        pair.update();
        spoil(pair);
        let progress = procedure.receive(&mut pair.axis);
        let block = pair.axis.transmission(pair.sent).main.emit();
        let clears = (block[1], block[8], &block[10..]) == (0x25, type_code as u8, &[0; 6][..]);
        commands += u32::from(clears && !is_out);
        is_out = clears;
        if !progress.is_pending() {
            return (progress, commands, pair.now - from);
        }
    }
    panic!("the procedure does not end");
}

fn all_behaviours() -> impl Iterator<Item = Behaviour> {
    (0..16_u16).map(|bits| {
        let busy = if bits & 4 == 0 { Quirks::empty() } else { Quirks::ALWAYS_BUSY };
        let failing = if bits & 8 == 0 { Quirks::empty() } else { Quirks::ERR_WHILE_BUSY | Quirks::WARNS };
        Behaviour::new()
            .with_echo_lag(if bits & 1 == 0 { 0 } else { 3 })
            .with_stale_answers(bits & 2)
            .with_quirks(busy | failing)
    })
}

#[test]
fn an_alarm_that_can_be_cleared() {
    for behaviour in all_behaviours() {
        for late in [0, 15] {
            // Alarm, bit 5, falls as late as this after the drive has cleared it.
            let mut pair = stopped(behaviour.with_status_late([0, 0, 0, 0, 0, late, 0, 0]));
            (0..20).for_each(|_| pair.update());
            let (ended, commands, _) = clear(&mut pair, 0xc4, |_| {});
            assert_eq!((ended, commands), (Progress::Done { value: Clearing::Cleared }, 1), "{behaviour:?}");
            assert_eq!(pair.drive.alarm(), None);
            // The axis stays stopped until it is cleared itself.
            assert!(matches!(pair.axis.state(), AxisState::Stopped(_)));
            pair.axis.clear();
            pair.switch_on();
            // Nothing is sent where there is no alarm.
            assert_eq!(clear(&mut pair, 0xc4, |_| {}), (Progress::Done { value: Clearing::Cleared }, 0, 2));
        }
    }
}

#[test]
fn an_alarm_that_cannot_be_cleared() {
    let refused = Progress::Done { value: Clearing::NotClearable };
    for behaviour in all_behaviours() {
        let mut pair = stopped(behaviour.with_quirks(behaviour.quirks | Quirks::REFUSES_TO_CLEAR));
        let (ended, commands, within) = clear(&mut pair, 0xc4, |_| {});
        assert_eq!((ended, commands, pair.drive.alarm()), (refused, 1, Some(ALARM)), "{behaviour:?}");
        assert!(within < LIMIT, "{within}");
        // The drive says that it is cleared; Alarm says otherwise for the whole limit.
        let mut pair = stopped(behaviour.with_quirks(behaviour.quirks | Quirks::ALARM_STAYS));
        let (ended, commands, within) = clear(&mut pair, 0xc4, |_| {});
        assert_eq!((ended, commands, pair.drive.alarm()), (refused, 1, Some(ALARM)), "{behaviour:?}");
        assert!((LIMIT + 4..LIMIT + 20).contains(&within), "{within}");
    }
    // A type code that the drive does not know says nothing of the alarm.
    let unknown = Progress::Failed { error: Failure::CommandError(ErrorCode(0x0031)) };
    assert_eq!(clear(&mut stopped(Behaviour::new()), 0xee, |_| {}).0, unknown);
}

/// Answers that are lost, and a drive that is lost: Status_Flags of an old block decide nothing.
#[test]
fn clearing_without_an_answer() {
    let no_answer = |pair: &mut Pair| {
        if let Some(response) = pair.received.response() {
            let mut block = response.emit();
            if block[1] == 0x25 {
                block[8] ^= 1;
                pair.received = Response::parse(&block).into();
            }
        }
    };
    let timed_out = Progress::Failed { error: Failure::TimedOut };
    // It was done all the same, or it was not: once is enough.
    let (ended, commands, _) = clear(&mut stopped(Behaviour::new()), 0xc4, no_answer);
    assert_eq!((ended, commands), (Progress::Done { value: Clearing::Cleared }, 1));
    let (ended, commands, _) = clear(&mut stopped(Behaviour::new().with_quirks(Quirks::ALARM_STAYS)), 0xc4, no_answer);
    assert_eq!((ended, commands), (timed_out, 1));
    // No block comes any more: before the command, or after its answer.
    let (ended, commands, within) = clear(&mut stopped(Behaviour::new()), 0xc4, |pair| pair.received = Heard::Nothing);
    assert_eq!((ended, commands, within), (timed_out, 0, LIMIT + 1));
    for behaviour in [Behaviour::new(), Behaviour::new().with_quirks(Quirks::ALARM_STAYS)] {
        let mut pair = stopped(behaviour.with_status_late([0, 0, 0, 0, 0, 3, 0, 0]));
        let (ended, commands, _) = clear(&mut pair, 0xc4, |pair| {
            if pair.axis.can_ask() || pair.received.response().is_some_and(|response| response.code.get() == 0x25) {
                return;
            }
            pair.received = Heard::Nothing;
        });
        assert_eq!((ended, commands), (timed_out, 1), "{behaviour:?}");
    }
    // ERR is the last that is heard of it: whether the alarm is still there is not known.
    let failed = Cell::new(false);
    let (ended, commands, _) =
        clear(&mut stopped(Behaviour::new().with_quirks(Quirks::REFUSES_TO_CLEAR)), 0xc4, |pair| {
            let response = pair.received.response().map(Response::noncyclic);
            if failed.get() {
                pair.received = Heard::Nothing;
            }
            failed.set(
                failed.get() || response.and_then(|it| it.execution()).is_some_and(|it| it.contains(Execution::ERR)),
            );
        });
    assert_eq!((ended, commands, failed.get()), (timed_out, 1, true));
    // An axis whose drive has not answered yet knows of no alarm, nor that there is none.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    assert_eq!(clear(&mut pair, 0xc4, |pair| pair.received = Heard::Nothing).0, timed_out);
}
