//! DIR after a halt: its level stays what the interrupt last set until the next motion needs the other one, half of the pause away from
//! the steps on either side.

use step_motion::{Axes, AxesQueue, Axis, AxisSetup, Clock, Limits, Path, Queue, Work};

use crate::machine::{Background, Machine, Timer};

/// Numbers in any order.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % most
    }

    /// Not 0.
    fn place(&mut self) -> i64 {
        let way = 1 + i64::try_from(self.below(30)).unwrap();
        if self.below(2) == 0 { way } else { -way }
    }
}

/// A background that is told where to go from where it is, and to halt.
trait Told<const N: usize>: Background<N> {
    fn go(&mut self, by: [i64; N]);
    fn stop_at_once(&mut self);
}

impl<const S: usize> Told<1> for Axis<'_, S> {
    fn go(&mut self, [by]: [i64; 1]) {
        self.move_to(self.commanded() + by).unwrap();
    }

    fn stop_at_once(&mut self) {
        self.halt();
    }
}

impl<const S: usize> Told<2> for Axes<'_, 2, 4, S> {
    fn go(&mut self, by: [i64; 2]) {
        let [x, y] = self.commanded();
        self.push([x + by[0], y + by[1]], 100_000).unwrap();
    }

    fn stop_at_once(&mut self) {
        self.halt();
    }
}

/// Halts at random events and between them, and the interrupt comes at once or when it is due; from there somewhere else, and back.
fn halts<T: Timer, const N: usize>(
    mut machine: Machine<T, N>,
    told: &mut impl Told<N>,
    (pause, reach): (u64, u64),
    half: u64,
) {
    let mut dice = Dice(pause + reach);
    let mut turns = 0;
    for _ in 0..300 {
        let mut by = [0; N];
        by.fill_with(|| dice.place());
        told.go(by);
        let until = machine.now + dice.below(2 * pause + 8000);
        machine.run(told, reach / 2, until);
        for _ in 0..dice.below(4) {
            if let Some(next) = machine.compare {
                machine.run(told, reach / 2, next);
            }
        }
        told.stop_at_once();
        if dice.below(2) == 0 || machine.compare.is_none() {
            machine.fire();
        } else {
            machine.drain();
        }
        assert_eq!((told.slice(), machine.compare), (Work::More, None));
        for _ in 0..dice.below(3) {
            by.fill_with(|| dice.place());
            told.go(by);
            machine.run(told, reach / 2, u64::MAX);
        }
        turns += machine.edges.len();
        for before in machine.edges.drain(..) {
            assert!(before + 2 >= half, "DIR {before} ticks after a step, pause {pause}, reach {reach}");
        }
        for (_, after) in machine.turns.drain(..) {
            assert!(after + 2 >= half, "DIR {after} ticks before a step, pause {pause}, reach {reach}");
        }
    }
    assert!(turns > 150, "{turns} turns");
}

const PAUSES: [(u32, u32); 6] =
    [(40, 10_000), (900, 10_000), (20_000, 10_000), (900, 100), (3000, 1600), (90_000, 10_000)];

#[test]
fn dir_of_an_axis_has_half_of_the_pause_behind_a_halt() {
    for (pause, reach) in PAUSES {
        let queue = Queue::<129>::new();
        let (axis, timer) = Axis::new(&queue, Clock::MICROSECONDS, Limits::new(8000, 800_000).unwrap()).unwrap();
        let mut axis = axis.with_reach(reach).with_reversal_pause(pause);
        halts(Machine::new(timer), &mut axis, (pause.into(), reach.into()), u64::from(pause / 2));
    }
}

/// Or a quarter of the reach, if that is less.
#[test]
fn dir_of_the_axes_of_a_path_has_half_of_the_pause_behind_a_halt() {
    for (pause, reach) in PAUSES {
        let axis = AxisSetup::new(Limits::new(8000, 800_000).unwrap(), 80_000).with_reversal_pause(pause);
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        let queue = AxesQueue::<2, 257>::new();
        let (axes, timer) = Axes::new(&queue, path);
        let mut axes = axes.with_reach(reach);
        halts(Machine::new(timer), &mut axes, (pause.into(), reach.into()), u64::from((pause / 2).min(reach / 4)));
    }
}
