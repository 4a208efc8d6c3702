use crate::{Answer, Code, ErrorCode, MacId, Nibble, Request, Response};

/// How far a profile motion has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MoveProgress {
    /// Code 10h is out; the drive has not echoed it yet, or is still moving.
    Preparing,
    /// Code 17h is out and not answered yet.
    Starting,
    /// The drive generates the position command.
    Moving {
        /// Inside the near window.
        near: bool,
    },
    /// In_Progress went back to 0.
    Done,
    /// ERR: accepted, and failed while it was executed.
    Failed,
    /// CMD_Error: not accepted.
    Rejected(ErrorCode),
    /// The drive did not start within the caller's limit.
    TimedOut,
}

/// Profile motion: the change of the code from 10h to 17h starts it while In_Progress is 0.
///
/// Target speed may be changed while the axis moves ([`set_speed`](Self::set_speed)); speed 0, or
/// [`PAUSE`](crate::ControlBits::PAUSE), makes it stand with In_Progress still 1. After the end the code goes
/// back to 10h, ready for the next motion. System Design Guide for Master, "Profile position control".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ProfileMove {
    mac_id: MacId,
    type_code: u8,
    target_position: i32,
    target_speed: i32,
    progress: MoveProgress,
    left: u32,
}

impl ProfileMove {
    /// A motion to `target_position` (by the type code absolute or relative), unit of the speed by Pr7.25; the
    /// drive has `limit` polls to get ready and start.
    ///
    /// Before a relative motion read IPOS while In_Progress is 0: it follows the motor in servo-off, CV and CT.
    pub const fn new(mac_id: MacId, type_code: u8, target_position: i32, target_speed: i32, limit: u32) -> Self {
        Self { mac_id, type_code, target_position, target_speed, progress: MoveProgress::Preparing, left: limit }
    }

    /// Another target speed, valid at once.
    pub const fn set_speed(&mut self, target_speed: i32) {
        self.target_speed = target_speed;
    }

    /// TPOS, for Command_Data1.
    pub const fn target_position(&self) -> i32 {
        self.target_position
    }

    /// What to send now: the normal command (code 10h) before the start and after the end, otherwise 17h.
    pub const fn request(&self) -> Request {
        match self.progress {
            MoveProgress::Starting | MoveProgress::Moving { .. } => Request::Profile {
                type_code: self.type_code,
                latch_sel1: Nibble::ZERO,
                monitor_sel: 0,
                target_speed: self.target_speed,
            },
            _ => Request::IDLE,
        }
    }

    /// How far it is.
    pub const fn progress(&self) -> MoveProgress {
        self.progress
    }

    /// Takes what one update period brought: the drive's response, `None` if there was none or it was refused.
    pub fn poll(&mut self, response: Option<&Response>) -> MoveProgress {
        let response = response.filter(|response| response.mac_id == self.mac_id);
        self.progress = match (self.progress, response) {
            (MoveProgress::Preparing, Some(r))
                if r.code == Code::PROFILE_IDLE && !r.cmd_error && !r.status.in_progress() =>
            {
                MoveProgress::Starting
            }
            (MoveProgress::Starting | MoveProgress::Moving { .. }, Some(r)) if r.code == Code::PROFILE_START => {
                self.read(r)
            }
            (progress, _) => progress,
        };
        if matches!(self.progress, MoveProgress::Preparing | MoveProgress::Starting) {
            match self.left.checked_sub(1) {
                Some(left) => self.left = left,
                None => self.progress = MoveProgress::TimedOut,
            }
        }
        self.progress
    }

    fn read(&self, response: &Response) -> MoveProgress {
        match response.answer() {
            Answer::CommandError(code) => MoveProgress::Rejected(code),
            Answer::Profile { type_code, .. } if type_code != self.type_code => self.progress,
            Answer::Profile { execution, .. } if execution.err => MoveProgress::Failed,
            Answer::Profile { execution, near, .. } if execution.busy || response.status.in_progress() => {
                MoveProgress::Moving { near }
            }
            Answer::Profile { .. } => MoveProgress::Done,
            _ => self.progress,
        }
    }
}
