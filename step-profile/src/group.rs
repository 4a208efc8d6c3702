use servowire_core::{Command, Direction};

use crate::axis::Axis;
use crate::error::Error;
use crate::profile::Profile;
use crate::ramp_steps::MoveState;

servowire_core::number! {
    /// Which of the four motors move, one bit each.
    ///
    /// The start bits of TI's `sorte_master_cfg.inc`: M1 = 1, M2 = 2, M3 = 4, M4 = 8, all = 0xF, off = 0.
    pub struct Motors(u8, 4);
}

impl Motors {
    /// No motors: the current of all four is switched off.
    pub const NONE: Self = Self::truncate(0);
    /// The first device on the line.
    pub const M1: Self = Self::truncate(1);
    /// The second.
    pub const M2: Self = Self::truncate(2);
    /// The third.
    pub const M3: Self = Self::truncate(4);
    /// The fourth.
    pub const M4: Self = Self::truncate(8);
    /// All four.
    pub const ALL: Self = Self::MAX;

    /// For each motor, whether it is selected.
    pub const fn selected(self) -> [bool; 4] {
        let mask = self.get();
        [mask & 1 != 0, mask & 2 != 0, mask & 4 != 0, mask & 8 != 0]
    }

    /// Gives one command to all selected motors: the others hold with the same DIR; if no motor is selected, all four are
    /// switched off.
    pub fn distribute(self, command: Command) -> [Command; 4] {
        let idle = match command {
            _ if self == Self::NONE => return [Command::Disable; 4],
            Command::Disable => Command::Disable,
            Command::Hold { direction } | Command::Pulse { direction, .. } => Command::Hold { direction },
        };
        self.selected().map(|selected| if selected { command } else { idle })
    }
}

/// Four motors that execute exactly the same sequence, as in the firmware of TIDEP0061 (section 2.3.2).
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Group<'t> {
    axis: Axis<'t>,
    motors: Motors,
    commanded: [i64; 4],
}

impl<'t> Group<'t> {
    /// Creates a group with the selected motors at rest and nothing commanded yet.
    pub const fn new(motors: Motors) -> Self {
        Self { axis: Axis::new(), motors, commanded: [0; 4] }
    }

    /// Selects other motors.
    ///
    /// # Errors
    /// [`Error::Moving`] while a move is in progress: the motors would start or stop without a ramp.
    pub fn select(&mut self, motors: Motors) -> Result<(), Error> {
        if self.state() != MoveState::Idle {
            return Err(Error::Moving);
        }
        self.motors = motors;
        Ok(())
    }

    /// Starts a move of the selected motors.
    ///
    /// # Errors
    /// [`Error::NoMotor`] if none is selected, [`Error::Moving`] while a move is in progress.
    pub fn start(&mut self, profile: Profile<'t>, steps: u32, direction: Direction) -> Result<(), Error> {
        if self.motors == Motors::NONE {
            return Err(Error::NoMotor);
        }
        self.axis.start(profile, steps, direction)
    }

    /// Advances to the next cycle and returns the commands of the four motors.
    pub fn tick(&mut self) -> [Command; 4] {
        let command = self.axis.tick();
        if let Command::Pulse { direction, .. } = command {
            for (steps, selected) in self.commanded.iter_mut().zip(self.motors.selected()) {
                if selected {
                    *steps = direction.advance(*steps);
                }
            }
        }
        self.motors.distribute(command)
    }

    /// Aborts the move, with the ramp down; see [`Axis::abort`].
    pub fn abort(&mut self) {
        self.axis.abort();
    }

    /// What the motors are doing.
    pub fn state(&self) -> MoveState {
        self.axis.state()
    }

    /// The selected motors.
    pub const fn motors(&self) -> Motors {
        self.motors
    }

    /// For each motor, the steps commanded so far, forward less reverse ones.
    pub const fn commanded(&self) -> [i64; 4] {
        self.commanded
    }

    /// Sets the step count of the present position, for instance 0 at a reference.
    pub fn set_commanded(&mut self, steps: [i64; 4]) {
        self.commanded = steps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frequency::Speed;
    use crate::profile::Parameters;

    #[test]
    fn every_mask_distributes_every_command() {
        let direction = Direction::Reverse;
        let hold = Command::Hold { direction };
        for mask in 0..16 {
            let motors = Motors::new(mask).unwrap();
            assert_eq!(motors.get(), mask);
            for command in [Command::Disable, hold, Command::Pulse { direction, sync_time: 7 }] {
                let idle = if mask == 0 || command == Command::Disable { Command::Disable } else { hold };
                let want = [0, 1, 2, 3].map(|m| if mask >> m & 1 == 1 { command } else { idle });
                assert_eq!(motors.distribute(command), want);
            }
        }
        assert_eq!((Motors::new(16), Motors::ALL.get()), (None, 15));
    }

    #[test]
    fn only_selected_motors_count() {
        let profile = Profile::new(Parameters::at(Speed::KHZ_250)).unwrap();
        let mut group = Group::new(Motors::NONE);
        assert_eq!(group.start(profile, 5, Direction::Forward), Err(Error::NoMotor));
        assert_eq!(group.tick(), [Command::Disable; 4]);
        group.select(Motors::new(0b0101).unwrap()).unwrap();
        group.start(profile, 5, Direction::Forward).unwrap();
        assert_eq!(group.select(Motors::ALL), Err(Error::Moving));
        for _ in 0..2000 {
            group.tick();
        }
        group.select(Motors::M1).unwrap();
        group.start(profile, 3, Direction::Reverse).unwrap();
        for _ in 0..2000 {
            group.tick();
        }
        assert_eq!((group.commanded(), group.motors()), ([2, 0, 5, 0], Motors::M1));
        group.set_commanded([0; 4]);
        assert_eq!(group.commanded(), [0; 4]);
        group.start(profile, 3, Direction::Reverse).unwrap();
        group.abort();
        assert_eq!(group.state(), MoveState::Idle);
    }
}
