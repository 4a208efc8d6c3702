//! Every sequence of two and three requests, told at once or while the one before acts: what is asked for last and still counts is what
//! comes about.

use proptest::prelude::*;
use step_motion::Error;

use super::machines::{Ask, Driven, HIGH, LOW, MoverMachine, PathMachine, with_axes, with_axis};

const ASKS: [Ask; 12] = [
    Ask::To(60),
    Ask::To(-20),
    Ask::Along(LOW),
    Ask::Override(0),
    Ask::Override(50),
    Ask::Hold,
    Ask::Resume,
    Ask::Stop,
    Ask::Quick,
    Ask::Halt,
    Ask::Set(0),
    Ask::Standstill,
];

/// What has been asked for, from the table of the README.
#[derive(Debug, Default)]
struct Asked {
    /// Where it is to be in the end, if it may go there.
    aim: Option<i64>,
    held: bool,
    stands: bool,
    quick: bool,
    halted: bool,
    /// Time has gone on since the first request.
    moved: bool,
    /// It was halted in the tick in which it was to begin, which may be said to be a motion or not.
    open: bool,
    /// The background has not been called for a while: whether it is at rest is found by the next call.
    late: bool,
    /// The interrupt has not confirmed a halt, so it is not known to be at rest.
    unconfirmed: bool,
}

impl Asked {
    /// Tells the machine, and checks whether it takes the request.
    fn ask(&mut self, machine: &mut dyn Driven, ask: Ask) {
        if machine.has_lines() && ask == Ask::Standstill {
            return;
        }
        let rest = machine.is_at_rest();
        (self.quick, self.unconfirmed) = (self.quick && !rest, self.unconfirmed && !rest);
        let (done, mut refused) = (machine.ask(ask), false);
        let there = self.held || self.stands || self.aim.is_none_or(|aim| aim == machine.at());
        // Of these the machine looks for itself.
        let looks = matches!(ask, Ask::To(_) | Ask::Along(_) | Ask::Standstill | Ask::Set(_)) && machine.has_halves();
        let rest = rest || looks && self.late && there && done.is_ok();
        self.quick &= !rest;
        match ask {
            Ask::To(_) | Ask::Along(_) | Ask::Standstill if self.quick || self.unconfirmed => refused = true,
            Ask::To(to) | Ask::Along(to) => (self.aim, self.halted, self.open) = (Some(to), false, false),
            Ask::Override(percent) => self.stands = percent == 0,
            Ask::Hold => self.held = true,
            Ask::Resume => self.held = false,
            Ask::Stop | Ask::Standstill => self.aim = None,
            Ask::Set(_) if rest => self.aim = None,
            Ask::Set(_) => refused = true,
            Ask::Quick => (self.aim, self.quick) = (None, !rest),
            Ask::Halt => {
                self.halted |= !rest && !self.unconfirmed;
                self.open |= !self.moved && !rest;
                (self.aim, self.held, self.quick, self.unconfirmed) = (None, false, false, machine.has_halves());
            }
        }
        assert_eq!(done, if refused { Err(Error::Moving) } else { Ok(()) }, "{ask:?}: {self:?}");
    }

    fn wait(&mut self, machine: &mut dyn Driven, ticks: u64) {
        if ticks > 0 {
            machine.wait(ticks);
            (self.moved, self.late) = (true, false);
        }
    }

    fn then(&mut self, machine: &mut dyn Driven, then: Then) {
        match then {
            Then::Wait(ticks) => return self.wait(machine, ticks),
            Then::Starve(ticks) => machine.starve(ticks),
            Then::Slices(slices) => (0..slices).for_each(|_| machine.work(20)),
        }
        (self.moved, self.late) = (true, true);
    }

    /// After a long time it is where it was told to go, or it has come to rest, and does not move before it is told to.
    fn settle(&mut self, machine: &mut dyn Driven) {
        self.wait(machine, 500_000);
        let at = machine.at();
        assert!(machine.is_at_rest(), "{self:?}");
        // In two halves it may be known that the last step had been made.
        let open = self.open || machine.has_halves() && !machine.is_halted();
        assert!(open || machine.is_halted() == self.halted, "{self:?}");
        if let Some(aim) = self.aim.filter(|_| !self.held && !self.stands) {
            assert_eq!(at, aim, "{self:?}");
        }
        machine.wait(500_000);
        assert_eq!(machine.at(), at, "{self:?}");
        self.ask(machine, Ask::Resume);
        self.ask(machine, Ask::Override(100));
        machine.wait(500_000);
        assert_eq!(machine.at(), self.aim.unwrap_or(at), "resumed: {self:?}");
        for to in [HIGH, 0] {
            self.ask(machine, Ask::To(to));
            machine.wait(500_000);
            assert_eq!(machine.at(), to, "started again: {self:?}");
        }
    }
}

/// From a motion at full speed, or from rest.
fn sequence(machine: &mut dyn Driven, moving: bool, asks: &[Ask], gap: u64) {
    let mut asked = Asked::default();
    if moving {
        asked.ask(machine, Ask::To(HIGH));
        asked.wait(machine, 25_000);
    }
    for ask in asks {
        asked.ask(machine, *ask);
        asked.wait(machine, gap);
    }
    asked.settle(machine);
}

fn of_an_axis_and_a_path(moving: bool, asks: &[Ask], gap: u64) {
    sequence(&mut MoverMachine::new(), moving, asks, gap);
    sequence(&mut PathMachine::new(), moving, asks, gap);
}

fn in_two_halves(moving: bool, asks: &[Ask], gap: u64) {
    with_axis(|machine| sequence(machine, moving, asks, gap));
    with_axes(|machine| sequence(machine, moving, asks, gap));
}

/// All at once, and each at another moment of the brake that the one before asks for.
#[test]
fn every_three_requests() {
    for (first, second, third) in triples() {
        let asks = [first, second, third];
        for gap in [0, 1700, 4000, 9800] {
            of_an_axis_and_a_path(true, &asks, gap);
        }
        in_two_halves(true, &asks, 0);
    }
}

/// Also from rest, and so far apart that the second one finds the machine at rest.
#[test]
fn every_two_requests() {
    for (first, second) in pairs() {
        for gap in [0, 1100, 3900, 30_000] {
            for moving in [false, true] {
                of_an_axis_and_a_path(moving, &[first, second], gap);
                in_two_halves(moving, &[first, second], gap);
            }
        }
    }
}

/// How many sequences, and how many in the nightly run.
fn cases() -> u32 {
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(150)
}

/// What is between two requests.
#[derive(Debug, Clone, Copy)]
enum Then {
    Wait(u64),
    /// Nobody calls the background.
    Starve(u64),
    /// It does so many slices, one in 20 us.
    Slices(u8),
}

fn asks() -> impl Strategy<Value = Vec<(Ask, Then)>> {
    let then = prop_oneof![
        1 => Just(Then::Wait(0)),
        3 => (1..13_000_u64).prop_map(Then::Wait),
        1 => (1..80_000_u64).prop_map(Then::Wait),
        1 => (1..40_000_u64).prop_map(Then::Starve),
        2 => (1..60_u8).prop_map(Then::Slices),
    ];
    prop::collection::vec((prop::sample::select(&ASKS), then), 1..12)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    /// At any moment, and now and then without a background for a while.
    #[test]
    fn many_requests(asks in asks()) {
        let test = |machine: &mut dyn Driven| {
            let mut asked = Asked::default();
            for (ask, then) in &asks {
                asked.ask(machine, *ask);
                asked.then(machine, *then);
            }
            asked.settle(machine);
        };
        test(&mut MoverMachine::new());
        test(&mut PathMachine::new());
        with_axis(test);
        with_axes(test);
    }
}

fn pairs() -> impl Iterator<Item = (Ask, Ask)> {
    ASKS.into_iter().flat_map(|first| ASKS.into_iter().map(move |second| (first, second)))
}

fn triples() -> impl Iterator<Item = (Ask, Ask, Ask)> {
    pairs().flat_map(|(first, second)| ASKS.into_iter().map(move |third| (first, second, third)))
}
