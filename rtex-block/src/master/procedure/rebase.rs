//! New coordinates while the servo is on.

use super::ask::{Ask, procedure};
use super::homing::command;
use crate::master::axis::Axis;
use crate::master::progress::{Failure, Progress};
use crate::master::servo_off::ActiveCode;
use crate::master::state::{AskError, AxisState, SetpointError};
use crate::type_code::homing;

/// Sets the actual position (21h) of an axis in CP **with the servo on**: the last part of a homing in which the host moves the
/// axis, towards a switch or a latch.
///
/// This is dangerous because the drive adopts new coordinates while the motor is energised: a command position in the old
/// ones would be a jump by the whole offset. So the axis must be at rest. It changes to CV at speed 0, in which no position
/// is commanded, and returns to CP at the position in the new coordinates. In between only the speed loop holds the motor:
/// do not use it for an axis that gravity can move. The available documents do not say whether a drive accepts the command
/// with the servo on. If it does not, the procedure fails with [`Failure::Execution`] or [`Failure::CommandError`], and the
/// axis is in CP again. After [`Failure::TimedOut`] the effect is not known; the command position still equals the actual one.
/// The command is never sent twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RebaseWithServoOn {
    ask: Ask,
    position: i32,
    limit: u32,
    left: u32,
    /// How the command was answered.
    answer: Option<Result<(), Failure>>,
    end: Option<Progress<i32>>,
}

procedure!(RebaseWithServoOn, i32);

impl RebaseWithServoOn {
    /// Creates the procedure that makes the present position `position`, command units; each change of the mode may take
    /// `limit` update periods.
    pub const fn new(position: i32, limit: u32) -> Self {
        Self { ask: Ask::NEW, position, limit, left: limit, answer: None, end: None }
    }

    const fn reset(&mut self) {
        *self = Self::new(self.position, self.limit);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<i32> {
        match axis.state() {
            AxisState::On => {}
            AxisState::Stopped(reason) | AxisState::Stopping(reason) | AxisState::Held(reason) => {
                return Progress::Failed { error: Failure::Stopped(reason) };
            }
            _ => return Progress::Failed { error: Failure::ServoOff },
        }
        match (self.answer, axis.mode()) {
            (None, ActiveCode::CyclicPosition) => self.change(axis, ActiveCode::CyclicVelocity),
            (None, ActiveCode::CyclicVelocity) => self.set(axis),
            // A position in the old coordinates may come for a turn of the counter after the answer.
            (Some(_), ActiveCode::CyclicVelocity) if !axis.can_ask() => self.wait(),
            (Some(_), ActiveCode::CyclicVelocity) => self.change(axis, ActiveCode::CyclicPosition),
            // By now it has been sent.
            (Some(Ok(())), ActiveCode::CyclicPosition) => Progress::Done { value: axis.setpoint() },
            (Some(Err(error)), ActiveCode::CyclicPosition) => Progress::Failed { error },
            _ => Progress::Failed { error: Failure::Mode },
        }
    }

    /// The mode changes as soon as the axis is at rest.
    fn change(&mut self, axis: &mut Axis, mode: ActiveCode) -> Progress<i32> {
        match axis.set_mode(mode) {
            Ok(()) => {}
            Err(SetpointError::NotStanding | SetpointError::Busy) => return self.wait(),
            Err(_) => return Progress::Failed { error: Failure::Mode },
        }
        Progress::Pending { left: self.left }
    }

    const fn wait(&mut self) -> Progress<i32> {
        let Some(left) = self.left.checked_sub(1) else { return Progress::Failed { error: Failure::Mode } };
        self.left = left;
        Progress::Pending { left }
    }

    fn set(&mut self, axis: &mut Axis) -> Progress<i32> {
        let request = command(homing::SET_ACTUAL_POSITION, self.position);
        match self.ask.receive_with(axis, |axis| match axis.ask_rebasing(request) {
            // The mode is not on its way yet.
            Err(AskError::ServoOn) => Err(AskError::Busy),
            sent => sent,
        }) {
            Progress::Done { .. } => self.answer = Some(Ok(())),
            Progress::Failed { error } => self.answer = Some(Err(error)),
            Progress::Pending { left } => return Progress::Pending { left },
        }
        self.left = self.limit;
        Progress::Pending { left: self.left }
    }
}
