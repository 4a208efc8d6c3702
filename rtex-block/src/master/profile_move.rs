use super::progress::{Failure, Progress};
use super::state::StopReason;
use crate::code::Code;
use crate::execution::{Execution, ProfileFlags};
use crate::header::MacId;
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;
use crate::status::StatusFlags;
use crate::type_code::Nibble;

/// The progress of a profile motion while it is pending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MoveStage {
    /// Code 10h has been sent; the drive has not echoed it yet, or is still moving.
    Preparing,
    /// Code 17h has been sent, and neither In_Progress nor Busy has been 1 yet.
    Starting,
    /// In_Progress or Busy was 1: the drive generates the position command.
    Moving,
    /// The motion has ended, successfully or not; the code is 10h again.
    Ended,
}

/// The end of a profile motion: In_Progress went from 1 to 0, so the drive no longer generates position commands.
///
/// This is not the arrival of the motor, which may still be on its way to the last command position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CommandEnded {
    /// In_Position in the same response: whether the deviation was already inside the window.
    pub in_position: bool,
    /// WNG: executed with a restriction.
    pub warning: bool,
}

/// Profile motion: the change of the code from 10h to 17h starts it while In_Progress is 0.
///
/// Target speed may be changed while the axis moves ([`Axis::set_move_speed`](super::Axis::set_move_speed)); speed 0, or
/// [`PAUSE`](crate::ControlBits::PAUSE), holds it at rest with In_Progress still 1. After the end the code goes
/// back to 10h, ready for the next motion. System Design Guide for Master, "Profile position control".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ProfileMove {
    mac_id: MacId,
    type_code: u8,
    target_position: i32,
    target_speed: i32,
    stage: MoveStage,
    progress: Progress<CommandEnded>,
    /// Why it is being aborted.
    broken: Option<StopReason>,
    latch_sel1: Nibble,
    monitor_sel: u8,
    flags: ProfileFlags,
    monitor_data: i32,
}

impl ProfileMove {
    /// Creates a motion to `target_position` (absolute or relative, by the type code), unit of the speed by Pr7.25; the
    /// drive has `limit` update periods to get ready and to set In_Progress.
    ///
    /// A motion of zero length may never set it, in which case it fails with [`NotStarted`](Failure::NotStarted). That
    /// In_Progress may come later than the first echo of 17h is inferred: the vendor does not say when it rises. Before a
    /// relative motion, read IPOS while In_Progress is 0: it follows the motor in servo-off, CV and CT.
    pub const fn new(mac_id: MacId, type_code: u8, target_position: i32, target_speed: i32, limit: u32) -> Self {
        Self {
            mac_id,
            type_code,
            target_position,
            target_speed,
            stage: MoveStage::Preparing,
            progress: Progress::Pending { left: limit },
            broken: None,
            latch_sel1: Nibble::ZERO,
            monitor_sel: 0,
            flags: ProfileFlags::empty(),
            monitor_data: 0,
        }
    }

    /// Adds Latch_Sel1 and Monitor_Sel, which the drive echoes; an answer with other values is an older one.
    #[must_use]
    pub const fn with_latch(self, latch_sel1: Nibble, monitor_sel: u8) -> Self {
        Self { latch_sel1, monitor_sel, ..self }
    }

    /// Sets a new target speed, valid at once.
    pub(super) const fn set_speed(&mut self, target_speed: i32) {
        self.target_speed = target_speed;
    }

    /// TPOS, for Command_Data1.
    pub const fn target_position(&self) -> i32 {
        self.target_position
    }

    /// Returns what to send now: the normal command (code 10h) before the start and after the end, otherwise 17h.
    pub const fn request(&self) -> NonCyclicCommand {
        match self.stage {
            MoveStage::Starting | MoveStage::Moving => NonCyclicCommand::Profile {
                type_code: self.type_code,
                latch_sel1: self.latch_sel1,
                monitor_sel: self.monitor_sel,
                target_speed: self.target_speed,
            },
            MoveStage::Preparing | MoveStage::Ended => NonCyclicCommand::IDLE,
        }
    }

    /// Returns the state of the motion.
    pub(super) const fn progress(&self) -> Progress<CommandEnded> {
        self.progress
    }

    /// The progress of the motion while it is pending.
    pub const fn stage(&self) -> MoveStage {
        self.stage
    }

    /// Returns whether In_Progress or Busy was 1 and the motion has not ended.
    pub(super) const fn is_moving(&self) -> bool {
        matches!(self.stage, MoveStage::Moving)
    }

    /// NEAR, PSL, NSL and Latch_Comp1 of the last answer.
    pub const fn flags(&self) -> ProfileFlags {
        self.flags
    }

    /// Monitor_Data of the last answer: the value chosen by Monitor_Sel. LPOS1 is valid once Latch_Comp1 is set.
    pub const fn monitor_data(&self) -> i32 {
        self.monitor_data
    }

    /// Ends the motion for this reason, or because the servo is off, and for no other reason: at once or, if the drive `slows`
    /// down, when In_Progress ends. An end that is not `confirmed` counts as an end of this kind.
    pub(super) fn break_off(&mut self, reason: Option<StopReason>, confirmed: bool, slows: bool) {
        match self.progress {
            Progress::Pending { .. } if slows => self.broken = self.broken.or(reason),
            Progress::Done { .. } if confirmed => {}
            Progress::Pending { .. } | Progress::Done { .. } => {
                self.broken = self.broken.or(reason);
                self.fail(Failure::ServoOff);
            }
            Progress::Failed { .. } => {}
        }
    }

    /// Takes the result of one update period: the drive's response, `None` if there was none or it was refused.
    pub fn receive(&mut self, response: Option<&Response>) -> Progress<CommandEnded> {
        match (self.stage, response.filter(|response| response.mac_id == self.mac_id)) {
            (MoveStage::Preparing, Some(r))
                if r.code == Code::PROFILE_IDLE && !r.cmd_error && !r.status.contains(StatusFlags::IN_PROGRESS) =>
            {
                self.stage = MoveStage::Starting;
            }
            (MoveStage::Starting | MoveStage::Moving, Some(r)) if r.code == Code::PROFILE_START => self.read(r),
            _ => {}
        }
        self.wait();
        self.progress
    }

    fn read(&mut self, response: &Response) {
        let NonCyclicResponse::Profile { execution, type_code, flags, latch_sel1, monitor_sel, monitor_data } =
            response.noncyclic()
        else {
            return self.refuse(response);
        };
        if (type_code, latch_sel1, monitor_sel) != (self.type_code, self.latch_sel1, self.monitor_sel) {
            return;
        }
        (self.flags, self.monitor_data) = (flags, monitor_data);
        let moves = execution.contains(Execution::BUSY) || response.status.contains(StatusFlags::IN_PROGRESS);
        if execution.contains(Execution::ERR) {
            self.fail(Failure::Execution);
        } else if moves {
            self.stage = MoveStage::Moving;
        } else if self.stage != MoveStage::Moving {
            // In_Progress may still rise.
        } else if let Some(reason) = self.broken {
            self.fail(Failure::Stopped(reason));
        } else {
            let in_position = response.status.contains(StatusFlags::IN_POSITION);
            let warning = execution.contains(Execution::WNG);
            self.progress = Progress::Done { value: CommandEnded { in_position, warning } };
            self.stage = MoveStage::Ended;
        }
    }

    /// A CMD_Error at the start refuses the motion. During the motion it is the effect of one damaged frame, and the drive
    /// keeps moving.
    fn refuse(&mut self, response: &Response) {
        if let (MoveStage::Starting, NonCyclicResponse::CommandError(code)) = (self.stage, response.noncyclic()) {
            self.fail(Failure::CommandError(code));
        }
    }

    /// Checks the limit for getting ready and starting; a motion in progress has none.
    fn wait(&mut self) {
        let (Progress::Pending { left }, MoveStage::Preparing | MoveStage::Starting) = (self.progress, self.stage)
        else {
            return;
        };
        match (left.checked_sub(1), self.stage) {
            (Some(left), _) => self.progress = Progress::Pending { left },
            (None, MoveStage::Starting) => self.fail(Failure::NotStarted),
            (None, _) => self.fail(Failure::TimedOut),
        }
    }

    /// Ends the motion with an error; if a stop is breaking it off, with the reason of the stop instead.
    fn fail(&mut self, error: Failure) {
        let error = self.broken.map_or(error, Failure::Stopped);
        self.progress = Progress::Failed { error };
        self.stage = MoveStage::Ended;
    }
}
