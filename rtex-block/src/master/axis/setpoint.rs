//! Set-points, modes and profile motion of an axis.

use super::Axis;
use crate::control::ControlBits;
use crate::master::echo::TURN;
use crate::master::profile_move::{CommandEnded, ProfileMove};
use crate::master::progress::Progress;
use crate::master::servo_off::ActiveCode;
use crate::master::state::{AxisState, SetpointError};
use crate::position::step;
use crate::status::StatusFlags;
use crate::type_code::Nibble;

impl Axis {
    /// The set-point: command position in CP, otherwise speed or torque.
    pub const fn setpoint(&self) -> i32 {
        self.setpoint
    }

    /// The present mode.
    pub const fn mode(&self) -> ActiveCode {
        self.mode
    }

    /// Largest step of the command position in an update period, command units.
    pub const fn max_step(&self) -> u32 {
        self.max_step
    }

    /// Changes the mode, with the servo off or on. The new set-point is the actual position in CP, otherwise 0; if the mode
    /// returns to that of the last block, it is the set-point of that block.
    ///
    /// With the servo on the axis must be at rest: the actual position is one or two update periods old when it becomes the
    /// command position. If the next update period brings no position, the axis does not change to CP and stays in its mode.
    /// A drive that cannot change to the mode answers CMD_Error, which stops the axis once the limit is reached.
    ///
    /// # Errors
    /// [`SetpointError::Busy`] during a profile motion or a request, [`SetpointError::NotOn`] between off and on and during
    /// a stop, [`SetpointError::NotStanding`]; the mode is kept.
    pub fn set_mode(&mut self, mode: ActiveCode) -> Result<(), SetpointError> {
        let is_on = match self.state {
            AxisState::SwitchingOn | AxisState::SwitchingOff | AxisState::Stopping(_) | AxisState::Held(_) => {
                return Err(SetpointError::NotOn);
            }
            AxisState::On => true,
            AxisState::Starting | AxisState::Off | AxisState::Stopped(_) => false,
        };
        if self.main.slot.asking().is_some()
            || is_on && (self.is_moving() || self.status().contains(StatusFlags::IN_PROGRESS))
        {
            return Err(SetpointError::Busy);
        }
        if mode == self.mode {
            return Ok(());
        }
        let back = is_on && mode == self.wire.mode;
        if is_on && !back && !self.stands(mode) {
            return Err(SetpointError::NotStanding);
        }
        self.mode = mode;
        self.feed_forward = [0; 3];
        self.rest();
        if back {
            self.setpoint = self.wire.value;
        }
        Ok(())
    }

    /// Begins CP, which was requested and has not been sent yet, at the position of this update period. Without one the axis
    /// stays in the mode of the last block; if it is to be held at rest and nothing can do that in this mode, it is switched off.
    #[cold]
    pub(super) fn begin_positions(&mut self) {
        if self.is_current() {
            self.rest();
        } else {
            (self.mode, self.setpoint) = (self.wire.mode, self.wire.value);
            match self.state {
                AxisState::Stopping(reason) | AxisState::Held(reason) if !self.can_slow_down() => self.fail(reason),
                _ => {}
            }
        }
    }

    /// Whether the axis is at rest, as far as can be determined, for a change to this mode.
    fn stands(&self, mode: ActiveCode) -> bool {
        let commanded = match self.wire.mode {
            ActiveCode::CyclicPosition => self.wire.step == 0,
            ActiveCode::CyclicVelocity => self.wire.value == 0,
            ActiveCode::ProfilePosition | ActiveCode::CyclicTorque => true,
        };
        // The actual position becomes the command position some periods after it was one.
        let drift = self.wire.step.unsigned_abs().saturating_mul(TURN.into());
        let known = self.is_current() && drift <= self.max_step;
        commanded && (mode != ActiveCode::CyclicPosition || known)
    }

    /// Sets the control bits other than Servo_On, which the state decides.
    pub const fn set_control(&mut self, control: ControlBits) {
        self.control = control.difference(ControlBits::SERVO_ON);
    }

    /// Sets Command_Data3 for commands that do not use it themselves: velocity or torque feed-forward by Pr7.35, as long
    /// as the servo is on. With Pr7.35 = 0 it must stay 0, or the drive answers 0032h. While a command uses bytes 12-15 itself
    /// (homing types 21h and 22h, parameter write, profile motion) the drive keeps the last value.
    ///
    /// # Errors
    /// [`SetpointError::NotOn`]
    pub fn set_feed_forward(&mut self, value: i32) -> Result<(), SetpointError> {
        self.must_be_on()?;
        self.feed_forward[0] = value;
        Ok(())
    }

    /// Sets Sub_Command_Data2 and 3 of the 32-byte mode: feed-forward by Pr7.36 and Pr7.37 (numbers inferred), as long as
    /// the servo is on.
    ///
    /// # Errors
    /// [`SetpointError::NotOn`]
    pub fn set_sub_feed_forward(&mut self, data2: i32, data3: i32) -> Result<(), SetpointError> {
        self.must_be_on()?;
        self.feed_forward = [self.feed_forward[0], data2, data3];
        Ok(())
    }

    /// Sets the next command position, in CP.
    ///
    /// # Errors
    /// [`SetpointError`]; the previous position is kept.
    pub fn set_position(&mut self, position: i32) -> Result<(), SetpointError> {
        self.must_be_on()?;
        // The first position after a change of the mode is that of the axis.
        if self.mode != ActiveCode::CyclicPosition || self.wire.mode != self.mode {
            return Err(SetpointError::Mode);
        }
        // From the position that was sent last: several calls in one update period do not add up.
        let step = step(self.wire.value, position);
        if step.unsigned_abs() > self.max_step {
            return Err(SetpointError::Step { step });
        }
        self.setpoint = position;
        Ok(())
    }

    /// Sets the next speed in CV (unit by Pr7.25) or torque in CT (0.1 % of rated).
    ///
    /// # Errors
    /// [`SetpointError`]; the previous value is kept.
    pub fn set_rate(&mut self, rate: i32) -> Result<(), SetpointError> {
        self.must_be_on()?;
        let limit = match self.mode {
            ActiveCode::CyclicVelocity => self.config.max_speed,
            ActiveCode::CyclicTorque => self.config.max_torque,
            _ => return Err(SetpointError::Mode),
        };
        within(rate, limit)?;
        self.setpoint = rate;
        Ok(())
    }

    /// Starts a profile motion, in PP; unit of the speed by Pr7.25.
    ///
    /// # Errors
    /// [`SetpointError`]; a motion in progress continues.
    pub fn start_move(&mut self, type_code: u8, target: i32, speed: i32) -> Result<(), SetpointError> {
        self.start_move_with_latch(type_code, target, speed, Nibble::ZERO, 0)
    }

    /// Like [`start_move`](Self::start_move), with Latch_Sel1 and Monitor_Sel; the answers are in [`profile`](Self::profile).
    ///
    /// # Errors
    /// [`SetpointError`]; a motion in progress continues.
    pub fn start_move_with_latch(
        &mut self,
        type_code: u8,
        target: i32,
        speed: i32,
        latch_sel1: Nibble,
        monitor_sel: u8,
    ) -> Result<(), SetpointError> {
        self.must_be_on()?;
        if self.mode != ActiveCode::ProfilePosition {
            return Err(SetpointError::Mode);
        }
        if self.is_moving() || self.main.slot.asking().is_some() {
            return Err(SetpointError::Busy);
        }
        within(speed, self.config.max_speed)?;
        let motion = ProfileMove::new(self.config.mac_id, type_code, target, speed, self.config.limits.answer);
        self.profile = Some(motion.with_latch(latch_sel1, monitor_sel));
        Ok(())
    }

    /// Changes the speed of the motion in progress, if there is one.
    ///
    /// # Errors
    /// [`SetpointError::NotOn`], [`SetpointError::Rate`]; the previous speed is kept.
    pub fn set_move_speed(&mut self, speed: i32) -> Result<(), SetpointError> {
        self.must_be_on()?;
        within(speed, self.config.max_speed)?;
        if let Some(profile) = &mut self.profile {
            profile.set_speed(speed);
        }
        Ok(())
    }

    /// Returns the profile motion that is in progress, or that has ended and was not yet taken.
    pub const fn profile(&self) -> Option<&ProfileMove> {
        self.profile.as_ref()
    }

    /// Returns the progress of the profile motion; once the motion has ended, returns its end and forgets it. It is done when
    /// In_Progress and Busy have been 0 for a turn of the counter, because they may come late and a block may be old, and the axis has
    /// stayed on for another, because the reason for an abort may appear later.
    pub fn take_move(&mut self) -> Option<Progress<CommandEnded>> {
        let progress = self.profile?.progress();
        if matches!(progress, Progress::Done { .. }) && !self.main.quiet.is_kept() {
            return Some(Progress::Pending { left: self.config.limits.answer });
        }
        if !progress.is_pending() {
            self.profile = None;
        }
        Some(progress)
    }

    pub(in crate::master) fn is_moving(&self) -> bool {
        self.profile.is_some_and(|profile| profile.progress().is_pending())
    }

    fn must_be_on(&self) -> Result<(), SetpointError> {
        if self.state == AxisState::On { Ok(()) } else { Err(SetpointError::NotOn) }
    }
}

fn within(rate: i32, limit: Option<u32>) -> Result<(), SetpointError> {
    match limit {
        Some(limit) if rate.unsigned_abs() > limit => Err(SetpointError::Rate { rate }),
        _ => Ok(()),
    }
}
