//! Every job of the runner is cut at every update period by every cause: it ends, for the reason that there was, and what it says is
//! done is done, by the motors themselves. Afterwards the ring is switched on again.
//!
//! `HOSTILE_EVENTS=1000000 SEED=7 cargo test --release -p rtex-block --test all run_cut:: -- --nocapture` cuts a million jobs by chance.

use crate::common::{CODES, limits, monitor};
use rtex_block::device::{Drive, DriveConfig, Fault};
use rtex_block::master::procedure::{Backup, ParameterValue, SetPosition};
use rtex_block::master::{
    ActiveCode, AskError, Axis, AxisConfig, AxisState, Ended, Failure, Heard, Ring, RingFailure, Run, SetpointError,
    StopCategory, StopReason, SwitchOnError,
};
use rtex_block::type_code::profile;
use rtex_block::{Alarm, ErrorCode, MacId, Pr, Response, Response32};
use servowire_world::{Draw, Seed, first_seed, wanted_events};

/// The longest that a job may go on after its cause: an answer has 60 update periods, a homing 200.
const PATIENCE: u32 = 500;
const NEVER: u32 = u32::MAX;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Cause {
    Silence,
    AllSilent,
    Alarm,
    /// Comes back after 100 update periods: a job that switches on waits for it without a limit.
    Power,
    /// Is released after 100 update periods, too.
    EmergencyStop,
    Drop,
    /// CMD_Error 0021h to everything.
    Refusal,
    /// One block does not come.
    Lost,
    /// The line itself fails.
    Line,
    Stop(StopCategory),
    SwitchOff,
}

const CAUSES: [Cause; 13] = [
    Cause::Silence,
    Cause::AllSilent,
    Cause::Alarm,
    Cause::Power,
    Cause::EmergencyStop,
    Cause::Drop,
    Cause::Refusal,
    Cause::Lost,
    Cause::Line,
    Cause::Stop(StopCategory::Zero),
    Cause::Stop(StopCategory::One),
    Cause::Stop(StopCategory::Two),
    Cause::SwitchOff,
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Job {
    SwitchOn,
    Wait,
    Ask,
    Home,
    Go,
    Follow,
    SetPosition,
    Backup,
}

const JOBS: [Job; 8] =
    [Job::SwitchOn, Job::Wait, Job::Ask, Job::Home, Job::Go, Job::Follow, Job::SetPosition, Job::Backup];

#[derive(Clone)]
struct Bench {
    ring: Ring<2>,
    drives: [Drive; 2],
    heard: [Heard; 2],
    wide: bool,
    now: u32,
    /// When what happens, to whom.
    at: u32,
    cause: Cause,
    victim: usize,
}

impl Bench {
    fn new(mode: ActiveCode, wide: bool) -> Self {
        let number = |n| MacId::new(n).unwrap();
        let config = |n| AxisConfig::new(number(n), mode, 500_000, limits().with_ready(None)).with_deceleration(50);
        let drives = [4, 5].map(|n| Drive::new(DriveConfig::new(number(n), CODES).with_homing_distance(-900)));
        let ring = Ring::new([4, 5].map(|n| Axis::new(config(n))), 2).unwrap();
        Self { ring, drives, heard: [Heard::Nothing; 2], wide, now: 0, at: NEVER, cause: Cause::Lost, victim: 0 }
    }

    /// It has happened, and lasts.
    fn lasts(&self) -> bool {
        self.now >= self.at
    }

    fn happens(&mut self) {
        let drive = &mut self.drives[self.victim];
        match self.cause {
            Cause::Alarm => drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 })),
            Cause::Power => drive.set_fault(Fault::NoMainPower),
            Cause::EmergencyStop => drive.set_fault(Fault::EmergencyStop),
            Cause::Drop => drive.set_fault(Fault::ServoDrop),
            Cause::Stop(category) => self.ring.stop(category),
            Cause::SwitchOff => self.ring.switch_off(),
            Cause::Silence | Cause::AllSilent | Cause::Refusal | Cause::Lost | Cause::Line => {}
        }
    }

    /// What the drive at `place` answers to a block of either size.
    fn exchange(&mut self, place: usize, block: &[u8; 32]) -> Heard {
        let refused = self.lasts() && self.cause == Cause::Refusal && place == self.victim;
        let refuse = |block: &mut [u8]| {
            if refused {
                block[1] |= 0x80;
                block[8..16].copy_from_slice(&[0x21, 0, 0, 0, 0, 0, 0, 0]);
            }
        };
        if self.wide {
            let Some(mut block) = self.drives[place].hear(block) else { return Heard::Nothing };
            refuse(&mut block);
            Response32::parse(&block).into()
        } else {
            let Some(mut block) = self.drives[place].hear(block.first_chunk::<16>().unwrap()) else {
                return Heard::Nothing;
            };
            refuse(&mut block);
            Response::parse(&block).into()
        }
    }
}

impl Run<2> for Bench {
    type Error = &'static str;

    fn ring_mut(&mut self) -> &mut Ring<2> {
        &mut self.ring
    }

    fn update(&mut self) -> Result<u64, &'static str> {
        self.now += 1;
        if self.now == self.at {
            self.happens();
        }
        let passes = matches!(self.cause, Cause::Power | Cause::EmergencyStop);
        if self.lasts() && passes && self.now - self.at == 100 {
            self.drives[self.victim].set_fault(Fault::None);
        }
        if self.lasts() && self.cause == Cause::Line {
            return Err("cut");
        }
        if self.now > self.at.saturating_add(PATIENCE).min(20_000) {
            return Err("it hangs");
        }
        let now_ns = u64::from(self.now) * 500_000;
        let commands = self.ring.update(&self.heard, now_ns);
        for (place, command) in commands.iter().enumerate() {
            let silent = match self.cause {
                Cause::Silence => self.lasts() && place == self.victim,
                Cause::AllSilent => self.lasts(),
                Cause::Lost => self.now == self.at && place == self.victim,
                _ => false,
            };
            let heard = self.exchange(place, &command.emit());
            self.heard[place] = if silent { Heard::Nothing } else { heard };
        }
        Ok(now_ns)
    }
}

/// Runs the job on axis 0; `Ok` says whether what it reports is true.
fn run(bench: &mut Bench, job: Job) -> Result<bool, Ended<&'static str>> {
    let near = |at: i32, to: i32, by: u32| at.abs_diff(to) <= by;
    match job {
        Job::SwitchOn => bench.switch_on().map(|()| bench.drives.iter().all(Drive::is_active)),
        Job::Wait => bench.run(40).map(|()| true),
        Job::Ask => {
            let data = bench.ask(0, monitor(0x07))?.data().unwrap();
            Ok(near(data, bench.drives[0].position(), 2))
        }
        // The way to the origin is 900 units long, and it is 0 there.
        Job::Home => bench.home(0, CODES.homing, 200).map(|()| near(bench.drives[0].position(), 0, 50)),
        Job::Go => {
            let to = bench.drives[0].position() + 20_000;
            bench.go(0, profile::RELATIVE, 20_000, 1_000_000)?;
            Ok(near(bench.drives[0].position(), to, 100))
        }
        Job::Follow => {
            let (from, begin) = ([0, 1].map(|place: usize| bench.drives[place].position()), bench.now);
            bench.follow(|place, now_ns| {
                let periods = (now_ns / 500_000) as i32 - begin as i32;
                (periods <= 40).then(|| from[place] + 100 * periods)
            })?;
            // The last position is on its way: the drives follow by some periods.
            Ok([0, 1].iter().all(|place| near(bench.drives[*place].position(), from[*place] + 4_000, 400)))
        }
        Job::SetPosition => {
            let value = bench.procedure(0, SetPosition::actual(1_234))?;
            Ok(value == 1_234 && bench.drives[0].position() == 1_234)
        }
        Job::Backup => {
            let mut list = [(7, 25), (8, 1)].map(|(class, number)| ParameterValue::new(Pr { class, number }, 0));
            bench.procedure(0, Backup::new(CODES.parameter_read, &mut list))?;
            Ok(list.map(|it| it.value) == [1, 1_000])
        }
    }
}

/// The reasons for which the axis at `place` may have stopped.
fn is_reason(reason: StopReason, place: usize, cause: Cause, victim: usize) -> bool {
    let own = place == victim;
    match (reason, cause) {
        (StopReason::OtherAxis { place: other }, Cause::AllSilent) => usize::from(other) != place,
        (StopReason::OtherAxis { place: other }, _) => !own && usize::from(other) == victim,
        (StopReason::EchoTimeout, Cause::Silence)
        | (StopReason::Alarm, Cause::Alarm)
        | (StopReason::NotReady, Cause::Power | Cause::EmergencyStop)
        | (StopReason::NotActive, Cause::Drop) => own,
        (StopReason::CommandError(code), Cause::Refusal) => own && code == ErrorCode(0x21),
        (StopReason::EchoTimeout, Cause::AllSilent) | (StopReason::Requested, Cause::Stop(_)) => true,
        _ => false,
    }
}

/// Whether the cause explains this end of the job on axis 0.
fn is_true(ended: Ended<&'static str>, job: Job, cause: Cause, victim: usize) -> bool {
    let stops = matches!(cause, Cause::Stop(_));
    match ended {
        Ended::Line(what) => what == "cut" && cause == Cause::Line,
        Ended::Ring(RingFailure { place, reason }) => is_reason(reason, place.into(), cause, victim),
        Ended::Alarm { place } => cause == Cause::Alarm && usize::from(place) == victim && job == Job::SwitchOn,
        Ended::SwitchOn(error) => match error.error {
            SwitchOnError::State(AxisState::Held(StopReason::Requested)) => stops,
            SwitchOnError::State(AxisState::On) => stops || cause == Cause::SwitchOff,
            SwitchOnError::State(AxisState::SwitchingOff | AxisState::Off) => cause == Cause::SwitchOff,
            _ => false,
        },
        // An axis that is stopping, held, off or not yet on again takes no set-point.
        Ended::Setpoint(error) => error == SetpointError::NotOn && (stops || cause == Cause::SwitchOff),
        Ended::Failed(Failure::Stopped(reason)) => is_reason(reason, 0, cause, victim),
        Ended::Failed(Failure::ServoOff) => cause == Cause::SwitchOff,
        Ended::Failed(Failure::TimedOut) => match cause {
            Cause::AllSilent => true,
            // Nor does a drive answer that discards every block.
            Cause::Silence | Cause::Refusal => victim == 0,
            _ => false,
        },
        // An axis that hears nothing asks nothing new; what was asked before is not taken back by that.
        Ended::Failed(Failure::NotSent(AskError::Busy)) => {
            let unheard = matches!(cause, Cause::Silence | Cause::Refusal) && victim == 0 || cause == Cause::AllSilent;
            unheard && matches!(job, Job::Ask | Job::Backup | Job::SetPosition)
        }
        Ended::Failed(Failure::CommandError(code)) => cause == Cause::Refusal && victim == 0 && code == ErrorCode(0x21),
        _ => false,
    }
}

/// A ring that is ready for the job.
fn ready(job: Job, wide: bool) -> Bench {
    let mode = if job == Job::Follow { ActiveCode::CyclicPosition } else { ActiveCode::ProfilePosition };
    let mut bench = Bench::new(mode, wide);
    if job == Job::SwitchOn {
        return bench;
    }
    bench.until(Some(400), |ring| ring.axes().iter().all(|axis| axis.can_switch_on().is_ok())).unwrap();
    bench.procedure(0, SetPosition::actual(70_000)).unwrap();
    if job != Job::SetPosition {
        bench.switch_on().unwrap();
    }
    bench.run(10).unwrap();
    bench
}

/// Cuts the job by the cause `after` so many update periods; returns whether it was over before.
fn cut(from: &Bench, job: Job, cause: Cause, victim: usize, after: u32) -> bool {
    let mut bench = Bench { at: from.now + after, cause, victim, ..from.clone() };
    let what = (job, cause, victim, after, bench.wide);
    match run(&mut bench, job) {
        // What happens in the last exchange has not been heard yet.
        Ok(is_so) => assert!(
            is_so || bench.now == bench.at,
            "{what:?}: it is not done: {:?}",
            bench.drives.map(|drive| drive.position())
        ),
        Err(ended) => {
            assert!(bench.lasts() && cause != Cause::Lost, "{what:?}: {ended:?} without a cause");
            assert!(is_true(ended, job, cause, victim), "{what:?}: {ended:?}");
            let not_sent = matches!(ended, Ended::Failed(Failure::NotSent(_)));
            let is_set = job == Job::SetPosition && bench.drives[0].position() != 70_000;
            assert!(!not_sent || !is_set, "{what:?}: it was sent: {}", bench.drives[0].position());
        }
    }
    let over = !bench.lasts();
    // It is repaired, and goes on.
    (bench.at, bench.cause) = (NEVER, Cause::Lost);
    for drive in &mut bench.drives {
        drive.set_fault(Fault::None);
        drive.clear_alarm();
    }
    bench.ring.switch_off();
    bench.ring.stop(StopCategory::Zero);
    let settle = (0..30).try_for_each(|_| bench.update().map(|_| ()));
    for drive in &mut bench.drives {
        drive.clear_alarm();
    }
    bench.ring.clear();
    assert_eq!((settle, bench.switch_on()), (Ok(()), Ok(())), "{what:?}: it is not switched on again");
    over
}

#[test]
fn every_job_ends_for_its_reason() {
    let (wanted, seed) = (wanted_events(1_000), first_seed());
    let (_said, mut draw) = (Seed(seed), Draw::seeded(seed));
    let rings = JOBS.map(|job| [false, true].map(|wide| ready(job, wide)));
    let mut cuts = [0_u64; CAUSES.len()];
    for (job, rings) in JOBS.into_iter().zip(&rings) {
        for (k, cause) in CAUSES.into_iter().enumerate() {
            for victim in 0..2 {
                for after in 1.. {
                    cuts[k] += 1;
                    if cut(&rings[after as usize % 2], job, cause, victim, after) {
                        break;
                    }
                }
            }
        }
    }
    for _ in 0..wanted {
        let mut below = |limit: usize| draw.below(limit as u64) as usize;
        let (job, k, victim, wide) = (below(JOBS.len()), below(CAUSES.len()), below(2), below(2));
        cuts[k] += 1;
        cut(&rings[job][wide], JOBS[job], CAUSES[k], victim, 1 + below(90) as u32);
    }
    println!("jobs cut by each cause: {cuts:?}");
    assert!(cuts.iter().all(|count| *count > 500), "{cuts:?}");
}
