//! A stop of a path is the same one whenever, however often and in whichever way it is asked for; and what comes after it.

use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

type Machine = PathMover<2, 8>;

/// 1000 steps/s, 5000 steps/s² and 50,000 steps/s³ along two lines in one direction, on one curve: full speed takes 150 steps.
fn machine() -> Machine {
    let limits = Limits::new(1000, 5000).unwrap().with_jerk(50_000).unwrap();
    let mut machine = PathMover::new(path(limits));
    machine.push([400, 0], 1000, 0).unwrap();
    machine.push([1000, 0], 1000, 0).unwrap();
    machine
}

fn path(limits: Limits) -> Path<2, 8> {
    Path::new(Clock::MICROSECONDS, [AxisSetup::new(limits, 1_000_000); 2], 20).unwrap()
}

/// Takes steps until so many are made; gives the tick of the last one.
fn take(machine: &mut Machine, until: i64) -> u64 {
    let mut last = 0;
    while machine.commanded()[0] < until {
        last = machine.pulse().unwrap().tick;
    }
    last
}

fn rest(machine: &mut Machine) -> Vec<u64> {
    core::iter::from_fn(|| machine.pulse()).map(|pulse| pulse.tick).collect()
}

#[test]
fn a_hold_that_is_asked_for_again_is_the_same() {
    for at in (30..500).step_by(37) {
        let mut once = machine();
        let now = take(&mut once, at);
        once.hold(now);
        let mut again = once.clone();
        let mut ticks = Vec::new();
        while let Some(pulse) = again.pulse() {
            ticks.push(pulse.tick);
            again.hold(pulse.tick);
            again.set_override(0, pulse.tick);
            again.set_override(100, pulse.tick);
        }
        assert_eq!(ticks, rest(&mut once), "{at}");
    }
}

/// At any step, across the joint too, and also while a hold is under way: the path ends where the hold would.
#[test]
fn a_stop_ends_where_a_hold_does() {
    for at in (20..560).step_by(9) {
        let mut held = machine();
        let now = take(&mut held, at);
        let mut stopped = held.clone();
        held.hold(now);
        stopped.stop(now);
        let aim = stopped.target();
        rest(&mut stopped);
        assert!(stopped.commanded() == aim && stopped.is_empty(), "{at}");
        let mut alone = held.clone();
        rest(&mut alone);
        assert_eq!(alone.commanded(), aim, "{at}");
        while let Some(pulse) = held.pulse() {
            let mut stopped = held.clone();
            stopped.stop(pulse.tick);
            rest(&mut stopped);
            assert!(stopped.commanded() == aim && stopped.is_empty(), "{at}: {:?}", stopped.commanded());
            stopped.resume(pulse.tick);
            stopped.push([aim[0] + 1, 0], 1000, pulse.tick).unwrap();
            assert!(stopped.due().is_some(), "{at}: it goes on");
        }
    }
}

/// At rest on the second line, after a brake that began on the first one: at 50,000 steps/s³ 4 to 5 steps take 78 to 85 ms.
#[test]
fn a_way_on_begins_at_rest() {
    let mut machine = machine();
    let now = take(&mut machine, 380);
    machine.hold(now);
    rest(&mut machine);
    assert!(machine.commanded()[0] > 410);
    machine.set_override(100, 2_000_000);
    machine.resume(2_000_000);
    let fifth = rest(&mut machine)[4];
    assert!((2_077_000..2_086_000).contains(&fifth), "{fifth}");
}

/// 1000 steps/s, and no way to rest: after a stop right at a step a way back begins half an interval later, and takes as long to its
/// first step.
#[test]
fn a_way_back_begins_behind_the_last_step() {
    let mut machine = PathMover::new(path(Limits::new(1000, 2_000_000_000).unwrap()));
    machine.push([10, 0], 1000, 0).unwrap();
    let last = take(&mut machine, 5);
    machine.stop(last);
    machine.push([0, 0], 1000, last).unwrap();
    let first = machine.due().unwrap();
    assert!((last + 999..=last + 1002).contains(&first), "{last} {first}");
}

/// A line that is added while a curve is under way is planned from there: where it makes no difference, it makes none. What is left of a
/// tick is not lost.
#[test]
fn a_curve_that_is_planned_again_goes_on_in_the_same_tick() {
    let limits = Limits::new(997, 4703).unwrap().with_jerk(50_021).unwrap();
    for length in 201..231 {
        // Back: it comes to rest at the end of the second line in any case.
        let lines = [[length, 0], [450, 0], [0, 0]];
        let ticks = |known: usize| {
            let (mut path, mut ticks) = (
                Path::<2, 8>::new(Clock::new(10_000).unwrap(), [AxisSetup::new(limits, 1_000_000); 2], 20).unwrap(),
                Vec::new(),
            );
            for to in &lines[..known] {
                path.push(*to, 1000).unwrap();
            }
            ticks.extend(path.next_line().unwrap().map(|pulse| pulse.tick));
            for to in &lines[known..] {
                path.push(*to, 1000).unwrap();
            }
            while let Some(line) = path.next_line() {
                ticks.extend(line.map(|pulse| pulse.tick));
            }
            ticks
        };
        let (all, late) = (ticks(3), ticks(2));
        let other = all.iter().zip(&late).filter(|(all, late)| all != late).count();
        assert!(all.len() == late.len() && other <= 4, "{length}: {other} of {}", all.len());
    }
}

/// A brake that does not fit on what is left of a line, because the line after it may have more jerk, begins at the joint; a hold does
/// so no sooner than a stop.
#[test]
fn a_stop_that_does_not_fit_is_no_longer_than_a_hold() {
    let limits = Limits::new(1232, 335_629).unwrap().with_jerk(373_964).unwrap();
    let setup = AxisSetup::new(limits, 478_936);
    for at in (0..160_000).step_by(500) {
        let mut machine = Machine::new(Path::new(Clock::MICROSECONDS, [setup; 2], 0).unwrap());
        machine.hold(0);
        machine.push([43, 0], 300_000, 1).unwrap();
        machine.push([148, 0], 300_000, 2).unwrap();
        machine.resume(3);
        while machine.due().is_some_and(|due| due <= at) {
            machine.pulse();
        }
        let left = |mut machine: Machine| core::iter::from_fn(|| machine.pulse()).count();
        let (mut held, mut stopped) = (machine.clone(), machine);
        held.hold(at);
        stopped.stop(at);
        let (held, stopped) = (left(held), left(stopped));
        assert!(stopped <= held, "at {at}: {stopped} steps of a stop, {held} of a hold");
    }
}

/// Twice the speed, ten times the acceleration and no limit of the jerk: for the stop, and not for the line after it.
#[test]
fn the_limits_of_a_quick_stop_end_with_it() {
    let takes = |machine: &mut Machine, now| {
        let from = machine.commanded()[0];
        machine.push([from + 600, 0], 5000, now).unwrap();
        let ticks = rest(machine);
        ticks[599] - ticks[0]
    };
    let mut stopped = machine();
    let now = take(&mut stopped, 300);
    stopped.quick_stop([Limits::new(2000, 50_000).unwrap(); 2], now);
    let now = rest(&mut stopped).pop().unwrap() + 10_000;
    assert!(stopped.commanded()[0] < 350);
    let mut fresh = machine();
    fresh.halt(0);
    let (stopped, fresh) = (takes(&mut stopped, now), takes(&mut fresh, 0));
    assert!(stopped.abs_diff(fresh) <= 1, "{stopped} {fresh}");
}

/// At rest after a hold, on either line: what is planned next begins where the motion has ended, 150 steps from where it was when the
/// hold came, half a step before a step.
#[test]
fn a_resume_begins_where_the_hold_has_ended() {
    for at in (200..500).step_by(7) {
        let mut machine = machine();
        let now = take(&mut machine, at);
        machine.hold(now);
        let now = rest(&mut machine).last().unwrap() + 100_000;
        machine.resume(now);
        let (begin, want) = (machine.at(now)[0].position, (2 * at + 299) << 31);
        assert!(begin.abs_diff(want) < 1 << 12, "{at}: {} / 2^32 steps from there", begin - want);
    }
}

/// On one curve over all lines a quick stop keeps the jerk of the weakest of them. Where the plain one has more on its first line, that
/// curve would be faster at first, though shorter: the interval before the fifth step of Y would be 8 % less.
#[test]
fn a_quick_stop_is_not_faster_where_it_begins() {
    let limits = |speed, jerk| Limits::new(speed, 40_000).unwrap().with_jerk(jerk).unwrap();
    let axes = [limits(14_917, 440_000), limits(3153, 8_000_000)];
    let path = axes.map(|limits| AxisSetup::new(limits, 80_000));
    let mut plain = PathMover::new(Path::<2, 16>::new(Clock::new(25_000_000).unwrap(), path, 13).unwrap());
    let lines = [
        ([-5, -4], 58_687),
        ([-6, -7], 136_121),
        ([-4, -9], 176_911),
        ([-2, -12], 293_028),
        ([0, -12], 291_141),
        ([9, -15], 108_346),
        ([5, -19], 111_673),
    ];
    for (to, feed) in lines {
        plain.push(to, feed, 0).unwrap();
    }
    for _ in 0..7 {
        plain.pulse().unwrap();
    }
    let (now, mut quick) = (1_047_716, plain.clone());
    plain.stop(now);
    quick.quick_stop(axes, now);
    let ticks = |mover: &mut PathMover<2, 16>| {
        let mut ticks: [Vec<u64>; 2] = Default::default();
        while let Some(pulse) = mover.pulse() {
            ticks[usize::from(pulse.axis)].push(pulse.tick);
        }
        ticks
    };
    let [plain, quick] = [ticks(&mut plain), ticks(&mut quick)];
    for (plain, quick) in plain.iter().zip(&quick) {
        assert!(quick.len() <= plain.len());
        for (plain, quick) in plain.windows(2).zip(quick.windows(2)) {
            let [plain, quick] = [plain, quick].map(|pair| pair[1] - pair[0]);
            assert!(quick + quick / 100 >= plain, "{quick} ticks in place of {plain}");
        }
    }
}

/// Before a corner for less speed than the motion has: a stop slows down to that and on, on one curve. 24 mm/s and -150 mm/s² take
/// 1.29 mm within 625 mm/s² and 3750 mm/s³, by hand; the corner, at most 0.9 mm on, is passed at 14 mm/s, and allows 21.5.
#[test]
fn a_stop_over_a_slower_corner_is_as_short_as_any() {
    let axis = AxisSetup::new(Limits::new(20_000, 50_000).unwrap().with_jerk(300_000).unwrap(), 80_000);
    let mut path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
    for (to, feed) in [([390, -20], 100_000), ([470, 10], 50_000), ([570, 150], 20_000)] {
        path.push(to, feed).unwrap();
    }
    let mut machine = PathMover::new(path);
    machine.resume(0);
    for made in 1..=372 {
        let now = machine.pulse().unwrap().tick;
        if made < 332 {
            continue;
        }
        let mut held = machine.clone();
        held.hold(now);
        let ticks = rest(&mut held);
        let more = ticks.len();
        assert!(more <= 131 && ticks.last().unwrap() - now <= 133_000, "{more} steps after {made}");
        // And it goes on to the end, whenever that is asked for.
        held.resume(ticks[more - 1]);
        let mut resumed = machine.clone();
        resumed.hold(now);
        for _ in 0..more / 2 {
            resumed.pulse().unwrap();
        }
        resumed.resume(ticks[more / 2]);
        for machine in [&mut held, &mut resumed] {
            rest(machine);
            assert_eq!(machine.commanded(), [570, 150], "{made}");
        }
    }
}
