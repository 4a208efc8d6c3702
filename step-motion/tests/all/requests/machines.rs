//! An axis and a path of one axis, one by one and in two halves, that are told the same.

use step_motion::{
    Axes, AxesQueue, Axis, AxisSetup, Clock, Direction, Error, Limits, Mover, Path, PathMover, Queue, Work,
};

use crate::machine::{Background, Machine, Timer};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ask {
    /// To a place, whatever was asked for before.
    To(i64),
    /// To a place: an axis runs in its direction up to the soft limit, a path goes on after its last line.
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

/// An axis, or a path of one axis, in two halves.
struct Halves<D, T> {
    background: D,
    machine: Machine<T, 1>,
}

pub(super) fn with_axis(test: impl FnOnce(&mut dyn Driven)) {
    let queue = Queue::new();
    let (axis, timer) = Axis::<SLOTS>::new(&queue, Clock::MICROSECONDS, limits()).unwrap();
    let background = axis.with_soft_limits(LOW, HIGH).with_reach(REACH);
    test(&mut Halves { background, machine: Machine::new(timer) });
}

pub(super) fn with_axes(test: impl FnOnce(&mut dyn Driven)) {
    let queue = AxesQueue::new();
    let (axes, timer) = Axes::<1, 8, SLOTS>::new(&queue, path());
    test(&mut Halves { background: axes.with_reach(REACH), machine: Machine::new(timer) });
}

/// What the two backgrounds call differently.
trait Asked: Background<1> {
    const HAS_LINES: bool;
    fn ask(&mut self, ask: Ask) -> Result<(), Error>;
    fn is_at_rest(&self) -> bool;
    fn is_halted(&self) -> bool;
}

impl Asked for Axis<'_, SLOTS> {
    const HAS_LINES: bool = false;

    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        match ask {
            Ask::To(to) => self.move_to(to)?,
            Ask::Along(to) => self.run(way(to), SPEED)?,
            Ask::Standstill => self.run(Direction::Forward, 0)?,
            Ask::Override(percent) => self.set_override(percent),
            Ask::Hold => self.hold(),
            Ask::Resume => self.resume(),
            Ask::Stop => self.stop(),
            Ask::Quick => self.quick_stop(hard()),
            Ask::Halt => self.halt(),
            Ask::Set(by) => self.set_commanded(self.commanded() + by)?,
        }
        Ok(())
    }

    fn is_at_rest(&self) -> bool {
        self.is_at_rest()
    }

    fn is_halted(&self) -> bool {
        self.is_halted()
    }
}

impl Asked for Axes<'_, 1, 8, SLOTS> {
    const HAS_LINES: bool = true;

    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        match ask {
            Ask::To(to) => self.move_to([to], FEED)?,
            Ask::Along(to) => self.push([to], FEED)?,
            Ask::Override(percent) => self.set_override(percent),
            Ask::Hold => self.hold(),
            Ask::Resume => self.resume(),
            Ask::Stop => self.stop(),
            Ask::Quick => self.quick_stop([hard()]),
            Ask::Halt => self.halt(),
            Ask::Set(by) => self.set_commanded(self.commanded().map(|at| at + by))?,
            Ask::Standstill => {}
        }
        Ok(())
    }

    fn is_at_rest(&self) -> bool {
        self.is_at_rest()
    }

    fn is_halted(&self) -> bool {
        self.is_halted()
    }
}

impl<D: Asked, T: Timer> Driven for Halves<D, T> {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        self.background.ask(ask)?;
        if let Ask::Set(by) = ask {
            self.machine.position[0] += by;
        }
        Ok(())
    }

    fn wait(&mut self, ticks: u64) {
        wait(&mut self.machine, &mut self.background, ticks);
    }

    fn starve(&mut self, ticks: u64) {
        self.machine.until(self.machine.now + ticks);
    }

    fn work(&mut self, ticks: u64) {
        work(&mut self.machine, &mut self.background, ticks);
    }

    fn at(&self) -> i64 {
        self.background.made()[0]
    }

    fn is_at_rest(&self) -> bool {
        self.background.is_at_rest()
    }

    fn is_halted(&self) -> bool {
        self.background.is_halted()
    }

    fn has_halves(&self) -> bool {
        true
    }

    fn has_lines(&self) -> bool {
        D::HAS_LINES
    }
}
