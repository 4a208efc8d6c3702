//! What is homed: an axis by itself, and one of a path, each one by one and in two halves.

use step_motion::{
    Axes, AxesQueue, AxesTimer, Axis, AxisSetup, Clock, Error, Homing, HomingConfig, HomingState, Mover, Path,
    PathMover, Queue, StepTimer, Switch,
};

use super::{SWITCH, config, limits};
use crate::machine::Machine;

/// Positions, so they do not count before there is a reference: the switch is beyond them, and so is where it backs off to.
const SOFT: (i64, i64) = (-60, 200);

/// What is homed: how, and how far ahead the switch is; `None` if it never closes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Case {
    pub(super) config: HomingConfig,
    pub(super) switch: Option<i64>,
}

impl Case {
    pub(super) fn usual() -> Self {
        Self { config: config(300), switch: Some(SWITCH) }
    }

    /// Where the switch closes.
    pub(super) fn place(self) -> Option<i64> {
        self.switch.map(|switch| if self.config.direction.dir() { -switch } else { switch })
    }

    pub(super) fn switch(self, at: i64) -> Switch {
        let ahead = if self.config.direction.dir() { -at } else { at };
        if self.switch.is_some_and(|switch| ahead >= switch) { Switch::Closed } else { Switch::Open }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Ask {
    Hold,
    Resume,
    Override(u16),
    Stop,
    Quick,
    Halt,
    MoveTo(i64),
}

/// An axis and its homing.
pub(super) trait Bench {
    fn ask(&mut self, ask: Ask) -> Result<(), Error>;
    /// 100 us go by, and the homing is asked.
    fn go(&mut self) -> Result<HomingState, Error>;
    /// Where the motor is, seen from where it was switched on; and what it is called.
    fn at(&self) -> (i64, i64);
    fn is_at_rest(&self) -> bool;

    /// Until a state is reached, or for ten seconds.
    fn until(&mut self, state: HomingState) {
        for _ in 0..100_000 {
            if self.go() == Ok(state) {
                return;
            }
        }
        panic!("never {state:?}");
    }
}

pub(super) struct OneByOne {
    case: Case,
    mover: Mover,
    homing: Homing,
    now: u64,
    real: i64,
}

impl OneByOne {
    pub(super) fn new(case: Case) -> Self {
        let mut mover = Mover::new(Clock::MICROSECONDS, limits()).unwrap().with_soft_limits(SOFT.0, SOFT.1);
        let homing = Homing::start(case.config, &mut mover, case.switch(0), 0).unwrap();
        Self { case, mover, homing, now: 0, real: 0 }
    }
}

impl Bench for OneByOne {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let (mover, now) = (&mut self.mover, self.now);
        match ask {
            Ask::Hold => mover.hold(now),
            Ask::Resume => mover.resume(now),
            Ask::Override(percent) => mover.set_override(percent, now),
            Ask::Stop => mover.stop(now),
            Ask::Quick => mover.quick_stop(limits(), now),
            Ask::Halt => mover.halt(now),
            Ask::MoveTo(to) => mover.move_to(to, now)?,
        }
        Ok(())
    }

    fn go(&mut self) -> Result<HomingState, Error> {
        self.now += 100;
        while self.mover.due().is_some_and(|due| due <= self.now) {
            self.real += if self.mover.pulse().unwrap().direction.dir() { -1 } else { 1 };
        }
        self.homing.poll(&mut self.mover, self.case.switch(self.real), self.now)
    }

    fn at(&self) -> (i64, i64) {
        (self.real, self.mover.commanded())
    }

    fn is_at_rest(&self) -> bool {
        self.mover.is_at_rest(self.now)
    }
}

const SLOTS: usize = 129;

pub(super) struct Halves<'q> {
    case: Case,
    axis: Axis<'q, SLOTS>,
    machine: Machine<StepTimer<'q, SLOTS>, 1>,
    homing: Homing,
    /// What a position is more than where the motor is.
    more: i64,
}

impl<'q> Halves<'q> {
    pub(super) fn new(case: Case, queue: &'q Queue<SLOTS>) -> Self {
        let (axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits()).unwrap();
        let mut axis = axis.with_reach(2000).with_soft_limits(SOFT.0, SOFT.1);
        let homing = Homing::start_axis(case.config, &mut axis, case.switch(0)).unwrap();
        Self { case, axis, machine: Machine::new(timer), homing, more: 0 }
    }
}

impl Bench for Halves<'_> {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let axis = &mut self.axis;
        match ask {
            Ask::Hold => axis.hold(),
            Ask::Resume => axis.resume(),
            Ask::Override(percent) => axis.set_override(percent),
            Ask::Stop => axis.stop(),
            Ask::Quick => axis.quick_stop(limits()),
            Ask::Halt => axis.halt(),
            Ask::MoveTo(to) => axis.move_to(to)?,
        }
        Ok(())
    }

    fn go(&mut self) -> Result<HomingState, Error> {
        let until = self.machine.now + 100;
        self.machine.run(&mut self.axis, 100, until);
        self.machine.until(until);
        let before = self.axis.commanded();
        let state = self.homing.poll_axis(&mut self.axis, self.case.switch(before - self.more));
        let more = self.axis.commanded() - before;
        (self.machine.position[0], self.more) = (self.machine.position[0] + more, self.more + more);
        state
    }

    fn at(&self) -> (i64, i64) {
        (self.axis.commanded() - self.more, self.axis.commanded())
    }

    fn is_at_rest(&self) -> bool {
        self.axis.is_at_rest()
    }
}

/// The other axis of the path stands here.
const OTHER: i64 = 7;

/// 80 steps/mm.
fn path() -> Path<2, 4> {
    let axis = AxisSetup::new(limits(), 80_000);
    let axes = [axis, axis.with_soft_limits(SOFT.0, SOFT.1)];
    Path::new(Clock::MICROSECONDS, axes, 20).unwrap()
}

pub(super) struct OfPath {
    case: Case,
    mover: PathMover<2, 4>,
    homing: Homing,
    now: u64,
    real: i64,
}

impl OfPath {
    pub(super) fn new(case: Case) -> Self {
        let mut mover = PathMover::new(path());
        mover.set_commanded([OTHER, 0], 0).unwrap();
        let homing = Homing::start_path(case.config, &mut mover, 1, case.switch(0), 0).unwrap();
        Self { case, mover, homing, now: 0, real: 0 }
    }
}

impl Bench for OfPath {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let (mover, now) = (&mut self.mover, self.now);
        match ask {
            Ask::Hold => mover.hold(now),
            Ask::Resume => mover.resume(now),
            Ask::Override(percent) => mover.set_override(percent, now),
            Ask::Stop => mover.stop(now),
            Ask::Quick => mover.quick_stop([limits(); 2], now),
            Ask::Halt => mover.halt(now),
            Ask::MoveTo(to) => mover.move_to([OTHER, to], 1_000_000, now)?,
        }
        Ok(())
    }

    fn go(&mut self) -> Result<HomingState, Error> {
        self.now += 100;
        while self.mover.due().is_some_and(|due| due <= self.now) {
            let pulse = self.mover.pulse().unwrap();
            assert_eq!(pulse.axis, 1);
            self.real += if pulse.direction.dir() { -1 } else { 1 };
        }
        self.homing.poll_path(&mut self.mover, self.case.switch(self.real), self.now)
    }

    fn at(&self) -> (i64, i64) {
        assert_eq!(self.mover.commanded()[0], OTHER);
        (self.real, self.mover.commanded()[1])
    }

    fn is_at_rest(&self) -> bool {
        self.mover.is_at_rest(self.now)
    }
}

pub(super) struct OfAxes<'q> {
    case: Case,
    axes: Axes<'q, 2, 4, SLOTS>,
    machine: Machine<AxesTimer<'q, 2, SLOTS>, 2>,
    homing: Homing,
    /// What a position is more than where the motor is.
    more: i64,
    /// The background is late by more than a block now and then.
    stalls: bool,
}

impl<'q> OfAxes<'q> {
    pub(super) fn new(case: Case, queue: &'q AxesQueue<2, SLOTS>, stalls: bool) -> Self {
        let (axes, timer) = Axes::new(queue, path());
        let mut axes = axes.with_reach(2000);
        axes.set_commanded([OTHER, 0]).unwrap();
        let homing = Homing::start_axes(case.config, &mut axes, 1, case.switch(0)).unwrap();
        let mut machine = Machine::new(timer);
        machine.position[0] = OTHER;
        Self { case, axes, machine, homing, more: 0, stalls }
    }
}

impl Bench for OfAxes<'_> {
    fn ask(&mut self, ask: Ask) -> Result<(), Error> {
        let axes = &mut self.axes;
        match ask {
            Ask::Hold => axes.hold(),
            Ask::Resume => axes.resume(),
            Ask::Override(percent) => axes.set_override(percent),
            Ask::Stop => axes.stop(),
            Ask::Quick => axes.quick_stop([limits(); 2]),
            Ask::Halt => axes.halt(),
            Ask::MoveTo(to) => axes.move_to([OTHER, to], 1_000_000)?,
        }
        Ok(())
    }

    fn go(&mut self) -> Result<HomingState, Error> {
        let until = self.machine.now + 100;
        let late = self.stalls && until % 40_000 < 15_000;
        if !late {
            self.machine.run(&mut self.axes, 100, until);
        }
        self.machine.until(until);
        let before = self.axes.commanded()[1];
        let state = self.homing.poll_axes(&mut self.axes, self.case.switch(before - self.more));
        let more = self.axes.commanded()[1] - before;
        (self.machine.position[1], self.more) = (self.machine.position[1] + more, self.more + more);
        state
    }

    fn at(&self) -> (i64, i64) {
        let [other, own] = self.axes.commanded();
        assert_eq!(other, OTHER);
        (own - self.more, own)
    }

    fn is_at_rest(&self) -> bool {
        self.axes.is_at_rest()
    }
}
