//! Single cases of the laws: what broke one of them, and what is easier to say by itself.

use super::*;

/// A step that is due in this tick, at the begin of a ramp: there is no speed to stop from, and the line is not run to its end.
#[test]
fn a_stop_without_speed_and_with_a_step_that_is_due() {
    let [a, b] = [(1860, 2782), (999, 14_826)].map(|(a, scale)| AxisSetup::new(Limits::new(49, a).unwrap(), scale));
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(1000).unwrap(), [a, b], 0).unwrap());
    machine.push([-4, 1], 504, 0).unwrap();
    machine.set_override(1, 357);
    machine.hold(0);
    machine.resume(358);
    assert_eq!((machine.due(), machine.at(358)[0].speed), (Some(358), 0));
    machine.stop(358);
    assert_eq!((machine.due(), machine.is_empty(), machine.target()), (None, true, machine.commanded()));
}

/// There, back and there with a pause, at a clock of 1 MHz.
#[test]
fn an_axis_has_its_pause_where_it_turns_round() {
    let limits = Limits::new(20_000, 2_000_000).unwrap();
    let axis = AxisSetup::new(limits, 80_000);
    for pause in [0, 40, 900, 20_000] {
        let axis = axis.with_reversal_pause(pause);
        let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 2000).unwrap());
        for to in [[800, 0], [400, 300], [800, 600]] {
            machine.push(to, 250_000, 0).unwrap();
        }
        let (mut last, mut turns) = (None::<(u64, Direction)>, 0);
        while let Some(pulse) = machine.pulse() {
            if pulse.axis == 0 {
                if let Some((tick, _)) = last.filter(|(_, way)| *way != pulse.direction) {
                    assert!(pulse.tick - tick + 1 >= u64::from(pause), "{} of {pause}", pulse.tick - tick);
                    turns += 1;
                }
                last = Some((pulse.tick, pulse.direction));
            }
        }
        assert_eq!((machine.commanded(), turns), ([800, 600], 2));
    }
}

/// A corner is as slow as a pause takes, not slower: one of 40 us costs no rest.
#[test]
fn a_short_pause_does_not_stop_at_a_corner() {
    let limits = Limits::new(20_000, 200_000).unwrap();
    let over = |pause| {
        let axis = AxisSetup::new(limits, 80_000).with_reversal_pause(pause);
        let mut path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        for to in [[40, 800], [0, 1600]] {
            path.push(to, 100_000).unwrap();
        }
        let mut end = 0;
        while let Some(line) = path.next_line() {
            end = line.end();
        }
        end
    };
    let [none, short, long] = [0, 40, 20_000].map(over);
    assert!(none <= short && short < none + none / 100 && long >= none + 20_000, "{none} {short} {long}");
}

/// From 8000 steps/s a stop at 20,000 steps/s² takes 1600 steps, a quick one at 400,000 takes 80; also from within the stop.
#[test]
fn a_quick_stop_of_a_path_is_quick() {
    let axis = AxisSetup::new(Limits::new(8000, 20_000).unwrap(), 80_000);
    let quick = [Limits::new(1, 400_000).unwrap(); 2];
    for stops_before in [false, true] {
        let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 2000).unwrap());
        machine.push([8000, 0], 100_000, 0).unwrap();
        machine.push([8000, 4000], 100_000, 0).unwrap();
        let mut now = 0;
        while machine.commanded() != [4000, 0] {
            now = machine.pulse().unwrap().tick;
        }
        if stops_before {
            machine.stop(now);
        }
        machine.quick_stop(quick, now);
        assert_eq!(machine.push([0, 0], 1000, now), Err(Error::Moving));
        while machine.pulse().is_some() {}
        let [x, y] = machine.commanded();
        assert!((4078..=4083).contains(&x) && y == 0, "{x} {y}");
        machine.push([0, 0], 100_000, now + 10_000_000).unwrap();
        while machine.pulse().is_some() {}
        assert_eq!(machine.commanded(), [0, 0]);
    }
}

#[test]
fn soft_limits_of_a_path_refuse_and_change_nothing() {
    let axis = AxisSetup::new(Limits::new(8000, 20_000).unwrap(), 80_000);
    let axes = [axis.with_soft_limits(-10, 500), axis];
    let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, axes, 20).unwrap());
    machine.push([500, 9000], 100_000, 0).unwrap();
    assert_eq!(machine.push([501, 0], 100_000, 0), Err(Error::SoftLimit { target: 501 }));
    let due = machine.due();
    assert_eq!(machine.move_to([-11, 0], 100_000, 0), Err(Error::SoftLimit { target: -11 }));
    assert_eq!((machine.due(), machine.target(), machine.len()), (due, [500, 9000], 1));
    machine.push([-10, 0], 100_000, 0).unwrap();
}
/// A stop while the acceleration fades, with a later line that allows less jerk: with that the speed would rise above the limit.
#[test]
fn a_stop_takes_no_jerk_of_lines_that_it_does_not_reach() {
    let first = Limits::new(4256, 9321).unwrap().with_jerk(46_714).unwrap();
    let axes = [AxisSetup::new(first, 20_466), AxisSetup::new(Limits::new(49, 1_351_593).unwrap(), 19_416)];
    let mut machine = PathMover::new(Path::<2, 4>::new(Clock::MICROSECONDS, axes, 134).unwrap());
    machine.push([501, -427], 77_725, 4921).unwrap();
    machine.push([-651, 0], 10, 4921).unwrap();
    while machine.due().is_some_and(|due| due <= 63_376) {
        machine.pulse();
    }
    machine.stop(63_376);
    let mut last = 0;
    while let Some(pulse) = machine.pulse() {
        if pulse.axis == 1 {
            assert!(last == 0 || pulse.tick - last >= 20_407, "{} ticks at {last}", pulse.tick - last);
            last = pulse.tick;
        }
    }
    assert!(last > 90_000);
}

/// Held, and told of a new target by a clock that is ahead: the rest has begun when it has.
#[test]
fn a_clock_that_is_ahead_does_not_make_a_rest_later() {
    let setup = |a, j, scale| AxisSetup::new(Limits::new(49, a).unwrap().with_jerk(j).unwrap(), scale);
    let axes = [setup(3_516_624, 13_436_394, 45_028), setup(999, 1_000_000, 115_549)];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(1000).unwrap(), axes, 0).unwrap());
    machine.push([-475, 0], 102, 0).unwrap();
    machine.set_override(66, 0);
    machine.set_override(0, 165);
    machine.hold(0);
    machine.move_to([0, 0], 10, 169).unwrap();
    machine.stop(0);
    assert!(machine.due().is_none() && machine.is_at_rest(168));
}

/// A line of a step, and one after it that allows less where the axes use more: a stop that ends on the first one has nothing to do with that.
#[test]
fn a_quick_stop_is_no_later_for_a_line_that_it_does_not_reach() {
    let limits = |a, j| Limits::new(49, a).unwrap().with_jerk(j).unwrap();
    let axes =
        [AxisSetup::new(limits(115_833, 185_103), 4623), AxisSetup::new(Limits::new(49, 137_593).unwrap(), 147_013)];
    let rest = |quick: bool| {
        let mut machine = PathMover::new(Path::<2, 4>::new(Clock::MICROSECONDS, axes, 4).unwrap());
        machine.push([-1, 5], 3198, 0).unwrap();
        machine.push([136, 47], 10, 1).unwrap();
        while machine.due().is_some_and(|due| due <= 21_183) {
            machine.pulse();
        }
        if quick {
            machine.quick_stop([limits(999, 10_000), Limits::new(1, 8_187_864).unwrap()], 21_183);
        } else {
            machine.hold(21_183);
        }
        while machine.pulse().is_some() {}
        (21_183..100_000).find(|now| machine.is_at_rest(*now)).unwrap()
    };
    assert!(rest(true) <= rest(false) + 18, "{} {}", rest(true), rest(false));
}

/// A stop on the way to another target, six lines of which are short.
#[test]
fn a_stop_on_the_way_takes_no_more_steps_than_a_hold() {
    let limits = |v, a| Limits::new(v, a).unwrap();
    let axes = [
        AxisSetup::new(limits(140, 1_235_741).with_jerk(586_848).unwrap(), 93_704),
        AxisSetup::new(limits(1047, 5_637_619), 367_017),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(25_000).unwrap(), axes, 2).unwrap());
    machine.move_to([-3, 0], 8106, 0).unwrap();
    machine.push([89, -57], 96_641, 0).unwrap();
    machine.resume(0);
    machine.set_override(19, 431);
    let steps = |mut machine: Machine| {
        let mut steps = [0; 2];
        while let Some(pulse) = machine.pulse() {
            steps[usize::from(pulse.axis)] += 1;
        }
        steps
    };
    let mut held = machine.clone();
    held.hold(0);
    machine.move_to([-10, 0], 10, 0).unwrap();
    machine.hold(0);
    let (stop, hold) = (steps(machine), steps(held));
    assert!(stop[0] <= hold[0] + 1, "{stop:?} {hold:?}");
}

/// Stopped just before the end of a line, and sent back: the axis that turns has its pause.
#[test]
fn a_line_behind_a_stop_has_the_pause_of_an_axis_that_turns() {
    let axes = [
        AxisSetup::new(Limits::new(35_951, 11_103).unwrap(), 453_393).with_reversal_pause(20_778),
        AxisSetup::new(Limits::new(13_234, 39_387).unwrap().with_jerk(18_677_251).unwrap(), 137_084),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::MICROSECONDS, axes, 0).unwrap());
    machine.set_override(176, 0);
    machine.move_to([168, 73], 5617, 1).unwrap();
    let (mut last, mut turned) = ([None::<(u64, Direction)>; 2], 0);
    let mut take = |machine: &mut Machine, until: u64| {
        while machine.due().is_some_and(|due| due <= until) {
            let pulse = machine.pulse().unwrap();
            let before = last[usize::from(pulse.axis)].replace((pulse.tick, pulse.direction));
            if let Some((tick, _)) = before.filter(|(_, way)| pulse.axis == 0 && *way != pulse.direction) {
                assert!(pulse.tick - tick + 2 >= 20_778, "{tick} {}", pulse.tick - tick);
                turned += 1;
            }
        }
    };
    take(&mut machine, 249_518);
    machine.push([0, 0], 10, 249_518).unwrap();
    take(&mut machine, 249_519);
    machine.stop(249_519);
    take(&mut machine, 249_520);
    machine.push([0, 0], 970, 249_520).unwrap();
    take(&mut machine, u64::MAX);
    assert_eq!((machine.commanded(), turned), ([0, 0], 1));
}

/// A quick stop ends on the step before the place where a hold ends.
#[test]
fn a_quick_stop_of_a_short_line_takes_no_more_steps_than_a_hold() {
    let axes = [
        AxisSetup::new(Limits::new(125, 17_614).unwrap().with_jerk(83_599).unwrap(), 6473).with_reversal_pause(11_904),
        AxisSetup::new(Limits::new(1349, 948_950).unwrap(), 55_765),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::MICROSECONDS, axes, 1).unwrap());
    machine.push([-3, 0], 41_268, 0).unwrap();
    machine.push([-51, 3], 40_102, 1).unwrap();
    while machine.due().is_some_and(|due| due <= 38_923) {
        machine.pulse();
    }
    let steps = |mut machine: Machine| {
        let mut steps = [0; 2];
        while let Some(pulse) = machine.pulse() {
            steps[usize::from(pulse.axis)] += 1;
        }
        (steps, (38_923..1_000_000).find(|now| machine.is_at_rest(*now)).unwrap())
    };
    let mut held = machine.clone();
    held.hold(38_923);
    let quick = Limits::new(1, 54_426_867).unwrap().with_jerk(10_000).unwrap();
    machine.quick_stop([quick, Limits::new(1, 999).unwrap()], 38_923);
    let (quick, hold) = (steps(machine), steps(held));
    assert!(quick.0[0] <= hold.0[0] && quick.1 <= hold.1 + 2, "{quick:?} {hold:?}");
}

/// A stop that crosses a corner is not later than a hold that does.
#[test]
fn a_stop_over_a_corner_is_not_later_than_a_hold() {
    let axes = [
        AxisSetup::new(Limits::new(49, 999).unwrap(), 999),
        AxisSetup::new(Limits::new(49, 999).unwrap().with_jerk(13_369).unwrap(), 58_577),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(1000).unwrap(), axes, 5).unwrap());
    machine.push([1, -3], 50_188, 0).unwrap();
    machine.push([156, 0], 3745, 0).unwrap();
    machine.set_override(172, 0);
    while machine.due().is_some_and(|due| due <= 58) {
        machine.pulse();
    }
    let rest = |mut machine: Machine| {
        while machine.pulse().is_some() {}
        (machine.commanded(), (58..10_000).find(|now| machine.is_at_rest(*now)).unwrap())
    };
    let mut held = machine.clone();
    held.hold(58);
    machine.stop(58);
    let hold = rest(held);
    let stop = rest(machine);
    assert!(stop.0 == hold.0 && stop.1 <= hold.1 + 7, "{stop:?} {hold:?}");
}

/// Harder brakes before a corner, and a line after it that allows more: who comes there later is at rest later, so the quick stop is as the hold.
#[test]
fn a_quick_stop_before_a_corner_is_not_later_than_a_hold() {
    let limits = |v, a| Limits::new(v, a).unwrap();
    let mild = [AxisSetup::new(limits(500, 500_758), 13_490), AxisSetup::new(limits(49, 999), 2809)];
    let jerk = limits(49, 9_066_448).with_jerk(15_876_333_851).unwrap();
    let near = [AxisSetup::new(limits(36_054, 25_448), 87_100), AxisSetup::new(jerk, 999)];
    for (hz, axes, deviation, lines, now, quick) in [
        (1000, mild, 34, [([-3, 3], 17_833, 0), ([-660, 0], 91_673, 0)], 68, 1593),
        (1_000_000, near, 1, [([-614, 1], 137_570, 0), ([-2, 180], 36_018, 214_656)], 214_657, 999),
    ] {
        let mut machine = Machine::new(Path::new(Clock::new(hz).unwrap(), axes, deviation).unwrap());
        for (to, feed, at) in lines {
            while machine.due().is_some_and(|due| due <= at) {
                machine.pulse();
            }
            machine.push(to, feed, at).unwrap();
        }
        while machine.due().is_some_and(|due| due <= now) {
            machine.pulse();
        }
        let mut held = machine.clone();
        held.hold(now);
        machine.quick_stop([limits(1, 999), limits(1, quick)], now);
        let [quick, held] = [ending(&machine, now), ending(&held, now)];
        assert!(quick.is_within(held, 0, 2), "{quick:?}, {held:?} of a hold");
    }
}

/// A stop by override in the tick of a step that is half a step from rest, as near as rounding allows: to be told again adds no step.
#[test]
fn a_stop_adds_no_step_to_the_stop_before() {
    let axes = [(284_758, 16_000), (999, 473_886)].map(|(a, scale)| AxisSetup::new(Limits::new(49, a).unwrap(), scale));
    let mut machine = Machine::new(Path::new(Clock::new(1000).unwrap(), axes, 0).unwrap());
    machine.push([-139, 0], 10, 0).unwrap();
    machine.set_override(0, 3126);
    let before = ending(&machine, 1);
    machine.hold(2);
    machine.stop(3);
    let after = ending(&machine, 1);
    assert!(after.is_within(before, 0, 0), "{after:?}, {before:?} before");
}

/// A hold that goes around a corner, as slow as rounding allows there: a stop that is asked for meanwhile is the same.
#[test]
fn a_stop_during_a_hold_is_that_hold() {
    let jerk = Limits::new(180, 3_046_482).unwrap().with_jerk(45_905_882_855).unwrap();
    let axes = [AxisSetup::new(Limits::new(16_624, 2844).unwrap(), 550_099), AxisSetup::new(jerk, 3022)];
    let mut machine = Machine::new(Path::new(Clock::MICROSECONDS, axes, 10).unwrap());
    machine.move_to([-4, 3], 166_192, 0).unwrap();
    machine.set_override(61, 1);
    machine.push([157, 0], 130, 2).unwrap();
    while machine.due().is_some_and(|due| due <= 52_104) {
        machine.pulse();
    }
    machine.hold(52_104);
    let before = ending(&machine, 52_105);
    machine.stop(53_352);
    let after = ending(&machine, 52_105);
    assert_eq!((after.steps, after.rest), (before.steps, before.rest));
}

/// A hold that cannot be left before the next line, and is asked for again: it stays what it was, as a stop does.
#[test]
fn a_hold_that_could_not_be_left_is_the_same_hold() {
    let limits = |v, a, j| Limits::new(v, a).unwrap().with_jerk(j).unwrap();
    let axes = [
        AxisSetup::new(limits(31_449, 4342, 557_960), 42_475),
        AxisSetup::new(limits(2026, 8000, 1_545_779_475), 40_029),
    ];
    let mut machine = Machine::new(Path::new(Clock::MICROSECONDS, axes, 558).unwrap());
    for (to, feed, at) in
        [([178, 6], 151_546, 0), ([293, 13], 114_387, 291), ([581, 9], 300_000, 265_107), ([805, 9], 300_000, 265_107)]
    {
        while machine.due().is_some_and(|due| due <= at) {
            machine.pulse();
        }
        machine.push(to, feed, at).unwrap();
    }
    while machine.due().is_some_and(|due| due <= 277_505) {
        machine.pulse();
    }
    machine.hold(277_505);
    while machine.due().is_some_and(|due| due <= 290_454) {
        machine.pulse();
    }
    let before = ending(&machine, 290_454);
    machine.resume(290_454);
    machine.hold(290_454);
    let again = ending(&machine, 290_454);
    machine.stop(290_454);
    let stop = ending(&machine, 290_454);
    assert_eq!([again, stop].map(|end| (end.steps, end.rest)), [(before.steps, before.rest); 2]);
}
