//! What is over in a log: requests that were answered, codes that have come back, drives that were none.

use super::*;

/// The same request again, after the normal command, is another one, and its answer another answer.
#[test]
fn a_request_is_asked_again() {
    let mut log = analysis();
    let once = |counter| [command(counter, 0x2a, 0), response(counter, 0x2a, 0)];
    let normal = |counter| [command(counter, 0x20, 0), response(counter, 0x20, 0)];
    let blocks = [normal(1), once(2), normal(3), once(0), normal(1)].concat();
    let answered = LogFinding::Answered { responses: 1, busy: 0 };
    assert_eq!(findings(&mut log, &blocks), [(3, answered), (7, answered)]);
}

/// A code that came back late is said once, and a drive that answered once and again once.
#[test]
fn what_is_over_is_said_once() {
    let mut log = analysis();
    let echoes = (0..5_u8).map(|k| response(k % 4, 0, 0)).chain((5..9).map(|k| response(k % 4, 0x20, 0)));
    let blocks: Vec<_> = core::iter::once(command(1, 0x20, 0)).chain(echoes).collect();
    assert_eq!(findings(&mut log, &blocks), [(6, LogFinding::CodeLate { responses: 6 })]);
    assert_eq!(log.end().count(), 0);
    let mut log = analysis();
    let commands = (1..5_u8).map(|k| command(k % 4, 0, 0));
    let blocks: Vec<_> =
        core::iter::once(response(0, 0, 0)).chain(commands).chain(core::iter::once(response(1, 0, 0))).collect();
    let want = [(3, LogFinding::NoAnswer { commands: 3 }), (5, LogFinding::AnswersAgain { commands: 4 })];
    assert_eq!(findings(&mut log, &blocks), want);
}

/// A drive that answered once, and then no more, is silent at the end.
#[test]
fn a_drive_that_answered_once_is_silent() {
    let mut log = analysis();
    let commands = (1..6_u8).map(|k| command(k % 4, 0, 0));
    let blocks: Vec<_> = core::iter::once(response(0, 0, 0)).chain(commands).collect();
    assert_eq!(findings(&mut log, &blocks), [(3, LogFinding::NoAnswer { commands: 3 })]);
    let silence = |finding| matches!(finding, LogFinding::AtEnd(_, Unfinished::Silence { commands: 5 }));
    assert!(log.end().any(silence), "{:?}", log.end().collect::<Vec<_>>());
}

/// A drive that was forgotten has never been there.
#[test]
fn a_drive_that_is_forgotten_was_not_there() {
    let mut log = analysis();
    let mut other = response(1, 0x20, 0);
    (other[0], other[2]) = (0xa7, 0xe1);
    let number = MacId::new(7).unwrap();
    findings(&mut log, &[command(1, 0x20, 0), response(1, 0x20, 0), other]);
    assert_eq!(log.end().collect::<Vec<_>>(), [LogFinding::NeverAsked(number)]);
    assert_eq!(log.troubles().collect::<Vec<_>>(), [DriveTrouble { mac_id: number, trouble: Trouble::Alarm }]);
    log.forget(number);
    assert_eq!((log.end().count(), log.troubles().count()), (0, 0));
}
