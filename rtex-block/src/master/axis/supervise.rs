//! State changes that an axis makes by itself.

use super::Axis;
use crate::error::Error;
use crate::header::MacId;
use crate::master::profile_move::MoveStage;
use crate::master::state::{AxisState, StopReason};
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;
use crate::status::StatusFlags;

impl Axis {
    /// Checks for silence, refusals and alarms, and checks readiness, activity and the limit of the state. An alarm counts
    /// in any block of the drive, everything else only in one that is on time.
    pub(super) fn supervise(&mut self, response: Option<&Response>, on_time: Option<&Response>) {
        if self.watch.is_tripped() {
            self.fail(self.silence());
        }
        if let Some(response) = on_time {
            self.count_refusals(response);
            self.follow(response.status);
        } else if response.is_some_and(|response| response.status.contains(StatusFlags::ALARM))
            && !matches!(self.state, AxisState::Starting)
        {
            self.fail(StopReason::Alarm);
        }
        self.wait(on_time);
    }

    /// Whether blocks have stopped coming on time, in any state.
    pub(in crate::master) const fn is_silent(&self) -> bool {
        self.watch.is_tripped()
    }

    /// Whether the communication with the drive has failed, even if the axis was stopped for another reason before.
    pub(in crate::master) const fn has_lost_its_drive(&self) -> bool {
        self.is_silent() || matches!(self.state(), AxisState::Stopped(reason) if reason.is_communication())
    }

    /// Returns why no block comes on time.
    fn silence(&self) -> StopReason {
        match self.last_refusal {
            Some(Error::MacId { got, .. }) => StopReason::WrongMacId(MacId::truncate(got)),
            Some(error) => StopReason::Refused(error.class()),
            None => StopReason::EchoTimeout,
        }
    }

    /// Counts CMD_Error, except for the refusal of a request or of the start of a motion.
    fn count_refusals(&mut self, response: &Response) {
        if !response.cmd_error {
            self.refused = 0;
            return;
        }
        let NonCyclicResponse::CommandError(code) = response.noncyclic() else { return };
        let starts = self.profile.is_some_and(|profile| profile.stage() == MoveStage::Starting);
        let asked = self.main.slot.asking().is_some() || starts || !self.main.quiet.is_kept();
        if response.code.noncyclic_bits() == 0 || !asked || code.discards_block() {
            self.refused = self.refused.saturating_add(1);
            if self.refused >= self.config.limits.command_errors.get() {
                self.fail(StopReason::CommandError(code));
            }
        }
    }

    /// Checks alarm, readiness and activity according to the state.
    fn follow(&mut self, status: StatusFlags) {
        let [alarm, ready, active] =
            [StatusFlags::ALARM, StatusFlags::SERVO_READY, StatusFlags::SERVO_ACTIVE].map(|flag| status.contains(flag));
        match self.state {
            AxisState::Starting if ready && !active && !alarm => self.enter(AxisState::Off, 0),
            AxisState::Starting | AxisState::Stopped(_) => {}
            _ if alarm => self.fail(StopReason::Alarm),
            AxisState::Off if !ready => self.enter(AxisState::Starting, self.config.limits.ready.unwrap_or(0)),
            AxisState::SwitchingOff if !active => self.enter(AxisState::Off, 0),
            _ if self.state.is_servo_on() && !ready => self.fail(StopReason::NotReady),
            AxisState::SwitchingOn if active => self.enter(AxisState::On, 0),
            _ if self.is_energised() && !active => self.fail(StopReason::NotActive),
            _ => {}
        }
        if self.state.is_servo_on() {
            return;
        }
        if !active {
            self.active_off = 0;
            self.passive = self.passive.saturating_add(1);
            return;
        }
        self.passive = 0;
        self.active_off = self.active_off.saturating_add(1);
        if self.active_off > self.config.limits.inactive {
            self.disobeys = true;
            self.fail(StopReason::InactiveTimeout);
        }
    }

    /// Checks the limit of the present state.
    fn wait(&mut self, on_time: Option<&Response>) {
        let reason = match self.state {
            AxisState::Starting if self.config.limits.ready.is_none() => return,
            AxisState::Starting => {
                let status = on_time.map_or(self.status(), |response| response.status);
                if status.contains(StatusFlags::ALARM) { StopReason::Alarm } else { StopReason::ReadyTimeout }
            }
            AxisState::SwitchingOn => StopReason::ActiveTimeout,
            AxisState::SwitchingOff => StopReason::InactiveTimeout,
            AxisState::Stopping(reason) => reason,
            AxisState::Off | AxisState::On | AxisState::Held(_) | AxisState::Stopped(_) => return,
        };
        match self.left.checked_sub(1) {
            Some(left) => self.left = left,
            None => self.fail(reason),
        }
    }
}
