//! Where an axis of a path turns round: DIR, the pause, and the steps on either side.

use step_motion::{Axes, AxesQueue, AxisSetup, Clock, Limits, Path, Work};

use crate::halts::Dice;
use crate::machine::Machine;

const SLOTS: usize = 513;

/// A driver needs its time between a step and DIR and between DIR and the next step, wherever a block ends: half of the pause each, or a
/// quarter of the reach.
#[test]
fn dir_has_half_of_the_pause_on_either_side() {
    for (pause, half, reach) in [(40, 20, 10_000), (900, 450, 10_000), (20_000, 2500, 10_000), (900, 25, 100)] {
        let axis = AxisSetup::new(Limits::new(8000, 800_000).unwrap(), 80_000).with_reversal_pause(pause);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (axes, timer) = Axes::new(&queue, path);
        let (mut axes, mut machine) = (axes.with_reach(reach), Machine::new(timer));
        for i in 1..300_i64 {
            let to = [i % 2 * (20 + i % 7), i % 3 * 10];
            while axes.is_full() {
                let soon = machine.now + 1000;
                machine.run(&mut axes, u64::from(reach / 2), soon);
            }
            axes.push(to, 100_000).unwrap();
        }
        machine.run(&mut axes, u64::from(reach / 2), u64::MAX);
        assert!(machine.turns.len() > 400);
        for (before, after) in machine.turns {
            assert!(before + 2 >= half && after + 2 >= half, "{before} and {after} of {pause} at {reach}");
        }
    }
}

/// A line that is pushed after any slice of the work on the block before, which ends at rest: it begins in that block or after it, and
/// none of its steps is due before that.
#[test]
fn a_line_behind_a_rest_begins_at_rest() {
    for slices in 0..250 {
        let axis = AxisSetup::new(Limits::new(8000, 8_000_000).unwrap(), 80_000);
        let path = Path::<3, 4>::new(Clock::MICROSECONDS, [axis; 3], 20).unwrap();
        let queue = AxesQueue::<3, SLOTS>::new();
        let (mut axes, timer) = Axes::new(&queue, path);
        let mut machine = Machine::<_, 3>::new(timer);
        axes.push([5, 0, 0], 100_000).unwrap();
        for _ in 0..slices {
            machine.slice(&mut axes);
        }
        axes.push([5, 50, 0], 100_000).unwrap();
        axes.push([55, 50, 50], 100_000).unwrap();
        assert_eq!(machine.run(&mut axes, 5000, u64::MAX), Work::Rest);
        assert_eq!(machine.position, [55, 50, 50]);
        let mut last = [None; 3];
        for &(tick, axis, _) in &machine.steps {
            let before: u64 = last[axis].replace(tick).unwrap_or(0);
            assert!(before == 0 || tick - before >= 124, "{} of axis {axis} at {tick}, {slices}", tick - before);
        }
    }
}

/// At full speed and high acceleration, with a way back at once: the first step is a step of 125 us after the last one, and DIR has half
/// of the pause on either side, although nobody knows how much of what was handed out has been made.
#[test]
fn a_way_back_behind_a_halt_keeps_its_distance() {
    for (pause, at) in [0, 300, 3000].into_iter().flat_map(|pause| (40..60).map(move |at| (pause, 613 * at))) {
        let limits = Limits::new(8000, 2_000_000_000).unwrap();
        let axis = AxisSetup::new(limits, 80_000).with_reversal_pause(pause);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (mut axes, timer) = Axes::new(&queue, path);
        let mut machine = Machine::<_, 2>::new(timer);
        axes.push([8000, 4000], 1_000_000).unwrap();
        machine.run(&mut axes, 5000, at);
        machine.until(at);
        let made = machine.steps.len();
        axes.halt();
        assert_eq!(axes.poll(), Work::Start);
        machine.fire();
        assert_eq!(axes.poll(), Work::More);
        axes.push([0, 0], 100_000).unwrap();
        machine.run(&mut axes, 5000, at + 20_000);
        let (before, after) = machine.steps.split_at(made);
        for axis in 0..2 {
            let last = before.iter().rev().find(|step| step.1 == axis).unwrap().0;
            let first = after.iter().find(|step| step.1 == axis).unwrap().0;
            assert!(first - last >= 124.max(u64::from(pause)), "{} after a halt at {at}", first - last);
        }
        let half = u64::from(pause / 2).min(2500);
        for (before, after) in &machine.turns {
            assert!(before + 2 >= half && after + 2 >= half, "{before} and {after} of {pause}, after a halt at {at}");
        }
    }
}

/// After a stop that nobody asked for, in a pause or before the first step of a way back, and after a rest.
#[test]
fn dir_is_in_time_behind_a_rest() {
    let mut turns = 0;
    for (pause, at) in [900, 4000].into_iter().flat_map(|pause| (20..120).map(move |at| (pause, 997 * at))) {
        let axis = AxisSetup::new(Limits::new(8000, 8_000_000).unwrap(), 80_000).with_reversal_pause(pause);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (mut axes, timer) = Axes::new(&queue, path);
        let mut machine = Machine::<_, 2>::new(timer);
        for to in [[200, 100], [100, 200], [150, 0], [0, 100]] {
            axes.push(to, 100_000).unwrap();
        }
        machine.run(&mut axes, 5000, at);
        machine.drain();
        machine.run(&mut axes, 5000, at + 40_000);
        axes.hold();
        machine.run(&mut axes, 5000, u64::MAX);
        machine.now += 100_000;
        axes.resume();
        machine.run(&mut axes, 5000, u64::MAX);
        axes.push([50, 50], 100_000).unwrap();
        machine.run(&mut axes, 5000, u64::MAX);
        assert_eq!(machine.position, [50, 50]);
        let half = u64::from(pause / 2).min(2500);
        for (before, after) in &machine.turns {
            assert!(before + 2 >= half && after + 2 >= half, "{before} and {after} of {pause}, late at {at}");
        }
        turns += machine.turns.len();
    }
    assert!(turns > 800, "{turns}");
}

/// From rest a way back begins when DIR has had its time, half of the pause or a quarter of the reach, and no later, if 4 ms of
/// the pause are over: the first step is 354 us after that at 8,000,000 steps/s². An axis that goes on as it went waits for nothing.
#[test]
fn a_way_back_from_rest_begins_in_time() {
    for (pause, lead) in [(0, 0), (900, 450), (4000, 2000), (6000, 2500)] {
        let axis = AxisSetup::new(Limits::new(8000, 8_000_000).unwrap(), 80_000).with_reversal_pause(pause);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (mut axes, timer) = Axes::new(&queue, path);
        let mut machine = Machine::<_, 2>::new(timer);
        for (to, lead) in [([50, 50], 0), ([80, 80], 0), ([60, 90], lead)] {
            let made = machine.steps.len();
            axes.push(to, 100_000).unwrap();
            let begun = machine.now;
            machine.run(&mut axes, 5000, u64::MAX);
            assert_eq!(machine.position, to);
            let waits = machine.steps[made].0 - begun;
            assert!((lead + 350..lead + 360).contains(&waits), "{waits} before the way to {to:?}, {lead} of {pause}");
        }
    }
}

/// A quick stop that takes less than half a step from the end of what is handed out: no step follows that, neither those of the stop that
/// was handed out with it nor any other, also behind another quick stop that would have had some.
#[test]
fn a_quick_stop_without_a_step_of_its_own() {
    // Steps/s, quick steps/s², and those of a first quick stop.
    for (feed, quick, first) in [(16_000, 401_000_000, None), (1000, 1_200_000, None), (1000, 1_200_000, Some(250_000))]
    {
        for asked in (300_000..320_000).step_by(1111) {
            let queue = AxesQueue::<1, 257>::new();
            let axis = AxisSetup::new(Limits::new(20_000, 200_000).unwrap(), 1_000_000);
            let (mut axes, mut timer) = Axes::new(&queue, Path::<1, 4>::new(Clock::MICROSECONDS, [axis], 20).unwrap());
            axes.push([80_000], feed).unwrap();
            let (mut now, mut next, mut last, mut target) = (0_u64, None, 0, None);
            while target.is_none() || !axes.is_at_rest() {
                while let Some(tick) = next.filter(|tick| *tick <= now) {
                    let fired = timer.fire();
                    last = if fired.steps() > 0 { tick } else { last };
                    next = Some(tick + u64::from(fired.wait())).filter(|_| fired.wait() > 0);
                }
                if now >= asked && target.is_none() {
                    let limits = |quick| [Limits::new(20_000, quick).unwrap()];
                    if let Some(first) = first {
                        axes.quick_stop(limits(first));
                    }
                    axes.quick_stop(limits(quick));
                    target = Some(axes.target()[0]);
                }
                while axes.poll() == Work::More {}
                if axes.poll() == Work::Start {
                    next = Some(now + u64::from(timer.fire().wait()));
                }
                now += 101;
                assert!(now < 2_000_000, "{feed} at {asked}: {:?} {last} {target:?}", axes.commanded());
            }
            assert_eq!(Some(axes.commanded()[0]), target, "{feed} at {asked}");
            assert!(last <= asked + 20_000 && now < asked + 25_000, "{feed} at {asked}: {last}, at rest at {now}");
            // And on from there.
            axes.push([0], feed).unwrap();
            while !axes.is_at_rest() {
                while axes.poll() == Work::More {}
                timer.fire();
            }
            assert_eq!(axes.commanded(), [0]);
        }
    }
}

/// An override, a hold, a resume, a stop and a way to somewhere else, whenever they come: before the first step of a way back too, which
/// may be sooner then.
#[test]
fn dir_is_in_time_whatever_is_asked_for() {
    for (seed, pause) in (0..400).flat_map(|seed| [40, 300, 900, 20_000].map(|pause| (seed, pause))) {
        let mut dice = Dice(seed << 20 | u64::from(pause));
        let limits = Limits::new(8000, 80_000 << dice.below(8)).unwrap();
        let axis = AxisSetup::new(limits, 80_000).with_reversal_pause(pause);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (mut axes, timer) = Axes::new(&queue, path);
        let mut machine = Machine::<_, 2>::new(timer);
        for _ in 0..60 {
            let mut place = || i64::try_from(dice.below(80)).unwrap() - 40;
            let to = [place(), place()];
            match dice.below(9) {
                0 => axes.hold(),
                1 => axes.set_override(dice.below(200) as u16),
                2 => axes.stop(),
                3 => _ = axes.move_to(to, 100_000),
                4 | 5 => axes.resume(),
                _ => _ = axes.push(to, 1000 << dice.below(8)),
            }
            let until = machine.now + dice.below(40_000);
            machine.run(&mut axes, 2500, until);
            machine.until(until);
        }
        let half = u64::from(pause / 2).min(2500);
        for (before, after) in &machine.turns {
            assert!(before + 2 >= half && after + 2 >= half, "{before} and {after} of {pause}, seed {seed}");
        }
    }
}

/// Without a pause DIR is in the middle between two steps, or between a step and the end of a block, wherever that is: for an axis of up
/// to 400 steps/s it is 1.25 ms from either step, or two ticks less.
#[test]
fn dir_is_not_beside_a_step_without_a_pause() {
    for (feed, reach) in [(250, 10_000), (2000, 9999), (5000, 7777), (5000, 1234), (5000, 3001)] {
        let axis = AxisSetup::new(Limits::new(400, 80_000).unwrap(), 80_000);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (axes, timer) = Axes::new(&queue, path);
        let (mut axes, mut machine) = (axes.with_reach(reach), Machine::<_, 2>::new(timer));
        for i in 1..120_i64 {
            while axes.is_full() {
                let soon = machine.now + 1000;
                machine.run(&mut axes, u64::from(reach / 2), soon);
            }
            axes.push([i, i % 2 * 3], feed).unwrap();
        }
        machine.run(&mut axes, u64::from(reach / 2), u64::MAX);
        assert!(machine.turns.len() > 90, "{}", machine.turns.len());
        for (before, after) in machine.turns {
            assert!(before >= 1248 && after >= 1248, "{before} and {after} at {feed} um/s, {reach}");
        }
    }
}

/// A stop just behind a corner, before the first step of the way back; and then that way at once: the pause is not shorter.
#[test]
fn a_stop_before_a_way_back_does_not_shorten_the_pause() {
    let mut short = 0;
    for at in (10_000..60_000).step_by(211) {
        let axis = AxisSetup::new(Limits::new(8000, 8_000_000).unwrap(), 80_000).with_reversal_pause(20_000);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 2000).unwrap();
        let queue = AxesQueue::<2, SLOTS>::new();
        let (axes, timer) = Axes::new(&queue, path);
        let (mut axes, mut machine) = (axes.with_reach(1000), Machine::<_, 2>::new(timer));
        // A step of Y at 100 of X, and another one back at 300, 25 ms later.
        axes.push([200, 1], 100_000).unwrap();
        axes.push([400, 0], 100_000).unwrap();
        machine.run(&mut axes, 500, at);
        machine.until(at);
        axes.stop();
        machine.run(&mut axes, 500, u64::MAX);
        let [x, y] = machine.position;
        axes.push([x + 20, y - 20], 100_000).unwrap();
        machine.run(&mut axes, 500, u64::MAX);
        let ways: Vec<_> = machine.steps.iter().filter(|(_, axis, _)| *axis == 1).collect();
        let Some(turn) = ways.windows(2).find(|pair| pair[0].2 > pair[1].2) else { continue };
        let gap = turn[1].0 - turn[0].0;
        assert!(gap + 2 >= 20_000, "{gap} after a stop at {at}");
        short += u32::from(gap < 24_000 && y == 1);
    }
    assert!(short > 5, "{short}");
}
