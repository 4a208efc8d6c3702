//! Each request to an axis in two halves does what it says, and no more.

use step_motion::{Axis, Clock, Direction, Error, Limits, Queue, StepTimer, Work};

use crate::machine::Machine;

const SLOTS: usize = 129;

struct Bench {
    axis: Axis<'static, SLOTS>,
    machine: Machine<StepTimer<'static, SLOTS>, 1>,
}

impl Bench {
    /// 8000 steps/s and 80,000 steps/s² at 1 MHz.
    fn new() -> Self {
        let queue: &'static Queue<SLOTS> = Box::leak(Box::default());
        let limits = Limits::new(8000, 80_000).unwrap();
        let (axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits).unwrap();
        Self { axis, machine: Machine::new(timer) }
    }

    fn until(&mut self, time: u64) {
        self.machine.run(&mut self.axis, 500, time);
        self.machine.until(time);
    }

    fn at(&self) -> i64 {
        self.machine.position[0]
    }

    /// At each override, in percent, so many steps in 100 ms.
    fn follows<const N: usize>(&mut self, overrides: [(u16, i64); N]) {
        for (percent, steps) in overrides {
            self.axis.set_override(percent);
            self.until(self.machine.now + 300_000);
            let before = self.at();
            self.until(self.machine.now + 100_000);
            assert!((self.at() - before - steps).abs() <= 1, "{percent} %: {}", self.at() - before);
        }
    }
}

#[test]
fn an_override_is_a_part_of_the_greatest_speed() {
    let mut bench = Bench::new();
    bench.axis.move_to(100_000).unwrap();
    bench.until(300_000);
    bench.follows([(25, 200), (0, 0), (100, 800), (250, 800)]);
}

#[test]
fn an_axis_is_at_rest_when_nothing_is_to_come() {
    let mut bench = Bench::new();
    assert!(bench.axis.is_at_rest());
    bench.axis.move_to(100).unwrap();
    assert!(!bench.axis.is_at_rest(), "it has been told, and nothing is made");
    // From slice to slice and event to event, until the last step has been made.
    while bench.at() < 100 {
        assert!(!bench.axis.is_at_rest(), "at {}", bench.at());
        let work = bench.machine.slice(&mut bench.axis);
        assert_ne!(work, Work::Start, "it runs");
        if work != Work::More {
            let next = bench.machine.compare.unwrap();
            bench.machine.until(next);
        }
    }
    bench.until(1_000_000);
    assert!(bench.axis.is_at_rest());
    bench.axis.hold();
    bench.axis.move_to(0).unwrap();
    bench.until(2_000_000);
    assert!(bench.axis.is_at_rest() && bench.at() == 100, "held");
    bench.axis.resume();
    bench.until(3_000_000);
    assert!(bench.axis.is_at_rest() && bench.at() == 0);
}

#[test]
fn limits_are_set_at_rest_and_hold_from_then_on() {
    let mut bench = Bench::new();
    let slow = Limits::new(500, 80_000).unwrap();
    bench.axis.run(Direction::Forward, 8000).unwrap();
    bench.until(300_000);
    assert_eq!(bench.axis.set_limits(slow), Err(Error::Moving));
    bench.axis.stop();
    bench.until(900_000);
    assert_eq!(bench.axis.set_limits(slow), Ok(()));
    bench.axis.run(Direction::Forward, 8000).unwrap();
    bench.until(1_200_000);
    let before = bench.at();
    bench.until(2_200_000);
    assert!((499..=501).contains(&(bench.at() - before)), "{}", bench.at() - before);
    let fast = Limits::new(500_001, 80_000).unwrap();
    bench.axis.stop();
    bench.until(2_900_000);
    assert!(matches!(bench.axis.set_limits(fast), Err(Error::SpeedAboveClock { .. })));
}

/// The interrupt has stopped for the first of two halts: the second one still waits for it.
#[test]
fn each_halt_is_confirmed_by_the_interrupt() {
    let mut bench = Bench::new();
    bench.axis.run(Direction::Forward, 8000).unwrap();
    bench.until(300_000);
    bench.axis.halt();
    bench.machine.fire();
    bench.axis.halt();
    assert_eq!(bench.axis.poll(), Work::Start);
    assert_eq!(bench.axis.move_to(0), Err(Error::Moving));
    bench.until(400_000);
    assert!(bench.axis.is_at_rest() && bench.axis.is_halted());
    // A number of bits, and once more.
    let at = bench.at();
    for _ in 0..70_000 {
        bench.axis.halt();
        assert_eq!(bench.machine.slice(&mut bench.axis), Work::More);
        assert_eq!(bench.machine.slice(&mut bench.axis), Work::More);
        assert!(bench.axis.is_at_rest());
    }
    bench.axis.move_to(at + 5).unwrap();
    bench.until(800_000);
    assert_eq!(bench.at(), at + 5);
}

/// What is ready is not made yet; what has been made is known before the background is called.
#[test]
fn an_axis_is_at_rest_when_the_interrupt_has_come_to_the_end() {
    let mut bench = Bench::new();
    for to in [30, 0, 7, 90] {
        bench.axis.move_to(to).unwrap();
        while bench.axis.poll() == Work::More {}
        assert!(!bench.axis.is_at_rest(), "before the first event of the way to {to}");
        bench.machine.fire();
        bench.machine.drain();
        assert!(bench.axis.is_at_rest() && bench.at() == to);
    }
    bench.axis.halt();
    assert!(!bench.axis.is_at_rest(), "the interrupt has not seen the halt");
}

/// While the timer runs nobody asks for its start.
#[test]
fn a_timer_that_runs_is_not_started() {
    let mut bench = Bench::new();
    bench.axis.move_to(2000).unwrap();
    bench.until(100);
    while let Some(next) = bench.machine.compare {
        assert_ne!(bench.machine.slice(&mut bench.axis), Work::Start);
        bench.machine.until(next);
    }
    assert_eq!(bench.at(), 2000);
}

#[test]
fn a_quick_stop_is_shorter_and_lasts_until_rest() {
    let ends = [None, Some(40_000), Some(800_000)].map(|quick| {
        let mut bench = Bench::new();
        bench.axis.run(Direction::Forward, 8000).unwrap();
        bench.until(300_000);
        let before = bench.at();
        match quick {
            None => bench.axis.stop(),
            Some(a) => {
                bench.axis.quick_stop(Limits::new(8000, a).unwrap());
                assert_eq!(bench.axis.move_to(0), Err(Error::Moving));
                assert_eq!(bench.axis.run(Direction::Reverse, 100), Err(Error::Moving));
            }
        }
        bench.until(600_000);
        assert!(bench.axis.is_at_rest() && !bench.axis.is_halted());
        let way = bench.at() - before;
        bench.axis.move_to(0).unwrap();
        bench.until(2_000_000);
        assert_eq!(bench.at(), 0);
        way
    });
    // 8000 steps/s: 400 steps at 80,000 steps/s², 40 at ten times of that, and at most 20 ms of reaction.
    assert!((400..=562).contains(&ends[0]) && ends[0] == ends[1], "{ends:?}");
    assert!((359..=361).contains(&(ends[0] - ends[2])), "{ends:?}");
}

#[test]
fn a_position_is_set_at_rest_and_targets_are_counted_from_it() {
    let mut bench = Bench::new();
    bench.axis.move_to(500).unwrap();
    bench.until(100_000);
    assert_eq!(bench.axis.set_commanded(0), Err(Error::Moving));
    assert_eq!(bench.axis.commanded(), bench.at());
    bench.until(1_000_000);
    assert_eq!((bench.at(), bench.axis.set_commanded(-20)), (500, Ok(())));
    assert_eq!(bench.axis.commanded(), -20);
    // The machine counts on from 500.
    bench.machine.position = [-20];
    bench.axis.move_to(10).unwrap();
    bench.until(2_000_000);
    assert_eq!((bench.at(), bench.axis.commanded()), (10, 10));
}

/// An interrupt that comes although nothing is to be made.
#[test]
fn a_rest_stays_one_whatever_fires() {
    let mut bench = Bench::new();
    for (to, fires) in [(20, 1), (0, 2), (30, 3)] {
        bench.axis.move_to(to).unwrap();
        bench.until(bench.machine.now + 300_000);
        for _ in 0..fires {
            bench.machine.fire();
            assert!(bench.axis.is_at_rest() && bench.at() == to);
        }
    }
}

/// A speed above the greatest one is taken as that, and the override is a part of it.
#[test]
fn an_override_is_a_part_of_a_speed_that_is_too_high() {
    let mut bench = Bench::new();
    bench.axis.run(Direction::Forward, 12_000).unwrap();
    bench.follows([(50, 400), (75, 600), (100, 800)]);
}

/// What was linked when a halt came is over: a call of the interrupt that nobody has asked for begins nothing.
#[test]
fn nothing_begins_behind_a_halt() {
    let mut bench = Bench::new();
    for halts in 0..3 {
        bench.axis.move_to(1000 * (halts + 1)).unwrap();
        bench.until(bench.machine.now + 100_000);
        bench.axis.halt();
        bench.machine.fire();
        assert_eq!(bench.axis.poll(), Work::More);
        let made = bench.machine.steps.len();
        for _ in 0..5 {
            bench.machine.fire();
            assert_eq!(bench.machine.compare, None);
        }
        assert!(bench.machine.steps.len() == made && bench.axis.is_at_rest());
    }
}
