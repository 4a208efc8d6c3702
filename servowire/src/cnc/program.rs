//! The program of the axes: a source of words, one for each axis in each cycle.
//!
//! A new kind of program is a variant of [`Program`] with its arm in [`Program::next`] and [`Program::is_over`]; nothing
//! else in the machine depends on the kind of program.

use std::collections::VecDeque;

use servowire_decode::fault::Fault;
use sorte_proto::{Direction, Pto};
use step_motion::AxisPulse;
use step_profile::{Axis, Command, Dance, Group, Motors, MoveState, Note, Parameters, Profile, Tone};

use crate::gcode::{AXES, Steps};

/// The tune of `--dance`, composed for this project: up and down the tones of Table 3.
const SONG: [Note; 16] = [
    Note::p250(Tone::Cis, 2500),
    Note::p250(Tone::E, 2500),
    Note::p250(Tone::Gis, 2500),
    Note::p250(Tone::Cis2, 2500),
    Note::p125(Tone::H, 2500),
    Note::p125(Tone::A, 2500),
    Note::p250(Tone::Gis, 12_500),
    Note::p250(Tone::Fis, 2500),
    Note::p250(Tone::A, 2500),
    Note::p250(Tone::D2, 2500),
    Note::p250(Tone::Fis2, 2500),
    Note::p125(Tone::D2, 2500),
    Note::p125(Tone::Cis2, 2500),
    Note::p250(Tone::H, 2500),
    Note::p125(Tone::Gis, 2500),
    Note::p250(Tone::Cis, 2500),
];

/// A program, which gives the words of one cycle after another.
pub(super) enum Program {
    /// All axes together: moves of equal length, back and forth.
    Turns { group: Group<'static>, profiles: Vec<Profile<'static>>, steps: u32, done: u64, moves: u64 },
    /// Each axis makes its own move at its own speed.
    Independent { axes: Vec<(Axis<'static>, Profile<'static>, u32)>, done: u64, moves: u64 },
    /// The tune.
    Dance(Box<Dance<'static>>),
    /// A part program: X, Y and Z are the first three axes.
    Part(Box<Follower>),
}

impl Program {
    /// `moves`: number of moves; they use the speeds of `profiles` in turn.
    pub(super) fn turns(motors: Motors, profiles: Vec<Profile<'static>>, steps: u32, moves: u64) -> Self {
        Self::Turns { group: Group::new(motors), profiles, steps, done: 0, moves }
    }

    /// Axis k of n makes `steps * (n - k) / n` steps, with the speeds in turn.
    pub(super) fn independent(axes: usize, profiles: &[Profile<'static>], steps: u32, moves: u64) -> Self {
        let length = |k: usize| (u64::from(steps) * (axes - k) as u64 / axes as u64).max(1) as u32;
        let axes =
            (0..axes).zip(profiles.iter().cycle()).map(|(k, profile)| (Axis::new(), *profile, length(k))).collect();
        Self::Independent { axes, done: 0, moves }
    }

    pub(super) fn part(steps: Steps) -> Self {
        Self::Part(Box::new(Follower::new(steps)))
    }

    pub(super) fn dance(motors: Motors, parameters: Parameters<'static>) -> Result<Self, step_profile::Error> {
        let direction = step_profile::Direction::Forward;
        Dance::new(motors, parameters, direction, &SONG).map(|dance| Self::Dance(Box::new(dance)))
    }

    /// Returns the words of the next cycle. Programs of four motors repeat them for the axes after the fourth.
    pub(super) fn next(&mut self, words: &mut [Pto]) {
        let commands = match self {
            Self::Dance(dance) => dance.tick(),
            Self::Part(part) => return part.next(words),
            Self::Turns { group, profiles, steps, done, moves } => {
                if group.state() == MoveState::Idle && done < moves {
                    let direction = direction_of(*done);
                    let profile = profiles.get((*done % profiles.len().max(1) as u64) as usize);
                    // The group is idle and has motors, so the move begins.
                    if let Some(profile) = profile {
                        let _: Result<_, _> = group.start(*profile, *steps, direction);
                    }
                    *done += 1;
                }
                group.tick()
            }
            Self::Independent { axes, done, moves } => {
                if axes.iter().all(|(axis, ..)| axis.state() == MoveState::Idle) && done < moves {
                    let direction = direction_of(*done);
                    for (axis, profile, steps) in axes.iter_mut() {
                        // The axis is idle, so the move begins.
                        let _: Result<_, _> = axis.start(*profile, *steps, direction);
                    }
                    *done += 1;
                }
                for (to, (axis, ..)) in words.iter_mut().zip(axes) {
                    *to = word(axis.tick());
                }
                return;
            }
        };
        for (to, command) in words.iter_mut().zip(commands.into_iter().cycle()) {
            *to = word(command);
        }
    }

    /// Why it ended early.
    pub(super) fn fault(&self) -> Option<&Fault> {
        if let Self::Part(part) = self { part.steps.fault() } else { None }
    }

    pub(super) fn is_over(&self) -> bool {
        match self {
            Self::Dance(dance) => dance.is_over(),
            Self::Part(part) => part.is_over(),
            Self::Turns { group, done, moves, .. } => done >= moves && group.state() == MoveState::Idle,
            Self::Independent { axes, done, moves } => {
                done >= moves && axes.iter().all(|(axis, ..)| axis.state() == MoveState::Idle)
            }
        }
    }
}

/// The steps of a part program, cycle by cycle.
pub(super) struct Follower {
    steps: Steps,
    /// The first step that is not due yet.
    next: Option<AxisPulse>,
    /// Start of the next cycle, in ns.
    now: u64,
    directions: [step_profile::Direction; AXES],
    /// Number of steps that are due on each axis.
    due: [VecDeque<AxisPulse>; AXES],
}

impl Follower {
    fn new(mut steps: Steps) -> Self {
        let (next, directions) = (steps.next(), [step_profile::Direction::default(); AXES]);
        Self { steps, next, now: 0, directions, due: [const { VecDeque::new() }; AXES] }
    }

    /// Returns at most one step per axis; if a corner has two in a cycle, the second goes into the next.
    fn next(&mut self, words: &mut [Pto]) {
        let begin = self.now;
        self.now += u64::from(step_profile::CYCLE_NS);
        while let Some(pulse) = self.next.filter(|pulse| pulse.tick < self.now) {
            self.next = self.steps.next();
            if let Some(due) = self.due.get_mut(usize::from(pulse.axis)) {
                due.push_back(pulse);
            }
        }
        for ((word, due), direction) in words.iter_mut().zip(&mut self.due).zip(&mut self.directions) {
            let command = match due.pop_front() {
                Some(pulse) => {
                    *direction = pulse.direction;
                    let sync_time = pulse.tick.saturating_sub(begin) as u32;
                    Command::Pulse { direction: pulse.direction, sync_time }
                }
                None => Command::Hold { direction: *direction },
            };
            *word = self::word(command);
        }
    }

    fn is_over(&self) -> bool {
        self.next.is_none() && self.due.iter().all(VecDeque::is_empty)
    }
}

/// Moves forwards, and back again.
fn direction_of(done: u64) -> step_profile::Direction {
    if done % 2 == 1 { step_profile::Direction::Reverse } else { step_profile::Direction::Forward }
}

fn level(direction: step_profile::Direction) -> Direction {
    match direction {
        step_profile::Direction::Forward => Direction::Low,
        step_profile::Direction::Reverse => Direction::High,
    }
}

/// Returns a command as it is on the wire.
fn word(command: Command) -> Pto {
    match command {
        Command::Disable => Pto::DriverOff,
        Command::Hold { direction } => Pto::NoPulse { direction: level(direction) },
        Command::Pulse { direction, sync_time } => Pto::from_step(sync_time, level(direction)).unwrap_or_default(),
    }
}
