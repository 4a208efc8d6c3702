//! A homing beside other requests to its axis, and the same in two halves.

use step_motion::{
    Axis, Clock, Direction, Error, Homing, HomingConfig, HomingState, Limits, Mover, Queue, StepTimer, Switch,
};

use crate::machine::Machine;

/// The switch closes at this place and beyond, seen from where the axis is switched on.
const SWITCH: i64 = 400;
const STATES: [HomingState; 5] = [
    HomingState::Seeking,
    HomingState::Stopping,
    HomingState::BackingOff,
    HomingState::Approaching,
    HomingState::Settling,
];

fn limits() -> Limits {
    Limits::new(10_000, 50_000).unwrap()
}

fn config(approach: u32) -> HomingConfig {
    HomingConfig::new(Direction::Forward, 2000, approach, 3000, Limits::new(10_000, 100_000).unwrap()).with_back_off(80)
}

/// What is homed: how, and where the switch is; `None` if it never closes.
#[derive(Debug, Clone, Copy)]
struct Case {
    config: HomingConfig,
    switch: Option<i64>,
}

impl Case {
    fn usual() -> Self {
        Self { config: config(300), switch: Some(SWITCH) }
    }

    fn switch(self, at: i64) -> Switch {
        if self.switch.is_some_and(|switch| at >= switch) { Switch::Closed } else { Switch::Open }
    }
}

#[derive(Debug, Clone, Copy)]
enum Ask {
    Hold,
    Resume,
    Override(u16),
    Stop,
    Quick,
    Halt,
    MoveTo(i64),
}

/// An axis and its homing.
trait Bench {
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

struct OneByOne {
    case: Case,
    mover: Mover,
    homing: Homing,
    now: u64,
    real: i64,
}

impl OneByOne {
    fn new(case: Case) -> Self {
        let mut mover = Mover::new(Clock::MICROSECONDS, limits()).unwrap();
        let homing = Homing::start(case.config, &mut mover, Switch::Open, 0).unwrap();
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

struct Halves<'q> {
    case: Case,
    axis: Axis<'q, SLOTS>,
    machine: Machine<StepTimer<'q, SLOTS>, 1>,
    homing: Homing,
    /// What a position is more than where the motor is.
    more: i64,
}

impl<'q> Halves<'q> {
    fn new(case: Case, queue: &'q Queue<SLOTS>) -> Self {
        let (axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits()).unwrap();
        let mut axis = axis.with_reach(2000);
        let homing = Homing::start_axis(case.config, &mut axis, Switch::Open).unwrap();
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

/// The same test of an axis one by one and in two halves.
fn both(test: impl Fn(&mut dyn Bench, &str)) {
    both_of(Case::usual(), test);
}

fn both_of(case: Case, test: impl Fn(&mut dyn Bench, &str)) {
    test(&mut OneByOne::new(case), "Mover");
    test(&mut Halves::new(case, &Queue::new()), "Axis");
}

fn is_found(bench: &mut dyn Bench, case: &str) {
    bench.until(HomingState::Done);
    let (real, called) = bench.at();
    // What is made between two polls: 300 steps/s.
    assert!((real - called - SWITCH).abs() <= 1, "{case}: {called} is at {real}");
    bench.ask(Ask::MoveTo(0)).unwrap();
    for _ in 0..3000 {
        bench.go().unwrap();
    }
    assert_eq!(bench.at().1, 0, "{case}");
}

#[test]
fn a_switch_is_found_by_an_axis_in_two_halves_too() {
    both(|bench, name| is_found(bench, name));
}

/// It runs on for up to 11 steps behind the switch, and in two halves for 4 ms more; all of them are counted.
#[test]
fn a_fast_approach_knows_where_the_switch_has_closed() {
    both_of(Case { config: config(1500), ..Case::usual() }, |bench, name| is_found(bench, name));
}

/// It has gone one step beyond the range when it stops: 40 steps at 2000 steps/s, and in two halves 4 ms and a poll more.
#[test]
fn a_switch_that_never_closes_is_given_up_at_the_end_of_the_range() {
    both_of(Case { switch: None, ..Case::usual() }, |bench, name| {
        bench.until(HomingState::Failed);
        for _ in 0..3000 {
            assert_eq!(bench.go(), Ok(HomingState::Failed), "{name}");
        }
        let (real, called) = bench.at();
        assert!(bench.is_at_rest() && real == called && (3040..=3050).contains(&real), "{name}: {called} is at {real}");
    });
}

/// It waits where it is, and goes on.
#[test]
fn a_hold_holds_a_homing() {
    for state in STATES {
        for (hold, resume) in [(Ask::Hold, Ask::Resume), (Ask::Override(0), Ask::Override(100))] {
            both(|bench, name| {
                let case = format!("{name}: {hold:?} when {state:?}");
                bench.until(state);
                bench.ask(hold).unwrap();
                for _ in 0..3000 {
                    let now = bench.go().unwrap();
                    assert!(now != HomingState::Failed && now != HomingState::Done, "{case}: {now:?}");
                }
                let at = bench.at();
                for _ in 0..3000 {
                    bench.go().unwrap();
                }
                assert_eq!((bench.at(), bench.is_at_rest()), (at, true), "{case}");
                bench.ask(resume).unwrap();
                is_found(bench, &case);
            });
        }
    }
}

/// Whoever stops the axis, or sends it elsewhere, has it: the homing makes no further motion.
#[test]
fn another_request_ends_a_homing() {
    for state in STATES {
        for ask in [Ask::Stop, Ask::Quick, Ask::Halt, Ask::MoveTo(-50)] {
            both(|bench, name| {
                let case = format!("{name}: {ask:?} when {state:?}");
                bench.until(state);
                if bench.ask(ask) == Err(Error::Moving) {
                    // In the quick stop at the switch, and so without an effect.
                    return is_found(bench, &case);
                }
                for _ in 0..8000 {
                    assert_eq!(bench.go(), Ok(HomingState::Failed), "{case}");
                }
                let (_, called) = bench.at();
                assert!(bench.is_at_rest(), "{case}");
                if let Ask::MoveTo(to) = ask {
                    assert_eq!(called, to, "{case}");
                }
                for _ in 0..3000 {
                    bench.go().unwrap();
                }
                assert_eq!(bench.at().1, called, "{case}");
            });
        }
    }
}
