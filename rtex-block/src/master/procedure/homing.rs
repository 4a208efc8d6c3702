//! Position set and homing by the drive.

use super::Ask;
use crate::master::axis::Axis;
use crate::master::progress::{Failure, Progress};
use crate::master::servo_off::ActiveCode;
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::status::StatusFlags;
use crate::type_code::{Nibble, homing, monitor};

/// A homing command outside latch mode.
const fn command(type_code: u8, setting_data: i32) -> NonCyclicCommand {
    NonCyclicCommand::Homing {
        type_code,
        latch_sel1: Nibble::ZERO,
        latch_sel2: Nibble::ZERO,
        monitor_sel: 0,
        setting_data,
    }
}

/// Sets a position of the drive (homing types 21h and 22h), once, and reads it back. Only with the servo off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SetPosition {
    ask: Ask,
    type_code: u8,
    position: i32,
    /// The command was answered, or not within its limit.
    set: Option<Result<(), Failure>>,
    end: Option<Progress<i32>>,
}

impl SetPosition {
    /// Sets the actual position (21h), command units; read back as APOS.
    pub const fn actual(position: i32) -> Self {
        Self { ask: Ask { asked: false }, type_code: homing::SET_ACTUAL_POSITION, position, set: None, end: None }
    }

    /// Sets the command position (22h), command units; read back as IPOS, which follows the motor while the servo is off.
    pub const fn command(position: i32) -> Self {
        Self { ask: Ask { asked: false }, type_code: homing::SET_COMMAND_POSITION, position, set: None, end: None }
    }

    /// To be called once in every update period. `Done` carries the position as read back: a motor that is free may have
    /// turned since.
    ///
    /// The command is never sent twice. If its answer does not come, the position read back decides: `Done` if it is the one
    /// to be set, otherwise [`Failure::TimedOut`], and the effect is not known. Once done or failed it stays so.
    pub fn receive(&mut self, axis: &mut Axis) -> Progress<i32> {
        let progress = self.end.unwrap_or_else(|| self.next(axis));
        self.end = progress.ended();
        progress
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<i32> {
        let Some(set) = self.set else {
            match self.ask.receive(axis, command(self.type_code, self.position)) {
                Progress::Done { .. } => self.set = Some(Ok(())),
                Progress::Failed { error: Failure::TimedOut } => self.set = Some(Err(Failure::TimedOut)),
                Progress::Failed { error } => return Progress::Failed { error },
                Progress::Pending { .. } => {}
            }
            return Progress::Pending { left: axis.answer_left() };
        };
        let type_code = match self.type_code {
            homing::SET_ACTUAL_POSITION => monitor::APOS,
            _ => monitor::IPOS,
        };
        match self.ask.receive(axis, NonCyclicCommand::Monitor(Arguments { type_code, index: 0, data: 0 })) {
            Progress::Done { value } => match (set, value.data()) {
                (Ok(()), Some(value)) => Progress::Done { value },
                (Err(_), Some(value)) if value == self.position => Progress::Done { value },
                (Err(error), _) => Progress::Failed { error },
                // Never: a monitor request is done with a monitor response, which has data.
                (Ok(()), None) => Progress::Failed { error: Failure::TimedOut },
            },
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}

/// Homing by the drive: the command with the caller's type code, and then the end of the drive's motion.
///
/// Only in PP, where the drive generates the position command. In CP the host does: the drive would take up new coordinates
/// between two set-points, and the next one, still in the old ones, would be a jump by the whole offset. In CV and CT nobody
/// watches In_Progress, as the drive generates no position command. How a drive homes there is not in the documents at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Home {
    ask: Ask,
    type_code: u8,
    left: u32,
    accepted: bool,
    /// Homing_Complete was 0, or In_Progress 1: what it says now is not left from an earlier homing.
    fresh: bool,
    end: Option<Progress<()>>,
}

impl Home {
    /// A homing of this type; the drive has `limit` update periods after it has accepted the command.
    pub const fn new(type_code: u8, limit: u32) -> Self {
        Self { ask: Ask { asked: false }, type_code, left: limit, accepted: false, fresh: false, end: None }
    }

    /// To be called once in every update period. `Done` when Homing_Complete is 1 and In_Progress is 0, and at least one of
    /// them was different since the command was accepted: Homing_Complete may be left from an earlier homing. Once done or
    /// failed it stays so: the command is never sent twice.
    pub fn receive(&mut self, axis: &mut Axis) -> Progress<()> {
        let progress = self.end.unwrap_or_else(|| self.next(axis));
        self.end = progress.ended();
        progress
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<()> {
        if axis.mode() != ActiveCode::ProfilePosition {
            return Progress::Failed { error: Failure::Mode };
        }
        let status = axis.status();
        let [complete, moves] =
            [StatusFlags::HOMING_COMPLETE, StatusFlags::IN_PROGRESS].map(|flag| status.contains(flag));
        if moves && !self.ask.asked && !self.accepted {
            // The end of another motion would look like that of this one.
            return self.wait();
        }
        self.fresh |= (self.ask.asked || self.accepted) && (moves || !complete);
        if !self.accepted {
            match self.ask.receive(axis, command(self.type_code, 0)) {
                Progress::Done { .. } => self.accepted = true,
                Progress::Pending { left } => return Progress::Pending { left },
                Progress::Failed { error } => return Progress::Failed { error },
            }
        }
        if self.fresh && complete && !moves {
            return Progress::Done { value: () };
        }
        self.wait()
    }

    const fn wait(&mut self) -> Progress<()> {
        match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Progress::Pending { left }
            }
            None => Progress::Failed { error: Failure::TimedOut },
        }
    }
}
