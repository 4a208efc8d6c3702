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
}

#[test]
fn an_override_is_a_part_of_the_greatest_speed() {
    let mut bench = Bench::new();
    bench.axis.move_to(100_000).unwrap();
    bench.until(300_000);
    for (percent, steps) in [(25, 200), (0, 0), (100, 800), (250, 800)] {
        bench.axis.set_override(percent);
        bench.until(bench.machine.now + 300_000);
        let before = bench.at();
        bench.until(bench.machine.now + 100_000);
        assert!((bench.at() - before - steps).abs() <= 1, "{percent} %: {}", bench.at() - before);
    }
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
        if bench.machine.slice(&mut bench.axis) != Work::More {
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
