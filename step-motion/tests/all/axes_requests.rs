//! Each request to the axes of a path does what it says, and no more.

use step_motion::{Axes, AxesQueue, AxesTimer, AxisSetup, Clock, Error, Limits, Path, Work};

const HZ: u64 = 1_000_000;
const SLOTS: usize = 513;

struct Machine {
    axes: Axes<'static, 2, 4, SLOTS>,
    timer: AxesTimer<'static, 2, SLOTS>,
    now: u64,
    /// When the compare register is reached.
    compare: Option<u64>,
    steps: Vec<(u64, u16)>,
}

impl Machine {
    /// 100 mm/s, 1 m/s², 80 steps/mm.
    fn new() -> Self {
        let axis = AxisSetup::new(Limits::new(8000, 80_000).unwrap(), 80_000).with_soft_limits(-9000, 9000);
        let path = Path::new(Clock::new(HZ as u32).unwrap(), [axis; 2], 20).unwrap();
        let queue: &'static AxesQueue<2, SLOTS> = Box::leak(Box::default());
        let (axes, timer) = Axes::new(queue, path);
        Self { axes, timer, now: 0, compare: None, steps: Vec::new() }
    }

    fn fire(&mut self) {
        let fired = self.timer.fire();
        if fired.steps() != 0 {
            self.steps.push((self.now, fired.steps()));
        }
        self.compare = Some(self.now + u64::from(fired.wait())).filter(|_| fired.wait() > 0);
    }

    /// All that the background has to do now.
    fn poll(&mut self) {
        loop {
            match self.axes.poll() {
                Work::More => {}
                Work::Start if self.compare.is_none() => self.fire(),
                Work::TooFewSlots => panic!("too few slots"),
                _ => break,
            }
        }
    }

    /// Time goes on, with a background or without one.
    fn until(&mut self, time: u64, background: bool) {
        loop {
            if background {
                self.poll();
            }
            let Some(compare) = self.compare.filter(|compare| *compare <= time) else { break };
            self.now = compare;
            self.fire();
        }
        self.now = self.now.max(time);
    }

    /// In the middle of a line of 8000 steps, at full speed.
    fn running() -> Self {
        let mut machine = Self::new();
        machine.axes.push([8000, 0], 100_000).unwrap();
        machine.until(300_000, true);
        assert!((1900..2100).contains(&machine.axes.commanded()[0]), "{:?}", machine.axes.commanded());
        machine
    }

    fn x(&self) -> i64 {
        self.axes.commanded()[0]
    }
}

/// Twice the reach, and 400 steps of brake.
const STOP: core::ops::Range<i64> = 300..650;

#[test]
fn a_hold_stops_and_a_resume_goes_on() {
    let mut machine = Machine::running();
    let before = machine.x();
    machine.axes.hold();
    machine.until(600_000, true);
    let held = machine.x();
    assert!(STOP.contains(&(held - before)), "{before} {held}");
    assert!(machine.axes.is_at_rest() && machine.axes.target() == [8000, 0]);
    machine.until(900_000, true);
    assert_eq!(machine.x(), held);
    machine.axes.resume();
    machine.until(3_000_000, true);
    assert_eq!(machine.axes.commanded(), [8000, 0]);
}

#[test]
fn a_stop_forgets_the_path_and_a_quick_one_is_shorter() {
    let ends = [None, Some(80_000_u32), Some(800_000)].map(|quick| {
        let mut machine = Machine::running();
        let before = machine.x();
        match quick {
            None => machine.axes.stop(),
            Some(a) => {
                machine.axes.quick_stop([Limits::new(8000, a).unwrap(); 2]);
                assert_eq!(machine.axes.push([0, 0], 100_000), Err(Error::Moving));
            }
        }
        machine.until(900_000, true);
        let end = machine.axes.commanded();
        assert!(machine.axes.is_at_rest() && machine.axes.target() == end, "{end:?}");
        machine.axes.resume();
        machine.axes.push([end[0], 100], 100_000).unwrap();
        machine.until(2_000_000, true);
        assert_eq!(machine.axes.commanded(), [end[0], 100]);
        end[0] - before
    });
    assert!(STOP.contains(&ends[0]) && ends[0] == ends[1], "{ends:?}");
    assert!((340..380).contains(&(ends[0] - ends[2])), "{ends:?}");
}

#[test]
fn an_override_is_a_part_of_the_feed() {
    let mut machine = Machine::running();
    machine.axes.set_override(25);
    machine.until(500_000, true);
    let before = machine.x();
    machine.until(600_000, true);
    assert!((199..=201).contains(&(machine.x() - before)), "{before} {}", machine.x());
    machine.axes.set_override(0);
    machine.until(900_000, true);
    let held = machine.x();
    machine.until(1_200_000, true);
    assert_eq!(machine.x(), held);
    machine.axes.set_override(100);
    machine.until(4_000_000, true);
    assert_eq!(machine.axes.commanded(), [8000, 0]);
}

#[test]
fn a_new_target_is_reached_from_the_stop() {
    let mut machine = Machine::running();
    assert_eq!(machine.axes.move_to([9001, 0], 100_000), Err(Error::SoftLimit { target: 9001 }));
    machine.axes.push([8000, 500], 100_000).unwrap();
    machine.axes.move_to([0, 100], 100_000).unwrap();
    machine.until(400_000, true);
    assert!((2000..2700).contains(&machine.x()), "{}", machine.x());
    machine.until(4_000_000, true);
    assert_eq!((machine.axes.commanded(), machine.axes.is_at_rest()), ([0, 100], true));
}

#[test]
fn a_queue_is_full_at_its_length_and_behind_a_stop_too() {
    let mut machine = Machine::new();
    for n in 1..=4 {
        assert!(!machine.axes.is_full());
        machine.axes.push([1000 * n, 0], 100_000).unwrap();
    }
    assert!(machine.axes.is_full());
    assert_eq!(machine.axes.push([0, 0], 100_000), Err(Error::QueueFull));
    machine.until(400_000, true);
    assert!(!machine.axes.is_full());
    machine.until(3_000_000, true);
    assert_eq!(machine.axes.commanded(), [4000, 0]);
}

#[test]
fn a_halt_is_confirmed_by_the_interrupt() {
    let mut machine = Machine::running();
    machine.axes.halt();
    let steps = machine.steps.len();
    assert!(!machine.axes.is_at_rest());
    for refused in [machine.axes.push([0, 0], 1000), machine.axes.move_to([0, 0], 1000)] {
        assert_eq!(refused, Err(Error::Moving));
    }
    assert_eq!(machine.axes.poll(), Work::Start);
    machine.until(400_000, true);
    assert_eq!((machine.steps.len(), machine.axes.poll()), (steps, Work::Rest));
    assert!(machine.axes.is_halted() && machine.axes.is_at_rest());
    machine.axes.push([0, 0], 100_000).unwrap();
    assert!(!machine.axes.is_halted());
    machine.until(3_000_000, true);
    assert_eq!(machine.axes.commanded(), [0, 0]);
    // A second one, at rest.
    machine.axes.halt();
    machine.until(3_100_000, true);
    machine.fire();
    assert_eq!(machine.axes.poll(), Work::Rest);
    assert!(!machine.axes.is_halted());
}

/// Without a background the machine comes to rest, and goes on from there.
#[test]
fn a_background_that_is_late_costs_a_stop_and_no_step() {
    for exact in [false, true] {
        let mut machine = Machine::running();
        if exact {
            machine.axes = machine.axes.with_exact_stops();
            machine.until(350_000, true);
        }
        let before = machine.x();
        machine.until(700_000, false);
        assert!(machine.compare.is_none() && STOP.contains(&(machine.x() - before)), "{before} {}", machine.x());
        // From step to step the speed falls by no more than the acceleration and 1 us at either end of an interval make of it.
        let worst = machine.steps.windows(3).map(|step| {
            let [first, second] = [step[1].0 - step[0].0, step[2].0 - step[1].0].map(|ticks| 1e6 / ticks as f64);
            let noise = (first.powi(2) + second.powi(2)) * 1.5e-6;
            (second - first).abs() / (80_000.0 * (step[2].0 - step[0].0) as f64 / 2e6 + noise)
        });
        let worst = worst.fold(0.0, f64::max);
        assert!(worst <= if exact { 1.0 } else { 1.3 }, "{exact}: {worst}");
        machine.until(3_000_000, true);
        assert_eq!(machine.axes.commanded(), [8000, 0]);
    }
}
