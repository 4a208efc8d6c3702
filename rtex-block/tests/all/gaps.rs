//! Exchanges that do not take place and blocks that do not come, at the worst moment: between what a caller asks for and the block
//! that carries it. The blocks are made by hand; a drive goes on with the last one that it got, as often as it goes round.

use core::num::NonZeroU16;
use std::collections::VecDeque;

use crate::common::{Pair, set_position};
use rtex_block::device::{Behaviour, Quirks};
use rtex_block::master::procedure::RebaseWithServoOn;
use rtex_block::master::{
    ActiveCode, Arrival, Axis, AxisConfig, AxisState, CommandCounter, Heard, Limits, Progress, StopCategory,
    SwitchOnError, Turn,
};
use rtex_block::{CyclicCode, Doubt, MacId, Policy, Response, UpdateCounter};

const PERIOD_NS: u64 = 500_000;

/// An axis, and a shaft that is turned by hand: what it does is written down here, not computed by a drive.
struct Hand {
    axis: Axis,
    counter: CommandCounter,
    sent: Turn,
    heard: Heard,
    code: u8,
    active: bool,
    at: i32,
    /// Units a period.
    speed: i32,
    now: u64,
}

/// Servo_On, cyclic code, Command_Data1.
type Sent = (bool, CyclicCode, i32);

impl Hand {
    fn new(mode: ActiveCode) -> Self {
        let limits = Limits::new(NonZeroU16::new(8).unwrap(), 200);
        let config = AxisConfig::new(MacId::new(9).unwrap(), mode, 500_000, limits).with_deceleration(40);
        let mut hand = Self {
            axis: Axis::new(config),
            counter: CommandCounter::new(2),
            sent: Turn::Invalid,
            heard: Heard::Nothing,
            code: 0,
            active: false,
            at: 5_000,
            speed: 0,
            now: 100,
        };
        (0..20).for_each(|_| _ = hand.update());
        assert_eq!(hand.axis.can_switch_on(), Ok(()));
        hand
    }

    fn on(mode: ActiveCode) -> Self {
        let mut hand = Self::new(mode);
        hand.axis.switch_on().unwrap();
        (0..8).for_each(|_| _ = hand.update());
        assert_eq!(hand.axis.state(), AxisState::On);
        hand
    }

    /// A period, of which the exchange is made.
    fn update(&mut self) -> Sent {
        self.axis.hear(self.sent, &self.heard, self.now * PERIOD_NS);
        self.sent = self.counter.next();
        let command = self.axis.transmission(self.sent).main;
        self.active = command.control.contains(rtex_block::ControlBits::SERVO_ON);
        self.code = command.code().get();
        self.frames(1);
        (self.active, command.cyclic, command.command_data1)
    }

    /// Frames that carry the same commands again, as when nobody calls; each answer says where the shaft is in it.
    fn frames(&mut self, count: u64) {
        let steps = i32::try_from(count).unwrap();
        self.now += count;
        self.at = self.at.wrapping_add(self.speed.wrapping_mul(steps));
        let Turn::Valid(counter) = self.sent else { return };
        let byte0 = 0x80 | counter.get() << 5 | 9;
        let byte2 = if self.active { 0xc0 } else { 0x40 };
        let [a, b, c, d] = self.at.to_le_bytes();
        self.heard = Response::parse(&[byte0, self.code, byte2, 0, a, b, c, d, 0, 0, 0, 0, 0, 0, 0, 0]).into();
    }
}

/// What comes between the request of the caller and the next exchange.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Between {
    Nothing,
    /// Nobody calls for so many frames; the drive goes on answering.
    Gap(u64),
    /// The drive's last block is that of the first frame of the gap.
    GapAndSilence(u64),
    Lost,
    Refused,
    Late,
}

const ALL: [Between; 10] = [
    Between::Nothing,
    Between::Gap(1),
    Between::Gap(2),
    Between::Gap(4),
    Between::Gap(20_000),
    Between::GapAndSilence(3),
    Between::GapAndSilence(20_000),
    Between::Lost,
    Between::Refused,
    Between::Late,
];

impl Between {
    fn happens(self, hand: &mut Hand) {
        match self {
            Self::Nothing => {}
            Self::Gap(frames) => hand.frames(frames),
            Self::GapAndSilence(frames) => {
                let heard = hand.heard;
                hand.frames(frames);
                hand.heard = heard;
            }
            Self::Lost => hand.heard = Heard::Nothing,
            Self::Refused => hand.heard = Response::parse(&[0; 16]).into(),
            Self::Late => {
                let Heard::Main(response) = &mut hand.heard else { panic!() };
                response.update_counter_echo =
                    UpdateCounter::new((response.update_counter_echo.get() + 2) & 3).unwrap();
            }
        }
    }
}

/// A shaft that is turned while the servo goes on: the first block with Servo_On carries a position of its own update period.
#[test]
fn servo_on_goes_out_with_a_position_of_its_own_period() {
    for between in ALL {
        let mut hand = Hand::new(ActiveCode::CyclicPosition);
        hand.speed = 300;
        (0..4).for_each(|_| _ = hand.update());
        hand.axis.switch_on().unwrap();
        between.happens(&mut hand);
        let mut periods = 0;
        loop {
            let at = hand.at;
            let (on, _, position) = hand.update();
            periods += 1;
            if on {
                assert!((at - position).abs() <= 300, "{between:?}: a bump of {}", at - position);
                break;
            }
            assert!(periods < 8, "{between:?}");
        }
        (0..8).for_each(|_| _ = hand.update());
        assert_eq!(hand.axis.state(), AxisState::On, "{between:?}");
    }
}

/// An axis that creeps, as far as it may at a change to CP: the first position of the new mode is no older than a period, or the
/// mode stays what it was.
#[test]
fn positions_begin_where_the_axis_is() {
    for between in ALL {
        for mode in [ActiveCode::CyclicVelocity, ActiveCode::CyclicTorque, ActiveCode::ProfilePosition] {
            let mut hand = Hand::on(mode);
            hand.speed = 300;
            (0..4).for_each(|_| _ = hand.update());
            hand.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
            between.happens(&mut hand);
            let at = hand.at;
            let (on, code, position) = hand.update();
            assert!(on);
            if code == CyclicCode::CyclicPosition {
                assert!((at - position).abs() <= 300, "{between:?} {mode}: a jump of {}", at - position);
                assert_eq!(hand.axis.mode(), ActiveCode::CyclicPosition);
            } else {
                assert_ne!(between, Between::Nothing);
                assert_eq!((hand.axis.mode(), position), (mode, 0), "{between:?}");
                // A period later it is known where the axis is.
                (0..2).for_each(|_| _ = hand.update());
                hand.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
                assert_eq!(hand.update().1, CyclicCode::CyclicPosition);
            }
        }
    }
}

/// After a gap nobody knows when the block in the memory came: its position is as old as it may be.
#[test]
fn a_block_after_a_gap_may_be_as_old_as_the_gap() {
    for (frames, old) in [(0, false), (1, true), (2, true), (8, true), (20_000, true)] {
        for silent in [false, true] {
            let mut hand = Hand::new(ActiveCode::CyclicPosition);
            let between = if silent { Between::GapAndSilence(frames) } else { Between::Gap(frames) };
            between.happens(&mut hand);
            hand.axis.hear(hand.sent, &hand.heard, hand.now * PERIOD_NS);
            assert_eq!(hand.axis.arrival(), Arrival::OnTime);
            let judged = hand.axis.evidence().at(hand.now * PERIOD_NS, Policy::new(PERIOD_NS - 1));
            let want = if old { Err(Doubt::Old { age_ns: frames * PERIOD_NS }) } else { Ok(5_000) };
            assert_eq!(judged.map(|sample| sample.position()), want, "{frames} {silent}");
            let switched = if old { Err(SwitchOnError::OldPosition) } else { Ok(()) };
            assert_eq!(hand.axis.can_switch_on(), switched, "{frames} {silent}");
        }
    }
}

/// Where an answer takes one period more, the frames of a gap bring the echo that is due in the exchange after next. If the next one
/// brings no block, the one after it cannot know from which of them its block is, and does not take it.
#[test]
fn a_gap_is_remembered_until_a_block_comes() {
    let counter = |n: u64| Turn::Valid(UpdateCounter::truncate(n as u8));
    let block = |echo: u64| -> Heard {
        Response::parse(&[0x89 | (echo as u8 & 3) << 5, 0x20, 0x40, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).into()
    };
    for unread in 1..3 {
        let mut axis = Hand::new(ActiveCode::CyclicPosition).axis;
        axis.hear(Turn::Invalid, &Heard::Nothing, 99 * PERIOD_NS);
        let mut exchange = |at: u64, sent: u64, heard: Heard| {
            axis.hear(counter(sent), &heard, at * PERIOD_NS);
            let sampled_ns = axis.evidence().at(0, Policy::new(u64::MAX)).map(|sample| sample.sampled_ns() / PERIOD_NS);
            (axis.arrival(), sampled_ns, axis.can_switch_on())
        };
        for n in 100..120 {
            _ = exchange(n, n - 1, block(n - 2));
        }
        // The exchange of 120 is left out, so the frame of 120 carries 119 once more, and those of `unread` are not read.
        for n in 121..121 + unread {
            assert_eq!(exchange(n, n - 2, Heard::Nothing).0, Arrival::Missing);
        }
        let n = 121 + unread;
        let old = exchange(n, n - 2, block(n - 3));
        assert_eq!(old, (Arrival::Repeated, Ok(119), Err(SwitchOnError::OldPosition)), "{unread}");
        assert_eq!(exchange(n + 1, n - 1, block(n - 2)), (Arrival::OnTime, Ok(n + 1), Ok(())), "{unread}");
    }
}

/// While nobody calls, the command position stands still on the wire. A stop afterwards does not move the axis again, but after one
/// or two periods it goes on, as after frames that were lost.
#[test]
fn a_stop_after_a_gap_does_not_start_the_axis() {
    for category in [StopCategory::One, StopCategory::Two] {
        for (frames, want) in [(0, vec![60, 20, 0]), (2, vec![60, 20, 0]), (3, vec![0; 3]), (20_000, vec![0; 3])] {
            for asked_before in [false, true] {
                let mut hand = Hand::on(ActiveCode::CyclicPosition);
                for k in 1..=10 {
                    hand.axis.set_position(5_000 + 100 * k).unwrap();
                    hand.update();
                }
                if asked_before {
                    hand.axis.stop(category);
                }
                hand.frames(frames);
                if !asked_before {
                    hand.axis.set_position(6_100).unwrap();
                    if frames > 0 {
                        // The caller goes on, and then finds out.
                        let (_, _, position) = hand.update();
                        assert_eq!(position, 6_100);
                        hand.frames(frames);
                    }
                    hand.axis.stop(category);
                }
                let mut steps = Vec::new();
                let mut from = if !asked_before && frames > 0 { 6_100 } else { 6_000 };
                for _ in 0..3 {
                    let (on, _, position) = hand.update();
                    if on {
                        steps.push(position - from);
                        from = position;
                    }
                }
                let want: Vec<i32> = want.iter().copied().take(steps.len()).collect();
                assert_eq!(steps, want, "{category:?} {frames} {asked_before}");
            }
        }
    }
}

/// Blocks of a stop that do not reach the ASIC: what is sent after them is a deceleration away from what was sent last, and after
/// three of them the axis stands.
#[test]
fn a_stop_goes_on_from_what_was_sent() {
    for category in [StopCategory::One, StopCategory::Two] {
        for (unsent, want) in [(0, [60, 20, 0]), (1, [60, 20, 0]), (2, [60, 20, 0]), (3, [0; 3]), (6, [0; 3])] {
            let mut hand = Hand::on(ActiveCode::CyclicPosition);
            for k in 1..=10 {
                hand.axis.set_position(5_000 + 100 * k).unwrap();
                hand.update();
            }
            hand.axis.stop(category);
            let last = hand.heard;
            for _ in 0..unsent {
                let sent = hand.axis.sent();
                hand.update();
                hand.axis.not_sent(sent);
                hand.heard = last;
            }
            let (mut steps, mut from) = (Vec::new(), 6_000);
            for _ in 0..3 {
                let (on, _, position) = hand.update();
                if on {
                    steps.push(position - from);
                    from = position;
                }
            }
            assert_eq!(steps, want[..steps.len()], "{category:?} {unsent}");
            assert!(steps.len() >= if category == StopCategory::Two { 3 } else { 2 * usize::from(unsent < 3) });
        }
    }
}

/// Servo_On that did not reach the ASIC has not been asked for: it goes out with a position of its own period again.
#[test]
fn servo_on_that_was_not_sent_begins_once_more() {
    let mut hand = Hand::new(ActiveCode::CyclicPosition);
    hand.speed = 10;
    hand.axis.switch_on().unwrap();
    let sent = hand.axis.sent();
    assert!(hand.update().0);
    hand.axis.not_sent(sent);
    hand.heard = Heard::Nothing;
    assert!(!hand.update().0, "no position came");
    let at = hand.at;
    let (on, _, position) = hand.update();
    assert!(on);
    assert_eq!(position, at);
}

/// A change to CP that did not reach the ASIC has not been made: CP begins where the shaft is in the first block that does.
#[test]
fn positions_that_were_not_sent_begin_once_more() {
    let mut hand = Hand::on(ActiveCode::CyclicVelocity);
    hand.speed = 10;
    (0..4).for_each(|_| _ = hand.update());
    hand.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
    let sent = hand.axis.sent();
    hand.update();
    hand.axis.not_sent(sent);
    let at = hand.at;
    assert_eq!(hand.update(), (true, CyclicCode::CyclicPosition, at));
}

/// A drive that shows its flags late reports the activity of before: that is no answer to this Servo_On.
#[test]
fn activity_of_before_is_not_that_of_now() {
    for (late, servo_off_late) in [(0, 0), (1, 1), (2, 3), (3, 0), (3, 3)] {
        for on_for in 1..12 {
            let polite = Behaviour::new().with_status_late([0, 0, 0, 0, 0, 0, 0, late]);
            let mut pair = Pair::on(ActiveCode::CyclicPosition, polite.with_servo_off_late(servo_off_late));
            pair.axis.stop(StopCategory::Zero);
            pair.update();
            pair.axis.clear();
            // On for a while only, and off again.
            pair.until("on its way", |pair| pair.axis.can_switch_on().is_ok());
            pair.axis.switch_on().unwrap();
            (0..on_for).for_each(|_| pair.update());
            pair.axis.stop(StopCategory::Zero);
            pair.update();
            pair.axis.clear();
            pair.until("off again", |pair| pair.axis.can_switch_on().is_ok());
            pair.axis.switch_on().unwrap();
            // No block with Servo_On has gone out, so what is reported now is of before.
            let mut periods = 0;
            while pair.axis.state() != AxisState::On {
                pair.update();
                periods += 1;
                assert!(periods < 40);
            }
            assert!(pair.drive.is_active() && periods > 1, "{late} {servo_off_late} {on_for}: {periods}");
        }
    }
}

/// A stop of category 2 between the request for CP and its first block holds the axis where it is.
#[test]
fn an_axis_is_held_where_it_is() {
    for between in ALL {
        for mode in [ActiveCode::CyclicVelocity, ActiveCode::CyclicTorque] {
            let mut hand = Hand::on(mode);
            hand.speed = 300;
            (0..4).for_each(|_| _ = hand.update());
            hand.axis.set_mode(ActiveCode::CyclicPosition).unwrap();
            hand.axis.stop(StopCategory::Two);
            between.happens(&mut hand);
            let at = hand.at;
            let (on, code, position) = hand.update();
            let bump = if code == CyclicCode::CyclicPosition { (at - position).abs() } else { position };
            assert!(!on || bump <= 300, "{between:?} {mode}: {bump}");
            // At speed 0 it is held without a position, too.
            assert!(on || mode == ActiveCode::CyclicTorque, "{between:?}");
        }
    }
}

/// Positions in the old coordinates for up to three blocks after the answer: no servo-on and no change to CP with one of them.
#[test]
fn old_coordinates_come_late() {
    for late in 0..=3 {
        for by in [-20_000, 900, 2_000_000] {
            // With the servo off.
            let mut pair = Pair::new(ActiveCode::CyclicPosition, Behaviour::new());
            pair.until("off", |pair| pair.axis.can_switch_on().is_ok());
            let mut line = VecDeque::from(vec![pair.drive.position(); late]);
            pair.until("free", |pair| pair.axis.can_ask());
            pair.axis.ask(set_position(0x21, by)).unwrap();
            let mut ended = false;
            while !pair.axis.state().is_servo_on() {
                delayed(&mut pair, &mut line);
                ended |= pair.axis.take_outcome().is_some_and(|outcome| matches!(outcome, Progress::Done { .. }));
                let _ = pair.axis.switch_on();
            }
            assert!(ended);
            (0..30).for_each(|_| delayed(&mut pair, &mut line));
            assert_eq!((pair.axis.state(), pair.drive.position()), (AxisState::On, by), "{late}");
            // With the servo on.
            let quirks = Behaviour::new().with_quirks(Quirks::SETS_POSITION_WHILE_ON);
            let mut pair = Pair::on(ActiveCode::CyclicPosition, quirks);
            let mut line = VecDeque::from(vec![pair.drive.position(); late]);
            let mut rebase = RebaseWithServoOn::new(by, 60);
            let mut progress = rebase.start(&mut pair.axis);
            while progress.is_pending() {
                delayed(&mut pair, &mut line);
                progress = rebase.receive(&mut pair.axis);
            }
            assert_eq!(progress, Progress::Done { value: by }, "{late}");
            (0..30).for_each(|_| delayed(&mut pair, &mut line));
            assert_eq!((pair.axis.mode(), pair.drive.position()), (ActiveCode::CyclicPosition, by), "{late}");
        }
    }
}

/// A period in which Response_Data1 is that of so many blocks before.
fn delayed(pair: &mut Pair, line: &mut VecDeque<i32>) {
    pair.update();
    let Heard::Main(response) = &mut pair.received else { panic!() };
    line.push_back(response.response_data1);
    response.response_data1 = line.pop_front().unwrap();
}
