//! Every block has its place in time: late, early, repeated, lost and torn ones, and frames of a turn of the counter ago.

use crate::common::{CODES, Pair, limits};
use rtex_block::device::Behaviour;
use rtex_block::master::procedure::{ReadText, Request};
use rtex_block::master::{
    ActiveCode, Arrival, Axis, AxisConfig, AxisState, Heard, Progress, Ring, StopCategory, StopReason, SwitchOnError,
    Turn,
};
use rtex_block::{Arguments, MacId, NonCyclicCommand, Policy, Pr, Response, TypeCode, UpdateCounter};

/// The pair with responses that come `late` periods after their time, from now on.
struct Late {
    pair: Pair,
    line: Vec<Heard>,
}

impl Late {
    fn new(pair: Pair) -> Self {
        Self { pair, line: Vec::new() }
    }

    /// `None`: as soon as they are there.
    fn update(&mut self, late: usize) {
        self.pair.update();
        self.line.insert(0, self.pair.received);
        self.pair.received = self.line.get(late).copied().unwrap_or(Heard::Nothing);
    }
}

/// A motor that is turned by hand while the answers are one to three periods late: no position, no servo-on. On time again both are
/// there.
#[test]
fn late_answers_give_no_position_and_no_servo_on() {
    for late in 1..=3_usize {
        let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
        pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
        let mut bench = Late::new(pair);
        (0..8).for_each(|_| bench.update(0));
        let at = |bench: &Late| bench.pair.axis.evidence().at(bench.pair.now_ns(), Policy::new(0));
        assert!(at(&bench).is_ok());
        // The line gets slower; three blocks of a lag that was not there before are not yet a system that has it.
        for _ in 0..3 {
            bench.update(late);
            bench.pair.axis.clone().switch_on().ok();
        }
        bench.update(late);
        let arrival = bench.pair.axis.arrival();
        assert_ne!(arrival, Arrival::OnTime, "{late}");
        assert!(at(&bench).is_err(), "{late}");
        assert_eq!(bench.pair.axis.switch_on(), Err(SwitchOnError::OldPosition), "{late}");
    }
}

/// One late block right after a stop that was cleared teaches no lag: it is no position to switch on with, and what comes on time
/// after it is.
#[test]
fn a_late_block_after_a_clear_is_not_on_time() {
    for late in 1..=3_usize {
        let mut bench = Late::new(Pair::on(ActiveCode::CyclicPosition, Behaviour::new()));
        (0..8).for_each(|_| bench.update(0));
        bench.pair.axis.stop(StopCategory::Zero);
        (0..20).for_each(|_| bench.update(0));
        assert!(matches!(bench.pair.axis.state(), AxisState::Stopped(_)));
        bench.pair.axis.clear();
        bench.pair.received = bench.line[late];
        bench.update(0);
        assert_ne!(bench.pair.axis.arrival(), Arrival::OnTime, "{late}");
        assert!(bench.pair.axis.evidence().at(bench.pair.now_ns(), Policy::new(0)).is_err(), "{late}");
        assert!(bench.pair.axis.switch_on().is_err(), "{late}");
        bench.update(0);
        bench.update(0);
        assert_eq!((bench.pair.axis.arrival(), bench.pair.axis.switch_on()), (Arrival::OnTime, Ok(())), "{late}");
    }
}

/// So at the start: what comes late once is neither the first position nor the lag of the system.
#[test]
fn a_late_block_at_the_start_is_not_on_time() {
    for late in 1..=3_usize {
        let mut bench = Late::new(Pair::new(ActiveCode::CyclicPosition, Behaviour::new()));
        while bench.pair.sent == Turn::Invalid {
            bench.update(0);
        }
        // The answer to the first valid block comes that late, and those between do not come.
        let first = bench.pair.received;
        for _ in 0..late {
            bench.pair.received = Heard::Nothing;
            bench.update(0);
        }
        bench.pair.received = first;
        bench.update(0);
        assert!(bench.pair.axis.clone().switch_on().is_err(), "{late}");
        assert!(bench.pair.axis.evidence().at(bench.pair.now_ns(), Policy::new(0)).is_err(), "{late}");
        // A turn, and what was behind the late block.
        for _ in 0..5 {
            bench.update(0);
        }
        assert_eq!(bench.pair.axis.arrival(), Arrival::OnTime, "{late}");
        assert!(bench.pair.axis.evidence().at(bench.pair.now_ns(), Policy::new(0)).is_ok(), "{late}");
    }
}

/// Late with the servo on: the age of the position grows by the clock, whatever comes, and at the limit the axis stops. What comes
/// late once is over with the next block.
#[test]
fn late_answers_stop_an_axis_at_the_limit() {
    for late in 1..=3_usize {
        let mut bench = Late::new(Pair::on(ActiveCode::CyclicPosition, Behaviour::new()));
        (0..8).for_each(|_| bench.update(0));
        let mut last = bench.pair.now_ns() - 500_000;
        for period in 0..7 {
            assert_eq!(bench.pair.axis.state(), AxisState::On, "{late}: {period}");
            bench.update(late);
            if bench.pair.axis.arrival() == Arrival::OnTime {
                last = bench.pair.now_ns();
            }
            let sample = bench.pair.axis.evidence().at(bench.pair.now_ns(), Policy::new(u64::MAX)).unwrap();
            assert_eq!(sample.sampled_ns(), last);
        }
        bench.update(late);
        assert_eq!(bench.pair.axis.state(), AxisState::Stopped(StopReason::EchoTimeout), "{late}");
        let mut bench = Late::new(Pair::on(ActiveCode::CyclicPosition, Behaviour::new()));
        (0..40).for_each(|period| bench.update(if period % 8 < 4 { 0 } else { late.min(1) }));
        assert_eq!(bench.pair.axis.state(), AxisState::On);
    }
}

/// A system in which every answer is so late has its lag from the start, and its own servo-on.
#[test]
fn a_lag_that_is_always_there_is_that_of_the_system() {
    for late in 0..=2_usize {
        let mut bench = Late::new(Pair::new(ActiveCode::CyclicPosition, Behaviour::new()));
        for _ in 0..80 {
            bench.update(late);
            let _ = bench.pair.axis.switch_on();
        }
        assert_eq!((bench.pair.axis.state(), bench.pair.axis.arrival()), (AxisState::On, Arrival::OnTime), "{late}");
    }
}

/// A frame of one to eight periods ago comes once, at any time while the same parameter is written for a second time: the second
/// write is done when the drive has done it, and not by the answer to the first.
#[test]
fn an_old_frame_is_no_answer_to_the_next_request() {
    let index = Pr { class: 8, number: 1 }.index();
    let write = |data| NonCyclicCommand::Parameter(Arguments { type_code: TypeCode::short(0x11), index, data });
    let read = NonCyclicCommand::Parameter(Arguments { type_code: CODES.parameter_read, index, data: 0 });
    for back in 1..=8_usize {
        for at in 0..40 {
            let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
            pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
            pair.until("free", |pair| pair.axis.can_ask());
            let (mut first, mut second, mut line) = (Request::new(write(1)), Request::new(write(2)), Vec::new());
            let (mut one, mut two) = (Progress::Pending { left: 0 }, Progress::Pending { left: 0 });
            for period in 0..120 {
                pair.update();
                line.insert(0, pair.received);
                if period == at && line.len() > back {
                    pair.received = line[back];
                }
                if one.is_pending() {
                    one = first.receive(&mut pair.axis);
                } else if two.is_pending() {
                    two = second.receive(&mut pair.axis);
                    if !two.is_pending() {
                        assert!(matches!(two, Progress::Done { .. }), "{back} {at}: {two:?}");
                        // Busy for four exchanges, and the answer after that.
                        let written = pair.clone_ask(read);
                        assert_eq!(written, Some(2), "{back} {at}");
                    }
                }
            }
            assert!(!two.is_pending(), "{back} {at}");
        }
    }
}

/// A motion right after another one: a frame of the first, in which it was in progress, does not make the second one end before it
/// has begun.
#[test]
fn an_old_frame_is_no_part_of_the_next_motion() {
    for back in 1..=8_usize {
        for at in 0..30 {
            let behaviour = Behaviour::new().with_in_progress_late(10);
            let mut pair = Pair::on(ActiveCode::ProfilePosition, behaviour);
            let (mut line, mut ended, mut period) = (Vec::new(), 0, 0);
            pair.axis.start_move(0x11, 5_000, 2_000_000).unwrap();
            while ended < 2 {
                pair.update();
                line.insert(0, pair.received);
                if ended == 1 {
                    if period == at && line.len() > back {
                        pair.received = line[back];
                    }
                    period += 1;
                }
                match pair.axis.take_move() {
                    Some(Progress::Done { .. }) => {
                        ended += 1;
                        if ended == 1 {
                            pair.axis.start_move(0x11, 5_000, 2_000_000).unwrap();
                        }
                    }
                    Some(Progress::Failed { error }) => panic!("{error}"),
                    _ => assert!(line.len() < 1_000),
                }
            }
            assert!(pair.drive.position() > 9_000, "{back} {at}: done at {}", pair.drive.position());
        }
    }
}

/// The blocks of two frames in one exchange are said to be that; so are those of a drive that stands still.
#[test]
fn two_frames_in_one_exchange() {
    let config = |n| AxisConfig::new(MacId::new(n).unwrap(), ActiveCode::CyclicPosition, 500_000, limits());
    let ring = Ring::new([config(1), config(2)].map(Axis::new), 0).unwrap();
    let block = |n: u8, echo: u8| -> Heard {
        let mut block = [0; 16];
        block[0] = 0x80 | echo << 5 | n;
        Response::parse(&block).into()
    };
    assert!(!ring.is_torn(&[block(1, 2), block(2, 2)]));
    assert!(ring.is_torn(&[block(1, 2), block(2, 3)]));
    assert!(ring.is_torn(&[block(1, 3), block(2, 0)]));
    // Where a block is missing, refused or of another drive there is nothing to compare.
    assert!(!ring.is_torn(&[block(1, 2), Heard::Nothing]));
    assert!(!ring.is_torn(&[block(2, 1), block(2, 2)]));
    assert!(!ring.is_torn(&[Response::parse(&[0; 16]).into(), block(2, 2)]));
}

/// An alarm counts in whichever block it comes, late or repeated.
#[test]
fn an_alarm_is_never_too_late() {
    for on in [false, true] {
        let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
        pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
        if on {
            pair.switch_on();
        }
        let mut bench = Late::new(pair);
        (0..8).for_each(|_| bench.update(0));
        let Heard::Main(mut response) = bench.line[2] else { panic!() };
        response.status.insert(rtex_block::StatusFlags::ALARM);
        bench.pair.received = Heard::Main(response);
        bench.update(0);
        assert_eq!(bench.pair.axis.state(), AxisState::Stopped(StopReason::Alarm), "{on}");
        assert!(bench.pair.axis.evidence().at(bench.pair.now_ns(), Policy::new(u64::MAX)).is_err());
    }
    // Everything else a late block says is of no account: servo off before it was switched on.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    let off = pair.received;
    pair.switch_on();
    let Heard::Main(mut off) = off else { panic!() };
    let Heard::Main(due) = pair.received else { panic!() };
    off.update_counter_echo = due.update_counter_echo.next();
    pair.received = Heard::Main(off);
    pair.update();
    assert_eq!(pair.axis.state(), AxisState::On);
}

/// A procedure that has ended stays so, and starts again when it is told to.
#[test]
fn a_procedure_starts_when_it_is_told_to() {
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
    let mut text = ReadText::new(TypeCode::short(0x01));
    for _ in 0..3 {
        let mut progress = text.start(&mut pair.axis);
        assert!(progress.is_pending());
        while progress.is_pending() {
            pair.update();
            progress = text.receive(&mut pair.axis);
        }
        let Progress::Done { value } = progress else { panic!("{progress:?}") };
        assert_eq!(value.as_bytes(), b"Panasonic");
        for _ in 0..20 {
            pair.update();
            assert_eq!(text.receive(&mut pair.axis), progress);
            assert_ne!(pair.received.response().unwrap().code.get(), 0x22);
        }
    }
}

/// What lies in the memory from before is no new block, neither after a stop that was cleared nor after a start with invalid data.
#[test]
fn what_lay_in_the_memory_is_not_new() {
    let mut pair = Pair::on(ActiveCode::CyclicPosition, Behaviour::new());
    let old = pair.received;
    let freeze = |pair: &mut Pair, periods: u32| {
        for _ in 0..periods {
            pair.received = old;
            pair.update();
        }
    };
    freeze(&mut pair, 20);
    assert_eq!(pair.axis.state(), AxisState::Stopped(StopReason::EchoTimeout));
    pair.axis.clear();
    for _ in 0..5 {
        freeze(&mut pair, 1);
        assert_eq!(pair.axis.arrival(), Arrival::Repeated);
        assert!(pair.axis.switch_on().is_err());
    }
    // A controller that has started anew, and a memory that holds what its predecessor has read.
    let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
    for _ in 0..8 {
        freeze(&mut pair, 1);
        assert_ne!(pair.axis.arrival(), Arrival::OnTime);
        assert!(pair.axis.evidence().at(pair.now_ns(), Policy::new(0)).is_err());
        assert!(pair.axis.switch_on().is_err());
    }
}

/// Exchanges that did not take place are told by the clock, from one and a half update periods on. With an echo that is two behind,
/// the block after one of them may be as much earlier.
#[test]
fn missed_exchanges_by_the_clock() {
    let mut bench = Late::new(Pair::new(ActiveCode::CyclicPosition, Behaviour::new()));
    (0..40).for_each(|_| bench.update(2));
    let pair = &bench.pair;
    assert_eq!(pair.axis.arrival(), Arrival::OnTime);
    let Turn::Valid(sent) = pair.sent else { panic!() };
    let response = *pair.received.response().unwrap();
    assert_eq!(sent.get().wrapping_sub(response.update_counter_echo.get()) & 3, 2);
    for (gap_ns, missed) in [
        (500_000, 0),
        (750_000, 0),
        (750_001, 1),
        (1_250_000, 1),
        (1_250_001, 2),
        (1_750_000, 2),
        (1_750_001, 3),
        (9_000_000, 3),
    ] {
        for found in 0..3_u8 {
            let echo = UpdateCounter::new(sent.get().wrapping_sub(found) & 3).unwrap();
            let heard = Ok(Response { update_counter_echo: echo, ..response }).into();
            let mut axis = pair.axis;
            axis.hear(pair.sent, &heard, pair.now_ns() + gap_ns);
            let want = found + missed >= 2;
            assert_eq!(axis.arrival() == Arrival::OnTime, want, "{gap_ns} ns, {found} behind: {}", axis.arrival());
        }
    }
}
