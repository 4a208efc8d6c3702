//! A homing beside other requests to its axis: by itself and of a path, one by one and in two halves.

mod benches;
mod laws;

use step_motion::{
    AxesQueue, AxisSetup, Clock, Direction, Error, Homing, HomingConfig, HomingState, Limits, Mover, Path, PathMover,
    Queue, Switch,
};

use benches::{Ask, Bench, Case, Halves, OfAxes, OfPath, OneByOne};

/// The switch closes at this place and beyond, seen from where the axis is switched on.
const SWITCH: i64 = 400;
const STATES: [HomingState; 5] = [
    HomingState::Seeking,
    HomingState::Stopping,
    HomingState::BackingOff,
    HomingState::Approaching,
    HomingState::Settling,
];

fn limits() -> Limits {
    Limits::new(10_000, 50_000).unwrap()
}

fn config(approach: u32) -> HomingConfig {
    HomingConfig::new(Direction::Forward, 2000, approach, 3000, Limits::new(10_000, 100_000).unwrap()).with_back_off(80)
}

/// The same test of an axis by itself and of one of a path, each one by one and in two halves.
fn all(test: impl Fn(&mut dyn Bench, &str)) {
    all_of(Case::usual(), test);
}

fn all_of(case: Case, test: impl Fn(&mut dyn Bench, &str)) {
    test(&mut OneByOne::new(case), "Mover");
    test(&mut Halves::new(case, &Queue::new()), "Axis");
    test(&mut OfPath::new(case), "PathMover");
    test(&mut OfAxes::new(case, &AxesQueue::new(), false), "Axes");
    test(&mut OfAxes::new(case, &AxesQueue::new(), true), "Axes, late");
}

fn is_found(bench: &mut dyn Bench, case: &str) {
    bench.until(HomingState::Done);
    let (real, called) = bench.at();
    // What is made between two polls: 300 steps/s.
    assert!((real - called - SWITCH).abs() <= 1, "{case}: {called} is at {real}");
    bench.ask(Ask::MoveTo(0)).unwrap();
    for _ in 0..3000 {
        bench.go().unwrap();
    }
    assert_eq!(bench.at().1, 0, "{case}");
    assert_eq!(bench.ask(Ask::MoveTo(201)), Err(Error::SoftLimit { target: 201 }), "{case}");
}

#[test]
fn a_switch_is_found_by_any_axis() {
    all(|bench, name| is_found(bench, name));
}

/// It runs on for up to 11 steps after the switch, and in two halves for 4 ms more; all of them are counted.
#[test]
fn a_fast_approach_knows_where_the_switch_has_closed() {
    all_of(Case { config: config(1500), ..Case::usual() }, |bench, name| is_found(bench, name));
}

/// It has gone one step beyond the range when it stops: 40 steps at 2000 steps/s, and in two halves 4 ms and a poll more.
#[test]
fn a_switch_that_never_closes_is_given_up_at_the_end_of_the_range() {
    all_of(Case { switch: None, ..Case::usual() }, |bench, name| {
        bench.until(HomingState::Failed);
        for _ in 0..3000 {
            assert_eq!(bench.go(), Ok(HomingState::Failed), "{name}");
        }
        let (real, called) = bench.at();
        // A stop because the background is late may begin right before the end of the range.
        let least = if name == "Axes, late" { 3001 } else { 3040 };
        assert!(
            bench.is_at_rest() && real == called && (least..=3050).contains(&real),
            "{name}: {called} is at {real}"
        );
    });
}

/// It waits where it is, and goes on.
#[test]
fn a_hold_holds_a_homing() {
    for state in STATES {
        for (hold, resume) in [(Ask::Hold, Ask::Resume), (Ask::Override(0), Ask::Override(100))] {
            all(|bench, name| {
                let case = format!("{name}: {hold:?} when {state:?}");
                bench.until(state);
                bench.ask(hold).unwrap();
                for _ in 0..3000 {
                    let now = bench.go().unwrap();
                    assert!(now != HomingState::Failed && now != HomingState::Done, "{case}: {now:?}");
                }
                let at = bench.at();
                for _ in 0..3000 {
                    bench.go().unwrap();
                }
                assert_eq!((bench.at(), bench.is_at_rest()), (at, true), "{case}");
                bench.ask(resume).unwrap();
                is_found(bench, &case);
            });
        }
    }
}

/// Whoever stops the axis, or sends it elsewhere, has it: the homing makes no further motion.
#[test]
fn another_request_ends_a_homing() {
    for state in STATES {
        for ask in [Ask::Stop, Ask::Quick, Ask::Halt, Ask::MoveTo(-50)] {
            all(|bench, name| {
                let case = format!("{name}: {ask:?} when {state:?}");
                bench.until(state);
                if bench.ask(ask) == Err(Error::Moving) {
                    // In the quick stop at the switch, and so without an effect.
                    return is_found(bench, &case);
                }
                for _ in 0..8000 {
                    assert_eq!(bench.go(), Ok(HomingState::Failed), "{case}");
                }
                let (_, called) = bench.at();
                assert!(bench.is_at_rest(), "{case}");
                if let Ask::MoveTo(to) = ask {
                    assert_eq!(called, to, "{case}");
                }
                for _ in 0..3000 {
                    bench.go().unwrap();
                }
                assert_eq!(bench.at().1, called, "{case}");
            });
        }
    }
}

/// A path of two axes has no third one, and nothing moves.
#[test]
fn an_axis_that_a_path_does_not_have() {
    let path = Path::<2, 4>::new(Clock::MICROSECONDS, [AxisSetup::new(limits(), 80_000); 2], 20).unwrap();
    let mut mover = PathMover::new(path);
    for switch in [Switch::Open, Switch::Closed] {
        let homing = Homing::start_path(config(300), &mut mover, 2, switch, 0);
        assert_eq!(homing.unwrap_err(), Error::NoAxis { axis: 2, axes: 2 });
        assert!(mover.is_at_rest(0) && mover.is_empty());
    }
}

/// Towards a soft limit that is behind, it does not run; towards one that is farther than a plan leads, it does.
#[test]
fn a_run_to_a_soft_limit_however_far_it_is() {
    for (low, high, forward, reverse) in [
        (100, 200, 200, 0),
        (-200, -100, 0, -200),
        (-(1 << 31), 1 << 31, 3000, -3000),
        (i64::MIN, i64::MAX, 3000, -3000),
    ] {
        for (direction, to) in [(Direction::Forward, forward), (Direction::Reverse, reverse)] {
            let mut mover = Mover::new(Clock::MICROSECONDS, limits()).unwrap().with_soft_limits(low, high);
            mover.run(direction, 5000, 0).unwrap();
            while mover.commanded().abs() < 3000 && mover.pulse().is_some() {}
            assert_eq!(mover.commanded(), to, "{direction} in {low}..={high}");
        }
    }
}
