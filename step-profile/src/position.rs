use servowire_core::{Command, Direction};

use crate::error::Error;
use crate::group::{Group, Motors};
use crate::microstep::{Microstep, Turn};
use crate::profile::Profile;
use crate::ramp_steps::MoveState;

servowire_core::codes! {
    /// The operating modes of TI's `sorte_master_cfg.inc`.
    ///
    /// TIDEP0061 describes position and dance, and this crate implements both; the other modes are only numbers.
    pub enum OperatingMode: u8 {
        /// Turns by a number of steps: [`PositionMode`].
        Position = 0 => "position",
        /// Not described.
        Speed = 1 => "speed",
        /// Not described.
        Ramp = 2 => "ramp",
        /// Tones: [`Dance`](crate::Dance).
        Dance = 3 => "dance",
        /// Not described.
        Manual = 4 => "manual",
    }
}

servowire_core::codes! {
    /// The states of position mode, numbered as in TI's `sorte_master_cfg.inc`.
    pub enum PositionState: u8 {
        /// Ready for the next turn.
        Idle = 0 => "idle",
        /// One second of rest after a turn.
        Wait = 1 => "wait",
        /// A quarter turn is in progress.
        QuarterTurn = 2 => "quarter turn",
        /// A full turn is in progress.
        FullTurn = 3 => "full turn",
        /// Ten turns are in progress.
        TenTurns = 4 => "ten turns",
    }
}

/// Position mode: the selected motors turn by a quarter, once or ten times, and then rest for a second.
///
/// TIDEP0061, section 2.3.3: any single motor, all, or none, to bring the motors to a reference position by hand.
/// The states are TI's; this crate's interpretation is that the rest follows the turn.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PositionMode<'t> {
    group: Group<'t>,
    microstep: Microstep,
    turn: Option<Turn>,
    /// Remaining cycles of rest.
    rest: u32,
}

impl<'t> PositionMode<'t> {
    /// The rest after a turn in cycles: 1 s.
    pub const REST: u32 = 250_000;

    /// Creates the mode with the selected motors at rest.
    pub const fn new(motors: Motors, microstep: Microstep) -> Self {
        Self { group: Group::new(motors), microstep, turn: None, rest: 0 }
    }

    /// Selects other motors.
    ///
    /// # Errors
    /// [`Error::Moving`] before the last turn and the rest after it have ended.
    pub fn select(&mut self, motors: Motors) -> Result<(), Error> {
        if self.state() != PositionState::Idle {
            return Err(Error::Moving);
        }
        self.group.select(motors)
    }

    /// Starts a turn of the selected motors.
    ///
    /// # Errors
    /// [`Error::Moving`] before the last turn and the rest after it have ended, [`Error::NoMotor`] if no motor is
    /// selected.
    pub fn start(&mut self, profile: Profile<'t>, turn: Turn, direction: Direction) -> Result<(), Error> {
        if self.state() != PositionState::Idle {
            return Err(Error::Moving);
        }
        self.group.start(profile, self.microstep.steps(turn), direction)?;
        self.turn = Some(turn);
        Ok(())
    }

    /// Advances to the next cycle and returns the commands of the four motors.
    pub fn tick(&mut self) -> [Command; 4] {
        self.rest = self.rest.saturating_sub(1);
        let commands = self.group.tick();
        if self.turn.is_some() && self.group.state() == MoveState::Idle {
            self.turn = None;
            self.rest = Self::REST;
        }
        commands
    }

    /// Aborts the turn, with the ramp down and the rest; see [`Axis::abort`](crate::Axis::abort).
    pub fn abort(&mut self) {
        self.group.abort();
    }

    /// The present state.
    pub const fn state(&self) -> PositionState {
        match self.turn {
            Some(Turn::Quarter) => PositionState::QuarterTurn,
            Some(Turn::Full) => PositionState::FullTurn,
            Some(Turn::Ten) => PositionState::TenTurns,
            None if self.rest > 0 => PositionState::Wait,
            None => PositionState::Idle,
        }
    }

    /// Sets the position of the motors: this is the purpose of a turn to the reference position.
    pub fn set_commanded(&mut self, positions: [i64; 4]) {
        self.group.set_commanded(positions);
    }

    /// The motors: selection, positions, ramp state.
    pub const fn group(&self) -> &Group<'t> {
        &self.group
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frequency::Speed;
    use crate::profile::Parameters;

    #[test]
    fn positions_are_declared() {
        let mut mode = PositionMode::new(Motors::ALL, Microstep::Div256);
        mode.set_commanded([1, -2, 3, i64::MIN]);
        assert_eq!(mode.group().commanded(), [1, -2, 3, i64::MIN]);
    }

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn a_quarter_turn_and_its_second_of_rest() {
        let profile = Profile::new(Parameters::at(Speed::KHZ_250)).unwrap();
        let mut mode = PositionMode::new(Motors::M2, Microstep::Div256);
        mode.start(profile, Turn::Quarter, Direction::Reverse).unwrap();
        let end = profile.steps(12_800).last().unwrap().cycle;
        for _ in 0..end {
            mode.tick();
            assert_eq!(mode.state(), PositionState::QuarterTurn);
        }
        let [_, last, ..] = mode.tick();
        assert!(matches!(last, Command::Pulse { .. }));
        assert_eq!(mode.group().commanded(), [0, -12_800, 0, 0]);
        for _ in 0..PositionMode::REST {
            assert_eq!(mode.state(), PositionState::Wait);
            assert_eq!(mode.select(Motors::ALL), Err(Error::Moving));
            assert_eq!(mode.start(profile, Turn::Full, Direction::Forward), Err(Error::Moving));
            mode.tick();
        }
        assert_eq!(mode.state(), PositionState::Idle);
        mode.select(Motors::NONE).unwrap();
        assert_eq!(mode.start(profile, Turn::Full, Direction::Forward), Err(Error::NoMotor));
        assert_eq!((mode.state(), mode.tick()), (PositionState::Idle, [Command::Disable; 4]));
    }

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn an_abort_before_the_first_pulse_rests_too() {
        let profile = Profile::new(Parameters::at(Speed::KHZ_250)).unwrap();
        let mut mode = PositionMode::new(Motors::ALL, Microstep::Full);
        for (turn, state) in [(Turn::Full, PositionState::FullTurn), (Turn::Ten, PositionState::TenTurns)] {
            mode.start(profile, turn, Direction::Forward).unwrap();
            assert_eq!(mode.state(), state);
            mode.abort();
            mode.tick();
            assert_eq!((mode.state(), mode.group().commanded()), (PositionState::Wait, [0; 4]));
            mode.set_commanded([0; 4]);
            for _ in 0..PositionMode::REST {
                mode.tick();
            }
        }
    }

    #[test]
    fn modes_by_their_numbers() {
        let codes = [
            OperatingMode::Position,
            OperatingMode::Speed,
            OperatingMode::Ramp,
            OperatingMode::Dance,
            OperatingMode::Manual,
        ];
        for (code, mode) in (0..).zip(codes) {
            assert_eq!(OperatingMode::from_code(code), Some(mode));
        }
        assert_eq!(OperatingMode::from_code(5), None);
        assert_eq!(OperatingMode::Manual.code(), 4);
        let states = [
            (PositionState::Idle, 0),
            (PositionState::Wait, 1),
            (PositionState::QuarterTurn, 2),
            (PositionState::FullTurn, 3),
            (PositionState::TenTurns, 4),
        ];
        for (state, code) in states {
            assert_eq!(state.code(), code, "{state}");
        }
    }

    /// 1 s of 4 µs cycles.
    #[test]
    fn the_rest_lasts_a_second() {
        assert_eq!(PositionMode::REST, 250_000);
    }
}
