//! Position set and homing by the drive.

use super::ask::{Ask, procedure, read_back};
use crate::master::axis::Axis;
use crate::master::config::StopCategory;
use crate::master::echo::{Arrival, TURN};
use crate::master::progress::{Failure, Progress};
use crate::master::servo_off::ActiveCode;
use crate::master::state::{AskError, AxisState, StopReason};
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::status::StatusFlags;
use crate::type_code::{Nibble, homing, monitor};

/// A homing command outside latch mode.
pub(super) const fn command(type_code: u8, setting_data: i32) -> NonCyclicCommand {
    NonCyclicCommand::Homing {
        type_code,
        latch_sel1: Nibble::ZERO,
        latch_sel2: Nibble::ZERO,
        monitor_sel: 0,
        setting_data,
    }
}

/// Sets a position of the drive (homing types 21h and 22h), once, and reads it back. This works only with the servo off.
///
/// `Done` carries the position as read back: a released motor may have turned since. The command is never sent twice. If its
/// answer does not come, the outcome depends on the position read back: `Done` if it equals the one to be set, otherwise
/// [`Failure::TimedOut`], in which case the effect is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SetPosition {
    ask: Ask,
    type_code: u8,
    position: i32,
    /// Whether the command was answered, or its limit has passed.
    set: Option<Result<(), Failure>>,
    end: Option<Progress<i32>>,
}

procedure!(SetPosition, i32);

impl SetPosition {
    /// Sets the actual position (21h), command units; read back as APOS.
    pub const fn actual(position: i32) -> Self {
        Self { ask: Ask::NEW, type_code: homing::SET_ACTUAL_POSITION, position, set: None, end: None }
    }

    /// Sets the command position (22h), command units; read back as IPOS, which follows the motor while the servo is off.
    pub const fn command(position: i32) -> Self {
        Self { ask: Ask::NEW, type_code: homing::SET_COMMAND_POSITION, position, set: None, end: None }
    }

    const fn reset(&mut self) {
        (self.ask, self.set) = (Ask::NEW, None);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<i32> {
        let Some(set) = self.set else {
            match self.ask.receive(axis, command(self.type_code, self.position)) {
                Progress::Done { .. } => self.set = Some(Ok(())),
                Progress::Failed { error: Failure::TimedOut } => {
                    (self.set, self.ask) = (Some(Err(Failure::TimedOut)), Ask::NEW);
                }
                Progress::Failed { error } => return Progress::Failed { error },
                Progress::Pending { .. } => {}
            }
            return Progress::Pending { left: axis.answer_left() };
        };
        let type_code = match self.type_code {
            homing::SET_ACTUAL_POSITION => monitor::APOS,
            _ => monitor::IPOS,
        };
        let read = NonCyclicCommand::Monitor(Arguments { type_code, index: 0, data: 0 });
        read_back(self.ask.receive(axis, read), set, |response| match (set, response.data()) {
            (Ok(()), Some(value)) => Progress::Done { value },
            (Err(_), Some(value)) if value == self.position => Progress::Done { value },
            (Err(error), _) => Progress::Failed { error },
            // Never: a monitor request is done with a monitor response, which has data.
            (Ok(()), None) => Progress::Failed { error: Failure::TimedOut },
        })
    }
}

/// Homing by the drive: the command with the caller's type code, and then the end of the drive's motion.
///
/// This works only in PP, where the drive generates the position command. In CP the host generates it: the drive would adopt
/// new coordinates between two set-points, and the next set-point, still in the old ones, would be a jump by the whole
/// offset. In CV and CT the drive generates no position command, so In_Progress carries no information. The available
/// documents do not say how a drive homes in these modes.
///
/// `Done` when Homing_Complete is 1 and In_Progress is 0 for a turn of the counter, the axis has been on all the time, and
/// at least one of the two has been different since the command was sent, because Homing_Complete may be left from an
/// earlier homing. If the homing is aborted, it fails for the reason that stopped the axis. If it does not end in time, the
/// axis is stopped (category 1) for [`HomingTimeout`](StopReason::HomingTimeout). The command is never sent twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Home {
    ask: Ask,
    type_code: u8,
    limit: u32,
    left: u32,
    accepted: bool,
    /// Homing_Complete was 0 or In_Progress was 1, so the present value of Homing_Complete is not left from an earlier
    /// homing.
    fresh: bool,
    /// Number of blocks on time that show the axis at rest before the homing begins, and number that show its end.
    blocks: u8,
    end: Option<Progress<()>>,
}

procedure!(Home, ());

impl Home {
    /// Creates a homing of this type. The drive may be Busy for `limit` update periods more than an answer may take, and has as many
    /// after it has accepted the command; a motion before it has as many in which to end.
    pub const fn new(type_code: u8, limit: u32) -> Self {
        let ask = Ask::NEW;
        Self { ask, type_code, limit, left: limit, accepted: false, fresh: false, blocks: 0, end: None }
    }

    const fn reset(&mut self) {
        *self = Self::new(self.type_code, self.limit);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<()> {
        match axis.state() {
            AxisState::On if axis.mode() != ActiveCode::ProfilePosition => {
                return Progress::Failed { error: Failure::Mode };
            }
            AxisState::On => {}
            AxisState::Stopped(reason) | AxisState::Stopping(reason) | AxisState::Held(reason) => {
                return Progress::Failed { error: Failure::Stopped(reason) };
            }
            _ => return Progress::Failed { error: Failure::ServoOff },
        }
        let status = axis.status();
        let [complete, moves] =
            [StatusFlags::HOMING_COMPLETE, StatusFlags::IN_PROGRESS].map(|flag| status.contains(flag));
        let on_its_way = self.ask.asked || self.accepted;
        if !on_its_way && self.for_a_turn(axis, !moves) < TURN {
            // The end of another motion would look like that of this one.
            return self.wait(axis);
        }
        self.fresh |= on_its_way && (moves || !complete);
        if !self.accepted {
            let request = command(self.type_code, 0);
            if !self.ask.asked {
                self.left = self.limit.saturating_add(axis.config().limits.answer);
            }
            let mut answer = self.ask.receive_with(axis, |axis| axis.ask_homing(request));
            if self.ask.asked {
                // The handshake counts what is not Busy.
                match self.left.checked_sub(1) {
                    Some(left) => self.left = left,
                    None => answer = Progress::Failed { error: Failure::TimedOut },
                }
            }
            if answer == (Progress::Failed { error: Failure::TimedOut }) {
                // It may be under way.
                axis.stop_for(StopReason::HomingTimeout, StopCategory::One);
            }
            return answer.and_then(|_| {
                (self.accepted, self.blocks, self.left) = (true, 0, self.limit);
                Progress::Pending { left: self.left }
            });
        }
        if self.for_a_turn(axis, self.fresh && complete && !moves) > TURN {
            return Progress::Done { value: () };
        }
        self.wait(axis)
    }

    /// Number of consecutive blocks on time for which this is true.
    fn for_a_turn(&mut self, axis: &Axis, is_so: bool) -> u8 {
        if axis.arrival() == Arrival::OnTime {
            self.blocks = if is_so { self.blocks.saturating_add(1) } else { 0 };
        }
        self.blocks
    }

    fn wait(&mut self, axis: &mut Axis) -> Progress<()> {
        if let Some(left) = self.left.checked_sub(1) {
            self.left = left;
            return Progress::Pending { left };
        }
        if !self.accepted {
            return Progress::Failed { error: Failure::NotSent(AskError::Busy) };
        }
        axis.stop_for(StopReason::HomingTimeout, StopCategory::One);
        Progress::Failed { error: Failure::TimedOut }
    }
}
