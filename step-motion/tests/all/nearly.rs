//! A path nearly along one axis, of lines that allow nearly the same: whatever is asked for, it comes to rest no faster than its
//! acceleration takes back, but for what a corner allows at once.

use proptest::prelude::*;
use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

use crate::straight::{cases, request};

const HZ: u32 = 100_000_000;
/// In µm, at 100 steps/mm.
const DEVIATION: u32 = 10;

type Machine = PathMover<2, 6>;

fn way() -> impl Strategy<Value = [i64; 2]> {
    (20..300_i64, prop_oneof![6 => Just(0), 1 => -3..3_i64]).prop_map(|(x, y)| [x, y])
}

/// The ticks of the last two steps of the first axis.
fn until(machine: &mut Machine, last: &mut [Option<u64>; 2], a: f64, time: u64) -> Result<(), TestCaseError> {
    while machine.due().is_some_and(|due| due <= time) {
        let pulse = machine.pulse().unwrap();
        if pulse.axis == 0 {
            *last = [last[1], Some(pulse.tick)];
        }
    }
    if machine.is_at_rest(time) {
        if let [Some(before), Some(last)] = *last {
            let (speed, steps) = (f64::from(HZ) / (last - before + 1) as f64, f64::from(DEVIATION) * 0.1);
            let most = (3.0 * a).sqrt() + (8.0 * a * steps).sqrt();
            prop_assert!(speed <= most * 1.01, "at rest from {speed} steps/s at {last}, {most} at most");
        }
        *last = [None; 2];
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn a_path_nearly_along_an_axis_comes_to_rest(
        (v, a, j) in (1000..5000_u32, 10_000..100_000_u32, 200_000..50_000_000_u64), less in [30..200_u32, 30..200_u32],
        requests in prop::collection::vec((request(way()), 0..4_000_000_u64), 4..24),
    ) {
        let limits = Limits::new(v, a).unwrap().with_jerk(j).unwrap();
        let across = Limits::new(v, a * less[0] / 1000 + 1).unwrap().with_jerk(j * u64::from(less[1]) / 1000 + 1).unwrap();
        let axes = [limits, across].map(|limits| AxisSetup::new(limits, 100_000));
        let mut machine = PathMover::new(Path::new(Clock::new(HZ).unwrap(), axes, DEVIATION).unwrap());
        let (mut last, mut now) = ([None; 2], 0);
        for (request, wait) in requests {
            request.tell(&mut machine, now);
            now += wait;
            until(&mut machine, &mut last, a.into(), now)?;
        }
        machine.set_override(100, now);
        machine.resume(now);
        now += 60 * u64::from(HZ);
        until(&mut machine, &mut last, a.into(), now)?;
        prop_assert_eq!(machine.commanded(), machine.target());
        prop_assert!(machine.is_empty() && machine.is_at_rest(now));
    }
}
