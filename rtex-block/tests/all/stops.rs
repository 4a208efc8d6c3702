//! The stop path, proved on the wire: consecutive command positions, their speed and their acceleration, by hand-made oracles that
//! read bytes.

use core::num::NonZeroU16;

use crate::common::{CODES, limits};
use rtex_block::device::{Drive, DriveConfig, Fault};
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, Heard, Limits, Ring, RingFailure, SetpointError, StopCategory, StopReason,
};
use rtex_block::{Alarm, MacId, Response};
use servowire_world::Draw;

/// A block as it went out: Servo_On, cyclic code, byte 3, Command_Data1.
type Sent = (bool, u8, u8, i32);

struct Bench {
    ring: Ring<2>,
    drives: [Drive; 2],
    heard: [Heard; 2],
    cut: [bool; 2],
    now_ns: u64,
    /// What axis 1 was sent.
    sent: Vec<Sent>,
}

impl Bench {
    fn new(mode: ActiveCode, stop: Option<StopCategory>, deceleration: u32) -> Self {
        let limits = limits().with_stop(20_000);
        let number = |n| MacId::new(n).unwrap();
        let first = AxisConfig::new(number(4), ActiveCode::CyclicPosition, 500_000, limits).with_stop(stop);
        let second = AxisConfig::new(number(5), mode, 500_000, limits).with_stop(stop).with_deceleration(deceleration);
        let drives = [4, 5].map(|n| Drive::new(DriveConfig::new(number(n), CODES)));
        let ring = Ring::new([first, second].map(Axis::new), 2).unwrap();
        let mut bench = Self { ring, drives, heard: [Heard::Nothing; 2], cut: [false; 2], now_ns: 0, sent: Vec::new() };
        bench.switch_on();
        bench
    }

    fn switch_on(&mut self) {
        for _ in 0..200 {
            self.update();
            let _ = self.ring.switch_on();
            if self.ring.all_are(AxisState::On) {
                return;
            }
        }
        panic!("{:?}", self.ring.failure());
    }

    fn update(&mut self) {
        self.now_ns += 500_000;
        let commands = self.ring.update(&self.heard, self.now_ns);
        for (place, command) in commands.iter().enumerate() {
            let block = command.main.emit();
            if place == 1 {
                let data = i32::from_le_bytes(block[4..8].try_into().unwrap());
                self.sent.push((block[2] & 0x80 != 0, block[1] >> 4, block[3], data));
            }
            self.heard[place] = if self.cut[place] {
                self.drives[place].framing_error();
                Heard::Nothing
            } else {
                Response::parse(&self.drives[place].hear(&block).unwrap()).into()
            };
        }
    }

    fn axis(&mut self) -> &mut Axis {
        &mut self.ring.axes_mut()[1]
    }

    /// Speeds up to `speed` units an update period, and keeps it for a while.
    fn run_at(&mut self, speed: i32) {
        for k in 1..=20 {
            let to = self.axis().setpoint().wrapping_add(speed / 20 * k);
            self.axis().set_position(to).unwrap();
            self.update();
        }
        for _ in 0..10 {
            let to = self.axis().setpoint().wrapping_add(speed);
            self.axis().set_position(to).unwrap();
            self.update();
        }
        self.sent.clear();
    }

    /// Steps between the blocks with the servo on, the first from `from`.
    fn steps(&self, from: i32) -> Vec<i32> {
        let positions: Vec<i32> = self.sent.iter().take_while(|sent| sent.0).map(|sent| sent.3).collect();
        let before = core::iter::once(from).chain(positions.iter().copied());
        positions.iter().zip(before).map(|(now, before)| now.wrapping_sub(before)).collect()
    }
}

/// What makes the axis stop.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cause {
    AlarmBeside,
    AxisOnRequest,
    RingOnRequest,
}

/// From any speed, by any cause: the first step is one deceleration less than the last one that was sent, whatever the caller has
/// asked for since, and so on down to rest; then the servo is off, or the axis is held.
#[test]
fn a_controlled_stop_only_slows_down() {
    for cause in [Cause::AlarmBeside, Cause::AxisOnRequest, Cause::RingOnRequest] {
        for category in [StopCategory::One, StopCategory::Two] {
            for (speed, deceleration, want) in [
                (50_000, 20_000, vec![30_000, 10_000]),
                (110_000, 40_000, vec![70_000, 30_000]),
                (-300, 40, vec![-260, -220, -180, -140, -100, -60, -20]),
                (20, 20, vec![]),
                (20, 200_000, vec![]),
                (-60, 21, vec![-39, -18]),
            ] {
                for asked in [None, Some(speed), Some(-speed), Some(4 * speed / 3)] {
                    let mut bench = Bench::new(ActiveCode::CyclicPosition, Some(category), deceleration);
                    bench.run_at(speed);
                    let last = bench.axis().setpoint();
                    let what = format!("{cause:?} {category:?} {speed} {asked:?}");
                    if let Some(by) = asked {
                        bench.axis().set_position(last + by).unwrap();
                    }
                    match cause {
                        Cause::AlarmBeside => {
                            let alarm = rtex_block::StatusFlags::ALARM;
                            let Heard::Main(response) = &mut bench.heard[0] else { panic!() };
                            response.status.insert(alarm);
                        }
                        Cause::AxisOnRequest => bench.axis().stop(category),
                        Cause::RingOnRequest => bench.ring.stop(category),
                    }
                    (0..20).for_each(|_| bench.update());
                    let mut steps = bench.steps(last);
                    let state = bench.axis().state();
                    if category == StopCategory::Two {
                        assert!(matches!(state, AxisState::Held(_)), "{what}: {state}");
                        assert!(steps.len() == 20 && steps[want.len()..].iter().all(|step| *step == 0), "{what}");
                        steps.truncate(want.len());
                    } else {
                        assert!(matches!(state, AxisState::Stopped(_)), "{what}: {state}");
                    }
                    assert_eq!(steps, want, "{what}");
                    assert_eq!(bench.drives[1].alarm(), None, "{what}");
                }
            }
        }
    }
}

/// Category 0 is a servo-off in the block after the failure, to every drive; so is 1 and 2 without a deceleration, or in CT.
#[test]
fn a_stop_at_once_is_one() {
    for (mode, category, deceleration) in [
        (ActiveCode::CyclicPosition, StopCategory::Zero, 40),
        (ActiveCode::CyclicPosition, StopCategory::One, 0),
        (ActiveCode::CyclicPosition, StopCategory::Two, 0),
        (ActiveCode::CyclicVelocity, StopCategory::Two, 0),
        (ActiveCode::CyclicVelocity, StopCategory::Zero, 40),
        (ActiveCode::CyclicTorque, StopCategory::One, 40),
        (ActiveCode::CyclicTorque, StopCategory::Two, 40),
        (ActiveCode::ProfilePosition, StopCategory::Zero, 40),
    ] {
        let mut bench = Bench::new(mode, Some(StopCategory::Zero), deceleration);
        bench.axis().stop(category);
        assert_eq!(bench.axis().state(), AxisState::Stopped(StopReason::Requested));
        bench.sent.clear();
        bench.update();
        assert!(!bench.sent[0].0 && bench.sent[0].1 != 0, "{mode:?} {category:?}");
        // The other one has gone with it.
        assert_eq!(bench.ring.axes()[0].state(), AxisState::Stopped(StopReason::OtherAxis { place: 1 }));
    }
}

/// A stop of a lower number takes the place of one that is under way; one of a higher number changes nothing, nor does any a second
/// time.
#[test]
fn a_stop_is_never_made_gentler() {
    use StopCategory::{One, Two, Zero};
    let states = |first: StopCategory, second: StopCategory| {
        let mut bench = Bench::new(ActiveCode::CyclicPosition, Some(One), 40);
        bench.run_at(200);
        bench.axis().stop(first);
        bench.update();
        bench.axis().stop(second);
        bench.sent.clear();
        let at_once = bench.axis().state();
        (0..20).for_each(|_| bench.update());
        (at_once, bench.axis().state(), bench.sent.iter().take_while(|sent| sent.0).count())
    };
    let (stopping, stopped) = (AxisState::Stopping(StopReason::Requested), AxisState::Stopped(StopReason::Requested));
    let held = AxisState::Held(StopReason::Requested);
    // 200: 160 before the second stop, then 120, 80, 40 go out, and 0 is the servo-off.
    for (first, second, want) in [
        (Two, One, (stopping, stopped, 3)),
        (One, Two, (stopping, stopped, 3)),
        (One, One, (stopping, stopped, 3)),
        (Two, Two, (stopping, held, 20)),
        (Two, Zero, (stopped, stopped, 0)),
        (One, Zero, (stopped, stopped, 0)),
    ] {
        assert_eq!(states(first, second), want, "{first:?} {second:?}");
    }
    // From Held, each way out.
    for (category, want) in [(Two, held), (One, stopped), (Zero, stopped)] {
        let mut bench = Bench::new(ActiveCode::CyclicPosition, Some(One), 40);
        bench.axis().stop(Two);
        assert_eq!(bench.axis().state(), held);
        assert_eq!(bench.axis().set_position(1), Err(SetpointError::NotOn));
        assert_eq!(bench.axis().set_mode(ActiveCode::CyclicTorque), Err(SetpointError::NotOn));
        bench.axis().stop(category);
        assert_eq!(bench.axis().state(), want);
    }
    let mut bench = Bench::new(ActiveCode::CyclicPosition, Some(One), 40);
    bench.run_at(200);
    bench.axis().stop(Two);
    (0..20).for_each(|_| bench.update());
    bench.ring.clear();
    assert!(bench.ring.all_are(AxisState::On));
    bench.sent.clear();
    let last = bench.axis().setpoint();
    bench.update();
    assert_eq!(bench.steps(last), [0]);
    bench.axis().stop(Two);
    bench.axis().switch_off();
    assert_eq!(bench.axis().state(), stopped);
}

/// Smooth_Stop in PP, as long as the drive generates a command; with category 2 for as long as the axis is held.
#[test]
fn a_profile_motion_is_ended_by_the_drive() {
    for category in [StopCategory::One, StopCategory::Two] {
        let mut bench = Bench::new(ActiveCode::ProfilePosition, Some(StopCategory::Zero), 0);
        bench.axis().start_move(0x11, 1_000_000, 2_000_000).unwrap();
        (0..60).for_each(|_| bench.update());
        bench.sent.clear();
        bench.axis().stop(category);
        (0..400).for_each(|_| bench.update());
        let smooth = bench.sent.iter().take_while(|sent| sent.0).all(|sent| sent.2 & 0x40 != 0);
        let on = bench.sent.iter().take_while(|sent| sent.0).count();
        assert!(smooth && on > 50, "{category:?}: {on}");
        match category {
            StopCategory::Two => assert_eq!((on, bench.axis().state()), (400, AxisState::Held(StopReason::Requested))),
            _ => assert_eq!(bench.axis().state(), AxisState::Stopped(StopReason::Requested)),
        }
        let failed = bench.axis().take_move().unwrap();
        let reason = rtex_block::master::Failure::Stopped(StopReason::Requested);
        assert_eq!(failed, rtex_block::master::Progress::Failed { error: reason });
        assert!(bench.drives[1].position() < 999_000);
    }
    // A motion that was started and has not begun: category 2 does not let it begin behind its back.
    let mut bench = Bench::new(ActiveCode::ProfilePosition, Some(StopCategory::Zero), 0);
    bench.drives[1].set_behaviour(rtex_block::device::Behaviour::new().with_in_progress_late(30));
    bench.axis().start_move(0x11, 1_000_000, 2_000_000).unwrap();
    (0..10).for_each(|_| bench.update());
    bench.axis().stop(StopCategory::Two);
    let from = bench.drives[1].position();
    (0..200).for_each(|_| bench.update());
    assert_eq!(bench.drives[1].position(), from);
    bench.ring.clear();
    (0..200).for_each(|_| bench.update());
    assert_eq!(bench.drives[1].position(), from);
}

/// The reason that came first stays, whatever is asked later.
#[test]
fn the_first_reason_of_a_stop_stays() {
    let mut bench = Bench::new(ActiveCode::CyclicPosition, Some(StopCategory::One), 100);
    bench.run_at(5_000);
    bench.drives[0].set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
    let other = StopReason::OtherAxis { place: 0 };
    while bench.axis().state() == AxisState::On {
        let to = bench.axis().setpoint().wrapping_add(5_000);
        bench.axis().set_position(to).unwrap();
        bench.update();
    }
    assert_eq!(bench.axis().state(), AxisState::Stopping(other));
    bench.ring.stop(StopCategory::Zero);
    assert_eq!(bench.axis().state(), AxisState::Stopped(other));
    assert_eq!(bench.ring.failure(), Some(RingFailure { place: 0, reason: StopReason::Alarm }));
}

/// A fault beside a stop on request: the others stop as their policy says, if that is sooner. Without a fault each axis comes to
/// rest in its own time.
#[test]
fn a_fault_beside_a_stop_on_request() {
    use StopCategory::{One, Two, Zero};
    for requested in [One, Two] {
        // 4,900 to 100 are 49 blocks, of which three are before the fault; an axis that is held stays on.
        let rest = if requested == Two { 101 } else { 46 };
        for (policy, want) in [(Some(Zero), 0), (Some(One), 46), (Some(Two), rest), (None, rest)] {
            let mut bench = Bench::new(ActiveCode::CyclicPosition, policy, 100);
            bench.run_at(5_000);
            bench.axis().stop(requested);
            (0..2).for_each(|_| bench.update());
            assert_eq!(bench.axis().state(), AxisState::Stopping(StopReason::Requested));
            bench.drives[0].set_fault(Fault::Alarm(Alarm { main: 38, sub: 1 }));
            while !matches!(bench.ring.axes()[0].state(), AxisState::Stopped(StopReason::Alarm)) {
                bench.sent.clear();
                bench.update();
            }
            (0..100).for_each(|_| bench.update());
            let on = bench.sent.iter().take_while(|sent| sent.0).count();
            assert_eq!(on, want, "{requested:?} {policy:?}: {}", bench.axis().state());
        }
    }
}

/// Two drives that fall silent in the same period do not make up for each other: nobody slows down, all are off.
#[test]
fn two_silent_drives_are_silent() {
    let mut bench = Bench::new(ActiveCode::CyclicPosition, Some(StopCategory::One), 1);
    bench.run_at(5_000);
    bench.cut = [true; 2];
    for _ in 0..=usize::from(crate::common::LIMIT) {
        bench.update();
    }
    assert!(bench.ring.axes().iter().all(|axis| matches!(axis.state(), AxisState::Stopped(_))));
    assert!(bench.ring.is_timed_out());
}

/// The communication is lost at an axis that is stopped already: everybody is switched off at the limit all the same.
#[test]
fn silence_of_a_stopped_axis_stops_everybody() {
    for stop in [None, Some(StopCategory::One), Some(StopCategory::Two)] {
        for axis_1_first in [false, true] {
            let mut bench = Bench::new(ActiveCode::CyclicPosition, stop, 1);
            let silent = usize::from(axis_1_first);
            // The one is stopped; the other goes on, or is slowing down for a long time.
            if stop.is_some() {
                bench.run_at(10_000);
            }
            bench.ring.axes_mut()[silent].stop(StopCategory::Zero);
            bench.update();
            bench.cut[silent] = true;
            (0..8).for_each(|_| bench.update());
            let [first, second] = bench.ring.axes().each_ref().map(Axis::state);
            assert!(!first.is_servo_on() && !second.is_servo_on(), "{stop:?}: {first}, {second}");
            assert!(bench.ring.is_timed_out());
            let place = u8::from(axis_1_first);
            let failure = Some(RingFailure { place, reason: StopReason::Requested });
            assert_eq!(bench.ring.failure(), failure);
        }
    }
}

/// Blocks that are refused are a failure of the communication like silence: everybody is off, whatever the policy.
#[test]
fn refused_blocks_are_silence() {
    let mut bench = Bench::new(ActiveCode::CyclicPosition, None, 1);
    for _ in 0..8 {
        bench.heard[0] = Response::parse(&[0; 16]).into();
        bench.update();
    }
    let states = bench.ring.axes().each_ref().map(Axis::state);
    assert!(matches!(states[0], AxisState::Stopped(StopReason::Refused(_))), "{}", states[0]);
    assert_eq!(states[1], AxisState::Stopped(StopReason::OtherAxis { place: 0 }));
}

/// CP to another mode and back before a block has gone out: the drive has never left CP, so the command position stays where it
/// was, however far behind it the motor is.
#[test]
fn a_mode_that_was_never_sent_leaves_the_set_point() {
    let mut bench = Bench::new(ActiveCode::CyclicPosition, None, 1);
    bench.run_at(100_000);
    let last = bench.axis().setpoint();
    assert!(last - bench.drives[1].position() > 250_000, "the motor is close behind");
    assert_eq!(bench.axis().set_mode(ActiveCode::CyclicTorque), Err(SetpointError::NotStanding));
    bench.update();
    assert_eq!(bench.sent.last().unwrap().3, last);
    bench.axis().set_mode(ActiveCode::CyclicTorque).unwrap();
    bench.axis().set_mode(ActiveCode::CyclicPosition).unwrap();
    bench.update();
    assert_eq!(bench.sent.last(), Some(&(true, 2, 0, last)));
    // Sent once, the motor turns on in CT: CP comes back when it stands, and no set-point before its first position.
    bench.axis().set_mode(ActiveCode::CyclicTorque).unwrap();
    bench.update();
    assert_eq!(bench.axis().set_mode(ActiveCode::CyclicPosition), Err(SetpointError::NotStanding));
    bench.axis().set_rate(-1).unwrap();
    let mut refused = 0;
    while bench.axis().set_mode(ActiveCode::CyclicPosition).is_err() {
        let against = -bench.drives[1].position().wrapping_sub(last).signum() * 3_000;
        let _ = bench.axis().set_rate(against);
        bench.update();
        refused += 1;
        assert!(refused < 5_000);
    }
    assert_eq!(bench.axis().set_position(0), Err(SetpointError::Mode));
    bench.update();
    bench.update();
    assert_eq!((bench.drives[1].alarm(), bench.axis().state()), (None, AxisState::On));
}

/// Anything in any order: consecutive command positions with the servo on are never further apart than the limit, a stop only slows
/// down, by one deceleration at a time, an axis that is held stands, and the drive never sees too large a step.
#[test]
fn whatever_is_done_the_wire_is_smooth() {
    let mut draw = Draw::default();
    let mut some = |below: u64| draw.below(below);
    let rounds = if cfg!(miri) { 1 } else { 60 };
    let (mut stops, mut modes, mut steps) = (0_u32, 0_u32, 0_u32);
    for _ in 0..rounds {
        let (deceleration, category) =
            (1 + some(9_000) as u32, [None, Some(StopCategory::One), Some(StopCategory::Two)][some(3) as usize]);
        let mut bench = Bench::new(ActiveCode::CyclicPosition, category, deceleration);
        let mut speed = 0_i32;
        // Position and step of the last block, in CP with the servo on.
        let mut before: Option<(i32, i32)> = None;
        for _ in 0..600 {
            match some(60) {
                0 => bench.axis().stop(StopCategory::One),
                1 => bench.axis().stop(StopCategory::Two),
                2 => bench.ring.stop([StopCategory::One, StopCategory::Two][some(2) as usize]),
                3 if some(5) == 0 => bench.axis().stop(StopCategory::Zero),
                4 => modes += u32::from(bench.axis().set_mode(ActiveCode::ALL[some(4) as usize]).is_ok()),
                5 => speed = some(180_000) as i32 - 90_000,
                6..=12 => speed = 0,
                13 if some(8) == 0 => bench.drives[0].set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
                14 => {
                    bench.drives[0].clear_alarm();
                    bench.ring.clear();
                }
                15 => bench.heard[1] = Heard::Nothing,
                _ => {}
            }
            let _ = bench.ring.switch_on();
            let to = bench.axis().setpoint().wrapping_add(speed);
            let _ = bench.axis().set_position(to);
            if bench.axis().mode() == ActiveCode::CyclicTorque {
                let _ = bench.axis().set_rate(0);
            }
            bench.update();
            let state = bench.axis().state();
            let (on, code, _, at) = *bench.sent.last().unwrap();
            let follows = matches!(state, AxisState::On | AxisState::Stopping(_) | AxisState::Held(_));
            assert!(on == follows || state == AxisState::SwitchingOn);
            let now = (follows && code == 2).then_some(at);
            before = match (before, now) {
                (Some((last, last_step)), Some(at)) => {
                    let step = at.wrapping_sub(last);
                    steps += 1;
                    assert!(step.abs() <= 200_000, "a step of {step}");
                    match state {
                        AxisState::Stopping(_) => {
                            stops += 1;
                            let slower = last_step.abs() - step.abs();
                            assert!((0..=deceleration as i32).contains(&slower), "{last_step} {step}");
                            assert!(step * last_step.signum() >= 0);
                        }
                        AxisState::Held(_) => assert!(step == 0 && last_step.unsigned_abs() <= deceleration),
                        _ => {}
                    }
                    Some((at, step))
                }
                (None, Some(at)) => Some((at, 0)),
                (_, None) => None,
            };
            assert_ne!(bench.drives[1].alarm(), Some(Alarm { main: 27, sub: 4 }));
        }
    }
    assert!(steps > 1_000 && stops > 100 && modes > 20, "{steps} {stops} {modes}");
}

/// Main power that comes after minutes: the ring waits, and nobody has failed. With a limit it does not.
#[test]
fn main_power_is_waited_for() {
    let number = |n| MacId::new(n).unwrap();
    for (ready, failed) in [(None, None), (Some(300), Some(RingFailure { place: 0, reason: StopReason::ReadyTimeout }))]
    {
        let limits = Limits::new(NonZeroU16::new(6).unwrap(), 60).with_ready(ready);
        let axis = AxisConfig::new(number(4), ActiveCode::CyclicPosition, 500_000, limits);
        let mut ring = Ring::new([Axis::new(axis)], 2).unwrap();
        let mut drive = Drive::new(DriveConfig::new(number(4), CODES));
        drive.set_fault(Fault::NoMainPower);
        let mut heard = [Heard::Nothing];
        for period in 0..20_000 {
            let [command] = ring.update(&heard, period * 500_000);
            heard = [Response::parse(&drive.hear(&command.main.emit()).unwrap()).into()];
        }
        assert_eq!(ring.failure(), failed);
        drive.set_fault(Fault::None);
        for period in 0..10 {
            let [command] = ring.update(&heard, period * 500_000);
            heard = [Response::parse(&drive.hear(&command.main.emit()).unwrap()).into()];
        }
        assert_eq!(ring.switch_on().is_ok(), failed.is_none());
    }
}
