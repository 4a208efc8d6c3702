//! Each request to the axes of a path does what it says, and no more.

use step_motion::{Axes, AxesQueue, AxesTimer, AxisSetup, Clock, Error, Limits, Path, Work};

use crate::machine::Machine;

const HZ: u64 = 1_000_000;
const SLOTS: usize = 513;

pub(crate) struct Bench {
    pub(crate) axes: Axes<'static, 2, 4, SLOTS>,
    pub(crate) machine: Machine<AxesTimer<'static, 2, SLOTS>, 2>,
}

impl Bench {
    /// 100 mm/s, 1 m/s², 80 steps/mm.
    pub(crate) fn new() -> Self {
        let axis = AxisSetup::new(Limits::new(8000, 80_000).unwrap(), 80_000).with_soft_limits(-9000, 9000);
        let path = Path::new(Clock::new(HZ as u32).unwrap(), [axis; 2], 20).unwrap();
        let queue: &'static AxesQueue<2, SLOTS> = Box::leak(Box::default());
        let (axes, timer) = Axes::new(queue, path);
        Self { axes, machine: Machine::new(timer) }
    }

    /// Time goes on, with a background or without one.
    pub(crate) fn until(&mut self, time: u64, background: bool) {
        if !background {
            return self.machine.until(time);
        }
        self.machine.run(&mut self.axes, 500, time);
        self.machine.until(time);
    }

    /// In the middle of a line of 8000 steps, at full speed.
    pub(crate) fn running() -> Self {
        let mut bench = Self::new();
        bench.axes.push([8000, 0], 100_000).unwrap();
        bench.until(300_000, true);
        assert!((1900..2100).contains(&bench.axes.commanded()[0]), "{:?}", bench.axes.commanded());
        bench
    }

    pub(crate) fn x(&self) -> i64 {
        self.axes.commanded()[0]
    }
}

/// Twice the reach, and 400 steps of brake.
const STOP: core::ops::Range<i64> = 300..650;

#[test]
fn a_hold_stops_and_a_resume_goes_on() {
    let mut bench = Bench::running();
    let before = bench.x();
    bench.axes.hold();
    bench.until(600_000, true);
    let held = bench.x();
    assert!(STOP.contains(&(held - before)), "{before} {held}");
    assert!(bench.axes.is_at_rest() && bench.axes.target() == [8000, 0]);
    bench.until(900_000, true);
    assert_eq!(bench.x(), held);
    bench.axes.resume();
    bench.until(3_000_000, true);
    assert_eq!(bench.axes.commanded(), [8000, 0]);
}

/// A line of a step takes 7 ms, less than a block: what is left of it then holds nothing.
#[test]
fn a_hold_behind_the_last_step_adds_no_time() {
    let [plain, held] = [false, true].map(|hold| {
        let mut bench = Bench::new();
        bench.axes.push([1, 0], 100_000).unwrap();
        while bench.machine.slice(&mut bench.axes) == Work::More {}
        if hold {
            bench.axes.hold();
            while bench.machine.slice(&mut bench.axes) == Work::More {}
        }
        bench.machine.drain();
        while bench.machine.slice(&mut bench.axes) == Work::More {}
        assert!(bench.axes.commanded() == [1, 0] && bench.axes.is_at_rest());
        bench.machine.now
    });
    assert_eq!(held, plain);
}

/// Of a machine that has nothing to do.
#[test]
fn a_request_at_rest_leaves_it_at_rest() {
    let mut bench = Bench::new();
    for ask in [Axes::hold, |axes: &mut Axes<'static, 2, 4, SLOTS>| axes.set_override(50), Axes::resume, Axes::stop] {
        ask(&mut bench.axes);
        assert!(bench.axes.is_at_rest());
        assert_eq!(bench.axes.poll(), Work::Rest);
    }
    bench.axes.hold();
    bench.axes.push([10, 0], 100_000).unwrap();
    bench.until(100_000, true);
    bench.axes.set_override(50);
    assert!(bench.axes.is_at_rest() && bench.axes.commanded() == [0, 0]);
    bench.axes.resume();
    assert!(!bench.axes.is_at_rest());
}

/// In one slice after the other a stop is asked for again: it has the same steps as if it was not.
#[test]
fn a_stop_that_is_asked_for_again_is_the_same_one() {
    for quick in [false, true] {
        let [once, again] = [false, true].map(|again| {
            let mut bench = Bench::running();
            let stop = |axes: &mut Axes<'static, 2, 4, SLOTS>| {
                if quick {
                    axes.quick_stop([Limits::new(8000, 200_000).unwrap(); 2]);
                } else {
                    axes.stop();
                }
            };
            stop(&mut bench.axes);
            while !bench.axes.is_at_rest() {
                bench.machine.slice(&mut bench.axes);
                if again {
                    stop(&mut bench.axes);
                }
                bench.machine.until(bench.machine.now + 20);
            }
            bench.machine.steps
        });
        assert!(once.len() > 2000 && once == again, "{quick}");
    }
}

/// A request that has not been planned is done with what was to be planned.
#[test]
fn an_axis_is_at_rest_once_a_halt_is_confirmed() {
    for ask in [Axes::hold, Axes::resume, |axes: &mut Axes<'static, 2, 4, SLOTS>| axes.set_override(50)] {
        for behind in [false, true] {
            let mut bench = Bench::running();
            if !behind {
                ask(&mut bench.axes);
            }
            bench.axes.halt();
            if behind {
                ask(&mut bench.axes);
            }
            bench.machine.drain();
            assert_eq!(bench.axes.poll(), Work::More);
            assert!(bench.axes.is_at_rest(), "{behind}");
        }
    }
}

#[test]
fn a_stop_forgets_the_path_and_a_quick_one_is_shorter() {
    let ends = [None, Some(80_000_u32), Some(800_000)].map(|quick| {
        let mut bench = Bench::running();
        let before = bench.x();
        match quick {
            None => bench.axes.stop(),
            Some(a) => {
                bench.axes.quick_stop([Limits::new(8000, a).unwrap(); 2]);
                assert_eq!(bench.axes.push([0, 0], 100_000), Err(Error::Moving));
            }
        }
        bench.until(900_000, true);
        let end = bench.axes.commanded();
        assert!(bench.axes.is_at_rest() && bench.axes.target() == end, "{end:?}");
        bench.axes.resume();
        bench.axes.push([end[0], 100], 100_000).unwrap();
        bench.until(2_000_000, true);
        assert_eq!(bench.axes.commanded(), [end[0], 100]);
        end[0] - before
    });
    assert!(STOP.contains(&ends[0]) && ends[0] == ends[1], "{ends:?}");
    assert!((340..380).contains(&(ends[0] - ends[2])), "{ends:?}");
}

/// From rest, or after another stop, and after any slice of the work: where the stop says, and no farther.
#[test]
fn a_stop_forgets_lines_in_the_making() {
    for (slices, moving) in (0..60).flat_map(|slices| [(slices, false), (slices, true)]) {
        let mut bench = if moving { Bench::running() } else { Bench::new() };
        bench.axes.stop();
        bench.axes.push([0, 500], 100_000).unwrap();
        for _ in 0..slices {
            bench.machine.slice(&mut bench.axes);
        }
        bench.axes.stop();
        let target = bench.axes.target();
        bench.until(bench.machine.now + 3_000_000, true);
        assert_eq!((bench.axes.commanded(), bench.axes.target()), (target, target), "{slices} {moving}");
        assert!(bench.axes.is_at_rest());
    }
}

/// 8000 steps/s: 200 steps at 160,000 steps/s², 20 at ten times of that.
#[test]
fn a_quick_stop_that_is_asked_for_again_may_be_harder() {
    let ways = [None, Some(160_000_u32), Some(1_600_000)].map(|again| {
        let mut bench = Bench::running();
        let before = bench.x();
        bench.axes.quick_stop([Limits::new(8000, 160_000).unwrap(); 2]);
        if let Some(a) = again {
            bench.until(302_000, true);
            bench.axes.quick_stop([Limits::new(8000, a).unwrap(); 2]);
        }
        bench.until(900_000, true);
        assert!(bench.axes.is_at_rest());
        bench.x() - before
    });
    assert!(ways[0] == ways[1] && ways[0] - ways[2] > 80, "{ways:?}");
}

#[test]
fn an_override_is_a_part_of_the_feed() {
    let mut bench = Bench::running();
    bench.axes.set_override(25);
    bench.until(500_000, true);
    let before = bench.x();
    bench.until(600_000, true);
    assert!((199..=201).contains(&(bench.x() - before)), "{before} {}", bench.x());
    bench.axes.set_override(0);
    bench.until(900_000, true);
    let held = bench.x();
    bench.until(1_200_000, true);
    assert_eq!(bench.x(), held);
    bench.axes.set_override(100);
    bench.until(4_000_000, true);
    assert_eq!(bench.axes.commanded(), [8000, 0]);
}

#[test]
fn a_new_target_is_reached_from_the_stop() {
    let mut bench = Bench::running();
    assert_eq!(bench.axes.move_to([9001, 0], 100_000), Err(Error::SoftLimit { target: 9001 }));
    bench.axes.push([8000, 500], 100_000).unwrap();
    bench.axes.move_to([0, 100], 100_000).unwrap();
    bench.until(400_000, true);
    assert!((2000..2700).contains(&bench.x()), "{}", bench.x());
    bench.until(4_000_000, true);
    assert_eq!((bench.axes.commanded(), bench.axes.is_at_rest()), ([0, 100], true));
}

#[test]
fn a_queue_is_full_at_its_length_and_behind_a_stop_too() {
    let mut bench = Bench::new();
    for n in 1..=4 {
        assert!(!bench.axes.is_full());
        bench.axes.push([1000 * n, 0], 100_000).unwrap();
    }
    assert!(bench.axes.is_full());
    assert_eq!(bench.axes.push([0, 0], 100_000), Err(Error::QueueFull));
    bench.until(400_000, true);
    assert!(!bench.axes.is_full());
    bench.until(3_000_000, true);
    assert_eq!(bench.axes.commanded(), [4000, 0]);
}

#[test]
fn a_halt_is_confirmed_by_the_interrupt() {
    let mut bench = Bench::running();
    bench.axes.halt();
    let steps = bench.machine.steps.len();
    assert!(!bench.axes.is_at_rest());
    for refused in [bench.axes.push([0, 0], 1000), bench.axes.move_to([0, 0], 1000)] {
        assert_eq!(refused, Err(Error::Moving));
    }
    assert_eq!(bench.axes.poll(), Work::Start);
    bench.until(400_000, true);
    assert_eq!((bench.machine.steps.len(), bench.axes.poll()), (steps, Work::Rest));
    assert!(bench.axes.is_halted() && bench.axes.is_at_rest());
    bench.axes.push([0, 0], 100_000).unwrap();
    assert!(!bench.axes.is_halted());
    bench.until(3_000_000, true);
    assert_eq!(bench.axes.commanded(), [0, 0]);
    // The interrupt has stopped for one halt: the next one still waits for it.
    bench.axes.halt();
    bench.machine.fire();
    bench.axes.halt();
    assert_eq!(bench.axes.poll(), Work::Start);
    bench.until(3_050_000, true);
    // One more, at rest.
    bench.axes.halt();
    bench.until(3_100_000, true);
    bench.machine.fire();
    assert_eq!(bench.axes.poll(), Work::Rest);
    assert!(!bench.axes.is_halted());
}

/// All of the line is handed out, and half of it is made: the motor is moving.
#[test]
fn a_halt_behind_the_end_of_what_is_planned() {
    let mut bench = Bench::new();
    bench.axes = bench.axes.with_reach(100_000);
    bench.axes.push([40, 0], 100_000).unwrap();
    while bench.x() < 20 {
        while bench.axes.poll() == Work::More {}
        if let Some(next) = bench.machine.compare { bench.machine.until(next) } else { bench.machine.fire() }
    }
    assert!(bench.axes.poll() != Work::More);
    bench.axes.halt();
    bench.until(1_000_000, true);
    assert!(bench.axes.is_halted() && bench.x() == 20);
}

/// An axis that is to turn in a while, with a pause that is longer than all that is queued, does not make the others late: 80 steps in
/// each reach of 10 ms, and 400 steps of brake.
#[test]
fn a_long_pause_makes_no_request_late() {
    for at in (400_000..700_000).step_by(4100) {
        let axis = AxisSetup::new(Limits::new(8000, 80_000).unwrap(), 80_000);
        let axes = [axis, axis.with_reversal_pause(400_000)];
        let path = Path::<2, 4>::new(Clock::new(HZ as u32).unwrap(), axes, 20).unwrap();
        let queue: &'static AxesQueue<2, SLOTS> = Box::leak(Box::default());
        let (mut axes, timer) = Axes::new(queue, path);
        let mut machine = Machine::new(timer);
        axes.push([8000, -2], 100_000).unwrap();
        machine.run(&mut axes, 500, at);
        let before = axes.commanded()[0];
        axes.hold();
        machine.run(&mut axes, 500, at + 600_000);
        let steps = axes.commanded()[0] - before;
        assert!(axes.is_at_rest() && steps <= 400 + 160 + 8, "{at}: {steps}");
    }
}

/// Twice the reach, and 16 ticks for either block, which does not end where a step is: all three axes are at up to half of the clock, and
/// come to rest at once.
#[test]
fn a_hold_is_in_time_at_any_clock() {
    for (hz, seed) in [1000, 2000, 10_000, 25_000].into_iter().flat_map(|hz| (0..60).map(move |seed| (hz, seed))) {
        let axis = AxisSetup::new(Limits::new(hz / (2 + seed % 5), 1 << 30).unwrap(), 80_000);
        let path = Path::<3, 4>::new(Clock::new(hz).unwrap(), [axis; 3], 20).unwrap();
        let queue: &'static AxesQueue<3, SLOTS> = Box::leak(Box::default());
        let (mut axes, timer) = Axes::new(queue, path);
        let mut machine = Machine::<_, 3>::new(timer);
        axes.push([300_000, 172_110 + 999 * i64::from(seed), 99_999], u32::MAX).unwrap();
        let asked = u64::from(hz / 2 + seed);
        machine.run(&mut axes, 1, asked);
        axes.hold();
        machine.run(&mut axes, 1, u64::MAX);
        let waits = machine.steps.last().unwrap().0 - asked;
        assert!(waits <= u64::from(hz) / 50 + 32 && machine.steps.len() > 100, "{waits} ticks at {hz} Hz, {seed}");
    }
}

/// The second half of the slots begins after 2^15 of them.
#[test]
fn the_largest_queue() {
    static QUEUE: AxesQueue<1, 65_535> = AxesQueue::new();
    let axis = AxisSetup::new(Limits::new(8000, 80_000).unwrap(), 80_000);
    let path = Path::<1, 4>::new(Clock::new(HZ as u32).unwrap(), [axis], 20).unwrap();
    let (mut axes, timer) = Axes::new(&QUEUE, path);
    let mut machine = Machine::new(timer);
    axes.push([2000], 100_000).unwrap();
    machine.run(&mut axes, 500, u64::MAX);
    assert_eq!(machine.position, [2000]);
}

/// Without a background the machine comes to rest, and goes on from there.
#[test]
fn a_background_that_is_late_costs_a_stop_and_no_step() {
    for exact in [false, true] {
        let mut bench = Bench::running();
        if exact {
            bench.axes = bench.axes.with_exact_stops();
            bench.until(350_000, true);
        }
        let before = bench.x();
        bench.until(700_000, false);
        assert!(bench.machine.compare.is_none() && STOP.contains(&(bench.x() - before)), "{before} {}", bench.x());
        // From step to step the speed falls by no more than the acceleration and 1 us at either end of an interval make of it.
        let worst = bench.machine.steps.windows(3).map(|step| {
            let [first, second] = [step[1].0 - step[0].0, step[2].0 - step[1].0].map(|ticks| 1e6 / ticks as f64);
            let noise = (first.powi(2) + second.powi(2)) * 1.5e-6;
            (second - first).abs() / (80_000.0 * (step[2].0 - step[0].0) as f64 / 2e6 + noise)
        });
        let worst = worst.fold(0.0, f64::max);
        assert!(worst <= if exact { 1.0 } else { 1.3 }, "{exact}: {worst}");
        bench.until(3_000_000, true);
        assert_eq!(bench.axes.commanded(), [8000, 0]);
    }
}

/// At 100 MHz and 200,000 steps/s²: how far from that the speed changes from step to step of a stop that nobody asked for, if times
/// are right to 25 ns.
#[test]
fn a_stop_is_as_exact_as_all_steps_if_that_is_asked_for() {
    let hz = 100_000_000;
    let worst = |exact: bool| {
        let axis = AxisSetup::new(Limits::new(20_000, 200_000).unwrap(), 80_000);
        let path = Path::<1, 4>::new(Clock::new(hz).unwrap(), [axis], 20).unwrap();
        let queue: &'static AxesQueue<1, SLOTS> = Box::leak(Box::default());
        let (axes, timer) = Axes::new(queue, path);
        let (mut axes, mut machine) = (if exact { axes.with_exact_stops() } else { axes }, Machine::new(timer));
        axes.push([100_000], 250_000).unwrap();
        machine.run(&mut axes, 100_000, 15_000_000);
        machine.drain();
        let worst = machine.steps.windows(3).map(|step| {
            let [first, second] =
                [step[1].0 - step[0].0, step[2].0 - step[1].0].map(|ticks| f64::from(hz) / ticks as f64);
            let noise = (first.powi(2) + second.powi(2)) * 50e-9;
            (second - first).abs() / (200_000.0 * (step[2].0 - step[0].0) as f64 / 2.0 / f64::from(hz) + noise)
        });
        worst.fold(0.0, f64::max)
    };
    let (exact, coarse) = (worst(true), worst(false));
    assert!(exact < 1.005 && coarse > 1.03, "{exact}, {coarse}");
}

/// A stop that nobody asked for lasts until the machine is at rest, which is later than its last step: next motion may begin then.
#[test]
fn a_stop_lasts_until_rest() {
    let (mut waits, mut wants) = (0.0, 0.0);
    for at in (300_000..302_000).step_by(97) {
        let mut bench = Bench::running();
        bench.until(at, true);
        bench.machine.drain();
        let [.., before, last] = bench.machine.steps[..] else { panic!("no steps") };
        // 80,000 steps/s².
        let gap = (last.0 - before.0) as f64 / 1e6;
        wants += f64::max(0.0, 1.0 / gap / 80_000.0 - gap / 2.0);
        waits += (bench.machine.now - last.0) as f64 / 1e6;
    }
    assert!(waits > 0.8 * wants && wants > 0.01, "{waits} s after the last steps, {wants} s are needed");
}

/// A corner of 90 degrees on a machine that is in motion.
#[test]
fn the_deviation_counts_for_the_lines_that_follow() {
    let over = |deviation| {
        let mut bench = Bench::running();
        bench.axes.set_deviation(deviation);
        bench.axes.push([8000, 4000], 100_000).unwrap();
        bench.machine.run(&mut bench.axes, 500, u64::MAX);
        assert_eq!(bench.machine.position, [8000, 4000]);
        bench.machine.steps.last().unwrap().0
    };
    let [none, some, much] = [0, 100, 2000].map(over);
    assert!(none > some && some > much && none - much > 50_000, "{none} {some} {much}");
}

/// Also of what is being made when it is set, and after a rest that nobody has asked for: 5500 steps/s in place of 550 at the corner.
#[test]
fn the_deviation_counts_from_then_on() {
    for (polls, starves) in (0..30).map(|polls| (polls, false)).chain([(0, true), (7, true)]) {
        let mut bench = Bench::running();
        bench.machine.until(305_000);
        for _ in 0..polls {
            bench.axes.poll();
        }
        bench.axes.set_deviation(2000);
        bench.until(if starves { 800_000 } else { 310_000 }, !starves);
        bench.until(bench.machine.now + 100_000, true);
        assert!(bench.x() < 7000, "{}", bench.x());
        bench.axes.push([8000, 4000], 100_000).unwrap();
        bench.machine.run(&mut bench.axes, 500, u64::MAX);
        assert_eq!(bench.machine.position, [8000, 4000]);
        let x: Vec<u64> =
            bench.machine.steps.iter().filter(|(_, axis, _)| *axis == 0).map(|(tick, ..)| *tick).collect();
        let apart = x[x.len() - 1] - x[x.len() - 2];
        assert!(apart < 300, "{apart}: {polls} {starves}");
    }
}
