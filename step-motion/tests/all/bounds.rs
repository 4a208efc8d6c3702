//! The bounds that a caller may ask for before a call refuses.

use step_motion::{Arc, Axis, AxisSetup, Clock, Direction, Limits, Mover, Path, PathMover, Queue, Turning, Work};

use crate::machine::Machine;

#[test]
fn the_bounds_that_are_said_are_those_that_are_checked() {
    assert_eq!((Clock::MIN_HZ, Clock::MAX_HZ), (1_000, 1_073_741_823));
    for (hz, fits) in [(999, false), (Clock::MIN_HZ, true), (Clock::MAX_HZ, true), (Clock::MAX_HZ + 1, false)] {
        assert_eq!(Clock::new(hz).is_some(), fits, "{hz} Hz");
    }
    assert_eq!((Limits::MAX_ACCELERATION, Limits::MAX_JERK), (2_147_483_647, 17_592_186_044_415));
    assert!(Limits::new(1, Limits::MAX_ACCELERATION).is_ok());
    assert!(Limits::new(1, Limits::MAX_ACCELERATION + 1).is_err());
    assert_eq!(Arc::MAX_RADIUS, 1_073_741_824);
    let quarter = |radius: i32| Arc::new([radius, 0], [0, radius], [0, 0], Turning::Clockwise, 1 << 29);
    assert!(quarter(1_073_741_824).is_ok());
    assert!(quarter(1_073_741_825).is_err());
}

#[test]
fn clocks_and_limits_as_numbers() {
    assert_eq!(u32::from(Clock::new(72_000_000).unwrap()), 72_000_000);
    let limits = Limits::new(20_000, 200_000).unwrap();
    assert_eq!(<(u32, u32, Option<u64>)>::from(limits), (20_000, 200_000, None));
    assert_eq!(
        <(u32, u32, Option<u64>)>::from(limits.with_jerk(4_000_000).unwrap()),
        (20_000, 200_000, Some(4_000_000))
    );
}

/// Steps are as far apart as the speed allows, whenever they begin.
fn apart(ticks: &[u64], least: u64) -> bool {
    ticks.windows(2).all(|pair| pair[1] - pair[0] + 1 >= least)
}

/// At rest any `now` may be the beginning, also the last tick that there is.
#[test]
fn no_time_is_too_late_to_begin() {
    for (hz, now) in [1000, 25_000, 1_000_000, 200_000_000]
        .into_iter()
        .flat_map(|hz| [u64::MAX, u64::MAX >> 1, u64::MAX / 1000, 1 << 40].map(|now| (hz, now)))
    {
        let limits = Limits::new(1000.min(hz / 2), 100_000).unwrap();
        let (clock, least) = (Clock::new(hz).unwrap(), u64::from(hz / limits.speed()));
        let mut axis = Mover::new(clock, limits).unwrap();
        let path = Path::new(clock, [AxisSetup::new(limits, 80_000)], 20).unwrap();
        let mut path = PathMover::<1, 4>::new(path);
        for to in [30, 0, 5] {
            axis.move_to(to, now).unwrap();
            path.push([to], 100_000, now).unwrap();
            let ticks: Vec<_> = core::iter::from_fn(|| axis.pulse()).map(|pulse| pulse.tick).collect();
            let others: Vec<_> = core::iter::from_fn(|| path.pulse()).map(|pulse| pulse.tick).collect();
            assert!(apart(&ticks, least), "{ticks:?} from {now} at {hz}");
            assert!(apart(&others, least), "{others:?} from {now} at {hz}");
            assert_eq!((axis.commanded(), path.commanded()), (to, [to]));
            assert!(axis.is_at_rest(u64::MAX) && path.is_at_rest(u64::MAX));
            axis.halt(now);
            path.halt(now);
        }
    }
}

/// A run ends at the last position, at rest, and there is a way back. At 1000 steps/s no step is sooner than 1 ms after the one before.
#[test]
fn a_run_ends_at_the_last_position() {
    let limits = Limits::new(1000, 10_000).unwrap();
    let both = [limits, limits.with_jerk(1_000_000).unwrap()];
    for (limits, away) in both.into_iter().flat_map(|limits| [0, 1, 2, 60, 400].map(|away| (limits, away))) {
        for (way, end, back) in [(Direction::Forward, i64::MAX, -away), (Direction::Reverse, i64::MIN, away)] {
            let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
            mover.set_commanded(end + back, 0).unwrap();
            mover.run(way, 1000, 0).unwrap();
            let ticks: Vec<_> = core::iter::from_fn(|| mover.pulse()).take(1000).map(|pulse| pulse.tick).collect();
            assert!(apart(&ticks, 990) && ticks.len() as u64 == away.unsigned_abs(), "{away} {way:?}: {ticks:?}");
            assert!(mover.is_at_rest(ticks.last().map_or(0, |tick| tick + 20_000)) && mover.commanded() == end);

            let queue: &'static Queue<129> = Box::leak(Box::default());
            let (mut axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits).unwrap();
            let mut machine = Machine::<_, 1>::new(timer);
            axis.set_commanded(end + back).unwrap();
            machine.position[0] = end + back;
            axis.run(way, 1000).unwrap();
            assert_eq!(machine.run(&mut axis, 5000, 4_000_000), Work::Rest);
            let ticks: Vec<_> = machine.steps.iter().map(|step| step.0).collect();
            assert!(apart(&ticks, 990) && axis.commanded() == end, "{away} {way:?}: {ticks:?}");
            axis.move_to(end + back.signum() * 3).unwrap();
            assert_eq!(machine.run(&mut axis, 5000, u64::MAX), Work::Rest);
            assert_eq!(axis.commanded(), end + back.signum() * 3);
        }
    }
}
