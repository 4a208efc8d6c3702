//! Where a request meets what has been handed out: nothing of it is lost, late or too near, whatever the interrupt has made of it.

use step_motion::{Axis, Clock, Direction, Limits, Queue, StepTimer, Work};

use crate::machine;

const MOST: u32 = 2_000_000_000;

struct Bench<const S: usize> {
    axis: Axis<'static, S>,
    machine: machine::Machine<StepTimer<'static, S>, 1>,
}

impl<const S: usize> Bench<S> {
    /// At 1 MHz, with a reach in us.
    fn new(speed: u32, acceleration: u32, reach: u32) -> Self {
        let queue: &'static Queue<S> = Box::leak(Box::default());
        let limits = Limits::new(speed, acceleration).unwrap();
        let (axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits).unwrap();
        Self { axis: axis.with_reach(reach), machine: machine::Machine::new(timer) }
    }

    fn until(&mut self, every: u64, time: u64) {
        assert_ne!(self.machine.run(&mut self.axis, every, time), Work::TooFewSlots);
        self.machine.until(time);
    }

    fn at(&self) -> i64 {
        self.machine.position[0]
    }
}

/// 20 steps/s, and no way to rest: the steps that had been handed out after the request are not made.
#[test]
fn a_hold_without_a_step_takes_back_those_behind_it() {
    let mut bench = Bench::<129>::new(20, MOST, 100_000);
    bench.axis.move_to(12).unwrap();
    bench.until(20_000, 60_000);
    bench.axis.hold();
    bench.until(20_000, 2_000_000);
    // Twice the reach.
    assert!(bench.at() <= 6 && bench.axis.is_at_rest(), "{}", bench.at());
    bench.axis.resume();
    bench.until(20_000, 4_000_000);
    assert_eq!(bench.at(), 12);
}

/// A background that has not been called for a while hears of a quick stop: at full speed it is within the reaction, without the 1000
/// steps of the other stop.
#[test]
fn a_quick_stop_without_a_step_is_in_time_before_the_other_stop() {
    let late = || {
        let mut bench = Bench::<129>::new(20_000, 200_000, 10_000);
        bench.axis.run(Direction::Forward, 20_000).unwrap();
        bench.until(5000, 200_000);
        bench
    };
    let mut alone = late();
    alone.machine.drain();
    let (mut in_time, stops) = (0, alone.at() - 1002);
    for at in (200_000..300_000).step_by(311) {
        let mut bench = late();
        bench.machine.until(at);
        let made = bench.at();
        bench.axis.quick_stop(Limits::new(20_000, MOST).unwrap());
        bench.until(2500, at + 400_000);
        assert!(bench.axis.is_at_rest());
        if made < stops {
            in_time += 1;
            assert!(bench.at() - made <= 402, "{at}: {} steps", bench.at() - made);
        }
    }
    assert!(in_time > 50, "{in_time}");
}

/// After a stop that nobody asked for, a request without steps leaves nothing to start: also if that stop took less than a tick.
#[test]
fn a_stop_after_a_stop_is_a_rest() {
    for (speed, acceleration) in [(20_000, 200_000), (1000, MOST)] {
        for at in (200_000..210_000).step_by(777) {
            for ask in [Axis::stop, Axis::hold] {
                let mut bench = Bench::<129>::new(speed, acceleration, 10_000);
                bench.axis.run(Direction::Forward, speed).unwrap();
                bench.until(5000, at);
                bench.machine.drain();
                ask(&mut bench.axis);
                assert!(bench.axis.is_at_rest(), "{at}");
                assert_eq!(bench.machine.slice(&mut bench.axis), Work::Rest);
            }
        }
    }
}

/// A background that comes 1.5 to 100 times too seldom, in blocks of 8 reaches, where the first step takes 5.6 ms, 220 ms or 144 ms: what has
/// been waited for from a rest on is not waited for again. Each step is as late as the background, and no more.
#[test]
fn a_seldom_background_gets_there() {
    let slow = Limits::new(20, 20).unwrap();
    let fast = Limits::new(14_471, 537_890).unwrap().with_jerk(17_431_354).unwrap();
    let jerky = Limits::new(100, 100).unwrap().with_jerk(500).unwrap();
    let all = [
        (fast, 210, 300),
        (fast, 210, 1000),
        (fast, 400, 500),
        (slow, 10_000, 11_000),
        (slow, 10_000, 30_000),
        (jerky, 10_000, 15_000),
    ];
    for (limits, reach, every) in all {
        let queue: &'static Queue<129> = Box::leak(Box::default());
        let (axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits).unwrap();
        let mut bench = Bench { axis: axis.with_reach(reach), machine: machine::Machine::new(timer) };
        for to in [20, 17] {
            bench.axis.move_to(to).unwrap();
            bench.until(every, bench.machine.now + 20_000_000);
            assert_eq!((bench.at(), bench.axis.is_at_rest()), (to, true), "{limits}, {reach} us, every {every} us");
        }
    }
}

/// The same axis is at rest there as soon as a stop or a hold is asked for, and a halt stops no motion. A way to the other side, and one to
/// where it is, are done.
#[test]
fn an_axis_that_stands_before_its_first_step_is_at_rest() {
    type Ask = fn(&mut Axis<'static, 129>);
    let asks: [(Ask, i64, bool); 7] = [
        (|axis| axis.stop(), 0, true),
        (|axis| axis.hold(), 0, true),
        (|axis| axis.set_override(0), 0, true),
        (|axis| axis.quick_stop(Limits::new(20, 40).unwrap()), 0, true),
        (|axis| axis.halt(), 0, false),
        (|axis| axis.move_to(-3).unwrap(), -3, false),
        (|axis| axis.move_to(0).unwrap(), 0, false),
    ];
    for ((ask, to, at_once), polls) in asks.into_iter().flat_map(|ask| (0..40).map(move |polls| (ask, polls))) {
        let mut bench = Bench::<129>::new(20, 20, 10_000);
        bench.axis.move_to(20).unwrap();
        bench.until(5000, 50_000);
        bench.machine.drain();
        for _ in 0..polls {
            let _: Work = bench.axis.poll();
        }
        ask(&mut bench.axis);
        // Until the next block has been linked.
        assert!(!at_once || polls > 30 || bench.axis.is_at_rest(), "{to} after {polls}");
        bench.until(5000, 10_000_000);
        assert_eq!((bench.at(), bench.axis.is_at_rest(), bench.axis.is_halted()), (to, true, false), "{polls}");
        bench.axis.resume();
        bench.axis.set_override(100);
        bench.axis.move_to(2).unwrap();
        bench.until(5000, 20_000_000);
        assert_eq!((bench.at(), bench.axis.is_at_rest()), (2, true), "{to} after {polls}");
    }
}

/// In the pause before a way back too, where such a stop has nothing to do: what is asked for then is done at once.
#[test]
fn a_stop_in_a_pause_is_a_rest() {
    for at in (2000..90_000).step_by(1777) {
        let mut bench = Bench::<129>::new(20_000, 200_000, 1000);
        bench.axis = bench.axis.with_reversal_pause(100_000);
        bench.axis.move_to(100).unwrap();
        bench.until(250, 500_000);
        bench.axis.move_to(0).unwrap();
        bench.until(250, 500_000 + at);
        bench.machine.drain();
        bench.axis.stop();
        assert!(bench.axis.is_at_rest() && bench.at() == 100, "{at}");
        assert_eq!(bench.machine.slice(&mut bench.axis), Work::Rest);
    }
}

/// At 1000 steps/s² rest comes up to 32 ms after the last step; what is asked for in between leaves nothing to make.
#[test]
fn a_request_behind_the_last_step_adds_no_time() {
    let asks: [fn(&mut Axis<'static, 129>); 5] = [
        |_| {},
        |axis| axis.hold(),
        |axis| axis.stop(),
        |axis| axis.set_override(50),
        |axis| axis.quick_stop(Limits::new(9, 9).unwrap()),
    ];
    for made in 1..9 {
        let ends = asks.map(|ask| {
            let mut bench = Bench::<129>::new(2000, 1000, 10_000);
            bench.axis.move_to(made).unwrap();
            while bench.at() < made {
                bench.until(500, bench.machine.now + 500);
            }
            ask(&mut bench.axis);
            while bench.machine.slice(&mut bench.axis) == Work::More {}
            bench.machine.drain();
            assert_eq!(bench.machine.slice(&mut bench.axis), Work::Rest);
            (bench.machine.now, bench.axis.is_at_rest())
        });
        assert_eq!(ends, [ends[0]; 5], "after step {made}");
        assert!(ends[0].1);
    }
}

/// 1000 steps/s, and no way to rest: a stop after what is handed out has nothing to do once the interrupt has made that.
#[test]
fn a_stop_of_less_than_a_tick_is_a_rest() {
    for at in (30_000..42_000).step_by(97) {
        let mut bench = Bench::<129>::new(1000, MOST, 1600);
        bench.axis.run(Direction::Forward, 1000).unwrap();
        bench.until(400, at);
        bench.axis.stop();
        bench.machine.drain();
        bench.until(400, at + 50_000);
        assert!(bench.axis.is_at_rest(), "{at}");
        let made = bench.at();
        bench.axis.set_limits(Limits::new(500, MOST).unwrap()).unwrap();
        bench.axis.move_to(made + 3).unwrap();
        bench.until(400, at + 100_000);
        assert!(bench.axis.is_at_rest() && bench.at() == made + 3, "{at}");
    }
}

/// 1000 steps/s, and no way to rest, with a reaction that is shorter than an interval: back after a step as soon as may be, and not
/// before.
#[test]
fn a_way_back_begins_behind_the_last_step() {
    for at in 20_000..22_000 {
        let mut bench = Bench::<129>::new(1000, MOST, 64);
        bench.axis.run(Direction::Forward, 1000).unwrap();
        bench.until(20, at);
        let made = bench.machine.steps.len();
        bench.axis.run(Direction::Reverse, 1000).unwrap();
        bench.until(20, at + 4000);
        let back = bench.machine.steps.iter().position(|step| step.2 < 0).unwrap();
        assert!(back <= made + 1);
        let (last, first) = (bench.machine.steps[back - 1].0, bench.machine.steps[back].0);
        let soon = (last + 1000).max(at + 2 * 64 + 500);
        assert!((last + 999..=soon + 2).contains(&first), "{at}: {first} after {last}");
    }
}

/// From rest, before the first step and before or after the change of DIR: DIR is right at each step, which the machine checks.
#[test]
fn a_request_before_the_first_step_of_a_way_back() {
    for at in (300_000..360_000).step_by(977) {
        for to in [-200, 300] {
            let mut bench = Bench::<129>::new(2000, 1000, 10_000);
            bench.axis.move_to(5).unwrap();
            bench.until(2000, 300_000);
            assert!(bench.axis.is_at_rest());
            bench.axis.move_to(-100).unwrap();
            bench.until(2000, at);
            bench.axis.move_to(to).unwrap();
            bench.until(2000, 3_000_000);
            assert_eq!(bench.at(), to, "{at}");
        }
    }
}

/// A change of DIR takes 1 s; the same direction takes none, whether the axis was held or has stopped by itself.
#[test]
fn a_pause_is_for_a_change_of_direction() {
    for late in [false, true] {
        let mut bench = Bench::<129>::new(20, MOST, 20_000);
        bench.axis = bench.axis.with_reversal_pause(1_000_000);
        bench.axis.run(Direction::Forward, 20).unwrap();
        bench.until(5000, 220_000);
        if late {
            bench.machine.drain();
        } else {
            bench.axis.hold();
            bench.until(5000, 400_000);
            assert!(bench.axis.is_at_rest());
            bench.axis.resume();
        }
        let (now, made) = (bench.machine.now, bench.at());
        bench.until(5000, now + 150_000);
        assert!(bench.at() >= made + 2, "{late}: {} steps", bench.at() - made);
        bench.axis.run(Direction::Reverse, 20).unwrap();
        let turned = bench.machine.now;
        bench.until(5000, turned + 1_500_000);
        let back = bench.machine.steps.iter().find(|step| step.2 < 0).unwrap().0;
        assert!((turned + 950_000..turned + 1_150_000).contains(&back), "{late}: {}", back - turned);
    }
}

/// A slice takes 100 us, or 150 us: a block is ready too late for the nearest joint, so one farther ahead is taken, without a stop. With
/// 150 us that takes more than there is after another request.
#[test]
fn a_slow_background_finds_a_joint_farther_ahead() {
    for (takes, asks) in [(100, &[50, 100, 50, 100][..]), (150, &[50])] {
        let mut bench = Bench::<257>::new(20_000, 2_000_000, 10_000);
        let go = |bench: &mut Bench<257>, time: u64| {
            while bench.machine.now < time {
                let work = bench.machine.slice(&mut bench.axis);
                assert!(matches!(work, Work::More | Work::Later), "{work:?}");
                bench.machine.until(bench.machine.now + takes);
            }
        };
        bench.axis.run(Direction::Forward, 20_000).unwrap();
        go(&mut bench, 200_000);
        for percent in asks {
            bench.axis.set_override(*percent);
            let now = bench.machine.now;
            go(&mut bench, now + 100_000);
            let (from, before) = (bench.machine.now, bench.at());
            go(&mut bench, from + 10_000);
            let (time, made) = (bench.machine.now - from, bench.at() - before);
            let want = time * u64::from(*percent) / 5000;
            assert!(made.unsigned_abs().abs_diff(want) <= 1, "{percent} %: {made} in {time}");
        }
        let worst = bench.machine.steps.windows(2).skip(200).map(|pair| pair[1].0 - pair[0].0).max();
        assert!(worst <= Some(102), "{takes}: {worst:?}");
    }
}

/// Blocks of 11 slots, which these moves fill to the last one.
#[test]
fn a_move_that_just_fits_is_made() {
    for (speed, acceleration) in [(2000, 20_000), (20_000, 1_000_000)] {
        for to in 1..100 {
            let mut bench = Bench::<23>::new(speed, acceleration, 10_000);
            bench.axis.move_to(to).unwrap();
            while bench.at() < to {
                let work = bench.machine.slice(&mut bench.axis);
                assert!(matches!(work, Work::More | Work::Later), "{work:?} at {} of {to}", bench.at());
                if work == Work::Later {
                    bench.machine.until(bench.machine.now + 2000);
                }
            }
        }
    }
}

/// Blocks of 4 slots: a wait, DIR, a step, and a wait to rest.
#[test]
fn a_step_back_fills_the_smallest_block() {
    for acceleration in (50_000..200_000).step_by(5000) {
        let mut bench = Bench::<9>::new(2000, acceleration, 10_000);
        for to in [1, 0, 1, 0] {
            bench.axis.move_to(to).unwrap();
            while bench.at() != to {
                assert_ne!(bench.machine.slice(&mut bench.axis), Work::TooFewSlots, "{acceleration}");
                bench.machine.until(bench.machine.now + 500);
            }
            bench.machine.drain();
        }
    }
}

/// Rest is later than the last step of a stop: what the speed there takes at 80,000 steps/s².
#[test]
fn a_stop_lasts_until_rest() {
    let (mut waits, mut wants) = (0.0, 0.0);
    for at in (300_000..302_000).step_by(97) {
        let mut bench = Bench::<129>::new(8000, 80_000, 10_000);
        bench.axis.run(Direction::Forward, 8000).unwrap();
        bench.until(500, at);
        bench.machine.drain();
        let [.., before, last] = bench.machine.steps[..] else { panic!("no steps") };
        let gap = (last.0 - before.0) as f64 / 1e6;
        wants += f64::max(0.0, 1.0 / gap / 80_000.0 - gap / 2.0);
        waits += (bench.machine.now - last.0) as f64 / 1e6;
    }
    assert!(waits > 0.8 * wants && wants > 0.01, "{waits} s after the last steps, {wants} s are needed");
}

/// A driver needs its time between a step and DIR and between DIR and the next step, wherever a wait or a block ends, whatever is asked
/// for in the pause, and after a stop of a late background: half of the pause each.
#[test]
fn dir_has_half_of_the_pause_on_either_side() {
    for (pause, reach) in [(40, 10_000), (900, 10_000), (20_000, 10_000), (900, 100), (3000, 1600)] {
        let mut bench = Bench::<129>::new(8000, 800_000, reach);
        bench.axis = bench.axis.with_reversal_pause(pause);
        let mut dice = u64::from(pause);
        let mut below = |most: u64| {
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (dice >> 33) % most
        };
        let (every, times) = (u64::from(reach / 2), u64::from(pause) + 10_000);
        for _ in 0..500 {
            bench.axis.move_to(i64::try_from(below(60)).unwrap() - 30).unwrap();
            bench.until(every, bench.machine.now + below(times));
            match below(5) {
                0 => bench.axis.hold(),
                1 => bench.axis.set_override(50),
                // So slow that another request makes the next step much earlier.
                3 => bench.axis.run(Direction::Reverse, 1 + u32::try_from(below(20)).unwrap()).unwrap(),
                2 => bench.machine.until(bench.machine.now + below(times)),
                _ => bench.axis.stop(),
            }
            bench.until(every, bench.machine.now + below(times));
            bench.axis.resume();
            bench.axis.set_override(100);
        }
        assert!(bench.machine.turns.len() > 150);
        for (before, after) in bench.machine.turns {
            let half = u64::from(pause / 2);
            assert!(before + 2 >= half && after + 2 >= half, "{before} and {after} of {pause} at {reach}");
        }
    }
}

/// A quick stop that is asked for when the interrupt has just gone over to the next block, before the background knows: 2 steps of brake.
#[test]
fn a_quick_stop_behind_a_linked_block_is_quick() {
    for at in (200_000..300_000).step_by(997) {
        let mut bench = Bench::<129>::new(20_000, 200_000, 10_000);
        bench.axis.run(Direction::Forward, 20_000).unwrap();
        bench.until(2500, at);
        bench.machine.until(at + 4000);
        let made = bench.at();
        bench.axis.quick_stop(Limits::new(20_000, 100_000_000).unwrap());
        bench.until(2500, at + 400_000);
        assert!(bench.axis.is_at_rest() && bench.at() - made <= 404, "{at}: {} steps", bench.at() - made);
    }
}

/// A background that is not called any more: at constant speed the axis stops after eight times the reach, what is linked after it
/// included, and two tenths of a second of brake.
#[test]
fn a_late_background_stops_the_axis_in_time() {
    for at in (300_000..500_000).step_by(2111) {
        let mut bench = Bench::<257>::new(20_000, 100_000, 10_000);
        bench.axis.run(Direction::Forward, 20_000).unwrap();
        bench.until(5000, at);
        let last = bench.machine.now;
        bench.machine.drain();
        let stopped = bench.machine.steps.last().unwrap().0 - last;
        assert!(stopped <= 290_000, "{stopped} us after {at}");
    }
}

/// From 100,000 steps/s an S-curve of 1.3 s has more segments than half of 129 slots, so the axis goes there at half of that speed, or a
/// quarter. It says so, and does not forget its target.
#[test]
fn limits_for_which_there_are_too_few_slots() {
    fn go<const N: usize>(limits: Limits, target: i64) -> (i64, u64, usize) {
        let queue = Queue::<N>::new();
        let (mut axis, mut timer) = Axis::new(&queue, Clock::new(168_000_000).unwrap(), limits).unwrap();
        axis.move_to(target).unwrap();
        let (mut time, mut refused) = (0, 0);
        loop {
            match axis.poll() {
                Work::Rest => return (axis.commanded(), time / 168_000, refused),
                Work::TooFewSlots => refused += 1,
                Work::More => {}
                _ => time += u64::from(timer.fire().wait()),
            }
        }
    }
    // 2.2 s at full speed, and 1.33 s for the ramps.
    let slow = Limits::new(100_000, 100_000).unwrap().with_jerk(300_000).unwrap();
    let (place, ms, refused) = go::<257>(slow, 220_000);
    assert!(place == 220_000 && ms.abs_diff(3533) < 3 && refused == 0, "{place} after {ms} ms, {refused}");
    for target in [220_000, -220_000] {
        let (place, ms, refused) = go::<129>(slow, target);
        assert!(place == target && (3533..9000).contains(&ms) && refused > 0, "{place} after {ms} ms, {refused}");
        let (place, _, refused) = go::<33>(slow, target);
        assert!(place == target && refused > 1, "{place}, {refused}");
    }
    // As the README says.
    let trapezoid = Limits::new(100_000, 200_000).unwrap();
    let s_curve = Limits::new(100_000, 1_500_000).unwrap().with_jerk(45_000_000).unwrap();
    for limits in [trapezoid, s_curve] {
        assert_eq!(go::<129>(limits, 220_000).2, 0);
    }
}
