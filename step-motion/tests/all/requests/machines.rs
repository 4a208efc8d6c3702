//! An axis and a path of one axis, one by one and in two halves, that are told the same.

use step_motion::{
    Axes, AxesQueue, AxesTimer, Axis, AxisSetup, Clock, Direction, Error, Limits, Mover, Path, PathMover, Queue,
    StepTimer, Work,
};

use crate::machine::{Background, Machine, Timer};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ask {
    /// To a place, whatever was asked for before.
    To(i64),
    /// To a place: an axis runs in its direction up to the soft limit, a path goes on behind its last line.
    Along(i64),
    Override(u16),
    Hold,
    Resume,
    Stop,
    Quick,
    Halt,
    /// The present position is called that many steps more.
    Set(i64),
    /// A run at no speed, which is a stop; of an axis only.
    Standstill,
}

/// 2000 steps/s, and 200,000 steps/s²: 10 ms and 10 steps to full speed. In a quick stop 2 ms and 2 steps.
const SPEED: u32 = 2000;
pub(super) const LOW: i64 = -30;
pub(super) const HIGH: i64 = 100;
/// In um/s: more than the axis takes.
const FEED: u32 = 1_000_000;

fn limits() -> Limits {
    Limits::new(SPEED, 200_000).unwrap()
}

fn hard() -> Limits {
    Limits::new(SPEED, 1_000_000).unwrap()
}

fn way(to: i64) -> Direction {
    if to > 0 { Direction::Forward } else { Direction::Reverse }
}

fn path() -> Path<1, 8> {
    let axis = AxisSetup::new(limits(), 1_000_000).with_soft_limits(LOW, HIGH);
    Path::new(Clock::MICROSECONDS, [axis], 20).unwrap()
}

pub(super) trait Driven {
    fn ask(&mut self, ask: Ask) -> Result<(), Error>;
    /// Time goes on, with a background that is in time.
    fn wait(&mut self, ticks: u64);
    /// Time goes on, and the background does one slice.
    fn work(&mut self, ticks: u64) {
        self.wait(ticks);
    }
    /// Time goes on without a background.
    fn starve(&mut self, ticks: u64) {
        self.wait(ticks);
    }
    fn at(&self) -> i64;
    fn is_at_rest(&self) -> bool;
    fn is_halted(&self) -> bool;
    /// A halt has to be confirmed by an interrupt.
    fn has_halves(&self) -> bool {
        false
    }
    /// It is a path.
    fn has_lines(&self) -> bool {
        false
    }
}

pub(super) struct MoverMachine {
    mover: Mover,
    now: u64,
}

impl MoverMachine {
    pub(super) fn new() -> Self {
        let mover = Mover::new(Clock::MICROSECONDS, limits()).unwrap().with_soft_limits(LOW, HIGH);
        Self { mover, now: 0 }
    }
}

impl Driven for MoverMachine {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let (mover, now) = (&mut self.mover, self.now);
        match ask {
            Ask::To(to) => mover.move_to(to, now)?,
            Ask::Along(to) => mover.run(way(to), SPEED, now)?,
            Ask::Standstill => mover.run(Direction::Forward, 0, now)?,
            Ask::Override(percent) => mover.set_override(percent, now),
            Ask::Hold => mover.hold(now),
            Ask::Resume => mover.resume(now),
            Ask::Stop => mover.stop(now),
            Ask::Quick => mover.quick_stop(hard(), now),
            Ask::Halt => mover.halt(now),
            Ask::Set(by) => mover.set_commanded(mover.commanded() + by, now)?,
        }
        Ok(())
    }

    fn wait(&mut self, ticks: u64) {
        self.now += ticks;
        while self.mover.due().is_some_and(|due| due <= self.now) {
            self.mover.pulse();
        }
    }

    fn at(&self) -> i64 {
        self.mover.commanded()
    }

    fn is_at_rest(&self) -> bool {
        self.mover.is_at_rest(self.now)
    }

    fn is_halted(&self) -> bool {
        self.mover.is_halted()
    }
}

pub(super) struct PathMachine {
    mover: PathMover<1, 8>,
    now: u64,
}

impl PathMachine {
    pub(super) fn new() -> Self {
        Self { mover: PathMover::new(path()), now: 0 }
    }
}

impl Driven for PathMachine {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let (mover, now) = (&mut self.mover, self.now);
        match ask {
            Ask::To(to) => mover.move_to([to], FEED, now)?,
            Ask::Along(to) => mover.push([to], FEED, now)?,
            Ask::Override(percent) => mover.set_override(percent, now),
            Ask::Hold => mover.hold(now),
            Ask::Resume => mover.resume(now),
            Ask::Stop => mover.stop(now),
            Ask::Quick => mover.quick_stop([hard()], now),
            Ask::Halt => mover.halt(now),
            Ask::Set(by) => mover.set_commanded(mover.commanded().map(|at| at + by), now)?,
            Ask::Standstill => {}
        }
        Ok(())
    }

    fn wait(&mut self, ticks: u64) {
        self.now += ticks;
        while self.mover.due().is_some_and(|due| due <= self.now) {
            self.mover.pulse();
        }
    }

    fn at(&self) -> i64 {
        self.mover.commanded()[0]
    }

    fn is_at_rest(&self) -> bool {
        self.mover.is_at_rest(self.now)
    }

    fn is_halted(&self) -> bool {
        self.mover.is_halted()
    }

    fn has_lines(&self) -> bool {
        true
    }
}

/// Time goes on; the background is called twice a millisecond.
fn wait<T: Timer>(machine: &mut Machine<T, 1>, background: &mut impl Background<1>, ticks: u64) {
    let until = machine.now + ticks;
    machine.run(background, 500, until);
    machine.until(until);
    machine.run(background, 500, until);
}

fn work<T: Timer>(machine: &mut Machine<T, 1>, background: &mut impl Background<1>, ticks: u64) {
    let until = machine.now + ticks;
    if machine.slice(background) != Work::Rest {
        machine.until(until);
    }
}

/// Ticks: twice that until a request takes effect, which is 4 steps at full speed.
const REACH: u32 = 1000;
const SLOTS: usize = 129;

pub(super) struct AxisMachine<'q> {
    axis: Axis<'q, SLOTS>,
    machine: Machine<StepTimer<'q, SLOTS>, 1>,
}

impl AxisMachine<'_> {
    pub(super) fn with(test: impl FnOnce(&mut dyn Driven)) {
        let queue = Queue::new();
        let (axis, timer) = Axis::new(&queue, Clock::MICROSECONDS, limits()).unwrap();
        let axis = axis.with_soft_limits(LOW, HIGH).with_reach(REACH);
        test(&mut AxisMachine { axis, machine: Machine::new(timer) });
    }
}

impl Driven for AxisMachine<'_> {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let axis = &mut self.axis;
        match ask {
            Ask::To(to) => axis.move_to(to)?,
            Ask::Along(to) => axis.run(way(to), SPEED)?,
            Ask::Standstill => axis.run(Direction::Forward, 0)?,
            Ask::Override(percent) => axis.set_override(percent),
            Ask::Hold => axis.hold(),
            Ask::Resume => axis.resume(),
            Ask::Stop => axis.stop(),
            Ask::Quick => axis.quick_stop(hard()),
            Ask::Halt => axis.halt(),
            Ask::Set(by) => {
                axis.set_commanded(axis.commanded() + by)?;
                self.machine.position[0] += by;
            }
        }
        Ok(())
    }

    fn wait(&mut self, ticks: u64) {
        wait(&mut self.machine, &mut self.axis, ticks);
    }

    fn starve(&mut self, ticks: u64) {
        self.machine.until(self.machine.now + ticks);
    }

    fn work(&mut self, ticks: u64) {
        work(&mut self.machine, &mut self.axis, ticks);
    }

    fn at(&self) -> i64 {
        self.axis.commanded()
    }

    fn is_at_rest(&self) -> bool {
        self.axis.is_at_rest()
    }

    fn is_halted(&self) -> bool {
        self.axis.is_halted()
    }

    fn has_halves(&self) -> bool {
        true
    }
}

pub(super) struct AxesMachine<'q> {
    axes: Axes<'q, 1, 8, SLOTS>,
    machine: Machine<AxesTimer<'q, 1, SLOTS>, 1>,
}

impl AxesMachine<'_> {
    pub(super) fn with(test: impl FnOnce(&mut dyn Driven)) {
        let queue = AxesQueue::new();
        let (axes, timer) = Axes::new(&queue, path());
        test(&mut AxesMachine { axes: axes.with_reach(REACH), machine: Machine::new(timer) });
    }
}

impl Driven for AxesMachine<'_> {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let axes = &mut self.axes;
        match ask {
            Ask::To(to) => axes.move_to([to], FEED)?,
            Ask::Along(to) => axes.push([to], FEED)?,
            Ask::Override(percent) => axes.set_override(percent),
            Ask::Hold => axes.hold(),
            Ask::Resume => axes.resume(),
            Ask::Stop => axes.stop(),
            Ask::Quick => axes.quick_stop([hard()]),
            Ask::Halt => axes.halt(),
            Ask::Set(by) => {
                axes.set_commanded(axes.commanded().map(|at| at + by))?;
                self.machine.position[0] += by;
            }
            Ask::Standstill => {}
        }
        Ok(())
    }

    fn wait(&mut self, ticks: u64) {
        wait(&mut self.machine, &mut self.axes, ticks);
    }

    fn starve(&mut self, ticks: u64) {
        self.machine.until(self.machine.now + ticks);
    }

    fn work(&mut self, ticks: u64) {
        work(&mut self.machine, &mut self.axes, ticks);
    }

    fn at(&self) -> i64 {
        self.axes.commanded()[0]
    }

    fn is_at_rest(&self) -> bool {
        self.axes.is_at_rest()
    }

    fn is_halted(&self) -> bool {
        self.axes.is_halted()
    }

    fn has_halves(&self) -> bool {
        true
    }

    fn has_lines(&self) -> bool {
        true
    }
}
