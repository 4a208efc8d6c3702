//! The runner: common jobs on a ring, and how they end.

use crate::common::{CODES, limits, monitor};
use rtex_block::device::{Drive, DriveConfig, Fault};
use rtex_block::master::procedure::SetPosition;
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, Ended, Failure, Heard, Ring, RingFailure, RingSwitchOnError, Run,
    SetpointError, StopCategory, StopReason, SwitchOnError,
};
use rtex_block::type_code::profile;
use rtex_block::{Alarm, MacId, Response, StatusFlags};

struct Bench {
    ring: Ring<2>,
    drives: [Drive; 2],
    heard: [Heard; 2],
    now_ns: u64,
    /// Update periods until the line fails.
    lasts: u32,
}

impl Run<2> for Bench {
    type Error = &'static str;

    fn ring_mut(&mut self) -> &mut Ring<2> {
        &mut self.ring
    }

    fn update(&mut self) -> Result<u64, &'static str> {
        self.lasts = self.lasts.checked_sub(1).ok_or("cut")?;
        self.now_ns += 500_000;
        let commands = self.ring.update(&self.heard, self.now_ns);
        for (place, command) in commands.iter().enumerate() {
            let block = self.drives[place].hear(&command.main.emit());
            self.heard[place] = block.map_or(Heard::Nothing, |block| Response::parse(&block).into());
        }
        Ok(self.now_ns)
    }
}

fn bench(mode: ActiveCode) -> Bench {
    let number = |n| MacId::new(n).unwrap();
    let config = |n| AxisConfig::new(number(n), mode, 500_000, limits().with_ready(None)).with_deceleration(10);
    let axis = |n| Axis::new(config(n));
    let drives = [4, 5].map(|n| Drive::new(DriveConfig::new(number(n), CODES)));
    let ring = Ring::new([axis(4), axis(5)], 2).unwrap();
    Bench { ring, drives, heard: [Heard::Nothing; 2], now_ns: 0, lasts: 100_000 }
}

/// As many update periods as are asked for.
#[test]
fn a_run_has_its_length() {
    for updates in [0, 1, 7] {
        let mut ring = bench(ActiveCode::CyclicPosition);
        ring.run(updates).unwrap();
        assert_eq!(ring.lasts, 100_000 - updates);
    }
}

#[test]
fn a_day_of_a_ring() {
    let mut ring = bench(ActiveCode::ProfilePosition);
    // The operator switches the main power on after five seconds.
    for drive in &mut ring.drives {
        drive.set_fault(Fault::NoMainPower);
    }
    ring.run(10_000).unwrap();
    for drive in &mut ring.drives {
        drive.set_fault(Fault::None);
    }
    ring.procedure(1, SetPosition::actual(70_000)).unwrap();
    ring.switch_on().unwrap();
    assert!(ring.ring.all_are(AxisState::On));
    assert_eq!(ring.ask(1, monitor(0x07)).unwrap().data(), Some(70_000));
    ring.home(0, 0xc8, 1_000).unwrap();
    ring.go(0, profile::RELATIVE, 30_000, 2_000_000).unwrap();
    ring.go(1, profile::RELATIVE, -20_000, 2_000_000).unwrap();
    ring.run(40).unwrap();
    assert_eq!(ring.drives.map(|drive| drive.position()), [30_000, 50_000]);
    // In CP from a source of positions: a ramp of 100 units a period, by the instant, from where each stands.
    for axis in ring.ring.axes_mut() {
        axis.set_mode(ActiveCode::CyclicPosition).unwrap();
    }
    ring.run(2).unwrap();
    let begin = ring.now_ns;
    ring.follow(|place, now_ns| {
        let periods = i32::try_from((now_ns - begin) / 500_000).unwrap();
        (periods <= 200).then_some([30_000, 50_000][place] + 100 * periods)
    })
    .unwrap();
    ring.run(60).unwrap();
    assert_eq!(ring.drives.map(|drive| drive.position()), [50_000, 70_000]);
    let mut calls = 0;
    ring.until(Some(5), |_| {
        calls += 1;
        calls == 4
    })
    .unwrap();
    let from = ring.now_ns;
    assert_eq!(ring.until(Some(5), |_| false), Err(Ended::Limit));
    assert_eq!((ring.now_ns - from) / 500_000, 5);
}

/// What is on is on; what is neither off nor on its way there is not waited for.
#[test]
fn switching_on_what_is_not_off_ends() {
    let mut ring = bench(ActiveCode::CyclicPosition);
    ring.switch_on().unwrap();
    ring.lasts = 100;
    assert_eq!(ring.switch_on(), Ok(()));
    // One is held, and one is still on.
    ring.ring.axes_mut()[1].stop(StopCategory::Two);
    ring.run(2).unwrap();
    let held = AxisState::Held(StopReason::Requested);
    let error = SwitchOnError::State(held);
    assert_eq!(ring.ring.axes()[1].state(), held);
    assert_eq!(ring.switch_on(), Err(Ended::SwitchOn(RingSwitchOnError { place: 1, error })));
    ring.ring.axes_mut()[1].clear();
    assert_eq!(ring.switch_on(), Ok(()));
    // One is off.
    ring.ring.axes_mut()[0].switch_off();
    let error = SwitchOnError::State(AxisState::On);
    assert_eq!(ring.switch_on(), Err(Ended::SwitchOn(RingSwitchOnError { place: 1, error })));
    ring.ring.switch_off();
    ring.lasts = 1_000;
    assert_eq!(ring.switch_on(), Ok(()));
    assert!(ring.ring.all_are(AxisState::On));
}

#[test]
fn every_end_of_a_job() {
    let alarm = Alarm { main: 16, sub: 0 };
    // An alarm at the start is said, and not waited for.
    let mut ring = bench(ActiveCode::ProfilePosition);
    ring.drives[1].set_fault(Fault::Alarm(alarm));
    assert_eq!(ring.switch_on(), Err(Ended::Alarm { place: 1 }));
    // An axis stops while another one is asked, waited for, or moves.
    let mut ring = bench(ActiveCode::ProfilePosition);
    ring.switch_on().unwrap();
    ring.drives[1].set_fault(Fault::Alarm(alarm));
    let failure = RingFailure { place: 1, reason: StopReason::Alarm };
    assert_eq!(ring.run(10), Err(Ended::Ring(failure)));
    // One that has stopped can be asked, and not moved.
    assert_eq!(ring.ask(1, monitor(0x07)).unwrap().data(), Some(0));
    assert_eq!(ring.go(0, profile::RELATIVE, 5, 5).err(), Some(Ended::Setpoint(SetpointError::NotOn)));
    assert_eq!(ring.home(0, 0xc8, 5), Err(Ended::Failed(Failure::Stopped(StopReason::OtherAxis { place: 1 }))));
    let mut ring = bench(ActiveCode::ProfilePosition);
    ring.switch_on().unwrap();
    ring.ring.axes_mut()[0].start_move(profile::RELATIVE, 1_000_000, 1_000_000).unwrap();
    ring.run(50).unwrap();
    ring.drives[1].set_fault(Fault::ServoDrop);
    let broken = ring.go(1, profile::RELATIVE, 1_000_000, 1_000_000).err();
    assert_eq!(broken, Some(Ended::Failed(Failure::Stopped(StopReason::NotActive))));
    // The place, and the line.
    let mut ring = bench(ActiveCode::ProfilePosition);
    assert_eq!(ring.ask(2, monitor(0x07)).err(), Some(Ended::Place));
    ring.lasts = 9;
    assert_eq!(ring.switch_on(), Err(Ended::Line("cut")));
    assert_eq!(Ended::Line("cut").to_string(), "the exchange failed: cut");
}

/// The drive at the place is homed, and no other.
#[test]
fn a_homing_is_that_of_its_place() {
    for place in 0..2 {
        let mut ring = bench(ActiveCode::ProfilePosition);
        ring.switch_on().unwrap();
        ring.home(place, 0xc8, 1_000).unwrap();
        let homed = ring.ring.axes().each_ref().map(|axis| axis.status().contains(StatusFlags::HOMING_COMPLETE));
        assert_eq!(homed, [place == 0, place == 1]);
    }
}
